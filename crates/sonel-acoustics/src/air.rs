//! Air: speed of sound, density, attenuation.
//!
//! Attenuation is accurate to 10 % for −20 … 50 °C, a molar concentration of water vapour of 0.05 … 5 %, pressures below
//! 200 kPa and frequencies of 4·10⁻⁴ … 10 Hz per pascal (40 Hz … 1 MHz at sea level).
//!
//! Reference: [ISO9613-1] (docs/references.md).

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Reference pressure of ISO 9613-1 [kPa].
const REFERENCE_PRESSURE_KPA: f64 = 101.325;
/// Reference temperature T₀ of ISO 9613-1, 20 °C [K].
const REFERENCE_TEMPERATURE: f64 = 293.15;
/// Triple-point isotherm temperature T₀₁ of ISO 9613-1, +0.01 °C [K].
const TRIPLE_POINT: f64 = 273.16;
/// 0 °C [K].
const ZERO_CELSIUS: f64 = 273.15;
/// Speed of sound at 20 °C, ISO 9613-1 equation (A.5) [m/s].
const REFERENCE_SPEED: f64 = 343.2;
/// Specific gas constants of dry air and of water vapour [J/(kg K)].
const GAS_CONSTANT_DRY_AIR: f64 = 287.058;
const GAS_CONSTANT_VAPOUR: f64 = 461.495;

/// State of the air in the room, the same everywhere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Air {
    /// Temperature [°C], −20 … 50.
    pub temperature_celsius: f64,
    /// Relative humidity [%], 0 … 100.
    pub relative_humidity_percent: f64,
    /// Ambient pressure [kPa], above 0, below 200.
    pub pressure_kpa: f64,
}

/// A quantity of [`Air`] out of its range.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{quantity} is {given}, outside {lowest} … {highest}")]
pub struct AirError {
    /// Name of the field of [`Air`].
    pub quantity: &'static str,
    /// The number found.
    pub given: f64,
    /// Lowest number accepted.
    pub lowest: f64,
    /// Highest number accepted.
    pub highest: f64,
}

impl Default for Air {
    /// 20 °C, 50 % and 101.325 kPa, the default of a scene.
    fn default() -> Self {
        Self {
            temperature_celsius: 20.0,
            relative_humidity_percent: 50.0,
            pressure_kpa: REFERENCE_PRESSURE_KPA,
        }
    }
}

impl Air {
    /// Every quantity out of its range (or not finite); empty when the formulas hold.
    pub fn problems(&self) -> Vec<AirError> {
        let ranges = [
            ("temperature_celsius", self.temperature_celsius, -20.0, 50.0),
            ("relative_humidity_percent", self.relative_humidity_percent, 0.0, 100.0),
            ("pressure_kpa", self.pressure_kpa, 10.0, 200.0),
        ];
        let out_of_range = |(quantity, given, lowest, highest): (&'static str, f64, f64, f64)| {
            (!(lowest..=highest).contains(&given)).then_some(AirError { quantity, given, lowest, highest })
        };
        ranges.into_iter().filter_map(out_of_range).collect()
    }

    /// Absolute temperature [K].
    pub fn temperature_kelvin(&self) -> f64 {
        self.temperature_celsius + ZERO_CELSIUS
    }

    /// Speed of sound, 343.2 √(T/T₀) [m/s]. Humidity raises it by at most 0.4 % at 20 °C, which ISO 9613-1 neglects.
    pub fn speed_of_sound(&self) -> f64 {
        REFERENCE_SPEED * libm::sqrt(self.temperature_kelvin() / REFERENCE_TEMPERATURE)
    }

    /// Density of moist air, dry air and vapour as ideal gases [kg/m³].
    pub fn density(&self) -> f64 {
        let vapour_pa = 1000.0 * self.vapour_pressure_kpa();
        let dry_pa = 1000.0 * self.pressure_kpa - vapour_pa;
        (dry_pa / GAS_CONSTANT_DRY_AIR + vapour_pa / GAS_CONSTANT_VAPOUR) / self.temperature_kelvin()
    }

    /// Partial pressure of water vapour, ISO 9613-1 equations (B.2), (B.3) [kPa].
    fn vapour_pressure_kpa(&self) -> f64 {
        let exponent = -6.8346 * libm::pow(TRIPLE_POINT / self.temperature_kelvin(), 1.261) + 4.6151;
        REFERENCE_PRESSURE_KPA * libm::exp10(exponent) * self.relative_humidity_percent / 100.0
    }

    /// Energy attenuation coefficient m of a pure tone, ISO 9613-1 equations (3)–(5) [1/m]: energy falls by
    /// e^(−m·distance). `frequency` [Hz] should be the exact midband of a band.
    pub fn energy_attenuation(&self, frequency: f64) -> f64 {
        let pressure = self.pressure_kpa / REFERENCE_PRESSURE_KPA;
        let temperature = self.temperature_kelvin() / REFERENCE_TEMPERATURE;
        let vapour_percent = 100.0 * self.vapour_pressure_kpa() / self.pressure_kpa;

        let oxygen_relaxation =
            pressure * (24.0 + 4.04e4 * vapour_percent * (0.02 + vapour_percent) / (0.391 + vapour_percent));
        let nitrogen_relaxation = pressure / libm::sqrt(temperature)
            * (9.0 + 280.0 * vapour_percent * libm::exp(-4.170 * (libm::cbrt(1.0 / temperature) - 1.0)));

        let squared = frequency * frequency;
        let relaxation = |frequency_of_gas: f64| 1.0 / (frequency_of_gas + squared / frequency_of_gas);
        let kelvin = self.temperature_kelvin();
        let classical = 1.84e-11 / pressure * libm::sqrt(temperature);
        let oxygen = 0.012_75 * libm::exp(-2239.1 / kelvin) * relaxation(oxygen_relaxation);
        let nitrogen = 0.1068 * libm::exp(-3352.0 / kelvin) * relaxation(nitrogen_relaxation);
        // Equation (5) is 8.686 f² (…) dB/m = f² (…) Np/m of pressure: twice that for energy.
        2.0 * squared * (classical + libm::pow(temperature, -2.5) * (oxygen + nitrogen))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Bands;

    /// Octaves 63 … 8000 Hz [dB/km], ISO 9613-2:1996 table 2, which quotes ISO 9613-1 at 101.325 kPa.
    const TABLE: [(f64, f64, [f64; 8]); 6] = [
        (10.0, 70.0, [0.1, 0.4, 1.0, 1.9, 3.7, 9.7, 32.8, 117.0]),
        (20.0, 70.0, [0.1, 0.3, 1.1, 2.8, 5.0, 9.0, 22.9, 76.6]),
        (30.0, 70.0, [0.1, 0.3, 1.0, 3.1, 7.4, 12.7, 23.1, 59.3]),
        (15.0, 20.0, [0.3, 0.6, 1.2, 2.7, 8.2, 28.2, 88.8, 202.0]),
        (15.0, 50.0, [0.1, 0.5, 1.2, 2.2, 4.2, 10.8, 36.2, 129.0]),
        (15.0, 80.0, [0.1, 0.3, 1.1, 2.4, 4.1, 8.3, 23.7, 82.8]),
    ];

    fn matches_table(scale: f64) -> Vec<String> {
        let bands = Bands::octaves();
        let mut wrong = Vec::new();
        for (temperature_celsius, relative_humidity_percent, expected) in TABLE {
            let air = Air { temperature_celsius, relative_humidity_percent, ..Air::default() };
            for (i, expected_db) in expected.into_iter().enumerate() {
                let db_per_km = scale
                    * air.energy_attenuation(bands.exact_midband(i))
                    * 1000.0
                    * 10.0
                    * std::f64::consts::LOG10_E;
                // ISO 9613-2 rounds the three figures of ISO 9613-1 once more: 4.151 became 4.15 and then 4.1.
                let half_a_digit = if expected_db >= 100.0 { 0.5 } else { 0.055 };
                if (db_per_km - expected_db).abs() > half_a_digit + 1e-9 {
                    wrong.push(format!(
                        "{temperature_celsius} {relative_humidity_percent} {i}: {db_per_km} not {expected_db}"
                    ));
                }
            }
        }
        wrong
    }

    #[test]
    fn attenuation_is_the_tables() {
        assert_eq!(matches_table(1.0), Vec::<String>::new());
    }

    #[test]
    fn attenuation_wrong_by_one_percent_is_rejected() {
        assert!(!matches_table(1.01).is_empty());
    }

    #[test]
    fn density_and_speed_at_20_degrees() {
        let air = Air::default();
        assert!((air.speed_of_sound() - 343.2).abs() < 1e-9);
        // CIPM-2007 gives 1.1992 kg/m³ for 20 °C, 50 %, 101.325 kPa.
        assert!((air.density() - 1.1992).abs() < 1e-3, "{}", air.density());
        let dry = Air { relative_humidity_percent: 0.0, ..air };
        assert!((dry.density() - 1.2041).abs() < 1e-3, "{}", dry.density());
    }

    #[test]
    fn dry_air_attenuates_finitely() {
        let dry = Air { relative_humidity_percent: 0.0, ..Air::default() };
        assert!(dry.energy_attenuation(1000.0).is_finite() && dry.energy_attenuation(1000.0) > 0.0);
    }

    #[test]
    fn ranges_are_all_checked() {
        let air = Air { temperature_celsius: f64::NAN, relative_humidity_percent: 101.0, pressure_kpa: -1.0 };
        let names: Vec<_> = air.problems().into_iter().map(|problem| problem.quantity).collect();
        assert_eq!(names, ["temperature_celsius", "relative_humidity_percent", "pressure_kpa"]);
        assert_eq!(Air::default().problems(), []);
    }
}
