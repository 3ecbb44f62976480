//! Studies of materials and of cost, above those that plan and run the stages (`sonel-study`).
//!
//! - [`fit`]: coefficients of materials from measured parameters;
//! - [`optimise`]: the cheapest change of materials that fulfils [`goal`]s;
//! - [`sensitivity`]: how parameters change with the coefficients of materials;
//! - [`tradeoff`]: error against CPU time, for several settings and numbers of packets.

pub mod fit;
pub mod goal;
mod local;
pub mod optimise;
pub mod sensitivity;
pub mod tradeoff;
