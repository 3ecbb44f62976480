//! Names that users give.

use crate::{Error, Result, quantity};

pub use sonel_analysis::shown::{message, shown};

/// The place of `wanted` among the `known` names.
///
/// # Errors
/// [`Error::Refused`]: begins with `none`, such as `the map has no source`, and lists the known names.
pub fn place<'a>(known: impl IntoIterator<Item = &'a str>, wanted: &str, none: &str) -> Result<usize> {
    let known: Vec<&str> = known.into_iter().collect();
    let found = known.iter().position(|name| *name == wanted);
    found.ok_or_else(|| {
        let known: Vec<String> = known.iter().map(|name| format!("\"{name}\"")).collect();
        Error::refused(format!("{none} \"{wanted}\"; it has {}", known.join(", ")))
    })
}

/// The band of the nominal centre `wanted` [Hz].
///
/// # Errors
/// [`Error::Refused`]: begins with `none`, such as `the map has no band`, and lists the `centers`.
pub fn band(centers: &[f64], wanted: f64, none: &str) -> Result<usize> {
    let found = centers.iter().position(|center| (wanted / center - 1.0).abs() < 1e-3);
    found.ok_or_else(|| {
        Error::refused(format!("{none} of {wanted} Hz; it has {} Hz", quantity::list(centers)))
    })
}
