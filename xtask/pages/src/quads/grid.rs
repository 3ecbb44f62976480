//! A rectilinear grid of solid and air cells, and the quads between them.
//!
//! Every grid line runs through the whole grid and every face is one quad of it, so neighbouring faces share whole edges: the
//! surface has no T-junctions and is closed by construction.

/// Materials of a solid's faces by the way they look; names are those of the scene file.
#[derive(Clone, Copy)]
pub(crate) struct Finish {
    pub top: &'static str,
    pub side: &'static str,
    pub bottom: &'static str,
}

impl Finish {
    /// One material on all sides.
    pub(crate) const fn all(material: &'static str) -> Self {
        Self { top: material, side: material, bottom: material }
    }
}

/// A box, `[lo, hi]` per axis, in the unit of the grid.
pub(crate) type Box3 = [(i32, i32); 3];

/// A solid box; later ones are painted over earlier ones.
pub(crate) struct Solid {
    pub extent: Box3,
    pub finish: Finish,
}

/// A box without thickness: faces that lie in it get another material (doors, panelling).
pub(crate) struct Patch {
    pub extent: Box3,
    pub material: &'static str,
}

/// A quad between solid and air: corners on the grid, counter-clockwise seen from the air.
pub(crate) struct Face {
    pub corners: [[i32; 3]; 4],
    pub material: &'static str,
}

/// Cells inside the lines' extent, air unless painted; everything outside is the shell.
pub(crate) struct Grid {
    lines: [Vec<i32>; 3],
    cells: Vec<Option<Finish>>,
    shell: Finish,
}

impl Grid {
    /// Cuts the space `extent` at every bound of `solids` and `patches`, then paints the solids in order.
    pub(crate) fn new(extent: Box3, shell: Finish, solids: &[Solid], patches: &[Patch]) -> Self {
        let lines = std::array::from_fn(|axis| lines_along(axis, extent, solids, patches));
        let count = lines.iter().map(|l: &Vec<i32>| l.len() - 1).product();
        let mut grid = Self { lines, cells: vec![None; count], shell };
        for solid in solids {
            grid.paint(solid);
        }
        grid
    }

    /// Every face between a solid and an air cell.
    pub(crate) fn faces(&self, patches: &[Patch]) -> Vec<Face> {
        let [nx, ny, nz] = self.counts();
        let mut faces = Vec::new();
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    if self.solid([i, j, k]).is_none() {
                        self.faces_about([i, j, k], patches, &mut faces);
                    }
                }
            }
        }
        faces
    }

    fn faces_about(&self, air: [i32; 3], patches: &[Patch], faces: &mut Vec<Face>) {
        for axis in 0..3 {
            for step in [-1, 1] {
                let mut neighbour = air;
                neighbour[axis] += step;
                let Some(finish) = self.solid(neighbour) else { continue };
                let corners = self.corners(air, axis, step);
                let material =
                    patches.iter().find(|p| covers(&p.extent, &corners)).map(|p| p.material).unwrap_or(
                        match (axis, step) {
                            (2, -1) => finish.top,
                            (2, _) => finish.bottom,
                            _ => finish.side,
                        },
                    );
                faces.push(Face { corners, material });
            }
        }
    }

    /// The face of cell `air` towards `step` along `axis`, wound so that its normal points back into the cell.
    fn corners(&self, air: [i32; 3], axis: usize, step: i32) -> [[i32; 3]; 4] {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let around =
            if step < 0 { [(0, 0), (1, 0), (1, 1), (0, 1)] } else { [(0, 0), (0, 1), (1, 1), (1, 0)] };
        around.map(|(du, dv)| {
            let mut index = air;
            index[axis] += i32::from(step > 0);
            index[u] += du;
            index[v] += dv;
            std::array::from_fn(|a| self.lines[a][index[a] as usize])
        })
    }

    fn counts(&self) -> [i32; 3] {
        std::array::from_fn(|axis| self.lines[axis].len() as i32 - 1)
    }

    fn solid(&self, cell: [i32; 3]) -> Option<Finish> {
        let n = self.counts();
        if (0..3).any(|a| cell[a] < 0 || cell[a] >= n[a]) {
            return Some(self.shell);
        }
        self.cells[self.index(cell)]
    }

    fn index(&self, [i, j, k]: [i32; 3]) -> usize {
        let [nx, ny, _] = self.counts();
        ((k * ny + j) * nx + i) as usize
    }

    fn paint(&mut self, solid: &Solid) {
        let range = |axis: usize| {
            let (lo, hi) = solid.extent[axis];
            let at = |bound| self.lines[axis].binary_search(&bound).expect("bounds of solids are grid lines");
            at(lo) as i32..at(hi) as i32
        };
        let (xs, ys, zs) = (range(0), range(1), range(2));
        for k in zs {
            for j in ys.clone() {
                for i in xs.clone() {
                    let cell = self.index([i, j, k]);
                    self.cells[cell] = Some(solid.finish);
                }
            }
        }
    }
}

fn lines_along(axis: usize, extent: Box3, solids: &[Solid], patches: &[Patch]) -> Vec<i32> {
    let bounds = solids.iter().map(|s| s.extent).chain(patches.iter().map(|p| p.extent)).chain([extent]);
    let mut lines: Vec<i32> = bounds.flat_map(|b| [b[axis].0, b[axis].1]).collect();
    lines.sort_unstable();
    lines.dedup();
    lines
}

fn covers(extent: &Box3, corners: &[[i32; 3]; 4]) -> bool {
    corners.iter().all(|c| (0..3).all(|a| extent[a].0 <= c[a] && c[a] <= extent[a].1))
}
