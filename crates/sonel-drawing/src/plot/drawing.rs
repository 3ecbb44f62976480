//! Sheets as SVG or as pixels, drawn by plotters.
//!
//! plotters draws lines, bands, bars and text; ticks, page and legends are ours. It rounds to whole pixels, so a page is
//! drawn on twice as many as an SVG claims to have. Its letters are measured with
//! DejaVu Sans, which a PNG also shows; an SVG names no font but "sans-serif".

mod panel;
pub(crate) mod plan;

use std::io::Write;
use std::ops::Range;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use sonel_analysis::shown::shown;
use thiserror::Error;

use super::Sheet;
use super::axis::Ruler;
use crate::pixels::{self, SOFTWARE};
use panel::PanelRow;
use plan::PlanRow;

/// Why there is no drawing or picture.
#[derive(Debug, Error)]
pub enum PlotError {
    /// The drawing library failed.
    #[error("cannot draw: {0}")]
    Drawing(String),
    /// The output cannot be written.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The encoder of PNG failed.
    #[error("cannot encode the PNG file: {0}")]
    Png(#[from] png::EncodingError),
    /// The encoder of OpenEXR failed.
    #[error("cannot encode the OpenEXR file: {0}")]
    Exr(String),
}

pub(crate) type Area<B> = DrawingArea<B, Shift>;
type Chart<'a, B> = ChartContext<'a, B, Cartesian2d<Ruler, Ruler>>;
pub(crate) type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// Pixels drawn for each that the page claims to have.
pub(crate) const FINENESS: u32 = 2;
/// Width of a page [pixels].
const WIDTH: u32 = 1000;
/// Sizes of the letters [pixels].
const TITLE: u32 = 19;
const CAPTION: u32 = 16;
const TEXT: u32 = 14;
/// Width of a letter in parts of its size, on average.
const LETTER: f64 = 0.62;
/// plotters takes the height of a line for the size of its letters.
const LINE_PER_LETTER: f64 = 1.24;
/// The font, as plotters and SVG call it.
const FONT: &str = "sans-serif";

/// Writes `sheet` to `out` as SVG that begins with the name of the program.
///
/// # Errors
/// When it cannot be drawn or written.
pub fn svg(sheet: &Sheet, out: &mut dyn Write) -> Result<(), PlotError> {
    let layout = Layout::new(sheet);
    let (size, fine) = (layout.size, layout.fine_size());
    let mut text = String::new();
    draw(&layout, SVGBackend::with_string(&mut text, fine).into_drawing_area()).map_err(failed)?;
    let drawn = format!("<svg width=\"{}\" height=\"{}\"", fine.0, fine.1);
    let claimed = format!("<!-- {SOFTWARE} -->\n<svg width=\"{}\" height=\"{}\"", size.0, size.1);
    out.write_all(shown(&text.replacen(&drawn, &claimed, 1)).as_bytes())?;
    Ok(())
}

/// Writes `sheet` to `out` as PNG, 2000 pixels wide.
///
/// # Errors
/// When it cannot be drawn or written.
pub fn png(sheet: &Sheet, out: &mut dyn Write) -> Result<(), PlotError> {
    let layout = Layout::new(sheet);
    let (width, height) = layout.fine_size();
    let mut colors = vec![0; 3 * width as usize * height as usize];
    let backend = BitMapBackend::with_buffer(&mut colors, (width, height));
    draw(&layout, backend.into_drawing_area()).map_err(failed)?;
    Ok(pixels::write([width, height], &colors, out)?)
}

pub(crate) fn failed(error: impl std::error::Error) -> PlotError {
    PlotError::Drawing(error.to_string())
}

/// A page divided into rows.
struct Layout<'a> {
    title: &'a str,
    rows: Vec<PanelRow<'a>>,
    plans: Option<PlanRow<'a>>,
    /// Height of the title [pixels].
    top: u32,
    /// Size on the page [pixels].
    size: (u32, u32),
}

impl<'a> Layout<'a> {
    fn new(sheet: &'a Sheet) -> Self {
        let rows: Vec<PanelRow<'_>> = sheet.rows.iter().map(|panels| PanelRow::new(panels)).collect();
        let plans = sheet.plans.as_ref().map(PlanRow::new);
        let top = if sheet.title.is_empty() { 0 } else { 2 * TITLE };
        let heights = rows.iter().map(|row| row.height).chain(plans.as_ref().map(|row| row.height));
        let size = (WIDTH, top + heights.sum::<u32>());
        Self { title: &sheet.title, rows, plans, top, size }
    }

    /// Size as drawn [pixels].
    fn fine_size(&self) -> (u32, u32) {
        (FINENESS * self.size.0, FINENESS * self.size.1.max(1))
    }
}

fn draw<B: DrawingBackend>(layout: &Layout<'_>, page: Area<B>) -> Drawn<B> {
    know_the_font();
    page.fill(&WHITE)?;
    if layout.top > 0 {
        let place = (fine(WIDTH) / 2, fine(TITLE) / 2);
        let style = letters(TITLE).pos(Pos::new(HPos::Center, VPos::Top));
        page.draw(&Text::new(layout.title, place, style))?;
    }
    let mut rest = page.split_vertically(FINENESS * layout.top).1;
    for row in &layout.rows {
        let (here, below) = rest.split_vertically(FINENESS * row.height);
        row.draw(&here)?;
        rest = below;
    }
    if let Some(plans) = &layout.plans {
        plans.draw(&rest)?;
    }
    page.present()
}

/// Gives plotters the font, once in a process.
pub(crate) fn know_the_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let known = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
        assert!(known.is_ok(), "the font is part of the program");
    });
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

pub(crate) fn letters(size: u32) -> TextStyle<'static> {
    (FONT, LINE_PER_LETTER * f64::from(FINENESS * size)).into_text_style(&(0, 0))
}

pub(crate) fn text_width(letters: usize, size: u32) -> u32 {
    (LETTER * f64::from(size) * letters as f64) as u32
}

fn fine(size: u32) -> i32 {
    (FINENESS * size) as i32
}
