//! L E R as the paper has it: how much of the first Fresnel zone is seen, [Kapralos2006] section 3.1.3.
//!
//! The wave front is a sphere about the source through the edge, ρ = |S p|; D = |S R|. Its first zone is what lies no further from the
//! receiver than r₀ + λ/2, r₀ = D − ρ: a cap about the line S R with cos φ₁ = (ρ² + D² − (r₀ + λ/2)²)/(2ρD). Points are uniform on it
//! (in cos φ), v₁ is the share of them that both source and receiver see, and v₁ times the energy without obstacle is what the
//! edge brings. docs/paper-mode.md says how far off that is: v₁ depends on the Fresnel number alone and ends at 1.

use core::f64::consts::TAU;

use glam::DVec3;
use sonel_diffraction::{Wedge, apex};
use sonel_geometry::{Departure, Edge, Geometry};
use sonel_sampling::ScrambledSobol;

/// The first Fresnel zone of one edge between a source and a receiver.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FirstZone {
    source: DVec3,
    /// Unit vector to the receiver, and two across it.
    axes: [DVec3; 3],
    /// ρ [m].
    radius: f64,
    /// cos φ₁.
    border: f64,
}

/// All edges of `geometry` that diffract, each once, about the scene's centre.
#[must_use]
pub(crate) fn edges(geometry: &Geometry) -> Vec<Wedge> {
    let local = |point: DVec3| point - geometry.center();
    let wedge = |edge: &Edge| {
        // No two of its sectors span more than half of the air: the first is the only one.
        let sector = edge.sectors.first()?;
        Wedge::new(edge.ends.map(local), sector.inward, sector.normal, sector.angle)
    };
    geometry.diffracting_edges().filter_map(wedge).collect()
}

/// The place of an edge where the way over it from source to receiver is shortest; [`None`] where either is within the
/// solid, or where the receiver does not see it: no visibility ray would meet it.
#[must_use]
pub(crate) fn place_on(edge: &Wedge, geometry: &Geometry, [source, receiver]: [DVec3; 2]) -> Option<DVec3> {
    let along = apex(edge.locate(source)?, edge.locate(receiver)?);
    let place = edge.at(along.clamp(0.0, edge.length()));
    let blocked = geometry.is_blocked(Departure::free(receiver.as_vec3()), place.as_vec3());
    (!blocked).then_some(place)
}

impl FirstZone {
    /// The zone of the edge at `place`; [`None`] where the wave has passed the receiver before it comes to the edge, and
    /// without a wavelength.
    #[must_use]
    pub(crate) fn new(source: DVec3, receiver: DVec3, place: DVec3, wavelength: f64) -> Option<Self> {
        let (radius, distance) = (source.distance(place), source.distance(receiver));
        let axis = (receiver - source).try_normalize()?;
        let (across, aside) = axis.any_orthonormal_pair();
        let farthest = distance - radius + 0.5 * wavelength;
        let border =
            (radius * radius + distance * distance - farthest * farthest) / (2.0 * radius * distance);
        (radius > 0.0 && radius < distance && wavelength > 0.0).then(|| Self {
            source,
            axes: [axis, across, aside],
            radius,
            // A wavelength beyond all lengths makes the whole sphere one zone.
            border: border.clamp(-1.0, 1.0),
        })
    }

    /// The point that two uniform numbers select, uniform on the zone.
    #[must_use]
    pub(crate) fn point(&self, [u, v]: [f32; 2]) -> DVec3 {
        let cosine = 1.0 - f64::from(u) * (1.0 - self.border);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (turn_sine, turn_cosine) = libm::sincos(TAU * f64::from(v));
        let [axis, across, aside] = self.axes;
        self.source + self.radius * (cosine * axis + sine * (turn_cosine * across + turn_sine * aside))
    }

    /// v₁: the share of `count` points of `sequence` that are `seen`.
    #[must_use]
    pub(crate) fn visibility(
        &self,
        sequence: &ScrambledSobol,
        count: u32,
        seen: impl Fn(DVec3) -> bool,
    ) -> f64 {
        let visible = (0..count).filter(|&index| seen(self.point(sequence.point(index)))).count();
        visible as f64 / f64::from(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    const WAVELENGTH: f64 = 343.0 / 2000.0;
    const AWAY: f64 = 10.0;

    /// Source and receiver on either side of the half plane x = 0, z < 0, `depth` below its edge: Fresnel number, v₁ with both
    /// rays tested and v₁ with the ray to the receiver alone.
    fn behind_a_screen(depth: f64) -> (f64, [f64; 2]) {
        let (source, receiver) = (DVec3::new(-AWAY, 0.0, -depth), DVec3::new(AWAY, 0.0, -depth));
        let clear = |a: DVec3, b: DVec3| {
            let share = a.x / (a.x - b.x);
            !(0.0..=1.0).contains(&share) || a.z + share * (b.z - a.z) > 0.0
        };
        let zone = FirstZone::new(source, receiver, DVec3::ZERO, WAVELENGTH).unwrap();
        let sequence = ScrambledSobol::from_keys([7, 11]);
        let both = zone.visibility(&sequence, 1 << 14, |p| clear(source, p) && clear(p, receiver));
        let one = zone.visibility(&sequence, 1 << 14, |p| clear(p, receiver));
        let detour = 2.0 * (AWAY.hypot(depth) - AWAY);
        (2.0 * detour / WAVELENGTH, [both, one])
    }

    /// The closed form holds to λ over the distances, a hundredth here.
    #[test]
    fn the_visibility_of_a_screen_is_a_function_of_the_fresnel_number() {
        let mut furthest: f64 = 0.0;
        for step in 0..=20 {
            let (number, [visibility, _]) = behind_a_screen(0.05 * f64::from(step));
            let u = number.sqrt().min(1.0);
            let expected = (u.acos() - u * (1.0 - u * u).sqrt()) / PI;
            assert!((visibility - expected).abs() < 0.01, "N {number}: {visibility} not {expected}");
            furthest = furthest.max(number);
        }
        assert!(furthest > 1.1, "nothing beyond the end of v1");
    }

    #[test]
    fn at_the_shadow_boundary_half_is_left_and_beyond_fresnel_number_one_nothing() {
        let level = 10.0 * behind_a_screen(0.0).1[0].log10();
        assert!((level + 3.0103).abs() < 0.1, "{level} dB");
        assert!(behind_a_screen(1.0).1[0] <= 0.0);
    }

    /// Visibility in deep shadow if only the ray to the receiver is tested.
    #[test]
    fn without_the_source_s_ray_deep_shadow_would_be_fully_lit() {
        assert!(behind_a_screen(5.0).1[1] >= 1.0);
    }

    #[test]
    fn points_fill_the_cap_up_to_its_border_evenly() {
        let (source, receiver) = (DVec3::ZERO, DVec3::X * 20.0);
        let zone = FirstZone::new(source, receiver, DVec3::X * 8.0, 1.0).unwrap();
        let points: Vec<DVec3> =
            (0..1024).map(|index| zone.point(ScrambledSobol::from_keys([1, 2]).point(index))).collect();
        let farthest = points.iter().map(|p| p.distance(receiver)).fold(0.0, f64::max);
        assert!(farthest <= 12.5 && farthest > 12.49, "{farthest}");
        assert!(points.iter().all(|p| (p.length() - 8.0).abs() < 1e-9));
        let mean = points.iter().map(|p| p.x / 8.0).sum::<f64>() / 1024.0;
        assert!((mean - 0.5 * (1.0 + zone.border)).abs() < 1e-4);
    }

    #[test]
    fn an_edge_behind_the_receiver_has_no_zone() {
        let zone = |x: f64| FirstZone::new(DVec3::ZERO, DVec3::X * 20.0, DVec3::X * x, 1.0);
        assert!(zone(21.0).is_none() && zone(0.0).is_none() && zone(19.0).is_some());
    }
}
