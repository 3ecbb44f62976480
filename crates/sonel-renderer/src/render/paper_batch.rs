//! One batch of the paper's pass: rays are cast, their discs indexed, the sonels stream past.

use glam::DVec3;
use sonel_map::{BandValues, Lanes, PathWeight, Segment, lanes_of};
use sonel_sampling::{Purpose, ScrambledSobol};

use super::Renderer;
use super::batch::{ReceiverGroup, receiver_stream};
use crate::exact::direct::{direct_way, spread};
use crate::exact::mirror::Radiator;
use crate::path_class::PathClass;
use crate::stochastic::estimate::{Arriving, BatchEstimate};
use crate::stochastic::gather::GatherIndex;
use crate::stochastic::gather::disc::place;
use crate::stochastic::gather::rays::GatherPoint;
use sonel_geometry::{Departure, Geometry};

use crate::paper::Paper;
use crate::paper::rays::{Looking, Sight, only};
use crate::paper::zone::{FirstZone, place_on};

/// Points of a zone in one batch: with 32 batches v₁ is known to half a hundredth.
const ZONE_POINTS: u32 = 64;

impl Renderer<'_> {
    /// Fills `estimate`, which is empty, with what one batch says by the paper's means.
    pub(crate) fn estimate_as_paper(
        &self,
        paper: &Paper,
        batch: u32,
        source: usize,
        group: &ReceiverGroup<'_>,
        estimate: &mut BatchEstimate<'_>,
    ) {
        let radiator = Radiator::new(&self.map.header().scene.sources[source], self.geometry.center());
        let index = self.look(paper, batch, source, radiator, group, estimate);
        self.look_over_edges(paper, batch, source, radiator, group, estimate);
        let mut scratch = vec![Lanes::ZERO; lanes_of(self.prepared.table.bands())];
        let mut weight = PathWeight::of(&self.prepared.table);
        for path in self.map.batch_paths(source as u32, batch) {
            self.follow_path(path, source, 1.0, &mut weight, |segment, _| {
                estimate.record_segment(segment, &self.medium(), &mut scratch);
                self.count(paper, segment, &index, &mut scratch, estimate);
            });
        }
    }

    /// Casts all visibility rays of a batch: adds what they see of the source, returns their discs.
    fn look(
        &self,
        paper: &Paper,
        batch: u32,
        source: usize,
        radiator: Radiator<'_>,
        group: &ReceiverGroup<'_>,
        estimate: &mut BatchEstimate<'_>,
    ) -> GatherIndex<GatherPoint> {
        let (columns, medium) = (self.prepared.table.bands(), self.medium());
        let mut points = Vec::new();
        for (number, receiver) in group.tile.receivers.iter().enumerate() {
            let mut stream = receiver_stream(self.seed(), Purpose::VisibilityRay, receiver, source, batch);
            for column in 0..columns {
                let looking = Looking {
                    geometry: self.geometry,
                    table: &self.prepared.table,
                    column,
                    radiator,
                    source_radius: paper.source_radius[source],
                    reach: self.prepared.bins.reach,
                };
                paper.cast(&looking, (number as u32, receiver), &mut stream, |sight| match sight {
                    Sight::Disc(point) => points.push(point),
                    Sight::Source(sight) => {
                        let length = sight.length;
                        let Some(bin) = self.prepared.bins.bin(length) else { return };
                        let mut energy = only(column, columns, sight.fluence);
                        let gain = if sight.in_half { 2.0 } else { 0.0 };
                        let towards = sight.towards.as_dvec3();
                        let arriving = Arriving { receiver: number, towards, length, bin };
                        let mut deposit = estimate.of(PathClass::LateSpecular, &medium);
                        deposit.add_from_kernel(arriving, &mut energy, gain);
                    }
                });
            }
        }
        GatherIndex::new(points)
    }

    /// Adds what edges bring to every receiver that the source's shadow ray does not reach.
    fn look_over_edges(
        &self,
        paper: &Paper,
        batch: u32,
        source: usize,
        radiator: Radiator<'_>,
        group: &ReceiverGroup<'_>,
        estimate: &mut BatchEstimate<'_>,
    ) {
        for (number, receiver) in group.tile.receivers.iter().enumerate() {
            if paper.edges.is_empty()
                || direct_way(self.geometry, &self.prepared.table, radiator.position, receiver.exact)
                    .is_some()
            {
                continue;
            }
            let offset = receiver.exact - radiator.position;
            let length = offset.length();
            let Some(bin) = self.prepared.bins.bin(length) else { continue };
            let mut stream = receiver_stream(self.seed(), Purpose::ZonePoint, receiver, source, batch);
            let mut unobstructed = vec![Lanes::ONE; lanes_of(self.prepared.table.bands())];
            radiator.towards(offset).weigh(&mut unobstructed);
            for edge in &paper.edges {
                let sequence = ScrambledSobol::from_keys([stream.bits(), stream.bits()]);
                let ends = [radiator.position, receiver.exact];
                let Some(place) = place_on(edge, self.geometry, ends) else { continue };
                let mut energy = visibilities(self.geometry, place, ends, &paper.wavelengths, &sequence);
                let towards = place - receiver.exact;
                let rendered = spread(length) * receiver.sensitivity.to(towards);
                for (energy, &unobstructed) in energy.iter_mut().zip(&unobstructed) {
                    *energy *= unobstructed * rendered;
                }
                let arriving = Arriving { receiver: number, towards, length, bin };
                estimate.of(PathClass::Edge, &self.medium()).add(arriving, &mut energy);
            }
        }
    }

    /// Counts a sonel in the discs around it, in every band that it carries.
    fn count(
        &self,
        paper: &Paper,
        segment: &Segment<'_>,
        index: &GatherIndex<GatherPoint>,
        scratch: &mut [Lanes],
        estimate: &mut BatchEstimate<'_>,
    ) {
        let Some(arrival) = segment.arrival else { return };
        let (columns, medium) = (self.prepared.table.bands(), self.medium());
        let at = paper.sheets[arrival.surface.0 as usize].flat(segment.end.as_dvec3());
        let first = place(arrival.surface, arrival.side) * columns as u32;
        let mut discs = Vec::new();
        for column in (0..columns).filter(|&column| segment.energy.band(column) > 0.0) {
            index.around(first + column as u32, at, &mut discs);
            for &(number, gain) in &discs {
                let point = index.point(number);
                let receiver = point.receiver as usize;
                let class = if point.seen_directly { PathClass::Diffuse } else { PathClass::DiffuseMirror };
                let length = segment.end_length + point.length;
                let Some(bin) = self.prepared.bins.bin(length) else { continue };
                scratch.set_product(segment.energy, &point.weight, 1.0);
                let arriving = Arriving { receiver, towards: point.towards.as_dvec3(), length, bin };
                estimate.of(class, &medium).add_from_kernel(arriving, scratch, gain);
            }
        }
    }
}

/// v₁ of an edge in every band, over whose `place` the way is shortest.
fn visibilities(
    geometry: &Geometry,
    place: DVec3,
    [source, receiver]: [DVec3; 2],
    wavelengths: &[f64],
    sequence: &ScrambledSobol,
) -> Vec<Lanes> {
    let mut shares = vec![Lanes::ZERO; lanes_of(wavelengths.len())];
    let sees = |from: DVec3, to: DVec3| !geometry.is_blocked(Departure::free(from.as_vec3()), to.as_vec3());
    for (band, &wavelength) in wavelengths.iter().enumerate() {
        if let Some(zone) = FirstZone::new(source, receiver, place, wavelength) {
            let seen = |point| sees(source, point) && sees(receiver, point);
            *shares.band_mut(band) = zone.visibility(sequence, ZONE_POINTS, seen);
        }
    }
    shares
}
