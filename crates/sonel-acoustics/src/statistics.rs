//! Statistical room acoustics: formulas for a diffuse field.
//!
//! All of it assumes one room whose field is diffuse: absorption spread evenly, no dominant dimension, frequencies above
//! Schroeder's. Each function says when it holds. `air_attenuation` is the energy attenuation m [1/m].
//!
//! References: [Sabine1922], [Eyring1930], [Schroeder1962] (docs/references.md).

/// Equivalent absorption area ΣS_i α_i of walls given as (area [m²], absorption coefficient) [m²].
pub fn equivalent_absorption_area(walls: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    walls.into_iter().map(|(area, absorption)| area * absorption).sum()
}

/// Mean absorption coefficient ΣS_i α_i / ΣS_i of walls given as (area [m²], absorption coefficient); 0 without walls.
pub fn mean_absorption(walls: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let (absorbing, total) = walls.into_iter().fold((0.0, 0.0), |(absorbing, total), (area, absorption)| {
        (absorbing + area * absorption, total + area)
    });
    if total > 0.0 { absorbing / total } else { 0.0 }
}

/// Mean free path 4V/S [m] of a room of `volume` [m³] and `surface_area` [m²].
///
/// Exact for any closed room in a diffuse field, whatever its shape.
pub fn mean_free_path(volume: f64, surface_area: f64) -> f64 {
    4.0 * volume / surface_area
}

/// Sabine's reverberation time 24 ln 10 · V / (c (A + 4mV)) [s], in which energy that decays as e^(−c (A + 4mV) t / 4V) falls by 60 dB;
/// infinite when nothing absorbs.
///
/// `volume` [m³], `absorption_area` A [m²], `air_attenuation` m [1/m], `speed_of_sound` [m/s]. Holds for weak
/// absorption, mean α below about 0.2; too long beyond (at α = 1 it does not vanish).
pub fn sabine_time(volume: f64, absorption_area: f64, air_attenuation: f64, speed_of_sound: f64) -> f64 {
    4.0 * libm::log(1e6) * volume / (speed_of_sound * (absorption_area + 4.0 * air_attenuation * volume))
}

/// Eyring's reverberation time 24 ln 10 · V / (c (−S ln(1−ᾱ) + 4mV)) [s]; 0 at ᾱ = 1, infinite when nothing absorbs.
///
/// `volume` [m³], `surface_area` S [m²], `mean_absorption` ᾱ 0 … 1, `air_attenuation` m [1/m], `speed_of_sound` [m/s].
/// Holds when every wall has about the same α and every path between walls about the mean length.
pub fn eyring_time(
    volume: f64,
    surface_area: f64,
    mean_absorption: f64,
    air_attenuation: f64,
    speed_of_sound: f64,
) -> f64 {
    let exponent = -libm::log1p(-mean_absorption);
    sabine_time(volume, surface_area * exponent, air_attenuation, speed_of_sound)
}

/// Schroeder's frequency 2000 √(T/V) [Hz] of a room of `volume` [m³] and `reverberation_time` [s].
///
/// Below it single modes dominate and energies do not describe the field.
pub fn schroeder_frequency(reverberation_time: f64, volume: f64) -> f64 {
    2000.0 * libm::sqrt(reverberation_time / volume)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHOEBOX: (f64, f64) = (400.0, 340.0); // 10 × 8 × 5 m

    #[test]
    fn shoebox_of_the_physics_page() {
        let (volume, surface) = SHOEBOX;
        let eyring = eyring_time(volume, surface, 0.2, 0.0, 343.0);
        assert!((eyring - 0.849).abs() < 5e-4, "{eyring}");
    }

    #[test]
    fn sabine_and_eyring_agree_where_absorption_is_weak_only() {
        let (volume, surface) = SHOEBOX;
        let ratio = |alpha: f64| {
            let area = equivalent_absorption_area([(surface, alpha)]);
            sabine_time(volume, area, 0.0, 343.0) / eyring_time(volume, surface, alpha, 0.0, 343.0)
        };
        assert!((ratio(0.001) - 1.0).abs() < 1e-3);
        assert!(ratio(0.5) > 1.3);
    }

    #[test]
    fn sabine_time_is_the_familiar_0_161() {
        let time = sabine_time(100.0, 10.0, 0.0, 343.2);
        assert!((time - 0.161 * 10.0).abs() < 1e-3, "{time}");
    }

    #[test]
    fn limits() {
        assert!(sabine_time(100.0, 0.0, 0.0, 343.0).is_infinite());
        assert!(eyring_time(100.0, 130.0, 1.0, 0.0, 343.0).abs() < 1e-300);
        // Only air: exp(−m c t) = 10⁻⁶.
        let air_only = eyring_time(100.0, 130.0, 0.0, 0.01, 343.0);
        assert!((air_only - 1e6_f64.ln() / 3.43).abs() < 1e-12);
    }

    #[test]
    fn means_over_walls() {
        let walls = [(10.0, 0.1), (30.0, 0.5)];
        assert!((equivalent_absorption_area(walls) - 16.0).abs() < 1e-12);
        assert!((mean_absorption(walls) - 0.4).abs() < 1e-12);
        assert!(mean_absorption([]).abs() < 1e-300);
        assert!((mean_free_path(SHOEBOX.0, SHOEBOX.1) - 4.705_882_352_941).abs() < 1e-9);
        assert!((schroeder_frequency(1.0, 100.0) - 200.0).abs() < 1e-12);
    }
}
