//! Files read and written from outside: damaged, forged, old and joined ones.
#![allow(clippy::unwrap_used, reason = "the functions that tests share are no #[test] themselves")]

mod changes;
mod corpus;
mod directivity;
mod faults;
#[path = "../forged/mod.rs"]
mod forged;
mod golden;
#[path = "../hand_made/mod.rs"]
mod hand_made;
mod merge;
mod regions;
#[path = "../sharded/mod.rs"]
mod sharded;
