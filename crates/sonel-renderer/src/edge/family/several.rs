//! What goes over several edges, one after the other ([`FacePath`]).

use std::f64::consts::PI;

use glam::DVec3;
use sonel_diffraction::face::{End, FaceEdge};
use sonel_diffraction::{Complex, FacePath, Wave};

use super::super::passage::{Passage, Passed};
use super::super::sight::{hiding, pieces};
use super::super::view::{Leg, longest, stretches};
use super::super::{Reflection, RoomEdge};
use super::Family;

/// What of an edge is seen, as one stretch [m]: by the source and by the receiver.
pub(super) type Seen = [Option<[f64; 2]>; 2];

impl Family<'_> {
    /// Adds what goes over `passages` in either direction, where the source sees the first and the receiver the last edge.
    pub(super) fn add_passages(&mut self, passages: &[Passage], leg: &Leg<'_>, reflections: &[Reflection]) {
        let edges = self.course.world.edges.iter().enumerate();
        let seen: Vec<Seen> = edges
            .map(|(index, edge)| {
                let is_passed =
                    passages.iter().any(|way| way.edges.iter().any(|passed| passed.edge == index));
                if is_passed { self.seen(index, edge, leg) } else { [None; 2] }
            })
            .collect();
        for passage in passages {
            self.add_passage(passage, &seen, leg, reflections);
            // Over an edge, another one and back it is the same way in both directions.
            let back = passage.reversed();
            if back.edges != passage.edges {
                self.add_passage(&back, &seen, leg, reflections);
            }
        }
    }

    /// What of an edge the source and the receiver see.
    pub(super) fn seen(&self, index: usize, edge: &RoomEdge, leg: &Leg<'_>) -> Seen {
        let (geometry, world) = (self.at.geometry, self.course.world);
        [
            longest(stretches(&edge.wedge, |point| leg.arrives(geometry, world.copy(index, point), point))),
            longest(stretches(&edge.wedge, |point| leg.goes_on(geometry, world.copy(index, point), point))),
        ]
    }

    /// An end of the way beyond the edge `passed`, which is joined to the edge `next` by a face of that.
    fn end(&self, passed: Passed, (next, joint): (Passed, usize), point: DVec3) -> Option<End> {
        let edges = &self.course.world.edges;
        let next_edge = &edges[next.edge].wedge;
        let face = if next.at_second[joint] { next_edge.angle() } else { 0.0 };
        let before = next_edge.locate(point).is_some_and(|at| (at.angle - face).abs() < PI);
        Some(End { point: edges[passed.edge].wedge.locate(point)?, before })
    }

    /// Adds what goes over `passed`: to the base path and to its images in the faces of the edges that lead.
    fn add_passage(&mut self, passage: &Passage, seen: &[Seen], leg: &Leg<'_>, reflections: &[Reflection]) {
        let passed = &passage.edges[..];
        let &[first, second, ..] = passed else { return };
        let &[.., before, last] = passed else { return };
        let (Some(part), Some(last_part)) = (seen[first.edge][0], seen[last.edge][1]) else { return };
        let source = self.end(first, (second, 0), leg.source);
        let receiver = self.end(last, (before, 1), leg.receiver);
        let (Some(source), Some(receiver)) = (source, receiver) else { return };
        let edges = &self.course.world.edges;
        let mut of_faces: Vec<FaceEdge<'_>> = passed
            .iter()
            .map(|&Passed { edge, at_second }| {
                let wedge = &edges[edge].wedge;
                FaceEdge { wedge, at_second, part: [0.0, wedge.length()], outline: &passage.outline }
            })
            .collect();
        let nearest = source.point.radius.min(receiver.point.radius).max(1e-3);
        let within = f64::from(self.at.geometry.resolution()) / nearest;
        let (smallest_k, orders) = (self.spectrum.smallest_k(), self.course.world.orders);
        let of_source = self.pieces(passage, 0, part, leg.source);
        let of_receiver = self.pieces(passage, 1, last_part, leg.receiver);
        for (piece, seen) in of_source {
            for &(last_piece, last_seen) in &of_receiver {
                of_faces[0].part = piece;
                of_faces[passed.len() - 1].part = last_piece;
                let path = FacePath::new(&of_faces, [source, receiver], within, smallest_k, orders);
                if let Some(path) = path {
                    self.add_path(&path, passage, seen * last_seen, leg, reflections);
                }
            }
        }
    }

    /// The pieces of the `part` that one of the ends of a passage sees of the edge there, each with what is left of it.
    fn pieces(&self, passage: &Passage, of: usize, part: [f64; 2], end: DVec3) -> Vec<([f64; 2], f64)> {
        let world = self.course.world;
        let edge = passage.edges[[0, passage.edges.len() - 1][of]].edge;
        let apart = passage.hidden_by[of].iter().map(|&other| &world.edges[other].wedge);
        let others = apart.chain(passage.borders[of].iter()).chain(hiding(world, edge));
        pieces(&world.edges[edge].wedge, part, others, &[end], world.clear)
    }

    /// Adds what is `left` of a path over `passage`. What belongs to images of the base path that are not lit is added to it as it is: both are heard as
    /// one field.
    fn add_path(
        &mut self,
        path: &FacePath,
        passage: &Passage,
        left: f64,
        leg: &Leg<'_>,
        reflections: &[Reflection],
    ) {
        let passed = &passage.edges[..];
        let (edges, cells) = (&self.course.world.edges, self.spectrum.cells());
        let length = path.length();
        let [from, to] = path.crossings();
        let first = edges[passed[0].edge].wedge.at(from);
        let last = edges[passed[passed.len() - 1].edge].wedge.at(to);
        let strength = self.at.radiator.factor(leg.leaving(first)).sqrt() * left;
        let through: Vec<f64> =
            (0..self.spectrum.bands()).map(|band| self.through(band, length) * strength).collect();
        let amplitudes = path.amplitudes(self.spectrum.wave_numbers());
        let mut course = vec![Complex::ZERO; cells.len()];
        for (lead, terms) in path.leads().zip(&amplitudes) {
            let index = passed[lead.edge].edge;
            let edge = &edges[index];
            for ((sum, terms), cell) in course.iter_mut().zip(terms).zip(cells) {
                *sum += terms[0] * through[cell.band];
            }
            for face in [0, 1] {
                let image = self.image(edge, face, reflections);
                let left = self.left(image, index, face, lead.ends);
                let scaled = cells
                    .iter()
                    .zip(terms)
                    .zip(left)
                    .map(|((cell, terms), left)| terms[1 + face] * (through[cell.band] * left));
                let is_image = self.is_image();
                let image = &mut self.images[image];
                if !is_image && image.lit.is_none() {
                    course.iter_mut().zip(scaled).for_each(|(sum, term)| *sum += term);
                } else {
                    let amplitude = scaled.collect();
                    image.waves.push(Wave { length, amplitude });
                    image.ways.push(length);
                }
            }
        }
        self.waves.push(Wave { length, amplitude: course });
        self.ways.push(length);
        self.detours.push((length, leg.towards(last)));
    }
}
