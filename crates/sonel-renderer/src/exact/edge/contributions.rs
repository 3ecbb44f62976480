//! Selects the paths over edges that are computed: those with the largest energy bounds.
//!
//! A contribution is an image of the source, an edge, two edges of a convex face or two other edges, and an image of the receiver. Its energy is at
//! most about 1/(4 + 20 N) of the free field over its way for every edge, N the Fresnel number of the detour: the formula of [Maekawa1968] at its
//! upper side, where half a plane takes 1/4 on the boundary and 1/(4π² N) far in shadow. Far from its boundary an edge shorter than the first Fresnel
//! zone sends less, as its length squared. Contributions are computed in the order of these bounds, over the energy of their band, until what is left
//! out is expected to change the bands by no more than [`AUDIBLE`]; with a share p of the batches, whose intervals are wider, by √√(1/p) as
//! much: with √(1/p) intervals of C80, which do not hold what is left out, were too narrow.
//!
//! What is left out changes a band by a value of standard deviation 0.045 (B/E)^¾ √v, with B the sum of its bounds, E the energy of the band, and v the
//! energies of what has been computed over their bounds. It is our own: between interference of random sign, √B, and energies, B, and fitted
//! among 30 random furnished rooms and four shipped ones, four receivers and six bands each: there intervals of 1.96 times that hold in 96 % what
//! all contributions make of the level, where up to 20 000 of them are computed.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;
use sonel_diffraction::Wedge;

use super::faces::{Joined, Pair};
use super::images::{Image, Images};
use super::{ReceiverContext, RoomEdge, VisibleWave};

/// Least energy of a sum of contributions over the sum of their energies [1] that is counted on: they may interfere. Chosen, not measured;
/// doubled, more is left out.
const FOUND: f64 = 0.5;
/// Most images on paths over two edges of different faces. Chosen: against waves (tests/accept/furniture.rs) more change the error of no
/// arrangement by more than 0.25 dB rms.
const IMAGES_OF_TWO: u32 = 2;
/// Most of these in bodies. Chosen likewise; without any, errors grow by 0.4 dB rms at 125 Hz.
const BODIES_OF_TWO: usize = 1;
/// Share of its bound by which a path over two edges ranks: it takes twice the time of another. With 0.25 a reflection over a row of desks was 10 dB too
/// loud, because what two of them take from it was left out.
const OF_TWO: f64 = 0.5;
/// Standard deviation of what is left out, as a share of a band's energy and as root mean square over all bands, up to which no more is
/// computed: ± 0.13 dB at 95 %. With 0.02 in every band 63 Hz, which takes longest, asks for 2.7 times the paths in the hall. In 18
/// other furnished rooms, office and hall, levels are off by 0.072 dB rms, 0.16 dB in 95 of 100, and 94 % of intervals hold (529 octaves).
const AUDIBLE: f64 = 0.015;
/// The same for (B/E)^¾ √v = 1 [1].
const OF_BOUNDS: f64 = 0.045;
/// Most paths of a receiver that nothing blocks. It bounds the time to about a CPU second (corridor of tests/waves: 1.2).
const MOST: usize = 2048;
/// Number of contributions from which on energies over bounds are known. With 64 a quarter of the places behind the hall's parapet were outside
/// their intervals at 63 Hz, by up to 1 dB; with 256 none.
const SURE: usize = 256;
/// Contributions that are computed at once, by all processors.
const AT_ONCE: usize = 32;

/// Edges that are passed.
#[derive(Debug, Clone, Copy)]
pub(super) enum Over {
    /// An edge, by its index.
    Edge(usize),
    /// Two edges of a face.
    Face(Pair),
    /// Two other edges.
    Two([usize; 2]),
}

/// A way over edges.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contribution {
    /// Image of the source, by index.
    pub from: usize,
    /// Image of the receiver.
    pub to: usize,
    pub over: Over,
    /// What is between two edges, by its number.
    pub between: usize,
}

/// All contributions, and how much those still to come may bring.
pub(super) struct Ranked {
    contributions: Vec<Contribution>,
    /// Energy at most, by contribution and band [1/m²].
    bounds: Vec<f64>,
    /// Numbers of those still to come, the greatest first.
    to_come: BinaryHeap<(u64, Reverse<usize>)>,
    /// The sum of those still to come per band [1/m²].
    rest: Vec<f64>,
    /// Energy found per band [1/m²].
    found: Vec<f64>,
    /// Sums over those that were computed per band: of energies at most, and in truth [1/m²].
    computed: Vec<[f64; 2]>,
    /// Number of those that were taken.
    taken: usize,
    /// Number of those that nothing blocks.
    seen: usize,
    /// [`AUDIBLE`] for the share of the batches.
    audible: f64,
}

/// Searches for all contributions at a receiver.
pub(super) struct Search<'a> {
    pub at: &'a ReceiverContext<'a>,
    pub from: &'a Images<'a>,
    pub to: &'a Images<'a>,
}

/// An image of the source with one of the receiver.
struct ImagePair<'a> {
    images: [&'a Image; 2],
    /// ∏ (1−α)(1−s) of the mirrors of both times the source's largest directivity factor, per band.
    factor: Vec<f64>,
    /// Length of the straight way between them [m].
    straight: f64,
    /// What is between two edges.
    joined: &'a Joined,
}

impl Search<'_> {
    /// All contributions beside the `visible` waves and `others` per band [1/m²].
    #[must_use]
    pub(super) fn rank(&self, visible: &[VisibleWave], others: &[f64]) -> Ranked {
        let bands = self.at.attenuation.len();
        let mut found: Vec<f64> = others.iter().map(|energy| 4.0 * PI * energy).collect();
        for wave in visible {
            found.iter_mut().zip(&wave.energy).for_each(|(sum, energy)| *sum += 4.0 * PI * energy);
        }
        let by_image: Vec<(Vec<Contribution>, Vec<f64>)> =
            (0..self.from.all.len()).into_par_iter().map(|from| self.of_image(from)).collect();
        let (contributions, bounds): (Vec<_>, Vec<_>) = by_image.into_iter().unzip();
        let (contributions, bounds) = (contributions.concat(), bounds.concat());
        let mut rest = vec![0.0; bands];
        let mut loudest = vec![f64::MIN_POSITIVE; bands];
        for bounds in bounds.chunks_exact(bands) {
            for ((bound, rest), loudest) in bounds.iter().zip(&mut rest).zip(&mut loudest) {
                *rest += bound;
                *loudest = loudest.max(*bound);
            }
        }
        // By the share of what there is, or of the loudest where nothing is visible; over hidden direct sound by that of its own loudest.
        let is_hidden = visible.iter().all(|wave| wave.order > 0);
        let is_direct = |one: &Contribution| is_hidden && one.from == 0 && one.to == 0;
        let mut whole = [found.clone(), vec![f64::MIN_POSITIVE; bands]];
        whole[0].iter_mut().zip(&loudest).for_each(|(whole, loudest)| *whole = whole.max(*loudest));
        let all = || contributions.iter().zip(bounds.chunks_exact(bands));
        for (_, bounds) in all().filter(|(one, _)| is_direct(one)) {
            whole[1].iter_mut().zip(bounds).for_each(|(whole, bound)| *whole = whole.max(*bound));
        }
        let weigh = |(one, bounds): (&Contribution, &[f64])| {
            let whole = &whole[usize::from(is_direct(one))];
            let share =
                bounds.iter().zip(whole).map(|(bound, whole)| bound / whole).sum::<f64>() / bands as f64;
            // An edge cuts an image source off; what two leave out is smaller and costs more.
            if matches!(one.over, Over::Edge(_)) { share } else { OF_TWO * share }
        };
        // Bits of numbers that are not negative are in the order of the numbers; of equal ones the first counts.
        let to_come = all().map(weigh).zip(0..).map(|(share, number)| (share.to_bits(), Reverse(number)));
        let to_come = to_come.collect();
        let (computed, audible) = (vec![[0.0; 2]; bands], AUDIBLE / self.at.share.sqrt().sqrt());
        Ranked { contributions, bounds, to_come, rest, found, computed, taken: 0, seen: 0, audible }
    }

    /// All contributions of an image of the source, and the bounds of each.
    fn of_image(&self, from: usize) -> (Vec<Contribution>, Vec<f64>) {
        let source = &self.from.all[from];
        let order = self.from.order().min(self.to.order()).min(self.at.complete_order);
        let bands = self.at.attenuation.len();
        let (mut contributions, mut bounds) = (Vec::new(), Vec::new());
        // Images are sorted by order.
        let images = self.to.all.iter().take_while(|receiver| source.order() + receiver.order() <= order);
        for (to, receiver) in images.enumerate() {
            for (between, joined) in self.from.edges.joined.iter().enumerate() {
                let reflections = source.order() + receiver.order() + u32::from(joined.floor.is_some());
                if reflections <= order
                    && let Some(ends) = self.ends(source, receiver, joined)
                {
                    let mut passed = Vec::new();
                    self.over(joined, &ends, [from, to], |over, edges| passed.push((over, edges)));
                    let known = bounds.len();
                    bounds.resize(known + bands * passed.len(), 0.0);
                    // The processors share even a single image.
                    let of_each = bounds[known..].par_chunks_exact_mut(bands).zip(&passed);
                    of_each.with_min_len(AT_ONCE).for_each(|(bounds, (over, edges))| {
                        let both = edges.map(|edge| &self.from.edges.all[edge]);
                        let found = self.bounds(&ends, both, matches!(over, Over::Two(_)));
                        bounds.iter_mut().zip(found).for_each(|(bound, found)| *bound = found);
                    });
                    let all = passed.into_iter().map(|(over, _)| Contribution { from, to, over, between });
                    contributions.extend(all);
                }
            }
        }
        (contributions, bounds)
    }

    /// Visits what may be passed between two images, with the first and the last edge.
    fn over(
        &self,
        joined: &Joined,
        ends: &ImagePair<'_>,
        [from, to]: [usize; 2],
        mut visit: impl FnMut(Over, [usize; 2]),
    ) {
        let [source, receiver] = ends.images;
        if joined.floor.is_none() {
            for (edge, of) in self.from.edges.all.iter().enumerate() {
                if both(source.parts[edge], receiver.parts[edge]).is_some() && lies_off(of, ends) {
                    visit(Over::Edge(edge), [edge; 2]);
                }
            }
        }
        for pair in &joined.pairs {
            let [first, last] = pair.edges;
            if source.parts[first].is_some() && receiver.parts[last].is_some() {
                visit(Over::Face(*pair), pair.edges);
            }
        }
        let reflections = source.order() + receiver.order() + u32::from(joined.floor.is_some());
        let bodies = ends.images.map(Image::mirrors_in_bodies).iter().sum::<usize>();
        if reflections > IMAGES_OF_TWO || bodies > BODIES_OF_TWO {
            return;
        }
        for &first in self.from.lit(from) {
            for &last in joined.partners[first].iter().filter(|&&last| self.to.is_lit(to, last)) {
                visit(Over::Two([first, last]), [first, last]);
            }
        }
    }

    fn ends<'a>(&self, source: &'a Image, receiver: &'a Image, joined: &'a Joined) -> Option<ImagePair<'a>> {
        let radiator = &self.at.radiator;
        let factors = source.factor.iter().zip(&receiver.factor).enumerate();
        let factor: Vec<f64> =
            factors.map(|(band, (one, other))| one * other * radiator.largest(band)).collect();
        if factor.iter().all(|&factor| factor <= 0.0) {
            return None;
        }
        let straight = source.position.distance(joined.image(receiver.position));
        Some(ImagePair { images: [source, receiver], factor, straight, joined })
    }

    /// Upper bounds of what a contribution adds per band by itself [1/m²], and by interference with an amplitude of 1 [1/m]: a quarter of the
    /// energy at Fresnel number 0, 1/(20 N) far from it, as behind a barrier [ISO9613-2].
    fn bounds<'a>(
        &'a self,
        ends: &'a ImagePair<'_>,
        edges: [&'a RoomEdge; 2],
        is_pair: bool,
    ) -> impl Iterator<Item = f64> + 'a {
        let [from, to] = ends.images.map(|image| image.position);
        let image = |point: DVec3| ends.joined.image(point);
        let to = image(to);
        let [first, last] = &ends.joined.wedges(edges);
        // The same with both ends exchanged.
        let (near, far) = (nearest(first, from, to), nearest(last, from, to));
        let (before, behind) = (from.distance(near), far.distance(to));
        let length = before + near.distance(far) + behind;
        let excess = length - ends.straight;
        // Images in faces may be as near to their boundaries as they like: half of the field at most.
        let in_faces = edges[0].faces.iter().chain(&edges[1].faces).filter(|_| ends.joined.floor.is_none());
        let least = in_faces.map(|face| length - face.image(from).distance(to)).fold(excess, f64::min);
        let shortest = first.length().min(last.length());
        let two = (!std::ptr::eq(edges[0], edges[1]))
            .then(|| {
                let apart = near.distance(far);
                let of = |edge: &RoomEdge, before: f64, behind: f64, one: DVec3, other: DVec3| {
                    let images =
                        edge.faces.iter().map(|face| before + behind - face.image(one).distance(other));
                    images.fold(before + behind - one.distance(other), f64::min)
                };
                [of(edges[0], before, apart, from, far), of(edges[1], apart, behind, image(near), image(to))]
            })
            .filter(|_| is_pair);
        let bands = self.from.edges.centres.iter().zip(self.at.attenuation).zip(&ends.factor);
        bands.map(move |((k, m), factor)| {
            let number = least.max(0.0) * k / PI;
            let zone = TAU / k * before * behind / length;
            // Next to its boundary a wave comes from a shorter part of the edge.
            let short = (shortest * shortest / (zone * number.min(1.0)).max(f64::MIN_POSITIVE)).min(1.0);
            // An upper bound of exp(−m length).
            let air = 1.0 / (1.0 + m * length);
            let mut energy = factor * air * short / ((4.0 + 20.0 * number) * length * length);
            if let Some([one, other]) = two {
                let of = |excess: f64| 1.0 / (4.0 + 20.0 * excess.max(0.0) * k / PI);
                energy = factor * air * of(one) * of(other) / (length * length);
            }
            energy
        })
    }
}

impl Ranked {
    /// The next contributions that have to be computed.
    pub(super) fn next(&mut self) -> Option<Vec<Contribution>> {
        if self.seen >= MOST || self.is_enough() {
            return None;
        }
        let next: Vec<usize> =
            (0..AT_ONCE).map_while(|_| self.to_come.pop()).map(|(_, next)| next.0).collect();
        self.taken += next.len();
        let bands = self.rest.len();
        for number in &next {
            let bounds = &self.bounds[number * bands..];
            for ((rest, bound), computed) in self.rest.iter_mut().zip(bounds).zip(&mut self.computed) {
                computed[0] += bound;
                *rest = (*rest - bound).max(0.0);
            }
        }
        (!next.is_empty()).then(|| next.into_iter().map(|number| self.contributions[number]).collect())
    }

    /// Notes the `energy` per band of what has been computed [1/m²].
    pub(super) fn found(&mut self, energy: &[f64]) {
        self.seen += 1;
        for ((found, computed), energy) in self.found.iter_mut().zip(&mut self.computed).zip(energy) {
            *found += FOUND * energy;
            computed[1] += energy;
        }
    }

    /// Number of contributions computed.
    #[must_use]
    pub(super) fn computed(&self) -> usize {
        self.taken
    }

    /// Whether the others are expected to change the bands by no more than is audible.
    fn is_enough(&self) -> bool {
        let square = self.left_out().map(|change| change * change).sum::<f64>();
        self.taken >= SURE && square <= self.audible * self.audible * self.rest.len() as f64
    }

    /// Standard deviation of what the others change each band by, as a share of its energy: they interfere either way.
    pub(super) fn left_out(&self) -> impl Iterator<Item = f64> + '_ {
        let bands = self.rest.iter().zip(&self.found).zip(&self.computed);
        bands.map(|((rest, found), [most, energy])| {
            let share = if self.taken >= SURE && *most > 0.0 { (energy / most).min(1.0) } else { 1.0 };
            let change = || OF_BOUNDS * share.sqrt() * libm::pow(rest / found.max(f64::MIN_POSITIVE), 0.75);
            if *rest > 0.0 { change() } else { 0.0 }
        })
    }
}

/// Whether both ends see an edge from outside its solid.
fn lies_off(edge: &RoomEdge, ends: &ImagePair<'_>) -> bool {
    ends.images
        .iter()
        .all(|image| edge.faces.iter().any(|face| face.height(image.displaced) > 0.0) || edge.wedge.is_rim())
}

/// What is in both parts of an edge [m].
pub(super) fn both(one: Option<[f64; 2]>, other: Option<[f64; 2]>) -> Option<[f64; 2]> {
    let ([from, to], [other_from, other_to]) = (one?, other?);
    let part = [from.max(other_from), to.min(other_to)];
    (part[0] < part[1]).then_some(part)
}

/// Point of an edge on the shortest path between two positions [m].
fn nearest(wedge: &Wedge, from: DVec3, to: DVec3) -> DVec3 {
    let along = [from, to].map(|end| (end - wedge.at(0.0)).dot(wedge.direction()));
    let near = from.distance(wedge.at(along[0]));
    let far = to.distance(wedge.at(along[1]));
    let share = if near + far > 0.0 { near / (near + far) } else { 0.5 };
    wedge.at((along[0] + (along[1] - along[0]) * share).clamp(0.0, wedge.length()))
}
