//! Drawings for eyes: line plots with intervals and plans as SVG or PNG, energy on surfaces as OpenEXR and PNG.
//!
//! No drawing is an artifact that is compared bit by bit. Programs that compute do not link this crate.

pub mod picture;
mod pixels;
pub mod plot;
