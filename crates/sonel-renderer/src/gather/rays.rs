//! Visibility rays: where a receiver looks, directly and by mirrors.

use glam::{DVec2, Vec3};
use sonel_geometry::{Departure, SurfaceId};
use sonel_map::{CoefficientTable, Lanes};
use sonel_sampling::{ScrambledSobol, Stream, warp};

use super::disc::{Sheet, View};
use crate::bending::WayEnd;
use crate::connection::normal_on;
use crate::receiver::PreparedReceiver;
use crate::render::Medium;

/// How rays gather.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GatherSettings {
    /// Rays of one receiver in one batch.
    pub rays: u32,
    /// Radius h of the discs [m].
    pub radius: f64,
    /// Longest path that matters [m].
    pub reach: f64,
    /// Whether rays go on by mirrors; else they gather near surfaces only.
    pub by_mirrors: bool,
}

/// One disc that gathers.
#[derive(Debug, Clone)]
pub struct GatherPoint {
    /// Number of the receiver.
    pub receiver: u32,
    /// Surface and side, as [`place`] numbers them.
    pub place: u32,
    /// Centre in the plane of the surface [m].
    pub centre: DVec2,
    /// Length of the ray [m].
    pub length: f64,
    /// What the disc sees of its surface.
    pub view: View,
    /// (4π/M) · T · δ / (π A) per band, times the share that is gathered [1/m²].
    pub weight: Vec<Lanes>,
    /// Whether the receiver sees it without a mirror: it gathers only what connections leave.
    pub seen_directly: bool,
}

/// Number of a surface's side.
#[inline]
#[must_use]
pub fn place(surface: SurfaceId, side: sonel_geometry::Side) -> u32 {
    2 * surface.0 + u32::from(side == sonel_geometry::Side::Back)
}

/// Casts the rays of one receiver in one batch and hands every disc to `found`. Where edges bend, a ray carries the bands alone that
/// go straight past all of them. `stream` is that of the receiver and batch.
pub fn cast(
    medium: &Medium<'_>,
    table: &CoefficientTable,
    sheets: &[Sheet],
    receiver: (u32, &PreparedReceiver),
    settings: &GatherSettings,
    stream: &mut Stream,
    mut found: impl FnMut(GatherPoint),
) {
    let geometry = medium.geometry;
    let directions = ScrambledSobol::from_keys([stream.bits(), stream.bits()]);
    for ray in 0..settings.rays {
        let mut direction = warp::uniform_sphere(directions.point(ray));
        let mut departure = Departure::free(receiver.1.position);
        let mut throughput = vec![[4.0 / f64::from(settings.rays); 4]; sonel_map::lanes_of(table.bands())];
        let (mut length, mut reflections) = (0.0, 0_u32);
        let mut at: Vec3 = receiver.1.position;
        let mut end = WayEnd::in_air(receiver.1.exact);
        while let Some(hit) = geometry.closest_hit(departure, direction) {
            length += f64::from(at.distance(hit.position));
            if length > settings.reach {
                break;
            }
            let surface = geometry.surface(hit.surface);
            let row = table.material(surface.material);
            let normal = normal_on(hit.side, surface.normal.as_vec3().normalize());
            let seen_directly = reflections == 0;
            let share = if seen_directly { receiver.1.gathered_share(hit.position, normal) } else { 1.0 };
            let gathers = share > 0.0 && !row.is_mirror;
            let start = WayEnd::at_surface(hit.position.as_dvec3(), f64::from(direction.dot(normal).abs()));
            if let Some(bends) = medium.bends
                && (gathers || settings.by_mirrors)
            {
                bends.keep_straight(geometry, [start, end], &mut throughput);
            }
            if gathers {
                let sheet = &sheets[hit.surface.0 as usize];
                let centre = sheet.flat(hit.position.as_dvec3());
                let view = sheet.view(hit.side, centre, settings.radius);
                let weight = product(&throughput, &row.diffuse.energy, share / view.area);
                found(GatherPoint {
                    receiver: receiver.0,
                    place: place(hit.surface, hit.side),
                    centre,
                    length,
                    weight,
                    view,
                    seen_directly,
                });
            }
            if !settings.by_mirrors || throughput.iter().flatten().all(|&band| band <= 0.0) {
                break;
            }
            // Roulette with the strongest band's reflection: no band's throughput grows.
            let survival = row.specular.energy.iter().flatten().copied().fold(0.0, f64::max);
            if stream.uniform_fine() >= survival {
                break;
            }
            throughput = product(&throughput, &row.specular.energy, 1.0 / survival);
            direction = (direction - 2.0 * direction.dot(normal) * normal).normalize();
            departure = geometry.leave(hit.position, hit.surface, hit.side);
            (at, end) = (hit.position, start);
            reflections += 1;
        }
    }
}

fn product(a: &[Lanes], b: &[Lanes], scale: f64) -> Vec<Lanes> {
    a.iter()
        .zip(b)
        .map(|(a, b)| {
            let mut out = [0.0; 4];
            for lane in 0..4 {
                out[lane] = a[lane] * b[lane] * scale;
            }
            out
        })
        .collect()
}
