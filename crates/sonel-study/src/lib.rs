//! Drivers above the stages: which effects a scene calls for.

pub mod effects;
