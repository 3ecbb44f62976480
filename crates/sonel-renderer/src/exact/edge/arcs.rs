//! Apparent positions of source and receiver seen from an edge, where paths are arcs.
//!
//! With c₀ ds/c as length, arcs are the shortest ways of a hyperbolic space. Seen from a place P an end is put where its arc leaves P, as far as
//! c₀ t: arcs through P are straight there, and the edge has the field of even air. Directions, times, the boundary of the shadow and the sum
//! of wave and edge on it are exact; far in the shadow the wave is (g t₁)(g t₂)/6 of its amplitude too weak, with the times before and behind the edge.
//!
//! A plane is reached in that space as a sphere of the curvature k = (n · ∇c)/c₀, n its normal: it focuses sound where c rises from it. With
//! u = g t of the legs before and behind it, and θ the angle of incidence, a tube of rays has the widths
//!
//!   sinh(u₁ + u₂) − (2 k c₀/g) sinh u₁ sinh u₂ · (1/cos θ or cos θ)
//!
//! within and across the plane of incidence, in units of c₀/g.
//!
//! References: docs/physics.md §3, [KouyoumjianPathak1974] for edges and mirrors along rays (docs/references.md).

use glam::DVec3;
use sonel_geometry::{Arc, Departure, Geometry, SpeedProfile};
use sonel_map::CoefficientTable;

use super::mirror::Mirror;
use crate::partition::Partitions;

/// Steps towards a place of reflection; each but the first few squares its error.
const STEPS: usize = 30;
/// How near it they come, relative to the length of the path.
const CONVERGED: f64 = 1e-10;
/// Least width of a tube in the plane of incidence, relative to one without mirror: a mirror that focuses more has several arcs, or a caustic.
const FOCUSED: f64 = 0.25;
/// So many lifts above a mirror it is felt for.
const ABOVE: f64 = 16.0;

/// The speed of sound, and that of the scene [m/s].
pub(super) type Air = (SpeedProfile, f64);

/// An end of a path as it appears from an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Appearance {
    /// Straight [m].
    pub position: DVec3,
    /// Unit direction in which sound leaves the end.
    pub leaving: DVec3,
    /// Amplitude relative to a path as long without mirror.
    pub gain: f64,
}

/// How `end` appears from `place`, over `mirror` if there is one; [`None`] where no arc leads over it.
#[must_use]
pub(super) fn appearance(air: &Air, end: DVec3, mirror: Option<&Mirror>, place: DVec3) -> Option<Appearance> {
    let Some(mirror) = mirror else {
        let (position, leaving) = seen(air, place, end);
        return Some(Appearance { position, leaving, gain: 1.0 });
    };
    let point = reflection_point(air, mirror, end, place)?;
    let (from_place, _) = seen(air, place, point);
    let (before, leaving) = seen(air, point, end);
    let length = from_place.distance(place) + before.distance(point);
    let widths = widths(air, mirror, point, [end, place]);
    let towards = (from_place - place).normalize();
    let gain = 1.0 / (widths[0] * widths[1]).sqrt();
    (widths[0] >= FOCUSED).then_some(Appearance { position: place + length * towards, leaving, gain })
}

/// What the arc from `end` over `mirror`, if there is one, to `place` passes; [`None`] where something is on it that nothing passes.
#[must_use]
pub(super) fn passed(
    (geometry, table): (&Geometry, &CoefficientTable),
    air: &Air,
    end: DVec3,
    mirror: Option<&Mirror>,
    place: DVec3,
) -> Option<Partitions> {
    let leg = |from: DVec3, departure: Departure, to: DVec3| {
        let arc = (&Arc::between(air.0, from, to), air.0.travel_time(from, to));
        Partitions::along(geometry, table, departure.origin, arc, to.as_vec3())
    };
    let Some(mirror) = mirror else { return leg(end, Departure::free(end.as_vec3()), place) };
    let point = reflection_point(air, mirror, end, place)?;
    let above = ABOVE * f64::from(geometry.lift());
    let from = Departure::free((point + above * mirror.normal()).as_vec3());
    let hit = geometry.closest_hit(from, -mirror.normal().as_vec3())?;
    if hit.surface != mirror.surface || f64::from(hit.distance) > 2.0 * above {
        return None;
    }
    let mut passed = leg(end, Departure::free(end.as_vec3()), point)?;
    passed.extend(leg(point, geometry.leave(hit.position, hit.surface, hit.side), place)?);
    Some(passed)
}

/// Amplitude of a wave over an edge after `way` = c₀ t [m], relative to even air: that of a wave as long without edge.
#[must_use]
pub(super) fn weakening((profile, speed): &Air, receiver: DVec3, way: f64) -> f64 {
    let turn = profile.gradient().length() * way / speed;
    speed / profile.speed_at(receiver) * turn / libm::sinh(turn)
}

/// Where `end` appears from `place` [m], and the unit direction from it to `place`.
fn seen((profile, speed): &Air, place: DVec3, end: DVec3) -> (DVec3, DVec3) {
    let (arc, time) = (Arc::between(*profile, place, end), profile.travel_time(place, end));
    (place + speed * time * arc.direction(0.0), -arc.direction(time))
}

/// Widths of a tube of rays in and across the plane of incidence at `point` of a mirror, relative to one without mirror.
fn widths((profile, speed): &Air, mirror: &Mirror, point: DVec3, ends: [DVec3; 2]) -> [f64; 2] {
    let gradient = profile.gradient();
    let steepness = gradient.length();
    let [before, behind] = ends.map(|end| profile.travel_time(point, end) * steepness);
    let apart = libm::sinh(before) * libm::sinh(behind) / libm::sinh(before + behind);
    let curvature = mirror.normal().dot(gradient) / steepness;
    let (position, _) = seen(&(*profile, *speed), point, ends[0]);
    let cosine = (position - point).normalize().dot(mirror.normal());
    [1.0 / cosine, cosine].map(|slant| 1.0 - 2.0 * curvature * slant * apart)
}

/// Where the arc from `from` over `mirror` to `to` is reflected [m]: the straight path between both ends as they appear from there crosses the
/// mirror there. [`None`] where there is none near the straight path.
fn reflection_point(air: &Air, mirror: &Mirror, from: DVec3, to: DVec3) -> Option<DVec3> {
    let cross = |from: DVec3, to: DVec3| {
        let [above, beyond] = [from, to].map(|end| mirror.height(end));
        let foot = |end: DVec3, height: f64| end - height * mirror.normal();
        let share = above / (above + beyond);
        let found = foot(from, above) + share * (foot(to, beyond) - foot(from, above));
        (above > 0.0 && beyond > 0.0).then_some(found)
    };
    let mut point = cross(from, to)?;
    for _ in 0..STEPS {
        let [one, other] = [from, to].map(|end| seen(air, point, end).0);
        let step = cross(one, other)? - point;
        if step.length() <= CONVERGED * one.distance(other) {
            return Some(point + step);
        }
        // What a step is too short by: the width of the tube.
        let [within, _] = widths(air, mirror, point, [from, to]);
        point += step / within.max(FOCUSED);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;
    use sonel_geometry::{Mesh, MeshTriangle, Side, SurfaceId};

    const SPEED: f64 = 340.0;

    fn air(gradient: f64) -> Air {
        (SpeedProfile::new(SPEED, gradient * DVec3::Z).unwrap(), SPEED)
    }

    /// The side with z > 0 of a plane through the origin with this normal.
    fn mirror(normal: DVec3) -> Mirror {
        let (u, v) = normal.any_orthonormal_pair();
        let vertices = vec![u, v, -u, -v];
        let triangles = [[0, 1, 2], [0, 2, 3]].map(|corners| MeshTriangle { corners, material: 0 }).to_vec();
        let geometry = sonel_geometry::Geometry::build(Mesh { vertices, triangles }).unwrap();
        let side =
            if geometry.surface(SurfaceId(0)).normal.dot(normal) > 0.0 { Side::Front } else { Side::Back };
        let mirror = Mirror::new(&geometry, SurfaceId(0), side);
        assert!((geometry.center().dot(normal)).abs() < 1e-9);
        mirror
    }

    /// Where an arc from `from` in `direction` is after being mirrored at the plane and `time` more.
    fn reflected(air: &Air, mirror: &Mirror, from: DVec3, direction: DVec3, time: f64) -> DVec3 {
        let arc = Arc::leaving(air.0, from, direction);
        let (mut low, mut high) = (0.0, 2.0);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if mirror.height(arc.at(middle)) > 0.0 { low = middle } else { high = middle }
        }
        let down = arc.direction(low);
        let up = down - 2.0 * down.dot(mirror.normal()) * mirror.normal();
        Arc::leaving(air.0, arc.at(low), up).at(time)
    }

    #[test]
    fn mirrored_arcs_have_the_direction_time_and_width_of_their_rays() {
        let (end, place) = (dvec3(0.0, 0.0, 6.0), dvec3(70.0, 15.0, 9.0));
        for gradient in [0.1, -0.1, 0.5, 1e-7] {
            for normal in [DVec3::Z, dvec3(0.1, -0.2, 1.0).normalize()] {
                let (air, mirror) = (air(gradient), mirror(normal));
                let found = appearance(&air, end, Some(&mirror), place).unwrap();
                let point = reflection_point(&air, &mirror, end, place).unwrap();
                let time = air.0.travel_time(point, place);
                let arrives = |direction: DVec3| reflected(&air, &mirror, end, direction, time);
                assert!(arrives(found.leaving).distance(place) < 1e-6, "{gradient} {normal}");
                let total = time + air.0.travel_time(end, point);
                assert!((found.position.distance(place) / (SPEED * total) - 1.0).abs() < 1e-12);
                let (right, up) = found.leaving.any_orthonormal_pair();
                let width = 1e-4;
                let moved = |way: DVec3| {
                    let at = |sign: f64| arrives((found.leaving + sign * width * way).normalize());
                    (at(1.0) - at(-1.0)) / (2.0 * width)
                };
                let towards = (place - found.position).normalize();
                let area = moved(right).cross(moved(up)).dot(towards).abs();
                let weak = weakening(&air, place, SPEED * total) / (SPEED * total) * found.gain;
                assert!(
                    (weak * weak * area - 1.0).abs() < 1e-5,
                    "{gradient} {normal}: {}",
                    weak * weak * area
                );
            }
        }
    }

    #[test]
    fn what_appears_without_a_mirror_has_the_spread_of_its_arc() {
        let (end, place) = (dvec3(0.0, 0.0, 6.0), dvec3(70.0, 15.0, -20.0));
        for gradient in [0.1, -3.0, 1e-9] {
            let air = air(gradient);
            let found = appearance(&air, end, None, place).unwrap();
            let way = found.position.distance(place);
            let weak = weakening(&air, place, way) / way;
            assert!((weak * weak / air.0.spread(end, place) - 1.0).abs() < 1e-9);
            if (0.0..1e-6).contains(&gradient) {
                assert!(found.position.distance(end) < 1e-6);
            }
        }
    }
}
