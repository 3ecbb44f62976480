//! Derivatives of parameters by the coefficients of materials: intervals, ranking and output.

use std::io::Write;

use serde_json::{Value, json};
use sonel_acoustics::Coefficient;

use crate::cell;
use crate::estimate::ParameterValue;
use crate::jackknife;
use crate::parameter::Parameter;
use crate::receiver::ReceiverParameters;
use crate::report::aligned;

/// Increase of a coefficient whose effect tables show [1].
const CHANGE: f64 = 0.1;

/// The derivatives of a parameter by one coefficient of one material.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// The source.
    pub source: String,
    /// The receiver.
    pub receiver: String,
    /// The material.
    pub material: String,
    /// Coefficient of the material.
    pub coefficient: Coefficient,
    /// The parameter.
    pub parameter: Parameter,
    /// By band.
    pub slopes: Vec<Option<Slope>>,
}

/// A derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// The parameter itself, in its unit.
    pub value: f64,
    /// Change of the parameter per unit of the coefficient.
    pub slope: f64,
    /// Half of its 95 % interval.
    pub half_width: f64,
}

/// The derivatives of a parameter by the coefficients that the bands from number `first` on differ in by `steps`.
#[must_use]
pub fn slopes(
    parameters: &ReceiverParameters,
    first: usize,
    steps: &[f64],
    parameter: Parameter,
) -> Vec<Option<Slope>> {
    let estimate = |band: usize| parameters.bands[band].parameter(parameter);
    steps
        .iter()
        .enumerate()
        .map(|(band, &step)| slope(estimate(band), estimate(first + band), step))
        .collect()
}

fn slope(before: &ParameterValue, after: &ParameterValue, step: f64) -> Option<Slope> {
    let (Ok(before), Ok(after)) = (before, after) else { return None };
    if step.abs() <= 0.0 || before.without.len() < 2 || before.without.len() != after.without.len() {
        return None;
    }
    let by_step = |(before, after): (&f64, &f64)| (after - before) / step;
    let slope = by_step((&before.value, &after.value));
    let without: Vec<f64> = before.without.iter().zip(&after.without).map(by_step).collect();
    let half_width = jackknife::spread(slope, &without, &before.weight).half_width;
    Some(Slope { value: before.value, slope, half_width })
}

/// Materials' coefficients from the one that changes the parameter most to the one that changes it least, each with the mean over bands
/// and receivers of what 0.1 more of the coefficient does, in just-noticeable differences.
#[must_use]
pub fn ranking(found: &[Sensitivity], parameter: Parameter) -> Vec<(String, Coefficient, f64)> {
    let mut ranked: Vec<(String, Coefficient, Vec<f64>)> = Vec::new();
    for Sensitivity { material, coefficient, slopes, .. } in
        found.iter().filter(|one| one.parameter == parameter)
    {
        let noticed = slopes
            .iter()
            .flatten()
            .map(|slope| (slope.slope * CHANGE).abs() / parameter.just_noticeable(slope.value));
        match ranked.iter_mut().find(|(name, kind, _)| name == material && kind == coefficient) {
            Some((_, _, all)) => all.extend(noticed),
            None => ranked.push((material.clone(), *coefficient, noticed.collect())),
        }
    }
    let mean = |all: &[f64]| all.iter().fold(0.0, |sum, one| sum + one) / all.len().max(1) as f64;
    let mut ranked: Vec<(String, Coefficient, f64)> =
        ranked.into_iter().map(|(name, kind, all)| (name, kind, mean(&all))).collect();
    ranked.sort_by(|a, b| b.2.total_cmp(&a.2));
    ranked
}

/// A table per parameter: what 0.1 more of every coefficient does, averaged over receivers, the most important first.
#[must_use]
pub fn tables(found: &[Sensitivity], wanted: &[Parameter], centers: &[f64]) -> String {
    let mut text = String::new();
    for &parameter in wanted {
        let (symbol, unit, factor) = parameter.heading();
        let frequencies = centers.iter().map(|center| format!("{center} Hz"));
        let head =
            ["material", "coefficient", "mean [JND]"].map(str::to_owned).into_iter().chain(frequencies);
        let row = |(material, coefficient, noticed): (String, Coefficient, f64)| {
            let own = |one: &&Sensitivity| {
                one.parameter == parameter && one.material == material && one.coefficient == coefficient
            };
            let own: Vec<&Sensitivity> = found.iter().filter(own).collect();
            let cells = (0..centers.len())
                .map(|band| cell(own.iter().filter_map(|one| one.slopes[band]), CHANGE * factor));
            let first = [material.clone(), coefficient.to_string(), format!("{noticed:.2}")];
            first.into_iter().chain(cells).collect::<Vec<_>>()
        };
        let table = aligned(head, ranking(found, parameter).into_iter().map(row), 2..);
        text += &format!("change of {symbol} [{unit}] for {CHANGE} more\n{table}\n");
    }
    text + "means over the receivers; ±: half-width of the 95 % interval; JND: just-noticeable difference; –: no derivative (no packet depends on the coefficient)\n"
}

/// Mean over receivers. They share sonels, so their intervals are not independent: the mean of the half-widths is kept.
fn cell(slopes: impl Iterator<Item = Slope>, factor: f64) -> String {
    let slopes: Vec<Slope> = slopes.collect();
    if slopes.is_empty() {
        return "–".to_owned();
    }
    let mean = |of: &dyn Fn(&Slope) -> f64| factor * slopes.iter().map(of).sum::<f64>() / slopes.len() as f64;
    format!("{:+.3} ±{:.3}", mean(&|slope| slope.slope), mean(&|slope| slope.half_width))
}

/// Columns of [`csv`].
const HEADER: &str =
    "source,receiver,material,coefficient,parameter,center_frequency_hz,value,slope,ci95_half_width";

/// Writes a row for every derivative, without numbers where packets cannot tell.
///
/// # Errors
/// When `out` cannot be written.
pub fn csv(found: &[Sensitivity], centers: &[f64], out: impl Write) -> std::io::Result<()> {
    let mut writer = ::csv::Writer::from_writer(out);
    writer.write_record(HEADER.split(','))?;
    for one in found {
        for (center, slope) in centers.iter().zip(&one.slopes) {
            let numbers = slope.map_or([const { String::new() }; 3], |slope| {
                [slope.value, slope.slope, slope.half_width].map(|number| number.to_string())
            });
            let [source, receiver, material] =
                [&one.source, &one.receiver, &one.material].map(|name| cell::of_name(name));
            let names = [
                &*source,
                &receiver,
                &material,
                &one.coefficient.to_string(),
                one.parameter.key(),
                &center.to_string(),
            ];
            writer.write_record(names.into_iter().chain(numbers.iter().map(String::as_str)))?;
        }
    }
    writer.flush()
}

/// All derivatives and the order of each parameter.
#[must_use]
pub fn json(found: &[Sensitivity], wanted: &[Parameter], centers: &[f64]) -> Value {
    let of = |one: &Sensitivity| {
        let bands: Vec<Value> = centers
            .iter()
            .zip(&one.slopes)
            .map(|(center, slope)| match slope {
                Some(Slope { value, slope, half_width }) => json!({
                    "center_frequency_hz": center,
                    "value": value,
                    "slope": slope,
                    "ci95": [slope - half_width, slope + half_width],
                }),
                None => json!({ "center_frequency_hz": center, "slope": null }),
            })
            .collect();
        json!({
            "source": one.source,
            "receiver": one.receiver,
            "material": one.material,
            "coefficient": one.coefficient.to_string(),
            "parameter": one.parameter.key(),
            "bands": bands,
        })
    };
    let ranked = |parameter: Parameter| -> Value {
        let rows = ranking(found, parameter);
        let row = |(material, coefficient, noticed): (String, Coefficient, f64)| json!({ "material": material, "coefficient": coefficient.to_string(), "mean_jnd_per_0.1": noticed });
        rows.into_iter().map(row).collect()
    };
    let ranking: serde_json::Map<String, Value> =
        wanted.iter().map(|&parameter| (parameter.key().to_owned(), ranked(parameter))).collect();
    json!({ "sensitivities": found.iter().map(of).collect::<Vec<_>>(), "ranking": ranking })
}
