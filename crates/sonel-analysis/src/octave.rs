//! Octaves of a response in octaves or third octaves.

/// Nominal octaves lie at least this factor apart (63 to 125 Hz), third octaves at most 1.29.
const NARROWEST_OCTAVE_STEP: f64 = 1.9;

/// Indices of the bands of the octave of nominal centre `octave` [Hz] among bands of ascending `frequencies` [Hz]: itself or its three thirds.
/// None where one of them is missing.
#[must_use]
pub fn bands_of(octave: f64, frequencies: &[f64]) -> Option<Vec<usize>> {
    let half = std::f64::consts::SQRT_2;
    let is_within = |&at: &usize| (octave / half..octave * half).contains(&frequencies[at]);
    let found: Vec<usize> = (0..frequencies.len()).filter(is_within).collect();
    let has_thirds = frequencies.windows(2).any(|pair| pair[1] / pair[0] < NARROWEST_OCTAVE_STEP);
    (found.len() == if has_thirds { 3 } else { 1 }).then_some(found)
}

/// Those of the `octaves` [Hz] that are not there; none where all are.
#[must_use]
pub fn missing(octaves: &[f64], is_there: impl Fn(f64) -> bool) -> Option<String> {
    let missing = octaves.iter().filter(|octave| !is_there(**octave));
    missing.map(|octave| format!("{octave} Hz")).reduce(|all, one| format!("{all}, {one}"))
}

/// Level of the sum of the energies of levels [dB], which is that of a single one to the last bit, however high.
#[must_use]
pub fn sum_db(levels_db: &[f64]) -> f64 {
    let highest = levels_db.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let relative = levels_db.iter().map(|level| libm::pow(10.0, 0.1 * (level - highest)));
    if highest.is_finite() { highest + 10.0 * libm::log10(relative.sum()) } else { highest }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octaves_are_single_bands_or_three_thirds() {
        assert_eq!(bands_of(500.0, &[250.0, 500.0, 1000.0]), Some(vec![1]));
        assert_eq!(bands_of(500.0, &[315.0, 400.0, 500.0, 630.0, 800.0]), Some(vec![1, 2, 3]));
        assert_eq!(bands_of(1000.0, &[400.0, 500.0, 630.0, 800.0, 1000.0]), None);
        let thirds: Vec<f64> = sonel_acoustics::BandWidth::Third.nominal_series().collect();
        for octave in sonel_acoustics::BandWidth::Octave.nominal_series().filter(|hz| *hz > 12.5) {
            let of_it = bands_of(octave, &thirds).map(|bands| thirds[bands[1]]);
            assert_eq!(of_it, Some(octave), "{octave}");
        }
        assert!((sum_db(&[60.0; 3]) - 64.771_212_547).abs() < 1e-9);
    }
}
