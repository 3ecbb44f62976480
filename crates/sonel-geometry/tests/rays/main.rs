//! Rays: none slips between walls, none is lost on a long walk, the index finds what an exhaustive search finds.
#![allow(clippy::unwrap_used)] // clippy takes what tests call for no tests

mod leaky;
mod numbers;
mod oracle;
mod rooms;
mod walks;
mod watertight;
