//! Runs that grow until their targets are met.
//!
//! After each evaluation the number of emissions grows by the need of the worst parameter, at least by a fifth and at most
//! eightfold, so that all evaluations together cost a small multiple of the last. The map is that of the final number.
//! Intervals are affected: a run stops sooner where its variance is underestimated.
//! The estimate has 31 degrees of freedom and there are few evaluations, so coverage falls from 95 by some per cent at the most
//! (docs/planning.md); [`MARGIN`] aims beyond the target so that one evaluation is usually enough.

use sonel_analysis::Unsupported;

use crate::study::spread::{NoWidth, ParameterPlace, Reading};
use crate::study::target::Targets;

/// Factor on the emissions that the last variance asks for [1]: the standard error of a variance from 32 batches is 25 %, of half-widths 13 %.
pub const MARGIN: f64 = 1.15;
/// Least and largest growth from iteration to iteration [1]: below the first the price of rendering again counts, above the second the
/// extrapolation of the variance. Chosen, not measured.
const GROWTH: [f64; 2] = [1.2, 8.0];

/// Least effort of an iteration relative to the last [1]: intervals shrink by 5 %. Chosen, not measured.
pub const WORTH_WHILE: f64 = 1.1;

/// How many after `count`, where `needed` are; some more, as the need is an estimate.
#[must_use]
pub fn grown(count: u64, needed: f64) -> u64 {
    let (count, [least, most]) = (count as f64, GROWTH);
    (MARGIN * needed).clamp(least * count, most * count).ceil() as u64
}

/// The parameters of an iteration against the targets.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetCheck {
    /// The parameter farthest from its limit; none where nothing is limited.
    pub worst: Option<Worst>,
    /// Figures that are limited and cannot be read, with the reason.
    pub not_estimable: Vec<(ParameterPlace, NoWidth)>,
}

/// The parameter farthest from its limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worst {
    /// Which one.
    pub place: ParameterPlace,
    /// Half of its 95 % interval [JND].
    pub half_width: f64,
    /// Limit [JND].
    pub limit: f64,
}

impl Worst {
    /// Half-width over limit.
    #[must_use]
    pub fn excess(&self) -> f64 {
        self.half_width / self.limit
    }
}

impl TargetCheck {
    /// Looks at `readings`.
    #[must_use]
    pub fn new(readings: &[Reading], targets: &Targets) -> Self {
        let mut check = Self { worst: None, not_estimable: Vec::new() };
        for reading in readings {
            let place = reading.place;
            match (&reading.half_width, targets.limit(place, reading.value)) {
                (Err(reason), _) => check.not_estimable.push((place, reason.clone())),
                (Ok(width), Some(limit)) => {
                    let found = Worst { place, half_width: width.total(), limit };
                    if check.worst.is_none_or(|worst| worst.excess() < found.excess()) {
                        check.worst = Some(found);
                    }
                }
                (Ok(width), None) if reading.value.is_none() => {
                    let noisy = Unsupported::Noisy { just_noticeable: width.noise };
                    check.not_estimable.push((place, noisy.into()));
                }
                (Ok(_), None) => {}
            }
        }
        check
    }

    /// Whether every parameter that can be read keeps its limit.
    #[must_use]
    pub fn is_inside(&self) -> bool {
        self.worst.is_none_or(|worst| worst.excess() <= 1.0)
    }

    /// Whether every parameter keeps its limit.
    #[must_use]
    pub fn is_reached(&self) -> bool {
        self.is_inside() && self.not_estimable.is_empty()
    }

    /// How many after `count` of whatever the variance shrinks with.
    #[must_use]
    pub fn next(&self, count: u64) -> u64 {
        let excess = self.worst.map_or(1.0, |worst| worst.excess());
        grown(count, count as f64 * excess * excess)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::spread::HalfWidth;
    use sonel_analysis::Parameter;

    fn reading(parameter: Parameter, noise: f64) -> Reading {
        let place = ParameterPlace { row: 0, band: 0, parameter };
        let half_width = Ok(HalfWidth { noise, beside: 0.0 });
        Reading { place, value: Some(1.0), half_width, kernel: None, excess_kurtosis: 0.0 }
    }

    #[test]
    fn the_figure_farthest_from_its_own_limit_decides() {
        let targets: Targets = "t30<1%,c80<0.5dB".parse().unwrap();
        let found = [
            reading(Parameter::T30, 0.4),
            reading(Parameter::ClarityC80, 0.6),
            reading(Parameter::Level, 9.0),
        ];
        let check = TargetCheck::new(&found, &targets);
        let worst = check.worst.unwrap();
        assert_eq!((worst.place.parameter, check.is_reached()), (Parameter::T30, false));
        assert!((worst.excess() - 2.0).abs() < 1e-12);
        assert!((4600..=4601).contains(&check.next(1000)));
        let calm = TargetCheck::new(&[reading(Parameter::T30, 0.19)], &targets);
        assert!(calm.is_reached());
    }

    #[test]
    fn what_cannot_be_read_is_never_reached() {
        let targets: Targets = "t30<1%".parse().unwrap();
        let mut found = reading(Parameter::T30, 0.1);
        found.half_width = Err(Unsupported::NoEnergy.into());
        let check = TargetCheck::new(&[found], &targets);
        assert!(check.is_inside() && !check.is_reached());
    }

    #[test]
    fn runs_grow_by_a_fifth_to_eightfold() {
        let targets: Targets = "t30<1jnd".parse().unwrap();
        let next = |noise| TargetCheck::new(&[reading(Parameter::T30, noise)], &targets).next(1000);
        assert_eq!([next(1.01), next(100.0)], [1200, 8000]);
    }
}
