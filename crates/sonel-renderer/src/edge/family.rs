//! A base path with its edges and the mirror images that belong to them: one field, one energy, shared out to arrivals.
//!
//! The field is A + Σ_f B_f: A the base path where it is clear with the edges' terms that complete it, B_f the mirror image in plane
//! f with the terms that complete that. All are added coherently, except that a receiver well lit by an image hears it
//! beside the direct sound as in the rest of the room, by its energy: the cross terms of B_f fade as 1/(1 + N²), N the Fresnel
//! number of the image's clearance of the edge. On the boundary N is 0, so no cross term steps.
//!
//! Reference: docs/physics.md §5.1, docs/diffraction.md.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use sonel_diffraction::{Complex, EdgePath, Lit, Wave, WedgePoint};
use sonel_geometry::PlaneId;

use super::view::Leg;
use super::{EdgeArrival, Edges, Listening, PlaneMirror, Reflection, RoomEdge};
use crate::direct::spread;

/// Positions of images that differ by no more than this many resolutions are the same.
const SAME_IMAGE: f64 = 64.0;

/// A mirror image in a plane at an edge.
struct Image {
    plane: PlaneId,
    /// Where it is, about the scene's centre [m].
    position: DVec3,
    /// Index of the reflection that it is, where it reaches the receiver.
    lit: Option<usize>,
    /// √((1−α)(1−s)) of the plane, per band.
    amplitude: Vec<f64>,
    waves: Vec<Wave>,
    /// Least L_edge − L_image over its edges [m].
    clearance: f64,
}

/// All waves of a base path.
pub(super) struct Family<'a> {
    edges: &'a Edges,
    at: &'a Listening<'a>,
    base: Option<&'a PlaneMirror>,
    /// Where the base path seems to come from [m].
    origin: DVec3,
    /// Index of the base path among the reflections; none for the direct path.
    reflection: Option<usize>,
    clear: bool,
    waves: Vec<Wave>,
    images: Vec<Image>,
    /// Length of the shortest way over an edge [m] and where it comes from.
    detour: Option<(f64, DVec3)>,
}

impl<'a> Family<'a> {
    /// The family of the direct path, or of the one mirrored by `base`.
    pub fn new(
        edges: &'a Edges,
        at: &'a Listening<'a>,
        base: Option<&'a PlaneMirror>,
        reflections: &[Reflection],
    ) -> Self {
        let source = at.radiator.position;
        let origin = base.map_or(source, |mirror| mirror.image(source));
        let reflection = base.and_then(|_| find(at, reflections, origin));
        let clear = if base.is_some() { reflection.is_some() } else { at.clear };
        let mut family = Self {
            edges,
            at,
            base,
            origin,
            reflection,
            clear,
            waves: Vec::new(),
            images: Vec::new(),
            detour: None,
        };
        if base.is_none_or(|mirror| mirror.height(source) > 0.0 && mirror.height(at.receiver) > 0.0) {
            family.gather(reflections);
        }
        family
    }

    fn gather(&mut self, reflections: &[Reflection]) {
        let (source, receiver) = (self.at.radiator.position, self.at.receiver);
        for edge in &self.edges.edges {
            match self.base {
                None => self.add(edge, Leg { source, receiver, mirror: None }, reflections),
                Some(&mirror) => {
                    let before = Leg { source: self.origin, receiver, mirror: Some((mirror, true)) };
                    let after =
                        Leg { source, receiver: mirror.image(receiver), mirror: Some((mirror, false)) };
                    self.add(edge, before, reflections);
                    self.add(edge, after, reflections);
                }
            }
        }
    }

    /// Adds what `edge` does to the base path on `leg`.
    fn add(&mut self, edge: &RoomEdge, leg: Leg, reflections: &[Reflection]) {
        let located = (edge.wedge.locate(leg.source), edge.wedge.locate(leg.receiver));
        let (Some(source), Some(receiver)) = located else { return };
        let stretches = leg.stretches(self.at.geometry, &edge.wedge);
        if stretches.is_empty() {
            return;
        }
        let images = [0, 1].map(|face| self.image(edge, &leg, face, reflections));
        let lit = Lit {
            direct: Some(self.clear),
            faces: images.map(|image| Some(self.images[image].lit.is_some())),
            within: f64::from(self.at.geometry.resolution()) / source.radius.min(receiver.radius).max(1e-3),
        };
        let away = [0, 1].map(|face| clearance(edge, source, receiver, face));
        for part in stretches {
            let k = self.edges.spectrum.smallest_k();
            let path = EdgePath::new(&edge.wedge, source, receiver, part, lit, k);
            let way = sonel_diffraction::wedge::apex(source, receiver).clamp(part[0], part[1]);
            let point = edge.wedge.at(way);
            let strength = self.at.radiator.factor(leg.leaving(point)).sqrt();
            if self.detour.is_none_or(|(length, _)| path.detour() < length) {
                self.detour = Some((path.detour(), leg.towards(point)));
            }
            self.add_waves(&path, strength, images, away);
        }
        for (image, away) in images.into_iter().zip(away) {
            let image = &mut self.images[image];
            image.clearance = image.clearance.min(away);
        }
    }

    /// The waves of `path` to the base path and to the images in its faces.
    fn add_waves(&mut self, path: &EdgePath, strength: f64, images: [usize; 2], away: [f64; 2]) {
        let cells = self.edges.spectrum.cells();
        // √((1−α)(1−s)) of the base's mirror, and the air on the way.
        let through: Vec<f64> = (0..self.edges.spectrum.bands())
            .map(|band| self.through(band, path.detour()) * strength)
            .collect();
        for (piece, length) in path.lengths().enumerate() {
            let terms: Vec<[Complex; 3]> = cells
                .iter()
                .map(|cell| path.amplitudes(piece, cell.k).map(|term| term * through[cell.band]))
                .collect();
            self.waves.push(Wave { length, amplitude: terms.iter().map(|term| term[0]).collect() });
            for face in [0, 1] {
                let image = &mut self.images[images[face]];
                let scaled = cells.iter().zip(&terms).map(|(cell, term)| {
                    let mirrored = image.amplitude[cell.band];
                    // Deep in the image's shadow a face is rigid, on the boundary it is the mirror that it is there.
                    let rigid = if image.lit.is_some() { 0.0 } else { 1.0 - faded(cell.k, away[face]) };
                    term[1 + face] * (mirrored + (1.0 - mirrored) * rigid)
                });
                image.waves.push(Wave { length, amplitude: scaled.collect() });
            }
        }
    }

    /// Amplitude that the base's mirror and `length` [m] of air leave in `band`.
    fn through(&self, band: usize, length: f64) -> f64 {
        let air = libm::exp(-0.5 * self.at.attenuation[band] * length);
        self.base.map_or(air, |mirror| air * self.specular(mirror, band).sqrt())
    }

    fn specular(&self, mirror: &PlaneMirror, band: usize) -> f64 {
        let material = self.at.geometry.surface(mirror.surface).material;
        self.at.table.material(material).specular.energy[band / 4][band % 4]
    }

    /// Index of the image of the base path in a face of `edge`, on `leg`.
    fn image(&mut self, edge: &RoomEdge, leg: &Leg, face: usize, reflections: &[Reflection]) -> usize {
        let mirror = &edge.faces[face];
        let position = match leg.mirror {
            Some((base, false)) => base.image(mirror.image(leg.source)),
            _ => mirror.image(leg.source),
        };
        let same = |image: &Image| {
            image.plane == mirror.plane && image.position.distance(position) <= same_image(self.at)
        };
        if let Some(known) = self.images.iter().position(same) {
            return known;
        }
        let bands = self.edges.spectrum.bands();
        self.images.push(Image {
            plane: mirror.plane,
            position,
            lit: find(self.at, reflections, position),
            amplitude: (0..bands).map(|band| self.specular(mirror, band).sqrt()).collect(),
            waves: Vec::new(),
            clearance: f64::INFINITY,
        });
        self.images.len() - 1
    }

    /// Shares the energy of the family out: to the reflections that it contains, as ratios, and to an arrival of its own.
    pub fn hear(mut self, reflections: &mut [Reflection]) -> Option<EdgeArrival> {
        let (detour, towards) = self.detour?;
        let bands = self.edges.spectrum.bands();
        let offset = self.origin - self.at.receiver;
        let straight = offset.length();
        if self.clear {
            let factor = self.factor_of_base(reflections);
            let clear = self.geometric(straight, &factor);
            self.waves.push(clear);
        }
        for image in 0..self.images.len() {
            if let Some(lit) = self.images[image].lit {
                let length = self.images[image].position.distance(self.at.receiver);
                let clear = self.geometric(length, &reflections[lit].factor);
                self.images[image].waves.push(clear);
            }
        }
        let own = self.edges.spectrum.energy(&self.waves);
        let of_images: Vec<Vec<f64>> =
            self.images.iter().map(|image| self.edges.spectrum.energy(&image.waves)).collect();
        let separate: Vec<f64> = (0..bands)
            .map(|band| own[band] + of_images.iter().map(|energy| energy[band]).sum::<f64>())
            .collect();
        let crossed = self.cross_terms();
        // What interference does to all of it; never below zero but by rounding.
        let gain: Vec<f64> = (0..bands)
            .map(|band| (1.0 + crossed[band] / separate[band].max(f64::MIN_POSITIVE)).max(0.0))
            .collect();
        let mut rest = own;
        for (image, energy) in self.images.iter().zip(&of_images) {
            match image.lit {
                Some(lit) => {
                    let length = image.position.distance(self.at.receiver);
                    for band in 0..bands {
                        let alone = self.alone(reflections[lit].factor[band], length, band);
                        reflections[lit].ratio[band] = ratio(gain[band] * energy[band] / (4.0 * PI), alone);
                    }
                }
                None => rest.iter_mut().zip(energy).for_each(|(rest, energy)| *rest += energy),
            }
        }
        let energy: Vec<f64> = rest.iter().zip(&gain).map(|(rest, gain)| rest * gain / (4.0 * PI)).collect();
        if let Some(base) = self.reflection {
            for band in 0..bands {
                let alone = self.alone(reflections[base].factor[band], straight, band);
                reflections[base].ratio[band] = ratio(energy[band], alone);
            }
            return None;
        }
        let (length, towards) = if self.clear { (straight, offset / straight) } else { (detour, towards) };
        Some(EdgeArrival {
            length,
            towards,
            order: u32::from(self.base.is_some()),
            shaded: !self.clear,
            energy,
        })
    }

    fn factor_of_base(&self, reflections: &[Reflection]) -> Vec<f64> {
        match self.reflection {
            Some(reflection) => reflections[reflection].factor.clone(),
            None => {
                let factor = self.at.radiator.factor(self.at.receiver - self.at.radiator.position);
                vec![factor; self.edges.spectrum.bands()]
            }
        }
    }

    /// A wave over `length` [m] without edges, of energy `factor` per band.
    fn geometric(&self, length: f64, factor: &[f64]) -> Wave {
        let amplitude =
            |band: usize| (factor[band] * libm::exp(-self.at.attenuation[band] * length)).sqrt() / length;
        let cells = self.edges.spectrum.cells().iter();
        Wave { length, amplitude: cells.map(|cell| Complex::real(amplitude(cell.band))).collect() }
    }

    /// Fluence of a mirror image without edges [1/m²].
    fn alone(&self, factor: f64, length: f64, band: usize) -> f64 {
        factor * spread(length) * libm::exp(-self.at.attenuation[band] * length)
    }

    /// 2 Re of the products of the base path with the images and of the images with one another, per band, faded [1/m²].
    fn cross_terms(&self) -> Vec<f64> {
        let spectrum = &self.edges.spectrum;
        let weight: Vec<Vec<f64>> = self
            .images
            .iter()
            .map(|image| {
                let of = |k| if image.lit.is_some() { faded(k, image.clearance) } else { 1.0 };
                spectrum.cells().iter().map(|cell| of(cell.k)).collect()
            })
            .collect();
        let mut sum = vec![0.0; spectrum.bands()];
        for (index, image) in self.images.iter().enumerate() {
            let own = &weight[index];
            spectrum.add_products(&self.waves, &image.waves, |cell| 2.0 * own[cell], &mut sum);
            for (other, weight) in self.images.iter().zip(&weight).take(index) {
                let both = |cell: usize| 2.0 * own[cell] * weight[cell];
                spectrum.add_products(&other.waves, &image.waves, both, &mut sum);
            }
        }
        sum
    }
}

/// 1/(1 + N²) of the Fresnel number N of a clearance [m] at wave number `k`.
fn faded(k: f64, clearance: f64) -> f64 {
    let number = 2.0 * clearance * k / TAU;
    1.0 / (1.0 + number * number)
}

fn ratio(energy: f64, alone: f64) -> f64 {
    if alone > 0.0 { energy / alone } else { 0.0 }
}

/// Way over the edge less the straight one from the image in `face` [m]; grows on both sides of the image's boundary.
fn clearance(edge: &RoomEdge, source: WedgePoint, receiver: WedgePoint, face: usize) -> f64 {
    let turn = match face {
        0 => source.angle + receiver.angle,
        _ => 2.0 * edge.wedge.angle() - source.angle - receiver.angle,
    };
    // Beyond a whole turn the image is as far off as it can be.
    let half = libm::cos(0.5 * turn.min(TAU));
    let (sum, offset) = (source.radius + receiver.radius, receiver.along - source.along);
    let detour = libm::hypot(sum, offset);
    let excess = 4.0 * source.radius * receiver.radius * half * half;
    excess / (detour + (detour * detour - excess).max(0.0).sqrt())
}

fn same_image(at: &Listening<'_>) -> f64 {
    SAME_IMAGE * f64::from(at.geometry.resolution())
}

fn find(at: &Listening<'_>, reflections: &[Reflection], position: DVec3) -> Option<usize> {
    reflections.iter().position(|reflection| reflection.image.distance(position) <= same_image(at))
}
