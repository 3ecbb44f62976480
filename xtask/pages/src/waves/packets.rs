//! The same rooms by packets, through the programs.

use anyhow::{Context, Result};
use serde_json::Value;
use xtask::workspace::{self, Profile};

use super::Row;
use super::rooms::Room;

/// The quantities compared.
const KEYS: [&str; 3] = ["t30_s", "early_decay_time_s", "strength_g_db"];

/// How a room is traced.
#[derive(Clone, Copy)]
pub(super) struct Variant {
    /// In file names.
    name: &'static str,
    /// In tables.
    pub title: &'static str,
    is_locally_reacting: bool,
}

/// All ways to trace a room.
pub(super) const VARIANTS: [Variant; 2] = [
    Variant { name: "packets", title: "uniform", is_locally_reacting: false },
    Variant { name: "angles", title: "locally reacting", is_locally_reacting: true },
];

/// What packets say, per band of the room.
pub(super) fn rows(room: &Room, variant: Variant) -> Result<Vec<Row>> {
    let scene = room.write(variant.name, variant.is_locally_reacting)?;
    let [map, response] = ["sonelmap", "npz"].map(|ending| scene.replace("toml", ending));
    for leftover in [&map, &response] {
        let _ = std::fs::remove_file(workspace::root().join(leftover));
    }
    let run = |program, words: &[&str]| workspace::program(Profile::Release, program, words);
    run("sonel-trace", &[&scene, "-o", &map, "--packets", room.packets, "--quiet"])?;
    run("sonel-render", &[&map, "-o", &response, "--rays", "4096", "--quiet"])?;
    let figures: Value =
        serde_json::from_str(&run("sonel-analyze", &["parameters", &response, "--format", "json"])?)?;
    let receivers = figures["receivers"].as_array().context("receivers")?;
    let of_band = |&centre: &f64| {
        KEYS.map(|key| {
            let value = |receiver: &Value| {
                let bands = receiver["bands"].as_array()?;
                bands.iter().find(|band| band["center_frequency_hz"] == centre)?[key]["value"].as_f64()
            };
            let values: Vec<f64> = receivers.iter().filter_map(value).collect();
            let mean =
                |of: fn(f64) -> f64| values.iter().map(|&it| of(it)).sum::<f64>() / values.len() as f64;
            // Of levels that of the energy.
            if key.ends_with("_db") {
                10.0 * mean(|level| 10_f64.powf(0.1 * level)).log10()
            } else {
                mean(|it| it)
            }
        })
    };
    Ok(room.bands.iter().map(of_band).collect())
}
