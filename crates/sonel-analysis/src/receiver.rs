//! The figures of a response: every source at every receiver.
//!
//! Values come from the fine bins, intervals from the coarse bins of the batches. Receivers of one response share sonels,
//! so their errors are correlated: intervals hold for each figure alone.

use rayon::prelude::*;
use sonel_acoustics::just_noticeable as noticeable;
use sonel_echogram::Response;

use crate::batches::{self, Parts};
use crate::decay::Echogram;
use crate::figure::{Figure, NoInterval, Unsupported};
use crate::missing::{self, Bounds};
use crate::modulation::{self, SPEECH_OCTAVES};
use crate::parameter::{LevelScale, PARAMETER_COUNT, Parameter, Values};
use crate::window::{WINDOW_COUNT, WINDOWS, Window};

/// Figures of one source at one receiver.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverFigures {
    /// Name of the source.
    pub source: String,
    /// Position of the source [m].
    pub source_position: [f64; 3],
    /// Name of the receiver.
    pub name: String,
    /// Position of the receiver [m].
    pub position: [f64; 3],
    /// Of the room alone: no noise, 0 … 1.
    pub speech_transmission_index: Figure,
    /// Ascending in frequency.
    pub bands: Vec<BandFigures>,
}

/// Figures of one band.
#[derive(Debug, Clone, PartialEq)]
pub struct BandFigures {
    /// Nominal centre [Hz].
    pub center_frequency_hz: f64,
    figures: [Figure; PARAMETER_COUNT],
    /// Strength in each of [`WINDOWS`], for comparisons.
    pub windows: [Figure; WINDOW_COUNT],
}

impl BandFigures {
    /// One of them.
    pub fn figure(&self, parameter: Parameter) -> &Figure {
        &self.figures[parameter as usize]
    }
}

impl ReceiverFigures {
    /// All parameters, the speech transmission index first.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        std::iter::once(&self.speech_transmission_index)
            .chain(self.bands.iter().flat_map(|band| &band.figures))
    }
}

/// All figures of `response`: source by source, receiver by receiver.
#[must_use]
pub fn parameters(response: &Response) -> Vec<ReceiverFigures> {
    let pairs: Vec<(usize, usize)> =
        (0..response.sources()).flat_map(|s| (0..response.receivers()).map(move |r| (s, r))).collect();
    pairs.into_par_iter().map(|(s, r)| at_receiver(response, s, r)).collect()
}

/// One band, read from the fine bins and from the batches.
struct Band {
    fine: Values,
    parts: Result<Parts, NoInterval>,
    /// With what may follow the record; none where nothing is known of it.
    bounds: Option<Bounds>,
}

impl Band {
    fn parts(&self) -> Result<&Parts, &NoInterval> {
        self.parts.as_ref()
    }
}

fn at_receiver(response: &Response, s: usize, r: usize) -> ReceiverFigures {
    let bands: Vec<Band> = (0..response.bands()).map(|b| read_band(response, (s, r, b))).collect();
    ReceiverFigures {
        source: response.source_names[s].clone(),
        source_position: response.source_positions[s],
        name: response.receiver_names[r].clone(),
        position: response.receiver_positions[r],
        speech_transmission_index: speech(&response.center_frequency_hz, &bands),
        bands: bands
            .iter()
            .zip(&response.center_frequency_hz)
            .map(|(band, &center_frequency_hz)| BandFigures {
                center_frequency_hz,
                figures: Parameter::ALL.map(|parameter| band_figure(band, parameter)),
                windows: WINDOWS.map(|window| window_figure(band, window)),
            })
            .collect(),
    }
}

fn read_band(response: &Response, (s, r, b): (usize, usize, usize)) -> Band {
    let scale = LevelScale {
        source_power_level_db: response.source_power_level_db[s * response.bands() + b],
        characteristic_impedance: response.characteristic_impedance,
    };
    let echogram = Echogram {
        edges: &response.time_edges_s,
        energy: response.echogram(s, r, b),
        direct_time: response.direct_time(s, r),
    };
    let fine = Values::read(echogram, scale);
    let bounds =
        response.missing(s, r, b).and_then(|missing| Bounds::new(echogram, &fine.curve, missing, scale));
    Band { bounds, fine, parts: Parts::read(response, (s, r, b), scale) }
}

fn band_figure(band: &Band, parameter: Parameter) -> Figure {
    let read = |values: &Values| values.values[parameter as usize].clone();
    let figure = figure_of(band, read)?.if_straight(band.fine.quality(parameter))?;
    let just_noticeable = parameter.just_noticeable(figure.value);
    let bounds: Vec<&Bounds> = band.bounds.iter().collect();
    let figure = figure.unless_noisy(just_noticeable)?;
    if bounds.is_empty() {
        return Ok(figure);
    }
    missing::widened(figure, &bounds, just_noticeable, |values| read(values[0]))
}

fn window_figure(band: &Band, window: Window) -> Figure {
    figure_of(band, |values| {
        values.curve.as_ref().map_err(Clone::clone).and_then(|curve| window.strength(curve))
    })
}

/// What `read` finds in the fine bins, with the interval it finds from the batches.
fn figure_of(band: &Band, read: impl Fn(&Values) -> Result<f64, Unsupported>) -> Figure {
    let parts = band.parts().map(|parts| [parts]);
    let parts = parts.as_ref().map(<[&Parts; 1]>::as_slice).map_err(|reason| *reason);
    batches::figure(read(&band.fine), parts, |values| read(values[0]))
}

fn speech(frequencies: &[f64], bands: &[Band]) -> Figure {
    let bands = speech_bands(frequencies, bands)?;
    let parts: Result<Vec<&Parts>, &NoInterval> = bands.iter().map(|band| band.parts()).collect();
    let parts = parts.as_ref().map(Vec::as_slice).map_err(|reason| *reason);
    let fine: Vec<&Values> = bands.iter().map(|band| &band.fine).collect();
    let figure = batches::figure(speech_index(&fine), parts, speech_index)?
        .unless_noisy(noticeable::SPEECH_TRANSMISSION_INDEX)?;
    let bounds: Option<Vec<&Bounds>> = bands.iter().map(|band| band.bounds.as_ref()).collect();
    match bounds {
        Some(bounds) => {
            missing::widened(figure, &bounds, noticeable::SPEECH_TRANSMISSION_INDEX, speech_index)
        }
        None => Ok(figure),
    }
}

fn speech_bands<'a>(frequencies: &[f64], bands: &'a [Band]) -> Result<Vec<&'a Band>, Unsupported> {
    let find = |octave: f64| frequencies.iter().position(|center| center.total_cmp(&octave).is_eq());
    let missing: Vec<String> = SPEECH_OCTAVES
        .iter()
        .filter(|&&octave| find(octave).is_none())
        .map(|octave| format!("{octave} Hz"))
        .collect();
    if !missing.is_empty() {
        return Err(Unsupported::BandsMissing { missing: missing.join(", ") });
    }
    if frequencies.windows(2).any(|pair| pair[1] / pair[0] < NARROWEST_OCTAVE_STEP) {
        return Err(Unsupported::NotOctaves);
    }
    Ok(SPEECH_OCTAVES.iter().filter_map(|&octave| find(octave)).map(|index| &bands[index]).collect())
}

/// Nominal octaves lie at least this factor apart (63 to 125 Hz), third octaves at most 1.29.
const NARROWEST_OCTAVE_STEP: f64 = 1.9;

fn speech_index(values: &[&Values]) -> Result<f64, Unsupported> {
    let mut indices = [0.0; 7];
    for ((index, values), octave) in indices.iter_mut().zip(values).zip(SPEECH_OCTAVES) {
        let curve = values.curve.as_ref().map_err(|reason| Unsupported::Band {
            center_frequency_hz: octave,
            reason: Box::new(reason.clone()),
        })?;
        *index = modulation::transfer_index(curve);
    }
    Ok(modulation::speech_transmission_index(&indices))
}
