//! Deterministic path classes: direct sound, image sources, edges. They have no noise and are the same for every batch.

pub mod direct;
pub mod edge;
pub mod mirror;
