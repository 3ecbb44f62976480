//! The parameters of a response: every source at every receiver.
//!
//! Values come from the fine bins, intervals from the coarse bins of the batches. Receivers of one response share sonels,
//! so their errors are correlated: intervals hold for each parameter alone.

use std::cell::RefCell;

use rayon::prelude::*;
use sonel_acoustics::just_noticeable as noticeable;
use sonel_acoustics::noise;
use sonel_echogram::provenance::SystemSource;
use sonel_echogram::{ArrivalKind, Response};

use crate::batches::{self, Parts};
use crate::decay::Echogram;
use crate::derived::derived;
use crate::echo::{self, ECHO_CRITERIA};
use crate::estimate::{Estimate, NoInterval, ParameterValue, Unsupported};
use crate::listed;
use crate::missing::{self, Bounds};
use crate::modulation::{self, Borders, SPEECH_OCTAVES, Talk};
use crate::octave;
use crate::parameter::{LevelScale, Parameter, Values};
use crate::window::WINDOWS;
use crate::{lateral, skewness, support};

/// Figures of one source at one receiver.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverParameters {
    /// Name of the source.
    pub source: String,
    /// Position of the source [m].
    pub source_position: [f64; 3],
    /// Name of the receiver.
    pub name: String,
    /// Position of the receiver [m].
    pub position: [f64; 3],
    /// Speech transmission index of the room alone, without noise, 0 … 1.
    pub speech_transmission_index: ParameterValue,
    /// A-weighted level of all bands of the source [dB re 20 µPa].
    pub a_weighted_level_db: ParameterValue,
    /// Echo criteria, as [`crate::echo::ECHO_CRITERIA`].
    pub echo: [ParameterValue; 2],
    /// Speech in noise; none without noise.
    pub in_noise: Option<SpeechInNoise>,
    /// Bands, ascending in frequency.
    pub bands: Vec<BandParameters>,
}

/// A-weighted levels of speech and noise in the octaves of speech.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeechInNoise {
    /// Of the speech [dB re 20 µPa].
    pub level_db: ParameterValue,
    /// Of the noise [dB re 20 µPa].
    pub noise_level_db: f64,
    /// Speech over noise [dB].
    pub signal_to_noise_db: ParameterValue,
}

impl SpeechInNoise {
    fn of(bands: &[BandParameters], talk: &Talk, more: [f64; 7]) -> Self {
        let noise_level_db = noise::a_weighted_db(&SPEECH_OCTAVES, &talk.noise_level_db);
        let frequencies: Vec<f64> = bands.iter().map(|band| band.center_frequency_hz).collect();
        let read = |less: f64| {
            let octaves = speech_octaves(&frequencies)?;
            let sum = |levels: &[f64]| {
                let octaves = levels.chunks(octaves[0].len()).zip(more);
                let louder: Vec<f64> = octaves.map(|(levels, more)| octave::sum_db(levels) + more).collect();
                noise::a_weighted_db(&SPEECH_OCTAVES, &louder) - less
            };
            derived(sum, octaves.iter().flatten().map(|&band| bands[band].parameter(Parameter::Level)))
        };
        Self { level_db: read(0.0), noise_level_db, signal_to_noise_db: read(noise_level_db) }
    }
}

/// Figures of one band.
#[derive(Debug, Clone, PartialEq)]
pub struct BandParameters {
    /// Nominal centre [Hz].
    pub center_frequency_hz: f64,
    /// [`Parameter::ALL`] first.
    parameters: Vec<(Parameter, ParameterValue)>,
    /// Strength in each of [`WINDOWS`], for comparisons; none where only some parameters were asked for.
    pub windows: Vec<ParameterValue>,
}

/// Stands for parameters of responses with directions, and of receivers one metre from a source.
static NO_DIRECTIONS: ParameterValue = Err(Unsupported::NoDirections);
static NOT_ON_STAGE: ParameterValue = Err(Unsupported::NotOnStage);
static NO_NOISE: ParameterValue = Err(Unsupported::NoNoise);
static NO_DIRECT_SOUND: ParameterValue = Err(Unsupported::NoDirectSound);
static NOT_ASKED: ParameterValue = Err(Unsupported::NotAsked);

impl BandParameters {
    /// The value of `parameter`.
    pub fn parameter(&self, parameter: Parameter) -> &ParameterValue {
        match self.parameters.iter().find(|(found, _)| *found == parameter) {
            Some((_, estimate)) => estimate,
            None if Parameter::LATERAL.contains(&parameter) => &NO_DIRECTIONS,
            None if Parameter::IN_NOISE.contains(&parameter) => &NO_NOISE,
            None if parameter == Parameter::DirectToReverberant => &NO_DIRECT_SOUND,
            None if Parameter::ALL.contains(&parameter) => &NOT_ASKED,
            None => &NOT_ON_STAGE,
        }
    }

    /// What there are parameters of.
    pub fn parameters(&self) -> impl Iterator<Item = Parameter> + '_ {
        self.parameters.iter().map(|(parameter, _)| *parameter)
    }
}

impl ReceiverParameters {
    /// Levels of the source in [`noise::NOISE_OCTAVES`] [dB re 20 µPa], for ratings of what it radiates as noise; none where an octave is missing.
    #[must_use]
    pub fn octave_levels_db(&self) -> [Option<f64>; 8] {
        let frequencies: Vec<f64> = self.bands.iter().map(|band| band.center_frequency_hz).collect();
        noise::NOISE_OCTAVES.map(|octave| {
            let bands = octave::bands_of(octave, &frequencies)?;
            let level = |&band: &usize| self.bands[band].parameter(Parameter::Level).as_ref().ok();
            let levels: Option<Vec<f64>> = bands.iter().map(|band| Some(level(band)?.value)).collect();
            levels.map(|levels| octave::sum_db(&levels))
        })
    }

    /// A parameter in the band of this nominal centre [Hz]; none without such a band.
    #[must_use]
    pub fn in_band(&self, hz: f64, parameter: Parameter) -> Option<ParameterValue> {
        Some(self.band(hz)?.parameter(parameter).clone())
    }

    /// The band of this nominal centre [Hz].
    pub(crate) fn band(&self, hz: f64) -> Option<&BandParameters> {
        self.bands.iter().find(|band| band.center_frequency_hz.total_cmp(&hz).is_eq())
    }

    /// What is of several bands: key, value and just-noticeable difference.
    pub(crate) fn over_bands(&self) -> Vec<(&'static str, &ParameterValue, Option<f64>)> {
        let (speech, level) = (Some(noticeable::SPEECH_TRANSMISSION_INDEX), Some(noticeable::LEVEL_DB));
        let mut values = vec![
            ("speech_transmission_index", &self.speech_transmission_index, speech),
            ("a_weighted_level_db", &self.a_weighted_level_db, level),
        ];
        values.extend(ECHO_CRITERIA.iter().zip(&self.echo).map(|(echo, value)| (echo.key, value, None)));
        if let Some(in_noise) = &self.in_noise {
            values.push(("speech_level_db", &in_noise.level_db, level));
            values.push(("signal_to_noise_db", &in_noise.signal_to_noise_db, level));
        }
        values
    }

    /// Every value that has changes by materials.
    pub(crate) fn values(&self) -> Vec<&ParameterValue> {
        let bands = self.bands.iter().flat_map(|band| band.parameters.iter().map(|(_, value)| value));
        self.over_bands().into_iter().map(|(_, value, _)| value).chain(bands).collect()
    }

    /// The values of [`Self::values`], in its order, each with the index of its band; none of several bands.
    pub(crate) fn values_mut(&mut self) -> Vec<(Option<usize>, &mut ParameterValue)> {
        let Self { speech_transmission_index, a_weighted_level_db, echo, in_noise, bands, .. } = self;
        let noise =
            in_noise.iter_mut().flat_map(|speech| [&mut speech.level_db, &mut speech.signal_to_noise_db]);
        let bands = bands.iter_mut().enumerate();
        let bands =
            bands.flat_map(|(b, band)| band.parameters.iter_mut().map(move |(_, value)| (Some(b), value)));
        let of_several =
            [speech_transmission_index, a_weighted_level_db].into_iter().chain(echo).chain(noise);
        of_several.map(|value| (None, value)).chain(bands).collect()
    }

    /// What any band has parameters of, in their order: noise is not stated in all bands.
    #[must_use]
    pub fn listed(&self) -> Vec<Parameter> {
        let mut listed = Vec::new();
        for parameter in self.bands.iter().flat_map(BandParameters::parameters) {
            if !listed.contains(&parameter) {
                listed.push(parameter);
            }
        }
        listed
    }

    /// All parameters, the speech transmission index first.
    pub fn parameters(&self) -> impl Iterator<Item = &ParameterValue> {
        std::iter::once(&self.speech_transmission_index)
            .chain(self.bands.iter().flat_map(|band| band.parameters.iter().map(|(_, estimate)| estimate)))
    }
}

/// What all `receivers` have parameters of.
pub(crate) fn shared<'a>(receivers: impl IntoIterator<Item = &'a ReceiverParameters>) -> Vec<Parameter> {
    let mut all = receivers.into_iter().map(ReceiverParameters::listed);
    let mut shared = all.next().unwrap_or_default();
    all.for_each(|listed| shared.retain(|parameter| listed.contains(parameter)));
    shared
}

/// All parameters of `response`: source by source, receiver by receiver.
#[must_use]
pub fn parameters(response: &Response) -> Vec<ReceiverParameters> {
    parameters_of(response, None)
}

/// All parameters of `response`, with the speech transmission index of `talk`: levels, noise and hearing decide it beside the room.
#[must_use]
pub fn parameters_of(response: &Response, talk: Option<&Talk>) -> Vec<ReceiverParameters> {
    parameters_at(response, talk, &Parameter::ALL, &pairs(response))
}

/// The `wanted` parameters of all bands of `response` and nothing else: neither speech transmission nor echoes nor windows.
#[must_use]
pub fn some_parameters(response: &Response, wanted: &[Parameter]) -> Vec<ReceiverParameters> {
    parameters_at(response, None, wanted, &pairs(response))
}

fn pairs(response: &Response) -> Vec<(usize, usize)> {
    (0..response.sources()).flat_map(|s| (0..response.receivers()).map(move |r| (s, r))).collect()
}

/// The same of some `pairs` of source and receiver alone, in their order.
#[must_use]
pub fn parameters_at(
    response: &Response,
    talk: Option<&Talk>,
    wanted: &[Parameter],
    pairs: &[(usize, usize)],
) -> Vec<ReceiverParameters> {
    let lateral = response.lateral(0).zip(response.lateral(1));
    let lateral = lateral.map(|(squares, cosines)| [squares, cosines]);
    let listed = listed::Index::new(response);
    let read =
        |(s, r): &(usize, usize)| at_receiver(response, lateral.as_ref(), &listed, (talk, wanted), *s, *r);
    pairs.par_iter().map(read).collect()
}

/// One band, read from the fine bins and from the batches.
struct Band {
    all: EchogramReading,
    /// Lateral energy and lateral cross energy, where there are directions.
    lateral: Option<[EchogramReading; 2]>,
}

/// An echogram, read from the fine bins and from the batches.
struct EchogramReading {
    fine: Values,
    parts: Result<Parts, NoInterval>,
    /// With what may follow the record; none where nothing is known of it.
    bounds: Option<Bounds>,
}

fn at_receiver(
    response: &Response,
    lateral: Option<&[Response; 2]>,
    listed: &listed::Index,
    (talk, wanted): (Option<&Talk>, &[Parameter]),
    s: usize,
    r: usize,
) -> ReceiverParameters {
    let all = wanted.len() == Parameter::ALL.len();
    let band = |b: usize| Band {
        all: read(response, listed, s, r, b),
        lateral: lateral.map(|both| both.each_ref().map(|lateral| read(lateral, listed, s, r, b))),
    };
    let bands: Vec<Band> = (0..response.bands()).into_par_iter().map(band).collect();
    let (source_position, position) = (response.source_positions[s], response.receiver_positions[r]);
    let squares = source_position.iter().zip(position).map(|(from, to)| (from - to) * (from - to));
    let on_stage = support::is_defined(squares.sum::<f64>().sqrt());
    let count = response.bands();
    let power = &response.source_power_level_db[s * count..(s + 1) * count];
    let system = &response.provenance.together;
    let more = talk.map(|talk| talk.more_than(&response.center_frequency_hz, power, system));
    let has_direct = !system.is_empty();
    let measured = response.provenance.measured.as_ref();
    let speech_transmission_index = || match all {
        true => speech(&response.center_frequency_hz, &bands, power, talk.zip(more))
            .map(|index| index.warned(of_different_talkers(system))),
        false => NOT_ASKED.clone(),
    };
    let found = bands.par_iter().enumerate().zip(&response.center_frequency_hz).map(
        |((b, band), &center_frequency_hz)| {
            let mut parameters = band_parameters(band, on_stage, wanted);
            let octave =
                SPEECH_OCTAVES.iter().position(|octave| octave.total_cmp(&center_frequency_hz).is_eq());
            let of_octave = octave::bands_of(center_frequency_hz, &response.center_frequency_hz);
            if let Some((((talk, more), k), of_octave)) = talk.zip(more).zip(octave).zip(of_octave) {
                let octave: Vec<&EchogramReading> = of_octave.iter().map(|&band| &bands[band].all).collect();
                parameters.extend(in_noise(&octave, more[k], talk.noise_level_db[k]));
            }
            let [lower, higher] = response.left_out_db(s, r, b);
            for (parameter, value) in &mut parameters {
                if let (Parameter::Level | Parameter::Strength, Ok(estimate)) = (parameter, value) {
                    // Independent of the spread of packets.
                    let value = estimate.value;
                    estimate.interval = estimate.interval.clone().map(|[low, high]| {
                        [value - libm::hypot(value - low, lower), value + libm::hypot(high - value, higher)]
                    });
                }
            }
            if has_direct {
                let direct = direct_energy(response, s, r, b);
                let ratio = checked(&[&band.all], Parameter::DirectToReverberant, |values| {
                    direct_ratio(values[0], direct)
                });
                parameters.push((Parameter::DirectToReverberant, ratio));
            }
            if let Some(&reached_db) = measured.and_then(|measured| measured.reached_db.get(b)) {
                parameters.retain_mut(|(parameter, value)| {
                    if let (Ok(_), Some(reason)) = (&value, refusal(*parameter, reached_db)) {
                        *value = Err(reason);
                    }
                    !matches!(parameter, Parameter::SupportEarly | Parameter::SupportLate)
                });
            }
            let windows = WINDOWS.iter().filter(|_| all);
            let windows = windows
                .map(|window| parameter_of(&[&band.all], |values| window.strength(values[0].curve()?)));
            BandParameters { center_frequency_hz, parameters, windows: windows.collect() }
        },
    );
    let (found, speech_transmission_index) =
        rayon::join(|| found.collect::<Vec<_>>(), speech_transmission_index);
    let levels = found.iter().map(|band| band.parameter(Parameter::Level));
    ReceiverParameters {
        source: response.source_names[s].clone(),
        source_position,
        name: response.receiver_names[r].clone(),
        position,
        speech_transmission_index,
        a_weighted_level_db: derived(
            |levels| noise::a_weighted_db(&response.center_frequency_hz, levels),
            levels,
        ),
        echo: if all { echo::echo(response, s, r) } else { [NOT_ASKED.clone(), NOT_ASKED.clone()] },
        in_noise: talk.zip(more).map(|(talk, more)| SpeechInNoise::of(&found, talk, more)),
        bands: found,
    }
}

/// A warning where the sources of a `system` may radiate different speech: none of them has a gain or delay, as loudspeakers have.
fn of_different_talkers(system: &[SystemSource]) -> Option<String> {
    let is_changed = |source: &SystemSource| source.gain_db.abs() + source.delay_s > 0.0;
    (system.len() > 1 && !system.iter().any(is_changed)).then(|| {
        "all sources are taken to radiate the same speech, as loudspeakers do: for different talkers read each source alone".to_owned()
    })
}

/// Noise must be so far below the part of a decay that is evaluated [dB] [ISO3382-1].
const BELOW_DECAY_DB: f64 = 10.0;

/// Why a measurement whose decay meets its noise at a level [dB] has no value of `parameter`.
fn refusal(parameter: Parameter, reached_db: f64) -> Option<Unsupported> {
    let needed_db = match parameter {
        Parameter::T20 => -25.0,
        Parameter::T30 => -35.0,
        // EDT; ratios of energies are off by less than a just-noticeable difference.
        _ => -10.0,
    } - BELOW_DECAY_DB;
    (reached_db > needed_db).then_some(Unsupported::NoiseReached { reached_db, needed_db })
}

/// U50 [Bradley1986] and signal-to-noise ratio of speech in the bands of an octave that is `more` [dB] louder than the source, in noise of a level
/// [dB].
fn in_noise(bands: &[&EchogramReading], more: f64, noise_db: f64) -> [(Parameter, ParameterValue); 2] {
    let [ratio, signal] = Parameter::IN_NOISE;
    let of = |values: &[&Values], parameter: Parameter| -> Result<Vec<f64>, Unsupported> {
        values.iter().map(|values| values.value(parameter)).collect()
    };
    let useful = checked(bands, ratio, |values| {
        let (levels, shares) = (of(values, Parameter::Level)?, of(values, Parameter::DefinitionD50)?);
        let energies: Vec<f64> =
            levels.iter().map(|level| libm::pow(10.0, 0.1 * (level + more - noise_db))).collect();
        let all: f64 = energies.iter().sum();
        let early: f64 = energies.iter().zip(shares).map(|(energy, share)| energy * share).sum();
        Ok(10.0 * libm::log10(early / (all - early + 1.0)))
    });
    let over =
        checked(bands, signal, |values| Ok(octave::sum_db(&of(values, Parameter::Level)?) + more - noise_db));
    [(ratio, useful), (signal, over)]
}

/// Fluence of the direct sound of source `s` at receiver `r` in band `b` per unit emitted energy [1/m²].
fn direct_energy(response: &Response, s: usize, r: usize, b: usize) -> f64 {
    let arrivals = &response.arrivals;
    let is_direct = |&at: &usize| {
        arrivals.kind[at] == ArrivalKind::Direct as u32
            && (arrivals.source[at] as usize, arrivals.receiver[at] as usize) == (s, r)
    };
    let direct = (0..arrivals.source.len()).filter(is_direct);
    direct.map(|at| arrivals.energy[at * response.bands() + b]).sum()
}

/// 10 lg of direct over other energy [dB].
fn direct_ratio(values: &Values, direct: f64) -> Result<f64, Unsupported> {
    let total = values.curve()?.total();
    if direct <= 0.0 || direct >= total {
        return Err(Unsupported::NoDirectSound);
    }
    Ok(10.0 * libm::log10(direct / (total - direct)))
}

fn read(response: &Response, listed: &listed::Index, s: usize, r: usize, b: usize) -> EchogramReading {
    let arrivals = listed.of(response, s, r, b);
    let scale = (!response.is_measured()).then(|| LevelScale {
        source_power_level_db: response.source_power_level_db[s * response.bands() + b],
        characteristic_impedance: response.characteristic_impedance,
    });
    let echogram = Echogram {
        edges: &response.time_edges_s,
        energy: response.echogram(s, r, b),
        direct_time: response.direct_time(s, r),
        arrivals: &arrivals,
    };
    let fine = Values::read(echogram, scale);
    let bounds =
        response.missing(s, r, b).and_then(|missing| Bounds::new(echogram, &fine.curve, missing, scale));
    EchogramReading { bounds, fine, parts: Parts::read(response, s, r, b, &arrivals, scale) }
}

/// The `wanted` parameters of one band, and those that only some responses have; `on_stage` where support is defined.
fn band_parameters(band: &Band, on_stage: bool, wanted: &[Parameter]) -> Vec<(Parameter, ParameterValue)> {
    let mut parameters: Vec<(Parameter, ParameterValue)> = wanted
        .iter()
        .map(|&parameter| {
            let read = |values: &[&Values]| values[0].value(parameter);
            (parameter, checked(&[&band.all], parameter, read))
        })
        .collect();
    if let Some([squares, cosines]) = &band.lateral {
        let fraction = |values: &[&Values]| lateral::early_fraction(values[0], values[1]);
        let [early, early_cosine, late] = Parameter::LATERAL;
        parameters.extend([
            (early, checked(&[&band.all, squares], early, fraction)),
            (early_cosine, checked(&[&band.all, cosines], early_cosine, fraction)),
            (late, checked(&[squares], late, |values| lateral::late_level_db(values[0]))),
        ]);
    }
    for (parameter, window) in Parameter::SUPPORT.into_iter().filter(|_| on_stage) {
        let estimate = checked(&[&band.all], parameter, |values| support::support_db(values[0], window));
        parameters.push((parameter, estimate));
    }
    parameters
}

/// What `read` finds in the fine bins of `readings`, with its interval, unless noise, the shape of the decay or the end of the run decide it.
fn checked(
    readings: &[&EchogramReading],
    parameter: Parameter,
    read: impl Fn(&[&Values]) -> Result<f64, Unsupported>,
) -> ParameterValue {
    let estimate = parameter_of(readings, &read)?;
    let is_late = matches!(parameter, Parameter::T20 | Parameter::T30);
    let estimate = if is_late { skewness::followed(estimate) } else { estimate };
    let straight = estimate.if_straight(readings[0].fine.quality(parameter))?;
    let just_noticeable = parameter.just_noticeable(straight.value);
    let straight = Estimate { is_time: parameter.is_time(), ..straight };
    refused_or_widened(straight, readings, just_noticeable, read)
}

/// The estimate, unless noise or the end of the run decide it.
fn refused_or_widened(
    estimate: Estimate,
    readings: &[&EchogramReading],
    just_noticeable: f64,
    read: impl Fn(&[&Values]) -> Result<f64, Unsupported>,
) -> ParameterValue {
    let estimate = estimate.unless_noisy(just_noticeable)?;
    let bounds: Option<Vec<&Bounds>> = readings.iter().map(|reading| reading.bounds.as_ref()).collect();
    match bounds {
        Some(bounds) => missing::widened(estimate, &bounds, just_noticeable, read),
        None => Ok(estimate),
    }
}

/// Estimate by `read`: its value from the fine bins, its interval from the batches.
fn parameter_of(
    readings: &[&EchogramReading],
    read: impl Fn(&[&Values]) -> Result<f64, Unsupported>,
) -> ParameterValue {
    let parts: Result<Vec<&Parts>, &NoInterval> =
        readings.iter().map(|reading| reading.parts.as_ref()).collect();
    let fine: Vec<&Values> = readings.iter().map(|reading| &reading.fine).collect();
    batches::estimate(read(&fine), parts.as_deref().map_err(|reason| *reason), read)
}

fn speech(
    frequencies: &[f64],
    bands: &[Band],
    power: &[f64],
    talk: Option<(&Talk, [f64; 7])>,
) -> ParameterValue {
    let borders = RefCell::new(Borders::default());
    let octaves = speech_octaves(frequencies)?;
    let readings: Vec<&EchogramReading> = octaves.iter().flatten().map(|&band| &bands[band].all).collect();
    let power: Vec<f64> = octaves.iter().flatten().map(|&band| power[band]).collect();
    let speech_index = |values: &[&Values]| speech_index(values, &power, &mut borders.borrow_mut(), talk);
    let estimate = parameter_of(&readings, speech_index)?;
    refused_or_widened(estimate, &readings, noticeable::SPEECH_TRANSMISSION_INDEX, speech_index)
}

/// Bands of every octave of speech among bands of these `frequencies` [Hz]: one each, or three.
fn speech_octaves(frequencies: &[f64]) -> Result<Vec<Vec<usize>>, Unsupported> {
    let bands = |octave: f64| octave::bands_of(octave, frequencies);
    match octave::missing(&SPEECH_OCTAVES, |octave| bands(octave).is_some()) {
        Some(missing) => Err(Unsupported::BandsMissing { missing }),
        None => Ok(SPEECH_OCTAVES.into_iter().filter_map(bands).collect()),
    }
}

/// The index of the room, or of a talk that is so many decibels louder than the source in every octave. `values` are those of the octaves, or of
/// the thirds of one after the other, `power` the levels of the source in them [dB].
fn speech_index(
    values: &[&Values],
    power: &[f64],
    borders: &mut Borders,
    talk: Option<(&Talk, [f64; 7])>,
) -> Result<f64, Unsupported> {
    let width = values.len() / SPEECH_OCTAVES.len();
    let octaves = || values.chunks(width);
    let shares = match talk {
        None => [1.0; 7],
        Some((talk, more)) => {
            let mut levels = [0.0; 7];
            for ((level, values), more) in levels.iter_mut().zip(octaves()).zip(more) {
                let of_bands = values.iter().map(|values| values.value(Parameter::Level));
                *level = octave::sum_db(&of_bands.collect::<Result<Vec<f64>, _>>()?) + more;
            }
            modulation::audible_shares(&levels, &talk.noise_level_db)
        }
    };
    let mut indices = [0.0; 7];
    let rows = octaves().zip(power.chunks(width)).zip(SPEECH_OCTAVES).zip(shares);
    for (index, (((values, power), octave), share)) in indices.iter_mut().zip(rows) {
        let mut bands = Vec::with_capacity(width);
        for (&values, level) in values.iter().zip(power) {
            let curve = values.curve.as_ref().map_err(|reason| Unsupported::Band {
                center_frequency_hz: octave,
                reason: Box::new(reason.clone()),
            })?;
            bands.push((curve, curve.total() * libm::pow(10.0, 0.1 * (level - power[0]))));
        }
        *index = modulation::transfer_index(&bands, borders, share);
    }
    Ok(modulation::speech_transmission_index(&indices))
}

#[cfg(test)]
mod tests;
