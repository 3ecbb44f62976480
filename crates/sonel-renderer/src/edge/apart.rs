//! Pairs of parallel edges that lie in no common face and see one another: of different objects, an object and its image among them.
//!
//! Such an edge hides the other from a receiver all at once, so what comes over the other has to be diffracted at it. Edges that are not
//! parallel hide one another point by point, and nothing begins at once. What is hidden comes over one edge of an object, or over
//! that and a parallel one of a face of it.

use std::sync::Arc;

use glam::DVec3;

use super::passage::{Border, CORNER, LIMIT, Passage};
use super::world::RoomEdge;

/// Sine of the angle within which edges count as parallel [1]: one of them then still hides the other within centimetres.
pub(super) const NEARLY: f64 = 0.01;
/// Shares of the lengths of two edges at which each has to see the other.
const SEEN_AT: [f64; 3] = [0.125, 0.5, 0.875];

/// A way over two edges that see one another, and over those beyond them.
#[derive(Debug, Clone)]
pub(crate) struct Apart {
    pub sides: [Shore; 2],
}

/// One side of the air between two edges.
#[derive(Debug, Clone)]
pub(crate) struct Shore {
    /// The edge at the air.
    pub edge: usize,
    /// One that is parallel to it and joined to it by a face.
    pub beyond: Option<Joined>,
    /// The edges of the outer one's faces over which other ways go on.
    pub known: Arc<[usize]>,
}

/// An edge that is joined to another one by a face.
#[derive(Debug, Clone)]
pub(crate) struct Joined {
    pub edge: usize,
    /// Whether the face is the second one of this edge, and whether it is that of the other.
    pub at_second: [bool; 2],
    /// As that of a [`Passage`].
    pub outline: Arc<[[DVec3; 2]]>,
}

impl Apart {
    /// All edges that it goes over.
    pub fn edges(&self) -> Vec<usize> {
        let of = |side: &Shore| [Some(side.edge), side.beyond.as_ref().map(|joined| joined.edge)];
        self.sides.iter().flat_map(of).flatten().collect()
    }

    /// The edge at the air across from `edge`, if that is at the other side of it.
    pub fn across(&self, edge: usize) -> Option<usize> {
        let [one, other] = self.sides.each_ref().map(|side| side.edge);
        if one == edge { Some(other) } else { (other == edge).then_some(one) }
    }

    /// Whether it goes over no edges beyond.
    pub fn is_short(&self) -> bool {
        self.sides.iter().all(|side| side.beyond.is_none())
    }
}

impl Shore {
    /// The edge that its end sees.
    pub fn outer(&self) -> usize {
        self.beyond.as_ref().map_or(self.edge, |joined| joined.edge)
    }
}

/// A place on an edge: its index, where it is [m], and the direction into the air there.
pub(crate) type Outlook = (usize, DVec3, DVec3);

/// Pairs of edges that see one another.
#[derive(Debug, Clone, Default)]
pub(crate) struct Pairs {
    /// All ways over those that see one another all along.
    pub ways: Vec<Apart>,
    /// Those that do so in places, over which none go.
    pub partly: Vec<[usize; 2]>,
}

/// All pairs among `edges` of these `faces` that see one another. Where they and the `passages` are too many, ways go over no edges beyond,
/// and where they still are there are none: [`None`].
pub(crate) fn apart(
    edges: &[RoomEdge],
    faces: &[Vec<Border>],
    passages: &[Passage],
    sees: impl Fn([Outlook; 2]) -> bool,
) -> Option<Pairs> {
    let limit = LIMIT.saturating_sub(passages.iter().filter(|way| !way.is_along_a_face()).count());
    let (mut pairs, mut partly) = (Vec::new(), Vec::new());
    for (index, one) in edges.iter().enumerate() {
        for (before, other) in edges[..index].iter().enumerate() {
            let is_of_both =
                |face: &Vec<Border>| [index, before].iter().all(|edge| face.iter().any(|of| of.0 == *edge));
            if one.wedge.sine_to(&other.wedge) > NEARLY || faces.iter().any(is_of_both) {
                continue;
            }
            match places_seen(edges, [before, index], &sees) {
                0 => {}
                count if count < SEEN_AT.len() => partly.push([before, index]),
                _ => pairs.push([before, index]),
            }
            if pairs.len() > limit {
                return None;
            }
        }
    }
    let mut ways = Vec::new();
    for [one, other] in pairs {
        let [of_one, of_other] = [[one, other], [other, one]].map(|pair| shores(edges, passages, pair));
        for side in &of_one {
            ways.extend(of_other.iter().map(|other| Apart { sides: [side.clone(), other.clone()] }));
        }
    }
    shorten(&mut [&mut ways], limit);
    Some(Pairs { ways, partly })
}

/// For each of so many edges those across the air of `ways`, which hide it all at once.
pub(crate) fn across(edges: usize, ways: &[Apart]) -> Vec<Vec<usize>> {
    let short = || ways.iter().filter(|way| way.is_short());
    (0..edges).map(|edge| short().filter_map(|way| way.across(edge)).collect()).collect()
}

/// Tells `passages` which of the edges `across` from their ends hide these where none of the `ways` goes on.
pub(crate) fn hide(passages: &mut [Passage], ways: &[Apart], across: &[Vec<usize>]) {
    for passage in passages {
        let count = passage.edges.len();
        passage.hidden_by = [[0, 1], [count - 1, count - 2]].map(|of| {
            let [edge, before] = of.map(|index| passage.edges[index].edge);
            let goes_on = |side: &Shore| {
                side.edge == edge && side.beyond.as_ref().is_some_and(|joined| joined.edge == before)
            };
            let is_continued = count == 2 && ways.iter().flat_map(|way| &way.sides).any(goes_on);
            if is_continued { Arc::default() } else { across[edge].as_slice().into() }
        });
    }
}

/// Leaves out ways over edges beyond where all `ways` are more than `limit`, and then all of them.
pub(crate) fn shorten(ways: &mut [&mut Vec<Apart>], limit: usize) {
    let is_too_many = |ways: &[&mut Vec<Apart>]| ways.iter().map(|ways| ways.len()).sum::<usize>() > limit;
    if is_too_many(ways) {
        ways.iter_mut().for_each(|ways| ways.retain(Apart::is_short));
        let sides = ways.iter_mut().flat_map(|ways| ways.iter_mut()).flat_map(|way| &mut way.sides);
        sides.for_each(|side| side.known = Arc::default());
    }
    if is_too_many(ways) {
        ways.iter_mut().for_each(|ways| ways.clear());
    }
}

/// The sides at `edge` of the air to the edge `from`: with nothing beyond, and with edges over faces in whose planes `from` does not lie.
fn shores(edges: &[RoomEdge], passages: &[Passage], [edge, from]: [usize; 2]) -> Vec<Shore> {
    let from = edges[from].wedge.at(0.5 * edges[from].wedge.length());
    let joined = |passage: &Passage| {
        let [one, other] = passage.edges[..] else { return None };
        let (own, other) = if one.edge == edge { (one, other) } else { (other, one) };
        let face = usize::from(own.at_second[0]);
        let is_beyond = own.edge == edge
            && edges[edge].wedge.across(&edges[other.edge].wedge).is_some()
            && edges[edge].faces[face].height(from).abs() > CORNER;
        is_beyond.then(|| Joined {
            edge: other.edge,
            at_second: [other.at_second[0], own.at_second[0]],
            outline: passage.outline.clone(),
        })
    };
    let beyond: Vec<Joined> = passages.iter().filter_map(joined).collect();
    let known = beyond.iter().map(|joined| joined.edge).collect();
    let mut shores = vec![Shore { edge, beyond: None, known }];
    shores.extend(beyond.into_iter().map(|joined| Shore {
        edge,
        beyond: Some(joined),
        known: Arc::new([edge]),
    }));
    shores
}

/// At how many places two edges see one another.
fn places_seen(edges: &[RoomEdge], pair: [usize; 2], sees: &impl Fn([Outlook; 2]) -> bool) -> usize {
    let [one, other] = pair.map(|edge| &edges[edge].wedge);
    let is_turned = one.direction().dot(other.direction()) < 0.0;
    let lies_apart = one.locate(other.at(0.0)).is_some_and(|at| at.radius > CORNER);
    let is_seen = |share: &&f64| {
        let from = one.at(**share * one.length());
        let to = other.at(if is_turned { 1.0 - **share } else { **share } * other.length());
        sees([(pair[0], from, one.into_air()), (pair[1], to, other.into_air())])
    };
    if lies_apart { SEEN_AT.iter().filter(is_seen).count() } else { 0 }
}
