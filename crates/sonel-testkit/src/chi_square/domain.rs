//! Samplers of two dimensions: cells of equal area on the square, the sphere and the hemisphere.

use std::f64::consts::TAU;

use super::{Flaw, Verdict, goodness_of_fit};
use crate::quadrature::integrate_rectangle;
use crate::uniform::Uniform;
use crate::vector::dot;

/// How far a direction may be from unit length: the rounding of a normalised `f32` vector.
const UNIT_TOLERANCE: f64 = 4.0 * f32::EPSILON as f64;

/// How a sampler is tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Seed of the uniform numbers of the first run; the others follow.
    pub seed: u64,
    /// Independent repetitions.
    pub runs: usize,
    /// Samples of one run.
    pub samples: usize,
    /// Cells along the first coordinate (x, or the azimuth) and the second (y, or the cosine of the polar angle).
    pub cells: [usize; 2],
    /// Chance that a correct sampler is rejected, over all runs.
    pub significance: f64,
}

impl Plan {
    /// Five runs of 100 000 samples on 24 × 16 cells at 1 % significance. The seed is a constant of the test: a
    /// correct sampler that happens to be rejected is given another one once, not a wider tolerance.
    pub fn seeded(seed: u64) -> Self {
        Self { seed, runs: 5, samples: 100_000, cells: [24, 16], significance: 0.01 }
    }
}

/// Tests a sampler of the unit square [0, 1]² against its density.
///
/// `sample` turns uniform numbers into a point; `density` is per unit area.
pub fn square(
    plan: Plan,
    sample: impl FnMut(&mut Uniform) -> [f64; 2],
    density: impl Fn([f64; 2]) -> f64,
) -> Verdict {
    let chart = Chart { low: [0.0, 0.0], high: [1.0, 1.0] };
    chart.judge(plan, sample, density, Ok)
}

/// Tests a sampler of unit vectors against its density on the whole sphere [1/sr].
pub fn sphere(
    plan: Plan,
    sample: impl FnMut(&mut Uniform) -> [f64; 3],
    density: impl Fn([f64; 3]) -> f64,
) -> Verdict {
    let chart = Chart { low: [0.0, -1.0], high: [TAU, 1.0] };
    chart.judge(plan, sample, |at| density(direction(at)), polar)
}

/// Tests a sampler of unit vectors with z ≥ 0 against its density on the hemisphere about +z [1/sr].
///
/// A vector below the horizon is rejected; wrap samplers about another normal by components in a frame.
pub fn hemisphere(
    plan: Plan,
    sample: impl FnMut(&mut Uniform) -> [f64; 3],
    density: impl Fn([f64; 3]) -> f64,
) -> Verdict {
    let chart = Chart { low: [0.0, 0.0], high: [TAU, 1.0] };
    chart.judge(plan, sample, |at| density(direction(at)), polar)
}

/// A rectangle of coordinates in which equal areas are equal areas of the domain.
struct Chart {
    low: [f64; 2],
    high: [f64; 2],
}

impl Chart {
    fn judge<P: Copy>(
        &self,
        plan: Plan,
        mut sample: impl FnMut(&mut Uniform) -> P,
        density: impl Fn([f64; 2]) -> f64,
        coordinates: impl Fn(P) -> Result<[f64; 2], Flaw>,
    ) -> Verdict {
        let probabilities = self.probabilities(plan.cells, density);
        let mut p_values = Vec::new();
        for run in 0..plan.runs {
            let mut numbers = Uniform::new(plan.seed.wrapping_add(run as u64));
            let points = (0..plan.samples).map(|_| coordinates(sample(&mut numbers)));
            let fit =
                self.histogram(plan.cells, points).and_then(|seen| goodness_of_fit(&seen, &probabilities));
            match fit {
                Ok(fit) => p_values.push(fit.p_value),
                Err(flaw) => {
                    return Verdict {
                        p_values: Vec::new(),
                        significance: plan.significance,
                        flaw: Some(flaw),
                    };
                }
            }
        }
        Verdict { p_values, significance: plan.significance, flaw: None }
    }

    /// Counts per cell, first coordinate fastest.
    fn histogram(
        &self,
        cells: [usize; 2],
        points: impl Iterator<Item = Result<[f64; 2], Flaw>>,
    ) -> Result<Vec<u64>, Flaw> {
        let mut counts = vec![0; cells[0] * cells[1]];
        for point in points {
            let point = point?;
            let mut cell = [0; 2];
            for k in 0..2 {
                if !(self.low[k]..=self.high[k]).contains(&point[k]) {
                    return Err(Flaw::Outside { sample: [point[0], point[1], 0.0] });
                }
                let part = (point[k] - self.low[k]) / (self.high[k] - self.low[k]);
                cell[k] = ((part * cells[k] as f64) as usize).min(cells[k] - 1);
            }
            counts[cell[0] + cells[0] * cell[1]] += 1;
        }
        Ok(counts)
    }

    /// Probability of each cell, in the order of [`Chart::histogram`].
    fn probabilities(&self, cells: [usize; 2], density: impl Fn([f64; 2]) -> f64) -> Vec<f64> {
        let edge =
            |k: usize, i: usize| self.low[k] + (self.high[k] - self.low[k]) * i as f64 / cells[k] as f64;
        let cell = |i: usize| [i % cells[0], i / cells[0]];
        (0..cells[0] * cells[1])
            .map(cell)
            .map(|[i, j]| {
                integrate_rectangle([edge(0, i), edge(1, j)], [edge(0, i + 1), edge(1, j + 1)], &density)
            })
            .collect()
    }
}

/// Azimuth [rad] in 0…2π and cosine of the polar angle, of a unit vector.
fn polar(v: [f64; 3]) -> Result<[f64; 2], Flaw> {
    // A NaN fails the comparison, as it should.
    if (dot(v, v).sqrt() - 1.0).abs() <= UNIT_TOLERANCE {
        Ok([v[1].atan2(v[0]).rem_euclid(TAU), v[2].clamp(-1.0, 1.0)])
    } else {
        Err(Flaw::Outside { sample: v })
    }
}

fn direction([azimuth, z]: [f64; 2]) -> [f64; 3] {
    let (sin, cos) = azimuth.sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    [r * cos, r * sin, z]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn lambert(numbers: &mut Uniform) -> [f64; 3] {
        let (radius, azimuth) = (numbers.next_f64().sqrt(), TAU * numbers.next_f64());
        [radius * azimuth.cos(), radius * azimuth.sin(), (1.0 - radius * radius).max(0.0).sqrt()]
    }

    fn even_hemisphere(numbers: &mut Uniform) -> [f64; 3] {
        let [x, y, z] = numbers.unit_vector();
        [x, y, z.abs()]
    }

    #[test]
    fn lambert_follows_the_cosine_and_nothing_else_does() {
        let verdict = hemisphere(Plan::seeded(1), lambert, |v| v[2] / PI);
        assert!(verdict.accepted(), "{verdict}");
        assert!(!hemisphere(Plan::seeded(1), even_hemisphere, |v| v[2] / PI).accepted());
        assert!(!hemisphere(Plan::seeded(1), lambert, |_| 1.0 / TAU).accepted());
    }

    #[test]
    fn a_subtle_flaw_is_found() {
        // One in forty Lambert samples replaced by an even one.
        let mixed = |numbers: &mut Uniform| {
            if numbers.next_f64() < 0.025 { even_hemisphere(numbers) } else { lambert(numbers) }
        };
        assert!(!hemisphere(Plan::seeded(2), mixed, |v| v[2] / PI).accepted());
    }

    #[test]
    fn the_hemisphere_is_half_of_the_sphere() {
        let upper = |v: [f64; 3]| if v[2] >= 0.0 { v[2] / PI } else { 0.0 };
        let verdict = sphere(Plan::seeded(3), lambert, upper);
        assert!(verdict.accepted(), "{verdict}");
        let below = |numbers: &mut Uniform| lambert(numbers).map(|x| -x);
        assert!(matches!(sphere(Plan::seeded(3), below, upper).flaw, Some(Flaw::Impossible { .. })));
        assert!(matches!(hemisphere(Plan::seeded(3), below, upper).flaw, Some(Flaw::Outside { .. })));
    }

    #[test]
    fn a_polynomial_on_the_square() {
        let bent = |numbers: &mut Uniform| [numbers.next_f64().sqrt(), numbers.next_f64().cbrt()];
        let verdict = square(Plan::seeded(4), bent, |[x, y]| 6.0 * x * y * y);
        assert!(verdict.accepted(), "{verdict}");
        let swapped = square(Plan::seeded(4), bent, |[x, y]| 6.0 * x * x * y);
        assert!(!swapped.accepted());
    }

    #[test]
    fn a_density_of_the_wrong_norm_is_rejected_although_its_shape_is_right() {
        let verdict = square(Plan::seeded(5), Uniform::square, |_| 1.01);
        assert!(matches!(verdict.flaw, Some(Flaw::NotNormalised { .. })), "{verdict}");
    }

    #[test]
    fn what_is_no_direction_is_rejected() {
        let long = |numbers: &mut Uniform| numbers.unit_vector().map(|x| 1.000_1 * x);
        let even = |_: [f64; 3]| 0.5 / TAU;
        assert!(matches!(sphere(Plan::seeded(6), long, even).flaw, Some(Flaw::Outside { .. })));
        assert!(matches!(sphere(Plan::seeded(6), |_| [f64::NAN; 3], even).flaw, Some(Flaw::Outside { .. })));
    }

    #[test]
    fn correct_samplers_are_rejected_as_rarely_as_stated() {
        let plan =
            |seed: u64| Plan { runs: 3, samples: 5000, cells: [8, 8], significance: 0.1, seed: 1000 * seed };
        let rejected =
            (0..400).filter(|&seed| !square(plan(seed), Uniform::square, |_| 1.0).accepted()).count();
        // Binomial: 40 expected, standard deviation 6.
        assert!((16..=64).contains(&rejected), "{rejected}");
    }
}
