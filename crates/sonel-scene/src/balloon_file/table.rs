//! A table of levels over directions, a CSV file.
//!
//! Angles are multiples of one step each. What symmetry leaves out is mirrored: one azimuth is all, azimuths up to 90° are a quarter, up to
//! 180° a half. A negative polar angle is the positive one at the opposite azimuth, so two polars are the azimuths 0° and 90°.

use std::collections::BTreeMap;

use sonel_acoustics::{BandWidth, Bands, energy_from_level_db};

use super::grid::{Grid, Problems, mean, spread_note};
use crate::problem::LineProblem;

/// Largest distance of an angle from a multiple of the step [°]: files round to two decimals.
const ANGLE_TOLERANCE: f64 = 0.01;
/// Smallest step of a grid [°]. Finer ones would not fit into a map.
const FINEST_STEP: f64 = 1.0;
/// Largest step between azimuths [°]: that of two polars.
const COARSEST_STEP: f64 = 90.0;
/// Highest level [dB], far above any reference; its energy of 1e30 is far from overflow.
const HIGHEST_LEVEL_DB: f64 = 300.0;

/// One row: a direction and its energies in the bands of the scene.
struct Row {
    line: usize,
    azimuth: f64,
    polar: f64,
    energies: Vec<f64>,
}

/// Multiples of a step.
struct Axis {
    step: f64,
    count: usize,
}

/// Reads the grid of a table, for `bands`.
///
/// # Errors
/// Every problem with its line.
pub(super) fn read(bytes: &[u8], bands: &Bands) -> Result<Grid, Problems> {
    let (rows, mut notes) = read_rows(bytes, bands)?;
    let (at_poles, off_poles): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(|row| row.is_pole());
    let poles = [true, false].map(|is_front| pole(&at_poles, is_front));
    let polars = polar_axis(&off_poles)?;
    let azimuths = azimuth_axis(&off_poles)?;
    let energies = fill(&poles, &off_poles, &azimuths, &polars, bands.count())?;
    let largest = off_poles.iter().map(|row| row.azimuth).fold(0.0, f64::max);
    if azimuths.count > 1 && largest <= 180.0 + ANGLE_TOLERANCE {
        let planes = if largest <= 90.0 + ANGLE_TOLERANCE { "both planes" } else { "the horizontal plane" };
        notes.push(format!("azimuths end at {largest}° and are mirrored at {planes}"));
    }
    let largest = poles.iter().flatten().map(|(_, spread)| *spread).fold(0.0, f64::max);
    notes.extend(spread_note("at one pole", largest));
    Ok(Grid { shape: [azimuths.count, polars.count, bands.count()], energies, notes })
}

impl Row {
    fn is_pole(&self) -> bool {
        self.polar < ANGLE_TOLERANCE || self.polar > 180.0 - ANGLE_TOLERANCE
    }
}

/// All rows, and the bands that are not used.
fn read_rows(bytes: &[u8], bands: &Bands) -> Result<(Vec<Row>, Vec<String>), Problems> {
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).comment(Some(b'#')).from_reader(bytes);
    let headers = reader.headers().map_err(|error| vec![LineProblem::new(1, error.to_string())])?.clone();
    let header_line = line_of(bytes, headers.position());
    let (columns, notes) = band_columns(&headers, header_line, bands)?;
    let (mut rows, mut problems) = (Vec::new(), Vec::new());
    for record in reader.records() {
        match record {
            Ok(record) => {
                let line = line_of(bytes, record.position());
                match read_row(&record, line, &headers, &columns) {
                    Ok(row) => rows.push(row),
                    Err(message) => problems.push(LineProblem::new(line, message)),
                }
            }
            Err(error) => {
                let line = line_of(bytes, error.position());
                problems.push(LineProblem::new(line, format!("not readable: {error}")));
            }
        }
    }
    if problems.is_empty() { Ok((rows, notes)) } else { Err(problems) }
}

/// Line of a record, whose position is before the comments and empty lines that precede it.
fn line_of(bytes: &[u8], position: Option<&csv::Position>) -> usize {
    let (mut at, mut line) = position.map_or((0, 1), |place| (place.byte() as usize, place.line() as usize));
    while let Some(length) = bytes[at.min(bytes.len())..].iter().position(|byte| *byte == b'\n') {
        let text = bytes[at..at + length].trim_ascii();
        if !text.is_empty() && text[0] != b'#' {
            break;
        }
        (at, line) = (at + length + 1, line + 1);
    }
    line
}

/// The column of each band.
fn band_columns(
    headers: &csv::StringRecord,
    line: usize,
    bands: &Bands,
) -> Result<(Vec<usize>, Vec<String>), Problems> {
    let names: Vec<&str> = headers.iter().collect();
    let ["azimuth_deg", "polar_deg", centers @ ..] = &names[..] else {
        let found: Vec<&str> = names.into_iter().take(3).collect();
        let message =
            format!("the header begins \"{}\"; it must begin \"azimuth_deg,polar_deg\"", found.join(","));
        return Err(vec![LineProblem::new(line, message)]);
    };
    let mut problems = Vec::new();
    let is_nominal = |hz: f64| {
        [BandWidth::Octave, BandWidth::Third].iter().any(|&width| Bands::problems(&[hz], width).is_empty())
    };
    let mut frequencies = Vec::new();
    for name in centers {
        match name.parse::<f64>() {
            Ok(hz) if is_nominal(hz) && !frequencies.contains(&hz) => frequencies.push(hz),
            Ok(hz) if is_nominal(hz) => {
                problems.push(LineProblem::new(line, format!("band {hz} Hz is given twice")));
            }
            _ => {
                let message =
                    format!("column `{name}` is not a band; name columns by nominal centre frequency in Hz");
                problems.push(LineProblem::new(line, message));
            }
        }
    }
    let place = |hz: &f64| frequencies.iter().position(|known| known.total_cmp(hz).is_eq());
    let missing: Vec<String> =
        bands.nominal().iter().filter(|hz| place(hz).is_none()).map(f64::to_string).collect();
    if !missing.is_empty() && problems.is_empty() {
        let message =
            format!("no column for {} Hz; give one for every band of the scene", missing.join(", "));
        problems.push(LineProblem::new(line, message));
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    let is_unused = |hz: &&f64| !bands.nominal().contains(hz);
    let unused: Vec<String> = frequencies.iter().filter(is_unused).map(f64::to_string).collect();
    let notes =
        if unused.is_empty() { vec![] } else { vec![format!("bands not used: {} Hz", unused.join(", "))] };
    Ok((bands.nominal().iter().filter_map(place).map(|column| column + 2).collect(), notes))
}

fn read_row(
    record: &csv::StringRecord,
    line: usize,
    headers: &csv::StringRecord,
    columns: &[usize],
) -> Result<Row, String> {
    if record.len() != headers.len() {
        return Err(format!("{} columns, the header has {}", record.len(), headers.len()));
    }
    let number = |column: usize| record[column].parse::<f64>().unwrap_or(f64::NAN);
    let (azimuth, polar) = (number(0), number(1));
    if !(-360.0..=360.0).contains(&azimuth) {
        return Err(format!("azimuth `{}` is not an angle of −360 … 360°", &record[0]));
    }
    if !(-180.0..=180.0).contains(&polar) {
        return Err(format!("polar angle `{}` is not an angle of −180 … 180°", &record[1]));
    }
    // Every column, those of bands that the scene lacks, too.
    for column in 2..record.len() {
        let level = number(column);
        if level.is_nan() || level > HIGHEST_LEVEL_DB {
            let (found, hz) = (&record[column], &headers[column]);
            return Err(format!(
                "`{found}` at {hz} Hz is not a level of at most {HIGHEST_LEVEL_DB} dB; write -inf for no sound"
            ));
        }
    }
    let turned = if polar < 0.0 { azimuth + 180.0 } else { azimuth };
    let azimuth = turned - 360.0 * libm::floor((turned + ANGLE_TOLERANCE) / 360.0);
    let energies = columns.iter().map(|&column| energy_from_level_db(number(column))).collect();
    Ok(Row { line, azimuth: azimuth.max(0.0), polar: polar.abs(), energies })
}

/// Number of the multiple of `step` that `angle` is; an error with the line where it is none.
fn multiple(angle: f64, step: f64, what: &str, line: usize) -> Result<usize, LineProblem> {
    let number = libm::round(angle / step);
    if (angle - number * step).abs() > ANGLE_TOLERANCE {
        let message =
            format!("{what} {angle}° is not a multiple of the step {step}°: all steps must be equal");
        return Err(LineProblem::new(line, message));
    }
    Ok(number as usize)
}

fn check_step(step: f64, whole: f64, what: &str, line: usize) -> Result<Axis, Problems> {
    let count = libm::round(whole / step);
    if step < FINEST_STEP - ANGLE_TOLERANCE || (count * step - whole).abs() > count * ANGLE_TOLERANCE {
        let message =
            format!("step {step}° between {what}s does not divide {whole}°, or is below {FINEST_STEP}°");
        return Err(vec![LineProblem::new(line, message)]);
    }
    Ok(Axis { step: whole / count, count: count as usize })
}

/// Polar angles from pole to pole.
fn polar_axis(off_poles: &[&Row]) -> Result<Axis, Problems> {
    let problem = "no direction but the poles; give polar angles between 0 and 180°";
    let first = off_poles.first().ok_or_else(|| vec![LineProblem::new(1, problem)])?;
    let mut angles: Vec<f64> = off_poles.iter().map(|row| row.polar).chain([0.0, 180.0]).collect();
    let axis = check_step(usual_step(&mut angles), 180.0, "polar angle", first.line)?;
    Ok(Axis { count: axis.count + 1, ..axis })
}

/// Azimuths around the aim; one where the rows have only one.
fn azimuth_axis(off_poles: &[&Row]) -> Result<Axis, Problems> {
    let mut angles: Vec<f64> = off_poles.iter().map(|row| row.azimuth).collect();
    let line = off_poles.first().map_or(1, |row| row.line);
    let step = usual_step(&mut angles);
    if !step.is_finite() {
        return Ok(Axis { step: 360.0, count: 1 });
    }
    if step > COARSEST_STEP + ANGLE_TOLERANCE {
        let message =
            format!("azimuths are {step}° apart, at most 90° are allowed; give a second polar at azimuth 90");
        return Err(vec![LineProblem::new(line, message)]);
    }
    check_step(step, 360.0, "azimuth", line)
}

/// Median distance between neighbouring angles: one that is off does not change it. Infinite where all are the same.
fn usual_step(angles: &mut [f64]) -> f64 {
    angles.sort_by(f64::total_cmp);
    let steps = angles.windows(2).map(|pair| pair[1] - pair[0]);
    let mut steps: Vec<f64> = steps.filter(|step| *step > ANGLE_TOLERANCE).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY)
}

/// Energies of the whole grid by azimuth, polar angle and band.
fn fill(
    poles: &[Option<(Vec<f64>, f64)>; 2],
    off_poles: &[&Row],
    azimuths: &Axis,
    polars: &Axis,
    bands: usize,
) -> Result<Vec<f64>, Problems> {
    let mut problems = Vec::new();
    let mut nodes: BTreeMap<(usize, usize), &Row> = BTreeMap::new();
    for row in off_poles {
        let i = multiple(row.azimuth, azimuths.step, "azimuth", row.line);
        let j = multiple(row.polar, polars.step, "polar angle", row.line);
        match (i, j) {
            (Ok(i), Ok(j)) => {
                if let Some(first) = nodes.insert((i % azimuths.count, j), row) {
                    let message = format!("this direction is given already in line {}", first.line);
                    problems.push(LineProblem::new(row.line, message));
                }
            }
            (i, j) => problems.extend([i.err(), j.err()].into_iter().flatten()),
        }
    }
    let farthest = nodes.keys().map(|(i, _)| *i).max().unwrap_or(0);
    let mirrored = mirror(farthest, azimuths.count);
    let mut energies = Vec::with_capacity(azimuths.count * polars.count * bands);
    let mut gaps: Vec<(usize, usize)> = Vec::new();
    for (i, j) in (0..azimuths.count).flat_map(|i| (0..polars.count).map(move |j| (i, j))) {
        if j == 0 || j + 1 == polars.count {
            let Some((mean, _)) = &poles[usize::from(j > 0)] else {
                let angle = if j == 0 { 0 } else { 180 };
                let message = format!("no row with polar angle {angle}°; the grid ends there");
                return Err(vec![LineProblem::new(1, message)]);
            };
            energies.extend(mean);
        } else if let Some(row) = nodes.get(&(mirrored(i), j)) {
            energies.extend(&row.energies);
        } else {
            gaps.push((mirrored(i), j));
        }
    }
    gaps.sort_unstable();
    gaps.dedup();
    if let (Some(&(i, j)), true) = (gaps.first(), problems.is_empty()) {
        let before = nodes.range(..(i, j)).next_back().map_or(1, |(_, row)| row.line);
        let others = match gaps.len() {
            1 => String::new(),
            count => format!(", nor for {} other directions", count - 1),
        };
        let (azimuth, polar) = (i as f64 * azimuths.step, j as f64 * polars.step);
        let message = format!(
            "gap in the grid behind this line: no row for azimuth {azimuth}°, polar angle {polar}°{others}"
        );
        problems.push(LineProblem::new(before, message));
    }
    if problems.is_empty() { Ok(energies) } else { Err(problems) }
}

/// Azimuth of the file that stands for each of `count`, when its last is number `farthest`.
fn mirror(farthest: usize, count: usize) -> impl Fn(usize) -> usize {
    move |i: usize| {
        let folded = if 2 * farthest <= count { i.min(count - i) } else { i };
        if 4 * farthest <= count && 4 * farthest > 0 {
            folded.min((count / 2).abs_diff(folded))
        } else {
            folded
        }
    }
}

/// Mean energies of the rows at a pole, and by how much these differ [dB].
fn pole(rows: &[&Row], is_front: bool) -> Option<(Vec<f64>, f64)> {
    let here = rows.iter().filter(|row| (row.polar < 90.0) == is_front);
    let energies: Vec<&[f64]> = here.map(|row| &row.energies[..]).collect();
    (!energies.is_empty()).then(|| mean(&energies))
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;
    use sonel_acoustics::Balloon;

    /// Rows of `level` [dB] at `azimuths` and `polars` [°] in one band.
    fn table(azimuths: &[i32], polars: &[i32], level: impl Fn(f64, f64) -> f64) -> String {
        let mut text = "# a comment\nazimuth_deg,polar_deg,1000\n".to_owned();
        for (a, p) in azimuths.iter().flat_map(|a| polars.iter().map(move |p| (a, p))) {
            text += &format!("{a},{p},{}\n", level(f64::from(*a).to_radians(), f64::from(*p).to_radians()));
        }
        text
    }

    fn bands() -> Bands {
        Bands::new(vec![1000.0], BandWidth::Octave).unwrap()
    }

    fn balloon(text: &str) -> Balloon {
        read("dir/l.csv", text.as_bytes(), &bands()).unwrap_or_else(|p| panic!("{p:?}")).0
    }

    /// Louder to the front, less so upwards: the same on both sides of both planes.
    fn level(azimuth: f64, polar: f64) -> f64 {
        -10.0 * (1.0 - polar.cos()) - 3.0 * (polar.sin() * azimuth.sin()).powi(2)
    }

    #[test]
    fn symmetric_tables_are_the_whole_one() {
        let polars: Vec<i32> = (0..=18).map(|i| 10 * i).collect();
        let whole: Vec<i32> = (0..12).map(|i| 30 * i).collect();
        let full = balloon(&table(&whole, &polars, level));
        assert_eq!((full.shape(), full.name()), ([12, 19, 1], "l.csv"));
        let close = |other: Balloon| {
            let pairs = full.factors().iter().zip(other.factors());
            assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-12) && other.shape() == full.shape());
        };
        close(balloon(&table(&whole[..7], &polars, level)));
        close(balloon(&table(&whole[..4], &polars, level)));
        let around: Vec<i32> = (-18..=18).map(|i| 10 * i).collect();
        close(balloon(&table(&whole[..6], &around, level)));
        let two = balloon(&table(&[0, 90], &around, level));
        assert_eq!((two.shape(), two.factors().len()), ([4, 19, 1], 76));
        assert_eq!(balloon(&table(&[0], &polars, level)).shape(), [1, 19, 1]);
    }

    #[test]
    fn notes_tell_symmetry_unused_bands_and_directivity_index() {
        let polars: Vec<i32> = (0..=36).map(|i| 5 * i).collect();
        let cardioid = |_: f64, polar: f64| 20.0 * ((0.5 + 0.5 * polar.cos()).max(0.0)).log10();
        let text = table(&[0, 45, 90], &polars, cardioid);
        let (_, notes) = read("l.csv", text.as_bytes(), &bands()).unwrap();
        assert!(notes[0].contains("90°") && notes[0].contains("both planes"), "{notes:?}");
        assert!(notes[1].contains("index 4.8 dB at 1000 Hz"), "{notes:?}");
    }

    #[test]
    fn every_mistake_is_named_with_its_line() {
        let polars: Vec<i32> = (0..=18).map(|i| 10 * i).collect();
        let good = table(&[0, 90, 180, 270], &polars, level);
        let lines: Vec<&str> = good.lines().collect();
        let replaced = |line: usize, with: &str| {
            let mut lines = lines.clone();
            lines[line - 1] = with;
            lines.join("\n")
        };
        let without = |line: usize| {
            let mut lines = lines.clone();
            lines.remove(line - 1);
            lines.join("\n")
        };
        let cases = [
            (replaced(2, "polar_deg,azimuth_deg,1000"), 2, "must begin"),
            (replaced(2, "azimuth_deg,polar_deg,1001"), 2, "`1001` is not a band"),
            (replaced(2, "azimuth_deg,polar_deg,500"), 2, "no column for 1000 Hz"),
            (replaced(7, "0,40,NaN"), 7, "`NaN` at 1000 Hz is not a level"),
            (replaced(7, "0,40,inf"), 7, "is not a level"),
            (replaced(7, "0,40,-3 dB"), 7, "is not a level"),
            (replaced(7, "0,240,-3"), 7, "polar angle `240`"),
            (replaced(7, "x,40,-3"), 7, "azimuth `x`"),
            (replaced(7, "0,40"), 7, "2 columns, the header has 3"),
            (replaced(7, "0,30,-3"), 7, "already in line 6"),
            (replaced(7, "0,43,-3"), 7, "43° is not a multiple of the step 10°"),
            (table(&[0], &[0, 70, 140, 180], level), 4, "does not divide 180°"),
            (without(7), 6, "no row for azimuth 0°, polar angle 40°"),
            (lines[..2].join("\n"), 1, "no direction but the poles"),
            (table(&[0, 180], &polars, level), 4, "second polar"),
            (table(&[0], &polars[..18], level), 1, "no row with polar angle 180°"),
            (table(&[0], &polars, |_, _| f64::NEG_INFINITY), 1, "no direction has sound"),
        ];
        for (text, line, expected) in cases {
            let found = read("l.csv", text.as_bytes(), &bands()).expect_err(expected);
            let has = |found: &LineProblem| found.line == line && found.message.contains(expected);
            assert!(found.iter().any(has), "{line} {expected}: {found:?}");
        }
        assert!(read("l.csv", &[0xff, 0xfe, 0], &bands()).is_err());
    }
}
