//! Uncertainty of a response's parameters by the absorption of materials, from the map that it was rendered from.

use std::ops::RangeInclusive;
use std::str::FromStr;

use crate::study::pipeline::render_variants;
use serde_json::{Value, json};
use sonel_acoustics::Material;
use sonel_analysis::ReceiverParameters;
use sonel_analysis::materials::{Varied, attach};
use sonel_echogram::Response as Echograms;
use sonel_renderer::{Air as Attenuation, Estimator, ReceiverPoint, RenderSettings, Sensitivity};
use sonel_scene::{Scene, Source};

use crate::coefficients::{self, Coefficients};
use crate::error::At;
use crate::names::place;
use crate::observer::{Observer, Severity, Watch};
use crate::prepared::Design;
use crate::{Error, Map, Mode, ParseError, Result};

use crate::study::job::directivity;

/// By how much an absorption is raised: small beside what bends a parameter, large beside rounding.
const STEP: f64 = 1e-3;
/// Smaller uncertainties change nothing that is stated.
const LEAST: f64 = 1e-9;
/// Standard uncertainties that make sense: an absorption lies between 0 and 1.
const RANGE: RangeInclusive<f64> = 0.0..=0.5;

/// Standard uncertainty of the absorption of a material.
#[derive(Debug, Clone, PartialEq)]
pub struct AbsorptionUncertainty {
    /// The material; none: every material that is not named.
    pub material: Option<String>,
    /// Standard uncertainty of α (coverage factor 1), 0 … 0.5, or as a share of α.
    pub uncertainty: Coefficients,
    /// Whether it is a share of α.
    pub is_relative: bool,
}

/// `0.05`, `20%` of the coefficient, `NAME=0.1` or, by band, `NAME=0.1,0.05,…`.
impl FromStr for AbsorptionUncertainty {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        let (material, numbers) = match text.rsplit_once('=') {
            Some((name, numbers)) => (Some(name.trim().trim_matches('"').to_owned()), numbers),
            None => (None, text),
        };
        let (numbers, is_relative) = match numbers.trim().strip_suffix('%') {
            Some(share) => (share, true),
            None => (numbers, false),
        };
        let scaled = |numbers: Coefficients| match numbers {
            Coefficients::Uniform(percent) if is_relative => Some(Coefficients::Uniform(percent / 100.0)),
            Coefficients::PerBand(_) if is_relative => None,
            numbers => Some(numbers),
        };
        let uncertainty = coefficients::parse(numbers)
            .and_then(scaled)
            .filter(|found| numbers_of(found).iter().all(|u| RANGE.contains(u)));
        uncertainty.filter(|_| material.as_deref() != Some("")).map(|uncertainty| Self { material, uncertainty, is_relative }).ok_or_else(|| {
            ParseError(format!(
                "\"{text}\" is no standard uncertainty of absorption: write 0.05 for all materials, NAME=0.1 for one, NAME=0.1,0.05,… by band, each 0 … 0.5, or NAME=20% of the coefficient, 0 … 50 %"
            ))
        })
    }
}

fn numbers_of(coefficients: &Coefficients) -> &[f64] {
    match coefficients {
        Coefficients::Uniform(number) => std::slice::from_ref(number),
        Coefficients::PerBand(numbers) => numbers,
    }
}

/// A response with the absorption of one uncertain material after the other changed a little.
#[derive(Debug, Clone)]
pub struct MaterialVariants {
    unchanged: Echograms,
    variants: Vec<MaterialVariant>,
}

#[derive(Debug, Clone)]
struct MaterialVariant {
    material: String,
    /// Standard uncertainty of α per band.
    uncertainty: Vec<f64>,
    /// Step of α in standard uncertainties.
    share: f64,
    /// How far α may fall and rise, by band [standard uncertainties].
    room: Vec<[f64; 2]>,
    echograms: Echograms,
}

impl MaterialVariants {
    /// Gives every value of `parameters` its changes by one standard uncertainty of each material, where `read` reads parameters off
    /// echograms as those were read off the response.
    ///
    /// # Errors
    /// The errors of `read`.
    pub fn attach<E>(
        &self,
        parameters: &mut [ReceiverParameters],
        read: impl Fn(&Echograms) -> std::result::Result<Vec<ReceiverParameters>, E>,
    ) -> std::result::Result<(), E> {
        let before = read(&self.unchanged)?;
        let varied = self.variants.iter().map(|variant| {
            Ok(Varied {
                material: variant.material.clone(),
                share: variant.share,
                room: variant.room.clone(),
                parameters: read(&variant.echograms)?,
            })
        });
        attach(parameters, &before, &varied.collect::<std::result::Result<Vec<_>, E>>()?);
        Ok(())
    }

    /// `[{"material": …, "absorption": [per band]}]`: standard uncertainties, in the order of the changes of each value.
    #[must_use]
    pub fn json(&self) -> Value {
        let row = |it: &MaterialVariant| json!({ "material": it.material, "absorption": it.uncertainty });
        self.variants.iter().map(row).collect()
    }

    /// Uncertain materials, in the order of the changes of each value: name, and standard uncertainty of α per band.
    pub fn uncertainties(&self) -> impl Iterator<Item = (&str, &[f64])> {
        self.variants.iter().map(|variant| (variant.material.as_str(), &variant.uncertainty[..]))
    }
}

impl Map {
    /// The echograms of `response`, which was rendered from this map, for small changes of the absorption of every uncertain material in use.
    /// Edges do not diffract in them. A material is left out, with a warning, in bands where it absorbs everything: no packet returns from it.
    ///
    /// # Errors
    /// When the response is of another map, is of its sources as one or has changed directivities; a material that does not exist; a map of `mode` paper; [`Error::Stopped`].
    pub fn material_variants(
        &self,
        response: &Echograms,
        uncertainty: &[AbsorptionUncertainty],
        observer: &dyn Observer,
    ) -> Result<MaterialVariants> {
        if response.provenance.map_digest != Some(self.digest()) {
            return Err(Error::refused(format!(
                "the response was not rendered from {}: give its map, or render the response again",
                self.label()
            )));
        }
        let sources = self.sonels().header().scene.sources.len();
        if response.sources() != sources {
            return Err(Error::refused(format!(
                "the response has {} sources, the map {sources}: sources as one (`together`) have no interval of the materials \
                 (`material_uncertainty`): leave one of the options out",
                response.sources()
            )));
        }
        if self.sonels().header().settings.mode == Mode::Paper {
            return Err(Error::refused(
                "materials of maps of `mode` paper cannot be changed: trace with `mode` accurate",
            ));
        }
        let label = || self.label().to_owned();
        self.sonels().require_whole().at(label)?;
        self.check()?;
        let Design { mut map, geometry, .. } = self.as_rendered(response)?;
        let scene = &map.header().scene;
        let materials = scene.materials.clone();
        let bands = scene.bands.count();
        let in_use =
            |index: usize| geometry.surfaces().iter().any(|surface| surface.material as usize == index);
        let mut steps = steps(&uncertainties(uncertainty, scene)?, &materials);
        steps.retain(|step| in_use(step.material));
        for step in &steps {
            let black: Vec<String> = (0..bands)
                .filter(|&band| step.uncertainty[band] > 0.0 && step.by_band[band] <= 0.0)
                .map(|band| scene.bands.nominal()[band].to_string())
                .collect();
            if !black.is_empty() {
                let text = format!(
                    "material \"{}\" absorbs everything at {} Hz: its uncertainty there is left out",
                    materials[step.material].name,
                    black.join(", ")
                );
                Watch(observer).say(Severity::Warning, &text)?;
            }
        }
        let changed: Vec<Vec<Material>> = steps.iter().map(|step| step.applied(&materials)).collect();
        let settings = settings(response, changed.len() + 1);
        let receivers = receivers(response);
        let whole =
            render_variants(&mut map, &geometry, &receivers, &settings, &changed, observer).at(label)?;
        let block = |index: usize| whole.of_bands(index * bands..(index + 1) * bands);
        let variant = |(index, step): (usize, Step)| MaterialVariant {
            material: materials[step.material].name.clone(),
            share: step.share,
            room: step.room(&materials[step.material]),
            uncertainty: step.uncertainty,
            echograms: block(index + 1),
        };
        Ok(MaterialVariants {
            unchanged: block(0),
            variants: steps.into_iter().enumerate().map(variant).collect(),
        })
    }

    /// The map with the materials that `response` was rendered with.
    fn as_rendered(&self, response: &Echograms) -> Result<Design> {
        let scene = &self.sonels().header().scene;
        let options = response.provenance.options.as_ref();
        let Some(changed) = options.and_then(|options| options.changed.as_ref()) else {
            return self.unchanged();
        };
        let is_other = |source: &&Source| {
            changed.directivities.get(&source.name) != Some(&directivity(&source.directivity))
        };
        if let Some(source) = scene.sources.iter().find(is_other) {
            return Err(Error::refused(format!(
                "the response was rendered with another directivity of source \"{}\": trace the scene with it",
                source.name
            )));
        }
        let materials = coefficients::rendered_with(&scene.materials, &changed.materials, 0.0);
        self.design(materials, scene.sources.clone(), self.sonels().layout().batches)
    }
}

/// The change of one material.
struct Step {
    /// Index of the material.
    material: usize,
    uncertainty: Vec<f64>,
    /// In standard uncertainties.
    share: f64,
    /// Of α per band; 0 where the material is black.
    by_band: Vec<f64>,
}

impl Step {
    /// How far the absorption of its `material` may fall, to its transmission, and rise, by band [standard uncertainties].
    fn room(&self, material: &Material) -> Vec<[f64; 2]> {
        let Material { absorption, transmission, .. } = material;
        let bands = absorption.iter().zip(transmission).zip(&self.uncertainty);
        bands.map(|((alpha, tau), u)| [alpha - tau, 1.0 - alpha].map(|room| room / u)).collect()
    }

    fn applied(&self, materials: &[Material]) -> Vec<Material> {
        let mut changed = materials.to_vec();
        for (value, step) in changed[self.material].absorption.iter_mut().zip(&self.by_band) {
            *value += step;
        }
        changed
    }
}

fn steps(uncertainties: &[Vec<f64>], materials: &[Material]) -> Vec<Step> {
    let of = |(index, uncertainty): (usize, &Vec<f64>)| {
        let most = uncertainty.iter().fold(0.0_f64, |most, u| most.max(*u));
        if most < LEAST {
            return None;
        }
        let share = STEP / most;
        let by_band = uncertainty.iter().zip(&materials[index].absorption);
        // A black surface reflects nothing that could be weighed anew.
        let by_band = by_band.map(|(u, absorption)| if *absorption < 1.0 - STEP { share * u } else { 0.0 });
        Some(Step { material: index, uncertainty: uncertainty.clone(), share, by_band: by_band.collect() })
    };
    uncertainties.iter().enumerate().filter_map(of).collect()
}

/// Standard uncertainty of every material per band; 0 where none is given.
fn uncertainties(given: &[AbsorptionUncertainty], scene: &Scene) -> Result<Vec<Vec<f64>>> {
    let bands = scene.bands.count();
    let known = || scene.materials.iter().map(|material| material.name.as_str());
    let mut found = vec![None; scene.materials.len()];
    let mut of_others = None;
    let mut problems = Vec::new();
    for AbsorptionUncertainty { material, uncertainty, is_relative } in given {
        let numbers = match uncertainty {
            Coefficients::Uniform(number) => vec![*number; bands],
            Coefficients::PerBand(numbers) => numbers.clone(),
        };
        let whose =
            material.as_ref().map_or_else(|| "all materials".to_owned(), |name| format!("\"{name}\""));
        if numbers.len() != bands {
            problems.push(format!("{} uncertainties of {whose}: the scene has {bands} bands", numbers.len()));
            continue;
        }
        if let Some(wrong) = numbers.iter().find(|number| !RANGE.contains(number)) {
            problems.push(format!("uncertainty {wrong} of {whose} is outside 0 … 0.5"));
        }
        let stated = match material {
            None => &mut of_others,
            Some(name) => match place(known(), name, "the scene has no material") {
                Ok(index) => &mut found[index],
                Err(problem) => {
                    problems.push(problem.to_string());
                    continue;
                }
            },
        };
        if stated.replace((numbers, *is_relative)).is_some() {
            problems.push(format!("the uncertainty of {whose} is given twice"));
        }
    }
    if !problems.is_empty() {
        return Err(Error::Options(problems));
    }
    let of_others = of_others.unwrap_or_else(|| (vec![0.0; bands], false));
    let stated = found.into_iter().map(|own| own.unwrap_or_else(|| of_others.clone()));
    let absolute = |((numbers, is_relative), material): ((Vec<f64>, bool), &Material)| {
        let absorption = material.absorption.iter().map(|alpha| if is_relative { *alpha } else { 1.0 });
        numbers.iter().zip(absorption).map(|(number, by)| number * by).collect()
    };
    Ok(stated.zip(&scene.materials).map(absolute).collect())
}

/// Settings that `response` was rendered with, for a map of `times` its bands.
fn settings(response: &Echograms, times: usize) -> RenderSettings {
    let Some(options) = &response.provenance.options else { return RenderSettings::default() };
    let estimator = Estimator::COMPARABLE.into_iter().find(|known| options.estimator == known.name());
    RenderSettings {
        rays: Some(options.rays).filter(|rays| *rays > 0),
        gather_radius: options.radius_m,
        seed: response.provenance.seed,
        bin: options.bin_s,
        mirror_order: options.order,
        air: if options.air_attenuation.len() == response.bands() {
            Attenuation::Attenuation(options.air_attenuation.repeat(times))
        } else {
            Attenuation::OfScene
        },
        directions: response.directions.is_some(),
        ..RenderSettings::of(estimator.unwrap_or(Estimator::Auto))
    }
}

/// The receivers of `response`.
fn receivers(response: &Echograms) -> Vec<ReceiverPoint> {
    let points = response.receiver_names.iter().zip(&response.receiver_positions).enumerate();
    points
        .map(|(index, (name, position))| {
            let directivity = response.receiver_directivities.get(index);
            let sensitivity = directivity.and_then(|found| {
                Some(Sensitivity { pattern: found.name.parse().ok()?, aim: found.aim.into() })
            });
            ReceiverPoint {
                name: name.clone(),
                position: (*position).into(),
                sensitivity: sensitivity.unwrap_or(Sensitivity::OMNI),
            }
        })
        .collect()
}
