//! Find the cheapest change of materials that reaches given parameters.
//!
//! Each material that may change is kept, replaced by one of some others, or given absorption within bounds. Every combination costs the
//! area that changes times its price. Values and derivatives of one rendering ([`crate::sensitivity`]) predict all of them; those that
//! may fulfil the goals are rendered from the map with their own weights, the cheapest first, until one does. A trace of its own, with
//! another seed, verifies it. Goals are for the mean over sources and receivers.

use sonel_acoustics::{Coefficient, Material};
use sonel_analysis::average::average;
use sonel_analysis::{Parameter, ParameterValue, ReceiverParameters};
use sonel_geometry::Geometry;
use thiserror::Error;

use crate::fit::{Stage, Workbench};
use crate::goal::Goal;
use crate::local::{Datum, Local, Unknown};
use crate::sensitivity::{Varied, VariedMap, value};
use sonel::study::pipeline::{self, MapStore, NoClock};

/// Most combinations, of which each is predicted; four digits of alternatives fit. Chosen, not measured; doubled, twice the time and memory.
pub const MOST_COMBINATIONS: usize = 20_000;
/// Most renderings of combinations. Chosen, not measured; doubled, searches without a solution take twice as long.
const MOST_RENDERED: u32 = 24;
/// Error of a prediction, in tolerances [1] and as a share of the predicted change [1]: a combination farther off is not rendered. Chosen, not
/// measured; doubled, more are rendered in vain.
const BELIEVED: [f64; 2] = [2.0, 0.5];
/// Most renderings of one combination with free absorption, each corrected by the last prediction's error. Chosen, not measured.
const REFINEMENTS: u32 = 3;
/// Share of the tolerance [1] to which free absorption is sought; it departs from the map's as little as that allows. Chosen, not measured.
const AIM: f64 = 0.25;
/// Standard deviation of free absorption in the logarithm of its place between the bounds: hardly held.
const FREE: f64 = 5.0;

/// Alternative for a material.
#[derive(Debug, Clone, PartialEq)]
pub enum Choice {
    /// This instead, by a name for people.
    Other(String, Material),
    /// Absorption from … to, in every band of a goal.
    Absorption([f64; 2]),
}

/// A material that may change.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Index.
    pub material: usize,
    /// What of it.
    pub choices: Vec<Choice>,
    /// Cost of a change per area [1/m²].
    pub price: f64,
}

/// A goal in one band.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Index of the goal.
    pub goal: usize,
    /// Index of the band.
    pub band: usize,
    /// Value of the map.
    pub before: f64,
    /// Value of the map with the changed materials.
    pub predicted: ParameterValue,
    /// Value of a trace of its own.
    pub verified: ParameterValue,
}

/// Proposal.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Candidates and their choices, by index.
    pub changes: Vec<(usize, usize)>,
    /// Area that changes [m²].
    pub area: f64,
    /// Area times price.
    pub cost: f64,
    /// All materials.
    pub materials: Vec<Material>,
    /// By goal and band.
    pub outcomes: Vec<Outcome>,
    /// Combinations there are, and renderings of them.
    pub tried: (usize, u32),
    /// Whether map and verification are within all tolerances.
    pub is_fulfilled: bool,
}

/// Why nothing is proposed.
#[derive(Debug, Error)]
pub enum OptimiseError {
    /// A map could not be rendered or traced.
    #[error(transparent)]
    PipelineRun(#[from] sonel::Error),
    /// The map has no such value.
    #[error("the map has no {} in band {}: {}", .0.key(), .1, .2)]
    NoValue(Parameter, usize, String),
    /// Too many.
    #[error("{0} combinations are more than {MOST_COMBINATIONS}: name fewer materials or fewer choices")]
    TooMany(f64),
    /// Nothing is near.
    #[error(
        "no combination is predicted to approach the goals; the nearest misses by {0:.1} tolerances: widen bounds or tolerances, or let more materials change"
    )]
    OutOfReach(f64),
}

/// A combination: choice of each candidate, its cost and area.
#[derive(Debug, Clone)]
struct Combination {
    choices: Vec<Option<usize>>,
    area: f64,
    cost: f64,
}

/// The model at the map's coefficients.
struct Model<'a> {
    candidates: &'a [Candidate],
    goals: &'a [(usize, usize, &'a Goal)],
    start: &'a [Material],
    /// One of each goal and band, with derivatives by all `unknowns`.
    data: Vec<Datum>,
    unknowns: Vec<(usize, Coefficient)>,
}

/// Proposes a change of `map` that fulfils `goals` at its receivers. It has other materials afterwards.
///
/// # Errors
/// When the map cannot be rendered or traced, or no combination comes near.
pub fn optimise(
    map: VariedMap<'_>,
    goals: &[Goal],
    candidates: &[Candidate],
    store: &mut impl MapStore,
    tell: &mut (dyn FnMut(Stage) + Send),
) -> Result<Proposal, OptimiseError> {
    let scene = &map.map.header().scene;
    let start = scene.materials.clone();
    let goals = in_bands(goals, scene.bands.nominal());
    let combinations = combinations(candidates, map.geometry)?;
    let mut bench = Workbench::new(map, store);
    let with_edges = bench.with_edges()?;
    let both = [Coefficient::Absorption, Coefficient::Scattering];
    let varied = bench.vary(&both, &mut |share| tell(Stage::Rendering(1, share)))?;
    let model = Model::new(candidates, &goals, &start, &varied, with_edges.as_deref())?;
    let combinations = model.in_order(combinations);
    let (misfit, mut proposal) = search(&model, &combinations, &mut bench, tell)?;
    let verified = means(&bench.verify(&proposal.materials)?, &goals);
    proposal.is_fulfilled = misfit <= 1.0;
    for ((outcome, verified), (_, _, goal)) in proposal.outcomes.iter_mut().zip(verified).zip(&goals) {
        let value = verified.as_ref().map_or(f64::INFINITY, |estimate| estimate.value);
        proposal.is_fulfilled &= (value - goal.value).abs() <= goal.tolerance;
        outcome.verified = verified;
    }
    Ok(proposal)
}

/// Renders the `combinations` that may fulfil the goals, in order, until one does; the nearest, and its misfit.
fn search<S: MapStore>(
    model: &Model<'_>,
    combinations: &[Combination],
    bench: &mut Workbench<'_, S>,
    tell: &mut (dyn FnMut(Stage) + Send),
) -> Result<(f64, Proposal), OptimiseError> {
    let (mut rendered, mut nearest, mut best) = (0, f64::INFINITY, None::<(f64, Proposal)>);
    'all: for combination in combinations {
        let mut offsets = vec![0.0; model.goals.len()];
        for _ in 0..REFINEMENTS {
            let materials = model.materials(combination, &offsets);
            let predicted = model.predict(&materials, &offsets);
            nearest = nearest.min(model.misfit(&predicted));
            if !model.may_fulfil(&predicted) {
                break;
            }
            if rendered == MOST_RENDERED {
                break 'all;
            }
            rendered += 1;
            bench.adopt(materials.clone(), tell)?;
            tell(Stage::Rendering(rendered + 1, 0.0));
            let found = means(&bench.map().read()?, model.goals);
            let value = |found: &ParameterValue| found.as_ref().map_or(f64::INFINITY, |found| found.value);
            let exact: Vec<f64> = found.iter().map(value).collect();
            let misfit = model.misfit(&exact);
            if best.as_ref().is_none_or(|(least, _)| misfit < *least) {
                let tried = (combinations.len(), rendered);
                best = Some((misfit, model.proposal(combination, &materials, found, tried)));
            }
            if misfit <= 1.0 {
                break 'all;
            }
            if !model.has_free(combination) || !misfit.is_finite() {
                break;
            }
            for ((offset, exact), predicted) in offsets.iter_mut().zip(&exact).zip(&predicted) {
                *offset += exact - predicted;
            }
        }
    }
    let (misfit, mut proposal) = best.ok_or(OptimiseError::OutOfReach(nearest))?;
    proposal.tried.1 = rendered;
    Ok((misfit, proposal))
}

impl<S: MapStore> Workbench<'_, S> {
    /// Parameters of a trace of its own with `materials`, from other random numbers.
    fn verify(&mut self, materials: &[Material]) -> Result<Vec<ReceiverParameters>, sonel::Error> {
        let mut header = self.map().map.header().clone();
        header.scene.materials = materials.to_vec();
        header.settings.seed = header.settings.seed.wrapping_add(1);
        let (geometry, store) = (self.given.geometry, &mut *self.store);
        let mut traced = pipeline::trace(&header, geometry, None, store, &NoClock, &mut |_| {})?;
        VariedMap { map: &mut traced.map, ..self.map() }.read()
    }
}

/// Goals by number and band.
fn in_bands<'a>(goals: &'a [Goal], bands: &[f64]) -> Vec<(usize, usize, &'a Goal)> {
    let is_wanted = |goal: &Goal, center: f64| {
        goal.centers_hz.is_empty()
            || goal.centers_hz.iter().any(|wanted| (wanted / center - 1.0).abs() < 1e-3)
    };
    let mut found = Vec::new();
    for (number, goal) in goals.iter().enumerate() {
        let wanted = bands.iter().enumerate().filter(|(_, center)| is_wanted(goal, **center));
        found.extend(wanted.map(|(band, _)| (number, band, goal)));
    }
    found
}

/// All combinations.
fn combinations(candidates: &[Candidate], geometry: &Geometry) -> Result<Vec<Combination>, OptimiseError> {
    let count: f64 = candidates.iter().map(|candidate| 1.0 + candidate.choices.len() as f64).product();
    if count > MOST_COMBINATIONS as f64 {
        return Err(OptimiseError::TooMany(count));
    }
    let mut all = vec![Combination { choices: Vec::new(), area: 0.0, cost: 0.0 }];
    for candidate in candidates {
        let area = geometry.exposed_area(candidate.material as u32);
        let options = std::iter::once(None).chain((0..candidate.choices.len()).map(Some));
        let with = |combination: &Combination, option: Option<usize>| {
            let changed = if option.is_some() { area } else { 0.0 };
            Combination {
                choices: combination.choices.iter().copied().chain([option]).collect(),
                area: combination.area + changed,
                cost: combination.cost + changed * candidate.price,
            }
        };
        all = options
            .flat_map(|option| all.iter().map(move |one| (one, option)))
            .map(|(one, option)| with(one, option))
            .collect();
    }
    Ok(all)
}

/// The mean over sources and receivers of each goal.
fn means(parameters: &[ReceiverParameters], goals: &[(usize, usize, &Goal)]) -> Vec<ParameterValue> {
    let mean = |(_, band, goal): &(usize, usize, &Goal)| {
        average(parameters.iter().map(|parameters| parameters.bands[*band].parameter(goal.parameter)))
    };
    goals.iter().map(mean).collect()
}

impl<'a> Model<'a> {
    fn new(
        candidates: &'a [Candidate],
        goals: &'a [(usize, usize, &'a Goal)],
        start: &'a [Material],
        varied: &Varied,
        with_edges: Option<&[ReceiverParameters]>,
    ) -> Result<Self, OptimiseError> {
        let is_candidate =
            |material: usize| candidates.iter().any(|candidate| candidate.material == material);
        let wanted: Vec<usize> =
            (0..varied.variants.len()).filter(|&v| is_candidate(varied.variants[v].material)).collect();
        let parameters = with_edges.unwrap_or(&varied.parameters);
        let mut data = Vec::new();
        for ((_, band, goal), mean) in goals.iter().zip(means(parameters, goals)) {
            let parameter = goal.parameter;
            let lacking = |reason: String| OptimiseError::NoValue(parameter, *band, reason);
            let value = mean.map_err(|reason| lacking(reason.to_string()))?.value;
            let slope = |variant: &usize| -> Result<f64, OptimiseError> {
                if varied.variants[*variant].steps[*band].abs() <= 0.0 {
                    return Ok(0.0);
                }
                let slopes = (0..varied.parameters.len())
                    .map(|place| varied.slopes(place, *variant, parameter)[*band]);
                let slopes: Option<Vec<f64>> = slopes.map(|slope| slope.map(|slope| slope.slope)).collect();
                let slopes = slopes.ok_or_else(|| lacking("some variant has none".to_owned()))?;
                Ok(slopes.iter().sum::<f64>() / slopes.len() as f64)
            };
            let slopes = wanted.iter().map(slope).collect::<Result<_, _>>()?;
            data.push(Datum { parameter, value, slopes, wanted: goal.value, sigma: AIM * goal.tolerance });
        }
        let unknowns =
            wanted.iter().map(|&v| (varied.variants[v].material, varied.variants[v].coefficient)).collect();
        Ok(Self { candidates, goals, start, data, unknowns })
    }

    /// The cheapest first; of equal ones that predicted nearest to the goals.
    fn in_order(&self, combinations: Vec<Combination>) -> Vec<Combination> {
        let none = vec![0.0; self.data.len()];
        let predicted = |one: &Combination| self.misfit(&self.predict(&self.materials(one, &none), &none));
        let mut keyed: Vec<(f64, Combination)> =
            combinations.into_iter().map(|one| (predicted(&one), one)).collect();
        keyed.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost).then(a.0.total_cmp(&b.0)));
        keyed.into_iter().map(|(_, one)| one).collect()
    }

    fn unknowns(&self, band: usize) -> Vec<Unknown> {
        let unknown = |&(material, coefficient): &(usize, Coefficient)| {
            let at = value(&self.start[material], coefficient, band);
            Unknown { coefficient, at, bounds: [0.0, 1.0], believed: at, sigma: FREE }
        };
        self.unknowns.iter().map(unknown).collect()
    }

    fn has_free(&self, combination: &Combination) -> bool {
        let mut chosen = combination.choices.iter().zip(self.candidates);
        chosen.any(|(choice, candidate)| {
            choice.is_some_and(|choice| matches!(candidate.choices[choice], Choice::Absorption(_)))
        })
    }

    /// All materials in `combination`; free absorption is that nearest to the goals, which predictions miss by `offsets`.
    fn materials(&self, combination: &Combination, offsets: &[f64]) -> Vec<Material> {
        let mut materials = self.start.to_vec();
        let mut free = Vec::new();
        for (choice, candidate) in combination.choices.iter().zip(self.candidates) {
            match choice.map(|choice| &candidate.choices[choice]) {
                None => {}
                Some(Choice::Other(_, other)) => {
                    let name = materials[candidate.material].name.clone();
                    materials[candidate.material] = Material { name, ..other.clone() };
                }
                Some(Choice::Absorption(bounds)) => free.push((candidate.material, *bounds)),
            }
        }
        let mut bands: Vec<usize> = self.goals.iter().map(|(_, band, _)| *band).collect();
        bands.sort_unstable();
        bands.dedup();
        for band in bands.into_iter().filter(|_| !free.is_empty()) {
            let local = self.free_model(&materials, &free, band, offsets);
            let found = local.coefficients(&local.solve());
            for ((material, _), value) in free.iter().zip(found) {
                materials[*material].absorption[band] = (value * 1e4).round() / 1e4;
            }
        }
        materials
    }

    /// The model of `band` about `materials`, for the absorption of those that are `free` within bounds.
    fn free_model(
        &self,
        materials: &[Material],
        free: &[(usize, [f64; 2])],
        band: usize,
        offsets: &[f64],
    ) -> Local {
        let (unknowns, here) = (self.unknowns(band), self.coefficients(materials, band));
        let in_band = self.each(offsets).filter(|(own, ..)| *own == band);
        let column = |material: usize| {
            self.unknowns.iter().position(|one| *one == (material, Coefficient::Absorption))
        };
        let datum = |(_, goal, datum, offset): (usize, &Goal, &Datum, f64)| {
            let (value, slopes) = datum.predict(&unknowns, &here);
            let slopes =
                free.iter().map(|(material, _)| column(*material).map_or(0.0, |column| slopes[column]));
            Datum { value, slopes: slopes.collect(), wanted: goal.value - offset, ..datum.clone() }
        };
        let unknown = |(material, bounds): &(usize, [f64; 2])| {
            let at = materials[*material].absorption[band];
            let [low, high] = *bounds;
            let rim = 0.01 * (high - low);
            let believed = at.clamp(low + rim, high - rim);
            Unknown { coefficient: Coefficient::Absorption, at, bounds: *bounds, believed, sigma: FREE }
        };
        Local { unknowns: free.iter().map(unknown).collect(), data: in_band.map(datum).collect() }
    }

    fn coefficients(&self, materials: &[Material], band: usize) -> Vec<f64> {
        let of = |&(material, coefficient): &(usize, _)| value(&materials[material], coefficient, band);
        self.unknowns.iter().map(of).collect()
    }

    /// Each goal with `materials`, `offsets` added.
    fn predict(&self, materials: &[Material], offsets: &[f64]) -> Vec<f64> {
        let predict = |(band, _, datum, offset): (usize, &Goal, &Datum, f64)| {
            datum.predict(&self.unknowns(band), &self.coefficients(materials, band)).0 + offset
        };
        self.each(offsets).map(predict).collect()
    }

    /// Whether values as certain as `predicted` may be within all tolerances.
    fn may_fulfil(&self, predicted: &[f64]) -> bool {
        let [tolerances, share] = BELIEVED;
        self.each(predicted).all(|(_, goal, datum, value)| {
            (value - goal.value).abs() <= tolerances * goal.tolerance + share * (value - datum.value).abs()
        })
    }

    /// Largest deviation in tolerances.
    fn misfit(&self, values: &[f64]) -> f64 {
        let off = self.each(values).map(|(_, goal, _, value)| (value - goal.value).abs() / goal.tolerance);
        off.fold(0.0, f64::max)
    }

    /// Band, goal and model of each of `values`.
    fn each<'b>(&'b self, values: &'b [f64]) -> impl Iterator<Item = (usize, &'b Goal, &'b Datum, f64)> {
        let all = self.goals.iter().zip(&self.data).zip(values);
        all.map(|(((_, band, goal), datum), value)| (*band, *goal, datum, *value))
    }

    fn proposal(
        &self,
        combination: &Combination,
        materials: &[Material],
        predicted: Vec<ParameterValue>,
        tried: (usize, u32),
    ) -> Proposal {
        let outcomes = self.goals.iter().zip(&self.data).zip(predicted);
        let outcomes = outcomes.map(|(((goal, band, _), datum), predicted)| Outcome {
            goal: *goal,
            band: *band,
            before: datum.value,
            verified: predicted.clone(),
            predicted,
        });
        let chosen = combination.choices.iter().enumerate();
        Proposal {
            changes: chosen.filter_map(|(candidate, choice)| Some((candidate, (*choice)?))).collect(),
            area: combination.area,
            cost: combination.cost,
            materials: materials.to_vec(),
            outcomes: outcomes.collect(),
            tried,
            is_fulfilled: false,
        }
    }
}
