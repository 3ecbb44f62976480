//! One band of a picture in decibels, windows of time below one another, with the scale of colours beside them.
//!
//! The level is 10 lg(E · 1 m²) with E in 1/m². Colours are viridis, which is even to the eye and for the colour-blind. Pixels without a
//! surface are grey.
//!
//! References: docs/formats/image.md.

use std::io::Write;

use plotters::prelude::{BitMapBackend, DrawingBackend, IntoDrawingArea, RGBColor, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use sonel_acoustics::energy_to_level_db;

use crate::pixels;
use crate::plot::axis::Ruler;
use crate::plot::drawing::plan::{draw_scale, ramp};
use crate::plot::drawing::{Area, Drawn, FINENESS, failed, know_the_font, letters, text_width};
use crate::plot::{Axis, PlotError};

/// Dynamic range where none is asked for [dB].
const USUAL_RANGE_DB: f64 = 40.0;
/// Limits of a chosen scale are multiples of this [dB].
const STEP_DB: f64 = 5.0;
/// Colour of pixels without a surface.
const NOTHING: RGBColor = RGBColor(128, 128, 128);
/// Size of the letters, in pixels of pages, and height of a caption [pixels].
const LETTERS: u32 = 8;
const CAPTION: u32 = 26;
/// Width of the bar of colours, and the gaps about it and its labels [pixels].
const BAR: u32 = 24;
const GAP: u32 = 8;
/// Height of a bar at least [pixels].
const LEAST_BAR: u32 = 160;
/// Above the bar.
const UNIT: &str = "dB re 1/m\u{b2}";

/// Levels of the first and last colour [dB re 1/m²].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecibelScale {
    /// First.
    pub low: f64,
    /// Last.
    pub high: f64,
}

/// What is drawn.
#[derive(Debug, Clone)]
pub struct Drawing<'a> {
    /// Pixels across and down of each window's picture.
    pub size: [u32; 2],
    /// Whether a pixel shows a surface.
    pub is_covered: &'a [bool],
    /// Caption of each window, and its energy by pixel [1/m²].
    pub windows: Vec<(String, Vec<f64>)>,
    /// Levels of the colours.
    pub scale: DecibelScale,
}

impl DecibelScale {
    /// The 40 dB below the largest of `energies` [1/m²], in steps of 5 dB; down from 0 dB where there is none.
    #[must_use]
    pub fn of(energies: impl Iterator<Item = f64>) -> Self {
        let largest = energies.fold(0.0, f64::max);
        let high = if largest > 0.0 { (energy_to_level_db(largest) / STEP_DB).ceil() * STEP_DB } else { 0.0 };
        Self { low: high - USUAL_RANGE_DB, high }
    }

    /// Shares of the `energies` [1/m²] that are below and above the scale.
    #[must_use]
    pub fn beyond(&self, energies: impl Iterator<Item = f64>) -> [f64; 2] {
        let (mut below, mut above, mut all) = (0_u64, 0_u64, 0_u64);
        for energy in energies {
            below += u64::from(energy_to_level_db(energy) < self.low);
            above += u64::from(energy_to_level_db(energy) > self.high);
            all += 1;
        }
        [below, above].map(|count| count as f64 / all.max(1) as f64)
    }

    /// Colour of an energy [1/m²]; the first and the last colour also stand for what is beyond.
    fn color(&self, energy: f64) -> RGBColor {
        ramp((energy_to_level_db(energy) - self.low) / (self.high - self.low))
    }
}

/// Draws to `out`.
///
/// # Errors
/// When `out` cannot be written.
pub fn png(drawing: &Drawing<'_>, out: &mut dyn Write) -> Result<(), PlotError> {
    let [width, height] = drawing.size;
    let left = drawing.windows.iter().map(|(caption, _)| width_of(caption)).fold(width, u32::max);
    let panels = drawing.windows.len() as u32 * (CAPTION + height);
    let size = (left + 3 * GAP + BAR.max(width_of(UNIT)), panels.max(CAPTION + LEAST_BAR) + CAPTION);
    let mut colors = vec![255; 3 * size.0 as usize * size.1 as usize];
    draw(drawing, left, &BitMapBackend::with_buffer(&mut colors, size).into_drawing_area())
        .map_err(failed)?;
    Ok(pixels::write([size.0, size.1], &colors, out)?)
}

/// Width of a text [pixels].
fn width_of(text: &str) -> u32 {
    FINENESS * text_width(text.chars().count(), LETTERS)
}

/// The windows up to `left`, and the bar of colours to the right of it.
fn draw<B: DrawingBackend>(drawing: &Drawing<'_>, left: u32, page: &Area<B>) -> Drawn<B> {
    know_the_font();
    let style = || letters(LETTERS).pos(Pos::new(HPos::Left, VPos::Center));
    let [width, height] = drawing.size;
    for (number, (caption, energies)) in (0..).zip(&drawing.windows) {
        let top = number * (CAPTION + height);
        page.draw(&Text::new(caption.as_str(), (0, (top + CAPTION / 2) as i32), style()))?;
        let covered = energies.iter().zip(drawing.is_covered);
        for (pixel, (&energy, &is_covered)) in (0..).zip(covered) {
            let color = if is_covered { drawing.scale.color(energy) } else { NOTHING };
            let place = (pixel % width, top + CAPTION + pixel / width);
            page.draw_pixel((place.0 as i32, place.1 as i32), &color)?;
        }
    }
    let DecibelScale { low, high } = drawing.scale;
    let ruler = Ruler::new(&Axis::linear(UNIT).from_to(low, high), std::iter::empty());
    let (from, caption) = ((left + GAP) as i32, CAPTION as i32);
    page.draw(&Text::new(UNIT, (from, caption / 2), style()))?;
    let length = page.dim_in_pixel().1 as i32 - 2 * caption;
    draw_scale(page, &ruler, [from, from + BAR as i32], [caption, length], LETTERS)?;
    page.present()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes_of(color: RGBColor) -> [u8; 3] {
        [color.0, color.1, color.2]
    }

    fn drawing<'a>(is_covered: &'a [bool], scale: DecibelScale) -> Drawing<'a> {
        let windows = ["0-20 ms", "20-50 ms"].map(|name| (name.to_owned(), vec![1e-2, 1e-6, 1e-4, 1e-2]));
        Drawing { size: [2, 2], is_covered, windows: windows.to_vec(), scale }
    }

    #[test]
    fn pixels_that_are_read_back_have_the_colours_of_their_levels() {
        let scale = DecibelScale { low: -60.0, high: -20.0 };
        let drawing = drawing(&[true, true, true, false], scale);
        let mut file = Vec::new();
        png(&drawing, &mut file).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let width = reader.next_frame(&mut bytes).unwrap().width as usize;
        let at = |x: usize, y: usize| -> [u8; 3] { bytes[3 * (y * width + x)..][..3].try_into().unwrap() };
        for window in 0..2 {
            let top = (window * (CAPTION + 2) + CAPTION) as usize;
            // The last and the first colour of viridis as published.
            for (x, expected) in [[253_u8, 231, 37], [68, 1, 84]].into_iter().enumerate() {
                let found = at(x, top);
                assert!(found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 2), "{found:?}");
            }
            assert_eq!(at(1, top + 1), bytes_of(NOTHING));
            let middle = at(0, top + 1);
            assert!(middle[1] > 130 && middle[0] < 60, "{middle:?}");
        }
        let [low, high] = [ramp(0.0), ramp(1.0)].map(bytes_of);
        let bar = drawing.size[0].max(width_of("20-50 ms")) as usize + GAP as usize;
        assert_eq!(at(bar, CAPTION as usize), high);
        assert!(
            bytes.chunks_exact(3).filter(|pixel| **pixel == low).count() > 1,
            "the bar ends in its first colour"
        );
        assert!(bytes.chunks_exact(3).any(|pixel| pixel == [0; 3]), "it has labels");
    }

    #[test]
    fn a_chosen_scale_ends_above_the_largest_level() {
        let scale = DecibelScale::of([1e-3, 2e-3, 0.0].into_iter());
        assert_eq!(scale, DecibelScale { low: -65.0, high: -25.0 });
        assert_eq!(DecibelScale::of([0.0].into_iter()), DecibelScale { low: -40.0, high: 0.0 });
        let [below, above] = scale.beyond([1e-3, 0.0, 1e-9, 1.0].into_iter());
        assert!((below - 0.5).abs() < 1e-12 && (above - 0.25).abs() < 1e-12);
    }
}
