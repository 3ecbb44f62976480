//! A study of cost, above those that plan and run the stages (`sonel::study`).
//!
//! - [`tradeoff`]: error against CPU time, for several settings and numbers of packets.

pub mod tradeoff;
