//! Pass one: emission, interaction, propagation, fates and the energy ledger.
//!
//! - [`interaction`]: what a surface does with an arriving packet, from uniform numbers;
//! - [`bending`]: the way of a packet past edges;
//! - [`packet`]: one sonel's life, from the source to its fate;
//! - `zone`: the founding paper's diffraction of packets;
//! - [`run`]: all packets of a run in chunks, on all cores, the same bytes for any number of threads.
//!
//! What is computed stands in docs/physics.md §2, §3 and §6.

pub mod bending;
pub mod interaction;
pub mod packet;
pub mod run;
mod zone;

pub use run::{ForeignPath, TraceError, TracedChunk, Tracer};
