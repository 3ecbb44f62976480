//! Panels as charts of plotly.js.

use serde_json::{Value, json};
use sonel_drawing::plot::{Axis, Mark, Panel, Scale, Series};

use super::document::escaped;

/// Colours of series, those of plotly.js.
const COLORS: [&str; 10] = [
    "#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22",
    "#17becf",
];

/// Colour of a series by its index.
pub fn color(index: usize) -> &'static str {
    COLORS[index % COLORS.len()]
}

/// A panel: lines with bands, points with bars.
pub fn of(panel: &Panel) -> Value {
    // Just below what is shown.
    let floor = panel.y.range.map_or(f64::MIN, |[low, high]| low - 0.1 * (high - low));
    let data: Vec<Value> = panel
        .series
        .iter()
        .enumerate()
        .flat_map(|(index, series)| traces(series, color(index), floor))
        .collect();
    json!({ "data": data, "layout": layout(&panel.title, axis(&panel.x), axis(&panel.y)) })
}

/// A layout with two axes.
pub fn layout(title: &str, x: Value, y: Value) -> Value {
    json!({
        "title": { "text": escaped(title), "font": { "size": 15 } },
        "margin": { "l": 60, "r": 10, "t": 40, "b": 55 },
        "hovermode": "closest", "xaxis": x, "yaxis": y,
    })
}

fn axis(axis: &Axis) -> Value {
    let is_logarithmic = axis.scale == Scale::Logarithmic;
    let mut value = json!({ "title": { "text": escaped(&axis.label) }, "type": if is_logarithmic { "log" } else { "linear" } });
    if let Some(ticks) = &axis.ticks {
        value["tickvals"] = json!(ticks);
        value["ticktext"] = json!(ticks.iter().map(ToString::to_string).collect::<Vec<_>>());
    }
    if let Some(range) = axis.range {
        value["range"] = json!(range.map(|end| if is_logarithmic { end.log10() } else { end }));
    }
    value
}

/// Four decimals are more than a screen shows; what is no number leaves a gap.
pub fn rounded(value: f64) -> Value {
    json!((value * 1e4).round() / 1e4)
}

fn column(series: &Series, of: impl Fn(&sonel_drawing::plot::Point) -> f64) -> Vec<Value> {
    series.points.iter().map(|point| rounded(of(point))).collect()
}

fn traces(series: &Series, color: &str, floor: f64) -> Vec<Value> {
    let (x, y) = (column(series, |point| point.x), column(series, |point| point.y));
    let name = escaped(&series.name);
    let mut line = json!({ "type": "scatter", "name": name, "legendgroup": name, "x": x, "y": y, "line": { "color": color } });
    line["mode"] = json!(match series.mark {
        Mark::Line | Mark::Dashed => "lines",
        Mark::Points | Mark::Stems => "markers",
        Mark::PointsAndLine => "lines+markers",
    });
    if series.mark == Mark::Dashed {
        line["line"]["dash"] = json!("dash");
    }
    if series.mark == Mark::Stems {
        let stems = column(series, |point| point.y - floor);
        line["error_y"] = json!({ "type": "data", "symmetric": false, "array": vec![0; stems.len()], "arrayminus": stems, "color": color, "width": 0 });
        return vec![line];
    }
    if series.points.iter().all(|point| point.interval.is_none()) {
        return vec![line];
    }
    if series.mark.has_points() {
        let beside = |sign: f64, index: usize| {
            column(series, |point| {
                point.interval.map_or(f64::NAN, |interval| sign * (interval[index] - point.y))
            })
        };
        line["error_y"] = json!({ "type": "data", "symmetric": false, "array": beside(1.0, 1), "arrayminus": beside(-1.0, 0), "color": color });
        return vec![line];
    }
    let [low, high] = band(series, color, floor);
    vec![low, high, line]
}

/// The band of a line's intervals: its lower end, and its upper end filled down to that. A lower end without energy is at the `floor`.
fn band(series: &Series, color: &str, floor: f64) -> [Value; 2] {
    let intervals = series.points.iter().filter_map(|point| Some((point.x, point.interval?)));
    let seen: Vec<(f64, [f64; 2])> = intervals.filter(|(_, [_, high])| high.is_finite()).collect();
    let edge = |index: usize, fill: &str| {
        let y: Vec<Value> = seen.iter().map(|(_, interval)| rounded(interval[index].max(floor))).collect();
        let x: Vec<Value> = seen.iter().map(|(x, _)| rounded(*x)).collect();
        json!({
            "type": "scatter", "mode": "lines", "x": x, "y": y, "fill": fill, "fillcolor": format!("{color}33"),
            "line": { "width": 0, "color": color }, "legendgroup": escaped(&series.name), "showlegend": false, "hoverinfo": "skip",
        })
    };
    [edge(0, "none"), edge(1, "tonexty")]
}
