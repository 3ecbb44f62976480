//! Deviations of simulated from measured parameters in just-noticeable differences, as CSV, summary and plot.
//!
//! 5 % of a reverberation time or EDT, 1 dB of C80, 0.05 of D50 [ISO3382-1]. Values are means over the pairs, and over the thirds
//! of an octave where the data have thirds.

use std::fmt::{Display, Write};

use anyhow::{Context, Result};
use sonel_drawing::plot::{self, Axis, Mark, Panel, Point, Series, Sheet};

use super::room::{Pairs, Room, Values};

/// What packets say in one variant.
pub(super) struct Run {
    /// That of the variant.
    pub name: &'static str,
    pub title: &'static str,
    pub pairs: Pairs,
}

/// Columns of the summary: names of runs, and headings.
const SETUPS: [(&str, &str); 7] = [
    ("plain", "published or fitted α"),
    ("initial", "initial α"),
    ("angles", "locally reacting"),
    ("straight", "diffraction off"),
    ("rough", "s at least 0.3"),
    ("diffuse", "s = 1"),
    (OTHERS, "median of others"),
];
/// Name of the simulations by others.
const OTHERS: &str = "others";

/// Names, units, and figures after the point, of the values of [`Values`].
fn quantities(room: &Room) -> [(&'static str, &'static str, usize); 4] {
    [(room.reverberation_time.0, "s", 2), ("EDT", "s", 2), ("C80", "dB", 1), ("D50", "1", 2)]
}

/// Deviations of one quantity in one simulation.
struct Row {
    /// Of the means over the pairs, per octave.
    octaves: Vec<f64>,
    /// Mean size over the octaves.
    mean: f64,
    /// Mean size over pairs and bands, where every pair was measured.
    per_pair: Option<f64>,
}

/// The first line of the CSV file.
pub(super) fn csv_head(room: &Room) -> String {
    let columns: Vec<String> = octaves(room).iter().map(|octave| format!("at_{octave}_hz")).collect();
    format!("room,parameter,unit,setup,{},mean_size_jnd,mean_size_per_pair_jnd\n", columns.join(","))
}

/// Lines of the CSV file: measured values, under them the deviations of every run and those of simulations by others.
pub(super) fn csv(room: &Room, runs: &[Run]) -> String {
    let measured = per_octave(room, &means(&room.measured));
    let mut text = String::new();
    for (quantity, (name, unit, decimals)) in quantities(room).into_iter().enumerate() {
        let values = joined(measured.iter().map(|values| format!("{:.decimals$}", values[quantity])));
        text += &format!("{},{name},{unit},measured,{values},,\n", room.name);
        for (_, setup, row) in rows(room, runs, quantity) {
            let octaves = joined(row.octaves.iter().map(|deviation| format!("{deviation:.1}")));
            let per_pair = row.per_pair.map(|size| format!("{size:.1}")).unwrap_or_default();
            text += &format!("{},{name},JND,{setup},{octaves},{:.1},{per_pair}\n", room.name, row.mean);
        }
    }
    text
}

/// The head of the summary.
pub(super) fn summary_head() -> String {
    let headings = SETUPS.map(|(_, heading)| heading).join(" | ");
    format!("| room | | {headings} |\n|---|---|{}\n", "---|".repeat(SETUPS.len()))
}

/// Lines of the summary: mean sizes of the deviations, a line per parameter, a column per setup.
pub(super) fn summary(room: &Room, runs: &[Run]) -> Result<String> {
    let mut text = String::new();
    for (quantity, (name, ..)) in quantities(room).into_iter().enumerate() {
        let title = if quantity == 0 { format!("{} ", room.title) } else { String::new() };
        write!(text, "| {title}| {name} |")?;
        let rows = rows(room, runs, quantity);
        for (setup, _) in SETUPS {
            match rows.iter().find(|(name, ..)| *name == setup) {
                Some((_, _, row)) => write!(text, " {:.1} |", row.mean)?,
                None => text.push_str(" |"),
            }
        }
        text.push('\n');
    }
    Ok(text)
}

/// Names, titles and deviations of all simulations.
fn rows(room: &Room, runs: &[Run], quantity: usize) -> Vec<(&'static str, String, Row)> {
    let ours = runs.iter().map(|run| (run.name, run.title.to_owned(), row(room, quantity, &run.pairs)));
    let others: Vec<Row> = room.others.iter().map(|pairs| row(room, quantity, pairs)).collect();
    let title = format!("median of {} others", others.len());
    let median = (!others.is_empty()).then(|| (OTHERS, title, median_row(&others)));
    ours.chain(median).collect()
}

fn joined(fields: impl Iterator<Item = impl Display>) -> String {
    fields.map(|field| field.to_string()).collect::<Vec<_>>().join(",")
}

fn row(room: &Room, quantity: usize, pairs: &Pairs) -> Row {
    let [ours, theirs] = [pairs, &room.measured].map(|pairs| per_octave(room, &means(pairs)));
    let octaves = deviations(quantity, &ours, &theirs);
    let of_pairs = || {
        let pairs = pairs.iter().zip(&room.measured);
        let all: Vec<f64> = pairs.flat_map(|(ours, theirs)| deviations(quantity, ours, theirs)).collect();
        mean_of_sizes(&all)
    };
    Row { mean: mean_of_sizes(&octaves), octaves, per_pair: (room.measured.len() > 1).then(of_pairs) }
}

/// The median of every figure over simulations that state it.
fn median_row(rows: &[Row]) -> Row {
    let median = |figure: &dyn Fn(&Row) -> f64| {
        let mut figures: Vec<f64> = rows.iter().map(figure).filter(|figure| figure.is_finite()).collect();
        figures.sort_by(f64::total_cmp);
        figures.get(figures.len() / 2).copied().unwrap_or(f64::NAN)
    };
    Row {
        octaves: (0..rows[0].octaves.len()).map(|octave| median(&|row| row.octaves[octave])).collect(),
        mean: median(&|row| row.mean),
        per_pair: rows[0].per_pair.map(|_| median(&|row| row.per_pair.unwrap_or(f64::NAN))),
    }
}

/// Measured values and those of `runs` over frequency, a panel per quantity.
pub(super) fn drawing(room: &Room, runs: &[&Run]) -> Result<Vec<u8>> {
    let measured = means(&room.measured);
    let ticks = octaves(room);
    let panel = |quantity: usize, name: String| {
        let points = |values: &[Values]| {
            room.bands.iter().zip(values).map(|(&band, values)| Point::new(band, values[quantity])).collect()
        };
        let series = runs.iter().map(|run| Series::new(run.title, Mark::Line, points(&means(&run.pairs))));
        let measured = Series::new("measured", Mark::PointsAndLine, points(&measured));
        Panel {
            title: name.clone(),
            x: Axis::logarithmic("band [Hz]").with_ticks(ticks.clone()),
            y: Axis::linear(name),
            series: std::iter::once(measured).chain(series).collect(),
        }
    };
    let mut panels: Vec<Panel> =
        quantities(room).into_iter().enumerate().map(|(quantity, of)| panel(quantity, label(of))).collect();
    let lower = panels.split_off(2);
    let mut svg = Vec::new();
    plot::svg(&Sheet::new(room.title, vec![panels, lower]), &mut svg)
        .with_context(|| format!("cannot draw {}", room.name))?;
    Ok(svg)
}

/// The label of an axis.
fn label((name, unit, _): (&str, &str, usize)) -> String {
    if unit == "1" { name.to_owned() } else { format!("{name} [{unit}]") }
}

/// Nominal centres of the octaves [Hz].
fn octaves(room: &Room) -> Vec<f64> {
    room.bands.chunks(room.bands_per_octave).map(|bands| bands[bands.len() / 2]).collect()
}

/// Means over the pairs, per band.
fn means(pairs: &Pairs) -> Vec<Values> {
    let mean = |band: usize| {
        std::array::from_fn(|quantity| {
            pairs.iter().map(|bands| bands[band][quantity]).sum::<f64>() / pairs.len() as f64
        })
    };
    (0..pairs[0].len()).map(mean).collect()
}

/// Means over the bands of every octave.
fn per_octave(room: &Room, bands: &[Values]) -> Vec<Values> {
    bands
        .chunks(room.bands_per_octave)
        .map(|octave| means(&octave.iter().map(|&band| vec![band]).collect())[0])
        .collect()
}

/// Of a quantity per band, in just-noticeable differences.
fn deviations(quantity: usize, simulated: &[Values], measured: &[Values]) -> Vec<f64> {
    let deviation = |(ours, theirs): (&Values, &Values)| {
        let (ours, theirs) = (ours[quantity], theirs[quantity]);
        match quantity {
            0 | 1 => (ours / theirs - 1.0) / 0.05,
            2 => ours - theirs,
            _ => (ours - theirs) / 0.05,
        }
    };
    simulated.iter().zip(measured).map(deviation).collect()
}

fn mean_of_sizes(deviations: &[f64]) -> f64 {
    deviations.iter().map(|deviation| deviation.abs()).sum::<f64>() / deviations.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validate::room::tests::cube;

    #[test]
    fn deviations_are_just_noticeable_differences() {
        let (ours, theirs) = ([[2.2, 0.9, 3.0, 0.6]], [[2.0, 1.0, 1.0, 0.5]]);
        let found: Vec<f64> = (0..4).map(|quantity| deviations(quantity, &ours, &theirs)[0]).collect();
        for (found, expected) in found.iter().zip([2.0, -2.0, 2.0, 2.0]) {
            assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
        }
    }

    #[test]
    fn tables_have_means_over_pairs_and_thirds() {
        let mut room = cube();
        let pair =
            |time: f64| vec![[time, 1.0, 0.0, 0.5], [time, 1.0, 0.0, 0.5], [time + 0.3, 1.0, 0.0, 0.5]];
        let runs = [Run { name: "angles", title: "ours", pairs: vec![pair(0.9), pair(1.1)] }];
        assert!(csv_head(&room).starts_with("room,parameter,unit,setup,at_1000_hz,mean_size_jnd,"));
        let text = csv(&room, &runs);
        assert!(text.starts_with("cube,T20,s,measured,1.00,,\ncube,T20,JND,ours,2.0,2.0,\n"), "{text}");
        let text = summary(&room, &runs).unwrap();
        assert!(text.starts_with("| cube | T20 | | | 2.0 | | | | |\n| | EDT | | | 0.0 |"), "{text}");
        room.measured = vec![pair(1.0), pair(1.0)];
        let text = csv(&room, &runs);
        // Means agree, and each pair is off by 0.1 s of 1 s, 1 s and 1.3 s.
        assert!(text.contains("cube,T20,JND,ours,0.0,0.0,1.8\n"), "{text}");
    }

    #[test]
    fn others_are_their_median_without_what_they_left_out() {
        let row = |deviation: f64| Row { octaves: vec![deviation], mean: deviation.abs(), per_pair: None };
        let median = median_row(&[row(-3.0), row(f64::NAN), row(-1.0), row(7.0)]);
        assert_eq!((median.octaves, median.mean, median.per_pair), (vec![-1.0], 3.0, None));
        let mut room = cube();
        room.others = vec![vec![vec![[1.1, 1.0, 0.0, 0.5]; 3]]];
        let text = csv(&room, &[]);
        assert!(text.contains("cube,T20,JND,median of 1 others,2.0,2.0,\n"), "{text}");
    }

    #[test]
    fn the_drawing_names_what_it_shows() {
        let room = cube();
        let run = Run { name: "plain", title: "ours", pairs: room.measured.clone() };
        let svg = String::from_utf8(drawing(&room, &[&run]).unwrap()).unwrap();
        assert!(["measured", "ours", "D50", "EDT [s]"].iter().all(|name| svg.contains(name)));
    }
}
