//! Wave numbers at which a field is evaluated, and exponentials that decay with them.

/// k p where the exponential is spent: e^(−18) is 2e-8.
pub(crate) const SPENT: f64 = 18.0;
/// Wave numbers [1/m], ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveNumbers {
    values: Vec<f64>,
    /// Index of the one that is half as large: e^(−kp) is then the square of what it is there.
    halves: Vec<Option<usize>>,
}

impl WaveNumbers {
    /// Wave numbers [1/m].
    #[must_use]
    pub fn new(values: Vec<f64>) -> Self {
        let find = |wanted: f64| {
            let is_it = |k: &f64| (k - wanted).abs() <= 4.0 * f64::EPSILON * wanted;
            values.iter().position(is_it)
        };
        Self { halves: values.iter().map(|k| find(0.5 * k)).collect(), values }
    }

    /// The wave numbers [1/m], ascending.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// e^(−kp), `p` in [m], of those at which it is not spent; written to `decays`, which has a place for each.
    pub(crate) fn decay<'a>(&self, p: f64, decays: &'a mut [f64]) -> &'a [f64] {
        let left = self.values.partition_point(|k| k * p <= SPENT);
        for index in 0..left {
            decays[index] = match self.halves[index] {
                Some(half) => decays[half] * decays[half],
                None => libm::exp(-self.values[index] * p),
            };
        }
        &decays[..left]
    }
}

impl From<f64> for WaveNumbers {
    fn from(k: f64) -> Self {
        Self::new(vec![k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octaves_are_squares() {
        let numbers = WaveNumbers::new(vec![1.1, 1.7, 2.2, 3.4, 4.4, 5.0]);
        assert_eq!(numbers.halves, [None, None, Some(0), Some(1), Some(2), None]);
        let mut decays = [0.0; 6];
        for (decay, k) in numbers.decay(0.7, &mut decays).iter().zip(numbers.values()) {
            assert!((decay / (-0.7 * k).exp() - 1.0).abs() < 1e-14);
        }
        assert_eq!(numbers.decay(6.0, &mut decays).len(), 3, "beyond e^(−18) nothing is asked for");
    }
}
