//! Where straight ways pass edges: the search for edges near a ray, and what is asked at the foot of the shortest distance.
//!
//! A way passes an edge where the shortest distance between both lies within both. At the foot of that distance the edge
//! must be in sight, the nearest of all edges in sight, and the foot must lie in one of the edge's sectors of air: what is
//! said of an edge is then said by one edge at a time, and not through walls.
//!
//! Edges stand in groups with a box each; a way looks into the groups whose boxes, widened by the reach, it meets. Scenes of
//! ten thousand edges take a microsecond or two a way.

use crate::{AirSector, Departure, Edge, Geometry, Side};
use glam::DVec3;
use std::f64::consts::TAU;
use std::ops::Range;

/// The line of an edge, about the scene's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeLine {
    /// Its first end [m].
    pub origin: DVec3,
    /// Unit vector towards the other end.
    pub along: DVec3,
    /// Its length [m].
    pub length: f64,
}

/// How a straight way passes an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// Which edge: a number of [`EdgeIndex::lines`].
    pub edge: u32,
    /// How far on the way its foot is [m].
    pub at: f64,
    /// Where on the edge the nearest point is, from its first end [m].
    pub along: f64,
    /// The shortest distance [m].
    pub distance: f64,
    /// Which way round the edge: front for counterclockwise about its direction.
    pub side: Side,
}

impl EdgeLine {
    /// The line between two points about the scene's centre [m].
    #[must_use]
    pub fn new([from, to]: [DVec3; 2]) -> Self {
        Self { origin: from, along: (to - from).normalize_or(DVec3::X), length: from.distance(to) }
    }

    /// The point at `along` from the first end [m].
    #[inline]
    #[must_use]
    pub fn point(&self, along: f64) -> DVec3 {
        self.origin + along * self.along
    }

    /// Where the line from `origin` in a unit `direction` is nearest to that of the edge: how far on both lines [m], and the
    /// square of the distance [m²]. [`None`] where they are parallel.
    #[inline]
    fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64, f64)> {
        let offset = origin - self.origin;
        let (slant, height) = (direction.dot(self.along), offset.dot(self.along));
        let across_squared = 1.0 - slant * slant;
        if across_squared < PARALLEL {
            return None;
        }
        let at = (height * slant - offset.dot(direction)) / across_squared;
        let aside = offset.length_squared() - height * height - at * at * across_squared;
        Some((at, height + at * slant, aside.max(0.0)))
    }

    /// The foot of a way that starts at `from` and passes the edge at `distance` from its point at `along`, on `side`: where the
    /// way touches the cylinder of that radius.
    #[must_use]
    pub fn foot(&self, from: DVec3, along: f64, distance: f64, side: Side) -> DVec3 {
        let offset = from - self.origin;
        let radial = offset - offset.dot(self.along) * self.along;
        let radius = radial.length();
        let towards = if radius > 0.0 { radial / radius } else { self.along.any_orthonormal_vector() };
        let cosine = (distance / radius).min(1.0);
        let sine = side.sign() * (1.0 - cosine * cosine).max(0.0).sqrt();
        self.point(along) + distance * (cosine * towards + sine * self.along.cross(towards))
    }

    /// A unit `direction` that passes the edge on `side` with its foot at `foot`, turned about the edge by the angle with the
    /// given `tangent`, towards the edge where that is positive. What it has along the edge it keeps.
    #[must_use]
    pub fn turned(&self, foot: DVec3, direction: DVec3, side: Side, tangent: f64) -> DVec3 {
        let offset = foot - self.origin;
        let outward =
            (offset - offset.dot(self.along) * self.along).normalize_or(self.along.any_orthonormal_vector());
        let forward = side.sign() * self.along.cross(outward);
        let slant = direction.dot(self.along);
        let across = (1.0 - slant * slant).max(0.0).sqrt() / (1.0 + tangent * tangent).sqrt();
        slant * self.along + across * (forward - tangent * outward)
    }

    /// Square of the distance of a point from the edge [m²], and where its nearest point is [m].
    fn distance_squared(&self, point: DVec3) -> (f64, f64) {
        let along = (point - self.origin).dot(self.along).clamp(0.0, self.length);
        (point.distance_squared(self.point(along)), along)
    }
}

/// Square of the sine below which a way and an edge are parallel: nothing passes anything.
const PARALLEL: f64 = 1e-12;

/// An edge whose foot is nearer to the start of a way than this part of its distance stands abreast of the start, and is not passed:
/// a distance in f32, as vertices hold it, would no longer tell the foot from the start, or from what is behind it.
const ABREAST: f64 = 2e-3;

/// Edges in a group.
const GROUP: usize = 16;

/// What is asked of the edges about a way.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    /// Where it starts, about the scene's centre [m].
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Part of the way that counts: from … to, exclusive [m].
    pub from: f64,
    /// See `from`.
    pub to: f64,
    /// Largest distance of an edge [m].
    pub reach: f64,
}

/// The edges of a scene made ready for ways.
#[derive(Debug)]
pub struct EdgeIndex {
    lines: Vec<EdgeLine>,
    sectors: Vec<Vec<AirSector>>,
    groups: Vec<Group>,
    /// Edge numbers, group by group.
    order: Vec<u32>,
    least: f64,
}

#[derive(Debug)]
struct Group {
    low: DVec3,
    high: DVec3,
    members: Range<usize>,
}

impl EdgeIndex {
    /// The diffracting edges of `geometry` that `chosen` picks, numbered in their order.
    #[must_use]
    pub fn new(geometry: &Geometry, chosen: impl Fn(&Edge) -> bool) -> Self {
        let (mut lines, mut sectors) = (Vec::new(), Vec::new());
        for edge in geometry.diffracting_edges().filter(|&edge| chosen(edge)) {
            lines.push(EdgeLine::new(edge.ends.map(|end| end - geometry.center())));
            sectors.push(edge.sectors.clone());
        }
        let mut index = Self {
            order: (0..lines.len() as u32).collect(),
            lines,
            sectors,
            groups: Vec::new(),
            least: f64::from(geometry.lift()),
        };
        index.divide(0..index.order.len());
        index
    }

    /// The lines of its edges.
    #[must_use]
    pub fn lines(&self) -> &[EdgeLine] {
        &self.lines
    }

    /// Distance below which no edge is passed, nor a foot is apart from where a way starts [m]: that by which rays leave
    /// surfaces.
    #[must_use]
    pub fn least_distance(&self) -> f64 {
        self.least
    }

    /// Makes groups of the edges at `places` of the order: halves along the longest side until they are small.
    fn divide(&mut self, places: Range<usize>) {
        if places.is_empty() {
            return;
        }
        let lines = &self.lines;
        let ends = |edge: &u32| {
            [lines[*edge as usize].origin, lines[*edge as usize].point(lines[*edge as usize].length)]
        };
        let low = self.order[places.clone()].iter().flat_map(ends).fold(DVec3::INFINITY, DVec3::min);
        let high = self.order[places.clone()].iter().flat_map(ends).fold(DVec3::NEG_INFINITY, DVec3::max);
        if places.len() <= GROUP {
            self.groups.push(Group { low, high, members: places });
            return;
        }
        let axis = (high - low).max_position();
        let middle = |edge: &u32| lines[*edge as usize].point(0.5 * lines[*edge as usize].length)[axis];
        self.order[places.clone()].sort_by(|a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
        let half = places.start + places.len() / 2;
        self.divide(places.start..half);
        self.divide(half..places.end);
    }

    /// Visits the edges whose groups come within `reach` of the box between two points.
    #[inline]
    fn near(&self, low: DVec3, high: DVec3, reach: f64, mut visit: impl FnMut(u32)) {
        for group in &self.groups {
            if (group.low - reach).cmple(high).all() && (group.high + reach).cmpge(low).all() {
                self.order[group.members.clone()].iter().for_each(|&edge| visit(edge));
            }
        }
    }

    /// The first passage on a way, of edges that `counts` accepts.
    #[must_use]
    pub fn first(&self, geometry: &Geometry, way: &Way, counts: impl Fn(u32) -> bool) -> Option<Passage> {
        let mut behind = (way.from, u32::MAX);
        loop {
            let passage = self.candidate(way, behind, &counts)?;
            if self.stands(geometry, way, &passage) {
                return Some(passage);
            }
            behind = (passage.at, passage.edge);
        }
    }

    /// The first edge on a way whose shortest distance lies within both, whatever is between, of those behind the foot and
    /// edge given: parallel edges have their feet at one place.
    fn candidate(&self, way: &Way, behind: (f64, u32), counts: impl Fn(u32) -> bool) -> Option<Passage> {
        let end = way.origin + way.direction * way.to;
        let reach_squared = way.reach * way.reach;
        let mut first: Option<Passage> = None;
        self.near(way.origin.min(end), way.origin.max(end), way.reach, |edge| {
            let line = &self.lines[edge as usize];
            let Some((at, along, squared)) = line.nearest(way.origin, way.direction) else { return };
            let before = first.map_or((way.to, 0), |first| (first.at, first.edge));
            let within = (at, edge) > behind && (at, edge) < before && along > 0.0 && along < line.length;
            let apart = squared >= self.least * self.least && at * at >= ABREAST * ABREAST * squared;
            if within && apart && squared <= reach_squared && counts(edge) {
                first = Some(Passage { edge, at, along, distance: squared.sqrt(), side: Side::Front });
            }
        });
        let passage = first?;
        let line = &self.lines[passage.edge as usize];
        let outward = way.origin + passage.at * way.direction - line.point(passage.along);
        let turns = line.along.cross(outward).dot(way.direction) >= 0.0;
        Some(Passage { side: if turns { Side::Front } else { Side::Back }, ..passage })
    }

    /// Whether a passage is one: its foot sees the edge, in a sector of its air, and sees no other edge nearer.
    fn stands(&self, geometry: &Geometry, way: &Way, passage: &Passage) -> bool {
        let foot = way.origin + passage.at * way.direction;
        if !self.sees(geometry, foot, passage.edge, passage.along) {
            return false;
        }
        let limit = passage.distance * passage.distance;
        let mut nearer = false;
        self.near(foot, foot, passage.distance, |other| {
            if nearer || other == passage.edge {
                return;
            }
            let (squared, along) = self.lines[other as usize].distance_squared(foot);
            nearer = squared < limit && self.sees(geometry, foot, other, along);
        });
        !nearer
    }

    /// Whether nothing is between a point of the air and the point at `along` of an edge, and the edge diffracts towards it.
    fn sees(&self, geometry: &Geometry, from: DVec3, edge: u32, along: f64) -> bool {
        let point = self.lines[edge as usize].point(along);
        let offset = from - point;
        self.sectors[edge as usize].iter().any(|sector| is_in(sector, offset))
            && !geometry.is_blocked(Departure::free(from.as_vec3()), point.as_vec3())
    }
}

fn is_in(sector: &AirSector, offset: DVec3) -> bool {
    sector.angle >= TAU
        || libm::atan2(offset.dot(sector.normal), offset.dot(sector.inward)).rem_euclid(TAU) <= sector.angle
}

impl Way {
    /// All of the way between two points about the scene's centre [m].
    #[must_use]
    pub fn between(from: DVec3, to: DVec3, reach: f64) -> Self {
        let length = from.distance(to);
        Self { origin: from, direction: (to - from) / length, from: 0.0, to: length, reach }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mesh, MeshTriangle};
    use glam::dvec3;

    /// A box of 20 m × 10 m × 6 m with a screen across its middle, 3 m high and 4 m wide, that stands on the floor.
    fn screened() -> Geometry {
        let mut mesh = Mesh::shoebox([20.0, 10.0, 6.0], [0; 6]);
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend([
            dvec3(10.0, 3.0, 0.0),
            dvec3(10.0, 7.0, 0.0),
            dvec3(10.0, 7.0, 3.0),
            dvec3(10.0, 3.0, 3.0),
        ]);
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let corners = corners.map(|corner| first + corner);
            mesh.triangles.push(MeshTriangle { corners, material: 0 });
        }
        Geometry::build(mesh).unwrap()
    }

    fn first(geometry: &Geometry, from: DVec3, to: DVec3, reach: f64) -> Option<Passage> {
        let index = EdgeIndex::new(geometry, |_| true);
        let local = |point: DVec3| point - geometry.center();
        index.first(geometry, &Way::between(local(from), local(to), reach), |_| true)
    }

    /// Starts beside the screen, ever nearer to being abreast of its top.
    #[test]
    fn a_foot_is_found_again_from_a_distance_in_f32() {
        let geometry = screened();
        let index = EdgeIndex::new(&geometry, |_| true);
        let mut passed = 0;
        for step in 0..400 {
            let before = libm::pow(10.0, -f64::from(step) / 80.0);
            let origin = dvec3(10.0 - before, 5.0, 3.3 + 0.002 * f64::from(step)) - geometry.center();
            let direction = dvec3(1.0, 0.01, 0.0).normalize();
            let way = Way { origin, direction, from: 0.0, to: 5.0, reach: 3.0 };
            let Some(passage) = index.first(&geometry, &way, |_| true) else { continue };
            passed += 1;
            let line = index.lines()[passage.edge as usize];
            let found = line.foot(origin, passage.along, f64::from(passage.distance as f32), passage.side);
            let error = found.distance(origin + passage.at * direction);
            assert!(error < 0.03 * passage.at, "{error:e} of {:e}", passage.at);
        }
        assert!((150..350).contains(&passed), "{passed} passages, and ways that start abreast");
    }

    #[test]
    fn a_way_over_a_screen_passes_its_top() {
        let geometry = screened();
        let passage = first(&geometry, dvec3(1.0, 4.0, 4.0), dvec3(19.0, 6.0, 4.0), 2.0).unwrap();
        assert!((passage.distance - 1.0).abs() < 1e-9);
        assert!((passage.at - 0.5 * dvec3(18.0, 2.0, 0.0).length()).abs() < 1e-9);
        let back = first(&geometry, dvec3(19.0, 6.0, 4.0), dvec3(1.0, 4.0, 4.0), 2.0).unwrap();
        assert_ne!(passage.side, back.side);
        assert!(
            first(&geometry, dvec3(1.0, 4.0, 4.0), dvec3(19.0, 6.0, 4.0), 0.99).is_none(),
            "out of reach"
        );
        assert!(
            first(&geometry, dvec3(1.0, 4.0, 4.0), dvec3(9.0, 5.0, 4.0), 2.0).is_none(),
            "ends before the edge"
        );
    }

    #[test]
    fn only_the_nearest_edge_in_sight_is_passed() {
        let geometry = screened();
        // Beside the screen at half its height: its side is 0.5 m away, the end of its top edge farther.
        let passage = first(&geometry, dvec3(1.0, 2.5, 1.5), dvec3(19.0, 2.5, 1.5), 5.0).unwrap();
        assert!((passage.distance - 0.5).abs() < 1e-9);
        // Down along the face of the screen, 2 m before it: the top is passed at its height, whatever is behind the sheet.
        let passage = first(&geometry, dvec3(8.0, 5.0, 5.0), dvec3(8.0, 5.0, 0.5), 5.0).unwrap();
        assert!((passage.distance - 2.0).abs() < 1e-9);
    }

    #[test]
    fn edges_behind_walls_are_not_passed() {
        let geometry = screened();
        // Outside of the room, above its ceiling.
        assert!(first(&geometry, dvec3(1.0, 5.0, 7.0), dvec3(19.0, 5.0, 7.0), 9.0).is_none());
    }

    #[test]
    fn feet_are_found_again_from_where_a_way_started() {
        let line = EdgeLine::new([dvec3(1.0, -2.0, 0.5), dvec3(3.0, 4.0, 2.5)]);
        let start = dvec3(-4.0, 1.03, 3.0);
        for step in 0..50 {
            let target = dvec3(5.0, 0.2 * f64::from(step) - 5.0, -2.0 + 0.1 * f64::from(step));
            let direction = (target - start).normalize();
            let (at, along, squared) = line.nearest(start, direction).unwrap();
            if at < 0.0 {
                continue;
            }
            let foot = start + at * direction;
            let outward = foot - line.point(along);
            let side = if line.along.cross(outward).dot(direction) >= 0.0 { Side::Front } else { Side::Back };
            let found = line.foot(start, along, squared.sqrt(), side);
            assert!(found.distance(foot) < 1e-6, "{found} {foot}");
            let straight = line.turned(foot, direction, side, 0.0);
            assert!(straight.distance(direction) < 1e-9);
            let turned = line.turned(foot, direction, side, 0.7);
            assert!((turned.length() - 1.0).abs() < 1e-12 && turned.dot(outward) < 0.0, "towards the edge");
            assert!(
                (turned.dot(line.along) - direction.dot(line.along)).abs() < 1e-12,
                "kept along the edge"
            );
            let across = |d: DVec3| d - d.dot(line.along) * line.along;
            let cosine = across(turned).normalize().dot(across(direction).normalize());
            assert!((cosine - 1.0 / 1.49_f64.sqrt()).abs() < 1e-9);
        }
    }

    #[test]
    fn groups_find_what_a_walk_through_all_edges_finds() {
        let mut mesh = Mesh::shoebox([40.0, 30.0, 10.0], [0; 6]);
        for number in 0..60 {
            let at = dvec3(
                2.0 + 6.0 * f64::from(number % 6),
                2.0 + 2.7 * f64::from(number / 6),
                1.0 + 0.07 * f64::from(number),
            );
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend([at, at + dvec3(1.0, 0.3, 0.0), at + dvec3(0.2, 0.1, 1.5)]);
            mesh.triangles.push(MeshTriangle { corners: [first, first + 1, first + 2], material: 0 });
        }
        let geometry = Geometry::build(mesh).unwrap();
        let index = EdgeIndex::new(&geometry, |_| true);
        assert!(index.groups.len() > 8 && index.lines.len() >= 180);
        for step in 0..300 {
            let turn = f64::from(step);
            let origin = dvec3(-18.0, -14.0, -4.0) + dvec3(0.1, 0.09, 0.02) * turn;
            let direction = dvec3(libm::cos(turn), libm::sin(turn), 0.1 * libm::cos(3.0 * turn)).normalize();
            let way = Way { origin, direction, from: 0.0, to: 30.0, reach: 2.0 };
            let all = index
                .lines
                .iter()
                .filter_map(|line| line.nearest(origin, direction).map(|near| (near, line.length)));
            let expected = all
                .filter(|&((at, along, squared), length)| {
                    at * at >= ABREAST * ABREAST * squared
                        && at > 0.0
                        && at < 30.0
                        && along > 0.0
                        && along < length
                        && squared <= 4.0
                })
                .map(|((at, ..), _)| at)
                .fold(f64::INFINITY, f64::min);
            let found =
                index.candidate(&way, (0.0, u32::MAX), |_| true).map_or(f64::INFINITY, |passage| passage.at);
            let same = (found - expected).abs() < 1e-12 || (found.is_infinite() && expected.is_infinite());
            assert!(same, "{found} {expected}");
        }
    }
}
