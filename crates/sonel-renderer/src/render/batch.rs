//! Stochastic path classes, one batch of emissions at a time.

use std::ops::Range;

use rayon::prelude::*;
use sonel_map::{
    Arrival, EmissionDirections, Lanes, PathView, PathWeight, Segment, SegmentHistory, lanes_of, sweep,
};
use sonel_sampling::{Purpose, Stream, StreamFamily};

use super::Renderer;
use crate::deposit::{Deposits, TimeBins, add_lanes};
use crate::directions::{Axes, Columns};
use crate::exact::mirror::Radiator;
use crate::path_class::PathClass;
use crate::receiver::{PreparedReceiver, axes};
use crate::regions::Fading;
use crate::rendering::{CoarseEchogram, Rendering};
use crate::stochastic::connection::{ClassDeposits, DiffuseSonel, Thinning, connect, normal_on, radiosity};
use crate::stochastic::crossing::{OthersOwn, Piece, cross, owns};
use crate::stochastic::gather::disc::place;
use crate::stochastic::gather::near::NearSource;
use crate::stochastic::gather::rays::{Found, GatherPoint, Observer, Sonels};
use crate::stochastic::gather::{GatherIndex, cast};
use crate::stochastic::kernel::{KernelDifference, coarse_bins};
use crate::stochastic::medium::Medium;
use crate::stochastic::mirror_connection::ReceiverImages;

/// Batches rendered before they are added: bounds the memory, whatever the number of threads.
pub(crate) const BATCHES_IN_FLIGHT: u32 = 8;

/// One batch's estimate: all its echograms, and the sums of its classes per receiver.
pub(crate) struct BatchEstimate {
    deposits: Deposits,
    sums: [Vec<Lanes>; PathClass::ALL.len()],
    kernel: KernelDifference,
    axes: Axes,
    /// What packets carry at [`TimeBins::marks`](crate::deposit::TimeBins::marks).
    under_way: [Vec<Lanes>; 2],
}

impl BatchEstimate {
    pub fn new(borders: &[Vec<f64>], bins: usize, bands: usize, axes: Axes) -> Self {
        let Columns { fine, coarse } = axes.columns();
        Self {
            deposits: Deposits::new(borders.len() * fine, bins, bands),
            kernel: KernelDifference::new(borders, coarse, bands),
            axes,
            sums: PathClass::ALL.map(|_| vec![[0.0; 4]; borders.len() * lanes_of(bands)]),
            under_way: [(); 2].map(|()| vec![[0.0; 4]; lanes_of(bands)]),
        }
    }

    /// Forgets the batch before. Memory is taken over from batch to batch: fresh pages would cost a tenth of the time.
    pub fn clear(&mut self) {
        self.deposits.clear();
        self.sums.iter_mut().flatten().for_each(|sum| *sum = [0.0; 4]);
        self.kernel.at.iter_mut().for_each(CoarseEchogram::clear);
        self.under_way.iter_mut().flatten().for_each(|sum| *sum = [0.0; 4]);
    }

    /// Counts what `segment` carries at [`TimeBins::marks`](crate::deposit::TimeBins::marks). What escapes brings nothing any more.
    pub fn take_stock(&mut self, segment: &Segment<'_>, medium: &Medium<'_>, scratch: &mut [Lanes]) {
        for (sum, mark) in self.under_way.iter_mut().zip(medium.bins.marks()) {
            if segment.escapes || mark < segment.start_length || mark >= segment.end_length {
                continue;
            }
            scratch.copy_from_slice(segment.energy);
            if let Some(regions) = medium.regions {
                regions.fade(segment.air, mark - segment.start_length, scratch);
            }
            if let Some(air) = medium.air {
                air.attenuate(mark, scratch);
            }
            add_lanes(sum, scratch);
        }
    }

    /// Adds the estimate of `batch` of `weight` at the receivers `tile`, whose direct sound arrives at `first_arrivals` [s], to `rendering`.
    pub fn add_to(
        &self,
        rendering: &mut Rendering,
        (batch, weight): (usize, f64),
        tile: Range<usize>,
        bins: &TimeBins,
        borders: &[Vec<f64>],
        first_arrivals: &[f64],
    ) {
        for (class, sums) in PathClass::ALL.into_iter().zip(&self.sums) {
            for (receiver, sum) in tile.clone().zip(sums.chunks_exact(sums.len() / tile.len())) {
                rendering.book(class, receiver, weight, sum);
            }
        }
        if tile.start == 0 {
            rendering.book_under_way(weight, &self.under_way);
        }
        let columns = self.axes.columns();
        rendering.total.add_receivers(tile.start * columns.fine, &self.deposits, weight);
        for (local, column) in (0..tile.len()).flat_map(|local| (0..columns.coarse).map(move |c| (local, c)))
        {
            let index = (tile.start + local) * columns.coarse + column;
            rendering.kernel_differences[batch][index].add(&self.kernel.at[local * columns.coarse + column]);
            let coarse: &mut CoarseEchogram = &mut rendering.batches[batch][index];
            let fine = local * columns.fine + column;
            coarse.add_fine(&borders[local], &self.deposits, fine, bins, first_arrivals[local]);
        }
    }

    /// Where the estimator of `class` leaves its energy.
    pub fn class(&mut self, class: PathClass) -> ClassDeposits<'_> {
        ClassDeposits {
            deposits: &mut self.deposits,
            sum: &mut self.sums[class as usize],
            kernel: &mut self.kernel,
            axes: &self.axes,
        }
    }
}

/// Receivers that share a sweep, with their images.
pub(crate) struct Audience<'a> {
    /// The receivers.
    pub receivers: &'a [PreparedReceiver],
    images: Vec<Option<ReceiverImages>>,
    others: Vec<OthersOwn>,
    /// For places next to receivers; none where no receiver has such places, or where edges bend what goes there.
    source: Option<NearSource<'a>>,
    /// By receiver and fine bin.
    coarse_bins: Vec<Vec<u32>>,
}

impl Audience<'_> {
    /// The coarse bin of a receiver's fine bin.
    #[inline]
    pub fn coarse_bin(&self, receiver: usize, bin: usize) -> u32 {
        self.coarse_bins[receiver][bin]
    }
}

/// Buffers and random numbers of one batch.
struct Scratch {
    choices: Vec<Stream>,
    turns: Vec<Thinning>,
    radiosity: Vec<Lanes>,
    energy: Vec<Lanes>,
    /// Discs that a sonel lies in, and what each would bring.
    discs: Vec<(u32, f64)>,
    brought: Vec<Lanes>,
}

impl Renderer<'_> {
    /// Adds all batches of `source` at the receivers `tile` to `rendering`.
    pub(crate) fn add_batches(
        &self,
        rendering: &mut Rendering,
        source: usize,
        receivers: &[PreparedReceiver],
        borders: &[Vec<f64>],
        tile: Range<usize>,
        progress: &mut dyn FnMut(f64),
    ) {
        let radiator = Radiator::new(&self.map.header().scene.sources[source], self.geometry.center());
        let traced = &self.map.header().settings;
        let directions =
            EmissionDirections::new(traced.seed, source as u32, self.map.layout(), traced.spectral);
        let count = self.batches.len() as u32;
        let audience =
            self.audience((source, radiator), &receivers[tile.clone()], borders, rendering.mirror_order);
        let first_arrivals: Vec<f64> =
            audience.others.iter().map(|others| self.bins.time(others.direct_length)).collect();
        rendering.image_order.extend(audience.others.iter().map(|others| others.image_order));
        let mut estimates: Vec<BatchEstimate> = (0..count.min(BATCHES_IN_FLIGHT))
            .map(|_| {
                BatchEstimate::new(
                    borders,
                    self.bins.count,
                    self.table.bands(),
                    axes(&receivers[tile.clone()]),
                )
            })
            .collect();
        for first in (0..count).step_by(BATCHES_IN_FLIGHT as usize) {
            let group = &mut estimates[..(count - first).min(BATCHES_IN_FLIGHT) as usize];
            group.par_iter_mut().zip(first..count).for_each(|(estimate, batch)| {
                self.estimate(batch, source, &directions, &audience, estimate);
            });
            for (batch, estimate) in (first as usize..).zip(group) {
                let weighed = (batch, self.batches[batch].weight);
                estimate.add_to(rendering, weighed, tile.clone(), &self.bins, borders, &first_arrivals);
            }
            progress(f64::from(count.min(first + BATCHES_IN_FLIGHT)) / f64::from(count));
        }
    }

    /// Prepares the images of `receivers`. K′ is a matter of each receiver: it depends on nobody who shares the call.
    fn audience<'b>(
        &'b self,
        (source, radiator): (usize, Radiator<'b>),
        receivers: &'b [PreparedReceiver],
        borders: &[Vec<f64>],
        mirror_order: u32,
    ) -> Audience<'b> {
        let images: Vec<Option<ReceiverImages>> = receivers
            .par_iter()
            .map(|receiver| ReceiverImages::new(self.geometry, &self.table, receiver, self.image_order))
            .collect();
        let others = images
            .iter()
            .zip(receivers)
            .map(|(images, receiver)| OthersOwn {
                direct_length: self.straight_length(source, receiver),
                mirror_order,
                long_chains: self.mirrors_long_chains(),
                image_order: self.owned_order(images.as_ref()),
                diffuse: self.connects_diffuse(),
                bent: self.gathers_by_mirrors(),
            })
            .collect();
        let coarse_bins = borders.iter().map(|borders| coarse_bins(borders, &self.bins)).collect();
        let is_near = self.gather.is_some() && receivers.iter().any(PreparedReceiver::is_near_surface);
        let source =
            (is_near && self.bends.is_none()).then(|| NearSource::new(self.geometry, &self.table, radiator));
        Audience { receivers, images, others, source, coarse_bins }
    }

    /// K′ at a receiver with `images`; without limit where rays gather.
    fn owned_order(&self, images: Option<&ReceiverImages>) -> u32 {
        if self.gathers_by_mirrors() { u32::MAX } else { images.map_or(0, ReceiverImages::order) }
    }

    /// The discs of all visibility rays of one batch. Direct sound that rays find next to receivers is added to `estimate`.
    fn gather_index(
        &self,
        audience: &Audience<'_>,
        source: usize,
        batch: u32,
        scratch: &mut [Lanes],
        estimate: &mut BatchEstimate,
    ) -> Option<GatherIndex<GatherPoint>> {
        let (sheets, settings) = self.gather.as_ref()?;
        let medium = self.medium();
        let mut points = Vec::new();
        for (number, receiver) in audience.receivers.iter().enumerate() {
            if !settings.by_mirrors && !receiver.is_near_surface() {
                continue;
            }
            let mut stream = receiver_stream(self.seed(), Purpose::VisibilityRay, receiver, source, batch);
            let image_order = audience.others[number].image_order;
            let observer = Observer { number: number as u32, receiver, image_order };
            cast(&medium, &self.table, sheets, observer, settings, &mut stream, |found| match found {
                Found::Disc(point) => points.push(point),
                Found::Near(place) => {
                    let Some(source) = &audience.source else { return };
                    let mut deposits = estimate.class(last_class(place.seen_directly));
                    source.connect(&place, (number, receiver), &medium, scratch, &mut deposits);
                }
            });
        }
        (!points.is_empty()).then(|| GatherIndex::new(points, settings.radius))
    }

    /// Whether a ray that goes on from a surface next to the receiver finds a sonel with `history` where it came from.
    fn is_followed(&self, history: SegmentHistory, audience: &Audience<'_>) -> bool {
        let by_rays =
            history.diffused && history.interfaces == 0 && (history.bends == 0 || self.gathers_by_mirrors());
        by_rays || audience.source.as_ref().is_some_and(|source| source.finds(history))
    }

    /// Adds what `segment` leaves in the discs around its end.
    fn gather(
        &self,
        (segment, arriving): (&Segment<'_>, &[Lanes]),
        arrival: Arrival,
        index: &GatherIndex<GatherPoint>,
        audience: &Audience<'_>,
        scratch: &mut Scratch,
        estimate: &mut BatchEstimate,
    ) {
        let Some((sheets, _)) = &self.gather else { return };
        let medium = self.medium();
        let at = sheets[arrival.surface.0 as usize].flat(segment.end.as_dvec3());
        // Discs weigh with the diffuse mean; what this sonel's angle reflects more or less of it is its own.
        let reflected = self.table.relative_reflection(arrival.surface, segment.direction()).map(|more| {
            let lanes = arriving.iter().zip(more);
            lanes
                .map(|(energy, more)| std::array::from_fn(|lane| energy[lane] * more[lane]))
                .collect::<Vec<Lanes>>()
        });
        let arriving = reflected.as_deref().unwrap_or(arriving);
        let Scratch { discs, brought, .. } = scratch;
        index.around(place(arrival.surface, arrival.side), at, discs);
        brought.clear();
        for (number, _) in discs.iter() {
            let weighed = arriving.iter().zip(&index.point(*number).weight);
            brought.extend(weighed.map(|(energy, weight)| -> Lanes {
                std::array::from_fn(|lane| energy[lane] * weight[lane])
            }));
        }
        for (&(number, gain), brought) in discs.iter().zip(brought.chunks_exact_mut(arriving.len())) {
            let point = index.point(number);
            let receiver = point.receiver as usize;
            if point.sonels == Sonels::NotFollowed && self.is_followed(segment.history, audience) {
                continue;
            }
            let class = last_class(point.seen_directly);
            // By way of the sonel, not of the disc's middle: never shorter than the straight way.
            let end = segment.end.as_dvec3();
            let middle = sheets[arrival.surface.0 as usize].place(point.disc.centre);
            let leg = end.distance(point.start) - middle.distance(point.start);
            let prepared = &audience.receivers[receiver];
            let [ray, leg] = [point.length, leg].map(|length| length * prepared.stretch);
            let length = segment.end_length + ray + leg;
            let Some(bin) = self.bins.bin(length) else { continue };
            medium.receive(prepared, (ray + leg).max(0.0), brought);
            let bins = (bin, audience.coarse_bin(receiver, bin));
            let arriving = (receiver, point.towards.as_dvec3());
            estimate.class(class).add_from_kernel(arriving, bins, length, brought, gain, &medium);
        }
    }

    /// What lies between sonels and receivers.
    pub(crate) fn medium(&self) -> Medium<'_> {
        Medium {
            geometry: self.geometry,
            table: &self.table,
            bins: &self.bins,
            air: self.carried_air.as_ref(),
            bends: self.bends.as_ref(),
            regions: self.regions.as_ref(),
        }
    }

    /// Fills `estimate` with what one batch says.
    fn estimate(
        &self,
        batch: u32,
        source: usize,
        directions: &EmissionDirections,
        audience: &Audience<'_>,
        estimate: &mut BatchEstimate,
    ) {
        estimate.clear();
        if let Some(paper) = &self.paper {
            return self.estimate_as_paper(paper, (batch, source), directions, audience, estimate);
        }
        let bands = self.table.bands();
        let zeros = vec![[0.0; 4]; lanes_of(bands)];
        let streams = |purpose| -> Vec<Stream> {
            let stream = |r| receiver_stream(self.seed(), purpose, r, source, batch);
            audience.receivers.iter().map(stream).collect()
        };
        let every = self.sonels_per_connection();
        let turns = streams(Purpose::ConnectionChoice);
        let mut scratch = Scratch {
            choices: streams(Purpose::MirrorChoice),
            turns: turns.into_iter().map(|mut stream| Thinning::new(every, stream.bits())).collect(),
            radiosity: zeros.clone(),
            energy: zeros,
            discs: Vec::new(),
            brought: Vec::new(),
        };
        let index = self.gather_index(audience, source, batch, &mut scratch.energy, estimate);
        self.each_segment(batch, source, directions, |segment, arriving| {
            self.hear_segment((segment, arriving), audience, index.as_ref(), &mut scratch, estimate);
        });
    }

    /// Visits every segment of every path of one batch, with its energy where it ends ([`Self::follow_path`]).
    pub(crate) fn each_segment(
        &self,
        batch: u32,
        source: usize,
        directions: &EmissionDirections,
        mut visit: impl FnMut(&Segment<'_>, &[Lanes]),
    ) {
        let mut weight = PathWeight::new(self.table.bands());
        for path in self.map.batch_paths(source as u32, batch) {
            self.follow_path(path, (source, batch), directions, 1.0, &mut weight, &mut visit);
        }
    }

    /// Visits every segment of a path of `source` and `batch`, with energies in units of `unit` ([`PathWeight::emit`]), and apart with its energy
    /// where it ends: another one in scenes of several airs.
    pub(crate) fn follow_path(
        &self,
        path: PathView<'_>,
        (source, batch): (usize, u32),
        directions: &EmissionDirections,
        unit: f64,
        weight: &mut PathWeight,
        mut visit: impl FnMut(&Segment<'_>, &[Lanes]),
    ) {
        let emitter = &self.map.header().scene.sources[source];
        let start = self.batches[batch as usize].packet(self.map.layout().lead(path.emission));
        weight.emit_from(emitter, directions.direction(path.emission), unit, start);
        let scene = &self.map.header().scene;
        let origin = (emitter.position - self.geometry.center(), scene.air_at_source(source));
        let Some(regions) = &self.regions else {
            let visit = |segment: &Segment<'_>| visit(segment, segment.energy);
            return sweep(origin, path.vertices, &self.table, weight, visit);
        };
        let mut fading = Fading::new(regions, lanes_of(self.table.bands()), self.bins.reach);
        let visit = |segment: &Segment<'_>| fading.visit(segment, &mut visit);
        sweep(origin, path.vertices, &self.table, weight, visit);
    }

    #[inline]
    fn hear_segment(
        &self,
        (segment, arriving): (&Segment<'_>, &[Lanes]),
        audience: &Audience<'_>,
        index: Option<&GatherIndex<GatherPoint>>,
        scratch: &mut Scratch,
        estimate: &mut BatchEstimate,
    ) {
        let medium = self.medium();
        estimate.take_stock(segment, &medium, &mut scratch.energy);
        let SegmentHistory { specular_run, bends, interfaces, .. } = segment.history;
        if specular_run > 0 || bends > 0 || interfaces > 0 || !self.connects_diffuse() {
            let receivers = audience.receivers.iter().zip(&audience.others).enumerate();
            let left = receivers.filter(|(_, (_, others))| owns(segment.history, **others));
            let receivers = left.map(|(index, (receiver, others))| (index, receiver, others.direct_length));
            let mut deposits = estimate.class(sphere_class(segment.history));
            let coarse = |receiver, bin| audience.coarse_bin(receiver, bin);
            cross(&Piece::of(segment), receivers, &medium, coarse, &mut scratch.energy, &mut deposits);
        }
        let Some(arrival) = segment.arrival else { return };
        let row = self.table.row(arrival.surface, segment.direction());
        if row.is_mirror || !self.connects_diffuse() {
            return;
        }
        if let Some(index) = index {
            self.gather((segment, arriving), arrival, index, audience, scratch, estimate);
        }
        let times = f64::from(self.sonels_per_connection());
        radiosity(arriving, &row.diffuse, times, &mut scratch.radiosity);
        let sonel = DiffuseSonel {
            position: segment.end,
            normal: normal_on(arrival.side, self.normals[arrival.surface.0 as usize]),
            departure: self.geometry.leave(segment.end, arrival.surface, arrival.side),
            length: segment.end_length,
            radiosity: &scratch.radiosity,
        };
        connect(
            &sonel,
            audience.receivers,
            &mut scratch.turns,
            &medium,
            &mut scratch.energy,
            &mut estimate.class(PathClass::Diffuse),
        );
        for (index, images) in audience.images.iter().enumerate() {
            if let Some(images) = images {
                let choice = scratch.choices[index].uniform_fine();
                images.connect(
                    &sonel,
                    (index, None),
                    &medium,
                    choice,
                    &mut scratch.energy,
                    &mut estimate.class(PathClass::DiffuseMirror),
                );
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
    if history.interfaces > 0 {
        return PathClass::Refracted;
    }
    match (history.diffused, history.specular_run) {
        (false, _) => PathClass::LongMirrorChain,
        (true, 0) => PathClass::Diffuse,
        (true, _) => PathClass::LongDiffuseMirror,
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
