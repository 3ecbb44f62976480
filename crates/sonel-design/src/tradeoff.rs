//! Error against CPU time: a scene simulated repeatedly with several settings.
//!
//! A [`Sweep`] says which settings are compared, with how many packets, and how often each is repeated with another seed.
//! [`conduct`] runs it. Errors are differences to the exact answer where nothing is sampled (image sources in a room
//! without scattering), else to a longer run of the best method. Times are CPU seconds of
//! the process for tracing and rendering, as [`sonel::study::pipeline`] measures them; reading the parameters costs the same with every
//! setting and is left out.
//!
//! - [`sweep`]: what is varied; [`runs`]: running it;
//! - [`errors`]: bias and standard deviation of the parameters; [`fit`]: lines through them;
//! - [`verdict`]: what follows; [`report`]: JSON, plots and a page.

pub mod errors;
pub mod fit;
pub mod report;
pub mod runs;
pub mod sweep;
pub mod verdict;

pub use errors::Curve;
pub use runs::{Reference, RunSeconds, SweepRun, Tradeoff, conduct};
pub use sweep::{Levels, Setting, Sweep};
pub use verdict::Verdict;
