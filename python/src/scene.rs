//! Scenes from files, and from values of Python.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use sonel::checkup::{report, room};
use sonel::scenes::library::{LibraryEntry, Octaves, shipped};
use sonel::{Document, Observer, PolygonMesh};

use crate::convert::{object, refused, value};
use crate::error;
use crate::work::{silent_work, work};

/// A scene that was read and is valid.
#[pyclass(frozen, module = "sonel._sonel")]
pub struct Scene {
    pub(crate) scene: Arc<sonel::Scene>,
}

/// Polygons as arrays in bytes: vertices (f64), corners, corners per face, material per face (u32), and names of materials.
type Polygons<'a> = (&'a [u8], &'a [u8], &'a [u8], &'a [u8], Vec<String>);

/// The little-endian numbers in `bytes`.
fn numbers<T, const N: usize>(bytes: &[u8], of: fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks().0.iter().map(|bytes| of(*bytes)).collect()
}

/// Name, group, description and source of a material; absorption and scattering as the lowest octave [Hz] and the values.
type Entry = ([&'static str; 4], [Option<(f64, &'static [f64])>; 2]);

/// Entries of the material library.
#[pyfunction]
pub(crate) fn library() -> Vec<Entry> {
    let octaves = |found: &'static Option<Octaves>| found.as_ref().map(|o| (o.first_hz, &o.values[..]));
    let entry = |entry: &'static LibraryEntry| {
        let LibraryEntry { name, group, text, source, absorption, scattering } = entry;
        ([name.as_str(), group, text, source], [octaves(absorption), octaves(scattering)])
    };
    shipped().iter().map(entry).collect()
}

fn mesh((vertices, corners, sizes, used, names): Polygons<'_>) -> PyResult<PolygonMesh> {
    let vertices = numbers(vertices, f64::from_le_bytes).as_chunks().0.to_vec();
    let [corners, sizes, used] = [corners, sizes, used].map(|bytes| numbers(bytes, u32::from_le_bytes));
    let (mut mesh, mut rest) = (PolygonMesh::new(vertices), &corners[..]);
    for (size, name) in sizes.into_iter().zip(used) {
        let face = rest.split_at_checked(size as usize).zip(names.get(name as usize));
        let ((face, after), name) = face.ok_or_else(|| refused("faces have corners and materials"))?;
        mesh.face(face, name);
        rest = after;
    }
    Ok(mesh)
}

#[pymethods]
impl Scene {
    /// The scene in a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, log: Bound<'_, PyAny>) -> PyResult<Self> {
        work(py, Some(log), None, None, move |observer: &dyn Observer| {
            Ok(Self { scene: Arc::new(sonel::Scene::load(&path, observer)?) })
        })
    }

    /// The scene of the `keys` of a scene file, with walls of `polygons` or of the key `shoebox`.
    #[staticmethod]
    #[pyo3(signature = (keys, polygons, log))]
    fn made(
        py: Python<'_>,
        keys: &Bound<'_, PyDict>,
        polygons: Option<Polygons<'_>>,
        log: Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let entries = keys.iter().map(|(key, given)| Ok((key.str()?.to_string(), value(&given)?)));
        let document = Document::new(entries.collect::<PyResult<Vec<_>>>()?, polygons.map(mesh).transpose()?);
        work(py, Some(log), None, None, move |observer: &dyn Observer| {
            Ok(Self { scene: Arc::new(sonel::Scene::from_document(document, observer)?) })
        })
    }

    /// The report of `sonel-trace check --json` on the scene of a file.
    #[staticmethod]
    fn check_file(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyAny>> {
        let check = move |observer: &dyn Observer| Ok(report(&sonel::check_file(&path, observer)?.0));
        object(py, &silent_work(py, check)?)
    }

    /// The report of `sonel-trace check --json`.
    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let scene = Arc::clone(&self.scene);
        object(py, &silent_work(py, move |_| Ok(report(&scene.check()?)))?)
    }

    /// Sizes, areas and statistical times of that report, in a tenth of its time.
    fn room<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let scene = Arc::clone(&self.scene);
        object(py, &silent_work(py, move |_| Ok(room(&scene.check()?)))?)
    }

    /// The text of the scene file.
    fn toml(&self) -> String {
        self.scene.to_toml()
    }

    /// Writes the scene file, and the mesh of a scene that came from Python; returns the path of the file.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<PathBuf> {
        py.detach(|| self.scene.save(folder)).map_err(error)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.scene.compiled().name
    }

    #[getter]
    fn duration(&self) -> f64 {
        self.scene.compiled().duration
    }

    #[getter]
    fn speed_of_sound(&self) -> f64 {
        self.scene.compiled().speed_of_sound
    }

    #[getter]
    fn center_frequencies(&self) -> Vec<f64> {
        self.scene.compiled().bands.nominal().to_vec()
    }

    #[getter]
    fn materials(&self) -> Vec<&str> {
        self.scene.compiled().materials.iter().map(|material| material.name.as_str()).collect()
    }

    #[getter]
    fn sources(&self) -> Vec<(&str, [f64; 3])> {
        let sources = self.scene.compiled().sources.iter();
        sources.map(|source| (source.name.as_str(), source.position.to_array())).collect()
    }

    #[getter]
    fn receivers(&self) -> Vec<(&str, [f64; 3])> {
        let receivers = self.scene.compiled().receivers.iter();
        receivers.map(|receiver| (receiver.name.as_str(), receiver.position.to_array())).collect()
    }
}
