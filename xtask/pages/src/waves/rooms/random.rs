//! Sixteen rooms that nobody chose, `random-0` to `random-15`: to judge by.
//!
//! 20 to 2000 m³, half of them with furniture, a third of even absorption. All stand along the grid of the solver: turned by 0.6 rad, the waves of
//! *classroom* have T30 1 % longer and 3, 15 % shorter at 63, 125, 250 Hz, because the steps of its walls scatter.

use anyhow::Result;
use sonel_testkit::uniform::Uniform;

use super::Room;
use super::sizes::{Block, Plan, plan, rows};
use crate::waves::CELL;

pub(super) fn all() -> Result<Vec<Room>> {
    (0..16).map(|number| drawn(number).room()).collect()
}

/// The room of a number.
fn drawn(number: u64) -> Plan {
    let mut draw = Uniform::new(number);
    let volume = logarithmic(&mut draw, 20.0, 2000.0);
    let height = draw.between(2.4, (0.6 * volume.cbrt()).max(2.6));
    let aspect = draw.between(1.0, 2.5);
    let width = (volume / (height * aspect)).sqrt();
    let size = [aspect * width, width, height].map(in_cells);
    let wall = logarithmic(&mut draw, 0.05, 0.15);
    let [floor, ceiling] = if draw.below(3) == 0 {
        [wall; 2]
    } else {
        [logarithmic(&mut draw, 0.05, 0.4), logarithmic(&mut draw, 0.05, 0.8)]
    };
    let furniture = if draw.below(2) == 0 { furniture(&mut draw, size) } else { Vec::new() };
    let absorption = [wall, floor, ceiling].map(|it: f64| (100.0 * it).round() / 100.0);
    let [a, b, c] = size;
    let absorbing = 2.0 * (a + b) * c * wall + a * b * (floor + ceiling);
    // Three of Sabine's times are enough for 60 dB and the filter's end where waves of order zero last.
    let duration = (3.0 * 0.161 * a * b * c / absorbing).max(1.5);
    Plan { furniture, ..plan(&format!("random-{number}"), size, absorption, duration) }
}

/// Equal blocks in rows, below a quarter of the height.
fn furniture(draw: &mut Uniform, [a, b, c]: [f64; 3]) -> Vec<Block> {
    let mut drawn = |low, high| in_cells(draw.between(low, high));
    let block = [drawn(0.5, 2.0), drawn(0.4, 1.0), drawn(0.5, 0.7).min(0.25 * c)];
    let gaps = [drawn(0.5, 1.5), drawn(0.5, 1.5)];
    let pitch = [block[0] + gaps[0], block[1] + gaps[1]];
    let count = [(a - 0.5) / pitch[0], (b - 0.5) / pitch[1]].map(|fit| fit as u32);
    rows([0.5, 0.5, 0.0], block, pitch, count)
}

fn logarithmic(draw: &mut Uniform, low: f64, high: f64) -> f64 {
    draw.between(low.ln(), high.ln()).exp()
}

/// The nearest multiple of the solver's cell [m].
fn in_cells(length: f64) -> f64 {
    (length / CELL).round() * CELL
}
