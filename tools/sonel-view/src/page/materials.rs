//! Materials that responses were rendered with: those of the map, or others that their provenance states.

use serde_json::{Value, json};
use sonel::acoustics::CompiledMaterial;
use sonel::rendering::rendered_with;

use super::{Subject, Traced};

/// Coefficients that differ by less are the same: text rounds the last digit.
const ROUNDING: f64 = 1e-9;

/// Responses with the same materials.
pub(super) struct Materials<'a> {
    /// These responses.
    pub of: Vec<&'a Subject>,
    /// Their materials, in the order of the scene.
    pub each: Vec<CompiledMaterial>,
}

/// The materials of all responses of the `map`; those of the map where it has no response.
pub(super) fn materials<'a>(subjects: &'a [Subject], map: Traced<'_>) -> Vec<Materials<'a>> {
    let own = &map.map.header().scene.materials;
    let mut found: Vec<Materials<'a>> = Vec::new();
    for subject in subjects.iter().filter(|subject| map.holds(subject.echograms())) {
        let options = subject.echograms().provenance.options.as_ref();
        let changed = options.and_then(|options| options.changed.as_ref());
        let each = changed.map_or_else(|| own.clone(), |it| rendered_with(own, &it.materials, ROUNDING));
        match found.iter_mut().find(|known| known.each == each) {
            Some(known) => known.of.push(subject),
            None => found.push(Materials { of: vec![subject], each }),
        }
    }
    if found.is_empty() {
        found.push(Materials { of: Vec::new(), each: own.clone() });
    }
    found
}

impl Materials<'_> {
    /// Names of the responses.
    pub(super) fn name(&self) -> String {
        self.of.iter().map(|subject| subject.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// Coefficients for the table of the page, and which are not those of the map.
    pub(super) fn json(&self, map: Traced<'_>) -> Value {
        let own = &map.map.header().scene.materials;
        let each = self.each.iter().zip(own).map(|(material, own)| {
            json!({ "absorption": material.absorption, "scattering": material.scattering,
                "transmission": material.transmission, "isChanged": material != own })
        });
        json!({ "name": self.name(), "materials": each.collect::<Vec<_>>() })
    }
}

#[cfg(test)]
mod tests {
    use sonel::acoustics::AbsorptionLaw;
    use sonel::echograms::provenance::{ByName, Coefficients};

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
        let of = |absorption: [f64; 2]| Coefficients {
            absorption: absorption.to_vec(),
            ..Coefficients::default()
        };
        let stated = [("wall", of([0.1 + 1e-16, 0.2])), ("ceiling", of([0.25, 0.5]))];
        let stated = ByName(stated.map(|(name, of)| (name.to_owned(), of)).to_vec());
        let changed = rendered_with(&own, &stated, ROUNDING);
        assert_eq!((&changed[0], &changed[1].absorption), (&own[0], &vec![0.25, 0.5]));
    }
}
