//! Sheets as SVG, drawn by plotters.
//!
//! plotters rounds to whole pixels, so a page is drawn on twice as many as it claims to have. Legends stand to the right of
//! their row, where they hide nothing.

use std::io::Write;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use thiserror::Error;

use super::axis::Ruler;
use super::{Mark, Panel, Point, Series, Sheet};

/// Why there is no drawing.
#[derive(Debug, Error)]
pub enum PlotError {
    /// The drawing library failed.
    #[error("cannot draw: {0}")]
    Drawing(String),
    /// The output cannot be written.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Ruler, Ruler>>;

/// Pixels drawn for each that the page claims to have.
const FINENESS: u32 = 2;
/// Width of a page [pixels].
const WIDTH: u32 = 1000;
/// Height of a panel in parts of its width, and its limits [pixels].
const HEIGHT_PER_WIDTH: f64 = 0.62;
const LOWEST: f64 = 240.0;
const HIGHEST: f64 = 430.0;
/// Sizes of the letters [pixels].
const TITLE: u32 = 19;
const CAPTION: u32 = 16;
const TEXT: u32 = 14;
/// Width of a letter in parts of its size, on average.
const LETTER: f64 = 0.62;
/// plotters takes the height of a line for the size of its letters.
const LINE_PER_LETTER: f64 = 1.24;
/// Width of a legend's sample and the gaps about it [pixels].
const SAMPLE: u32 = 42;
/// Length of the pieces of broken lines and of the gaps between them [pixels].
const DASH: [u32; 2] = [7, 4];

/// Colours that also the colour-blind tell apart (the palette of Okabe and Ito), black first.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 0, 0),
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// Writes `sheet` to `out` as SVG.
///
/// # Errors
/// When it cannot be drawn or written.
pub fn svg(sheet: &Sheet, out: &mut dyn Write) -> Result<(), PlotError> {
    let layouts: Vec<Row<'_>> = sheet.rows.iter().map(|panels| Row::new(panels)).collect();
    let title = if sheet.title.is_empty() { 0 } else { 2 * TITLE };
    let size = (WIDTH, title + layouts.iter().map(|row| row.height).sum::<u32>());
    let fine = (FINENESS * size.0, FINENESS * size.1.max(1));
    let mut text = String::new();
    draw(sheet, &layouts, title, &mut text, fine)
        .map_err(|error| PlotError::Drawing(format!("{error:?}")))?;
    let drawn = format!("<svg width=\"{}\" height=\"{}\"", fine.0, fine.1);
    let claimed = format!("<svg width=\"{}\" height=\"{}\"", size.0, size.1);
    out.write_all(text.replacen(&drawn, &claimed, 1).as_bytes())?;
    Ok(())
}

type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

fn draw(sheet: &Sheet, rows: &[Row<'_>], title: u32, text: &mut String, size: (u32, u32)) -> Drawn {
    let page = SVGBackend::with_string(text, size).into_drawing_area();
    page.fill(&WHITE)?;
    if title > 0 {
        let place = ((size.0 / 2) as i32, pixels(TITLE) / 2);
        page.draw(&Text::new(
            sheet.title.as_str(),
            place,
            letters(TITLE).pos(Pos::new(HPos::Center, VPos::Top)),
        ))?;
    }
    let mut rest = page.split_vertically(FINENESS * title).1;
    for row in rows {
        let (here, below) = rest.split_vertically(FINENESS * row.height);
        row.draw(&here)?;
        rest = below;
    }
    page.present()
}

/// A row with its legend.
struct Row<'a> {
    panels: &'a [Panel],
    /// Name and mark of every entry.
    entries: Vec<(&'a str, Mark)>,
    legend: u32,
    height: u32,
}

impl<'a> Row<'a> {
    fn new(panels: &'a [Panel]) -> Self {
        let mut entries: Vec<(&str, Mark)> = Vec::new();
        for series in panels.iter().flat_map(|panel| &panel.series) {
            if entries.iter().all(|(name, _)| *name != series.name) {
                entries.push((&series.name, series.mark));
            }
        }
        let longest = entries.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
        let legend = if longest == 0 { 0 } else { SAMPLE + text_width(longest, TEXT) };
        let width = f64::from(WIDTH.saturating_sub(legend)) / panels.len().max(1) as f64;
        let height = (HEIGHT_PER_WIDTH * width).clamp(LOWEST, HIGHEST) as u32;
        let lines = (entries.len() as u32 + 2) * TEXT * 3 / 2;
        Self { panels, entries, legend, height: height.max(lines) }
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let (panels, legend) = area.split_horizontally(FINENESS * (WIDTH - self.legend));
        for (panel, area) in self.panels.iter().zip(panels.split_evenly((1, self.panels.len().max(1)))) {
            self.draw_panel(panel, &area)?;
        }
        for (line, (name, mark)) in self.entries.iter().enumerate() {
            let y = pixels(CAPTION) * 5 / 2 + line as i32 * pixels(TEXT) * 3 / 2;
            let (from, to) = (pixels(4), pixels(SAMPLE - 10));
            let style = self.color(name).stroke_width(2 * FINENESS);
            match mark {
                Mark::Dashed => legend.draw(&DashedPathElement::new(
                    [(from, y), (to, y)],
                    DASH[0] * FINENESS,
                    DASH[1] * FINENESS,
                    style,
                ))?,
                Mark::Points => {}
                _ => legend.draw(&PathElement::new([(from, y), (to, y)], style))?,
            }
            if matches!(mark, Mark::Points | Mark::PointsAndLine) {
                legend.draw(&Circle::new(((from + to) / 2, y), pixels(3), style.filled()))?;
            }
            let left = letters(TEXT).pos(Pos::new(HPos::Left, VPos::Center));
            legend.draw(&Text::new(*name, (pixels(SAMPLE - 4), y), left))?;
        }
        Ok(())
    }

    /// The colour of the series called `name`: one of a few, or one of a ramp where there are many.
    fn color(&self, name: &str) -> RGBColor {
        let count = self.entries.len();
        let at = self.entries.iter().position(|(entry, _)| *entry == name).unwrap_or(0);
        match COLORS.get(at) {
            Some(&color) if count <= COLORS.len() => color,
            // The last tenth of the ramp is too bright for a white page.
            _ => ViridisRGB.get_color(0.9 * at as f64 / (count - 1).max(1) as f64),
        }
    }

    fn draw_panel(&self, panel: &Panel, area: &Area<'_>) -> Drawn {
        let points = || panel.series.iter().flat_map(|series| &series.points);
        let x = Ruler::new(&panel.x, points().map(|point| point.x));
        let values =
            |point: &Point| [Some(point.y), point.interval.map(|i| i[0]), point.interval.map(|i| i[1])];
        let y = Ruler::new(&panel.y, points().flat_map(values).flatten());
        let widest = y.ticks.iter().map(|&tick| y.label(tick).chars().count()).max().unwrap_or(0);
        let mut chart = ChartBuilder::on(area)
            .caption(&panel.title, letters(CAPTION))
            .margin(pixels(8))
            .x_label_area_size(pixels(TEXT * 3))
            .y_label_area_size(pixels(TEXT * 2 + 6 + text_width(widest, TEXT)))
            .build_cartesian_2d(x.clone(), y.clone())?;
        chart
            .configure_mesh()
            .label_style(letters(TEXT))
            .axis_desc_style(letters(TEXT))
            .x_desc(&panel.x.label)
            .y_desc(&panel.y.label)
            .x_label_formatter(&|tick| x.label(*tick))
            .y_label_formatter(&|tick| y.label(*tick))
            .bold_line_style(BLACK.mix(0.15))
            .light_line_style(TRANSPARENT)
            .set_all_tick_mark_size(pixels(4))
            .draw()?;
        for series in &panel.series {
            let color = self.color(&series.name);
            for run in runs(series, &x, &y) {
                draw_run(&mut chart, series.mark, &run, color)?;
            }
        }
        Ok(())
    }
}

impl Ranged for Ruler {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, coordinate: &f64, (first, last): (i32, i32)) -> i32 {
        let share = (coordinate - self.low) / (self.high - self.low);
        first + (share * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

/// A point in the coordinates of its axes.
struct Placed {
    at: (f64, f64),
    interval: Option<[f64; 2]>,
}

/// The points of `series` that both axes show, divided where they do not.
fn runs(series: &Series, x: &Ruler, y: &Ruler) -> Vec<Vec<Placed>> {
    let mut runs = vec![Vec::new()];
    for point in &series.points {
        let place = |ruler: &Ruler, value| ruler.coordinate(value).filter(|at| ruler.shows(*at));
        match place(x, point.x).zip(place(y, point.y)) {
            Some(at) => runs[0].push(Placed {
                at,
                interval: point.interval.map(|interval| interval.map(|value| y.clamped(value))),
            }),
            None if runs[0].is_empty() => {}
            None => runs.insert(0, Vec::new()),
        }
    }
    runs.retain(|run| !run.is_empty());
    runs.reverse();
    runs
}

fn draw_run(chart: &mut Chart<'_, '_>, mark: Mark, run: &[Placed], color: RGBColor) -> Drawn {
    let has_points = matches!(mark, Mark::Points | Mark::PointsAndLine);
    let line = || run.iter().map(|point| point.at);
    let stroke = color.stroke_width(FINENESS * 3 / 2);
    if !has_points {
        let upper = run.iter().filter_map(|point| Some((point.at.0, point.interval?[1])));
        let lower = run.iter().rev().filter_map(|point| Some((point.at.0, point.interval?[0])));
        let band: Vec<(f64, f64)> = upper.chain(lower).collect();
        if !band.is_empty() {
            chart.draw_series(std::iter::once(Polygon::new(band, color.mix(0.22))))?;
        }
    }
    match mark {
        Mark::Line | Mark::PointsAndLine => {
            chart.draw_series(LineSeries::new(line(), stroke))?;
        }
        Mark::Dashed => {
            chart.draw_series(DashedLineSeries::new(
                line(),
                DASH[0] * FINENESS,
                DASH[1] * FINENESS,
                stroke,
            ))?;
        }
        Mark::Points => {}
    }
    if has_points {
        chart.draw_series(line().map(|at| Circle::new(at, pixels(3), color.filled())))?;
        let bars = run.iter().filter_map(|point| {
            let ((x, y), [low, high]) = (point.at, point.interval?);
            Some(ErrorBar::new_vertical(x, low, y, high, color.stroke_width(FINENESS), FINENESS * 8))
        });
        chart.draw_series(bars)?;
    }
    Ok(())
}

fn letters(size: u32) -> TextStyle<'static> {
    ("sans-serif", LINE_PER_LETTER * f64::from(FINENESS * size)).into_text_style(&(0, 0))
}

fn text_width(letters: usize, size: u32) -> u32 {
    (LETTER * f64::from(size) * letters as f64) as u32
}

fn pixels(size: u32) -> i32 {
    (FINENESS * size) as i32
}
