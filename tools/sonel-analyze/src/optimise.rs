//! `sonel-analyze optimise`: the cheapest change of materials that fulfils goals.

use std::io::Write;

use anyhow::{Context, bail};
use sonel::TemporaryMaps;
use sonel::analysis::ParameterValue;
use sonel::names::{band, place};
use sonel::rendering::RenderSettings;
use sonel::scenes::{CompiledScene, load_materials};
use sonel::study::response::receivers_of;
use sonel_console::follower::Follower;
use sonel_console::output::{Kind, Output, folder_of};
use sonel_console::table::aligned;
use sonel_console::{Log, Outcome};
use sonel_design::goal::Goal;
use sonel_design::optimise::{Candidate, Choice, OptimiseError, Proposal};
use sonel_design::sensitivity::VariedMap;

use crate::arguments::{Change, OptimiseArguments, To};
use crate::fit::{refuse_angular, tell, write_materials};
use crate::open;

/// Prints what is proposed and writes the materials.
///
/// # Errors
/// When the map is unusable, a goal or change does not fit it, or the output cannot be written.
pub(crate) fn run(
    arguments: &OptimiseArguments,
    quiet: bool,
    out: &mut dyn Write,
    log: &mut Log<'_>,
) -> anyhow::Result<Outcome> {
    let (mut map, geometry) = open::changeable_map(&arguments.map)?;
    let label = arguments.map.display().to_string();
    let scene = map.header().scene.clone();
    refuse_angular(&scene.materials)?;
    for wanted in arguments.goals.iter().flat_map(|goal| &goal.centers_hz) {
        band(scene.bands.nominal(), *wanted, "the map has no band").map_err(anyhow::Error::msg)?;
    }
    let candidates = candidates(arguments, &scene)?;
    let receivers =
        if arguments.receivers.is_empty() { receivers_of(&scene) } else { arguments.receivers.clone() };
    if receivers.is_empty() {
        bail!("{label}: the scene has no receivers: give --receiver NAME=x,y,z");
    }
    let output = Output::create(&arguments.output, Kind::MATERIALS, &[])?;
    let follower = Follower::new(quiet, log);
    let (map, render) = (&mut map, RenderSettings::default());
    let found = sonel_design::optimise::optimise(
        VariedMap { map, geometry: &geometry, receivers: &receivers, render },
        &arguments.goals,
        &candidates,
        &mut TemporaryMaps::new(folder_of(&arguments.output).to_owned()),
        &mut |stage| tell(stage, &follower),
    );
    drop(follower);
    if let Err(error @ OptimiseError::OutOfReach(_)) = found {
        writeln!(out, "{error}; no file is written")?;
        return Ok(Outcome::Missed);
    }
    let found = found.with_context(|| label.clone())?;
    print(&found, arguments, &candidates, &scene, out)?;
    let head = format!(
        "sonel-analyze optimise {label}\nuse it with sonel-render --materials, or copy the tables to the scene file"
    );
    write_materials(output, &found.materials, &scene.materials, (&head, "chosen by sonel-analyze optimise"))?;
    writeln!(log, "written to {}", arguments.output.display())?;
    Ok(if found.is_fulfilled { Outcome::Done } else { Outcome::Missed })
}

/// The changes in terms of the scene; every problem is said at once.
fn candidates(arguments: &OptimiseArguments, scene: &CompiledScene) -> anyhow::Result<Vec<Candidate>> {
    let mut problems = Vec::new();
    let mut found: Vec<Candidate> = Vec::new();
    let number = |name: &str| {
        place(scene.materials.iter().map(|material| material.name.as_str()), name, "the map has no material")
    };
    for Change { name, to } in &arguments.changes {
        let candidate = number(name).and_then(|material| {
            if found.iter().any(|one| one.material == material) {
                return Err(format!("\"{name}\" is given to --change twice: keep one"));
            }
            if let To::Absorption([low, _]) = to
                && scene.materials[material].transmission.iter().any(|transmission| transmission > low)
            {
                return Err(format!("\"{name}\" transmits more than {low}: raise the lower bound"));
            }
            Ok(Candidate { material, choices: choices(to, scene)?, price: 1.0 })
        });
        candidate.map_or_else(|problem| problems.push(problem), |candidate| found.push(candidate));
    }
    for (name, price) in &arguments.prices {
        match number(name).map(|material| found.iter_mut().find(|one| one.material == material)) {
            Ok(Some(candidate)) => candidate.price = *price,
            Ok(None) => problems.push(format!("--price names \"{name}\", which no --change names")),
            Err(problem) => problems.push(problem),
        }
    }
    if problems.is_empty() { Ok(found) } else { bail!("{}", problems.join("\nerror: ")) }
}

fn choices(to: &To, scene: &CompiledScene) -> Result<Vec<Choice>, String> {
    match to {
        To::Absorption(bounds) => Ok(vec![Choice::Absorption(*bounds)]),
        To::Entries(entries) => entries
            .iter()
            .map(|entry| {
                let text = format!("[materials.entry]\nlibrary = {entry:?}\n");
                let read =
                    load_materials(&text, "--change", &scene.bands).map_err(|error| error.to_string())?;
                let material = read.into_iter().next().ok_or("a table of one material")?;
                Ok(Choice::Other(entry.clone(), material))
            })
            .collect(),
    }
}

fn print(
    found: &Proposal,
    arguments: &OptimiseArguments,
    candidates: &[Candidate],
    scene: &CompiledScene,
    out: &mut dyn Write,
) -> anyhow::Result<()> {
    if found.changes.is_empty() {
        writeln!(out, "nothing needs to change")?;
    }
    for &(candidate, choice) in &found.changes {
        let Candidate { material, choices, .. } = &candidates[candidate];
        let what = match &choices[choice] {
            Choice::Other(entry, _) => format!("becomes {entry}"),
            Choice::Absorption(_) => {
                let values = found.materials[*material].absorption.iter();
                let changed = values.zip(&scene.materials[*material].absorption).zip(scene.bands.nominal());
                let changed = changed.filter(|((new, old), _)| (*new - *old).abs() > 0.0);
                let words: Vec<String> = changed
                    .map(|((new, old), center)| format!("{old:.3} → {new:.3} at {center} Hz"))
                    .collect();
                format!("absorption {}", words.join(", "))
            }
        };
        writeln!(out, "{}: {what}", scene.materials[*material].name)?;
    }
    let (combinations, rendered) = found.tried;
    writeln!(
        out,
        "{:.1} m² change, cost {:.1}; {combinations} combinations, {rendered} rendered\n",
        found.area, found.cost
    )?;
    writeln!(
        out,
        "{}\nmeans over sources and receivers; predicted: from the map; fresh trace: of the changed scene with another seed; ±: half-width of the 95 % interval",
        outcomes(found, &arguments.goals, scene)
    )?;
    Ok(())
}

/// A row for each goal and band.
fn outcomes(found: &Proposal, goals: &[Goal], scene: &CompiledScene) -> String {
    let rows = found.outcomes.iter().map(|outcome| {
        let goal = &goals[outcome.goal];
        let (symbol, unit, factor) = goal.parameter.heading();
        let is_met = |estimate: &ParameterValue| {
            estimate.as_ref().is_ok_and(|estimate| (estimate.value - goal.value).abs() <= goal.tolerance)
        };
        let met = is_met(&outcome.predicted) && is_met(&outcome.verified);
        [
            format!("{symbol} [{unit}]"),
            format!("{} Hz", scene.bands.nominal()[outcome.band]),
            format!("{:.3} ±{:.3}", factor * goal.value, factor * goal.tolerance),
            format!("{:.3}", factor * outcome.before),
            cell(&outcome.predicted, factor),
            cell(&outcome.verified, factor),
            if met { "met" } else { "missed" }.to_owned(),
        ]
    });
    let head = ["parameter", "band", "wanted", "map as it is", "predicted", "fresh trace", ""];
    aligned(head, rows, 1..)
}

fn cell(estimate: &ParameterValue, factor: f64) -> String {
    match estimate {
        Err(reason) => reason.to_string(),
        Ok(estimate) => match &estimate.interval {
            Ok([low, high]) => format!("{:.3} ±{:.3}", factor * estimate.value, 0.5 * factor * (high - low)),
            Err(reason) => format!("{:.3}, {reason}", factor * estimate.value),
        },
    }
}

#[cfg(test)]
mod tests {
    use sonel::analysis::{Estimate, NoInterval};

    use super::*;

    #[test]
    fn what_has_no_interval_says_why() {
        let shown = |interval| cell(&Ok(Estimate::bare(0.5, interval)), 100.0);
        assert_eq!(shown(Ok([0.45, 0.55])), "50.000 ±5.000");
        assert!(shown(Err(NoInterval::OneBatch)).starts_with("50.000, the response holds one batch"));
    }
}
