//! Uncertainty of a standard error from batches.
//!
//! The standard error of G normal batches scatters by 1/√(2(G − 1)) of itself. Where few strong paths carry a parameter, the fourth moment counts too:
//! var(ln σ) = ¼ (2/(G − 1) + κ/G), κ the excess kurtosis of a batch: the variance of a sample's variance. κ falls as one over the emissions
//! of a batch, so κ/G = τ/N for a run of N emissions, where the tail τ is a property of scene and parameter, however many batches there are.
//! The tail is estimated from the same batches and never exceeds their number: it is too small where the strong paths are so rare that none was
//! found.

/// Excess kurtosis of `values`, unbiased for normal ones; zero where there are fewer than four or all agree.
pub(crate) fn excess_kurtosis(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let moment = |of: fn(f64) -> f64| values.iter().map(|value| of(value - mean)).sum::<f64>() / count;
    let square = libm::pow(moment(|x| x * x), 2.0);
    if values.len() < 4 || square <= 0.0 {
        return 0.0;
    }
    let plain = moment(|x| x * x * x * x) / square - 3.0;
    (count - 1.0) / ((count - 2.0) * (count - 3.0)) * ((count + 1.0) * plain + 6.0)
}

/// Variance of the logarithm of a standard error from `batches` batches of `emissions` emissions in all, one of which has an
/// excess kurtosis of `tail`.
pub(crate) fn scatter(batches: u32, emissions: u64, tail: f64) -> f64 {
    0.25 * (2.0 / f64::from(batches.max(2) - 1) + tail / emissions as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_testkit::uniform::Uniform;

    /// Exponentially distributed numbers, whose excess kurtosis is 6, added up by `count`.
    fn sum(numbers: &mut Uniform, count: u32) -> f64 {
        (0..count).map(|_| -libm::log1p(-numbers.next_f64())).sum()
    }

    #[test]
    fn the_kurtosis_of_sums_falls_as_their_number() {
        let mut numbers = Uniform::new(1);
        let mut kurtosis =
            |count| excess_kurtosis(&(0..200_000).map(|_| sum(&mut numbers, count)).collect::<Vec<_>>());
        assert!((kurtosis(1) - 6.0).abs() < 0.6);
        assert!((kurtosis(4) - 1.5).abs() < 0.2);
        assert!(excess_kurtosis(&[1.0; 9]).abs() < 1e-12 && excess_kurtosis(&[1.0, 2.0]).abs() < 1e-12);
    }

    /// The logarithm of a standard error from 32 batches scatters as the tail says, and not as batches without one would.
    #[test]
    fn standard_errors_scatter_as_their_tails_say() {
        const BATCHES: u32 = 32;
        const RUNS: u32 = 4000;
        let mut numbers = Uniform::new(2);
        let logarithms: Vec<f64> = (0..RUNS)
            .map(|_| {
                let batches: Vec<f64> = (0..BATCHES).map(|_| sum(&mut numbers, 1)).collect();
                let mean = batches.iter().sum::<f64>() / f64::from(BATCHES);
                0.5 * libm::log(batches.iter().map(|batch| (batch - mean) * (batch - mean)).sum::<f64>())
            })
            .collect();
        let mean = logarithms.iter().sum::<f64>() / f64::from(RUNS);
        let found = logarithms.iter().map(|l| (l - mean) * (l - mean)).sum::<f64>() / f64::from(RUNS);
        // One emission a batch: the tail is the kurtosis.
        let near = |tail| (found / scatter(BATCHES, BATCHES.into(), tail) - 1.0).abs() < 0.25;
        assert!(near(6.0), "{found} {}", scatter(BATCHES, BATCHES.into(), 6.0));
        assert!(!near(0.0), "no tail is found out");
    }
}
