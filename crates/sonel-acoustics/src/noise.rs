//! Background noise: A-weighting, noise rating (NR), noise criterion (NC) and room criterion (RC) of octave levels.
//!
//! NR curves are L = a + b NR with the constants of ISO/R 1996. NC curves are a table, between whose rows is interpolated. Both ratings are the
//! highest curve that a level reaches (tangent method). RC is the mean of 500, 1000 and 2000 Hz; its curve falls by 5 dB an octave.
//!
//! References: [IEC61672-1], [ISOR1996], [ANSIS12.2], [Blazier1981] (docs/references.md).

/// Octaves of the ratings, nominal centres [Hz].
pub const NOISE_OCTAVES: [f64; 8] = [63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];

/// Constants a [dB] and b of the NR curves.
const NR: [[f64; 2]; 8] = [
    [35.5, 0.790],
    [22.0, 0.870],
    [12.0, 0.930],
    [4.8, 0.974],
    [0.0, 1.000],
    [-3.5, 1.015],
    [-6.1, 1.025],
    [-8.0, 1.030],
];
/// Lowest NR.
const LOWEST_NR: f64 = 0.0;
/// Highest NR.
const HIGHEST_NR: f64 = 130.0;

/// Levels of the NC curves 15, 20 … 65 [dB].
const NC: [[f64; 8]; 11] = [
    [47.0, 36.0, 29.0, 22.0, 17.0, 14.0, 12.0, 11.0],
    [51.0, 40.0, 33.0, 26.0, 22.0, 19.0, 17.0, 16.0],
    [54.0, 44.0, 37.0, 31.0, 27.0, 24.0, 22.0, 21.0],
    [57.0, 48.0, 41.0, 35.0, 31.0, 29.0, 28.0, 27.0],
    [60.0, 52.0, 45.0, 40.0, 36.0, 34.0, 33.0, 32.0],
    [64.0, 56.0, 50.0, 45.0, 41.0, 39.0, 38.0, 37.0],
    [67.0, 60.0, 54.0, 49.0, 46.0, 44.0, 43.0, 42.0],
    [71.0, 64.0, 58.0, 54.0, 51.0, 49.0, 48.0, 47.0],
    [74.0, 67.0, 62.0, 58.0, 56.0, 54.0, 53.0, 52.0],
    [77.0, 71.0, 67.0, 63.0, 61.0, 59.0, 58.0, 57.0],
    [80.0, 75.0, 71.0, 68.0, 66.0, 64.0, 63.0, 62.0],
];
/// Lowest and highest NC curve, and their distance.
const LOWEST_NC: f64 = 15.0;
const HIGHEST_NC: f64 = 65.0;
const NC_STEP: f64 = 5.0;

/// Fall of an RC curve per octave [dB].
const RC_SLOPE: f64 = 5.0;
/// Excess over the RC curve up to 500 Hz that rumbles, and above that hisses [dB].
const RUMBLE: f64 = 5.0;
const HISS: f64 = 3.0;

/// A-weighting at a frequency [Hz], in decibels.
#[must_use]
pub fn a_weighting_db(frequency: f64) -> f64 {
    let square = frequency * frequency;
    let pole = |corner: f64| square + corner * corner;
    let (low, high) = (20.598_997, 12_194.217);
    let gain = high * high * square * square
        / (pole(low) * (pole(107.652_65) * pole(737.862_23)).sqrt() * pole(high));
    20.0 * libm::log10(gain) + 2.0
}

/// A-weighted sum of band levels [dB] at these `frequencies` [Hz].
#[must_use]
pub fn a_weighted_db(frequencies: &[f64], levels_db: &[f64]) -> f64 {
    let weighted = || frequencies.iter().zip(levels_db).map(|(hz, level)| level + a_weighting_db(*hz));
    // Relative to the loudest, so that no level is beyond numbers.
    let loudest = weighted().fold(f64::MIN, f64::max);
    loudest + 10.0 * libm::log10(weighted().map(|level| libm::pow(10.0, 0.1 * (level - loudest))).sum())
}

/// A family of curves of background noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseCurve {
    /// Noise rating.
    Nr,
    /// Noise criterion.
    Nc,
}

impl NoiseCurve {
    /// Lowest and highest curve.
    #[must_use]
    pub fn range(self) -> [f64; 2] {
        match self {
            Self::Nr => [LOWEST_NR, HIGHEST_NR],
            Self::Nc => [LOWEST_NC, HIGHEST_NC],
        }
    }

    /// Levels of the curve `rating` in [`NOISE_OCTAVES`] [dB re 20 µPa]; none outside [`Self::range`].
    #[must_use]
    pub fn levels_db(self, rating: f64) -> Option<[f64; 8]> {
        let [low, high] = self.range();
        (low..=high).contains(&rating).then(|| match self {
            Self::Nr => NR.map(|[a, b]| a + b * rating),
            Self::Nc => {
                let row = (rating - LOWEST_NC) / NC_STEP;
                let below = (row as usize).min(NC.len() - 2);
                let share = row - below as f64;
                std::array::from_fn(|k| NC[below][k] + share * (NC[below + 1][k] - NC[below][k]))
            }
        })
    }

    /// The curve that the loudest octave reaches: `levels_db` [dB re 20 µPa], [`None`] where an octave is not known. The lowest curve stands
    /// for what is below all of them; none above the highest.
    #[must_use]
    pub fn rating(self, levels_db: &[Option<f64>; 8]) -> Option<f64> {
        let [low, high] = self.range();
        let reached = |(k, level): (usize, &Option<f64>)| {
            let level = (*level)?;
            Some(match self {
                Self::Nr => (level - NR[k][0]) / NR[k][1],
                Self::Nc => {
                    let row = NC.windows(2).position(|pair| level < pair[1][k]).unwrap_or(NC.len() - 2);
                    let (from, to) = (NC[row][k], NC[row + 1][k]);
                    LOWEST_NC + NC_STEP * (row as f64 + (level - from) / (to - from))
                }
            })
        };
        let rating = levels_db.iter().enumerate().filter_map(reached).fold(f64::NEG_INFINITY, f64::max);
        (rating.is_finite() && rating <= high).then(|| rating.max(low))
    }
}

/// Room criterion of a noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoomCriterion {
    /// Mean of 500, 1000 and 2000 Hz [dB].
    pub rating: f64,
    /// Whether octaves up to 500 Hz exceed the curve by more than 5 dB.
    pub rumbles: bool,
    /// Whether octaves from 1000 Hz exceed the curve by more than 3 dB.
    pub hisses: bool,
}

impl RoomCriterion {
    /// The criterion of `levels_db` in [`NOISE_OCTAVES`] [dB re 20 µPa]; none where one of the three octaves is not known.
    #[must_use]
    pub fn of(levels_db: &[Option<f64>; 8]) -> Option<Self> {
        let middle = [levels_db[3]?, levels_db[4]?, levels_db[5]?];
        let rating = middle.iter().sum::<f64>() / 3.0;
        // 1000 Hz is octave 4.
        let excess = |k: usize| levels_db[k].map(|level| level - (rating + RC_SLOPE * (4.0 - k as f64)));
        let exceeds = |octaves: std::ops::Range<usize>, limit: f64| {
            octaves.filter_map(excess).any(|excess| excess > limit)
        };
        Some(Self { rating, rumbles: exceeds(0..4, RUMBLE), hisses: exceeds(4..8, HISS) })
    }
}

/// `RC 35 (N)`: N neutral, R rumble, H hiss.
impl std::fmt::Display for RoomCriterion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let quality = match (self.rumbles, self.hisses) {
            (false, false) => "N",
            (true, false) => "R",
            (false, true) => "H",
            (true, true) => "RH",
        };
        write!(f, "RC {:.0} ({quality})", self.rating)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(levels: [f64; 8]) -> [Option<f64>; 8] {
        levels.map(Some)
    }

    /// The table of IEC 61672-1 at nominal frequencies, to its tenth and the difference of exact and nominal frequency.
    #[test]
    fn a_weighting_is_that_of_the_standard() {
        let table =
            [(31.5, -39.4), (63.0, -26.2), (125.0, -16.1), (250.0, -8.6), (500.0, -3.2), (1000.0, 0.0)];
        let high = [(2000.0, 1.2), (4000.0, 1.0), (8000.0, -1.1), (16_000.0, -6.6)];
        for (hz, expected) in table.into_iter().chain(high) {
            let found = a_weighting_db(hz);
            assert!((found - expected).abs() < 0.13, "{hz} Hz: {found} instead of {expected}");
        }
        assert!((a_weighted_db(&[1000.0, 1000.0], &[60.0, 60.0]) - 63.01).abs() < 0.01);
    }

    /// Printed values of NR 35 and NC 30, and a curve half way between two.
    #[test]
    fn curves_are_those_of_the_tables() {
        let nr = NoiseCurve::Nr.levels_db(35.0).expect("in range");
        for (found, printed) in nr.into_iter().zip([63.1, 52.4, 44.5, 38.9, 35.0, 32.0, 29.8, 28.0]) {
            assert!((found - printed).abs() < 0.1, "{found} instead of {printed}");
        }
        assert_eq!(NoiseCurve::Nc.levels_db(30.0), Some(NC[3]));
        let between = NoiseCurve::Nc.levels_db(32.5).expect("in range");
        assert!((between[0] - 58.5).abs() < 1e-12 && (between[7] - 29.5).abs() < 1e-12);
        assert!(NoiseCurve::Nc.levels_db(10.0).is_none() && NoiseCurve::Nr.levels_db(131.0).is_none());
    }

    #[test]
    fn ratings_are_the_highest_curve_reached() {
        for curve in [NoiseCurve::Nr, NoiseCurve::Nc] {
            let levels = curve.levels_db(42.0).expect("in range");
            assert!((curve.rating(&known(levels)).expect("a rating") - 42.0).abs() < 1e-9);
            let mut louder = levels;
            louder[3] += 3.0;
            assert!(curve.rating(&known(louder)).expect("a rating") > 44.0);
        }
        assert_eq!(NoiseCurve::Nc.rating(&known([0.0; 8])), Some(15.0));
        assert_eq!(NoiseCurve::Nc.rating(&known([90.0; 8])), None);
        assert_eq!(NoiseCurve::Nr.rating(&[None; 8]), None);
    }

    #[test]
    fn the_room_criterion_tells_rumble_and_hiss() {
        let neutral = [55.0, 50.0, 45.0, 40.0, 35.0, 30.0, 25.0, 20.0];
        let of = |levels| RoomCriterion::of(&known(levels)).expect("three octaves").to_string();
        assert_eq!(of(neutral), "RC 35 (N)");
        let (mut rumbling, mut hissing) = (neutral, neutral);
        rumbling[0] = 61.0;
        hissing[7] = 24.0;
        assert_eq!((of(rumbling), of(hissing)), ("RC 35 (R)".to_owned(), "RC 35 (H)".to_owned()));
    }
}
