//! The sonel map: paths on disk, sonels by sweeping them.
//!
//! A map stores *paths, not energies* (docs/physics.md §2): for every emission the points where the packet met a
//! surface and what it did there. Energies in any band follow from the points and the coefficient table in one running
//! product, so one map serves any air, source level, directivity and, within limits, other materials.
//!
//! - [`leads`]: the probabilities by which events are drawn: of each band, also as variants of materials have them;
//! - [`emission`]: which lead emission i has and which batch it belongs to, as functions of i alone;
//! - [`emissions`]: all of a run, ready to be traced or followed;
//! - [`vertex`]: the 16-byte record of one arrival;
//! - [`classes`]: bands with equal coefficients;
//! - [`coefficients`] and [`weight`]: the balance heuristic over leads, shared by tracer and readers;
//! - [`mod@sweep`]: a path as a sequence of segments with energy, length and history;
//! - [`ledger`]: where the energy went, per band, and the fates of the packets;
//! - [`header`]: provenance: settings, scene, effects, shard; [`writer`] and [`reader`]: the file itself;
//! - [`provenance`]: in what two maps differ; [`merge`]: shards joined to the map of their run.
//!
//! The layout of the file, byte by byte, stands in docs/formats/sonelmap.md.

#[cfg(target_endian = "big")]
compile_error!(
    "sonel maps are mapped into memory as little-endian arrays; a big-endian reader needs its own codec"
);

pub mod classes;
mod codec;
pub mod coefficients;
mod directivity;
pub mod emission;
pub mod emissions;
pub mod error;
mod format;
pub mod header;
mod incidence;
pub mod leads;
pub mod ledger;
mod media;
pub mod merge;
mod places;
pub mod provenance;
pub mod reader;
mod record;
mod sections;
mod shards;
pub mod spectral;
mod storage;
mod surfaces;
pub mod sweep;
mod tiling;
mod variants;
pub mod vertex;
pub mod weight;
pub mod writer;

pub use classes::BandClasses;
pub use coefficients::CoefficientTable;
pub use emission::{BatchStart, CHUNK_EMISSIONS, EmissionDirections, EmissionLayout, PacketStart};
pub use emissions::Emissions;
pub use error::MapError;
pub use header::{EffectState, MapHeader, Mode, Settings, ShardRange};
pub use leads::Leads;
pub use ledger::{BandLedger, ChunkLedger, Fate, Fates, Ledger};
pub use merge::{MergeError, Merger};
pub use provenance::hexadecimal;
pub use reader::{BeforeWidening, PathView, SonelMap};
pub use sonel_acoustics::{BandValues, Lanes, lanes_of, to_lanes};
pub use spectral::Spectral;
pub use sweep::{Along, Arrival, Segment, SegmentHistory, sweep};
pub use vertex::{Event, Vertex};
pub use weight::PathWeight;
pub use writer::{ChunkPaths, MapWriter};
