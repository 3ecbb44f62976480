//! Options of a rendering.

use std::path::PathBuf;
use std::str::FromStr;

use crate::study::target::Targets;
use sonel_acoustics::Air as AirState;
use sonel_map::ShardRange;
use sonel_renderer::{Air as Attenuation, Estimator, RenderSettings};
use sonel_scene::Scene;

use crate::feasible::wrong_limits;
use crate::{Audience, Change, Error, Grid, ParseError, Result};

/// Options of a rendering.
#[derive(Debug, Clone)]
pub struct RenderOptions {
    /// Width of a time bin [s], above 0; by default 0.001. A response has at most 2²⁰ bins.
    pub bin: f64,
    /// Estimator of each path class; by default [`Estimator::Auto`].
    pub estimator: Estimator,
    /// Effects that are decided in rendering; by default all.
    pub effects: RenderEffects,
    /// Highest order of image sources; by default from the room.
    pub order: Option<u32>,
    /// Number of batches that are rendered, the first ones of the map; by default all. A share of the time, and wider intervals.
    pub batches: Option<u32>,
    /// Radius of the discs in which visibility rays gather [m]; by default from room and number of packets.
    pub radius: Option<f64>,
    /// Visibility rays per receiver, at least 1; by default a quarter as many as packets. With `until` the maximum.
    pub rays: Option<u32>,
    /// Seed of the rendering; by default that of the map.
    pub seed: Option<u64>,
    /// Air that attenuates; by default that of the scene.
    pub air: Air,
    /// Whether energies by direction of incidence are stored, too: for lateral fractions, ambisonics and two ears.
    pub directions: bool,
    /// A variant of the scene file, `[variants.NAME]`, whose materials replace the scene's before `materials` and `set`.
    pub variant: Option<String>,
    /// A TOML file of `[materials.NAME]`; those materials replace the scene's before `set`.
    pub materials: Option<PathBuf>,
    /// Changes against the scene of the map.
    pub set: Vec<Change>,
    /// Further receivers. Points on surfaces, in solids or outside the room are left out.
    pub grid: Option<Grid>,
    /// Further receivers above the faces of materials, numbered, such as "seats 1". Points without a place are left out as those of a grid.
    pub audience: Option<Audience>,
    /// The part of the receivers that is rendered; by default all.
    pub shard: Option<ShardRange>,
    /// Takes more batches, then more rays, until the intervals are as narrow as this.
    pub until: Option<Targets>,
    /// Limit of `until` and of plans [s], by the observer's clock; another rendering that is predicted to take longer on all cores is refused.
    pub at_most: Option<f64>,
    /// Own memory that the rendering may take [bytes]: one that is predicted to take more is refused.
    pub memory: Option<f64>,
}

/// The air that attenuates in a rendering. Travel times are those of the trace.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Air {
    /// Air of the scene.
    #[default]
    OfScene,
    /// Air with another temperature [°C] or relative humidity [%]; what is none is that of the scene.
    State {
        /// Temperature [°C].
        temperature: Option<f64>,
        /// Relative humidity [%].
        humidity: Option<f64>,
    },
    /// Air that does not attenuate.
    None,
}

impl Default for RenderOptions {
    fn default() -> Self {
        let RenderSettings { bin, estimator, .. } = RenderSettings::default();
        Self {
            bin,
            estimator,
            effects: RenderEffects::default(),
            order: None,
            batches: None,
            radius: None,
            rays: None,
            seed: None,
            air: Air::OfScene,
            directions: false,
            variant: None,
            materials: None,
            set: Vec::new(),
            grid: None,
            audience: None,
            shard: None,
            until: None,
            at_most: None,
            memory: None,
        }
    }
}

impl RenderOptions {
    /// Checks what can be checked without a map.
    pub(super) fn check(&self) -> Result<()> {
        let positive = |number: f64| number.is_finite() && number > 0.0;
        let bin = Some(self.bin).filter(|&bin| !positive(bin));
        let [memory, at_most] = wrong_limits(self.memory, self.at_most);
        let problems = [
            bin.map(|bin| {
                format!("`bin` {bin} s is no width of a time bin: give a width above 0 s, such as 0.001")
            }),
            memory,
            self.audience.as_ref().and_then(Audience::problem),
            at_most,
            (self.rays == Some(0)).then(|| "`rays` 0 gather nothing: give at least 1".to_owned()),
            (self.until.is_some() && self.shard.is_some())
                .then(|| "`until` and `shard` cannot be combined".to_owned()),
            (self.until.is_some() && self.batches.is_some())
                .then(|| "`until` chooses the batches: leave `batches` out".to_owned()),
        ];
        let problems: Vec<String> = problems.into_iter().flatten().collect();
        if problems.is_empty() { Ok(()) } else { Err(Error::Options(problems)) }
    }

    pub(super) fn settings(&self, scene: &Scene) -> Result<RenderSettings> {
        Ok(RenderSettings {
            bin: self.bin,
            mirror_order: self.order,
            rays: self.rays,
            gather_radius: self.radius,
            seed: self.seed,
            air: self.attenuation(scene)?,
            edges: self.effects.diffraction,
            boundary: self.effects.boundary && self.estimator != Estimator::Paper,
            directions: self.directions,
            ..RenderSettings::of(self.estimator)
        })
    }

    /// Attenuation of the air of the options.
    fn attenuation(&self, scene: &Scene) -> Result<Attenuation> {
        let (temperature, humidity) = match self.air {
            Air::OfScene | Air::State { temperature: None, humidity: None } => {
                return Ok(Attenuation::OfScene);
            }
            Air::None => return Ok(Attenuation::Attenuation(vec![0.0; scene.bands.count()])),
            Air::State { temperature, humidity } => (temperature, humidity),
        };
        let state = AirState {
            temperature_celsius: temperature.unwrap_or(scene.air.temperature_celsius),
            relative_humidity_percent: humidity.unwrap_or(scene.air.relative_humidity_percent),
            ..scene.air
        };
        let problems: Vec<String> = state.problems().iter().map(ToString::to_string).collect();
        if !problems.is_empty() {
            return Err(Error::Options(problems));
        }
        let attenuation = (0..scene.bands.count())
            .map(|band| state.energy_attenuation(scene.bands.exact_midband(band)))
            .collect();
        Ok(Attenuation::Attenuation(attenuation))
    }
}

/// Effects that belong to a rendering. As text `auto`, or changes, with or without `auto` before them: `-diffraction`, `auto,-boundary`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RenderEffects {
    /// Whether edges diffract.
    pub diffraction: bool,
    /// Whether all but direct sound has the boundary term; the paper's estimator has none.
    pub boundary: bool,
}

impl Default for RenderEffects {
    fn default() -> Self {
        Self { diffraction: true, boundary: true }
    }
}

impl FromStr for RenderEffects {
    type Err = ParseError;

    fn from_str(text: &str) -> std::result::Result<Self, ParseError> {
        let mut effects = Self::default();
        let changes = text.split(',').map(str::trim).enumerate();
        for (_, change) in changes.filter(|&word| word != (0, "auto")) {
            let on = change.starts_with('+');
            match change.strip_prefix(['+', '-']) {
                Some("diffraction") => effects.diffraction = on,
                Some("boundary") => effects.boundary = on,
                _ => {
                    return Err(ParseError(format!(
                        "\"{change}\" is no effect of a rendering: write auto or changes such as -diffraction,-boundary, and give other effects to the trace"
                    )));
                }
            }
        }
        Ok(effects)
    }
}
