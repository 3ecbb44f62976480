//! Selects the paths over edges that are computed: those with the largest energy bounds.
//!
//! A contribution is an image of the source, an edge, two edges of a convex face or two other edges, and an image of the receiver. Its energy is at
//! most about 1/(4 + 20 N) of the free field over its way for every edge, N the Fresnel number of the detour: the formula of [Maekawa1968] at its
//! upper side, where half a plane takes 1/4 on the boundary and 1/(4π² N) far in shadow. Far from its boundary an edge shorter than the first Fresnel
//! zone sends less, as its length squared. With a visible image source it interferes, by twice the product of the amplitudes, less over a band the
//! more it turns there. Contributions are computed in the order of these bounds, all above [`LEAST`], others while what is left out is expected to
//! change a band by more than [`AUDIBLE`]. Interference is of random sign: its bounds are added as squares. Most contributions are invisible, the
//! more the lower they rank: the others are expected to bring the same share of their bounds as the last ones.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::DVec3;
use sonel_diffraction::Wedge;

use super::faces::{Joined, Pair};
use super::field::{Field, Key, Place};
use super::images::{Image, Images};
use super::mirror::Mirror;
use super::{ReceiverContext, RoomEdge, VisibleWave};

/// Least energy of a sum of contributions over the sum of their energies [1] that is counted on: they may interfere. Chosen, not measured;
/// doubled, more is left out.
const FOUND: f64 = 0.5;
/// Most images on paths over two edges of different faces. Chosen: against waves (tests/accept/furniture.rs) more change the error of no
/// arrangement by more than 0.25 dB rms.
const IMAGES_OF_TWO: u32 = 2;
/// Most of these in bodies. Chosen likewise; without any, errors grow by 0.4 dB rms at 125 Hz.
const BODIES_OF_TWO: usize = 1;
/// A contribution is computed where its bound is this share of a band's energy, 0.02 dB: so little an image source may step where an edge that is
/// left out cuts it off. Over hidden direct sound it is the share of its loudest one.
const LEAST: f64 = 0.005;
/// Share of its bound by which a path over two edges ranks: four times less is left out of others.
const OF_TWO: f64 = 0.25;
/// Fainter contributions are computed while those left out are expected to bring this share of a band's energy, 0.3 dB.
const AUDIBLE: f64 = 0.07;
/// Most paths of a receiver that nothing blocks. It bounds the time to about a CPU second (corridor of tests/waves: 1.2); `dropped` states the rest.
const MOST: usize = 2048;
/// Number of the last contributions that give the ratio of energies to bounds. Chosen, not measured; doubled, the ratio follows the order of
/// contributions later.
const SURE: usize = 64;
/// Half the relative width of an octave [1], (√2 − 1/√2)/2: waves that turn against one another in it interfere no more.
const HALF_BAND: f64 = 0.35;

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

/// All contributions, the greatest first, and how much those still to come may bring.
pub(super) struct Ranked {
    /// Each with the number of its bounds.
    contributions: Vec<(Contribution, usize)>,
    /// Energy by itself and by interference at most, by contribution and band [1/m²].
    bounds: Vec<[f64; 2]>,
    /// Sums over those still to come per band: of energies, and of squares of interference.
    rest: Vec<[f64; 2]>,
    /// Energy found per band [1/m²].
    found: Vec<f64>,
    /// Energies of the last that were computed per band: at most, and in truth [1/m²]. Each counts 1 − 1/[`SURE`] of the next.
    computed: Vec<[f64; 2]>,
    next: usize,
    /// Number of those that nothing blocks.
    seen: usize,
    /// Number of contributions above [`LEAST`].
    heavy: usize,
}

/// Searches for all contributions at a receiver.
pub(super) struct Search<'a> {
    pub at: &'a ReceiverContext<'a>,
    pub from: &'a Images<'a>,
    pub to: &'a Images<'a>,
    pub field: &'a Field<'a>,
}

/// An image of the source with one of the receiver.
struct Ends<'a> {
    images: [&'a Image; 2],
    /// ∏ (1−α)(1−s) of the mirrors of both times the source's largest directivity factor, per band.
    factor: Vec<f64>,
    /// Length of the straight way between them [m].
    straight: f64,
    /// Whether that is clear.
    is_visible: bool,
    /// The image source that is seen along it.
    place: Place,
    /// What is between two edges.
    joined: &'a Joined,
}

/// Numbers of an image of the source, one of the receiver, and of what is between two edges.
type Between = [usize; 3];

/// The strongest wave of every image source.
#[derive(Default)]
struct Strongest {
    bands: usize,
    /// Number of each image source.
    numbers: HashMap<Key, usize>,
    /// Energies by image source and band [1/m²].
    energies: Vec<f64>,
    /// The ends that were added last.
    last: Option<(Between, usize)>,
    /// The image source of every contribution.
    of_contribution: Vec<usize>,
}

impl Strongest {
    /// Adds a contribution between the images of two numbers.
    fn add(&mut self, images: Between, ends: &Ends<'_>, bounds: &[[f64; 2]]) {
        let number = match self.last {
            Some((last, number)) if last == images => number,
            _ => self.number(ends),
        };
        self.last = Some((images, number));
        self.of_contribution.push(number);
        for (energy, bound) in self.energies[number * self.bands..].iter_mut().zip(bounds) {
            *energy = energy.max(bound[0]);
        }
    }

    fn number(&mut self, ends: &Ends<'_>) -> usize {
        let count = self.numbers.len();
        let number = *self.numbers.entry(ends.place.key()).or_insert(count);
        if number == count {
            self.energies.resize((count + 1) * self.bands, 0.0);
        }
        if ends.is_visible {
            let free = ends.straight * ends.straight;
            for (energy, factor) in self.energies[number * self.bands..].iter_mut().zip(&ends.factor) {
                *energy = energy.max(factor / free);
            }
        }
        number
    }

    /// Gives interference the amplitudes of the strongest waves.
    fn interfere(&self, bounds: &mut [[f64; 2]]) {
        for (bounds, number) in bounds.chunks_exact_mut(self.bands).zip(&self.of_contribution) {
            for (bound, energy) in bounds.iter_mut().zip(&self.energies[number * self.bands..]) {
                bound[1] *= energy.sqrt();
            }
        }
    }
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
        let (mut contributions, mut bounds) = (Vec::new(), Vec::new());
        let mut strongest = Strongest { bands, ..Strongest::default() };
        self.visit(|contribution, ends, wedges| {
            contributions.push((contribution, contributions.len()));
            let first = bounds.len();
            let is_pair = matches!(contribution.over, Over::Two(_));
            bounds.extend(self.bounds(ends, wedges, is_pair));
            strongest.add([contribution.from, contribution.to, contribution.between], ends, &bounds[first..]);
        });
        strongest.interfere(&mut bounds);
        let mut rest = vec![[0.0; 2]; bands];
        let mut loudest = vec![f64::MIN_POSITIVE; bands];
        for bounds in bounds.chunks_exact(bands) {
            for ((bound, rest), loudest) in bounds.iter().zip(&mut rest).zip(&mut loudest) {
                *rest = [rest[0] + bound[0], rest[1] + bound[1] * bound[1]];
                *loudest = loudest.max(bound[0]);
            }
        }
        // By the share of what there is, or of the loudest where nothing is visible; over hidden direct sound by that of its own loudest.
        let is_hidden = visible.iter().all(|wave| wave.order > 0);
        let is_direct = |one: &Contribution| is_hidden && one.from == 0 && one.to == 0;
        let mut whole = [found.clone(), vec![f64::MIN_POSITIVE; bands]];
        whole[0].iter_mut().zip(&loudest).for_each(|(whole, loudest)| *whole = whole.max(*loudest));
        for (_, number) in contributions.iter().filter(|(one, _)| is_direct(one)) {
            let bounds = &bounds[number * bands..];
            whole[1].iter_mut().zip(bounds).for_each(|(whole, bound)| *whole = whole.max(bound[0]));
        }
        let weigh = |(one, number): &(Contribution, usize)| {
            let whole = &whole[usize::from(is_direct(one))];
            let bounds = bounds[number * bands..][..bands].iter().zip(whole);
            let share = bounds.map(|(bound, whole)| (bound[0] + bound[1]) / whole).fold(0.0, f64::max);
            // An edge cuts an image source off; what two leave out is smaller and costs more.
            if matches!(one.over, Over::Edge(_)) { share } else { OF_TWO * share }
        };
        let mut weighed: Vec<(f64, (Contribution, usize))> =
            contributions.into_iter().map(|one| (weigh(&one), one)).collect();
        // Ties stay in the order in which they were found.
        weighed.sort_by(|one, other| other.0.total_cmp(&one.0));
        let heavy = weighed.partition_point(|(weight, _)| *weight >= LEAST);
        let contributions = weighed.into_iter().map(|(_, one)| one).collect();
        Ranked {
            contributions,
            bounds,
            rest,
            found,
            computed: vec![[0.0; 2]; bands],
            next: 0,
            seen: 0,
            heavy,
        }
    }

    /// Visits all contributions, with their ends and edges.
    fn visit(&self, mut visit: impl FnMut(Contribution, &Ends<'_>, [&RoomEdge; 2])) {
        let order = self.from.order().min(self.to.order()).min(self.at.complete_order);
        for (from, source) in self.from.all.iter().enumerate() {
            for (to, receiver) in self.to.all.iter().enumerate() {
                let images = source.order() + receiver.order();
                // Images are sorted by order.
                if images > order {
                    break;
                }
                for (between, joined) in self.from.edges.joined.iter().enumerate() {
                    let reflections = images + u32::from(joined.floor.is_some());
                    if reflections <= order
                        && let Some(ends) = self.ends(source, receiver, joined)
                    {
                        self.over(joined, &ends, [from, to], |over, edges| {
                            let both = edges.map(|edge| &self.from.edges.all[edge]);
                            visit(Contribution { from, to, over, between }, &ends, both);
                        });
                    }
                }
            }
        }
    }

    /// Visits what may be passed between two images, with the first and the last edge.
    fn over(
        &self,
        joined: &Joined,
        ends: &Ends<'_>,
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

    fn ends<'a>(&self, source: &'a Image, receiver: &'a Image, joined: &'a Joined) -> Option<Ends<'a>> {
        let radiator = &self.at.radiator;
        let factors = source.factor.iter().zip(&receiver.factor).enumerate();
        let factor: Vec<f64> =
            factors.map(|(band, (one, other))| one * other * radiator.largest(band)).collect();
        if factor.iter().all(|&factor| factor <= 0.0) {
            return None;
        }
        let place = place(self.from.all[0].position, source, joined.floor.as_slice(), receiver);
        let is_visible = self.field.find(&place).is_some();
        let straight = source.position.distance(joined.image(receiver.position));
        Some(Ends { images: [source, receiver], factor, straight, is_visible, place, joined })
    }

    /// Upper bounds of what a contribution adds per band by itself [1/m²], and by interference with an amplitude of 1 [1/m]: a quarter of the
    /// energy at Fresnel number 0, 1/(20 N) far from it, as behind a barrier [ISO9613-2].
    fn bounds<'a>(
        &'a self,
        ends: &'a Ends<'_>,
        edges: [&'a RoomEdge; 2],
        is_pair: bool,
    ) -> impl Iterator<Item = [f64; 2]> + 'a {
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
            let turns = (1.0 / (HALF_BAND * k * excess.max(f64::MIN_POSITIVE))).min(1.0);
            [energy, 2.0 * energy.sqrt() * turns]
        })
    }
}

impl Ranked {
    /// The next contribution that has to be computed.
    pub(super) fn next(&mut self) -> Option<Contribution> {
        let is_enough = self.next >= self.heavy && self.dropped() <= AUDIBLE;
        if self.seen >= MOST || is_enough {
            return None;
        }
        let (contribution, number) = *self.contributions.get(self.next)?;
        self.next += 1;
        let bands = self.rest.len();
        let bounds = &self.bounds[number * bands..];
        for ((rest, bound), computed) in self.rest.iter_mut().zip(bounds).zip(&mut self.computed) {
            *computed = computed.map(|sum| sum * (1.0 - 1.0 / SURE as f64));
            computed[0] += bound[0];
            *rest = [(rest[0] - bound[0]).max(0.0), (rest[1] - bound[1] * bound[1]).max(0.0)];
        }
        Some(contribution)
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
        self.next
    }

    /// How much the others are expected to change any band, as a share of its energy. Most are invisible: they bring as much of their bounds as
    /// the last that have been computed, once these are enough to tell.
    fn dropped(&self) -> f64 {
        self.left_out().map(|[less, more]| less.max(more)).fold(0.0, f64::max)
    }

    /// By how much the others are expected to lower and to raise each band at most, as shares of its energy: they interfere either way, and add
    /// energy of their own.
    pub(super) fn left_out(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let bands = self.rest.iter().zip(&self.found).zip(&self.computed);
        bands.map(|((rest, found), computed)| {
            let is_known = self.next >= SURE && computed[0] > 0.0;
            let share = if is_known { (computed[1] / computed[0]).min(1.0) } else { 1.0 };
            let interference = (rest[1] * share).sqrt();
            let of = |rest: f64| if rest > 0.0 { rest / found.max(f64::MIN_POSITIVE) } else { 0.0 };
            [of(interference), of(rest[0] * share + interference)]
        })
    }
}

/// The image source over walls alone of what is at `end` [m], that is seen past the edges between two images and over `faces` of the edges.
pub(super) fn place(end: DVec3, source: &Image, faces: &[Mirror], receiver: &Image) -> Place {
    let all = || source.mirrors.iter().chain(faces).chain(receiver.mirrors.iter().rev());
    let walls = || all().filter(|mirror| mirror.is_wall());
    let position = walls().fold(end, |point, mirror| mirror.image(point));
    Place::new(position, walls().map(|mirror| mirror.plane), Vec::new())
}

/// Whether both ends see an edge from outside its solid.
fn lies_off(edge: &RoomEdge, ends: &Ends<'_>) -> bool {
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
