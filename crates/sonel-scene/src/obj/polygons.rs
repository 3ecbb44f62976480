//! The polygons of an OBJ file, read by `tobj` from the cleaned text of the scan.

use std::ops::Range;

use foldhash::HashMap;
use glam::DVec3;

use super::scan::{MaterialName, Scan, scan};
use crate::problem::LineProblem;

/// Polygons as in the file: its unit, its axes. At least one face.
#[derive(Debug)]
pub(crate) struct Polygons {
    /// Positions that faces use, no two the same.
    pub(crate) vertices: Vec<DVec3>,
    /// Indices of vertices, face after face.
    pub(crate) corners: Vec<u32>,
    pub(crate) faces: Vec<Face>,
    pub(crate) names: Vec<MaterialName>,
    /// Names and positions of points that are neither vertices nor faces, such as nodes without a mesh.
    pub(crate) points: Vec<(String, DVec3)>,
    /// Lines and what was done about them.
    pub(crate) notes: Vec<(usize, String)>,
    pub(crate) terms: FileTerms,
}

/// Terms of a file: counting, names, unit and axes.
#[derive(Clone, Debug)]
pub(crate) struct FileTerms {
    /// Whether places are lines; else they are faces, counted from 1.
    pub(crate) counts_lines: bool,
    /// Word of the format for a material's name.
    pub(crate) word: &'static str,
    /// Length of the unit the file states [m], and its name.
    pub(crate) unit: Option<(f64, &'static str)>,
    /// Whether the file states that y is up.
    pub(crate) is_y_up: bool,
}

impl Default for FileTerms {
    fn default() -> Self {
        Self { counts_lines: true, word: "usemtl", unit: None, is_y_up: false }
    }
}

impl FileTerms {
    /// A problem at a line or face; 0 is the whole file.
    pub(crate) fn problem(&self, place: usize, message: &str) -> LineProblem {
        let message = if self.word == "usemtl" { message } else { message.trim_start_matches("f: ") };
        match (self.counts_lines, place) {
            (true, line) => LineProblem::new(line, message),
            (false, 0) => LineProblem::new(0, message),
            (false, face) => LineProblem { line: 0, message: format!("face {face}: {message}") },
        }
    }

    /// A line or face as a note begins with it.
    pub(crate) fn label(&self, file: &str, place: usize) -> String {
        match (self.counts_lines, place) {
            (_, 0) => file.to_owned(),
            (true, line) => format!("{file}:{line}"),
            (false, face) => format!("{file}: face {face}"),
        }
    }
}

/// One polygon.
#[derive(Debug)]
pub(crate) struct Face {
    /// Range in [`Polygons::corners`].
    pub(crate) corners: Range<usize>,
    /// Index into [`Polygons::names`].
    pub(crate) name: usize,
    /// Line in the file, or number of the face, from 1.
    pub(crate) line: usize,
}

/// Reads a file.
///
/// # Errors
/// Every problem of the file, in any order.
pub(crate) fn read(bytes: &[u8]) -> Result<Polygons, Vec<LineProblem>> {
    let scan = scan(bytes);
    if !scan.problems.is_empty() {
        return Err(scan.problems);
    }
    let refused = |message: String| vec![LineProblem { line: 1, message }];
    let models =
        parse(&scan).map_err(|error| refused(format!("the OBJ reader refuses the file: {error}")))?;
    gather(&models, scan).ok_or_else(|| refused("the OBJ reader lost faces of the file".to_owned()))
}

fn parse(scan: &Scan) -> Result<Vec<tobj::Model>, tobj::LoadError> {
    let every_name: String = (0..scan.names.len()).map(|index| format!("newmtl {index}\n")).collect();
    let options = tobj::LoadOptions::default();
    let materials = |_: &std::path::Path| tobj::load_mtl_buf(&mut every_name.as_bytes());
    let (models, _) = tobj::load_obj_buf(&mut scan.cleaned.as_bytes(), &options, materials)?;
    Ok(models)
}

/// Joins the models into which `tobj` splits a file at every change of material; `None` when faces went missing.
fn gather(models: &[tobj::Model], scan: Scan) -> Option<Polygons> {
    let mut vertices = Vertices::default();
    let mut corners = Vec::new();
    let mut faces = Vec::new();
    let mut lines = scan.face_lines.iter();
    for tobj::Model { mesh, .. } in models {
        let name = mesh.material_id?;
        let triangles_only = vec![3; mesh.indices.len() / 3];
        let arities = if mesh.face_arities.is_empty() { &triangles_only } else { &mesh.face_arities };
        let mut rest = mesh.indices.as_slice();
        for arity in arities {
            let (face, after) = rest.split_at_checked(*arity as usize)?;
            rest = after;
            let start = corners.len();
            for index in face {
                let first = 3 * *index as usize;
                corners.push(vertices.index_of(DVec3::from_slice(mesh.positions.get(first..first + 3)?)));
            }
            faces.push(Face { corners: start..corners.len(), name, line: *lines.next()? });
        }
    }
    if lines.next().is_some() {
        return None;
    }
    let terms = FileTerms::default();
    Some(Polygons {
        vertices: vertices.positions,
        corners,
        faces,
        names: scan.names,
        points: Vec::new(),
        notes: scan.notes,
        terms,
    })
}

/// Every model of `tobj` repeats the vertices it uses; equal positions become one vertex again.
#[derive(Default)]
pub(crate) struct Vertices {
    pub(crate) positions: Vec<DVec3>,
    indices: HashMap<[u64; 3], u32>,
}

impl Vertices {
    pub(crate) fn index_of(&mut self, position: DVec3) -> u32 {
        // −0 + 0 = +0: the two zeros are one position.
        let position = position + DVec3::ZERO;
        let next = self.positions.len() as u32;
        let index = *self.indices.entry(position.to_array().map(f64::to_bits)).or_insert(next);
        if index == next {
            self.positions.push(position);
        }
        index
    }
}
