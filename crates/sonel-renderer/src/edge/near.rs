//! The room about a receiver's images, in scenes of too many planes and edges to unfold all of it about all of them.
//!
//! An image is cut off where the straight way to it passes an edge, and is changed little by edges that it passes at a distance. So of every
//! chain of mirrors that the way meets, or nearly does, only the edges within [`Reach`] of it are unfolded.

use glam::DVec3;
use sonel_geometry::Geometry;

use super::Listening;
use super::chain::Chain;
use super::extent::Extent;
use super::mirror::PlaneMirror;
use super::reach::Reach;
use super::sight::{beyond_straight, borders};
use super::world::{Copy, RoomEdge, World};

/// What is unfolded for each receiver.
pub(super) struct Near {
    chains: Vec<Unfoldable>,
    /// Where each edge of the room is.
    edges: Vec<Extent>,
}

/// A chain of mirrors about which the room can be unfolded.
struct Unfoldable {
    chain: Chain,
    /// Whether its family begins with it, edges or not.
    is_base: bool,
    copies: Vec<Place>,
}

/// A copy of the room, and where its mirrors are.
struct Place {
    copy: Copy,
    before: Vec<Extent>,
    behind: Vec<Extent>,
}

impl Near {
    /// The `chains` of mirrors among `edges`, each after whether its family begins with it.
    #[must_use]
    pub fn new(geometry: &Geometry, edges: &[RoomEdge], chains: impl Iterator<Item = (bool, Chain)>) -> Self {
        let extents = |chain: &Chain| -> Vec<Extent> {
            chain.mirrors().iter().map(|mirror| Extent::of_plane(geometry, mirror)).collect()
        };
        let place = |copy: Copy| {
            let [before, behind] = [&copy.before, &copy.behind].map(extents);
            Place { copy, before, behind }
        };
        let unfoldable = |(is_base, chain): (bool, Chain)| {
            let copies = World::copies(&chain).into_iter().map(place).collect();
            Unfoldable { chain, is_base, copies }
        };
        let edges = edges.iter().map(|edge| Extent::of(ends(edge)));
        Self { chains: chains.map(unfoldable).collect(), edges: edges.collect() }
    }

    /// The rooms unfolded about every chain that the way to the receiver nearly meets, with those of the room's `edges` that are near it for wave
    /// numbers of at least `smallest_k` [1/m].
    #[must_use]
    pub fn rooms(&self, edges: &[RoomEdge], at: &Listening<'_>, smallest_k: f64) -> Vec<World> {
        self.chains.iter().filter_map(|chain| self.room(chain, edges, at, smallest_k)).collect()
    }

    fn room(
        &self,
        unfoldable: &Unfoldable,
        edges: &[RoomEdge],
        at: &Listening<'_>,
        smallest_k: f64,
    ) -> Option<World> {
        let (chain, copies) = (&unfoldable.chain, &unfoldable.copies);
        let [from, to] = [at.radiator.position, at.receiver];
        if !chain.is_met(from, to) {
            return None;
        }
        let reach = Reach::of(chain);
        let far = Reach::end(smallest_k);
        let ways: Vec<[DVec3; 2]> = copies.iter().map(|place| place.ways(from, to)).collect();
        let extents: Vec<Extent> = ways.iter().map(|ends| Extent::of_ways(*ends, far)).collect();
        if !copies.iter().zip(&extents).any(|(place, reach)| place.meets_mirrors(reach)) {
            return None;
        }
        let is_near = |index: usize| -> Vec<bool> {
            let of_copy = |copy: usize| {
                (reach.has_faces() || extents[copy].touches(&self.edges[index]))
                    && reach.holds(&edges[index], ways[copy], smallest_k)
                    && copies[copy].may_lead([from, to], ends(&edges[index]))
            };
            (0..copies.len()).map(of_copy).collect()
        };
        let (mut near, mut in_copies) = (Vec::new(), Vec::new());
        for (index, edge) in edges.iter().enumerate() {
            let is_near = is_near(index);
            if is_near.contains(&true) {
                near.push(*edge);
                in_copies.push(is_near);
            }
        }
        let is_wanted = unfoldable.is_base || !near.is_empty();
        is_wanted.then(|| {
            let mut world = World::near(at.geometry, &near, &in_copies, chain.clone());
            let source = chain.image(at.radiator.position);
            let borders = borders(chain, edges).into_iter().map(|(_, border)| border);
            let borders = borders.filter(|border| beyond_straight(border, source, at.receiver) < far);
            world.hidden_by = vec![borders.collect(); world.edges.len()];
            world
        })
    }
}

impl Place {
    /// Where sound seems to come from in this copy, and where it seems to go [m].
    fn ways(&self, from: DVec3, to: DVec3) -> [DVec3; 2] {
        [self.copy.before.image(from), self.copy.behind.image(to)]
    }

    /// Whether there are mirrors within `reach` next to this copy, on a way that comes through it.
    fn meets_mirrors(&self, reach: &Extent) -> bool {
        let mirrors = [&self.before, &self.behind];
        mirrors.iter().all(|mirrors| mirrors.len() < 2 && mirrors.iter().all(|extent| reach.touches(extent)))
    }

    /// Whether sound may get from the one place to an edge between `ends`, and on to the other one, as far as mirrors are concerned [m].
    fn may_lead(&self, [from, to]: [DVec3; 2], ends: [DVec3; 2]) -> bool {
        may_reach(&self.copy.before, &self.before, from, ends)
            && may_reach(&self.copy.behind, &self.behind, to, ends)
    }
}

/// Whether sound may get over the mirrors of `chain`, which are within `extents`, to an edge between `ends` [m].
pub(super) fn may_reach(chain: &Chain, extents: &[Extent], from: DVec3, ends: [DVec3; 2]) -> bool {
    let over = |order: &[usize]| {
        let mirrors: Vec<PlaneMirror> = order.iter().map(|&of| chain.mirrors()[of]).collect();
        let mut at = from;
        (0..order.len()).all(|met| {
            let mirror = &mirrors[met];
            let foot = |end: DVec3| {
                let to = mirrors[met..].iter().rev().fold(end, |point, mirror| mirror.image(point));
                let (above, below) = (mirror.height(at), -mirror.height(to));
                (above > 0.0 && below > 0.0).then(|| at + (to - at) * (above / (above + below)))
            };
            let is_there = match ends.map(foot) {
                [Some(one), Some(other)] => Extent::of([one, other]).touches(&extents[order[met]]),
                [None, None] => false,
                _ => true,
            };
            at = mirror.image(at);
            is_there
        })
    };
    let in_order: Vec<usize> = (0..extents.len()).collect();
    over(&in_order) || chain.is_either_way() && over(&[1, 0])
}

pub(super) fn ends(edge: &RoomEdge) -> [DVec3; 2] {
    [0.0, edge.wedge.length()].map(|end| edge.wedge.at(end))
}
