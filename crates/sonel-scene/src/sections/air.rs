//! `[air]`

use std::ops::RangeInclusive;

use sonel_acoustics::{Air, Bands};
use sonel_geometry::Geometry;

use crate::document::{Entry, Number, Table};
use crate::report::Report;
use crate::scene::{Scene, attenuation_per_band};

const KEYS: [&str; 6] = [
    "temperature_celsius",
    "relative_humidity_percent",
    "pressure_kpa",
    "speed_of_sound",
    GRADIENT,
    "attenuation",
];
const GRADIENT: &str = "sound_speed_gradient";

/// The air and what the scene file overrides of it.
pub(crate) struct AirChoice {
    pub(crate) air: Air,
    speed_of_sound: Option<f64>,
    gradient: Option<Number>,
    attenuates: bool,
}

impl AirChoice {
    /// c [m/s].
    pub(crate) fn speed_of_sound(&self) -> f64 {
        self.speed_of_sound.unwrap_or_else(|| self.air.speed_of_sound())
    }

    /// Gradient of the speed of sound with height [1/s].
    pub(crate) fn gradient(&self) -> f64 {
        self.gradient.map_or(0.0, |gradient| gradient.value)
    }

    /// Reports a gradient that is impossible in the compiled `scene`.
    pub(crate) fn check_gradient(&self, scene: &Scene, geometry: &Geometry, report: &Report) {
        if let Some((gradient, problem)) = self.gradient.zip(scene.profile_problem(geometry)) {
            report.problem(gradient.at, format!("air.{GRADIENT}: {problem}"));
        }
    }

    /// m per band of `air` beside that of the scene, 0 where air does not attenuate [1/m].
    pub(crate) fn attenuation_of(&self, air: &Air, bands: &Bands) -> Vec<f64> {
        if self.attenuates { attenuation_per_band(air, bands) } else { vec![0.0; bands.count()] }
    }
}

/// Speeds of sound that are allowed [m/s]: any gas or liquid, also scale models.
const SPEEDS: RangeInclusive<f64> = 1.0..=10_000.0;

/// A speed of sound [m/s].
pub(crate) fn read_speed(entry: &Entry<'_>) -> Option<f64> {
    let speed = entry.positive()?;
    if !SPEEDS.contains(&speed) {
        let (low, high) = SPEEDS.into_inner();
        return entry.refused(&format!("{speed:e} m/s is outside {low} … {high} m/s"));
    }
    Some(speed)
}

/// Reads temperature and humidity of `air`, and checks all of its state.
pub(crate) fn read_state(table: &Table<'_>, air: &mut Air) {
    let quantities = [
        ("temperature_celsius", &mut air.temperature_celsius),
        ("relative_humidity_percent", &mut air.relative_humidity_percent),
    ];
    for (key, quantity) in quantities {
        if let Some(number) = table.get(key).and_then(|entry| entry.number()) {
            *quantity = number.value;
        }
    }
    for problem in air.problems() {
        if let Some(entry) = table.get(problem.quantity) {
            let (given, lowest, highest) = (problem.given, problem.lowest, problem.highest);
            entry.problem(&format!("{given} is outside {lowest} … {highest}"));
        }
    }
}

/// Reads the section; what it does not say is as in [`Air::default`].
pub(crate) fn read(document: &Table<'_>) -> AirChoice {
    let mut choice =
        AirChoice { air: Air::default(), speed_of_sound: None, gradient: None, attenuates: true };
    let Some(section) = document.get("air") else {
        document.report.default("air: 20 °C, 50 %, 101.325 kPa (default)");
        return choice;
    };
    let Some(table) = section.table() else { return choice };
    table.allow_only(&KEYS);

    let air = &mut choice.air;
    if let Some(number) = table.get("pressure_kpa").and_then(|entry| entry.number()) {
        air.pressure_kpa = number.value;
    }
    read_state(&table, air);
    choice.speed_of_sound = table.get("speed_of_sound").and_then(|entry| read_speed(&entry));
    choice.gradient = table.get(GRADIENT).and_then(|entry| entry.number());
    if let Some(attenuates) = table.get("attenuation").and_then(|entry| entry.flag()) {
        choice.attenuates = attenuates;
    }
    choice
}
