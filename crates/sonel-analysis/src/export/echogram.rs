//! A row for every source, receiver, band and time bin of a response: a long table for spreadsheets and data frames.

use std::io::{self, Write};

use sonel_echogram::Response;

use crate::cell;

/// Columns; the coordinates are the receiver's [m], the energy is fluence per unit emitted energy [1/m²].
const COLUMNS: [&str; 9] =
    ["source", "receiver", "center_frequency_hz", "begin_s", "end_s", "energy_per_m2", "x_m", "y_m", "z_m"];

/// Writes all bins, those without energy too.
///
/// # Errors
/// When `out` cannot be written.
pub fn echogram_csv(response: &Response, out: impl Write) -> io::Result<()> {
    let mut writer = ::csv::Writer::from_writer(out);
    writer.write_record(COLUMNS)?;
    let borders: Vec<String> = response.time_edges_s.iter().map(ToString::to_string).collect();
    let bands: Vec<String> = response.center_frequency_hz.iter().map(ToString::to_string).collect();
    for (s, source) in response.source_names.iter().enumerate() {
        let source = cell::of_name(source);
        for (r, receiver) in response.receiver_names.iter().enumerate() {
            let receiver = cell::of_name(receiver);
            let [x, y, z] = response.receiver_positions[r].map(|coordinate| coordinate.to_string());
            for (b, band) in bands.iter().enumerate() {
                for (edges, energy) in borders.windows(2).zip(response.echogram(s, r, b)) {
                    let energy = energy.to_string();
                    let [begin, end] = [&edges[0], &edges[1]];
                    writer.write_record([&source, &*receiver, band, begin, end, &energy, &x, &y, &z])?;
                }
            }
        }
    }
    writer.flush()
}
