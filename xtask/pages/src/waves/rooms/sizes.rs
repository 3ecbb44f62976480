//! Twenty rooms of 21 to 5184 m³, bare and furnished, with even and uneven absorption.
//!
//! Furniture are blocks of the walls' material. Surfaces scatter as `sonel-trace check` advises, with s = 0.1 where it advises nothing. All lengths
//! are multiples of the solver's cell.

use std::fmt::Write;

use anyhow::{Result, anyhow};

use super::{BANDS, Mesh, Room};

/// Corner and opposite corner of a block [m].
pub(super) type Block = [[f64; 3]; 2];

/// A room on a floor plan of rectangles.
pub(super) struct Plan {
    pub name: String,
    /// Inner size [m].
    pub size: [f64; 3],
    /// α of walls, floor and ceiling.
    pub absorption: [f64; 3],
    /// Blocks from floor to ceiling that the plan lacks, flush with its walls: an L-shape, or the wall beside a door.
    pub solid: Vec<Block>,
    pub furniture: Vec<Block>,
    /// [s].
    pub duration: f64,
}

/// `count` blocks of `size` [m] in rows along x and y from `first` [m], `pitch` [m] apart.
pub(super) fn rows(first: [f64; 3], size: [f64; 3], pitch: [f64; 2], count: [u32; 2]) -> Vec<Block> {
    let place =
        |i: u32, j: u32| [first[0] + f64::from(i) * pitch[0], first[1] + f64::from(j) * pitch[1], first[2]];
    let block = |from: [f64; 3]| [from, [0, 1, 2].map(|axis| from[axis] + size[axis])];
    (0..count[0]).flat_map(|i| (0..count[1]).map(move |j| block(place(i, j)))).collect()
}

pub(super) fn plan(name: &str, size: [f64; 3], absorption: [f64; 3], duration: f64) -> Plan {
    let (solid, furniture) = (Vec::new(), Vec::new());
    Plan { name: name.to_owned(), size, absorption, solid, furniture, duration }
}

fn plans() -> Vec<Plan> {
    let study = [[[0.5, 2.0, 0.0], [2.0, 2.75, 0.75]], [[4.0, 0.25, 0.0], [4.5, 1.75, 2.0]]];
    let l_shape = vec![[[7.0, 0.0, 0.0], [12.0, 4.0, 3.5]]];
    let shelves = rows([1.0, 7.0, 0.0], [3.0, 0.5, 2.0], [4.0, 1.0], [2, 1]);
    // A wall of 0.25 m with a door of 1 m × 2 m.
    let walls = vec![
        [[6.0, 0.0, 0.0], [6.25, 2.0, 3.0]],
        [[6.0, 3.0, 0.0], [6.25, 5.0, 3.0]],
        [[6.0, 2.0, 2.0], [6.25, 3.0, 3.0]],
    ];
    vec![
        plan("booth", [3.5, 2.5, 2.375], [0.1; 3], 1.6),
        Plan { furniture: study.to_vec(), ..plan("study", [4.5, 3.5, 2.625], [0.08, 0.2, 0.08], 1.6) },
        plan("box", [6.25, 4.5, 2.75], [0.06, 0.06, 0.4], 3.0),
        Plan {
            furniture: rows([1.0, 1.0, 0.0], [1.25, 0.5, 0.75], [2.0, 1.5], [4, 4]),
            ..plan("classroom", [9.0, 7.0, 3.0], [0.06, 0.06, 0.5], 3.0)
        },
        Plan { solid: walls, ..plan("coupled-pair", [14.0, 5.0, 3.0], [0.1, 0.1, 0.2], 2.5) },
        Plan {
            solid: l_shape,
            furniture: shelves,
            ..plan("l-shape", [12.0, 8.0, 3.5], [0.1, 0.1, 0.1], 2.5)
        },
        Plan {
            furniture: rows([1.5, 1.5, 0.0], [1.5, 0.75, 0.75], [2.5, 2.0], [5, 4]),
            ..plan("canteen", [15.0, 11.0, 3.5], [0.06, 0.06, 0.5], 3.5)
        },
        Plan {
            furniture: rows([2.0, 1.5, 0.0], [1.5, 1.0, 1.5], [3.5, 3.0], [4, 3]),
            ..plan("furnished-box", [16.0, 10.0, 5.0], [0.1, 0.1, 0.3], 3.0)
        },
        plan("gym", [20.0, 12.0, 7.0], [0.12, 0.12, 0.12], 3.5),
        Plan {
            furniture: rows([6.0, 2.0, 0.0], [0.75, 6.0, 1.0], [1.75, 8.0], [8, 2]),
            ..plan("theatre", [24.0, 18.0, 12.0], [0.1, 0.4, 0.1], 4.5)
        },
    ]
}

/// Rooms with a ceiling, in one case a floor, that absorbs more than the walls.
fn one_sided() -> Vec<Plan> {
    let tables = |pitch, count| rows([1.5, 1.5, 0.0], [1.5, 0.75, 0.75], pitch, count);
    vec![
        plan("flat", [20.0, 14.0, 3.0], [0.06, 0.06, 0.6], 4.0),
        Plan {
            furniture: tables([3.0, 2.5], [6, 5]),
            ..plan("open-office", [20.0, 14.0, 3.0], [0.06, 0.06, 0.6], 4.0)
        },
        plan("aisle", [20.0, 2.5, 3.0], [0.06, 0.06, 0.5], 4.0),
        plan("hangar", [20.0, 12.0, 7.0], [0.08, 0.08, 0.5], 4.0),
        Plan {
            furniture: rows([1.0, 1.0, 0.0], [1.25, 0.5, 0.75], [2.5, 1.5], [3, 3]),
            ..plan("lesson", [8.0, 6.0, 3.25], [0.06, 0.06, 0.4], 4.0)
        },
        Plan {
            furniture: rows([1.0, 1.0, 0.0], [2.0, 0.75, 0.75], [5.0, 3.5], [2, 2]),
            ..plan("lounge", [10.0, 7.0, 2.75], [0.06, 0.06, 0.7], 4.0)
        },
        plan("carpet", [8.0, 7.0, 3.0], [0.06, 0.3, 0.06], 4.0),
        plan("long", [24.0, 6.0, 4.0], [0.06, 0.06, 0.35], 4.0),
        Plan {
            furniture: tables([2.5, 2.5], [5, 4]),
            ..plan("call", [15.0, 12.0, 2.75], [0.06, 0.15, 0.8], 4.0)
        },
        plan("sports", [24.0, 14.0, 6.0], [0.06, 0.06, 0.7], 4.0),
    ]
}

pub(super) fn all() -> Result<Vec<Room>> {
    plans().into_iter().chain(one_sided()).map(Plan::room).collect()
}

impl Plan {
    /// The room, with the scattering that is advised.
    pub(super) fn room(self) -> Result<Room> {
        let obj = self.mesh().text;
        let checkup =
            sonel_scene::checkup::check(&self.toml([0.1; 3]), &self.name, &mut |_| Ok(obj.clone().into()));
        let notes = checkup.map_err(|problems| anyhow!("{problems}"))?.notes;
        let advice = notes.iter().find_map(|note| note.split_once("scattering of all surfaces is at least "));
        let of_band = |band: &f64| {
            let named = advice.into_iter().flat_map(|(_, list)| list.split(", "));
            let mut named = named.filter_map(|it| it.split_once(&format!(" at {band} Hz")));
            named.next().map_or(Ok(0.1), |(s, _)| s.parse())
        };
        let scattering = BANDS.iter().map(of_band).collect::<Result<Vec<f64>, _>>()?;
        let toml = self.toml([scattering[0], scattering[1], scattering[2]]);
        Ok(Room { name: self.name, bands: BANDS, packets: "4k", toml, obj })
    }

    fn toml(&self, scattering: [f64; 3]) -> String {
        let mut text = format!(
            "mesh = \"hall.obj\"\nduration_s = {}\n\n[bands]\ncenter_frequencies_hz = [63, 125, 250]\n\n[air]\nattenuation = false\n",
            self.duration
        );
        for (name, absorption) in ["walls", "floor", "ceiling"].into_iter().zip(self.absorption) {
            let _ = write!(
                text,
                "\n[materials.{name}]\nabsorption = {absorption}\nscattering = {scattering:?}\n"
            );
        }
        let place = |[x, y, z]: [f64; 3]| {
            let [a, b, c] = self.size;
            format!("[{:.3}, {:.3}, {:.3}]", x * a, y * b, z * c)
        };
        for at in [[0.17, 0.31, 0.56], [0.12, 0.64, 0.71], [0.55, 0.8, 0.3], [0.92, 0.57, 0.66]] {
            let _ = write!(text, "\n[[sources]]\nposition = {}\n", place(at));
        }
        for at in [
            [0.33, 0.72, 0.41],
            [0.41, 0.62, 0.64],
            [0.27, 0.83, 0.55],
            [0.38, 0.58, 0.37],
            [0.68, 0.63, 0.62],
            [0.81, 0.77, 0.43],
            [0.74, 0.59, 0.68],
            [0.86, 0.66, 0.51],
        ] {
            let _ = write!(text, "\n[[receivers]]\nposition = {}\n", place(at));
        }
        text
    }

    /// The faces between air and what is none: of the grid of all planes of blocks.
    fn mesh(&self) -> Mesh {
        let blocks: Vec<&Block> = self.solid.iter().chain(&self.furniture).collect();
        let planes = [0, 1, 2].map(|axis| {
            let ends = blocks.iter().flat_map(|block| block.iter().map(|corner| corner[axis]));
            let mut planes: Vec<f64> = ends.chain([0.0, self.size[axis]]).collect();
            planes.sort_by(f64::total_cmp);
            planes.dedup();
            planes
        });
        let is_air = |middle: [f64; 3]| {
            let is_in = |from: &[f64; 3], to: &[f64; 3]| {
                (0..3).all(|axis| from[axis] < middle[axis] && middle[axis] < to[axis])
            };
            is_in(&[0.0; 3], &self.size) && !blocks.iter().any(|[from, to]| is_in(from, to))
        };
        let mut mesh = Mesh::default();
        for axis in 0..3 {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            for &at in &planes[axis] {
                for (i, j) in (1..planes[u].len()).flat_map(|i| (1..planes[v].len()).map(move |j| (i, j))) {
                    let [low, high] = [[planes[u][i - 1], planes[v][j - 1]], [planes[u][i], planes[v][j]]];
                    let corner = |[along, across]: [f64; 2]| {
                        let mut corner = [at; 3];
                        (corner[u], corner[v]) = (along, across);
                        corner
                    };
                    let beside = |step: f64| {
                        let mut middle = corner([0, 1].map(|side| 0.5 * (low[side] + high[side])));
                        middle[axis] += step;
                        is_air(middle)
                    };
                    if beside(-0.0625) == beside(0.0625) {
                        continue;
                    }
                    let material = match axis {
                        2 if at <= 0.0 => "floor",
                        2 if at >= self.size[2] => "ceiling",
                        _ => "walls",
                    };
                    let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
                    mesh.add_quad(corners.map(corner), material);
                }
            }
        }
        mesh
    }
}
