//! Specular paths among triangles, by trying every sequence of planes.
//!
//! Both ends are displaced by about a tenth of a millimetre before anything is decided, as the caller says: then no path meets
//! the rim of a triangle, and every decision is far enough from a tie that rounding cannot turn it. That is asserted.

use glam::DVec3;
use sonel_geometry::Mesh;

/// Displacement of the source [m].
const DISPLACEMENT: f64 = 1e-4;
/// What decides is at least this far from 0 [m, m²]; rounding errors are below 10⁻¹³.
const DECIDED: f64 = 1e-12;
/// Planes are one whose normals and offsets differ by no more than this [1, m].
const SAME_PLANE: f64 = 1e-9;

/// A path from a source over mirrors to a receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecularPath {
    /// Number of reflections.
    pub order: u32,
    /// The source's image in all mirrors, undisplaced [m].
    pub image: DVec3,
}

/// Triangles of one plane.
struct Wall {
    normal: DVec3,
    offset: f64,
    triangles: Vec<[DVec3; 3]>,
}

/// An end with its image, displaced and undisplaced [m].
#[derive(Clone, Copy)]
struct Place {
    displaced: DVec3,
    exact: DVec3,
}

/// Triangles as mirrors.
pub struct Mirrors {
    walls: Vec<Wall>,
}

impl Wall {
    fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    fn image(&self, point: DVec3) -> DVec3 {
        point - 2.0 * self.height(point) * self.normal
    }

    /// Where the way between two points crosses a triangle of the wall.
    fn crossing(&self, from: DVec3, to: DVec3) -> Option<DVec3> {
        let (before, behind) = (decided(self.height(from)), decided(self.height(to)));
        let point = from + (to - from) * (before / (before - behind));
        (before * behind < 0.0 && self.contains(point)).then_some(point)
    }

    fn contains(&self, point: DVec3) -> bool {
        let is_within = |[a, b, c]: &[DVec3; 3]| {
            let sides = [(a, b), (b, c), (c, a)];
            let turns = sides.map(|(from, to)| decided((*to - *from).cross(point - *from).dot(self.normal)));
            turns.iter().all(|&turn| turn > 0.0) || turns.iter().all(|&turn| turn < 0.0)
        };
        self.triangles.iter().any(is_within)
    }
}

/// A value whose sign decides.
fn decided(value: f64) -> f64 {
    assert!(value.abs() > DECIDED, "decided by rounding: {value:e}");
    value
}

impl Mirrors {
    /// The triangles of a mesh, as drawn.
    #[must_use]
    pub fn of(mesh: &Mesh) -> Self {
        Self::new(mesh.triangles.iter().map(|it| it.corners.map(|corner| mesh.vertices[corner as usize])))
    }

    /// The planes of some triangles.
    #[must_use]
    pub fn new(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> Self {
        let mut walls: Vec<Wall> = Vec::new();
        for triangle in triangles {
            let [a, b, c] = triangle;
            let normal = (b - a).cross(c - a).normalize();
            let offset = normal.dot(a);
            let is_same = |wall: &&mut Wall| {
                let [one, other] = [1.0, -1.0]
                    .map(|sign| wall.normal.distance(sign * normal) + (wall.offset - sign * offset).abs());
                one.min(other) <= SAME_PLANE
            };
            match walls.iter_mut().find(is_same) {
                Some(wall) => wall.triangles.push(triangle),
                None => walls.push(Wall { normal, offset, triangles: vec![triangle] }),
            }
        }
        Self { walls }
    }

    /// All paths of at most `order` reflections and a length of at most `longest` [m] between two places, displaced along `displacements`.
    #[must_use]
    pub fn paths(
        &self,
        [source, receiver]: [DVec3; 2],
        displacements: [DVec3; 2],
        order: u32,
        longest: f64,
    ) -> Vec<SpecularPath> {
        let scale = DISPLACEMENT / displacements[0].length();
        let [from, to] = [(source, displacements[0]), (receiver, displacements[1])]
            .map(|(exact, displacement)| Place { displaced: exact + scale * displacement, exact });
        let mut paths = Vec::new();
        let mut images = vec![from];
        self.search(&mut Vec::new(), &mut images, (to, order, longest), &mut paths);
        paths
    }

    /// Adds the path over the mirrors of `sequence`, and those over any mirrors more.
    fn search(
        &self,
        sequence: &mut Vec<usize>,
        images: &mut Vec<Place>,
        at: (Place, u32, f64),
        paths: &mut Vec<SpecularPath>,
    ) {
        let (receiver, order, longest) = at;
        let last = images[images.len() - 1];
        if last.exact.distance(receiver.exact) <= longest
            && self.is_path(sequence, images, receiver.displaced)
        {
            paths.push(SpecularPath { order: sequence.len() as u32, image: last.exact });
        }
        if sequence.len() as u32 == order {
            return;
        }
        for (index, wall) in self.walls.iter().enumerate() {
            if sequence.last() == Some(&index) {
                continue;
            }
            sequence.push(index);
            images.push(Place { displaced: wall.image(last.displaced), exact: wall.image(last.exact) });
            self.search(sequence, images, at, paths);
            sequence.pop();
            images.pop();
        }
    }

    /// Whether the path to `receiver` over a sequence of mirrors is there: each is met, from the side that the path leaves it on, and
    /// nothing is in between.
    fn is_path(&self, sequence: &[usize], images: &[Place], receiver: DVec3) -> bool {
        let mut points = vec![receiver];
        for (met, &wall) in sequence.iter().enumerate().rev() {
            let Some(point) = self.walls[wall].crossing(points[points.len() - 1], images[met + 1].displaced)
            else {
                return false;
            };
            points.push(point);
        }
        points.push(images[0].displaced);
        let mirror_at =
            |place: usize| sequence.len().checked_sub(place).and_then(|met| sequence.get(met)).copied();
        points.windows(2).enumerate().all(|(leg, ends)| {
            let at_ends = [mirror_at(leg), mirror_at(leg + 1)];
            let others = self.walls.iter().enumerate().filter(|(wall, _)| !at_ends.contains(&Some(*wall)));
            others.into_iter().all(|(_, wall)| wall.crossing(ends[0], ends[1]).is_none())
        })
    }
}
