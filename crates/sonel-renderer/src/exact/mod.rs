//! Classes that are computed: direct sound, image sources, edges. The same for every batch, without noise.

pub mod direct;
pub mod edge;
pub mod mirror;
