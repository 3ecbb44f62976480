//! Drivers above the stages.
//!
//! - [`effects`]: which effects a scene calls for;
//! - [`fit`]: coefficients of materials from measured parameters;
//! - [`forecast`]: what a run will find and cost;
//! - [`render_need`]: rays for hearing a map, and the sonels that it lacks;
//! - [`evaluation_receivers`]: where the accuracy of a run is read;
//! - [`optimise`]: the cheapest change of materials that fulfils [`wish`]es;
//! - [`pilot`] and [`spread`]: how uncertain parameters are, and what a longer run would make of it;
//! - [`plan`]: sonels and rays for an accuracy;
//! - [`response`]: all sources of a map rendered, and the response made of it;
//! - [`tradeoff`]: what accuracy costs, with several settings and numbers of sonels;
//! - [`sensitivity`]: how parameters change with the coefficients of materials;
//! - [`target`]: how certain parameters shall be;
//! - [`pipeline`]: a scene traced, rendered and read in one go, with what each phase costs;
//! - [`until`]: runs that go on until their parameters are certain enough.

pub mod effects;
pub mod evaluation_receivers;
pub mod fit;
pub mod forecast;
mod kurtosis;
mod local;
pub mod optimise;
pub mod pilot;
pub mod pipeline;
pub mod plan;
pub mod render_need;
pub mod response;
pub mod sensitivity;
mod split;
pub mod spread;
pub mod target;
pub mod tradeoff;
pub mod until;
pub mod wish;
