//! Images of three reflections and more: what the edges next to their ways make of them.
//!
//! Each is a small part of what is heard, so it is heard by its own energy, and only where that part is large enough for anyone to hear it begin:
//! the image where it is lit, and what one edge at a time sends that completes it, added coherently. The edges are those within
//! [`Reach`] of the straight way, those of the mirrors themselves among them.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::DVec3;
use sonel_diffraction::wedge::apex;
use sonel_diffraction::{Complex, EdgePath, Lit, WAVES, Wave, Wedge};
use sonel_geometry::{Geometry, PlaneId};
use sonel_map::CoefficientTable;

use super::chain::Chain;
use super::extent::Extent;
use super::family::{UNKNOWN, doubt_over, excess, faded, kept, mirrors_at_feet, turn};
use super::image::SourceImage;
use super::mirror::{self, PlaneMirror, reflects};
use super::near::{ends, may_reach};
use super::reach::{Beside, Reach};
use super::sight::{CROWDED, beyond_straight, in_line, smooth};
use super::view::stretches;
use super::world::{Copy, RoomEdge};
use super::{EDGE_ORDER, Edges, Listening};
use crate::direct::spread;
use crate::mirror::tree::ImageTree;

/// Images that bring less than this of what direct sound and earlier images do are as they are without edges: a hundredth of a decibel, if they
/// begin at once. From twice as much on they are whole what edges make of them. Later images do not count: from either end of a path as
/// many are enumerated as are few enough.
const WORTH: f64 = 0.002;

/// Where the planes of all mirrors are, and all edges.
pub(super) struct Places {
    planes: HashMap<PlaneId, Extent>,
    edges: Vec<Extent>,
}

/// An image of more reflections than [`EDGE_ORDER`] that edges change.
pub(crate) struct LaterImage {
    /// Where it is, about the scene's centre [m].
    pub position: DVec3,
    /// Which one it is of those that reach the receiver, if it does.
    pub lit: Option<usize>,
    /// Number of reflections.
    pub order: u32,
    /// Length of its way, over an edge where it is not lit [m].
    pub length: f64,
    /// Fluence per unit emitted energy per band, attenuated by air [1/m²].
    pub energy: Vec<f64>,
}

/// An image, and all chains of planes that may show it.
struct Shown {
    image: SourceImage,
    chains: Vec<Chain>,
    /// How much of what edges change counts: 0 where the image is not worth it … 1.
    share: f64,
}

/// What one edge next to the way to an image sends of it.
struct Sender {
    edge: RoomEdge,
    copy: Copy,
    /// Where its sound seems to come from [m].
    source: DVec3,
    /// The face in whose plane it is mirrored there, if it is.
    face: Option<usize>,
}

impl Places {
    /// Those of the planes of `geometry` that mirror anything, and of its `edges`.
    #[must_use]
    pub fn new(geometry: &Geometry, table: &CoefficientTable, edges: &[RoomEdge]) -> Self {
        let planes = mirror::planes(geometry, table);
        let extent = |plane: &PlaneMirror| (plane.plane, Extent::of_plane(geometry, plane));
        Self {
            planes: planes.iter().map(extent).collect(),
            edges: edges.iter().map(|edge| Extent::of(ends(edge))).collect(),
        }
    }

    fn of(&self, chain: &[PlaneMirror]) -> Vec<Extent> {
        chain.iter().map(|mirror| self.planes[&mirror.plane]).collect()
    }
}

impl Edges {
    /// The images of `tree` of more than [`EDGE_ORDER`] reflections that edges change. `lit` are those that reach the receiver, and `heard`
    /// is the energy of direct sound and earlier images [1/m²].
    #[must_use]
    pub fn hear_later(
        &self,
        at: &Listening<'_>,
        tree: &ImageTree,
        lit: &[SourceImage],
        heard: &[f64],
    ) -> Vec<LaterImage> {
        let shown = self.shown(at, tree, heard);
        let find = |shown: &Shown| lit.iter().position(|lit| lit.is(&shown.image, at));
        shown.iter().filter_map(|shown| self.later(at, shown, find(shown))).collect()
    }

    /// The images that are worth it, lit or not, by the chains whose mirrors the way meets or nearly does.
    fn shown(&self, at: &Listening<'_>, tree: &ImageTree, heard: &[f64]) -> Vec<Shown> {
        let far = Reach::end(self.spectrum.smallest_k());
        let mut shown: Vec<Shown> = Vec::new();
        let least = WORTH * heard.iter().copied().fold(f64::INFINITY, f64::min);
        for image in tree.beyond(EDGE_ORDER) {
            let position = tree.position(image);
            let length = position.distance(at.receiver);
            if tree.strongest(image) * spread(length) < least {
                continue;
            }
            let mirrors = tree.mirrors(image);
            let mirrors: Vec<PlaneMirror> =
                mirrors.map(|(surface, side)| PlaneMirror::new(at.geometry, surface, side)).collect();
            let chain = Chain::of(&mirrors).reversed();
            let parts = at.through(chain.mirrors(), length).zip(heard);
            let part = parts.map(|(factor, heard)| factor * spread(length) / heard).fold(0.0, f64::max);
            let share = smooth(part / WORTH - 1.0);
            if share <= 0.0 || !self.places.are_met(&chain, at, far) {
                continue;
            }
            // From either end the tree may know the same image by other orders of its mirrors; surfaces of one plane are one mirror.
            let image = SourceImage::in_mirrors(position, &chain);
            let known = shown.iter_mut().find(|known| known.image.is(&image, at));
            if known.as_ref().is_some_and(|known| known.chains.iter().any(|other| other.is(&chain))) {
                continue;
            }
            let chains = chain.orders().into_iter().filter(|order| self.places.are_met(order, at, far));
            match known {
                None => shown.push(Shown { image, chains: chains.collect(), share }),
                Some(known) => known.chains.extend(chains),
            }
        }
        shown
    }

    /// What edges make of an image; [`None`] where none is next to its way.
    fn later(&self, at: &Listening<'_>, shown: &Shown, lit: Option<usize>) -> Option<LaterImage> {
        let senders: Vec<Sender> = shown.chains.iter().flat_map(|chain| self.senders(at, chain)).collect();
        let mut waves = Vec::new();
        let mut length = f64::INFINITY;
        for sender in &senders {
            let beside: Vec<&Wedge> = senders.iter().map(|other| &other.edge.wedge).collect();
            length =
                length.min(self.send(at, sender, &beside, shown.image.position, lit.is_some(), &mut waves));
        }
        if waves.is_empty() {
            return None;
        }
        let is_met = |chain: &&Chain| !chain.feet(at.radiator.position, at.receiver).is_empty();
        let chain = shown.chains.iter().find(is_met).unwrap_or(&shown.chains[0]);
        let mut alone = vec![0.0; self.spectrum.bands()];
        if lit.is_some() {
            length = shown.image.position.distance(at.receiver);
            let leaving = chain.reversed().image(at.receiver) - at.radiator.position;
            let factor = at.radiator.factor(leaving);
            alone.fill(factor / (length * length));
            waves.push(self.spectrum.flat(length, factor.sqrt() / length));
        }
        let factor = at.through(&mirrors_at_feet(chain, at), length);
        let changed = self.spectrum.energy(&waves).into_iter().zip(alone);
        let energy = changed.zip(factor).map(|((changed, alone), factor)| {
            (alone + (changed - alone) * shown.share) * factor / (4.0 * PI)
        });
        let energy = energy.collect();
        Some(LaterImage { position: shown.image.position, lit, order: chain.order(), length, energy })
    }

    /// The edges next to the way over `chain`: those that it passes between its mirrors, and those that its mirrors end at.
    fn senders(&self, at: &Listening<'_>, chain: &Chain) -> Vec<Sender> {
        let mirrors = chain.mirrors();
        let passed = (0..=mirrors.len()).flat_map(|met| {
            let copy = copy_of(&mirrors[..met], &mirrors[met..]);
            self.next_to(at, &copy, None)
        });
        let ended = mirrors.iter().enumerate().flat_map(|(met, mirror)| {
            let copy = copy_of(&mirrors[..met], &mirrors[met + 1..]);
            self.next_to(at, &copy, Some(mirror))
        });
        passed.chain(ended).collect()
    }

    /// The edges of a `copy` next to the way, or of them those of a plane that `mirrors` there.
    fn next_to(&self, at: &Listening<'_>, copy: &Copy, mirrors: Option<&PlaneMirror>) -> Vec<Sender> {
        let far = Reach::end(self.spectrum.smallest_k());
        let source = copy.before.image(at.radiator.position);
        let to = copy.behind.image(at.receiver);
        let from = mirrors.map_or(source, |mirror| mirror.image(source));
        let reach = Extent::of_ways([from, to], far);
        let within = super::IN_PLANE * f64::from(at.geometry.resolution());
        let [before, behind] = [&copy.before, &copy.behind].map(|chain| self.places.of(chain.mirrors()));
        let unfolded = copy.behind.reversed();
        let mut senders = Vec::new();
        for (edge, extent) in self.rooms.direct.edges.iter().zip(&self.places.edges) {
            if !reach.touches(extent) {
                continue;
            }
            let face = mirrors.map(|mirror| edge.faces.iter().position(|face| face.is(mirror)));
            let piece = copy.beside.iter().try_fold(*edge, |edge, mirror| edge.before(mirror, within));
            let (None | Some(Some(_)), Some(piece)) = (face, piece) else { continue };
            let places = ends(&piece);
            if beyond_straight(&piece.wedge, from, to) < far
                && may_reach(&copy.before, &before, at.radiator.position, places)
                && may_reach(&copy.behind, &behind, at.receiver, places)
            {
                let edge = piece.image(&unfolded);
                let source = unfolded.image(source);
                senders.push(Sender { edge, copy: copy.clone(), source, face: face.flatten() });
            }
        }
        senders
    }

    /// Adds the waves of a `sender` to an image at `position`, mirrors and air left out, and returns the length of the shortest [m].
    fn send(
        &self,
        at: &Listening<'_>,
        sender: &Sender,
        beside: &[&Wedge],
        position: DVec3,
        is_lit: bool,
        waves: &mut Vec<Wave>,
    ) -> f64 {
        let Sender { edge, copy, source, face } = sender;
        let wedge = &edge.wedge;
        let located = (wedge.locate(*source), wedge.locate(at.receiver));
        let (Some(from), Some(to)) = located else { return f64::INFINITY };
        let (geometry, origin) = (at.geometry, at.radiator.position);
        let seen = stretches(wedge, |point| {
            let place = copy.seen(geometry, point);
            reflects(geometry, copy.before.mirrors(), origin, place)
                && reflects(geometry, copy.behind.mirrors(), at.receiver, place)
        });
        let lit = Lit {
            direct: face.is_none().then_some(is_lit),
            faces: [0, 1].map(|of| (*face == Some(of)).then_some(is_lit)),
            within: doubt_over(at, copy.before.order() + copy.behind.order(), from, to),
        };
        let turned = face.map_or((from.angle - to.angle).abs(), |face| turn(edge, from, to, face));
        let of_image = Beside { excess: beyond_straight(wedge, position, at.receiver), is_lit: turned < PI };
        let in_faces = [0, 1].map(|face| {
            let turn = turn(edge, from, to, face);
            (turn > PI).then(|| excess(from, to, turn))
        });
        // What belongs to the image, and of what belongs to images of one reflection more what is deep in their shadow.
        let share = |k: f64| -> [f64; WAVES] {
            let near = Reach::share(of_image, k);
            let around = Reach::share(Beside { is_lit: false, ..of_image }, k);
            let dark = |away: Option<f64>| away.map_or(0.0, |away| around * (1.0 - faded(k, away / UNKNOWN)));
            match *face {
                None => [near, dark(in_faces[0]), dark(in_faces[1])],
                Some(of) => {
                    let mut share = [0.0; WAVES];
                    share[1 + of] = near * faded(k, of_image.excess / UNKNOWN);
                    share
                }
            }
        };
        let smallest_k = self.spectrum.smallest_k();
        let mut shortest = f64::INFINITY;
        for part in seen {
            let path = EdgePath::new(wedge, from, to, part, lit, smallest_k);
            let point = wedge.at(apex(from, to).clamp(part[0], part[1]));
            let leaving = copy.before.reversed().image(copy.behind.image(point)) - origin;
            let strength = at.radiator.factor(leaving).sqrt()
                * kept(wedge, from, to)
                * in_line(wedge, beside.iter().copied(), point, &[position, at.receiver], CROWDED);
            for (piece, length) in path.lengths().enumerate() {
                let amplitudes = path.amplitudes(piece, self.spectrum.wave_numbers());
                let cells = self.spectrum.cells().iter().zip(amplitudes);
                let amplitude: Vec<Complex> = cells
                    .map(|(cell, terms): (_, [Complex; WAVES])| {
                        let shares = share(cell.k).into_iter().zip(terms);
                        shares.fold(Complex::ZERO, |sum, (share, term)| sum + term * (strength * share))
                    })
                    .collect();
                waves.push(Wave { length, amplitude });
            }
            shortest = shortest.min(path.detour());
        }
        shortest
    }
}

/// The room as it is met after the mirrors `before` and before those `behind`, both as met from the source.
fn copy_of(before: &[PlaneMirror], behind: &[PlaneMirror]) -> Copy {
    Copy {
        before: Chain::of(before),
        behind: Chain::of(behind).reversed(),
        beside: before.last().into_iter().chain(behind.first()).copied().collect(),
    }
}

impl Places {
    /// Whether the way over `chain` to the receiver meets all of its mirrors, or would if it were no more than `far` [m] longer.
    fn are_met(&self, chain: &Chain, at: &Listening<'_>, far: f64) -> bool {
        let mirrors = chain.mirrors();
        let mut from = chain.image(at.radiator.position);
        let mut to = at.receiver;
        mirrors.iter().rev().all(|mirror| {
            let is_met = Extent::of_ways([from, to], far).touches(&self.planes[&mirror.plane]);
            (from, to) = (mirror.image(from), mirror.image(to));
            is_met
        })
    }
}
