//! Known-wrong ways to test the cells of two maps, which tests of the right one must be able to reject.

use sonel_analysis::map_comparison::{CellDifference, MapComparison};

/// What a normal value exceeds in either direction once in a hundred times.
const ONE_PERCENT: f64 = 2.575_829;

/// Whether any cell differs when each is tested as if it were the only one.
#[must_use]
pub fn one_by_one(comparison: &MapComparison) -> bool {
    any(comparison, |_| ONE_PERCENT)
}

/// Whether any cell differs by the right level for the family but the quantile of the normal distribution.
#[must_use]
pub fn by_the_normal_distribution(comparison: &MapComparison) -> bool {
    any(comparison, |level| {
        // Student with so many degrees of freedom is the normal distribution to four digits.
        sonel_analysis::student::quantile(level, 20_000)
    })
}

fn any(comparison: &MapComparison, quantile: impl Fn(f64) -> f64) -> bool {
    comparison.tiers.iter().any(|tier| {
        let critical = quantile(tier.level);
        let differs =
            |cell: &CellDifference| (cell.incident[1] - cell.incident[0]).abs() > critical * cell.sigma;
        tier.cells.iter().any(differs)
    })
}
