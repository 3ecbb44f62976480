//! Cracks: gaps between open edges that run beside one another.
//!
//! Two open edges face one another where they are parallel within 10°, no farther apart than the widest crack, their faces do
//! not go the same way (those are two sides of a panel), and what is between them is a gap and no narrow strip. Each has the
//! nearest such edge for its partner, and both must agree. An edge with partners along all of it is the rim of a crack; so
//! are edges that close the end of one, and the rim of a hole no longer than a crack is wide. The width is the distance
//! between the edges where it is largest, the area length times mean width.
//!
//! The widest crack is half a wavelength at 8.5 kHz, in small scenes a part of their size: what is wider may be drawn on
//! purpose and its rims diffract.

use crate::Mesh;
use crate::boundary::{ALIKE, OpenEdge, open_edges};
use crate::stitch::edge_grid;
use crate::topology::{Connected, SharedEdge};
use foldhash::{HashMap, HashSet};
use glam::DVec3;

/// Width up to which gaps are cracks [m], in scenes of `SIZES_PER_CRACK` times that and more: half a wavelength at 8.5 kHz.
pub const WIDEST_CRACK: f64 = 0.02;
/// Least ratio of the longest side of a scene's bounding box to the width of a crack [1]. Chosen, not measured: rooms of 10 m and more have
/// [`WIDEST_CRACK`]; doubled, rooms of 20 m.
const SIZES_PER_CRACK: f64 = 500.0;

/// Largest length of an edge without a partner, as a share of its length and of the widest crack [1]. Chosen, not measured; at 1 an edge
/// shorter than the crack needs no partner.
const ALLOWED_BARE: f64 = 0.5;
/// Sine of the angle by which the line from edge to edge leans over a face: 10°, as in [`ALIKE`].
const SLANT: f64 = 0.174;
/// Height of a face over the distance of the edges from which on it is no strip between them [1]: an equilateral triangle on the gap has
/// 0.87. Chosen, not measured; doubled, small faces beside a gap count as strips, whose gap is no crack.
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
    /// Indices of the rims among the edges of the mesh.
    pub rims: [usize; 2],
    /// Faces of the rims.
    pub faces: [u32; 2],
    /// Whether the second rim's ends are in the order of the first one's.
    pub is_parallel: bool,
    /// The gap between the rims.
    pub crack: Crack,
}

impl Facing {
    /// Whether the faces are oriented alike.
    pub(crate) fn agree(&self, mesh: &Mesh, edges: &[SharedEdge]) -> bool {
        let [here, there] = [0, 1].map(|i| edges[self.rims[i]].is_ahead(mesh, self.faces[i]));
        (here != there) == self.is_parallel
    }
}

/// Largest width of a crack in a mesh [m].
pub(crate) fn widest_crack(mesh: &Mesh) -> f64 {
    let (low, high) = mesh.bounds();
    WIDEST_CRACK.min((high - low).max_element() / SIZES_PER_CRACK)
}

/// Finds where open edges face one another, and marks those that are rims of cracks; `tolerance` [m] is below which positions are
/// the same.
pub(crate) fn find_cracks(mesh: &Mesh, edges: &mut [SharedEdge], tolerance: f64) -> Vec<Facing> {
    let widest = widest_crack(mesh);
    let open = open_edges(mesh, edges);
    let beside = neighbours(&open, widest, tolerance);
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
                facing.push(pair([&open[here], &open[span.other]], span));
            }
        }
    }
    let is_covered = open
        .iter()
        .zip(covered)
        .map(|(edge, parts)| bare(edge.length(), parts) <= ALLOWED_BARE * widest.min(edge.length()))
        .collect();
    for (edge, is_rim) in open.iter().zip(rims(&open, is_covered, &facing, widest)) {
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
fn neighbours(open: &[OpenEdge], widest: f64, tolerance: f64) -> Vec<Vec<Span>> {
    let grid = edge_grid(open, widest);
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
        let found = [[a, b], [b, a]].map(|[here, there]| span(&open[here], &open[there], widest));
        if let [Some(there), Some(back)] = found {
            for (here, other, [from, to], widths) in [(a, b, there.0, there.1), (b, a, back.0, back.1)] {
                if to - from > tolerance {
                    spans[here].push(Span { other, from, to, widths });
                }
            }
        }
    }
    spans
}

/// The stretch of an edge that faces another one [m], and the distances of the two at its ends [m].
fn span(edge: &OpenEdge, other: &OpenEdge, widest: f64) -> Option<([f64; 2], [f64; 2])> {
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
    let is_gap = widths[0].max(widths[1]) <= widest && !is_strip(edge, other, 0.5 * (from + to));
    is_gap.then_some(([from, to], widths))
}

/// Whether faces rather than air lie between two edges, seen from a place along the first [m]: the way from one to the other
/// leads over their faces, and neither is much higher than the edges are apart. Walls that cross at their edges lie so too,
/// but one of them is higher.
fn is_strip(edge: &OpenEdge, other: &OpenEdge, along: f64) -> bool {
    let across = other.at(other.project(edge.at(along))) - edge.at(along);
    let distance = across.length();
    let over_a_face = across.dot(edge.inward).max(-across.dot(other.inward)) > SLANT * distance;
    over_a_face && edge.height.max(other.height) < HEIGHTS_PER_WIDTH * distance
}

fn pair([a, b]: [&OpenEdge; 2], span: &Span) -> Facing {
    let middle = |along: f64| {
        let point = a.at(along);
        0.5 * (point + b.at(b.project(point).clamp(0.0, b.length())))
    };
    let area = (span.to - span.from) * 0.5 * (span.widths[0] + span.widths[1]);
    let crack = Crack { ends: [middle(span.from), middle(span.to)], width: span.width(), area };
    let is_parallel = a.along.dot(b.along) > 0.0;
    Facing { rims: [a.index, b.index], faces: [a.face, b.face], is_parallel, crack }
}

/// Whether each open edge is the rim of a crack, given which have partners along all of them.
fn rims(open: &[OpenEdge], is_covered: Vec<bool>, facing: &[Facing], widest: f64) -> Vec<bool> {
    let mut at: HashMap<u32, Vec<usize>> = HashMap::default();
    for (index, edge) in open.iter().enumerate() {
        for end in edge.ends {
            at.entry(end).or_default().push(index);
        }
    }
    let pairs: HashSet<[usize; 2]> = facing.iter().map(|facing| facing.rims).collect();
    let mut widths: HashMap<usize, f64> = HashMap::default();
    for Facing { rims, crack, .. } in facing {
        rims.iter().for_each(|&rim| {
            let width = widths.entry(rim).or_default();
            *width = width.max(crack.width);
        });
    }
    let mut is_rim = is_covered.clone();
    let mut seen = is_covered.clone();
    for first in 0..open.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        // Bare edges that hang together, and the covered ones at their ends.
        let (mut chain, mut next, mut beside) = (vec![first], 0, Vec::new());
        while next < chain.len() {
            for &other in open[chain[next]].ends.iter().flat_map(|end| &at[end]) {
                if is_covered[other] {
                    beside.push(other);
                } else if !std::mem::replace(&mut seen[other], true) {
                    chain.push(other);
                }
            }
            next += 1;
        }
        let length: f64 = chain.iter().map(|&edge| open[edge].length()).sum();
        let faces = |a: usize, b: usize| pairs.contains(&[open[a].index, open[b].index]);
        let is_part = || match &beside[..] {
            [] => is_hole(open, &chain),
            // Where three walls meet, one short and two long, what is left is no longer than the crack is wide.
            _ => {
                beside.iter().any(|&a| beside.iter().any(|&b| faces(a, b)))
                    || beside
                        .iter()
                        .any(|&rim| widths.get(&open[rim].index).is_some_and(|&width| length <= width))
            }
        };
        if length <= widest && is_part() {
            chain.iter().for_each(|&edge| is_rim[edge] = true);
        }
    }
    is_rim
}

/// Whether the faces at some open edges lie around them, not between.
fn is_hole(open: &[OpenEdge], chain: &[usize]) -> bool {
    let middle = |edge: usize| 0.5 * (open[edge].points[0] + open[edge].points[1]);
    let center = chain.iter().map(|&edge| middle(edge)).sum::<DVec3>() / chain.len() as f64;
    let outward = |&edge: &usize| open[edge].length() * open[edge].inward.dot(middle(edge) - center);
    chain.iter().map(outward).sum::<f64>() > 0.0
}

/// Length of an edge that some parts of it do not cover [m].
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
    let mut at: HashMap<u32, Vec<usize>> = HashMap::default();
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
