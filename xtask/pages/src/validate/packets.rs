//! A measured room by packets, through the programs.

use anyhow::{Context, Result};
use serde_json::Value;
use xtask::workspace::{self, Profile};

use super::room::{Pairs, Room, Values, Variant};

const PACKETS: &str = "20k";
const RAYS: &str = "8192";

/// What packets say: a row per pair, sources first, a column per band.
pub(super) fn pairs(room: &Room, variant: &Variant) -> Result<Pairs> {
    let scene = room.write(variant)?;
    let [map, response] = ["sonelmap", "npz"].map(|ending| scene.replace("toml", ending));
    for leftover in [&map, &response] {
        let _ = std::fs::remove_file(workspace::root().join(leftover));
    }
    let run = |program, words: &[&str]| workspace::program(Profile::Release, program, words);
    run("sonel-trace", &[&scene, "-o", &map, "--packets", PACKETS, "--quiet"])?;
    run("sonel-render", &[&map, "-o", &response, "--rays", RAYS, "--effects", variant.effects, "--quiet"])?;
    let parameters = run("sonel-analyze", &["parameters", &response, "--format", "json"])?;
    let parameters: Value = serde_json::from_str(&parameters)?;
    let listed = parameters["receivers"].as_array().context("receivers")?;
    let mut pairs = Vec::new();
    for (source, _) in room.sources {
        for (receiver, _) in room.receivers {
            let is_pair = |row: &&Value| row["source"] == *source && row["name"] == *receiver;
            let row = listed
                .iter()
                .find(is_pair)
                .with_context(|| format!("no parameters of {source} at {receiver}"))?;
            pairs.push(room.bands.iter().map(|&band| values(room, row, band)).collect());
        }
    }
    Ok(pairs)
}

/// The values of a receiver in a band; not a number where the response does not support one.
fn values(room: &Room, receiver: &Value, band: f64) -> Values {
    let bands = receiver["bands"].as_array().map_or(&[][..], Vec::as_slice);
    let found = bands.iter().find(|row| row["center_frequency_hz"] == band);
    [room.reverberation_time.1, "early_decay_time_s", "clarity_c80_db", "definition_d50"]
        .map(|key| found.and_then(|row| row[key]["value"].as_f64()).unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validate::room::tests::cube;

    #[test]
    fn values_are_those_of_the_band_and_missing_ones_are_no_numbers() {
        let row = serde_json::json!({"bands": [
            {"center_frequency_hz": 800.0, "t20_s": {"value": 9.0}},
            {"center_frequency_hz": 1000.0, "t20_s": {"value": 1.5}, "early_decay_time_s": {"value": null},
             "clarity_c80_db": {"value": -2.0}, "definition_d50": {"value": 0.25}},
        ]});
        assert_eq!(format!("{:?}", values(&cube(), &row, 1000.0)), "[1.5, NaN, -2.0, 0.25]");
        assert!(values(&cube(), &row, 125.0)[0].is_nan());
    }
}
