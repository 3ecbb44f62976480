//! What goes over two edges: parallel ones of a solid by [`DoublePath`], others by [`FacePath`].

use std::f64::consts::PI;

use glam::DVec3;
use sonel_diffraction::double::Side;
use sonel_diffraction::face::FaceEdge;
use sonel_diffraction::{Complex, DoublePath, FacePath, WAVES, Wave, WedgePoint};

use super::super::pair::{EdgePair, Joint};
use super::super::view::{Leg, stretches};
use super::super::{Reflection, RoomEdge};
use super::{Family, clearance};

/// How far beside a boundary a place counts that lies on it [rad]: beyond what `sonel_diffraction` takes for the boundary.
const BESIDE: f64 = 1e-7;

/// How many resolutions from a plane a place may lie in it.
const IN_PLANE: f64 = 8.0;

/// An edge of a pair.
struct PairedEdge<'a> {
    edge: &'a RoomEdge,
    joined_at_second: bool,
}

impl PairedEdge<'_> {
    /// Angle about the edge of the face that joins the pair [rad].
    fn joint(&self) -> f64 {
        if self.joined_at_second { self.edge.wedge.angle() } else { 0.0 }
    }
}

impl Family<'_> {
    /// `edge` of a pair with the source or receiver, `end`, at `point` about it. Where that lies in the plane of the face between
    /// the edges, rounding decides whether it sees the `other` edge past this one. The wave over that edge alone and the wave over both
    /// must take it the same, or half of the sound is missing or there twice.
    fn side<'b>(
        &self,
        edge: &PairedEdge<'b>,
        (end, point): (DVec3, WedgePoint),
        part: [f64; 2],
        other: &PairedEdge<'_>,
        leg: &Leg,
    ) -> Side<'b> {
        let wedge = &edge.edge.wedge;
        let joint = edge.joint();
        let past = (point.angle - joint).abs() - PI;
        let doubt = f64::from(self.at.geometry.resolution()) / point.radius.max(f64::MIN_POSITIVE);
        let mut point = point;
        if past.abs() <= doubt {
            let turn = PI + if self.is_alone(other, end, leg) { -BESIDE } else { BESIDE };
            point.angle = if edge.joined_at_second { joint - turn } else { turn };
        }
        Side { wedge, point, joined_at_second: edge.joined_at_second, part }
    }

    /// Adds what goes over `pair` in either order, if the source sees the first and the receiver the second edge.
    pub(super) fn add_pair(&mut self, pair: &EdgePair, leg: &Leg, reflections: &[Reflection]) {
        let [one, other] = pair.edges.map(|(edge, joined_at_second)| PairedEdge {
            edge: &self.course.world.edges[edge],
            joined_at_second,
        });
        for (first, second) in [(&one, &other), (&other, &one)] {
            match pair.joint {
                Joint::Face(width) => self.add_over_face(first, second, width, leg, reflections),
                Joint::Corner => self.add_over_corner(first, second, leg, reflections),
            }
        }
    }

    /// Adds what goes over a face of `width` [m] from the `first` edge to the `second`.
    fn add_over_face(
        &mut self,
        first: &PairedEdge<'_>,
        second: &PairedEdge<'_>,
        width: f64,
        leg: &Leg,
        reflections: &[Reflection],
    ) {
        let (wedge, next) = (&first.edge.wedge, &second.edge.wedge);
        let located = (wedge.locate(leg.source), next.locate(leg.receiver));
        let (Some(source), Some(receiver)) = located else { return };
        let geometry = self.at.geometry;
        let part = longest(stretches(wedge, |point| leg.arrives(geometry, point)));
        let (Some(part), Some(next_part)) =
            (part, longest(stretches(next, |point| leg.goes_on(geometry, point))))
        else {
            return;
        };
        let offset = (leg.receiver - leg.source).dot(wedge.direction());
        let sides = [
            self.side(first, (leg.source, source), part, second, leg),
            self.side(second, (leg.receiver, receiver), next_part, first, leg),
        ];
        let path = DoublePath::new(sides[0], sides[1], width, offset, self.spectrum.smallest_k());
        let length = path.length();
        // Unfolded about both edges the way is straight.
        let share = |before: f64| before / (source.radius + width + receiver.radius).max(f64::MIN_POSITIVE);
        let (z, next_z) = (share(source.radius) * offset, share(source.radius + width) * offset);
        let point = wedge.at(source.along + z);
        let last = point + wedge.direction() * (next_z - z);
        let last = next.at((last - next.at(0.0)).dot(next.direction()));
        let strength = self.at.radiator.factor(leg.leaving(point)).sqrt();
        let [from_source, from_receiver] = sides;
        let back = if wedge.direction().dot(next.direction()) < 0.0 { offset } else { -offset };
        let ends = [
            [source, from_source.far(width + receiver.radius, offset)],
            [receiver, from_receiver.far(width + source.radius, back)],
        ];
        let cells = self.spectrum.cells();
        let terms: Vec<[[Complex; WAVES]; 2]> = cells
            .iter()
            .map(|cell| {
                let through = strength * self.through(cell.band, length);
                path.amplitudes(cell.k).map(|terms| terms.map(|term| term * through))
            })
            .collect();
        self.add_by_wave([(first.edge, ends[0]), (second.edge, ends[1])], length, &terms, leg, reflections);
        self.detours.push((length, leg.towards(last)));
    }

    /// Whether `edge` alone is heard by `end` along the face of the pair, or from it: where rounding decides, as it was decided for
    /// that edge.
    fn is_alone(&self, edge: &PairedEdge<'_>, end: DVec3, leg: &Leg) -> bool {
        let (wedge, geometry) = (&edge.edge.wedge, self.at.geometry);
        let Some(at) = wedge.locate(end) else { return false };
        let before = (at.angle - edge.joint()).abs() < PI;
        let height = at.radius * libm::sin(at.angle - edge.joint());
        let beyond_doubt = height.abs() > IN_PLANE * f64::from(geometry.resolution());
        if !before || wedge.is_rim() || beyond_doubt {
            return before;
        }
        let both = |place| leg.arrives(geometry, place) && leg.goes_on(geometry, place);
        let is_heard = wedge.locate(leg.source).is_some() && wedge.locate(leg.receiver).is_some();
        is_heard && !stretches(wedge, both).is_empty()
    }

    /// As an edge of the face of the pair, of which `part` is seen.
    fn face_edge<'b>(&self, edge: &PairedEdge<'b>, leg: &Leg, part: [f64; 2]) -> FaceEdge<'b> {
        let (wedge, ends) = (&edge.edge.wedge, [leg.source, leg.receiver]);
        let alone = ends.map(|end| self.is_alone(edge, end, leg));
        let ends = ends.map(|end| wedge.locate(end));
        FaceEdge { wedge, ends, alone, at_second: edge.joined_at_second, part }
    }

    /// Adds what goes over a face from the `first` edge to the `second`, whichever way they run: to the base path and to its images
    /// in the faces of the first edge, as what goes over that alone.
    fn add_over_corner(
        &mut self,
        first: &PairedEdge<'_>,
        second: &PairedEdge<'_>,
        leg: &Leg,
        reflections: &[Reflection],
    ) {
        let geometry = self.at.geometry;
        if first.edge.wedge.locate(leg.source).is_none() || second.edge.wedge.locate(leg.receiver).is_none() {
            return;
        }
        let part = longest(stretches(&first.edge.wedge, |point| leg.arrives(geometry, point)));
        let next_part = longest(stretches(&second.edge.wedge, |point| leg.goes_on(geometry, point)));
        let (Some(part), Some(next_part)) = (part, next_part) else { return };
        let edges = [self.face_edge(first, leg, part), self.face_edge(second, leg, next_part)];
        let nearest = edges.iter().flat_map(|edge| edge.ends).flatten().map(|point| point.radius);
        let within = f64::from(geometry.resolution()) / nearest.fold(f64::INFINITY, f64::min).max(1e-3);
        let smallest_k = self.spectrum.smallest_k();
        let Some(path) = FacePath::new(edges[0], edges[1], within, smallest_k) else { return };
        let length = path.length();
        let point = |edge: &PairedEdge<'_>, end: usize, part: [f64; 2]| {
            let [from, to] = path.ways()[end].ends;
            edge.edge.wedge.at(sonel_diffraction::wedge::apex(from, to).clamp(part[0], part[1]))
        };
        let strength = self.at.radiator.factor(leg.leaving(point(first, 0, part))).sqrt();
        let towards = leg.towards(point(second, 1, next_part));
        let cells = self.spectrum.cells();
        let terms: Vec<[[Complex; WAVES]; 2]> = cells
            .iter()
            .map(|cell| {
                let through = strength * self.through(cell.band, length);
                [0, 1].map(|way| path.ways()[way].amplitudes(cell.k, length).map(|term| term * through))
            })
            .collect();
        let edges = [0, 1].map(|way| ([first.edge, second.edge][way], path.ways()[way].ends));
        self.add_by_wave(edges, length, &terms, leg, reflections);
        self.detours.push((length, towards));
    }

    /// Adds what comes over two edges in `length` [m]: to the base path, and to its images in the faces of each edge as what goes
    /// over that alone between two points about it.
    fn add_by_wave(
        &mut self,
        edges: [(&RoomEdge, [WedgePoint; 2]); 2],
        length: f64,
        terms: &[[[Complex; WAVES]; 2]],
        leg: &Leg,
        reflections: &[Reflection],
    ) {
        let amplitude = terms.iter().map(|[one, other]| one[0] + other[0]).collect();
        self.waves.push(Wave { length, amplitude });
        self.ways.push(length);
        for (way, (edge, [from, to])) in edges.into_iter().enumerate() {
            for face in [0, 1] {
                let mirrored = self.mirrored(&edge.faces[face]);
                let image = self.image(edge, leg, face, reflections);
                let (image, away) = (&mut self.images[image], clearance(edge, from, to, face));
                let cells = self.spectrum.cells().iter().zip(terms);
                let scaled = cells.map(|(cell, terms)| {
                    terms[way][1 + face] * image.reflected(mirrored[cell.band], cell, away)
                });
                let amplitude = scaled.collect();
                image.waves.push(Wave { length, amplitude });
                image.ways.push(length);
            }
        }
    }
}

fn longest(stretches: Vec<[f64; 2]>) -> Option<[f64; 2]> {
    stretches.into_iter().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
}
