//! Radius of the gathering discs.

use sonel_acoustics::mean_free_path;
use sonel_geometry::Geometry;

use crate::receiver::REFERENCE_EMISSIONS;
use crate::settings::RenderSettings;

/// Mean free path [m]; in an open scene its extent.
#[must_use]
pub fn free_path(geometry: &Geometry) -> f64 {
    match geometry.volume() {
        Some(volume) => mean_free_path(volume, geometry.area()),
        None => f64::from(geometry.extent()),
    }
}

/// Radius of a disc at [`REFERENCE_EMISSIONS`], relative to the mean free path [1]. Half of it is twice as noisy at few sonels in low rooms;
/// doubled, the O(h²) bias is four times as large.
pub(crate) const DISC_PER_FREE_PATH: f64 = 0.03;

/// Sonels that a disc holds where it may be wide enough [1]. Chosen: with twice as many, half-width² × time of T30 in hall, office, classroom and
/// church differs by a fifth at most, either way.
const IN_DISC: f64 = 500.0;
/// Widest disc over that at many sonels [1]: mean levels in hall and office are 0.02 and 0.01 dB lower, at no seat more than 0.06 dB; in twelve
/// random furnished rooms, 48 places of six octaves, 0.003 ± 0.002 dB higher, C80 by −0.007 ± 0.012 dB, T30 by −0.06 ± 0.08 %.
const WIDEST: f64 = 4.0;

/// The radius of discs [m] that take `share` of a mean free path at [`REFERENCE_EMISSIONS`]. It shrinks as N^(−1/6), so that the O(h²) bias vanishes as fast as the noise (docs/physics.md §4).
pub(crate) fn disc_radius(
    share: f64,
    free_path: f64,
    settings: &RenderSettings,
    traced: &sonel_map::Settings,
) -> f64 {
    let shrink = libm::pow(traced.emissions.max(1) as f64 / REFERENCE_EMISSIONS, -1.0 / 6.0);
    settings.gather_radius.unwrap_or(share * free_path * shrink)
}

/// Radius [m] of discs that hold [`IN_DISC`] sonels where `density` of them lie on an area [1/m²]: from `radius` to [`WIDEST`] times that.
pub(crate) fn filled(radius: f64, density: f64) -> f64 {
    (IN_DISC / (std::f64::consts::PI * density)).sqrt().clamp(radius, WIDEST * radius)
}
