//! A wave solver: finite differences in time on cubic cells, walls of frequency-independent admittance.
//!
//! Pressure stands in the middles of cubes with side h. Each cube balances what flows through its six faces [Bilbao2013]: through an
//! open face (p′ − p)/h, through a wall of the specific admittance β −(β/c) ∂p/∂t. With λ = cT/h, K open faces, γ the sum of the
//! admittances of the others, and centred differences in time,
//!
//!   p⁺ = [(2 − Kλ²) p + λ² Σ p′ − (1 − λγ/2) p⁻] / (1 + λγ/2),
//!
//! which loses energy at walls alone and is stable up to λ² = 1/3, the value taken here. A wave along an axis is 2 % slow at twelve
//! cells per wavelength, along a diagonal it is exact. Small, slow and clear: all cells of the box are stored. In single precision rounding leaves noise at low
//! frequencies, 30 dB below the modes of a hall at 63 Hz.
//!
//! Reference: docs/references.md [Bilbao2013].

use rayon::prelude::*;

/// λ², the stability limit in three dimensions.
const COURANT_SQUARED: f64 = 1.0 / 3.0;
/// All six faces are open.
const INTERIOR: u8 = 0b11_1111;

/// Cubes of air between walls.
pub struct WaveRoom {
    counts: [usize; 3],
    /// A bit per face that is open, by axis, first the lower one; none for cells out of reach.
    open: Vec<u8>,
    /// γ, the admittances of all walls of the cell.
    admittance: Vec<f64>,
}

/// Source and receivers, each a cell.
pub struct Places<'a> {
    /// Cell of the source.
    pub source: [usize; 3],
    /// Cells of the receivers.
    pub receivers: &'a [[usize; 3]],
}

impl WaveRoom {
    /// The cells that air reaches from `start` in a box of `counts` cells. `wall` gives the specific admittance of the wall between a
    /// cell and its next along an axis, 0 for a rigid one; [`None`] where nothing is between them. The box is rigid.
    ///
    /// # Panics
    /// Where `start` is outside.
    #[must_use]
    pub fn new(
        counts: [usize; 3],
        start: [usize; 3],
        wall: impl Fn([usize; 3], usize) -> Option<f64> + Sync,
    ) -> Self {
        let total = counts.iter().product();
        let walls: Vec<[Option<f64>; 3]> = (0..total)
            .into_par_iter()
            .map(|index| {
                let cell = place(counts, index);
                [0, 1, 2].map(|axis| if cell[axis] + 1 < counts[axis] { wall(cell, axis) } else { Some(0.0) })
            })
            .collect();
        let mut room = Self { counts, open: vec![0; total], admittance: vec![0.0; total] };
        let (mut seen, mut next) = (vec![false; total], vec![room.index(start)]);
        seen[next[0]] = true;
        while let Some(index) = next.pop() {
            for axis in 0..3 {
                let stride = room.stride(axis);
                let is_first = place(counts, index)[axis] == 0;
                let below = if is_first { Some(0.0) } else { walls[index - stride][axis] };
                for (face, wall) in [(2 * axis, below), (2 * axis + 1, walls[index][axis])] {
                    let Some(admittance) = wall else {
                        room.open[index] |= 1 << face;
                        let other = if face % 2 == 0 { index - stride } else { index + stride };
                        if !std::mem::replace(&mut seen[other], true) {
                            next.push(other);
                        }
                        continue;
                    };
                    room.admittance[index] += admittance;
                }
            }
        }
        room
    }

    /// Number of cells that air reaches.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.open.iter().filter(|&&open| open > 0).count()
    }

    /// Pressure at the receivers at every step after a unit pulse at the source: `[receiver][step]`. A step takes h/(√3 c).
    #[must_use]
    pub fn responses(&self, places: &Places<'_>, steps: usize) -> Vec<Vec<f64>> {
        let mut now = vec![0.0; self.open.len()];
        let mut before = now.clone();
        now[self.index(places.source)] = 1.0;
        let mut responses = vec![Vec::with_capacity(steps); places.receivers.len()];
        for _ in 0..steps {
            for (responses, &receiver) in responses.iter_mut().zip(places.receivers) {
                responses.push(now[self.index(receiver)]);
            }
            self.advance(&now, &mut before);
            std::mem::swap(&mut now, &mut before);
        }
        responses
    }

    /// Puts the pressures after `now` in place of those before.
    fn advance(&self, now: &[f64], before: &mut [f64]) {
        let layer = self.stride(2);
        before.par_chunks_mut(layer).enumerate().for_each(|(number, before)| {
            for (offset, before) in before.iter_mut().enumerate() {
                let index = number * layer + offset;
                *before = match self.open[index] {
                    0 => continue,
                    INTERIOR => COURANT_SQUARED * self.neighbours(now, index, INTERIOR) - *before,
                    open => self.at_wall(now, (index, open), *before),
                };
            }
        });
    }

    fn at_wall(&self, now: &[f64], (index, open): (usize, u8), before: f64) -> f64 {
        let half_loss = 0.5 * COURANT_SQUARED.sqrt() * self.admittance[index];
        let own = 2.0 - f64::from(open.count_ones()) * COURANT_SQUARED;
        let flow = own * now[index] + COURANT_SQUARED * self.neighbours(now, index, open);
        (flow - (1.0 - half_loss) * before) / (1.0 + half_loss)
    }

    /// Sum of the pressures behind the open faces. In the interior 2 − 6λ² is zero: a cell does not see itself.
    #[inline]
    fn neighbours(&self, now: &[f64], index: usize, open: u8) -> f64 {
        let mut sum = 0.0;
        for axis in 0..3 {
            let stride = self.stride(axis);
            if open & 1 << (2 * axis) != 0 {
                sum += now[index - stride];
            }
            if open & 2 << (2 * axis) != 0 {
                sum += now[index + stride];
            }
        }
        sum
    }

    #[inline]
    fn stride(&self, axis: usize) -> usize {
        [1, self.counts[0], self.counts[0] * self.counts[1]][axis]
    }

    fn index(&self, cell: [usize; 3]) -> usize {
        (0..3).map(|axis| cell[axis] * self.stride(axis)).sum()
    }
}

fn place(counts: [usize; 3], index: usize) -> [usize; 3] {
    [index % counts[0], index / counts[0] % counts[1], index / (counts[0] * counts[1])]
}

/// Step [s] on cells of `cell` [m].
#[must_use]
pub fn step(cell: f64, speed_of_sound: f64) -> f64 {
    cell * COURANT_SQUARED.sqrt() / speed_of_sound
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const COUNTS: [usize; 3] = [12, 9, 7];

    /// Every mode of a rigid box turns at the frequency that the scheme gives it, sin²(ωT/2) = λ² Σ sin²(k h/2), which is that of
    /// the wave equation within its dispersion.
    #[test]
    fn a_rigid_box_has_its_modes() {
        let room = WaveRoom::new(COUNTS, [0; 3], |_, _| None);
        for orders in [[1, 0, 0], [0, 2, 1], [2, 1, 1]] {
            let wave = |axis: usize| f64::from(orders[axis]) * PI / COUNTS[axis] as f64;
            let sines: f64 = (0..3).map(|axis| (0.5 * wave(axis)).sin().powi(2)).sum();
            let turn = 2.0 * (sines / 3.0).sqrt().asin();
            let shape = |index: usize| {
                let cell = place(COUNTS, index);
                (0..3).map(|axis| (wave(axis) * (cell[axis] as f64 + 0.5)).cos()).product::<f64>()
            };
            let mut now: Vec<f64> = (0..room.open.len()).map(shape).collect();
            let mut before: Vec<f64> = now.iter().map(|p| p * turn.cos()).collect();
            for step in 1..200 {
                room.advance(&now, &mut before);
                std::mem::swap(&mut now, &mut before);
                let expected = shape(0) * (turn * f64::from(step)).cos();
                assert!((now[0] - expected).abs() < 1e-9, "{orders:?}, step {step}");
            }
            let exact = ((0..3).map(|axis| wave(axis).powi(2)).sum::<f64>() / 3.0).sqrt();
            assert!((turn / exact - 1.0).abs() < 0.03, "{orders:?}: {turn} {exact}");
        }
    }

    /// A long pulse in a tube comes back from an end of admittance β as (1 − β)/(1 + β), from a rigid one as it was.
    #[test]
    fn walls_reflect_by_their_admittance() {
        let length = 400;
        for admittance in [0.0, 0.1, 0.5, 1.0] {
            let room = WaveRoom::new([length, 1, 1], [0; 3], |_, _| None);
            let mut room = room;
            room.admittance[length - 1] += admittance;
            // A wave to the right: what it was a step ago stood λ cells to the left.
            let pulse = |x: f64| if x.abs() < 50.0 { (PI * x / 100.0).cos().powi(2) } else { 0.0 };
            let courant = COURANT_SQUARED.sqrt();
            let at = |shift: f64| -> Vec<f64> {
                (0..length).map(|cell| pulse(cell as f64 - 300.0 + shift)).collect()
            };
            let (mut now, mut before) = (at(0.0), at(courant));
            for _ in 0..(200.0 / courant) as usize {
                room.advance(&now, &mut before);
                std::mem::swap(&mut now, &mut before);
            }
            let found = now.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
            let expected = (1.0 - admittance) / (1.0 + admittance);
            assert!((found - expected).abs() < 0.01, "{admittance}: {found} instead of {expected}");
        }
    }

    /// Air behind a wall is not reached and stays silent.
    #[test]
    fn nothing_passes_a_wall() {
        let room = WaveRoom::new(COUNTS, [0; 3], |cell, axis| (axis == 0 && cell[0] == 5).then_some(0.2));
        assert_eq!(room.cells(), 6 * COUNTS[1] * COUNTS[2]);
        let receivers = [[2, 4, 3], [9, 4, 3]];
        let responses = room.responses(&Places { source: [1, 1, 1], receivers: &receivers }, 60);
        assert!(responses[0].iter().any(|&p| p.abs() > 1e-3) && responses[1].iter().all(|&p| p.abs() <= 0.0));
    }
}
