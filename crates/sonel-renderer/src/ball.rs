//! The receiver sphere: the volume about a receiver in which segments of packets are counted.
//!
//! Fluence is path length per volume: F = Σ e ℓ / V over all segments, ℓ the length of a segment within the volume V. The
//! volume is the part of a sphere of radius r that the receiver sees. So it may reach beyond the nearest wall, and a
//! receiver beside a wall has no more noise than one in the middle of the room. The bias is that of averaging over the ball
//! (docs/physics.md §4).
//!
//! Late sound varies less from place to place and its paths are rarer: the ball grows with the length that a path has gone.
//! Early paths with specular reflections alone are beams with sharp borders: they have a ball of half the radius. Beams that an interface
//! refracts near the critical angle vary with the height over it: their ball ends well before it.

use core::f64::consts::PI;

use glam::{DVec3, Vec3};
use sonel_geometry::{Departure, Geometry};
use sonel_sampling::{ScrambledSobol, warp};

/// Factor on the squared share of the radius at which a segment passes; the digits behind the point then choose by chance.
const DIGITS: f64 = 10_000.0;
/// Rays that measure how much of a ball a receiver sees: a standard error of some thousandths.
const RAYS: u32 = 8192;

/// Largest radius over the distance to the nearest surface [1] of a ball that must hold no wall. Chosen; at 1 it touches the wall.
pub(crate) const CLEARANCE: f64 = 0.95;
/// Factors on the radius [1] and the path lengths [mean free paths] from which on they count. With four times the radius at the end levels were
/// up to 0.2 dB too high.
const GROWTH: [(f64, f64); 4] = [(1.0, 0.0), (1.25, 16.0), (1.6, 32.0), (2.0, 64.0)];
/// Factor on the first radius for paths that were reflected specularly alone [1]: with 1 the hall was 1.2 % too loud from 0.2 to 0.5 s.
const MIRRORED: f64 = 0.5;
/// Part of the way to the next interface that the ball of refracted beams takes: the bias stays below 0.14 dB up to 87° from the normal,
/// where a ball that touches the interface is 0.5 dB too loud.
const REFRACTED_CLEARANCE: f64 = 0.5;

/// Radii within which a path is near: 256 of them are where one crosses the ball.
const NEARBY: f64 = 16.0;

/// Kind of a path for the ball that it crosses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BeamKind {
    /// Reflected diffusely.
    Diffused,
    /// Reflected specularly alone.
    Mirrored,
    /// Not reflected diffusely, but met an interface between airs.
    Refracted,
}

impl BeamKind {
    /// All kinds.
    pub(crate) const ALL: [Self; 3] = [Self::Diffused, Self::Mirrored, Self::Refracted];
}

/// Surroundings of a receiver.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AboutReceiver<'a> {
    /// How far the sound that comes to it goes at a time [m]: the mean free path, of what comes from farther off the distance.
    pub free_path: f64,
    /// Distance of the next interface between airs [m]; infinite without any.
    pub interface: f64,
    /// cos θ / d² of some of the sonels that it sees [1/m²].
    pub solid_angles: &'a [f64],
}

/// The balls of a receiver, one for each range of path lengths.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Balls {
    balls: [ReceiverSphere; GROWTH.len()],
    /// The first one for paths that were reflected specularly alone.
    mirrored: ReceiverSphere,
    /// The first one for beams that an interface refracted.
    refracted: ReceiverSphere,
    mean_free_path: f64,
}

impl Balls {
    /// Balls about `center` (about the scene's centre [m]), of `radius` [m] for early sound; the next surface is `nearest` [m] away.
    #[must_use]
    pub(crate) fn new(
        geometry: &Geometry,
        center: DVec3,
        radius: f64,
        nearest: f64,
        about: AboutReceiver<'_>,
    ) -> Self {
        // The size of an open scene does not say how far the field about a receiver is alike.
        let closed = geometry.is_closed_room();
        let radius = |growth| if closed { growth * radius } else { radius.min(CLEARANCE * nearest) };
        let is_cut = GROWTH.iter().any(|&(growth, _)| radius(growth) > nearest);
        let distances = if is_cut { distances(geometry, center) } else { Vec::new() };
        let ball = |(growth, _)| ReceiverSphere::new(center, radius(growth), nearest, &distances);
        let beams = radius(1.0).min(REFRACTED_CLEARANCE * about.interface);
        Self {
            balls: GROWTH.map(ball),
            mirrored: ball((MIRRORED, 0.0)),
            refracted: ReceiverSphere::new(center, beams, nearest, &distances),
            mean_free_path: about.free_path,
        }
    }

    /// Radius for early sound [m].
    #[must_use]
    pub(crate) fn early_radius(&self) -> f64 {
        self.balls[0].radius
    }

    /// The ball for early paths that were reflected specularly alone.
    #[must_use]
    pub(crate) fn mirrored(&self) -> &ReceiverSphere {
        &self.mirrored
    }

    /// Whether paths of `length` [m] are early.
    #[must_use]
    pub(crate) fn is_early(&self, length: f64) -> bool {
        length < GROWTH[1].1 * self.mean_free_path
    }

    /// The ball for paths that have gone `length` [m].
    #[inline]
    #[must_use]
    pub(crate) fn at(&self, length: f64, beam: BeamKind) -> &ReceiverSphere {
        let grown = |(_, from): &(f64, f64)| from * self.mean_free_path <= length;
        match (GROWTH.iter().rposition(grown).unwrap_or(0), beam) {
            (0, BeamKind::Mirrored) => &self.mirrored,
            (0, BeamKind::Refracted) => &self.refracted,
            (growth, _) => &self.balls[growth],
        }
    }
}

/// A ball about a receiver.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ReceiverSphere {
    /// Centre relative to the scene's centre [m].
    center: DVec3,
    /// Radius [m].
    radius: f64,
    /// Volume visible from the receiver [m³].
    volume: f64,
    /// Visible volume of the ball of half the cross section [m³].
    inner_volume: f64,
    /// Whether no surface reaches into it.
    is_whole: bool,
}

/// The part of a segment within a ball.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chord {
    /// Distance from the start of the segment at which its line passes the centre [m].
    pub at: f64,
    /// Length per volume [1/m²].
    pub fluence: f64,
    /// Ratio of the estimate of the ball of half the cross section to this one [1].
    pub gain: f64,
}

/// How far one sees from `center` (about the scene's centre [m]) in directions that are spread evenly [m].
fn distances(geometry: &Geometry, center: DVec3) -> Vec<f64> {
    let directions = ScrambledSobol::numbered(0, 0, 0);
    let departure = Departure::free(center.as_vec3());
    let distance = |ray| {
        let hit = geometry.closest_hit(departure, warp::uniform_sphere(directions.point(ray)));
        hit.map_or(f64::INFINITY, |hit| f64::from(hit.distance))
    };
    (0..RAYS).map(distance).collect()
}

impl ReceiverSphere {
    /// Radius [m].
    #[must_use]
    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    /// Whether the line of a segment passes the centre within the radius, at a point of the segment.
    #[inline]
    #[must_use]
    pub(crate) fn is_passed(&self, (start, end): (Vec3, Vec3)) -> bool {
        let (along, offset) = ((end - start).as_dvec3(), self.center - start.as_dvec3());
        let (projected, extent_squared) = (offset.dot(along), along.length_squared());
        let miss_squared = offset.length_squared() * extent_squared - projected * projected;
        projected >= 0.0
            && projected < extent_squared
            && miss_squared < self.radius * self.radius * extent_squared
    }

    /// Mean fluence of a packet of energy 1 that crosses the ball [1/m²].
    #[must_use]
    pub(crate) fn fluence_per_crossing(&self) -> f64 {
        1.0 / (PI * self.radius * self.radius)
    }

    /// The ball of `radius` [m] about `center` (about the scene's centre [m]), `nearest` [m] away from all surfaces. `distances` are how far
    /// one sees from there; they do not matter to a ball that no surface reaches into.
    fn new(center: DVec3, radius: f64, nearest: f64, distances: &[f64]) -> Self {
        let inner = radius * core::f64::consts::FRAC_1_SQRT_2;
        let whole = |radius: f64| 4.0 / 3.0 * PI * radius * radius * radius;
        let ball = Self {
            center,
            radius,
            volume: whole(radius),
            inner_volume: whole(inner),
            is_whole: nearest >= radius,
        };
        if ball.is_whole {
            return ball;
        }
        let mean = |radius: f64| {
            distances.iter().map(|distance| whole(distance.min(radius))).sum::<f64>() / distances.len() as f64
        };
        Self { volume: mean(radius), inner_volume: mean(inner), ..ball }
    }

    /// Whether a segment passes within [`NEARBY`] radii of the centre, which sees it there: behind a wall or a pane it is another matter.
    #[must_use]
    pub(crate) fn is_passed_nearby(&self, geometry: &Geometry, (start, end): (Vec3, Vec3)) -> bool {
        let (along, offset) = ((end - start).as_dvec3(), self.center - start.as_dvec3());
        let nearest = (offset.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let (aside, reach) = (offset - nearest * along, NEARBY * self.radius);
        let place = (self.center - aside).as_vec3();
        aside.length_squared() < reach * reach
            && !geometry.is_blocked(Departure::free(self.center.as_vec3()), place)
    }

    /// The part of the segment from `start` to `end` [m] that the receiver sees within the ball.
    ///
    /// Where surfaces reach into the ball one point stands for the part. It is chosen by digits of the distance at which the segment passes,
    /// which are as good as random.
    #[inline]
    #[must_use]
    pub(crate) fn chord(&self, geometry: &Geometry, (start, end): (Vec3, Vec3)) -> Option<Chord> {
        let along = (end - start).as_dvec3();
        let extent_squared = along.length_squared();
        let offset = self.center - start.as_dvec3();
        let radius_squared = self.radius * self.radius;
        // Everything times the squared extent, so that a miss costs neither root nor division.
        let projected = offset.dot(along);
        let miss_squared = offset.length_squared() * extent_squared - projected * projected;
        if miss_squared > radius_squared * extent_squared || extent_squared <= 0.0 {
            return None;
        }
        let extent = extent_squared.sqrt();
        let (nearest, miss_squared) = (projected / extent, miss_squared / extent_squared);
        // Points within rounding of the surfaces at the ends may be behind them.
        let margin = f64::from(geometry.lift());
        let within = |radius_squared: f64| {
            let half = (radius_squared - miss_squared).max(0.0).sqrt();
            [(nearest - half).max(margin), (nearest + half).min(extent - margin)]
        };
        let [from, to] = within(radius_squared);
        if to <= from {
            return None;
        }
        let [inner_from, inner_to] = within(0.5 * radius_squared);
        let inner_share = if self.is_whole {
            (inner_to - inner_from).max(0.0) / (to - from)
        } else {
            let digits = DIGITS * miss_squared / radius_squared;
            let at = from + (to - from) * (digits - digits.floor());
            let point = start.as_dvec3() + along * (at / extent);
            let ends = [point, self.center].map(|end| Departure::free(end.as_vec3()));
            if geometry.is_blocked_between_surfaces(ends[0], ends[1]) {
                return None;
            }
            f64::from(u8::from(at > inner_from && at < inner_to))
        };
        let gain = inner_share * self.volume / self.inner_volume;
        Some(Chord { at: nearest, fluence: (to - from) / self.volume, gain })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;
    use sonel_geometry::Mesh;
    use sonel_testkit::uniform::Uniform;

    /// Mean fluence and mean gain over many random parallel beams of unit fluence through a ball beside a wall.
    fn of_unit_fluence(height: f64) -> (f64, f64) {
        let geometry = Geometry::build(Mesh::shoebox([4.0, 4.0, 4.0], [0; 6])).unwrap();
        let center = dvec3(0.1, -0.2, -2.0 + height);
        let ball = ReceiverSphere::new(center, 0.5, height, &distances(&geometry, center));
        let mut random = Uniform::new(5);
        let count = 40_000;
        let (mut sum, mut inner) = (0.0, 0.0);
        for _ in 0..count {
            let direction = DVec3::from(random.unit_vector());
            let (across, aside) = direction.any_orthonormal_pair();
            // Beams over a square of one metre: a fluence of one each, if each carries one per square metre.
            let [u, v] = [random.between(-0.5, 0.5), random.between(-0.5, 0.5)];
            let foot = center + across * u + aside * v;
            let clip = |t: f64| {
                let point = foot + direction * t;
                if point.z >= -2.0 { point } else { foot + direction * ((-2.0 - foot.z) / direction.z) }
            };
            if foot.z < -2.0 {
                // The line enters the room further on.
                let entry = (-2.0 - foot.z) / direction.z;
                let (a, b) = (foot + direction * entry, foot + direction * (entry + entry.signum()));
                if let Some(chord) = ball.chord(&geometry, (a.as_vec3(), b.as_vec3())) {
                    sum += chord.fluence;
                    inner += chord.fluence * chord.gain;
                }
                continue;
            }
            let segment = (clip(-1.0).as_vec3(), clip(1.0).as_vec3());
            if let Some(chord) = ball.chord(&geometry, segment) {
                sum += chord.fluence;
                inner += chord.fluence * chord.gain;
            }
        }
        (sum / f64::from(count), inner / f64::from(count))
    }

    /// Fluence is one whatever the wall takes of the ball, and the inner ball finds as much.
    #[test]
    fn a_ball_beside_a_wall_finds_the_fluence_of_one_in_the_air() {
        for height in [0.6, 0.4, 0.1, 0.001] {
            let (whole, inner) = of_unit_fluence(height);
            assert!((whole - 1.0).abs() < 0.02 && (inner - 1.0).abs() < 0.04, "{height}: {whole} {inner}");
        }
    }
}
