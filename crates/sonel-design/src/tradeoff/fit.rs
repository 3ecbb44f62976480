//! Straight lines through measured points, with intervals of their slopes.

use sonel_analysis::{jackknife, student};

/// A value with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// In its unit.
    pub value: f64,
    /// In its unit; none where there are too few points or repeats to tell.
    pub interval: Option<[f64; 2]>,
}

impl Measured {
    /// `value` with an interval that is as wide to either side.
    #[must_use]
    pub fn within(value: f64, half_width: Option<f64>) -> Self {
        Self { value, interval: half_width.map(|half| [value - half, value + half]) }
    }

    /// `factor` times as much, `factor` above zero.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self { value: factor * self.value, interval: self.interval.map(|ends| ends.map(|end| factor * end)) }
    }

    /// Half of the width of the interval.
    #[must_use]
    pub fn half_width(&self) -> Option<f64> {
        self.interval.map(|[low, high]| 0.5 * (high - low))
    }

    /// Whether `value` lies in the interval; anything does where there is none.
    #[must_use]
    pub fn allows(&self, value: f64) -> bool {
        self.interval.is_none_or(|[low, high]| (low..=high).contains(&value))
    }
}

/// y = intercept + slope x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// At x = 0, in the unit of y.
    pub intercept: Measured,
    /// In units of y per unit of x.
    pub slope: Measured,
}

/// Weighted least squares through `points` (x, y, weight), weights above zero in proportion to 1/variance of y. Intervals are
/// Student's, from the residuals; none through two points. [`None`] where fewer than two x differ.
#[must_use]
pub fn line(points: &[(f64, f64, f64)]) -> Option<Line> {
    let total: f64 = points.iter().map(|(_, _, weight)| weight).sum();
    let mean = |of: &dyn Fn(f64, f64) -> f64| {
        points.iter().map(|&(x, y, weight)| weight * of(x, y)).sum::<f64>() / total
    };
    let (x_mean, y_mean) = (mean(&|x, _| x), mean(&|_, y| y));
    let spread = mean(&|x, _| (x - x_mean) * (x - x_mean));
    // The spread of equal x is rounding.
    if points.iter().all(|(x, ..)| x.total_cmp(&points[0].0).is_eq()) {
        return None;
    }
    let slope = mean(&|x, y| (x - x_mean) * (y - y_mean)) / spread;
    let intercept = y_mean - slope * x_mean;
    let residual = mean(&|x, y| (y - intercept - slope * x) * (y - intercept - slope * x));
    let half_width = |variance: f64| {
        let freedom = points.len() as u32 - 2;
        (freedom > 0).then(|| {
            let sigma = (residual / f64::from(freedom) * variance).sqrt();
            student::quantile(student::MISSED, freedom) * sigma
        })
    };
    Some(Line {
        intercept: Measured::within(intercept, half_width(1.0 + x_mean * x_mean / spread)),
        slope: Measured::within(slope, half_width(1.0 / spread)),
    })
}

/// What `read` makes of all `repeats`, with an interval from leaving out each of them: right where errors of several points
/// belong together, since all that share a seed leave together. [`None`] where `read` fails on all repeats.
#[must_use]
pub fn over_repeats(repeats: usize, read: impl Fn(Option<usize>) -> Option<f64>) -> Option<Measured> {
    let value = read(None).filter(|value| value.is_finite())?;
    let without: Option<Vec<f64>> =
        (0..repeats).map(|repeat| read(Some(repeat)).filter(|value| value.is_finite())).collect();
    let weight = vec![1.0 / repeats as f64; repeats];
    let half_width =
        without.filter(|_| repeats > 2).map(|without| jackknife::spread(value, &without, &weight).half_width);
    Some(Measured::within(value, half_width))
}

/// The same for what is above zero and known in proportion: a deviation, a cost, an efficiency. [`None`] also where it is not
/// above zero.
#[must_use]
pub fn ratio_over_repeats(repeats: usize, read: impl Fn(Option<usize>) -> Option<f64>) -> Option<Measured> {
    let logarithm = |left_out| read(left_out).filter(|value| *value > 0.0).map(libm::log);
    let Measured { value, interval } = over_repeats(repeats, logarithm)?;
    Some(Measured { value: libm::exp(value), interval: interval.map(|ends| ends.map(libm::exp)) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_testkit::uniform::Uniform;

    /// Standard normal numbers.
    fn normal(numbers: &mut Uniform) -> f64 {
        let (u, v) = (numbers.next_f64(), numbers.next_f64());
        (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    #[test]
    fn a_line_is_found_and_its_residuals_make_the_interval() {
        let exact: Vec<_> = [1.0, 2.0, 5.0, 9.0].map(|x| (x, 3.0 - 0.5 * x, x)).into();
        let found = line(&exact).unwrap();
        assert!((found.slope.value + 0.5).abs() < 1e-12 && (found.intercept.value - 3.0).abs() < 1e-12);
        assert!(found.slope.half_width().unwrap() < 1e-6);
        // By hand: y = 0, 1, 0 at x = 0, 1, 2: slope 0, intercept 1/3, residual variance 2/3 / 1, sigma of slope √(1/3).
        let bent = line(&[(0.0, 0.0, 1.0), (1.0, 1.0, 1.0), (2.0, 0.0, 1.0)]).unwrap();
        assert!(bent.slope.value.abs() < 1e-12 && (bent.intercept.value - 1.0 / 3.0).abs() < 1e-12);
        let expected = student::quantile(0.05, 1) * (1.0_f64 / 3.0).sqrt();
        assert!((bent.slope.half_width().unwrap() - expected).abs() < 1e-9);
        assert_eq!(line(&[(1.0, 2.0, 1.0)]), None);
        assert_eq!(line(&[(1.0, 2.0, 1.0), (1.0, 3.0, 1.0)]), None);
        // By rounding the mean of these equal x is another number.
        assert_eq!(line(&[(1000.0, 2.0, 1e-6); 4]), None);
        assert_eq!(line(&[(1.0, 2.0, 1.0), (2.0, 3.0, 1.0)]).unwrap().slope.interval, None);
    }

    /// How many of 300 intervals of a weighted line hold the true slope, with noise that grows as x does and `weight` of x.
    fn held(weight: impl Fn(f64) -> f64, seed: u64) -> u32 {
        let mut numbers = Uniform::new(seed);
        let holds = (0..300).filter(|_| {
            let xs = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];
            let points = xs.map(|x| (x, 2.0 + 0.7 * x + 0.1 * x * normal(&mut numbers), weight(x)));
            let slope = line(&points).unwrap().slope;
            slope.interval.is_some() && slope.allows(0.7)
        });
        holds.count() as u32
    }

    /// 95 % of 300 are 285 ± 3.8; four standard deviations below is 270.
    #[test]
    fn intervals_of_a_line_hold_its_slope_where_the_weights_are_right() {
        let right = held(|x| 1.0 / (x * x), 1);
        assert!((270..=299).contains(&right), "{right}");
    }

    /// The sibling: without weights the residuals of the small x, which hardly scatter, narrow the intervals.
    #[test]
    fn wrong_weights_are_noticed() {
        let wrong = held(|_| 1.0, 1);
        assert!(!(270..=299).contains(&wrong), "{wrong}");
    }
}
