//! Frequency bands: nominal centres, exact midbands, edges.
//!
//! A band is named by its *nominal* centre (63, 125 … Hz) and has an *exact* midband 10^(n/10) Hz, the base-ten series.
//! Air attenuation uses the exact midband, diffraction integrates over f/√2 … f√2 of the nominal centre
//! (docs/physics.md §1). The two series of edges differ by 0.1 %.
//!
//! References: [IEC61260-1] (docs/references.md), ISO 266:1997.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Width of every band of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BandWidth {
    /// One octave.
    Octave,
    /// One third of an octave.
    Third,
}

impl BandWidth {
    /// Steps of the third-octave series from one band to the next.
    fn thirds(self) -> usize {
        match self {
            Self::Octave => 3,
            Self::Third => 1,
        }
    }

    /// Ratio of the upper edge to the centre: 2^(1/2) or 2^(1/6).
    pub fn half_width_ratio(self) -> f64 {
        match self {
            Self::Octave => libm::sqrt(2.0),
            Self::Third => libm::cbrt(libm::sqrt(2.0)),
        }
    }

    /// All nominal centres of this width, ascending [Hz].
    pub fn nominal_series(self) -> impl Iterator<Item = f64> {
        // The octave series contains 1000 Hz, so it starts where the distance to it is a whole number of octaves.
        let first = INDEX_OF_1000_HZ % self.thirds();
        NOMINAL_THIRDS[first..].iter().step_by(self.thirds()).copied()
    }
}

/// Nominal third-octave centres of ISO 266 from 10 Hz to 20 kHz [Hz]; entry i has the exact midband 10^((i+10)/10).
const NOMINAL_THIRDS: [f64; 34] = [
    10.0, 12.5, 16.0, 20.0, 25.0, 31.5, 40.0, 50.0, 63.0, 80.0, 100.0, 125.0, 160.0, 200.0, 250.0, 315.0,
    400.0, 500.0, 630.0, 800.0, 1000.0, 1250.0, 1600.0, 2000.0, 2500.0, 3150.0, 4000.0, 5000.0, 6300.0,
    8000.0, 10000.0, 12500.0, 16000.0, 20000.0,
];

/// Index of 1000 Hz in [`NOMINAL_THIRDS`].
const INDEX_OF_1000_HZ: usize = 20;

/// Why a list of centres is no set of bands.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BandError {
    /// No centre at all.
    #[error("no band given: list at least one nominal centre frequency")]
    Empty,
    /// A centre outside the nominal series of its width.
    #[error("{given} Hz is not a nominal {width} centre; the nearest is {nearest} Hz")]
    NotNominal {
        /// Position in the list.
        index: usize,
        /// The number found [Hz].
        given: f64,
        /// Nearest nominal centre by ratio [Hz].
        nearest: f64,
        /// Width of the set.
        width: BandWidth,
    },
    /// A centre not above the one before it.
    #[error("{given} Hz follows {before} Hz: centres must ascend, each once")]
    NotAscending {
        /// Position in the list.
        index: usize,
        /// The number found [Hz].
        given: f64,
        /// The number before it [Hz].
        before: f64,
    },
}

impl std::fmt::Display for BandWidth {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Octave => "octave",
            Self::Third => "third-octave",
        })
    }
}

/// A set of bands of one width: at least one nominal centre, ascending, gaps allowed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "UncheckedBands")]
pub struct Bands {
    nominal: Vec<f64>,
    width: BandWidth,
}

#[derive(Deserialize)]
struct UncheckedBands {
    nominal: Vec<f64>,
    width: BandWidth,
}

impl TryFrom<UncheckedBands> for Bands {
    type Error = BandError;

    fn try_from(unchecked: UncheckedBands) -> Result<Self, BandError> {
        Self::new(unchecked.nominal, unchecked.width)
    }
}

impl Bands {
    /// Checks and keeps nominal centres [Hz].
    ///
    /// # Errors
    /// The first problem of [`Bands::problems`].
    pub fn new(nominal: Vec<f64>, width: BandWidth) -> Result<Self, BandError> {
        match Self::problems(&nominal, width).into_iter().next() {
            Some(problem) => Err(problem),
            None => Ok(Self { nominal, width }),
        }
    }

    /// Bands of several sets, one behind the other: variants of a scene that are computed side by side.
    #[must_use]
    pub fn repeated(&self, times: usize) -> Self {
        Self { nominal: self.nominal.repeat(times), width: self.width }
    }

    /// Everything that keeps `nominal` [Hz] from being a set of bands; empty when it is one.
    pub fn problems(nominal: &[f64], width: BandWidth) -> Vec<BandError> {
        if nominal.is_empty() {
            return vec![BandError::Empty];
        }
        let mut problems = Vec::new();
        for (index, &given) in nominal.iter().enumerate() {
            let nearest = nearest_nominal(given, width);
            if given.total_cmp(&nearest).is_ne() {
                problems.push(BandError::NotNominal { index, given, nearest, width });
            }
            let before = index.checked_sub(1).map(|previous| nominal[previous]);
            if let Some(before) = before.filter(|before| given <= *before) {
                problems.push(BandError::NotAscending { index, given, before });
            }
        }
        problems
    }

    /// The eight octaves 63 … 8000 Hz, the default of a scene.
    pub fn octaves() -> Self {
        let nominal = vec![63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];
        Self { nominal, width: BandWidth::Octave }
    }

    /// Number of bands, at least 1.
    pub fn count(&self) -> usize {
        self.nominal.len()
    }

    /// Nominal centres, ascending [Hz].
    pub fn nominal(&self) -> &[f64] {
        &self.nominal
    }

    /// Width of every band.
    pub fn width(&self) -> BandWidth {
        self.width
    }

    /// Exact base-ten midband of band `i`, 10^(n/10) [Hz].
    ///
    /// # Panics
    /// When `i` is not below [`Bands::count`].
    pub fn exact_midband(&self, i: usize) -> f64 {
        let tenths_of_decade = libm::round(10.0 * libm::log10(self.nominal[i]));
        libm::exp10(tenths_of_decade / 10.0)
    }

    /// Lower and upper edge of band `i`: f/√2 and f√2 for octaves, f·2^(∓1/6) for third octaves, f nominal [Hz].
    ///
    /// # Panics
    /// When `i` is not below [`Bands::count`].
    pub fn edges(&self, i: usize) -> (f64, f64) {
        let ratio = self.width.half_width_ratio();
        (self.nominal[i] / ratio, self.nominal[i] * ratio)
    }

    /// Index of the band with nominal centre `nominal` [Hz], if it is in the set.
    pub fn index_of(&self, nominal: f64) -> Option<usize> {
        self.nominal.iter().position(|centre| centre.total_cmp(&nominal).is_eq())
    }
}

/// Nearest nominal centre by ratio; 1000 Hz for what is no frequency at all.
fn nearest_nominal(frequency: f64, width: BandWidth) -> f64 {
    if !(frequency > 0.0 && frequency.is_finite()) {
        return 1000.0;
    }
    let distance = |centre: f64| libm::fabs(libm::log(centre / frequency));
    width.nominal_series().min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap_or(1000.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_are_the_nominal_ones() {
        let octaves: Vec<f64> = BandWidth::Octave.nominal_series().collect();
        let expected = [16.0, 31.5, 63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0, 16000.0];
        assert_eq!(octaves, expected);
        assert_eq!(BandWidth::Third.nominal_series().count(), 34);
        assert!((NOMINAL_THIRDS[INDEX_OF_1000_HZ] - 1000.0).abs() < 1e-12);
    }

    #[test]
    fn every_nominal_centre_finds_its_exact_midband() {
        let bands = Bands::new(NOMINAL_THIRDS.to_vec(), BandWidth::Third).unwrap();
        for i in 0..bands.count() {
            let exact = 10f64.powf((i + 10) as f64 / 10.0);
            assert!((bands.exact_midband(i) / exact - 1.0).abs() < 1e-14, "{i}");
            // ISO 266 rounds to three figures or fewer: never by more than 1.3 %.
            assert!((bands.exact_midband(i) / bands.nominal()[i] - 1.0).abs() < 0.013, "{i}");
        }
    }

    #[test]
    fn edges_of_neighbours_meet() {
        let octaves = Bands::octaves();
        assert_eq!(octaves.count(), 8);
        let (low, high) = octaves.edges(4);
        assert!((low - 707.106_781_186_547_5).abs() < 1e-9 && (high - 1_414.213_562_373_095).abs() < 1e-9);
        assert!((octaves.edges(5).0 - high).abs() < 1e-9);
        let third = Bands::new(vec![1000.0], BandWidth::Third).unwrap();
        assert!((third.edges(0).1 / third.edges(0).0 - 2f64.cbrt()).abs() < 1e-14);
    }

    #[test]
    fn every_problem_is_found_at_once() {
        let problems = Bands::problems(&[500.0, 440.0, f64::NAN, 250.0, 250.0], BandWidth::Octave);
        let messages: Vec<String> = problems.iter().map(ToString::to_string).collect();
        assert_eq!(
            messages,
            [
                "440 Hz is not a nominal octave centre; the nearest is 500 Hz",
                "440 Hz follows 500 Hz: centres must ascend, each once",
                "NaN Hz is not a nominal octave centre; the nearest is 1000 Hz",
                "250 Hz follows 250 Hz: centres must ascend, each once",
            ]
        );
        assert_eq!(Bands::problems(&[], BandWidth::Third), [BandError::Empty]);
        assert_eq!(Bands::problems(&[100.0, 125.0], BandWidth::Third), []);
        assert_eq!(Bands::problems(&[100.0, 125.0], BandWidth::Octave).len(), 1);
    }
}
