//! Receivers in line with the source and a corner.
//!
//! Where two edges meet, each ends where its own wave is cut off. Off the line through the corner each says how much of the wave is
//! behind it; on the line, where both the boundary and the end of each are in doubt, only one bit is known, whether the wave is there,
//! and two halves of two edges are not what a corner leaves. The field is continuous, so such a receiver is heard a few resolutions
//! beside the line, where it is lit or shaded as it is here.

use std::f64::consts::PI;

use glam::DVec3;
use sonel_diffraction::wedge::rapidity;

use super::super::view::Leg;
use super::super::world::RoomEdge;
use super::face::turn;
use super::{Course, Family, Reflection, doubt};

/// So many times what is in doubt counts as the corner: the doubt is then too small a part of a right angle to be heard beyond.
const CLOSE: f64 = 16.0;
/// So many times what is in doubt the receiver is moved, out of all doubt from anywhere there.
const BESIDE: f64 = 32.0;

/// The waves of an edge: the direct one, and the images in its faces.
#[derive(Debug, Clone, Copy, PartialEq)]
enum CutOff {
    Direct,
    Image(usize),
}

impl Family<'_> {
    /// A place beside the receiver [m] if a corner that `course` meets is in line with it.
    pub(super) fn beside_corners(&self, course: &Course<'_>, reflections: &[Reflection]) -> Option<DVec3> {
        if course.world.behind.is_some() {
            return None;
        }
        let receiver = self.at.receiver;
        let leg = course.leg(receiver);
        course.world.edges.iter().enumerate().find_map(|(index, edge)| {
            // Images of three reflections fade towards where they begin.
            let faces = if course.order() < 2 { &[0, 1][..] } else { &[] };
            let (wave, step) = self.corner_in_line(edge, faces, &leg)?;
            let along = edge.wedge.direction();
            let across = (receiver - leg.source).cross(along).normalize_or_zero();
            let places = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
                .map(|(u, v): (f64, f64)| receiver + (along * u + across * v) * step);
            let is_known = self.is_known(course, edge, wave, reflections);
            places.into_iter().find(|place| self.is_there(course, index, wave, *place) == is_known)
        })
    }

    /// Which wave on `leg` is cut off by `edge` just where that ends, and how far to go from there [m].
    fn corner_in_line(&self, edge: &RoomEdge, faces: &[usize], leg: &Leg<'_>) -> Option<(CutOff, f64)> {
        let (source, receiver) = (edge.wedge.locate(leg.source)?, edge.wedge.locate(leg.receiver)?);
        let within = doubt(self.at, source, receiver);
        if source.radius <= 0.0 || receiver.radius <= 0.0 {
            return None;
        }
        let direct = (CutOff::Direct, (source.angle - receiver.angle).abs());
        let image = |&face: &usize| (CutOff::Image(face), turn(edge, source, receiver, face));
        let mut turns = std::iter::once(direct).chain(faces.iter().map(image));
        let (wave, _) = turns.find(|(_, turn)| (turn - PI).abs() <= CLOSE * within)?;
        let ends = [0.0, edge.wedge.length()];
        let at_end = ends.into_iter().any(|end| rapidity(source, receiver, end).abs() <= CLOSE * within);
        at_end.then_some((wave, BESIDE * within * receiver.radius))
    }

    /// Whether a wave is there, as the rest of the room has it.
    fn is_known(
        &self,
        course: &Course<'_>,
        edge: &RoomEdge,
        wave: CutOff,
        reflections: &[Reflection],
    ) -> bool {
        match wave {
            CutOff::Direct => course.clear,
            CutOff::Image(face) => {
                self.find_image(reflections, edge.faces[face].image(course.origin)).is_some()
            }
        }
    }

    /// Whether a wave reaches `place` [m].
    fn is_there(&self, course: &Course<'_>, index: usize, wave: CutOff, place: DVec3) -> bool {
        let world = course.world;
        let chain = match wave {
            CutOff::Direct => world.shown.clone(),
            CutOff::Image(face) => world.copy_at_middle(index).with(&world.edges[index].faces[face]),
        };
        chain.reaches(self.at.geometry, self.at.radiator.position, place)
    }
}
