//! Criteria that a room shall meet: `t30=0.6s±20%@250-2000`, `t20<=0.8s@500,1000,2000`, or curves of standards.
//!
//! A criterion gives a parameter a range in some bands. The mean over the receivers meets it where its 95 % interval lies within the range, fails
//! where the interval lies outside, and is undecided else.
//!
//! - `din18041-a1` … `a4`: reverberation time of [DIN18041] group A by volume V [m³], 0.45 lg V + 0.07 (music), 0.37 lg V − 0.14 (speech),
//!   0.32 lg V − 0.17 (teaching), 0.26 lg V − 0.14 s (inclusive teaching), with the range of its figure 2 from 125 to 4000 Hz, occupied.
//! - `bb93-primary`, `bb93-secondary`: at most 0.6 and 0.8 s as the arithmetic mean of the octaves 500, 1000 and 2000 Hz, or of the third octaves
//!   400 … 2500 Hz \[BB93\].
//! - `ansi-s12.60`: at most 0.6 s up to 283 m³, 0.7 s up to 566 m³, in each of the octaves 500, 1000 and 2000 Hz [ANSIS12.60].
//!
//! References: docs/references.md.

use sonel_analysis::average::average;
use sonel_analysis::{Parameter, ParameterValue, Unsupported};

use crate::target;

/// A criterion.
#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    /// As it was written.
    pub name: String,
    /// Parameter that it is about.
    pub parameter: Parameter,
    range: Range,
}

#[derive(Debug, Clone, PartialEq)]
enum Range {
    /// Lowest and highest value, in bands from and to [Hz], or in these bands.
    Stated([f64; 2], Bands),
    /// Curve of DIN 18041: slope and offset over lg V [s].
    Din([f64; 2]),
    /// Curve of ANSI S12.60.
    Ansi,
    /// Highest mean over the middle frequencies of BB93.
    MiddleMean(f64),
}

#[derive(Debug, Clone, PartialEq)]
enum Bands {
    All,
    Between([f64; 2]),
    Listed(Vec<f64>),
}

/// What became of a criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The whole interval lies within the range.
    Pass,
    /// The whole interval lies outside.
    Fail,
    /// The interval reaches over an end of the range, or there is none.
    Undecided,
}

/// Words for curves of DIN 18041, with slope and offset [s].
const DIN: [(&str, [f64; 2]); 4] = [
    ("din18041-a1", [0.45, 0.07]),
    ("din18041-a2", [0.37, -0.14]),
    ("din18041-a3", [0.32, -0.17]),
    ("din18041-a4", [0.26, -0.14]),
];
/// Range of DIN 18041 about its reverberation time, per octave [Hz].
const DIN_RANGE: [(f64, [f64; 2]); 6] = [
    (125.0, [0.65, 1.45]),
    (250.0, [0.8, 1.2]),
    (500.0, [0.8, 1.2]),
    (1000.0, [0.8, 1.2]),
    (2000.0, [0.8, 1.2]),
    (4000.0, [0.65, 1.2]),
];
/// Volumes of DIN 18041 group A [m³].
const DIN_VOLUMES: std::ops::RangeInclusive<f64> = 30.0..=5000.0;
/// Words for limits of BB93 [s].
const BB93: [(&str, f64); 2] = [("bb93-primary", 0.6), ("bb93-secondary", 0.8)];
/// The word for ANSI S12.60, with its volumes [m³] and limits [s].
const ANSI: &str = "ansi-s12.60";
const ANSI_LIMITS: [(f64, f64); 2] = [(283.0, 0.6), (566.0, 0.7)];
/// Octaves of BB93 and ANSI S12.60 [Hz].
const SPEECH_OCTAVES: [f64; 3] = [500.0, 1000.0, 2000.0];
/// Third octaves of BB93 [Hz].
const MIDDLE_THIRDS: [f64; 9] = [400.0, 500.0, 630.0, 800.0, 1000.0, 1250.0, 1600.0, 2000.0, 2500.0];

impl Criterion {
    /// Reads a criterion.
    ///
    /// # Errors
    /// A sentence that says what is right.
    pub fn parse(text: &str) -> Result<Self, String> {
        let name = text.trim().to_owned();
        let word = name.to_lowercase();
        let of = |parameter, range| Ok(Self { name: name.clone(), parameter, range });
        if let Some((_, curve)) = DIN.iter().find(|(known, _)| *known == word) {
            return of(Parameter::T20, Range::Din(*curve));
        }
        if let Some((_, limit)) = BB93.iter().find(|(known, _)| *known == word) {
            return of(Parameter::T20, Range::MiddleMean(*limit));
        }
        if word == ANSI {
            return of(Parameter::T20, Range::Ansi);
        }
        let (parameter, range) = stated(&name).ok_or_else(|| {
            let words: Vec<&str> = DIN.iter().map(|it| it.0).chain(BB93.iter().map(|it| it.0)).chain([ANSI]).collect();
            format!(
                "\"{text}\" is not a criterion: write t30=0.6s±20%@250-2000, c50>=2dB, t20<=0.8s@500,1000 (+- for ±; parameters {}; units s, ms, dB, %), or one of {}",
                target::names(),
                words.join(", ")
            )
        })?;
        of(parameter, range)
    }

    /// Lowest and highest value in the octave or third `hz` of a room of `volume` [m³], in the unit of the parameter; none where it says nothing.
    #[must_use]
    pub fn range(&self, hz: f64, volume: Option<f64>) -> Option<[f64; 2]> {
        match &self.range {
            Range::Stated(range, bands) => {
                let is_meant = match bands {
                    Bands::All => true,
                    Bands::Between([low, high]) => (*low..=*high).contains(&hz),
                    Bands::Listed(listed) => listed.contains(&hz),
                };
                is_meant.then_some(*range)
            }
            Range::Din([slope, offset]) => {
                let volume = volume.filter(|volume| DIN_VOLUMES.contains(volume))?;
                let (_, range) = DIN_RANGE.iter().find(|(octave, _)| octave.total_cmp(&hz).is_eq())?;
                Some(range.map(|share| share * (slope * libm::log10(volume) + offset)))
            }
            Range::Ansi => {
                let (_, limit) =
                    ANSI_LIMITS.iter().find(|(most, _)| volume.is_some_and(|volume| volume <= *most))?;
                SPEECH_OCTAVES.contains(&hz).then_some([0.0, *limit])
            }
            Range::MiddleMean(limit) => {
                (SPEECH_OCTAVES.contains(&hz) || MIDDLE_THIRDS.contains(&hz)).then_some([0.0, *limit])
            }
        }
    }

    /// What is judged of a room of `volume` [m³] in a response of these `bands` [Hz]: each band with its range, or the mean over several.
    #[must_use]
    pub fn judged(&self, bands: &[f64], volume: Option<f64>) -> Vec<Judged> {
        if let Range::MiddleMean(limit) = self.range {
            // Nominal centres alone do not tell 500 Hz of octaves from that of thirds.
            let has_thirds =
                bands.iter().any(|hz| MIDDLE_THIRDS.contains(hz) && !SPEECH_OCTAVES.contains(hz));
            let of: &[f64] = if has_thirds { &MIDDLE_THIRDS } else { &SPEECH_OCTAVES };
            return vec![Judged { bands: of.to_vec(), range: [0.0, limit] }];
        }
        let judged = |hz: &f64| Some(Judged { bands: vec![*hz], range: self.range(*hz, volume)? });
        bands.iter().filter_map(judged).collect()
    }
}

/// A value that a criterion is about.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// The band [Hz], or the bands whose mean it is.
    pub bands: Vec<f64>,
    /// Lowest and highest value, in the unit of the parameter.
    pub range: [f64; 2],
}

impl Judged {
    /// The value, from the values of bands, of which there may be no such band.
    ///
    /// # Errors
    /// Why a band has none.
    pub fn value(&self, of: impl Fn(f64) -> Option<ParameterValue>) -> ParameterValue {
        let found: Vec<Option<ParameterValue>> = self.bands.iter().map(|hz| of(*hz)).collect();
        let missing: Vec<String> = self
            .bands
            .iter()
            .zip(&found)
            .filter(|(_, found)| found.is_none())
            .map(|(hz, _)| format!("{hz} Hz"))
            .collect();
        if !missing.is_empty() {
            let octaves = if self.bands.len() > SPEECH_OCTAVES.len() { "400 to 2500" } else { "500 to 2000" };
            return Err(Unsupported::OctavesMissing { octaves, missing: missing.join(", ") });
        }
        let found: Vec<ParameterValue> = found.into_iter().flatten().collect();
        match &found[..] {
            [one] => one.clone(),
            several => average(several),
        }
    }
}

/// `500`, or `mean 500 … 2000`.
impl std::fmt::Display for Judged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.bands[..] {
            [first, .., last] => write!(f, "mean {first} … {last}"),
            [one] => write!(f, "{one}"),
            [] => Ok(()),
        }
    }
}

/// What is decided of a value with its interval: that of the simulation and, where it is known, of the materials.
#[must_use]
pub fn verdict([low, high]: [f64; 2], value: &ParameterValue) -> Verdict {
    let Some([from, to]) = value.as_ref().ok().and_then(|estimate| estimate.whole_interval().ok()) else {
        return Verdict::Undecided;
    };
    match () {
        () if from >= low && to <= high => Verdict::Pass,
        () if to < low || from > high => Verdict::Fail,
        () => Verdict::Undecided,
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Undecided => "undecided",
        })
    }
}

fn stated(text: &str) -> Option<(Parameter, Range)> {
    let (condition, bands) = match text.split_once('@') {
        Some((condition, bands)) => (condition, self::bands(bands)?),
        None => (text, Bands::All),
    };
    for (sign, is_most) in [("<=", true), (">=", false)] {
        if let Some((name, value)) = condition.split_once(sign) {
            let parameter = target::parameter(name).ok()?;
            let value = number(value, parameter)?;
            let range = if is_most { [f64::NEG_INFINITY, value] } else { [value, f64::INFINITY] };
            return Some((parameter, Range::Stated(range, bands)));
        }
    }
    let (name, rest) = condition.split_once('=')?;
    let parameter = target::parameter(name).ok()?;
    let (value, tolerance) = rest.split_once('±').or_else(|| rest.split_once("+-"))?;
    let value = number(value, parameter)?;
    let tolerance = match tolerance.trim().strip_suffix('%').filter(|_| parameter != Parameter::DefinitionD50)
    {
        Some(share) => share.trim().parse::<f64>().ok()? / 100.0 * value.abs(),
        None => number(tolerance, parameter)?,
    };
    let range = [value - tolerance, value + tolerance];
    (tolerance >= 0.0).then_some((parameter, Range::Stated(range, bands)))
}

/// A number with its unit, in the unit of the parameter.
fn number(text: &str, parameter: Parameter) -> Option<f64> {
    let text = text.trim();
    let units: &[(&str, f64)] = match parameter {
        Parameter::EarlyDecayTime | Parameter::T20 | Parameter::T30 | Parameter::CenterTime => {
            &[("ms", 1e-3), ("s", 1.0)]
        }
        Parameter::DefinitionD50 => &[("%", 1e-2)],
        _ => &[("dB", 1.0)],
    };
    let (number, factor) =
        units.iter().find_map(|(unit, factor)| Some((text.strip_suffix(unit)?, *factor)))?;
    number.trim().parse::<f64>().ok().filter(|number| number.is_finite()).map(|number| number * factor)
}

fn bands(text: &str) -> Option<Bands> {
    let hz = |text: &str| text.trim().parse::<f64>().ok().filter(|hz| *hz > 0.0);
    match text.split_once('-') {
        Some((low, high)) => Some(Bands::Between([hz(low)?, hz(high)?])).filter(|_| hz(low) <= hz(high)),
        None => text.split(',').map(hz).collect::<Option<Vec<_>>>().map(Bands::Listed),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_analysis::Estimate;

    fn range(text: &str, hz: f64, volume: f64) -> Option<[f64; 2]> {
        Criterion::parse(text).expect("a criterion").range(hz, Some(volume))
    }

    fn near(found: Option<[f64; 2]>, expected: [f64; 2]) {
        let found = found.expect("a range");
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3), "{found:?}");
    }

    /// Tₛₒₗₗ of teaching in 187 m³: 0.32 · 2.272 − 0.17 = 0.557 s.
    #[test]
    fn curves_are_those_of_the_standards() {
        near(range("DIN18041-A3", 500.0, 187.0), [0.8 * 0.557, 1.2 * 0.557]);
        near(range("din18041-a3", 125.0, 187.0), [0.65 * 0.557, 1.45 * 0.557]);
        assert_eq!(range("din18041-a3", 8000.0, 187.0), None);
        assert_eq!(range("din18041-a3", 500.0, 9000.0), None);
        near(range("ansi-s12.60", 1000.0, 187.0), [0.0, 0.6]);
        near(range("ansi-s12.60", 1000.0, 300.0), [0.0, 0.7]);
        assert_eq!(range("ansi-s12.60", 1000.0, 600.0), None);
        near(range("bb93-secondary", 2000.0, 1.0), [0.0, 0.8]);
    }

    /// BB93 judges one mean, which may pass where a band alone is above the limit; ANSI S12.60 judges each octave.
    #[test]
    fn a_mean_over_bands_is_judged_once() {
        let bands: [f64; 5] = [250.0, 500.0, 1000.0, 2000.0, 4000.0];
        let times = [0.9, 0.66, 0.58, 0.5, 0.4];
        let of = |hz: f64| {
            let at = bands.iter().position(|band| band.total_cmp(&hz).is_eq())?;
            Some(Ok(Estimate::bare(times[at], Ok([times[at] - 0.01, times[at] + 0.01]))))
        };
        let judged = |word: &str, bands: &[f64]| Criterion::parse(word).unwrap().judged(bands, Some(200.0));
        let mean = &judged("bb93-primary", &bands)[..];
        assert_eq!(
            (mean.len(), mean[0].to_string(), mean[0].range),
            (1, "mean 500 … 2000".to_owned(), [0.0, 0.6])
        );
        assert!((mean[0].value(of).unwrap().value - 0.58).abs() < 1e-12);
        assert_eq!(
            judged("ansi-s12.60", &bands).iter().map(|one| one.bands[0]).collect::<Vec<_>>(),
            [500.0, 1000.0, 2000.0]
        );
        // Without an octave there is no mean, which is undecided and not left out.
        let missing = mean[0].value(|hz| of(hz).filter(|_| hz < 2000.0));
        assert!(missing.as_ref().unwrap_err().to_string().contains("missing: 2000 Hz"));
        assert_eq!(verdict(mean[0].range, &missing), Verdict::Undecided);
        assert_eq!(judged("bb93-primary", &[400.0, 500.0, 630.0])[0].bands.len(), 9);
    }

    #[test]
    fn criteria_have_units_tolerances_and_bands() {
        near(range("t30=0.6s±20%@250-2000", 250.0, 1.0), [0.48, 0.72]);
        near(range("ts=80ms+-10ms@500,1000", 1000.0, 1.0), [0.07, 0.09]);
        assert_eq!(range("t30=0.6s±20%@250-2000", 125.0, 1.0), None);
        assert_eq!(range("c50>=2dB", 63.0, 1.0), Some([2.0, f64::INFINITY]));
        near(range("d50=70%±5%", 63.0, 1.0), [0.65, 0.75]);
        for wrong in ["t30=0.6", "t30=0.6s", "rt60<=1s", "t30<=1dB", "t30<=1s@x", "din"] {
            assert!(Criterion::parse(wrong).unwrap_err().contains("din18041-a3"), "{wrong}");
        }
    }
}
