//! Vocabulary of room acoustics: bands, levels, air, materials, directivity, statistical formulas.
//!
//! The crate depends on no other crate of the workspace and reads no file. Units are coherent SI unless a name says otherwise; every transcendental
//! function is `libm`'s, so that the same inputs give the same bits on every platform.
//!
//! References: docs/physics.md §1, docs/references.md.

pub mod absorption_law;
mod air;
mod balloon;
mod bands;
mod directivity;
pub mod just_noticeable;
mod lanes;
mod levels;
mod material;
pub mod modes;
pub mod noise;
pub mod sample;
mod source_change;
mod statistics;
mod talker;

pub use absorption_law::AbsorptionLaw;
pub use air::{Air, AirError};
pub use balloon::{Balloon, BalloonError, Radiation};
pub use bands::{BandError, BandWidth, Bands};
pub use directivity::{Directivity, Pattern, UnknownDirectivity};
pub use lanes::{BandValues, Lanes, lanes_of, to_lanes};
pub use levels::{REFERENCE_IMPEDANCE, energy_from_level_db, energy_to_level_db, level_db, strength_db};
pub use material::{Coefficient, Material, MaterialProblem};
pub use source_change::SourceChange;
pub use statistics::{
    equivalent_absorption_area, eyring_time, mean_absorption, mean_free_path, sabine_time,
    schroeder_frequency,
};
pub use talker::{TALKER, talker};
