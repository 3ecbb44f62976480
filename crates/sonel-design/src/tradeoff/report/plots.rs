//! A sweep as plots: a panel a parameter, a series a setting.

use sonel_analysis::Parameter;
use sonel_drawing::plot::{Axis, Mark, Panel, Point as Dot, Series, Sheet};

use super::Findings;
use crate::tradeoff::errors::{self, Curve, Point};
use crate::tradeoff::fit::Measured;
use crate::tradeoff::sweep::JUDGED;

/// Panels side by side.
const COLUMNS: usize = 2;

/// Standard deviation over CPU seconds, log–log.
#[must_use]
pub fn deviation(findings: &Findings<'_>) -> Sheet {
    sheet(findings, "Standard deviation over CPU seconds", |parameter| {
        panel(findings, parameter, Axis::logarithmic, "standard deviation", "", |point| {
            (point.mean_seconds(None), point.measured_deviation())
        })
    })
}

/// Bias over CPU seconds.
#[must_use]
pub fn bias(findings: &Findings<'_>) -> Sheet {
    sheet(findings, "Bias over CPU seconds", |parameter| {
        panel(findings, parameter, Axis::linear, "bias", "", |point| (point.mean_seconds(None), point.bias()))
    })
}

/// Efficiency over packets.
#[must_use]
pub fn efficiency(findings: &Findings<'_>) -> Sheet {
    sheet(findings, "Efficiency: 1/(variance × CPU seconds)", |parameter| {
        let found = panel(findings, parameter, Axis::logarithmic, "efficiency", "efficiency", |point| {
            (point.packets as f64, point.efficiency())
        });
        Panel { x: Axis::logarithmic("packets"), ..found }
    })
}

/// CPU seconds over packets.
#[must_use]
pub fn cost(findings: &Findings<'_>) -> Sheet {
    let of_level = findings.curves.iter().filter(|curve| curve.parameter == JUDGED[0]);
    let series = of_level.map(|curve| {
        let dots = curve.points.iter().map(|point| dot(point.packets as f64, point.measured_seconds()));
        Series::new(findings.name(curve.setting), Mark::PointsAndLine, dots.collect())
    });
    Sheet::single(Panel {
        title: format!("{}: CPU seconds of tracing and rendering", findings.tradeoff.scene),
        x: Axis::logarithmic("packets"),
        y: Axis::logarithmic("CPU seconds [s]"),
        series: series.collect(),
    })
}

fn sheet(findings: &Findings<'_>, title: &str, panel: impl Fn(Parameter) -> Panel) -> Sheet {
    let panels: Vec<Panel> = JUDGED.map(panel).into();
    Sheet::new(
        format!("{}: {title}", findings.tradeoff.scene),
        panels.chunks(COLUMNS).map(<[Panel]>::to_vec).collect(),
    )
}

fn panel(
    findings: &Findings<'_>,
    parameter: Parameter,
    y_axis: impl Fn(String) -> Axis,
    what: &str,
    of: &str,
    place: impl Fn(&Point) -> (f64, Option<Measured>),
) -> Panel {
    let unit = errors::unit(parameter);
    let unit = if of.is_empty() { unit.to_owned() } else { format!("1/({unit}² s)") };
    let series = |curve: &Curve| {
        let dots = curve.points.iter().map(&place).map(|(x, measured)| dot(x, measured)).collect();
        Series::new(findings.name(curve.setting), Mark::PointsAndLine, dots)
    };
    Panel {
        title: parameter.heading().0.to_owned(),
        x: Axis::logarithmic("CPU seconds [s]"),
        y: y_axis(format!("{what} [{unit}]")),
        series: findings.curves.iter().filter(|curve| curve.parameter == parameter).map(series).collect(),
    }
}

fn dot(x: f64, measured: Option<Measured>) -> Dot {
    Dot {
        x,
        y: measured.map_or(f64::NAN, |measured| measured.value),
        interval: measured.and_then(|measured| measured.interval),
    }
}
