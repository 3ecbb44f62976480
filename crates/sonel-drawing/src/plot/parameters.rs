//! Parameters over bands, a panel a parameter.

use super::{Axis, Mark, Panel, Point, Series};
use sonel_analysis::parameter::Parameter;
use sonel_analysis::receiver::{BandParameters, ReceiverParameters};

/// What any of `receivers` has figures of.
#[must_use]
pub fn shown(receivers: &[(String, &ReceiverParameters)]) -> Vec<Parameter> {
    let most = receivers.iter().map(|(_, figures)| figures.listed()).max_by_key(Vec::len);
    most.unwrap_or_default()
}

/// A panel of each of them over the bands, a series for each of the named `receivers`; what was refused leaves a gap.
#[must_use]
pub fn parameters(receivers: &[(String, &ReceiverParameters)]) -> Vec<Panel> {
    let mut centers: Vec<f64> = receivers
        .iter()
        .flat_map(|(_, figures)| &figures.bands)
        .map(|band| band.center_frequency_hz)
        .collect();
    centers.sort_by(f64::total_cmp);
    centers.dedup();
    // Labels of third octaves would run into one another.
    let every = if centers.len() > 10 { 3 } else { 1 };
    let ticks: Vec<f64> = centers.iter().copied().skip(every / 2).step_by(every).collect();
    let panel = |parameter: Parameter| {
        let (symbol, unit, factor) = parameter.heading();
        let series = receivers.iter().map(|(name, figures)| {
            let points = figures.bands.iter().map(|band| point(band, parameter, factor)).collect();
            Series::new(name.clone(), Mark::PointsAndLine, points)
        });
        Panel {
            title: String::new(),
            x: Axis::logarithmic("band [Hz]").with_ticks(ticks.clone()),
            y: Axis::linear(format!("{symbol} [{unit}]")),
            series: series.collect(),
        }
    };
    shown(receivers).into_iter().map(panel).collect()
}

fn point(band: &BandParameters, parameter: Parameter, factor: f64) -> Point {
    let (y, interval) = match band.parameter(parameter) {
        Ok(estimate) => {
            (factor * estimate.value, estimate.interval.as_ref().ok().map(|i| i.map(|end| factor * end)))
        }
        Err(_) => (f64::NAN, None),
    };
    Point { x: band.center_frequency_hz, y, interval }
}
