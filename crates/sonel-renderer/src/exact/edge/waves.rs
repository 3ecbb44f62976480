//! The waves of one contribution: over an edge ([`EdgePath`]), or over two edges of a face ([`FacePath`]).

use std::f64::consts::PI;

use glam::DVec3;
use sonel_diffraction::face::{End, FaceEdge};
use sonel_diffraction::{Cell, Complex, EdgePath, FacePath, Visibility, WAVES, Wave, WedgePoint, apex};
use sonel_map::BandValues;

use super::contributions::{Contribution, Over, place};
use super::faces::Pair;
use super::field::{FacePart, Field, Part, Path, Place, Route};
use super::images::{Image, Images, View, specular};
use super::mirror::Mirror;
use super::visibility::smooth;
use super::{ReceiverContext, RoomEdge};

/// Sine of the angle over a face from which on an end is in front of it: 6°, where a mirrored wave is complete. Chosen, not measured; doubled,
/// mirrored waves fade in over 12°.
const IN_FRONT: f64 = 0.1;
/// Least distance from an edge that the doubt about an end's angle is computed with [m]; it keeps the quotient finite.
const NEAREST: f64 = 1e-3;

/// Computes contributions at a receiver.
pub(super) struct Waves<'a> {
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
    /// Distance from the receiver [m].
    straight: f64,
    /// Share by which both ends are in front of the face: 0 … 1.
    in_front: f64,
    /// In which direction its sound meets the face [m].
    incident: DVec3,
}

/// Factor of mirrors, air and directivity on a contribution, and its direction of arrival.
struct EdgeRoute {
    group: usize,
    /// Amplitude by band, of a source and a receiver that have no direction.
    through: Vec<f64>,
    /// What directions make of it.
    route: Route,
}

impl Waves<'_> {
    /// Adds the waves of a contribution to the field. Returns about the energy that they have by themselves, per band [1/m²]; [`None`] where an
    /// end does not see its edge.
    pub(super) fn add(&mut self, contribution: Contribution) -> Option<Vec<f64>> {
        let mut energy = vec![0.0; self.at.attenuation.len()];
        let [first, last] = match contribution.over {
            Over::Edge(edge) => [edge; 2],
            Over::Pair(pair) => pair.edges,
        };
        let sources = self.from.views(contribution.from, first);
        let receivers = self.to.views(contribution.to, last);
        let mut is_seen = false;
        for source in sources.iter() {
            // What one object hides from both ends does nothing.
            let is_hidden = |object: &u32| source.objects.contains(object);
            for receiver in receivers.iter().filter(|view| !view.objects.iter().any(is_hidden)) {
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
        FacePath::new(edges, ends, self.doubt(points), self.from.edges.spectrum.smallest_k())
    }

    fn add_edge(
        &mut self,
        contribution: Contribution,
        index: usize,
        [source, receiver]: [&View; 2],
        energy: &mut [f64],
    ) -> Option<()> {
        let all = self.from.edges;
        let edge = &all.all[index];
        let [from, to] = [source.point, receiver.point];
        let ends = self.images(contribution).map(|image| image.position);
        let group = self.group(contribution);
        let over = edge.wedge.at(apex(from, to).clamp(0.0, edge.wedge.length()));
        let faces = [0, 1].map(|face| self.image(contribution, &edge.faces[face], over, ends));
        let visible = Visibility {
            direct: Some(!self.field.is_blocked(group, edge.object)),
            faces: faces.map(|image| image.group.map(|group| !self.field.is_blocked(group, edge.object))),
            within: self.doubt([from, to]),
        };
        for part in source.common(receiver) {
            let path = EdgePath::new(&edge.wedge, from, to, part, visible, all.spectrum.smallest_k());
            let along = apex(from, to).clamp(part[0], part[1]);
            let place = edge.wedge.at(along);
            let route = self.route(contribution, group, edge.object, [place; 2]);
            let straight = self.field.position(group).distance(self.at.receiver);
            self.field.keep_clear(group, edge.object, path.detour() - straight);
            for (piece, length) in path.lengths().enumerate() {
                let terms = path.amplitudes(piece, all.spectrum.wave_numbers());
                if piece == 0 {
                    self.add_energy(&route, &terms, energy);
                }
                self.add_terms(&route, length, &terms, edge, faces, [from, to]);
            }
            self.keep_clear(&faces, edge.object, path.detour());
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
        let all = self.from.edges;
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
        let route = self.route(contribution, group, first.object, places);
        let amplitudes = path.amplitudes(all.spectrum.wave_numbers());
        for (lead, terms) in path.leads().zip(&amplitudes) {
            let edge = [first, last][lead.edge];
            let faces =
                [0, 1].map(|face| self.image(contribution, &edge.faces[face], places[lead.edge], ends));
            self.keep_clear(&faces, first.object, path.length());
            self.add_energy(&route, terms, energy);
            self.add_terms(&route, path.length(), terms, edge, faces, lead.ends);
        }
        Some(())
    }

    /// Adds the mean square of all waves of one length together to the `energy` of every band.
    fn add_energy(&self, route: &EdgeRoute, terms: &[[Complex; WAVES]], energy: &mut [f64]) {
        let spectrum = &self.from.edges.spectrum;
        let sum = |(terms, cell): (&[Complex; WAVES], &Cell)| {
            let sum = terms.iter().fold(Complex::ZERO, |sum, term| sum + *term);
            sum * (route.through[cell.band] * route.route.gain[cell.band])
        };
        let wave = Wave { length: 0.0, amplitude: terms.iter().zip(spectrum.cells()).map(sum).collect() };
        energy.iter_mut().zip(spectrum.energy(&[wave])).for_each(|(sum, energy)| *sum += energy);
    }

    /// Notes that edges of an object cut off the images in their faces; of sound whose way is `way` [m].
    fn keep_clear(&mut self, faces: &[FaceImage; 2], object: u32, way: f64) {
        for face in faces.iter().filter(|face| face.in_front > 0.0) {
            let excess = (way - face.straight).max(0.0);
            if let Some(group) = face.group {
                self.field.keep_clear(group, object, excess);
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
            let cells = terms.iter().zip(self.from.edges.spectrum.cells());
            cells.map(|(terms, cell)| terms[wave] * route.through[cell.band]).collect()
        };
        let faces = [0, 1].map(|face| {
            let FaceImage { group, straight, in_front, incident } = faces[face];
            let turn = turn(edge, from, to, face);
            let mirror = &edge.faces[face];
            let mirrored = specular(self.at.table, mirror.surface, incident).into_iter().map(f64::sqrt);
            FacePart {
                group,
                mirrored: mirrored.collect(),
                is_dark: turn > PI,
                in_front,
                excess: (route.route.way - straight).max(0.0),
                terms: of(1 + face),
            }
        });
        let direct = of(0);
        self.field.add(Part { group: route.group, route: route.route.clone(), length, direct, faces });
    }

    /// The group of the image source that is seen past the edges.
    fn group(&mut self, contribution: Contribution) -> usize {
        let [from, to] = self.images(contribution);
        let (mut place, order) = (place(from, to), from.order() + to.order());
        place.through.clone_from(&self.through);
        self.group_at(contribution, place, order, None)
    }

    /// The group of the image source at `place` over the mirrors of a contribution and a `face` between them.
    fn group_at(
        &mut self,
        contribution: Contribution,
        place: Place,
        order: u32,
        face: Option<&Mirror>,
    ) -> usize {
        let position = place.position;
        let group = self.field.group(place, order);
        if self.field.lacks_path(group) {
            let path = self.path(contribution, position, face);
            self.field.set_path(group, path);
        }
        group
    }

    /// The path from the image source at `position` [m] past the edges, over the mirrors of a contribution and a `face` between them.
    fn path(&self, contribution: Contribution, position: DVec3, face: Option<&Mirror>) -> Path {
        // The image of a source behind a mirror may be where the receiver is.
        let length = position.distance(self.at.receiver).max(f64::from(self.at.geometry.resolution()));
        let [from, to] = self.images(contribution);
        let mirrors: Vec<&Mirror> = from.mirrors.iter().chain(face).chain(to.mirrors.iter().rev()).collect();
        let ends = [&self.from.all[0], &self.to.all[0]].map(|end| end.displaced);
        let blocking =
            self.from.edges.objects.blocking(self.at.geometry, self.at.table, ends, &mirrors, &self.through);
        let [towards, back] =
            [to, from].map(|end| face.map_or(end.position, |face| face.image(end.position)));
        let ours = from.factor_towards(self.at.table, towards);
        let theirs = to.factor_towards(self.at.table, back);
        let by_face = face.map(|face| specular(self.at.table, face.surface, towards - from.position));
        let free = |(band, m): (usize, &f64)| {
            let mirrored = by_face.as_ref().map_or(1.0, |by_face| by_face[band]);
            let factor = ours[band] * theirs[band] * mirrored * self.passed(band);
            (factor * libm::exp(-m * length)).sqrt() / length
        };
        let radiation = self.at.radiator.towards(self.from.leaving(contribution.from, towards));
        let sensitivity = self.at.sensitivity.to((position - self.at.receiver).normalize_or_zero());
        let bands = 0..self.at.attenuation.len();
        Path {
            free: self.at.attenuation.iter().enumerate().map(free).collect(),
            gain: bands.map(|band| (radiation.factor(band) * sensitivity).sqrt()).collect(),
            length,
            blocking,
            mirrors: mirrors.iter().map(|mirror| mirror.object).collect(),
        }
    }

    /// τ of all partitions on the path that is being added.
    fn passed(&self, band: usize) -> f64 {
        let passes = |&material: &u32| self.at.table.material(material).transmitted.energy.band(band);
        self.through.iter().map(passes).product()
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
        let planes = from.mirrors.iter().chain(&to.mirrors).map(|mirror| (mirror.plane, mirror.object));
        let position = to.unfold(face.image(from.position));
        let place = Place::new(position, planes.chain([(face.plane, face.object)]), self.through.clone());
        let is_known = order <= self.at.complete_order;
        let height = |end: DVec3| face.height(end) / end.distance(over);
        let in_front = [before, behind].into_iter().map(|end| smooth(height(end) / IN_FRONT)).product();
        let incident = over - before;
        FaceImage {
            group: is_known.then(|| self.group_at(contribution, place, order, Some(face))),
            straight: face.image(before).distance(behind),
            in_front,
            incident,
        }
    }

    fn route(
        &self,
        contribution: Contribution,
        group: usize,
        object: u32,
        [first, last]: [DVec3; 2],
    ) -> EdgeRoute {
        let [from, to] = self.images(contribution);
        let way = from.position.distance(first) + first.distance(last) + last.distance(to.position);
        let towards = self.to.leaving(contribution.to, last).normalize_or_zero();
        let radiation = self.at.radiator.towards(self.from.leaving(contribution.from, first));
        let sensitivity = self.at.sensitivity.to(towards);
        let [ours, theirs] =
            [(from, first), (to, last)].map(|(image, at)| image.factor_towards(self.at.table, at));
        let through = |(band, m): (usize, &f64)| {
            (ours[band] * theirs[band] * self.passed(band)).sqrt() * libm::exp(-0.5 * m * way)
        };
        let bands = 0..self.at.attenuation.len();
        let gain = bands.map(|band| (radiation.factor(band) * sensitivity).sqrt()).collect();
        EdgeRoute {
            group,
            through: self.at.attenuation.iter().enumerate().map(through).collect(),
            route: Route { object, gain, way, towards },
        }
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
