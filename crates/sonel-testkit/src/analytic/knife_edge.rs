//! The Kirchhoff knife edge: what passes an absorbing half plane by Fresnel's integrals, small angles.
//!
//! Relative to free field, with ν positive in shadow: ½ [(½ − C(ν))² + (½ − S(ν))²].
//!
//! Reference: [BornWolf1999] §8.7 (docs/references.md).

use std::f64::consts::FRAC_PI_2;

/// Steps of Simpson's rule from 0 to ν; at ν = 10 the integrand turns 25 times.
const STEPS: u32 = 20_000;

/// Energy relative to free field at the Fresnel parameter ν = h √(2/(λL)): h the height of the edge over the line from
/// source to receiver, L = l₁l₂/(l₁ + l₂).
pub fn kirchhoff(fresnel: f64) -> f64 {
    let [cosine, sine] = [f64::cos, f64::sin].map(|wave| integral(fresnel, wave));
    0.5 * ((0.5 - cosine).powi(2) + (0.5 - sine).powi(2))
}

fn integral(end: f64, wave: impl Fn(f64) -> f64) -> f64 {
    let width = end / f64::from(STEPS);
    let at = |step: u32| wave(FRAC_PI_2 * (f64::from(step) * width).powi(2));
    let weight = |step: u32| if step == 0 || step == STEPS { 1.0 } else { f64::from(2 + 2 * (step % 2)) };
    (0..=STEPS).map(|step| weight(step) * at(step)).sum::<f64>() * width / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresnels_integrals_have_their_known_values() {
        for (end, cosine, sine) in [(1.0, 0.779_893_4, 0.438_259_1), (-2.0, -0.488_253_4, -0.343_415_7)] {
            assert!((integral(end, f64::cos) - cosine).abs() < 1e-6);
            assert!((integral(end, f64::sin) - sine).abs() < 1e-6);
        }
    }

    #[test]
    fn the_boundary_has_a_quarter_and_the_far_lit_side_all() {
        assert!((kirchhoff(0.0) - 0.25).abs() < 1e-12);
        assert!((kirchhoff(-20.0) - 1.0).abs() < 0.03);
    }
}
