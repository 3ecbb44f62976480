//! A sweep as one page of Markdown: recommendation, plots, tables.

use std::fmt::Write;

use super::Findings;
use crate::tradeoff::errors;
use crate::tradeoff::fit::Measured;
use crate::tradeoff::sweep::JUDGED;
use crate::tradeoff::verdict;

/// The page; `command` made it, and the plots lie beside it.
#[must_use]
pub fn markdown(findings: &Findings<'_>, command: &str) -> String {
    let tradeoff = findings.tradeoff;
    let mut page = format!("# {}: what accuracy costs\n\n", tradeoff.scene);
    let recommended = verdict::recommendation(tradeoff, &findings.verdicts);
    let against = match tradeoff.reference.packets {
        Some(packets) => format!("a run of the best method with {packets} packets and another seed"),
        None => "the exact answer (nothing is sampled)".to_owned(),
    };
    let sweep = &tradeoff.sweep;
    // Writing to a string cannot fail.
    let _ = write!(
        page,
        "{recommended}\n\n\
         Made by `{command}`: {} repeats of every setting with seeds from {}, errors against {against}. Deviations are root mean squares over \
         receivers and bands, biases means. CPU seconds are those of tracing and rendering. Intervals hold the true value with 95 %.\n\n\
         ![standard deviation over CPU seconds](deviation.svg)\n\n\
         ![bias over CPU seconds](bias.svg)\n\n\
         ![efficiency over packets](efficiency.svg)\n\n\
         ![CPU seconds over packets](cost.svg)\n\n",
        sweep.repeats, sweep.seed
    );
    page.push_str(&settings(findings));
    page.push_str(&phases(findings));
    page
}

fn settings(findings: &Findings<'_>) -> String {
    let mut table = String::from(
        "## Settings\n\n| setting | CPU-s to a twentieth of a JND | packets | µs per packet | bias |\n|---|---|---|---|---|\n",
    );
    for verdict in &findings.verdicts {
        let per_packet = findings.seconds_per_packet(verdict.setting).map(|line| line.slope.times(1e6));
        let biases =
            if verdict.biases.is_empty() { "none seen".to_owned() } else { verdict.biases.join(", ") };
        let _ = writeln!(
            table,
            "| {} | {} | {} | {} | {biases} |",
            findings.name(verdict.setting),
            cell(verdict.seconds),
            if verdict.packets.is_finite() { verdict::rounded(verdict.packets) } else { "–".to_owned() },
            cell(per_packet),
        );
    }
    table.push_str("\n## Noise over time\n\nSlope of the standard deviation over CPU seconds, log–log (−0.5 where only packets take time), and 1/(variance × CPU-s) with the most packets.\n\n| setting |");
    for parameter in JUDGED {
        let (symbol, unit) = (parameter.heading().0, errors::unit(parameter));
        let _ = write!(table, " {symbol}: slope | efficiency [1/({unit}² s)] |");
    }
    table.push_str("\n|---|");
    table.push_str(&"---|".repeat(2 * JUDGED.len()));
    for setting in 0..findings.tradeoff.sweep.settings.len() {
        let _ = write!(table, "\n| {} |", findings.name(setting));
        for curve in findings.curves.iter().filter(|curve| curve.setting == setting) {
            let _ = write!(table, " {} | {} |", cell(curve.slope()), cell(curve.efficiency()));
        }
    }
    table.push('\n');
    let (points, tried) = (
        findings.curves.iter().map(|curve| curve.points.len()).sum::<usize>(),
        findings.curves.len() * findings.tradeoff.sweep.packets.len(),
    );
    if points < tried {
        let _ = writeln!(
            table,
            "\n{} of {tried} points are missing: more than a tenth of their parameters were refused by some run.",
            tried - points
        );
    }
    table
}

fn phases(findings: &Findings<'_>) -> String {
    let Some(&most) = findings.tradeoff.sweep.packets.last() else { return String::new() };
    let mut table = format!("\n## Where the time goes\n\nCPU seconds with {most} packets.\n\n| setting |");
    let names: Vec<&str> = findings.phases(0, most).iter().map(|(name, _)| *name).collect();
    names.iter().for_each(|name| table.push_str(&format!(" {name} |")));
    table.push_str("\n|---|");
    table.push_str(&"---|".repeat(names.len()));
    for setting in 0..findings.tradeoff.sweep.settings.len() {
        let _ = write!(table, "\n| {} |", findings.name(setting));
        findings.phases(setting, most).iter().for_each(|(_, mean)| table.push_str(&format!(" {mean:.3} |")));
    }
    table.push('\n');
    table
}

/// Three significant places, with the interval where there is one.
fn cell(measured: impl Into<Option<Measured>>) -> String {
    let Some(Measured { value, interval }) = measured.into() else { return "–".to_owned() };
    let places = (2.0 - libm::log10(value.abs().max(1e-9)).floor()).clamp(0.0, 9.0) as usize;
    let ends = interval.map(|[low, high]| format!(" ({low:.places$} … {high:.places$})")).unwrap_or_default();
    format!("{value:.places$}{ends}").replace('-', "−")
}
