//! Which ways over edges are computed: those that matter most, within a budget.
//!
//! A contribution is an image of the source, an edge or two edges of a convex face, and an image of the receiver. Its energy is at most about
//! 1/(4 + 20 N) of the free field over its way, N the Fresnel number of the detour: the formula of [Maekawa1968] at its upper side, where half a
//! plane takes 1/4 on the boundary and 1/(4π² N) far in shadow. An edge shorter than the first Fresnel zone sends less as its length squared. With a
//! visible image source it interferes, by twice the product of the amplitudes, less over a band the more it turns there. Contributions are ranked by
//! their largest share of what reaches the receiver without edges; the last ones are dropped whose shares together are less than [`DROPPED`], or
//! that exceed the budget. Interference is of random sign: its shares are added as squares.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use sonel_diffraction::Wedge;

use super::faces::Pair;
use super::field::{Field, Place};
use super::images::{Image, Images};
use super::{Edges, Listening, RoomEdge, VisibleWave};

/// Share of a receiver's energy that is left out: 0.05 dB.
const DROPPED: f64 = 0.0116;
/// Most contributions of a receiver: some 0.3 CPU-s.
const BUDGET: usize = 4096;
/// Half the relative width of a band that two waves have to turn against one another in, to interfere no more [1].
const HALF_BAND: f64 = 0.35;

/// What is passed.
#[derive(Debug, Clone, Copy)]
pub(super) enum Over {
    /// An edge, by its index.
    Edge(usize),
    /// Two edges of a face.
    Pair(Pair),
}

/// A way over edges.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contribution {
    /// Image of the source, by index.
    pub from: usize,
    /// Image of the receiver.
    pub to: usize,
    pub over: Over,
    /// Share of the receiver's energy by itself, and by interference, at most.
    shares: [f64; 2],
}

/// The contributions that are computed, and the share of the energy of those that are not.
pub(super) struct Chosen {
    pub contributions: Vec<Contribution>,
    pub dropped: f64,
}

/// Searches for all contributions at a receiver.
pub(super) struct Search<'a> {
    pub edges: &'a Edges,
    pub at: &'a Listening<'a>,
    pub from: &'a Images,
    pub to: &'a Images,
    pub field: &'a Field<'a>,
}

/// An image of the source with one of the receiver.
struct Ends<'a> {
    images: [&'a Image; 2],
    /// ∏ (1−α)(1−s) of the mirrors of both, per band.
    factor: Vec<f64>,
    /// Length of the straight way between them [m].
    straight: f64,
    /// Whether that is clear.
    is_visible: bool,
}

impl Search<'_> {
    /// The contributions that matter, the greatest first.
    #[must_use]
    pub fn choose(&self, visible: &[VisibleWave]) -> Chosen {
        let mut least = vec![0.0; self.at.attenuation.len()];
        for wave in visible {
            least.iter_mut().zip(&wave.energy).for_each(|(sum, energy)| *sum += 4.0 * PI * energy);
        }
        if least.iter().any(|&energy| energy <= 0.0) {
            // In shadow the loudest contribution, of which its bound is a few times too much.
            let mut loudest = vec![0.0_f64; least.len()];
            self.visit(|_, ends, wedges| {
                for (band, loudest) in loudest.iter_mut().enumerate() {
                    *loudest = loudest.max(self.bound(&ends, wedges, band)[0]);
                }
            });
            least.iter_mut().zip(loudest).for_each(|(sum, loudest)| *sum += 0.25 * loudest);
        }
        let mut all: Vec<Contribution> = Vec::new();
        self.visit(|contribution, ends, wedges| {
            let mut shares = [0.0_f64; 2];
            for (band, least) in least.iter().enumerate() {
                let bound = self.bound(&ends, wedges, band);
                shares = [0, 1].map(|of| shares[of].max(bound[of] / least.max(f64::MIN_POSITIVE)));
            }
            if shares[0] > 0.0 {
                all.push(Contribution { shares, ..contribution });
            }
        });
        // Ties in the order in which they were found.
        let weight = |one: &Contribution| one.shares[0] + one.shares[1];
        all.sort_by(|one, other| weight(other).total_cmp(&weight(one)));
        let (mut alone, mut squares, mut kept) = (0.0, 0.0, all.len());
        let dropped = |alone: f64, squares: f64| alone + squares.sqrt();
        while let Some(last) = kept.checked_sub(1).map(|last| &all[last]) {
            let next = (alone + last.shares[0], squares + last.shares[1] * last.shares[1]);
            if kept <= BUDGET && dropped(next.0, next.1) > DROPPED {
                break;
            }
            (alone, squares) = next;
            kept -= 1;
        }
        all.truncate(kept);
        Chosen { contributions: all, dropped: dropped(alone, squares) }
    }

    /// Visits all contributions, with their ends and edges.
    fn visit(&self, mut visit: impl FnMut(Contribution, &Ends<'_>, [&RoomEdge; 2])) {
        let order = self.from.order().min(self.to.order()).min(self.at.complete_order);
        for (from, source) in self.from.all.iter().enumerate() {
            for (to, receiver) in self.to.all.iter().enumerate() {
                // Images are sorted by order.
                if source.order() + receiver.order() > order {
                    break;
                }
                let Some(ends) = self.ends(source, receiver) else { continue };
                let contribution = |over| Contribution { from, to, over, shares: [0.0; 2] };
                for edge in common(&source.edges, &receiver.edges) {
                    let of = &self.edges.all[edge];
                    if lies_off(of, &ends) {
                        visit(contribution(Over::Edge(edge)), &ends, [of; 2]);
                    }
                }
                for pair in &self.edges.pairs {
                    for pair in [*pair, pair.reversed()] {
                        let [first, last] = pair.edges;
                        if has(&source.edges, first) && has(&receiver.edges, last) {
                            let both = pair.edges.map(|edge| &self.edges.all[edge]);
                            visit(contribution(Over::Pair(pair)), &ends, both);
                        }
                    }
                }
            }
        }
    }

    fn ends<'a>(&self, source: &'a Image, receiver: &'a Image) -> Option<Ends<'a>> {
        let factor: Vec<f64> =
            source.factor.iter().zip(&receiver.factor).map(|(one, other)| one * other).collect();
        if factor.iter().all(|&factor| factor <= 0.0) {
            return None;
        }
        let place = place(source, receiver);
        let is_visible = self.field.find(&place).is_some_and(|group| self.field.is_visible(group));
        let straight = source.position.distance(receiver.position);
        Some(Ends { images: [source, receiver], factor, straight, is_visible })
    }

    /// The most that a contribution brings in `band`, by itself and by interference [1/m²].
    fn bound(&self, ends: &Ends<'_>, edges: [&RoomEdge; 2], band: usize) -> [f64; 2] {
        let [from, to] = ends.images.map(|image| image.position);
        let [first, last] = edges.map(|edge| &edge.wedge);
        let near = nearest(first, from, to);
        let far = if std::ptr::eq(edges[0], edges[1]) { near } else { nearest(last, near, to) };
        let (before, behind) = (from.distance(near), near.distance(far) + far.distance(to));
        let length = before + behind;
        let k = self.edges.centres[band];
        let excess = length - ends.straight;
        let number = excess.max(0.0) * k / PI;
        // Images in faces may be as near to their boundaries as they like: half of the field at most.
        let in_faces = edges[0].faces.iter().chain(&edges[1].faces);
        let least = in_faces.map(|face| length - face.image(from).distance(to)).fold(excess, f64::min);
        let number = number.min(least.max(0.0) * k / PI);
        let zone = TAU / k * before * behind / length;
        let short = (first.length().min(last.length()).powi(2) / zone.max(f64::MIN_POSITIVE)).min(1.0);
        let air = libm::exp(-self.at.attenuation[band] * length);
        let energy = ends.factor[band] * air * short / ((4.0 + 20.0 * number) * length * length);
        let wave =
            if ends.is_visible { ends.factor[band] * air / (ends.straight * ends.straight) } else { 0.0 };
        let turns = (1.0 / (HALF_BAND * k * excess.max(f64::MIN_POSITIVE))).min(1.0);
        [energy, 2.0 * (energy * wave).sqrt() * turns]
    }
}

/// Where the image source is that is seen past the edges between two images.
pub(super) fn place(source: &Image, receiver: &Image) -> Place {
    let planes = source.mirrors.iter().chain(&receiver.mirrors).map(|mirror| mirror.plane);
    Place::new(receiver.unfold(source.position), planes)
}

/// Whether both ends see an edge from outside its solid.
fn lies_off(edge: &RoomEdge, ends: &Ends<'_>) -> bool {
    ends.images
        .iter()
        .all(|image| edge.faces.iter().any(|face| face.height(image.position) > 0.0) || edge.wedge.is_rim())
}

/// Where on an edge the way between two places is shortest [m].
fn nearest(wedge: &Wedge, from: DVec3, to: DVec3) -> DVec3 {
    super::images::over_edge(wedge, from, to).1
}

fn has(bits: &[u64], edge: usize) -> bool {
    bits[edge / 64] & (1 << (edge % 64)) != 0
}

fn common<'a>(one: &'a [u64], other: &'a [u64]) -> impl Iterator<Item = usize> + 'a {
    one.iter().zip(other).enumerate().flat_map(|(word, (one, other))| {
        let mut bits = one & other;
        std::iter::from_fn(move || {
            (bits != 0).then(|| {
                let bit = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                64 * word + bit
            })
        })
    })
}
