//! A source at a receiver as pages have it: parameters with intervals, charts, and the paths of early reflections.

use serde::Serialize;
use sonel::analysis::comparison::{Pairing, difference};
use sonel::analysis::receiver::BandParameters;
use sonel::analysis::single::Single;
use sonel::analysis::{Parameter, ParameterValue, ReceiverParameters};
use sonel::drawing::plot::{self, Panel};
use sonel::echograms::Echograms;
use sonel::geometry::Geometry;

use super::number::Number;
use super::reflections::{self, ReflectionPath};

/// A source at a receiver.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Pair {
    /// Index of the design; none where the page is asked for one place after the other.
    pub design: usize,
    pub source: String,
    pub receiver: String,
    /// Position of the receiver [m].
    pub at: [f64; 3],
    /// Position of the source [m].
    pub source_at: [f64; 3],
    /// Nominal centres [Hz].
    pub bands: Vec<f64>,
    pub parameters: Vec<PairRow>,
    /// What is drawn of it; none where there are too many pairs.
    pub curves: Option<Curves>,
}

/// A parameter.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct PairRow {
    pub key: &'static str,
    pub symbol: &'static str,
    pub unit: &'static str,
    /// Just-noticeable difference about the single number.
    pub noticeable: f64,
    /// Whether this is a share of the value.
    pub is_relative: bool,
    /// Single number.
    pub single: Number,
    /// In each band; empty for what is of several bands.
    pub values: Vec<Number>,
    /// Difference to the first design.
    pub less: Option<Less>,
    /// Of a mean: number of receivers with a value, and of all.
    pub counted: Option<[usize; 2]>,
}

/// Differences to another response.
#[derive(Debug, Serialize)]
pub(crate) struct Less {
    pub single: Number,
    pub values: Vec<Number>,
}

/// Charts of a pair.
#[derive(Debug, Serialize)]
pub(crate) struct Curves {
    pub decay: Panel,
    pub echogram: Panel,
    /// None where no arrival is listed.
    pub early: Option<Panel>,
    /// Early reflections as lines in the room.
    pub ways: Vec<ReflectionPath>,
}

/// Charts of source `s` at receiver `r`. Reflections are followed between the walls, where these are those that the response was rendered with.
pub(crate) fn curves(response: &Echograms, (s, r): (usize, usize), walls: Option<&Geometry>) -> Curves {
    Curves {
        decay: plot::decay(response, s, r),
        echogram: plot::echogram(response, s, r),
        early: plot::early(response, (s, r), None),
        ways: walls.map_or_else(Vec::new, |walls| reflections::of(response, walls, (s, r))),
    }
}

impl Pair {
    /// The `parameters` of a source at a receiver, with their differences to those of `first`.
    pub(crate) fn of(parameters: &ReceiverParameters, first: Option<(&ReceiverParameters, Pairing)>) -> Self {
        let bands = parameters.bands.iter().map(|band| band.center_frequency_hz);
        Self {
            design: 0,
            source: parameters.source.clone(),
            receiver: parameters.name.clone(),
            at: parameters.position,
            source_at: parameters.source_position,
            bands: bands.collect(),
            parameters: rows(parameters, first),
            curves: None,
        }
    }
}

/// Every parameter over the bands and as a single number.
fn rows(receiver: &ReceiverParameters, first: Option<(&ReceiverParameters, Pairing)>) -> Vec<PairRow> {
    let of_bands = receiver.listed().into_iter().map(Single::Of);
    let row = |single: Single| {
        let value = single.value(receiver);
        let bands = match single {
            Single::Of(parameter) => receiver.bands.iter().map(|band| (band, parameter)).collect(),
            _ => Vec::new(),
        };
        let values =
            bands.iter().map(|(band, parameter)| Number::of(band.parameter(*parameter), single.heading().2));
        let less = first.map(|(first, pairing)| {
            let number = |before: &ParameterValue, after: &ParameterValue| {
                Number::of(&difference(before, after, pairing), single.heading().2)
            };
            let in_band = |(band, parameter): &(&BandParameters, Parameter)| {
                let before = first.in_band(band.center_frequency_hz, *parameter);
                let missing = || Number::Missing("the first design has no such band".to_owned());
                before.map_or_else(missing, |before| number(&before, band.parameter(*parameter)))
            };
            Less { single: number(&single.value(first), &value), values: bands.iter().map(in_band).collect() }
        });
        PairRow { values: values.collect(), less, ..PairRow::of(single, &value) }
    };
    of_bands.chain(Single::OF_SEVERAL).map(row).collect()
}

impl PairRow {
    /// A single number alone.
    pub(crate) fn of(single: Single, value: &ParameterValue) -> Self {
        let (symbol, unit, factor) = single.heading();
        let about = value.as_ref().map_or(1.0, |estimate| estimate.value);
        Self {
            key: single.key(),
            symbol,
            unit,
            noticeable: factor * single.just_noticeable(about),
            is_relative: matches!(single, Single::Of(parameter) if parameter.is_noticed_relatively()),
            single: Number::of(value, factor),
            values: Vec::new(),
            less: None,
            counted: None,
        }
    }
}
