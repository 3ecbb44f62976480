//! Axes: range, ticks and their labels.
//!
//! Ticks are at 1, 2 or 5 times a power of ten. A logarithmic axis is drawn on the logarithm of its values; where it spans
//! little more than a factor of two its ticks are those of a linear one.

use serde::Serialize;

/// How an axis maps values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// Evenly in the logarithm: values above zero only.
    Logarithmic,
}

/// An axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Axis {
    /// Quantity and unit, such as "time [s]".
    pub label: String,
    /// How it maps values.
    pub scale: Scale,
    /// First and last value shown; from the values where none is given.
    pub range: Option<[f64; 2]>,
    /// Where the ticks are; chosen where none are given.
    pub ticks: Option<Vec<f64>>,
}

impl Axis {
    /// An evenly divided axis.
    #[must_use]
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: Scale::Linear, range: None, ticks: None }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn logarithmic(label: impl Into<String>) -> Self {
        Self { scale: Scale::Logarithmic, ..Self::linear(label) }
    }

    /// The same from `low` to `high`.
    #[must_use]
    pub fn from_to(self, low: f64, high: f64) -> Self {
        Self { range: Some([low, high]), ..self }
    }

    /// The same with ticks at `values`.
    #[must_use]
    pub fn with_ticks(self, values: Vec<f64>) -> Self {
        Self { ticks: Some(values), ..self }
    }
}

/// Ticks wished for on an axis.
const TICKS: f64 = 6.0;
/// Decades from which on only powers of ten have labels.
const MANY_DECADES: f64 = 2.8;
/// Decades below which the ticks are those of a linear axis.
const FEW_DECADES: f64 = 0.5;
/// Part of the axis left free beyond the values on either side.
const MARGIN: f64 = 0.05;

/// An axis with its range settled, in the coordinate it is drawn on: the value or its decadic logarithm.
#[derive(Debug, Clone)]
pub(crate) struct Ruler {
    scale: Scale,
    /// First coordinate.
    pub low: f64,
    /// Last coordinate.
    pub high: f64,
    /// Coordinates with a label.
    pub ticks: Vec<f64>,
    /// Smallest difference between ticks that labels tell apart.
    step: f64,
}

impl Ruler {
    /// For `axis` and all its `values`.
    pub(crate) fn new(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let coordinate = |value| coordinate(axis.scale, value);
        let (mut low, mut high) = match axis.range {
            Some([low, high]) => (coordinate(low).unwrap_or(0.0), coordinate(high).unwrap_or(1.0)),
            None => padded(values.filter_map(coordinate)),
        };
        if high <= low {
            (low, high) = (low - 0.5, high + 0.5);
        }
        let (ticks, step) = match &axis.ticks {
            Some(ticks) => (ticks.clone(), 0.0),
            None => ticks(axis.scale, low, high),
        };
        let (near, far) = (low - ROUNDING * (high - low), high + ROUNDING * (high - low));
        let inside = |tick: &f64| (near..=far).contains(tick);
        Self {
            scale: axis.scale,
            low,
            high,
            ticks: ticks.into_iter().filter_map(coordinate).filter(inside).collect(),
            step,
        }
    }

    /// Where `value` is drawn, also beyond the range; none where the axis cannot show it.
    pub(crate) fn coordinate(&self, value: f64) -> Option<f64> {
        coordinate(self.scale, value)
    }

    /// Where `value` is drawn, or the end of the axis that lies nearest to it.
    pub(crate) fn clamped(&self, value: f64) -> f64 {
        let beyond = if value > 0.0 { self.high } else { self.low };
        self.coordinate(value).unwrap_or(beyond).clamp(self.low, self.high)
    }

    /// Whether `coordinate` lies on the axis.
    pub(crate) fn shows(&self, coordinate: f64) -> bool {
        let slack = ROUNDING * (self.high - self.low);
        (self.low - slack..=self.high + slack).contains(&coordinate)
    }

    /// A value between the ticks of a linear axis, with one decimal more than they have.
    pub(crate) fn fine_label(&self, value: f64) -> String {
        label(value, 0.1 * self.step)
    }

    /// The label of the tick at `coordinate`.
    pub(crate) fn label(&self, coordinate: f64) -> String {
        let value = match self.scale {
            Scale::Linear => coordinate,
            Scale::Logarithmic => libm::exp10(coordinate),
        };
        label(value, self.step)
    }
}

/// Part of a range that is rounding.
const ROUNDING: f64 = 1e-9;

fn coordinate(scale: Scale, value: f64) -> Option<f64> {
    let coordinate = match scale {
        Scale::Linear => value,
        Scale::Logarithmic if value > 0.0 => libm::log10(value),
        Scale::Logarithmic => return None,
    };
    coordinate.is_finite().then_some(coordinate)
}

/// Range of `coordinates` with a margin; 0 to 1 where there are none.
fn padded(coordinates: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = coordinates.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), coordinate| {
        (low.min(coordinate), high.max(coordinate))
    });
    if low > high {
        return (0.0, 1.0);
    }
    let margin = if high > low { MARGIN * (high - low) } else { 0.1 * high.abs().max(0.1) };
    (low - margin, high + margin)
}

/// Values with ticks between the coordinates `low` and `high`, and the least difference between them.
fn ticks(scale: Scale, low: f64, high: f64) -> (Vec<f64>, f64) {
    let decades = high - low;
    match scale {
        Scale::Linear => even_ticks(low, high),
        Scale::Logarithmic if decades < FEW_DECADES => even_ticks(libm::exp10(low), libm::exp10(high)),
        Scale::Logarithmic => {
            let mantissas: &[f64] = if decades < MANY_DECADES { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let stride = (decades / 9.0).ceil().max(1.0) as i32;
            let exponents = (low.floor() as i32..=high.ceil() as i32).filter(|e| e.rem_euclid(stride) == 0);
            let tick = |e: i32| mantissas.iter().map(move |m| m * libm::exp10(f64::from(e)));
            (exponents.flat_map(tick).collect(), 0.0)
        }
    }
}

fn even_ticks(low: f64, high: f64) -> (Vec<f64>, f64) {
    let wished = (high - low) / TICKS;
    let power = libm::exp10(libm::log10(wished).floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|step| *step >= wished);
    let step = step.unwrap_or(10.0 * power);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    ((first..=last).map(|n| n as f64 * step).collect(), step)
}

/// `value` as people write it; `step` is the least difference to other labels, or 0 where labels differ by factors.
fn label(value: f64, step: f64) -> String {
    let size = value.abs();
    if step > 0.0 && size < 1e4 && step >= 1e-4 {
        let decimals = (-libm::log10(step) - ROUNDING).ceil().max(0.0) as usize;
        // No minus before a zero.
        return format!("{:.decimals$}", if size < 0.5 * step { 0.0 } else { value }).replace('-', "−");
    }
    match size {
        0.0 => "0".to_owned(),
        1e9.. | ..1e-3 => power_of_ten(value),
        1e6.. => format!("{}M", trimmed(value / 1e6)),
        1e3.. => format!("{}k", trimmed(value / 1e3)),
        _ => trimmed(value),
    }
}

/// `value` to six significant places without trailing zeros.
fn trimmed(value: f64) -> String {
    let places = (5.0 - libm::log10(value.abs()).floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.places$}").replace('-', "−");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn power_of_ten(value: f64) -> String {
    let exponent = (libm::log10(value.abs()) + ROUNDING).floor();
    let mantissa = trimmed(value / libm::exp10(exponent));
    let raise = |plain: char| "-0123456789".find(plain).and_then(|index| "⁻⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(index));
    let raised: String = exponent.to_string().chars().filter_map(raise).collect();
    if mantissa == "1" { format!("10{raised}") } else { format!("{mantissa}·10{raised}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, values: &[f64]) -> Vec<String> {
        let ruler = Ruler::new(axis, values.iter().copied());
        ruler.ticks.iter().map(|&tick| ruler.label(tick)).collect()
    }

    #[test]
    fn ticks_are_round_and_labels_tell_them_apart() {
        let linear = Axis::linear("");
        assert_eq!(labels(&linear, &[0.0, 1.0]), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(&linear, &[-31.52, -31.44]), ["−31.52", "−31.50", "−31.48", "−31.46", "−31.44"]);
        let log = Axis::logarithmic("");
        assert_eq!(labels(&log, &[1e-5, 10.0]), ["10⁻⁵", "10⁻⁴", "0.001", "0.01", "0.1", "1", "10"]);
        assert_eq!(labels(&log, &[1e4, 2e6])[..4], ["10k", "20k", "50k", "100k"]);
        assert_eq!(labels(&log, &[2.0, 2.4]), ["2.0", "2.1", "2.2", "2.3", "2.4"]);
        let bands = Axis::logarithmic("").with_ticks(vec![125.0, 1000.0, 4000.0]);
        assert_eq!(labels(&bands, &[125.0, 4000.0]), ["125", "1k", "4k"]);
    }

    #[test]
    fn what_an_axis_cannot_show_does_not_reach_its_range() {
        let ruler = Ruler::new(&Axis::logarithmic(""), [0.0, -3.0, f64::NAN, 1.0, 100.0].into_iter());
        assert!(ruler.low > -0.2 && ruler.high < 2.2);
        assert_eq!(ruler.coordinate(0.0), None);
        assert!((ruler.clamped(0.0) - ruler.low).abs() < 1e-12);
        let empty = Ruler::new(&Axis::linear(""), std::iter::empty());
        assert!(empty.low < empty.high);
        let single = Ruler::new(&Axis::linear(""), [7.0].into_iter());
        assert!(single.low < 7.0 && single.high > 7.0 && !single.ticks.is_empty());
    }
}
