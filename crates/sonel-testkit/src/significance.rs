//! One level of significance, shared by several tests.
//!
//! Reference: [Sidak1967].

/// The level of each of `tests` independent tests, so that the chance that any of them rejects a true hypothesis
/// is `level`: 1 − (1 − level)^(1/tests).
///
/// `level` lies in (0, 1); `tests` is at least 1.
pub fn sidak(level: f64, tests: usize) -> f64 {
    assert!(level > 0.0 && level < 1.0 && tests > 0, "level {level} over {tests} tests is no significance");
    -((-level).ln_1p() / tests as f64).exp_m1()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_tests_together_have_the_stated_level() {
        for tests in [1, 2, 10, 1000] {
            let each = sidak(0.01, tests);
            let together = 1.0 - (1.0 - each).powi(i32::try_from(tests).unwrap());
            assert!((together - 0.01).abs() < 1e-12, "{tests}: {together}");
        }
    }

    #[test]
    #[should_panic(expected = "no significance")]
    fn a_level_of_zero_is_refused_since_nothing_could_fail() {
        sidak(0.0, 3);
    }
}
