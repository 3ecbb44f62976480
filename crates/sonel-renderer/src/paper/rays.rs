//! Visibility rays with the paper's roulette: mirrored until they are absorbed or reflected diffusely.
//!
//! Each band has its own rays and sonels. At every surface one random number selects by the coefficients of that band:
//! diffuse reflection (δ) ends the ray in a disc that counts sonels, specular reflection and transmission continue it,
//! absorption ends it. The roulette is where δ is applied; the disc counts all that arrives.
//!
//! A ray of M that meets the source's sphere of radius a brings Q/(M π a²): the sphere at distance d fills a²/(4d²) of the
//! directions, so that the mean is Q/(4πd²). The sphere shades nothing.

use core::f64::consts::PI;

use sonel_geometry::{Departure, Geometry, SurfaceId};
use sonel_map::{BandValues, CoefficientTable, Lanes};
use sonel_sampling::{ScrambledSobol, Stream, warp};

use crate::exact::mirror::Radiator;
use crate::receiver::PreparedReceiver;
use crate::stochastic::connection::normal_on;
use crate::stochastic::gather::rays::{GatherPoint, Weight};

use super::Paper;

/// The source, seen by mirrors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SourceSight {
    /// Length of the way to the middle of the source's image [m].
    pub length: f64,
    /// Fluence per unit emitted energy, without air [1/m²].
    pub fluence: f64,
    /// Direction in which the ray left the receiver.
    pub towards: glam::Vec3,
    /// Whether the ray also meets the sphere of half the area.
    pub in_half: bool,
}

/// Targets of a ray.
pub(crate) enum Sight {
    /// A disc in which sonels are counted.
    Disc(GatherPoint),
    /// The source.
    Source(SourceSight),
}

/// The surroundings of the rays of one band.
pub(crate) struct Looking<'a> {
    /// Walls.
    pub geometry: &'a Geometry,
    /// Coefficients.
    pub table: &'a CoefficientTable,
    /// The band, or class of bands, a column of the table.
    pub column: usize,
    /// Targets.
    pub radiator: Radiator<'a>,
    /// Radius of its sphere [m].
    pub source_radius: f64,
    /// Longest path that matters [m].
    pub reach: f64,
}

/// Fate of a ray at a surface.
enum Turn {
    Diffuse,
    Mirror,
    Through,
    Absorbed,
}

impl Paper {
    /// Casts the rays of receiver number `receiver` in one batch.
    pub(crate) fn cast(
        &self,
        looking: &Looking<'_>,
        receiver: (u32, &PreparedReceiver),
        stream: &mut Stream,
        mut found: impl FnMut(Sight),
    ) {
        let directions = ScrambledSobol::from_keys([stream.bits(), stream.bits()]);
        for ray in 0..self.rays {
            let mut direction = warp::uniform_sphere(directions.point(ray));
            let towards = direction;
            let sensitivity = receiver.1.sensitivity.to(direction.as_dvec3());
            let mut departure = Departure::free(receiver.1.position);
            let (mut at, mut length) = (receiver.1.exact, 0.0);
            for leg in 0_u32.. {
                let hit = looking.geometry.closest_hit(departure, direction);
                let end = hit.map(|hit| hit.position.as_dvec3());
                // The first leg is left to the shadow ray.
                if leg > 0
                    && let Some(sight) =
                        looking.source_on(at, direction.as_dvec3(), end.map(|end| at.distance(end)), length)
                {
                    let fluence = sight.fluence * sensitivity / f64::from(self.rays);
                    found(Sight::Source(SourceSight { fluence, towards, ..sight }));
                }
                let (Some(hit), Some(end)) = (hit, end) else { break };
                length += at.distance(end);
                if length > looking.reach {
                    break;
                }
                at = end;
                let surface = looking.geometry.surface(hit.surface);
                let onward = match looking.turn(hit.surface, direction.as_dvec3(), stream.uniform_fine()) {
                    Turn::Diffuse => {
                        found(Sight::Disc(self.disc(
                            looking,
                            (receiver.0, leg == 0),
                            &hit,
                            (length, sensitivity, towards),
                        )));
                        break;
                    }
                    Turn::Mirror => {
                        let normal = normal_on(hit.side, surface.normal.as_vec3().normalize());
                        direction = direction.reflect(normal).normalize();
                        hit.side
                    }
                    Turn::Through => hit.side.opposite(),
                    Turn::Absorbed => break,
                };
                departure = looking.geometry.leave(hit.position, hit.surface, onward);
            }
        }
    }

    /// The disc about `hit`: (4π/M) / (π A) times the energy that arrives in it.
    fn disc(
        &self,
        looking: &Looking<'_>,
        (receiver, seen_directly): (u32, bool),
        hit: &sonel_geometry::Hit,
        (length, sensitivity, towards): (f64, f64, glam::Vec3),
    ) -> GatherPoint {
        let mut disc = self.sheets[hit.surface.0 as usize].disc(looking.geometry, hit, self.disc_radius);
        let columns = looking.table.bands();
        disc.place = disc.place * columns as u32 + looking.column as u32;
        GatherPoint {
            receiver,
            length,
            start: glam::DVec3::ZERO,
            weight: Weight::from_vec(only(
                looking.column,
                columns,
                4.0 * sensitivity / (f64::from(self.rays) * disc.view.area),
            )),
            disc,
            seen_directly,
            is_followed: false,
            towards,
        }
    }
}

impl Looking<'_> {
    fn turn(&self, surface: SurfaceId, direction: glam::DVec3, uniform: f64) -> Turn {
        // Sonels know at which angle they reached the disc: its ray looks with the diffuse mean.
        let mean = self.table.mean_row(surface);
        let row = &*self.table.row(surface, direction);
        let of = |energy: &[Lanes]| energy.band(self.column);
        let diffuse = of(&mean.diffuse.energy);
        let mirror = diffuse + of(&row.specular.energy);
        let through = mirror + of(&row.transmitted.energy);
        match uniform {
            u if u < diffuse => Turn::Diffuse,
            u if u < mirror => Turn::Mirror,
            u if u < through => Turn::Through,
            _ => Turn::Absorbed,
        }
    }

    /// The source, if a leg of `leg` [m] (endless where it meets no wall) from `at` along `direction` comes by.
    fn source_on(
        &self,
        at: glam::DVec3,
        direction: glam::DVec3,
        leg: Option<f64>,
        length: f64,
    ) -> Option<SourceSight> {
        let offset = self.radiator.position - at;
        let along = offset.dot(direction);
        let miss_squared = offset.length_squared() - along * along;
        let radius_squared = self.source_radius * self.source_radius;
        let meets = along > 0.0 && leg.is_none_or(|leg| along < leg) && miss_squared <= radius_squared;
        meets.then(|| SourceSight {
            length: ((length + along) * (length + along) + miss_squared.max(0.0)).sqrt(),
            fluence: self.radiator.towards(-direction).factor(self.column) / (PI * radius_squared),
            towards: direction.as_vec3(),
            in_half: miss_squared <= 0.5 * radius_squared,
        })
    }
}

/// `value` in one column and nothing in the others.
pub(crate) fn only(column: usize, columns: usize, value: f64) -> Vec<Lanes> {
    let mut lanes = vec![Lanes::ZERO; sonel_map::lanes_of(columns)];
    *lanes.band_mut(column) = value;
    lanes
}
