//! SOFA files [AES69]: attributes and arrays of any convention, and triangles between measured directions.
//!
//! A file is read where it is stored as the netCDF library does it, and refused otherwise (`stored`). Positions are as in SOFA: x ahead,
//! y to the left, z up.
//!
//! References: [AES69] (docs/references.md).

mod array;
mod stored;
mod triangles;
mod triplets;

pub use array::{Array, Sofa};
pub use triangles::{Triangles, Weights};
pub use triplets::{Triplets, spherical};

use thiserror::Error;

/// Description of files that are not read: damaged ones, and those of HDF5 before 1.8 or since 1.10, in uncompressed or very many chunks.
const UNREAD: &str = "the file is damaged, or stored otherwise than by the netCDF library";

/// Why a file is not read, or its contents are not taken, in a sentence.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct SofaError(String);

impl<S: Into<String>> From<S> for SofaError {
    fn from(sentence: S) -> Self {
        Self(sentence.into())
    }
}
