//! Intervals of fitted coefficients, and coefficients that the measurement cannot separate.
//!
//! With J the derivatives of the deviations in standard deviations by y, H = JᵀJ + 1/w² and K = H⁻¹Jᵀ, a change of the data changes y by K
//! times it. The variance has three parts: K applied to the noise of the measurement, K applied to the batches of the map left out one at a
//! time (they share packets, so that their noise is not independent), and what the prior leaves.

use nalgebra::{DMatrix, DVector};
use sonel_acoustics::Coefficient;
use sonel_analysis::student::NORMAL_95;
use sonel_analysis::{Estimate, jackknife};

use crate::local::{Datum, Local, Unknown};

/// Root mean square of a short step [standard errors]. Chosen, not measured; doubled, fits end a rendering earlier.
const STEP: f64 = 0.5;
/// χ² of four degrees of freedom exceeds this many times its mean in one of ten cases.
const REDRAWN: f64 = 2.0;
/// Largest share of the prior variance [1] that the measurement leaves of an identified coefficient: half, so that it counts more than the prior.
const LEFT: f64 = 0.5;
/// Cosine of the angle between derivatives from which on coefficients are confounded: 18°. Chosen, not measured; 0.81 doubles the angle.
const ALIKE: f64 = 0.95;

/// Certainty of a fitted coefficient.
#[derive(Debug, Clone, PartialEq)]
pub enum Identifiability {
    /// The measurement determines it.
    Identified,
    /// Nothing measured depends on it enough.
    Insensitive,
    /// Confounded with these (indices of materials and their coefficients): it would be determined if they were known. With all others together where there are none.
    Confounded(Vec<(usize, Coefficient)>),
}

/// Certainty of one coefficient.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Certainty {
    /// Half of the 95 % interval of y.
    pub half_width: f64,
    /// Part of the variance left by the data, with all others unknown and with all others known.
    left: [f64; 2],
    alike: Vec<usize>,
}

impl Certainty {
    /// In terms of the `materials` of `unknowns`.
    pub(super) fn identifiability(&self, materials: &[usize], unknowns: &[Unknown]) -> Identifiability {
        match self.left {
            [_, alone] if alone > LEFT => Identifiability::Insensitive,
            [together, _] if together > LEFT => {
                let name = |&other: &usize| (materials[other], unknowns[other].coefficient);
                Identifiability::Confounded(self.alike.iter().map(name).collect())
            }
            _ => Identifiability::Identified,
        }
    }
}

/// (JᵀJ + 1/w²)⁻¹: the prior keeps it from being singular.
fn covariance(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let normal = jacobian.transpose() * jacobian;
    normal.cholesky().expect("every column has its prior").inverse()
}

/// Reduction of half the sum of squares below which a step need not be checked by another rendering.
///
/// A step d reduces it by ½ dᵀHd. In this metric no combination of coefficients moves by more of its standard error than √(dᵀHd), and
/// coefficients that the data leave free weigh nothing, since the prior holds them. Two terms: [`STEP`] of a standard error in each of the
/// Σh directions that the data determine, h being the diagonal of JH⁻¹Jᵀ (the error left is of second order in the step), and the noise of
/// the map, part f of the variance of a value. Roulette of rays depends on coefficients, so each rendering draws part of that noise anew; two
/// independent draws lie Σhf apart in the mean.
pub(super) fn settled_reduction(local: &Local, y: &[f64], estimates: &[Estimate]) -> f64 {
    if y.is_empty() {
        return 0.0;
    }
    let jacobian = local.jacobian(y);
    let covariance = covariance(&jacobian);
    let of = |(row, (datum, estimate)): (usize, (&Datum, &Estimate))| {
        let slopes = jacobian.row(row);
        let noise = estimate.error.map_or(0.0, |error| error.sigma / datum.sigma);
        (slopes * &covariance * slopes.transpose())[(0, 0)] * (0.5 * STEP * STEP + REDRAWN * noise * noise)
    };
    local.data.iter().zip(estimates).enumerate().map(of).sum()
}

/// Certainty of every unknown of `local` at `y`; `noise` are the standard deviations of the measured values, `estimates` the computed ones.
pub(super) fn of(local: &Local, y: &[f64], noise: &[f64], estimates: &[Estimate]) -> Vec<Certainty> {
    if y.is_empty() {
        return Vec::new();
    }
    let jacobian = local.jacobian(y);
    let (count, covariance) = (local.data.len(), covariance(&jacobian));
    let data = jacobian.rows(0, count).into_owned();
    let gain = &covariance * data.transpose();
    let batches = without_batches(local, estimates, &gain);
    let column = |k: usize| data.column(k).into_owned();
    let certainty = |(k, unknown): (usize, &Unknown)| {
        let share = |i: usize| gain[(k, i)] * noise[i] / local.data[i].sigma;
        let measured: f64 = (0..count).map(|i| share(i) * share(i)).sum();
        let prior = |(other, unknown): (usize, &Unknown)| {
            let part = covariance[(k, other)] / unknown.sigma;
            part * part
        };
        let believed: f64 = local.unknowns.iter().enumerate().map(prior).sum();
        let sampled = batches.as_ref().map_or(0.0, |(shifts, weight)| {
            let shifts: Vec<f64> = shifts.iter().map(|shift| shift[k]).collect();
            jackknife::spread(0.0, &shifts, weight).half_width
        });
        let information = column(k).norm_squared() * unknown.sigma * unknown.sigma;
        Certainty {
            half_width: libm::hypot(NORMAL_95 * (measured + believed).sqrt(), sampled),
            left: [covariance[(k, k)] / (unknown.sigma * unknown.sigma), 1.0 / (1.0 + information)],
            alike: (0..y.len()).filter(|&other| other != k && is_alike(&column(k), &column(other))).collect(),
        }
    };
    local.unknowns.iter().enumerate().map(certainty).collect()
}

fn is_alike(a: &DVector<f64>, b: &DVector<f64>) -> bool {
    a.dot(b).abs() > ALIKE * a.norm() * b.norm()
}

/// By how much y changes without each batch, and what the batches weigh; none where values have none.
fn without_batches(
    local: &Local,
    estimates: &[Estimate],
    gain: &DMatrix<f64>,
) -> Option<(Vec<DVector<f64>>, Vec<f64>)> {
    let weight = estimates.iter().map(|estimate| &estimate.weight).find(|weight| weight.len() > 1)?;
    let deviation = |estimate: &Estimate, batch: usize| {
        if estimate.without.len() != weight.len() {
            return 0.0;
        }
        let centre: f64 = estimate.without.iter().zip(weight).map(|(value, weight)| value * weight).sum();
        estimate.without[batch] - centre
    };
    let shift = |batch: usize| {
        let values = estimates.iter().zip(&local.data);
        let deviations: Vec<f64> =
            values.map(|(estimate, datum)| deviation(estimate, batch) / datum.sigma).collect();
        -(gain * DVector::from_vec(deviations))
    };
    Some(((0..weight.len()).map(shift).collect(), weight.clone()))
}
