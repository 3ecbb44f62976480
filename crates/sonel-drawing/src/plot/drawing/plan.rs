//! A row of plans to one scale, with the bar of their colours to the right.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::Axis;
use super::super::axis::Ruler;
use super::super::plan::{Plan, Plans, Spot};
use super::{Area, CAPTION, Chart, Drawn, FINENESS, TEXT, WIDTH, fine, letters, text_width};

/// Height of a plan at most, without its labels [pixels].
const HIGHEST: f64 = 620.0;
/// Gap about a plan, and between the bar and what is beside it [pixels].
const GAP: u32 = 12;
/// Width of the bar [pixels].
const BAR: u32 = 20;
/// Part of the extents left free about them.
const MARGIN: f64 = 0.04;
/// Dots up to which values stand beside them.
const MOST_LABELS: usize = 40;
/// Radius of a dot [pixels].
const DOT: u32 = 7;
/// Colour of what has no value.
const NOTHING: RGBColor = RGBColor(200, 200, 200);
/// Colour of sources: not one of the ramp.
const SOURCE: RGBColor = RGBColor(213, 94, 0);
/// Radius of the mark of a source [pixels].
const SOURCE_MARK: u32 = 8;

/// Plans and the places they take.
pub(crate) struct PlanRow<'a> {
    plans: &'a Plans,
    scale: Ruler,
    /// Lower and upper corner of all plans [m].
    extents: [[f64; 2]; 2],
    /// Between borders of plans, their labels and gaps included [pixels].
    width: u32,
    /// Size of the plans themselves [pixels].
    size: [u32; 2],
    /// Height of the row [pixels].
    pub height: u32,
}

impl<'a> PlanRow<'a> {
    pub(crate) fn new(plans: &'a Plans) -> Self {
        let values = plans.each.iter().flat_map(|plan| &plan.spots).filter_map(|spot| spot.value);
        let scale = Ruler::new(&plans.scale, values);
        let longest = scale.ticks.iter().map(|&tick| scale.label(tick).chars().count()).max().unwrap_or(0);
        let label = text_width(plans.scale.label.chars().count(), TEXT);
        let bar = (2 * GAP + BAR + text_width(longest, TEXT)).max(GAP + label);
        let extents = extents(&plans.each);
        let [across, up] = [0, 1].map(|axis| extents[1][axis] - extents[0][axis]);
        let width = (WIDTH - bar) / plans.each.len().max(1) as u32;
        let free = f64::from(width.saturating_sub(LEFT + 2 * GAP).max(1));
        let pixels_per_metre = (free / across).min(HIGHEST / up);
        let size = [across, up].map(|extent| ((extent * pixels_per_metre).round() as u32).max(1));
        let height = (size[1] + TOP + BOTTOM).max(LEAST_HEIGHT);
        let title = plans.each.iter().map(|plan| text_width(plan.title.chars().count(), CAPTION)).max();
        let width = (GAP + LEFT + size[0].max(title.unwrap_or(0)) + GAP).min(width);
        Self { plans, scale, extents, width, size, height }
    }

    pub(crate) fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Drawn<B> {
        let (plans, bar) = area.split_horizontally(FINENESS * self.width * self.plans.each.len() as u32);
        for (number, plan) in (0..).zip(&self.plans.each) {
            let (_, rest) = plans.split_horizontally(FINENESS * number * self.width);
            let (own, _) = rest.split_horizontally(FINENESS * self.width);
            self.draw_plan(plan, &own)?;
        }
        self.draw_bar(&bar)
    }

    fn draw_plan<B: DrawingBackend>(&self, plan: &Plan, area: &Area<B>) -> Drawn<B> {
        let title = letters(CAPTION).pos(Pos::new(HPos::Left, VPos::Top));
        let caption = shortened(&plan.title, self.width.saturating_sub(GAP + LEFT), CAPTION);
        area.draw(&Text::new(caption, (fine(GAP + LEFT), fine(GAP)), title))?;
        let right = self.width.saturating_sub(GAP + LEFT + self.size[0]);
        let below = self.height - TOP - BOTTOM - self.size[1];
        let ruler = |axis: usize| {
            let [low, high] = self.extents.map(|corner| corner[axis]);
            Ruler::new(&Axis::linear("").from_to(low, high), std::iter::empty())
        };
        let (x, y) = (thinned(ruler(0), self.size[0]), ruler(1));
        let mut chart = ChartBuilder::on(area)
            .margin_top(fine(TOP))
            .margin_left(fine(GAP))
            .margin_right(fine(right))
            .margin_bottom(fine(below))
            .x_label_area_size(fine(BOTTOM))
            .y_label_area_size(fine(LEFT))
            .build_cartesian_2d(x.clone(), y.clone())?;
        chart
            .configure_mesh()
            .disable_mesh()
            .label_style(letters(TEXT))
            .axis_desc_style(letters(TEXT))
            .x_desc(&plan.axes[0])
            .y_desc(&plan.axes[1])
            .x_label_formatter(&|tick| x.label(*tick))
            .y_label_formatter(&|tick| y.label(*tick))
            .set_all_tick_mark_size(fine(4))
            .draw()?;
        self.draw_contents(plan, &mut chart)
    }

    fn draw_contents<B: DrawingBackend>(&self, plan: &Plan, chart: &mut Chart<'_, B>) -> Drawn<B> {
        let point = |[x, y]: [f64; 2]| (x, y);
        for spot in &plan.spots {
            let color = spot.value.map_or(NOTHING, |value| self.color(value)).filled();
            match spot.cell {
                Some(corners) => {
                    chart.draw_series([Rectangle::new(corners.map(point), color)])?;
                }
                None => self.draw_dot(spot, plan.spots.len() <= MOST_LABELS, color, chart)?,
            }
        }
        let stroke = BLACK.stroke_width(FINENESS * 3 / 2);
        chart.draw_series(plan.walls.iter().map(|ends| PathElement::new(ends.map(point), stroke)))?;
        // A wider white mark below sets it off from all colours.
        for (color, width) in [(WHITE, 5), (SOURCE, 2)] {
            let mark = |at: &[f64; 2]| {
                Cross::new(point(*at), fine(SOURCE_MARK), color.stroke_width(FINENESS * width))
            };
            chart.draw_series(plan.sources.iter().map(mark))?;
        }
        Ok(())
    }

    /// A dot, where they are few with its value as text.
    fn draw_dot<B: DrawingBackend>(
        &self,
        spot: &Spot,
        is_labelled: bool,
        color: ShapeStyle,
        chart: &mut Chart<'_, B>,
    ) -> Drawn<B> {
        let at = (spot.at[0], spot.at[1]);
        let text = match spot.value {
            _ if !is_labelled => String::new(),
            Some(value) => self.scale.fine_label(value),
            None => "–".to_owned(),
        };
        let style = letters(TEXT).pos(Pos::new(HPos::Left, VPos::Center));
        let label = EmptyElement::at(at)
            + Circle::new((0, 0), fine(DOT), color)
            + Circle::new((0, 0), fine(DOT), BLACK.stroke_width(FINENESS / 2))
            + Text::new(text, (fine(DOT + 4), 0), style);
        chart.draw_series([label])?;
        Ok(())
    }

    fn draw_bar<B: DrawingBackend>(&self, area: &Area<B>) -> Drawn<B> {
        let (top, length) = (fine(TOP), fine(self.height - TOP - BOTTOM));
        let left = letters(TEXT).pos(Pos::new(HPos::Left, VPos::Center));
        area.draw(&Text::new(self.plans.scale.label.as_str(), (fine(GAP), top - fine(TEXT)), left))?;
        draw_scale(area, &self.scale, [fine(GAP), fine(GAP + BAR)], [top, length], TEXT)
    }

    fn color(&self, value: f64) -> RGBColor {
        ramp((value - self.scale.low) / (self.scale.high - self.scale.low))
    }
}

/// Labels to the left of and below a plan, and its title [pixels].
const LEFT: u32 = 64;
const BOTTOM: u32 = 3 * TEXT;
const TOP: u32 = 3 * CAPTION;
/// Least height of a row, for the bar [pixels].
const LEAST_HEIGHT: u32 = 260;

/// The bar of colours between two abscissas, from `top` on and with a `length`, and its labels to the right in letters of a `size` [pixels].
pub(crate) fn draw_scale<B: DrawingBackend>(
    area: &Area<B>,
    scale: &Ruler,
    [from, to]: [i32; 2],
    [top, length]: [i32; 2],
    size: u32,
) -> Drawn<B> {
    let left = letters(size).pos(Pos::new(HPos::Left, VPos::Center));
    for y in 0..length {
        let color = ramp(1.0 - f64::from(y) / f64::from((length - 1).max(1)));
        area.draw(&Rectangle::new([(from, top + y), (to, top + y + 1)], color.filled()))?;
    }
    for &tick in &scale.ticks {
        let share = (tick - scale.low) / (scale.high - scale.low);
        let y = top + ((1.0 - share) * f64::from(length)).round() as i32;
        area.draw(&PathElement::new([(to, y), (to + fine(4), y)], BLACK.stroke_width(FINENESS)))?;
        area.draw(&Text::new(scale.label(tick), (to + fine(8), y), left.clone()))?;
    }
    Ok(())
}

/// Viridis, even to the eye and for the colour-blind.
pub(crate) fn ramp(share: f64) -> RGBColor {
    ViridisRGB.get_color(share.clamp(0.0, 1.0))
}

/// `text`, with an ellipsis where it would be wider than `width` [pixels] in letters of a `size` [pixels].
fn shortened(text: &str, width: u32, size: u32) -> String {
    let letters = text.chars().count();
    let room = (1..=letters).rev().find(|count| text_width(*count, size) <= width).unwrap_or(1);
    if room >= letters {
        return text.to_owned();
    }
    text.chars().take(room.saturating_sub(1)).chain(['…']).collect()
}

/// The ruler of a horizontal axis `width` [pixels] wide with so many ticks that their labels do not touch.
fn thinned(mut ruler: Ruler, width: u32) -> Ruler {
    let longest = ruler.ticks.iter().map(|&tick| ruler.label(tick).chars().count()).max().unwrap_or(0);
    let most = (width / (text_width(longest, TEXT) + GAP)).max(1) as usize;
    let every = ruler.ticks.len().div_ceil(most).max(1);
    ruler.ticks = ruler.ticks.into_iter().step_by(every).collect();
    ruler
}

/// Lower and upper corner of everything in the plans, with a margin [m].
fn extents(plans: &[Plan]) -> [[f64; 2]; 2] {
    let mut corners = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    let mut hold = |point: &[f64; 2]| {
        for axis in 0..2 {
            corners[0][axis] = corners[0][axis].min(point[axis]);
            corners[1][axis] = corners[1][axis].max(point[axis]);
        }
    };
    for plan in plans {
        plan.spots.iter().for_each(|spot| {
            hold(&spot.at);
            spot.cell.iter().flatten().for_each(&mut hold);
        });
        plan.walls.iter().flatten().chain(&plan.sources).for_each(&mut hold);
    }
    let [low, high] = corners;
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    if !extent.is_finite() {
        return [[0.0; 2], [1.0; 2]];
    }
    // A single place gets a metre about it, a line of places a band.
    let margin = (MARGIN * extent).max(0.5);
    [low.map(|value| value - margin), high.map(|value| value + margin)]
}
