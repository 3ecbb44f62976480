//! A raster of pixels with text.

use std::convert::Infallible;

use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::iso_8859_1::FONT_9X18_BOLD as FONT;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::{DrawTarget, Drawable, OriginDimensions, Pixel, Point, RgbColor, Size};
use embedded_graphics::text::{Alignment, Baseline, Text, TextStyleBuilder};

/// Width of a letter [pixels].
pub const LETTER: u32 = FONT.character_size.width;
/// Height of a line [pixels].
pub const LINE: u32 = FONT.character_size.height;

/// Red, green and blue of pixels in rows from the top.
pub struct Canvas {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// A white canvas.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, pixels: vec![[255; 3]; width as usize * height as usize] }
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Colours a pixel; those beyond the canvas are not there.
    pub fn set(&mut self, x: u32, y: u32, color: [u8; 3]) {
        if x < self.width && y < self.height {
            self.pixels[y as usize * self.width as usize + x as usize] = color;
        }
    }

    /// Writes `text` with its left end at `x` and its middle at `y`.
    pub fn write(&mut self, text: &str, x: u32, y: u32) {
        let style = TextStyleBuilder::new().alignment(Alignment::Left).baseline(Baseline::Middle).build();
        let letters = MonoTextStyle::new(&FONT, Rgb888::BLACK);
        let at = Point::new(x as i32, y as i32);
        match Text::with_text_style(text, at, letters, style).draw(self) {
            Ok(_) => {}
            Err(never) => match never {},
        }
    }

    /// Red, green and blue of all pixels.
    pub fn bytes(&self) -> &[u8] {
        self.pixels.as_flattened()
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(Point { x, y }, color) in pixels {
            if let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) {
                self.set(x, y, [color.r(), color.g(), color.b()]);
            }
        }
        Ok(())
    }
}
