//! Receivers in line with the source and a corner.
//!
//! Where two edges meet, each ends where its own wave is cut off. Off the line through the corner each says how much of the wave is
//! behind it; on the line, where both the boundary and the end of each are in doubt, only one bit is known, whether the wave is there,
//! and two halves of two edges are not what a corner leaves. The field is continuous, so such a receiver is heard a few resolutions
//! beside the line, where it is lit or shaded as it is here.

use std::f64::consts::{PI, SQRT_2};

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

/// Sine of the angle between two borders of shadows that are one.
const SAME_BORDER: f64 = 1e-3;

/// The waves of an edge: the direct one, and the images in its faces.
#[derive(Debug, Clone, Copy, PartialEq)]
enum CutOff {
    Direct,
    Image(usize),
}

/// An edge that ends in line with the receiver and a wave that it cuts off.
struct InLine {
    edge: usize,
    wave: CutOff,
    /// Unit direction of the wave.
    line: DVec3,
    /// Unit direction across it in which the shadow of the edge has its border.
    border: DVec3,
    /// How far to go from there [m].
    step: f64,
}

impl Family<'_> {
    /// A place beside the receiver [m] if a corner that `course` meets is in line with it.
    pub(super) fn beside_corners(&self, course: &Course<'_>, reflections: &[Reflection]) -> Option<DVec3> {
        if course.world.behind.is_some() {
            return None;
        }
        let leg = course.leg(self.at.receiver);
        // Images of three reflections fade towards where they begin.
        let faces = if course.order() < 2 { &[0, 1][..] } else { &[] };
        let edges = course.world.edges.iter().enumerate();
        let in_line: Vec<InLine> =
            edges.filter_map(|(index, edge)| self.corner_in_line(index, edge, faces, &leg)).collect();
        in_line.iter().find_map(|corner| {
            let is_known = self.is_known(course, corner, reflections);
            let mut places = around(corner, &in_line, leg.receiver);
            places.find(|place| self.is_there(course, corner, *place) == is_known)
        })
    }

    /// Which wave on `leg` is cut off by `edge` just where that ends.
    fn corner_in_line(
        &self,
        index: usize,
        edge: &RoomEdge,
        faces: &[usize],
        leg: &Leg<'_>,
    ) -> Option<InLine> {
        let (source, receiver) = (edge.wedge.locate(leg.source)?, edge.wedge.locate(leg.receiver)?);
        let within = doubt(self.at, source, receiver);
        if source.radius <= 0.0 || receiver.radius <= 0.0 {
            return None;
        }
        let direct = (CutOff::Direct, (source.angle - receiver.angle).abs());
        let image = |&face: &usize| (CutOff::Image(face), turn(edge, source, receiver, face));
        let mut turns = std::iter::once(direct).chain(faces.iter().map(image));
        let (wave, _) = turns.find(|(_, turn)| (turn - PI).abs() <= CLOSE * within)?;
        let origin = match wave {
            CutOff::Direct => leg.source,
            CutOff::Image(face) => edge.faces[face].image(leg.source),
        };
        let line = (leg.receiver - origin).normalize_or_zero();
        let border = edge.wedge.direction().reject_from_normalized(line).normalize_or_zero();
        let ends = [0.0, edge.wedge.length()];
        let at_end = ends.into_iter().any(|end| rapidity(source, receiver, end).abs() <= CLOSE * within);
        at_end.then_some(InLine { edge: index, wave, line, border, step: BESIDE * within * receiver.radius })
    }

    /// Whether a wave is there, as the rest of the room has it.
    fn is_known(&self, course: &Course<'_>, corner: &InLine, reflections: &[Reflection]) -> bool {
        match corner.wave {
            CutOff::Direct => course.clear,
            CutOff::Image(face) => {
                let mirror = &course.world.edges[corner.edge].faces[face];
                self.find_image(reflections, &course.seen().in_face(mirror)).is_some()
            }
        }
    }

    /// Whether a wave reaches `place` [m].
    fn is_there(&self, course: &Course<'_>, corner: &InLine, place: DVec3) -> bool {
        let world = course.world;
        let chain = match corner.wave {
            CutOff::Direct => world.shown.clone(),
            CutOff::Image(face) => {
                world.copy_at_middle(corner.edge).with(&world.edges[corner.edge].faces[face])
            }
        };
        chain.reaches(self.at.geometry, self.at.radiator.position, place)
    }
}

/// Places about the `receiver` [m] in every sector between the borders of the shadows of edges in line, and between that of the
/// edge of `corner` and what is across it.
fn around(corner: &InLine, in_line: &[InLine], receiver: DVec3) -> impl Iterator<Item = DVec3> {
    let across = corner.line.cross(corner.border);
    let borders =
        in_line.iter().map(|other| other.border).filter(move |other| other.dot(across).abs() > SAME_BORDER);
    let sectors = borders.chain([across]).flat_map(move |other| {
        [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]].map(|[u, v]| corner.border * u + other * v)
    });
    sectors.map(move |sector| receiver + sector.normalize() * (SQRT_2 * corner.step))
}
