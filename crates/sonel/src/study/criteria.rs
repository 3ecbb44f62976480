//! Criteria that a room shall meet: `t30=0.6s±20%@250-2000`, `t20<=0.8s@500,1000,2000`, `sti>=0.6`, or curves of standards.
//!
//! A criterion gives a parameter a range in some bands, or a quantity of several bands (sti, la) one range. The mean over the receivers meets it if its
//! 95 % interval lies within the range, fails if the interval lies outside, and is undecided otherwise.
//!
//! Requirements of standards have names ([`sonel_scene::requirement`]); a file in the same form has others: `room.toml`, `rooms.toml:quiet`.
//!
//! References: docs/references.md.

use std::fmt::Display;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use sonel_analysis::average::average;
use sonel_analysis::single::Single;
use sonel_analysis::{Parameter, ParameterValue, ReceiverParameters, Unsupported, octave};
use sonel_echogram::Provenance;
use sonel_scene::requirement::{self, Requirement, Size, State};

use crate::ParseError;

pub use sonel_scene::requirement::DoesNotApply;

/// A criterion.
#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    /// As it was written.
    pub name: String,
    /// What it is about.
    pub quantity: Single,
    range: Range,
}

#[derive(Debug, Clone, PartialEq)]
enum Range {
    /// Lowest and highest value, in bands from and to [Hz], or in these bands.
    Stated([f64; 2], Bands),
    /// Requirement of a standard.
    Standard(Arc<Requirement>),
}

#[derive(Debug, Clone, PartialEq)]
enum Bands {
    Between([f64; 2]),
    Listed(Vec<f64>),
}

impl Bands {
    const ALL: Self = Self::Between([0.0, f64::INFINITY]);
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

impl FromStr for Criterion {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Self, ParseError> {
        let name = text.trim().to_owned();
        if let Some(requirement) = standard(&name)? {
            let quantity = Single::named(&requirement.parameter)
                .ok_or_else(|| ParseError(format!("{name}: no parameter \"{}\"", requirement.parameter)))?;
            return Ok(Self { name, quantity, range: Range::Standard(requirement) });
        }
        let (quantity, range) = stated(&name).ok_or_else(|| {
            let words: Vec<&str> = requirement::shipped().keys().map(String::as_str).collect();
            let singles = Parameter::EVERY.map(Single::Of).into_iter().chain(Single::OF_SEVERAL);
            let names: Vec<&str> = singles.map(Single::short_name).collect();
            ParseError(format!(
                "\"{text}\" is not a criterion: write t30=0.6s±20%@250-2000, c50>=2dB, t20<=0.8s@500,1000, sti>=0.6 or la<=35dB (+- for ±; of {}; units s, ms, dB, %, all but dB 0 or more; sti and la have no bands), or one of {}, or a file of requirements FILE.toml:NAME",
                names.join(", "),
                words.join(", ")
            ))
        })?;
        Ok(Self { name, quantity, range })
    }
}

/// The requirement of this name, of the shipped ones or in a file.
fn standard(name: &str) -> Result<Option<Arc<Requirement>>, ParseError> {
    let Some((stem, of)) = name.split_once(".toml") else {
        return Ok(requirement::shipped().get(&name.to_lowercase()).cloned().map(Arc::new));
    };
    let file = format!("{stem}.toml");
    let wrong = |error: &dyn Display| ParseError(format!("{file}: {error}"));
    let text = crate::file::read_to_string(Path::new(&file)).map_err(|error| wrong(&error))?;
    let found = requirement::read(&text).map_err(|error| wrong(&error))?;
    let only = found.values().next().filter(|_| of.is_empty() && found.len() == 1);
    if let Some(one) = only.or_else(|| found.get(of.trim_start_matches(':'))) {
        return Ok(Some(Arc::new(one.clone())));
    }
    let names = found.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
    Err(wrong(&format!("write {file}:NAME, NAME being one of {names}")))
}

/// What a requirement needs to know of the room of a response.
fn size(of: &Provenance) -> Size {
    Size { volume: of.volume_m3, height: of.height_m }
}

impl Criterion {
    /// The state of the room for which a standard holds, in a sentence; empty without one.
    #[must_use]
    pub fn state(&self) -> &'static str {
        match &self.range {
            Range::Stated(..) => "",
            Range::Standard(standard) if standard.state == State::Occupied => {
                "occupied room: people must be in the materials"
            }
            Range::Standard(_) => "finished, unoccupied room: no people in the materials",
        }
    }

    /// What the standard is for and where its numbers stand; empty without one.
    #[must_use]
    pub fn source(&self) -> String {
        match &self.range {
            Range::Stated(..) => String::new(),
            Range::Standard(standard) => format!("{} ({})", standard.title, standard.source),
        }
    }

    /// Lowest and highest value in the octave or third `hz` in the room of a response, in the unit of the parameter; none where it says nothing.
    #[must_use]
    pub fn range(&self, hz: f64, room: &Provenance) -> Option<[f64; 2]> {
        match &self.range {
            Range::Stated(range, bands) => {
                let is_meant = match bands {
                    Bands::Between([low, high]) => (*low..=*high).contains(&hz),
                    Bands::Listed(listed) => listed.contains(&hz),
                };
                is_meant.then_some(*range)
            }
            Range::Standard(standard) => standard.range(hz, size(room)),
        }
    }

    /// What is judged of the room of a response of these `bands` [Hz]: each band with its range, or the mean over several.
    ///
    /// # Errors
    /// Why the criterion does not apply.
    pub fn judged(&self, bands: &[f64], room: &Provenance) -> Result<Vec<Judged>, DoesNotApply> {
        match &self.range {
            Range::Stated(range, _) if !matches!(self.quantity, Single::Of(_)) => {
                return Ok(vec![Judged { bands: Vec::new(), range: *range }]);
            }
            Range::Stated(..) => {}
            Range::Standard(standard) => {
                let limit = standard.value(size(room))?;
                // Nominal centres alone do not tell 500 Hz of octaves from that of thirds.
                let has = |set: &&Vec<f64>| set.iter().filter(|hz| bands.contains(hz)).count();
                if let Some(of) = standard.means.iter().max_by_key(has) {
                    return Ok(vec![Judged { bands: of.clone(), range: [0.0, limit] }]);
                }
            }
        }
        let judged = |hz: &f64| Some(Judged { bands: vec![*hz], range: self.range(*hz, room)? });
        let judged: Vec<Judged> = bands.iter().filter_map(judged).collect();
        if judged.is_empty() {
            Err(DoesNotApply("the response has none of its bands".to_owned()))
        } else {
            Ok(judged)
        }
    }

    /// What is judged, at a receiver.
    ///
    /// # Errors
    /// Why it has no value.
    pub fn value(&self, judged: &Judged, receiver: &ReceiverParameters) -> ParameterValue {
        match self.quantity {
            Single::Of(parameter) => judged.value(|hz| receiver.in_band(hz, parameter)),
            several => several.value(receiver),
        }
    }
}

/// A value that a criterion is about.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// The band [Hz], the bands whose mean it is, or none if the quantity has no bands.
    pub bands: Vec<f64>,
    /// Lowest and highest value, in the unit of the parameter.
    pub range: [f64; 2],
}

impl Judged {
    /// The value, from the values of bands, of which there may be no such band.
    ///
    /// # Errors
    /// Why a band has none.
    fn value(&self, of: impl Fn(f64) -> Option<ParameterValue>) -> ParameterValue {
        if let Some(missing) = octave::missing(&self.bands, |hz| of(hz).is_some()) {
            let octaves = if self.bands.len() > 3 { "400 to 2500" } else { "500 to 2000" };
            return Err(Unsupported::OctavesMissing { octaves, missing });
        }
        let found: Vec<ParameterValue> = self.bands.iter().filter_map(|hz| of(*hz)).collect();
        match &found[..] {
            [one] => one.clone(),
            several => average(several),
        }
    }
}

/// `500 Hz`, `mean 500 … 2000 Hz`, or nothing.
impl std::fmt::Display for Judged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.bands[..] {
            [first, .., last] => write!(f, "mean {first} … {last} Hz"),
            [one] => write!(f, "{one} Hz"),
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

fn stated(text: &str) -> Option<(Single, Range)> {
    let (condition, bands) = match text.split_once('@') {
        Some((condition, bands)) => (condition, self::bands(bands)?),
        None => (text, Bands::ALL),
    };
    let named = |name: &str| {
        Single::named(name.trim()).filter(|single| bands == Bands::ALL || matches!(single, Single::Of(_)))
    };
    for (sign, is_most) in [("<=", true), (">=", false)] {
        if let Some((name, value)) = condition.split_once(sign) {
            let quantity = named(name)?;
            let value = number(value, quantity)?;
            let range = if is_most { [f64::NEG_INFINITY, value] } else { [value, f64::INFINITY] };
            return Some((quantity, Range::Stated(range, bands)));
        }
    }
    let (name, rest) = condition.split_once('=')?;
    let quantity = named(name)?;
    let (value, tolerance) = rest.split_once('±').or_else(|| rest.split_once("+-"))?;
    let value = number(value, quantity)?;
    let tolerance = match tolerance.trim().strip_suffix('%').filter(|_| quantity.heading().1 != "%") {
        Some(share) => share.trim().parse::<f64>().ok()? / 100.0 * value.abs(),
        None => number(tolerance, quantity)?,
    };
    let range = [value - tolerance, value + tolerance];
    (tolerance >= 0.0).then_some((quantity, Range::Stated(range, bands)))
}

/// A number with its unit, in the unit of the quantity.
fn number(text: &str, quantity: Single) -> Option<f64> {
    let text = text.trim();
    let (units, least): (&[(&str, f64)], f64) = match quantity.heading().1 {
        "s" | "ms" => (&[("ms", 1e-3), ("s", 1.0)], 0.0),
        "%" => (&[("%", 1e-2)], 0.0),
        "" => (&[("", 1.0)], 0.0),
        _ => (&[("dB(A)", 1.0), ("dB", 1.0)], f64::NEG_INFINITY),
    };
    let (number, factor) =
        units.iter().find_map(|(unit, factor)| Some((text.strip_suffix(unit)?, *factor)))?;
    number
        .trim()
        .parse::<f64>()
        .ok()
        .filter(|number| number.is_finite() && *number >= least)
        .map(|number| number * factor)
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

    fn room(volume: f64) -> Provenance {
        Provenance { volume_m3: Some(volume), ..Provenance::default() }
    }

    fn range(text: &str, hz: f64, volume: f64) -> Option<[f64; 2]> {
        text.parse::<Criterion>().expect("a criterion").range(hz, &room(volume))
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
        assert_eq!(range("din18041-a4", 500.0, 600.0), None);
        near(range("din18041-a5", 500.0, 3000.0), [0.8 * 1.608, 1.2 * 1.608]);
        assert_eq!(range("din18041-a5", 125.0, 3000.0), None);
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
        let judged = |word: &str, bands: &[f64]| {
            word.parse::<Criterion>().unwrap().judged(bands, &room(200.0)).unwrap()
        };
        let mean = &judged("bb93-primary", &bands)[..];
        assert_eq!(
            (mean.len(), mean[0].to_string(), mean[0].range),
            (1, "mean 500 … 2000 Hz".to_owned(), [0.0, 0.6])
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
    fn what_does_not_apply_says_why() {
        let reason = |word: &str, room: &Provenance| {
            word.parse::<Criterion>().unwrap().judged(&[500.0], room).unwrap_err().to_string()
        };
        assert_eq!(reason("ansi-s12.60", &room(600.4)), "volume 600 m³ outside 0 … 566 m³");
        assert_eq!(reason("din18041-b3", &room(600.0)), "the response states no height");
        assert_eq!(reason("t30<=1s@63", &room(600.0)), "the response has none of its bands");
    }

    #[test]
    fn own_requirements_stand_in_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("own.toml").display().to_string();
        let of = |name: &str| {
            format!(
                "[{name}]\ntitle = \"club\"\nsource = \"owner\"\nstate = \"occupied\"\nparameter = \"c50\"\nrooms = [{{ volume = [0, 900], offset = 2 }}]\nbands = [[500, 1, 2]]\n"
            )
        };
        std::fs::write(&path, of("club")).unwrap();
        let club: Criterion = path.parse().unwrap();
        assert_eq!(
            (club.range(500.0, &room(90.0)), club.source()),
            (Some([2.0, 4.0]), "club (owner)".to_owned())
        );
        std::fs::write(&path, of("club") + &of("bar")).unwrap();
        assert!(format!("{path}:bar").parse::<Criterion>().is_ok());
        for (text, message) in
            [(path.clone(), "one of bar, club"), (path.replace("own", "no"), "No such file")]
        {
            assert!(text.parse::<Criterion>().unwrap_err().0.contains(message), "{text}");
        }
    }

    #[test]
    fn criteria_have_units_tolerances_and_bands() {
        near(range("t30=0.6s±20%@250-2000", 250.0, 1.0), [0.48, 0.72]);
        near(range("ts=80ms+-10ms@500,1000", 1000.0, 1.0), [0.07, 0.09]);
        assert_eq!(range("t30=0.6s±20%@250-2000", 125.0, 1.0), None);
        assert_eq!(range("c50>=2dB", 63.0, 1.0), Some([2.0, f64::INFINITY]));
        assert_eq!(range("c50>=-2dB", 63.0, 1.0), Some([-2.0, f64::INFINITY]));
        near(range("d50=70%±5%", 63.0, 1.0), [0.65, 0.75]);
        near(range("lf>=15%", 63.0, 1.0).map(|[low, _]| [low, 1.0]), [0.15, 1.0]);
        for (text, quantity, wanted) in
            [("sti>=0.6", Single::Speech, 0.6), ("LA>=35dB(A)", Single::AWeighted, 35.0)]
        {
            let criterion = text.parse::<Criterion>().unwrap();
            assert_eq!(criterion.quantity, quantity);
            let judged = criterion.judged(&[], &Provenance::default()).unwrap();
            assert_eq!(
                (judged.len(), judged[0].range, judged[0].to_string()),
                (1, [wanted, f64::INFINITY], String::new())
            );
        }
        assert!(Parameter::EVERY.iter().all(|parameter| {
            format!("{}>=1{}", parameter.short_name(), parameter.heading().1).parse::<Criterion>().is_ok()
        }));
        for wrong in [
            "t30=0.6",
            "t30=0.6s",
            "rt60<=1s",
            "t30<=1dB",
            "t30<=1s@x",
            "din",
            "sti>=0.6@500",
            "sti>=60%",
            "t30<=-1s",
            "d50=-5%±1%",
            "sti>=-0.1",
            "c80>=infdB",
        ] {
            assert!(wrong.parse::<Criterion>().unwrap_err().0.contains("din18041-a3"), "{wrong}");
        }
    }
}
