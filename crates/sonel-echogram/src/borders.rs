//! Coarse time borders for batch estimates, fine enough for the parameters.
//!
//! The limits 50 ms and 80 ms after the direct sound are borders; between them and later the steps are short enough for
//! the regressions of ISO 3382-1. All source–receiver pairs of a duration get the same number of borders, as an array
//! needs; where the direct sound comes late the last ones repeat and their bins are empty.

/// Step while early energy is separated from late [s]: ten to the 50 ms of C50.
const EARLY_STEP: f64 = 0.005;
/// Number of early steps: up to 100 ms.
const EARLY_STEPS: usize = 20;
/// Least step of the late part [s]: decays are straight over it. Chosen, not measured.
const LATE_STEP: f64 = 0.010;
/// Most late steps: two seconds of the least. It bounds memory; longer runs have longer steps.
const LATE_STEPS: f64 = 200.0;

/// Borders for a receiver that the direct sound reaches at `direct_time` [s] in a response of `duration` [s]: 0, the direct
/// sound, 5 ms steps to 100 ms behind it, longer ones to the end. Ascending, the last is `duration`.
#[must_use]
pub fn batch_time_edges(direct_time: f64, duration: f64) -> Vec<f64> {
    let late_step = LATE_STEP.max(duration / LATE_STEPS);
    let late_steps = (duration / late_step).ceil() as usize;
    let early = (0..=EARLY_STEPS).map(|step| direct_time + step as f64 * EARLY_STEP);
    let late_start = direct_time + EARLY_STEPS as f64 * EARLY_STEP;
    let late = (1..=late_steps).map(|step| late_start + step as f64 * late_step);
    std::iter::once(0.0).chain(early).chain(late).map(|edge| edge.min(duration)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_ascend_and_keep_the_limits_of_clarity() {
        for (direct, duration) in [(0.01, 1.0), (0.5, 1.0), (0.132, 10.0), (0.003, 0.05), (2.0, 1.0)] {
            let edges = batch_time_edges(direct, duration);
            assert!(edges.windows(2).all(|pair| pair[0] <= pair[1]), "{edges:?}");
            assert!((edges[edges.len() - 1] - duration).abs() < 1e-12);
            for limit in [0.0, 0.05, 0.08] {
                let wanted = (direct + limit).min(duration);
                assert!(edges.iter().any(|edge| (edge - wanted).abs() < 1e-12), "{limit} s after {direct} s");
            }
        }
    }

    #[test]
    fn the_count_depends_on_the_duration_alone() {
        assert_eq!(batch_time_edges(0.001, 3.0).len(), batch_time_edges(0.9, 3.0).len());
    }
}
