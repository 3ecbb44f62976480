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
//! | diffuse shoebox | decay, echogram and steady state, to discretisation | [`diffuse_box`] |

pub mod diffuse_box;
pub mod diffuse_sphere;
mod form_factor;
mod patches;
pub mod specular_box;

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
