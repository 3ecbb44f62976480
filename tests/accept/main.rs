//! Long runs behind `cargo xtask accept`: what must hold before a release and takes too long for every change.

#![allow(clippy::print_stdout, reason = "people read what long runs measured")]

mod agreement;
mod comparison;
mod coverage;
mod effects;
mod flipped_bits;
mod furniture;
mod general_position;
mod invariances;
mod known_rooms;
mod losses;
mod memory;
mod partitions;
mod planning;
#[path = "../pipeline/readers.rs"]
mod readers;
#[path = "../physics/solid_buildings.rs"]
mod solid_buildings;
#[path = "../physics/sound.rs"]
mod sound;
#[path = "../stability/cases/mod.rs"]
mod stability;
mod stopping;
mod thick_partitions;
mod two_airs;
mod uncertainty;
mod uneven_box;
mod walk;
#[path = "../physics/watertight.rs"]
mod watertight;
mod what_if;
mod widths;
mod windows;

/// Which form of the hard cases this binary runs.
const FORM: stability::Form = stability::Form::Long;
/// Impulse responses of one echogram.
const REALISATIONS: u64 = 400;
/// Damaged copies of every seed of a reader.
const COPIES: u64 = 5_000;
/// Rays in each shipped room.
const WATERTIGHT_RAYS: u32 = 1_000_000;
