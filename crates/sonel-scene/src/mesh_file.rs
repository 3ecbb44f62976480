//! Reads a mesh file into a mesh in metres with the materials of the scene.

use foldhash::HashMap;
use glam::DVec3;
use sonel_acoustics::Material;
use sonel_geometry::{Mesh, MeshTriangle};

use crate::document::quoted_key;
use crate::notation::number;
use crate::obj::{self, Face, FileTerms, Polygons, Triangulation};
use crate::problem::LineProblem;
use crate::report::{NoteKind, Report};
use crate::suggest::suggest;

/// No coordinate lies further from the origin [m]; generous for national grids, far below where squares overflow.
pub(crate) const FARTHEST: f64 = 1e8;

/// Most problems of a mesh file reported one by one, a screenful; the others are counted.
const MOST_PROBLEMS: usize = 50;

/// Keys of the scene file about its mesh.
pub(crate) struct Stated {
    /// Length of the unit [m].
    pub(crate) unit: Option<f64>,
    /// Whether it says which axis is up: then nothing is turned.
    pub(crate) up: bool,
}

/// A mesh [m], and what its file says of it.
pub(crate) struct MeshOfFile {
    pub(crate) mesh: Mesh,
    /// Names that are no material of the scene; triangles index them behind the materials.
    pub(crate) unknown: Vec<String>,
    /// Length of the unit of the file [m].
    pub(crate) unit: f64,
}

/// Makes a mesh of `polygons`; `None` when its faces have problems. `file` is its name in messages. Unknown materials are problems too.
pub(crate) fn read(
    polygons: Result<Polygons, Vec<LineProblem>>,
    file: &str,
    stated: &Stated,
    materials: &[Material],
    report: &Report,
) -> Option<MeshOfFile> {
    let refused = |problems| report_problems(problems, file, report);
    let polygons = polygons.map_err(refused).ok()?;
    let (material_of_name, unknown) = match_materials(&polygons, materials, file, report);
    let (vertices, unit) = in_metres(&polygons, file, stated, report);
    let terms = &polygons.terms;
    let mut oddities =
        Oddities { file, terms, bent: Vec::new(), bend: 0.0, flat: Vec::new(), doubled: Vec::new() };
    let triangles =
        triangles(&polygons, &vertices, &material_of_name, &mut oddities).map_err(refused).ok()?;
    oddities.tell(report);
    for (place, note) in &polygons.notes {
        report.note(format!("{}: {note}", terms.label(file, *place)));
    }
    Some(MeshOfFile { mesh: Mesh { vertices, triangles }, unknown, unit })
}

/// The faces of a file in triangles, each face once, with the materials of their names.
fn triangles<'f>(
    polygons: &'f Polygons,
    vertices: &[DVec3],
    material_of_name: &[u32],
    oddities: &mut Oddities<'f>,
) -> Result<Vec<MeshTriangle>, Vec<LineProblem>> {
    let (mut triangles, mut problems) = (Vec::new(), Vec::new());
    // The corners of each face in an order that does not depend on where it begins and which way it turns.
    let mut sorted = polygons.corners.clone();
    polygons.faces.iter().for_each(|face| sorted[face.corners.clone()].sort_unstable());
    let mut known: HashMap<&[u32], &Face> = HashMap::default();
    for face in &polygons.faces {
        let corners = &polygons.corners[face.corners.clone()];
        let positions: Vec<DVec3> = corners.iter().map(|corner| vertices[*corner as usize]).collect();
        let farthest = positions.iter().map(|position| position.abs().max_element()).fold(0.0, f64::max);
        if farthest > FARTHEST {
            let message =
                format!("f: a coordinate of {farthest:e} m is beyond {FARTHEST:e} m; check mesh_unit");
            problems.push(polygons.terms.problem(face.line, &message));
            continue;
        }
        // Faces without area are dropped later: they double none.
        let first = match obj::is_line(&positions) {
            true => face,
            false => *known.entry(&sorted[face.corners.clone()]).or_insert(face),
        };
        if !std::ptr::eq(first, face) {
            let [used, left_out] = [first, face].map(|face| polygons.names[face.name].name.as_str());
            oddities.doubled.push((face.line, first.line, (used != left_out).then_some([used, left_out])));
            continue;
        }
        match obj::triangulate(&positions) {
            Ok(triangulation) => {
                oddities.see(face, &triangulation);
                let material = material_of_name[face.name];
                triangles.extend(triangulation.triangles.iter().map(|triangle| MeshTriangle {
                    corners: triangle.map(|corner| corners[corner]),
                    material,
                }));
            }
            Err(error) => problems.push(polygons.terms.problem(face.line, &error.to_string())),
        }
    }
    if problems.is_empty() { Ok(triangles) } else { Err(problems) }
}

/// The vertices in metres, with z up where the file says that y is and the scene file says nothing; and the length of the unit [m].
fn in_metres(polygons: &Polygons, file: &str, stated: &Stated, report: &Report) -> (Vec<DVec3>, f64) {
    let mut unit = stated.unit.unwrap_or(1.0);
    if let (None, Some((length, name))) = (stated.unit, polygons.terms.unit) {
        unit = length;
        report.note(format!("{file}: mesh_unit: {name} (the file says so)"));
    }
    let turns = polygons.terms.is_y_up && !stated.up;
    if turns {
        report.note(format!("{file}: turned from y up, as the file says, to z up: (x, y, z) becomes (x, -z, y); mesh_up keeps its axes"));
    }
    // Adding zero makes one number of both zeros.
    let place = |vertex: &DVec3| {
        let DVec3 { x, y, z } = *vertex * unit;
        if turns { DVec3::new(x, -z, y) + DVec3::ZERO } else { DVec3::new(x, y, z) }
    };
    (polygons.vertices.iter().map(place).collect(), unit)
}

fn report_problems(mut problems: Vec<LineProblem>, file: &str, report: &Report) {
    problems.sort_by_key(|problem| problem.line);
    let more = problems.len().saturating_sub(MOST_PROBLEMS);
    let last_line = problems.last().map_or(1, |problem| problem.line);
    report.problems_of(file, problems.into_iter().take(MOST_PROBLEMS));
    if more > 0 {
        let message = format!("and {more} more problems up to this line");
        report.problems_of(file, [LineProblem::new(last_line, message)]);
    }
}

/// For each name of the file its index among the scene's materials, and the names not there, which are problems and come
/// behind.
fn match_materials(
    polygons: &Polygons,
    materials: &[Material],
    file: &str,
    report: &Report,
) -> (Vec<u32>, Vec<String>) {
    let mut problems = Vec::new();
    let mut unknown = Vec::new();
    let indices: HashMap<&str, u32> =
        materials.iter().map(|material| material.name.as_str()).zip(0u32..).collect();
    let mut is_used = vec![false; polygons.names.len()];
    for face in &polygons.faces {
        is_used[face.name] = true;
    }
    let mut matched = Vec::new();
    for (name, is_used) in polygons.names.iter().zip(is_used) {
        let index = indices.get(name.name.as_str()).copied();
        if index.is_none() && is_used {
            let advice = suggest(&name.name, materials.iter().map(|material| material.name.as_str()));
            let message = format!(
                "{} {}: no table [materials.{}] in the scene file; {advice}",
                polygons.terms.word,
                name.name,
                quoted_key(&name.name)
            );
            let line = if polygons.terms.counts_lines { name.line } else { 0 };
            problems.push(LineProblem::new(line, message));
            unknown.push(name.name.clone());
        }
        let behind = (materials.len() + unknown.len()).saturating_sub(1) as u32;
        matched.push(index.unwrap_or(behind));
    }
    report_problems(problems, file, report);
    (matched, unknown)
}

/// Lines of faces that are no problem but deserve a word.
struct Oddities<'f> {
    file: &'f str,
    terms: &'f FileTerms,
    bent: Vec<usize>,
    /// Largest distance of corners from their plane [m].
    bend: f64,
    flat: Vec<usize>,
    /// Faces left out: their line, that of the face they double, and both materials where they differ.
    doubled: Vec<(usize, usize, Option<[&'f str; 2]>)>,
}

impl Oddities<'_> {
    fn see(&mut self, face: &Face, triangulation: &Triangulation) {
        if triangulation.bend > 0.0 {
            self.bent.push(face.line);
            self.bend = self.bend.max(triangulation.bend);
        }
        if triangulation.triangles.is_empty() {
            self.flat.push(face.line);
        }
    }

    fn tell(&self, report: &Report) {
        let bend = number(1e3 * self.bend);
        let bent = format!(
            "the face is not plane, its corners off by up to {bend} mm, and is folded along diagonals"
        );
        let kinds = [(&self.bent, &*bent), (&self.flat, "the face has no area and was dropped")];
        for (lines, what) in kinds {
            if let Some(first) = lines.first() {
                let place = self.terms.label(self.file, *first);
                report.note_of(NoteKind::Repair, format!("{place}: {what}{}", obj::and_more(lines.len())));
            }
        }
        if let Some((line, first, _)) = self.doubled.first() {
            let more = obj::and_more(self.doubled.len());
            let place = self.terms.label(self.file, *line);
            let other = if self.terms.counts_lines {
                format!("the face in line {first}")
            } else {
                format!("face {first}")
            };
            report.note_of(
                NoteKind::RepairedFault,
                format!("{place}: the face has the corners of {other} and is left out{more}"),
            );
        }
        let mut conflicts =
            self.doubled.iter().filter_map(|(line, _, materials)| Some((line, (*materials)?)));
        if let Some((line, [used, left_out])) = conflicts.next() {
            let more = obj::and_more(1 + conflicts.count());
            report.warn(format!(
                "{}: the face doubles one of another material: {used} is used on both sides, {left_out} is not{more}",
                self.terms.label(self.file, *line)
            ));
        }
    }
}
