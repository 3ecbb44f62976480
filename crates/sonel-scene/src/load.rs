//! Reads the text of a scene file into a [`Scene`].

use std::io;
use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use sonel_acoustics::{Bands, Directivity, Material};
use sonel_geometry::{CellPlace, FaceKind, Geometry, Redrawn};
use toml::de::DeTable;

use crate::bands::{self, BandChoice};
use crate::document::{Entry, Table};
use crate::formats;
use crate::hollow_partitions;
use crate::inspection::inspect;
use crate::library;
use crate::notation::{count, listed, number, place, shell_word};
use crate::polygon_mesh::PolygonMesh;
use crate::problem::LineProblem;
use crate::report::{NoteKind, Remarks, Report};
use crate::room;
use crate::scene::{default_duration, face_kind};
use crate::seclusion;
use crate::sections::points::{Placed, read_receivers, read_sources};
use crate::sections::walls::{self, Walls};
use crate::sections::{air, designs, materials, regions};
use crate::value::{Entries, Value, to_toml};
use crate::{LONGEST_DEFAULT_DURATION, LONGEST_DURATION, Problem, Receiver, Scene, SceneErrors, Source};

/// Keys of the document itself.
const KEYS: [&str; 17] = [
    "name",
    "mesh",
    "mesh_unit",
    "mesh_weld",
    "mesh_up",
    "closed",
    "air_at",
    "duration_s",
    "shoebox",
    "bands",
    "air",
    "material_files",
    "materials",
    designs::SECTION,
    "regions",
    "sources",
    "receivers",
];

/// Most mistakes of notation that are listed: files of another kind have one in every line.
const MOST_TOML_ERRORS: usize = 10;
/// Message of the parser about a key that is given twice.
const DUPLICATE_KEY: &str = "duplicate key";

/// A scene and what is to be said about how it was read.
#[derive(Debug)]
pub struct Loaded {
    /// The compiled scene.
    pub scene: Scene,
    /// The walls, by [`Scene::geometry`].
    pub geometry: Arc<Geometry>,
    /// Size of the room, defaults taken, repairs made: one sentence each, for the log.
    pub notes: Vec<String>,
    /// Indices of the notes about defaults and entries of libraries ([`crate::folded`]).
    pub defaults: Vec<usize>,
    /// Likely mistakes: one sentence each.
    pub warnings: Vec<String>,
}

/// Reads a scene.
///
/// `toml_text` is the scene file, `file_label` its name in messages. `open_mesh` is called with the text of the key
/// `mesh`, a path relative to the scene file, and returns the mesh file's bytes; it is not called for a shoebox.
///
/// # Errors
/// Every problem of the scene file and of its mesh. Only a file that is no TOML is not looked at any further.
pub fn load(
    toml_text: &str,
    file_label: &str,
    open_mesh: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
) -> Result<Loaded, SceneErrors> {
    loaded(attempt(toml_text, file_label, open_mesh, None)?)
}

/// Reads a scene that differs from an `earlier` one in its sources alone, and takes over the walls of that.
///
/// # Errors
/// The errors of [`load`].
pub fn reload(
    toml_text: &str,
    file_label: &str,
    open_file: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
    earlier: Earlier<'_>,
) -> Result<Loaded, SceneErrors> {
    loaded(attempt(toml_text, file_label, open_file, Some(earlier))?)
}

/// A scene and its walls.
type Earlier<'a> = (&'a Scene, &'a Arc<Geometry>);

/// The scene of `attempt` where it has no problem.
fn loaded(attempt: Attempt) -> Result<Loaded, SceneErrors> {
    let Attempt { scene, geometry, problems, remarks: Remarks { notes, warnings }, .. } = attempt;
    if !problems.is_empty() {
        return Err(SceneErrors { problems });
    }
    let geometry = geometry.expect("a scene without problems has walls");
    let defaults = (0..notes.len()).filter(|&index| notes[index].kind == NoteKind::Default).collect();
    let notes = notes.into_iter().map(|note| note.text).collect();
    Ok(Loaded { scene, geometry, notes, defaults, warnings })
}

/// A scene made in code: the keys of a scene file (docs/formats/scene.md) as values, and the polygons that its `mesh` stands for.
#[derive(Clone, Debug)]
pub struct Document {
    keys: Entries,
    mesh: Option<PolygonMesh>,
}

impl Document {
    /// Name in messages.
    const LABEL: &str = "scene";
    /// Name of its mesh when it is saved.
    pub const MESH_NAME: &str = "mesh.obj";

    /// A scene of `keys`, with walls of `mesh` or of the key `shoebox`.
    pub fn new<K: Into<String>>(
        keys: impl IntoIterator<Item = (K, Value)>,
        mesh: Option<PolygonMesh>,
    ) -> Self {
        let mesh_name = mesh.as_ref().map(|_| ("mesh".to_owned(), Value::from(Self::MESH_NAME)));
        let keys = keys.into_iter().map(|(key, value)| (key.into(), value));
        Self { keys: Entries::made(mesh_name.into_iter().chain(keys)), mesh }
    }

    /// Polygons; none for a shoebox.
    #[must_use]
    pub fn mesh(&self) -> Option<&PolygonMesh> {
        self.mesh.as_ref()
    }

    /// The text of its scene file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        to_toml(&self.keys)
    }

    /// Compiles the scene, which is that of its scene file.
    ///
    /// # Errors
    /// Every problem, by key.
    pub fn load(&self) -> Result<Loaded, SceneErrors> {
        loaded(self.attempt())
    }

    pub(crate) fn attempt(&self) -> Attempt {
        let mut none = |_: &str| Err(io::ErrorKind::NotFound.into());
        let text = self.to_toml();
        // The mesh is the first key.
        let begin = "mesh = ".len();
        let name = self.mesh.as_ref().map_or(0..0, |_| begin..begin + Self::MESH_NAME.len() + 2);
        let origin = Origin { text: &text, mesh_name: name, mesh: self.mesh.as_ref(), earlier: None };
        compile(&self.keys, &origin, &mut none, Report::new(Self::LABEL, None))
    }
}

/// Sources of a scene beside its keys.
struct Origin<'a> {
    /// The scene file.
    text: &'a str,
    /// Bytes that name the mesh.
    mesh_name: Range<usize>,
    /// The mesh, where it is no file.
    mesh: Option<&'a PolygonMesh>,
    /// A scene of the same walls.
    earlier: Option<Earlier<'a>>,
}

/// Reads the `[[receivers]]` of a file that holds nothing else: receivers of a map, kept beside it.
///
/// # Errors
/// Every problem of the file; a file without receivers is one.
pub fn load_receivers(toml_text: &str, file_label: &str) -> Result<Vec<Receiver>, SceneErrors> {
    let (entries, report) = parsed(toml_text, file_label)?;
    let document = Table::document(&entries, &report);
    document.allow_only(&["receivers"]);
    let receivers = read_receivers(&document, None);
    if receivers.is_empty() {
        report.problem(0, "no receivers; add a [[receivers]] table with a name and a position");
    }
    report.finish()?;
    Ok(receivers.into_iter().map(|Placed { point, .. }| point).collect())
}

/// Reads `variants` of the material `name` in a scene of `materials` and `bands`: tables with the keys of `[[materials.NAME.variants]]`,
/// with entries of the shipped library. `label` is what messages call them.
///
/// # Errors
/// Every problem of the tables.
pub fn read_variants(
    label: &str,
    name: &str,
    variants: Vec<Value>,
    materials: &[Material],
    bands: &Bands,
) -> Result<Vec<Material>, SceneErrors> {
    let own = Value::table([(name, Value::table([("variants", variants)]))]);
    let (entries, report) = (Entries::made([("materials", own)]), Report::new(label, None));
    let sources = library::MaterialSources::shipped(BandChoice::certain(bands.clone()));
    let document = Table::document(&entries, &report);
    let table = document.table("materials").and_then(|section| section.table(name));
    let found = materials.iter().find(|material| material.name == name).zip(table);
    let variants = found.map(|(material, own)| materials::variants_of(material, &own, &sources));
    report.finish()?;
    Ok(variants.unwrap_or_default())
}

/// Reads the material `name` of `keys`, as `[materials.NAME]` has them, for a map of `bands`. `label` is what messages call it.
///
/// # Errors
/// Every problem of the keys.
pub fn read_material(
    label: &str,
    name: &str,
    keys: Vec<(&str, Value)>,
    bands: &Bands,
) -> Result<Material, SceneErrors> {
    let own = Value::table([(name, Value::table(keys))]);
    let entries = Entries::made([("materials", own)]);
    Ok(only_materials(&entries, bands, Report::new(label, None))?.remove(0))
}

/// Reads the `[materials.NAME]` of a file that holds nothing else: materials for a map of `bands`.
///
/// # Errors
/// Every problem of the file; a file without materials is one.
pub fn load_materials(
    toml_text: &str,
    file_label: &str,
    bands: &Bands,
) -> Result<Vec<Material>, SceneErrors> {
    let (entries, report) = parsed(toml_text, file_label)?;
    only_materials(&entries, bands, report)
}

fn only_materials(entries: &Entries, bands: &Bands, report: Report) -> Result<Vec<Material>, SceneErrors> {
    let document = Table::document(entries, &report);
    document.allow_only(&["materials"]);
    let sources = library::MaterialSources::shipped(BandChoice::certain(bands.clone()));
    let (materials, tables) = materials::read(&document, &sources);
    for interface in regions::interfaces(&tables) {
        let message = format!("{}: a map keeps its interfaces; remove the table", interface.path);
        report.problem(interface.at, message);
    }
    if materials.is_empty() {
        report.problem(0, "no materials; add a table [materials.NAME] with its absorption");
    }
    report.finish()?;
    Ok(materials)
}

/// Parses a document; problems that leave it readable are in the report.
fn parsed(toml_text: &str, file_label: &str) -> Result<(Entries, Report), SceneErrors> {
    let report = Report::new(file_label, Some(toml_text));
    let (document, errors) = DeTable::parse_recoverable(toml_text);
    // A key given twice leaves a sound document; after any other error the rest is guesswork.
    let is_readable = errors.iter().all(|error| error.message() == DUPLICATE_KEY);
    if !is_readable && formats::is_mesh(file_label) {
        let message =
            format!("a mesh, no scene: sonel-trace new {} writes a scene for it", shell_word(file_label));
        return Err(SceneErrors::of_file(file_label, vec![LineProblem::new(1, message)]));
    }
    for error in errors.iter().take(MOST_TOML_ERRORS) {
        let span = error.span().unwrap_or(0..0);
        match toml_text.get(span.clone()).filter(|_| error.message() == DUPLICATE_KEY) {
            Some(key) => report.problem(span.start, format!("{key}: given twice; keep one of the two")),
            None => report.problem(span.start, in_words(error.message(), toml_text, span.start)),
        }
    }
    if let Some(more) = errors.len().checked_sub(MOST_TOML_ERRORS).filter(|more| *more > 0) {
        let last = errors.last().and_then(|error| error.span()).map_or(0, |span| span.start);
        report.problem(last, format!("and {more} more mistakes up to this line: is it a scene file?"));
    }
    match is_readable {
        true => Ok((Entries::parsed(document.get_ref()), report)),
        false => Err(SceneErrors { problems: report.finish_anyway().1 }),
    }
}

/// What the parser says of a mistake at a place of the text, with the remedy for numbers that other programs and countries write.
fn in_words(message: &str, text: &str, at: usize) -> String {
    let (before, after) = (text.get(..at).unwrap_or(""), text.get(at..).unwrap_or(""));
    if message.starts_with("invalid mantissa") || message.starts_with("invalid fraction") {
        return "numbers have digits before and after the point, such as 0.1 and 2.0".to_owned();
    }
    if after.starts_with(',') && before.ends_with(|end: char| end.is_ascii_digit()) {
        return "numbers have a point, not a comma, such as 0.1; lists are in brackets".to_owned();
    }
    if message.contains("escape") {
        return format!("{message}; write / between folders, or '…' about a text with \\");
    }
    message.to_owned()
}

/// A scene that was read as far as it could be, and everything said about it.
pub(crate) struct Attempt {
    /// A makeshift where there are problems.
    pub(crate) scene: Scene,
    /// The walls, where they can be used.
    pub(crate) geometry: Option<Arc<Geometry>>,
    /// Names of the mesh that are no material; triangles index them behind the materials.
    pub(crate) unknown: Vec<String>,
    pub(crate) remarks: Remarks,
    pub(crate) problems: Vec<Problem>,
}

/// Reads a scene as [`load`] does, or [`reload`] after an `earlier` one, and keeps what could be read of it.
///
/// # Errors
/// When the text is no TOML.
pub(crate) fn attempt(
    toml_text: &str,
    file_label: &str,
    open_mesh: walls::OpenMesh<'_>,
    earlier: Option<Earlier<'_>>,
) -> Result<Attempt, SceneErrors> {
    let (entries, report) = parsed(toml_text, file_label)?;
    let mesh_name = entries.get("mesh").map_or(0..0, |mesh| mesh.span.clone());
    Ok(compile(&entries, &Origin { text: toml_text, mesh_name, mesh: None, earlier }, open_mesh, report))
}

/// Reads every section. With problems in the report the scene is a makeshift and must not be used.
fn compile(
    entries: &Entries,
    origin: &Origin<'_>,
    open_mesh: walls::OpenMesh<'_>,
    report: Report,
) -> Attempt {
    let document = &Table::document(entries, &report);
    document.allow_only(&KEYS);
    let name = read_name(document);
    let bands = bands::read(document);
    let air = air::read(document);
    let read_with = library::read_material_sources(document, bands, open_mesh);
    let (materials, tables) = materials::read(document, &read_with);
    let mut variants = materials::read_variants(&materials, &tables, &read_with);
    let designs = designs::read(document, &materials, &tables, &mut variants, &read_with);
    let bands = read_with.bands;
    let interfaces = regions::interfaces(&tables);
    let regions = regions::read(document, &air, &bands);
    let up = walls::read_up(document);
    let sources = read_sources(document, &bands, up, open_mesh);
    let first_source = sources.first().map(|source| source.point.position);
    let receivers = read_receivers(document, first_source);
    let known = origin.earlier;
    let mut walls =
        if known.is_none() { walls::read(document, &materials, open_mesh, origin.mesh) } else { None };
    if let Some(walls) = &mut walls {
        leave_out_holes(walls, &materials, &report);
    }
    let is_interface = |material| interfaces.iter().any(|interface| interface.material == material);
    let kind = |material| face_kind(&materials, material, is_interface);
    let closed = read_closed(document);
    let mut air_at = document.get("air_at").and_then(|entry| entry.vectors()).unwrap_or_default();
    let geometry =
        walls.as_mut().and_then(|walls| build(walls, &materials, kind, &air_at, closed.as_ref(), &report));
    let source_points: Vec<DVec3> = sources.iter().map(|source| source.point.position).collect();
    let geometry = walls.as_ref().zip(geometry).map(|(walls, geometry)| {
        Arc::new(hollow_partitions::close_off(walls, geometry, kind, &mut air_at, &source_points, &report))
    });
    let geometry = geometry.or_else(|| known.map(|(_, walls)| Arc::clone(walls)));
    let air_at = known.map_or(air_at, |(scene, _)| scene.air_at.clone());
    let is_outside = |place: &DVec3| geometry.as_ref().is_some_and(|geometry| geometry.cell_at(*place) == 0);
    for (at, place) in air_at.iter().enumerate().filter(|(_, place)| is_outside(place)) {
        report.warn(format!(
            "air_at[{}]: {place} is in no closed part of the mesh, so the outside is air and the scene no closed room; close the gap to \
             the outside in the drawing, or give a place in a closed room",
            at + 1
        ));
    }
    inspect(geometry.as_deref(), &sources, &receivers, &report);
    let compile_media = |geometry| regions::compile(regions, &interfaces, &sources, geometry, &report);
    let media = geometry.as_deref().and_then(compile_media);

    if let Some(walls) = &walls {
        walls.note_unused(&materials, up, &report);
    }
    let of_walls = walls.as_mut().map(|walls| (std::mem::take(&mut walls.unknown), walls.unit));
    let (unknown, unit) = of_walls.unwrap_or_default();
    let of_walls = walls.map(|walls| (walls.mesh, walls.digest));
    let of_walls = of_walls.or_else(|| known.map(|(scene, _)| (scene.mesh.clone(), scene.mesh_digest)));
    let (mesh, mesh_digest) = of_walls.unwrap_or_default();
    let mut scene = Scene {
        name,
        speed_of_sound: air.speed_of_sound(),
        sound_speed_gradient: air.gradient(),
        air_attenuation: air.attenuation_of(&air.air, &bands.bands),
        bands: bands.bands,
        air: air.air,
        duration: 0.0,
        has_default_duration: document.get("duration_s").is_none(),
        materials,
        variants,
        designs,
        mesh,
        air_at,
        sources: sources.into_iter().map(|Placed { point, .. }| point).collect(),
        receivers: receivers.into_iter().map(|Placed { point, .. }| point).collect(),
        up,
        media,
        digest: [0; 32],
        mesh_digest,
    };
    scene.digest = digest(origin, &scene.sources);
    if let Some(geometry) = geometry.as_ref().filter(|_| known.is_none()) {
        room::describe(&scene, geometry, unit, &report);
        room::warn_of_its_side(&scene, geometry, &report);
    }
    scene.duration = read_duration(document, &scene, geometry.as_deref());
    if let Some(geometry) = &geometry {
        air.check_gradient(&scene, geometry, &report);
        seclusion::warn(&scene, geometry, &report);
    }
    let (remarks, problems) = report.finish_anyway();
    Attempt { scene, geometry, unknown, remarks, problems }
}

/// Digest of the scene file, whatever the name of its mesh: the same walls in another file are the same scene. Factors of measured directivities
/// follow it.
fn digest(origin: &Origin<'_>, sources: &[Source]) -> [u8; 32] {
    let (text, name) = (origin.text.as_bytes(), &origin.mesh_name);
    let mut hasher = blake3::Hasher::new();
    hasher.update(&text[..name.start]).update(&text[name.end..]);
    for source in sources {
        if let Directivity::Measured { balloon, .. } = &source.directivity {
            balloon.factors().iter().for_each(|factor| {
                hasher.update(&factor.to_le_bytes());
            });
        }
    }
    hasher.finalize().into()
}

fn read_name(document: &Table<'_>) -> String {
    let name = match document.get("name") {
        Some(entry) => entry.filled_text(),
        None => {
            document.report.default("name: \"untitled\" (default)");
            None
        }
    };
    name.unwrap_or("untitled").to_owned()
}

/// Drops the faces of materials that let everything through in every band: what they do is nothing.
fn leave_out_holes(walls: &mut Walls, materials: &[Material], report: &Report) {
    let is_open = |material: &Material| material.transmission.iter().all(|&transmission| transmission >= 1.0);
    let is_hole = |index: u32| materials.get(index as usize).is_some_and(is_open);
    let faces = walls.mesh.triangles.len();
    walls.mesh.triangles.retain(|triangle| !is_hole(triangle.material));
    let dropped = faces - walls.mesh.triangles.len();
    if dropped > 0 {
        report.note(format!("triangles of materials with transmission 1 left out as holes: {dropped}"));
    }
}

/// Closes cracks of the walls, builds their geometry and tells what that changed.
fn build(
    walls: &mut Walls,
    materials: &[Material],
    kind: impl Fn(u32) -> FaceKind,
    air_at: &[DVec3],
    closed: Option<&Entry<'_>>,
    report: &Report,
) -> Option<Geometry> {
    let path = walls.path;
    let mut before = walls.mesh.vertices.len();
    let mut dropped = 0;
    if let Some(mended) = walls.mesh.mended(walls.weld) {
        if mended.joined + mended.attached > 0 {
            report.note_of(NoteKind::Repair, format!(
                "{path}: cracks up to {} mm closed: {} joined to others, {} put on edges; mesh_weld sets the width",
                number(1e3 * walls.weld),
                count(mended.joined, "corner"),
                mended.attached
            ));
        }
        before -= mended.joined;
        dropped = mended.dropped;
        walls.mesh = mended.mesh;
    }
    let geometry = match Geometry::with_kinds(walls.mesh.clone(), kind, air_at) {
        Ok(geometry) => geometry,
        Err(error) => {
            report.problem(walls.at, format!("{path}: {error}"));
            return None;
        }
    };
    let joined = before.saturating_sub(geometry.mesh().vertices.len());
    if joined > 0 {
        report.note_of(
            NoteKind::Repair,
            format!("{path}: vertices joined to others at the same place: {joined}"),
        );
    }
    for Redrawn { materials: of, area, center } in geometry.redrawn() {
        let [first, left_out] = of.map(|index| materials.get(index as usize).map_or("faces", |it| &it.name));
        let [area, about] = [number(*area), place(*center)];
        report.note_of(NoteKind::RepairedFault, match first == left_out {
            true => format!("{path}: {area} m² of {left_out} about ({about}) m are drawn more than once"),
            false => format!(
                "{path}: {area} m² of {left_out} about ({about}) m lie in faces of {first}, which were drawn first and count: \
                 cut them out of {first}, or draw {left_out} first"
            ),
        });
    }
    let masonry = geometry.masonry();
    if !masonry.is_empty() {
        let volume: f64 = masonry.iter().map(|part| part.volume).sum();
        let about = |part: &CellPlace| format!("{} m³ about ({}) m", number(part.volume), place(part.place));
        let of_what = match air_at {
            [] => "walls are drawn as solids, air_at = [[x, y, z]] states where air is instead",
            _ => "air is where air_at says",
        };
        report.note(format!(
            "{path}: {of_what}: {} m³ in {} count as masonry: {}",
            number(volume),
            count(masonry.len(), "part"),
            listed(masonry.iter().map(about))
        ));
        if !geometry.crossings().is_empty() {
            let united = format!("{path}: solids are united: {}", room::crossings(&geometry));
            report.note_of(NoteKind::Repair, united);
        }
    }
    let dropped = dropped + geometry.dropped_triangles();
    if dropped > 0 {
        report.note_of(NoteKind::Repair, format!("{path}: triangles without area dropped: {dropped}"));
    }
    report_leaks(&geometry, path, closed, report);
    Some(geometry)
}

/// Tells where sound can escape: an error in a scene that states to be `closed`.
fn report_leaks(geometry: &Geometry, path: &str, closed: Option<&Entry<'_>>, report: &Report) {
    let mut leaks = Vec::new();
    if !geometry.cracks().is_empty() {
        leaks.push((room::cracks(geometry), ""));
    }
    if !geometry.is_closed_room() {
        let remedy = "; add the missing faces (sonel-trace check lists all holes), or remove this key if sound may escape";
        leaks.push((room::leak(geometry), remedy));
    }
    for (leak, remedy) in leaks {
        match closed {
            Some(closed) if !geometry.is_watertight() => {
                closed.problem(&format!("{path}: {leak}{remedy}"));
            }
            _ => report.note_of(NoteKind::Fault, format!("{path}: {leak}")),
        }
    }
}

/// The key `closed` where it is true.
fn read_closed<'t>(document: &Table<'t>) -> Option<Entry<'t>> {
    document.get("closed").filter(|entry| entry.flag() == Some(true))
}

/// The duration stated, or at least 1.2 times the largest Sabine time, rounded up to hundredths of a second.
fn read_duration(document: &Table<'_>, scene: &Scene, geometry: Option<&Geometry>) -> f64 {
    if let Some(entry) = document.get("duration_s") {
        let duration = entry.positive().unwrap_or(0.0);
        if duration > LONGEST_DURATION {
            entry.problem(&format!("{duration} is more than an hour; give at most {LONGEST_DURATION}"));
        }
        return duration;
    }
    let Some(geometry) = geometry.filter(|_| document.report.is_clean()) else { return 0.0 };
    let Some(sabine) = scene.largest_sabine_time(geometry) else {
        document
            .report
            .problem(0, "duration_s: missing, and a band has no absorption, so there is no default; give it");
        return 0.0;
    };
    let duration = default_duration(sabine);
    if duration > LONGEST_DEFAULT_DURATION {
        let message = format!(
            "duration_s: missing, and the default, 1.2 times the largest Sabine time of {sabine:.0} s, exceeds {LONGEST_DEFAULT_DURATION} s; \
             check the size of the room and its absorption (sonel-trace check), or give duration_s"
        );
        document.report.problem(0, message);
    }
    document.report.default(format!(
        "duration_s: at least {duration:.2} (default: 1.2 times the largest Sabine time, {sabine:.3} s; longer where the room decays more slowly)"
    ));
    duration
}
