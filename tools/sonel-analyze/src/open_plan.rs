//! `sonel-analyze open-plan`: parameters of ISO 3382-3 along a line of receivers.

use std::io::Write;
use std::path::Path;

use anyhow::bail;
use serde_json::{Value, json};
use sonel::analysis::ParameterValue;
use sonel::analysis::comparison::{Pairing, difference};
use sonel::analysis::modulation::Talk;
use sonel::analysis::open_plan::{Line, SPEECH_POWER_LEVEL_DB, line};
use sonel::analysis::report::{self, Notes, aligned, cell};
use sonel::drawing::plot::{Axis, Mark, Panel, Point, Series, Sheet};
use sonel::echograms::{Echograms, Provenance};
use sonel_console::Outcome;
use sonel_console::artifact::stem;

use crate::arguments::OpenPlan;
use crate::open;
use crate::plot::Target;

/// Values of the informative annex of ISO 3382-3:2012.
const GOOD: &str =
    "good offices by ISO 3382-3 (2012, annex A): D2,S at least 7 dB, Lp,A,S,4m at most 48 dB, rD at most 5 m";
/// Places that the standard asks for.
const WANTED: usize = 4;

/// Reads the parameters of a line of receivers of every response.
///
/// # Errors
/// When a response is unusable or lacks a source or receiver that is named, or an output cannot be written.
pub(crate) fn run(arguments: &OpenPlan, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let target = arguments.output.as_deref().map(Target::create).transpose()?;
    let mut offices: Vec<Office> = Vec::new();
    for path in &arguments.responses {
        let mut office = Office::read(path, arguments, log)?;
        if offices.iter().any(|other| other.name == office.name) {
            office.name = stem(path);
        }
        offices.push(office);
    }
    let losses: Vec<Losses> = offices[1..].iter().map(|office| Losses::of(&offices[0], office)).collect();
    arguments.printed.print(out, || json_of(&offices, &losses), || text_of(&offices, &losses))?;
    if let Some(target) = target {
        target.draw(&Sheet::new("", vec![vec![levels(&offices), indices(&offices)]]))?;
    }
    Ok(Outcome::Done)
}

fn json_of(offices: &[Office], losses: &[Losses]) -> Value {
    match offices {
        [office] => office.object(),
        _ => json!({
            "responses": offices.iter().map(Office::object).collect::<Vec<_>>(),
            "insertion_losses": losses.iter().map(Losses::object).collect::<Vec<_>>(),
        }),
    }
}

fn text_of(offices: &[Office], losses: &[Losses]) -> String {
    let tables = offices.iter().map(|office| {
        let name = if offices.len() > 1 { format!("{}\n", office.name) } else { String::new() };
        format!("{name}{}\n", table(&office.line, &office.source))
    });
    tables.chain(losses.iter().map(|loss| loss.table() + "\n")).collect()
}

/// A response and its line.
struct Office {
    name: String,
    source: String,
    line: Line,
}

impl Office {
    fn read(path: &Path, arguments: &OpenPlan, log: &mut dyn Write) -> anyhow::Result<Self> {
        let response = open::response(path)?;
        let source = match &arguments.source {
            Some(name) => open::place_of(path, "source", &response.source_names, name)?,
            None => 0,
        };
        let find = |name: &String| open::place_of(path, "receiver", &response.receiver_names, name);
        let named = arguments.receivers.iter().map(find).collect::<anyhow::Result<Vec<usize>>>()?;
        let receivers = if named.is_empty() { (0..response.receivers()).collect() } else { named };
        check_twice(&receivers, &response)?;
        let power_level_db = Some(arguments.speech.map_or(SPEECH_POWER_LEVEL_DB, |speech| speech.0));
        let talk = Talk { power_level_db, noise_level_db: arguments.noise.0 };
        let line = line(&response, source, &receivers, &talk);
        if line.places.len() < WANTED {
            writeln!(
                log,
                "warning: {} workstations; ISO 3382-3 requires at least {WANTED}",
                line.places.len()
            )?;
        }
        let Provenance { scene, variant, .. } = &response.provenance;
        Ok(Self {
            name: variant.as_ref().or(scene.as_ref()).cloned().unwrap_or_else(|| stem(path)),
            source: response.source_names[source].clone(),
            line,
        })
    }

    fn object(&self) -> Value {
        let mut object = object(&self.line, &self.source);
        object["name"] = json!(self.name);
        object
    }
}

/// A-weighted insertion losses [dB] of one office re another, at workstations of both.
struct Losses {
    title: String,
    places: Vec<(String, f64, ParameterValue)>,
}

impl Losses {
    fn of(before: &Office, after: &Office) -> Self {
        let places = after.line.places.iter().filter_map(|place| {
            let other = before.line.places.iter().find(|other| other.name == place.name)?;
            let loss = difference(&place.speech_level_db, &other.speech_level_db, Pairing::Independent);
            Some((place.name.clone(), place.distance, loss))
        });
        Self { title: format!("{} re {}", after.name, before.name), places: places.collect() }
    }

    fn object(&self) -> Value {
        let place = |(name, distance, loss): &(String, f64, ParameterValue)| json!({ "receiver": name, "distance_m": distance, "insertion_loss_db": report::estimate(loss) });
        json!({ "name": self.title, "places": self.places.iter().map(place).collect::<Vec<_>>() })
    }

    fn table(&self) -> String {
        if self.places.is_empty() {
            return format!(
                "{}: no insertion loss, as they have no workstation of the same name",
                self.title
            );
        }
        let mut notes = Notes::default();
        let rows = self.places.iter().map(|(name, distance, loss)| {
            [name.clone(), format!("{distance:.2}"), cell(loss, 1.0, &mut notes)]
        });
        let lines = aligned(["receiver", "r [m]", "A-weighted insertion loss [dB]"], rows, 1..);
        format!("{}\n{lines}{}", self.title, notes.text())
    }
}

/// Levels over the logarithm of the distance, each with its regression.
fn levels(offices: &[Office]) -> Panel {
    let mut series = Vec::new();
    for office in offices {
        let places = office.line.places.iter();
        let points = places.map(|place| point(place.distance, &place.speech_level_db)).collect();
        series.push(Series::new(&office.name, Mark::Points, points));
        if let (Ok(rate), Ok(at_4_m)) = (&office.line.decay_rate_db, &office.line.level_at_4_m_db) {
            let of = |r: f64| Point::new(r, at_4_m.value - rate.value * (r / 4.0).log2());
            series.push(Series::new(&office.name, Mark::Line, vec![of(2.0), of(16.0)]));
        }
    }
    let ticks = vec![1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
    Panel {
        title: "A-weighted level of speech".to_owned(),
        x: Axis::logarithmic("distance r [m]").with_ticks(ticks),
        y: Axis::linear("Lp,A,S [dB]"),
        series,
    }
}

/// Speech transmission index over the distance.
fn indices(offices: &[Office]) -> Panel {
    let one = |office: &Office| {
        let places = office.line.places.iter();
        let points = places.map(|place| point(place.distance, &place.speech_transmission_index)).collect();
        Series::new(&office.name, Mark::PointsAndLine, points)
    };
    Panel {
        title: "Speech transmission index with noise".to_owned(),
        x: Axis::linear("distance r [m]"),
        y: Axis::linear("STI").from_to(0.0, 1.0),
        series: offices.iter().map(one).collect(),
    }
}

fn point(x: f64, value: &ParameterValue) -> Point {
    match value {
        Ok(estimate) => Point { x, y: estimate.value, interval: estimate.interval.as_ref().ok().copied() },
        Err(_) => Point::new(x, f64::NAN),
    }
}

fn check_twice(receivers: &[usize], response: &Echograms) -> anyhow::Result<()> {
    let twice = |(at, receiver): (usize, &usize)| receivers[..at].contains(receiver).then_some(*receiver);
    match receivers.iter().enumerate().find_map(twice) {
        Some(receiver) => bail!("receiver \"{}\" is named twice", response.receiver_names[receiver]),
        None => Ok(()),
    }
}

fn object(line: &Line, source: &str) -> Value {
    let places: Vec<Value> = line
        .places
        .iter()
        .map(|place| {
            json!({
                "receiver": place.name,
                "distance_m": place.distance,
                "speech_level_db": report::estimate(&place.speech_level_db),
                "speech_transmission_index": report::estimate(&place.speech_transmission_index),
            })
        })
        .collect();
    let mut object = json!({ "source": source, "places": places });
    for (_, key, estimate) in line.numbers() {
        object[key] = report::estimate(estimate);
    }
    object
}

fn table(line: &Line, source: &str) -> String {
    let mut notes = Notes::default();
    let rows = line.places.iter().map(|place| {
        let [level, index] = [&place.speech_level_db, &place.speech_transmission_index]
            .map(|estimate| cell(estimate, 1.0, &mut notes));
        [place.name.clone(), format!("{:.2}", place.distance), level, index]
    });
    let lines = aligned(["receiver", "r [m]", "Lp,A,S [dB]", "STI"], rows, 1..);
    let singles: String = line
        .numbers()
        .into_iter()
        .map(|(symbol, _, estimate)| format!("{symbol}: {}\n", cell(estimate, 1.0, &mut notes)))
        .collect();
    let level = line.propagation().map_or_else(String::new, |levels| levels + "\n");
    format!(
        "line from source \"{source}\"\n{lines}{singles}{level}±: half-width of the 95 % interval\n{GOOD}\n{}",
        notes.text()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn responses_without_a_common_workstation_say_so() {
        let losses = Losses { title: "screens re open".to_owned(), places: Vec::new() };
        assert!(losses.table().contains("no workstation of the same name"));
    }
}
