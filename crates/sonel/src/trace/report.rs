//! Report of a run as text and JSON.

use crate::study::effects::{Bound, Decision, Skip};
use serde_json::{Value, json};
use sonel_map::{EffectState, Fate, MapHeader};

use crate::ledger::{balances_json, fates_json, on_in_words};
use crate::plan::extend;
use crate::trace::Traced;

impl Traced {
    /// Settings of the run and fates of the packets, in a few lines.
    #[must_use]
    pub fn summary(&self) -> String {
        let (header, fates) = (self.header(), &self.ledger.fates);
        let counts = Fate::ALL.iter().map(|&fate| (fate.name(), fates.count(fate)));
        let counts: Vec<String> =
            counts.filter(|(_, count)| *count > 0).map(|(name, count)| format!("{count} {name}")).collect();
        format!(
            "{}: {} packets, {} sonels stored; packets {}\n\
             energy ledger: largest relative residual {:.1e}\neffects:\n{}\n\
             {:.2} s ({:.2} CPU seconds)",
            header.scene.name,
            self.map.sonels().path_count(),
            self.map.sonels().sonel_count(),
            counts.join(", "),
            self.ledger.worst_residual(),
            effects(header),
            self.seconds.0,
            self.seconds.1,
        )
    }

    /// The report of docs/interface.md. Energies are per source: with S sources every band emits 1 on average over them.
    #[must_use]
    pub fn report(&self) -> Value {
        let scene = &self.header().scene;
        let mut report = json!({
            "emitted": self.map.sonels().path_count(),
            "stored": self.map.sonels().vertex_count(),
            "segments": self.ledger.segments,
            "wall_s": self.seconds.0,
            "cpu_s": self.seconds.1,
            "fates": fates_json(&self.ledger.fates),
            "ledger": balances_json(&self.ledger, scene.bands.nominal(), scene.sources.len()),
            "effects": effects_json(self.header(), &self.decisions),
        });
        extend(&mut report, &self.extra);
        report
    }
}

/// A line for each effect: whether it is on, and why.
fn effects(header: &MapHeader) -> String {
    let line = |effect: &EffectState| {
        format!("  {:12} {}: {}", effect.effect.name(), on_in_words(&effect.on), effect.reason)
    };
    header.effects.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Decisions on effects with their reasons, in lines.
pub(super) fn effects_in_words(header: &MapHeader, decisions: &[Decision]) -> String {
    if decisions.is_empty() {
        return effects(header);
    }
    weighed(header, decisions, &crate::study::effects::skips(&header.scene, header.settings.spectral))
}

/// A line for each effect with what leaving it out would change, band by band where it differs, and what it costs; then a line for
/// each thing that the scene lets the stages skip.
fn weighed(header: &MapHeader, decisions: &[Decision], skips: &[Skip]) -> String {
    let nominal = header.scene.bands.nominal();
    let of_effects = decisions.iter().map(|decision| {
        let bound = decision.bound.as_ref().map_or(String::new(), in_words);
        let cost =
            if decision.cost.is_empty() { String::new() } else { format!("; costs {}", decision.cost) };
        let name = decision.effect.name();
        format!("  {name:12} {}{bound}: {}{cost}", state(&decision.on, nominal), decision.reason)
    });
    let of_skips = skips.iter().map(|skip| {
        let done = if skip.skipped { "skipped" } else { "done" };
        format!("  {}: {done}, {}", skip.what, skip.reason)
    });
    let lines: Vec<String> = of_effects.chain(["computations:".to_owned()]).chain(of_skips).collect();
    lines.join("\n")
}

/// The most that leaving an effect out changes in any band; nothing of an effect that the scene has not.
fn in_words(bound: &Bound) -> String {
    if bound.level_db.iter().chain(&bound.decay).all(|&largest| largest == 0.0) {
        return String::new();
    }
    let most = |values: &[f64], unit: &str| match values.iter().copied().fold(0.0, f64::max) {
        value if value.is_finite() => format!("at most {value:.2} {unit}"),
        _ => format!("no limit in {unit}"),
    };
    let percent: Vec<f64> = bound.decay.iter().map(|decay| 100.0 * decay).collect();
    format!(" (without it: {}, {})", most(&bound.level_db, "dB"), most(&percent, "% of T"))
}

/// On, off, or where it is off.
fn state(on: &[bool], nominal: &[f64]) -> String {
    let off: Vec<String> =
        on.iter().zip(nominal).filter(|(on, _)| !**on).map(|(_, band)| band.to_string()).collect();
    match off.len() {
        0 => "on".to_owned(),
        all if all == on.len() => "off".to_owned(),
        _ => format!("on, but off at {} Hz", off.join(", ")),
    }
}

/// The effects as JSON, with their bounds where they were decided now.
pub(super) fn effects_json(header: &MapHeader, decisions: &[Decision]) -> Vec<Value> {
    if decisions.is_empty() {
        header.effects.iter().map(effect).collect()
    } else {
        decisions.iter().map(decision).collect()
    }
}

/// An effect with what leaving it out would change.
fn decision(decision: &Decision) -> Value {
    let mut value = effect(&decision.state());
    if let Some(bound) = &decision.bound {
        value["level_bound_db"] = json!(bound.level_db);
        value["decay_bound_percent"] = bound.decay.iter().map(|decay| 100.0 * decay).collect();
    }
    value
}

fn effect(effect: &EffectState) -> Value {
    let uniform = effect.on.windows(2).all(|pair| pair[0] == pair[1]);
    let on = match effect.on.first() {
        Some(&first) if uniform => json!(first),
        _ => json!(effect.on),
    };
    json!({ "name": effect.effect.name(), "on": on, "reason": effect.reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_effect_says_where_it_is_off() {
        let nominal = [125.0, 250.0, 500.0];
        assert_eq!(state(&[true; 3], &nominal), "on");
        assert_eq!(state(&[false; 3], &nominal), "off");
        assert_eq!(state(&[false, true, false], &nominal), "on, but off at 125, 500 Hz");
    }

    #[test]
    fn the_bound_is_that_of_the_worst_band() {
        let bound = Bound { level_db: vec![0.01, 0.3, 0.2], decay: vec![0.02, 0.0, 0.001] };
        assert_eq!(in_words(&bound), " (without it: at most 0.30 dB, at most 2.00 % of T)");
        let bound = Bound { decay: vec![f64::INFINITY], ..bound };
        assert_eq!(in_words(&bound), " (without it: at most 0.30 dB, no limit in % of T)");
    }
}
