//! How uncertain the materials are, and what each of them makes of the reverberation time.

use sonel::analysis::average::{average, single_number};
use sonel::analysis::{Parameter, ParameterValue};

use super::Subject;
use super::document::Document;
use super::single::Single;

/// What the contributions are shown of.
const SHOWN: [Parameter; 3] = [Parameter::Strength, Parameter::T30, Parameter::ClarityC80];

/// Whether the uncertainty of the materials is part of the numbers.
pub(super) fn is_known(subjects: &[Subject]) -> bool {
    subjects.iter().any(|subject| subject.materials.is_some())
}

/// Standard uncertainties and their contributions to single numbers, averaged over the receivers.
pub(super) fn materials(page: &mut Document, subjects: &[Subject]) {
    if !is_known(subjects) {
        return;
    }
    page.section("Uncertainty of the materials");
    for subject in subjects {
        let Some(materials) = &subject.materials else { continue };
        if subjects.len() > 1 {
            page.text(&subject.name);
        }
        let bands = &subject.echograms().center_frequency_hz;
        let columns = bands.iter().map(|hz| format!("u(α) {hz} Hz"));
        let shown = SHOWN.map(|parameter| Single::Of(parameter).label());
        let head: Vec<String> = ["material".to_owned()].into_iter().chain(shown).chain(columns).collect();
        let means: Vec<ParameterValue> = SHOWN
            .iter()
            .map(|&parameter| {
                let all: Vec<ParameterValue> =
                    subject.parameters.iter().map(|receiver| single_number(receiver, parameter)).collect();
                average(all.iter().filter(|value| value.is_ok()))
            })
            .collect();
        let row = |(index, (name, uncertainty)): (usize, (&str, &[f64]))| {
            let changes = SHOWN.iter().zip(&means).map(|(parameter, mean)| {
                let change = mean.as_ref().ok().and_then(|mean| Some(mean.materials.get(index)?.by_one));
                change.map_or_else(
                    || "–".to_owned(),
                    |change| format!("{:+.3}", parameter.heading().2 * change),
                )
            });
            let uncertainty = uncertainty.iter().map(|u| format!("{u:.3}"));
            [name.to_owned()].into_iter().chain(changes).chain(uncertainty).collect()
        };
        let rows: Vec<Vec<String>> = materials.uncertainties().enumerate().map(row).collect();
        page.table("", &head, &rows);
    }
    page.note(
        "Changes of single numbers, as means over the receivers, by one standard uncertainty u(α) of the absorption of each material. Materials are taken as \
         independent, bands of one material as deviating together; the second interval is 1.96 times the root of the sum of squares, of times that of the decay rate, within the range of absorption. Scattering is taken as exact.",
    );
}
