//! The waves of one contribution: over an edge ([`EdgePath`]), over two edges of a face ([`FacePath`]), or over two others ([`EdgePair`]).

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use sonel_diffraction::face::{End, FaceEdge, crossings};
use sonel_diffraction::{
    Cell, Complex, EdgePair, EdgePath, FacePath, PairWay, PartOfEdge, Visibility, WAVES, Wave, Wedge,
    WedgePoint, apex,
};
use sonel_map::BandValues;

use super::bodies::WALL;
use super::contributions::{Contribution, Over, both};
use super::faces::Pair;
use super::field::{FaceSide, Field, FieldPart, ImagePlace, Route, Sides};
use super::images::{Image, Images, Passed, specular};
use super::mirror::Mirror;
use super::{OFF_EDGE, ReceiverContext, RoomEdge};

/// Sine of the angle over a face from which on an end is in front of it: 6°, where a mirrored wave is complete. Chosen, not measured; doubled,
/// mirrored waves fade in over 12°.
const IN_FRONT: f64 = 0.1;
/// Least distance from an edge that the doubt about an end's angle is computed with [m]; it keeps the quotient finite.
const NEAREST: f64 = 1e-3;
/// Distance of a path from the ends of an edge, as a share of its length [1]: off the faces there.
const OFF_THE_ENDS: f64 = 2e-4;
/// The same of the rays that tell whether it is clear [1]: a hair off the edge, they pass the faces at its ends at angles above a milliradian or two,
/// for edges of 0.4 m and more. Chosen: with [`OFF_THE_ENDS`] it was 30 mrad (tests/physics/solid_buildings.rs).
const SEEN_OFF_THE_ENDS: f64 = 0.01;

/// Computes contributions at a receiver.
pub(super) struct Waves<'a> {
    pub at: &'a ReceiverContext<'a>,
    pub from: &'a Images<'a>,
    pub to: &'a Images<'a>,
    pub field: Field<'a>,
    /// Whether faces lie between source and receiver wherever sound goes: then no body is small enough to be passed.
    pub is_sealed: bool,
}

/// A path that nothing blocks.
struct ClearPath<'a> {
    images: [&'a Image; 2],
    /// Materials of the partitions that it passes, in ascending order.
    through: Vec<u32>,
    /// Amplitude by cell, of a source and a receiver that have no direction.
    amplitude: Vec<Complex>,
    /// The way that it takes.
    route: Route,
    /// The floor between its edges.
    floor: Option<&'a Mirror>,
}

/// A contribution with its waves.
pub(super) struct Found<'a> {
    path: ClearPath<'a>,
    parts: Vec<FoundPart<'a>>,
    /// About the energy that they have by themselves, per band [1/m²].
    pub energy: Vec<f64>,
}

/// Waves over the same edges.
struct FoundPart<'a> {
    passed: Vec<PassedEdge<'a>>,
    /// The shortest way over the one edge that cuts an image source off [m].
    detour: Option<f64>,
    /// Lengths with which amplitudes rotate [m], and those by wave of the first edge and of the second one and by cell [1/m].
    pieces: Vec<(f64, Vec<Vec<Complex>>)>,
}

/// One edge on a path.
struct PassedEdge<'a> {
    edge: &'a RoomEdge,
    /// Where it is passed [m].
    over: DVec3,
    /// Where sound comes from and where it goes [m].
    ends: [DVec3; 2],
    /// The same about the edge.
    points: [WedgePoint; 2],
}

impl<'a> Waves<'a> {
    /// The waves of a contribution; [`None`] where something is on its way.
    pub(super) fn find(&self, contribution: Contribution) -> Option<Found<'a>> {
        match contribution.over {
            Over::Edge(edge) => self.over_edge(contribution, edge),
            Over::Face(pair) => self.over_pair(contribution, pair),
            Over::Two(edges) => self.over_two(contribution, edges),
        }
    }

    /// Adds them to the field.
    pub(super) fn add(&mut self, Found { path, parts, .. }: Found<'a>) {
        let route = Arc::new(path.route.clone());
        for FoundPart { passed, detour, pieces } in parts {
            let (sides, groups) = self.sides(&path, &passed);
            if let (Some(detour), Some(group)) = (detour, groups[0]) {
                let straight = self.field.position(group).distance(self.at.receiver);
                self.field.keep_clear(group, detour - straight);
            }
            for (length, waves) in pieces {
                let waves = groups.iter().copied().zip(waves).collect();
                self.field.add(FieldPart { route: route.clone(), length, sides: sides.clone(), waves });
            }
        }
    }

    /// Adds what comes straight past small bodies, or from mirrors past them.
    pub(super) fn add_straight(&mut self) {
        for image in 0..self.from.all.len() {
            let source = &self.from.all[image];
            let own = bodies_of(&source.mirrors, &[]);
            let Some(passed) = self.from.sees(image, self.to.all[0].displaced, &own) else { continue };
            // What passes nothing is visible, and known.
            if passed.bodies.is_empty() || self.is_sealed {
                continue;
            }
            let receiver = self.at.receiver;
            let path = self.clear_path([image, 0], [receiver; 2], passed, &own);
            let place = self.place(&path, &[]);
            let group = self.field.group(place, source.order());
            let length = path.route.way;
            let amplitude = path.amplitude.iter().map(|amplitude| *amplitude * (1.0 / length)).collect();
            self.field.add_straight(group, Wave { length, amplitude }, path.route);
        }
    }

    fn images(&self, contribution: Contribution) -> [&'a Image; 2] {
        let (from, to) = (self.from, self.to);
        [&from.all[contribution.from], &to.all[contribution.to]]
    }

    fn over_edge(&self, contribution: Contribution, index: usize) -> Option<Found<'a>> {
        let all = self.from.edges;
        let edge = &all.all[index];
        let images = self.images(contribution);
        let part = both(images[0].parts[index], images[1].parts[index])?;
        let [from, to] = [edge.wedge.locate(images[0].displaced)?, edge.wedge.locate(images[1].displaced)?];
        let over = inside(&edge.wedge, part, apex(from, to));
        let path = self.clear(contribution, &[edge], &[edge.beside(over, part)], [over; 2], None)?;
        let passed = PassedEdge { edge, over, ends: images.map(|image| image.position), points: [from, to] };
        let visible = Visibility {
            direct: Some(self.sees(&path, None)),
            faces: [0, 1].map(|face| Some(self.sees(&path, Some(&edge.faces[face])))),
            within: self.doubt([from, to]),
        };
        let edge_path = EdgePath::new(&edge.wedge, from, to, part, visible, all.spectrum.range());
        let mut energy = Vec::new();
        let lengths = edge_path.lengths().enumerate();
        let pieces = lengths.map(|(piece, length)| {
            let terms = edge_path.amplitudes(piece, all.spectrum.wave_numbers());
            if piece == 0 {
                energy = self.energy(&path, terms.iter().map(sum));
            }
            (length, path.by_wave(&terms))
        });
        let pieces = pieces.collect();
        let detour = Some(edge_path.detour());
        Some(Found { parts: vec![FoundPart { passed: vec![passed], detour, pieces }], path, energy })
    }

    fn over_pair(&self, contribution: Contribution, pair: Pair) -> Option<Found<'a>> {
        let all = self.from.edges;
        let both = pair.edges.map(|edge| &all.all[edge]);
        let images = self.images(contribution);
        let parts = [images[0].parts[pair.edges[0]]?, images[1].parts[pair.edges[1]]?];
        // Behind a floor everything is mirrored in it.
        let joined = &all.joined[contribution.between];
        let wedges = joined.wedges(both);
        let of = |edge: usize| FaceEdge {
            wedge: &wedges[edge],
            at_second: pair.at_second[edge],
            part: parts[edge],
        };
        let displaced = [images[0].displaced, joined.image(images[1].displaced)];
        let points = [wedges[0].locate(displaced[0])?, wedges[1].locate(displaced[1])?];
        let crossings = crossings([of(0), of(1)], points);
        let places = [0, 1].map(|edge| inside(&both[edge].wedge, parts[edge], crossings[edge]));
        let hairs = [0, 1].map(|edge| both[edge].beside(places[edge], parts[edge]));
        let path = self.clear(contribution, &both, &hairs, places, Some(pair))?;
        let face_path = self.over_face([of(0), of(1)], displaced, points)?;
        let amplitudes = face_path.amplitudes(all.spectrum.wave_numbers());
        let mut energy = vec![0.0; self.at.attenuation.len()];
        let parts = face_path.leads().zip(&amplitudes).map(|(lead, terms)| {
            let mut ends = images.map(|image| image.position);
            ends[1 - lead.edge] = joined.image(ends[1 - lead.edge]);
            let passed =
                PassedEdge { edge: both[lead.edge], over: places[lead.edge], ends, points: lead.ends };
            energy
                .iter_mut()
                .zip(self.energy(&path, terms.iter().map(sum)))
                .for_each(|(sum, energy)| *sum += energy);
            let pieces = vec![(face_path.length(), path.by_wave(terms))];
            FoundPart { passed: vec![passed], detour: None, pieces }
        });
        Some(Found { parts: parts.collect(), path, energy })
    }

    fn over_two(&self, contribution: Contribution, edges: [usize; 2]) -> Option<Found<'a>> {
        let all = self.from.edges;
        let both = edges.map(|edge| &all.all[edge]);
        let images = self.images(contribution);
        // Behind a floor everything is mirrored in it.
        let joined = &all.joined[contribution.between];
        let wedges = joined.wedges(both);
        let parts = [
            PartOfEdge { wedge: &wedges[0], part: off_the_ends(images[0].parts[edges[0]]?, OFF_THE_ENDS) },
            PartOfEdge { wedge: &wedges[1], part: off_the_ends(images[1].parts[edges[1]]?, OFF_THE_ENDS) },
        ];
        let displaced = [images[0].displaced, joined.image(images[1].displaced)];
        let way = PairWay::new(parts, displaced)?;
        let places = [way.places[0], joined.image(way.places[1])];
        let hairs = [0, 1].map(|edge| both[edge].beside(places[edge], parts[edge].part));
        let path = self.clear(contribution, &both, &hairs, places, None)?;
        let pair = EdgePair::new(parts, displaced, &way, all.spectrum.range())?;
        let passed = [0, 1].map(|edge| {
            let ends = match edge {
                0 => [images[0].position, way.unfolded[0]],
                _ => [joined.image(way.unfolded[1]), images[1].position],
            };
            PassedEdge { edge: both[edge], over: places[edge], ends, points: pair.points()[edge] }
        });
        let terms: Vec<[Complex; WAVES * WAVES]> = pair
            .amplitudes(all.spectrum.wave_numbers())
            .iter()
            .map(|terms| std::array::from_fn(|wave| terms[wave / WAVES][wave % WAVES]))
            .collect();
        let energy = self.energy(&path, terms.iter().map(sum));
        let pieces = vec![(pair.length(), path.by_wave(&terms))];
        Some(Found { parts: vec![FoundPart { passed: passed.into(), detour: None, pieces }], path, energy })
    }

    /// The path over `edges`, past the `hairs` beside them, if it is clear; along the face of a `pair`.
    fn clear(
        &self,
        contribution: Contribution,
        edges: &[&RoomEdge],
        hairs: &[DVec3],
        places: [DVec3; 2],
        pair: Option<Pair>,
    ) -> Option<ClearPath<'a>> {
        let [from, to] = self.images(contribution);
        let own = bodies_of(from.mirrors.iter().chain(&to.mirrors), edges);
        let mut passed = self.from.sees(contribution.from, hairs[0], &own)?;
        passed.extend(self.to.sees(contribution.to, hairs[hairs.len() - 1], &own)?);
        let floor = self.from.edges.joined[contribution.between].floor.as_ref();
        let joins = |places: [DVec3; 2]| match floor {
            Some(floor) => self.from.over(floor, places, &own),
            None => self.from.between(places, &own),
        };
        match (pair, hairs) {
            (Some(pair), _) => {
                let normal = edges[0].faces[usize::from(pair.at_second[0])].normal();
                let hair = OFF_EDGE * f64::from(self.at.geometry.resolution()) * normal;
                let along = |hair: DVec3| joins(places.map(|place| place + hair));
                let is_sheet = edges.iter().all(|edge| edge.wedge.is_rim());
                passed.extend(along(hair).or_else(|| along(-hair).filter(|_| is_sheet))?);
            }
            (None, &[first, last]) => passed.extend(joins([first, last])?),
            (None, _) => {}
        }
        let passed = self.unless_sealed(passed)?;
        let mut path = self.clear_path([contribution.from, contribution.to], places, passed, &own);
        let body = edges[0].body();
        path.route.is_over_several = edges.iter().any(|edge| edge.body() != body);
        if let Some(floor) = floor {
            path.mirror_in(self, floor, places);
        }
        Some(path)
    }

    /// What is passed, unless a body is passed between sealed ends.
    fn unless_sealed(&self, passed: Passed) -> Option<Passed> {
        (passed.bodies.is_empty() || !self.is_sealed).then_some(passed)
    }

    /// The path between two images over the first and the last one of `places` [m], where the bodies `own` scatter and others are `passed`.
    fn clear_path(
        &self,
        images: [usize; 2],
        [first, last]: [DVec3; 2],
        passed: Passed,
        own: &[u32],
    ) -> ClearPath<'a> {
        let (ours, theirs) = (self.from, self.to);
        let [from, to] = [&ours.all[images[0]], &theirs.all[images[1]]];
        let way = from.position.distance(first) + first.distance(last) + last.distance(to.position);
        let behind = if images[1] == 0 && last == to.position {
            from.position - last
        } else {
            self.to.leaving(images[1], last)
        };
        let towards = behind.normalize_or_zero();
        let radiation = self.at.radiator.towards(self.from.leaving(images[0], first));
        let sensitivity = self.at.sensitivity.to(towards);
        let mirrored = [(from, first), (to, last)].map(|(image, at)| image.factor_towards(self.at.table, at));
        let tau = |band: usize| -> f64 {
            let passes = |&material: &u32| self.at.table.material(material).transmitted.energy.band(band);
            passed.through.iter().map(passes).product()
        };
        let through = |(band, m): (usize, &f64)| {
            (mirrored[0][band] * mirrored[1][band] * tau(band)).sqrt() * libm::exp(-0.5 * m * way)
        };
        let through: Vec<f64> = self.at.attenuation.iter().enumerate().map(through).collect();
        let edges = self.from.edges;
        let amplitude = |cell: &Cell| {
            let scattered = |body: &u32| edges.bodies.scattered(*body, cell.k);
            let left = |body: &u32| Complex::from(1.0) - scattered(body);
            let all = own.iter().map(scattered).chain(passed.bodies.iter().map(left));
            all.fold(Complex::from(through[cell.band]), |product, factor| product * factor)
        };
        let bands = 0..self.at.attenuation.len();
        let gain = bands.map(|band| (radiation.factor(band) * sensitivity).sqrt()).collect();
        ClearPath {
            images: [from, to],
            amplitude: edges.spectrum.cells().iter().map(amplitude).collect(),
            route: Route { gain, way, towards, visible: None, is_over_several: false },
            through: passed.through,
            floor: None,
        }
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
        FacePath::new(edges, ends, self.doubt(points), self.from.edges.spectrum.range())
    }

    /// The mean square of a wave with `terms` by cell, per band.
    fn energy(&self, path: &ClearPath<'_>, terms: impl Iterator<Item = Complex>) -> Vec<f64> {
        let spectrum = &self.from.edges.spectrum;
        let directed = |(term, cell): (Complex, &Cell)| term * path.route.gain[cell.band];
        spectrum.energy_of_one(path.heard(terms).into_iter().zip(spectrum.cells()).map(directed))
    }

    /// The image source over walls alone that is seen past the edges and over `faces` of theirs.
    fn place(&self, path: &ClearPath<'_>, faces: &[Mirror]) -> ImagePlace {
        let [from, to] = path.images;
        let all = || from.mirrors.iter().chain(faces).chain(path.floor).chain(to.mirrors.iter().rev());
        let walls = || all().filter(|mirror| mirror.is_wall());
        let position = walls().fold(self.from.all[0].position, |point, mirror| mirror.image(point));
        ImagePlace::new(position, walls().map(|mirror| mirror.plane), path.through.clone())
    }

    /// Whether what passes the edges, or is mirrored in the `face` of one, reaches the receiver without them.
    fn sees(&self, path: &ClearPath<'_>, face: Option<&Mirror>) -> bool {
        let [from, to] = path.images;
        let position = face.map_or(from.position, |face| face.image(from.position));
        let planes = from.mirrors.iter().chain(face).chain(&to.mirrors).map(|mirror| mirror.plane);
        self.field.sees(&ImagePlace::new(to.unfold(position), planes, path.through.clone()))
    }

    /// The faces of the edges of a path, and by wave of the first one and of the second one the image sources that are seen over them; none where
    /// nobody knows whether they are visible, and where a face is one of a body.
    fn sides(
        &mut self,
        path: &ClearPath<'_>,
        passed: &[PassedEdge<'_>],
    ) -> (Arc<[Sides]>, Vec<Option<usize>>) {
        let sides: Arc<[Sides]> = passed.iter().map(|passed| self.face_sides(passed)).collect();
        let order = path.images[0].order() + path.images[1].order() + u32::from(path.floor.is_some());
        let columns = if passed.len() > 1 { WAVES } else { 1 };
        let mut groups = Vec::with_capacity(WAVES * columns);
        for wave in 0..WAVES * columns {
            let waves = [wave / columns, wave % columns];
            let of_edge =
                |(passed, wave): (&PassedEdge<'_>, usize)| (wave > 0).then(|| passed.edge.faces[wave - 1]);
            let faces: Vec<Mirror> = passed.iter().zip(waves).filter_map(of_edge).collect();
            let order = order + faces.len() as u32;
            let is_known =
                faces.is_empty() || (order <= self.at.complete_order && faces.iter().all(Mirror::is_wall));
            let place = self.place(path, &faces);
            groups.push(is_known.then(|| self.group_of(path, place, order)));
        }
        for (edge, sides) in sides.iter().enumerate() {
            let step = if edge == 0 { columns } else { 1 };
            for (face, side) in (1..).zip(sides).filter(|(_, side)| side.in_front > 0.0) {
                if let Some(group) = groups[face * step] {
                    self.field.keep_clear(group, side.excess);
                }
            }
        }
        (sides, groups)
    }

    /// The group of an image source, whose free path is that of `path` without what bodies mirror.
    fn group_of(&mut self, path: &ClearPath<'_>, place: ImagePlace, order: u32) -> usize {
        let group = self.field.group(place, order);
        if self.field.lacks_free(group) {
            let length = self
                .field
                .position(group)
                .distance(self.at.receiver)
                .max(f64::from(self.at.geometry.resolution()));
            let walls = |image: &Image, band: usize| -> f64 {
                let of = |mirror: &Mirror| self.at.table.mean_row(mirror.surface).specular.energy.band(band);
                image.mirrors.iter().filter(|mirror| mirror.is_wall()).map(of).product()
            };
            let [from, to] = path.images;
            let free = |(band, m): (usize, &f64)| {
                (walls(from, band) * walls(to, band) * libm::exp(-m * length)).sqrt() * path.route.gain[band]
                    / length
            };
            let free = self.at.attenuation.iter().enumerate().map(free).collect();
            self.field.set_free(group, free);
        }
        group
    }

    fn face_sides(&self, passed: &PassedEdge<'_>) -> Sides {
        [0, 1].map(|face| {
            let mirror = &passed.edge.faces[face];
            let [before, behind] = passed.ends;
            let height = |end: DVec3| mirror.height(end) / end.distance(passed.over);
            let in_front = [before, behind].into_iter().map(|end| smooth(height(end) / IN_FRONT)).product();
            let way = before.distance(passed.over) + passed.over.distance(behind);
            let mirrored = specular(self.at.table, mirror.surface, passed.over - before);
            FaceSide {
                mirrored: mirrored.into_iter().map(f64::sqrt).collect(),
                is_dark: turn(passed.edge, passed.points, face) > PI,
                in_front,
                excess: (way - mirror.image(before).distance(behind)).max(0.0),
                is_of_body: !mirror.is_wall(),
            }
        })
    }

    /// Angle [rad] about a boundary within which corners off their edge may decide on which side of it a path is.
    fn doubt(&self, [from, to]: [WedgePoint; 2]) -> f64 {
        f64::from(self.at.geometry.resolution()) / from.radius.min(to.radius).max(NEAREST)
    }
}

impl<'a> ClearPath<'a> {
    /// Takes the way between the `places` [m] over a floor.
    fn mirror_in(&mut self, waves: &Waves<'a>, floor: &'a Mirror, [first, last]: [DVec3; 2]) {
        self.floor = Some(floor);
        let longer = first.distance(floor.image(last)) - first.distance(last);
        self.route.way += longer;
        let mirrored = specular(waves.at.table, floor.surface, floor.image(last) - first);
        let bands: Vec<f64> = mirrored
            .iter()
            .zip(waves.at.attenuation)
            .map(|(mirrored, m)| mirrored.sqrt() * libm::exp(-0.5 * m * longer))
            .collect();
        let cells = waves.from.edges.spectrum.cells();
        let heard = self.amplitude.iter().zip(cells).map(|(amplitude, cell)| *amplitude * bands[cell.band]);
        self.amplitude = heard.collect();
    }

    /// [`ClearPath::heard`] of every wave.
    fn by_wave<const N: usize>(&self, terms: &[[Complex; N]]) -> Vec<Vec<Complex>> {
        (0..N).map(|wave| self.heard(terms.iter().map(|terms| terms[wave]))).collect()
    }

    /// Amplitudes of a wave, one a cell, with what the way takes of them [1/m].
    fn heard(&self, terms: impl Iterator<Item = Complex>) -> Vec<Complex> {
        terms.zip(&self.amplitude).map(|(term, amplitude)| term * *amplitude).collect()
    }
}

/// The bodies that scatter sound over `mirrors` and `edges`.
pub(super) fn bodies_of<'m>(mirrors: impl IntoIterator<Item = &'m Mirror>, edges: &[&RoomEdge]) -> Vec<u32> {
    let edges = edges.iter().map(|edge| edge.body());
    let mut bodies: Vec<u32> =
        mirrors.into_iter().map(|mirror| mirror.body).chain(edges).filter(|&body| body != WALL).collect();
    bodies.sort_unstable();
    bodies.dedup();
    bodies
}

fn sum<const N: usize>(terms: &[Complex; N]) -> Complex {
    terms.iter().fold(Complex::ZERO, |sum, term| sum + *term)
}

/// The place at `along` within the part of an edge [m].
fn inside(wedge: &Wedge, part: [f64; 2], along: f64) -> DVec3 {
    let [from, to] = off_the_ends(part, OFF_THE_ENDS);
    wedge.at(along.clamp(from, to))
}

/// A part of an edge [m] without a `share` of it next to its ends, where other faces begin.
fn off_the_ends([from, to]: [f64; 2], share: f64) -> [f64; 2] {
    let margin = share * (to - from);
    [from + margin, to - margin]
}

impl RoomEdge {
    /// A hair off the edge, in the middle of its air, by a place on a part of it [m].
    fn beside(&self, place: DVec3, part: [f64; 2]) -> DVec3 {
        let [from, to] = off_the_ends(part, SEEN_OFF_THE_ENDS);
        let along = (place - self.wedge.at(0.0)).dot(self.wedge.direction());
        self.wedge.at(along.clamp(from, to)) + self.off
    }
}

/// By how much [rad] a wave turns about `edge` that seems to come from the image in `face`: π on the image's boundary.
fn turn(edge: &RoomEdge, [source, receiver]: [WedgePoint; 2], face: usize) -> f64 {
    let sum = source.angle + receiver.angle;
    if face == 0 { sum } else { 2.0 * edge.wedge.angle() - sum }
}

/// From 0 at 0 to 1 at 1, level at both.
fn smooth(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
