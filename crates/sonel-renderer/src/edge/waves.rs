//! The waves of one contribution: over an edge ([`EdgePath`]), or over two edges of a face ([`FacePath`]).

use std::f64::consts::PI;

use glam::DVec3;
use sonel_diffraction::face::{End, FaceEdge};
use sonel_diffraction::{Complex, EdgePath, FacePath, Lit, WAVES, Wave, WedgePoint, apex};

use super::contributions::{Contribution, Over, place};
use super::faces::Pair;
use super::field::{FacePart, Field, Part, Place};
use super::images::{Image, Images, OFF_THE_MIRROR, specular};
use super::mirror::Mirror;
use super::rows::in_row;
use super::visibility::smooth;
use super::{Edges, Listening, RoomEdge};

/// So many lifts beside its way a path may go on from a mirror; seen from an edge, so far on both of its sides.
const LEFT: f64 = 2.0;
/// Sine of the angle over a face from which on an end is in front of it.
const IN_FRONT: f64 = 0.1;
/// Nearest that an end counts to be to an edge where its place is in doubt [m].
const NEAREST: f64 = 1e-3;

/// Computes contributions at a receiver.
pub(super) struct Waves<'a> {
    pub edges: &'a Edges,
    pub at: &'a Listening<'a>,
    pub from: &'a Images,
    pub to: &'a Images,
    pub field: Field<'a>,
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
struct Course {
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
        match contribution.over {
            Over::Edge(edge) => self.add_edge(contribution, edge, &mut energy)?,
            Over::Pair(pair) => self.add_pair(contribution, pair, &mut energy)?,
        }
        Some(energy)
    }

    fn images(&self, contribution: Contribution) -> [&Image; 2] {
        [&self.from.all[contribution.from], &self.to.all[contribution.to]]
    }

    fn add_edge(&mut self, contribution: Contribution, index: usize, energy: &mut [f64]) -> Option<()> {
        let (all, geometry) = (self.edges, self.at.geometry);
        let edge = &all.all[index];
        let source = self.from.view(all, geometry, contribution.from, index)?;
        let receiver = self.to.view(all, geometry, contribution.to, index)?;
        let (from, to) = (source.point, receiver.point);
        let group = self.group(contribution);
        let over = edge.wedge.at(apex(from, to).clamp(0.0, edge.wedge.length()));
        let faces = [0, 1].map(|face| self.image(contribution, &edge.faces[face], over));
        let lit = Lit {
            direct: Some(self.field.is_visible(group)),
            faces: faces.map(|image| image.group.map(|group| self.field.is_visible(group))),
            within: self.doubt(contribution, from, to),
        };
        let rows = self.row_shares(contribution, index, [from, to]);
        for part in source.common(&receiver) {
            let path = EdgePath::new(&edge.wedge, from, to, part, lit, all.spectrum.smallest_k());
            let along = apex(from, to).clamp(part[0], part[1]);
            let share = source.share * receiver.share;
            let course =
                self.course(contribution, group, [edge.wedge.at(along); 2], path.detour(), (share, &rows));
            let straight = self.field.position(group).distance(self.at.receiver);
            self.field.keep_clear(group, (path.detour() - straight) / share);
            for (piece, length) in path.lengths().enumerate() {
                let terms = path.amplitudes(piece, all.spectrum.wave_numbers());
                if piece == 0 {
                    self.add_energy(&course, &terms, energy);
                }
                self.add_terms(&course, length, &terms, edge, faces, [from, to]);
            }
            self.keep_clear(&faces, path.detour(), share);
        }
        Some(())
    }

    fn add_pair(&mut self, contribution: Contribution, pair: Pair, energy: &mut [f64]) -> Option<()> {
        let (all, geometry) = (self.edges, self.at.geometry);
        let [first, last] = pair.edges.map(|edge| &all.all[edge]);
        let source = self.from.view(all, geometry, contribution.from, pair.edges[0])?;
        let receiver = self.to.view(all, geometry, contribution.to, pair.edges[1])?;
        let of = |edge: usize, part| {
            let wedge = [&first.wedge, &last.wedge][edge];
            FaceEdge { wedge, at_second: pair.at_second[edge], part }
        };
        let edges = [of(0, source.longest()), of(1, receiver.longest())];
        let end = |point: WedgePoint, next: usize, place: DVec3| {
            let face = if pair.at_second[next] { edges[next].wedge.angle() } else { 0.0 };
            let before = edges[next].wedge.locate(place).is_some_and(|at| (at.angle - face).abs() < PI);
            End { point, before }
        };
        let [from, to] = self.images(contribution).map(|image| image.position);
        let ends = [end(source.point, 1, from), end(receiver.point, 0, to)];
        let nearest = source.point.radius.min(receiver.point.radius).max(NEAREST);
        let within = f64::from(geometry.resolution()) / nearest;
        let path = FacePath::new(edges, ends, within, all.spectrum.smallest_k())?;
        let [start, end] = path.crossings();
        let places = [first.wedge.at(start), last.wedge.at(end)];
        let group = self.group(contribution);
        let [one, other] = pair.edges.map(|edge| self.in_row(contribution, edge, [from, to], None));
        let both: Vec<f64> = one.into_iter().zip(other).map(|(one, other)| one.min(other)).collect();
        let rows = [(); WAVES].map(|()| both.clone());
        let share = source.share * receiver.share;
        let course = self.course(contribution, group, places, path.length(), (share, &rows));
        let amplitudes = path.amplitudes(all.spectrum.wave_numbers());
        for (lead, terms) in path.leads().zip(&amplitudes) {
            let edge = [first, last][lead.edge];
            let faces = [0, 1].map(|face| self.image(contribution, &edge.faces[face], places[lead.edge]));
            self.keep_clear(&faces, path.length(), share);
            self.add_energy(&course, terms, energy);
            self.add_terms(&course, path.length(), terms, edge, faces, lead.ends);
        }
        Some(())
    }

    /// Adds the mean square of all waves of one length together to the `energy` of every band.
    fn add_energy(&self, course: &Course, terms: &[[Complex; WAVES]], energy: &mut [f64]) {
        let spectrum = &self.edges.spectrum;
        let sum = |(cell, terms): (usize, &[Complex; WAVES])| {
            let terms = terms.iter().zip(&course.through);
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
        let least = OFF_THE_MIRROR * f64::from(self.at.geometry.lift());
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
    ) -> [Vec<f64>; WAVES] {
        let [from, to] = self.images(contribution).map(|image| image.position);
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
        course: &Course,
        length: f64,
        terms: &[[Complex; WAVES]],
        edge: &RoomEdge,
        faces: [FaceImage; 2],
        [from, to]: [WedgePoint; 2],
    ) {
        let of = |wave: usize| -> Vec<Complex> {
            terms.iter().zip(&course.through[wave]).map(|(terms, &through)| terms[wave] * through).collect()
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
                excess: (course.way - straight).max(0.0),
                terms: of(1 + face),
            })
        });
        self.field.add(Part {
            group: course.group,
            length,
            way: course.way,
            towards: course.towards,
            direct: of(0),
            faces,
        });
    }

    /// The group of the image source that is seen past the edges.
    fn group(&mut self, contribution: Contribution) -> usize {
        let [from, to] = self.images(contribution);
        let (place, order) = (place(from, to), from.order() + to.order());
        self.field.group(place, order)
    }

    /// Its image in a `face` of the edges, which are passed at `over` [m].
    fn image(&mut self, contribution: Contribution, face: &Mirror, over: DVec3) -> FaceImage {
        let [from, to] = self.images(contribution);
        let order = from.order() + to.order() + 1;
        let planes = from.mirrors.iter().chain(&to.mirrors).map(|mirror| mirror.plane);
        let position = to.unfold(face.image(from.position));
        let place = Place::new(position, planes.chain([face.plane]));
        let is_known = order <= self.at.complete_order;
        let height = |image: &Image| face.height(image.position) / image.position.distance(over);
        let in_front = [from, to].into_iter().map(|image| smooth(height(image) / IN_FRONT)).product();
        let incident = over - from.position;
        FaceImage {
            group: is_known.then(|| self.field.group(place, order)),
            straight: position.distance(self.at.receiver),
            in_front,
            incident,
        }
    }

    fn course(
        &self,
        contribution: Contribution,
        group: usize,
        [first, last]: [DVec3; 2],
        way: f64,
        (share, rows): (f64, &[Vec<f64>; WAVES]),
    ) -> Course {
        let [from, to] = self.images(contribution);
        let leaving = self.from.leaving(contribution.from, first);
        let towards = (to.unfold(last) - self.at.receiver).normalize_or_zero();
        let radiation = self.at.radiator.towards(leaving);
        let share = self.at.sensitivity.to(towards).sqrt() * share;
        let [ours, theirs] =
            [(from, first), (to, last)].map(|(image, at)| image.factor_towards(self.at.table, at));
        let through = ours.iter().zip(theirs.iter()).zip(self.at.attenuation);
        let through: Vec<f64> = through
            .enumerate()
            .map(|(band, ((one, other), m))| {
                let strength = radiation.factor(band).sqrt() * share;
                (one * other).sqrt() * libm::exp(-0.5 * m * way) * strength
            })
            .collect();
        let cells = self.edges.spectrum.cells();
        let through = std::array::from_fn(|wave| {
            cells.iter().zip(&rows[wave]).map(|(cell, in_row)| through[cell.band] * in_row).collect()
        });
        Course { group, through, way, towards }
    }

    /// Angle [rad] about a boundary within which positions do not tell on which side of it a path is.
    fn doubt(&self, contribution: Contribution, from: WedgePoint, to: WedgePoint) -> f64 {
        let [source, receiver] = self.images(contribution);
        let geometry = self.at.geometry;
        let of_mirrors = LEFT * f64::from(source.order() + receiver.order()) * f64::from(geometry.lift());
        (f64::from(geometry.resolution()) + of_mirrors) / from.radius.min(to.radius).max(NEAREST)
    }
}

/// By how much [rad] a wave turns about `edge` that seems to come from the image in `face`: π on the image's boundary.
fn turn(edge: &RoomEdge, source: WedgePoint, receiver: WedgePoint, face: usize) -> f64 {
    let sum = source.angle + receiver.angle;
    if face == 0 { sum } else { 2.0 * edge.wedge.angle() - sum }
}
