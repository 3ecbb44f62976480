//! The polygons of a mesh file, and how messages call its places.

use foldhash::HashMap;
use glam::DVec3;

use super::scan::{Face, MaterialName, scan};
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

/// Reads a file.
///
/// # Errors
/// Every problem of the file, in any order.
pub(crate) fn read(bytes: &[u8]) -> Result<Polygons, Vec<LineProblem>> {
    let scan = scan(bytes);
    if !scan.problems.is_empty() {
        return Err(scan.problems);
    }
    let (mut vertices, mut corners) = (Vertices::default(), Vec::with_capacity(scan.corners.len()));
    corners.extend(scan.corners.iter().map(|index| vertices.index_of(scan.vertices[index - 1])));
    Ok(Polygons {
        vertices: vertices.positions,
        corners,
        faces: scan.faces,
        names: scan.names,
        points: Vec::new(),
        notes: scan.notes,
        terms: FileTerms::default(),
    })
}

/// Vertices in the order of their use; equal positions are one.
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
