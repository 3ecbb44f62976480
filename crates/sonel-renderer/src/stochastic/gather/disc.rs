//! The part of a disc that lies on a planar surface and is seen from its centre.
//!
//! With the centre on the surface, the clipped area is that of the whole disc plus, for every edge of the surface's boundary that
//! enters it, the triangle over the chord minus the sector over the same angle. Edges further away change nothing,
//! so the cost is that of finding near edges, whatever the shape: holes and notches come out right by orientation.
//!
//! A thin wall that stands on the surface divides what is one surface to the map. Its foot hides a part of the disc, which neither counts as
//! area nor gathers: sound does not pass under walls. [`View`] holds the feet that do hide something; most discs have none.

use core::f64::consts::FRAC_1_SQRT_2;
use glam::{DVec2, DVec3};
use sonel_geometry::{Geometry, Hit, Side, SurfaceId};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use super::visible::{Segment, distance_to, visible_area};

/// A surface laid out in its plane.
#[derive(Debug, Clone)]
pub(crate) struct Sheet {
    surface: SurfaceId,
    origin: DVec3,
    across: DVec3,
    along: DVec3,
    /// Found for the first disc: rays meet few of a million surfaces.
    outline: OnceLock<Outline>,
}

/// Borders of a sheet.
#[derive(Debug, Clone)]
struct Outline {
    /// Boundary edges with the surface on their left, seen from the front.
    boundary: Vec<Segment>,
    /// Feet of walls that stand on the front and on the back and could hide a part of the surface from another.
    feet: [Vec<Segment>; 2],
}

/// A disc in which sonels are gathered.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Disc {
    /// Surface and side, as `super::rays::place` numbers them.
    pub place: u32,
    /// Centre in the plane of the surface [m].
    pub centre: DVec2,
    /// Radius [m].
    pub radius: f64,
    /// Visible part of the surface.
    pub view: View,
}

/// Visible part of a disc's surface.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct View {
    /// Area that lies on the surface and is seen from the centre [m²].
    pub area: f64,
    /// The same area of the disc of half the size [m²].
    pub inner_area: f64,
    /// Feet of walls that hide a part of the disc, seen from its centre [m].
    pub hidden_by: Vec<Segment>,
}

impl View {
    /// Whether nothing stands between the centre and a place at `offset` from it [m].
    #[inline]
    #[must_use]
    pub(crate) fn sees(&self, offset: DVec2) -> bool {
        !self.hidden_by.iter().any(|&(a, b)| is_between(offset, a, b))
    }
}

/// Whether the line from `a` to `b` crosses that from the origin to `tip`.
fn is_between(tip: DVec2, a: DVec2, b: DVec2) -> bool {
    let along = b - a;
    let divided = (a.perp_dot(along) > 0.0) != ((a - tip).perp_dot(along) > 0.0);
    divided && (tip.perp_dot(a) > 0.0) != (tip.perp_dot(b) > 0.0)
}

impl Sheet {
    /// Lays out all surfaces.
    #[must_use]
    pub(crate) fn all(geometry: &Geometry) -> Vec<Self> {
        (0..geometry.surfaces().len() as u32).map(|id| Self::new(geometry, SurfaceId(id))).collect()
    }

    /// Lays out a surface. Coordinates are about the scene's centre.
    #[must_use]
    fn new(geometry: &Geometry, id: SurfaceId) -> Self {
        let surface = geometry.surface(id);
        let across = surface.normal.any_orthonormal_vector();
        let (origin, along) = (surface.centroid - geometry.center(), surface.normal.cross(across));
        Self { surface: id, origin, across, along, outline: OnceLock::new() }
    }

    fn outline(&self, geometry: &Geometry) -> &Outline {
        self.outline.get_or_init(|| Outline::new(geometry, self))
    }

    /// The disc of `radius` [m] about a point of the surface, on the side that was met.
    #[must_use]
    pub(crate) fn disc(&self, geometry: &Geometry, hit: &Hit, radius: f64) -> Disc {
        let centre = self.flat(hit.position.as_dvec3());
        let view = self.outline(geometry).view(hit.side, centre, radius);
        Disc { place: place(hit.surface, hit.side), centre, radius, view }
    }

    /// Coordinates in the plane of a point on it [m].
    #[inline]
    #[must_use]
    pub(crate) fn flat(&self, point: DVec3) -> DVec2 {
        let offset = point - self.origin;
        DVec2::new(self.across.dot(offset), self.along.dot(offset))
    }
}

impl Outline {
    fn new(geometry: &Geometry, sheet: &Sheet) -> Self {
        let surface = geometry.surface(sheet.surface);
        let triangles = || surface.triangles.iter().map(|&t| geometry.mesh().triangles[t as usize].corners);
        let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
        // Triangles that are drawn twice count once.
        let directed: BTreeSet<(u32, u32)> = triangles().flat_map(edges).collect();
        let corner = |index: u32| sheet.flat(geometry.mesh().vertices[index as usize] - geometry.center());
        let rim = directed.iter().copied().filter(|&(from, to)| !directed.contains(&(to, from)));
        let boundary = straightened(rim, corner);
        let resolution = f64::from(geometry.resolution());
        let feet = geometry.footprints(sheet.surface).map(|feet| {
            let flat = feet.into_iter().map(|[a, b]| (sheet.flat(a), sheet.flat(b)));
            flat.filter(|&foot| is_divided(&boundary, foot, resolution)).collect()
        });
        Self { boundary, feet }
    }

    /// Part of one side of the surface that is visible in the disc of `radius` [m] about `centre`, a point of it.
    fn view(&self, side: Side, centre: DVec2, radius: f64) -> View {
        let inner_radius = radius * FRAC_1_SQRT_2;
        let area = self.clipped_area(centre, radius);
        let feet = &self.feet[usize::from(side == Side::Back)];
        let near: Vec<Segment> = feet
            .iter()
            .map(|&(a, b)| (a - centre, b - centre))
            .filter(|&(a, b)| distance_to(a, b) < radius)
            .collect();
        if !near.is_empty() {
            let boundary: Vec<Segment> =
                self.boundary.iter().map(|&(a, b)| (a - centre, b - centre)).collect();
            let seen = |radius: f64| {
                let whole = core::f64::consts::PI * radius * radius;
                visible_area(&boundary, &near, radius).clamp(whole * SMALLEST_SHARE, whole)
            };
            let visible = seen(radius);
            if visible < area * (1.0 - NOTHING_HIDDEN) {
                return View { area: visible, inner_area: seen(inner_radius), hidden_by: near };
            }
        }
        View { area, inner_area: self.clipped_area(centre, inner_radius), hidden_by: Vec::new() }
    }

    /// Area of the disc of `radius` about `centre`, a point of the surface, that lies on the surface [m²].
    fn clipped_area(&self, centre: DVec2, radius: f64) -> f64 {
        let whole = core::f64::consts::PI * radius * radius;
        let change: f64 =
            self.boundary.iter().map(|&(a, b)| edge_change(a - centre, b - centre, radius)).sum();
        // A centre within rounding of the boundary can miss a sliver; no disc is emptier than a corner's.
        (whole + change).clamp(whole * SMALLEST_SHARE, whole)
    }
}

/// Smallest share of a disc [1] that is divided by: that of a corner of a third of a degree.
const SMALLEST_SHARE: f64 = 1e-3;
/// Angle between edges that go straight on [rad]: above rounding of a millimetre's edge, and over 10 m off by 10 µm.
const STRAIGHT: f64 = 1e-6;
/// Largest distance of a wall's foot from the border that it stands on [resolutions]: 16 lifts of 4, where a wall leans by 86°.
const BORDER_RESOLUTIONS: f64 = 64.0;
/// Share of a disc [1] below which feet of walls hide nothing of it: rounding.
const NOTHING_HIDDEN: f64 = 1e-9;

/// Whether the line through a `foot` has more than rounding of the surface in `boundary` on both sides: a wall on a straight border has not.
fn is_divided(boundary: &[Segment], (a, b): Segment, resolution: f64) -> bool {
    let Some(along) = (b - a).try_normalize() else { return false };
    let beside = boundary.iter().map(|(corner, _)| along.perp_dot(*corner - a));
    let (left, right) = beside.fold((0.0_f64, 0.0_f64), |(left, right), at| (left.max(at), right.max(-at)));
    left.min(right) > BORDER_RESOLUTIONS * resolution
}

/// Joins the edges of a boundary that go straight on: a conforming mesh divides a border wherever another face touches it, and
/// every disc pays for every piece. Vertices at which boundaries meet stay.
fn straightened(edges: impl Iterator<Item = (u32, u32)>, corner: impl Fn(u32) -> DVec2) -> Vec<Segment> {
    let edges: Vec<(u32, u32)> = edges.collect();
    let mut next: BTreeMap<u32, Option<u32>> = BTreeMap::new();
    let mut previous: BTreeMap<u32, Option<u32>> = BTreeMap::new();
    for &(from, to) in &edges {
        next.entry(from).and_modify(|other| *other = None).or_insert(Some(to));
        previous.entry(to).and_modify(|other| *other = None).or_insert(Some(from));
    }
    let only = |of: &BTreeMap<u32, Option<u32>>, vertex: u32| of.get(&vertex).copied().flatten();
    let goes_straight_on = |vertex: u32| {
        let (Some(from), Some(to)) = (only(&previous, vertex), only(&next, vertex)) else { return false };
        let (arrives, leaves) = (corner(vertex) - corner(from), corner(to) - corner(vertex));
        arrives.dot(leaves) > 0.0 && arrives.perp_dot(leaves).abs() < STRAIGHT * arrives.dot(leaves)
    };
    let ahead = |mut vertex: u32| {
        while goes_straight_on(vertex) {
            vertex = only(&next, vertex).expect("a vertex that goes straight on has one successor");
        }
        vertex
    };
    edges
        .iter()
        .filter(|&&(from, _)| !goes_straight_on(from))
        .map(|&(from, to)| (corner(from), corner(ahead(to))))
        .collect()
}

/// Number of a surface's side.
#[inline]
#[must_use]
pub(crate) fn place(surface: SurfaceId, side: sonel_geometry::Side) -> u32 {
    2 * surface.0 + u32::from(side == sonel_geometry::Side::Back)
}

/// By how much the edge from `a` to `b`, seen from the disc's centre, changes the area of the disc.
fn edge_change(a: DVec2, b: DVec2, radius: f64) -> f64 {
    let direction = b - a;
    let (square, half_linear) = (direction.length_squared(), a.dot(direction));
    let discriminant = half_linear * half_linear - square * (a.length_squared() - radius * radius);
    if discriminant <= 0.0 || square <= 0.0 {
        return 0.0;
    }
    let root = discriminant.sqrt();
    let enters = ((-half_linear - root) / square).max(0.0);
    let leaves = ((-half_linear + root) / square).min(1.0);
    if enters >= leaves {
        return 0.0;
    }
    let (from, to) = (a + direction * enters, a + direction * leaves);
    0.5 * (from.perp_dot(to) - radius * radius * libm::atan2(from.perp_dot(to), from.dot(to)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;
    use sonel_geometry::Mesh;

    fn floor(size: [f64; 3]) -> (Geometry, Sheet) {
        let geometry = Geometry::build(Mesh::shoebox(size, [0; 6])).unwrap();
        let floor = geometry.surfaces().iter().position(|surface| surface.normal.z > 0.9).unwrap();
        let sheet = Sheet::new(&geometry, SurfaceId(floor as u32));
        (geometry, sheet)
    }

    fn area(size: [f64; 3], at: [f64; 2], radius: f64) -> f64 {
        let (geometry, sheet) = floor(size);
        sheet
            .outline(&geometry)
            .clipped_area(sheet.flat(DVec3::new(at[0], at[1], 0.0) - geometry.center()), radius)
    }

    #[test]
    fn discs_inside_at_edges_and_in_corners_have_their_exact_areas() {
        let size = [10.0, 8.0, 5.0];
        let close =
            |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        close(area(size, [5.0, 4.0], 1.0), PI);
        close(area(size, [1e-12, 4.0], 1.0), PI / 2.0);
        close(area(size, [1e-12, 1e-12], 1.0), PI / 4.0);
        // Half a radius from a wall: the disc less a segment of 120°.
        close(area(size, [0.5, 4.0], 1.0), PI - (PI / 3.0 - 3.0_f64.sqrt() / 4.0));
        close(area(size, [5.0, 4.0], 100.0), PI * 1e4 * SMALLEST_SHARE.max(80.0 / (PI * 1e4)));
    }

    #[test]
    fn a_border_divided_by_other_faces_costs_no_more_edges() {
        // Boards that end on the rim of the floor divide two of its edges in the conforming mesh.
        let (room, divided) =
            floor_with_screens(&[[1.0, 0.0, 1.0, 0.5], [2.0, 0.0, 2.0, 0.7], [0.0, 2.0, 0.5, 2.0]]);
        let (empty, plain) = floor_with_screens(&[]);
        assert_eq!(plain.outline(&empty).boundary.len(), 4);
        assert_eq!(divided.outline(&room).boundary.len(), 4);
    }

    #[test]
    fn the_area_agrees_with_counting_points() {
        let (size, at, radius) = ([3.0, 2.0, 2.0], [0.4, 1.7], 1.1);
        let (cells, mut inside) = (2000, 0);
        for i in 0..cells {
            for j in 0..cells {
                let (x, y) = (3.0 * (f64::from(i) + 0.5) / 2000.0, 2.0 * (f64::from(j) + 0.5) / 2000.0);
                inside += u32::from((x - at[0]).powi(2) + (y - at[1]).powi(2) < radius * radius);
            }
        }
        let counted = f64::from(inside) * 6.0 / 4e6;
        let exact = area(size, at, radius);
        assert!((exact / counted - 1.0).abs() < 1e-3);
        assert!((PI * radius * radius / counted - 1.0).abs() > 0.3, "the unclipped disc is rejected");
    }

    /// The floor of a box of 4 m by 3 m on which screens stand along `feet`.
    fn floor_with_screens(feet: &[[f64; 4]]) -> (Geometry, Sheet) {
        let mut mesh = Mesh::shoebox([4.0, 3.0, 2.0], [0; 6]);
        for &[x, y, u, v] in feet {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend([
                DVec3::new(x, y, 0.0),
                DVec3::new(u, v, 0.0),
                DVec3::new(u, v, 1.0),
                DVec3::new(x, y, 1.0),
            ]);
            for corners in [[0, 1, 2], [0, 2, 3]].map(|corners| corners.map(|corner| first + corner)) {
                mesh.triangles.push(sonel_geometry::MeshTriangle { corners, material: 0 });
            }
        }
        let geometry = Geometry::build(mesh).unwrap();
        let floor = geometry.surfaces().iter().position(|surface| surface.normal.z > 0.9).unwrap();
        let sheet = Sheet::new(&geometry, SurfaceId(floor as u32));
        (geometry, sheet)
    }

    #[test]
    fn walls_on_a_border_hide_nothing() {
        let (geometry, sheet) = floor([3.0, 2.0, 2.0]);
        assert!(sheet.outline(&geometry).feet.iter().all(Vec::is_empty));
    }

    #[test]
    fn a_screen_hides_what_is_behind_it() {
        let (geometry, sheet) = floor_with_screens(&[[2.0, 0.0, 2.0, 3.0]]);
        let at = |x: f64| sheet.flat(DVec3::new(x, 1.5, 0.0) - geometry.center());
        let centre = at(1.75);
        let view = sheet.outline(&geometry).view(Side::Front, centre, 0.5);
        // A quarter of the diameter is cut off: the disc less a segment of 120°.
        let segment = 0.25 * (PI / 3.0 - 3.0_f64.sqrt() / 4.0);
        assert!((view.area - (0.25 * PI - segment)).abs() < 1e-6, "{}", view.area);
        let below = sheet.outline(&geometry).view(Side::Back, centre, 0.5);
        assert!((below.area - 0.25 * PI).abs() < 1e-12 && below.hidden_by.is_empty());
        let far = sheet.outline(&geometry).view(Side::Front, at(1.45), 0.5);
        assert!(far.hidden_by.is_empty());
    }

    #[test]
    fn the_visible_area_agrees_with_counting_places_that_are_seen() {
        // Screens that cross, that meet a wall, that end within the disc, and one beyond another.
        let feet = [
            [1.0, 1.0, 2.2, 1.6],
            [1.4, 0.6, 1.5, 2.0],
            [2.5, 0.0, 2.5, 1.2],
            [0.2, 0.9, 0.6, 0.9],
            [0.1, 0.7, 0.9, 0.75],
        ];
        let (geometry, sheet) = floor_with_screens(&feet);
        for [x, y] in [[1.2, 1.4], [1.9, 0.9], [0.5, 1.2], [2.6, 0.3]] {
            let at = |x: f64, y: f64| sheet.flat(DVec3::new(x, y, 0.0) - geometry.center());
            let (centre, radius) = (at(x, y), 0.9);
            let view = sheet.outline(&geometry).view(Side::Front, centre, radius);
            let (cells, mut seen, mut within) = (1200, 0, 0);
            for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
                let place =
                    at(4.0 * (f64::from(i) + 0.5) / 1200.0, 3.0 * (f64::from(j) + 0.5) / 1200.0) - centre;
                if place.length() < radius {
                    within += 1;
                    seen += u32::from(view.sees(place));
                }
            }
            let area = |count: u32| f64::from(count) * 12.0 / f64::from(cells * cells);
            assert!((view.area / area(seen) - 1.0).abs() < 2e-3, "({x}, {y}): {} {}", view.area, area(seen));
            assert!(area(within) > 1.05 * view.area, "the disc without its screens is rejected");
        }
    }
}
