//! Tracing: emission, interaction, propagation, fates and the energy ledger.
//!
//! - [`interaction`]: event and outgoing direction at a surface, from uniform numbers;
//! - [`packet`]: one packet from emission to its fate;
//! - `zone`: the founding paper's diffraction of packets;
//! - [`run`]: all packets of a run in chunks, on all cores, the same bytes for any number of threads.
//!
//! Formulas: docs/physics.md §2, §3 and §6.

/// Revision of the paths: raised by every change after which the same command may write other paths or another ledger. `tests/pipeline`
/// keeps digests of some runs. Maps of two revisions are never joined.
pub const REVISION: u32 = 7;

pub mod interaction;
pub mod packet;
pub mod run;
mod splitting;
mod zone;

pub use run::{CHUNKS_IN_FLIGHT, PILOTS, TraceError, TracedChunk, Tracer};
