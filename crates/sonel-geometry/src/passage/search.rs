//! What is looked for among edges: feet on a way, and rivals about a foot.

use super::boxes::{Boxes, Ray, Search, WIDTH};
use super::few::{Few, Near};
use super::lanes::{Block, LANES};
use super::{Foot, Way};
use glam::DVec3;
use std::array::from_fn;

/// An edge whose foot is nearer to the start of a way than this part of its distance stands abreast of the start, and is not passed:
/// a distance in f32, as vertices hold it, would no longer tell the foot from the start, or from what is behind it.
const ABREAST: f64 = 2e-3;

/// The first feet on a way, of edges that `counts` accepts.
pub(super) struct Feet<'a, C> {
    way: &'a Way,
    ray: Ray,
    least_squared: f64,
    counts: C,
    /// In the order in which they are passed.
    pub few: Few,
}

impl<'a, C: Fn(u32) -> bool> Feet<'a, C> {
    /// Of edges no nearer than `least` [m], behind a foot and edge.
    pub fn new(way: &'a Way, least: f64, counts: C, behind: (f64, u32)) -> Self {
        let ray = Ray::new(way.origin, way.direction);
        Self { way, ray, least_squared: least * least, counts, few: Few::behind(behind) }
    }

    /// Where feet are still looked for: from … to [m].
    fn part(&self) -> [f64; 2] {
        [self.few.start(), self.few.limit(self.way.to)]
    }
}

impl<C: Fn(u32) -> bool> Search for Feet<'_, C> {
    #[inline]
    fn enters(&self, boxes: &Boxes) -> [bool; WIDTH] {
        boxes.beside(&self.ray, self.part(), self.way.reach)
    }

    #[inline]
    fn take(&mut self, block: &Block) {
        let near = block.approaches(self.way.origin, self.way.direction);
        let (from, to, reach_squared) = (self.few.start(), self.way.to, self.way.reach * self.way.reach);
        let is_passed: [bool; LANES] = from_fn(|lane| {
            let (at, squared) = (near.at[lane], near.squared[lane]);
            near.is_on_edge[lane]
                & (at >= from)
                & (at < to)
                & (squared >= self.least_squared)
                & (squared <= reach_squared)
                & (at * at >= ABREAST * ABREAST * squared)
        });
        for lane in (0..LANES).filter(|&lane| is_passed[lane]) {
            let edge = block.edges[lane];
            if (self.counts)(edge) {
                let (order, along, squared) = (near.at[lane], near.along[lane], near.squared[lane]);
                self.few.offer(Near { order, edge, along, squared });
            }
        }
    }
}

/// The edges nearest to a foot, of those nearer than the one that is passed there.
pub(super) struct Rivals {
    position: DVec3,
    edge: u32,
    limit: f64,
    /// In the order of their distances.
    pub few: Few,
}

impl Rivals {
    /// Those behind a square of a distance and an edge.
    pub fn new(foot: &Foot, behind: (f64, u32)) -> Self {
        let (position, edge) = (foot.position, foot.near.edge);
        Self { position, edge, limit: foot.limit(), few: Few::behind(behind) }
    }
}

impl Search for Rivals {
    #[inline]
    fn enters(&self, boxes: &Boxes) -> [bool; WIDTH] {
        boxes.about(self.position, self.few.limit(self.limit))
    }

    #[inline]
    fn take(&mut self, block: &Block) {
        let near = block.distances(self.position);
        for lane in 0..block.count {
            let (squared, edge) = (near.squared[lane], block.edges[lane]);
            if squared < self.limit && edge != self.edge {
                self.few.offer(Near { order: squared, edge, along: near.along[lane], squared });
            }
        }
    }
}
