//! Reverberation time of an echogram by plain backward integration and regression.
//!
//! An implementation of its own, to judge rooms in the tests of this crate and others without the parameter code.
//!
//! References: [Schroeder1965], ISO 3382-1:2009.

/// Energy from the beginning of each bin to the end of the echogram.
pub fn backward_integral(energies: &[f64]) -> Vec<f64> {
    let mut curve = energies.to_vec();
    let mut sum = 0.0;
    for value in curve.iter_mut().rev() {
        sum += *value;
        *value = sum;
    }
    curve
}

/// Time of a decay by 60 dB [s], from a least-squares line through the decay curve between two levels [dB]
/// relative to its start: −5 and −35 for T30, −5 and −25 for T20, 0 and −10 for EDT.
///
/// NaN when fewer than three bins lie in that range. The echogram must reach well below `to_db`, since what is cut
/// off bends the curve.
pub fn reverberation_time(energies: &[f64], bin_width: f64, from_db: f64, to_db: f64) -> f64 {
    let curve = backward_integral(energies);
    let level = |i: usize| 10.0 * (curve[i] / curve[0]).log10();
    let points = (0..curve.len())
        .map(|i| (i as f64 * bin_width, level(i)))
        .filter(|&(_, level)| level <= from_db && level >= to_db)
        .collect::<Vec<_>>();
    if points.len() < 3 {
        return f64::NAN;
    }
    let count = points.len() as f64;
    let (time, level) = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / count, sum.1 + p.1 / count));
    let covariance = points.iter().map(|p| (p.0 - time) * (p.1 - level)).sum::<f64>();
    let variance = points.iter().map(|p| (p.0 - time) * (p.0 - time)).sum::<f64>();
    -60.0 * variance / covariance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exponential::ExponentialDecay;

    #[test]
    fn an_exponential_decay_has_its_own_reverberation_time() {
        let bins = ExponentialDecay { reverberation_time: 0.8, energy: 3.0 }.bins_to_depth(0.002, 150.0);
        for (from, to) in [(0.0, -10.0), (-5.0, -25.0), (-5.0, -35.0)] {
            let time = reverberation_time(&bins, 0.002, from, to);
            assert!((time - 0.8).abs() < 1e-8, "{time}");
        }
    }

    #[test]
    fn a_truncated_or_bent_decay_has_not() {
        let decay = ExponentialDecay { reverberation_time: 0.8, energy: 1.0 };
        let short = decay.bins_to_depth(0.002, 40.0);
        assert!((reverberation_time(&short, 0.002, -5.0, -35.0) - 0.8).abs() > 0.01);
        assert!(reverberation_time(&short[..1], 0.002, -5.0, -35.0).is_nan());
        let late = ExponentialDecay { reverberation_time: 3.0, energy: 0.1 }.bins(0.002, 5000);
        let bent = decay.bins(0.002, 5000).iter().zip(late).map(|(a, b)| a + b).collect::<Vec<_>>();
        assert!(reverberation_time(&bent, 0.002, -5.0, -35.0) > 1.2);
    }
}
