//! Predicts intervals and cost of a run from a pilot.
//!
//! Variances fall as 1/N: batches are independent, and deterministic parts have none (docs/physics.md §7). That of spheres falls more
//! slowly, as they shrink, and that of discs faster, as the rays that end in them grow with N too. Areas of discs and spheres shrink as
//! N^(−1/3), and with them their bias. The noise of visibility rays is mainly that of their directions: it falls as 1/M.

use crate::study::effort::Effort;
use crate::study::findings::{Costs, Linear, Pilot, Spread};
use crate::study::kurtosis;
use crate::study::split::Variance;
use crate::study::spread::{HalfWidth, student_factor};

/// The next number with two digits and zeros.
pub(crate) fn two_digits_up(number: u64) -> u64 {
    let mut unit = 1;
    while number / unit >= 100 {
        unit *= 10;
    }
    number.div_ceil(unit) * unit
}

/// The least number that does not exceed, to one part in `parts` of itself; `low` exceeds, `high` does not.
pub(crate) fn least_within(mut low: u64, mut high: u64, parts: u64, exceeds: impl Fn(u64) -> bool) -> u64 {
    while high - low > 1 + low / parts {
        let middle = low + (high - low) / 2;
        if exceeds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// What an interval takes for bias where there is none, in standard errors of the shift that would show it: the mean of
/// √(x² − 1), where that is real, for a normal x.
const SPURIOUS: f64 = 0.325;

/// A bias extends an interval to one side, which makes half of it longer by half the bias.
const ONE_SIDE: f64 = 0.5;

/// Standard deviations that are exceeded once in 20 times.
const MOST_SIGMAS: f64 = 1.96;

/// CPU seconds and bytes of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Price {
    /// CPU seconds of the trace.
    pub trace: f64,
    /// CPU seconds of rendering the evaluation receivers.
    pub render: f64,
    /// Bytes of the map.
    pub bytes: f64,
}

impl Pilot {
    /// Half of the 95 % interval that the parameter of `spread` will have, in just-noticeable differences.
    ///
    /// # Errors
    /// Why nobody can say.
    pub fn half_width<'a>(&self, spread: &'a Spread, effort: Effort) -> Result<HalfWidth, &'a str> {
        let variance = spread.variance.as_ref().map_err(String::as_str)?;
        let [all, areas] = self.noise(variance, effort);
        let bias = self.squared_bias(variance, effort) + SPURIOUS * SPURIOUS * 4.0 * areas;
        let noise = student_factor(effort.batches) * all.sqrt();
        Ok(HalfWidth { noise, beside: ONE_SIDE * bias.sqrt() })
    }

    /// Between which bounds that half-width is found in 19 of 20 runs, in just-noticeable differences. The standard errors of pilot and run
    /// scatter, the more the heavier the tails of the batches are; and where areas bring noise, an interval may take part of it for bias.
    ///
    /// # Errors
    /// Why nobody can say.
    pub fn range<'a>(&self, spread: &'a Spread, effort: Effort) -> Result<[f64; 2], &'a str> {
        let variance = spread.variance.as_ref().map_err(String::as_str)?;
        let width = self.half_width(spread, effort)?;
        let scatter = kurtosis::scatter(self.batches, self.emissions, spread.tail)
            + kurtosis::scatter(effort.batches, effort.emissions, spread.tail);
        let factor = libm::exp(MOST_SIGMAS * scatter.sqrt());
        let [_, areas] = self.noise(variance, effort);
        let shift = 2.0 * areas.sqrt() * (MOST_SIGMAS * MOST_SIGMAS - 1.0).sqrt();
        let real = self.squared_bias(variance, effort).sqrt();
        Ok([width.noise / factor, (width.noise + ONE_SIDE * (shift + real)) * factor])
    }

    /// Variance, and the part of it that discs and spheres show.
    fn noise(&self, variance: &Variance, effort: Effort) -> [f64; 2] {
        let packets = self.emissions as f64 / effort.emissions as f64;
        let rays = f64::from(self.rays) / f64::from(effort.rays);
        [(variance.packets + variance.areas) * packets + variance.rays * rays, variance.areas * packets]
    }

    /// The square of the bias: it grows with the areas of discs and spheres.
    fn squared_bias(&self, variance: &Variance, effort: Effort) -> f64 {
        variance.bias * libm::pow(self.emissions as f64 / effort.emissions as f64, 2.0 / 3.0)
    }

    /// The same with the costs of rendering `receivers` receivers where there were `evaluation_receivers`.
    #[must_use]
    pub fn rendered_at(mut self, receivers: usize, evaluation_receivers: usize) -> Self {
        let times = receivers as f64 / evaluation_receivers.max(1) as f64;
        let Linear { fixed, each } = self.costs.render;
        self.costs.render = Linear { fixed: times * fixed, each: times * each };
        self.costs.rays *= times;
        self
    }

    /// Cost of `effort`.
    #[must_use]
    pub fn price(&self, effort: Effort) -> Price {
        let Costs { trace, open, render, rays, bytes, .. } = self.costs;
        let as_many = effort.emissions as f64 / self.emissions as f64;
        let more_rays = (f64::from(effort.rays) / f64::from(self.rays) - as_many) * rays;
        Price {
            trace: trace.at(effort.emissions),
            render: open.at(effort.emissions) + (render.at(effort.emissions) + more_rays).max(0.0),
            bytes: bytes.at(effort.emissions),
        }
    }
}
