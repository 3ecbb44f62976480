//! Long runs behind `cargo xtask accept`: what must hold before a release and takes too long for every change.

mod agreement;
mod comparison;
mod coverage;
mod invariances;
mod known_rooms;
mod losses;
mod memory;
mod uneven_box;
