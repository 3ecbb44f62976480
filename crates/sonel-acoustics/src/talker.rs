//! Directivity of a human talker: octave levels of running speech in the horizontal plane, taken as the same around the aim.
//!
//! Levels re the front every 15° are those of normal speech in [Monson2012], octaves of 125 … 16 000 Hz. A third octave has the values of the
//! octave that contains it, lower bands those of 125 Hz. What differs between above and below is left out: [Leishman2021] measured spheres,
//! which a source takes from a file.
//!
//! References: [Monson2012], [Leishman2021] (docs/references.md).

use crate::balloon::Balloon;
use crate::bands::Bands;
use crate::levels::energy_from_level_db;

/// The word for it in a scene, and the name of the balloon.
pub const TALKER: &str = "talker";

/// Lowest octave of the table [Hz]; each following one is twice as high.
const LOWEST_HZ: f64 = 125.0;

/// Levels re the front [dB] by polar angle, every 15°, and octave.
const LEVELS_DB: [[f64; 8]; 13] = [
    [0.0; 8],
    [0.8, 0.7, 0.6, -0.2, -1.0, -1.7, -1.0, -0.1],
    [-0.1, -0.2, 0.1, -0.7, -0.1, -0.7, -1.7, -0.5],
    [-0.4, -0.5, 0.0, -1.4, -0.8, -1.6, -3.1, -2.3],
    [-0.6, -0.8, -0.1, -1.5, -2.5, -3.9, -5.8, -4.4],
    [-1.1, -1.6, -0.7, -1.4, -4.7, -5.3, -7.0, -5.1],
    [-1.6, -2.3, -1.6, -1.6, -7.0, -6.3, -8.7, -7.2],
    [-2.1, -3.1, -2.8, -2.5, -7.6, -9.0, -11.5, -10.1],
    [-2.7, -3.9, -4.4, -4.6, -7.9, -12.7, -15.0, -14.2],
    [-3.1, -4.5, -5.5, -7.0, -9.3, -14.5, -17.8, -17.8],
    [-3.5, -4.9, -6.0, -7.9, -13.0, -16.7, -21.5, -21.7],
    [-3.6, -5.0, -6.0, -6.9, -15.0, -21.0, -25.0, -23.5],
    [-3.6, -5.1, -5.9, -6.3, -13.1, -18.9, -26.3, -26.7],
];

/// The directivity of a talker in `bands`.
///
/// # Panics
/// Never: the table is a balloon.
#[must_use]
pub fn talker(bands: &Bands) -> Balloon {
    let column = |hz: &f64| {
        let octave = libm::round(libm::log2(hz / LOWEST_HZ));
        octave.clamp(0.0, (LEVELS_DB[0].len() - 1) as f64) as usize
    };
    let columns: Vec<usize> = bands.nominal().iter().map(column).collect();
    let row = |levels: &[f64; 8]| -> Vec<f64> {
        columns.iter().map(|&column| energy_from_level_db(levels[column])).collect()
    };
    let energies = LEVELS_DB.iter().flat_map(row).collect();
    Balloon::new(TALKER, [1, LEVELS_DB.len(), bands.count()], energies).expect("a table of finite levels")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bands::BandWidth;
    use crate::levels::energy_to_level_db;
    use core::f64::consts::PI;

    fn level(balloon: &Balloon, degrees: f64, band: usize) -> f64 {
        let factor = balloon.at(degrees * PI / 180.0, 1.0).factor(band);
        energy_to_level_db(factor / balloon.on_axis(band))
    }

    #[test]
    fn levels_are_those_of_the_table_and_the_mean_is_one() {
        let balloon = talker(&Bands::octaves());
        for (band, side, behind) in [(1, -1.6, -3.6), (4, -1.6, -6.3), (5, -7.0, -13.1), (7, -8.7, -26.3)] {
            assert!((level(&balloon, 90.0, band) - side).abs() < 1e-9, "{band}");
            assert!((level(&balloon, 180.0, band) - behind).abs() < 1e-9, "{band}");
            assert!((balloon.mean(band) - 1.0).abs() < 1e-12);
        }
        // 63 Hz has the values of 125 Hz. The directivity index rises with frequency, to that of a voice.
        assert!((balloon.on_axis(0) - balloon.on_axis(1)).abs() < 1e-12);
        let index = |band| energy_to_level_db(balloon.on_axis(band));
        assert!(
            (1.0..2.0).contains(&index(1)) && (5.0..8.0).contains(&index(7)),
            "{} {}",
            index(1),
            index(7)
        );
    }

    #[test]
    fn thirds_have_the_values_of_their_octaves() {
        let thirds =
            Bands::new(vec![50.0, 160.0, 315.0, 1250.0, 6300.0, 20_000.0], BandWidth::Third).unwrap();
        let balloon = talker(&thirds);
        for (band, behind) in [-3.6, -3.6, -5.1, -6.3, -26.3, -26.7].into_iter().enumerate() {
            assert!((level(&balloon, 180.0, band) - behind).abs() < 1e-9, "{band}");
        }
    }
}
