//! Pictures as OpenEXR: a layer (part) per window of time, a channel of 32-bit floats per band.
//!
//! References: docs/formats/image.md.

use std::io::{Seek, Write};

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, Text, Vec2, WritableImage,
};

use super::{Picture, WindowPicture};
use crate::pixels::SOFTWARE;
use crate::plot::PlotError;

/// Writes `picture` to `out`.
///
/// # Errors
/// When `out` cannot be written.
pub fn exr(picture: Picture, out: impl Write + Seek) -> Result<(), PlotError> {
    let [width, height] = picture.size.map(|pixels| pixels as usize);
    let size = Vec2(width, height);
    let covered: Vec<f32> = picture.is_covered.iter().map(|&covered| f32::from(u8::from(covered))).collect();
    let names: Vec<String> =
        picture.center_frequencies_hz.iter().map(|&frequency| channel_name(frequency)).collect();
    let comments = Text::from(picture.metadata.to_string().as_str());
    let layer = |window: WindowPicture| {
        let bands = names.iter().map(String::as_str).zip(window.energy);
        let others = [("A", covered.clone()), ("relative_error", window.relative_error)];
        let channel = |(name, values)| AnyChannel::new(name, FlatSamples::F32(values));
        let channels = AnyChannels::sort(bands.chain(others).map(channel).collect());
        let mut attributes = LayerAttributes::named(window.name.as_str());
        attributes.comments = Some(comments.clone());
        attributes.software_name = Some(Text::from(SOFTWARE));
        Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels)
    };
    let layers: Vec<_> = picture.windows.into_iter().map(layer).collect();
    let image = Image::from_layers(ImageAttributes::new(IntegerBounds::from_dimensions(size)), layers);
    image.write().to_buffered(out).map_err(|error| PlotError::Exr(error.to_string()))
}

/// `band.00125Hz`: sorted by name, channels are in the order of frequency.
fn channel_name(center_frequency_hz: f64) -> String {
    if center_frequency_hz.fract() > 0.0 {
        format!("band.{center_frequency_hz:07.1}Hz")
    } else {
        format!("band.{center_frequency_hz:05}Hz")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers, read};
    use serde_json::json;
    use std::io::Cursor;

    #[test]
    fn names_sort_as_frequencies_do() {
        let names = [31.5, 63.0, 125.0, 16_000.0].map(channel_name);
        assert_eq!(names, ["band.00031.5Hz", "band.00063Hz", "band.00125Hz", "band.16000Hz"]);
        assert!(names.is_sorted());
    }

    #[test]
    fn what_is_written_is_read_back() {
        let window = |name: &str, scale: f32| WindowPicture {
            name: name.to_owned(),
            energy: vec![vec![scale, 2.0 * scale, 0.0], vec![1e-30, 3.0 * scale, 0.0]],
            relative_error: vec![0.1, f32::INFINITY, 0.0],
        };
        let picture = Picture {
            size: [3, 1],
            center_frequencies_hz: vec![125.0, 1000.0],
            is_covered: vec![true, true, false],
            windows: vec![window("0-20ms", 1.0), window("20-50ms", 0.5)],
            metadata: json!({"radius_m": 0.1}),
        };
        let mut file = Cursor::new(Vec::new());
        exr(picture.clone(), &mut file).unwrap();
        let mut again = Cursor::new(Vec::new());
        exr(picture, &mut again).unwrap();
        assert_eq!(file.get_ref(), again.get_ref(), "same picture, same bytes");
        file.set_position(0);
        let read =
            read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
        let image = read.from_buffered(file).unwrap();
        assert_eq!(image.layer_data.len(), 2);
        let second = &image.layer_data[1];
        assert_eq!(second.attributes.layer_name, Some(Text::from("20-50ms")));
        let found: Vec<(String, Vec<f32>)> = second
            .channel_data
            .list
            .iter()
            .map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().collect()))
            .collect();
        let expected: [(&str, [f32; 3]); 4] = [
            ("A", [1.0, 1.0, 0.0]),
            ("band.00125Hz", [0.5, 1.0, 0.0]),
            ("band.01000Hz", [1e-30, 1.5, 0.0]),
            ("relative_error", [0.1, f32::INFINITY, 0.0]),
        ];
        assert_eq!(found, expected.map(|(name, values)| (name.to_owned(), values.to_vec())));
    }
}
