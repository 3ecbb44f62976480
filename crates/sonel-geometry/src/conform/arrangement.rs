//! The lines on a face, or on several that overlap, divided where they meet, and the triangles between them.
//!
//! What is computed here is two-dimensional: faces are projected along the axis to which they are turned most, which leaves
//! the coordinates as they are. The constrained triangulation covers the convex hull of all lines; which of its triangles
//! belong to a face follows from the lines alone: each line of a face's rim has the face on one side and not on the other.

use super::OnSides;
use crate::Mesh;
use crate::stitch::share_along;
use crate::weld::Points;
use foldhash::HashMap;
use glam::DVec3;
use smallvec::SmallVec;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::BTreeMap;

/// Trace of another face on one, by corners.
#[derive(Debug, Clone, Copy)]
pub(super) enum FaceTrace {
    /// A line between two corners.
    Line([u32; 2]),
    /// A corner.
    Point(u32),
}

/// Faces of one plane that are divided together, and the lines on them.
pub(super) struct Lines {
    /// In ascending order.
    pub faces: Vec<u32>,
    lines: Vec<[u32; 2]>,
    points: Vec<u32>,
    /// For each line, sides of the faces included, the corners on it in order.
    divided: BTreeMap<[u32; 2], Vec<u32>>,
}

/// Corners in the plane of a group of faces.
struct Plane {
    axes: [usize; 2],
}

impl Lines {
    /// Faces without lines.
    pub(super) fn new(faces: Vec<u32>) -> Self {
        Self { faces, lines: Vec::new(), points: Vec::new(), divided: BTreeMap::new() }
    }

    /// Adds what another face leaves.
    pub(super) fn add(&mut self, piece: FaceTrace) {
        match piece {
            FaceTrace::Line([a, b]) if a != b => self.lines.push([a.min(b), a.max(b)]),
            FaceTrace::Line([a, _]) | FaceTrace::Point(a) => self.points.push(a),
        }
    }

    /// Divides all lines where they cross or meet corners, and notes the corners on them in `on_sides`. Returns the number of crossings.
    pub(super) fn divide(
        &mut self,
        mesh: &Mesh,
        points: &mut Points,
        tolerance: f64,
        on_sides: &mut OnSides,
    ) -> usize {
        let mut lines: Vec<[u32; 2]> =
            self.faces.iter().flat_map(|&face| mesh.triangles[face as usize].sides()).collect();
        lines.extend(&self.lines);
        lines.sort_unstable();
        lines.dedup();
        let plane = Plane::of(mesh, &self.faces);
        let mut crossings = Vec::new();
        for (a, b) in overlapping(&lines, &points.places, tolerance) {
            let ends = [lines[a], lines[b]].map(|line| line.map(|end| points.places[end as usize]));
            if let Some(place) = plane.crossing(ends, tolerance) {
                crossings.push(points.join(place));
            }
        }
        let corners = sorted(self.points.iter().chain(lines.iter().flatten()).chain(&crossings));
        let on = corners_on(&lines, &corners, &points.places, tolerance);
        for (line, on) in lines.into_iter().zip(on) {
            if !on.is_empty() {
                let noted = on_sides.entry(line).or_default();
                on.iter().for_each(|corner| {
                    if !noted.contains(corner) {
                        noted.push(*corner);
                    }
                });
            }
            self.divided.insert(line, on);
        }
        crossings.len()
    }

    /// The parts of each face, where it has any; lines at their sides are divided at the corners `on_sides` too.
    pub(super) fn triangulated(
        &self,
        mesh: &Mesh,
        tolerance: f64,
        on_sides: &OnSides,
    ) -> Option<Vec<(u32, Vec<[u32; 3]>)>> {
        let mut lines: Vec<[u32; 2]> =
            self.faces.iter().flat_map(|&face| mesh.triangles[face as usize].sides()).collect();
        lines.extend(self.divided.keys());
        lines.sort_unstable();
        lines.dedup();
        let noted = lines.iter().flat_map(|line| on_sides.get(line)).flatten();
        let divided = self.divided.values().flatten();
        let corners = sorted(self.points.iter().chain(lines.iter().flatten()).chain(divided).chain(noted));
        // What is noted of one line may lie on others too.
        let on = corners_on(&lines, &corners, &mesh.vertices, tolerance);
        let lines: BTreeMap<[u32; 2], Vec<u32>> = lines.into_iter().zip(on).collect();
        let is_whole = self.faces.len() == 1 && self.points.is_empty() && lines.values().all(Vec::is_empty);
        if is_whole && lines.len() == 3 {
            return None;
        }
        let parts =
            Triangles::new(mesh, Plane::of(mesh, &self.faces), &lines, &self.points)?.parts(&self.faces);
        let is_same = |(face, parts): &(u32, Vec<[u32; 3]>)| matches!(parts[..], [part] if is_permutation(part, mesh.triangles[*face as usize].corners));
        Some(parts.into_iter().filter(|parts| !is_same(parts)).collect())
    }
}

fn is_permutation(a: [u32; 3], b: [u32; 3]) -> bool {
    a.iter().all(|corner| b.contains(corner))
}

/// The axis on which the bounds of fewest lines meet: rows of seats are long and side by side.
fn sweep_axis(bounds: &[(DVec3, DVec3)]) -> usize {
    let meeting = |&axis: &usize| {
        let mut begins: Vec<f64> = bounds.iter().map(|(low, _)| low[axis]).collect();
        begins.sort_by(f64::total_cmp);
        bounds.iter().map(|(_, high)| begins.partition_point(|low| *low <= high[axis])).sum::<usize>()
    };
    (0..3).min_by_key(meeting).expect("there are three axes")
}

/// Pairs of lines whose bounds meet, by a sweep along one axis.
fn overlapping(lines: &[[u32; 2]], places: &[DVec3], margin: f64) -> Vec<(usize, usize)> {
    let bounds: Vec<(DVec3, DVec3)> = lines.iter().map(|line| bounds(line, places, margin)).collect();
    let axis = sweep_axis(&bounds);
    let mut order: Vec<usize> = (0..lines.len()).collect();
    order.sort_by(|&a, &b| bounds[a].0[axis].total_cmp(&bounds[b].0[axis]));
    let mut pairs = Vec::new();
    for (at, &a) in order.iter().enumerate() {
        for &b in order[at + 1..].iter().take_while(|&&b| bounds[b].0[axis] <= bounds[a].1[axis]) {
            if bounds[a].0.cmple(bounds[b].1).all() && bounds[b].0.cmple(bounds[a].1).all() {
                pairs.push((a.min(b), a.max(b)));
            }
        }
    }
    pairs.sort_unstable();
    pairs
}

fn bounds(line: &[u32; 2], places: &[DVec3], margin: f64) -> (DVec3, DVec3) {
    let [a, b] = line.map(|end| places[end as usize]);
    (a.min(b) - margin, a.max(b) + margin)
}

fn sorted<'a>(corners: impl Iterator<Item = &'a u32>) -> Vec<u32> {
    let mut corners: Vec<u32> = corners.copied().collect();
    corners.sort_unstable();
    corners.dedup();
    corners
}

/// For each line the corners in its interior, in order along it.
fn corners_on(lines: &[[u32; 2]], corners: &[u32], places: &[DVec3], tolerance: f64) -> Vec<Vec<u32>> {
    let place = |corner: u32| places[corner as usize];
    let bounds: Vec<(DVec3, DVec3)> = lines.iter().map(|line| bounds(line, places, tolerance)).collect();
    let axis = sweep_axis(&bounds);
    let mut order: Vec<u32> = corners.to_vec();
    order.sort_by(|&a, &b| place(a)[axis].total_cmp(&place(b)[axis]));
    let on = |(line, (low, high)): (&[u32; 2], &(DVec3, DVec3))| {
        let first = order.partition_point(|&corner| place(corner)[axis] < low[axis]);
        let near = order[first..].iter().take_while(|&&corner| place(corner)[axis] <= high[axis]);
        let share = |corner: u32| share_along(line.map(place), place(corner), tolerance);
        let apart = near.copied().filter(|corner| !line.contains(corner));
        let mut on: Vec<(f64, u32)> = apart.filter_map(|corner| Some((share(corner)?, corner))).collect();
        on.sort_by(|a, b| a.0.total_cmp(&b.0));
        on.into_iter().map(|(_, corner)| corner).collect()
    };
    lines.iter().zip(&bounds).map(on).collect()
}

impl Plane {
    /// Plane of the largest of some faces.
    fn of(mesh: &Mesh, faces: &[u32]) -> Self {
        let areas = faces.iter().map(|&face| mesh.vector_area(face));
        let largest = areas.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        let dropped = largest.expect("a group has faces").abs().max_position();
        Self { axes: [(dropped + 1) % 3, (dropped + 2) % 3] }
    }

    fn project(&self, place: DVec3) -> [f64; 2] {
        self.axes.map(|axis| place[axis])
    }

    /// Crossing of two lines in the interior of both [m].
    fn crossing(&self, [[a, b], [c, d]]: [[DVec3; 2]; 2], tolerance: f64) -> Option<DVec3> {
        let [p, q, r, s] = [a, b, c, d].map(|place| self.project(place));
        let (above, below) = (turn(p, q, r), turn(p, q, s));
        let (left, right) = (turn(r, s, p), turn(r, s, q));
        if above * below >= 0.0 || left * right >= 0.0 {
            return None;
        }
        let place = a.lerp(b, left / (left - right));
        [a, b, c, d].iter().all(|end| end.distance(place) > tolerance).then_some(place)
    }
}

/// Twice the signed area of a triangle.
fn turn(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// A constrained triangulation of the lines in a plane.
struct Triangles<'a> {
    mesh: &'a Mesh,
    plane: Plane,
    triangulation: ConstrainedDelaunayTriangulation<Point2<f64>>,
    /// The corner of each vertex of the triangulation.
    corners: Vec<u32>,
    lines: &'a BTreeMap<[u32; 2], Vec<u32>>,
}

impl<'a> Triangles<'a> {
    /// None where lines that should not cross do, by rounding.
    fn new(
        mesh: &'a Mesh,
        plane: Plane,
        lines: &'a BTreeMap<[u32; 2], Vec<u32>>,
        points: &[u32],
    ) -> Option<Self> {
        let mut triangulation = ConstrainedDelaunayTriangulation::new();
        let mut handles: HashMap<u32, FixedVertexHandle> = HashMap::default();
        let mut corners: Vec<u32> = Vec::new();
        let all = lines.iter().flat_map(|(line, on)| line.iter().chain(on)).chain(points);
        for &corner in all {
            if handles.contains_key(&corner) {
                continue;
            }
            let [x, y] = plane.project(mesh.vertices[corner as usize]);
            let handle = triangulation.insert(Point2::new(x, y)).ok()?;
            if handle.index() == corners.len() {
                corners.push(corner);
            }
            handles.insert(corner, handle);
        }
        for (line, on) in lines {
            for [from, to] in steps(line, on) {
                let (from, to) = (handles[&from], handles[&to]);
                if from != to {
                    triangulation.can_add_constraint(from, to).then_some(())?;
                    triangulation.add_constraint(from, to);
                }
            }
        }
        Some(Self { mesh, plane, triangulation, corners, lines })
    }

    /// The triangles within each of `faces`, oriented as the face.
    fn parts(&self, faces: &[u32]) -> Vec<(u32, Vec<[u32; 3]>)> {
        let rims = self.rims(faces);
        let mut parts: Vec<(u32, Vec<[u32; 3]>)> = faces.iter().map(|&face| (face, Vec::new())).collect();
        let is_turned: Vec<bool> = faces.iter().map(|&face| self.is_turned(face)).collect();
        for (triangle, within) in self.within(&rims) {
            for at in within {
                let [a, b, c] = triangle;
                parts[at].1.push(if is_turned[at] { [a, c, b] } else { [a, b, c] });
            }
        }
        parts.retain(|(_, parts)| !parts.is_empty());
        parts
    }

    /// For each piece of a line the faces at whose rim it is, by their place among `faces`.
    fn rims(&self, faces: &[u32]) -> HashMap<[u32; 2], SmallVec<[usize; 2]>> {
        let mut rims: HashMap<[u32; 2], SmallVec<[usize; 2]>> = HashMap::default();
        for (at, &face) in faces.iter().enumerate() {
            for side in self.mesh.triangles[face as usize].sides() {
                for [from, to] in steps(&side, &self.lines[&side]) {
                    toggle(rims.entry([from.min(to), from.max(to)]).or_default(), at);
                }
            }
        }
        rims
    }

    /// The triangles that lie within any face, with those faces.
    fn within(
        &self,
        rims: &HashMap<[u32; 2], SmallVec<[usize; 2]>>,
    ) -> Vec<([u32; 3], SmallVec<[usize; 2]>)> {
        let outer = self.triangulation.outer_face();
        let mut inside: Vec<Option<SmallVec<[usize; 2]>>> = vec![None; self.triangulation.num_all_faces()];
        inside[outer.fix().index()] = Some(SmallVec::new());
        let mut open = vec![outer.fix()];
        while let Some(face) = open.pop() {
            let here = inside[face.index()].clone().expect("open faces are known");
            let edges: Vec<_> = match self.triangulation.face(face).as_inner() {
                Some(inner) => inner.adjacent_edges().to_vec(),
                None => self.triangulation.convex_hull().collect(),
            };
            for edge in edges {
                // Edges of the hull are given with the outer face on their left.
                let beyond = edge.rev().face().fix();
                if inside[beyond.index()].is_none() {
                    let [a, b] = edge.vertices().map(|vertex| self.corners[vertex.index()]);
                    let mut there = here.clone();
                    rims.get(&[a.min(b), a.max(b)])
                        .into_iter()
                        .flatten()
                        .for_each(|&at| toggle(&mut there, at));
                    inside[beyond.index()] = Some(there);
                    open.push(beyond);
                }
            }
        }
        let faces = self.triangulation.inner_faces();
        faces
            .filter_map(|face| {
                let mut within = inside[face.index()].take().filter(|within| !within.is_empty())?;
                within.sort_unstable();
                Some((face.vertices().map(|vertex| self.corners[vertex.index()]), within))
            })
            .collect()
    }

    /// Whether a face runs clockwise in the plane.
    fn is_turned(&self, face: u32) -> bool {
        let [a, b, c] = self.mesh.corners(face).map(|corner| self.plane.project(corner));
        turn(a, b, c) < 0.0
    }
}

/// The pieces of a line with corners `on` it.
fn steps<'a>(line: &'a [u32; 2], on: &'a [u32]) -> impl Iterator<Item = [u32; 2]> + 'a {
    let from = std::iter::once(line[0]).chain(on.iter().copied());
    let to = on.iter().copied().chain(std::iter::once(line[1]));
    from.zip(to).map(|(from, to)| [from, to])
}

fn toggle(set: &mut SmallVec<[usize; 2]>, member: usize) {
    match set.iter().position(|&it| it == member) {
        Some(at) => {
            set.remove(at);
        }
        None => set.push(member),
    }
}
