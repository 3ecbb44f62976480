//! Absorption and scattering of materials from measured parameters.
//!
//! The map is rendered with a variant of every coefficient ([`crate::sensitivity`]); in each band, values and derivatives give a local
//! model, whose least squares give the next coefficients, until they stay. What is minimised is Σ ((computed − measured)/σ)² +
//! Σ ((y − y₀)/w)², where σ² is the variance of the measurement and of the computed value, y the logarithm of (α − τ)/(1 − α) or of
//! s/(1 − s), and y₀ that of the map's coefficient. The last step is as long as noise makes it (`certainty::settled_reduction`); it is taken and
//! not rendered again. Edges do not diffract in variants; what they do to each parameter is taken from one
//! rendering of the map as it is. Coefficients that the paths of the map cannot carry ([`sonel_analysis::what_if`]) are traced anew.

mod certainty;

use sonel_acoustics::{Coefficient, Material};
use sonel_analysis::what_if::fitness;
use sonel_analysis::{Estimate, Parameter, ReceiverParameters};
use sonel_map::SonelMap;
use thiserror::Error;

pub use certainty::Identifiability;

use crate::local::{Datum, Local, Unknown};
use crate::sensitivity::{Varied, VariedMap, value, values};
use sonel::study::pipeline::{self, MapStore, NoClock};

/// Most renderings. Chosen, not measured; doubled, fits that do not converge take twice as long.
const MOST_ROUNDS: u32 = 10;
/// A step is rejected if χ² grows by more than this share and 1: its weights are estimates, anew in each rendering.
const GROWTH: f64 = 1.1;
/// Longest step of y: a coefficient changes to its odds times or divided by seven at once.
const LONGEST_STEP: f64 = 2.0;
/// Distance of a coefficient from the ends of its range [1], half a unit of the two digits of tables.
const FROM_THE_END: f64 = 0.005;

/// A measured value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Index of the source.
    pub source: usize,
    /// Index of the receiver.
    pub receiver: usize,
    /// Index of the band.
    pub band: usize,
    /// What was measured.
    pub parameter: Parameter,
    /// In its unit.
    pub value: f64,
    /// Standard deviation of the measurement.
    pub sigma: f64,
}

/// Unknowns and settings of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FitSettings {
    /// Absorption, or also scattering.
    pub coefficients: Vec<Coefficient>,
    /// Standard deviation w of what the map has, in y: small coefficients are known to a factor e^w, those in the middle to w/4.
    pub prior_sigma: f64,
}

/// Progress of a fit.
#[derive(Debug, Clone, PartialEq)]
pub enum Stage {
    /// A rendering, by number, and its share that is done.
    Rendering(u32, f64),
    /// The paths cannot carry the new coefficients for these reasons: the scene is traced with them.
    Retracing(Vec<String>),
}

/// A fitted coefficient.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Index of the material.
    pub material: usize,
    /// Coefficient of the material.
    pub coefficient: Coefficient,
    /// Index of the band.
    pub band: usize,
    /// Coefficient of the map.
    pub start: f64,
    /// Fitted coefficient.
    pub value: f64,
    /// 95 %: noise of the measurement and of the map, and what the map's coefficient was believed to be.
    pub interval: [f64; 2],
    /// Identifiability.
    pub identifiability: Identifiability,
}

/// A measured value beside what is computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    /// What was measured.
    pub measurement: Measurement,
    /// With the coefficients of the map, where there is such a value.
    pub before: Option<f64>,
    /// With those fitted, or why there is no such value.
    pub after: Result<f64, String>,
    /// Standard deviation of the measurement and of the computed value together.
    pub sigma: f64,
}

/// Result of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// All materials, with the fitted coefficients.
    pub materials: Vec<Material>,
    /// Coefficients requested.
    pub asked: Vec<Coefficient>,
    /// Material by material, then band by band; without those that packets cannot tell.
    pub coefficients: Vec<Fitted>,
    /// In the order of the measurements.
    pub deviations: Vec<Deviation>,
    /// Renderings that were made.
    pub rounds: u32,
    /// Whether the coefficients stayed in the end.
    pub is_settled: bool,
}

/// Why nothing was fitted.
#[derive(Debug, Error)]
pub enum FitError {
    /// A map could not be rendered or traced.
    #[error(transparent)]
    PipelineRun(#[from] sonel::Error),
    /// No measured value has a computed one.
    #[error("the map supports none of the measured values; the first: {0}")]
    NothingComputed(String),
    /// Every coefficient is at an end of its range.
    #[error("no material has a coefficient that could be fitted: all are 1, or on no surface")]
    NothingToFit,
}

/// The map in use: that given, or one traced since.
pub(crate) struct Workbench<'a, S: MapStore> {
    pub given: VariedMap<'a>,
    pub traced: Option<SonelMap>,
    pub store: &'a mut S,
}

impl<'a, S: MapStore> Workbench<'a, S> {
    pub(crate) fn new(given: VariedMap<'a>, store: &'a mut S) -> Self {
        Self { given, traced: None, store }
    }

    pub(crate) fn map(&mut self) -> VariedMap<'_> {
        let VariedMap { map, geometry, receivers, render } = &mut self.given;
        let map = self.traced.as_mut().unwrap_or(map);
        VariedMap { map, geometry, receivers, render: render.clone() }
    }

    /// Gives the map other materials, traced anew where its paths cannot carry them.
    pub(crate) fn adopt(
        &mut self,
        materials: Vec<Material>,
        tell: &mut (dyn FnMut(Stage) + Send),
    ) -> Result<bool, sonel::Error> {
        let VariedMap { map, geometry, .. } = self.map();
        let sources = map.header().scene.sources.clone();
        map.change(materials, sources);
        let refusals = fitness(map, geometry).refusals;
        if refusals.is_empty() {
            return Ok(false);
        }
        tell(Stage::Retracing(refusals));
        let header = map.header().clone();
        let (geometry, store) = (self.given.geometry, &mut *self.store);
        let traced = pipeline::trace(&header, geometry, None, store, &NoClock, &mut |_| {})?;
        self.traced = Some(traced.map);
        Ok(true)
    }

    pub(crate) fn vary(
        &mut self,
        coefficients: &[Coefficient],
        tell: &mut (dyn FnMut(f64) + Send),
    ) -> Result<Varied, sonel::Error> {
        let mut map = self.map();
        let sources = map.map.header().scene.sources.len() as f64;
        let mut progress = |source: usize, share: f64| tell((source as f64 + share) / sources);
        Ok(map.vary(coefficients, &mut progress)?)
    }

    /// Figures with everything that the map has, edges included; none where edges do not diffract.
    pub(crate) fn with_edges(&mut self) -> Result<Option<Vec<ReceiverParameters>>, sonel::Error> {
        let map = self.map();
        let diffracts = map.render.edges && map.geometry.diffracting_edges().next().is_some();
        diffracts.then(|| map.read()).transpose()
    }
}

/// Fits the coefficients of `map` to `measurements` at its receivers. It has other materials afterwards.
///
/// # Errors
/// When the map cannot be rendered or traced, or no measured value has a computed one.
pub fn fit(
    map: VariedMap<'_>,
    measurements: &[Measurement],
    settings: &FitSettings,
    store: &mut impl MapStore,
    tell: &mut (dyn FnMut(Stage) + Send),
) -> Result<Fit, FitError> {
    let start = map.map.header().scene.materials.clone();
    let receivers = map.receivers.len();
    let mut bench = Workbench::new(map, store);
    let with_edges = bench.with_edges()?;
    let search = Search { settings, start: &start, measurements, receivers };
    let (mut shifts, mut first): (Vec<Shift>, Option<Look>) = (Vec::new(), None);
    let mut best: Option<(f64, usize, Vec<Material>)> = None;
    for round in 1..=MOST_ROUNDS {
        let varied = bench.vary(&settings.coefficients, &mut |share| tell(Stage::Rendering(round, share)))?;
        if round == 1 {
            shifts = search.shifts(&varied, with_edges.as_deref());
        }
        let current = bench.map().map.header().scene.materials.clone();
        let look = search.look(&varied, &current, &shifts);
        if look.count() == 0 {
            let reason = look.computed.iter().find_map(|value| value.clone().err());
            return Err(FitError::NothingComputed(reason.unwrap_or_default()));
        }
        let (cost, count) = (look.cost(), look.count());
        // Sums over other data are not compared.
        let is_worse = |(least, of, _): &(f64, usize, _)| *of == count && cost > GROWTH * least + 1.0;
        let worse = best.as_ref().is_some_and(is_worse);
        let solved = look.solve();
        let is_settled = look.is_settled(&solved);
        let first = first.get_or_insert_with(|| look.clone());
        if is_settled || round == MOST_ROUNDS {
            return search.summary(first, &look, &solved, round, is_settled);
        }
        let next = match &best {
            // Too long a step: half of it.
            Some((.., before)) if worse => between(before, &current),
            _ => {
                best = Some((cost, count, current.clone()));
                look.apply(&solved, &current)
            }
        };
        if bench.adopt(next, tell)? {
            // Costs of other paths have other noise.
            best = None;
        }
    }
    unreachable!("the last round returns")
}

fn between(first: &[Material], second: &[Material]) -> Vec<Material> {
    let middle = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect() };
    let pair = |(a, b): (&Material, &Material)| Material {
        absorption: middle(&a.absorption, &b.absorption),
        scattering: middle(&a.scattering, &b.scattering),
        ..b.clone()
    };
    first.iter().zip(second).map(pair).collect()
}

struct Search<'a> {
    settings: &'a FitSettings,
    start: &'a [Material],
    measurements: &'a [Measurement],
    receivers: usize,
}

/// One band: its model, and which measurements and coefficients it is of.
#[derive(Debug, Clone, Default)]
struct Band {
    local: Local,
    measurements: Vec<usize>,
    estimates: Vec<Estimate>,
    materials: Vec<usize>,
}

/// Addition of edges to a computed value, from all batches and without each of them.
#[derive(Debug, Clone, Default)]
struct Shift {
    value: f64,
    without: Vec<f64>,
}

/// Values of one rendering.
#[derive(Debug, Clone)]
struct Look {
    bands: Vec<Band>,
    /// By measurement.
    computed: Vec<Result<f64, String>>,
}

impl Search<'_> {
    fn place(&self, measurement: &Measurement) -> usize {
        measurement.source * self.receivers + measurement.receiver
    }

    /// Addition of edges to the computed value of each measurement.
    fn shifts(&self, varied: &Varied, with_edges: Option<&[ReceiverParameters]>) -> Vec<Shift> {
        let shift = |measurement: &Measurement| {
            let place = self.place(measurement);
            let of = |parameters: &'_ [ReceiverParameters]| {
                let estimate = parameters[place].bands[measurement.band].parameter(measurement.parameter);
                estimate.as_ref().ok().map(|estimate| (estimate.value, estimate.without.clone()))
            };
            let ((with, with_out), (alone, alone_out)) = (of(with_edges?)?, of(&varied.parameters)?);
            let without = with_out.iter().zip(&alone_out).map(|(with, alone)| with - alone).collect();
            Some(Shift { value: with - alone, without })
        };
        self.measurements.iter().map(|measurement| shift(measurement).unwrap_or_default()).collect()
    }

    fn look(&self, varied: &Varied, current: &[Material], shifts: &[Shift]) -> Look {
        let mut bands: Vec<Band> =
            (0..varied.bands).map(|band| self.unknowns(varied, current, band)).collect();
        let mut computed = Vec::with_capacity(self.measurements.len());
        for (index, (measurement, shift)) in self.measurements.iter().zip(shifts).enumerate() {
            let found = self.datum(varied, measurement, shift);
            computed.push(found.as_ref().map(|(datum, _)| datum.value + shift.value).map_err(Clone::clone));
            let Ok((datum, estimate)) = found else { continue };
            let band = &mut bands[measurement.band];
            band.local.data.push(datum);
            band.measurements.push(index);
            band.estimates.push(estimate);
        }
        Look { bands, computed }
    }

    /// The coefficients of a band that packets can tell.
    fn unknowns(&self, varied: &Varied, current: &[Material], band: usize) -> Band {
        let mut found = Band::default();
        for variant in varied.variants.iter().filter(|variant| variant.steps[band].abs() > 0.0) {
            let of = |materials: &[Material]| value(&materials[variant.material], variant.coefficient, band);
            let low = match variant.coefficient {
                Coefficient::Absorption => current[variant.material].transmission[band],
                _ => 0.0,
            };
            found.materials.push(variant.material);
            found.local.unknowns.push(Unknown {
                coefficient: variant.coefficient,
                at: of(current),
                bounds: [low, 1.0],
                believed: of(self.start).clamp(low + FROM_THE_END, 1.0 - FROM_THE_END),
                sigma: self.settings.prior_sigma,
            });
        }
        found
    }

    fn datum(
        &self,
        varied: &Varied,
        measurement: &Measurement,
        shift: &Shift,
    ) -> Result<(Datum, Estimate), String> {
        let Measurement { band, parameter, .. } = *measurement;
        let place = self.place(measurement);
        let estimate = varied.parameters[place].bands[band].parameter(parameter);
        let estimate = estimate.as_ref().map_err(ToString::to_string)?;
        let mut slopes = Vec::new();
        for (index, variant) in varied.variants.iter().enumerate() {
            if variant.steps[band].abs() > 0.0 {
                let slope = varied.slopes(place, index, parameter)[band];
                slopes.push(slope.ok_or("no derivative: some variant has no such value")?.slope);
            }
        }
        let noise = estimate.error.map_or(0.0, |error| error.sigma);
        let datum = Datum {
            parameter,
            value: estimate.value,
            slopes,
            wanted: measurement.value - shift.value,
            sigma: libm::hypot(measurement.sigma, noise),
        };
        let mut estimate = estimate.clone();
        estimate.without.iter_mut().zip(&shift.without).for_each(|(without, shift)| *without += shift);
        Ok((datum, estimate))
    }

    fn summary(
        &self,
        first: &Look,
        last: &Look,
        solved: &[Vec<f64>],
        rounds: u32,
        is_settled: bool,
    ) -> Result<Fit, FitError> {
        let mut coefficients = Vec::new();
        let mut computed: Vec<(Option<f64>, f64)> = vec![(None, 0.0); self.measurements.len()];
        for (index, (band, y)) in last.bands.iter().zip(solved).enumerate() {
            coefficients.extend(self.certain(index, band, y));
            let at = band.local.coefficients(y);
            for (datum, &number) in band.local.data.iter().zip(&band.measurements) {
                let shift = self.measurements[number].value - datum.wanted;
                computed[number] = (Some(datum.predict(&band.local.unknowns, &at).0 + shift), datum.sigma);
            }
        }
        if coefficients.is_empty() {
            return Err(FitError::NothingToFit);
        }
        coefficients.sort_by_key(|one: &Fitted| (one.material, one.coefficient as u8, one.band));
        let mut materials = self.start.to_vec();
        for one in &coefficients {
            values(&mut materials[one.material], one.coefficient)[one.band] = one.value;
        }
        let deviation = |(index, &(after, sigma)): (usize, &(Option<f64>, f64))| Deviation {
            measurement: self.measurements[index],
            before: first.computed[index].as_ref().ok().copied(),
            after: after.ok_or_else(|| last.computed[index].clone().err().unwrap_or_default()),
            sigma,
        };
        Ok(Fit {
            deviations: computed.iter().enumerate().map(deviation).collect(),
            materials,
            asked: self.settings.coefficients.clone(),
            coefficients,
            rounds,
            is_settled,
        })
    }

    fn certain(&self, index: usize, band: &Band, y: &[f64]) -> Vec<Fitted> {
        let noise: Vec<f64> =
            band.measurements.iter().map(|&number| self.measurements[number].sigma).collect();
        let found = certainty::of(&band.local, y, &noise, &band.estimates);
        let fitted = |(column, certainty): (usize, certainty::Certainty)| {
            let (unknown, material) = (&band.local.unknowns[column], band.materials[column]);
            let at = |y: f64| four_digits(unknown.of_logit(y).0, unknown.bounds);
            Fitted {
                material,
                coefficient: unknown.coefficient,
                band: index,
                start: value(&self.start[material], unknown.coefficient, index),
                value: at(y[column]),
                interval: [-1.0, 1.0].map(|side| at(y[column] + side * certainty.half_width)),
                identifiability: certainty.identifiability(&band.materials, &band.local.unknowns),
            }
        };
        found.into_iter().enumerate().map(fitted).collect()
    }
}

/// Rounded, as no measurement tells more, and within `bounds`.
fn four_digits(coefficient: f64, [low, high]: [f64; 2]) -> f64 {
    ((coefficient * 1e4).round() / 1e4).clamp(low, high)
}

impl Look {
    fn solve(&self) -> Vec<Vec<f64>> {
        let step = |(y, here): (f64, f64)| y.clamp(here - LONGEST_STEP, here + LONGEST_STEP);
        let solve = |band: &Band| match band.here() {
            here if band.local.data.is_empty() => here,
            here => band.local.solve().into_iter().zip(here).map(step).collect(),
        };
        self.bands.iter().map(solve).collect()
    }

    /// Measurements that have a computed value.
    fn count(&self) -> usize {
        self.bands.iter().map(|band| band.local.data.len()).sum()
    }

    /// At the coefficients of the map.
    fn cost(&self) -> f64 {
        self.bands.iter().map(|band| band.local.cost(&band.here())).sum()
    }

    /// Whether the step to `solved` is as long as noise makes it, in every band.
    fn is_settled(&self, solved: &[Vec<f64>]) -> bool {
        self.bands.iter().zip(solved).all(|(band, solved)| {
            let reduction = band.local.cost(&band.here()) - band.local.cost(solved);
            reduction <= certainty::settled_reduction(&band.local, solved, &band.estimates)
        })
    }

    fn apply(&self, solved: &[Vec<f64>], current: &[Material]) -> Vec<Material> {
        let mut materials = current.to_vec();
        for (index, (band, y)) in self.bands.iter().zip(solved).enumerate() {
            let coefficients = band.local.coefficients(y);
            for ((unknown, &material), value) in
                band.local.unknowns.iter().zip(&band.materials).zip(coefficients)
            {
                values(&mut materials[material], unknown.coefficient)[index] = value;
            }
        }
        materials
    }
}

impl Band {
    fn here(&self) -> Vec<f64> {
        self.local.unknowns.iter().map(|unknown| unknown.logit(unknown.at)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel::study::pipeline::{InMemory, Room};
    use sonel::study::response::receivers_of;
    use sonel_acoustics::Bands;
    use sonel_map::Settings;
    use sonel_scene::Scene;

    /// From nearly black to live few packets were reflected often enough; from live to a little less so they were.
    #[test]
    fn what_the_paths_cannot_carry_is_traced_anew_and_the_rest_is_not() {
        for (before, after, is_traced) in [(0.97, 0.1, true), (0.2, 0.25, false)] {
            let wall = |absorption| Material::uniform("wall", absorption, 0.5, 8);
            let scene = Scene::shoebox([6.0, 5.0, 4.0], wall(before), Bands::octaves())
                .with_source("source", [1.5, 1.2, 1.3])
                .with_receiver("receiver", [4.2, 3.7, 2.1])
                .with_duration(1.5);
            let settings = Settings { emissions: 10_000, ..Settings::default() };
            let (receivers, geometry) = (receivers_of(&scene), scene.geometry().unwrap());
            let traced = Room::within(&scene, scene.geometry().unwrap(), Vec::new()).trace(
                settings,
                &mut InMemory,
                &NoClock,
            );
            let mut map = traced.unwrap().map;
            let given = VariedMap {
                map: &mut map,
                geometry: &geometry,
                receivers: &receivers,
                render: sonel_renderer::RenderSettings::default(),
            };
            let mut store = InMemory;
            let mut bench = Workbench::new(given, &mut store);
            let mut reasons = Vec::new();
            let found = bench.adopt(vec![wall(after)], &mut |stage| reasons.push(stage)).unwrap();
            assert_eq!(found, is_traced, "{reasons:?}");
            assert_eq!(matches!(reasons[..], [Stage::Retracing(_)]), is_traced);
            let map = bench.map().map;
            assert_eq!(map.drawn_with().is_none(), is_traced, "a fresh map is drawn with its own materials");
            assert!((map.header().scene.materials[0].absorption[0] - after).abs() < 1e-15);
        }
    }
}
