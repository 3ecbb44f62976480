//! Rooms for tests and measurements.
#![allow(dead_code)] // each of the programs that include this file uses some of the rooms

use crate::numbers::Numbers;
use glam::{DVec3, dvec3};
use sonel_geometry::{Mesh, MeshTriangle};
use std::collections::HashMap;

/// Adds triangles of one material with corners given as positions.
pub(crate) fn add(mesh: &mut Mesh, material: u32, triangles: &[[DVec3; 3]]) {
    for triangle in triangles {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(triangle);
        mesh.triangles.push(MeshTriangle { corners: [first, first + 1, first + 2], material });
    }
}

pub(crate) fn add_quad(mesh: &mut Mesh, material: u32, [a, b, c, d]: [DVec3; 4]) {
    add(mesh, material, &[[a, b, c], [a, c, d]]);
}

/// A mesh moved and turned: walls in general position.
pub(crate) fn turned(mut mesh: Mesh, shift: DVec3) -> Mesh {
    let turn = glam::DQuat::from_xyzw(0.2, -0.3, 0.4, 0.8).normalize();
    for vertex in &mut mesh.vertices {
        *vertex = turn * *vertex + shift;
    }
    mesh
}

pub(crate) fn shoebox() -> Mesh {
    Mesh::shoebox([10.0, 7.0, 3.0], [0, 1, 2, 3, 4, 5])
}

/// A box of 12 n² triangles.
pub(crate) fn tessellated_box(size: DVec3, n: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let corner = Mesh::shoebox(size.to_array(), [0, 1, 2, 3, 4, 5]);
    for wall in 0..6 {
        let [a, b, c] = corner.triangles[2 * wall].corners.map(|i| corner.vertices[i as usize]);
        let d = a + c - b;
        // Weights of opposite walls are computed alike, so that shared vertices are the same to the bit.
        let at = |i: usize, j: usize| {
            let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
            (a + (b - a) * u) + (d - a) * v
        };
        for i in 0..n {
            for j in 0..n {
                add_quad(&mut mesh, wall as u32, [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    mesh
}

/// An L-shaped room: 8 × 8 m less a 5 × 5 m corner, 3 m high.
pub(crate) fn l_room() -> Mesh {
    let outline = [(0.0, 0.0), (8.0, 0.0), (8.0, 3.0), (3.0, 3.0), (3.0, 8.0), (0.0, 8.0)];
    let mut mesh = prism(&outline, 3.0);
    let at = |i: usize, z: f64| dvec3(outline[i].0, outline[i].1, z);
    for (z, up) in [(0.0, true), (3.0, false)] {
        for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]] {
            let [a, b, c] = if up { [a, b, c] } else { [a, c, b] }.map(|i| at(i, z));
            add(&mut mesh, 6, &[[a, b, c]]);
        }
    }
    mesh
}

/// A needle of a room: a triangle of 10 m with an acute corner, 3 m high.
pub(crate) fn wedge_room(degrees: f64) -> Mesh {
    let angle = degrees.to_radians();
    let outline = [(0.0, 0.0), (10.0, 0.0), (10.0 * angle.cos(), 10.0 * angle.sin())];
    let mut mesh = prism(&outline, 3.0);
    let at = |i: usize, z: f64| dvec3(outline[i].0, outline[i].1, z);
    add(&mut mesh, 6, &[[at(0, 0.0), at(1, 0.0), at(2, 0.0)], [at(0, 3.0), at(2, 3.0), at(1, 3.0)]]);
    mesh
}

/// The walls over an outline, a material each.
fn prism(outline: &[(f64, f64)], height: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for (i, &(x, y)) in outline.iter().enumerate() {
        let (u, v) = outline[(i + 1) % outline.len()];
        let wall = [dvec3(u, v, 0.0), dvec3(x, y, 0.0), dvec3(x, y, height), dvec3(u, v, height)];
        add_quad(&mut mesh, i as u32, wall);
    }
    mesh
}

/// The shoebox with a thin screen that stands on the floor in the middle, from 2 m to 5 m.
pub(crate) fn screened_room() -> Mesh {
    let mut mesh = shoebox();
    let screen = [dvec3(5.0, 2.0, 0.0), dvec3(5.0, 5.0, 0.0), dvec3(5.0, 5.0, 2.0), dvec3(5.0, 2.0, 2.0)];
    add_quad(&mut mesh, 6, screen);
    mesh
}

/// A box whose walls are each divided on their own: in every edge the vertices of one wall lie between the other's.
pub(crate) fn carelessly_drawn_box() -> Mesh {
    let size = dvec3(10.0, 7.0, 3.0);
    let mut mesh = Mesh::default();
    for (material, n) in [1, 3, 4, 5, 7, 16].into_iter().enumerate() {
        let wall = tessellated_box(size, n);
        for triangle in wall.triangles.iter().filter(|t| t.material == material as u32) {
            add(&mut mesh, material as u32, &[triangle.corners.map(|c| wall.vertices[c as usize])]);
        }
    }
    mesh
}

/// A sphere of radius 5 m from an icosahedron divided `depth` times, every vertex moved in or out by up to 10 %.
pub(crate) fn boulder(depth: u32) -> Mesh {
    sphere(depth, 0.1)
}

/// A geodesic sphere of radius 5 m, each radius changed by up to a share.
pub(crate) fn sphere(depth: u32, roughness: f64) -> Mesh {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut vertices: Vec<DVec3> = Vec::new();
    for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        vertices.extend([dvec3(a, b, 0.0), dvec3(0.0, a, b), dvec3(b, 0.0, a)]);
    }
    let edge = 2.0 + 1e-9;
    let near = |a: usize, b: usize| vertices[a].distance(vertices[b]) < edge;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    triangles.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    for _ in 0..depth {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut middle = |a: u32, b: u32, vertices: &mut Vec<DVec3>| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                vertices.push(0.5 * (vertices[a as usize] + vertices[b as usize]));
                vertices.len() as u32 - 1
            })
        };
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let (ab, bc, ca) =
                (middle(a, b, &mut vertices), middle(b, c, &mut vertices), middle(c, a, &mut vertices));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    let mut numbers = Numbers(7);
    let vertices = vertices
        .into_iter()
        .map(|v| v.normalize() * 5.0 * (1.0 + roughness * (2.0 * numbers.unit() - 1.0)))
        .collect();
    let triangles = triangles.into_iter().map(|corners| MeshTriangle { corners, material: 0 }).collect();
    Mesh { vertices, triangles }
}

/// A hall of 40 × 30 × 15 m with closed boxes of all sizes and turns in it, twelve triangles each.
pub(crate) fn furnished_hall(objects: usize) -> Mesh {
    let mut mesh = Mesh::shoebox([40.0, 30.0, 15.0], [0; 6]);
    let mut numbers = Numbers(11);
    for _ in 0..objects {
        let size = numbers.within(DVec3::splat(0.05), DVec3::splat(0.6));
        let axis = numbers.direction();
        let turn = glam::DQuat::from_xyzw(axis.x, axis.y, axis.z, 2.0 * numbers.unit()).normalize();
        let place = numbers.within(DVec3::splat(1.0), dvec3(39.0, 29.0, 14.0));
        let object = Mesh::shoebox(size.to_array(), [1; 6]);
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(object.vertices.iter().map(|&v| place + turn * v));
        let triangles = object.triangles.iter();
        mesh.triangles.extend(
            triangles.map(|t| MeshTriangle { corners: t.corners.map(|c| c + first), material: t.material }),
        );
    }
    mesh
}
