//! Meshes that are hard in one way each, made from sound ones.

use std::collections::HashMap;

use glam::{DVec3, dvec3};
use sonel_geometry::{Mesh, MeshTriangle};
use sonel_testkit::uniform::Uniform;

/// Adds a triangle with corners of its own.
pub fn add(mesh: &mut Mesh, material: u32, corners: [DVec3; 3]) {
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(corners);
    mesh.triangles.push(MeshTriangle { corners: [first, first + 1, first + 2], material });
}

/// Adds a plane quadrilateral.
pub fn add_quad(mesh: &mut Mesh, material: u32, [a, b, c, d]: [DVec3; 4]) {
    add(mesh, material, [a, b, c]);
    add(mesh, material, [a, c, d]);
}

/// Adds a closed box from `low` to `high` with normals outwards.
pub fn add_box(mesh: &mut Mesh, material: u32, low: DVec3, high: DVec3) {
    let first = mesh.vertices.len() as u32;
    let mut solid = Mesh::shoebox((high - low).to_array(), [material; 6]);
    for triangle in &mut solid.triangles {
        triangle.corners = triangle.corners.map(|corner| corner + first);
        triangle.corners.swap(1, 2);
    }
    mesh.vertices.extend(solid.vertices.into_iter().map(|vertex| vertex + low));
    mesh.triangles.extend(solid.triangles);
}

/// A room over a floor plan, counterclockwise, all of which is seen from its first corner: floor, ceiling and walls have materials 0, 1
/// and 2, normals point inwards.
#[must_use]
pub fn prism(plan: &[[f64; 2]], height: f64) -> Mesh {
    let count = plan.len() as u32;
    let level = |z: f64| plan.iter().map(move |&[x, y]| dvec3(x, y, z));
    let mut mesh = Mesh { vertices: level(0.0).chain(level(height)).collect(), triangles: Vec::new() };
    let mut face = |material, corners| mesh.triangles.push(MeshTriangle { corners, material });
    for i in 1..count - 1 {
        face(0, [0, i, i + 1]);
        face(1, [count, count + i + 1, count + i]);
    }
    for i in 0..count {
        let next = (i + 1) % count;
        face(2, [i, i + count, next + count]);
        face(2, [i, next + count, next]);
    }
    mesh
}

/// Corners of a triangle.
#[must_use]
pub fn corners(mesh: &Mesh, triangle: usize) -> [DVec3; 3] {
    mesh.triangles[triangle].corners.map(|corner| mesh.vertices[corner as usize])
}

/// Every triangle that `choose` names by index and material divided into four.
#[must_use]
pub fn divided(mesh: &Mesh, choose: impl Fn(usize, u32) -> bool) -> Mesh {
    let mut fine = Mesh { vertices: mesh.vertices.clone(), triangles: Vec::new() };
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    for (index, &MeshTriangle { corners: [a, b, c], material }) in mesh.triangles.iter().enumerate() {
        if !choose(index, material) {
            fine.triangles.push(mesh.triangles[index]);
            continue;
        }
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                fine.vertices.push(0.5 * (fine.vertices[a as usize] + fine.vertices[b as usize]));
                fine.vertices.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        fine.triangles.extend(parts.map(|corners| MeshTriangle { corners, material }));
    }
    fine
}

/// Every triangle divided `times` times into four.
#[must_use]
pub fn tessellated(mesh: &Mesh, times: u32) -> Mesh {
    (0..times).fold(mesh.clone(), |mesh, _| divided(&mesh, |_, _| true))
}

/// A sphere of 8 · 4^`depth` triangles with its centre in the origin.
#[must_use]
pub fn sphere(radius: f64, depth: u32) -> Mesh {
    let vertices = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z].to_vec();
    let faces = (0..8_u32).map(|face| [face & 1, 2 + (face >> 1 & 1), 4 + (face >> 2)]);
    let triangles = faces.map(|corners| MeshTriangle { corners, material: 0 }).collect();
    let mut mesh = tessellated(&Mesh { vertices, triangles }, 1);
    for _ in 1..depth {
        mesh.vertices.iter_mut().for_each(|vertex| *vertex = vertex.normalize());
        mesh = tessellated(&mesh, 1);
    }
    mesh.vertices.iter_mut().for_each(|vertex| *vertex = radius * vertex.normalize());
    mesh
}

/// Every wall of a mesh, which is a material, with corners of its own and moved outward by `distance` [m], as seen from the
/// middle of the mesh's vertices.
#[must_use]
pub fn walls_apart(mesh: &Mesh, distance: f64) -> Mesh {
    let middle = mesh.vertices.iter().sum::<DVec3>() / mesh.vertices.len() as f64;
    let mut apart = Mesh::default();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.corners.map(|corner| mesh.vertices[corner as usize]);
        let normal = (b - a).cross(c - a).normalize();
        let outward = normal * distance.copysign(normal.dot(a - middle));
        add(&mut apart, triangle.material, [a, b, c].map(|corner| corner + outward));
    }
    apart
}

/// Every triangle with corners of its own, moved by up to `distance` [m] along each axis: cracks and overlaps everywhere.
#[must_use]
pub fn cracked(mesh: &Mesh, distance: f64) -> Mesh {
    let mut random = Uniform::new(11);
    let mut cracked = Mesh::default();
    for triangle in 0..mesh.triangles.len() {
        let moved = corners(mesh, triangle)
            .map(|corner| corner + DVec3::from([0; 3].map(|_| random.between(-distance, distance))));
        add(&mut cracked, mesh.triangles[triangle].material, moved);
    }
    cracked
}

/// Some of the triangles turned over.
#[must_use]
pub fn turned_over(mut mesh: Mesh) -> Mesh {
    let mut random = Uniform::new(12);
    for triangle in &mut mesh.triangles {
        if random.next_f64() < 0.5 {
            triangle.corners.swap(0, 1);
        }
    }
    mesh
}

/// Every triangle twice, the second time with corners of its own.
#[must_use]
pub fn doubled(mesh: &Mesh) -> Mesh {
    let mut twice = mesh.clone();
    for triangle in 0..mesh.triangles.len() {
        add(&mut twice, mesh.triangles[triangle].material, corners(mesh, triangle));
    }
    twice
}

/// With a rectangle of the wall's own material, 1 m × 1 m, lying in the wall z = 0, 1 m from its corner.
#[must_use]
pub fn overlapped(mut mesh: Mesh) -> Mesh {
    let corner = |x: f64, y: f64| dvec3(1.0 + x, 1.0 + y, 0.0);
    add_quad(&mut mesh, 4, [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)]);
    mesh
}

/// Every triangle divided into needles: fans from a point `distance` [m] off the middle of its first side, and with them
/// as many triangles without any area.
#[must_use]
pub fn needled(mesh: &Mesh, distance: f64) -> Mesh {
    let mut needles = Mesh::default();
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = corners(mesh, triangle);
        let material = mesh.triangles[triangle].material;
        let middle = 0.5 * (a + b);
        let inner = middle + distance * (c - middle).normalize();
        for parts in [[a, b, inner], [b, c, inner], [c, a, inner], [a, middle, b], [c, c, a]] {
            add(&mut needles, material, parts);
        }
    }
    needles
}
