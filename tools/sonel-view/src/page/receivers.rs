//! What every receiver has: tables over the bands, and maps where receivers lie close.

use sonel::analysis::average::single_number;
use sonel::analysis::comparison::Pairing;
use sonel::analysis::report::{Column, beside_blocks};
use sonel::analysis::{Parameter, ParameterValue, ReceiverParameters};
use sonel::drawing::plot::{self, Axis, Place, Plan, Plans, Sheet};

use super::document::Document;
use super::single::{Single, cell};
use super::{Subject, Traced};

/// Pairs of source and receiver with tables of their own: each takes some 3 kB of the page.
const MOST_TABLES: usize = 500;
/// Receivers below which a map is dots that a table says better.
const LEAST_MAPPED: usize = 12;
/// Receivers up to which the page has maps: each takes 0.1 kB in every map.
const MOST_MAPPED: usize = 5000;

/// Tables over the bands of every source at every receiver, folded; several responses side by side.
pub(super) fn tables(page: &mut Document, subjects: &[Subject]) {
    page.section("Over frequency, in numbers");
    let columns: Vec<Column> = subjects
        .iter()
        .map(|subject| Column {
            name: subject.name.clone(),
            parameters: subject.parameters.clone(),
            pairing: Pairing::of(&subjects[0].echograms().provenance, &subject.echograms().provenance),
        })
        .collect();
    let mut left_out = 0;
    if let [column] = &columns[..] {
        for receiver in column.parameters.iter().take(MOST_TABLES) {
            let (head, rows) = over_bands(receiver);
            page.folded(&format!("{} → {}", receiver.source, receiver.name), &head, &rows);
        }
        left_out = column.parameters.len().saturating_sub(MOST_TABLES);
    } else {
        let blocks = beside_blocks(&columns, false, &mut |value, factor| cell(value, factor));
        left_out += blocks.len().saturating_sub(MOST_TABLES);
        for block in blocks.into_iter().take(MOST_TABLES) {
            let receiver = block.receiver.unwrap_or_default();
            page.folded(&format!("{} → {receiver}", block.source), &block.head, &block.rows);
        }
    }
    if left_out > 0 {
        page.text(&format!("Tables of {left_out} more pairs of source and receiver are left out: sonel-analyze parameters prints them."));
    }
    page.note(
        "± half of the 95 % interval. Of differences: (0) not beyond the noise of the simulation, * beyond it and at least one just-noticeable difference (JND).",
    );
}

/// Bands, single numbers and just-noticeable differences of one receiver.
fn over_bands(receiver: &ReceiverParameters) -> (Vec<String>, Vec<Vec<String>>) {
    let parameters = receiver.listed();
    let headings = parameters.iter().map(|parameter| Single::Of(*parameter).label());
    let head = std::iter::once("f [Hz]".to_owned()).chain(headings).collect();
    let row = |name: String, of: &dyn Fn(Parameter) -> ParameterValue| -> Vec<String> {
        let cells = parameters.iter().map(|&parameter| cell(&of(parameter), parameter.heading().2));
        std::iter::once(name).chain(cells).collect()
    };
    let bands = receiver.bands.iter();
    let mut rows: Vec<Vec<String>> = bands
        .map(|band| row(band.center_frequency_hz.to_string(), &|parameter| band.parameter(parameter).clone()))
        .collect();
    rows.push(row("single".to_owned(), &|parameter| single_number(receiver, parameter)));
    let noticed = parameters.iter().map(|parameter| Single::Of(*parameter).just_noticeable_in_words());
    rows.push(std::iter::once("JND".to_owned()).chain(noticed).collect());
    (head, rows)
}

/// Single numbers in colours over the room, of every source, where receivers are a grid or an audience.
pub(super) fn maps(page: &mut Document, subjects: &[Subject], map: Option<Traced<'_>>) {
    let count = |subject: &Subject| subject.echograms().receivers();
    let is_mapped = |subject: &&Subject| (LEAST_MAPPED..=MOST_MAPPED).contains(&count(subject));
    let mapped: Vec<&Subject> = subjects.iter().filter(is_mapped).collect();
    if mapped.is_empty() {
        return;
    }
    page.section("Maps");
    let mut sources: Vec<&String> = Vec::new();
    for source in mapped.iter().flat_map(|subject| &subject.echograms().source_names) {
        if !sources.contains(&source) {
            sources.push(source);
        }
    }
    let shown = [Parameter::Strength, Parameter::T30, Parameter::ClarityC80].map(Single::Of);
    for source in sources {
        for single in shown.into_iter().chain([Single::Speech]) {
            figure(page, &mapped, map, source, single);
        }
    }
    page.note("Single numbers. A cell reaches halfway to the next receiver; grey: no value. The cross is the source.");
}

fn figure(page: &mut Document, subjects: &[&Subject], map: Option<Traced<'_>>, source: &str, single: Single) {
    let plans: Vec<Plan> = subjects.iter().filter_map(|subject| plan(subject, map, source, single)).collect();
    if plans.is_empty() || plans.iter().all(|plan| plan.spots.iter().all(|spot| spot.value.is_none())) {
        return;
    }
    let plans = Plans { scale: Axis::linear(single.label()), each: plans };
    let mut drawn = Vec::new();
    // Writing to memory cannot fail; a drawing that does is left out, its numbers are in the tables.
    let sheet = Sheet { plans: Some(plans), ..Sheet::default() };
    if plot::svg(&sheet, &mut drawn).is_ok() {
        page.drawing(&format!("{} of {source}", single.heading().0), &String::from_utf8_lossy(&drawn));
    }
}

fn plan(subject: &Subject, map: Option<Traced<'_>>, source: &str, single: Single) -> Option<Plan> {
    let (symbol, _, factor) = single.heading();
    let echograms = subject.echograms();
    let index = echograms.source_names.iter().position(|name| name == source)?;
    let own = subject.parameters.iter().filter(|receiver| receiver.source == source);
    let places: Vec<Place> = own
        .map(|receiver| Place {
            position: receiver.position,
            value: single.value(receiver).ok().map(|estimate| factor * estimate.value),
        })
        .collect();
    let room = map.map(|map| &map.map.header().scene).map(|scene| (&scene.mesh, scene.up));
    let title = format!("{symbol}: {}", subject.name);
    Some(Plan::of(title, &places, echograms.source_positions[index], room))
}
