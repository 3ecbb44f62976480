//! L E R and L S E R: what edges do to the direct path and to the mirror images of low order.
//!
//! Every base path (the direct one, and one or two mirror reflections at planes without diffracting edges) is a family of waves:
//! itself where it is clear, the terms of every edge about it that belong to it, and for each plane at an edge the mirror
//! image in it with the terms that belong to that ([`family`]). The family replaces the base path and those images:
//! their energies are never added to it. Which part of an edge takes part is what both ends see of it ([`view`]).
//!
//! Over two edges of a face or a sheet and over three of a solid ([`passage`]) base paths are diffracted several times,
//! and over edges of different objects ([`apart`]). What a plane
//! mirrors meets the edges of the room unfolded about it ([`world`], [`rooms`]).
//!
//! Images are told apart by their mirrors ([`image`]). Next to a plane of faces, and next to where
//! an image ends at a hollow corner, a receiver hears what is between both sides ([`beside`], [`hollow`]).
//!
//! Images of more reflections are no families: each is heard by its own energy, with what single edges next to its way make of it ([`later`]).
//!
//! Faces are rigid for what they shade. In a mirror image absorption and scattering of its plane are those of the room, and the
//! terms of the image take over from the one to the other as the image fades (docs/diffraction.md).
//!
//! References: [Svensson1999] (docs/references.md), docs/physics.md §5.1.

mod apart;
mod beside;
mod chain;
mod extent;
mod family;
mod hollow;
mod image;
mod later;
mod mirror;
mod near;
mod passage;
mod reach;
mod rooms;
mod sight;
mod view;
mod world;

use glam::DVec3;
use sonel_acoustics::Bands;
use sonel_diffraction::{Spectrum, Wedge};
use sonel_geometry::Geometry;
use sonel_map::{CoefficientTable, Lanes};

use crate::direct::spread;
use crate::mirror::{MirrorArrival, Radiator};
use family::Family;
use later::Places;
use mirror::PlaneMirror;
use rooms::Rooms;
use world::RoomEdge;

pub(crate) use beside::Beside;
pub(crate) use image::SourceImage;
pub(crate) use later::LaterImage;

/// Reflections of a mirror image that edges change as one field with others.
pub(crate) const EDGE_ORDER: u32 = 2;
/// How many resolutions from a plane a place may lie in it.
const IN_PLANE: f64 = 8.0;
/// How many resolutions out of a plane a source in it is moved, and a receiver. Where both are in one plane the field depends on which
/// is how much farther off it: as far as the receiver can be without being moved, and where it is moved to, is next to nothing.
pub(crate) const SOURCE_OUT: f64 = 128.0;
pub(crate) const RECEIVER_OUT: f64 = 16.0;

/// All edges that diffract, and what they have to be asked with.
pub(crate) struct Edges {
    rooms: Rooms,
    places: Places,
    spectrum: Spectrum,
}

/// A mirror image that reaches the receiver.
pub(crate) struct Reflection {
    /// Where the sound seems to come from.
    image: SourceImage,
    /// ∏ (1−α)(1−s) times the source's directivity factor, per band.
    factor: Vec<f64>,
    /// Energy over that of the mirror image alone, per band: 1 but where edges have a say.
    pub ratio: Vec<f64>,
}

/// Sound of a base path and of the edges about it; the base path is part of the first one where it is clear.
pub(crate) struct EdgeArrival {
    /// Length of its way [m].
    pub length: f64,
    /// Unit direction from the receiver to where it comes from.
    pub towards: DVec3,
    /// Number of reflections.
    pub order: u32,
    /// Whether it goes over edges only.
    pub shaded: bool,
    /// Fluence per unit emitted energy per band, attenuated by air [1/m²].
    pub energy: Vec<f64>,
}

/// Where sound is heard, and what is known of it.
pub(crate) struct Listening<'a> {
    pub geometry: &'a Geometry,
    pub table: &'a CoefficientTable,
    /// m per band [1/m].
    pub attenuation: &'a [f64],
    pub radiator: Radiator,
    /// About the scene's centre [m].
    pub receiver: DVec3,
    /// Whether the direct path is clear.
    pub clear: bool,
    /// K: mirror images of at most so many reflections are known completely.
    pub complete_order: u32,
}

impl Edges {
    /// The edges of `geometry`; [`None`] where it has none that diffract.
    #[must_use]
    pub fn new(
        geometry: &Geometry,
        table: &CoefficientTable,
        bands: &Bands,
        speed_of_sound: f64,
    ) -> Option<Self> {
        let edges = room_edges(geometry);
        if edges.is_empty() {
            return None;
        }
        let rooms = Rooms::new(geometry, table, edges);
        let places = Places::new(geometry, table, &rooms.direct.edges);
        let borders: Vec<(f64, f64)> = (0..bands.count()).map(|band| bands.edges(band)).collect();
        let spectrum = Spectrum::new(&borders, speed_of_sound);
        Some(Self { rooms, places, spectrum })
    }

    /// The place of a source or receiver [m], or one beside it if it lies in the plane of a face: whether it sees an edge past the face
    /// would be for rounding to say, for each edge on its own. The field is continuous across the plane. `out` is how far [resolutions].
    #[must_use]
    pub fn beside_planes(&self, geometry: &Geometry, place: DVec3, out: f64) -> DVec3 {
        let resolution = f64::from(geometry.resolution());
        let faces = self.rooms.direct.edges.iter().flat_map(|edge| &edge.faces);
        faces.fold(place, |place, face| {
            let in_plane = face.height(place).abs() <= IN_PLANE * resolution;
            if in_plane { place + face.normal() * (out * resolution) } else { place }
        })
    }

    /// The boundaries next to which a receiver hears what is between both sides, from number `first` on: the number of the first one that `receiver`
    /// is next to, a plane of faces or where an image of `source` ends at a hollow corner, and the places on either side of that.
    #[must_use]
    pub fn beside(
        &self,
        geometry: &Geometry,
        source: DVec3,
        receiver: DVec3,
        first: usize,
    ) -> Option<(usize, Beside)> {
        let Rooms { faces, corners, .. } = &self.rooms;
        (first..faces.len() + corners.len()).find_map(|number| {
            let beside = match faces.get(number) {
                Some(plane) => plane.beside(geometry, receiver),
                None => corners[number - faces.len()].beside(geometry, source, receiver),
            };
            Some((number, beside?))
        })
    }

    /// What edges bring to one receiver. `reflections` are all mirror images of up to two reflections that reach it; the
    /// ratios of those that edges change are set.
    pub fn hear<'a>(&'a self, at: &'a Listening<'_>, reflections: &mut [Reflection]) -> Vec<EdgeArrival> {
        let near = self.rooms.near(at, self.spectrum.smallest_k());
        let families = self.rooms.families(&near, at, reflections);
        let mut arrivals = Vec::new();
        for courses in families {
            arrivals.extend(Family::new(&courses, &self.spectrum, at, reflections).hear(reflections));
        }
        arrivals
    }
}

impl Listening<'_> {
    /// (1−α)(1−s) of a plane, per band.
    fn specular(&self, mirror: &PlaneMirror) -> impl Iterator<Item = f64> + use<'_> {
        let material = self.geometry.surface(mirror.surface).material;
        let energy = &self.table.material(material).specular.energy;
        (0..self.table.bands()).map(|band| energy[band / 4][band % 4])
    }

    /// What `mirrors` and `length` [m] of air leave, per band.
    fn through(&self, mirrors: &[PlaneMirror], length: f64) -> impl Iterator<Item = f64> + use<> {
        let mut left: Vec<f64> = self.attenuation.iter().map(|m| libm::exp(-m * length)).collect();
        for mirror in mirrors {
            left.iter_mut().zip(self.specular(mirror)).for_each(|(left, specular)| *left *= specular);
        }
        left.into_iter()
    }
}

impl Reflection {
    /// Its energy with what edges do to it, per band, after `attenuation` of the air [1/m] on the way to the `receiver` [1/m²].
    pub fn energy(&self, receiver: DVec3, attenuation: &[f64]) -> impl Iterator<Item = f64> {
        let length = self.image.position.distance(receiver);
        let parts = self.factor.iter().zip(&self.ratio).zip(attenuation);
        parts.map(move |((factor, ratio), m)| factor * ratio * spread(length) * libm::exp(-m * length))
    }

    /// `found` at `receiver` (about the scene's centre [m]).
    #[must_use]
    pub fn new(found: &MirrorArrival<'_>, receiver: DVec3, bands: usize) -> Self {
        Self {
            image: SourceImage::of(found, receiver),
            factor: flat(found.factor, bands),
            ratio: vec![1.0; bands],
        }
    }
}

/// The edges of `geometry` that diffract, each once for every sector of air into which it does.
fn room_edges(geometry: &Geometry) -> Vec<RoomEdge> {
    let local = |point: DVec3| point - geometry.center();
    geometry
        .diffracting_edges()
        .flat_map(|edge| edge.sectors.iter().map(move |sector| (edge, sector)))
        .filter_map(|(edge, sector)| {
            let wedge = Wedge::new(edge.ends.map(local), sector.inward, sector.normal, sector.angle)?;
            let faces = sector.faces.map(|(surface, side)| PlaneMirror::new(geometry, surface, side));
            Some(RoomEdge { wedge, faces })
        })
        .collect()
}

fn flat(lanes: &[Lanes], bands: usize) -> Vec<f64> {
    (0..bands).map(|band| lanes[band / 4][band % 4]).collect()
}
