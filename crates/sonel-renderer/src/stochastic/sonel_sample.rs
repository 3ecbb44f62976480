//! A sample of the sonels of one source: where sound comes from at a receiver, before the receiver is rendered.
//!
//! Every sonel is as likely in it, so that late ones and those in quiet rooms count, too. Seen from a receiver, each sends what its surface
//! mirrors on the side of the arrival, and what passes a partition on the other, as if by Lambert's law. Each band counts alike. That gives the directions of visibility rays ([`GuidedDirections`]), the free path about the receiver, which the sizes of
//! discs and balls follow, and the side of a partition to look at.

use glam::Vec3;
use sonel_geometry::{Departure, Geometry, Hit, SurfaceId};
use sonel_map::coefficients::{LEAST_THROUGH, MaterialRow};
use sonel_map::{Arrival, CoefficientTable, Lanes, Segment};

use crate::deposit::add_lanes;
use crate::partition::Partitions;
use crate::receiver::Sensitivity;
use crate::stochastic::connection::normal_on;
use crate::stochastic::gather::directions::GuidedDirections;
use crate::stochastic::gather::disc::place;

/// Most sonels of a sample.
pub const SONELS: usize = 1 << 15;
/// Parts of a sample that a receiver looks at, one after another.
const PARTS: usize = 8;
/// Sonels that are enough for a receiver, if it sees so many.
const ENOUGH: usize = 1024;
/// Part of its free path from which on a sonel is not brighter the nearer it is.
const NEAR_PER_FREE_PATH: f32 = 0.25;

/// Sonels of one source.
#[derive(Debug, Clone, Default)]
pub struct SonelSample {
    sonels: Vec<SampledSonel>,
    /// Incident energy of each, per band.
    energies: Vec<Lanes>,
    lanes: usize,
    /// Incident energy by side of a surface and band; empty where nothing is a partition.
    incident: Vec<Lanes>,
}

#[derive(Debug, Clone)]
struct SampledSonel {
    surface: SurfaceId,
    position: Vec3,
    /// Normal on the side of the arrival.
    normal: Vec3,
    departure: Departure,
    /// Path length since the reflection before [m].
    free_path: f32,
}

/// What a receiver sees of a sample.
#[derive(Debug, Clone, Default)]
pub struct Outlook {
    /// Directions of its rays.
    pub directions: GuidedDirections,
    /// Mean free path of the sound that comes to it [m]; none where it sees no sonel.
    pub free_path: Option<f64>,
}

/// A sonel seen from a receiver.
struct SeenSonel {
    /// Number in the sample.
    number: usize,
    towards: Vec3,
    /// Fluence from it, per band.
    fluence: Vec<Lanes>,
}

impl SonelSample {
    /// An empty sample, in so many lanes of bands.
    #[must_use]
    pub fn new(geometry: &Geometry, table: &CoefficientTable, lanes: usize) -> Self {
        let places = if table.transmits() { 2 * geometry.surfaces().len() } else { 0 };
        Self { lanes, incident: vec![[0.0; 4]; places * lanes], ..Self::default() }
    }

    /// Adds the sonel that `arrives` at the end of `segment` with `energy`, `free_path` [m] after the reflection before.
    pub fn add(
        &mut self,
        geometry: &Geometry,
        (segment, arrival): (&Segment<'_>, Arrival),
        energy: &[Lanes],
        free_path: f64,
    ) {
        let surface = geometry.surface(arrival.surface);
        self.sonels.push(SampledSonel {
            surface: arrival.surface,
            position: segment.end,
            normal: normal_on(arrival.side, surface.normal.as_vec3().normalize()),
            departure: geometry.leave(segment.end, arrival.surface, arrival.side),
            free_path: free_path as f32,
        });
        self.energies.extend_from_slice(energy);
        if !self.incident.is_empty() {
            let first = place(arrival.surface, arrival.side) as usize * self.lanes;
            add_lanes(&mut self.incident[first..first + self.lanes], energy);
        }
    }

    /// Adds the sonels of `other`.
    pub fn extend(&mut self, other: Self) {
        self.sonels.extend(other.sonels);
        self.energies.extend(other.energies);
        add_lanes(&mut self.incident, &other.incident);
    }

    /// Mean free path of all sonels [m]; none without any.
    #[must_use]
    pub fn free_path(&self) -> Option<f64> {
        let energies = self.energies.chunks_exact(self.lanes.max(1)).map(<[Lanes]>::to_vec);
        let all =
            energies.enumerate().map(|(number, fluence)| SeenSonel { number, towards: Vec3::ZERO, fluence });
        self.weighed(&all.collect::<Vec<_>>()).1
    }

    /// What a receiver at `position` (about the scene's centre [m]) sees.
    #[must_use]
    pub fn seen_from(
        &self,
        (geometry, table): (&Geometry, &CoefficientTable),
        (position, sensitivity): (Vec3, &Sensitivity),
    ) -> Outlook {
        let mut seen = Vec::new();
        for part in 0..PARTS {
            let numbers = (part..self.sonels.len()).step_by(PARTS);
            seen.extend(
                numbers.filter_map(|number| self.see(number, (geometry, table), (position, sensitivity))),
            );
            if seen.len() >= ENOUGH {
                break;
            }
        }
        let (seen, free_path) = self.weighed(&seen);
        Outlook { directions: GuidedDirections::new(&seen), free_path }
    }

    /// What sonel `number` sends to `position`; [`None`] where something is between, or it sends nothing there.
    fn see(
        &self,
        number: usize,
        (geometry, table): (&Geometry, &CoefficientTable),
        (position, sensitivity): (Vec3, &Sensitivity),
    ) -> Option<SeenSonel> {
        let sonel = &self.sonels[number];
        let row = table.mean_row(sonel.surface);
        let offset = position - sonel.position;
        let projected = offset.dot(sonel.normal);
        // Behind a partition the way crosses it, which takes its τ.
        if projected <= 0.0 && !row.is_partition {
            return None;
        }
        let passed = Partitions::between(geometry, table, sonel.departure, position)?;
        let distance = offset.length();
        let near = distance.max(NEAR_PER_FREE_PATH * sonel.free_path);
        let cosine = projected.abs() / distance;
        let spread = f64::from(cosine / (near * near)) * sensitivity.to(-offset.as_dvec3());
        let incident = &self.energies[number * self.lanes..(number + 1) * self.lanes];
        let mut fluence: Vec<Lanes> =
            incident.iter().map(|energy| energy.map(|energy| energy * spread)).collect();
        if projected > 0.0 {
            for (fluence, specular) in fluence.iter_mut().flatten().zip(row.specular.energy.iter().flatten())
            {
                *fluence *= specular;
            }
        }
        passed.attenuate(geometry, table, &mut fluence);
        Some(SeenSonel { number, towards: -offset / distance, fluence })
    }

    /// Directions of `seen` with the weight of each, and the mean free path: all bands count alike.
    fn weighed(&self, seen: &[SeenSonel]) -> (Vec<(Vec3, f64)>, Option<f64>) {
        let mut sums = vec![[0.0; 4]; self.lanes];
        seen.iter().for_each(|seen| add_lanes(&mut sums, &seen.fluence));
        let weight = |seen: &SeenSonel| -> f64 {
            let shares = seen.fluence.iter().flatten().zip(sums.iter().flatten());
            shares.filter(|(_, sum)| **sum > 0.0).map(|(fluence, sum)| fluence / sum).sum()
        };
        let weighed: Vec<(Vec3, f64)> = seen.iter().map(|seen| (seen.towards, weight(seen))).collect();
        let total: f64 = weighed.iter().map(|(_, weight)| weight).sum();
        let paths: f64 = seen
            .iter()
            .zip(&weighed)
            .map(|(seen, (_, weight))| weight * f64::from(self.sonels[seen.number].free_path))
            .sum();
        (weighed, (total > 0.0).then(|| paths / total))
    }

    /// Share of the rays that carry `throughput` to the partition at `hit` that pass it: more the more of what they bring lies behind.
    #[must_use]
    pub fn through(&self, hit: &Hit, row: &MaterialRow, throughput: &[Lanes]) -> f64 {
        if row.through() >= 1.0 {
            return 1.0;
        }
        let brought = |side, factors: &[Lanes]| -> f64 {
            let first = place(hit.surface, side) as usize * self.lanes;
            let incident = self.incident[first..first + self.lanes].iter().flatten();
            let carried = throughput.iter().flatten().zip(factors.iter().flatten());
            incident.zip(carried).map(|(incident, (throughput, factor))| incident * throughput * factor).sum()
        };
        let behind = brought(hit.side.opposite(), &row.transmitted.energy);
        let before = brought(hit.side, &row.specular.energy);
        let share = if behind + before > 0.0 { behind / (behind + before) } else { 0.5 };
        LEAST_THROUGH + (1.0 - 2.0 * LEAST_THROUGH) * share
    }
}
