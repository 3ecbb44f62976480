//! Speech and noise in words: vocal efforts, noise curves, and lists of levels.
//!
//! Normal effort has the power levels of [ISO3382-3]. Raised, loud and shouted speech is louder by the differences of the octave spectra of
//! [ANSIS3.5], which begin at 250 Hz: the difference at 125 Hz is taken as that at 250 Hz. `iec` is the male test signal of [IEC60268-16] at
//! 60 dB(A) one metre in front, as if the talker were omnidirectional.
//!
//! References: docs/references.md.

use std::str::FromStr;

use sonel_acoustics::noise::NoiseCurve;

use crate::open_plan::SPEECH_POWER_LEVEL_DB;

/// Words for spectra of speech and how much louder than normal speech they are in the octaves 125 … 8000 Hz [dB].
const EFFORTS: [(&str, [f64; 7]); 4] = [
    ("normal", [0.0; 7]),
    ("raised", [4.3, 4.3, 5.8, 8.8, 8.0, 7.5, 4.0]),
    ("loud", [6.8, 6.8, 10.5, 17.1, 17.1, 16.1, 10.3]),
    ("shouted", [7.8, 7.8, 14.9, 26.3, 27.0, 25.1, 19.6]),
];
/// The word for the test signal of IEC 60268-16, and its octave levels at 60 dB(A) in 1 m [dB].
const TEST_SIGNAL: (&str, [f64; 7]) = ("iec", [62.9, 62.9, 59.2, 53.2, 47.2, 41.2, 35.2]);
/// 10 lg 4π: power level over the level in 1 m of a free field [dB].
const FREE_FIELD_DB: f64 = 10.992_098_640_220_963;
/// Possible levels [dB].
const POSSIBLE: std::ops::RangeInclusive<f64> = -100.0..=200.0;

/// Power levels of speech in the octaves 125 … 8000 Hz [dB re 1 pW]: a word, or seven numbers between commas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeechPower(pub [f64; 7]);

/// Levels of noise in the octaves 125 … 8000 Hz [dB re 20 µPa]: a curve such as `NR-35` or `NC-30`, or seven numbers between commas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseLevels(pub [f64; 7]);

/// A sentence that says which words and levels are right.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct UnfitLevels(String);

impl FromStr for SpeechPower {
    type Err = UnfitLevels;

    fn from_str(text: &str) -> Result<Self, UnfitLevels> {
        let word = text.trim().to_lowercase();
        if word == TEST_SIGNAL.0 {
            return Ok(Self(TEST_SIGNAL.1.map(|level| level + FREE_FIELD_DB)));
        }
        if let Some((_, louder)) = EFFORTS.iter().find(|(name, _)| *name == word) {
            return Ok(Self(std::array::from_fn(|k| SPEECH_POWER_LEVEL_DB[k] + louder[k])));
        }
        let words: Vec<&str> = EFFORTS.iter().map(|(name, _)| *name).chain([TEST_SIGNAL.0]).collect();
        octaves(text, &format!("one of {}", words.join(", "))).map(Self)
    }
}

impl FromStr for NoiseLevels {
    type Err = UnfitLevels;

    fn from_str(text: &str) -> Result<Self, UnfitLevels> {
        let word = text.trim().to_uppercase();
        let (rest, curve) = match (word.strip_prefix("NR"), word.strip_prefix("NC")) {
            (Some(rest), _) => (rest, NoiseCurve::Nr),
            (_, Some(rest)) => (rest, NoiseCurve::Nc),
            _ => return octaves(text, "a curve such as NR-35 or NC-30").map(Self),
        };
        let rating = rest.trim_start_matches(['-', ' ']).parse().ok();
        let levels = rating.and_then(|rating| curve.levels_db(rating)).ok_or_else(|| {
            let [low, high] = curve.range();
            UnfitLevels(format!(
                "\"{text}\" is no curve of noise: give {low} … {high}, such as NR-35 or NC-30"
            ))
        })?;
        Ok(Self(std::array::from_fn(|k| levels[k + 1])))
    }
}

/// Seven levels within what physics allows; else a sentence with the `alternative`.
fn octaves(text: &str, alternative: &str) -> Result<[f64; 7], UnfitLevels> {
    let levels: Option<Vec<f64>> = text.split(',').map(|field| field.trim().parse().ok()).collect();
    let levels: [f64; 7] = levels.and_then(|levels| levels.try_into().ok()).ok_or_else(|| {
        UnfitLevels(format!(
            "\"{text}\" is not seven levels: write one for each octave 125 … 8000 Hz, such as 42,38,35,32,28,24,20, or {alternative}"
        ))
    })?;
    match levels.iter().find(|level| !POSSIBLE.contains(*level)) {
        Some(level) => Err(UnfitLevels(format!("{level} dB is outside -100 … 200 dB"))),
        None => Ok(levels),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modulation::SPEECH_OCTAVES;
    use sonel_acoustics::noise::a_weighted_db;

    /// A-weighted levels in 1 m: 57.4 dB of ISO 3382-3, 60 dB of IEC 60268-16; each effort is louder than the one before by 6 to 13 dB.
    #[test]
    fn words_have_the_levels_of_their_standards() {
        let level = |word: &str| {
            let SpeechPower(power) = word.parse().expect("a word");
            a_weighted_db(&SPEECH_OCTAVES, &power) - FREE_FIELD_DB
        };
        assert!((level("normal") - 57.4).abs() < 0.1, "{}", level("normal"));
        assert!((level("IEC") - 60.0).abs() < 0.2, "{}", level("iec"));
        let efforts = ["normal", "raised", "loud", "shouted"].map(level);
        assert!(efforts.windows(2).all(|pair| (6.0..13.0).contains(&(pair[1] - pair[0]))), "{efforts:?}");
    }

    #[test]
    fn noise_is_a_curve_or_seven_levels() {
        let NoiseLevels(nr) = "NR-35".parse().expect("a curve");
        assert!((nr[3] - 35.0).abs() < 1e-12 && (nr[0] - 52.45).abs() < 1e-9);
        let same = ["nc30", "48,41,35,31,29,28,27"].map(|text| text.parse::<NoiseLevels>().expect("levels"));
        assert_eq!(same[0], same[1]);
        for (text, expected) in
            [("NR-200", "0 … 130"), ("1,2", "seven levels"), ("1,2,3,4,5,6,300", "outside")]
        {
            assert!(text.parse::<NoiseLevels>().unwrap_err().to_string().contains(expected), "{text}");
        }
        assert!("quiet".parse::<SpeechPower>().unwrap_err().to_string().contains("raised"));
    }
}
