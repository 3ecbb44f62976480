//! Classes that packets estimate: each batch of emissions is an estimate of its own.

mod alias;
pub mod connection;
pub mod crossing;
pub mod gather;
pub mod kernel;
pub mod medium;
pub mod mirror_connection;
pub mod selection;
