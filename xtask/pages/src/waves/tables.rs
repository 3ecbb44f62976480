//! Waves and packets as CSV file, and the mean deviations over several rooms as summary.
//!
//! Deviations are those of packets from waves: differences of levels [dB], relative differences of times [%].

use super::packets::VARIANTS;
use super::{Columns, Row};

/// The first line of the CSV file.
pub(super) const CSV_HEAD: &str = "room,band_hz,setup,t30_s,early_decay_time_s,strength_g_db\n";

/// Lines of the summary: name, index in [`Row`], variant.
const SHOWN: [(&str, usize, usize); 6] =
    [("G", 2, 0), ("G", 2, 1), ("EDT", 1, 0), ("EDT", 1, 1), ("T30", 0, 0), ("T30", 0, 1)];

/// Lines of the CSV file: per band, waves first.
pub(super) fn csv(room: &str, bands: &[f64], columns: &Columns) -> String {
    let setups: Vec<&str> = std::iter::once("waves").chain(VARIANTS.map(|variant| variant.title)).collect();
    let mut text = String::new();
    for (index, band) in bands.iter().enumerate() {
        for (setup, column) in setups.iter().zip(columns) {
            let [late, early, strength] = column[index];
            text += &format!("{room},{band},{setup},{late:.2},{early:.2},{strength:.1}\n");
        }
    }
    text
}

/// Mean and root mean square of the deviations over `rooms`, a column per band.
pub(super) fn summary(bands: &[f64], rooms: &[Columns]) -> String {
    let names: Vec<String> = bands.iter().map(|band| format!(" {band} Hz |")).collect();
    let rule = "---|".repeat(bands.len());
    let mut text = format!("| mean (rms) deviation from waves |{}\n|---|{rule}\n", names.concat());
    for (name, quantity, variant) in SHOWN {
        text += &format!("| {name}, {} |", VARIANTS[variant].title);
        for band in 0..bands.len() {
            let of_room = |columns: &Columns| {
                let [waves, packets]: [Row; 2] = [columns[0][band], columns[1 + variant][band]];
                deviation(quantity, packets[quantity], waves[quantity])
            };
            let deviations: Vec<f64> = rooms.iter().map(of_room).collect();
            let count = deviations.len() as f64;
            let mean = deviations.iter().sum::<f64>() / count;
            let rms = (deviations.iter().map(|deviation| deviation * deviation).sum::<f64>() / count).sqrt();
            let (unit, places) = if quantity == 2 { ("dB", 1) } else { ("%", 0) };
            text += &format!(" {mean:+.places$} ({rms:.places$}) {unit} |").replace('-', "−");
        }
        text.push('\n');
    }
    text
}

fn deviation(quantity: usize, packets: f64, waves: f64) -> f64 {
    if quantity == 2 { packets - waves } else { 100.0 * (packets / waves - 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves have T30 = EDT = 2 s and G = 10 dB; all packets have the times and the level given.
    fn room(time: f64, strength: f64) -> Columns {
        let packets = vec![[time, time, strength]];
        [vec![vec![[2.0, 2.0, 10.0]]], vec![packets; VARIANTS.len()]].concat()
    }

    #[test]
    fn the_file_has_a_line_per_band_and_setup() {
        let text = csv("empty", &[63.0], &room(2.5, 11.0));
        assert!(
            text.starts_with("empty,63,waves,2.00,2.00,10.0\nempty,63,uniform,2.50,2.50,11.0\n"),
            "{text}"
        );
        assert_eq!(text.lines().count(), 1 + VARIANTS.len());
        assert!(text.lines().all(|line| line.split(',').count() == CSV_HEAD.split(',').count()));
    }

    #[test]
    fn deviations_are_relative_for_times_and_differences_for_levels() {
        let text = summary(&[63.0], &[room(1.0, 7.0), room(2.2, 11.0)]);
        assert!(text.contains("| G, uniform | −1.0 (2.2) dB |\n"), "{text}");
        assert!(text.contains("| T30, locally reacting | −20 (36) % |\n"), "{text}");
    }
}
