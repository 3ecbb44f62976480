//! Echograms with batch statistics and discrete arrivals: types and files.
//!
//! A [`Response`] is what `sonel-render` writes and `sonel-analyze` reads: a numpy archive that opens with `numpy.load`
//! without pickle, every key of which is described in docs/interface.md and docs/formats/response.md. Whoever else writes
//! numpy archives uses [`ArchiveWriter`].

mod archive;
mod arrays;
mod bands;
mod borders;
mod check;
mod directions;
mod error;
mod header;
mod join;
pub mod provenance;
mod read;
mod response;
mod together;
mod write;

pub use archive::{ArchiveWriter, ArrayWriter, Number};
pub use borders::batch_time_edges;
pub use directions::{Directions, LATERAL_KEYS, Lateral};
pub use error::ResponseError;
pub use join::{JoinError, join, side_by_side};
pub use provenance::Provenance;
pub use response::{ArrivalKind, Arrivals, Batches, Missing, ReceiverDirectivity, Response};
pub use sonel_acoustics::SourceChange;

/// Version of the response file, in its array `format_version`.
pub const FORMAT_VERSION: u32 = 1;
