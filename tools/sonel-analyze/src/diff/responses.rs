//! Compares two responses: scene, version, options, then parameters that differ beyond noise.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::hash::Hash;
use std::io::Write;
use std::path::Path;

use anyhow::bail;
use serde_json::{Value, json};
use sonel::analysis::comparison::{Comparison, Difference, Pairing, compare};
use sonel::analysis::{ReceiverParameters, parameters};
use sonel_console::Outcome;

use crate::arguments::Diff;
use crate::open;

/// Digits of a digest.
const DIGEST_DIGITS: usize = 64;
/// Letters of other values that are printed.
const SHOWN: usize = 60;

/// What decided a response, as files call it.
const PROVENANCE: [&str; 9] = [
    "scene_digest",
    "mesh_digest",
    "map_digest",
    "tool_version",
    "seed",
    "emissions",
    "batches",
    "survival",
    "options",
];

/// Compares two responses; [`Outcome::Missed`] where they differ beyond noise.
///
/// # Errors
/// When a file is unusable, the two have no parameter in common that can be tested, or `out` cannot be written.
pub(super) fn run(arguments: &Diff, out: &mut dyn Write) -> anyhow::Result<Outcome> {
    let (a, b) = (open::response(&arguments.a)?, open::response(arguments.other())?);
    let (mut figures_a, mut figures_b) = (parameters(&a), parameters(&b));
    if let [from, to] = arguments.between.as_slice() {
        figures_a = only(figures_a, from, &arguments.a, (from, to))?;
        figures_b = only(figures_b, to, arguments.other(), (from, to))?;
    }
    let pairing = Pairing::of(&a.provenance, &b.provenance);
    let comparison = compare(&figures_a, &figures_b, pairing);
    if comparison.differences.is_empty() {
        bail!(
            "{} and {} have no comparable parameter in common: both need the same names of sources and receivers, a common band, and batches",
            arguments.a.display(),
            arguments.other().display()
        );
    }
    let stated = [&a, &b].map(|response| response.provenance.to_json());
    let provenance = provenance(&stated[0], &stated[1]);
    let text = || to_text(&comparison, &provenance, arguments);
    arguments.printed.print(out, || to_json(&comparison, &provenance), text)?;
    Ok(if comparison.beyond_noise().next().is_some() { Outcome::Missed } else { Outcome::Done })
}

/// The parameters of receiver `name` alone, under the name of the comparison.
fn only(
    parameters: Vec<ReceiverParameters>,
    name: &str,
    file: &Path,
    (from, to): (&str, &str),
) -> anyhow::Result<Vec<ReceiverParameters>> {
    let known: Vec<String> = parameters.iter().map(|parameters| parameters.name.clone()).collect();
    open::place_of(file, "receiver", &known, name)?;
    let chosen = parameters.into_iter().filter(|parameters| parameters.name == name);
    Ok(chosen.map(|chosen| ReceiverParameters { name: format!("{from} → {to}"), ..chosen }).collect())
}

/// Keys of the provenance whose values differ, with both.
fn provenance<'a>(a: &'a Value, b: &'a Value) -> Vec<(&'static str, &'a Value, &'a Value)> {
    PROVENANCE.iter().map(|key| (*key, &a[*key], &b[*key])).filter(|(_, a, b)| a != b).collect()
}

fn to_json(comparison: &Comparison, provenance: &[(&str, &Value, &Value)]) -> Value {
    json!({
        "same": comparison.beyond_noise().next().is_none(),
        "level_per_parameter": comparison.level,
        "not_tested": comparison.not_tested,
        "provenance": provenance.iter().map(|(key, a, b)| json!({ "key": key, "a": a, "b": b })).collect::<Vec<_>>(),
        "differences": comparison.differences.iter().map(entry).collect::<Vec<_>>(),
    })
}

fn entry(difference: &Difference) -> Value {
    json!({
        "source": difference.source,
        "receiver": difference.receiver,
        "center_frequency_hz": difference.center_frequency_hz,
        "parameter": difference.estimate,
        "difference": { "value": difference.value, "ci95": difference.interval },
        "just_noticeable_differences": difference.just_noticeable,
        "differs": difference.differs,
    })
}

fn to_text(comparison: &Comparison, provenance: &[(&str, &Value, &Value)], arguments: &Diff) -> String {
    let all = &comparison.differences;
    let mut text = format!("A: {}\nB: {}\n", arguments.a.display(), arguments.other().display());
    // Writing to a String cannot fail.
    let same: Vec<&str> =
        PROVENANCE.into_iter().filter(|key| provenance.iter().all(|(other, ..)| other != key)).collect();
    if !same.is_empty() {
        let _ = writeln!(text, "same: {}", same.join(", "));
    }
    for (key, a, b) in provenance {
        write_difference(&mut text, key, (a, b));
    }
    let _ = writeln!(
        text,
        "pairs of source and receiver: {}, bands: {}, parameters compared: {}, parameters that could not be compared: {}\n",
        distinct(all.iter().map(|difference| (&difference.source, &difference.receiver))),
        distinct(all.iter().filter_map(|difference| difference.center_frequency_hz.map(f64::to_bits))),
        all.len(),
        comparison.not_tested
    );
    text.push_str("                                compared  differ  largest B − A, 95 % interval\n");
    let mut keys: Vec<&str> = Vec::new();
    for difference in all {
        if !keys.contains(&difference.estimate) {
            keys.push(difference.estimate);
        }
    }
    for key in keys {
        let of_key = || all.iter().filter(|difference| difference.estimate == key);
        let size = |of: &Difference| of.just_noticeable.unwrap_or(of.value.abs());
        let Some(largest) = of_key().max_by(|a, b| size(a).total_cmp(&size(b))) else { continue };
        let differ = of_key().filter(|difference| difference.differs).count();
        let _ = writeln!(text, "{key:<31} {:>8} {differ:>7}  {}", of_key().count(), measured(largest));
    }
    let beyond: Vec<&Difference> = comparison.beyond_noise().collect();
    if arguments.list {
        text.push('\n');
        for difference in &beyond {
            let _ = writeln!(text, "{}: {}", difference.estimate, measured(difference));
        }
    }
    let verdict = if beyond.is_empty() { "same within noise" } else { "different" };
    let _ = writeln!(
        text,
        "\n{verdict}: {} of {} parameters differ beyond noise (false alarm in 1 % of comparisons)",
        beyond.len(),
        all.len()
    );
    if !beyond.is_empty() && !arguments.list {
        text.push_str("--list prints every parameter that differs, --json all parameters\n");
    }
    text
}

/// A line for each key in which `a` and `b` differ, also within objects that both have.
fn write_difference(text: &mut String, key: &str, (a, b): (&Value, &Value)) {
    let (Value::Object(in_a), Value::Object(in_b)) = (a, b) else {
        let _ = writeln!(text, "different {key}: {} in A, {} in B", shortened(a), shortened(b));
        return;
    };
    for name in in_a.keys().chain(in_b.keys().filter(|name| !in_a.contains_key(*name))) {
        let (a, b) = (&a[name], &b[name]);
        if a != b {
            write_difference(text, &format!("{key}.{name}"), (a, b));
        }
    }
}

/// How many of `values` are different.
fn distinct<T: Eq + Hash>(values: impl Iterator<Item = T>) -> usize {
    values.collect::<HashSet<T>>().len()
}

/// A digest by its first digits, other long values by their beginning.
fn shortened(value: &Value) -> String {
    match value.as_str() {
        Some(text) if text.len() == DIGEST_DIGITS => format!("{}…", &text[..8]),
        Some(text) => text.to_owned(),
        None if value.is_null() => "nothing".to_owned(),
        None => {
            let whole = value.to_string();
            let begin: String = whole.chars().take(SHOWN).collect();
            if begin.len() < whole.len() { format!("{begin}… (--json prints all)") } else { whole }
        }
    }
}

fn measured(difference: &Difference) -> String {
    let band = difference.center_frequency_hz.map(|center| format!("{center} Hz, ")).unwrap_or_default();
    let noticed = difference.just_noticeable.map(|size| format!(" ({size:.2} JND)")).unwrap_or_default();
    format!(
        "{:+.4} ± {:.4}{noticed}, {band}\"{}\" to \"{}\"",
        difference.value,
        0.5 * (difference.interval[1] - difference.interval[0]),
        difference.source,
        difference.receiver
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_options_that_differ_are_printed_and_long_ones_are_cut() {
        let long = vec![0.25; 40];
        let (a, b) =
            (json!({ "bin_s": 0.001, "rays": 10, "changed": long }), json!({ "bin_s": 0.001, "rays": 20 }));
        let mut text = String::new();
        write_difference(&mut text, "options", (&a, &b));
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "different options.rays: 10 in A, 20 in B");
        assert!(lines[1].ends_with("… (--json prints all) in A, nothing in B") && lines[1].len() < 140);
        assert_eq!(lines.len(), 2, "{text}");
    }
}
