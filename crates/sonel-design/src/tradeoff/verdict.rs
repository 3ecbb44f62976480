//! Recommendation of a sweep: CPU time of each setting to a stated accuracy.
//!
//! The accuracy is a twentieth of a just-noticeable difference in every parameter: 0.05 dB of level and clarity, 0.25 % of
//! the times, as standard deviations. Noise falls as 1/√N, so N and seconds follow from the run with the most packets. Bias
//! does not fall: a setting whose bias is significantly larger never reaches the accuracy.

use super::errors::{self, Curve};
use super::fit::{self, Measured};
use super::runs::Tradeoff;
use super::sweep::JUDGED;

/// Cost and errors of a setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Index of the setting.
    pub setting: usize,
    /// CPU seconds to the accuracy [s]; none where parameters are missing. Zero where nothing scatters.
    pub seconds: Option<Measured>,
    /// The same in parts of what the best setting takes; none where that is nothing.
    pub times_best: Option<Measured>,
    /// Emissions per source to the accuracy.
    pub packets: f64,
    /// Figures whose bias exceeds the accuracy beyond doubt, in words.
    pub biases: Vec<String>,
}

impl Verdict {
    /// Whether the setting reaches the accuracy.
    #[must_use]
    pub fn arrives(&self) -> bool {
        self.biases.is_empty() && self.seconds.is_some()
    }
}

/// Every setting of `tradeoff`, whose `curves` are those of [`errors::curves`].
#[must_use]
pub fn verdicts(tradeoff: &Tradeoff, curves: &[Curve]) -> Vec<Verdict> {
    let repeats = tradeoff.sweep.repeats as usize;
    let most = tradeoff.sweep.packets.last().map_or(0.0, |&most| most as f64);
    let settings = 0..tradeoff.sweep.settings.len();
    let own = |setting: usize| -> Vec<&Curve> { curves.iter().filter(|c| c.setting == setting).collect() };
    let mut verdicts: Vec<Verdict> = settings
        .map(|setting| {
            let own = own(setting);
            let needed = |left_out| seconds_needed(&own, left_out);
            let nothing = needed(None).filter(|seconds| *seconds <= 0.0).map(|_| Measured::within(0.0, None));
            Verdict {
                setting,
                seconds: fit::ratio_over_repeats(repeats, needed).or(nothing),
                times_best: None,
                packets: most * times_more(&own, None).unwrap_or(f64::NAN),
                biases: own.iter().filter_map(|curve| biased(curve)).collect(),
            }
        })
        .collect();
    if let Some(best) = best(&verdicts).map(|best| own(best.setting)) {
        for verdict in &mut verdicts {
            let own = own(verdict.setting);
            // Settings share their seeds, so that much of the noise is in both.
            verdict.times_best = fit::ratio_over_repeats(repeats, |left_out| {
                Some(seconds_needed(&own, left_out)? / seconds_needed(&best, left_out)?)
            });
        }
    }
    verdicts
}

/// The setting that arrives first.
fn best(verdicts: &[Verdict]) -> Option<&Verdict> {
    let seconds = |verdict: &Verdict| verdict.seconds.map_or(f64::INFINITY, |seconds| seconds.value);
    verdicts.iter().filter(|verdict| verdict.arrives()).min_by(|a, b| seconds(a).total_cmp(&seconds(b)))
}

/// How many times the most packets tried are needed: the worst of the parameters decides. None where a parameter has no parameter.
fn times_more(curves: &[&Curve], left_out: Option<usize>) -> Option<f64> {
    let most = curves.iter().flat_map(|curve| curve.points.last()).map(|point| point.packets).max()?;
    let needed = |curve: &&Curve| {
        let point = curve.points.last().filter(|point| point.packets == most)?;
        let deviation = point.deviation(left_out);
        let part =
            if deviation > errors::NOTHING { deviation / errors::target(curve.parameter) } else { 0.0 };
        Some(part * part)
    };
    let needed: Option<Vec<f64>> = curves.iter().map(needed).collect();
    needed.map(|needed| needed.into_iter().fold(0.0, f64::max))
}

fn seconds_needed(curves: &[&Curve], left_out: Option<usize>) -> Option<f64> {
    Some(times_more(curves, left_out)? * curves.first()?.points.last()?.mean_seconds(left_out))
}

fn biased(curve: &Curve) -> Option<String> {
    let bias = curve.points.last()?.bias()?;
    let doubt = bias.half_width().unwrap_or(f64::INFINITY);
    let (name, unit) = (curve.parameter.heading().0, errors::unit(curve.parameter));
    (bias.value.abs() - doubt > errors::target(curve.parameter))
        .then(|| format!("{name} by {:+.2} ± {doubt:.2} {unit}", bias.value).replace('-', "−"))
}

/// Choice of a setting with its reason, in a few sentences.
#[must_use]
pub fn recommendation(tradeoff: &Tradeoff, verdicts: &[Verdict]) -> String {
    let name = |verdict: &Verdict| tradeoff.sweep.settings[verdict.setting].name.as_str();
    let symbols: Vec<&str> = JUDGED.map(|parameter| parameter.heading().0).into();
    let aim = format!(
        "The aim is a twentieth of a just-noticeable difference in {}: a standard deviation of 0.05 dB, or 0.25 % of a time.",
        symbols.join(", ")
    );
    let Some((best, seconds)) = best(verdicts).and_then(|best| Some((best, best.seconds?))) else {
        return format!("{aim} No setting reaches it; the table of settings says why.");
    };
    if seconds.value <= 0.0 {
        return format!("{aim} {} samples nothing: any number of packets reaches it.", name(best));
    }
    let mut text = format!(
        "{aim} Take {} with about {} packets: {}.",
        name(best),
        rounded(best.packets),
        in_seconds(seconds)
    );
    for other in verdicts.iter().filter(|other| other.setting != best.setting) {
        text.push(' ');
        text.push_str(&against(other, name(other)));
    }
    text
}

fn against(other: &Verdict, name: &str) -> String {
    if !other.biases.is_empty() {
        return format!("{name} is biased: {}.", other.biases.join(", "));
    }
    match other.times_best {
        None => format!("{name}: some parameter is refused in one of its runs."),
        Some(times) if times.allows(1.0) => {
            format!("{name} takes {:.1} times as long (difference within noise).", times.value)
        }
        Some(times) => format!("{name} takes {:.1} times as long.", times.value),
    }
}

fn in_seconds(Measured { value, interval }: Measured) -> String {
    match interval {
        Some([low, high]) => format!("{value:.2} CPU-s ({low:.2} to {high:.2})"),
        None => format!("{value:.2} CPU-s"),
    }
}

/// A count to two places.
#[must_use]
pub fn rounded(count: f64) -> String {
    let unit = libm::exp10(libm::log10(count.max(1.0)).floor() - 1.0).max(1.0);
    format!("{}", (count / unit).ceil() * unit)
}
