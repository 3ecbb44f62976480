//! The waves that reach a receiver, by the image source over walls that each belongs to, and their energy.
//!
//! Over an edge come three waves ([`sonel_diffraction::EdgePath`]): one completes what is seen past the edge, two the images of that in the faces of
//! the edge. All waves of an image source over walls are added coherently, with itself where it is visible, and so is what bodies mirror and scatter
//! of it: nothing steps where it is cut off. Different image sources add by their energies, as in the rest of the room. An image in a wall is one of
//! its own; in shadow, where it is neither visible nor its boundary near, its waves are those of a rigid face and are added coherently to what is seen
//! past the edge: with N the Fresnel number of the clearance from the boundary they pass from the one to the other with the amplitude
//! N²/(N² + 0.04).
//!
//! Paths over two edges are not enough where many bodies stand behind one another: what they scatter from one to another is limited to half of
//! the free path ([`IN_A_ROW`]).
//!
//! What passes partitions is not in phase with what goes around them: it belongs to an image source of its own for every set of their materials.
//!
//! Reference: docs/diffraction.md.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use sonel_diffraction::{Cell, Complex, WAVES, Wave};
use sonel_geometry::PlaneId;

use super::{EdgeArrival, Edges, VisibleWave};

/// Differences of path length up to which paths over edges are one arrival [m]: of hidden image sources (29 ms), and beside visible ones (3 ms).
/// Chosen, not measured; doubled, arrivals are fewer and their times less certain.
const SAME_ARRIVAL: [f64; 2] = [10.0, 1.0];

/// Fresnel number at which half of the amplitude of a hidden image in a face is added to that of the image source past the edge. The smaller it
/// is the more is right in shadow.
const HALF: f64 = 0.2;
/// Amplitude over that of the free path that paths over several bodies may have together [1]. Between 0.3 and 0.7 the error against waves changes by
/// less than 0.5 dB rms in any octave (docs/diffraction.md).
const IN_A_ROW: f64 = 0.5;
/// Fresnel number that stands for infinity: shares N²/(N² + 0.04) are 1 to 4e-14.
const FAR: f64 = 1e6;

/// Apparent position of an image source at the receiver, with its mirror planes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ImagePlace {
    /// About the scene's centre [m].
    pub position: DVec3,
    /// The planes of its mirrors in ascending order, each that is met an odd number of times once.
    planes: Vec<PlaneId>,
    /// Materials of the partitions between them, in ascending order.
    pub through: Vec<u32>,
}

impl ImagePlace {
    /// At `position` in `planes`, seen through partitions.
    #[must_use]
    pub(crate) fn new(position: DVec3, planes: impl IntoIterator<Item = PlaneId>, through: Vec<u32>) -> Self {
        let mut planes: Vec<PlaneId> = planes.into_iter().collect();
        planes.sort_unstable();
        let odd = planes.chunk_by(|one, other| one == other).filter(|run| run.len() % 2 == 1);
        Self { position, planes: odd.map(|run| run[0]).collect(), through }
    }

    /// Whether both are one but for `distance` [m], in the same planes.
    fn is_at(&self, other: &Self, distance: f64) -> bool {
        self.position.distance(other.position) <= distance && self.through == other.through
    }
}

/// The way of sound over edges.
#[derive(Clone)]
pub(super) struct Route {
    /// Factors of the directions of source and receiver on the amplitudes, per band.
    pub gain: Vec<f64>,
    /// The shortest way over the edges [m].
    pub way: f64,
    /// Unit direction from the receiver to where it comes from.
    pub towards: DVec3,
    /// Index of the visible wave that it is, if it is one.
    pub visible: Option<usize>,
    /// Whether it passes edges of several bodies.
    pub is_over_several: bool,
}

/// The faces of one edge on a path.
pub(super) type Sides = [FaceSide; 2];

/// The image in a face of what an edge is lit by.
pub(super) struct FaceSide {
    /// √((1−α)(1−s)) of the face, per band.
    pub mirrored: Vec<f64>,
    /// Whether the receiver is in the shadow of the image behind the edge.
    pub is_dark: bool,
    /// Share by which both ends are in front of the face, where its image may be visible: 0 … 1.
    pub in_front: f64,
    /// Detour of the path over the edge against that to the image [m].
    pub excess: f64,
    /// Whether the image is one of a body, which scatters as a whole.
    pub is_of_body: bool,
}

/// Waves of one length over one edge or two.
pub(super) struct FieldPart {
    pub route: Arc<Route>,
    /// The length with which the amplitudes rotate [m].
    pub length: f64,
    /// The faces of each edge.
    pub sides: Arc<[Sides]>,
    /// By the wave of the first edge and of the second one (past it, image in the first face, in the second): the image source that it belongs
    /// to, none where nobody knows whether that is visible, and amplitudes, one a cell [1/m].
    pub waves: Vec<(Option<usize>, Vec<Complex>)>,
}

/// A wave with the way that it has come.
struct Sent {
    wave: Wave,
    route: Arc<Route>,
}

/// An image source with the waves that belong to it.
struct Group {
    place: ImagePlace,
    order: u32,
    /// Index of the visible wave.
    visible: Option<usize>,
    /// Least excess over an edge that cuts it off [m].
    clearance: f64,
    /// Amplitude of the free path, per band [1/m].
    free: Vec<f64>,
    sent: Vec<Sent>,
}

/// All waves at a receiver.
pub(super) struct Field<'a> {
    edges: &'a Edges,
    attenuation: &'a [f64],
    groups: Vec<Group>,
    by_planes: HashMap<Vec<PlaneId>, Vec<usize>>,
    /// Places of the visible waves over walls and bodies.
    seen: HashMap<Vec<PlaneId>, Vec<ImagePlace>>,
    same_place: f64,
    parts: Vec<FieldPart>,
}

impl<'a> Field<'a> {
    /// The `visible` waves, and nothing over edges yet. Places nearer than `same_place` [m] are one.
    #[must_use]
    pub(super) fn new(
        edges: &'a Edges,
        attenuation: &'a [f64],
        visible: &[VisibleWave],
        same_place: f64,
    ) -> Self {
        let mut field = Self {
            edges,
            attenuation,
            groups: Vec::new(),
            by_planes: HashMap::new(),
            seen: HashMap::new(),
            same_place,
            parts: Vec::new(),
        };
        for (index, wave) in visible.iter().enumerate() {
            field.seen.entry(wave.whole.planes.clone()).or_default().push(wave.whole.clone());
            let group = field.group(wave.place.clone(), wave.order);
            if wave.bodies.is_empty() {
                field.groups[group].visible = Some(index);
            } else {
                let gain = vec![1.0; attenuation.len()];
                let route = Route {
                    gain,
                    way: wave.length,
                    towards: wave.towards,
                    visible: Some(index),
                    is_over_several: false,
                };
                let wave = field.visible(wave);
                field.groups[group].sent.push(Sent { wave, route: Arc::new(route) });
            }
        }
        field
    }

    /// The group of the image source at `place`, if it has one.
    #[must_use]
    pub(super) fn find(&self, place: &ImagePlace) -> Option<usize> {
        let is_there = |&&group: &&usize| self.groups[group].place.is_at(place, self.same_place);
        self.by_planes.get(&place.planes)?.iter().find(is_there).copied()
    }

    /// Whether a wave over walls and bodies seems to come from `place`.
    #[must_use]
    pub(super) fn sees(&self, place: &ImagePlace) -> bool {
        let seen = self.seen.get(&place.planes);
        seen.is_some_and(|seen| seen.iter().any(|known| known.is_at(place, self.same_place)))
    }

    /// The group of the image source at `place`.
    pub(super) fn group(&mut self, place: ImagePlace, order: u32) -> usize {
        self.find(&place).unwrap_or_else(|| {
            let group = self.groups.len();
            self.by_planes.entry(place.planes.clone()).or_default().push(group);
            self.groups.push(Group {
                place,
                order,
                visible: None,
                clearance: f64::INFINITY,
                free: Vec::new(),
                sent: Vec::new(),
            });
            group
        })
    }

    /// Whether the amplitude of the free path of a group is not known.
    #[must_use]
    pub(super) fn lacks_free(&self, group: usize) -> bool {
        self.groups[group].free.is_empty()
    }

    /// Sets it, per band [1/m].
    pub(super) fn set_free(&mut self, group: usize, free: Vec<f64>) {
        self.groups[group].free = free;
    }

    /// Whether the image source of a group is visible.
    #[must_use]
    pub(super) fn is_visible(&self, group: usize) -> bool {
        self.groups[group].visible.is_some()
    }

    /// Position of the image source of a group [m].
    #[must_use]
    pub(super) fn position(&self, group: usize) -> DVec3 {
        self.groups[group].place.position
    }

    /// Notes that an edge cuts the image source of a group off over which the way is longer by `excess` [m].
    pub(super) fn keep_clear(&mut self, group: usize, excess: f64) {
        let clearance = &mut self.groups[group].clearance;
        *clearance = clearance.min(excess);
    }

    /// Adds a wave that comes straight, or that a body mirrors.
    pub(super) fn add_straight(&mut self, group: usize, wave: Wave, route: Route) {
        self.groups[group].sent.push(Sent { wave, route: Arc::new(route) });
    }

    /// Adds waves over edges.
    pub(super) fn add(&mut self, part: FieldPart) {
        self.parts.push(part);
    }

    /// Sets the energies of the `visible` waves that edges change; returns what arrives over edges besides.
    #[must_use]
    pub(super) fn energies(mut self, visible: &mut [VisibleWave]) -> Vec<EdgeArrival> {
        for part in std::mem::take(&mut self.parts) {
            self.share_out(part);
        }
        let mut arrivals = Vec::new();
        for group in self.groups.iter().filter(|group| !group.sent.is_empty()) {
            arrivals.extend(self.arrivals_at(group, visible));
        }
        arrivals
    }

    /// Gives the waves of a part to the groups that they belong to.
    fn share_out(&mut self, part: FieldPart) {
        let FieldPart { route, length, sides, mut waves } = part;
        let columns = waves.len() / WAVES;
        for (edge, sides) in sides.iter().enumerate() {
            for (face, side) in (1..).zip(sides) {
                // Of the waves of one edge, where those of the other one begin and how far they are apart.
                let (step, others, other_step) =
                    if edge == 0 { (columns, columns, 1) } else { (1, WAVES, columns) };
                let shares = self.shares(side, waves[face * step].0);
                for other in 0..others {
                    let at = other * other_step;
                    let terms = std::mem::take(&mut waves[at + face * step].1);
                    let own = terms.iter().zip(&shares).map(|(term, (_, own))| *term * *own).collect();
                    for ((sum, term), (joined, _)) in waves[at].1.iter_mut().zip(terms).zip(&shares) {
                        *sum += term * *joined;
                    }
                    waves[at + face * step].1 = own;
                }
            }
        }
        for (group, amplitude) in waves {
            if let Some(group) = group {
                let wave = Wave { length, amplitude };
                self.groups[group].sent.push(Sent { wave, route: route.clone() });
            }
        }
    }

    /// Which shares of the wave of an image in a face join what is seen past the edge, and stay with the image, by cell.
    fn shares(&self, side: &FaceSide, group: Option<usize>) -> Vec<(f64, f64)> {
        let is_visible = group.is_some_and(|group| self.is_visible(group));
        let clearance = group.map_or(side.excess, |group| self.groups[group].clearance);
        let of = |cell: &Cell| {
            let mirrored = side.mirrored[cell.band];
            let shaded = |way: f64, half: f64| {
                let number = (way * cell.k / PI).min(FAR);
                let near = half * half / (half * half + number * number);
                1.0 - side.in_front * if side.is_dark || group.is_some() { near } else { 1.0 }
            };
            let rigid = match (side.is_of_body, is_visible) {
                (true, _) => 1.0,
                (false, true) => 0.0,
                (false, false) => shaded(clearance, HALF),
            };
            // Far in its shadow a face is rigid.
            let left = if side.is_dark { shaded(side.excess, 1.0) } else { 1.0 - side.in_front };
            (rigid * (mirrored + (1.0 - mirrored) * left), (1.0 - rigid * rigid).sqrt() * mirrored)
        };
        self.edges.spectrum.cells().iter().map(of).collect()
    }

    /// The energy of a group, shared out to the visible wave and to arrivals in proportion to what each brings alone.
    fn arrivals_at(&self, group: &Group, visible: &mut [VisibleWave]) -> Vec<EdgeArrival> {
        let together = SAME_ARRIVAL[usize::from(group.visible.is_some())];
        let counted = self.counted(group);
        let heard: Vec<Wave> = group.sent.iter().map(|sent| self.wave(sent, &counted)).collect();
        let mut sent: Vec<(&Wave, f64, DVec3, Option<usize>)> = heard
            .iter()
            .zip(&group.sent)
            .map(|(wave, sent)| (wave, sent.route.way, sent.route.towards, sent.route.visible))
            .collect();
        let direct = group.visible.map(|index| self.visible(&visible[index]));
        if let (Some(index), Some(direct)) = (group.visible, &direct) {
            sent.push((direct, 0.0, visible[index].towards, Some(index)));
        }
        sent.sort_by(|one, other| one.1.total_cmp(&other.1));
        let mut energies: Vec<(f64, DVec3, Option<usize>, Vec<f64>)> = Vec::new();
        let mut first = 0;
        for next in 1..=sent.len() {
            let start = if first == 0 && direct.is_some() { sent[0].0.length } else { sent[first].1 };
            if next == sent.len() || sent[next].3.is_some() || sent[next].1 > start + together {
                let waves: Vec<&Wave> = sent[first..next].iter().map(|sent| sent.0).collect();
                energies.push((start, sent[first].2, sent[first].3, self.edges.spectrum.energy(&waves)));
                first = next;
            }
        }
        let whole: Vec<&Wave> = heard.iter().chain(&direct).collect();
        let total = self.edges.spectrum.energy(&whole);
        for (band, total) in total.into_iter().enumerate() {
            let sum: f64 = energies.iter().map(|(.., energy)| energy[band]).sum();
            let gain = total / sum.max(f64::MIN_POSITIVE);
            energies.iter_mut().for_each(|(.., energy)| energy[band] *= gain);
        }
        let mut arrivals = Vec::new();
        for (length, towards, of_visible, energy) in energies {
            let energy = energy.into_iter().map(|energy| energy / (4.0 * PI)).collect();
            match of_visible {
                Some(index) => visible[index].energy = energy,
                None => arrivals.push(EdgeArrival { length, towards, order: group.order, energy }),
            }
        }
        arrivals
    }

    /// How much of what several bodies scatter counts, per band: with A its amplitude over that of the free path, 1 where A is small and [`IN_A_ROW`]/A
    /// where many bodies stand in a row.
    fn counted(&self, group: &Group) -> Vec<f64> {
        let of_several = group.sent.iter().filter(|sent| sent.route.is_over_several);
        let whole = vec![1.0; self.attenuation.len()];
        let waves: Vec<Wave> = of_several.map(|sent| self.wave(sent, &whole)).collect();
        let energies = self.edges.spectrum.energy(&waves);
        let free = group.free.iter().chain(std::iter::repeat(&0.0));
        energies.iter().zip(free).map(|(e, free)| limited(e.sqrt() / free.max(f64::MIN_POSITIVE))).collect()
    }

    /// A wave that has been sent, of which the part over several bodies is `counted`.
    fn wave(&self, sent: &Sent, counted: &[f64]) -> Wave {
        let Sent { wave, route } = sent;
        let cells = wave.amplitude.iter().zip(self.edges.spectrum.cells());
        let gain = |cell: &Cell| {
            route.gain[cell.band] * if route.is_over_several { counted[cell.band] } else { 1.0 }
        };
        let amplitude = cells.map(|(amplitude, cell)| *amplitude * gain(cell)).collect();
        Wave { length: wave.length, amplitude }
    }

    /// A visible wave without edges: of what bodies mirror, the share that small ones do.
    fn visible(&self, wave: &VisibleWave) -> Wave {
        let amplitude = |cell: &Cell| {
            let energy = wave.factor[cell.band] * libm::exp(-self.attenuation[cell.band] * wave.length);
            let scattered = wave.bodies.iter().map(|body| self.edges.bodies.scattered(*body, cell.k));
            scattered.fold(Complex::from(energy.sqrt() / wave.length), |product, factor| product * factor)
        };
        Wave { length: wave.length, amplitude: self.edges.spectrum.cells().iter().map(amplitude).collect() }
    }
}

/// The share that is counted of an amplitude over that of the free path.
fn limited(amplitude: f64) -> f64 {
    libm::pow(1.0 + libm::pow(amplitude / IN_A_ROW, 8.0), -0.125)
}
