//! Scenes from files, and from texts that Python wrote.

use std::collections::HashMap;
use std::io;
use std::path::PathBuf;

use anyhow::Context;
use pyo3::prelude::*;
use sonel_console::progress::ProgressSink;
use sonel_console::{input, scene};

use crate::work::{Followers, work};

/// Where a scene comes from.
#[derive(Clone)]
enum Origin {
    File(PathBuf),
    /// The scene file and the files that it names.
    Text(String, HashMap<String, Vec<u8>>),
}

/// What a scene in a text is called in messages.
const LABEL: &str = "scene.toml";

impl Origin {
    fn load(&self, log: &mut dyn io::Write) -> anyhow::Result<(sonel_scene::Scene, Vec<PathBuf>)> {
        match self {
            Self::File(path) => {
                let (scene, _, files) = scene::load(path, ProgressSink::Nobody, log)?;
                Ok((scene, files))
            }
            Self::Text(text, files) => {
                let loaded = sonel_scene::load(text, LABEL, &mut |name| find(files, name))?;
                Ok((scene::tell(loaded, log)?.0, Vec::new()))
            }
        }
    }

    fn check(&self) -> anyhow::Result<String> {
        let checkup = match self {
            Self::File(path) => {
                scene::with_file(path, ProgressSink::Nobody, |text, label, open| {
                    sonel_scene::checkup::check(text, label, open)
                })?
                .0
            }
            Self::Text(text, files) => {
                sonel_scene::checkup::check(text, LABEL, &mut |name| find(files, name))?
            }
        };
        Ok(sonel_trace::checkup_json(&checkup).to_string())
    }
}

fn find(files: &HashMap<String, Vec<u8>>, name: &str) -> io::Result<Vec<u8>> {
    files.get(name).cloned().ok_or_else(|| io::ErrorKind::NotFound.into())
}

/// A scene that was read and is sound.
#[pyclass(frozen, module = "sonel._sonel")]
pub struct Scene {
    origin: Origin,
    pub(crate) loaded: sonel_scene::Scene,
    /// Files that it was read from.
    pub(crate) inputs: Vec<PathBuf>,
}

impl Scene {
    fn of(py: Python<'_>, origin: Origin, log: Bound<'_, PyAny>) -> PyResult<Self> {
        work(py, &Followers { progress: None, log }, None, move |_, log| {
            let (loaded, inputs) = origin.load(log)?;
            Ok(Self { origin, loaded, inputs })
        })
    }
}

#[pymethods]
impl Scene {
    /// The scene in a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, log: Bound<'_, PyAny>) -> PyResult<Self> {
        Self::of(py, Origin::File(path), log)
    }

    /// The scene in a text; `files` are those that it names.
    #[staticmethod]
    fn read(
        py: Python<'_>,
        text: String,
        files: HashMap<String, Vec<u8>>,
        log: Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        Self::of(py, Origin::Text(text, files), log)
    }

    /// The report of `sonel-trace check --json` on the scene of a file.
    #[staticmethod]
    fn check_file(py: Python<'_>, path: PathBuf) -> PyResult<String> {
        py.detach(|| Origin::File(path).check()).map_err(crate::error)
    }

    /// The report of `sonel-trace check --json`.
    fn check(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| self.origin.check()).map_err(crate::error)
    }

    /// Text and files of a scene that came from Python.
    fn text(&self) -> PyResult<(String, HashMap<String, Vec<u8>>)> {
        match &self.origin {
            Origin::Text(text, files) => Ok((text.clone(), files.clone())),
            Origin::File(path) => {
                let text = input::read_to_string(path)
                    .with_context(|| format!("cannot read the scene {}", path.display()));
                Ok((text.map_err(crate::error)?, HashMap::new()))
            }
        }
    }

    #[getter]
    fn name(&self) -> &str {
        &self.loaded.name
    }

    #[getter]
    fn duration(&self) -> f64 {
        self.loaded.duration
    }

    #[getter]
    fn speed_of_sound(&self) -> f64 {
        self.loaded.speed_of_sound
    }

    #[getter]
    fn center_frequencies(&self) -> Vec<f64> {
        self.loaded.bands.nominal().to_vec()
    }

    #[getter]
    fn materials(&self) -> Vec<&str> {
        self.loaded.materials.iter().map(|material| material.name.as_str()).collect()
    }

    #[getter]
    fn sources(&self) -> Vec<(&str, [f64; 3])> {
        self.loaded.sources.iter().map(|source| (source.name.as_str(), source.position.to_array())).collect()
    }

    #[getter]
    fn receivers(&self) -> Vec<(&str, [f64; 3])> {
        self.loaded
            .receivers
            .iter()
            .map(|receiver| (receiver.name.as_str(), receiver.position.to_array()))
            .collect()
    }
}
