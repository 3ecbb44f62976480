//! Numbers of rays, and several numbers in one word.

use anyhow::Context;
use sonel::parse_count;

/// Parses a number of rays.
///
/// # Errors
/// A sentence for the user where `text` is not a count of at least one, or too large.
pub fn parse_rays(text: &str) -> anyhow::Result<u32> {
    let rays = u32::try_from(parse_count(text)?).ok().filter(|rays| *rays > 0);
    rays.with_context(|| format!("give 1 … {} rays", u32::MAX))
}

/// N finite numbers with a `separator` between them; none where `text` is anything else.
#[must_use]
pub fn numbers<const N: usize>(text: &str, separator: char) -> Option<[f64; N]> {
    let finite = |part: &str| part.trim().parse().ok().filter(|number: &f64| number.is_finite());
    let numbers: Option<Vec<f64>> = text.split(separator).map(finite).collect();
    numbers?.try_into().ok()
}
