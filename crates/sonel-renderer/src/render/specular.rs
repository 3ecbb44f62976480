//! L S^k R, k > K: rays with specular reflections only, counted in receiver spheres.
//!
//! Few packets of a map are reflected specularly many times in a row, with much energy each. These rays are always
//! reflected specularly and weighted by the product of (1−α)(1−s) in every band; there are four for each packet of the map.
//! Rays that carry little go on by roulette. Each batch has rays of its own, so the interval covers them.

use std::ops::Range;

use sonel_geometry::{Departure, Hit};
use sonel_map::{BandValues, Lanes, lanes_of};
use sonel_sampling::{Purpose, ScrambledSobol, Stream, StreamFamily, warp};
use sonel_scene::refract;

use super::Renderer;
use super::batch::{BatchEstimate, Tile};
use crate::ball::Beam;
use crate::deposit::Deposits;
use crate::exact::mirror::{Radiator, lattice_room};
use crate::path_class::PathClass;
use crate::receiver::PreparedReceiver;
use crate::rendering::Rendering;
use crate::stochastic::crossing::{Piece, cross};
use crate::stochastic::gather::rays::LIGHT;

/// Receivers that share rays: their echograms bound the memory.
const RECEIVERS: usize = 64;
/// Rays for each packet: they cost a tenth of it, and where walls are smooth most noise of the level is theirs.
const RAYS_PER_PACKET: u64 = 4;

impl Renderer<'_> {
    /// Whether rays of their own bring L S^k R, k > K. In an empty box image sources bring all that matters.
    pub(crate) fn casts_specular_rays(&self) -> bool {
        let is_lattice =
            lattice_room(self.geometry, &self.table).is_some() && self.settings.mirror_order.is_none();
        self.settings.estimator.has_rays() && !is_lattice
    }

    /// Adds L S^k R, k > K, of `batches` of `source` at all `receivers` to `rendering`, their echograms to `total`.
    pub(crate) fn add_late_specular(
        &self,
        rendering: &mut Rendering,
        total: &mut Deposits,
        source: usize,
        receivers: &[PreparedReceiver],
        borders: &[Vec<f64>],
        batches: Range<u32>,
    ) {
        if !self.casts_specular_rays() {
            return;
        }
        let mirror_order = rendering.mirror_order;
        for first in (0..receivers.len()).step_by(RECEIVERS) {
            let range = first..(first + RECEIVERS).min(receivers.len());
            let tile = self.tile(source, receivers, borders, range);
            let fill = |batch, estimate: &mut BatchEstimate<'_>| {
                self.mirror_rays(source, batch, mirror_order, &tile, estimate);
            };
            self.add_estimates(rendering, total, &tile, batches.clone(), fill, &mut |_| {});
        }
    }

    /// Follows the rays of one batch.
    fn mirror_rays(
        &self,
        source: usize,
        batch: u32,
        mirror_order: u32,
        tile: &Tile<'_>,
        estimate: &mut BatchEstimate<'_>,
    ) {
        let radiator = Radiator::new(&self.map.header().scene.sources[source], self.geometry.center());
        let air = self.map.header().scene.air_at_source(source);
        let traced = &self.map.header().settings;
        let rays = (RAYS_PER_PACKET * traced.emissions)
            .div_ceil(u64::from(traced.batches))
            .min(u64::from(u32::MAX)) as u32;
        let family = StreamFamily::new(self.seed(), Purpose::SpecularRay, [source as u32, 0, 0, 0]);
        let mut stream = family.stream(u64::from(batch));
        let directions = ScrambledSobol::from_keys([stream.bits(), stream.bits()]);
        let nothing = vec![Lanes::ZERO; lanes_of(self.table.bands())];
        let (mut energy, mut scratch) = (nothing.clone(), nothing);
        for ray in 0..rays {
            let direction = warp::uniform_sphere(directions.point(ray));
            energy.fill(Lanes::ONE);
            radiator.towards(direction.as_dvec3()).weigh(&mut energy);
            energy.divide(f64::from(rays));
            let mut usual = energy.largest();
            let mut way = Way {
                departure: Departure::free(radiator.position.as_vec3()),
                direction,
                length: 0.0,
                stretch: self.table.propagation().stretch(air, radiator.position),
                reflections: 0,
            };
            while energy.largest() > 0.0 {
                let hit = self.geometry.closest_hit(way.departure, way.direction);
                if way.reflections > mirror_order {
                    estimate.crossings.pass(Beam::Mirrored, &energy);
                    self.cross(&way, hit.as_ref(), tile, &energy, &mut scratch, estimate);
                }
                let Some(hit) = hit else { break };
                let (reflections, before) = (way.reflections, energy.largest());
                if !self.mirror(&mut way, &hit, &mut energy, &mut stream) {
                    break;
                }
                // What a partition lets through is all that there is behind it.
                if way.reflections == reflections {
                    usual *= energy.largest() / before;
                }
                if !survives(&mut energy, LIGHT * usual, &mut stream) {
                    break;
                }
            }
        }
    }

    /// Adds what a ray on its way to `hit`, or to the end of the run, brings to the receivers.
    fn cross(
        &self,
        way: &Way,
        hit: Option<&Hit>,
        tile: &Tile<'_>,
        energy: &[Lanes],
        scratch: &mut [Lanes],
        estimate: &mut BatchEstimate<'_>,
    ) {
        let start = way.departure.origin;
        let end = hit.map_or_else(
            || start + way.direction * ((self.bins.reach - way.length) / way.stretch) as f32,
            |hit| hit.position,
        );
        let piece = Piece {
            ends: (start, end),
            start_length: way.length,
            energy,
            fades_from: 0.0,
            beam: Beam::Mirrored,
        };
        let receivers = tile.receivers.iter().zip(&tile.direct_lengths).enumerate();
        let receivers = receivers.map(|(index, (receiver, &length))| (index, receiver, length));
        let mut deposits = estimate.class(PathClass::LateSpecular);
        cross(&piece, receivers, &self.medium(), scratch, &mut deposits);
    }

    /// Mirrors a ray at `hit`, or lets it through; false where the run ends before.
    fn mirror(&self, way: &mut Way, hit: &Hit, energy: &mut [Lanes], stream: &mut Stream) -> bool {
        let end = hit.position;
        way.length += f64::from(way.departure.origin.distance(end)) * way.stretch;
        if way.length > self.bins.reach {
            return false;
        }
        let direction = way.direction.as_dvec3();
        let mut passes = false;
        if let Some(interface) = self.table.propagation().interface(hit.surface, hit.side) {
            // What passes is left to packets.
            let normal = self.table.normal(hit.surface);
            energy.scale(refract(direction.normalize(), normal, interface.sides).reflected);
        } else {
            let row = &*self.table.row(hit.surface, direction);
            let through = row.through();
            passes = through > 0.0 && stream.uniform_fine() < through;
            let (factors, share) =
                if passes { (&row.transmitted, through) } else { (&row.specular, 1.0 - through) };
            for (energy, &factor) in energy.iter_mut().zip(&factors.energy) {
                *energy *= factor / share;
            }
        }
        if passes {
            let Some(passage) = self.geometry.pass(hit) else { return false };
            way.departure = passage.departure;
            way.length += passage.thickness() * way.stretch;
            return true;
        }
        let normal = self.normals[hit.surface.0 as usize];
        way.direction = (way.direction - 2.0 * way.direction.dot(normal) * normal).normalize();
        way.departure = self.geometry.leave(end, hit.surface, hit.side);
        way.reflections += 1;
        true
    }
}

/// State of a ray.
struct Way {
    departure: Departure,
    direction: glam::Vec3,
    /// Length from the source [m], times c₀/c of its air.
    length: f64,
    stretch: f64,
    reflections: u32,
}

/// Whether a ray that carries `energy` goes on: by roulette where that is less than `light` in every band.
fn survives(energy: &mut [Lanes], light: f64, stream: &mut Stream) -> bool {
    let survival = energy.largest() / light;
    if survival >= 1.0 {
        return true;
    }
    energy.divide(survival);
    stream.uniform_fine() < survival
}
