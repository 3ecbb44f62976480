//! Where straight ways pass edges: the search for edges near a ray, and what is asked at the closest point of the shortest distance.
//!
//! A way passes an edge where the shortest distance between both lies within both. At the closest point of that distance the edge
//! must be in sight, no other edge in sight may be nearer, and the closest point must lie in the edge's sector of air: what is
//! said of an edge is then said by one edge at a time, and not through walls. Edges have a limit, a distance beyond which they are not
//! passed; an edge of a smaller limit hides none of a larger one, so that an edge that matters to long waves is not lost behind a small one that
//! does not.
//!
//! Both searches, for feet on a way and for competing about a closest point, walk a hierarchy of boxes over blocks of edges and leave with the
//! first few they find; rays are cast last, and towards the likeliest rival first. What is left out cannot be found, so the
//! answer is that of the definition.

mod air;
mod boxes;
mod faces;
mod hierarchy;
mod lanes;
mod line;
mod question;
mod search;
mod top_k;

use crate::{Departure, Edge, Geometry, Side};
use air::Air;
pub use faces::EdgeFaces;
use faces::Regions;
use glam::DVec3;
use hierarchy::Hierarchy;
pub use line::EdgeLine;
use search::{CompetingEdges, Feet, Neighbours};
use top_k::Near;

/// How a straight way passes an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgePass {
    /// Which edge: a number of [`EdgeIndex::lines`].
    pub edge: u32,
    /// How far on the way its closest point is [m].
    pub at: f64,
    /// Where on the edge the nearest point is, from its first end [m].
    pub along: f64,
    /// The shortest distance [m].
    pub distance: f64,
    /// Which way round the edge: front for counterclockwise about its direction.
    pub side: Side,
}

/// An edge that a way comes near: within reach, and where it is at a height between the ends of the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearby {
    /// Which edge: a number of [`EdgeIndex::lines`].
    pub edge: u32,
    /// Where its line and that of the way are nearest, how far on that of the way [m]: not necessarily on the way.
    pub at: f64,
    /// Their distance there [m].
    pub distance: f64,
    /// Cosine of the angle between the way and the plane normal to the edge.
    pub level: f64,
    /// The part of the way that is near: from … to [m].
    pub part: [f64; 2],
}

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
    faces: Vec<EdgeFaces>,
    air: Vec<Air>,
    /// By edge [m].
    limits: Vec<f64>,
    /// Those of one limit, the largest limit first.
    groups: Vec<Group>,
    least: f64,
    extent: f64,
}

/// Edges of one limit.
#[derive(Debug)]
struct Group {
    /// Distance beyond which they are not passed [m].
    limit: f64,
    hierarchy: Hierarchy,
}

/// A place on a way at the distance from an edge at which it passes it.
#[derive(Debug, Clone, Copy)]
struct ClosestPoint {
    position: DVec3,
    near: Near,
    distance: f64,
    /// Limit below which edges do not hide what is passed here [m].
    least_limit: f64,
}

impl EdgeIndex {
    /// The diffracting edges of `geometry` to which `limit` gives one [m], numbered in their order.
    #[must_use]
    pub fn new(geometry: &Geometry, limit: impl Fn(&Edge, &EdgeFaces) -> Option<f64>) -> Self {
        let mut regions = Regions::new(geometry);
        let (mut lines, mut all_faces, mut air, mut limits) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for edge in geometry.diffracting_edges() {
            let line = EdgeLine::new(edge.ends.map(|end| end - geometry.center()));
            let faces = regions.of(&edge.sectors[0], line.along, edge.ends[0]);
            if let Some(limit) = limit(edge, &faces) {
                lines.push(line);
                all_faces.push(faces);
                air.push(Air::new(&edge.sectors[0]));
                limits.push(limit);
            }
        }
        let least = f64::from(geometry.lift());
        let extent = f64::from(geometry.extent());
        Self { groups: groups(&lines, &limits), lines, faces: all_faces, air, limits, least, extent }
    }

    /// The faces of its edges.
    #[must_use]
    pub fn faces(&self) -> &[EdgeFaces] {
        &self.faces
    }

    /// The lines of its edges.
    #[must_use]
    pub fn lines(&self) -> &[EdgeLine] {
        &self.lines
    }

    /// Distance below which no edge is passed, nor a closest point is apart from where a way starts [m]: that by which rays leave
    /// surfaces.
    #[must_use]
    pub fn least_distance(&self) -> f64 {
        self.least
    }

    /// The first passage on a way, of edges that `counts` accepts, asked with the square of the distance [m²].
    #[must_use]
    pub fn first(
        &self,
        geometry: &Geometry,
        way: &Way,
        counts: impl Fn(u32, f64) -> bool,
    ) -> Option<EdgePass> {
        let mut behind = (way.from, u32::MAX);
        let mut rival = None;
        loop {
            let mut feet = Feet::new(self, way, &counts, behind);
            for group in &self.groups {
                feet.limit_to(group.limit);
                group.hierarchy.search(&mut feet);
            }
            let stands = |near: &&Near| {
                let least_limit = self.limits[near.edge as usize];
                self.stands(geometry, &ClosestPoint::new(way, near, least_limit), &mut rival)
            };
            if let Some(near) = feet.few.found().iter().find(stands) {
                return Some(self.edge_pass(way, near));
            }
            behind = feet.few.next()?;
        }
    }

    /// Calls `found` for all edges that a way comes near, seen or not, in an order of their own.
    pub fn nearby(&self, way: &Way, mut found: impl FnMut(Nearby)) {
        for group in &self.groups {
            let way = Way { reach: way.reach.min(group.limit), ..*way };
            group.hierarchy.search(&mut Neighbours::new(self, &way, &mut found));
        }
    }

    /// The edges nearer to `place` than `reach` [m] that may be passed there: the nearest in sight, and those farther off that no edge of their
    /// limit or a larger one hides. Their numbers, and where on them the nearest point is, from their first end [m].
    #[must_use]
    pub fn nearest(&self, geometry: &Geometry, place: DVec3, reach: f64) -> Vec<(u32, f64)> {
        let near = Near { edge: u32::MAX, ..Near::default() };
        let (mut found, mut least_limit) = (Vec::new(), 0.0);
        while let Some(next) =
            self.rival(geometry, &ClosestPoint { position: place, near, distance: reach, least_limit })
        {
            let limit = self.limits[next.edge as usize];
            if next.squared <= limit * limit {
                found.push((next.edge, next.along));
            }
            if limit >= self.groups[0].limit {
                break;
            }
            least_limit = limit.next_up();
        }
        found
    }

    fn edge_pass(&self, way: &Way, near: &Near) -> EdgePass {
        let line = &self.lines[near.edge as usize];
        let outward = way.origin + near.order * way.direction - line.point(near.along);
        let turns = line.along.cross(outward).dot(way.direction) >= 0.0;
        EdgePass {
            edge: near.edge,
            at: near.order,
            along: near.along,
            distance: near.squared.sqrt(),
            side: if turns { Side::Front } else { Side::Back },
        }
    }

    /// Whether a passage is one: its closest point sees the edge, in a sector of its air, and sees no other edge nearer. A `rival` that was
    /// seen from the closest point before is asked for first, and left there.
    ///
    /// The edge itself is looked for last: most are not the nearest.
    fn stands(&self, geometry: &Geometry, closest: &ClosestPoint, rival: &mut Option<u32>) -> bool {
        let (edge, along) = (closest.near.edge, closest.near.along);
        if !self.air_holds(closest.position, edge, along)
            || rival.is_some_and(|rival| self.is_before(geometry, closest, rival))
        {
            return false;
        }
        if let Some(found) = self.rival(geometry, closest) {
            *rival = Some(found.edge);
            return false;
        }
        self.is_clear(geometry, closest.position, edge, along)
    }

    /// Whether an edge is nearer to the closest point than the one passed, and in sight.
    #[inline]
    fn is_before(&self, geometry: &Geometry, closest: &ClosestPoint, edge: u32) -> bool {
        let (squared, along) = self.lines[edge as usize].distance_squared(closest.position);
        edge != closest.near.edge
            && self.limits[edge as usize] >= closest.least_limit
            && squared < closest.limit()
            && self.air_holds(closest.position, edge, along)
            && self.is_clear(geometry, closest.position, edge, along)
    }

    /// An edge that is nearer to the closest point than the one passed and hides it, and in sight.
    fn rival(&self, geometry: &Geometry, closest: &ClosestPoint) -> Option<Near> {
        let mut behind = top_k::BEFORE_ALL;
        loop {
            let mut competing = CompetingEdges::new(self, closest, behind);
            for group in self.groups.iter().take_while(|group| group.limit >= closest.least_limit) {
                group.hierarchy.search(&mut competing);
            }
            let is_seen = |near: &&Near| {
                self.air_holds(closest.position, near.edge, near.along)
                    && self.is_clear(geometry, closest.position, near.edge, near.along)
            };
            if let Some(near) = competing.few.found().iter().find(is_seen) {
                return Some(*near);
            }
            behind = competing.few.next()?;
        }
    }

    /// Whether an edge diffracts from its point at `along` towards a point.
    #[inline]
    fn air_holds(&self, point: DVec3, edge: u32, along: f64) -> bool {
        self.air[edge as usize].holds(point - self.lines[edge as usize].point(along))
    }

    /// Whether nothing is between a point of the air and the point at `along` of an edge.
    #[inline]
    fn is_clear(&self, geometry: &Geometry, from: DVec3, edge: u32, along: f64) -> bool {
        let point = self.lines[edge as usize].point(along);
        !geometry.is_blocked(Departure::free(from.as_vec3()), point.as_vec3())
    }
}

/// Groups of edges by limit, the largest first.
fn groups(lines: &[EdgeLine], limits: &[f64]) -> Vec<Group> {
    let mut edges: Vec<u32> = (0..lines.len() as u32).collect();
    edges.sort_by(|&a, &b| limits[b as usize].total_cmp(&limits[a as usize]).then(a.cmp(&b)));
    let alike = edges.chunk_by_mut(|&a, &b| limits[a as usize].total_cmp(&limits[b as usize]).is_eq());
    alike
        .map(|edges| Group { limit: limits[edges[0] as usize], hierarchy: Hierarchy::new(lines, edges) })
        .collect()
}

impl ClosestPoint {
    fn new(way: &Way, near: &Near, least_limit: f64) -> Self {
        let position = way.origin + near.order * way.direction;
        Self { position, near: *near, distance: near.squared.sqrt(), least_limit }
    }

    /// Square of the distance within which other edges are nearer [m²].
    fn limit(&self) -> f64 {
        self.distance * self.distance
    }
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
mod tests;
