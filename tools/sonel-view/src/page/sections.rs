//! Tables and charts of responses, and what the map tells of its trace.

use serde_json::{Value, json};
use sonel::analysis::modal::ModalBands;
use sonel::analysis::{ReceiverParameters, report};
use sonel::drawing::plot;
use sonel::ledger::{balances_json, fates_json, on_in_words};

use super::charts::{self, layout, rounded};
use super::document::{Document, color, escaped};
use super::single::{Single, cell};
use super::{MOST_PAIRS, Subject, Traced, uncertainty, words};

/// Rows of a table of pairs of source and receiver beyond which it is folded.
pub(super) const MOST_ROWS: usize = 24;
/// Pairs of source and receiver of all responses, by name, as many as are drawn.
pub(super) fn drawn(subjects: &[Subject]) -> Vec<(String, &Subject, usize)> {
    let all =
        subjects.iter().flat_map(|subject| (0..subject.parameters.len()).map(move |index| (subject, index)));
    all.take(MOST_PAIRS)
        .map(|(subject, index)| (label(subjects, subject, &subject.parameters[index]), subject, index))
        .collect()
}

/// Source and receiver, and the response where there are several.
fn label(subjects: &[Subject], subject: &Subject, parameters: &ReceiverParameters) -> String {
    let pair = format!("{} → {}", parameters.source, parameters.name);
    if subjects.len() > 1 { format!("{}: {pair}", subject.name) } else { pair }
}

/// Single numbers of every pair and their means.
pub(super) fn summary(page: &mut Document, subjects: &[Subject]) {
    page.section("Summary");
    let single = Single::of(subjects);
    let head: Vec<String> =
        std::iter::once("source → receiver".to_owned()).chain(single.iter().map(|it| it.label())).collect();
    let (mut rows, mut each) = (Vec::new(), Vec::new());
    let is_long = subjects.iter().map(Subject::pairs).sum::<usize>() > MOST_ROWS;
    for subject in subjects {
        for parameters in &subject.parameters {
            let cells = single.iter().map(|it| cell(&it.value(parameters), it.heading().2));
            let row = std::iter::once(label(subjects, subject, parameters)).chain(cells).collect();
            if is_long { &mut each } else { &mut rows }.push(row);
        }
        if subject.parameters.len() > 1 {
            let name = if subjects.len() > 1 { format!("{}: mean", subject.name) } else { "mean".to_owned() };
            let means = single.iter().map(|it| it.mean(&subject.parameters));
            rows.push(std::iter::once(name).chain(means).collect());
        }
    }
    let noticeable = single.iter().map(|it| it.just_noticeable_in_words());
    rows.push(std::iter::once("JND".to_owned()).chain(noticeable).collect());
    page.table("", &head, &rows);
    if is_long {
        page.folded("Every source and receiver", &head, &each);
    }
    let speech = match subjects
        .iter()
        .flat_map(|subject| &subject.parameters)
        .find_map(|found| found.in_noise.as_ref())
    {
        Some(speech) => format!(
            "STI, U50 (speech of the first 50 ms over later speech and noise) and SNR (speech over noise): with background noise of {:.1} dB(A).",
            speech.noise_level_db
        ),
        None => "STI: without background noise.".to_owned(),
    };
    let materials = if uncertainty::is_known(subjects) { ", then that of the materials" } else { "" };
    page.note(&format!(
        "Means of the octaves 500 and 1000 Hz (LF, LFC and LJ: 125 to 1000 Hz), ± half of the 95 % interval of the simulation{materials}. A difference of one \
         JND (just-noticeable difference) can just be heard. The mean is over all pairs of a response that have a value; its interval is that of the mean, not the spread between seats. {speech}"
    ));
    let all: Vec<ReceiverParameters> =
        drawn(subjects).into_iter().map(|(_, subject, index)| subject.parameters[index].clone()).collect();
    page.data("figures", &report::receivers(&all));
}

/// Warnings in plain words.
pub(super) fn remarks(page: &mut Document, subjects: &[Subject], map: Option<Traced<'_>>) {
    page.section("Remarks");
    let mut remarks = words::remarks(subjects.iter().flat_map(|subject| &subject.parameters));
    if let Some(map) = map {
        for subject in subjects.iter().filter(|subject| !map.holds(subject.echograms())) {
            remarks.push(format!(
                "{} was not rendered from this map: room, effects and ledger below belong to another run.",
                subject.name
            ));
        }
    }
    if subjects.iter().any(|subject| subject.parameters.len() > 1) {
        remarks.push("All receivers share one simulation, so their errors are correlated; each interval holds for one value.".to_owned());
    }
    for subject in subjects {
        let bands = subject.volume().and_then(|volume| ModalBands::of(&subject.parameters, volume));
        remarks.extend(bands.map(|bands| format!("{}: {bands}.", subject.name)));
    }
    if subjects.iter().any(|subject| subject.volume().is_none()) {
        remarks.push("The simulation computes energies. It is not valid below the Schroeder frequency of a room, where single modes dominate.".to_owned());
    }
    page.list(&remarks);
}

/// Every parameter over the bands.
pub(super) fn over_bands(page: &mut Document, subjects: &[Subject]) {
    page.section("Over frequency");
    let drawn = drawn(subjects);
    let named: Vec<(String, &ReceiverParameters)> =
        drawn.iter().map(|(name, subject, index)| (name.clone(), &subject.parameters[*index])).collect();
    let charts: Vec<Value> = plot::parameters(&named)
        .iter()
        .zip(plot::shown(&named))
        .map(|(panel, parameter)| {
            let mut chart = charts::of(panel);
            chart["layout"]["showlegend"] = json!(false);
            let points: Vec<(f64, f64)> = panel
                .series
                .iter()
                .flat_map(|series| &series.points)
                .filter(|point| point.y.is_finite())
                .map(|point| (point.x, point.y))
                .collect();
            let last = points.iter().fold(0.0_f64, |last, point| last.max(point.0));
            if let (Some(bar), Some(data)) =
                (bar(Single::Of(parameter), points.iter().map(|point| point.1)), chart["data"].as_array_mut())
            {
                data.push(noticeable_bar(json!(last * 1.5), bar));
            }
            chart
        })
        .collect();
    let names: Vec<String> = named.into_iter().map(|(name, _)| name).collect();
    page.charts(&names, &charts);
    page.note(
        "Bars at the points are 95 % intervals, the grey bar at the right is one just-noticeable difference.",
    );
}

/// Middle of the values and the just-noticeable difference there, in the unit of the heading.
fn bar(single: Single, values: impl Iterator<Item = f64> + Clone) -> Option<(f64, f64)> {
    let count = values.clone().count();
    let factor = single.heading().2;
    let middle = values.sum::<f64>() / count as f64;
    (count > 0).then(|| (middle, factor * single.just_noticeable(middle / factor)))
}

fn noticeable_bar(x: Value, (middle, difference): (f64, f64)) -> Value {
    json!({
        "type": "scatter", "mode": "markers", "name": "JND", "x": [x], "y": [rounded(middle)],
        "marker": { "size": 1, "color": "#888" },
        "error_y": { "type": "data", "array": [rounded(0.5 * difference)], "color": "#888", "thickness": 4, "width": 8 },
    })
}

/// Single numbers over the receivers.
pub(super) fn over_receivers(page: &mut Document, subjects: &[Subject]) {
    page.section("Over receivers");
    let names: Vec<String> = subjects.iter().flat_map(|subject| series_names(subjects, subject)).collect();
    let charts: Vec<Value> =
        Single::of(subjects).into_iter().map(|single| receivers_chart(subjects, single)).collect();
    page.charts(if names.len() > 1 { &names } else { &[] }, &charts);
    page.note(
        "Means of 500 and 1000 Hz (LF, LFC and LJ: 125 to 1000 Hz) with 95 % intervals; the grey bar is one just-noticeable difference.",
    );
}

/// The sources of a response, with its name where there are several responses.
fn series_names(subjects: &[Subject], subject: &Subject) -> Vec<String> {
    let name = if subjects.len() > 1 { format!("{}: ", subject.name) } else { String::new() };
    subject.echograms().source_names.iter().map(|source| format!("{name}{source}")).collect()
}

fn receivers_chart(subjects: &[Subject], single: Single) -> Value {
    let factor = single.heading().2;
    let (mut data, mut values) = (Vec::new(), Vec::new());
    for subject in subjects {
        for (source, name) in series_names(subjects, subject).iter().enumerate() {
            let receivers = subject.echograms().receivers();
            let parameters = &subject.parameters[source * receivers..(source + 1) * receivers];
            let (mut names, mut y, mut up, mut down) = (vec![], vec![], vec![], vec![]);
            for receiver in parameters {
                let Ok(estimate) = single.value(receiver) else { continue };
                let [low, high] = estimate.interval.unwrap_or([estimate.value; 2]);
                values.push(factor * estimate.value);
                names.push(escaped(&receiver.name));
                y.push(rounded(factor * estimate.value));
                up.push(rounded(factor * (high - estimate.value)));
                down.push(rounded(factor * (estimate.value - low)));
            }
            data.push(json!({
                "type": "scatter", "mode": "markers", "name": escaped(name), "marker": { "color": color(data.len()) },
                "x": names, "y": y, "error_y": { "type": "data", "symmetric": false, "array": up, "arrayminus": down },
            }));
        }
    }
    if let Some(bar) = bar(single, values.iter().copied()) {
        data.push(noticeable_bar(json!("JND"), bar));
    }
    let y = json!({ "title": { "text": single.label() } });
    let mut layout = layout("", json!({ "type": "category", "automargin": true }), y);
    layout["showlegend"] = json!(false);
    json!({ "data": data, "layout": layout })
}

/// Effects of the map, on and off.
pub(super) fn effects(page: &mut Document, map: Traced<'_>) {
    page.section("Effects");
    let effects = map.map.header().effects.iter();
    let rows: Vec<Vec<String>> = effects
        .map(|effect| vec![effect.effect.name().to_owned(), on_in_words(&effect.on), effect.reason.clone()])
        .collect();
    page.table("long", &["effect", "state", "reason and bound"].map(str::to_owned), &rows);
}

/// Where the energy went.
pub(super) fn ledger(page: &mut Document, map: Traced<'_>) {
    page.section("Energy ledger");
    let keys = ["absorbed", "transmitted", "escaped", "truncated", "sampling"];
    let head: Vec<String> =
        ["f [Hz]"].into_iter().chain(keys).chain(["residual"]).map(str::to_owned).collect();
    let (scene, ledger) = (&map.map.header().scene, map.map.ledger());
    let bands = balances_json(&ledger, scene.bands.nominal(), scene.sources.len());
    let bands = bands.as_array().into_iter().flatten();
    let rows: Vec<Vec<String>> = bands
        .map(|band| {
            let percent = |key: &str| format!("{:.3} %", 100.0 * band[key].as_f64().unwrap_or(f64::NAN));
            let residual = format!("{:.1e}", band["relative_residual"].as_f64().unwrap_or(f64::NAN));
            [band["center_frequency_hz"].as_f64().unwrap_or(f64::NAN).to_string()]
                .into_iter()
                .chain(keys.map(percent))
                .chain([residual])
                .collect()
        })
        .collect();
    page.table("", &head, &rows);
    page.note("Shares of the emitted energy. Truncated is the energy of packets at the end of the simulated time; sampling is random with mean zero.");
    let fates = fates_json(&ledger.fates);
    let fates = fates.as_object().into_iter().flatten();
    let fates: Vec<String> = fates.map(|(name, count)| format!("{name} {count}")).collect();
    page.text(&format!("Packets by fate: {}.", fates.join(", ")));
}

/// Where the numbers come from.
pub(super) fn provenance(page: &mut Document, subjects: &[Subject]) {
    page.section("Provenance");
    for subject in subjects {
        let stated = subject.echograms().provenance.to_json();
        let keys = stated.as_object().into_iter().flatten();
        let plain = keys.filter(|(key, _)| key.as_str() != "sources");
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let mut rows = vec![vec!["response".to_owned(), subject.name.clone()]];
        rows.extend(plain.map(|(key, value)| vec![key.clone(), text(value)]));
        page.table("long", &[], &rows);
    }
}
