//! L S^k R, k > K: rays with specular reflections only, counted in receiver spheres; where sound is focused they find image sources.
//!
//! Few packets of a map are reflected specularly many times in a row, with much energy each. These rays are always
//! reflected specularly and weighted by the product of (1−α)(1−s) in every band; there are four for each packet of the map.
//! Rays that carry little go on by roulette. Each batch has rays of its own, so the interval covers them.
//!
//! A sphere averages. Some rays measure beforehand whether half its cross section has another mean: then the field varies within it, at a focus
//! or at the border of a beam. There each early ray that passes the receiver within the sphere names an image source, by its chain of mirrors
//! [Vorlaender1989]. If its path is clear, the receiver gets its exact energy, divided by the probability P that a ray finds it. So there is
//! no bias. 1/P is estimated without bias by the number of directions about the path that are tried until some of them find it too
//! [Zeltner2020].

use std::ops::{ControlFlow, Range};

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use smallvec::SmallVec;
use sonel_geometry::{Departure, End, Hit};
use sonel_map::{BandValues, Lanes, lanes_of};
use sonel_sampling::{Frame, Purpose, ScrambledSobol, Stream, StreamFamily, warp};
use sonel_scene::refract;

use super::batch::receiver_stream;
use super::{BatchSums, Progress, Renderer};
use crate::ball::{BeamKind, Chord, ReceiverSphere};
use crate::exact::direct::spread;
use crate::exact::mirror::chain::{self, Ends, Reflection, SurfaceSide};
use crate::exact::mirror::{MirrorArrival, Radiator, lattice_room};
use crate::path_class::PathClass;
use crate::receiver::PreparedReceiver;
use crate::stochastic::crossing::{WayPiece, cross};
use crate::stochastic::estimate::{Arriving, BatchEstimate, Deposit, ReceiverTile};
use crate::stochastic::gather::rays::LIGHT;

/// Receivers that share rays: their echograms bound the memory.
const RECEIVERS: usize = 64;
/// Rays for each packet. With half as many, the squared half-widths of level, EDT, T20, T30, C50 and C80 times the time are 0.88 (T30 of the
/// classroom) to 1.10 (C80 of the hall) times as much in hall, office and classroom.
const RAYS_PER_PACKET: u64 = 4;
/// Batches of rays that measure the variation of fields: a sixteenth of a run of 32. Chosen, not measured.
const PROBED_BATCHES: u64 = 2;
/// Least relative difference of the mean of half the cross section of a sphere at which rays find image sources [1]. Chosen: it leaves a bias
/// that the interval includes; images are noisier than spheres where many beams are narrow.
const LEAST_VARIATION: f64 = 0.03;
/// Least such difference in standard errors.
const SIGNIFICANT: f64 = 3.0;
/// Directions that must find an image again. Chosen, not measured; doubled, the trials cost twice the time, and the variance of 1/P, on average
/// a quarter of that of the rays, halves.
const SUCCESSES: u32 = 4;
/// Most directions that are tried. It ends trials for what rays find by rounding alone.
const MOST_TRIALS: u32 = 1 << 16;

impl Renderer<'_> {
    /// Whether rays of their own bring L S^k R, k > K. In an empty box image sources bring all that matters.
    pub(crate) fn casts_specular_rays(&self) -> bool {
        let is_lattice = lattice_room(self.geometry, &self.prepared.table).is_some()
            && self.prepared.settings.mirror_order.is_none();
        self.prepared.settings.estimator.has_rays() && !is_lattice
    }

    /// Adds L S^k R, k > K, of `batches` to `sums`.
    pub(super) fn add_late_specular(
        &self,
        sums: &mut BatchSums,
        batches: Range<u32>,
        progress: Progress<'_>,
    ) -> ControlFlow<()> {
        let BatchSums { source, receivers, borders, rendering, mirrored, .. } = sums;
        if !self.casts_specular_rays() {
            return ControlFlow::Continue(());
        }
        let source = *source;
        let mirror_order = rendering.mirror_order;
        for first in (0..receivers.len()).step_by(RECEIVERS) {
            let range = first..(first + RECEIVERS).min(receivers.len());
            let tile = self.tile(source, receivers, borders, range);
            let is_varied = self.varied_fields(source, mirror_order, tile.receivers);
            let fill = |batch, estimate: &mut BatchEstimate<'_>| {
                self.mirror_rays((source, batch), mirror_order, &tile, &is_varied, estimate);
            };
            self.add_estimates(rendering, mirrored, &tile, batches.clone(), fill, progress)?;
        }
        ControlFlow::Continue(())
    }

    /// At which receivers early sound of this kind varies within the sphere.
    fn varied_fields(&self, source: usize, mirror_order: u32, receivers: &[PreparedReceiver]) -> Vec<bool> {
        let family = StreamFamily::new(self.seed(), Purpose::SpecularRay, [source as u32, 1, 0, 0]);
        let measured = (0..PROBED_BATCHES).into_par_iter().map(|batch| {
            let mut variations = vec![Variation::default(); receivers.len()];
            self.follow_rays(source, mirror_order, &mut family.stream(batch), |way, piece| {
                for (variation, receiver) in variations.iter_mut().zip(receivers) {
                    if way.is_early_at(receiver) {
                        let chord = receiver.balls.mirrored().chord(self.geometry, piece.ends);
                        chord.into_iter().for_each(|chord| variation.add(piece.energy.largest(), &chord));
                    }
                }
            });
            variations
        });
        let measured: Vec<Vec<Variation>> = measured.collect();
        let of_all = |index| measured.iter().fold(Variation::default(), |sum, of| sum.with(of[index]));
        (0..receivers.len()).map(|index| of_all(index).is_significant()).collect()
    }

    /// Adds what the rays of a batch bring. Where the field `is_varied` they find image sources.
    fn mirror_rays(
        &self,
        (source, batch): (usize, u32),
        mirror_order: u32,
        tile: &ReceiverTile<'_>,
        is_varied: &[bool],
        estimate: &mut BatchEstimate<'_>,
    ) {
        let family = StreamFamily::new(self.seed(), Purpose::SpecularRay, [source as u32, 0, 0, 0]);
        let trials = |receiver| receiver_stream(self.seed(), Purpose::SpecularTrial, receiver, source, batch);
        let mut trials: Vec<Stream> = tile.receivers.iter().map(trials).collect();
        let nothing = vec![Lanes::ZERO; lanes_of(self.prepared.table.bands())];
        let (mut scratch, medium) = ([nothing.clone(), nothing], self.medium());
        let mut stream = family.stream(u64::from(batch));
        self.follow_rays(source, mirror_order, &mut stream, |way, piece| {
            estimate.crossings.pass(BeamKind::Mirrored, piece.energy);
            let deposit = &mut estimate.of(PathClass::LateSpecular, &medium);
            for (index, receiver) in tile.receivers.iter().enumerate() {
                if is_varied[index] && way.is_early_at(receiver) {
                    let (receiver, stream) = ((index, receiver), &mut trials[index]);
                    self.find_image(way, piece, receiver, stream, &mut scratch, deposit);
                } else {
                    let receiver = std::iter::once((index, receiver, tile.direct_lengths[index]));
                    cross(piece, receiver, &mut scratch[0], deposit);
                }
            }
        });
    }

    /// Follows the rays of a batch and visits every straight piece of their paths beyond order `mirror_order`.
    fn follow_rays(
        &self,
        source: usize,
        mirror_order: u32,
        stream: &mut Stream,
        mut visit: impl FnMut(&Way<'_>, &WayPiece<'_>),
    ) {
        let radiator = Radiator::new(&self.map.header().scene.sources[source], self.geometry.center());
        let air = self.map.header().scene.air_at_source(source);
        let traced = &self.map.header().settings;
        let rays = (RAYS_PER_PACKET * traced.emissions)
            .div_ceil(u64::from(traced.batches))
            .min(u64::from(u32::MAX)) as u32;
        let directions = ScrambledSobol::from_keys([stream.bits(), stream.bits()]);
        let mut energy = vec![Lanes::ZERO; lanes_of(self.prepared.table.bands())];
        let mut chain = Vec::new();
        for ray in 0..rays {
            let direction = warp::uniform_sphere(directions.point(ray));
            energy.fill(Lanes::ONE);
            radiator.towards(direction.as_dvec3()).weigh(&mut energy);
            energy.divide(f64::from(rays));
            let mut reference = energy.largest();
            let mut way = Way {
                radiator,
                origin: self.geometry.in_general_position(radiator.position, End::Source),
                emitted: direction,
                departure: Departure::free(radiator.position.as_vec3()),
                direction,
                length: 0.0,
                stretch: self.prepared.table.propagation().stretch(air, radiator.position),
                chain,
                chance: f64::from(rays),
            };
            while energy.largest() > 0.0 {
                let hit = self.geometry.closest_hit(way.departure, way.direction);
                if way.chain.len() > mirror_order as usize {
                    let rest = ((self.prepared.bins.reach - way.length) / way.stretch) as f32;
                    let end = || way.departure.origin + way.direction * rest;
                    let piece = WayPiece {
                        ends: (way.departure.origin, hit.map_or_else(end, |hit| hit.position)),
                        start_length: way.length,
                        energy: &energy,
                        fades_from: 0.0,
                        beam: BeamKind::Mirrored,
                    };
                    visit(&way, &piece);
                }
                let Some(hit) = hit else { break };
                let (reflections, before) = (way.chain.len(), energy.largest());
                if !self.mirror(&mut way, &hit, &mut energy, stream) {
                    break;
                }
                // What a partition lets through is all that there is behind it.
                if way.chain.len() == reflections {
                    reference *= energy.largest() / before;
                }
                let survival = energy.largest() / (LIGHT * reference);
                if survival < 1.0 {
                    energy.divide(survival);
                    way.chance *= survival;
                    if stream.uniform_fine() >= survival {
                        break;
                    }
                }
            }
            // One allocation for all rays.
            chain = way.chain;
            chain.clear();
        }
    }

    /// Adds the sound of the image source that a ray names to a receiver, if the ray passes it within its sphere.
    fn find_image(
        &self,
        way: &Way<'_>,
        piece: &WayPiece<'_>,
        (index, receiver): (usize, &PreparedReceiver),
        stream: &mut Stream,
        [scratch, factor]: &mut [Vec<Lanes>; 2],
        deposit: &mut Deposit<'_, '_>,
    ) {
        let ball = receiver.balls.mirrored();
        if !ball.is_passed(piece.ends) {
            let is_near = || ball.is_passed_nearby(self.geometry, piece.ends);
            return deposit.estimate.crossings.pass_near(BeamKind::Mirrored, index, piece.energy, is_near);
        }
        deposit.estimate.crossings.cross(BeamKind::Mirrored, index, piece.energy);
        let ends = Ends {
            radiator: way.radiator,
            origin: way.origin,
            receiver: receiver.exact,
            displaced: self.geometry.in_general_position(receiver.exact, End::Receiver),
        };
        let chain: SmallVec<[&Reflection; 16]> = way.chain.iter().rev().collect();
        let found = chain::arrive(self.geometry, &self.prepared.table, &ends, &chain, factor);
        let Some((MirrorArrival { length: path, towards, factor, .. }, leaving)) = found else { return };
        let length = path * receiver.stretch;
        let Some(bin) = self.prepared.bins.bin(length) else { return };
        let cone = Cone::new(leaving, ball.radius() / path);
        if !cone.contains(way.emitted) {
            return;
        }
        let source = way.radiator.position.as_vec3();
        let finds = |direction| self.finds(&way.chain, source, direction, ball);
        let probability = cone.share() / trials_per_success(&cone, finds, stream);
        let weight = receiver.sensitivity.to(towards) / (probability * way.chance);
        scratch.set_times(factor, spread(path) * weight);
        deposit.medium.receive(receiver, length, scratch);
        deposit.add(Arriving { receiver: index, towards, length, bin }, scratch);
    }

    /// Whether a ray that leaves `source` [m] in `direction` runs along the whole of a chain and then passes the middle of a ball within its
    /// radius. Partitions are passed.
    fn finds(&self, chain: &[Reflection], source: Vec3, mut direction: Vec3, ball: &ReceiverSphere) -> bool {
        let mut departure = Departure::free(source);
        let mut mirrors = chain.iter().map(|reflection| reflection.mirror).peekable();
        loop {
            let hit = self.geometry.closest_hit(departure, direction);
            let is_last = mirrors.peek().is_none();
            let end = || departure.origin + direction * self.prepared.bins.reach as f32;
            if is_last && ball.is_passed((departure.origin, hit.map_or_else(end, |hit| hit.position))) {
                return true;
            }
            let Some(hit) = hit else { return false };
            if mirrors.next_if_eq(&SurfaceSide { surface: hit.surface, side: hit.side }).is_some() {
                direction = self.mirrored(direction, &hit);
                departure = self.geometry.leave(hit.position, hit.surface, hit.side);
            } else if self.prepared.table.mean_row(hit.surface).is_partition {
                let Some(passage) = self.geometry.pass(&hit) else { return false };
                departure = passage.departure;
            } else {
                return false;
            }
        }
    }

    /// Mirrors a ray at `hit`, or lets it through; false where the run ends before.
    fn mirror(&self, way: &mut Way<'_>, hit: &Hit, energy: &mut [Lanes], stream: &mut Stream) -> bool {
        let end = hit.position;
        way.length += f64::from(way.departure.origin.distance(end)) * way.stretch;
        if way.length > self.prepared.bins.reach {
            return false;
        }
        let direction = way.direction.as_dvec3();
        if let Some(interface) = self.prepared.table.propagation().interface(hit.surface, hit.side) {
            // What passes is left to packets.
            let normal = self.prepared.table.normal(hit.surface);
            energy.scale(refract(direction.normalize(), normal, interface.sides).reflected);
        } else {
            let row = &*self.prepared.table.row(hit.surface, direction);
            let through = row.through();
            let passes = through > 0.0 && stream.uniform_fine() < through;
            let (factors, share) =
                if passes { (&row.transmitted, through) } else { (&row.specular, 1.0 - through) };
            for (energy, &factor) in energy.iter_mut().zip(&factors.energy) {
                *energy *= factor / share;
            }
            way.chance *= share;
            if passes {
                let Some(passage) = self.geometry.pass(hit) else { return false };
                way.departure = passage.departure;
                way.length += passage.thickness() * way.stretch;
                return true;
            }
        }
        way.direction = self.mirrored(way.direction, hit);
        way.departure = self.geometry.leave(end, hit.surface, hit.side);
        let source = [way.origin, way.radiator.position];
        let images = way.chain.last().map_or(source, |last| [last.image, last.of_radiator]);
        let mirror = SurfaceSide { surface: hit.surface, side: hit.side };
        way.chain.push(Reflection::new(self.geometry, mirror, images));
        true
    }

    fn mirrored(&self, direction: Vec3, hit: &Hit) -> Vec3 {
        let normal = self.prepared.normals[hit.surface.0 as usize];
        direction.reflect(normal).normalize()
    }
}

/// State of a ray.
struct Way<'a> {
    radiator: Radiator<'a>,
    /// The radiator's position in general position [m].
    origin: DVec3,
    /// Direction in which it left the source.
    emitted: Vec3,
    departure: Departure,
    direction: Vec3,
    /// Length from the source [m], times c₀/c of its air.
    length: f64,
    stretch: f64,
    /// Its reflections.
    chain: Vec<Reflection>,
    /// Number of rays times the probability of all that was drawn about this one since.
    chance: f64,
}

impl Way<'_> {
    /// Whether the path of its image source to a receiver is early: the length of that path, not of the ray's, so that all rays of a chain agree.
    fn is_early_at(&self, receiver: &PreparedReceiver) -> bool {
        let distance = |last: &Reflection| last.of_radiator.distance(receiver.exact) * self.stretch;
        self.chain.last().is_some_and(|last| receiver.balls.is_early(distance(last)))
    }
}

/// Sums over rays that cross a sphere: energy, and what half the cross section finds more.
#[derive(Debug, Clone, Copy, Default)]
struct Variation {
    energy: f64,
    more: f64,
    more_squared: f64,
}

impl Variation {
    fn add(&mut self, energy: f64, chord: &Chord) {
        let found = energy * chord.fluence;
        let more = found * (chord.gain - 1.0);
        *self = self.with(Self { energy: found, more, more_squared: more * more });
    }

    fn with(self, other: Self) -> Self {
        Self {
            energy: self.energy + other.energy,
            more: self.more + other.more,
            more_squared: self.more_squared + other.more_squared,
        }
    }

    fn is_significant(self) -> bool {
        let more = self.more.abs();
        more > LEAST_VARIATION * self.energy && more > SIGNIFICANT * self.more_squared.sqrt()
    }
}

/// Directions about an axis; all directions where its aperture is the whole sphere.
struct Cone {
    frame: Frame,
    axis: DVec3,
    sine: f64,
    /// 1 − cos of the half angle.
    depth: f64,
}

impl Cone {
    /// The cone about `axis` whose half angle has this `sine`; from 1 on all directions.
    fn new(axis: DVec3, sine: f64) -> Self {
        let axis = axis.normalize();
        let depth = if sine < 1.0 { 1.0 - (1.0 - sine * sine).sqrt() } else { 2.0 };
        Self { frame: Frame::about(axis.as_vec3()), axis, sine, depth }
    }

    /// Its share of all directions [1].
    fn share(&self) -> f64 {
        0.5 * self.depth
    }

    fn contains(&self, direction: Vec3) -> bool {
        let direction = direction.as_dvec3();
        self.sine >= 1.0 || direction.dot(self.axis) > 0.0 && direction.cross(self.axis).length() < self.sine
    }

    fn sample(&self, u: [f32; 2]) -> Vec3 {
        let [u, v] = u.map(f64::from);
        let depth = u * self.depth;
        let (sine, cosine) = libm::sincos(core::f64::consts::TAU * v);
        let aside = (depth * (2.0 - depth)).sqrt();
        self.frame.outward(DVec3::new(aside * cosine, aside * sine, 1.0 - depth).as_vec3())
    }
}

/// Directions of a cone that are tried for each that `finds`: the mean over [`SUCCESSES`], without bias.
fn trials_per_success(cone: &Cone, finds: impl Fn(Vec3) -> bool, stream: &mut Stream) -> f64 {
    let mut successes = 0;
    for trial in 1..=MOST_TRIALS {
        successes += u32::from(finds(cone.sample(stream.uniform_pair())));
        if successes == SUCCESSES {
            return f64::from(trial) / f64::from(SUCCESSES);
        }
    }
    f64::from(MOST_TRIALS) / f64::from(successes.max(1))
}
