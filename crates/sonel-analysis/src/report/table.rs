//! Text table: a block per source and receiver, a row per band, explanations of missing values below.

use sonel_acoustics::noise::{NoiseCurve, RoomCriterion};

use super::aligned;
use crate::average::single_number;
use crate::echo::ECHO_CRITERIA;
use crate::estimate::{Estimate, ParameterValue, Unsupported};
use crate::parameter::Parameter;
use crate::receiver::{BandParameters, ReceiverParameters, SpeechInNoise};

/// Aligned text; `title` begins the line above every block; the speech transmission index
/// may have noise. Remarks are printed once, below all blocks.
#[must_use]
pub fn table(receivers: &[ReceiverParameters], title: &str, has_noise: bool) -> String {
    let mut notes = Notes::default();
    let noise = if has_noise { "with noise" } else { "no noise" };
    let blocks: Vec<String> =
        receivers.iter().map(|receiver| block(receiver, title, noise, &mut notes)).collect();
    let materials = of_materials(receivers);
    format!(
        "{}\n±: half-width of the 95 % interval{materials}; JND: just-noticeable difference; single: mean over the octaves of the single number\n{}",
        blocks.join("\n"),
        notes.text()
    )
}

/// What tables say of a second interval, if any value has one.
pub(super) fn of_materials<'a>(parameters: impl IntoIterator<Item = &'a ReceiverParameters>) -> &'static str {
    let mut values = parameters.into_iter().flat_map(ReceiverParameters::values).flatten();
    let is_known = values.any(|estimate| !estimate.materials.is_empty());
    if is_known { " of the simulation, then that of the materials" } else { "" }
}

/// Heads of the columns of frequencies, `parameters` and what follows them.
pub(super) fn headings<'a>(
    parameters: impl IntoIterator<Item = &'a Parameter>,
    more: impl IntoIterator<Item = &'a str>,
) -> Vec<String> {
    let heading = |parameter: &Parameter| {
        let (symbol, unit, _) = parameter.heading();
        format!("{symbol} [{unit}]")
    };
    let more = more.into_iter().map(str::to_owned);
    std::iter::once("f [Hz]".to_owned()).chain(parameters.into_iter().map(heading)).chain(more).collect()
}

fn block(receiver: &ReceiverParameters, title: &str, noise: &str, notes: &mut Notes) -> String {
    let parameters = receiver.listed();
    let head = headings(&parameters, ["ξ T30 [‰]", "C [%]"]);
    let mut rows: Vec<Vec<String>> =
        receiver.bands.iter().map(|band| row(band, &parameters, notes)).collect();
    rows.push(single_numbers(receiver, &parameters, notes));
    rows.push(just_noticeable(&parameters));
    make_room_for_marks(&mut rows);
    let [x, y, z] = receiver.position;
    let speech = cell(&receiver.speech_transmission_index, 1.0, notes);
    let level = cell(&receiver.a_weighted_level_db, 1.0, notes);
    let mut levels = format!("A-weighted level [dB]: {level}{}\n", ratings(receiver));
    if let Some(SpeechInNoise { level_db, noise_level_db, signal_to_noise_db }) = &receiver.in_noise {
        let [speech, ratio] = [level_db, signal_to_noise_db].map(|estimate| cell(estimate, 1.0, notes));
        levels.push_str(&format!(
            "speech [dB(A)]: {speech}; noise [dB(A)]: {noise_level_db:.1}; signal-to-noise ratio [dB]: {ratio}\n"
        ));
    }
    let echoes = ECHO_CRITERIA.iter().zip(&receiver.echo).map(|(criterion, found)| {
        format!("{} {} (limit {:.1})", criterion.name, cell(found, 1.0, notes), criterion.limit)
    });
    levels.push_str(&format!("echo criterion: {}\n", echoes.collect::<Vec<_>>().join("; ")));
    format!(
        "{title}source \"{}\" at receiver \"{}\" ({x}, {y}, {z}) m\n{}speech transmission index, {noise}: {speech}\n{levels}",
        receiver.source,
        receiver.name,
        aligned(head, rows, ..)
    )
}

/// What the octaves of the source are as a noise: NR, NC and RC.
fn ratings(receiver: &ReceiverParameters) -> String {
    let levels = receiver.octave_levels_db();
    let curves = [("NR", NoiseCurve::Nr), ("NC", NoiseCurve::Nc)];
    let curves = curves.into_iter().map(|(name, curve)| match curve.rating(&levels) {
        Some(rating) => format!("; {name} {rating:.0}"),
        None => format!("; {name} –"),
    });
    let room = RoomCriterion::of(&levels).map(|room| format!("; {room}"));
    curves.chain(room).collect()
}

/// Blanks after numbers without a mark, so that those of a column stand below one another.
fn make_room_for_marks(rows: &mut [Vec<String>]) {
    let mark = |cell: &String| cell.find(MARK).map_or(0, |at| cell.len() - at);
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    for column in 0..columns {
        let mut cells: Vec<&mut String> = rows.iter_mut().filter_map(|row| row.get_mut(column)).collect();
        let widest = cells.iter().map(|cell| mark(cell)).max().unwrap_or(0);
        for cell in &mut cells {
            let room = widest - mark(cell);
            cell.push_str(&" ".repeat(room));
        }
    }
}

fn row(band: &BandParameters, parameters: &[Parameter], notes: &mut Notes) -> Vec<String> {
    let parameters =
        parameters.iter().map(|&parameter| cell(band.parameter(parameter), parameter.heading().2, notes));
    std::iter::once(band.center_frequency_hz.to_string()).chain(parameters).chain(quality(band)).collect()
}

/// Non-linearity and curvature (ISO 3382-2) of the decay that T30 was read from.
fn quality(band: &BandParameters) -> [String; 2] {
    let decay = band.parameter(Parameter::T30).as_ref().ok().and_then(|estimate| estimate.decay);
    // Adding zero to a rounded value makes −0.0 plain zero.
    let in_tenths = |value: f64| format!("{:.1}", (value * 10.0).round() / 10.0 + 0.0);
    [decay.map(|decay| decay.non_linearity_permille), decay.and_then(|decay| decay.curvature_percent)]
        .map(|value| value.map_or_else(|| "–".to_owned(), in_tenths))
}

/// Single numbers: means over the octaves of each parameter.
fn single_numbers(receiver: &ReceiverParameters, parameters: &[Parameter], notes: &mut Notes) -> Vec<String> {
    let numbers = parameters.iter().map(|&parameter| {
        let found = single_number(receiver, parameter);
        if matches!(found, Err(Unsupported::OctavesMissing { .. })) {
            return "–".to_owned();
        }
        cell(&found, parameter.heading().2, notes)
    });
    std::iter::once("single".to_owned()).chain(numbers).collect()
}

/// The last row: what a listener notices of each parameter.
fn just_noticeable(parameters: &[Parameter]) -> Vec<String> {
    let differences = parameters.iter().map(|parameter| {
        if parameter.is_noticed_relatively() {
            format!("{} %", 100.0 * parameter.just_noticeable(1.0))
        } else {
            (parameter.just_noticeable(0.0) * parameter.heading().2).to_string()
        }
    });
    std::iter::once("JND".to_owned()).chain(differences).collect()
}

/// A value times `factor` with its intervals, and marks of what is to be said of it.
pub fn cell(estimate: &ParameterValue, factor: f64, notes: &mut Notes) -> String {
    let estimate = match estimate {
        Ok(estimate) => estimate,
        Err(reason) => return format!("–{}", notes.mark(&reason.to_string())),
    };
    let value = estimate.value * factor;
    let warning = estimate.warning.as_ref().map(|warning| notes.mark(warning)).unwrap_or_default();
    match &estimate.interval {
        Ok([low, high]) => {
            // Where the run ends early, an interval reaches further to one side.
            let half = (high - estimate.value).max(estimate.value - low) * factor;
            let digits = digits(value, half);
            format!("{value:.digits$} ±{half:.digits$}{}{warning}", by_materials(estimate, factor, digits))
        }
        Err(reason) => {
            let low = estimate.material_interval().map(|[low, _]| factor * (estimate.value - low));
            let digits = digits(value, low.unwrap_or(0.0));
            let simulation = if low.is_some() { " ±–" } else { "" };
            let materials = by_materials(estimate, factor, digits);
            format!("{value:.digits$}{simulation}{materials}{warning}{}", notes.mark(&reason.to_string()))
        }
    }
}

/// ` ±0.34`, or ` −0.25 +0.57` to either side, of the interval of the materials; empty where it is not known.
#[must_use]
pub fn by_materials(estimate: &Estimate, factor: f64, digits: usize) -> String {
    let Some([low, high]) = estimate.material_interval() else { return String::new() };
    let side =
        |off: f64| if off.is_finite() { format!("{:.digits$}", factor * off) } else { "∞".to_owned() };
    match (side(estimate.value - low), side(high - estimate.value)) {
        (low, high) if low == high => format!(" ±{low}"),
        (low, high) => format!(" −{low} +{high}"),
    }
}

/// Decimals that show two digits of the half-width, and no more than anybody can use.
#[must_use]
pub fn digits(value: f64, half: f64) -> usize {
    let most = if value.abs() < 10.0 { 3 } else { 2 };
    let wanted = if half > 0.0 { 1.0 - libm::floor(libm::log10(half)) } else { f64::from(most) };
    wanted.clamp(1.0, f64::from(most)) as usize
}

/// Begin of the mark of a remark.
const MARK: &str = " [";

/// Remarks, numbered in the order they are first made. Those that differ in numbers alone share one.
#[derive(Debug, Default)]
pub struct Notes {
    remarks: Vec<Remark>,
}

#[derive(Debug)]
struct Remark {
    first: String,
    has_other_numbers: bool,
}

impl Notes {
    /// The mark of a remark.
    pub fn mark(&mut self, remark: &str) -> String {
        let index =
            self.remarks.iter().position(|known| without_numbers(&known.first) == without_numbers(remark));
        let index = index.unwrap_or_else(|| {
            self.remarks.push(Remark { first: remark.to_owned(), has_other_numbers: false });
            self.remarks.len() - 1
        });
        let known = &mut self.remarks[index];
        known.has_other_numbers |= known.first != remark;
        format!("{MARK}{}]", index + 1)
    }

    /// All remarks, a line each.
    #[must_use]
    pub fn text(&self) -> String {
        let line = |(index, remark): (usize, &Remark)| {
            let more = if remark.has_other_numbers { " (numbers of the first case)" } else { "" };
            format!("[{}] {}{more}\n", index + 1, remark.first)
        };
        self.remarks.iter().enumerate().map(line).collect()
    }
}

fn without_numbers(remark: &str) -> String {
    remark.chars().filter(|letter| !letter.is_ascii_digit() && !matches!(letter, '.' | '-' | '−')).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::{MaterialChange, NoInterval};

    #[test]
    fn numbers_with_and_without_a_mark_stand_below_one_another() {
        let mut rows = [["1.25 ±0.10", "–"], ["2.50 ±0.10 [12]", "3"], ["–", "4"]]
            .map(|row| row.map(str::to_owned).to_vec());
        make_room_for_marks(&mut rows);
        assert_eq!(rows, [["1.25 ±0.10     ", "–"], ["2.50 ±0.10 [12]", "3"], ["–     ", "4"]]);
    }

    #[test]
    fn a_warning_has_its_mark_where_there_is_no_interval() {
        let mut notes = Notes::default();
        let estimate =
            Estimate::bare(1.25, Err(NoInterval::SingleMeasurement)).warned(Some("bent".to_owned()));
        assert_eq!(cell(&Ok(estimate), 1.0, &mut notes), "1.250 [1] [2]");
        assert_eq!(notes.text(), "[1] bent\n[2] a single measurement has no interval\n");
    }

    #[test]
    fn intervals_of_materials_have_two_sides() {
        let materials = vec![MaterialChange { by_one: -0.2, at_ends: [0.4, -0.4] }];
        let time = Estimate { is_time: true, materials, ..Estimate::bare(1.0, Ok([0.99, 1.01])) };
        let written = |estimate: &Estimate| cell(&Ok(estimate.clone()), 1.0, &mut Notes::default());
        assert_eq!(written(&time), "1.000 ±0.010 −0.286 +0.667");
        assert_eq!(written(&Estimate { is_time: false, ..time.clone() }), "1.000 ±0.010 ±0.400");
        let endless = MaterialChange { by_one: -0.6, at_ends: [1.2, -0.4] };
        assert_eq!(written(&Estimate { materials: vec![endless], ..time }), "1.000 ±0.010 −0.286 +∞");
    }

    #[test]
    fn remarks_that_differ_in_numbers_alone_are_printed_once() {
        let mut notes = Notes::default();
        let marks = ["only 12.5 dB", "no energy", "only 9 dB", "no energy"].map(|remark| notes.mark(remark));
        assert_eq!(marks, [" [1]", " [2]", " [1]", " [2]"]);
        assert_eq!(notes.text(), "[1] only 12.5 dB (numbers of the first case)\n[2] no energy\n");
    }
}
