//! What goes over one edge ([`EdgePath`]).

use sonel_diffraction::wedge::apex;
use sonel_diffraction::{Complex, EdgePath, Lit, WAVES, Wave, Wedge, WedgePoint};

use super::super::reach::Reach;
use super::super::sight::{hiding, pieces};
use super::super::view::{Leg, stretches};
use super::super::{Listening, Reflection};
use super::face::{excess, turn};
use super::{Family, doubt, plane};

/// So many lifts beside its way a path may go from a mirror on; seen from an edge that is so far on both of its sides.
const LEFT: f64 = 2.0;

/// What is followed of the waves of an edge, besides what all of them lose.
struct Followed {
    /// Of that of the course, in every cell.
    course: Vec<f64>,
    /// Of those of its images in the faces: which image, and what is left in every cell.
    in_faces: [Option<(usize, Vec<f64>)>; 2],
    /// Whether an image that does not reach the receiver is heard as one field with the course.
    is_with_base: bool,
}

impl Family<'_> {
    /// Adds what `part` [m] of an edge does to the course on `leg`.
    pub(super) fn add_edge(
        &mut self,
        index: usize,
        part: [f64; 2],
        leg: &Leg<'_>,
        reflections: &[Reflection],
    ) {
        let world = self.course.world;
        let edge = &world.edges[index];
        let located = (edge.wedge.locate(leg.source), edge.wedge.locate(leg.receiver));
        let (Some(source), Some(receiver)) = located else { return };
        let smallest_k = self.spectrum.smallest_k();
        let reach = world.is_near.then(|| Reach::of(&world.shown));
        let beside = reach.map(|reach| reach.beside(edge, source, receiver));
        let share = |wave: usize, k: f64| match beside {
            Some(beside) => Reach::share(beside[wave], k),
            None => 1.0,
        };
        let largest = [0, 1, 2].map(|wave| share(wave, smallest_k));
        if largest.iter().all(|&share| share <= 0.0) {
            return;
        }
        let geometry = self.at.geometry;
        let seen = stretches(&edge.wedge, |point| {
            let copy = world.copy(index, point);
            leg.arrives(geometry, copy, point) && leg.goes_on(geometry, copy, point)
        });
        let seen = within(seen, part);
        if seen.is_empty() {
            return;
        }
        let images =
            [0, 1].map(|face| (largest[1 + face] > 0.0).then(|| self.image(edge, face, reflections)));
        let lit = Lit {
            direct: Some(self.course.clear),
            faces: images.map(|image| image.map(|image| self.images[image].lit.is_some())),
            within: self.doubt(source, receiver),
        };
        let shares = |wave: usize| self.spectrum.cells().iter().map(move |cell| share(wave, cell.k));
        let course: Vec<f64> = shares(0).collect();
        let left = [0, 1].map(|face| -> Option<Vec<f64>> {
            let left = self.left(images[face]?, index, face, [source, receiver]);
            Some(left.into_iter().zip(shares(1 + face)).map(|(left, share)| left * share).collect())
        });
        let is_with_base = !self.is_image() || self.find_image(reflections, &self.course.seen()).is_none();
        let kept = if world.orders.most < 2 { plane::kept(&edge.wedge, source, receiver) } else { 1.0 };
        let others: Vec<&Wedge> = hiding(world, index).collect();
        let ends = [leg.source, leg.receiver];
        let pieces = |part| pieces(&edge.wedge, part, others.iter().copied(), &ends, world.clear);
        for (part, in_sight) in seen.into_iter().flat_map(pieces) {
            let path = EdgePath::new(&edge.wedge, source, receiver, part, lit, smallest_k);
            let point = edge.wedge.at(apex(source, receiver).clamp(part[0], part[1]));
            let strength = self.at.radiator.factor(leg.leaving(point)).sqrt() * kept;
            let in_faces = [0, 1].map(|face| {
                let left = left[face].as_ref()?.iter().map(|left| left * in_sight);
                Some((images[face]?, left.collect()))
            });
            // Where the direct path is cut off an edge in line with others is what completes it.
            let seen = if world.shown.order() > 0 { in_sight } else { 1.0 };
            let course = course.iter().map(|share| share * seen).collect();
            self.detours.push((path.detour(), leg.towards(point)));
            self.add_waves(&path, strength, &Followed { course, in_faces, is_with_base });
        }
        let mut keep_off = |image: usize, turn: f64, share: f64| {
            let clearance = &mut self.images[image].clearance;
            *clearance = clearance.min(excess(source, receiver, turn) / share);
        };
        for (face, image) in images.into_iter().enumerate() {
            if let Some(image) = image {
                keep_off(image, turn(edge, source, receiver, face), largest[1 + face]);
            }
        }
        if self.is_image() && largest[0] > 0.0 {
            let image = self.image_at(self.course.seen(), reflections);
            let clearance = &mut self.images[image].clearance;
            let excess = excess(source, receiver, (source.angle - receiver.angle).abs());
            *clearance = clearance.min(excess / largest[0]);
        }
    }

    /// Angle [rad] about a boundary within which it is not told whether the course is clear: every mirror is left by a lift.
    pub(super) fn doubt(&self, source: WedgePoint, receiver: WedgePoint) -> f64 {
        doubt_over(self.at, self.course.order(), source, receiver)
    }

    /// The waves of `path`, to the course and to the images in the faces of its edge.
    fn add_waves(&mut self, path: &EdgePath, strength: f64, followed: &Followed) {
        let cells = self.spectrum.cells();
        // √((1−α)(1−s)) of the course's mirror, and the air on the way.
        let through: Vec<f64> =
            (0..self.spectrum.bands()).map(|band| self.through(band, path.detour()) * strength).collect();
        for (piece, length) in path.lengths().enumerate() {
            let amplitudes = path.amplitudes(piece, self.spectrum.wave_numbers());
            let terms: Vec<[Complex; WAVES]> = cells
                .iter()
                .zip(amplitudes)
                .map(|(cell, terms)| terms.map(|term| term * through[cell.band]))
                .collect();
            let mut course: Vec<Complex> =
                terms.iter().zip(&followed.course).map(|(term, &share)| term[0] * share).collect();
            for (face, in_face) in followed.in_faces.iter().enumerate() {
                let Some((image, left)) = in_face else { continue };
                let amplitude = terms.iter().zip(left).map(|(term, &left)| term[1 + face] * left);
                let image = &mut self.images[*image];
                if followed.is_with_base && image.lit.is_none() {
                    course.iter_mut().zip(amplitude).for_each(|(sum, term)| *sum += term);
                } else {
                    image.waves.push(Wave { length, amplitude: amplitude.collect() });
                    image.ways.push(path.detour());
                }
            }
            self.waves.push(Wave { length, amplitude: course });
            self.ways.push(path.detour());
        }
    }
}

/// Angle [rad] about a boundary within which it is not told whether a path over so many mirrors is clear.
pub(crate) fn doubt_over(at: &Listening<'_>, order: u32, source: WedgePoint, receiver: WedgePoint) -> f64 {
    let of_mirrors = LEFT * f64::from(order) * f64::from(at.geometry.lift());
    doubt(at, source, receiver) + of_mirrors / source.radius.min(receiver.radius).max(1e-3)
}

/// What of `stretches` is within `part` [m].
fn within(stretches: Vec<[f64; 2]>, part: [f64; 2]) -> Vec<[f64; 2]> {
    let cut = stretches.into_iter().map(|[low, high]| [low.max(part[0]), high.min(part[1])]);
    cut.filter(|[low, high]| low < high).collect()
}
