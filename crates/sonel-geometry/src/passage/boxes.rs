//! Boxes about blocks of edges, eight to a node: what a search need not look at.
//!
//! A box is left out only if nothing in it can be found. Boxes are larger than what is in them by a padding that no rounding of a
//! test exceeds.

use super::lanes::{Block, LANES};
use super::line::EdgeLine;
use glam::DVec3;
use std::array::from_fn;

/// Children of a node.
pub(super) const WIDTH: usize = 8;
/// Marks a child that is a block.
const BLOCK: u32 = 1 << 31;
/// Component of a direction below which it is taken as this [1], so that its inverse is finite.
const LEAST_SLOPE: f64 = 1e-20;

/// The boxes of a node, by axis and child.
#[derive(Debug, Clone)]
pub(super) struct Boxes {
    low: [[f64; WIDTH]; 3],
    high: [[f64; WIDTH]; 3],
}

#[derive(Debug)]
struct Node {
    boxes: Boxes,
    children: Vec<u32>,
}

/// Blocks of edges in a hierarchy of boxes; node 0 is the root.
#[derive(Debug)]
pub(super) struct Hierarchy {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

/// What looks for edges.
pub(super) trait Search {
    /// Which boxes may hold what is looked for.
    fn enters(&self, boxes: &Boxes) -> [bool; WIDTH];
    /// Takes what is looked for from a block.
    fn take(&mut self, block: &Block);
}

/// A straight line made ready for boxes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    origin: DVec3,
    direction: DVec3,
    inverse: DVec3,
}

impl Ray {
    /// From `origin` in a unit `direction`.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let inverse = |slope: f64| 1.0 / if slope.abs() < LEAST_SLOPE { LEAST_SLOPE } else { slope };
        let inverse = DVec3::from_array(direction.to_array().map(inverse));
        Self { origin, direction, inverse }
    }
}

impl Boxes {
    /// Which boxes may hold a point that is within `reach` of the part `from` … `to` of a ray and square to it from there: between the planes across
    /// the ray at both ends, and in a box that, grown by the reach, the part passes through.
    #[inline]
    pub fn beside(&self, ray: &Ray, [from, to]: [f64; 2], reach: f64) -> [bool; WIDTH] {
        let (mut nearest, mut farthest) = ([0.0; WIDTH], [0.0; WIDTH]);
        let (mut enter, mut leave) = ([from; WIDTH], [to; WIDTH]);
        for axis in 0..3 {
            let (origin, direction, inverse) = (ray.origin[axis], ray.direction[axis], ray.inverse[axis]);
            for lane in 0..WIDTH {
                let (low, high) = (self.low[axis][lane] - origin, self.high[axis][lane] - origin);
                let (one, other) = (low * direction, high * direction);
                nearest[lane] += if one < other { one } else { other };
                farthest[lane] += if one < other { other } else { one };
                let (one, other) = ((low - reach) * inverse, (high + reach) * inverse);
                let (near, far) = if one < other { (one, other) } else { (other, one) };
                enter[lane] = if near > enter[lane] { near } else { enter[lane] };
                leave[lane] = if far < leave[lane] { far } else { leave[lane] };
            }
        }
        from_fn(|lane| (enter[lane] <= leave[lane]) & (nearest[lane] <= to) & (farthest[lane] >= from))
    }

    /// Which boxes come nearer to a point than the square of a distance [m²].
    #[inline]
    pub fn about(&self, point: DVec3, squared: f64) -> [bool; WIDTH] {
        let mut sum = [0.0; WIDTH];
        for axis in 0..3 {
            for lane in 0..WIDTH {
                let (below, above) =
                    (self.low[axis][lane] - point[axis], point[axis] - self.high[axis][lane]);
                let outside = if below > above { below } else { above };
                let outside = if outside > 0.0 { outside } else { 0.0 };
                sum[lane] += outside * outside;
            }
        }
        from_fn(|lane| sum[lane] < squared)
    }
}

impl Hierarchy {
    /// A hierarchy of the edges along `lines`, with boxes padded by `padding` [m].
    pub fn new(lines: &[EdgeLine], padding: f64) -> Self {
        let mut hierarchy = Self { nodes: Vec::new(), blocks: Vec::new() };
        let mut edges: Vec<u32> = (0..lines.len() as u32).collect();
        hierarchy.node(&mut edges, &Division { lines, padding });
        hierarchy
    }

    /// Shows `search` the blocks in all boxes that it enters.
    #[inline]
    pub fn search(&self, search: &mut impl Search) {
        self.search_below(0, search);
    }

    fn search_below(&self, node: u32, search: &mut impl Search) {
        let node = &self.nodes[node as usize];
        let enters = search.enters(&node.boxes);
        for (&child, enters) in node.children.iter().zip(enters) {
            if enters {
                if child & BLOCK == 0 {
                    self.search_below(child, search);
                } else {
                    search.take(&self.blocks[(child & !BLOCK) as usize]);
                }
            }
        }
    }

    /// Appends the node for `edges` and everything below; returns its number.
    fn node(&mut self, edges: &mut [u32], division: &Division<'_>) -> u32 {
        let number = self.nodes.len();
        let boxes = Boxes { low: [[0.0; WIDTH]; 3], high: [[0.0; WIDTH]; 3] };
        self.nodes.push(Node { boxes, children: Vec::new() });
        for (lane, part) in division.parts(edges).into_iter().enumerate() {
            let (low, high) = division.bounds(part);
            let child = if part.len() <= LANES {
                self.blocks.push(Block::new(part, division.lines));
                (self.blocks.len() - 1) as u32 | BLOCK
            } else {
                self.node(part, division)
            };
            let node = &mut self.nodes[number];
            node.children.push(child);
            for axis in 0..3 {
                node.boxes.low[axis][lane] = low[axis];
                node.boxes.high[axis][lane] = high[axis];
            }
        }
        number as u32
    }
}

/// How edges are divided among boxes.
struct Division<'a> {
    lines: &'a [EdgeLine],
    padding: f64,
}

impl Division<'_> {
    /// The box about `edges`, padded.
    fn bounds(&self, edges: &[u32]) -> (DVec3, DVec3) {
        let ends = || {
            let lines = edges.iter().map(|&edge| &self.lines[edge as usize]);
            lines.flat_map(|line| [line.origin, line.point(line.length)])
        };
        let low = ends().fold(DVec3::INFINITY, DVec3::min) - self.padding;
        (low, ends().fold(DVec3::NEG_INFINITY, DVec3::max) + self.padding)
    }

    /// At most [`WIDTH`] parts of `edges`, none of which need be divided while others are larger: the largest is halved along the
    /// longest side of its box.
    fn parts<'a>(&self, edges: &'a mut [u32]) -> Vec<&'a mut [u32]> {
        let mut parts = vec![edges];
        while parts.len() < WIDTH {
            let Some(largest) = (0..parts.len()).max_by_key(|&part| parts[part].len()) else { break };
            if parts[largest].len() <= LANES {
                break;
            }
            let (one, other) = self.halves(parts.swap_remove(largest));
            parts.extend([one, other]);
        }
        parts.retain(|part| !part.is_empty());
        parts
    }

    fn halves<'a>(&self, edges: &'a mut [u32]) -> (&'a mut [u32], &'a mut [u32]) {
        let (low, high) = self.bounds(edges);
        let axis = (high - low).max_position();
        let middle = |edge: u32| {
            let line = &self.lines[edge as usize];
            line.point(0.5 * line.length)[axis]
        };
        edges.sort_by(|&a, &b| middle(a).total_cmp(&middle(b)).then(a.cmp(&b)));
        edges.split_at_mut(edges.len() / 2)
    }
}
