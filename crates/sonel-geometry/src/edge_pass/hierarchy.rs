//! Blocks of edges in a hierarchy of boxes.

use super::boxes::{Bounds, Boxes, QUAD};
use super::lanes::{Block, LANES};
use super::line::EdgeLine;
use super::question::lanes;
use glam::DVec3;

/// Children of a node.
const WIDTH: usize = 2 * QUAD;
/// Marks a child that is a block.
const BLOCK: u32 = 1 << 31;

#[derive(Debug)]
struct Node {
    boxes: [Boxes; 2],
    children: [u32; WIDTH],
}

/// Blocks of edges below nodes; node 0 is the root.
#[derive(Debug)]
pub(super) struct Hierarchy {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

/// What looks for edges.
pub(super) trait Search {
    /// Which boxes may hold what is looked for, one bit each.
    fn enters(&self, boxes: &Boxes) -> u32;
    /// Takes what is looked for from a block.
    fn take(&mut self, block: &Block);
}

impl Hierarchy {
    /// A hierarchy of some `edges` of those along `lines`, which it sorts.
    pub fn new(lines: &[EdgeLine], edges: &mut [u32]) -> Self {
        let mut hierarchy = Self { nodes: Vec::new(), blocks: Vec::new() };
        hierarchy.node(edges, lines);
        hierarchy
    }

    /// Shows `search` the blocks in all boxes that it enters.
    #[inline]
    pub fn search(&self, search: &mut impl Search) {
        match &self.blocks[..] {
            [only] => search.take(only),
            _ => self.search_below(0, search),
        }
    }

    fn search_below(&self, node: u32, search: &mut impl Search) {
        let node = &self.nodes[node as usize];
        let [some, others] = &node.boxes;
        for lane in lanes(search.enters(some) | search.enters(others) << QUAD) {
            let child = node.children[lane];
            if child & BLOCK == 0 {
                self.search_below(child, search);
            } else {
                search.take(&self.blocks[(child & !BLOCK) as usize]);
            }
        }
    }

    /// Appends the node for `edges` and everything below; returns its number.
    fn node(&mut self, edges: &mut [u32], lines: &[EdgeLine]) -> u32 {
        let parts = parts(edges, lines);
        let bounds: Vec<Bounds> = parts.iter().map(|part| bounds(part, lines)).collect();
        let (some, others) = bounds.split_at(bounds.len().min(QUAD));
        let number = self.nodes.len();
        self.nodes.push(Node { boxes: [some, others].map(Boxes::new), children: [0; WIDTH] });
        for (lane, part) in parts.into_iter().enumerate() {
            self.nodes[number].children[lane] = if part.len() <= LANES {
                self.blocks.push(Block::new(part, lines));
                (self.blocks.len() - 1) as u32 | BLOCK
            } else {
                self.node(part, lines)
            };
        }
        number as u32
    }
}

/// The box about `edges`.
fn bounds(edges: &[u32], lines: &[EdgeLine]) -> Bounds {
    let lines = || edges.iter().map(|&edge| &lines[edge as usize]);
    let ends = || lines().flat_map(|line| [line.origin, line.point(line.length)]);
    let aside =
        lines().map(|line| (1.0 - line.along * line.along).max(DVec3::ZERO)).fold(DVec3::ZERO, DVec3::max);
    Bounds {
        low: ends().fold(DVec3::INFINITY, DVec3::min),
        high: ends().fold(DVec3::NEG_INFINITY, DVec3::max),
        aside: DVec3::from_array(aside.to_array().map(f64::sqrt)),
    }
}

/// At most [`WIDTH`] parts of `edges`, the largest of which is halved as long as it has more than fit below one child.
fn parts<'a>(edges: &'a mut [u32], lines: &[EdgeLine]) -> Vec<&'a mut [u32]> {
    let mut room = LANES;
    while room * WIDTH < edges.len() {
        room *= WIDTH;
    }
    let mut parts = vec![edges];
    while parts.len() < WIDTH {
        let largest = (0..parts.len()).max_by_key(|&part| parts[part].len()).unwrap_or(0);
        if parts[largest].len() <= room {
            break;
        }
        let (one, other) = halves(parts.swap_remove(largest), lines);
        parts.extend([one, other]);
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// Edges along one axis and others while there are both, else those on both sides of the middle.
fn halves<'a>(edges: &'a mut [u32], lines: &[EdgeLine]) -> (&'a mut [u32], &'a mut [u32]) {
    let axis = |edge: u32| lines[edge as usize].along.abs().max_position();
    edges.sort_by_key(|&edge| (axis(edge), edge));
    let first = axis(edges[0]);
    let alike = edges.partition_point(|&edge| axis(edge) == first);
    if alike < edges.len() {
        return edges.split_at_mut(alike);
    }
    let Bounds { low, high, .. } = bounds(edges, lines);
    let longest = (high - low).max_position();
    let middle = |edge: u32| {
        let line = &lines[edge as usize];
        line.point(0.5 * line.length)[longest]
    };
    edges.sort_by(|&a, &b| middle(a).total_cmp(&middle(b)).then(a.cmp(&b)));
    edges.split_at_mut(edges.len() / 2)
}
