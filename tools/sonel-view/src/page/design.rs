//! A design: a response with its materials, its means over the receivers, and where its numbers come from.

use serde::Serialize;
use serde_json::Value;
use sonel::acoustics::{CompiledMaterial, eyring_time, sabine_time};
use sonel::analysis::average::average;
use sonel::analysis::comparison::{Pairing, difference};
use sonel::analysis::modal::ModalBands;
use sonel::analysis::seats::spread;
use sonel::analysis::single::Single;
use sonel::analysis::{Parameter, ParameterValue, ReceiverParameters};
use sonel::rendering::rendered_with;

use super::number::Number;
use super::pair::{Less, PairRow};
use super::room::Coefficients;
use super::{Subject, Traced};

/// Coefficients that differ by less are the same: text rounds the last digit.
const ROUNDING: f64 = 1e-9;
/// What contributions of materials are shown of.
const BY_MATERIALS: [Parameter; 3] = [Parameter::Strength, Parameter::T30, Parameter::ClarityC80];

/// A response.
#[derive(Debug, Serialize)]
pub(crate) struct Design {
    pub name: String,
    /// Index of its room.
    pub room: usize,
    /// Its materials, in the order of the room; none without its map.
    pub materials: Option<Vec<Coefficients>>,
    /// Means over all pairs that have a value, of single numbers and in each band.
    pub means: Vec<PairRow>,
    /// What the rendering computed beside what the trace did.
    pub effects: Vec<&'static str>,
    /// Statistical times of a closed room.
    pub times: Vec<StatisticalTimes>,
    /// Sources of a system with their gains and delays.
    pub system: Vec<String>,
    /// A-weighted level of the background noise [dB].
    pub noise: Option<f64>,
    /// Which bands lie below the Schroeder frequency.
    pub modal: Option<String>,
    /// How uncertain its materials are, where that is known.
    pub uncertainties: Option<Vec<MaterialUncertainty>>,
    /// Key and value.
    pub provenance: Vec<[String; 2]>,
}

/// Times of a diffuse field in a band [s].
#[derive(Debug, Serialize)]
pub(crate) struct StatisticalTimes {
    /// Mean absorption, 0 … 1.
    pub absorption: f64,
    pub sabine: f64,
    pub eyring: f64,
}

/// Standard uncertainty of a material.
#[derive(Debug, Serialize)]
pub(crate) struct MaterialUncertainty {
    pub material: String,
    /// Of the absorption in each band.
    pub absorption: Vec<f64>,
    /// Changes of mean single numbers by one standard uncertainty, in the unit of their headings.
    pub changes: [Option<f64>; BY_MATERIALS.len()],
}

impl Design {
    /// A response, with the map and room that it was rendered from, and the differences to the `first` design.
    pub(super) fn of(
        subject: &Subject,
        (room, map): (usize, Option<Traced<'_>>),
        first: Option<&Subject>,
    ) -> Self {
        let provenance = &subject.echograms().provenance;
        let materials = map.map(|map| materials(subject, map));
        let own = map.map(|map| &map.map.header().scene.materials);
        let coefficients = |each: &Vec<CompiledMaterial>| {
            let own = own.into_iter().flatten();
            each.iter().zip(own).map(|(material, own)| Coefficients::of(material, material != own)).collect()
        };
        let volume = subject.volume();
        let modal = volume.and_then(|volume| ModalBands::of(&subject.parameters, volume));
        let stated = provenance.to_json();
        let stated = stated.as_object().into_iter().flatten().filter(|(key, _)| key.as_str() != "sources");
        let [edges, boundary] = [
            provenance.sources.iter().any(|source| !source.edges.is_empty()),
            provenance.sources.iter().any(|source| !source.boundary_db.is_empty()),
        ];
        let effects = [("edges", edges), ("boundary", boundary)];
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        Self {
            name: subject.name.clone(),
            room,
            means: subject.singles().map(|single| mean(single, subject, first)).collect(),
            effects: effects.into_iter().filter(|(_, is_on)| *is_on).map(|(name, _)| name).collect(),
            times: map.zip(materials.as_ref()).map_or_else(Vec::new, |(map, each)| times(map, each)),
            materials: materials.as_ref().map(coefficients),
            system: provenance
                .together
                .iter()
                .map(|it| {
                    format!("{}: gain {} dB, delay {:.1} ms", it.source, it.gain_db, 1000.0 * it.delay_s)
                })
                .collect(),
            noise: subject.parameters.iter().find_map(|found| Some(found.in_noise.as_ref()?.noise_level_db)),
            modal: modal.map(|bands| bands.to_string()),
            uncertainties: subject.materials.as_ref().map(|materials| {
                materials
                    .uncertainties()
                    .enumerate()
                    .map(|(index, of)| contributions(subject, index, of))
                    .collect()
            }),
            provenance: stated.map(|(key, value)| [key.clone(), text(value)]).collect(),
        }
    }
}

/// The mean of a single number, also in every band, over the receivers; its difference to that of `first` over the receivers of both.
fn mean(single: Single, subject: &Subject, first: Option<&Subject>) -> PairRow {
    let factor = single.heading().2;
    let all: Vec<ParameterValue> = subject.parameters.iter().map(|receiver| single.value(receiver)).collect();
    let over = spread(&all.iter().collect::<Vec<_>>());
    let in_band = |hz: &f64| {
        let Single::Of(parameter) = single else { return None };
        let values = subject.parameters.iter().filter_map(|receiver| receiver.in_band(*hz, parameter));
        let values: Vec<ParameterValue> = values.collect();
        Some(Number::of(&spread(&values.iter().collect::<Vec<_>>()).mean, factor))
    };
    let less = first.map(|first| {
        let pairing = Pairing::of(&first.echograms().provenance, &subject.echograms().provenance);
        let both = subject.parameters.iter().filter_map(|after| Some([same(first, after)?, after]));
        let both: Vec<[ParameterValue; 2]> = both
            .map(|pair| pair.map(|receiver| single.value(receiver)))
            .filter(|pair| pair.iter().all(Result::is_ok))
            .collect();
        let [before, after] = [0, 1].map(|which| average(both.iter().map(|pair| &pair[which])));
        Less { single: Number::of(&difference(&before, &after, pairing), factor), values: Vec::new() }
    });
    PairRow {
        values: subject.echograms().center_frequency_hz.iter().filter_map(in_band).collect(),
        less,
        counted: Some([over.count, over.of]),
        ..PairRow::of(single, &over.mean)
    }
}

/// The source and receiver of `subject` that are called as these.
pub(super) fn same<'a>(subject: &'a Subject, of: &ReceiverParameters) -> Option<&'a ReceiverParameters> {
    subject.parameters.iter().find(|found| (&found.source, &found.name) == (&of.source, &of.name))
}

/// The materials of a response of the `map`: those of the map, or others that its provenance states.
fn materials(subject: &Subject, map: Traced<'_>) -> Vec<CompiledMaterial> {
    let own = &map.map.header().scene.materials;
    let options = subject.echograms().provenance.options.as_ref();
    let changed = options.and_then(|options| options.changed.as_ref());
    changed.map_or_else(|| own.clone(), |it| rendered_with(own, &it.materials, ROUNDING))
}

/// Sabine's and Eyring's times in a closed room of these materials.
fn times(map: Traced<'_>, materials: &[CompiledMaterial]) -> Vec<StatisticalTimes> {
    let (scene, Some(volume)) = (&map.map.header().scene, map.walls.volume()) else { return Vec::new() };
    let areas: Vec<f64> = (0..materials.len()).map(|index| map.walls.exposed_area(index as u32)).collect();
    let surface: f64 = areas.iter().sum();
    let in_band = |band: usize| {
        let absorbing: f64 = areas.iter().zip(materials).map(|(area, it)| area * it.absorption[band]).sum();
        let (m, c, absorption) = (scene.air_attenuation[band], scene.speed_of_sound, absorbing / surface);
        StatisticalTimes {
            absorption,
            sabine: sabine_time(volume, absorbing, m, c),
            eyring: eyring_time(volume, surface, absorption, m, c),
        }
    };
    (0..scene.bands.nominal().len()).map(in_band).collect()
}

/// The uncertain material number `index` and what it makes of the means over the receivers.
fn contributions(
    subject: &Subject,
    index: usize,
    (material, absorption): (&str, &[f64]),
) -> MaterialUncertainty {
    let change = |parameter: Parameter| {
        let single = Single::Of(parameter);
        let all: Vec<ParameterValue> =
            subject.parameters.iter().map(|receiver| single.value(receiver)).collect();
        let mean = average(all.iter().filter(|value| value.is_ok())).ok()?;
        Some(single.heading().2 * mean.materials.get(index)?.by_one)
    };
    MaterialUncertainty {
        material: material.to_owned(),
        absorption: absorption.to_vec(),
        changes: BY_MATERIALS.map(change),
    }
}

#[cfg(test)]
mod tests {
    use sonel::acoustics::AbsorptionLaw;
    use sonel::echograms::provenance::{self, ByName};

    use super::*;

    #[test]
    fn a_response_has_the_coefficients_that_it_states_and_else_those_of_the_map() {
        let material = |name: &str| CompiledMaterial {
            name: name.to_owned(),
            absorption: vec![0.1, 0.2],
            scattering: vec![0.3; 2],
            transmission: vec![0.0; 2],
            law: AbsorptionLaw::default(),
            source: None,
        };
        let own = ["wall", "ceiling"].map(material);
        assert_eq!(rendered_with(&own, &ByName::default(), ROUNDING), own);
        let of = |absorption: [f64; 2]| provenance::Coefficients {
            absorption: absorption.to_vec(),
            ..provenance::Coefficients::default()
        };
        let stated = [("wall", of([0.1 + 1e-16, 0.2])), ("ceiling", of([0.25, 0.5]))];
        let stated = ByName(stated.map(|(name, of)| (name.to_owned(), of)).to_vec());
        let changed = rendered_with(&own, &stated, ROUNDING);
        assert_eq!((&changed[0], &changed[1].absorption), (&own[0], &vec![0.25, 0.5]));
    }
}
