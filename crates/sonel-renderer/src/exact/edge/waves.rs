//! The waves of one contribution: over an edge ([`EdgePath`]), or over two edges of a face ([`FacePath`]).

use std::f64::consts::PI;

use glam::DVec3;
use sonel_diffraction::face::{End, FaceEdge};
use sonel_diffraction::{Complex, EdgePath, FacePath, Visibility, WAVES, Wave, WedgePoint, apex};

use super::contributions::{Contribution, Over, place};
use super::faces::Pair;
use super::field::{FacePart, Field, Part, Place};
use super::images::{Image, Images, OFF_THE_MIRROR, View, specular};
use super::mirror::Mirror;
use super::rows::in_row;
use super::visibility::smooth;
use super::{Edges, ReceiverContext, RoomEdge};

/// Sine of the angle over a face from which on an end is in front of it.
const IN_FRONT: f64 = 0.1;
/// Nearest that an end counts to be to an edge where its place is in doubt [m].
const NEAREST: f64 = 1e-3;

/// Computes contributions at a receiver.
pub(super) struct Waves<'a> {
    pub edges: &'a Edges,
    pub at: &'a ReceiverContext<'a>,
    pub from: &'a Images<'a>,
    pub to: &'a Images<'a>,
    pub field: Field<'a>,
    /// Materials of the partitions on the path that is being added, in ascending order.
    pub through: Vec<u32>,
}

/// The image in a face of the image source that is seen past the edges.
#[derive(Clone, Copy)]
struct FaceImage {
    /// None where nobody knows whether it is visible.
    group: Option<usize>,
    /// How far it is from the receiver [m].
    straight: f64,
    /// How far both ends are in front of the face: 0 … 1.
    in_front: f64,
    /// In which direction its sound meets the face [m].
    incident: DVec3,
}

/// What mirrors, air and directivity leave of a contribution, and where it is heard.
struct EdgeRoute {
    group: usize,
    /// Amplitude by wave and cell.
    through: [Vec<f64>; WAVES],
    way: f64,
    towards: DVec3,
}

impl Waves<'_> {
    /// Adds the waves of a contribution to the field. Returns about the energy that they have by themselves, per band [1/m²]; [`None`] where an
    /// end does not see its edge.
    pub fn add(&mut self, contribution: Contribution) -> Option<Vec<f64>> {
        let mut energy = vec![0.0; self.at.attenuation.len()];
        let [first, last] = match contribution.over {
            Over::Edge(edge) => [edge; 2],
            Over::Pair(pair) => pair.edges,
        };
        let scene = (self.at.geometry, self.at.table);
        let sources = self.from.views(self.edges, scene, contribution.from, first);
        let receivers = self.to.views(self.edges, scene, contribution.to, last);
        let mut is_seen = false;
        for source in sources.iter() {
            for receiver in receivers.iter() {
                self.through = [&source.through[..], &receiver.through].concat();
                self.through.sort_unstable();
                let views = [source, receiver];
                let added = match contribution.over {
                    Over::Edge(edge) => self.add_edge(contribution, edge, views, &mut energy),
                    Over::Pair(pair) => self.add_pair(contribution, pair, views, &mut energy),
                };
                is_seen |= added.is_some();
            }
        }
        is_seen.then_some(energy)
    }

    fn images(&self, contribution: Contribution) -> [&Image; 2] {
        [&self.from.all[contribution.from], &self.to.all[contribution.to]]
    }

    /// The path over two edges of a face.
    fn over_face(
        &self,
        edges: [FaceEdge<'_>; 2],
        [from, to]: [DVec3; 2],
        points: [WedgePoint; 2],
    ) -> Option<FacePath> {
        let end = |position: DVec3, point: WedgePoint, next: &FaceEdge<'_>| {
            let face = if next.at_second { next.wedge.angle() } else { 0.0 };
            let at = next.wedge.locate(position);
            End { point, before: at.is_some_and(|at| (at.angle - face).abs() < PI) }
        };
        let ends = [end(from, points[0], &edges[1]), end(to, points[1], &edges[0])];
        FacePath::new(edges, ends, self.doubt(points), self.edges.spectrum.smallest_k())
    }

    fn add_edge(
        &mut self,
        contribution: Contribution,
        index: usize,
        [source, receiver]: [&View; 2],
        energy: &mut [f64],
    ) -> Option<()> {
        let all = self.edges;
        let edge = &all.all[index];
        let [from, to] = [source.point, receiver.point];
        let ends = self.images(contribution).map(|image| image.position);
        let group = self.group(contribution);
        let over = edge.wedge.at(apex(from, to).clamp(0.0, edge.wedge.length()));
        let faces = [0, 1].map(|face| self.image(contribution, &edge.faces[face], over, ends));
        let visible = Visibility {
            direct: Some(self.field.is_visible(group)),
            faces: faces.map(|image| image.group.map(|group| self.field.is_visible(group))),
            within: self.doubt([from, to]),
        };
        let rows = self.row_shares(contribution, index, [from, to], ends);
        for part in source.common(receiver) {
            let path = EdgePath::new(&edge.wedge, from, to, part, visible, all.spectrum.smallest_k());
            let along = apex(from, to).clamp(part[0], part[1]);
            let share = source.share * receiver.share;
            let place = edge.wedge.at(along);
            let route = self.route(contribution, group, [place; 2], (share, &rows));
            let straight = self.field.position(group).distance(self.at.receiver);
            self.field.keep_clear(group, (path.detour() - straight) / share);
            for (piece, length) in path.lengths().enumerate() {
                let terms = path.amplitudes(piece, all.spectrum.wave_numbers());
                if piece == 0 {
                    self.add_energy(&route, &terms, energy);
                }
                self.add_terms(&route, length, &terms, edge, faces, [from, to]);
            }
            self.keep_clear(&faces, path.detour(), share);
        }
        Some(())
    }

    fn add_pair(
        &mut self,
        contribution: Contribution,
        pair: Pair,
        [source, receiver]: [&View; 2],
        energy: &mut [f64],
    ) -> Option<()> {
        let all = self.edges;
        let [first, last] = pair.edges.map(|edge| &all.all[edge]);
        let of = |edge: usize, part| {
            let wedge = [&first.wedge, &last.wedge][edge];
            FaceEdge { wedge, at_second: pair.at_second[edge], part }
        };
        let edges = [of(0, source.longest()), of(1, receiver.longest())];
        let ends = self.images(contribution).map(|image| image.position);
        let displaced = self.images(contribution).map(|image| image.displaced);
        let path = self.over_face(edges, displaced, [source.point, receiver.point])?;
        let [start, end] = path.crossings();
        let places = [first.wedge.at(start), last.wedge.at(end)];
        let group = self.group(contribution);
        let [one, other] = pair.edges.map(|edge| self.in_row(contribution, edge, ends, None));
        let both: Vec<f64> = one.into_iter().zip(other).map(|(one, other)| one.min(other)).collect();
        let rows = [(); WAVES].map(|()| both.clone());
        let share = source.share * receiver.share;
        let route = self.route(contribution, group, places, (share, &rows));
        let amplitudes = path.amplitudes(all.spectrum.wave_numbers());
        for (lead, terms) in path.leads().zip(&amplitudes) {
            let edge = [first, last][lead.edge];
            let faces =
                [0, 1].map(|face| self.image(contribution, &edge.faces[face], places[lead.edge], ends));
            self.keep_clear(&faces, path.length(), share);
            self.add_energy(&route, terms, energy);
            self.add_terms(&route, path.length(), terms, edge, faces, lead.ends);
        }
        Some(())
    }

    /// Adds the mean square of all waves of one length together to the `energy` of every band.
    fn add_energy(&self, route: &EdgeRoute, terms: &[[Complex; WAVES]], energy: &mut [f64]) {
        let spectrum = &self.edges.spectrum;
        let sum = |(cell, terms): (usize, &[Complex; WAVES])| {
            let terms = terms.iter().zip(&route.through);
            terms.fold(Complex::ZERO, |sum, (term, through)| sum + *term * through[cell])
        };
        let wave = Wave { length: 0.0, amplitude: terms.iter().enumerate().map(sum).collect() };
        energy.iter_mut().zip(spectrum.energy(&[wave])).for_each(|(sum, energy)| *sum += energy);
    }

    /// The share of an edge among those of its row, see [`in_row`], of a path between `ends` [m].
    fn in_row(
        &self,
        contribution: Contribution,
        edge: usize,
        ends: [DVec3; 2],
        is_dark: Option<bool>,
    ) -> Vec<f64> {
        let least = OFF_THE_MIRROR * f64::from(self.at.geometry.resolution());
        let images = self.images(contribution);
        // Edges behind a mirror are on no way, those in its plane border on it.
        let is_before = |other: &RoomEdge| {
            let middle = other.wedge.at(0.5 * other.wedge.length());
            images.iter().all(|image| image.mirrors.last().is_none_or(|mirror| mirror.height(middle) > least))
        };
        in_row(self.edges, edge, ends, is_dark, is_before)
    }

    /// The shares of the waves over an edge: that of the image in a face is grazed as the image is seen from either end.
    fn row_shares(
        &self,
        contribution: Contribution,
        index: usize,
        points: [WedgePoint; 2],
        [from, to]: [DVec3; 2],
    ) -> [Vec<f64>; WAVES] {
        let edge = &self.edges.all[index];
        let direct = self.in_row(contribution, index, [from, to], None);
        let [first, second] = [0, 1].map(|face| {
            let mirror = &edge.faces[face];
            if mirror.height(from) <= 0.0 || mirror.height(to) <= 0.0 {
                return direct.clone();
            }
            let is_dark = Some(turn(edge, points[0], points[1], face) > PI);
            let there = self.in_row(contribution, index, [mirror.image(from), to], is_dark);
            let back = self.in_row(contribution, index, [from, mirror.image(to)], is_dark);
            there.into_iter().zip(back).map(|(there, back)| there.min(back)).collect()
        });
        [direct, first, second]
    }

    /// Notes that edges cut off the images in their faces; of sound whose way is `way` [m], `share` of which is there.
    fn keep_clear(&mut self, faces: &[FaceImage; 2], way: f64, share: f64) {
        for face in faces.iter().filter(|face| face.in_front > 0.0) {
            let excess = (way - face.straight).max(0.0) / share;
            if let Some(group) = face.group {
                self.field.keep_clear(group, excess);
            }
        }
    }

    /// Adds the waves of one length over `edge`.
    fn add_terms(
        &mut self,
        route: &EdgeRoute,
        length: f64,
        terms: &[[Complex; WAVES]],
        edge: &RoomEdge,
        faces: [FaceImage; 2],
        [from, to]: [WedgePoint; 2],
    ) {
        let of = |wave: usize| -> Vec<Complex> {
            terms.iter().zip(&route.through[wave]).map(|(terms, &through)| terms[wave] * through).collect()
        };
        let faces = [0, 1].map(|face| {
            let FaceImage { group, straight, in_front, incident } = faces[face];
            let turn = turn(edge, from, to, face);
            let mirror = &edge.faces[face];
            let mirrored = specular(self.at.table, mirror.surface, incident).into_iter().map(f64::sqrt);
            Some(FacePart {
                group,
                mirrored: mirrored.collect(),
                is_dark: turn > PI,
                in_front,
                excess: (route.way - straight).max(0.0),
                terms: of(1 + face),
            })
        });
        self.field.add(Part {
            group: route.group,
            length,
            way: route.way,
            towards: route.towards,
            direct: of(0),
            faces,
        });
    }

    /// The group of the image source that is seen past the edges.
    fn group(&mut self, contribution: Contribution) -> usize {
        let [from, to] = self.images(contribution);
        let (mut place, order) = (place(from, to), from.order() + to.order());
        place.through.clone_from(&self.through);
        self.field.group(place, order)
    }

    /// Its image in a `face` of the edges, which are passed at `over` [m].
    fn image(
        &mut self,
        contribution: Contribution,
        face: &Mirror,
        over: DVec3,
        [before, behind]: [DVec3; 2],
    ) -> FaceImage {
        let [from, to] = self.images(contribution);
        let order = from.order() + to.order() + 1;
        let planes = from.mirrors.iter().chain(&to.mirrors).map(|mirror| mirror.plane);
        let position = to.unfold(face.image(from.position));
        let place = Place::new(position, planes.chain([face.plane]), self.through.clone());
        let is_known = order <= self.at.complete_order;
        let height = |end: DVec3| face.height(end) / end.distance(over);
        let in_front = [before, behind].into_iter().map(|end| smooth(height(end) / IN_FRONT)).product();
        let incident = over - before;
        FaceImage {
            group: is_known.then(|| self.field.group(place, order)),
            straight: face.image(before).distance(behind),
            in_front,
            incident,
        }
    }

    fn route(
        &self,
        contribution: Contribution,
        group: usize,
        [first, last]: [DVec3; 2],
        (share, rows): (f64, &[Vec<f64>; WAVES]),
    ) -> EdgeRoute {
        let [from, to] = self.images(contribution);
        let way = from.position.distance(first) + first.distance(last) + last.distance(to.position);
        let towards = self.to.leaving(contribution.to, last).normalize_or_zero();
        let radiation = self.at.radiator.towards(self.from.leaving(contribution.from, first));
        let share = self.at.sensitivity.to(towards).sqrt() * share;
        let [ours, theirs] =
            [(from, first), (to, last)].map(|(image, at)| image.factor_towards(self.at.table, at));
        let through = ours.iter().zip(theirs.iter()).zip(self.at.attenuation);
        let through: Vec<f64> = through
            .enumerate()
            .map(|(band, ((one, other), m))| {
                let passes =
                    |&material: &u32| self.at.table.material(material).transmitted.energy[band / 4][band % 4];
                let passed: f64 = self.through.iter().map(passes).product();
                let strength = (radiation.factor(band) * passed).sqrt() * share;
                (one * other).sqrt() * libm::exp(-0.5 * m * way) * strength
            })
            .collect();
        let cells = self.edges.spectrum.cells();
        let through = std::array::from_fn(|wave| {
            cells.iter().zip(&rows[wave]).map(|(cell, in_row)| through[cell.band] * in_row).collect()
        });
        EdgeRoute { group, through, way, towards }
    }

    /// Angle [rad] about a boundary within which corners off their edge may decide on which side of it a path is.
    fn doubt(&self, [from, to]: [WedgePoint; 2]) -> f64 {
        f64::from(self.at.geometry.resolution()) / from.radius.min(to.radius).max(NEAREST)
    }
}

/// By how much [rad] a wave turns about `edge` that seems to come from the image in `face`: π on the image's boundary.
fn turn(edge: &RoomEdge, source: WedgePoint, receiver: WedgePoint, face: usize) -> f64 {
    let sum = source.angle + receiver.angle;
    if face == 0 { sum } else { 2.0 * edge.wedge.angle() - sum }
}
