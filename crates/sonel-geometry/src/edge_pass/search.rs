//! What is looked for among edges: feet on a way, competing about a closest point, and all that a way comes near.

use super::boxes::Boxes;
use super::hierarchy::Search;
use super::lanes::Block;
use super::question::{Point, Ray};
use super::top_k::{Near, TopK};
use super::{ClosestPoint, EdgeIndex, Nearby, Way};
use glam::DVec3;

/// An edge whose closest point is nearer to the start of a way than this part of its distance stands abreast of the start, and is not passed:
/// a distance in f32, as vertices hold it, would no longer tell the closest point from the start, or from what is behind it.
const ABREAST: f64 = 2e-3;

/// Feet looked for at a time: of most ways one of the first is passed.
const FEET: usize = 8;
/// CompetingEdges looked for at a time: one of the nearest is in sight most often.
const RIVALS: usize = 4;

/// The first feet on a way, of edges that `counts` accepts.
pub(super) struct Feet<'a, C> {
    index: &'a EdgeIndex,
    way: &'a Way,
    ray: Ray,
    /// Square of the largest distance [m²].
    within: f64,
    counts: C,
    /// In the order in which they are passed.
    pub few: TopK<FEET>,
}

impl<'a, C: Fn(u32, f64) -> bool> Feet<'a, C> {
    /// Those behind a closest point and edge.
    pub fn new(index: &'a EdgeIndex, way: &'a Way, counts: C, behind: (f64, u32)) -> Self {
        let ray = Ray::new(way.origin, way.direction, way.to, way.reach, index.extent);
        Self { index, way, ray, within: way.reach * way.reach, counts, few: TopK::behind(behind) }
    }

    /// Goes on with edges of another limit [m].
    pub fn limit_to(&mut self, limit: f64) {
        let reach = self.way.reach.min(limit);
        (self.ray.reach, self.within) = (reach as f32, reach * reach);
    }

    /// Where feet are still looked for: from … to [m].
    #[inline]
    fn part(&self) -> [f32; 2] {
        [self.few.start() as f32, self.few.limit(self.way.to) as f32]
    }
}

impl<C: Fn(u32, f64) -> bool> Search for Feet<'_, C> {
    #[inline]
    fn enters(&self, boxes: &Boxes) -> u32 {
        boxes.beside(&self.ray, self.part())
    }

    #[inline]
    fn take(&mut self, block: &Block) {
        let way = self.way;
        for edge in block.beside(&self.ray, self.part()) {
            let line = &self.index.lines[edge as usize];
            let Some((at, along, squared)) = line.nearest(way.origin, way.direction) else { continue };
            let is_on_both = at < way.to && along > 0.0 && along < line.length;
            let is_apart =
                squared >= self.index.least * self.index.least && at * at >= ABREAST * ABREAST * squared;
            if is_on_both && is_apart && squared <= self.within && (self.counts)(edge, squared) {
                self.few.offer(Near { order: at, edge, along, squared });
            }
        }
    }
}

/// The edges nearest to a closest point, of those nearer than the one that is passed there.
pub(super) struct CompetingEdges<'a> {
    index: &'a EdgeIndex,
    position: DVec3,
    point: Point,
    edge: u32,
    limit: f64,
    /// In the order of their distances.
    pub few: TopK<RIVALS>,
}

impl<'a> CompetingEdges<'a> {
    /// Those behind a square of a distance and an edge.
    pub fn new(index: &'a EdgeIndex, closest: &ClosestPoint, behind: (f64, u32)) -> Self {
        let point = Point::new(closest.position, index.extent);
        let (position, edge, limit) = (closest.position, closest.near.edge, closest.limit());
        Self { index, position, point, edge, limit, few: TopK::behind(behind) }
    }

    /// Square of the distance within which competing are still looked for [m²], never less for being in f32.
    #[inline]
    fn within(&self) -> f32 {
        self.few.limit(self.limit) as f32 * (1.0 + 4.0 * f32::EPSILON)
    }
}

impl Search for CompetingEdges<'_> {
    #[inline]
    fn enters(&self, boxes: &Boxes) -> u32 {
        boxes.about(&self.point, self.within())
    }

    #[inline]
    fn take(&mut self, block: &Block) {
        for edge in block.about(&self.point, self.within()) {
            let (squared, along) = self.index.lines[edge as usize].distance_squared(self.position);
            if squared < self.limit && edge != self.edge {
                self.few.offer(Near { order: squared, edge, along, squared });
            }
        }
    }
}

/// All edges that a way comes near.
pub(super) struct Neighbours<'a, F> {
    index: &'a EdgeIndex,
    way: &'a Way,
    ray: Ray,
    found: F,
}

impl<'a, F: FnMut(Nearby)> Neighbours<'a, F> {
    pub fn new(index: &'a EdgeIndex, way: &'a Way, found: F) -> Self {
        let ray = Ray::new(way.origin, way.direction, way.to, way.reach, index.extent);
        Self { index, way, ray, found }
    }
}

impl<F: FnMut(Nearby)> Search for Neighbours<'_, F> {
    #[inline]
    fn enters(&self, boxes: &Boxes) -> u32 {
        boxes.abreast(&self.ray, [self.way.from as f32, self.way.to as f32])
    }

    #[inline]
    fn take(&mut self, block: &Block) {
        for edge in block.all() {
            if let Some(nearby) = self.index.lines[edge as usize].nearby(edge, self.way) {
                (self.found)(nearby);
            }
        }
    }
}
