//! A wide bounding volume hierarchy over blocks of triangles.
//!
//! obvhs builds the binary tree; here it is collapsed so that one node holds the boxes of several children, tested
//! together like the lanes of a block. Its own traversal is not used: neither its triangle test nor its box test is
//! conservative. Here boxes are padded by more than any rounding in the triangle test, and the slab test allows for
//! its own relative rounding [Ize2013], so that no box hides a triangle the block would accept.

use crate::block::{Block, Facet, greater};
use crate::probe::Probe;
use glam::{Vec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use smallvec::SmallVec;
use std::time::Duration;

/// Children of a node: two registers of four lanes per bound.
const WIDTH: usize = 8;
/// Triangles of a leaf: one register.
const LEAF_LANES: usize = 4;
/// Number of triangles above which only [`REINSERTED_OF_MANY`] is inserted anew: all would take a quarter of the time to load them, and rays
/// are hardly faster after it.
const MANY: usize = 200_000;
const REINSERTED_OF_MANY: f32 = 0.02;
/// Marks a child that is a leaf.
const LEAF: u32 = 1 << 31;
/// Bounds of (b − o) · i with three roundings, taken at both ends of the slab [Ize2013].
const SLAB_SLACK: f32 = 1.0 + 6.0 * f32::EPSILON;

/// The hierarchy; node 0 is the root.
pub(crate) struct Tree {
    nodes: Vec<Node>,
    leaves: Vec<Block<LEAF_LANES>>,
}

struct Node {
    /// By axis, lower or upper bound, and child; absent children have inverted bounds.
    bounds: [[[f32; WIDTH]; 2]; 3],
    children: [u32; WIDTH],
}

impl Boundable for Facet {
    fn aabb(&self) -> Aabb {
        let [a, b, c] = self.corners.map(Vec3A::from);
        Aabb { min: a.min(b).min(c), max: a.max(b).max(c) }
    }
}

impl Tree {
    /// Builds the hierarchy over at least two triangles, with boxes padded by `padding` [m].
    pub(crate) fn build(facets: &[Facet], padding: f32) -> Self {
        // One triangle a leaf, since blocks are filled below; no spatial splits, whose parts would each need padding.
        // The thorough build pays: where walls are finely tessellated the quick ones visit ten times the nodes.
        let share = if facets.len() > MANY { REINSERTED_OF_MANY } else { 1.0 };
        let parameters = BvhBuildParams {
            pre_split: false,
            max_prims_per_leaf: 1,
            reinsertion_batch_ratio: share,
            ..BvhBuildParams::very_slow_build()
        };
        let binary = build_bvh2(facets, parameters, &mut Duration::default());
        let mut counts = vec![0; binary.nodes.len()];
        count(&binary, 0, &mut counts);
        let mut tree = Self { nodes: Vec::new(), leaves: Vec::new() };
        let mut collapse = Collapse { binary: &binary, counts: &counts, facets, padding, tree: &mut tree };
        collapse.node(0);
        tree
    }

    /// Visits leaves on the ray from near to far; `visit` returns the distance beyond which nothing is wanted.
    #[inline(always)]
    pub(crate) fn nearest(&self, ray: &Probe, visit: impl FnMut(&Block<LEAF_LANES>) -> f64) {
        let slabs = Slabs::new(ray);
        self.near_to_far(|node, limit| node.enter(&slabs, limit), visit);
    }

    /// Visits leaves about a local position [m] from near to far; `visit` returns the distance beyond which nothing is wanted.
    pub(crate) fn around(&self, point: Vec3, visit: impl FnMut(&Block<LEAF_LANES>) -> f64) {
        self.near_to_far(|node, limit| node.distances(point, limit), visit);
    }

    /// Visits leaves from near to far, where `enter` gives the distances of the boxes in a node and marks those within a limit.
    #[inline(always)]
    fn near_to_far(
        &self,
        enter: impl Fn(&Node, f32) -> ([f32; WIDTH], u32),
        mut visit: impl FnMut(&Block<LEAF_LANES>) -> f64,
    ) {
        let mut limit = f32::INFINITY;
        let mut stack = TraversalStack::new();
        let mut next = Some(StackEntry { child: 0, distance: 0.0 });
        while let Some(entry) = next {
            if entry.distance > limit {
                next = stack.pop();
                continue;
            }
            if entry.child & LEAF != 0 {
                limit = round_up(visit(&self.leaves[(entry.child & !LEAF) as usize]));
                next = stack.pop();
                continue;
            }
            let node = &self.nodes[entry.child as usize];
            let (near, mut met) = enter(node, limit);
            // Most nodes are left by one or two children: the nearest is visited at once, the others wait, nearest on top.
            let first = stack.len();
            next = None;
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                met &= met - 1;
                let mut entry = StackEntry { child: node.children[lane], distance: near[lane] };
                match &mut next {
                    None => next = Some(entry),
                    Some(nearest) => {
                        if entry.distance < nearest.distance {
                            std::mem::swap(nearest, &mut entry);
                        }
                        insert_in_order(&mut stack, entry, first);
                    }
                }
            }
            if next.is_none() {
                next = stack.pop();
            }
        }
    }

    /// Whether `visit` is true for any leaf between the ray's origin and the tip of its direction.
    #[inline(always)]
    pub(crate) fn any(&self, ray: &Probe, mut visit: impl FnMut(&Block<LEAF_LANES>) -> bool) -> bool {
        let slabs = Slabs::new(ray);
        let limit = round_up(1.0);
        let mut stack = TraversalStack::new();
        let mut next = Some(StackEntry { child: 0, distance: 0.0 });
        while let Some(entry) = next {
            if entry.child & LEAF != 0 {
                if visit(&self.leaves[(entry.child & !LEAF) as usize]) {
                    return true;
                }
                next = stack.pop();
                continue;
            }
            let node = &self.nodes[entry.child as usize];
            let (_, mut met) = node.enter(&slabs, limit);
            next = None;
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                met &= met - 1;
                if let Some(waits) = next.replace(StackEntry { child: node.children[lane], distance: 0.0 }) {
                    stack.push(waits);
                }
            }
            if next.is_none() {
                next = stack.pop();
            }
        }
        false
    }

    /// Visits every leaf whose box meets that from `low` to `high`.
    pub(crate) fn within(&self, low: Vec3, high: Vec3, mut visit: impl FnMut(&Block<LEAF_LANES>)) {
        let mut open = vec![0];
        while let Some(index) = open.pop() {
            if index & LEAF != 0 {
                visit(&self.leaves[(index & !LEAF) as usize]);
                continue;
            }
            let node = &self.nodes[index as usize];
            let met = (0..WIDTH).filter(|&lane| node.meets(lane, low, high));
            open.extend(met.map(|lane| node.children[lane]));
        }
    }
}

/// A distance as `f32`, not below what it was.
fn round_up(distance: f64) -> f32 {
    (distance as f32) * SLAB_SLACK
}

impl Node {
    /// Whether a child's box and that from `low` to `high` have a point in common.
    fn meets(&self, lane: usize, low: Vec3, high: Vec3) -> bool {
        let bounds = &self.bounds;
        (0..3).all(|axis| bounds[axis][0][lane] <= high[axis] && low[axis] <= bounds[axis][1][lane])
    }

    /// Distance of a point from each child's box, and the children, as bits, that are within `limit`.
    fn distances(&self, point: Vec3, limit: f32) -> ([f32; WIDTH], u32) {
        let mut squares = [0.0; WIDTH];
        for axis in 0..3 {
            let [low, high] = &self.bounds[axis];
            for lane in 0..WIDTH {
                let beside = greater(greater(low[lane] - point[axis], point[axis] - high[lane]), 0.0);
                squares[lane] += beside * beside;
            }
        }
        let distances = squares.map(f32::sqrt);
        let is_within = |lane: usize| distances[lane] < f32::INFINITY && distances[lane] <= limit;
        (distances, (0..WIDTH).map(|lane| u32::from(is_within(lane)) << lane).sum())
    }

    /// Distance at which the ray enters each child's box, and the children, as bits, whose boxes it enters before `limit`.
    #[inline(always)]
    fn enter(&self, slabs: &Slabs, limit: f32) -> ([f32; WIDTH], u32) {
        let mut entry = [0.0; WIDTH];
        let mut met = 0;
        for half in 0..WIDTH / 4 {
            let lanes = 4 * half..4 * half + 4;
            let distance = |axis: usize, bound: usize| {
                let planes = Vec4::from_slice(&self.bounds[axis][bound][lanes.clone()]);
                (planes - slabs.origin[axis]) * slabs.inverse[axis]
            };
            let near = |axis: usize| distance(axis, slabs.near[axis]);
            let far = |axis: usize| distance(axis, 1 - slabs.near[axis]);
            let enters = near(0).max(near(1)).max(near(2).max(Vec4::ZERO));
            let leaves = far(0).min(far(1)).min(far(2).min(Vec4::splat(limit)));
            enters.write_to_slice(&mut entry[lanes.clone()]);
            met |= enters.cmple(leaves * SLAB_SLACK).bitmask() << lanes.start;
        }
        (entry, met)
    }
}

/// Numbers of a ray that the boxes need, in all lanes.
struct Slabs {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
    near: [usize; 3],
}

impl Slabs {
    #[inline(always)]
    fn new(ray: &Probe) -> Self {
        let lanes = |vector: Vec3| vector.to_array().map(Vec4::splat);
        Self { origin: lanes(ray.origin), inverse: lanes(ray.inverse), near: ray.near }
    }
}

/// A subtree still to be visited.
#[derive(Clone, Copy, Default)]
struct StackEntry {
    child: u32,
    distance: f32,
}

/// Entries on the way: depth 9 with seven siblings waiting at each level, 8⁹ triangles in a balanced tree, without an allocation.
type TraversalStack = SmallVec<[StackEntry; 64]>;

/// Inserts an entry below those nearer among the entries from place `first` on.
#[inline(always)]
fn insert_in_order(stack: &mut TraversalStack, entry: StackEntry, first: usize) {
    let farther = stack[first..].iter().rev().take_while(|waits| waits.distance < entry.distance).count();
    stack.insert(stack.len() - farther, entry);
}

/// Triangles below each node of the binary tree.
fn count(binary: &Bvh2, root: usize, counts: &mut [u32]) {
    // Children first: the order of a depth-first walk, reversed.
    let mut order = vec![root];
    let mut next = 0;
    while next < order.len() {
        let node = &binary.nodes[order[next]];
        if !node.is_leaf() {
            order.extend([node.first_index as usize, node.first_index as usize + 1]);
        }
        next += 1;
    }
    for &index in order.iter().rev() {
        let node = &binary.nodes[index];
        counts[index] = if node.is_leaf() {
            node.prim_count
        } else {
            counts[node.first_index as usize] + counts[node.first_index as usize + 1]
        };
    }
}

/// The binary tree on its way to the wide one.
struct Collapse<'a> {
    binary: &'a Bvh2,
    counts: &'a [u32],
    facets: &'a [Facet],
    padding: f32,
    tree: &'a mut Tree,
}

impl Collapse<'_> {
    /// Appends the wide node for a binary one and everything below; returns its index.
    fn node(&mut self, root: usize) -> u32 {
        let index = self.tree.nodes.len();
        let mut bounds = [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3];
        self.tree.nodes.push(Node { bounds, children: [LEAF; WIDTH] });
        let mut children = [LEAF; WIDTH];
        for (lane, below) in self.children(root).into_iter().enumerate() {
            let aabb = self.binary.nodes[below].aabb();
            let (low, high) = (Vec3::from(aabb.min) - self.padding, Vec3::from(aabb.max) + self.padding);
            for axis in 0..3 {
                bounds[axis][0][lane] = low[axis];
                bounds[axis][1][lane] = high[axis];
            }
            children[lane] = if self.is_leaf(below) { self.leaf(below) } else { self.node(below) };
        }
        self.tree.nodes[index] = Node { bounds, children };
        index as u32
    }

    /// Up to [`WIDTH`] binary nodes that together hold what `root` holds: the largest boxes are opened first.
    fn children(&self, root: usize) -> Vec<usize> {
        let mut children = vec![root];
        while children.len() < WIDTH {
            let open = |&place: &usize| !self.is_leaf(children[place]);
            let area = |&place: &usize| self.binary.nodes[children[place]].aabb().half_area();
            let Some(largest) = (0..children.len()).filter(open).max_by(|a, b| area(a).total_cmp(&area(b)))
            else {
                break;
            };
            let first = self.binary.nodes[children[largest]].first_index as usize;
            children[largest] = first;
            children.push(first + 1);
        }
        children
    }

    fn is_leaf(&self, node: usize) -> bool {
        self.counts[node] as usize <= LEAF_LANES
    }

    /// Appends the block of all triangles below a binary node.
    fn leaf(&mut self, root: usize) -> u32 {
        let mut facets = Vec::with_capacity(LEAF_LANES);
        let mut open = vec![root];
        while let Some(index) = open.pop() {
            let node = &self.binary.nodes[index];
            if node.is_leaf() {
                let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                let triangles = &self.binary.primitive_indices[range];
                facets.extend(triangles.iter().map(|&primitive| self.facets[primitive as usize]));
            } else {
                open.extend([node.first_index as usize, node.first_index as usize + 1]);
            }
        }
        self.tree.leaves.push(Block::new(&facets));
        LEAF | (self.tree.leaves.len() - 1) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stack_keeps_its_order_beyond_the_usual_depth() {
        let mut stack = TraversalStack::new();
        for round in 0..3 {
            for child in 0..200 {
                stack.push(StackEntry { child, distance: 0.0 });
            }
            for child in (round * 10..200).rev() {
                assert_eq!(stack.pop().map(|entry| entry.child), Some(child));
            }
            while stack.pop().is_some() {}
        }
        assert!(stack.pop().is_none());
    }

    #[test]
    fn every_triangle_is_in_one_leaf_and_within_its_boxes() {
        let corner = |i: u32, k: u32| {
            let turn = |n: u32| (i.wrapping_mul(n) % 1009) as f32 / 100.0;
            Vec3::new(turn(37), turn(101), turn(211)) + 0.3 * Vec3::AXES[k as usize]
        };
        let facets: Vec<Facet> = (0..1000)
            .map(|i| Facet {
                corners: [0, 1, 2].map(|k| corner(i, k)),
                triangle: i,
                plane: crate::PlaneId(i),
            })
            .collect();
        let tree = Tree::build(&facets, 1e-3);
        let mut seen = vec![0; 1000];
        let mut open = vec![(0u32, Vec3::NEG_INFINITY, Vec3::INFINITY)];
        while let Some((child, low, high)) = open.pop() {
            if child & LEAF != 0 {
                for triangle in tree.leaves[(child & !LEAF) as usize].triangles() {
                    seen[triangle as usize] += 1;
                    let inside = |v: &Vec3| v.cmpgt(low).all() && v.cmplt(high).all();
                    assert!(facets[triangle as usize].corners.iter().all(inside));
                }
                continue;
            }
            let node = &tree.nodes[child as usize];
            for lane in (0..WIDTH).filter(|&lane| node.bounds[0][0][lane] < f32::INFINITY) {
                let bound = |side: usize| Vec3::from([0, 1, 2].map(|axis| node.bounds[axis][side][lane]));
                open.push((node.children[lane], low.max(bound(0)), high.min(bound(1))));
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
    }
}
