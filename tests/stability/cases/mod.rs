//! The hard cases by family; each family keeps a broken variant that its cases reject.

mod air;
mod coefficients;
mod decays;
mod edges;
mod estimators;
mod geometry;
mod junctions;
mod outputs;
mod positions;
mod properties;
mod statistics;

/// How much a case spends.
#[derive(Clone, Copy, PartialEq, Eq)]
#[allow(dead_code)] // each of the two binaries that share these modules is one of them
pub(crate) enum Form {
    /// For every change: seconds.
    Quick,
    /// Before a release.
    Long,
}

/// What a case uses in the form that runs.
fn form<T>(quick: T, long: T) -> T {
    if crate::FORM == Form::Long { long } else { quick }
}
