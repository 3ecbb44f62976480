//! Material files of other programs.
//!
//! - CATT-Acoustic, any text with lines `ABS name = <12 10 8 7 5 4> L <30 40 50 60 70 80> {r g b}`: percent, octaves from 125 Hz,
//!   L is scattering, 8 and 16 kHz may follow a colon; `ABS name = other` repeats another one, `;` begins a comment, other statements are not looked at.
//! - ODEON, `.Li8`: a line with number and description, then a line with α in the octaves 63 … 8000 Hz. Both name it.
//! - pyroomacoustics, `.json`: `center_freqs`, then `absorption` and `scattering` by group and name, each with `description` and
//!   `coeffs`.

use std::collections::HashMap;

use serde_json::{Map, Value};

use super::{FIRST_OCTAVE_HZ, LibraryEntry, Octaves, octave};
use crate::notation::text_of;
use crate::problem::LineProblem;

type Problems = Vec<LineProblem>;

/// The entries of a file called `path`.
///
/// # Errors
/// Every problem with its line; 0 where the file knows no lines.
pub(crate) fn read(path: &str, bytes: &[u8]) -> Result<Vec<LibraryEntry>, Problems> {
    let text = text_of(bytes);
    let lower = path.to_lowercase();
    let (entries, mut problems) = if lower.ends_with(".json") {
        read_pyroomacoustics(&text)
    } else if lower.ends_with(".li8") {
        read_odeon(&text)
    } else {
        read_catt(&text)
    };
    if entries.is_empty() && problems.is_empty() {
        let message = "no material: known are ABS lines (CATT), .Li8 (ODEON) and .json (pyroomacoustics)";
        problems.push(LineProblem::new(0, message));
    }
    if problems.is_empty() { Ok(entries) } else { Err(problems) }
}

/// Finite numbers of 0 and more in a text, times `scale`.
fn numbers<'w>(words: impl Iterator<Item = &'w str>, scale: f64) -> Result<Vec<f64>, String> {
    words
        .map(|word| match word.parse::<f64>() {
            Ok(value) if value.is_finite() && value >= 0.0 => Ok(value * scale),
            _ => Err(format!("`{word}` is not a coefficient; give numbers of 0 and more")),
        })
        .collect()
}

fn read_catt(text: &str) -> (Vec<LibraryEntry>, Problems) {
    let (mut entries, mut problems): (Vec<LibraryEntry>, Problems) = Default::default();
    let mut index: HashMap<String, usize> = HashMap::new();
    let code = |line: &str| line.split(';').next().unwrap_or("").trim().to_owned();
    let mut lines = text.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        let mut statement = code(line);
        let is_definition = statement.get(..4).is_some_and(|begin| begin.eq_ignore_ascii_case("ABS "))
            && statement.contains('=');
        if !is_definition {
            continue;
        }
        while statement.matches('<').count() > statement.matches('>').count() {
            let Some((_, next)) = lines.next() else { break };
            statement = statement + " " + &code(next);
        }
        let (name, value) = statement[4..].split_once('=').expect("a definition has an equals sign");
        let name = name.trim();
        match catt_value(value.trim(), &entries, &index) {
            Ok(_) if index.contains_key(name) => {
                problems.push(LineProblem::new(number + 1, format!("ABS {name}: defined twice")));
            }
            Ok((absorption, scattering)) => {
                index.insert(name.to_owned(), entries.len());
                entries.push(LibraryEntry {
                    name: name.to_owned(),
                    group: "CATT".to_owned(),
                    text: name.to_owned(),
                    absorption: Some(absorption),
                    scattering,
                    source: "CATT material file".to_owned(),
                });
            }
            Err(message) => problems.push(LineProblem::new(number + 1, format!("ABS {name}: {message}"))),
        }
    }
    (entries, problems)
}

type Coefficients = (Octaves, Option<Octaves>);

/// The right-hand side: numbers, or the name of another material.
fn catt_value(
    value: &str,
    entries: &[LibraryEntry],
    index: &HashMap<String, usize>,
) -> Result<Coefficients, String> {
    if !value.starts_with('<') {
        let other = index
            .get(value)
            .and_then(|at| Some((entries[*at].absorption.clone()?, entries[*at].scattering.clone())));
        return other.ok_or_else(|| format!("no ABS `{value}` before it"));
    }
    let mut absorption = None;
    let mut scattering = None;
    let mut rest = value;
    while let Some((label, after)) = rest.split_once('<') {
        let (list, next) = after.split_once('>').ok_or("`<` without `>`")?;
        let words = list.split(|c: char| c.is_whitespace() || c == ':').filter(|word| !word.is_empty());
        let values = numbers(words, 0.01)?;
        let is_single = values.len() == 1 && label.trim() == "L";
        if !is_single && !(6..=8).contains(&values.len()) {
            return Err(format!("{} numbers; give 6 to 8 octaves from 125 Hz", values.len()));
        }
        let octaves = Some(Octaves { first_hz: FIRST_OCTAVE_HZ, values });
        match label.trim() {
            "" if absorption.is_none() => absorption = octaves,
            "L" => scattering = octaves,
            unknown => return Err(format!("`{unknown} <…>` is not read; known is L <scattering>")),
        }
        rest = next.trim();
        // Colours follow in braces.
        if let Some((_, behind)) = rest.strip_prefix('{').and_then(|rest| rest.split_once('}')) {
            rest = behind.trim_start();
        }
    }
    if !rest.is_empty() {
        return Err(format!("`{rest}` is not read; give scattering as L <30 40 50 60 70 80>"));
    }
    Ok((absorption.ok_or("no numbers")?, scattering))
}

fn read_odeon(text: &str) -> (Vec<LibraryEntry>, Problems) {
    let (mut entries, mut problems): (Vec<LibraryEntry>, Problems) = Default::default();
    let mut title: Option<(usize, String)> = None;
    for (number, line) in text.lines().enumerate().map(|(at, line)| (at + 1, line)) {
        if line.trim().is_empty() {
            continue;
        }
        let Some((at, begun)) = title.take() else {
            title = Some((number, line.trim().to_owned()));
            continue;
        };
        let values = numbers(line.split_whitespace(), 1.0).and_then(|values| match values.len() {
            8 => Ok(values),
            count => Err(format!("{count} numbers; give 8 octaves, 63 … 8000 Hz")),
        });
        match values.map_err(|message| format!("{message} (α of the material in line {at})")) {
            Ok(values) => entries.extend(odeon_entries(&begun, &values)),
            Err(message) => problems.push(LineProblem::new(number, message)),
        }
    }
    if let Some((at, _)) = title {
        problems.push(LineProblem::new(at, "no line with coefficients follows"));
    }
    (entries, problems)
}

/// A material by its number and by its description.
fn odeon_entries(title: &str, values: &[f64]) -> Vec<LibraryEntry> {
    let (number, text) = title.split_once(char::is_whitespace).unwrap_or((title, title));
    let entry = |name: &str| LibraryEntry {
        name: name.trim().to_owned(),
        group: "ODEON".to_owned(),
        text: text.trim().to_owned(),
        absorption: Some(Octaves { first_hz: 63.0, values: values.to_vec() }),
        scattering: None,
        source: format!("ODEON material {number}"),
    };
    if number.trim() == text.trim() { vec![entry(number)] } else { vec![entry(number), entry(text)] }
}

fn read_pyroomacoustics(text: &str) -> (Vec<LibraryEntry>, Problems) {
    let mut entries = Vec::new();
    let mut problems = Vec::new();
    let document: Value = match serde_json::from_str(text) {
        Ok(document) => document,
        Err(error) => return (entries, vec![LineProblem::new(error.line(), format!("no JSON: {error}"))]),
    };
    let centers = match octave_centers(&document["center_freqs"]) {
        Ok(centers) => centers,
        Err(message) => return (entries, vec![LineProblem::new(0, format!("center_freqs: {message}"))]),
    };
    for what in ["absorption", "scattering"] {
        for (group, name, material) in materials_of(&document[what]) {
            match pyroomacoustics_entry(name, material, &centers) {
                Ok((text, octaves)) => {
                    let [absorption, scattering] =
                        if what == "absorption" { [Some(octaves), None] } else { [None, Some(octaves)] };
                    let source = "pyroomacoustics material file".to_owned();
                    let (name, group) = (name.clone(), group.clone());
                    entries.push(LibraryEntry { name, group, text, absorption, scattering, source });
                }
                Err(message) => {
                    problems.push(LineProblem::new(0, format!("{what}.{group}.{name}: {message}")));
                }
            }
        }
    }
    (entries, problems)
}

/// Group, name and value of every material of a section.
fn materials_of(section: &Value) -> impl Iterator<Item = (&String, &String, &Value)> {
    let groups = section.as_object().into_iter().flat_map(Map::iter);
    groups.flat_map(|(group, rows)| {
        rows.as_object().into_iter().flat_map(Map::iter).map(move |(name, material)| (group, name, material))
    })
}

/// The centres, which must be neighbouring octaves.
fn octave_centers(value: &Value) -> Result<Vec<f64>, String> {
    let items = value.as_array().ok_or("missing; give the octaves, such as [125, 250, 500]")?;
    let centers: Vec<f64> =
        items.iter().filter_map(Value::as_f64).filter(|hz| (10.0..=20e3).contains(hz)).collect();
    let are_neighbours = centers.windows(2).all(|pair| octave(pair[1]) == octave(pair[0]) + 1);
    if centers.is_empty() || centers.len() != items.len() || !are_neighbours {
        return Err("give neighbouring octaves in Hz, upwards".to_owned());
    }
    Ok(centers)
}

fn pyroomacoustics_entry(name: &str, material: &Value, centers: &[f64]) -> Result<(String, Octaves), String> {
    let items = material["coeffs"].as_array().ok_or("coeffs: missing; give a list of numbers")?;
    let values: Vec<f64> = items.iter().filter_map(Value::as_f64).filter(|value| *value >= 0.0).collect();
    if values.len() != items.len() || values.is_empty() || values.len() > centers.len() {
        return Err(format!("coeffs: give 1 to {} numbers of 0 and more", centers.len()));
    }
    let text = material["description"].as_str().unwrap_or(name).to_owned();
    Ok((text, Octaves { first_hz: centers[0], values }))
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "numbers are compared as they were read")]
mod tests {
    use super::*;

    fn catt(text: &str) -> Result<Vec<LibraryEntry>, Vec<String>> {
        read("room.geo", text.as_bytes())
            .map_err(|problems| problems.iter().map(|p| format!("{}: {}", p.line, p.message)).collect())
    }

    #[test]
    fn catt_lines_are_read_in_percent() {
        let text = "GLOBAL h = 9\nABS wood   = <12 10 8 7 5 4>  {213 220 160}\n;ABS old = <1 2 3 4 5 6>\n\
                    ABS audience = <68 75 82 85 86 86 > L <30 40 50 60 70 80> {128 128 0} ; seats\nABS wallabs = wood\n\
                    ABS long = <1 2 3\n 4 5 6> L <25>\nABS eight = <1 2 3 4 5 6 : 7 8> L <9 9 9 9 9 9:9 9>\n";
        let entries = catt(text).unwrap();
        let names: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(names, ["wood", "audience", "wallabs", "long", "eight"]);
        assert_eq!(entries[0].absorption.as_ref().unwrap().at(125.0), (0.12, false));
        assert_eq!(entries[1].scattering.as_ref().unwrap().at(4000.0), (0.8, false));
        assert_eq!(entries[2].absorption, entries[0].absorption);
        assert_eq!(entries[3].scattering.as_ref().unwrap().at(500.0), (0.25, true));
        assert_eq!(entries[4].absorption.as_ref().unwrap().at(8000.0), (0.07, false));
    }

    #[test]
    fn catt_mistakes_have_their_lines() {
        let text = "ABS a = <1 2 3>\nABS b = nothing\nABS c = <1 2 3 4 5 x>\nABS d = <1 2 3 4 5 6> T <1 2 3 4 5 6>\n\
                    ABS e = <1 2 3 4 5 6>\nABS e = <1 2 3 4 5 6>\nABS f = <1 2 3 4 5 6> {1 2 3} L = estimate(0.1)\n";
        let problems = catt(text).unwrap_err();
        assert_eq!(
            problems,
            [
                "1: ABS a: 3 numbers; give 6 to 8 octaves from 125 Hz",
                "2: ABS b: no ABS `nothing` before it",
                "3: ABS c: `x` is not a coefficient; give numbers of 0 and more",
                "4: ABS d: `T <…>` is not read; known is L <scattering>",
                "6: ABS e: defined twice",
                "7: ABS f: `L = estimate(0.1)` is not read; give scattering as L <30 40 50 60 70 80>",
            ]
        );
    }

    #[test]
    fn odeon_materials_are_known_by_number_and_description() {
        let text = "100\tRough concrete\n\t0.02\t0.02\t0.03\t0.03\t0.03\t0.04\t0.07\t0.07\n\n107\tBlock\n\t0.3 0.3\n";
        let problems = read("a.Li8", text.as_bytes()).unwrap_err();
        assert_eq!((problems.len(), problems[0].line), (1, 5));
        let entries = read("a.LI8", text.split("107").next().unwrap().as_bytes()).unwrap();
        assert_eq!(
            entries.iter().map(|entry| entry.name.as_str()).collect::<Vec<_>>(),
            ["100", "Rough concrete"]
        );
        let octaves = entries[1].absorption.as_ref().unwrap();
        assert_eq!((octaves.at(63.0), octaves.at(4000.0)), ((0.02, false), (0.07, false)));
    }

    #[test]
    fn pyroomacoustics_files_have_absorption_and_scattering() {
        let text = r#"{"center_freqs": [125, 250, 500], "absorption": {"Wood": {"door": {"description": "Door", "coeffs": [0.1, 0.2, 0.3]}}},
            "scattering": {"Seats": {"rows": {"description": "Rows", "coeffs": [0.4, 0.5]}}}}"#;
        let entries = read("m.json", text.as_bytes()).unwrap();
        assert_eq!(entries[0].absorption.as_ref().unwrap().values, [0.1, 0.2, 0.3]);
        assert_eq!(entries[1].scattering.as_ref().unwrap().at(500.0), (0.5, true));
        assert_eq!((entries[0].group.as_str(), entries[1].name.as_str()), ("Wood", "rows"));
        for bad in [
            "{",
            "{}",
            r#"{"center_freqs": [125, 500]}"#,
            r#"{"center_freqs": [125], "absorption": {"g": {"m": {}}}}"#,
        ] {
            assert!(!read("m.json", bad.as_bytes()).unwrap_err().is_empty(), "{bad}");
        }
    }
}
