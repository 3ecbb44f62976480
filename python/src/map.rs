//! Maps: traced into a temporary file, or opened from one.

use std::fs::File;
use std::io::{self, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, anyhow};
use clap::Parser;
use pyo3::prelude::*;
use sonel_console::input;
use sonel_console::output::{Kind, Output};
use sonel_map::SonelMap;
use tempfile::TempDir;

use crate::error;
use crate::response::{Response, Room};
use crate::scene::Scene;
use crate::work::{Followers, work};

/// A sonel map in a file, which need not fit into memory.
#[pyclass(frozen, module = "sonel._sonel")]
pub struct Map {
    /// What it is called in messages.
    label: String,
    path: PathBuf,
    /// The file as it was when it was opened: another may be put in its place.
    file: Mutex<File>,
    digest: [u8; 32],
    /// Of `sonel-trace --json`, where it was traced now.
    report: Option<String>,
    /// Holds the file of a map that was traced now; removed with it.
    _folder: Option<TempDir>,
}

/// The arguments of a program from the words of its command line.
fn arguments<A: Parser>(program: &str, words: Vec<String>) -> anyhow::Result<A> {
    let words = std::iter::once(program.to_owned()).chain(words);
    // The usage of the program is nothing for Python.
    A::try_parse_from(words).map_err(|error| {
        let text = error.to_string();
        let message = text.split("\n\n").next().unwrap_or_default();
        anyhow!("{}", message.trim_start_matches("error: "))
    })
}

/// Traces `scene` with the options of `sonel-trace` in `words`.
#[pyfunction]
#[pyo3(signature = (scene, words, log, threads=None, progress=None))]
pub fn trace(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    words: Vec<String>,
    log: Bound<'_, PyAny>,
    threads: Option<usize>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Map> {
    let (loaded, inputs) = (scene.get().loaded.clone(), scene.get().inputs.clone());
    work(py, &Followers { progress, log }, threads, move |progress, log| {
        let folder = tempfile::Builder::new().prefix("sonel-").tempdir()?;
        let path = folder.path().join("traced.sonelmap");
        let options = [loaded.name.clone(), format!("--output={}", path.display()), "--json".to_owned()];
        let arguments = arguments("sonel-trace", words.into_iter().chain(options).collect())?;
        let mut report = Vec::new();
        sonel_trace::run_on(
            |_| {
                let geometry = loaded.geometry()?;
                Ok((loaded, geometry, inputs))
            },
            &arguments,
            progress,
            &mut report,
            log,
        )?;
        let report = Some(String::from_utf8(report)?);
        Map::open("the map".to_owned(), path, report, Some(folder))
    })
}

impl Map {
    fn open(
        label: String,
        path: PathBuf,
        report: Option<String>,
        folder: Option<TempDir>,
    ) -> anyhow::Result<Self> {
        let file = input::open(&path).with_context(|| format!("cannot read the map {label}"))?;
        let digest = SonelMap::open(&file).with_context(|| label.clone())?.digest();
        Ok(Self { label, path, file: Mutex::new(file), digest, report, _folder: folder })
    }

    fn map(&self) -> PyResult<SonelMap> {
        let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        SonelMap::open(&file).with_context(|| self.label.clone()).map_err(error)
    }

    fn copy_to(&self, path: &Path) -> anyhow::Result<()> {
        let output = Output::create(path, Kind::MAP, std::slice::from_ref(&self.path))?;
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(0))?;
        output.write(|out| io::copy(&mut *file, out))
    }
}

#[pymethods]
impl Map {
    /// The map in a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| Self::open(path.display().to_string(), path, None, None)).map_err(error)
    }

    /// Writes the map.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.copy_to(&path)).map_err(error)
    }

    /// Renders with the options of `sonel-render` in `words`.
    #[pyo3(signature = (words, log, threads=None, progress=None))]
    fn render(
        &self,
        py: Python<'_>,
        words: Vec<String>,
        log: Bound<'_, PyAny>,
        threads: Option<usize>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Response> {
        let (mut map, label) = (self.map()?, self.label.clone());
        work(py, &Followers { progress, log }, threads, move |progress, log| {
            let options = [label.clone(), "--output=response.npz".to_owned()];
            let arguments = arguments("sonel-render", words.into_iter().chain(options).collect())?;
            let (response, report) = sonel_render::respond(&mut map, &label, &arguments, progress, log)?;
            let (scene, settings) = (&map.header().scene, &map.header().settings);
            let volume = scene.geometry().with_context(|| label.clone())?.volume();
            let room = Room { volume, up: scene.up, seed: arguments.seed.unwrap_or(settings.seed) };
            Ok(Response::of(response, Some(report.to_string()), Some(room)))
        })
    }

    #[getter]
    fn path(&self) -> &PathBuf {
        &self.path
    }

    #[getter]
    fn report(&self) -> Option<&str> {
        self.report.as_deref()
    }

    #[getter]
    fn digest(&self) -> String {
        sonel_map::hexadecimal(&self.digest)
    }

    #[getter]
    fn scene_name(&self) -> PyResult<String> {
        Ok(self.map()?.header().scene.name.clone())
    }

    #[getter]
    fn sonels(&self) -> PyResult<u64> {
        Ok(self.map()?.header().settings.emissions)
    }

    #[getter]
    fn seed(&self) -> PyResult<u64> {
        Ok(self.map()?.header().settings.seed)
    }
}
