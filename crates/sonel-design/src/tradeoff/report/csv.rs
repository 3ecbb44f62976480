//! Tables for programs.

use std::io::Write;

use super::Findings;
use crate::tradeoff::errors;
use crate::tradeoff::fit::Measured;

/// Columns of [`curves_csv`].
const CURVES: &str = "setting,parameter,unit,packets,cpu_s,standard_deviation,standard_deviation_low,\
    standard_deviation_high,bias,bias_half_width,efficiency,parameters,figures_refused";

/// Errors over all parameters of a parameter: a row for each setting, parameter and number of packets.
///
/// # Errors
/// When `out` cannot be written.
pub fn curves_csv(findings: &Findings<'_>, out: &mut dyn Write) -> std::io::Result<()> {
    let mut table = csv::Writer::from_writer(out);
    table.write_record(CURVES.split(','))?;
    for curve in &findings.curves {
        for point in &curve.points {
            let (deviation, bias) = (point.measured_deviation(), point.bias());
            table.write_record([
                findings.name(curve.setting).to_owned(),
                curve.parameter.key().to_owned(),
                errors::unit(curve.parameter).to_owned(),
                point.packets.to_string(),
                number(Some(point.mean_seconds(None))),
                number(deviation.map(|deviation| deviation.value)),
                number(deviation.and_then(|deviation| Some(deviation.interval?[0]))),
                number(deviation.and_then(|deviation| Some(deviation.interval?[1]))),
                number(bias.map(|bias| bias.value)),
                number(bias.and_then(|bias| bias.half_width())),
                number(point.efficiency().map(|efficiency| efficiency.value)),
                point.errors[0].len().to_string(),
                point.refused.to_string(),
            ])?;
        }
    }
    table.flush()
}

/// Columns of [`parameters_csv`].
const PARAMETERS: &str = "setting,packets,source,receiver,center_frequency_hz,parameter,reference,mean,mean_half_width,\
    standard_deviation,stated_half_width,reason";

/// Every parameter for itself: a row for each setting, number of packets, source, receiver, band and parameter.
///
/// # Errors
/// When `out` cannot be written.
pub fn parameters_csv(findings: &Findings<'_>, out: &mut dyn Write) -> std::io::Result<()> {
    let tradeoff = findings.tradeoff;
    let mut table = csv::Writer::from_writer(out);
    table.write_record(PARAMETERS.split(','))?;
    for (setting, packets) in pairs(findings) {
        let runs = tradeoff.runs_of(setting, packets);
        for (index, cell) in tradeoff.cells.iter().enumerate() {
            let found = errors::estimate(&runs, index);
            let mean: Option<Measured> = found.as_ref().map(|estimate| estimate.mean);
            let missing = errors::missing(found.as_ref(), tradeoff.reference.values[index]);
            table.write_record([
                findings.name(setting).to_owned(),
                packets.to_string(),
                cell.source.clone(),
                cell.receiver.clone(),
                cell.center_frequency_hz.to_string(),
                cell.parameter.key().to_owned(),
                number(tradeoff.reference.values[index].map(|(value, _)| value)),
                number(mean.map(|mean| mean.value)),
                number(mean.and_then(|mean| mean.half_width())),
                number(found.as_ref().map(|estimate| estimate.deviation)),
                number(found.as_ref().and_then(|estimate| estimate.stated_half_width)),
                missing.unwrap_or_default().to_owned(),
            ])?;
        }
    }
    table.flush()
}

/// Settings and numbers of packets in order.
pub(super) fn pairs<'a>(findings: &'a Findings<'_>) -> impl Iterator<Item = (usize, u64)> + 'a {
    let sweep = &findings.tradeoff.sweep;
    (0..sweep.settings.len())
        .flat_map(move |setting| sweep.packets.iter().map(move |&packets| (setting, packets)))
}

/// Empty where there is no number.
fn number(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map(|value| format!("{value:.6}")).unwrap_or_default()
}
