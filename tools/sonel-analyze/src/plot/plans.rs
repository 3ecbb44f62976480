//! `plot --what map`: a parameter at every receiver of a response, as a plan.

use std::io::Write;
use std::path::Path;

use anyhow::bail;
use sonel::analysis::receiver::parameters_at;
use sonel::analysis::single::Single;
use sonel::analysis::{Parameter, ParameterValue, ReceiverParameters};
use sonel::drawing::plot::{Axis, Plan, PlanPoint, Plans};
use sonel::scenes::CompiledScene;
use sonel_console::quantity::counted;

use super::Subject;
use crate::arguments::Plot;
use crate::open;
use sonel_console::artifact::check_scene;

/// A plan of every response, with the walls of the map where there is one.
pub(super) fn of(
    subjects: &[Subject],
    map: Option<&Path>,
    arguments: &Plot,
    log: &mut dyn Write,
) -> anyhow::Result<Plans> {
    let map = map.map(open::map).transpose()?;
    let scene = map.as_ref().map(|(map, _)| &map.header().scene);
    if let Some(scene) = scene {
        let named = subjects.iter().map(|subject| (subject.name.as_str(), &subject.response));
        check_scene(named, &[scene], &mut |text| Ok(writeln!(log, "{text}")?))?;
    }
    let each =
        subjects.iter().map(|subject| plan(subject, scene, arguments, log)).collect::<Result<_, _>>()?;
    Ok(Plans { scale: Axis::linear(arguments.parameter.label()), each })
}

fn plan(
    subject: &Subject,
    scene: Option<&CompiledScene>,
    arguments: &Plot,
    log: &mut dyn Write,
) -> anyhow::Result<Plan> {
    let response = &subject.response;
    let receivers = response.receivers();
    let wanted = match arguments.parameter {
        Single::Of(parameter) if Parameter::ALL.contains(&parameter) => vec![parameter],
        _ => Parameter::ALL.to_vec(),
    };
    let pairs: Vec<(usize, usize)> = (0..receivers).map(|r| (subject.source, r)).collect();
    let figures = parameters_at(response, subject.talk.as_ref(), &wanted, &pairs);
    let values: Vec<ParameterValue> =
        figures.iter().map(|receiver| value(subject, receiver, arguments)).collect::<Result<_, _>>()?;
    log_what_is_missing(subject, &values, log)?;
    let factor = arguments.parameter.heading().2;
    let place = |(position, value): (&[f64; 3], &ParameterValue)| PlanPoint {
        position: *position,
        value: value.as_ref().ok().map(|estimate| factor * estimate.value),
    };
    let places: Vec<PlanPoint> = response.receiver_positions.iter().zip(&values).map(place).collect();
    let room = scene.map(|scene| (&scene.mesh, scene.up));
    let plan = Plan::of(title(subject, arguments), &places, response.source_positions[subject.source], room);
    if plan.hidden > 0 {
        writeln!(
            log,
            "note: {}: hidden by another at the same place of the plan: {}; render one height to show all",
            subject.name,
            counted(plan.hidden, "receiver")
        )?;
    }
    Ok(plan)
}

fn title(subject: &Subject, arguments: &Plot) -> String {
    let source = &subject.response.source_names[subject.source];
    let band = match (arguments.parameter, arguments.band) {
        (Single::Of(_), Some(band)) => format!(", {band} Hz"),
        (Single::Of(_), None) => ", single number".to_owned(),
        _ => String::new(),
    };
    format!("{}{band}: \"{source}\", {}", arguments.parameter.heading().0, subject.name)
}

fn value(
    subject: &Subject,
    receiver: &ReceiverParameters,
    arguments: &Plot,
) -> anyhow::Result<ParameterValue> {
    Ok(match (arguments.parameter, arguments.band) {
        (single, None) => single.value(receiver),
        (Single::Of(parameter), Some(band)) => {
            receiver.bands[subject.band(band)?].parameter(parameter).clone()
        }
        (several, Some(_)) => bail!("{} has no bands: omit --band", several.heading().0),
    })
}

/// Notes receivers without a value; an error where no receiver has one.
fn log_what_is_missing(
    subject: &Subject,
    values: &[ParameterValue],
    log: &mut dyn Write,
) -> anyhow::Result<()> {
    let reasons: Vec<String> =
        values.iter().filter_map(|value| value.as_ref().err()).map(ToString::to_string).collect();
    let Some(first) = reasons.first() else { return Ok(()) };
    if reasons.len() == values.len() {
        bail!("{}: no receiver has a value: {first}", subject.path.display());
    }
    let (count, all) = (reasons.len(), values.len());
    Ok(writeln!(log, "note: {}: no value at {count} of {all} receivers (grey): {first}", subject.name)?)
}
