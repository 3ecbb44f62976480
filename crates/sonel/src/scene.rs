//! Scenes: from a file, or made in code.

use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use sonel_acoustics::{BandWidth, Bands};
use sonel_geometry::Geometry;
use sonel_scene::checkup::{self, Checkup};
use sonel_scene::{Document, Loaded, PolygonMesh, SceneErrors, Value};

use crate::error::At;
use crate::file;
use crate::observer::{Observer, Severity, Watch};
use crate::{Coefficients, Error, MaterialKey, Result};

/// A room with materials, sources and receivers, read and checked. Positions are in metres, in the axes of the mesh.
pub struct Scene {
    compiled: sonel_scene::Scene,
    geometry: Arc<Geometry>,
    files: Vec<PathBuf>,
    origin: Origin,
}

/// Origin of a scene.
enum Origin {
    File { path: PathBuf, text: String },
    Made(Box<Document>),
}

impl Scene {
    /// Reads a scene file (docs/formats/scene.md) and the files that it names. Notes and warnings go to `observer`.
    ///
    /// # Errors
    /// When a file cannot be read; every mistake in it, with file and line.
    pub fn load(path: impl AsRef<Path>, observer: &dyn Observer) -> Result<Self> {
        let text = read_text(path.as_ref())?;
        Self::load_text(text, path, observer)
    }

    /// Reads `text` as that of the scene file at `path`, which need not exist, and the files that it names beside it.
    ///
    /// # Errors
    /// The errors of [`Self::load`].
    pub fn load_text(text: String, path: impl AsRef<Path>, observer: &dyn Observer) -> Result<Self> {
        let (path, watch) = (path.as_ref().to_owned(), Watch(observer));
        let (loaded, files) = with_files(&text, &path, watch, sonel_scene::load)?;
        Self::of(loaded, files, Origin::File { path, text }, watch)
    }

    /// Reads `text` as that of its scene file, with nothing but other sources: walls are not read again.
    ///
    /// # Errors
    /// The errors of [`Self::load`].
    pub fn with_sources_of(&self, text: String, observer: &dyn Observer) -> Result<Self> {
        let walls = (&self.compiled, &self.geometry);
        let reload = |text: &str, label: &str, open: Open<'_>| sonel_scene::reload(text, label, open, walls);
        let path = self.files.first().cloned().unwrap_or_default();
        let (loaded, _) = with_files(&text, &path, Watch(observer), reload)?;
        Self::of(loaded, self.files.clone(), Origin::File { path, text }, Watch(observer))
    }

    /// Compiles a scene made in code. Notes and warnings go to `observer`.
    ///
    /// # Errors
    /// Every mistake in it, by key.
    pub fn from_document(document: Document, observer: &dyn Observer) -> Result<Self> {
        Self::of(document.load()?, Vec::new(), Origin::Made(Box::new(document)), Watch(observer))
    }

    fn of(loaded: Loaded, files: Vec<PathBuf>, origin: Origin, watch: Watch<'_>) -> Result<Self> {
        let Loaded { scene: compiled, geometry, notes, defaults, warnings } = loaded;
        if let Some(defaults) = sonel_scene::folded(defaults.iter().map(|index| notes[*index].as_str())) {
            watch.say(Severity::Note, &defaults)?;
        }
        for (index, note) in notes.iter().enumerate() {
            watch.say(if defaults.contains(&index) { Severity::Detail } else { Severity::Note }, note)?;
        }
        warnings.iter().try_for_each(|warning| watch.say(Severity::Warning, warning))?;
        Ok(Self { compiled, geometry, files, origin })
    }

    /// Begins a rectangular room with one corner at the origin: inner lengths `size` [m], above 0. Its walls have the material of their name
    /// (`x0` is that at x = 0, `x1` that opposite, likewise y and z), all others the material `walls`.
    #[must_use]
    pub fn shoebox(size: [f64; 3]) -> SceneBuilder {
        SceneBuilder::new(vec![("shoebox".to_owned(), size.to_vec().into())], None)
    }

    /// Begins a room of polygons, each with the name of its material.
    #[must_use]
    pub fn of_polygons(mesh: PolygonMesh) -> SceneBuilder {
        SceneBuilder::new(Vec::new(), Some(mesh))
    }

    /// Sizes, statistical times, warnings, and faults of the mesh with their places.
    ///
    /// # Errors
    /// When the file of the scene cannot be read any more.
    pub fn check(&self) -> Result<Checkup> {
        match &self.origin {
            Origin::File { path, text } => check_text(text, path, &crate::Silent).map(|(checkup, _)| checkup),
            Origin::Made(document) => Ok(document.check()),
        }
    }

    /// The text of its scene file. A scene made in code has this identity.
    #[must_use]
    pub fn to_toml(&self) -> String {
        match &self.origin {
            Origin::File { text, .. } => text.clone(),
            Origin::Made(document) => document.to_toml(),
        }
    }

    /// Writes a scene made in code as `scene.toml`, and its mesh beside it, to `folder`, which is made where there is none. Files that are there
    /// are not replaced. Returns the path of the scene file.
    ///
    /// # Errors
    /// When a file exists or cannot be written.
    pub fn save(&self, folder: impl AsRef<Path>) -> Result<PathBuf> {
        let folder = folder.as_ref();
        std::fs::create_dir_all(folder).at(|| format!("cannot make the folder {}", folder.display()))?;
        let path = folder.join("scene.toml");
        let text = self.to_toml();
        create(&path, |out| out.write_all(text.as_bytes()))?;
        if let Origin::Made(document) = &self.origin
            && let Some(mesh) = document.mesh()
        {
            create(&folder.join(Document::MESH_NAME), |out| mesh.write_obj(out))?;
        }
        Ok(path)
    }

    /// The compiled scene: everything in SI, every list as long as there are bands.
    #[must_use]
    pub fn compiled(&self) -> &sonel_scene::Scene {
        &self.compiled
    }

    /// Walls.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    pub(crate) fn shared_geometry(&self) -> Arc<Geometry> {
        Arc::clone(&self.geometry)
    }

    /// The compiled scene, its walls, and the files that it was read from.
    #[must_use]
    pub fn into_parts(self) -> (sonel_scene::Scene, Arc<Geometry>, Vec<PathBuf>) {
        (self.compiled, self.geometry, self.files)
    }

    /// The files that it was read from.
    #[must_use]
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }
}

/// Name and counts: the compiled scene holds the mesh.
impl fmt::Debug for Scene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sources, receivers) = (self.compiled.sources.len(), self.compiled.receivers.len());
        write!(f, "Scene {:?}: {sources} sources, {receivers} receivers", self.compiled.name)
    }
}

type Open<'a> = &'a mut dyn FnMut(&str) -> std::io::Result<Vec<u8>>;

/// Checks the scene file at `path`, which need not be valid; with the files that were read.
///
/// # Errors
/// When it cannot be read or is no TOML.
pub fn check_file(path: impl AsRef<Path>, observer: &dyn Observer) -> Result<(Checkup, Vec<PathBuf>)> {
    check_text(&read_text(path.as_ref())?, path.as_ref(), observer)
}

fn check_text(text: &str, path: &Path, observer: &dyn Observer) -> Result<(Checkup, Vec<PathBuf>)> {
    with_files(text, path, Watch(observer), checkup::check)
}

fn read_text(path: &Path) -> Result<String> {
    file::read_to_string(path).at(|| format!("cannot read the scene {}", path.display()))
}

/// Runs `read` with the text of the scene file at `path`, its name in messages, and what opens files beside it; with the files that were
/// read.
fn with_files<T>(
    text: &str,
    path: &Path,
    watch: Watch<'_>,
    read: impl FnOnce(&str, &str, Open<'_>) -> Result<T, SceneErrors>,
) -> Result<(T, Vec<PathBuf>)> {
    const STEP: &str = "reading";
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let mut files = vec![path.to_owned()];
    let mut open = |beside: &str| {
        files.push(folder.join(beside));
        file::read_in(&folder, beside)
    };
    // A mesh of a million triangles takes its time.
    watch.progress(STEP, 0.0)?;
    let result = read(text, &path.display().to_string(), &mut open);
    watch.progress(STEP, 1.0)?;
    Ok((result?, files))
}

/// Writes `content` to a new file.
fn create(path: &Path, content: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    let mut file = std::fs::File::create_new(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => {
            Error::refused(format!("{} exists: delete it first, or choose another folder", path.display()))
        }
        _ => Error::File(error),
    })?;
    let mut out = std::io::BufWriter::new(&mut file);
    content(&mut out).and_then(|()| out.flush()).at(|| format!("cannot write {}", path.display()))
}

/// A material of a scene made in code.
#[derive(Debug, Clone)]
pub struct Material(Vec<(String, Value)>);

impl Material {
    /// A material of this absorption coefficient α, 0 … 1. It scatters 0.1 unless stated otherwise.
    pub fn new(absorption: impl Into<Coefficients>) -> Self {
        Self(Vec::new()).with(MaterialKey::Absorption, absorption)
    }

    /// An entry of the shipped library (docs/materials.md).
    #[must_use]
    pub fn library(entry: &str) -> Self {
        Self(vec![("library".to_owned(), entry.into())])
    }

    /// States a coefficient.
    #[must_use]
    pub fn with(mut self, key: MaterialKey, values: impl Into<Coefficients>) -> Self {
        self.0.push((key.name().to_owned(), values.into().into()));
        self
    }
}

/// A scene in the making: a room, to which materials, sources and receivers are added.
#[derive(Debug, Clone)]
pub struct SceneBuilder {
    keys: Vec<(String, Value)>,
    mesh: Option<PolygonMesh>,
    materials: Vec<(String, Value)>,
    sources: Vec<Value>,
    receivers: Vec<Value>,
}

impl SceneBuilder {
    fn new(keys: Vec<(String, Value)>, mesh: Option<PolygonMesh>) -> Self {
        Self { keys, mesh, materials: Vec::new(), sources: Vec::new(), receivers: Vec::new() }
    }

    /// Names the scene.
    #[must_use]
    pub fn name(self, name: &str) -> Self {
        self.key("name", name.into())
    }

    /// Gives the walls of a name a material.
    #[must_use]
    pub fn material(mut self, name: &str, material: Material) -> Self {
        self.materials.push((name.to_owned(), Value::table(material.0)));
        self
    }

    /// Adds an omnidirectional source of 90 dB in every band at `position` [m].
    #[must_use]
    pub fn source(mut self, name: &str, position: [f64; 3]) -> Self {
        self.sources.push(point(name, position));
        self
    }

    /// Adds an omnidirectional receiver at `position` [m].
    #[must_use]
    pub fn receiver(mut self, name: &str, position: [f64; 3]) -> Self {
        self.receivers.push(point(name, position));
        self
    }

    /// Computes in `bands` instead of octaves of 63 … 8000 Hz.
    #[must_use]
    pub fn bands(self, bands: &Bands) -> Self {
        let centers = bands.nominal().to_vec();
        let width = match bands.width() {
            BandWidth::Octave => "octave",
            BandWidth::Third => "third",
        };
        let table = [("center_frequencies_hz", Value::from(centers)), ("width", width.into())];
        self.key("bands", Value::table(table))
    }

    /// States the length of the echograms [s], above 0 and at most 3600; by default as long as the room decays.
    #[must_use]
    pub fn duration(self, seconds: f64) -> Self {
        self.key("duration_s", seconds.into())
    }

    /// States any other key of the scene file (docs/formats/scene.md), such as `air` or `closed`.
    #[must_use]
    pub fn key(mut self, name: &str, value: Value) -> Self {
        self.keys.push((name.to_owned(), value));
        self
    }

    /// Compiles the scene. Notes and warnings go to `observer`.
    ///
    /// # Errors
    /// Every mistake in it, by key.
    pub fn build(self, observer: &dyn Observer) -> Result<Scene> {
        let Self { mut keys, mesh, materials, sources, receivers } = self;
        keys.push(("materials".to_owned(), Value::table(materials)));
        let lists = [("sources", sources), ("receivers", receivers)];
        let lists = lists.into_iter().filter(|(_, points)| !points.is_empty());
        keys.extend(lists.map(|(key, points)| (key.to_owned(), points.into())));
        Scene::from_document(Document::new(keys, mesh), observer)
    }
}

fn point(name: &str, position: [f64; 3]) -> Value {
    Value::table([("name", Value::from(name)), ("position", position.to_vec().into())])
}
