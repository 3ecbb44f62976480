//! Output of `fit` as a table, CSV or JSON.

use std::io::Write;

use serde_json::{Value, json};
use sonel::acoustics::Coefficient;
use sonel::analysis::Parameter;
use sonel::scenes::CompiledScene;
use sonel_console::table::aligned;
use sonel_design::fit::{Fit, Fitted, Identifiability};

use crate::arguments::Format;

/// Prints `fit` of the materials of `scene`.
///
/// # Errors
/// When `out` cannot be written.
pub(super) fn print(
    fit: &Fit,
    scene: &CompiledScene,
    format: Format,
    out: &mut dyn Write,
) -> anyhow::Result<()> {
    match format {
        Format::Table => write!(out, "{}", table(fit, scene))?,
        Format::Csv => csv(fit, scene, out)?,
        Format::Json => writeln!(out, "{:#}", json(fit, scene))?,
    }
    Ok(())
}

/// Runs of coefficients of one material over its bands.
fn rows(fit: &Fit) -> impl Iterator<Item = &[Fitted]> {
    fit.coefficients.chunk_by(|a, b| (a.material, a.coefficient) == (b.material, b.coefficient))
}

fn table(fit: &Fit, scene: &CompiledScene) -> String {
    let centers = scene.bands.nominal();
    let head = ["material", "coefficient", ""].map(str::to_owned);
    let head = head.into_iter().chain(centers.iter().map(|center| format!("{center} Hz")));
    let mut lines = Vec::new();
    for row in rows(fit) {
        let cells = |of: &dyn Fn(&Fitted) -> String| -> Vec<String> {
            let cell = |band: usize| row.iter().find(|one| one.band == band).map_or("–".to_owned(), of);
            (0..centers.len()).map(cell).collect()
        };
        let name = [scene.materials[row[0].material].name.clone(), row[0].coefficient.to_string()];
        let [map, fitted, interval] = ["map", "fitted", "95 %"].map(str::to_owned);
        let blank = || [String::new(), String::new()];
        lines.push([&name[..], &[map], &cells(&|one| format!("{:.3}", one.start))].concat());
        lines.push([&blank()[..], &[fitted], &cells(&|one| format!("{:.3}", one.value))].concat());
        let ends = |one: &Fitted| format!("{:.3}–{:.3}", one.interval[0], one.interval[1]);
        lines.push([&blank()[..], &[interval], &cells(&ends)].concat());
    }
    let sentences: String = sentences(fit, scene).iter().map(|sentence| format!("{sentence}\n")).collect();
    format!("{}\n{}\n{sentences}", aligned(head, lines, 3..), deviations(fit))
}

/// Root mean squares of the deviations by parameter.
fn deviations(fit: &Fit) -> String {
    let rows = Parameter::ALL.into_iter().filter_map(|parameter| {
        let [count, squares @ ..] = mean_squares(fit, parameter)?;
        let roots = squares.map(|square| format!("{:.2}", (square / count).sqrt()));
        Some([&[parameter.heading().0.to_owned(), count.to_string()][..], &roots].concat())
    });
    aligned(["deviation", "values", "map [JND]", "fitted [JND]", "fitted [σ]"], rows, 1..)
}

/// Count and sums of squares of deviations with the map's coefficients and with those fitted [JND], and with those fitted in standard
/// deviations.
fn mean_squares(fit: &Fit, parameter: Parameter) -> Option<[f64; 4]> {
    let mut sums = [0.0; 4];
    for deviation in fit.deviations.iter().filter(|one| one.measurement.parameter == parameter) {
        let (Some(before), Ok(after)) = (deviation.before, &deviation.after) else { continue };
        let measured = deviation.measurement.value;
        let noticeable = parameter.just_noticeable(measured);
        let parts = [
            (before - measured) / noticeable,
            (after - measured) / noticeable,
            (after - measured) / deviation.sigma,
        ];
        sums[0] += 1.0;
        for (sum, part) in sums[1..].iter_mut().zip(parts) {
            *sum += part * part;
        }
    }
    (sums[0] > 0.0).then_some(sums)
}

/// What the measurement does not tell, and what has no computed value.
fn sentences(fit: &Fit, scene: &CompiledScene) -> Vec<String> {
    let name = |material: usize, coefficient: Coefficient| {
        format!("{} of {}", coefficient, scene.materials[material].name)
    };
    let mut sentences = Vec::new();
    for row in rows(fit) {
        let mut kinds: Vec<(&Identifiability, Vec<String>)> = Vec::new();
        for one in row.iter().filter(|one| one.identifiability != Identifiability::Identified) {
            let band = scene.bands.nominal()[one.band].to_string();
            match kinds.iter_mut().find(|(kind, _)| *kind == &one.identifiability) {
                Some((_, bands)) => bands.push(band),
                None => kinds.push((&one.identifiability, vec![band])),
            }
        }
        let own = name(row[0].material, row[0].coefficient);
        for (kind, bands) in kinds {
            let bands = bands.join(", ");
            sentences.push(match kind {
                Identifiability::Confounded(others) if others.is_empty() => format!(
                    "{own} cannot be separated from the other coefficients at {bands} Hz: it stays near the value of the map"
                ),
                Identifiability::Confounded(others) => {
                    let others: Vec<String> =
                        others.iter().map(|(material, coefficient)| name(*material, *coefficient)).collect();
                    format!("{own} cannot be separated from {} at {bands} Hz", others.join(", "))
                }
                _ => format!("{own} hardly changes the measured parameters at {bands} Hz: it stays near the value of the map"),
            });
        }
    }
    sentences.extend(left_out(fit, scene));
    for deviation in &fit.deviations {
        if let Err(reason) = &deviation.after {
            let measurement = &deviation.measurement;
            sentences.push(format!(
                "not used: {} at {} Hz: {reason}",
                measurement.parameter.key(),
                scene.bands.nominal()[measurement.band]
            ));
        }
    }
    sentences
}

/// Coefficients that were asked for and cannot be fitted.
fn left_out(fit: &Fit, scene: &CompiledScene) -> Vec<String> {
    let mut sentences = Vec::new();
    for (index, material) in scene.materials.iter().enumerate() {
        for &coefficient in &fit.asked {
            let is_fitted = |band: usize| {
                let own =
                    |one: &Fitted| (one.material, one.coefficient, one.band) == (index, coefficient, band);
                fit.coefficients.iter().any(own)
            };
            let centers = scene.bands.nominal().iter().enumerate().filter(|(band, _)| !is_fitted(*band));
            let bands: Vec<String> = centers.map(|(_, center)| center.to_string()).collect();
            if !bands.is_empty() {
                let why = match coefficient {
                    Coefficient::Scattering => {
                        "it is 0 or 1, or on no surface: start from a value between them"
                    }
                    _ => "it is 1, or on no surface",
                };
                let bands = bands.join(", ");
                sentences
                    .push(format!("{coefficient} of {} is not fitted at {bands} Hz: {why}", material.name));
            }
        }
    }
    sentences
}

fn csv(fit: &Fit, scene: &CompiledScene, out: &mut dyn Write) -> anyhow::Result<()> {
    let mut writer = ::csv::Writer::from_writer(out);
    writer.write_record([
        "material",
        "coefficient",
        "center_frequency_hz",
        "start",
        "value",
        "ci95_low",
        "ci95_high",
        "identifiability",
    ])?;
    for one in &fit.coefficients {
        let numbers =
            [scene.bands.nominal()[one.band], one.start, one.value, one.interval[0], one.interval[1]];
        let name = sonel::analysis::cell::of_name(&scene.materials[one.material].name);
        let names = [name.into_owned(), one.coefficient.to_string()];
        let fields = names.into_iter().chain(numbers.map(|number| number.to_string()));
        writer.write_record(fields.chain([word(&one.identifiability).to_owned()]))?;
    }
    writer.flush()?;
    Ok(())
}

fn word(knowledge: &Identifiability) -> &'static str {
    match knowledge {
        Identifiability::Identified => "identified",
        Identifiability::Insensitive => "weak",
        Identifiability::Confounded(_) => "confounded",
    }
}

fn json(fit: &Fit, scene: &CompiledScene) -> Value {
    let coefficient = |one: &Fitted| {
        let mut value = json!({
            "material": scene.materials[one.material].name,
            "coefficient": one.coefficient.to_string(),
            "center_frequency_hz": scene.bands.nominal()[one.band],
            "start": one.start,
            "value": one.value,
            "ci95": one.interval,
            "identifiability": word(&one.identifiability),
        });
        if let Identifiability::Confounded(others) = &one.identifiability {
            let other = |(material, coefficient): &(usize, Coefficient)| json!({ "material": scene.materials[*material].name, "coefficient": coefficient.to_string() });
            value["confounded_with"] = others.iter().map(other).collect();
        }
        value
    };
    let deviation = |parameter: Parameter| {
        let [count, before, after, sigmas] = mean_squares(fit, parameter)?;
        let mean = |sum: f64| (sum / count).sqrt();
        Some(
            json!({ "parameter": parameter.key(), "values": count, "rms_map_jnd": mean(before), "rms_fitted_jnd": mean(after), "rms_fitted_sigma": mean(sigmas) }),
        )
    };
    json!({
        "coefficients": fit.coefficients.iter().map(coefficient).collect::<Vec<_>>(),
        "deviations": Parameter::ALL.into_iter().filter_map(deviation).collect::<Vec<_>>(),
        "remarks": sentences(fit, scene),
        "renderings": fit.rounds,
        "settled": fit.is_settled,
    })
}
