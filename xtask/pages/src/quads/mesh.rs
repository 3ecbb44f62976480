//! Welded quads: measures, checks, and the OBJ text.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::grid::Face;

/// Quads over shared vertices.
pub(crate) struct QuadMesh {
    /// Positions [m].
    pub vertices: Vec<[f64; 3]>,
    /// Corner indices, counter-clockwise seen from the air, with the material's name.
    pub quads: Vec<([usize; 4], &'static str)>,
}

impl QuadMesh {
    /// Welds equal vertices of the grid, of which `place` gives the position [m]; quads are sorted by material.
    pub(crate) fn weld(mut faces: Vec<Face>, place: impl Fn([i32; 3]) -> [f64; 3]) -> Self {
        faces.sort_by_key(|f| (f.material, f.corners));
        let mut seen = BTreeMap::new();
        let mut vertices = Vec::new();
        let quads = faces
            .iter()
            .map(|face| {
                let corners = face.corners.map(|corner| {
                    *seen.entry(corner).or_insert_with(|| {
                        vertices.push(place(corner));
                        vertices.len() - 1
                    })
                });
                (corners, face.material)
            })
            .collect();
        Self { vertices, quads }
    }

    /// The quad's corners [m].
    pub(crate) fn corners(&self, quad: &[usize; 4]) -> [[f64; 3]; 4] {
        quad.map(|i| self.vertices[i])
    }

    /// Enclosed air [m³], by the divergence theorem; positive if the normals point into it.
    pub(crate) fn volume(&self) -> f64 {
        -self.triangles().map(|([a, b, c], _)| dot(a, cross(b, c)) / 6.0).sum::<f64>()
    }

    /// Area [m²] by material.
    pub(crate) fn areas(&self) -> BTreeMap<&'static str, f64> {
        let mut areas = BTreeMap::new();
        for ([a, b, c], material) in self.triangles() {
            *areas.entry(material).or_insert(0.0) += 0.5 * length(cross(sub(b, a), sub(c, a)));
        }
        areas
    }

    /// Both triangles of each quad.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = ([[f64; 3]; 3], &'static str)> {
        self.quads.iter().flat_map(|(quad, material)| {
            let [a, b, c, d] = self.corners(quad);
            [([a, b, c], *material), ([a, c, d], *material)]
        })
    }

    /// Wavefront OBJ text of the room `title`, which `cargo pages PAGE` writes.
    pub(crate) fn to_obj(&self, title: &str, page: &str) -> String {
        let mut obj = format!(
            "# {title}, z up, metres. Written by `cargo pages {page}`; change the plan there, not this file.\n"
        );
        for [x, y, z] in &self.vertices {
            writeln!(obj, "v {} {} {}", decimal(*x), decimal(*y), decimal(*z))
                .expect("writing to a string cannot fail");
        }
        let mut current = "";
        for (quad, material) in &self.quads {
            if *material != current {
                current = material;
                writeln!(obj, "o {material}\nusemtl {material}").expect("writing to a string cannot fail");
            }
            let [a, b, c, d] = quad.map(|i| i + 1);
            writeln!(obj, "f {a} {b} {c} {d}").expect("writing to a string cannot fail");
        }
        obj
    }
}

/// Five decimals without trailing zeros; never "-0".
fn decimal(value: f64) -> String {
    let text = format!("{value:.5}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

/// Directed edges that do not occur exactly once in each direction.
#[cfg(test)]
pub(crate) fn open_edges(mesh: &QuadMesh) -> usize {
    let mut seen: BTreeMap<(usize, usize), [u32; 2]> = BTreeMap::new();
    for (quad, _) in &mesh.quads {
        for i in 0..4 {
            let (from, to) = (quad[i], quad[(i + 1) % 4]);
            seen.entry((from.min(to), from.max(to))).or_default()[usize::from(from > to)] += 1;
        }
    }
    seen.values().filter(|both| **both != [1, 1]).count()
}

/// Largest distance [m] of a quad's fourth corner from the plane of the others.
#[cfg(test)]
pub(crate) fn warp(corners: [[f64; 3]; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let normal = cross(sub(b, a), sub(c, a));
    (dot(sub(d, a), normal) / length(normal)).abs()
}

pub(crate) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
