//! Means over frequency bands of products of waves, flat per Hz.
//!
//! A band is cut into cells of equal ratio, each weighted by its width. Within a cell the amplitudes count as constant, but
//! the rotation of two waves against one another is averaged exactly, so a difference of path of a thousand wavelengths
//! needs no more cells than none. Amplitudes over edges change as the root of the frequency at the fastest.

use std::borrow::Borrow;
use std::f64::consts::TAU;

use crate::complex::{Complex, unit};
use crate::wave_numbers::WaveNumbers;

/// Cells of an octave: means are exact for amplitudes that fall as the root of 1/f, as those over edges do far from their boundaries, and err by
/// 0.011 dB for 1/f.
const CELLS_PER_OCTAVE: f64 = 4.0;
/// Angle [rad] by which waves of one length turn against one another between the middle and the end of a cell: an error of 4e-4 of what they
/// add up to.
const SAME_LENGTH: f64 = 0.05;
/// Pairs of waves that are multiplied at once.
const AT_ONCE: usize = 4;

/// A cell of a band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Wave number in the middle [1/m].
    pub k: f64,
    /// Half its width in wave numbers [1/m].
    half: f64,
    /// Share of its band.
    weight: f64,
    /// Index of its band.
    pub band: usize,
}

/// Frequency bands as cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    cells: Vec<Cell>,
    wave_numbers: WaveNumbers,
    bands: usize,
}

/// Sound of one travel time: amplitude(k) e^(−jk length), with slowly varying amplitudes, one a cell [1/m].
#[derive(Debug, Clone, PartialEq)]
pub struct Wave {
    /// Length of its way [m].
    pub length: f64,
    /// Amplitudes.
    pub amplitude: Vec<Complex>,
}

impl Spectrum {
    /// Bands from lower to upper edge [Hz] at a speed of sound [m/s].
    #[must_use]
    pub fn new(bands: &[(f64, f64)], speed_of_sound: f64) -> Self {
        let mut cells = Vec::new();
        for (band, &(low, high)) in bands.iter().enumerate() {
            let count = libm::ceil(CELLS_PER_OCTAVE * libm::log2(high / low)).max(1.0) as usize;
            let border = |cell: usize| low * libm::pow(high / low, cell as f64 / count as f64);
            for cell in 0..count {
                let (from, to) = (border(cell), border(cell + 1));
                let k = 0.5 * (from + to) * TAU / speed_of_sound;
                let half = 0.5 * (to - from) * TAU / speed_of_sound;
                cells.push(Cell { k, half, weight: (to - from) / (high - low), band });
            }
        }
        // The mean of 1/k over a cell is that at the logarithmic mean of its ends.
        let mean = |cell: &Cell| 2.0 * cell.half / libm::log((cell.k + cell.half) / (cell.k - cell.half));
        let wave_numbers = WaveNumbers::new(cells.iter().map(mean).collect());
        Self { cells, wave_numbers, bands: bands.len() }
    }

    /// The cells.
    #[must_use]
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// The wave numbers at which amplitudes stand for their cells: the logarithmic means of the ends.
    #[must_use]
    pub fn wave_numbers(&self) -> &WaveNumbers {
        &self.wave_numbers
    }

    /// Number of bands.
    #[must_use]
    pub fn bands(&self) -> usize {
        self.bands
    }

    /// The smallest and the largest of the wave numbers [1/m].
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        let of = |[low, high]: [f64; 2], k: &f64| [low.min(*k), high.max(*k)];
        self.wave_numbers.values().iter().fold([f64::INFINITY, 0.0], of)
    }

    /// The wave that has the same amplitude in every cell.
    #[must_use]
    pub fn flat(&self, length: f64, amplitude: f64) -> Wave {
        Wave { length, amplitude: vec![Complex::from(amplitude); self.cells.len()] }
    }

    /// Mean of |p|² of one wave with `amplitudes`, one a cell [1/m], per band [1/m²].
    #[must_use]
    pub fn energy_of_one(&self, amplitudes: impl Iterator<Item = Complex>) -> Vec<f64> {
        let mut energy = vec![0.0; self.bands];
        for (amplitude, cell) in amplitudes.zip(&self.cells) {
            energy[cell.band] += cell.weight * amplitude.norm_sqr();
        }
        energy
    }

    /// Mean of |p|² of the field of `waves` per band [1/m²].
    #[must_use]
    pub fn energy<W: Borrow<Wave>>(&self, waves: &[W]) -> Vec<f64> {
        let mut sorted: Vec<&Wave> = waves.iter().map(Borrow::borrow).collect();
        sorted.sort_by(|one, other| one.length.total_cmp(&other.length));
        let mut first = 0;
        let bands = self.cells.chunk_by(|one, other| one.band == other.band);
        bands
            .map(|cells| {
                let before = first;
                first += cells.len();
                Arriving::new(cells, before, &sorted).mean_square(cells)
            })
            .collect()
    }
}

/// Waves at the receiver in one band, in ascending order of length, those of nearly one length as one.
struct Arriving {
    lengths: Vec<f64>,
    /// By cell.
    rows: Vec<CellWaves>,
}

/// Waves in one cell, by their number.
#[derive(Clone, Default)]
struct CellWaves {
    /// Real and imaginary parts of amplitude e^(−jk length) in the middle of the cell [1/m].
    re: Vec<f64>,
    im: Vec<f64>,
    /// e^(j half length): how far each wave turns from the middle of the cell to its end.
    cosine: Vec<f64>,
    sine: Vec<f64>,
}

impl Arriving {
    /// In `cells`, of which `before` others lie below, from waves `sorted` by length.
    fn new(cells: &[Cell], before: usize, sorted: &[&Wave]) -> Self {
        let widest = cells.iter().map(|cell| cell.half).fold(0.0, f64::max);
        let mut arriving = Self { lengths: Vec::new(), rows: vec![CellWaves::default(); cells.len()] };
        for wave in sorted {
            let amplitudes = &wave.amplitude[before..][..cells.len()];
            if amplitudes.iter().all(|amplitude| amplitude.norm_sqr() <= 0.0) {
                continue;
            }
            let is_new =
                arriving.lengths.last().is_none_or(|last| widest * (wave.length - last) > SAME_LENGTH);
            if is_new {
                arriving.lengths.push(wave.length);
            }
            for ((row, cell), &amplitude) in arriving.rows.iter_mut().zip(cells).zip(amplitudes) {
                row.add(is_new, amplitude * unit(-cell.k * wave.length), cell.half * wave.length);
            }
        }
        arriving
    }

    /// Mean of |p|² [1/m²]: over a cell, that of a product of two waves falls as sin x/x, x = half (difference of their lengths).
    fn mean_square(&self, cells: &[Cell]) -> f64 {
        let mut sums = vec![0.0; cells.len()];
        let mut inverse = vec![0.0; self.lengths.len()];
        for (index, length) in self.lengths.iter().enumerate() {
            for (inverse, other) in inverse[index + 1..].iter_mut().zip(&self.lengths[index + 1..]) {
                *inverse = 1.0 / (other - length);
            }
            for ((sum, row), cell) in sums.iter_mut().zip(&self.rows).zip(cells) {
                let own = row.re[index] * row.re[index] + row.im[index] * row.im[index];
                *sum += own + 2.0 / cell.half * row.with_later(index, &inverse);
            }
        }
        // The mean of a square: what rounding leaves below zero is zero.
        sums.iter().zip(cells).map(|(sum, cell)| cell.weight * sum).sum::<f64>().max(0.0)
    }
}

impl CellWaves {
    /// Adds a wave that turns by `angle` to the end of the cell, as a new one or to the last.
    fn add(&mut self, is_new: bool, amplitude: Complex, angle: f64) {
        if is_new {
            let (sine, cosine) = libm::sincos(angle);
            self.re.push(0.0);
            self.im.push(0.0);
            self.sine.push(sine);
            self.cosine.push(cosine);
        }
        let last = self.re.len() - 1;
        self.re[last] += amplitude.re;
        self.im[last] += amplitude.im;
    }

    /// Sum of Re(a b*) sin(half (difference of their lengths)) over that difference [1/m³], of wave `index` and all later ones.
    fn with_later(&self, index: usize, inverse: &[f64]) -> f64 {
        let [re, im, cosine, sine] = [&self.re, &self.im, &self.cosine, &self.sine].map(|row| row[index]);
        let mut sums = [0.0; AT_ONCE];
        let mut add = |lane: usize, [b_re, b_im, b_cosine, b_sine, inverse]: [f64; 5]| {
            sums[lane] += (re * b_re + im * b_im) * (b_sine * cosine - b_cosine * sine) * inverse;
        };
        let rows = [&self.re[..], &self.im, &self.cosine, &self.sine, inverse].map(|row| &row[index + 1..]);
        let whole = rows[0].len() - rows[0].len() % AT_ONCE;
        for first in (0..whole).step_by(AT_ONCE) {
            let lanes = rows.map(|row| &row[first..first + AT_ONCE]);
            for lane in 0..AT_ONCE {
                add(lane, lanes.map(|row| row[lane]));
            }
        }
        for other in whole..rows[0].len() {
            add(0, rows.map(|row| row[other]));
        }
        sums.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_equal_waves_interfere_within_a_band_and_far_apart_they_add() {
        let spectrum = Spectrum::new(&[(700.0, 1400.0)], 340.0);
        let energy = |length: f64| spectrum.energy(&[spectrum.flat(1.0, 1.0), spectrum.flat(length, 1.0)])[0];
        assert!((energy(1.0) - 4.0).abs() < 1e-12);
        assert!((energy(1.0 + 5000.0) - 2.0).abs() < 1e-3);
        // Mean of 2 + 2 cos 2πfτ over the band, in closed form.
        for difference in [0.05, 0.3, 4.0, 77.0] {
            let phase = |f: f64| TAU * f * difference / 340.0;
            let exact =
                2.0 + 2.0 * (phase(1400.0).sin() - phase(700.0).sin()) / (phase(1400.0) - phase(700.0));
            assert!((energy(1.0 + difference) - exact).abs() < 1e-9, "{difference}");
        }
    }

    #[test]
    fn means_are_flat_per_hertz() {
        let spectrum = Spectrum::new(&[(707.0, 1414.0)], 343.0);
        let falling =
            spectrum.wave_numbers().values().iter().map(|k| Complex::from(1.0 / k.sqrt())).collect();
        let found = spectrum.energy(&[Wave { length: 0.0, amplitude: falling }])[0];
        let exact = 2f64.ln() / 707.0 * 343.0 / TAU;
        assert!((found / exact - 1.0).abs() < 1e-12, "{found} {exact}");
    }

    #[test]
    fn a_wave_that_ends_below_the_last_cell_counts_up_to_there() {
        let spectrum = Spectrum::new(&[(350.0, 700.0), (700.0, 1400.0)], 340.0);
        let low = |length: f64| {
            let below = |cell: &Cell| Complex::from(if cell.band == 0 { 0.5 } else { 0.0 });
            Wave { length, amplitude: spectrum.cells().iter().map(below).collect() }
        };
        let alone = spectrum.energy(&[spectrum.flat(1.0, 1.0)]);
        let all = spectrum.energy(&[spectrum.flat(1.0, 1.0), spectrum.flat(1.3, 0.5)]);
        for waves in [[spectrum.flat(1.0, 1.0), low(1.3)], [low(1.3), spectrum.flat(1.0, 1.0)]] {
            let found = spectrum.energy(&waves);
            assert!((found[0] / all[0] - 1.0).abs() < 1e-12 && (found[1] / alone[1] - 1.0).abs() < 1e-12);
        }
    }
}
