//! What a client reads: project, room, statistical times beside simulated ones, targets, differences between variants, limits.

use serde_json::json;
use sonel::acoustics::{eyring_time, mean_free_path, sabine_time};
use sonel::analysis::average::average;
use sonel::analysis::comparison::{Pairing, Significance, difference};
use sonel::analysis::seats::spread;
use sonel::analysis::{Parameter, ParameterValue, ReceiverParameters};
use sonel::echograms::provenance::SystemSource;
use sonel::study::criteria::{Verdict, verdict};
use sonel_console::quantity;

use super::document::{Document, color, escaped};
use super::materials::{Materials, materials};
use super::sections::MOST_ROWS;
use super::single::{Single, cell};
use super::{Subject, Traced, charts, uncertainty};
use crate::HeadArguments;

/// Author, date and version, as they were given; the project is the title.
pub(super) fn head(page: &mut Document, head: &HeadArguments) {
    let given = [("Author: ", &head.author), ("", &head.date), ("Version ", &head.revision)];
    let parts: Vec<String> =
        given.into_iter().filter_map(|(what, text)| Some(format!("{what}{}", text.as_ref()?))).collect();
    if !parts.is_empty() {
        page.head(&parts.join(" · "));
    }
}

/// Size of the room and positions; materials stand below its drawing.
pub(super) fn room(page: &mut Document, subjects: &[Subject], map: Option<Traced<'_>>) {
    page.section("The room");
    if let Some(map) = map {
        let surface = surface(map);
        let mut facts =
            vec![vec!["triangles".to_owned(), map.map.header().scene.mesh.triangles.len().to_string()]];
        if let Some(volume) = map.walls.volume() {
            facts.push(vec!["volume".to_owned(), format!("{volume:.0} m³")]);
            facts
                .push(vec!["mean free path".to_owned(), format!("{:.2} m", mean_free_path(volume, surface))]);
        }
        facts.push(vec!["surface".to_owned(), format!("{surface:.0} m²")]);
        page.table("long", &[], &facts);
    }
    let echograms = subjects[0].echograms();
    let point = |what: &str, name: &String, at: &[f64; 3]| {
        let [x, y, z] = at.map(|value| format!("{value:.2}"));
        vec![what.to_owned(), name.clone(), x, y, z]
    };
    let sources = echograms.source_names.iter().zip(&echograms.source_positions);
    let receivers = echograms.receiver_names.iter().zip(&echograms.receiver_positions);
    let rows: Vec<Vec<String>> = sources
        .map(|(name, at)| point("source", name, at))
        .chain(receivers.map(|(name, at)| point("receiver", name, at)))
        .collect();
    page.table("", &["", "name", "x [m]", "y [m]", "z [m]"].map(str::to_owned), &rows);
    for subject in subjects {
        let parts: Vec<String> = subject.echograms().provenance.together.iter().map(part).collect();
        if !parts.is_empty() {
            page.text(&format!("{}: sources as one system, {}.", subject.name, parts.join("; ")));
        }
    }
}

/// A source of a system with its gain and delay.
fn part(SystemSource { source, gain_db, delay_s }: &SystemSource) -> String {
    format!("{source} with a gain of {gain_db} dB and a delay of {:.1} ms", 1000.0 * delay_s)
}

fn surface(map: Traced<'_>) -> f64 {
    let materials = 0..map.map.header().scene.materials.len();
    materials.map(|index| map.walls.exposed_area(index as u32)).sum()
}

/// Mean over the receivers of a parameter in a band.
fn mean(subject: &Subject, parameter: Parameter, hz: f64) -> ParameterValue {
    let bands = subject.parameters.iter().filter_map(|receiver| {
        receiver.bands.iter().find(|band| band.center_frequency_hz.total_cmp(&hz).is_eq())
    });
    let values: Vec<&ParameterValue> = bands.map(|band| band.parameter(parameter)).collect();
    spread(&values).mean
}

/// Sabine's and Eyring's times beside T30 of the responses with these materials.
pub(super) fn statistics(page: &mut Document, subjects: &[Subject], map: Traced<'_>) {
    let Some(volume) = map.walls.volume() else { return };
    page.section("Statistical and simulated reverberation times");
    let all = materials(subjects, map);
    for materials in &all {
        if all.len() > 1 {
            page.text(&format!("Materials of {}", materials.name()));
        }
        times(page, materials, map, volume);
    }
    page.note(
        "Statistical times hold for a diffuse field and the materials of these responses; where absorption is uneven, simulated times are longer. \
         T30 is the mean over the receivers with a value.",
    );
}

fn times(page: &mut Document, materials: &Materials<'_>, map: Traced<'_>, volume: f64) {
    let (scene, surface) = (&map.map.header().scene, surface(map));
    let named = materials.of.iter().map(|subject| format!("T30 [s], {}", subject.name));
    let columns = ["f [Hz]", "mean α", "Sabine [s]", "Eyring [s]"].map(str::to_owned).into_iter();
    let columns: Vec<String> = columns.chain(named).collect();
    let row = |(band, hz): (usize, &f64)| {
        let areas = materials.each.iter().enumerate();
        let absorbing: f64 = areas
            .map(|(index, material)| map.walls.exposed_area(index as u32) * material.absorption[band])
            .sum();
        let (m, c, mean_absorption) =
            (scene.air_attenuation[band], scene.speed_of_sound, absorbing / surface);
        let times =
            [sabine_time(volume, absorbing, m, c), eyring_time(volume, surface, mean_absorption, m, c)];
        [hz.to_string(), format!("{mean_absorption:.3}")]
            .into_iter()
            .chain(times.map(|time| format!("{time:.2}")))
            .chain(materials.of.iter().map(|subject| cell(&mean(subject, Parameter::T30, *hz), 1.0)))
            .collect()
    };
    let rows: Vec<Vec<String>> = scene.bands.nominal().iter().enumerate().map(row).collect();
    page.table("", &columns, &rows);
}

/// Targets per band, with a verdict by the interval of the mean over the receivers.
pub(super) fn targets(page: &mut Document, subjects: &[Subject], head: &HeadArguments) {
    if head.targets.is_empty() {
        return;
    }
    page.section("Targets");
    for target in &head.targets {
        let (symbol, unit, factor) = target.parameter.heading();
        let mut rows = Vec::new();
        for subject in subjects {
            let volume = subject.volume();
            let mut verdicts = Vec::new();
            let judged = target.judged(&subject.echograms().center_frequency_hz, volume);
            for judged in judged.iter().flatten() {
                let range = judged.range;
                let known = &subject.echograms().center_frequency_hz;
                let value =
                    judged.value(|hz| known.contains(&hz).then(|| mean(subject, target.parameter, hz)));
                let found = verdict(range, &value);
                verdicts.push(found);
                rows.push(vec![
                    subject.name.clone(),
                    judged.to_string(),
                    quantity::range(range.map(|end| factor * end)),
                    cell(&value, factor),
                    found.to_string(),
                ]);
            }
            let all = match &judged {
                Err(reason) => format!("does not apply: {reason}"),
                Ok(_) if verdicts.contains(&Verdict::Fail) => Verdict::Fail.to_string(),
                Ok(_) if verdicts.contains(&Verdict::Undecided) => Verdict::Undecided.to_string(),
                Ok(_) => Verdict::Pass.to_string(),
            };
            rows.push(vec![subject.name.clone(), "all".to_owned(), String::new(), String::new(), all]);
        }
        page.text(&format!("{}: {symbol} [{unit}]{}", target.name, state(&target.name)));
        let columns = ["variant", "f [Hz]", "wanted", "mean over receivers", "verdict"].map(str::to_owned);
        page.table("", &columns, &rows);
    }
    let of = if uncertainty::is_known(subjects) {
        "the 95 % interval, of simulation and materials together (root of the sum of squares),"
    } else {
        "the 95 % interval of the simulation, which leaves out the uncertainty of the materials,"
    };
    page.note(&format!(
        "Pass: all of {of} lies within the range. Fail: all of it lies outside. Undecided: it reaches over an end of the range."
    ));
}

/// The state of the room in which the standard of a target holds.
fn state(target: &str) -> &'static str {
    let target = target.to_lowercase();
    match () {
        () if ["din18041-a5", "bb93", "ansi"].iter().any(|standard| target.starts_with(standard)) => {
            " of the finished, unoccupied room; no people in the materials"
        }
        () if target.starts_with("din18041") => " of the occupied room; people must be in the materials",
        () => "",
    }
}

/// Differences of single numbers between every response and the first.
pub(super) fn differences(page: &mut Document, subjects: &[Subject]) {
    let [first, others @ ..] = subjects else { return };
    let shown = Single::of(subjects);
    let (mut rows, mut means) = (Vec::new(), Vec::new());
    for other in others {
        let pairing = Pairing::of(&first.echograms().provenance, &other.echograms().provenance);
        // Receivers of both.
        let pairs: Vec<[&ReceiverParameters; 2]> = other
            .parameters
            .iter()
            .filter_map(|after| {
                let is_same = |found: &&ReceiverParameters| {
                    (&found.source, &found.name) == (&after.source, &after.name)
                };
                Some([first.parameters.iter().find(is_same)?, after])
            })
            .collect();
        let row = |name: String, pairs: &[[&ReceiverParameters; 2]]| -> Vec<String> {
            let cells = shown.iter().map(|single| {
                let values: Vec<[ParameterValue; 2]> =
                    pairs.iter().map(|pair| pair.map(|found| single.value(found))).collect();
                // Receivers that have the value in both.
                let known = || values.iter().filter(|[a, b]| a.is_ok() && b.is_ok());
                let [a, b] = [0, 1].map(|which| average(known().map(|pair| &pair[which])));
                noticed(&difference(&a, &b, pairing), &a, *single)
            });
            std::iter::once(name).chain(cells).collect()
        };
        rows.extend(pairs.iter().map(|pair| {
            row(format!("{}: {} → {}", other.name, pair[1].source, pair[1].name), std::slice::from_ref(pair))
        }));
        if pairs.len() > 1 {
            means.push(row(format!("{}: mean", other.name), &pairs));
        }
    }
    if rows.is_empty() {
        return;
    }
    page.section("Differences");
    let columns = shown.iter().map(|single| format!("Δ{}", single.label()));
    let columns: Vec<String> = std::iter::once(format!("less {}", first.name)).chain(columns).collect();
    if rows.len() > MOST_ROWS {
        page.table("", &columns, &means);
        page.folded("Every source and receiver", &columns, &rows);
    } else {
        page.table("", &columns, &[rows, means].concat());
    }
    page.note(
        "Difference of the single numbers with half of its 95 % interval of the simulation; runs of one map, or of one seed, share their random numbers. (0): not beyond the noise of the simulation. \
         *: beyond it and at least one just-noticeable difference.",
    );
}

fn noticed(difference: &ParameterValue, before: &ParameterValue, single: Single) -> String {
    let (Ok(found), Ok(before)) = (difference, before) else { return "–".to_owned() };
    let significance = Significance::of(found, single.just_noticeable(before.value));
    format!("{}{}", cell(difference, single.heading().2), significance.mark())
}

/// T20 over the bands, with the ranges of targets about it.
pub(super) fn curves(page: &mut Document, subjects: &[Subject], head: &HeadArguments) {
    let Some(target) = head.targets.first() else { return };
    let (symbol, unit, factor) = target.parameter.heading();
    let mut data = Vec::new();
    for (index, subject) in subjects.iter().enumerate() {
        let bands = &subject.echograms().center_frequency_hz;
        let values: Vec<ParameterValue> =
            bands.iter().map(|hz| mean(subject, target.parameter, *hz)).collect();
        let y: Vec<_> = values
            .iter()
            .map(|value| charts::rounded(value.as_ref().map_or(f64::NAN, |found| factor * found.value)))
            .collect();
        data.push(json!({ "type": "scatter", "mode": "lines+markers", "name": escaped(&subject.name), "x": bands, "y": y,
            "line": { "color": color(index) } }));
    }
    let volume = subjects[0].volume();
    for (end, name) in [(0, "lowest"), (1, "highest")] {
        let points: Vec<(f64, f64)> = subjects[0]
            .echograms()
            .center_frequency_hz
            .iter()
            .filter_map(|hz| Some((*hz, factor * target.range(*hz, volume)?[end])))
            .filter(|(_, value)| value.is_finite() && *value > 0.0)
            .collect();
        let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
        data.push(
            json!({ "type": "scatter", "mode": "lines", "name": format!("{name} wanted"), "x": x, "y": y,
            "line": { "color": "#888", "dash": "dash" } }),
        );
    }
    let x = json!({ "type": "log", "title": { "text": "band [Hz]" }, "tickvals": subjects[0].echograms().center_frequency_hz,
        "ticktext": subjects[0].echograms().center_frequency_hz.iter().map(ToString::to_string).collect::<Vec<_>>() });
    let y = json!({ "title": { "text": format!("{symbol} [{unit}]") }, "rangemode": "tozero" });
    page.charts(
        &[],
        &[json!({ "data": data, "layout": charts::layout(&format!("{symbol} and {}", target.name), x, y) })],
    );
}

/// What the numbers do not say.
pub(super) fn limits(page: &mut Document, subjects: &[Subject]) {
    let materials = if uncertainty::is_known(subjects) {
        "The uncertainty of scattering coefficients. That of absorption is the second interval, as far as its standard uncertainties are right."
    } else {
        "The uncertainty of the materials. Coefficients differ between laboratory and building by 0.1 and more; intervals are those of the simulation alone."
    };
    page.section("What was not simulated");
    page.list(
        &[
            "Waves: the calculation follows energies. Below the Schroeder frequency single modes decide, and loudspeakers with one signal interfere; neither is in the numbers.",
            "People and furniture that the model leaves out. Their absorption and scattering must be in the coefficients of the surfaces.",
            materials,
            "Sound from outside, from services and through walls, but for the noise that is stated.",
            "Differences from seat to seat between the receivers.",
        ]
        .map(str::to_owned),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_standard_says_for_which_room_it_holds() {
        let stated = ["DIN18041-a3", "bb93-primary", "ansi-s12.60", "din18041-a5", "t30<=0.6s"].map(state);
        assert!(stated[0].contains(" occupied") && stated[1].contains("unoccupied"));
        assert_eq!((stated[2], stated[3], stated[4]), (stated[1], stated[1], ""));
    }

    #[test]
    fn a_part_of_a_system_has_its_gain_and_delay() {
        let text = part(&SystemSource { source: "rear".to_owned(), gain_db: -3.5, delay_s: 0.025 });
        assert_eq!(text, "rear with a gain of -3.5 dB and a delay of 25.0 ms");
    }
}
