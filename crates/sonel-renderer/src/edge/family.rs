//! A base path with its edges and the mirror images that belong to them: one field, one energy, shared out to arrivals.
//!
//! The field is A + Σ_f B_f: A the base path where it is clear with the edges' terms that complete it, B_f the mirror image in plane
//! f with the terms that complete that. All are added coherently, except that a receiver well lit by an image hears it
//! beside the direct sound as in the rest of the room, by its energy: the cross terms of B_f fade as 1/(1 + N²), N the Fresnel
//! number of the image's clearance of the edge. On the boundary N is 0, so no cross term steps.
//!
//! Reference: docs/physics.md §5.1, docs/diffraction.md.

mod apart;
mod corner;
mod course;
mod face;
mod plane;
mod several;
mod single;

pub(crate) use course::{Course, mirrors_at_feet};
pub(super) use plane::kept;
pub(super) use single::doubt_over;

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use sonel_diffraction::{Complex, Field, Spectrum, Wave, WedgePoint};

use super::image::{SourceImage, same_place};
use super::view::Leg;
use super::{EdgeArrival, Listening, Reflection, RoomEdge};
use crate::direct::spread;
pub(super) use face::{UNKNOWN, excess, turn};

/// Ways over edges that differ by no more than this are one arrival [m]: in shadow, where nothing else is heard, what follows
/// within 30 ms; beside a clear path, a few milliseconds.
const SAME_ARRIVAL: [f64; 2] = [10.0, 1.0];

/// A mirror image in a plane at an edge.
struct Image {
    source: SourceImage,
    /// Index of the reflection that it is, where it reaches the receiver.
    lit: Option<usize>,
    waves: Vec<Wave>,
    /// The shortest way over the edge of each wave [m].
    ways: Vec<f64>,
    /// Least L_edge − L_image over its edges [m].
    clearance: f64,
}

/// All waves of a base path.
pub(super) struct Family<'a> {
    spectrum: &'a Spectrum,
    at: &'a Listening<'a>,
    base: Course<'a>,
    /// The one that is followed: the base path, or an image of it in a plane with edges.
    course: Course<'a>,
    /// Index of the base path among the reflections; none for the direct path.
    reflection: Option<usize>,
    waves: Vec<Wave>,
    /// The shortest way over the edge of each wave [m].
    ways: Vec<f64>,
    images: Vec<Image>,
    /// Lengths of the ways over edges [m] and where each comes from.
    detours: Vec<(f64, DVec3)>,
}

impl<'a> Family<'a> {
    /// The family of the first of `courses`; the others lead to what belongs to it, too.
    pub fn new(
        courses: &[Course<'a>],
        spectrum: &'a Spectrum,
        at: &'a Listening<'a>,
        reflections: &[Reflection],
    ) -> Self {
        let base = &courses[0];
        let mut family = Self {
            spectrum,
            at,
            course: base.clone(),
            base: base.clone(),
            reflection: find(at, reflections, &base.seen()).filter(|_| base.order() > 0),
            waves: Vec::new(),
            ways: Vec::new(),
            images: Vec::new(),
            detours: Vec::new(),
        };
        family.gather(courses, reflections);
        family
    }

    fn gather(&mut self, courses: &[Course<'a>], reflections: &[Reflection]) {
        let beside = courses.iter().find_map(|course| self.beside_corners(course, reflections));
        let receiver = beside.unwrap_or(self.at.receiver);
        for course in courses {
            self.course = course.clone();
            if !self.is_image() {
                self.follow(&course.leg(receiver), reflections);
                continue;
            }
            let base = (std::mem::take(&mut self.waves), std::mem::take(&mut self.ways));
            self.follow(&course.leg(receiver), reflections);
            let waves = std::mem::replace(&mut self.waves, base.0);
            let ways = std::mem::replace(&mut self.ways, base.1);
            if !waves.is_empty() {
                let image = self.image_at(course.seen(), reflections);
                self.images[image].waves.extend(waves);
                self.images[image].ways.extend(ways);
            }
        }
    }

    /// Whether the course leads from an image of the family and not from where its base path does.
    fn is_image(&self) -> bool {
        self.course.origin.distance(self.base.origin) > same_place(self.at)
    }

    /// Adds what edges do to the course on `leg`.
    fn follow(&mut self, leg: &Leg<'_>, reflections: &[Reflection]) {
        let world = self.course.world;
        for (edge, part) in world.alone.iter().enumerate() {
            if part[0] < part[1] {
                self.add_edge(edge, *part, leg, reflections);
            }
        }
        self.add_passages(&world.passages, leg, reflections);
        self.add_apart(leg, reflections);
    }

    /// Amplitude that the course's mirror and `length` [m] of air leave in `band`.
    fn through(&self, band: usize, length: f64) -> f64 {
        let air = libm::exp(-0.5 * self.at.attenuation[band] * length);
        air * self.course.mirrored[band]
    }

    /// Index of the image of the course in a face of `edge`.
    fn image(&mut self, edge: &RoomEdge, face: usize, reflections: &[Reflection]) -> usize {
        self.image_at(self.course.seen().in_face(&edge.faces[face]), reflections)
    }

    /// Index of an image.
    fn image_at(&mut self, source: SourceImage, reflections: &[Reflection]) -> usize {
        if let Some(known) = self.images.iter().position(|image| image.source.is(&source, self.at)) {
            return known;
        }
        self.images.push(Image {
            lit: self.find_image(reflections, &source),
            source,
            waves: Vec::new(),
            ways: Vec::new(),
            clearance: f64::INFINITY,
        });
        self.images.len() - 1
    }

    /// Index of `image` among the reflections but that of the base path.
    fn find_image(&self, reflections: &[Reflection], image: &SourceImage) -> Option<usize> {
        find(self.at, reflections, image).filter(|&found| Some(found) != self.reflection)
    }

    /// Shares the energy of the family out: to the reflections that it contains, as ratios, and to arrivals of its own.
    pub fn hear(mut self, reflections: &mut [Reflection]) -> Vec<EdgeArrival> {
        if self.detours.is_empty() {
            return Vec::new();
        }
        let straight = self.base.origin.distance(self.at.receiver);
        if self.base.clear {
            let factor = self.factor_of_base(reflections);
            self.waves.push(self.geometric(straight, &factor));
            self.ways.push(straight);
            self.detours.push((straight, (self.base.origin - self.at.receiver) / straight));
        }
        for image in 0..self.images.len() {
            if let Some(lit) = self.images[image].lit {
                let length = self.images[image].source.position.distance(self.at.receiver);
                let clear = self.geometric(length, &reflections[lit].factor);
                self.images[image].waves.push(clear);
                self.images[image].ways.push(length);
            }
        }
        let (arrivals, of_images) = (self.arrivals(), self.energies_of_images());
        let gain = self.gain(&arrivals, &of_images);
        for (image, energy) in self.images.iter().zip(&of_images) {
            if let Some(lit) = image.lit {
                let length = image.source.position.distance(self.at.receiver);
                self.set_ratio(&mut reflections[lit], length, energy, &gain);
            }
        }
        let mut arrivals = arrivals.into_iter().map(|mut arrival| {
            for (energy, gain) in arrival.energy.iter_mut().zip(&gain) {
                *energy *= gain / (4.0 * PI);
            }
            arrival
        });
        if let Some(base) = self.reflection
            && let Some(first) = arrivals.next()
        {
            let energy: Vec<f64> = first.energy.iter().map(|energy| energy * 4.0 * PI).collect();
            self.set_ratio(&mut reflections[base], straight, &energy, &vec![1.0; gain.len()]);
        }
        arrivals.collect()
    }

    /// What arrives over edges, images that are lit left out, in order of time: energies before interference between arrivals and
    /// images. The first is the base path where that is clear.
    fn arrivals(&self) -> Vec<EdgeArrival> {
        let mut detours = self.detours.clone();
        detours.sort_by(|a, b| a.0.total_cmp(&b.0));
        let together = SAME_ARRIVAL[usize::from(self.base.clear)];
        let mut arrivals: Vec<EdgeArrival> = Vec::new();
        for (length, towards) in detours {
            if arrivals.last().is_none_or(|last| length > last.length + together) {
                let shaded = !(self.base.clear && arrivals.is_empty());
                let order = self.base.order();
                arrivals.push(EdgeArrival { length, towards, order, shaded, energy: Vec::new() });
            }
        }
        let ends: Vec<f64> = arrivals.iter().skip(1).map(|next| next.length).chain([f64::INFINITY]).collect();
        for (arrival, end) in arrivals.iter_mut().zip(ends) {
            let part = |waves: &[Wave], ways: &[f64]| {
                let within = |way: &f64| (arrival.length..end).contains(way);
                let chosen: Vec<Wave> = waves
                    .iter()
                    .zip(ways)
                    .filter(|(_, way)| within(way))
                    .map(|(wave, _)| wave.clone())
                    .collect();
                self.spectrum.energy(&chosen)
            };
            let mut energy = part(&self.waves, &self.ways);
            for image in self.images.iter().filter(|image| image.lit.is_none()) {
                energy.iter_mut().zip(part(&image.waves, &image.ways)).for_each(|(sum, part)| *sum += part);
            }
            arrival.energy = energy;
        }
        arrivals
    }

    fn energies_of_images(&self) -> Vec<Vec<f64>> {
        self.images.iter().map(|image| self.spectrum.energy(&image.waves)).collect()
    }

    /// What interference does to all of the family, per band: its energy over the sum of those of its parts.
    fn gain(&self, arrivals: &[EdgeArrival], of_images: &[Vec<f64>]) -> Vec<f64> {
        let own = self.spectrum.energy(&self.waves);
        let crossed = self.cross_terms();
        let lit = |band: usize| -> f64 {
            self.images
                .iter()
                .zip(of_images)
                .filter(|(image, _)| image.lit.is_some())
                .map(|(_, e)| e[band])
                .sum()
        };
        (0..own.len())
            .map(|band| {
                let together =
                    own[band] + of_images.iter().map(|energy| energy[band]).sum::<f64>() + crossed[band];
                let apart = lit(band) + arrivals.iter().map(|arrival| arrival.energy[band]).sum::<f64>();
                // Below zero by rounding only.
                together.max(0.0) / apart.max(f64::MIN_POSITIVE)
            })
            .collect()
    }

    /// Sets what edges make of a reflection over `length` [m].
    fn set_ratio(&self, reflection: &mut Reflection, length: f64, energy: &[f64], gain: &[f64]) {
        for (band, ratio) in reflection.ratio.iter_mut().enumerate() {
            let alone =
                reflection.factor[band] * spread(length) * libm::exp(-self.at.attenuation[band] * length);
            *ratio = if alone > 0.0 { gain[band] * energy[band] / (4.0 * PI) / alone } else { 0.0 };
        }
    }

    fn factor_of_base(&self, reflections: &[Reflection]) -> Vec<f64> {
        match self.reflection {
            Some(reflection) => reflections[reflection].factor.clone(),
            None => {
                let factor = self.at.radiator.factor(self.at.receiver - self.at.radiator.position);
                vec![factor; self.spectrum.bands()]
            }
        }
    }

    /// A wave over `length` [m] without edges, of energy `factor` per band.
    fn geometric(&self, length: f64, factor: &[f64]) -> Wave {
        let amplitude =
            |band: usize| (factor[band] * libm::exp(-self.at.attenuation[band] * length)).sqrt() / length;
        let cells = self.spectrum.cells().iter();
        Wave { length, amplitude: cells.map(|cell| Complex::real(amplitude(cell.band))).collect() }
    }

    /// 2 Re of the products of the base path with the images and of the images with one another, per band, faded [1/m²].
    fn cross_terms(&self) -> Vec<f64> {
        let spectrum = self.spectrum;
        let weight: Vec<Vec<f64>> = self
            .images
            .iter()
            .map(|image| {
                let of = |k| if image.lit.is_some() { faded(k, image.clearance) } else { 1.0 };
                spectrum.cells().iter().map(|cell| of(cell.k)).collect()
            })
            .collect();
        let base = spectrum.field(&self.waves);
        let images: Vec<Field> = self.images.iter().map(|image| spectrum.field(&image.waves)).collect();
        let mut sum = vec![0.0; spectrum.bands()];
        for (index, (image, own)) in images.iter().zip(&weight).enumerate() {
            spectrum.add_products(&base, image, |cell| 2.0 * own[cell], &mut sum);
            for (other, weight) in images.iter().zip(&weight).take(index) {
                spectrum.add_products(other, image, |cell| 2.0 * own[cell] * weight[cell], &mut sum);
            }
        }
        sum
    }
}

/// 1/(1 + N²) of the Fresnel number N of a clearance [m] at wave number `k`.
pub(super) fn faded(k: f64, clearance: f64) -> f64 {
    let number = 2.0 * clearance * k / TAU;
    1.0 / (1.0 + number * number)
}

/// Angle [rad] about a boundary within which f32 does not tell on which side of it `receiver` is.
fn doubt(at: &Listening<'_>, source: WedgePoint, receiver: WedgePoint) -> f64 {
    f64::from(at.geometry.resolution()) / source.radius.min(receiver.radius).max(1e-3)
}

fn find(at: &Listening<'_>, reflections: &[Reflection], image: &SourceImage) -> Option<usize> {
    reflections.iter().position(|reflection| reflection.image.is(image, at))
}
