//! Drivers above the stages.
//!
//! - [`effects`]: which effects a scene calls for;
//! - [`response`]: all sources of a map rendered, and the response made of it;
//! - [`tradeoff`]: what accuracy costs, with several settings and numbers of sonels;
//! - [`trial`]: a scene traced, rendered and read in one go, with what each phase costs.

pub mod effects;
pub mod response;
pub mod tradeoff;
pub mod trial;
