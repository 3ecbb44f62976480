//! A sample of the sonels of one source: where sound comes from at a receiver, before the receiver is rendered.
//!
//! Seen from a receiver, each sonel lights the side of its arrival, if that mirrors anything, and the other side of a partition, as if by
//! Lambert's law. That gives the directions of visibility rays ([`GuidedDirections`]), the lengths that discs and balls follow, and the side
//! of a partition to look at. Every sonel counts alike, whatever it carries: late ones and those in quiet rooms matter as well, and other
//! air, materials or patterns of receivers choose the same rays, so that renderings of one map differ by what was changed and not by noise.

use glam::Vec3;
use sonel_geometry::{Departure, Geometry, Hit, SurfaceId};
use sonel_map::coefficients::MaterialRow;
use sonel_map::leads::LEAST_THROUGH;
use sonel_map::{Arrival, BandValues, CoefficientTable, Segment};

use crate::guided_directions::GuidedDirections;
use crate::partition::Partitions;
use crate::stochastic::connection::normal_on;
use crate::stochastic::gather::disc::place;

/// Most sonels of a sample: 32 times [`ENOUGH`], for receivers that see a thirtieth of them.
pub(crate) const SONELS: usize = 1 << 15;
/// Parts of a sample that a receiver tests one after another until it sees [`ENOUGH`]. Speed alone depends on it.
const PARTS: usize = 8;
/// Visible sonels after which a receiver tests no more parts: shares of the sphere of one in sixteen are known to 13 %. Chosen, not measured;
/// doubled, to 9 % at twice the rays.
const ENOUGH: usize = 1024;
/// Distance below which a sonel is no brighter the nearer it is, relative to its free path [1]. Chosen, not measured: it bounds the weight of
/// one sonel beside a receiver; doubled, near surfaces get fewer rays.
const NEAR_PER_FREE_PATH: f32 = 0.05;

/// Sonels of one source.
#[derive(Debug, Clone, Default)]
pub(crate) struct SonelSample {
    sonels: Vec<SampledSonel>,
    /// Numbers of arrivals on each side of a surface.
    arrived: Vec<u32>,
}

#[derive(Debug, Clone)]
struct SampledSonel {
    surface: SurfaceId,
    position: Vec3,
    /// Normal on the side of the arrival.
    normal: Vec3,
    departure: Departure,
    /// Path length since the reflection before, or since the source [m].
    free_path: f32,
    /// Whether there was a reflection before: how near a source is to a wall says nothing of the room.
    is_reflected: bool,
}

/// Visible part of a sample at a receiver.
#[derive(Debug, Clone, Default)]
pub(crate) struct Outlook {
    /// Directions of its rays.
    pub directions: GuidedDirections,
    /// Scale of discs and balls; none where no sonel is visible.
    pub scale: Option<Scale>,
    /// cos θ / d² of every sonel [1/m²].
    pub solid_angles: Vec<f64>,
}

/// Lengths over which irradiance and fluence vary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    /// Mean free path of sonels [m]: over so much irradiance varies where they lie.
    pub free_path: f64,
    /// Mean distance of a receiver from them, at least their free path [m]: over so much fluence varies about it.
    pub distance: f64,
}

impl Scale {
    /// The same in halves of `whole` [m], at most that: where a scene is one room lengths are those of the room, whoever looks.
    #[must_use]
    pub(crate) fn in_halves_of(self, whole: f64) -> Self {
        let halved = |length: f64| whole * libm::exp2(-libm::round(libm::log2(whole / length)).max(0.0));
        Self { free_path: halved(self.free_path), distance: halved(self.distance) }
    }
}

/// A sonel seen from a receiver.
struct SeenSonel<'a> {
    sonel: &'a SampledSonel,
    towards: Vec3,
    distance: f32,
    /// Fluence from it, relative to others.
    weight: f64,
}

impl SonelSample {
    /// An empty sample.
    #[must_use]
    pub(crate) fn new(geometry: &Geometry) -> Self {
        Self { sonels: Vec::new(), arrived: vec![0; 2 * geometry.surfaces().len()] }
    }

    /// Adds the sonel that `arrives` at the end of `segment`, `free_path` [m] after the reflection before.
    pub(crate) fn add(
        &mut self,
        geometry: &Geometry,
        segment: &Segment<'_>,
        arrival: Arrival,
        free_path: f64,
    ) {
        let is_reflected = free_path < segment.end_length;
        let surface = geometry.surface(arrival.surface);
        self.arrived[place(arrival.surface, arrival.side) as usize] += 1;
        self.sonels.push(SampledSonel {
            surface: arrival.surface,
            position: segment.end,
            normal: normal_on(arrival.side, surface.normal.as_vec3().normalize()),
            departure: geometry.leave(segment.end, arrival.surface, arrival.side),
            free_path: free_path as f32,
            is_reflected,
        });
    }

    /// Adds the sonels of `other`.
    pub(crate) fn extend(&mut self, other: Self) {
        self.sonels.extend(other.sonels);
        self.arrived.iter_mut().zip(other.arrived).for_each(|(mine, other)| *mine += other);
    }

    /// Scale of all sonels, wherever a receiver is; none without any.
    #[must_use]
    pub(crate) fn scale(&self) -> Option<Scale> {
        let all = |sonel| SeenSonel { sonel, towards: Vec3::ZERO, distance: 0.0, weight: 1.0 };
        scale(&self.sonels.iter().map(all).collect::<Vec<_>>())
    }

    /// Visible part of the sample from `position`, relative to the scene's centre [m].
    #[must_use]
    pub(crate) fn seen_from(&self, geometry: &Geometry, table: &CoefficientTable, position: Vec3) -> Outlook {
        let mut seen = Vec::new();
        for part in 0..PARTS {
            let sonels = self.sonels.iter().skip(part).step_by(PARTS);
            seen.extend(sonels.filter_map(|sonel| sonel.seen_from(geometry, table, position)));
            if seen.len() >= ENOUGH {
                break;
            }
        }
        let directions: Vec<(Vec3, f64)> = seen.iter().map(|seen| (seen.towards, seen.weight)).collect();
        let solid_angles = seen.iter().map(|seen| seen.weight).collect();
        Outlook { directions: GuidedDirections::new(&directions), scale: scale(&seen), solid_angles }
    }

    /// Share of the rays that meet the partition of `row` at `hit` that pass it: more the more sonels lie behind.
    #[must_use]
    pub(crate) fn through(&self, hit: &Hit, row: &MaterialRow) -> f64 {
        if row.through() >= 1.0 {
            return 1.0;
        }
        let arrived = |side| f64::from(self.arrived[place(hit.surface, side) as usize]);
        let (behind, before) = (arrived(hit.side.opposite()), arrived(hit.side));
        let share = if behind + before > 0.0 { behind / (behind + before) } else { 0.5 };
        LEAST_THROUGH + (1.0 - 2.0 * LEAST_THROUGH) * share
    }
}

impl SampledSonel {
    /// Radiation towards `position`; [`None`] where the path is blocked or nothing is radiated there.
    fn seen_from(
        &self,
        geometry: &Geometry,
        table: &CoefficientTable,
        position: Vec3,
    ) -> Option<SeenSonel<'_>> {
        let row = table.mean_row(self.surface);
        let offset = position - self.position;
        let projected = offset.dot(self.normal);
        let sends = if projected > 0.0 { row.specular.energy.largest() > 0.0 } else { row.is_partition };
        if !sends {
            return None;
        }
        let passed = Partitions::between(geometry, table, self.departure, position)?;
        let offset = offset - passed.shift().as_vec3();
        let distance = offset.length();
        let near = distance.max(NEAR_PER_FREE_PATH * self.free_path);
        Some(SeenSonel {
            sonel: self,
            towards: -offset / distance,
            distance,
            weight: f64::from(projected.abs() / (distance * near * near)),
        })
    }
}

/// The weighted means of those of `seen` that were reflected before.
fn scale(seen: &[SeenSonel<'_>]) -> Option<Scale> {
    let reflected = || seen.iter().filter(|seen| seen.sonel.is_reflected);
    let total: f64 = reflected().map(|seen| seen.weight).sum();
    let mean = |of: fn(&SeenSonel<'_>) -> f32| {
        reflected().map(|seen| seen.weight * f64::from(of(seen))).sum::<f64>() / total
    };
    (total > 0.0).then(|| Scale {
        free_path: mean(|seen| seen.sonel.free_path),
        distance: mean(|seen| seen.sonel.free_path.max(seen.distance)),
    })
}
