//! Parameters of one band near known coefficients, and the coefficients that come nearest to wanted values.
//!
//! From values and derivatives at one set of coefficients: packets that met a surface n times carry (1−α)ⁿ, so decay rates and levels are
//! nearly straight over −ln(1−α). Reverberation times are continued as 1/T, everything else as it is. Coefficients c stay within their
//! bounds by c = l + (h−l)/(1+e^−y); the least squares over y are those of Levenberg and Marquardt as MINPACK has them [More1978].

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use sonel_acoustics::Coefficient;
use sonel_analysis::Parameter;

/// Largest ratio of a continued reverberation time to its value [1]. Chosen, not measured; it keeps times finite where absorption vanishes.
const LONGEST: f64 = 20.0;
/// |y| beyond which a coefficient is at its bound to 1e-5.
const STEEPEST: f64 = 12.0;
/// |y| at which a search begins at most: the derivative of the coefficient is 0.007 there, beyond it the search would hardly move.
const FLATTEST: f64 = 5.0;
/// Absorption is read as this at the most: nothing is left to multiply beyond.
const BLACKEST: f64 = 1.0 - 1e-6;

/// A coefficient that may change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Unknown {
    pub coefficient: Coefficient,
    /// Point at which values and derivatives are known.
    pub at: f64,
    /// Lowest and highest value.
    pub bounds: [f64; 2],
    /// Mean of its prior, in y.
    pub believed: f64,
    /// Standard deviation of its prior, in y.
    pub sigma: f64,
}

/// A value that is wanted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Datum {
    pub parameter: Parameter,
    /// Value of the map.
    pub value: f64,
    /// Derivatives by each unknown.
    pub slopes: Vec<f64>,
    pub wanted: f64,
    /// Standard deviation of value and wanted value together.
    pub sigma: f64,
}

/// One band.
#[derive(Debug, Clone, Default)]
pub(crate) struct Local {
    pub unknowns: Vec<Unknown>,
    pub data: Vec<Datum>,
}

impl Unknown {
    /// y of a coefficient within the bounds.
    pub(crate) fn logit(&self, coefficient: f64) -> f64 {
        let [low, high] = self.bounds;
        let share = ((coefficient - low) / (high - low)).clamp(0.0, 1.0);
        libm::log(share / (1.0 - share)).clamp(-STEEPEST, STEEPEST)
    }

    /// The coefficient and its derivative by y.
    pub(crate) fn of_logit(&self, y: f64) -> (f64, f64) {
        let [low, high] = self.bounds;
        let share = 1.0 / (1.0 + libm::exp(-y));
        (low + (high - low) * share, (high - low) * share * (1.0 - share))
    }

    /// What parameters are straight over, from where they are known, and its derivatives there and at `coefficient`.
    fn abscissa(&self, coefficient: f64) -> (f64, f64, f64) {
        if self.coefficient == Coefficient::Absorption {
            let [at, here] = [self.at, coefficient].map(|alpha| alpha.min(BLACKEST));
            let passed = libm::log1p(-at) - libm::log1p(-here);
            (passed, 1.0 / (1.0 - at), 1.0 / (1.0 - here))
        } else {
            (coefficient - self.at, 1.0, 1.0)
        }
    }
}

impl Datum {
    /// The parameter at `coefficients`, and its derivatives by them.
    pub(crate) fn predict(&self, unknowns: &[Unknown], coefficients: &[f64]) -> (f64, Vec<f64>) {
        let is_time = self.parameter.is_noticed_relatively();
        // dz/dg at the known value, z being what is straight.
        let straight = if is_time { -1.0 / (self.value * self.value) } else { 1.0 };
        let (mut change, mut slopes) = (0.0, Vec::with_capacity(unknowns.len()));
        for ((unknown, &coefficient), slope) in unknowns.iter().zip(coefficients).zip(&self.slopes) {
            let (passed, there, here) = unknown.abscissa(coefficient);
            let slope = straight * slope / there;
            change += slope * passed;
            slopes.push(slope * here);
        }
        if !is_time {
            return (self.value + change, slopes);
        }
        let floor = 1.0 / (LONGEST * self.value);
        let rate = 1.0 / self.value + change;
        if rate < floor {
            return (1.0 / floor, vec![0.0; slopes.len()]);
        }
        slopes.iter_mut().for_each(|slope| *slope *= -1.0 / (rate * rate));
        (1.0 / rate, slopes)
    }

    fn deviation(&self, value: f64) -> f64 {
        (value - self.wanted) / self.sigma
    }
}

impl Local {
    /// y of the least squares: near the wanted values and near what is believed.
    pub(crate) fn solve(&self) -> Vec<f64> {
        if self.unknowns.is_empty() {
            return Vec::new();
        }
        let start = self
            .unknowns
            .iter()
            .map(|unknown| unknown.logit(unknown.at).clamp(-FLATTEST, FLATTEST))
            .collect();
        let problem = Problem { local: self, y: DVector::from_vec(start) };
        let (solved, _) = LevenbergMarquardt::new().minimize(problem);
        solved.y.iter().map(|y| y.clamp(-STEEPEST, STEEPEST)).collect()
    }

    /// Coefficients at `y`.
    pub(crate) fn coefficients(&self, y: &[f64]) -> Vec<f64> {
        self.unknowns.iter().zip(y).map(|(unknown, &y)| unknown.of_logit(y).0).collect()
    }

    /// Half the sum of squares at `y`.
    pub(crate) fn cost(&self, y: &[f64]) -> f64 {
        0.5 * self.residuals(y).norm_squared()
    }

    /// Deviations of the data in standard deviations, then those of the unknowns from what is believed.
    pub(crate) fn residuals(&self, y: &[f64]) -> DVector<f64> {
        let coefficients = self.coefficients(y);
        let data =
            self.data.iter().map(|datum| datum.deviation(datum.predict(&self.unknowns, &coefficients).0));
        let believed = self
            .unknowns
            .iter()
            .zip(y)
            .map(|(unknown, y)| (y - unknown.logit(unknown.believed)) / unknown.sigma);
        let residuals: Vec<f64> = data.chain(believed).collect();
        DVector::from_vec(residuals)
    }

    /// Derivatives of the residuals by y.
    pub(crate) fn jacobian(&self, y: &[f64]) -> DMatrix<f64> {
        let (coefficients, count) = (self.coefficients(y), self.unknowns.len());
        let mut jacobian = DMatrix::zeros(self.data.len() + count, count);
        for (row, datum) in self.data.iter().enumerate() {
            let (_, slopes) = datum.predict(&self.unknowns, &coefficients);
            for (column, (unknown, slope)) in self.unknowns.iter().zip(slopes).enumerate() {
                jacobian[(row, column)] = slope * unknown.of_logit(y[column]).1 / datum.sigma;
            }
        }
        for (column, unknown) in self.unknowns.iter().enumerate() {
            jacobian[(self.data.len() + column, column)] = 1.0 / unknown.sigma;
        }
        jacobian
    }
}

struct Problem<'a> {
    local: &'a Local,
    y: DVector<f64>,
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, y: &DVector<f64>) {
        self.y.copy_from(y);
    }

    fn params(&self) -> DVector<f64> {
        self.y.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.local.residuals(self.y.as_slice()))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        Some(self.local.jacobian(self.y.as_slice()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two surfaces of a room in which T = 0.161 V / (Σ S u + 4 m V), u = −ln(1−α): straight over u as the model has it.
    fn eyring(alpha: [f64; 2]) -> (f64, Vec<f64>) {
        let areas = [60.0, 140.0];
        let rate = |alpha: f64, area: f64| -area * libm::log1p(-alpha);
        let time = 0.161 * 200.0 / (rate(alpha[0], areas[0]) + rate(alpha[1], areas[1]) + 2.0);
        let slope = |i: usize| -time * time / (0.161 * 200.0) * areas[i] / (1.0 - alpha[i]);
        (time, vec![slope(0), slope(1)])
    }

    fn local(sigma: f64) -> Local {
        let at = [0.1, 0.2];
        let (value, slopes) = eyring(at);
        let unknown = |at: f64| Unknown {
            coefficient: Coefficient::Absorption,
            at,
            bounds: [0.0, 1.0],
            believed: at,
            sigma: 0.5,
        };
        let datum = Datum {
            parameter: Parameter::T20,
            value,
            slopes,
            wanted: eyring([0.3, 0.45]).0,
            sigma: sigma * value,
        };
        Local { unknowns: at.map(unknown).to_vec(), data: vec![datum] }
    }

    #[test]
    fn the_model_is_exact_where_decay_rates_add_up() {
        let local = local(1e-3);
        for alpha in [[0.05, 0.9], [0.3, 0.45], [0.6, 0.02]] {
            let (expected, slopes) = eyring(alpha);
            let (found, found_slopes) = local.data[0].predict(&local.unknowns, &alpha);
            assert!((found / expected - 1.0).abs() < 1e-12);
            for (found, expected) in found_slopes.iter().zip(&slopes) {
                assert!((found / expected - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn derivatives_are_differences() {
        let local = local(0.01);
        let y = [0.3, -1.2];
        let jacobian = local.jacobian(&y);
        for column in 0..2 {
            let mut shifted = y;
            shifted[column] += 1e-6;
            let difference = (local.residuals(&shifted) - local.residuals(&y)) / 1e-6;
            for row in 0..3 {
                let (found, expected) = (jacobian[(row, column)], difference[row]);
                assert!((found - expected).abs() < 1e-4 * (1.0 + expected.abs()), "{found} {expected}");
            }
        }
    }

    #[test]
    fn a_certain_value_is_met_and_an_uncertain_one_changes_nothing() {
        let alphas = |sigma: f64| {
            let local = local(sigma);
            let found = local.coefficients(&local.solve());
            (local.data[0].predict(&local.unknowns, &found).0 / local.data[0].wanted, found)
        };
        let (ratio, found) = alphas(1e-5);
        assert!((ratio - 1.0).abs() < 1e-6 && found[0] > 0.1 && found[1] > 0.2, "{ratio} {found:?}");
        let (_, found) = alphas(1e3);
        assert!((found[0] - 0.1).abs() + (found[1] - 0.2).abs() < 1e-4, "{found:?}");
    }
}
