//! Matches a measured table with the sources, receivers and bands of a map.

use std::io::Write;

use anyhow::{Context, bail};
use glam::DVec3;
use sonel::analysis::Parameter;
use sonel::analysis::measured::{MeasuredRow, read as read_rows};
use sonel::names::{band, place};
use sonel::rendering::ReceiverPoint;
use sonel::scenes::CompiledScene;
use sonel::study::response::receivers_of;
use sonel_console::input;
use sonel_console::quantity::counted;
use sonel_design::fit::Measurement;

use crate::arguments::FitArguments;

/// A receiver of the table is that of the scene of the same name when it is no farther from it than this [m].
const SAME_PLACE: f64 = 0.01;

/// What was measured, and where.
pub(super) struct Measured {
    /// Receivers of the scene, then others of the table.
    pub receivers: Vec<ReceiverPoint>,
    /// Values to fit to.
    pub measurements: Vec<Measurement>,
}

/// Reads the table; what is left out is counted in the log.
///
/// # Errors
/// With every row that does not fit the map.
pub(super) fn read(
    arguments: &FitArguments,
    scene: &CompiledScene,
    log: &mut dyn Write,
) -> anyhow::Result<Measured> {
    let label = arguments.measured.display().to_string();
    let file = input::open(&arguments.measured).with_context(|| format!("cannot read {label}"))?;
    let fail = |problems: Vec<String>| {
        let lines: Vec<String> = problems.iter().map(|problem| format!("{label}: {problem}")).collect();
        anyhow::anyhow!("{}", lines.join("\nerror: "))
    };
    let rows = read_rows(file).map_err(fail)?;
    let mut measured = Measured { receivers: receivers_of(scene), measurements: Vec::new() };
    let (mut problems, mut unused, mut empty) = (Vec::new(), Vec::new(), 0_usize);
    for row in &rows {
        if !arguments.parameters.contains(&row.parameter) {
            if !unused.contains(&row.parameter) {
                unused.push(row.parameter);
            }
            continue;
        }
        let Some(value) = row.value else {
            empty += 1;
            continue;
        };
        match measured.place(row, scene) {
            Ok((source, receiver, band)) => {
                let noticeable = row.parameter.just_noticeable(value);
                let sigma = row.sigma.filter(|sigma| *sigma > 0.0).unwrap_or(arguments.error * noticeable);
                measured
                    .add(Measurement { source, receiver, band, parameter: row.parameter, value, sigma }, row)
            }
            Err(problem) => Err(problem),
        }
        .unwrap_or_else(|problem| problems.push(format!("line {}: {problem}", row.line)));
    }
    if !problems.is_empty() {
        return Err(fail(problems));
    }
    if measured.measurements.is_empty() {
        bail!("{label}: no row has a value of {}", names(&arguments.parameters));
    }
    if !unused.is_empty() {
        writeln!(log, "{label}: parameters not used: {}; choose them with --use", names(&unused))?;
    }
    if empty > 0 {
        writeln!(log, "{label}: {} without a value", counted(empty, "row"))?;
    }
    Ok(measured)
}

fn names(parameters: &[Parameter]) -> String {
    parameters.iter().map(|parameter| parameter.key()).collect::<Vec<_>>().join(", ")
}

impl Measured {
    fn add(&mut self, new: Measurement, row: &MeasuredRow) -> Result<(), String> {
        let is_same = |old: &Measurement| {
            (old.source, old.receiver, old.band, old.parameter)
                == (new.source, new.receiver, new.band, new.parameter)
        };
        if self.measurements.iter().any(is_same) {
            let (key, receiver) = (row.parameter.key(), &row.receiver);
            return Err(format!(
                "{key} at \"{receiver}\" and {} Hz occurs twice: keep one row",
                row.center_frequency_hz
            ));
        }
        self.measurements.push(new);
        Ok(())
    }

    /// Numbers of source, receiver and band of a row.
    fn place(&mut self, row: &MeasuredRow, scene: &CompiledScene) -> Result<(usize, usize, usize), String> {
        let sources: Vec<&str> = scene.sources.iter().map(|source| source.name.as_str()).collect();
        let source = match &row.source {
            None if sources.len() == 1 => 0,
            None => {
                return Err(format!(
                    "the map has several sources: add a column source ({})",
                    sources.join(", ")
                ));
            }
            Some(name) => place(sources, name, "the map has no source")?,
        };
        let band = band(scene.bands.nominal(), row.center_frequency_hz, "the map has no band")?;
        Ok((source, self.receiver(row)?, band))
    }

    fn receiver(&mut self, row: &MeasuredRow) -> Result<usize, String> {
        let name = &row.receiver;
        let position = row.position.map(DVec3::from_array);
        if let Some(index) = self.receivers.iter().position(|receiver| receiver.name == *name) {
            let at = self.receivers[index].position;
            return match position {
                Some(there) if there.distance(at) > SAME_PLACE => Err(format!(
                    "receiver \"{name}\" is at {at} m in the map and at {there} m in the table: rename it"
                )),
                _ => Ok(index),
            };
        }
        let position = position.ok_or_else(|| {
            let known: Vec<&str> = self.receivers.iter().map(|receiver| receiver.name.as_str()).collect();
            format!(
                "the map has no receiver \"{name}\" (it has {}), and the table has no receiver_x_m, receiver_y_m, receiver_z_m for it",
                known.join(", ")
            )
        })?;
        self.receivers.push(ReceiverPoint::omni(name, position));
        Ok(self.receivers.len() - 1)
    }
}
