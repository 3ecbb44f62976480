//! Rooms with known answers, each written down from its formula and from nothing else.
//!
//! All energies are per unit emitted energy, from an omnidirectional source, in one band; a fluence is in 1/m².
//!
//! | room | answer | module |
//! |---|---|---|
//! | none | spherical spreading | [`free_field`] |
//! | any closed one | mean free path, sum of incident energy | [`mean_free_path`], [`incident_per_emitted`] |
//! | specular shoebox | every arrival | [`specular_box`] |
//! | diffuse sphere | decay and steady state, exact | [`diffuse_sphere`] |
//! | half plane | point source, everywhere, exact | [`half_plane`] |
//! | edge of a wedge | diffracted field, by adding up its parts | [`wedge_edge`] |
//! | absorbing half plane | Kirchhoff's, small angles | [`knife_edge`] |
//! | two edges of a barrier | what goes over both, by adding up its parts | [`double_edge`] |
//! | half plane with a thickness | what goes over it, once and again, far off | [`thick_plate`] |
//! | rigid cylinder of rectangular section | line source, to discretisation | [`boundary_elements`] |
//! | rigid box | point source, to discretisation | [`rigid_box`] |
//! | thin rigid rectangle | point source, to discretisation | [`rigid_sheet`] |
//! | diffuse shoebox | decay, echogram and steady state, to discretisation | [`diffuse_box`] |

pub mod boundary_elements;
pub mod diffuse_box;
pub mod diffuse_sphere;
pub mod double_edge;
mod form_factor;
pub mod half_plane;
pub mod knife_edge;
mod patches;
pub mod rigid_box;
pub mod rigid_sheet;
pub mod specular_box;
pub mod thick_plate;
pub mod wedge_edge;

use std::f64::consts::PI;

/// Fluence e^(−m r)/(4π r²) at `distance` r [m] of a source in free air, `air_attenuation` m [1/m]; result [1/m²].
pub fn free_field(distance: f64, air_attenuation: f64) -> f64 {
    (-air_attenuation * distance).exp() / (4.0 * PI * distance * distance)
}

/// Mean free path 4V/S [m]: the mean chord of a closed room of any shape under a Lambertian flux.
pub fn mean_free_path(volume: f64, surface_area: f64) -> f64 {
    4.0 * volume / surface_area
}

/// Sum of the energies incident on the walls of a closed room with one `absorption` α in 0…1 everywhere and no loss
/// in the air: Σ (1 − α)^n = 1/α, whatever its shape and its scattering.
pub fn incident_per_emitted(absorption: f64) -> f64 {
    1.0 / absorption
}

/// Mean of |p|² over `band` [Hz] of `pressure` at the wave number, flat per Hz, by `count` equal steps.
fn mean_over_band(
    band: (f64, f64),
    speed_of_sound: f64,
    count: usize,
    pressure: impl Fn(f64) -> (f64, f64),
) -> f64 {
    let square = |step: usize| {
        let frequency = band.0 + (band.1 - band.0) * (step as f64 + 0.5) / count as f64;
        let (re, im) = pressure(2.0 * PI * frequency / speed_of_sound);
        re * re + im * im
    };
    (0..count).map(square).sum::<f64>() / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flux_through_any_sphere_about_the_source_is_what_the_air_has_left() {
        for (radius, attenuation) in [(0.5, 0.0), (10.0, 0.003)] {
            let flux = free_field(radius, attenuation) * 4.0 * PI * radius * radius;
            assert!((flux - f64::exp(-attenuation * radius)).abs() < 1e-12);
        }
    }
}
