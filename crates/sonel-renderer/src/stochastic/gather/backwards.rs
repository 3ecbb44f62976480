//! The law of bending, seen against the packets.
//!
//! A packet on its way with the foot F at the distance b from an edge is turned by θ, t = tan θ normal with the deviation 1/(c b), and goes
//! on over F. A ray that looks against it passes the edge at b′ = b cos θ with a foot F′ of its own; F is b′ t behind that, in the plane
//! normal to the edge. Turning keeps the angle between ways and narrows their distance by cos θ, so that radiance arrives as
//!
//!   L′ = ∫ dt p(t; b) / cos θ · L,  b = b′ √(1 + t²).
//!
//! The place x of F on the ray says all of it: the edge is the nearest in sight from there, t and b follow, and with the ray's slope over the
//! edge cos β
//!
//!   L′ = ∫ dx p(t; b) cos β b / b′² · L.
//!
//! Places are drawn with t √(1 + t²) normal with the deviation 1/(c b′), which leaves weights (1 + t²)^{3/2} / (1 + 2t²).
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use core::f64::consts::FRAC_1_SQRT_2;

use glam::DVec3;
use sonel_diffraction::bending;
use sonel_geometry::{EdgeLine, Nearby};

/// Deviations beyond which nothing is expected.
const WIDEST: f64 = 9.0;

/// The place of F for a `normal` number [m].
pub fn place(near: &Nearby, normal: f64, concentration: f64) -> f64 {
    let scaled = normal / (concentration * near.distance);
    // t² of t √(1 + t²).
    let square = 2.0 * scaled * scaled / (1.0 + (1.0 + 4.0 * scaled * scaled).sqrt());
    near.at + square.sqrt().copysign(normal) * near.distance / near.level
}

/// The number for which [`place`] is `at`.
fn normal(near: &Nearby, at: f64, concentration: f64) -> f64 {
    let shift = (at - near.at) * near.level;
    concentration * shift * (1.0 + shift * shift / (near.distance * near.distance)).sqrt()
}

/// Density of [`place`] [1/m].
pub fn density(near: &Nearby, at: f64, concentration: f64) -> f64 {
    let shift = (at - near.at) * near.level;
    if concentration * shift.abs() > WIDEST {
        return 0.0;
    }
    let tangent = shift / near.distance;
    let square = tangent * tangent;
    let distance = near.distance * (1.0 + square).sqrt();
    let narrowed = (1.0 + 2.0 * square) / (1.0 + square);
    bending::density(tangent, concentration, distance) * narrowed * near.level / near.distance
}

/// Probability that [`place`] is on the part that is near, and within `reach` of the edge [m].
pub fn likelihood(near: &Nearby, concentration: f64, reach: f64) -> f64 {
    if near.distance > reach {
        return 0.0;
    }
    let within = (reach * reach - near.distance * near.distance).sqrt() / near.level;
    let [from, to] = [near.part[0].max(near.at - within), near.part[1].min(near.at + within)];
    if from >= to {
        return 0.0;
    }
    let below = |at: f64| {
        let normal = normal(near, at, concentration).clamp(-WIDEST, WIDEST);
        0.5 * libm::erfc(-normal * FRAC_1_SQRT_2)
    };
    below(to) - below(from)
}

/// A packet that is turned into the ray.
pub struct ReverseBend {
    /// Unit direction of the packet before.
    pub before: DVec3,
    /// b [m].
    pub distance: f64,
    /// t.
    pub tangent: f64,
    /// b / b′² · cos β [1/m].
    spread: f64,
}

impl ReverseBend {
    /// The packet with the foot `place` and the nearest `point` of the edge along `line` that goes on against `direction`; [`None`] where it
    /// would have to turn by a right angle and more.
    #[must_use]
    pub fn new(line: &EdgeLine, point: DVec3, place: DVec3, direction: DVec3) -> Option<Self> {
        let (distance, after) = (place.distance(point), -direction);
        let outward = (place - point) / distance;
        let tangential = line.along.cross(outward);
        let forward = if tangential.dot(after) >= 0.0 { tangential } else { -tangential };
        let (ahead, aside) = (forward.dot(after), outward.dot(after));
        let level = line.along.cross(direction).length();
        if distance <= 0.0 || ahead <= f64::EPSILON * level {
            return None;
        }
        let near = distance * ahead / level;
        Some(Self {
            before: after.dot(line.along) * line.along + level * forward,
            distance,
            tangent: -aside / ahead,
            spread: distance / (near * near) * level,
        })
    }

    /// p(t; b) cos β b / b′² [1/m].
    #[must_use]
    pub fn density(&self, concentration: f64) -> f64 {
        bending::density(self.tangent, concentration, self.distance) * self.spread
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use glam::dvec3;
    use sonel_geometry::Side;
    use sonel_sampling::{Purpose, StreamFamily, warp};
    use sonel_testkit::z_test::{Estimate, Within, within_sigmas};

    /// An edge that slants past the origin.
    fn line() -> EdgeLine {
        EdgeLine::new([dvec3(-3.0, -9.0, 1.0), dvec3(2.0, 9.0, -2.0)])
    }

    /// A ray along x whose line comes as near to the edge as `distance`, and that line's place in it.
    fn ray(distance: f64) -> (Nearby, DVec3, DVec3) {
        let (line, direction) = (line(), DVec3::X);
        let across = line.along.cross(direction).normalize();
        let at = 4.0;
        let origin = line.point(8.0) + distance * across - at * direction;
        let level = line.along.cross(direction).length();
        (Nearby { edge: 0, at, distance, level, part: [-50.0, 50.0] }, origin, direction)
    }

    /// The packet that is turned into the ray at `at`.
    fn turned(of: &(Nearby, DVec3, DVec3), at: f64) -> Option<ReverseBend> {
        let (line, place) = (line(), of.1 + at * of.2);
        let nearest = line.point((place - line.origin).dot(line.along));
        ReverseBend::new(&line, nearest, place, of.2)
    }

    #[test]
    fn turning_back_undoes_turning() {
        let line = line();
        for (tangent, side) in
            [(0.3, Side::Front), (-2.5, Side::Back), (0.0, Side::Front), (40.0, Side::Back)]
        {
            let point = line.point(7.0);
            let outward = 0.4 * line.along.any_orthonormal_vector();
            let foot = point + outward;
            let forward = side.sign() * line.along.cross(outward).normalize();
            let before = 0.6 * forward + 0.8 * line.along;
            let after = line.turned(foot, before, side, tangent);
            let back = ReverseBend::new(&line, point, foot, -after).unwrap();
            assert!(back.before.distance(before) < 1e-12 && (back.distance - 0.4).abs() < 1e-12);
            assert!((back.tangent - tangent).abs() < 1e-9 * (1.0 + tangent * tangent), "{}", back.tangent);
        }
    }

    /// What is turned into rays at all distances, of light that is the same everywhere, less what went straight [m].
    fn gained(weight: impl Fn(&ReverseBend) -> f64) -> f64 {
        let concentration = bending::concentration(1.0);
        let (nearest, farthest, steps, width) = (1e-5_f64, 60.0_f64, 1500, 0.012);
        let stretch = (farthest / nearest).ln() / f64::from(steps);
        let gained_at = |distance: f64| {
            let of = ray(distance);
            // Places by their normal numbers, so that near and far ones come alike.
            let brought = (-500..500).map(|number| {
                let normal = (f64::from(number) + 0.5) * width;
                let at = place(&of.0, normal, concentration);
                let stretch = (-0.5 * normal * normal).exp() / TAU.sqrt() / density(&of.0, at, concentration);
                turned(&of, at).map_or(0.0, |back| weight(&back) * back.density(concentration) * stretch)
            });
            brought.sum::<f64>() * width - 1.0
        };
        let distances = (0..steps).map(|step| nearest * ((f64::from(step) + 0.5) * stretch).exp());
        distances.map(|distance| gained_at(distance) * distance * stretch).sum()
    }

    #[test]
    fn as_much_is_turned_into_rays_as_out_of_them() {
        let gain = gained(|_| 1.0);
        assert!(gain.abs() < 2e-3, "{gain} m");
        let spoilt = gained(|back| 1.0 / (1.0 + back.tangent * back.tangent).sqrt());
        assert!(spoilt.abs() > 0.01, "the law of packets taken for that of rays: {spoilt} m");
    }

    #[test]
    fn drawn_places_bring_on_average_what_all_bring() {
        let mut stream = StreamFamily::new(5, Purpose::VisibilityRay, [0; 4]).stream(0);
        for (distance, wavelength) in [(0.003, 2.7), (0.05, 0.3), (0.4, 0.3), (2.0, 2.7)] {
            let (of, concentration) = (ray(distance), bending::concentration(wavelength));
            let (mut all, width) = (0.0, 1e-5 * wavelength);
            for step in -300_000..300_000 {
                let at = of.0.at + (f64::from(step) + 0.5) * width;
                all += turned(&of, at).map_or(0.0, |back| back.density(concentration)) * width;
            }
            let samples: Vec<f64> = (0..20_000)
                .map(|_| {
                    let [normal, _] = warp::normal_pair(stream.uniform_pair());
                    let at = place(&of.0, normal, concentration);
                    turned(&of, at).unwrap().density(concentration) / density(&of.0, at, concentration)
                })
                .collect();
            let within = Within { sigmas: 4.0, maximal_sigma: 0.02 * all };
            within_sigmas(Estimate::of(&samples), all, within).unwrap();
            assert!(within_sigmas(Estimate::of(&samples), 1.1 * all, within).is_err(), "another sum");
        }
    }

    #[test]
    fn places_are_as_likely_as_their_density_says() {
        let concentration = bending::concentration(0.5);
        for (distance, part) in [(0.02, [3.99, 4.05]), (0.5, [-50.0, 4.03]), (0.5, [4.1, 4.2])] {
            let near = Nearby { part, ..ray(distance).0 };
            let (steps, from, to) = (200_000, part[0].max(3.0), part[1].min(5.0));
            let width = (to - from) / f64::from(steps);
            let sum: f64 = (0..steps)
                .map(|step| density(&near, from + (f64::from(step) + 0.5) * width, concentration) * width)
                .sum();
            assert!((sum - likelihood(&near, concentration, 9.0)).abs() < 1e-6, "{sum}");
        }
        let near = ray(0.5).0;
        assert!((likelihood(&near, concentration, 9.0) - 1.0).abs() < 1e-12);
        assert!(likelihood(&near, concentration, 0.4) <= 0.0, "out of reach");
    }
}
