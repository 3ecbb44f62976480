//! Receivers above an audience: a lattice over the faces of named materials.
//!
//! The lattice is square as seen along the scene's vertical, with its first point half a spacing inside the bounds of the faces. Above every
//! point of a face on it a receiver stands at a height, along the vertical. Vertical faces have none. A point with another face between it and
//! its receiver is below that face, like the floor under a table.

use glam::{DVec2, DVec3};
use sonel_geometry::Geometry;
use sonel_renderer::ReceiverPoint;
use sonel_scene::Scene;

use crate::names::place;
use crate::{Error, Result};

/// Width of the rim of a face that counts as it [m]: positions in feet or of single precision are off by less, and the cracks of that width
/// are closed by default.
const RIM: f64 = 1e-3;
/// A response of so many receivers would take tens of gigabytes.
pub(super) const MOST_POINTS: f64 = 1e5;

/// Receivers above every face of some materials.
#[derive(Debug, Clone, PartialEq)]
pub struct Audience {
    /// Names of the materials; one or more.
    pub materials: Vec<String>,
    /// Horizontal distance of neighbours along both axes of the lattice [m], above 0.
    pub spacing: f64,
    /// Height above the face, along the vertical [m], above 0.
    pub height: f64,
}

impl Audience {
    /// Above `material`, 1.2 m high and 1 m apart.
    #[must_use]
    pub fn of(materials: Vec<String>) -> Self {
        Self { materials, spacing: 1.0, height: 1.2 }
    }

    /// What is wrong with it apart from any scene.
    pub(super) fn problem(&self) -> Option<String> {
        let positive = |number: f64| number.is_finite() && number > 0.0;
        if self.materials.is_empty() {
            return Some("`audience` names no material: give one or more".to_owned());
        }
        let wrong = [("spacing", self.spacing), ("height", self.height)];
        let (name, value) = wrong.into_iter().find(|(_, value)| !positive(*value))?;
        Some(format!("`{name}` {value} m is not a length: give one above 0 m, such as 1.2"))
    }

    /// Receivers named after their material and without numbers, row by row, and how many points are below another face.
    ///
    /// # Errors
    /// A material that the scene does not have; no point; more than 100 000 of them.
    pub(super) fn points(&self, scene: &Scene, geometry: &Geometry) -> Result<(Vec<ReceiverPoint>, usize)> {
        let (mut points, mut below) = (Vec::new(), 0);
        for name in &self.materials {
            let known = scene.materials.iter().map(|material| material.name.as_str());
            let material = place(known, name, "`audience`: the scene has no material")?;
            let lattice = Lattice::over(scene.up, material as u32, geometry, self.spacing)
                .ok_or_else(|| Error::refused(format!("`audience`: no face is of \"{name}\"")))?;
            let columns = lattice.columns();
            if columns > MOST_POINTS {
                return Err(Error::refused(format!(
                    "`spacing` {} m divides the faces of \"{name}\" into {columns} columns, more than {MOST_POINTS}: give a wider one",
                    self.spacing
                )));
            }
            let (found, hidden) = lattice.places(geometry, self.height);
            if found.is_empty() && hidden == 0 {
                return Err(Error::refused(format!(
                    "`audience`: no point of a lattice of {} m is on a face of \"{name}\" that is not vertical: give a smaller `spacing`",
                    self.spacing
                )));
            }
            below += hidden;
            points.extend(found.into_iter().map(|place| ReceiverPoint::omni(name, place)));
        }
        Ok((points, below))
    }
}

/// Columns along the vertical over the faces of a material.
struct Lattice {
    /// Two horizontal axes and the vertical.
    axes: [DVec3; 3],
    material: u32,
    spacing: f64,
    /// Coordinates of the first column [m], and numbers of columns along both axes.
    first: [f64; 2],
    counts: [f64; 2],
}

/// A face above or below a point of a column.
struct Crossing {
    height: f64,
    is_seat: bool,
}

impl Lattice {
    /// None without a face of `material`.
    fn over(up: DVec3, material: u32, geometry: &Geometry, spacing: f64) -> Option<Self> {
        // The vertical is an axis in every scene but turned ones: the plan then keeps the scene's axes.
        let along = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().find(|axis| axis.dot(up).abs() < 0.5)?;
        let across = along.reject_from(up).normalize();
        let axes = [across, up.cross(across), up];
        let mesh = geometry.mesh();
        let of_material = (0..).zip(&mesh.triangles).filter(|(_, triangle)| triangle.material == material);
        let plan = |corner: DVec3| DVec2::new(corner.dot(axes[0]), corner.dot(axes[1]));
        let corners = || of_material.clone().flat_map(|(index, _)| mesh.corners(index)).map(plan);
        let (low, high) = (corners().reduce(DVec2::min)?, corners().reduce(DVec2::max)?);
        // Centred, so that the margins on both sides are equal.
        let counts = ((high - low + RIM) / spacing).floor().max(DVec2::ONE);
        let first = 0.5 * (low + high) - 0.5 * spacing * (counts - 1.0);
        Some(Self { axes, material, spacing, first: first.to_array(), counts: counts.to_array() })
    }

    fn columns(&self) -> f64 {
        self.counts[0] * self.counts[1]
    }

    /// Places of receivers, row by row and upward in each column, and the number of points below another face.
    fn places(&self, geometry: &Geometry, height: f64) -> (Vec<DVec3>, usize) {
        let [across, away] = self.counts.map(|count| count as usize);
        let clearance = geometry.clearance().max(2.0 * RIM);
        let mut columns: Vec<Vec<Crossing>> = (0..across * away).map(|_| Vec::new()).collect();
        let mesh = geometry.mesh();
        for (index, triangle) in (0u32..).zip(&mesh.triangles) {
            self.cross(mesh.corners(index), triangle.material == self.material, &mut columns);
        }
        let (mut places, mut below) = (Vec::new(), 0);
        for (index, mut column) in columns.into_iter().enumerate() {
            column.sort_by(|a, b| a.height.total_cmp(&b.height));
            let [x, y] = self.column([index % across, index / across]);
            let mut last = f64::NEG_INFINITY;
            for seat in column.iter().filter(|crossing| crossing.is_seat) {
                // A point on an edge lies on both of its faces.
                if seat.height - last < clearance {
                    continue;
                }
                last = seat.height;
                let between = seat.height + clearance..seat.height + height;
                if column.iter().any(|other| between.contains(&other.height)) {
                    below += 1;
                } else {
                    places.push(x * self.axes[0] + y * self.axes[1] + (seat.height + height) * self.axes[2]);
                }
            }
        }
        (places, below)
    }

    /// Horizontal coordinates of a column [m].
    fn column(&self, at: [usize; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.first[axis] + self.spacing * at[axis] as f64)
    }

    /// Adds the heights at which columns cross a triangle.
    fn cross(&self, corners: [DVec3; 3], is_seat: bool, columns: &mut [Vec<Crossing>]) {
        let [a, b, c] = corners.map(|corner| self.axes.map(|axis| corner.dot(axis)));
        let area = |p: [f64; 2], q: [f64; 3], r: [f64; 3]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let whole = area([a[0], a[1]], b, c);
        // Vertical, or so steep that its height at a point is rounding: seen from above it has no area.
        let length = |end: [f64; 3]| DVec3::from_array(end).distance(DVec3::from_array(a));
        if whole.abs() <= 1e-9 * length(b) * length(c) {
            return;
        }
        let range = |axis: usize| {
            let low = a[axis].min(b[axis]).min(c[axis]);
            let high = a[axis].max(b[axis]).max(c[axis]);
            let index = |coordinate: f64| (coordinate - self.first[axis]) / self.spacing;
            let first = index(low - RIM).ceil().max(0.0);
            let end = (index(high + RIM).floor() + 1.0).clamp(0.0, self.counts[axis]);
            first as usize..end as usize
        };
        let across = self.counts[0] as usize;
        for j in range(1) {
            for i in range(0) {
                let point = self.column([i, j]);
                let shares =
                    [area(point, b, c), area(point, c, a), area(point, a, b)].map(|part| part / whole);
                // The share at a corner falls to 0 over the height above the opposite side.
                let is_within = |(share, [from, to]): (&f64, [[f64; 3]; 2])| {
                    let side = libm::hypot(to[0] - from[0], to[1] - from[1]);
                    share * whole.abs() >= -RIM * side
                };
                if shares.iter().zip([[b, c], [c, a], [a, b]]).all(is_within) {
                    let height = shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2];
                    columns[j * across + i].push(Crossing { height, is_seat });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_geometry::{Mesh, MeshTriangle};

    /// A ramp of material 1 that rises by a half, in a room of material 0, with a plate of material 2 over its lower half.
    fn ramp() -> Geometry {
        let mut mesh = Mesh::shoebox([10.0, 6.0, 9.0], [0; 6]);
        let mut quad = |corners: [[f64; 3]; 4], material: u32| {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(corners.map(DVec3::from_array));
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                mesh.triangles.push(MeshTriangle { corners: [first + a, first + b, first + c], material });
            }
        };
        quad([[1.0, 1.0, 1.0], [9.0, 1.0, 5.0], [9.0, 5.0, 5.0], [1.0, 5.0, 1.0]], 1);
        quad([[1.0, 1.0, 1.9], [5.0, 1.0, 3.9], [5.0, 5.0, 3.9], [1.0, 5.0, 1.9]], 2);
        Geometry::build(mesh).unwrap()
    }

    #[test]
    fn receivers_follow_a_slope_and_a_low_ceiling_leaves_them_out() {
        let geometry = ramp();
        let lattice = Lattice::over(DVec3::Z, 1, &geometry, 1.0).unwrap();
        let (places, below) = lattice.places(&geometry, 1.2);
        // 8 x 4 columns; the plate, 0.9 m over the ramp, hides those of x below 5.
        assert_eq!((places.len(), below), (16, 16));
        for place in &places {
            assert!((place.z - (1.0 + 0.5 * (place.x - 1.0) + 1.2)).abs() < 1e-9, "{place}");
        }
        assert!(places[0].distance(DVec3::new(5.5, 1.5, 4.45)) < 1e-9, "{}", places[0]);
        let (seated, below) = lattice.places(&geometry, 0.8);
        assert_eq!((seated.len(), below), (32, 0));
    }

    #[test]
    fn a_lattice_through_shared_edges_and_corners_counts_each_point_once() {
        let geometry = Geometry::build(Mesh::shoebox([3.0, 3.0, 3.0], [0, 0, 0, 0, 1, 0])).unwrap();
        // Three by three columns, those of the diagonal on the edge of both triangles.
        let lattice = Lattice::over(DVec3::Z, 1, &geometry, 1.0).unwrap();
        assert_eq!(lattice.places(&geometry, 1.2).0.len(), 9);
    }

    #[test]
    fn seats_do_not_depend_on_the_unit() {
        for unit in [1.0, 0.3048, 0.0254, 0.001] {
            let mut mesh = Mesh::shoebox([12.0, 8.0, 3.0], [0, 0, 0, 0, 1, 0]);
            // As written with three decimals.
            mesh.vertices.iter_mut().for_each(|vertex| *vertex = (*vertex / unit * 1e3).round() / 1e3 * unit);
            let geometry = Geometry::build(mesh).unwrap();
            let lattice = Lattice::over(DVec3::Z, 1, &geometry, 1.0).unwrap();
            let (places, below) = lattice.places(&geometry, 1.2);
            assert_eq!((places.len(), below), (96, 0), "{unit} m");
        }
    }

    #[test]
    fn in_a_turned_scene_up_stays_up() {
        let geometry = Geometry::build(Mesh::shoebox([3.0, 4.0, 2.5], [0, 0, 1, 0, 0, 0])).unwrap();
        let lattice = Lattice::over(DVec3::Y, 1, &geometry, 1.0).unwrap();
        let (places, _) = lattice.places(&geometry, 1.2);
        assert_eq!(places.len(), 6);
        assert!(places.iter().all(|place| (place.y - 1.2).abs() < 1e-12));
    }
}
