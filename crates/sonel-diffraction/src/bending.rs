//! Bending of packets at edges: distribution of the deflection angle.
//!
//! A packet that passes an edge at the distance b is turned about the edge by an angle θ whose tangent is normal with mean 0
//! and standard deviation γ/(2kb), k the wave number: the nearer, the less is known of its direction. Summed over all distances that
//! gives the energy of a Kirchhoff knife edge, within 0.5 dB for deflections below 30°; of a rigid screen it is another model
//! (docs/diffraction.md). Energy is kept: the density integrates to one.
//!
//! Beyond [`REACH`] wavelengths nothing is turned: by less than a degree it would be.
//!
//! References: [Stephenson2010] for the idea (docs/references.md), docs/physics.md §5.2.

/// γ. Far in the shadow the Kirchhoff knife edge asks for √(2/π) = 0.80, just behind the boundary for 0.97: this halves the
/// difference, which is then within 0.37 dB at every Fresnel number.
const GAMMA: f64 = 0.87;

/// Distance up to which an edge bends, in wavelengths.
pub const REACH: f64 = 5.0;

/// 2k/γ, k = 2π/λ [1/m]: b times the tangent of the angle times this is normal with standard deviation 1.
#[must_use]
pub fn concentration(wavelength: f64) -> f64 {
    4.0 * core::f64::consts::PI / (GAMMA * wavelength)
}

/// The tangent of the angle at `distance` [m] for a `normal` number of mean 0 and standard deviation 1.
#[inline]
#[must_use]
pub fn tangent(normal: f64, concentration: f64, distance: f64) -> f64 {
    normal / (concentration * distance)
}

/// Density of the tangent at `distance` [m].
#[inline]
#[must_use]
pub fn density(tangent: f64, concentration: f64, distance: f64) -> f64 {
    let scale = concentration * distance;
    let normal = tangent * scale;
    scale * INVERSE_ROOT_OF_TAU * libm::exp(-0.5 * normal * normal)
}

/// 1/√(2π).
const INVERSE_ROOT_OF_TAU: f64 = 0.398_942_280_401_432_7;

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{PI, TAU};
    use sonel_testkit::analytic::knife_edge::kirchhoff;

    /// Energy behind an edge that a packet from a source at l1 needs to pass to reach a point at l2, small angles: over the
    /// distance b, density of the angle b/L + θ0, divided by L = l1 l2/(l1 + l2).
    fn behind(fresnel: f64, wavelength: f64, gamma_over_ours: f64) -> f64 {
        let (length, concentration) = (5.0, concentration(wavelength) / gamma_over_ours);
        // ν = θ0 √(2 L/λ).
        let angle = fresnel / (2.0 * length / wavelength).sqrt();
        let (steps, widest) = (200_000, 12.0 * (length * wavelength).sqrt());
        let width = widest / f64::from(steps);
        let at = |step: i32| (f64::from(step) + 0.5) * width;
        (0..steps)
            .map(|step| density(at(step) / length + angle, concentration, at(step)) / length * width)
            .sum()
    }

    #[test]
    fn a_knife_edge_shades_as_kirchhoffs_at_every_wavelength() {
        for (fresnel, known) in [(0.0, -6.02), (1.0, -13.86), (2.0, -19.09), (5.0, -26.94), (10.0, -32.95)] {
            let exact = 10.0 * kirchhoff(fresnel).log10();
            assert!((exact - known).abs() < 0.01, "the reference: {exact} {known}");
            for wavelength in [2.7, 0.34, 0.086] {
                let level = 10.0 * behind(fresnel, wavelength, 1.0).log10();
                assert!((level - exact).abs() < 0.4, "{fresnel}: {level} {exact}");
            }
        }
        let spoilt = 10.0 * behind(5.0, 0.34, 1.5).log10();
        assert!((spoilt - 10.0 * kirchhoff(5.0).log10()).abs() > 0.5, "another spread is rejected");
    }

    #[test]
    fn tangents_have_their_density() {
        let (concentration, distance) = (concentration(0.34), 0.2);
        let width = 1e-4;
        let total: f64 = (-100_000..100_000)
            .map(|step| density(f64::from(step) * width, concentration, distance) * width)
            .sum();
        assert!((total - 1.0).abs() < 1e-9);
        // One standard deviation: γ/(2kb).
        let expected = 0.87 / (2.0 * TAU / 0.34 * distance);
        assert!((tangent(1.0, concentration, distance) / expected - 1.0).abs() < 1e-12);
        assert!((concentration - 4.0 * PI / (0.87 * 0.34)).abs() < 1e-9);
    }
}
