//! Panels as charts of plotly.js.

use serde_json::{Value, json};
use sonel::drawing::plot::{Axis, Mark, Panel, Scale, Series};

use super::document::{color, escaped};

/// A panel: lines with bands, points with bars.
pub(super) fn of(panel: &Panel) -> Value {
    let floor = panel.y.range.map_or(f64::MIN, |[low, _]| low);
    let mut x = axis(&panel.x);
    if panel.x.range.is_none()
        && let Some(end) = last_shown(panel)
    {
        x["range"] = json!([0.0, end]);
    }
    let mut data: Vec<Value> = panel
        .series
        .iter()
        .enumerate()
        .flat_map(|(index, series)| traces(series, color(index), floor))
        .collect();
    share_abscissas(&mut data);
    json!({ "data": data, "layout": layout(&panel.title, x, axis(&panel.y)) })
}

/// Where the last of the lines falls below the range of the ordinate.
fn last_shown(panel: &Panel) -> Option<f64> {
    let [low, _] = panel.y.range?;
    let points = panel.series.iter().flat_map(|series| &series.points);
    points.filter(|point| point.y >= low).map(|point| point.x).max_by(f64::total_cmp)
}

/// Puts the number of an earlier trace in place of abscissas that are the same; `drawChart` puts them back.
fn share_abscissas(data: &mut [Value]) {
    for at in 1..data.len() {
        let (earlier, later) = data.split_at_mut(at);
        let own = &later[0]["x"];
        let same = |trace: &Value| own.is_array() && trace["x"] == *own;
        if let Some(first) = earlier.iter().position(same) {
            later[0]["x"] = json!(first);
        }
    }
}

/// A layout with two axes.
pub(super) fn layout(title: &str, x: Value, y: Value) -> Value {
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
pub(super) fn rounded(value: f64) -> Value {
    json!((value * 1e4).round() / 1e4)
}

fn column(series: &Series, of: impl Fn(&sonel::drawing::plot::Point) -> f64) -> Vec<Value> {
    series.points.iter().map(|point| rounded(of(point))).collect()
}

/// Fewest points of a line at equal distances that are stated by the first and their distance.
const MANY: usize = 50;

/// A trace with the abscissas `x`: each of them, or first and distance of many at equal distances.
fn at(x: &[f64], mut trace: Value) -> Value {
    let step =
        x.last().zip(x.first()).map_or(0.0, |(last, first)| (last - first) / (x.len().max(2) - 1) as f64);
    let is_even = |(index, value): (usize, &f64)| (value - x[0] - step * index as f64).abs() < 1e-3 * step;
    if x.len() >= MANY && x.iter().enumerate().all(is_even) {
        (trace["x0"], trace["dx"]) = (json!(x[0]), json!(step));
    } else {
        trace["x"] = x.iter().map(|x| rounded(*x)).collect();
    }
    trace
}

/// An ordinate of a line: of what has two digits before the point, a screen shows no hundredths.
fn ordinate(value: f64) -> Value {
    if value.abs() < 10.0 { rounded(value) } else { json!((value * 10.0).round() / 10.0) }
}

fn traces(series: &Series, color: &str, floor: f64) -> Vec<Value> {
    let x: Vec<f64> = series.points.iter().map(|point| point.x).collect();
    let y: Vec<Value> = series.points.iter().map(|point| ordinate(point.y)).collect();
    let name = escaped(&series.name);
    let line =
        json!({ "type": "scatter", "name": name, "legendgroup": name, "y": y, "line": { "color": color } });
    let mut line = at(&x, line);
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
        // Else a stem is read as an error.
        line["hovertemplate"] = json!("%{x:.1f}, %{y:.1f}");
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

/// The band of a line's intervals, as far as the line is shown: its lower end, and its upper end filled down to that. A lower end without energy is
/// at the `floor`.
fn band(series: &Series, color: &str, floor: f64) -> [Value; 2] {
    let shown = series.points.iter().filter(|point| point.y >= floor);
    let seen: Vec<(f64, [f64; 2])> = shown
        .filter_map(|point| Some((point.x, point.interval?)))
        .filter(|(_, [_, high])| high.is_finite())
        .collect();
    let edge = |index: usize, fill: &str| {
        let y: Vec<Value> = seen.iter().map(|(_, interval)| ordinate(interval[index].max(floor))).collect();
        let x: Vec<f64> = seen.iter().map(|(x, _)| *x).collect();
        let line = json!({
            "type": "scatter", "mode": "lines", "y": y, "fill": fill, "fillcolor": format!("{color}33"),
            "line": { "width": 0, "color": color }, "legendgroup": escaped(&series.name), "showlegend": false, "hoverinfo": "skip",
        });
        at(&x, line)
    };
    [edge(0, "none"), edge(1, "tonexty")]
}

#[cfg(test)]
mod tests {
    use sonel::drawing::plot::Point;

    use super::*;

    #[test]
    fn band_and_axis_end_with_the_line() {
        let point = |i: u32| {
            let (x, y) = (0.1 * f64::from(i), -10.0 * f64::from(i));
            // Far below, where little energy is left, an interval is wide.
            Point { x, y, interval: Some([y - 5.0, if i > 7 { 0.0 } else { y + 5.0 }]) }
        };
        let series = vec![Series::new("1000 Hz".to_owned(), Mark::Line, (0..20).map(point).collect())];
        let y = Axis::linear("level [dB]").from_to(-70.0, 2.0);
        let chart = of(&Panel { title: String::new(), x: Axis::linear("time [s]"), y, series });
        let end = chart["layout"]["xaxis"]["range"][1].as_f64().unwrap();
        assert!((end - 0.7).abs() < 1e-9, "{end}");
        let high = chart["data"][1]["y"].as_array().unwrap();
        assert!(high.len() == 8 && high[7] == -65.0, "{high:?}");
    }
}
