//! Writes the rooms of a consultant's work: a classroom, an open-plan office and a church, from plans of boxes.

mod church;
mod classroom;
mod office;

use anyhow::Result;
use xtask::workspace::{self, read, write};

use crate::quads::figures;
use crate::quads::grid::{Box3, Finish, Grid, Patch, Solid};
use crate::quads::mesh::QuadMesh;
use crate::quads::scene;

/// A room of boxes.
struct Plan {
    /// Title in the mesh file.
    title: &'static str,
    /// The mesh file, named from the root.
    mesh: &'static str,
    /// The scene file.
    scene: &'static str,
    /// The page with the figures; a room without one shares that of another.
    readme: Option<&'static str>,
    extent: Box3,
    shell: Finish,
    solids: Vec<Solid>,
    patches: Vec<Patch>,
    /// Position [m] of a corner of the grid.
    place: fn([i32; 3]) -> [f64; 3],
}

impl Plan {
    fn build(&self) -> QuadMesh {
        let grid = Grid::new(self.extent, self.shell, &self.solids, &self.patches);
        QuadMesh::weld(grid.faces(&self.patches), self.place)
    }

    fn obj(&self) -> String {
        self.build().to_obj(self.title, "rooms")
    }
}

/// Whole centimetres in metres.
fn centimetres(corner: [i32; 3]) -> [f64; 3] {
    corner.map(|length| f64::from(length) / 100.0)
}

fn plans() -> Vec<Plan> {
    let mut plans = vec![classroom::plan(), church::plan()];
    plans.extend(office::plans());
    plans
}

/// Rewrites the meshes and the figures.
pub(crate) fn run() -> Result<()> {
    for plan in plans() {
        write(plan.mesh, plan.obj())?;
        if let Some(readme) = plan.readme {
            let figures = figures::markdown(&plan.build(), &scene(plan.scene)?)?;
            write(readme, workspace::with_figures(&read(readme)?, &figures)?)?;
            print!("{}\n{figures}", plan.title);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quads::mesh::{open_edges, warp};

    #[test]
    fn checked_in_meshes_and_figures_are_the_computed_ones() {
        for plan in plans() {
            assert!(read(plan.mesh).unwrap() == plan.obj(), "run `cargo pages rooms`: {}", plan.mesh);
            if let Some(path) = plan.readme {
                let readme = read(path).unwrap();
                let figures = figures::markdown(&plan.build(), &scene(plan.scene).unwrap()).unwrap();
                let written = workspace::with_figures(&readme, &figures).unwrap();
                assert_eq!(readme, written, "run `cargo pages rooms`: {path}");
            }
        }
    }

    #[test]
    fn rooms_are_closed_and_faces_planar() {
        for plan in plans() {
            let mesh = plan.build();
            assert_eq!(open_edges(&mesh), 0, "{}", plan.title);
            let worst = mesh.quads.iter().map(|(quad, _)| warp(mesh.corners(quad))).fold(0.0, f64::max);
            assert!(worst < 1e-12, "{}: {worst:e} m", plan.title);
        }
    }

    /// The three offices differ in nothing but their screens.
    #[test]
    fn scenes_of_the_office_differ_in_name_mesh_and_screens() {
        let of = |path: &str| {
            let mut table: toml::Table = read(path).unwrap().parse().unwrap();
            let _ = (table.remove("name"), table.remove("mesh"));
            table["materials"].as_table_mut().unwrap().remove("screen");
            table
        };
        let [none, low, high] = office::SCENES;
        assert!(of(none) == of(low) && of(low) == of(high));
    }
}
