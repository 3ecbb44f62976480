//! The Python package `sonel` against the programs: same bytes, same messages.
//!
//! Here the package is put together from what the workspace has compiled anyway. `cargo xtask accept` builds the wheel that users
//! get, installs it, repeats these tests with it, checks its types and runs the notebooks.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use crate::python::{self, shown};
use crate::python_reader;
use xtask::workspace::{self, Profile};

const TESTS: &str = "python/tests";
const PACKAGE: &str = "target/python/package";
const WHEEL_ENVIRONMENT: &str = "target/wheel";
const WHEEL_REQUIREMENTS: &str = "python/requirements-accept.txt";
/// Debian's interpreter: its package python3-torch is much smaller than the wheel of torch.
const SYSTEM_PYTHON: &str = "/usr/bin/python3";
const NOTEBOOKS: [&str; 3] =
    ["python/first-hour.ipynb", "python/from-pyroomacoustics.ipynb", "python/arrays.ipynb"];

/// Tests the package as the workspace compiles it.
pub(crate) fn check() -> Result<()> {
    let python = python_reader::environment()?.join("python");
    workspace::libraries()?;
    let programs = workspace::programs(Profile::Dev)?;
    let root = workspace::root();
    let package = root.join(PACKAGE).join("sonel");
    fs::create_dir_all(&package)?;
    for entry in fs::read_dir(root.join("python/package/sonel"))? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            fs::copy(entry.path(), package.join(entry.file_name()))?;
        }
    }
    let compiled = programs.join(format!("{DLL_PREFIX}_sonel{DLL_SUFFIX}"));
    let module = package.join(if cfg!(windows) { "_sonel.pyd" } else { "_sonel.abi3.so" });
    fs::copy(&compiled, module).with_context(|| format!("cannot copy {}", compiled.display()))?;
    shown(tests(&python, &programs).env("PYTHONPATH", root.join(PACKAGE)))
}

/// Builds the wheel, installs it, tests it, and runs the notebooks. Where something of it cannot run: what it needs.
pub(crate) fn accept() -> Result<Option<&'static str>> {
    let folder = python::environment(WHEEL_ENVIRONMENT, WHEEL_REQUIREMENTS)?;
    let python = folder.join("python");
    let programs = workspace::programs(Profile::Release)?;
    let run = |words: &[&str]| shown(Command::new(&python).args(words));
    install_wheel(&python)?;
    let torch = Command::new(SYSTEM_PYTHON).args(["-c", "import torch"]).output();
    let has_torch = torch.is_ok_and(|output| output.status.success());
    let mut tests = tests(&python, &programs);
    tests.env("SONEL_LONG", "1");
    if has_torch {
        tests.env("SONEL_TORCH_PYTHON", SYSTEM_PYTHON);
    }
    shown(&mut tests)?;
    run(&["-m", "mypy", "--strict", "--package", "sonel"])?;
    NOTEBOOKS.iter().try_for_each(|notebook| run(&["-m", "jupyter", "execute", notebook]))?;
    Ok((!has_torch).then_some("the torch example of docs/python.md needs Debian's python3-torch"))
}

/// Builds the wheel and installs it for the interpreter `python`.
pub(crate) fn install_wheel(python: &Path) -> Result<()> {
    let install = ["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps", "./python"];
    shown(Command::new(python).args(install))
}

fn tests(python: &Path, programs: &Path) -> Command {
    let mut command = Command::new(python);
    command.args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider", TESTS]);
    command.env("SONEL_PROGRAMS", programs);
    command
}
