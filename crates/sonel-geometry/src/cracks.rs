//! Cracks: gaps between open edges that run beside one another.
//!
//! Two open edges face one another where they are parallel within 10°, no farther apart than [`WIDEST_CRACK`], their faces
//! do not go the same way (those are two sides of a panel), and what is between them is a gap and no narrow strip. Each has the nearest such edge for its partner, and both must
//! agree. An edge with partners along all of it is the rim of a crack, and so are edges without a partner that only close the
//! end of one. The width is the distance between the edges where it is largest, the area length times mean width.
//!
//! The limit is half a wavelength at 8.5 kHz: what is wider may be drawn on purpose and its rims diffract.

use crate::Mesh;
use crate::boundary::{ALIKE, OpenEdge, open_edges};
use crate::stitch::edge_grid;
use crate::topology::{Connected, SharedEdge};
use glam::DVec3;
use std::collections::HashMap;

/// Gaps up to this width [m] are cracks.
pub const WIDEST_CRACK: f64 = 0.02;

/// A way from edge to edge leads over a face where it turns towards it by more than this share of its length: 10°.
const SLANT: f64 = 0.174;
/// Faces of walls that cross are at least this many times as high as their edges are apart.
const HEIGHTS_PER_WIDTH: f64 = 2.0;

/// A gap between open edges of the mesh that run beside one another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crack {
    /// Ends of the line in its middle, in world coordinates [m].
    pub ends: [DVec3; 2],
    /// Largest distance between its rims [m].
    pub width: f64,
    /// Area of the gap [m²].
    pub area: f64,
}

/// Two open edges that face one another along a part of both.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Facing {
    /// Their places among the edges of the mesh.
    pub rims: [usize; 2],
    /// Their faces.
    pub faces: [u32; 2],
    /// Whether these are oriented alike.
    pub agree: bool,
    /// What is between.
    pub crack: Crack,
}

/// Finds where open edges face one another, and marks those that are rims of cracks; `tolerance` [m] is below which positions are
/// the same.
pub(crate) fn find_cracks(mesh: &Mesh, edges: &mut [SharedEdge], tolerance: f64) -> Vec<Facing> {
    let open = open_edges(mesh, edges);
    let beside = neighbours(&open, tolerance);
    let nearest = |here: usize, along: f64| {
        let over = beside[here].iter().filter(|span| (span.from..=span.to).contains(&along));
        over.min_by(|a, b| a.width_at(along).total_cmp(&b.width_at(along))).map(|span| span.other)
    };
    let chooses = |here: usize, span: &Span| nearest(here, 0.5 * (span.from + span.to)) == Some(span.other);
    let mut covered: Vec<Vec<[f64; 2]>> = vec![Vec::new(); open.len()];
    let mut facing = Vec::new();
    for (here, spans) in beside.iter().enumerate() {
        for span in spans.iter().filter(|span| chooses(here, span)) {
            let back = beside[span.other].iter().find(|back| back.other == here);
            if !back.is_some_and(|back| chooses(span.other, back)) {
                continue;
            }
            covered[here].push([span.from - span.width(), span.to + span.width()]);
            if here < span.other {
                facing.push(pair(mesh, [&open[here], &open[span.other]], edges, span));
            }
        }
    }
    for (edge, is_rim) in open.iter().zip(rims(&open, covered, tolerance)) {
        edges[edge.index].is_crack = is_rim;
    }
    facing
}

/// The part of an open edge that another one faces: from where to where along it [m], and the distances there [m].
struct Span {
    other: usize,
    from: f64,
    to: f64,
    widths: [f64; 2],
}

impl Span {
    fn width(&self) -> f64 {
        self.widths[0].max(self.widths[1])
    }

    fn width_at(&self, along: f64) -> f64 {
        let share = (along - self.from) / (self.to - self.from);
        self.widths[0] + share * (self.widths[1] - self.widths[0])
    }
}

/// For each open edge the parts that others face.
fn neighbours(open: &[OpenEdge], tolerance: f64) -> Vec<Vec<Span>> {
    let grid = edge_grid(open, WIDEST_CRACK);
    let mut spans: Vec<Vec<Span>> = (0..open.len()).map(|_| Vec::new()).collect();
    // Where one edge is beside another, an end of either is.
    let near_an_end = |here: usize| open[here].points.map(|point| grid.around(point));
    let mut pairs: Vec<[usize; 2]> = (0..open.len())
        .flat_map(|here| near_an_end(here).into_iter().flatten().map(move |&other| [here, other as usize]))
        .filter(|[here, other]| here != other)
        .map(|[here, other]| [here.min(other), here.max(other)])
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    for [a, b] in pairs {
        let found = [span(&open[a], &open[b], b, tolerance), span(&open[b], &open[a], a, tolerance)];
        if let [Some(there), Some(back)] = found {
            spans[a].push(there);
            spans[b].push(back);
        }
    }
    spans
}

fn span(edge: &OpenEdge, other: &OpenEdge, index: usize, tolerance: f64) -> Option<Span> {
    let are_alike = edge.along.dot(other.along).abs() > ALIKE;
    if !are_alike || edge.inward.dot(other.inward) > ALIKE {
        return None;
    }
    let [a, b] = other.points.map(|point| edge.project(point).clamp(0.0, edge.length()));
    let (from, to) = (a.min(b), a.max(b));
    let width = |along: f64| {
        let point = edge.at(along);
        other.at(other.project(point).clamp(0.0, other.length())).distance(point)
    };
    let widths = [width(from), width(to)];
    let is_gap = to - from > tolerance && widths[0].max(widths[1]) <= WIDEST_CRACK;
    let middle = 0.5 * (from + to);
    (is_gap && !is_strip(edge, other, middle)).then_some(Span { other: index, from, to, widths })
}

/// Whether faces rather than air lie between two edges, seen from a place along the first [m]: the way from one to the other
/// leads over their faces, and these are not much higher than the edges are apart. Walls that cross at their edges lie so
/// too, but are higher.
fn is_strip(edge: &OpenEdge, other: &OpenEdge, along: f64) -> bool {
    let across = other.at(other.project(edge.at(along))) - edge.at(along);
    let distance = across.length();
    let over_a_face = across.dot(edge.inward).max(-across.dot(other.inward)) > SLANT * distance;
    over_a_face && edge.height.min(other.height) < HEIGHTS_PER_WIDTH * distance
}

fn pair(mesh: &Mesh, [a, b]: [&OpenEdge; 2], edges: &[SharedEdge], span: &Span) -> Facing {
    let middle = |along: f64| {
        let point = a.at(along);
        0.5 * (point + b.at(b.project(point).clamp(0.0, b.length())))
    };
    let [here, there] = [a, b].map(|edge| edges[edge.index].is_ahead(mesh, edge.face));
    let area = (span.to - span.from) * 0.5 * (span.widths[0] + span.widths[1]);
    let crack = Crack { ends: [middle(span.from), middle(span.to)], width: span.width(), area };
    let agree = (here == there) == (a.along.dot(b.along) < 0.0);
    Facing { rims: [a.index, b.index], faces: [a.face, b.face], agree, crack }
}

/// Whether each open edge is the rim of a crack, given the parts of it that have a partner.
fn rims(open: &[OpenEdge], covered: Vec<Vec<[f64; 2]>>, tolerance: f64) -> Vec<bool> {
    let bare: Vec<f64> =
        open.iter().zip(covered).map(|(edge, covered)| bare(edge.length(), covered)).collect();
    let is_bare = |edge: &usize| bare[*edge] > tolerance;
    let mut connected = Connected::new(open.len());
    let mut at: HashMap<u32, u32> = HashMap::new();
    for edge in (0..open.len()).filter(is_bare) {
        for end in open[edge].ends {
            let first = *at.entry(end).or_insert(edge as u32);
            connected.join(first, edge as u32);
        }
    }
    let mut total = vec![0.0; open.len()];
    for edge in (0..open.len()).filter(is_bare) {
        total[connected.root(edge as u32) as usize] += bare[edge];
    }
    // Bare edges that together are no longer than a crack is wide close its end.
    (0..open.len())
        .map(|edge| !is_bare(&edge) || total[connected.root(edge as u32) as usize] <= WIDEST_CRACK)
        .collect()
}

/// What some parts of an edge leave of its length [m].
fn bare(length: f64, mut covered: Vec<[f64; 2]>) -> f64 {
    covered.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut reached = 0.0;
    let mut bare = 0.0;
    for [from, to] in covered {
        bare += (from - reached).max(0.0);
        reached = reached.max(to);
    }
    bare + (length - reached).max(0.0)
}

/// Cracks, each along one straight line, the largest area first.
pub(crate) fn joined_up(edges: &[SharedEdge], facing: &[Facing]) -> Vec<Crack> {
    let mut connected = Connected::new(facing.len());
    let mut at: HashMap<u32, Vec<usize>> = HashMap::new();
    let along = |crack: &Crack| (crack.ends[1] - crack.ends[0]).normalize_or_zero();
    for (index, Facing { rims, crack, .. }) in facing.iter().enumerate() {
        for end in rims.iter().flat_map(|&rim| edges[rim].ends) {
            let others = at.entry(end).or_default();
            for &other in others.iter() {
                if along(crack).dot(along(&facing[other].crack)).abs() > ALIKE {
                    connected.join(other as u32, index as u32);
                }
            }
            others.push(index);
        }
    }
    let mut cracks: Vec<Option<Crack>> = vec![None; facing.len()];
    for (index, Facing { crack, .. }) in facing.iter().enumerate() {
        let whole = &mut cracks[connected.root(index as u32) as usize];
        *whole = Some(whole.map_or(*crack, |whole| together(whole, *crack)));
    }
    let mut cracks: Vec<Crack> = cracks.into_iter().flatten().collect();
    cracks.sort_by(|a, b| b.area.total_cmp(&a.area));
    cracks
}

fn together(a: Crack, b: Crack) -> Crack {
    let along = a.ends[1] - a.ends[0];
    let ends = b.ends.into_iter().fold(a.ends, |[low, high], point| {
        let low = if (point - low).dot(along) < 0.0 { point } else { low };
        [low, if (point - high).dot(along) > 0.0 { point } else { high }]
    });
    Crack { ends, width: a.width.max(b.width), area: a.area + b.area }
}
