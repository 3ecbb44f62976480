//! Errors of rendering.

use sonel_map::MapError;
use thiserror::Error;

/// Why a map could not be rendered.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The map cannot be believed.
    #[error(transparent)]
    Map(#[from] MapError),
    /// A receiver no echogram exists for.
    #[error("{}", .0.join("\n"))]
    Receivers(Vec<String>),
    /// A setting out of range.
    #[error("{0}")]
    Settings(String),
}
