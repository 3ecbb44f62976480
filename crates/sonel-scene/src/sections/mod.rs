//! The sections of a scene file, one module each: keys to values of the scene, problems to the report.

pub(crate) mod air;
pub(crate) mod designs;
pub(crate) mod materials;
pub(crate) mod points;
pub(crate) mod regions;
pub(crate) mod walls;
