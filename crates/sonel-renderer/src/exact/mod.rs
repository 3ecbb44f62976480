//! Deterministic path classes: direct sound, image sources, reflections along arcs, edges. They have no noise and are the same for every batch.

pub(crate) mod direct;
pub(crate) mod edge;
pub(crate) mod level;
pub(crate) mod mirror;
