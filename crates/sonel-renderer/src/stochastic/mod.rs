//! Classes that packets estimate: each batch of emissions is an estimate of its own.

mod alias;
pub(crate) mod connection;
pub(crate) mod crossing;
pub(crate) mod estimate;
pub(crate) mod gather;
pub(crate) mod kernel;
pub(crate) mod medium;
pub(crate) mod mirror_connection;
pub(crate) mod selection;
