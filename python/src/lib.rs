//! The compiled half of the Python package `sonel`: scenes, maps and responses by the crate `sonel`.
//!
//! `python/package/sonel/__init__.py` is the half that users see: signatures, units, numpy.

mod convert;
mod map;
mod response;
mod scene;
mod work;

use std::path::PathBuf;

use pyo3::prelude::*;

pyo3::create_exception!(
    sonel,
    Error,
    pyo3::exceptions::PyValueError,
    "Bad input, a damaged file or an impossible request: the message of the programs."
);

/// An error with its causes, as the programs print it.
fn error(error: impl Into<anyhow::Error>) -> PyErr {
    Error::new_err(sonel::names::message(&format!("{:#}", error.into())))
}

/// The bytes of a regular file, of at most 2 GiB.
#[pyfunction]
fn read(path: PathBuf) -> PyResult<Vec<u8>> {
    Ok(sonel::file::read(&path)?)
}

#[pymodule]
mod _sonel {
    #[pymodule_export]
    use super::Error;
    #[pymodule_export]
    use super::map::{Map, parameters, trace};
    #[pymodule_export]
    use super::read;
    #[pymodule_export]
    use super::response::{Array, Response, places};
    #[pymodule_export]
    use super::scene::{Scene, library};

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
