//! Room-acoustic parameters of a response, every one with its interval or a reason.
//!
//! The value is read from the fine echogram. Its interval is that of a delete-one jackknife over the batches, in their coarse bins
//! (docs/physics.md §7). Receivers of one map share sonels, so their errors are correlated; so are those of the bands.

use sonel_echogram::Response;

use crate::decay::{DecayCurve, NoDecay, Tail, TailRefusal};
use crate::figure::{Estimate, Figure, Interval, Line};
use crate::leave_one_out::{BatchSet, LeaveOneOut};
use crate::parameter::{LevelReference, Parameter, check_completeness};
use crate::speech::{OCTAVES_HZ, speech_transmission_index};

/// Half-width of an interval beyond which a speech transmission index means nothing: two of five classes of quality.
const WIDEST_SPEECH_INTERVAL: f64 = 0.15;

/// Parameters of all pairs of a source and a receiver, sources first.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Nominal band centres, ascending (Hz).
    pub center_frequency_hz: Vec<f64>,
    /// Number of batches behind the intervals.
    pub batches: usize,
    /// The pairs.
    pub pairs: Vec<Pair>,
}

/// Parameters of one source at one receiver.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Name of the source.
    pub source: String,
    /// Name of the receiver.
    pub receiver: String,
    /// Where the receiver stands [m].
    pub position: [f64; 3],
    /// Distance over speed of sound [s].
    pub direct_time: f64,
    /// Speech transmission index, 0…1.
    pub speech_transmission_index: Figure,
    /// One entry per band.
    pub bands: Vec<Band>,
}

/// Parameters of one band.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Nominal centre (Hz).
    pub center_frequency_hz: f64,
    /// What lies beyond the record, or why that is unknown; none without a decay curve.
    pub tail: Option<Result<Tail, TailRefusal>>,
    /// Level of the decay curve at the end of what can be believed, below its start (dB).
    pub decay_depth_db: Option<f64>,
    figures: [Figure; Parameter::ALL.len()],
}

impl Band {
    /// A figure.
    #[must_use]
    pub fn figure(&self, parameter: Parameter) -> &Figure {
        &self.figures[parameter as usize]
    }

    /// All figures, in the order of [`Parameter::ALL`].
    pub fn figures(&self) -> impl Iterator<Item = (Parameter, &Figure)> {
        Parameter::ALL.into_iter().zip(&self.figures)
    }
}

impl Report {
    /// Reads the parameters off `response`.
    #[must_use]
    pub fn new(response: &Response) -> Self {
        let batches = BatchSet::of(response);
        let pairs = (0..response.sources())
            .flat_map(|s| (0..response.receivers()).map(move |r| (s, r)))
            .map(|(s, r)| pair(response, &batches, [s, r]))
            .collect();
        Self {
            center_frequency_hz: response.center_frequency_hz.clone(),
            batches: batches.map_or(0, |batches| batches.weights.count()),
            pairs,
        }
    }
}

/// A band's curve and the curves behind its intervals.
struct Curves {
    fine: DecayCurve,
    batches: Result<LeaveOneOut, String>,
}

fn pair(response: &Response, batches: &Result<BatchSet, String>, [s, r]: [usize; 2]) -> Pair {
    let direct_time = response.direct_time(s, r);
    let curves: Vec<Result<Curves, NoDecay>> = (0..response.bands())
        .map(|b| {
            let fine = DecayCurve::new(&response.time_edges_s, response.echogram(s, r, b), direct_time)?;
            let batches = batches.as_ref().map_err(String::clone);
            let batches = batches.and_then(|set| set.curves(response, [s, r, b], fine.recorded_energy()));
            Ok(Curves { fine, batches })
        })
        .collect();
    let weights = Quality { batches: batches.as_ref().ok() };
    let bands = curves
        .iter()
        .enumerate()
        .map(|(b, curves)| {
            let reference = LevelReference {
                source_power_level_db: response.source_power_level_db[s * response.bands() + b],
                characteristic_impedance: response.characteristic_impedance,
            };
            weights.band(response.center_frequency_hz[b], curves, reference)
        })
        .collect();
    Pair {
        source: response.source_names[s].clone(),
        receiver: response.receiver_names[r].clone(),
        position: response.receiver_positions[r],
        direct_time,
        speech_transmission_index: weights.speech(&response.center_frequency_hz, &curves),
        bands,
    }
}

/// Turns values into figures with intervals.
struct Quality<'a> {
    batches: Option<&'a BatchSet>,
}

impl Quality<'_> {
    fn band(&self, center: f64, curves: &Result<Curves, NoDecay>, reference: LevelReference) -> Band {
        let figures = Parameter::ALL.map(|parameter| match curves {
            Ok(curves) => self.parameter(parameter, curves, reference),
            Err(reason) => Figure::unsupported(reason),
        });
        let fine = curves.as_ref().ok().map(|curves| &curves.fine);
        let tail = fine.map(DecayCurve::tail);
        let decay_depth_db = fine.map(DecayCurve::depth_db);
        let mut band = Band { center_frequency_hz: center, tail, decay_depth_db, figures };
        add_curvature(&mut band);
        band
    }

    fn parameter(&self, parameter: Parameter, curves: &Curves, reference: LevelReference) -> Figure {
        let evaluated = parameter.line(&curves.fine).and_then(|fit| {
            let line = fit.map(|fit| Line { fit, curvature_percent: None });
            Ok((parameter.evaluate(&curves.fine, reference)?, line))
        });
        let (value, line) = match evaluated {
            Ok(found) => found,
            Err(reason) => return Figure::unsupported(reason),
        };
        let limits = parameter.limits();
        let widest = parameter.widest_interval(value);
        let interval =
            self.interval(value, limits, curves.batches.as_ref().map_err(String::clone), |curves| {
                let all = parameter.evaluate(&curves.all, reference).map_err(|reason| reason.to_string())?;
                let without = curves.without.iter().map(|curve| {
                    parameter
                        .evaluate(curve, reference)
                        .map(|value| all - value)
                        .map_err(|reason| reason.to_string())
                });
                without.collect()
            });
        judge(value, interval, widest, line)
    }

    fn speech(&self, centers: &[f64], curves: &[Result<Curves, NoDecay>]) -> Figure {
        let mut octaves = Vec::with_capacity(OCTAVES_HZ.len());
        for octave in OCTAVES_HZ {
            let Some(band) = centers.iter().position(|center| center.total_cmp(&octave).is_eq()) else {
                return Figure::unsupported(format!("the octave band {octave} Hz is missing"));
            };
            match &curves[band] {
                Ok(curves) => match check_completeness(&curves.fine) {
                    Ok(()) => octaves.push(curves),
                    Err(reason) => return Figure::unsupported(format!("at {octave} Hz, {reason}")),
                },
                Err(reason) => return Figure::unsupported(format!("at {octave} Hz, {reason}")),
            }
        }
        let value = speech_transmission_index(std::array::from_fn(|octave| &octaves[octave].fine));
        let batches: Result<Vec<&LeaveOneOut>, String> =
            octaves.iter().map(|curves| curves.batches.as_ref().map_err(String::clone)).collect();
        let interval = self.interval(value, (0.0, 1.0), batches, |octaves| {
            let index = |of: &dyn Fn(&LeaveOneOut) -> &DecayCurve| {
                speech_transmission_index(std::array::from_fn(|octave| of(octaves[octave])))
            };
            let all = index(&|octave| &octave.all);
            let count = octaves[0].without.len();
            Ok((0..count).map(|g| all - index(&|octave| &octave.without[g])).collect())
        });
        judge(value, interval, WIDEST_SPEECH_INTERVAL, None)
    }

    /// The interval about `value` from the deviations that `deviate` finds in `curves`.
    fn interval<C>(
        &self,
        value: f64,
        limits: (f64, f64),
        curves: Result<C, String>,
        deviate: impl FnOnce(C) -> Result<Vec<f64>, String>,
    ) -> Result<Interval, String> {
        let (curves, set) = match (curves, self.batches) {
            (Ok(curves), Some(set)) => (curves, set),
            (Err(reason), _) => return Ok(Interval::Unknown { reason }),
            (Ok(_), None) => return Ok(Interval::Unknown { reason: "there are no batches".to_owned() }),
        };
        let deviations =
            deviate(curves).map_err(|reason| format!("single batches do not support it: {reason}"))?;
        let spread = set.weights.spread(&deviations);
        let low = (value - spread.half_width).max(limits.0);
        let high = (value + spread.half_width).min(limits.1);
        Ok(Interval::Known { low, high, spread })
    }
}

/// A figure from its value and interval, unless the interval is too wide or a number is not finite.
fn judge(value: f64, interval: Result<Interval, String>, widest: f64, line: Option<Line>) -> Figure {
    let interval = match interval {
        Ok(interval) => interval,
        Err(reason) => return Figure::Unsupported { reason },
    };
    let mut warning = None;
    if let Interval::Known { spread, .. } = &interval {
        if spread.half_width > widest {
            let half_width = spread.half_width;
            return Figure::unsupported(format!(
                "the 95 % interval is too wide: {value:.3} ± {half_width:.3}; trace more sonels"
            ));
        }
        if !spread.half_width.is_finite() {
            return Figure::unsupported("its interval is not finite");
        }
        warning = spread.heavy_tailed.then(|| {
            "one batch departs from the others by more than chance: the interval may be too short; trace more sonels"
                .to_owned()
        });
    }
    if !value.is_finite() {
        return Figure::unsupported("it is not finite");
    }
    Figure::Supported(Estimate { value, interval, warning, line })
}

/// ISO 3382-2 annex B: 100 (T30/T20 − 1).
fn add_curvature(band: &mut Band) {
    let (t20, t30) = (band.figure(Parameter::T20).value(), band.figure(Parameter::T30).value());
    let (Some(t20), Some(t30)) = (t20, t30) else { return };
    for parameter in [Parameter::T20, Parameter::T30] {
        if let Figure::Supported(Estimate { line: Some(line), .. }) = &mut band.figures[parameter as usize] {
            line.curvature_percent = Some(100.0 * (t30 / t20 - 1.0));
        }
    }
}
