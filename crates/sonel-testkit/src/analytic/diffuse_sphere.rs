//! The sphere with Lambertian walls, whose decay is known exactly.
//!
//! Chords that leave a wall point of a sphere with the cosine law end evenly distributed over the sphere, whatever
//! happened before: their lengths are independent with density l/(2R²) on 0…2R. Hence the energy decays with the
//! rate μ that solves (1 − α) ∫ l/(2R²) e^(μ l/c) dl = 1, and from the second arrival on the irradiance is uniform.
//! Without loss in the air; loss in the air adds m·c to the rate, exactly.
//!
//! Reference: [Kuttruff2009], diffuse reflections, with the chord law of the sphere.

use std::f64::consts::{LN_10, PI};

/// A sphere whose wall reflects 1 − α of the energy after the cosine law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiffuseSphere {
    /// Radius R [m].
    pub radius: f64,
    /// Absorption coefficient α, 0…1 exclusive.
    pub absorption: f64,
    /// Speed of sound c [m/s].
    pub speed_of_sound: f64,
}

impl DiffuseSphere {
    /// Decay rate μ of the energy [1/s], by bisection to the last bit.
    pub fn decay_rate(&self) -> f64 {
        assert!(
            self.absorption > 0.0 && self.absorption < 1.0,
            "absorption {} leaves no decay",
            self.absorption
        );
        // In x = 2Rμ/c the condition is (1 − α) 2 (1 + (x − 1)eˣ)/x² = 1, with a left side that grows with x.
        let excess = |x: f64| (1.0 - self.absorption) * chord_transform(x) - 1.0;
        let (mut low, mut high) = (0.0, 1.0);
        while excess(high) < 0.0 {
            (low, high) = (high, 2.0 * high);
        }
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return middle * self.speed_of_sound / (2.0 * self.radius);
            }
            if excess(middle) < 0.0 { low = middle } else { high = middle }
        }
    }

    /// Time of a decay by 60 dB of the late field [s]; the transient is over after a few chords.
    pub fn reverberation_time(&self) -> f64 {
        6.0 * LN_10 / self.decay_rate()
    }

    /// Area of the wall [m²].
    pub fn surface_area(&self) -> f64 {
        4.0 * PI * self.radius * self.radius
    }

    /// Energy that arrives per area of the wall after at least one reflection [1/m²]: (1 − α)/(α S), the same at
    /// every point and for every position of the source.
    pub fn reflected_irradiance(&self) -> f64 {
        (1.0 - self.absorption) / (self.absorption * self.surface_area())
    }

    /// Fluence of all reflected energy at any receiver inside, for a source at the centre (or at the centre, for a
    /// source anywhere) [1/m²]: the wall radiates (1 − α)/(α S) evenly, seen under 4π: 4 (1 − α)/(α S).
    pub fn reflected_fluence(&self) -> f64 {
        4.0 * self.reflected_irradiance()
    }
}

/// ∫₀¹ 2u e^(x u) du = 2 (1 + (x − 1)eˣ)/x², by its series where the closed form cancels.
fn chord_transform(x: f64) -> f64 {
    if x.abs() > 0.5 {
        return 2.0 * (1.0 + (x - 1.0) * x.exp()) / (x * x);
    }
    let (mut power, mut sum) = (1.0, 0.0);
    for n in 0..20 {
        sum += 2.0 * power / f64::from(n + 2);
        power *= x / f64::from(n + 1);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::integrate;
    use crate::uniform::Uniform;
    use crate::vector::{difference, dot};
    use crate::z_test::{Estimate, Within, within_sigmas};

    fn sphere(absorption: f64) -> DiffuseSphere {
        DiffuseSphere { radius: 5.0, absorption, speed_of_sound: 343.0 }
    }

    #[test]
    fn reverberation_times_of_the_physics_page() {
        for (absorption, time) in [(0.3, 0.7689), (0.5, 0.4028)] {
            let found = sphere(absorption).reverberation_time();
            assert!((found - time).abs() < 5e-5, "{absorption}: {found}");
        }
        let eyring = 24.0 * LN_10 * (5.0 / 3.0) / (-343.0 * 0.7_f64.ln());
        assert!((sphere(0.3).reverberation_time() / eyring - 1.0).abs() > 0.01, "{eyring}");
    }

    #[test]
    fn the_rate_solves_the_integral_by_quadrature() {
        for absorption in [0.001, 0.05, 0.3, 0.5, 0.9] {
            let room = sphere(absorption);
            let rate = room.decay_rate();
            let part = |i: i32| {
                let (low, high) = (0.1 * f64::from(i), 0.1 * f64::from(i + 1));
                integrate(low, high, |l| l / 50.0 * (rate * l / 343.0).exp())
            };
            let kept = (1.0 - absorption) * (0..100).map(part).sum::<f64>();
            assert!((kept - 1.0).abs() < 1e-12, "{absorption}: {kept}");
        }
    }

    #[test]
    fn little_absorption_decays_after_sabine() {
        // μ → α c / (mean free path), the mean free path of a sphere being 4R/3.
        let ratio = sphere(1e-6).decay_rate() / (1e-6 * 343.0 / (20.0 / 3.0));
        assert!((ratio - 1.0).abs() < 1e-5, "{ratio}");
    }

    #[test]
    fn chords_by_the_cosine_law_have_the_linear_density() {
        let mut numbers = Uniform::new(1);
        let mean = |f: &dyn Fn(f64) -> f64, numbers: &mut Uniform| {
            // From the south pole of the unit sphere, a Lambert direction meets the sphere again after 2 cos θ.
            let samples = (0..100_000).map(|_| f(2.0 * numbers.next_f64().sqrt())).collect::<Vec<_>>();
            Estimate::of(&samples)
        };
        let within = Within { sigmas: 4.0, maximal_sigma: 0.01 };
        within_sigmas(mean(&|l| l, &mut numbers), 4.0 / 3.0, within).unwrap();
        within_sigmas(mean(&|l| l.exp(), &mut numbers), chord_transform(2.0), within).unwrap();
        assert!(within_sigmas(mean(&|l| l, &mut numbers), 1.0, within).is_err());
    }

    /// Follows rays between points of the sphere; every one is lost by weight only.
    fn incident_after_reflection(numbers: &mut Uniform, cap: f64) -> f64 {
        let (room, mut weight, mut incident) = (sphere(0.3), 1.0, 0.0);
        let mut normal = numbers.unit_vector();
        for _ in 0..60 {
            weight *= 1.0 - room.absorption;
            let lift = numbers.unit_vector();
            // Normal plus a point of the unit sphere is a Lambert direction; inwards is −normal.
            let d = difference(lift, normal);
            let step = -2.0 * dot(d, normal) / dot(d, d);
            normal = [0, 1, 2].map(|k| normal[k] + step * d[k]);
            incident += if normal[2] > cap { weight } else { 0.0 };
        }
        incident
    }

    #[test]
    fn reflected_irradiance_is_uniform_and_follows_from_the_absorption() {
        let room = sphere(0.3);
        let mut numbers = Uniform::new(2);
        for cap in [0.0, 0.8] {
            let part = 0.5 * (1.0 - cap);
            let samples =
                (0..40_000).map(|_| incident_after_reflection(&mut numbers, cap)).collect::<Vec<_>>();
            let expected = room.reflected_irradiance() * room.surface_area() * part;
            let within = Within { sigmas: 4.0, maximal_sigma: 0.01 * expected };
            within_sigmas(Estimate::of(&samples), expected, within).unwrap();
            assert!(
                within_sigmas(Estimate::of(&samples), expected / (1.0 - room.absorption), within).is_err()
            );
        }
    }
}
