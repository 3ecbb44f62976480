//! Line plots with intervals and plans, as SVG or PNG, and what they show of a response.
//!
//! A [`Sheet`] has rows of [`Panel`]s, a panel has two axes and any number of [`Series`]; [`svg()`] and [`png()`] draw it. Series of one name
//! have one colour and one entry in the legend of their row. Values that an axis cannot show (missing ones, those outside of its
//! range, zero and less on a logarithmic axis) leave a gap. Intervals are bars where a series has points, and bands where it is a line.
//!
//! [`echogram`], [`decay`], [`early`] and [`parameters`] are panels of a response. Below them stand [`Plans`]: a value at each of many places, in
//! colours, and walls as lines. Drawings are for eyes: they are no artifact that is
//! compared bit by bit, and the library that draws them rounds to hundredths of the page.

pub(crate) mod axis;
pub(crate) mod drawing;
mod early;
mod parameters;
mod plan;
mod response;
#[cfg(test)]
mod tests;

use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

pub use axis::{Axis, Scale};
pub use drawing::{PlotError, png, svg};
pub use early::{Arrival, arrivals, class_name, early, shown_ms};
pub use parameters::{parameters, shown};
pub use plan::{Plan, PlanPoint, Plans, Spot};
pub use response::{decay, echogram};

/// A value and where the true one lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// In the unit of the x axis.
    pub x: f64,
    /// In the unit of the y axis; not finite where there is none.
    pub y: f64,
    /// 95 % interval about `y`, in its unit.
    pub interval: Option<[f64; 2]>,
}

impl Point {
    /// A value without interval.
    #[must_use]
    pub fn new(x: f64, y: f64) -> Self {
        Self { x, y, interval: None }
    }

    /// A value with the half-width of its interval.
    #[must_use]
    pub fn within(x: f64, y: f64, half_width: f64) -> Self {
        Self { x, y, interval: Some([y - half_width, y + half_width]) }
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Mark {
    /// A line; intervals are a band.
    Line,
    /// A broken line, for what is computed rather than measured; intervals are a band.
    Dashed,
    /// Points; intervals are bars.
    Points,
    /// Points joined by a line; intervals are bars.
    PointsAndLine,
    /// Points, each on a line from the bottom of the panel.
    Stems,
}

impl Mark {
    /// Whether it shows points; intervals are then bars.
    #[must_use]
    pub fn has_points(self) -> bool {
        matches!(self, Self::Points | Self::PointsAndLine | Self::Stems)
    }
}

/// Values that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its entry in the legend.
    pub name: String,
    /// How it is drawn.
    pub mark: Mark,
    /// In the order in which they are joined.
    pub points: Vec<Point>,
}

impl Series {
    /// A series called `name`.
    #[must_use]
    pub fn new(name: impl Into<String>, mark: Mark, points: Vec<Point>) -> Self {
        Self { name: name.into(), mark, points }
    }
}

/// In JSON columns: `name`, `mark`, `x`, `y`, and the ends `low` and `high` of the intervals; what there is not, or is not finite, is null. Values have the
/// digits that a screen shows.
impl Serialize for Series {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let rounded = |value: f64, steps: f64| (steps * value).round() / steps;
        let shown = |value: f64| rounded(value, if value.abs() < 10.0 { 1e3 } else { 10.0 });
        let column = |of: &dyn Fn(&Point) -> f64| -> Vec<f64> {
            self.points.iter().map(|point| shown(of(point))).collect()
        };
        let end = |index: usize| column(&|point| point.interval.map_or(f64::NAN, |interval| interval[index]));
        let mut columns = serializer.serialize_struct("Series", 6)?;
        columns.serialize_field("name", &self.name)?;
        columns.serialize_field("mark", &self.mark)?;
        let x: Vec<f64> = self.points.iter().map(|point| rounded(point.x, 1e4)).collect();
        columns.serialize_field("x", &x)?;
        columns.serialize_field("y", &column(&|point| point.y))?;
        columns.serialize_field("low", &end(0))?;
        columns.serialize_field("high", &end(1))?;
        columns.end()
    }
}

/// A pair of axes and what is drawn between them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// Along.
    pub x: Axis,
    /// Up.
    pub y: Axis,
    /// In drawing order.
    pub series: Vec<Series>,
}

/// A page.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sheet {
    /// Above everything.
    pub title: String,
    /// From top to bottom; panels of a row share its width.
    pub rows: Vec<Vec<Panel>>,
    /// Below the rows.
    pub plans: Option<Plans>,
}

impl Sheet {
    /// A page of rows of panels.
    #[must_use]
    pub fn new(title: impl Into<String>, rows: Vec<Vec<Panel>>) -> Self {
        Self { title: title.into(), rows, plans: None }
    }

    /// A page of one panel, which bears the title itself.
    #[must_use]
    pub fn single(panel: Panel) -> Self {
        Self::new("", vec![vec![panel]])
    }
}
