//! The Python reader of maps, written from docs/formats/sonelmap.md, against `sonel-render`: same map, same connections; and
//! against `sonel-analyze export`: same map, same sonels. OpenEXR reads what `sonel-analyze image` writes: same sonels, same picture.
//!
//! What it needs is installed into target/python, so that neither Python nor numpy can be missing without a failure.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use crate::python::{self, printed};
use xtask::workspace::{self, Profile};

const SCENE: &str = "python/reader/box.toml";
/// A room with a partition and two airs.
const SCREENED: &str = "python/reader/screened.toml";
/// The box with variants of its materials.
const VARIANTS: &str = "python/reader/variants.toml";
/// The box with a speed of sound that rises with height.
const GRADIENT: &str = "python/reader/gradient.toml";
const READER: &str = "python/reader/read_sonelmap.py";
const REQUIREMENTS: &str = "python/requirements.txt";
const ENVIRONMENT: &str = "target/python";
const MAP: &str = "target/python/box.sonelmap";
const RESPONSE: &str = "target/python/box.npz";
/// Compares an export with the map.
const SONELS: &str = "python/reader/check_sonels.py";
const ARCHIVE: &str = "target/python/sonels.npz";
const ROWS: &str = "target/python/sonels.csv";
/// Compares a picture of [`SCENE`], a box of these extents, with an export.
const PICTURES: &str = "python/reader/check_image.py";
const ENERGY: &str = "target/python/energy.exr";
const EXTENTS: &str = "6,4.5,3";
/// The seat of the scene, and a place a centimetre away.
const SEAT: &str = "3.0,3.6,1.1";
const BESIDE: &str = "3.01,3.6,1.1";
/// Largest relative difference: both know positions in f32 only and sum in another order.
const TOLERANCE: f64 = 1e-6;
/// The class that the reader recomputes, as `sonel-render` calls it.
const CLASS: &str = "... D R";

/// Installs what the reader needs; the folder of its programs.
pub(crate) fn environment() -> Result<PathBuf> {
    python::environment(ENVIRONMENT, REQUIREMENTS)
}

/// Traces and renders a box with shared and with separate bands, reads both maps, compares.
pub(crate) fn check() -> Result<()> {
    let python = environment()?.join("python");
    let programs = workspace::programs(Profile::Dev)?;
    let program = |name: &str, arguments: &[&str]| printed(Command::new(programs.join(name)).args(arguments));
    for spectral in ["shared", "per-band"] {
        let traced = ["--packets", "250", "--spectral", spectral, "--quiet"];
        program("sonel-trace", &[&[SCENE, "-o", MAP], &traced[..]].concat())?;
        let by_connection = ["--estimator", "connection", "--effects", "-boundary", "--json", "--quiet"];
        let rendered = program("sonel-render", &[&[MAP, "-o", RESPONSE], &by_connection[..]].concat())?;
        let read = |receiver| printed(Command::new(&python).args([READER, MAP, "--receiver", receiver]));
        let difference = largest_difference(&rendered, &read(SEAT)?)?;
        println!("bands {spectral}: largest relative difference {difference:.1e}");
        ensure!(difference <= TOLERANCE, "the Python reader disagrees with sonel-render, bands {spectral}");
        let beside = largest_difference(&rendered, &read(BESIDE)?)?;
        ensure!(beside > TOLERANCE, "a receiver a centimetre away goes unnoticed: the comparison is blind");
        check_export(&python, &program, [spectral, SCENE, "auto"])?;
        check_export(&python, &program, [spectral, GRADIENT, "auto"])?;
        check_export(&python, &program, [spectral, VARIANTS, "auto"])?;
        check_export(&python, &program, [spectral, SCREENED, "auto"])?;
    }
    check_image(&python, &program)
}

/// Takes pictures of a small map and lets the reader compare them with its sonels; a picture of another map must not pass.
fn check_image(python: &Path, program: &impl Fn(&str, &[&str]) -> Result<String>) -> Result<()> {
    let options =
        ["--eye", "1,1,1", "--look", "5,3.5,1.5", "--fov", "80", "--size", "64x48", "--radius", "0.3"];
    let windows = ["--windows", "0-20ms,20-50ms,50-400ms", "--source", "right", "--quiet"];
    let trace = |seed| {
        program("sonel-trace", &[SCENE, "-o", MAP, "--packets", "1000", "--seed", seed, "--quiet"])?;
        program("sonel-analyze", &["export", MAP, "-o", ARCHIVE, "--quiet"])
    };
    let compare = || printed(Command::new(python).args([PICTURES, MAP, ARCHIVE, ENERGY, EXTENTS]));
    trace("1")?;
    program("sonel-analyze", &[&["image", MAP, "-o", ENERGY], &options[..], &windows[..]].concat())?;
    print!("picture of {SCENE}: {}", compare()?);
    trace("2")?;
    ensure!(compare().is_err(), "a picture of another map goes unnoticed: the comparison is blind");
    Ok(())
}

/// Exports a small map and lets the reader compare; an export of another map must not pass.
fn check_export(
    python: &Path,
    program: &impl Fn(&str, &[&str]) -> Result<String>,
    [spectral, scene, effects]: [&str; 3],
) -> Result<()> {
    let trace = |seed| {
        let options =
            ["--packets", "40", "--spectral", spectral, "--effects", effects, "--seed", seed, "--quiet"];
        program("sonel-trace", &[&[scene, "-o", MAP], &options[..]].concat())
    };
    let compare = || printed(Command::new(python).args([SONELS, MAP, ARCHIVE, ROWS]));
    trace("1")?;
    for output in [ARCHIVE, ROWS] {
        program("sonel-analyze", &["export", MAP, "-o", output, "--quiet"])?;
    }
    print!("export of {scene}, bands {spectral}: {}", compare()?);
    trace("2")?;
    ensure!(compare().is_err(), "sonels of another map go unnoticed: the comparison is blind");
    Ok(())
}

/// Largest |reader / renderer − 1| over sources and bands.
fn largest_difference(rendered: &str, read: &str) -> Result<f64> {
    let rendered: Value = serde_json::from_str(rendered).context("sonel-render printed no JSON")?;
    let read: Value = serde_json::from_str(read).context("the reader printed no JSON")?;
    let (sources, others) = (list(&rendered["sources"])?, list(&read["sources"])?);
    ensure!(!sources.is_empty() && sources.len() == others.len(), "not as many sources as the reader found");
    let mut largest = 0.0_f64;
    for (source, other) in sources.iter().zip(others) {
        let classes = list(&source["classes"])?;
        let Some(class) = classes.iter().find(|class| class["class"] == CLASS) else {
            bail!("sonel-render reports no class {CLASS}");
        };
        ensure!(class["estimator"] == "connection", "{CLASS} is not estimated by connections");
        let (ours, theirs) = (list(&class["energy"][0])?, list(&other["connection"])?);
        ensure!(!ours.is_empty() && ours.len() == theirs.len(), "not as many bands as the reader found");
        for (ours, theirs) in ours.iter().zip(theirs) {
            let difference = (number(theirs)? / number(ours)? - 1.0).abs();
            largest = if difference.is_nan() { f64::INFINITY } else { largest.max(difference) };
        }
    }
    Ok(largest)
}

fn list(value: &Value) -> Result<&Vec<Value>> {
    value.as_array().with_context(|| format!("{value} is no list"))
}

fn number(value: &Value) -> Result<f64> {
    value.as_f64().with_context(|| format!("{value} is not a number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rendered(energy: &str) -> String {
        format!(
            r#"{{"sources":[{{"classes":[{{"class":"... D R","estimator":"connection","energy":[{energy}]}}]}}]}}"#
        )
    }

    fn read(energy: &str) -> String {
        format!(r#"{{"sources":[{{"connection":{energy}}}]}}"#)
    }

    #[test]
    fn the_largest_difference_is_found_in_any_band() {
        let difference = largest_difference(&rendered("[1.0, 2.0]"), &read("[1.0, 2.5]")).unwrap();
        assert!((difference - 0.25).abs() < 1e-12);
        assert!(largest_difference(&rendered("[0.0, 2.0]"), &read("[0.0, 2.0]")).unwrap().is_infinite());
    }

    #[test]
    fn nothing_to_compare_is_no_agreement() {
        assert!(largest_difference(&rendered("[]"), &read("[]")).is_err());
        assert!(largest_difference(&rendered("[1.0]"), &read("[1.0, 2.0]")).is_err());
        assert!(largest_difference(r#"{"sources":[]}"#, r#"{"sources":[]}"#).is_err());
        assert!(largest_difference(r#"{"sources":[{"classes":[]}]}"#, &read("[1.0]")).is_err());
    }
}
