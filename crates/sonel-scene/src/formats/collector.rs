//! Collects the faces of a file.

use std::collections::{HashMap, HashSet};
use std::fmt::Display;

use glam::DVec3;

use crate::obj::{Face, FileTerms, MaterialName, NAMELESS, Polygons, Vertices, and_more, repeated};
use crate::problem::LineProblem;

/// Faces read so far and what is wrong with them.
#[derive(Default)]
pub(crate) struct Collector {
    terms: FileTerms,
    vertices: Vertices,
    corners: Vec<u32>,
    faces: Vec<Face>,
    names: Vec<MaterialName>,
    indices_of_names: HashMap<String, usize>,
    /// Place of the first face without area, and their count.
    flat: Option<(usize, usize)>,
    /// Names and positions of points.
    pub(crate) points: Vec<(String, DVec3)>,
    /// Places and remarks.
    pub(crate) notes: Vec<(usize, String)>,
    pub(crate) problems: Vec<LineProblem>,
}

impl Collector {
    pub(crate) fn new(terms: FileTerms) -> Self {
        Self { terms, ..Self::default() }
    }

    /// Whether there is any face.
    pub(crate) fn has_faces(&self) -> bool {
        !self.faces.is_empty()
    }

    /// Notes a problem at a line or face.
    pub(crate) fn problem(&mut self, place: usize, message: impl AsRef<str>) {
        self.problems.push(self.terms.problem(place, message.as_ref()));
    }

    /// Adds a polygon under a name; one without area is counted and left out, corners that follow themselves are one. `place` is its line, or
    /// its number from 1.
    pub(crate) fn face(&mut self, corners: &[DVec3], name: &str, place: usize) {
        if let Some(corner) = corners.iter().find(|corner| !corner.is_finite()) {
            self.problem(place, format!("a coordinate is not a finite number: {corner}"));
            return;
        }
        let start = self.corners.len();
        for corner in corners {
            let index = self.vertices.index_of(*corner);
            if self.corners[start..].last() != Some(&index) {
                self.corners.push(index);
            }
        }
        if self.corners.len() > start + 1 && self.corners.last() == Some(&self.corners[start]) {
            self.corners.pop();
        }
        let outline = &self.corners[start..];
        let different = outline.iter().collect::<HashSet<_>>().len();
        // Of three corners more than a triangle is a line that is walked there and back.
        if different < 3 || different == 3 && outline.len() > 3 {
            self.corners.truncate(start);
            let (first, before) = self.flat.unwrap_or((place, 0));
            self.flat = Some((first, before + 1));
            return;
        }
        if let Some(twice) = repeated(outline) {
            self.corners.truncate(start);
            let corner = self.vertices.positions[twice as usize];
            self.problem(
                place,
                format!("the corner at {corner} occurs twice in the outline; split the face"),
            );
            return;
        }
        let name = self.name(name.trim(), place);
        self.faces.push(Face { corners: start..self.corners.len(), name, line: place });
    }

    /// Adds a polygon of `vertices` by their indices from 0, as [`Self::face`] does.
    pub(crate) fn indexed<I: Copy + TryInto<usize> + Display>(
        &mut self,
        vertices: &[DVec3],
        corners: &[I],
        name: &str,
        place: usize,
    ) {
        let vertex = |&index: &I| vertices.get(index.try_into().ok()?).copied();
        match corners.iter().find(|index| vertex(index).is_none()) {
            Some(wrong) => {
                let count = vertices.len();
                self.problem(place, format!("no vertex {wrong}: there are {count}, counted from 0"));
            }
            None => self.face(&corners.iter().filter_map(vertex).collect::<Vec<_>>(), name, place),
        }
    }

    fn name(&mut self, name: &str, place: usize) -> usize {
        let name = if name.is_empty() { NAMELESS } else { name };
        if let Some(index) = self.indices_of_names.get(name) {
            return *index;
        }
        self.names.push(MaterialName { name: name.to_owned(), line: place });
        self.indices_of_names.insert(name.to_owned(), self.names.len() - 1);
        self.names.len() - 1
    }

    pub(crate) fn finish(mut self) -> Result<Polygons, Vec<LineProblem>> {
        if let Some((place, count)) = self.flat {
            self.notes.push((place, format!("the face has no area and was dropped{}", and_more(count))));
        }
        if self.faces.is_empty() && self.problems.is_empty() {
            self.problem(0, "the mesh has no face; export polygons");
        }
        if !self.problems.is_empty() {
            return Err(self.problems);
        }
        let Self { terms, vertices, corners, faces, names, points, notes, .. } = self;
        Ok(Polygons { vertices: vertices.positions, corners, faces, names, points, notes, terms })
    }
}
