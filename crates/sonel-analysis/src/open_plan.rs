//! Open-plan offices: decay of speech along a line of workstations (ISO 3382-3).
//!
//! L_p,A,S is the A-weighted level of speech at a workstation. Over lg r, r the distance from the source, its regression line between 2 m and 16 m
//! falls by D_2,S per doubling of r, has L_p,A,S,4m at 4 m and 45 dB at the comfort distance r_C. The speech transmission index, with background noise, is regressed over r: it
//! falls to 0.50 at the distraction distance r_D and to 0.20 at the privacy distance r_P. Intervals are those of the simulation: lines of
//! the same places without each batch in turn.
//!
//! References: [ISO3382-3], [IEC60268-16], A-weighting of [IEC61672-1] (docs/references.md).

use sonel_echogram::Response;

use crate::derived::derived;
use crate::estimate::{ParameterValue, Unsupported};
use crate::modulation::{SPEECH_OCTAVES, Talk};
use crate::parameter::Parameter;
use crate::receiver::{ReceiverParameters, parameters_at};

/// Power levels of speech at normal effort in [`SPEECH_OCTAVES`] [dB re 1 pW], 68.4 dB(A) in all.
pub const SPEECH_POWER_LEVEL_DB: [f64; 7] = [60.9, 65.3, 69.0, 63.0, 55.8, 49.8, 44.5];
/// A-weighting of the same octaves [dB].
const A_WEIGHTING_DB: [f64; 7] = [-16.1, -8.6, -3.2, 0.0, 1.2, 1.0, -1.1];
/// Distances of the regression of levels (ISO 3382-3) [m].
const NEAREST: f64 = 2.0;
const FARTHEST: f64 = 16.0;
/// L_p,A,S at the comfort distance (ISO 3382-3:2022) [dB].
const COMFORT: f64 = 45.0;
/// Fewest places of a regression: a line has two numbers.
const FEWEST: usize = 2;
/// Speech transmission indices at the distraction and the privacy distance (ISO 3382-3).
const DISTRACTION: f64 = 0.50;
const PRIVACY: f64 = 0.20;

/// A line of workstations.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// By distance.
    pub places: Vec<Workstation>,
    /// D_2,S [dB].
    pub decay_rate_db: ParameterValue,
    /// L_p,A,S,4m [dB].
    pub level_at_4_m_db: ParameterValue,
    /// r_C [m].
    pub comfort_distance: ParameterValue,
    /// r_D [m].
    pub distraction_distance: ParameterValue,
    /// r_P [m].
    pub privacy_distance: ParameterValue,
}

impl Line {
    /// Its numbers with their symbols, units and keys.
    pub fn numbers(&self) -> [(&'static str, &'static str, &ParameterValue); 5] {
        [
            ("D2,S [dB]", "decay_rate_d2s_db", &self.decay_rate_db),
            ("Lp,A,S,4m [dB]", "speech_level_at_4_m_db", &self.level_at_4_m_db),
            ("rC [m]", "comfort_distance_m", &self.comfort_distance),
            ("rD [m]", "distraction_distance_m", &self.distraction_distance),
            ("rP [m]", "privacy_distance_m", &self.privacy_distance),
        ]
    }

    /// Levels of sound propagation of [VDI2569], 1 (best) … 3 or none, that lie within the intervals.
    #[must_use]
    pub fn propagation(&self) -> Option<String> {
        let ends = |value: &ParameterValue| value.as_ref().ok()?.interval.clone().ok();
        let ([slow, fast], [quiet, loud]) = (ends(&self.decay_rate_db)?, ends(&self.level_at_4_m_db)?);
        let level = |rate: f64, at_4_m: f64| {
            let is_met = |(least, most): &(f64, f64)| rate >= *least && at_4_m <= *most;
            PROPAGATION.iter().position(is_met).map_or("none".to_owned(), |index| (index + 1).to_string())
        };
        let (best, worst) = (level(fast, quiet), level(slow, loud));
        let levels = if best == worst { best } else { format!("{best} or {worst}") };
        Some(format!("level of sound propagation (VDI 2569): {levels}"))
    }
}

/// Least decay rate and highest level at 4 m of each level of sound propagation [dB] [VDI2569].
const PROPAGATION: [(f64, f64); 3] = [(8.0, 47.0), (6.0, 49.0), (4.0, 51.0)];

/// A workstation.
#[derive(Debug, Clone, PartialEq)]
pub struct Workstation {
    /// Name of the receiver.
    pub name: String,
    /// From the source [m].
    pub distance: f64,
    /// L_p,A,S [dB].
    pub speech_level_db: ParameterValue,
    /// With noise, 0 … 1.
    pub speech_transmission_index: ParameterValue,
}

/// The line of `receivers` from source `s`, with `talk`.
#[must_use]
pub fn line(response: &Response, s: usize, receivers: &[usize], talk: &Talk) -> Line {
    let bands = response.bands();
    let power = &response.source_power_level_db[s * bands..(s + 1) * bands];
    let more = talk.more_than(&response.center_frequency_hz, power, &[]);
    let pairs: Vec<(usize, usize)> = receivers.iter().map(|r| (s, *r)).collect();
    let parameters = parameters_at(response, Some(talk), &Parameter::ALL, &pairs);
    let mut places: Vec<Workstation> = parameters.iter().map(|receiver| place(receiver, more)).collect();
    places.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    let (of_levels, levels): (Vec<f64>, Vec<&ParameterValue>) = places
        .iter()
        .filter(|place| (NEAREST..=FARTHEST).contains(&place.distance))
        .map(|place| (libm::log10(place.distance), &place.speech_level_db))
        .unzip();
    let (of_indices, indices): (Vec<f64>, Vec<&ParameterValue>) =
        places.iter().map(|place| (place.distance, &place.speech_transmission_index)).unzip();
    let level = |read: fn([f64; 2]) -> f64| {
        enough(&of_levels)?;
        derived(|levels| read(regression(&of_levels, levels)), levels.iter().copied())
    };
    let index =
        |symbol, value| reached(symbol, "the speech transmission index", value, &of_indices, &indices, |r| r);
    Line {
        decay_rate_db: level(|[_, slope]| -slope * libm::log10(2.0)),
        level_at_4_m_db: level(|[at_one, slope]| at_one + slope * libm::log10(4.0)),
        comfort_distance: reached("rC", "the levels", COMFORT, &of_levels, &levels, |lg| libm::pow(10.0, lg)),
        distraction_distance: index("rD", DISTRACTION),
        privacy_distance: index("rP", PRIVACY),
        places,
    }
}

/// Distance `symbol` [m] at which the line of `of_what` over `x` falls to `value`, where `distance` is that of an x.
fn reached(
    symbol: &str,
    of_what: &'static str,
    value: f64,
    x: &[f64],
    y: &[&ParameterValue],
    distance: fn(f64) -> f64,
) -> ParameterValue {
    enough(x)?;
    let at = |[at_zero, slope]: [f64; 2]| distance((value - at_zero) / slope);
    let slope = derived(|y| regression(x, y)[1], y.iter().copied())?;
    let found = derived(|y| at(regression(x, y)), y.iter().copied())?;
    if slope.value >= 0.0 || found.value <= 0.0 {
        return Err(Unsupported::NotFalling { of_what, value });
    }
    let [nearest, farthest] = [x[0], x[x.len() - 1]].map(distance);
    let end = (found.value > farthest).then_some(("ends", farthest));
    let begin = (found.value < nearest).then_some(("begins", nearest));
    let beyond =
        end.or(begin).map(|(ends, at)| format!("{symbol} is extrapolated: the line {ends} at {at:.1} m"));
    Ok(found.warned(beyond))
}

fn place(parameters: &ReceiverParameters, more: [f64; 7]) -> Workstation {
    let squares = parameters.source_position.iter().zip(parameters.position).map(|(a, b)| (a - b) * (a - b));
    Workstation {
        name: parameters.name.clone(),
        distance: squares.sum::<f64>().sqrt(),
        speech_level_db: a_weighted(parameters, more),
        speech_transmission_index: parameters.speech_transmission_index.clone(),
    }
}

/// A-weighted level of what is louder than the source by `more` [dB].
fn a_weighted(parameters: &ReceiverParameters, more: [f64; 7]) -> ParameterValue {
    // Where octaves of speech are missing, so is the index, with the reason.
    parameters.speech_transmission_index.as_ref().map_err(Clone::clone)?;
    let octaves = SPEECH_OCTAVES.iter().filter_map(|octave| parameters.band(*octave));
    let sum = |levels: &[f64]| {
        let weighted = levels.iter().zip(more).zip(A_WEIGHTING_DB).map(|((level, more), a)| level + more + a);
        10.0 * libm::log10(weighted.map(|level| libm::pow(10.0, 0.1 * level)).sum())
    };
    derived(sum, octaves.map(|band| band.parameter(Parameter::Level)))
}

fn enough(places: &[f64]) -> Result<(), Unsupported> {
    let distinct = places.first().zip(places.last()).is_some_and(|(first, last)| last > first);
    if places.len() < FEWEST || !distinct {
        return Err(Unsupported::TooFewPlaces { found: places.len() });
    }
    Ok(())
}

/// Value at 0 and slope of the least squares line.
fn regression(x: &[f64], y: &[f64]) -> [f64; 2] {
    let count = x.len() as f64;
    let [mean_x, mean_y] = [x, y].map(|values| values.iter().sum::<f64>() / count);
    let products = x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y));
    let squares = x.iter().map(|x| (x - mean_x) * (x - mean_x));
    let slope = products.sum::<f64>() / squares.sum::<f64>();
    [mean_y - slope * mean_x, slope]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_echogram::Arrivals;
    use sonel_testkit::exponential::ExponentialDecay;

    const NOISE: [f64; 7] = [42.0, 38.0, 35.0, 32.0, 28.0, 24.0, 20.0];

    /// Exponential decays of 0.6 s with a fluence of 0.05 r^−1.6 in every octave, of a source of 90 dB each.
    fn response(distances: &[f64]) -> Response {
        let edges: Vec<f64> = (0..=1200).map(|edge| f64::from(edge) * 0.001).collect();
        let echogram = |distance: &f64| {
            let decay =
                ExponentialDecay { reverberation_time: 0.6, energy: 0.05 * libm::pow(*distance, -1.6) };
            let since = |edge: f64| (edge - distance / 343.0).max(0.0);
            edges
                .windows(2)
                .map(|pair| decay.energy_between(since(pair[0]), since(pair[1])))
                .collect::<Vec<_>>()
        };
        Response {
            center_frequency_hz: SPEECH_OCTAVES.to_vec(),
            energy: distances.iter().flat_map(|distance| echogram(distance).repeat(7)).collect(),
            time_edges_s: edges.clone(),
            receiver_names: distances.iter().map(ToString::to_string).collect(),
            receiver_positions: distances.iter().map(|distance| [*distance, 0.0, 0.0]).collect(),
            receiver_directivities: Vec::new(),
            source_names: vec!["talker".into()],
            source_positions: vec![[0.0; 3]],
            source_power_level_db: vec![90.0; 7],
            speed_of_sound: 343.0,
            characteristic_impedance: 412.0,
            direct_times_s: Vec::new(),
            batches: None,
            missing: None,
            arrivals: Arrivals::default(),
            directions: None,
            provenance: Default::default(),
        }
    }

    fn talk() -> Talk {
        Talk { power_level_db: Some(SPEECH_POWER_LEVEL_DB), noise_level_db: NOISE }
    }

    /// Values of a calculation apart from this code: closed forms of the decay, IEC 60268-16 and least squares written in Python.
    #[test]
    fn a_line_has_the_figures_of_an_independent_calculation() {
        let response = response(&[20.0, 2.0, 4.0, 6.5, 8.0, 12.0]);
        let line = line(&response, 0, &[0, 1, 2, 3, 4, 5], &talk());
        let near = |estimate: &ParameterValue, expected: f64| {
            let found = estimate.as_ref().expect("a figure").value;
            assert!((found - expected).abs() < 1e-6 * expected, "{found} instead of {expected}");
        };
        assert_eq!(line.places[5].name, "20");
        near(&line.places[0].speech_level_db, 50.714_174_570_8);
        near(&line.places[0].speech_transmission_index, 0.606_581_443_7);
        near(&line.places[5].speech_transmission_index, 0.256_365_721_7);
        // lg 2 · 16 dB a decade, of places up to 16 m.
        near(&line.decay_rate_db, 4.816_479_930_6);
        near(&line.level_at_4_m_db, 45.897_694_640_2);
        // 4 m · 10^((L − 45 dB) / 16 dB).
        near(&line.comfort_distance, 4.551_619_049_2);
        near(&line.distraction_distance, 5.536_728_299_6);
        near(&line.privacy_distance, 21.682_528_259_9);
        let warning = line.privacy_distance.expect("a distance").warning.expect("beyond the line");
        assert!(warning == "rP is extrapolated: the line ends at 20.0 m", "{warning}");
    }

    #[test]
    fn distances_before_the_first_workstation_are_warned_of() {
        let response = response(&[8.0, 12.0, 20.0]);
        let found = line(&response, 0, &[0, 1, 2], &talk()).distraction_distance.expect("a distance");
        assert!(found.value < 8.0, "{}", found.value);
        assert_eq!(found.warning.as_deref(), Some("rD is extrapolated: the line begins at 8.0 m"));
    }

    #[test]
    fn noise_matters() {
        let quiet = Talk { noise_level_db: [0.0; 7], ..talk() };
        let response = response(&[2.0, 4.0, 8.0]);
        let [loud, quiet] = [talk(), quiet].map(|talk| {
            line(&response, 0, &[0, 1, 2], &talk).places[2]
                .speech_transmission_index
                .clone()
                .expect("octaves")
                .value
        });
        assert!(quiet > loud + 0.05, "{quiet} {loud}");
    }

    #[test]
    fn lines_that_are_none_have_reasons() {
        let response = response(&[3.0, 3.0, 30.0]);
        let of = |places: &[usize]| line(&response, 0, places, &talk());
        assert_eq!(of(&[0, 1]).decay_rate_db, Err(Unsupported::TooFewPlaces { found: 2 }));
        assert_eq!(of(&[0, 2]).decay_rate_db, Err(Unsupported::TooFewPlaces { found: 1 }));
        assert!(of(&[0, 2]).distraction_distance.is_ok());
        let deaf = Talk { noise_level_db: [120.0; 7], ..talk() };
        let line = line(&response, 0, &[0, 2], &deaf);
        let of_what = "the speech transmission index";
        assert_eq!(line.distraction_distance, Err(Unsupported::NotFalling { of_what, value: 0.5 }));
    }

    /// Classes are those that lie within both intervals.
    #[test]
    fn levels_of_propagation_are_those_of_the_intervals() {
        let value =
            |value: f64, half: f64| Ok(crate::Estimate::bare(value, Ok([value - half, value + half])));
        let line = |rate: f64, at_4_m: f64, half: f64| Line {
            places: Vec::new(),
            decay_rate_db: value(rate, half),
            level_at_4_m_db: value(at_4_m, half),
            comfort_distance: value(5.0, half),
            distraction_distance: value(5.0, half),
            privacy_distance: value(5.0, half),
        };
        for (rate, at_4_m, half, levels) in [
            (8.2, 46.5, 0.1, "1"),
            (8.2, 46.5, 0.6, "1 or 2"),
            (8.2, 48.0, 0.1, "2"),
            (4.5, 46.5, 0.1, "3"),
            (4.1, 46.5, 0.2, "3 or none"),
            (2.8, 52.5, 0.2, "none"),
        ] {
            let found = line(rate, at_4_m, half).propagation().unwrap();
            assert!(found.ends_with(&format!(": {levels}")), "{found}");
        }
    }
}
