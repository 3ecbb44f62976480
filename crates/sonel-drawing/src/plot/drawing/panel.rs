//! Rows of panels with a legend to their right, where it hides nothing.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::axis::Ruler;
use super::super::{Mark, Panel, Point, Series};
use super::{Area, CAPTION, Chart, Drawn, FINENESS, TEXT, WIDTH, fine, letters, text_width};

/// Height of a panel in parts of its width, and its limits [pixels].
const HEIGHT_PER_WIDTH: f64 = 0.62;
const LOWEST: f64 = 240.0;
const HIGHEST: f64 = 430.0;
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

/// A row with its legend.
pub(super) struct PanelRow<'a> {
    panels: &'a [Panel],
    /// Name and mark of every entry.
    entries: Vec<(&'a str, Mark)>,
    legend: u32,
    /// Height of the row [pixels].
    pub height: u32,
}

impl<'a> PanelRow<'a> {
    pub(super) fn new(panels: &'a [Panel]) -> Self {
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

    pub(super) fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Drawn<B> {
        let (panels, legend) = area.split_horizontally(FINENESS * (WIDTH - self.legend));
        for (panel, area) in self.panels.iter().zip(panels.split_evenly((1, self.panels.len().max(1)))) {
            self.draw_panel(panel, &area)?;
        }
        for (line, (name, mark)) in self.entries.iter().enumerate() {
            let y = fine(CAPTION) * 5 / 2 + line as i32 * fine(TEXT) * 3 / 2;
            let (from, to) = (fine(4), fine(SAMPLE - 10));
            let style = self.color(name).stroke_width(2 * FINENESS);
            match mark {
                Mark::Dashed => legend.draw(&DashedPathElement::new(
                    [(from, y), (to, y)],
                    DASH[0] * FINENESS,
                    DASH[1] * FINENESS,
                    style,
                ))?,
                Mark::Points | Mark::Stems => {}
                _ => legend.draw(&PathElement::new([(from, y), (to, y)], style))?,
            }
            if mark.has_points() {
                legend.draw(&Circle::new(((from + to) / 2, y), fine(3), style.filled()))?;
            }
            let left = letters(TEXT).pos(Pos::new(HPos::Left, VPos::Center));
            legend.draw(&Text::new(*name, (fine(SAMPLE - 4), y), left))?;
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

    fn draw_panel<B: DrawingBackend>(&self, panel: &Panel, area: &Area<B>) -> Drawn<B> {
        let points = || panel.series.iter().flat_map(|series| &series.points);
        let x = Ruler::new(&panel.x, points().map(|point| point.x));
        let values =
            |point: &Point| [Some(point.y), point.interval.map(|i| i[0]), point.interval.map(|i| i[1])];
        let y = Ruler::new(&panel.y, points().flat_map(values).flatten());
        let widest = y.ticks.iter().map(|&tick| y.label(tick).chars().count()).max().unwrap_or(0);
        let mut chart = ChartBuilder::on(area)
            .caption(&panel.title, letters(CAPTION))
            .margin(fine(8))
            .x_label_area_size(fine(TEXT * 3))
            .y_label_area_size(fine(TEXT * 2 + 6 + text_width(widest, TEXT)))
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
            .set_all_tick_mark_size(fine(4))
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

fn draw_run<B: DrawingBackend>(
    chart: &mut Chart<'_, B>,
    mark: Mark,
    run: &[Placed],
    color: RGBColor,
) -> Drawn<B> {
    let line = || run.iter().map(|point| point.at);
    let stroke = color.stroke_width(FINENESS * 3 / 2);
    if !mark.has_points() {
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
        Mark::Stems => {
            let bottom = chart.y_range().start;
            let stem = |at: (f64, f64)| PathElement::new([(at.0, bottom), at], stroke);
            chart.draw_series(line().map(stem))?;
        }
        Mark::Points => {}
    }
    if mark.has_points() {
        chart.draw_series(line().map(|at| Circle::new(at, fine(3), color.filled())))?;
        let bars = run.iter().filter_map(|point| {
            let ((x, y), [low, high]) = (point.at, point.interval?);
            Some(ErrorBar::new_vertical(x, low, y, high, color.stroke_width(FINENESS), FINENESS * 8))
        });
        chart.draw_series(bars)?;
    }
    Ok(())
}
