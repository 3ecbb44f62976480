//! Writes the concert hall of `scenes/hall`: mesh from the plan, figures from mesh and materials.

mod plan;
mod shape;

use anyhow::Result;

use crate::quads::grid::Grid;
use crate::quads::mesh::QuadMesh;
use crate::quads::{self, figures};
use xtask::workspace::{self, read, write};

const MESH: &str = "scenes/hall/hall.obj";
const SCENE: &str = "scenes/hall/scene.toml";
const README: &str = "scenes/hall/README.md";

/// Rewrites the mesh and the figures in the README.
pub(crate) fn run() -> Result<()> {
    let mesh = build();
    write(MESH, mesh.to_obj("Concert hall", "hall"))?;
    let figures = figures::markdown(&mesh, &quads::scene(SCENE)?)?;
    write(README, &workspace::with_figures(&read(README)?, &figures)?)?;
    print!("{figures}");
    Ok(())
}

fn build() -> QuadMesh {
    let extent = [(-plan::HALF_WIDTH, plan::HALF_WIDTH), (0, plan::LENGTH), (0, plan::CEILING)];
    let (solids, patches) = (plan::solids(), plan::patches());
    QuadMesh::weld(Grid::new(extent, plan::SHELL, &solids, &patches).faces(&patches), shape::place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quads::mesh::{cross, dot, length, open_edges, sub, warp};

    #[test]
    fn checked_in_mesh_is_the_generated_one() {
        assert!(
            read(MESH).unwrap() == build().to_obj("Concert hall", "hall"),
            "run `cargo pages hall` and commit {MESH}"
        );
    }

    #[test]
    fn figures_in_the_readme_are_the_computed_ones() {
        let readme = read(README).unwrap();
        let figures = figures::markdown(&build(), &quads::scene(SCENE).unwrap()).unwrap();
        assert_eq!(readme, workspace::with_figures(&readme, &figures).unwrap(), "run `cargo pages hall`");
    }

    #[test]
    fn every_quad_is_planar() {
        let mesh = build();
        let worst = mesh.quads.iter().map(|(quad, _)| warp(mesh.corners(quad))).fold(0.0, f64::max);
        assert!(worst < 1e-12, "{worst:e} m");
    }

    #[test]
    fn a_warped_quad_is_noticed() {
        let skew = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1e-6]];
        assert!(warp(skew) > 1e-7);
    }

    #[test]
    fn mesh_is_a_closed_manifold() {
        assert_eq!(open_edges(&build()), 0);
    }

    #[test]
    fn a_missing_quad_and_a_flipped_quad_are_noticed() {
        let mut holed = build();
        holed.quads.pop();
        assert_eq!(open_edges(&holed), 4);
        let mut flipped = build();
        flipped.quads[0].0.reverse();
        assert_eq!(open_edges(&flipped), 4);
    }

    #[test]
    fn normals_point_into_the_air() {
        let volume = build().volume();
        assert!((8_000.0..12_000.0).contains(&volume), "{volume} m³");
    }

    #[test]
    fn no_positions_coincide_after_shaping() {
        let mut vertices = build().vertices;
        let count = vertices.len();
        vertices.sort_by(|a, b| a.partial_cmp(b).unwrap());
        vertices.dedup();
        assert_eq!(vertices.len(), count);
    }

    #[test]
    fn source_and_receivers_stand_clear_of_surfaces_above_their_floors() {
        let scene: toml::Table = read(SCENE).unwrap().parse().unwrap();
        let triangles: Vec<_> = build().triangles().map(|(t, _)| t).collect();
        for (kind, height) in [("sources", 1.5), ("receivers", 1.2)] {
            for entry in scene[kind].as_array().unwrap() {
                let values = entry["position"].as_array().unwrap();
                let at: [f64; 3] = std::array::from_fn(|i| values[i].as_float().unwrap());
                let clearance = triangles.iter().map(|t| distance(at, *t)).fold(f64::INFINITY, f64::min);
                assert!(clearance >= 0.4, "{}: {clearance} m from a surface", entry["name"]);
                let floors = floors_below(at, &triangles);
                // Straight down is the floor itself or the top of a block of seats, 0.6 m above its floor.
                assert!(
                    [height, height - 0.6].iter().any(|h| (floors - h).abs() < 1e-9),
                    "{}: {floors} m above what is below",
                    entry["name"]
                );
            }
        }
    }

    /// Height [m] of a point above the highest upward-facing triangle below it.
    fn floors_below(at: [f64; 3], triangles: &[[[f64; 3]; 3]]) -> f64 {
        let inside = |t: &[[f64; 3]; 3]| {
            (0..3).all(|i| {
                let (p, q) = (t[i], t[(i + 1) % 3]);
                (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0]) >= 0.0
            }) && cross(sub(t[1], t[0]), sub(t[2], t[0]))[2] > 0.0
        };
        let heights = triangles.iter().filter(|t| inside(t)).map(|t| at[2] - t[0][2]);
        heights.filter(|h| *h > 0.0).fold(f64::INFINITY, f64::min)
    }

    /// Distance [m] of a point from a triangle: from its interior, or from the nearest side.
    fn distance(at: [f64; 3], t: [[f64; 3]; 3]) -> f64 {
        let normal = cross(sub(t[1], t[0]), sub(t[2], t[0]));
        let sides = (0..3).map(|i| (t[i], sub(t[(i + 1) % 3], t[i])));
        let above = sides.clone().all(|(p, side)| dot(cross(side, sub(at, p)), normal) >= 0.0);
        if above {
            return dot(sub(at, t[0]), normal).abs() / length(normal);
        }
        sides
            .map(|(p, side)| {
                let along = (dot(sub(at, p), side) / dot(side, side)).clamp(0.0, 1.0);
                length(sub(at, std::array::from_fn(|i| p[i] + along * side[i])))
            })
            .fold(f64::INFINITY, f64::min)
    }
}
