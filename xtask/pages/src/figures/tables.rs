//! What the figures show, as tables: read from the JSON of a sweep, written as CSV and Markdown.

use std::fmt::Write;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use super::{Condition, MODES};

/// A level of one band with one number of sonels.
pub(super) struct Level {
    /// Sonels emitted in the band.
    pub sonels: f64,
    /// Nominal centre [Hz].
    pub center_frequency_hz: f64,
    /// Over repeats [dB].
    pub mean: f64,
    /// Of the 95 % interval that one run states [dB].
    pub half_width: f64,
    /// Over repeats [dB].
    pub deviation: f64,
}

/// Levels of `mode` in the order of the sweep.
pub(super) fn levels(json: &Value, mode: &str) -> Result<Vec<Level>> {
    let figures = json["parameters"].as_array().context("the sweep has no figures")?;
    let wanted = figures.iter().filter(|f| f["setting"] == mode && f["parameter"] == "level_db");
    wanted
        .map(|figure| {
            let number = |value: &Value| value.as_f64().context("a level was refused");
            Ok(Level {
                sonels: number(&figure["packets"])?,
                center_frequency_hz: number(&figure["center_frequency_hz"])?,
                mean: number(&figure["mean"]["value"])?,
                half_width: number(&figure["stated_half_width"])?,
                deviation: number(&figure["standard_deviation"])?,
            })
        })
        .collect()
}

/// CPU seconds with one number of sonels.
pub(super) struct Time {
    /// As they were asked for.
    pub sonels: f64,
    /// Mean over repeats [s].
    pub mean: f64,
    /// Half of the range over repeats [s].
    pub half_width: f64,
    /// Of it, tracing alone [s].
    pub trace: f64,
}

/// CPU seconds of a mode.
pub(super) struct Times {
    /// By number of sonels.
    pub points: Vec<Time>,
    /// At no sonels [s].
    pub overhead: f64,
    /// Value and half-width of the 95 % interval [s].
    pub per_sonel: [f64; 2],
}

/// CPU seconds of `mode`, which emits `packets` for each sonel, for each of them.
pub(super) fn times(json: &Value, mode: &str, packets: f64) -> Result<Times> {
    let number = |value: &Value| value.as_f64().map(|value| value / packets).context("a time is missing");
    let of_mode = |list: &str, key: &str| -> Result<Vec<Value>> {
        let rows = json[list].as_array().with_context(|| format!("the sweep has no {list}"))?;
        Ok(rows.iter().filter(|row| row[key] == mode).cloned().collect())
    };
    let point = |row: &Value| -> Result<Time> {
        let seconds: Vec<f64> =
            row["cpu_s"].as_array().context("no runs")?.iter().map(number).collect::<Result<_>>()?;
        let most = seconds.iter().copied().fold(f64::MIN, f64::max);
        let least = seconds.iter().copied().fold(f64::MAX, f64::min);
        Ok(Time {
            sonels: row["packets"].as_f64().context("no count")?,
            mean: seconds.iter().sum::<f64>() / seconds.len() as f64,
            half_width: 0.5 * (most - least),
            trace: number(&row["phases"]["trace_s"])?,
        })
    };
    let setting = of_mode("settings", "name")?;
    let setting = setting.first().with_context(|| format!("the sweep has no setting {mode}"))?;
    let slope = &setting["seconds_per_packet"];
    let (low, high) = (number(&slope["ci95"][0])?, number(&slope["ci95"][1])?);
    Ok(Times {
        points: of_mode("seconds", "setting")?.iter().map(point).collect::<Result<_>>()?,
        overhead: number(&setting["overhead_s"]["value"])?,
        per_sonel: [number(&slope["value"])?, 0.5 * (high - low)],
    })
}

/// Figure 3 as CSV.
pub(super) fn levels_csv(conditions: &[Condition]) -> Result<String> {
    let mut text =
        "condition,mode,sonels,center_frequency_hz,level_db,half_width_db,standard_deviation_db\n".to_owned();
    for condition in conditions {
        for (mode, _) in MODES {
            for level in levels(&condition.json, mode)? {
                let Level { sonels, center_frequency_hz, mean, half_width, deviation } = level;
                writeln!(
                    text,
                    "{},{mode},{sonels},{center_frequency_hz},{mean:.4},{half_width:.4},{deviation:.4}",
                    condition.name
                )?;
            }
        }
    }
    Ok(text)
}

/// Figure 4 as CSV.
pub(super) fn times_csv(conditions: &[Condition]) -> Result<String> {
    let mut text = "condition,mode,sonels,cpu_s,half_range_s,trace_cpu_s\n".to_owned();
    for condition in conditions {
        for (mode, packets) in MODES {
            for time in times(&condition.json, mode, packets)?.points {
                let Time { sonels, mean, half_width, trace } = time;
                writeln!(text, "{},{mode},{sonels},{mean:.4},{half_width:.4},{trace:.4}", condition.name)?;
            }
        }
    }
    Ok(text)
}

/// Both as a table for the page, a line per condition and mode.
pub(super) fn markdown(conditions: &[Condition]) -> Result<String> {
    let mut text = String::from(
        "| condition | mode | level, mean over bands [dB] | half-width, fewest and most sonels [dB] | \
         tracing and rendering [µs per sonel] | tracing alone [µs per sonel] | without a sonel [s] |\n|---|---|---|---|---|---|---|\n",
    );
    for condition in conditions {
        for (mode, packets) in MODES {
            let levels = levels(&condition.json, mode)?;
            let over_bands = |value: fn(&Level) -> f64| -> Vec<f64> {
                let counts = levels.chunk_by(|a, b| a.sonels.total_cmp(&b.sonels).is_eq());
                counts
                    .map(|of_count| of_count.iter().map(value).sum::<f64>() / of_count.len() as f64)
                    .collect()
            };
            let (means, stated) = (over_bands(|level| level.mean), over_bands(|level| level.half_width));
            let least = means.iter().copied().fold(f64::MAX, f64::min);
            let most = means.iter().copied().fold(f64::MIN, f64::max);
            let [fewest, .., best] = stated[..] else { bail!("{mode} needs two numbers of sonels") };
            let times = times(&condition.json, mode, packets)?;
            let last = times.points.last().context("no times")?;
            writeln!(
                text,
                "| {} | {mode} | {least:.2} … {most:.2} | {fewest:.2}, {best:.2} | {:.2} ± {:.2} | {:.2} | {:.2} |",
                condition.name,
                1e6 * times.per_sonel[0],
                1e6 * times.per_sonel[1],
                1e6 * last.trace / last.sonels,
                times.overhead
            )?;
        }
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// A sweep of one mode and one band: 2 and 4 s for 1000 and 2000 sonels in six bands.
    fn sweep(level: Value) -> Value {
        let figure = |parameter: &str, value: &Value| {
            json!({
                "setting": "paper", "packets": 1000, "center_frequency_hz": 125.0, "parameter": parameter,
                "mean": { "value": value }, "standard_deviation": 0.1, "stated_half_width": 0.2,
            })
        };
        let seconds = |sonels: u64, runs: [f64; 2]| json!({ "setting": "paper", "packets": sonels, "cpu_s": runs, "phases": { "trace_s": 0.6 } });
        json!({
            "parameters": [figure("t30_s", &json!(7.7)), figure("level_db", &level)],
            "seconds": [seconds(1000, [1.8, 2.2]), seconds(2000, [4.0, 4.0])],
            "settings": [{
                "name": "paper",
                "seconds_per_packet": { "value": 0.002, "ci95": [0.0018, 0.0022] },
                "overhead_s": { "value": 0.0 },
            }],
        })
    }

    #[test]
    fn levels_and_times_are_those_of_the_sweep_times_for_each_band() {
        let json = sweep(json!(58.5));
        let found = levels(&json, "paper").unwrap();
        assert!(
            found.len() == 1
                && (found[0].mean - 58.5).abs() < 1e-12
                && (found[0].half_width - 0.2).abs() < 1e-12
        );
        let times = times(&json, "paper", 2.0).unwrap();
        assert!(
            (times.points[0].mean - 1.0).abs() < 1e-12 && (times.points[0].half_width - 0.1).abs() < 1e-12
        );
        assert!((times.per_sonel[0] - 1e-3).abs() < 1e-12 && (times.per_sonel[1] - 1e-4).abs() < 1e-12);
    }

    #[test]
    fn a_refused_level_and_a_missing_mode_are_errors() {
        assert!(levels(&sweep(Value::Null), "paper").is_err());
        assert!(times(&sweep(json!(58.5)), "accurate", 1.0).is_err());
    }
}
