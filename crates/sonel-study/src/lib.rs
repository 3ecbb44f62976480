//! Studies that use several stages: effects, pilots, plans, fits, trade-offs.
//!
//! - [`effects`]: which effects are simulated;
//! - [`fit`]: coefficients of materials from measured parameters;
//! - [`forecast`]: predicted intervals and cost of a run;
//! - [`render_need`]: rays for a rendering, and sonels that the map lacks;
//! - [`evaluation_receivers`]: where the accuracy of a run is read;
//! - [`optimise`]: the cheapest change of materials that fulfils [`wish`]es;
//! - [`pilot`] and [`spread`]: uncertainty of parameters, now and in longer runs;
//! - [`plan`]: sonels and rays for an accuracy;
//! - [`room_decay`]: how long a run has to be;
//! - [`response`]: all sources of a map rendered, and the response made of it;
//! - [`tradeoff`]: error against CPU time, for several settings and numbers of sonels;
//! - [`sensitivity`]: how parameters change with the coefficients of materials;
//! - [`target`]: limits of half-widths;
//! - [`pipeline`]: a scene traced, rendered and read in one go, with what each phase costs;
//! - [`until`]: runs that stop when their targets are met.

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
pub mod room_decay;
pub mod sensitivity;
mod split;
pub mod spread;
pub mod target;
pub mod tradeoff;
pub mod until;
pub mod wish;
