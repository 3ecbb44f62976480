//! Refraction and reflection of a plane wave at an interface between two airs.
//!
//! sin θ₂ = (c₂/c₁) sin θ₁; where that exceeds 1 everything is reflected. Else the energy reflection coefficient is
//!
//!   R = ((Z₂ cos θ₁ − Z₁ cos θ₂) / (Z₂ cos θ₁ + Z₁ cos θ₂))², Z = ρc,
//!
//! the same from both sides of one path. It does not depend on frequency: a packet comes back with the probability R and keeps its
//! energy either way. Holds for interfaces that are sharp and plane on the scale of a wavelength.
//!
//! Reference: [Kuttruff2009], docs/physics.md §3.

use crate::propagation::AirSide;
use glam::DVec3;

/// Reflection and refraction of a plane wave at an interface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refraction {
    /// R, 0 … 1.
    pub reflected: f64,
    /// Unit direction beyond; none where everything is reflected.
    pub onward: Option<DVec3>,
}

/// A plane wave along the unit vector `direction` at an interface with unit `normal` of either sign, from one air to the other.
#[must_use]
pub fn refract(direction: DVec3, normal: DVec3, [from, to]: [AirSide; 2]) -> Refraction {
    if from == to {
        return Refraction { reflected: 0.0, onward: Some(direction) };
    }
    let cosine = direction.dot(normal).abs();
    let ratio = to.speed_of_sound / from.speed_of_sound;
    let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine).max(0.0);
    if square <= 0.0 {
        return Refraction { reflected: 1.0, onward: None };
    }
    let beyond = square.sqrt();
    let [arriving, leaving] = [to.impedance * cosine, from.impedance * beyond];
    let amplitude = (arriving - leaving) / (arriving + leaving);
    let ahead = normal * direction.dot(normal).signum();
    let onward = ratio * direction + (beyond - ratio * cosine) * ahead;
    Refraction { reflected: amplitude * amplitude, onward: Some(onward.normalize()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Air of 20 °C and of `celsius` at the same pressure.
    fn airs(celsius: f64) -> [AirSide; 2] {
        [20.0, celsius].map(|celsius| {
            let air = sonel_acoustics::Air { temperature_celsius: celsius, ..Default::default() };
            let speed_of_sound = air.speed_of_sound();
            AirSide { speed_of_sound, impedance: air.density() * speed_of_sound }
        })
    }

    fn at(degrees: f64) -> DVec3 {
        let (sine, cosine) = libm::sincos(degrees.to_radians());
        DVec3::new(sine, 0.0, -cosine)
    }

    #[test]
    fn waves_turn_by_snells_law_and_back() {
        let [cold, warm] = airs(40.0);
        for degrees in [0.0, 10.0, 45.0, 70.0, 74.0] {
            let there = refract(at(degrees), DVec3::Z, [cold, warm]);
            let onward = there.onward.unwrap();
            let expected = at(degrees).x * warm.speed_of_sound / cold.speed_of_sound;
            assert!((onward.x - expected).abs() < 1e-12 && onward.z < 0.0 && onward.is_normalized());
            let back = refract(-onward, DVec3::NEG_Z, [warm, cold]);
            assert!(back.onward.unwrap().distance(-at(degrees)) < 1e-12);
            assert!((back.reflected - there.reflected).abs() < 1e-12, "the same from both sides");
        }
        let normal = refract(at(0.0), DVec3::Z, [cold, warm]).reflected;
        let amplitude = (warm.impedance - cold.impedance) / (warm.impedance + cold.impedance);
        assert!((normal - amplitude * amplitude).abs() < 1e-15);
    }

    #[test]
    fn beyond_the_critical_angle_everything_comes_back() {
        let [cold, warm] = airs(40.0);
        let critical = libm::asin(cold.speed_of_sound / warm.speed_of_sound).to_degrees();
        let reflected = |degrees: f64| refract(at(degrees), DVec3::Z, [cold, warm]);
        for above in [1e-5, 1.0, 14.0] {
            assert_eq!(reflected(critical + above), Refraction { reflected: 1.0, onward: None });
        }
        assert!(reflected(critical - 1e-5).onward.is_some());
        assert!((reflected(critical - 1e-10).reflected - 1.0).abs() < 1e-4, "it rises to 1");
        assert!(refract(at(89.9), DVec3::Z, [warm, cold]).onward.is_some(), "not into colder air");
    }

    #[test]
    fn along_the_interface_nothing_passes_and_equal_airs_are_one() {
        let [cold, warm] = airs(40.0);
        for pair in [[cold, warm], [warm, cold]] {
            assert!((refract(DVec3::X, DVec3::Z, pair).reflected - 1.0).abs() < 1e-15);
        }
        let slanting = at(63.0);
        assert_eq!(
            refract(slanting, DVec3::Z, [cold; 2]),
            Refraction { reflected: 0.0, onward: Some(slanting) }
        );
    }
}
