//! Random streams and warps: the source of every random number of the simulator.
//!
//! Three ideas, one module each:
//! - [`stream`]: independent, portable generators, one for every emission and every visibility ray;
//! - [`stratified`]: scrambled low-discrepancy points for emission directions, extensible without end;
//! - [`warp`]: uniform numbers to directions, each as sample, density and inverse.
//!
//! The physics elsewhere takes uniform numbers, never a generator, so it can be tested point by point.

pub mod frame;
pub mod stratified;
pub mod stream;
pub mod warp;

pub use frame::Frame;
pub use stratified::ScrambledSobol;
pub use stream::{Purpose, Stream, StreamFamily};
