//! Measured parameters from a table: that of [`crate::report::csv()`], or one written by hand with some of its columns.
//!
//! A row is a value of one parameter in one band at one receiver; `receiver`, `center_frequency_hz`, `parameter` and `value` are needed.
//! `ci95_low` and `ci95_high` are the 95 % interval of the measurement. Columns that are not named here are not looked at.

use std::io::Read;

use csv::StringRecord;

use crate::cell;
use crate::parameter::Parameter;
use crate::student::NORMAL_95;

const NEEDED: [&str; 4] = ["receiver", "center_frequency_hz", "parameter", "value"];
/// Parameters over all bands, which are left out.
const WITHOUT_BAND: [&str; 5] = [
    "speech_transmission_index",
    "a_weighted_level_db",
    "speech_level_db",
    "echo_criterion_speech",
    "echo_criterion_music",
];
const PLACE: [&str; 3] = ["receiver_x_m", "receiver_y_m", "receiver_z_m"];

/// A row.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredRow {
    /// Line of the file.
    pub line: u64,
    /// Name of the source, where the table has it.
    pub source: Option<String>,
    /// Name of the receiver.
    pub receiver: String,
    /// Position of the receiver [m], if the table has it.
    pub position: Option<[f64; 3]>,
    /// Nominal centre of the band [Hz].
    pub center_frequency_hz: f64,
    /// The parameter.
    pub parameter: Parameter,
    /// In its unit; none where nothing could be measured.
    pub value: Option<f64>,
    /// Standard deviation, where the table has an interval.
    pub sigma: Option<f64>,
}

/// Rows of parameters per band; those over all bands are left out.
///
/// # Errors
/// Every problem of `table`, a sentence with its line each.
pub fn read(table: impl Read) -> Result<Vec<MeasuredRow>, Vec<String>> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(table);
    let header = reader.headers().map_err(|error| vec![error.to_string()])?.clone();
    let missing: Vec<&str> =
        NEEDED.into_iter().filter(|name| !header.iter().any(|column| column == *name)).collect();
    if !missing.is_empty() {
        return Err(vec![format!(
            "line 1: no column {}; the first line names the columns, with commas between; {} are needed",
            missing.join(", "),
            NEEDED.join(", ")
        )]);
    }
    let (mut rows, mut problems) = (Vec::new(), Vec::new());
    for record in reader.records() {
        match record.map_err(|error| error.to_string()).and_then(|record| row(&header, &record)) {
            Ok(row) => rows.extend(row),
            Err(problem) => problems.push(problem),
        }
    }
    if problems.is_empty() { Ok(rows) } else { Err(problems) }
}

fn row(header: &StringRecord, record: &StringRecord) -> Result<Option<MeasuredRow>, String> {
    let line = record.position().map_or(0, csv::Position::line);
    let text = |name: &str| {
        let column = header.iter().position(|column| column == name)?;
        record.get(column).filter(|field| !field.is_empty())
    };
    let number = |name: &str| -> Result<Option<f64>, String> {
        let Some(field) = text(name) else { return Ok(None) };
        let number = field.parse().ok().filter(|number: &f64| number.is_finite());
        number.map(Some).ok_or_else(|| format!("line {line}: {name} is \"{field}\", no number"))
    };
    let needed = |name: &str| text(name).ok_or_else(|| format!("line {line}: {name} is empty"));
    let key = needed("parameter")?;
    let known = Parameter::EVERY.into_iter().find(|parameter| parameter.key() == key);
    let is_unused = known.is_some_and(|known| !Parameter::ALL.contains(&known));
    if WITHOUT_BAND.contains(&key) || is_unused {
        return Ok(None);
    }
    let parameter = known.ok_or_else(|| {
        let keys = Parameter::ALL.map(Parameter::key).join(", ");
        format!("line {line}: there is no parameter \"{key}\"; there are {keys}")
    })?;
    needed("center_frequency_hz")?;
    let value = number("value")?;
    if value.is_some_and(|value| parameter.is_noticed_relatively() && value <= 0.0) {
        return Err(format!("line {line}: {key} is not above 0"));
    }
    let interval = [number("ci95_low")?, number("ci95_high")?];
    let sigma = match interval {
        [Some(low), Some(high)] if high >= low => Some((high - low) / (2.0 * NORMAL_95)),
        [None, None] => None,
        _ => {
            return Err(format!(
                "line {line}: ci95_low and ci95_high are not an interval: give both, the lower first, or neither"
            ));
        }
    };
    let [x, y, z] = PLACE.map(number);
    let position = match (x?, y?, z?) {
        (Some(x), Some(y), Some(z)) => Some([x, y, z]),
        (None, None, None) => None,
        _ => return Err(format!("line {line}: {} need a number each, or none has one", PLACE.join(", "))),
    };
    Ok(Some(MeasuredRow {
        line,
        source: text("source").map(str::to_owned),
        receiver: cell::name(needed("receiver")?).to_owned(),
        position,
        center_frequency_hz: number("center_frequency_hz")?.unwrap_or_default(),
        parameter,
        value,
        sigma,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_by_hand_is_read() {
        let table = "# hall, empty\nreceiver, center_frequency_hz, parameter, value\nrow 3, 500, t20_s, 1.8\nrow 3,500,clarity_c80_db,\n";
        let rows = read(table.as_bytes()).unwrap();
        assert_eq!((rows.len(), rows[0].value, rows[0].sigma, rows[1].value), (2, Some(1.8), None, None));
        assert_eq!((rows[0].parameter, rows[0].line, rows[0].source.clone()), (Parameter::T20, 3, None));
    }

    #[test]
    fn every_problem_is_said_with_its_line() {
        let table = "receiver,center_frequency_hz,parameter,value,ci95_low,ci95_high,receiver_x_m,receiver_y_m,receiver_z_m\n\
                     a,500,t60_s,1,,,,,\n,500,t20_s,1,,,,,\na,x,t20_s,1,,,,,\na,500,t20_s,-1,,,,,\na,500,t20_s,1,2,1,,,\n\
                     a,500,t20_s,1,,,3,,1\n";
        let problems = read(table.as_bytes()).unwrap_err();
        let lines: Vec<&str> = problems.iter().filter_map(|text| text.split(':').next()).collect();
        assert_eq!(lines, ["line 2", "line 3", "line 4", "line 5", "line 6", "line 7"], "{problems:?}");
        assert!(problems[0].contains("t20_s"));
        let missing = read("receiver,value\n".as_bytes()).unwrap_err();
        assert!(missing[0].contains("no column center_frequency_hz, parameter"), "{missing:?}");
    }
}
