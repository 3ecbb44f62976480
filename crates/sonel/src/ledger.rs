//! The energy ledger of a map, and its effects, as the programs print them.

use serde_json::{Value, json};
use sonel_map::{Fate, Fates, Ledger};

/// Packets by fate.
#[must_use]
pub fn fates_json(fates: &Fates) -> Value {
    Fate::ALL.iter().map(|&fate| (fate.name().to_owned(), json!(fates.count(fate)))).collect()
}

/// The balance of every band: of S `sources` each, so that every band emits 1 on average over them.
#[must_use]
pub fn balances_json(ledger: &Ledger, center_frequencies_hz: &[f64], sources: usize) -> Value {
    let sources = sources as f64;
    let bands = center_frequencies_hz.iter().zip(&ledger.bands);
    bands
        .map(|(frequency, band)| {
            json!({
                "center_frequency_hz": frequency,
                "emitted": band.emitted / sources,
                "absorbed": band.absorbed / sources,
                "transmitted": band.transmitted / sources,
                "escaped": band.escaped / sources,
                "truncated": band.truncated / sources,
                "sampling": band.sampling / sources,
                "sampling_sigma": band.sampling_sigma() / sources,
                "relative_residual": band.relative_residual(),
            })
        })
        .collect()
}

/// In how many bands an effect is `on`.
#[must_use]
pub fn on_in_words(on: &[bool]) -> String {
    match on.iter().filter(|on| **on).count() {
        0 => "off".to_owned(),
        all if all == on.len() => "on".to_owned(),
        some => format!("on in {some} of {} bands", on.len()),
    }
}
