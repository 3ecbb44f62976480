//! Means over frequency bands of products of waves, flat per Hz.
//!
//! A band is cut into cells of equal ratio, each weighted by its width. Within a cell the amplitudes count as constant, but
//! the rotation of two waves against one another is averaged exactly, so a difference of path of a thousand wavelengths
//! needs no more cells than none. Amplitudes over edges change as the root of the frequency at the fastest.

use std::borrow::Borrow;
use std::f64::consts::TAU;

use crate::complex::Complex;
use crate::wave_numbers::WaveNumbers;

/// Cells of an octave: means are exact for amplitudes that fall as the root of 1/f, as those over edges do far from their boundaries, and err by
/// 0.011 dB for 1/f.
const CELLS_PER_OCTAVE: f64 = 4.0;
/// Products of two waves below this share of the strongest wave's own are left out: thousands of them with random phases
/// make less than 1e-4 dB, 0.01 dB in a band that is 30 dB below the strongest.
const NEGLIGIBLE: f64 = 1e-7;

/// Angle [rad] by which waves of one length turn against one another between the middle and the end of a cell: an error of 1e-4 of what they
/// add up to.
const SAME_LENGTH: f64 = 0.02;

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
        Wave { length, amplitude: vec![Complex::real(amplitude); self.cells.len()] }
    }

    /// amplitude e^(−jk length) of a wave in the middle of each cell [1/m], up to the last one in which it is not 0.
    fn at_receiver(&self, wave: &Wave) -> Vec<Complex> {
        let is_something = |amplitude: &Complex| amplitude.square_of_modulus() > 0.0;
        let count = wave.amplitude.iter().rposition(is_something).map_or(0, |last| last + 1);
        let cells = self.cells[..count].iter().zip(&wave.amplitude);
        cells.map(|(cell, &amplitude)| amplitude * Complex::unit(-cell.k * wave.length)).collect()
    }

    /// All waves in ascending order of length, those of nearly one length as one.
    fn turned<W: Borrow<Wave>>(&self, waves: &[W]) -> Vec<TurnedWave> {
        let widest = self.cells.iter().map(|cell| cell.half).fold(f64::MIN_POSITIVE, f64::max);
        let mut sorted: Vec<&Wave> = waves.iter().map(Borrow::borrow).collect();
        sorted.sort_by(|one, other| one.length.total_cmp(&other.length));
        let mut turned = Vec::new();
        let mut sorted = sorted.into_iter().peekable();
        while let Some(first) = sorted.next() {
            let mut sum = self.at_receiver(first);
            while let Some(next) = sorted.next_if(|next| widest * (next.length - first.length) <= SAME_LENGTH)
            {
                let amplitude = self.at_receiver(next);
                sum.resize(sum.len().max(amplitude.len()), Complex::ZERO);
                sum.iter_mut().zip(amplitude).for_each(|(sum, amplitude)| *sum += amplitude);
            }
            let across = self.cells[..sum.len()].iter().map(|cell| Complex::unit(cell.half * first.length));
            turned.push(TurnedWave {
                length: first.length,
                across: Parts::new(across),
                largest_square: sum.iter().map(|a| a.square_of_modulus()).fold(0.0, f64::max),
                amplitude: Parts::new(sum.into_iter()),
            });
        }
        turned
    }

    /// Adds, per band, the mean of Re(a b*) of a wave `a` with others, each cell times `weights`, without products that cannot exceed `least` [1/m²].
    fn add(&self, a: &TurnedWave, b: &[TurnedWave], weights: &[f64], least: f64, sum: &mut [f64]) {
        let narrowest = self.cells.iter().map(|cell| cell.half).fold(f64::INFINITY, f64::min);
        // With the weights and the half widths, which all waves share.
        let scaled: Vec<f64> =
            weights.iter().zip(&self.cells).map(|(weight, cell)| weight / cell.half).collect();
        let scaled = Parts {
            re: a.amplitude.re.iter().zip(&scaled).map(|(a, scale)| a * scale).collect(),
            im: a.amplitude.im.iter().zip(&scaled).map(|(a, scale)| a * scale).collect(),
        };
        let mut cells = vec![0.0; a.amplitude.re.len()];
        for b in b {
            let cells = &mut cells[..a.amplitude.re.len().min(b.amplitude.re.len())];
            let difference = a.length - b.length;
            // The mean over a cell falls as the turns of the two against one another within it.
            let bound =
                (a.largest_square * b.largest_square).sqrt() / (narrowest * difference).abs().max(1.0);
            if bound < least {
                continue;
            }
            if (narrowest * difference).abs() < SMALL {
                for (index, (cell, sum)) in self.cells.iter().zip(&mut *cells).enumerate() {
                    let product = a.amplitude.with_conjugate(&b.amplitude, index).re;
                    let turn = a.across.with_conjugate(&b.across, index).im;
                    *sum += weights[index] * product * sinc(cell.half * difference, turn);
                }
            } else {
                scaled.add_turned(&b.amplitude, &a.across, &b.across, 1.0 / difference, cells);
            }
        }
        for (cell, part) in self.cells.iter().zip(cells) {
            sum[cell.band] += part;
        }
    }

    /// Mean of |p|² of the field of `waves` per band [1/m²].
    #[must_use]
    pub fn energy<W: Borrow<Wave>>(&self, waves: &[W]) -> Vec<f64> {
        let waves = self.turned(waves);
        let loudest = waves.iter().map(|wave| wave.largest_square).fold(0.0, f64::max);
        let once: Vec<f64> = self.cells.iter().map(|cell| cell.weight).collect();
        let twice: Vec<f64> = once.iter().map(|weight| 2.0 * weight).collect();
        let least = NEGLIGIBLE * loudest;
        let mut sum = vec![0.0; self.bands];
        for (index, wave) in waves.iter().enumerate() {
            self.add(wave, std::slice::from_ref(wave), &once, least, &mut sum);
            self.add(wave, &waves[index + 1..], &twice, least, &mut sum);
        }
        debug_assert!(sum.iter().all(|energy| energy.is_finite()), "{sum:?}");
        // The mean of a square: what rounding leaves below zero is zero.
        sum.iter().map(|energy| energy.max(0.0)).collect()
    }
}

/// A wave whose phases at the receiver are known in every cell, so that products of thousands of pairs need no sine.
#[derive(Debug, Clone, PartialEq)]
struct TurnedWave {
    length: f64,
    /// amplitude e^(−jk length) in the middle of each cell [1/m], up to the last one in which it is not 0.
    amplitude: Parts,
    /// e^(j half length): how far the wave turns from the middle of each cell to its end.
    across: Parts,
    /// Largest |amplitude|² of any cell [1/m²].
    largest_square: f64,
}

/// One complex number a cell, as real and imaginary parts, which processors multiply by the row.
#[derive(Debug, Clone, PartialEq)]
struct Parts {
    re: Vec<f64>,
    im: Vec<f64>,
}

impl Parts {
    fn new(numbers: impl Iterator<Item = Complex>) -> Self {
        let (re, im) = numbers.map(|number| (number.re, number.im)).unzip();
        Self { re, im }
    }

    /// The number at `index` times the conjugate of another one.
    fn with_conjugate(&self, other: &Self, index: usize) -> Complex {
        Complex::new(self.re[index], self.im[index])
            * Complex::new(other.re[index], other.im[index]).conjugate()
    }

    /// Adds Re(self other*) Im(turn other_turn*) `scale` of each cell to `sum`.
    fn add_turned(&self, other: &Self, turn: &Self, other_turn: &Self, scale: f64, sum: &mut [f64]) {
        let count = sum.len();
        let rows = [self, other, turn, other_turn].map(|parts| (&parts.re[..count], &parts.im[..count]));
        let [(a_re, a_im), (b_re, b_im), (turn_re, turn_im), (other_re, other_im)] = rows;
        for cell in 0..count {
            let product = a_re[cell] * b_re[cell] + a_im[cell] * b_im[cell];
            let sine = turn_im[cell] * other_re[cell] - turn_re[cell] * other_im[cell];
            sum[cell] += product * sine * scale;
        }
    }
}

/// Angle [rad] below which sin x / x is taken from its series to x²; x⁴/120 is then below 1e-14.
const SMALL: f64 = 1e-3;

/// sin x / x, where sin x is known; rounding of a small sine is avoided.
fn sinc(x: f64, sine: f64) -> f64 {
    if x.abs() < SMALL { 1.0 - x * x / 6.0 } else { sine / x }
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
            spectrum.wave_numbers().values().iter().map(|k| Complex::real(1.0 / k.sqrt())).collect();
        let found = spectrum.energy(&[Wave { length: 0.0, amplitude: falling }])[0];
        let exact = 2f64.ln() / 707.0 * 343.0 / TAU;
        assert!((found / exact - 1.0).abs() < 1e-12, "{found} {exact}");
    }

    #[test]
    fn a_wave_that_ends_below_the_last_cell_counts_up_to_there() {
        let spectrum = Spectrum::new(&[(350.0, 700.0), (700.0, 1400.0)], 340.0);
        let low = |length: f64| {
            let below = |cell: &Cell| Complex::real(if cell.band == 0 { 0.5 } else { 0.0 });
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
