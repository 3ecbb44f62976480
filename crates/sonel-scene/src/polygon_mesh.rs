//! Walls made in code: polygons over vertices, each of a material.

use std::io::{self, Write};

use glam::DVec3;

use crate::formats::Collector;
use crate::obj::{FileTerms, Polygons};
use crate::problem::LineProblem;

/// Polygons over vertices [m], each of a material. They are plane, of either sense, with three corners or more.
#[derive(Clone, Debug, Default)]
pub struct PolygonMesh {
    vertices: Vec<[f64; 3]>,
    /// Indices of vertices, face after face.
    corners: Vec<u32>,
    /// Where the corners of each face end, and the index of its material's name.
    faces: Vec<(usize, usize)>,
    names: Vec<String>,
}

impl PolygonMesh {
    /// A mesh of `vertices` [m] without faces.
    #[must_use]
    pub fn new(vertices: Vec<[f64; 3]>) -> Self {
        Self { vertices, ..Self::default() }
    }

    /// Adds a face between the vertices of the indices `corners`, counted from 0. Wrong indices are told when the scene is compiled.
    pub fn face(&mut self, corners: &[u32], material: &str) {
        let last = self.faces.last().map(|(_, name)| *name).filter(|&name| self.names[name] == material);
        let name =
            last.or_else(|| self.names.iter().position(|name| name == material)).unwrap_or_else(|| {
                self.names.push(material.to_owned());
                self.names.len() - 1
            });
        self.corners.extend(corners);
        self.faces.push((self.corners.len(), name));
    }

    /// Corners and material of every face.
    fn faces(&self) -> impl Iterator<Item = (&[u32], &str)> {
        let begins = std::iter::once(0).chain(self.faces.iter().map(|(end, _)| *end));
        let faces = begins.zip(&self.faces);
        faces.map(|(begin, &(end, name))| (&self.corners[begin..end], self.names[name].as_str()))
    }

    /// Writes the mesh as an OBJ file, which has the digest of the mesh.
    ///
    /// # Errors
    /// The errors of `out`.
    pub fn write_obj(&self, out: &mut dyn Write) -> io::Result<()> {
        for [x, y, z] in &self.vertices {
            writeln!(out, "v {x:?} {y:?} {z:?}")?;
        }
        let mut used = None;
        for (corners, name) in self.faces() {
            if used.replace(name) != Some(name) {
                writeln!(out, "usemtl {name}")?;
            }
            let corners: Vec<String> = corners.iter().map(|corner| (corner + 1).to_string()).collect();
            writeln!(out, "f {}", corners.join(" "))?;
        }
        Ok(())
    }

    /// The polygons as those of a file.
    pub(crate) fn polygons(&self) -> Result<Polygons, Vec<LineProblem>> {
        let terms = FileTerms { counts_lines: false, word: "material", ..FileTerms::default() };
        let mut collector = Collector::new(terms);
        for name in &self.names {
            if name.trim() != name || name.is_empty() || name.chars().any(char::is_control) {
                collector.problem(0, format!("a mesh cannot hold the material name {name:?}: rename it"));
            }
        }
        let vertices: Vec<DVec3> = self.vertices.iter().map(|&vertex| vertex.into()).collect();
        for (number, (corners, name)) in (1..).zip(self.faces()) {
            collector.indexed(&vertices, corners, name, number);
        }
        collector.finish()
    }
}
