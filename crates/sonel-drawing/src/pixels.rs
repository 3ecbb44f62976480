//! RGB PNG files with the name of the program.

use std::io::Write;

/// The program that our pictures name, which tells them from others.
pub(crate) const SOFTWARE: &str = "sonel-analyze";

/// Writes pixels in rows from the top, three bytes each.
///
/// # Errors
/// When `out` cannot be written.
pub(crate) fn write(
    [width, height]: [u32; 2],
    colors: &[u8],
    out: &mut dyn Write,
) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.add_text_chunk("Software".to_owned(), SOFTWARE.to_owned())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(colors)?;
    writer.finish()
}
