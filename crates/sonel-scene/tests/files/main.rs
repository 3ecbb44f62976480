//! Scene files: those that are read, those that are refused, and those of the documentation.
#![allow(clippy::unwrap_used, reason = "the functions that tests share are no #[test] themselves")]

mod checkup;
mod corpus;
mod documentation;
mod formats;
mod robustness;
mod sofa;
mod values;
