//! What a geometry knows of its shape: welding, orientation, surfaces and planes, the room it encloses.
#![allow(clippy::unwrap_used)] // clippy takes what tests call for no tests

mod cracks;
mod edges;
mod orientation;
mod planes;
mod welding;

#[path = "../rays/numbers.rs"]
mod numbers;
mod room;
#[path = "../rays/rooms.rs"]
mod rooms;
mod shells;
mod solids;
