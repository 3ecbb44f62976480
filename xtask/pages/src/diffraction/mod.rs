//! The plots and tables in docs/diffraction: insertion loss of a screen by every law.

mod laws;

use std::fmt::Write;

use anyhow::{Context, Result};
use glam::DVec2;
use sonel_drawing::plot::{self, Axis, Mark, Panel, Point, Series, Sheet};

use laws::{Arrangement, LAWS, Losses};
use xtask::workspace;

const FOLDER: &str = "docs/diffraction";

/// Bands of the second plot [Hz].
const OCTAVES: [f64; 6] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0];
/// Source and receiver this far from the screen [m].
const AWAY: f64 = 10.0;
/// The band in which the Fresnel number is swept [Hz].
const SWEPT: f64 = 4000.0;

/// Computes the laws and rewrites plots and tables.
pub(crate) fn run() -> Result<()> {
    for (file, sheet) in [("fresnel.svg", fresnel_sheet()), ("bands.svg", bands_sheet())] {
        let mut svg = Vec::new();
        plot::svg(&sheet, &mut svg).with_context(|| format!("cannot draw {file}"))?;
        workspace::write(&format!("{FOLDER}/{file}"), svg)?;
    }
    workspace::write(&format!("{FOLDER}/fresnel.csv"), fresnel_csv()?)?;
    workspace::write(&format!("{FOLDER}/bands.csv"), bands_csv()?)
}

/// Source and receiver as far below the edge as each other.
fn below(depth: f64) -> Arrangement {
    Arrangement { source: DVec2::new(-AWAY, -depth), receiver: DVec2::new(AWAY, -depth) }
}

/// A source level with the edge, and a receiver where the Fresnel number in the swept band is `number`.
fn at_fresnel_number(number: f64) -> Losses {
    let at = |height: f64| Arrangement {
        source: DVec2::new(-AWAY, 0.0),
        receiver: DVec2::new(AWAY, height.copysign(-number)),
    };
    let wanted = 0.5 * number.abs() * laws::SPEED / SWEPT;
    let (mut low, mut high) = (0.0, 1e3);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if at(middle).detour() < wanted { low = middle } else { high = middle }
    }
    at(0.5 * (low + high)).losses(SWEPT)
}

/// Fresnel numbers about the boundary, and into the shadow.
fn numbers() -> [Vec<f64>; 2] {
    let about = (-30..=30).map(|step| 0.1 * f64::from(step) + 1e-3).collect();
    let deep = (0..=40).map(|step| 0.01 * 10_f64.powf(0.1 * f64::from(step))).collect();
    [about, deep]
}

/// A series a law.
fn by_law(losses: &[(f64, Losses)]) -> Vec<Series> {
    let series = |(law, name): (usize, &&str)| {
        let point = |(x, of): &(f64, Losses)| Some(Point::new(*x, of.by_law[law]?));
        let mark = if law < 1 { Mark::Line } else { Mark::Dashed };
        Series::new(*name, mark, losses.iter().filter_map(point).collect())
    };
    LAWS.iter().enumerate().map(series).collect()
}

fn fresnel_sheet() -> Sheet {
    let swept = |numbers: &[f64]| -> Vec<(f64, Losses)> {
        numbers.iter().map(|&number| (number, at_fresnel_number(number))).collect()
    };
    let [about, deep] = numbers();
    let y = || Axis::linear("insertion loss [dB]");
    let about = Panel {
        title: "About the boundary".to_owned(),
        x: Axis::linear("Fresnel number N"),
        y: y().from_to(-5.0, 25.0),
        series: by_law(&swept(&about)),
    };
    let deep = Panel {
        title: "Into the shadow".to_owned(),
        x: Axis::logarithmic("Fresnel number N"),
        y: y().from_to(0.0, 40.0),
        series: by_law(&swept(&deep)),
    };
    Sheet::new(
        "A rigid screen, octave of 4 kHz, 10 m + 10 m, the source level with the edge",
        vec![vec![about, deep]],
    )
}

fn bands_sheet() -> Sheet {
    let panel = |depth: f64| {
        let losses: Vec<(f64, Losses)> = OCTAVES.map(|band| (band, below(depth).losses(band))).into();
        Panel {
            title: format!("{depth} m below the edge"),
            x: Axis::logarithmic("band [Hz]").with_ticks(OCTAVES.into()),
            y: Axis::linear("insertion loss [dB]").from_to(0.0, 35.0),
            series: by_law(&losses),
        }
    };
    Sheet::new("A rigid screen, source and receiver 10 m from it", vec![vec![panel(1.0), panel(3.0)]])
}

fn fresnel_csv() -> Result<String> {
    let mut text = format!("fresnel_number,{}\n", LAWS.join(","));
    for number in numbers().concat() {
        let losses =
            at_fresnel_number(number).by_law.map(|loss| loss.map_or(String::new(), |l| format!("{l:.3}")));
        writeln!(text, "{number:.4},{}", losses.join(","))?;
    }
    Ok(text)
}

fn bands_csv() -> Result<String> {
    let mut text = format!("below_edge_m,band_hz,fresnel_number,{}\n", LAWS.join(","));
    for depth in [1.0, 3.0] {
        for band in OCTAVES {
            let losses = below(depth).losses(band);
            let by_law = losses.by_law.map(|loss| loss.map_or(String::new(), |l| format!("{l:.2}")));
            writeln!(text, "{depth},{band},{:.2},{}", losses.fresnel, by_law.join(","))?;
        }
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_checked_in_is_what_is_computed() {
        for (file, computed) in [("fresnel.csv", fresnel_csv()), ("bands.csv", bands_csv())] {
            let stored = workspace::read(&format!("{FOLDER}/{file}")).unwrap();
            assert_eq!(stored, computed.unwrap(), "run `cargo pages diffraction`");
        }
    }
}
