//! Studies that use several stages: effects, pilots, plans.
//!
//! - [`effects`]: which effects are simulated;
//! - [`forecast`]: how many packets and rays, how wide the intervals, at what cost;
//! - [`evaluation_receivers`]: where the accuracy of a run is read;
//! - [`pilot`] and [`spread`]: uncertainty of parameters in the first packets of a run;
//! - [`plan`]: forecasts for several accuracies;
//! - [`room_decay`]: how long a run has to be;
//! - [`response`]: all sources of a map rendered, and the response made of it;
//! - [`sensitivity`]: how parameters change with the coefficients of materials;
//! - [`target`]: limits of half-widths;
//! - [`pipeline`]: a scene traced, rendered and read in one go, with what each phase costs;
//! - [`until`]: runs that stop when their targets are met.

pub mod criteria;
pub mod effects;
pub mod evaluation_receivers;
pub mod forecast;
pub(crate) mod job;
mod kurtosis;
pub(crate) mod memory;
pub mod pilot;
pub mod pipeline;
pub mod plan;
pub mod response;
pub mod room_decay;
pub mod sensitivity;
mod split;
pub mod spread;
pub mod target;
pub mod until;
