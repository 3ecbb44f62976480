//! Parameters of measured impulse responses against pyrato, in its own environment under target/.

use std::process::Command;

use anyhow::Result;

use crate::python;
use xtask::workspace::{self, Profile};

const REQUIREMENTS: &str = "python/measured/requirements.txt";
const ENVIRONMENT: &str = "target/pyrato";
const COMPARISON: &str = "python/measured/compare.py";

/// Compares; within 0.1 just-noticeable differences.
pub(crate) fn accept() -> Result<()> {
    let python = python::environment(ENVIRONMENT, REQUIREMENTS)?.join("python");
    let program = workspace::programs(Profile::Dev)?.join("sonel-analyze");
    python::shown(Command::new(python).arg(COMPARISON).arg(program))
}
