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

/// Description of files that are not read: damaged ones, and those of HDF5 before 1.8 or since 1.10, in uncompressed or very many chunks.
pub const UNREAD: &str = "the file is damaged, or stored otherwise than by the netCDF library";
