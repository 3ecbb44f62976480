//! Stochastic path classes, one batch of emissions at a time.

use std::ops::{ControlFlow, Range};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use sonel_geometry::{PlaneId, Shoebox};
use sonel_map::{
    Along, Arrival, BandValues, Event, Lanes, PathView, PathWeight, Segment, SegmentHistory, lanes_of,
};
use sonel_sampling::{Purpose, Stream, StreamFamily};

use super::{Preparation, Progress, Renderer};
use crate::Estimator;
use crate::deposit::Deposits;
use crate::exact::mirror::{Radiator, lattice_room};
use crate::path_class::PathClass;
use crate::receiver::PreparedReceiver;
use crate::regions::Fading;
use crate::rendering::Rendering;
use crate::stochastic::connection::{DiffuseSonel, connect, normal_on};
use crate::stochastic::crossing::{AssignedClasses, WayPiece, cross, is_left_to_sphere};
use crate::stochastic::estimate::{Arriving, BatchEstimate, ReceiverTile};
use crate::stochastic::gather::disc::place;
use crate::stochastic::gather::near::NearSource;
use crate::stochastic::gather::rays::{GatherHit, GatherPoint, Observer};
use crate::stochastic::gather::{GatherIndex, cast};
use crate::stochastic::kernel::coarse_bins;
use crate::stochastic::medium::Medium;
use crate::stochastic::mirror_connection::ReceiverImages;
use crate::stochastic::selection::{Selector, SonelSelection};

/// Batches rendered before they are added: bounds the memory, whatever the number of threads.
pub const BATCHES_IN_FLIGHT: u32 = 8;

/// Receivers that share a sweep, with their images.
pub(crate) struct ReceiverGroup<'a> {
    /// The receivers.
    pub tile: &'a ReceiverTile<'a>,
    images: Vec<Option<ReceiverImages>>,
    others: AssignedClasses,
    /// For places next to receivers; none where no receiver has such places.
    source: Option<NearSource<'a>>,
    /// Sonels that are connected to the receivers.
    selection: Option<&'a SonelSelection>,
}

/// Buffers and random numbers of one batch.
struct Scratch {
    choices: Vec<Stream>,
    selector: Selector,
    /// Of the selected sonels those that are connected, by receiver.
    connected: Vec<Selector>,
    /// Energy of a selected sonel, with those that it stands for.
    selected: Vec<Lanes>,
    /// The discs of the batch's rays, where any are cast.
    index: Option<GatherIndex<GatherPoint>>,
    radiosity: Vec<Lanes>,
    energy: Vec<Lanes>,
    /// Discs that a sonel lies in, and what each would bring.
    discs: Vec<(u32, f64)>,
    brought: Vec<Lanes>,
    /// The level at which all reflections of the path have been so far, [`Levels`](crate::exact::level::Levels).
    level: Along<Option<PlaneId>>,
    /// Cost of the mirrors since the last diffuse reflection, or since the source.
    run: Along<u32>,
}

impl Renderer<'_> {
    /// The receivers `range` of those with `borders`.
    pub(crate) fn tile<'b>(
        &self,
        source: usize,
        receivers: &'b [PreparedReceiver],
        borders: &'b [Vec<f64>],
        range: Range<usize>,
    ) -> ReceiverTile<'b> {
        let (receivers, borders) = (&receivers[range.clone()], &borders[range.clone()]);
        let direct_length = |receiver| self.straight_length(source, receiver);
        ReceiverTile {
            first: range.start,
            receivers,
            borders,
            direct_lengths: receivers.iter().map(direct_length).collect(),
            coarse_bins: borders.iter().map(|borders| coarse_bins(borders, &self.prepared.bins)).collect(),
        }
    }

    /// Adds `batches` of `source` at the receivers of `tile` to `rendering`, their echograms to `total`.
    pub(crate) fn add_batches(
        &self,
        rendering: &mut Rendering,
        total: &mut Deposits,
        source: usize,
        tile: &ReceiverTile<'_>,
        batches: Range<u32>,
        progress: Progress<'_>,
    ) -> ControlFlow<()> {
        let group = self.group(source, tile);
        let fill = |batch, estimate: &mut BatchEstimate<'_>| self.estimate(batch, source, &group, estimate);
        self.add_estimates(rendering, total, tile, batches, fill, progress)
    }

    /// Adds what `fill` finds in each of `batches` at the receivers of `tile` to `rendering`, its echograms to `total`: on all cores, in the
    /// order of the batches. Every core reports its batches itself, so that work that `progress` breaks off ends with the batch that it is at.
    pub(crate) fn add_estimates(
        &self,
        rendering: &mut Rendering,
        total: &mut Deposits,
        tile: &ReceiverTile<'_>,
        batches: Range<u32>,
        fill: impl Fn(u32, &mut BatchEstimate<'_>) + Sync,
        progress: Progress<'_>,
    ) -> ControlFlow<()> {
        let count = batches.len() as u32;
        let mut estimates: Vec<BatchEstimate<'_>> = (0..count.min(BATCHES_IN_FLIGHT))
            .map(|_| BatchEstimate::new(tile, self.prepared.bins.count, self.prepared.table.bands()))
            .collect();
        let done = Mutex::new((0, progress));
        for first in batches.clone().step_by(BATCHES_IN_FLIGHT as usize) {
            let group = &mut estimates[..(batches.end - first).min(BATCHES_IN_FLIGHT) as usize];
            group.par_iter_mut().zip(first..batches.end).try_for_each(|(estimate, batch)| {
                estimate.clear();
                fill(batch, estimate);
                let (done, progress) = &mut *done.lock().unwrap_or_else(PoisonError::into_inner);
                *done += 1;
                progress(f64::from(*done) / f64::from(count))
            })?;
            for (batch, estimate) in (first as usize..).zip(group) {
                let weight = self.prepared.emissions.batches[batch].weight;
                estimate.add_to(rendering, total, (batch, weight), &self.prepared.bins);
            }
        }
        ControlFlow::Continue(())
    }

    /// Prepares the images of the receivers of `tile`.
    fn group<'b>(&'b self, source: usize, tile: &'b ReceiverTile<'b>) -> ReceiverGroup<'b> {
        let receivers = tile.receivers;
        let Preparation { table, chains, settings, gather, .. } = &*self.prepared;
        let lattice = lattice_room(self.geometry, table);
        let images = |room: &Shoebox, receiver: &PreparedReceiver| {
            ReceiverImages::new(self.geometry, (room, chains), table, receiver)
        };
        let is_auto = settings.estimator == Estimator::Auto && !self.gathers_by_mirrors();
        let room = lattice.as_ref().filter(|_| is_auto);
        let others = AssignedClasses {
            mirror_limit: self.image_sources(source).limit(),
            specular_rays: self.casts_specular_rays(),
            image_limit: match self.gathers_by_mirrors() {
                true => u32::MAX,
                false if room.is_some() => chains.limit,
                false => 0,
            },
            diffuse: self.connects_diffuse(),
        };
        let radiator = Radiator::new(&self.map.header().scene.sources[source], self.geometry.center());
        let near_source = || {
            let room = lattice.as_ref().filter(|_| radiator.directivity.is_omni());
            let at = PreparedReceiver::point(radiator.position);
            NearSource { radiator, images: room.and_then(|room| images(room, &at)) }
        };
        let is_near = gather.is_some() && receivers.iter().any(PreparedReceiver::is_near_surface);
        ReceiverGroup {
            tile,
            images: match room {
                Some(room) => receivers.par_iter().map(|receiver| images(room, receiver)).collect(),
                None => Vec::new(),
            },
            others,
            source: is_near.then(near_source),
            selection: self.survey(source).selection.as_ref(),
        }
    }

    /// The discs of all visibility rays of one batch. Direct sound that rays find next to receivers is added to `estimate`.
    fn gather_index(
        &self,
        group: &ReceiverGroup<'_>,
        source: usize,
        batch: u32,
        scratch: &mut [Lanes],
        estimate: &mut BatchEstimate<'_>,
    ) -> Option<GatherIndex<GatherPoint>> {
        let (sheets, settings) = self.prepared.gather.as_ref()?;
        let medium = self.medium();
        let mut points = Vec::new();
        for (number, receiver) in group.tile.receivers.iter().enumerate() {
            if !settings.by_mirrors && !receiver.is_near_surface() {
                continue;
            }
            let mut stream = receiver_stream(self.seed(), Purpose::VisibilityRay, receiver, source, batch);
            let sample = &self.survey(source).sample;
            let observer = Observer { number: number as u32, receiver, sample };
            cast(&medium, sheets, observer, settings, &mut stream, |found| match found {
                GatherHit::Disc(point) => points.push(point),
                GatherHit::Near(place) => {
                    let Some(source) = &group.source else { return };
                    let mut deposit = estimate.of(last_class(place.ray.is_seen_directly()), &medium);
                    source.connect(&place, number, receiver, scratch, &mut deposit);
                }
            });
        }
        (!points.is_empty()).then(|| GatherIndex::new(points))
    }

    /// Adds what the selected sonel at the end of `segment` leaves in the discs around it.
    fn gather(
        &self,
        segment: &Segment<'_>,
        arrival: Arrival,
        group: &ReceiverGroup<'_>,
        scratch: &mut Scratch,
        estimate: &mut BatchEstimate<'_>,
    ) {
        let Scratch { index, discs, brought, selected, run, .. } = scratch;
        let Some(((sheets, _), index)) = self.prepared.gather.as_ref().zip(index.as_ref()) else { return };
        let medium = self.medium();
        let at = sheets[arrival.surface.0 as usize].flat(segment.end.as_dvec3());
        // Discs weigh with the diffuse mean; what this sonel's angle reflects more or less of it is its own.
        let reflected =
            self.prepared.table.relative_reflection(arrival.surface, segment.direction()).map(|more| {
                selected.iter().zip(more).map(|(&energy, more)| energy * more).collect::<Vec<Lanes>>()
            });
        let arriving = reflected.as_deref().unwrap_or(selected);
        // Rays that go on from a surface next to the receiver find it where it came from.
        let SegmentHistory { diffused, interfaces, .. } = segment.history;
        let limit = self.prepared.chains.limit;
        let is_found = |source: &NearSource<'_>| source.finds(segment.history, run.now, limit);
        let is_followed = diffused && interfaces == 0 || group.source.as_ref().is_some_and(is_found);
        index.around(place(arrival.surface, arrival.side), at, discs);
        brought.clear();
        for (number, _) in discs.iter() {
            let weighed = arriving.iter().zip(&index.point(*number).weight);
            brought.extend(weighed.map(|(&energy, &weight)| energy * weight));
        }
        for (&(number, gain), brought) in discs.iter().zip(brought.chunks_exact_mut(arriving.len())) {
            let point = index.point(number);
            let receiver = point.receiver as usize;
            if point.is_followed && is_followed {
                continue;
            }
            let class = last_class(point.seen_directly);
            let prepared = &group.tile.receivers[receiver];
            // By way of the sonel, not of the disc's middle: never shorter than the straight way.
            let leg = segment.end.as_dvec3().distance(point.start);
            let length = ((point.length + leg) * prepared.stretch).max(0.0);
            let Some(bin) = self.prepared.bins.bin(segment.end_length + length) else { continue };
            medium.receive(prepared, length, brought);
            let arriving = Arriving { receiver, towards: point.towards.as_dvec3(), length, bin };
            estimate.of(class, &medium).add_from_kernel(arriving, brought, gain);
        }
    }

    /// Medium between sonels and receivers.
    pub(crate) fn medium(&self) -> Medium<'_> {
        Medium {
            geometry: self.geometry,
            table: &self.prepared.table,
            chains: &self.prepared.chains,
            bins: &self.prepared.bins,
            air: &self.prepared.carried_air,
            airs: &self.prepared.airs,
        }
    }

    /// Fills `estimate`, which is empty, with what one batch says.
    fn estimate(
        &self,
        batch: u32,
        source: usize,
        group: &ReceiverGroup<'_>,
        estimate: &mut BatchEstimate<'_>,
    ) {
        if let Some(paper) = &self.prepared.paper {
            return self.estimate_as_paper(paper, batch, source, group, estimate);
        }
        let bands = self.prepared.table.bands();
        let zeros = vec![Lanes::ZERO; lanes_of(bands)];
        let choices = |r| receiver_stream(self.seed(), Purpose::MirrorChoice, r, source, batch);
        let selections = StreamFamily::new(self.seed(), Purpose::SonelChoice, [source as u32, 0, 0, 0]);
        let mut scratch = Scratch {
            choices: group.tile.receivers.iter().map(choices).collect(),
            selector: Selector::new(0.0),
            connected: vec![Selector::new(0.0); group.tile.receivers.len()],
            selected: zeros.clone(),
            index: None,
            radiosity: zeros.clone(),
            energy: zeros,
            discs: Vec::new(),
            brought: Vec::new(),
            level: Along::new(None),
            run: Along::new(0),
        };
        scratch.index = self.gather_index(group, source, batch, &mut scratch.energy, estimate);
        let mut weight = PathWeight::of(&self.prepared.table);
        for path in self.map.batch_paths(source as u32, batch) {
            let mut offsets = selections.stream(path.emission);
            scratch.selector = Selector::new(offsets.uniform_fine());
            scratch.connected.fill(Selector::new(offsets.uniform_fine()));
            scratch.run.now = 0;
            self.follow_path(path, source, 1.0, &mut weight, |segment, arriving| {
                self.add_segment(segment, arriving, group, &mut scratch, estimate);
            });
        }
    }

    /// Visits every segment of a path of `source`, with energies in units of `unit` ([`PathWeight::emit`]), and apart with its energy
    /// where it ends: another one in scenes of several airs.
    pub(crate) fn follow_path(
        &self,
        path: PathView<'_>,
        source: usize,
        unit: f64,
        weight: &mut PathWeight,
        mut visit: impl FnMut(&Segment<'_>, &[Lanes]),
    ) {
        let (source, table) = (source as u32, &self.prepared.table);
        if !self.prepared.airs.are_several() {
            let visit = |segment: &Segment<'_>| visit(segment, segment.energy);
            return self.prepared.emissions.follow(source, path, unit, table, weight, visit);
        }
        let mut fading =
            Fading::new(&self.prepared.airs, lanes_of(self.prepared.table.bands()), self.prepared.bins.reach);
        let visit = |segment: &Segment<'_>| fading.visit(segment, &mut visit);
        self.prepared.emissions.follow(source, path, unit, table, weight, visit);
    }

    /// Adds what `segment`, with energy `arriving` at its end, brings to the receivers.
    #[inline]
    fn add_segment(
        &self,
        segment: &Segment<'_>,
        arriving: &[Lanes],
        group: &ReceiverGroup<'_>,
        scratch: &mut Scratch,
        estimate: &mut BatchEstimate<'_>,
    ) {
        let medium = self.medium();
        scratch.level.enter(segment);
        scratch.run.enter(segment);
        estimate.record_segment(segment, &medium, &mut scratch.energy);
        let is_exact = scratch.level.now.is_some() && segment.history.image_order().is_some();
        if !is_exact && is_left_to_sphere(segment.history, scratch.run.now, group.others) {
            let ReceiverTile { receivers, direct_lengths, .. } = group.tile;
            let piece = WayPiece::of(segment);
            estimate.crossings.pass(piece.beam, segment.energy);
            let receivers = receivers.iter().zip(direct_lengths).enumerate();
            let receivers = receivers.map(|(index, (receiver, &length))| (index, receiver, length));
            let mut deposit = estimate.of(sphere_class(segment.history), &medium);
            cross(&piece, receivers, &mut scratch.energy, &mut deposit);
        }
        if let Some(arrival) = segment.arrival {
            self.add_sonel(segment, arrival, arriving, group, scratch, estimate);
            self.pass(segment, arrival, scratch);
        }
    }

    /// Notes in `scratch` what becomes of the path at `arrival`.
    #[inline]
    fn pass(&self, segment: &Segment<'_>, arrival: Arrival, scratch: &mut Scratch) {
        let run = &mut scratch.run.now;
        match arrival.event {
            Event::Specular => *run = self.prepared.chains.after(*run, arrival.surface),
            Event::Diffuse => *run = 0,
            _ => {}
        }
        if let Some(levels) = self.prepared.levels.as_ref().filter(|_| arrival.event == Event::Specular) {
            let level = levels.of(arrival.surface);
            let is_first = segment.history.order == 0;
            scratch.level.now = level.filter(|_| is_first || level == scratch.level.now);
        }
    }

    /// Adds what the sonel at the end of `segment`, with energy `arriving`, brings to the receivers.
    #[inline]
    fn add_sonel(
        &self,
        segment: &Segment<'_>,
        arrival: Arrival,
        arriving: &[Lanes],
        group: &ReceiverGroup<'_>,
        scratch: &mut Scratch,
        estimate: &mut BatchEstimate<'_>,
    ) {
        let medium = self.medium();
        let row = &*self.prepared.table.row(arrival.surface, segment.direction());
        let Some(selection) = group.selection.filter(|_| !row.is_mirror) else { return };
        let brightness = selection.brightness(segment.end_length, segment.end, arriving);
        if segment.end_length > self.prepared.bins.reach || !scratch.selector.takes(brightness.min(1.0)) {
            return;
        }
        scratch.selected.set_times(arriving, brightness.recip().max(1.0));
        medium.air.attenuate(segment.end_length, &mut scratch.selected);
        self.gather(segment, arrival, group, scratch, estimate);
        scratch.radiosity.set_product(&scratch.selected, &row.diffuse.energy, core::f64::consts::FRAC_1_PI);
        let sonel = DiffuseSonel {
            position: segment.end,
            normal: normal_on(arrival.side, self.prepared.normals[arrival.surface.0 as usize]),
            departure: self.geometry.leave(segment.end, arrival.surface, arrival.side),
            length: segment.end_length,
            brightness: brightness.max(1.0),
            radiosity: &scratch.radiosity,
        };
        let diffuse = &mut estimate.of(PathClass::Diffuse, &medium);
        connect(&sonel, group.tile.receivers, &mut scratch.connected, &mut scratch.energy, diffuse);
        let mirrored = &mut estimate.of(PathClass::DiffuseMirror, &medium);
        for (index, images) in group.images.iter().enumerate() {
            if let Some(images) = images {
                let choice = scratch.choices[index].uniform_fine();
                images.connect(&sonel, (index, None), choice, &mut scratch.energy, mirrored);
            }
        }
    }
}

/// The class of what rays find, by whether they see the last diffuse reflection without a mirror.
fn last_class(seen_directly: bool) -> PathClass {
    if seen_directly { PathClass::Diffuse } else { PathClass::DiffuseMirror }
}

/// The class of a segment that crosses a sphere.
fn sphere_class(history: SegmentHistory) -> PathClass {
    match (history.image_order(), history.interfaces, history.specular_run) {
        (Some(_), ..) => PathClass::LateSpecular,
        (None, 0, 0) => PathClass::Diffuse,
        (None, 0, _) => PathClass::LongDiffuseMirror,
        _ => PathClass::Refracted,
    }
}

/// The random numbers of one receiver in one batch: a function of its place, not of who shares the call.
pub(crate) fn receiver_stream(
    seed: u64,
    purpose: Purpose,
    receiver: &PreparedReceiver,
    source: usize,
    batch: u32,
) -> Stream {
    let [x, y, z] = receiver.exact.to_array().map(|coordinate| {
        let bits = coordinate.to_bits();
        (bits >> 32) as u32 ^ bits as u32
    });
    StreamFamily::new(seed, purpose, [x, y, z, source as u32]).stream(u64::from(batch))
}
