//! L E R and L S E R: diffraction of direct sound and image sources at edges.
//!
//! One rule: an image of the source × an edge × an image of the receiver, at any order of images, and the same with two edges of a convex face in
//! the place of the edge. Both ends see a part of the edge ([`images`]), which radiates as a finite edge does. Which contributions are computed is
//! a matter of their bounds ([`contributions`]); what they add up to, of the image sources that they belong to ([`field`]).
//!
//! Faces are rigid for what they shade. In a mirror image absorption and scattering of its plane are those of the room, and the
//! terms of the image take over from the one to the other as the image fades (docs/diffraction.md).
//!
//! Where paths are arcs, both ends are put where they appear from the edge ([`arcs`]). There are images of one reflection, on either end or on both in
//! one plane, and none where the image is visible past the edges: packets carry its sound.
//!
//! References: [Svensson1999] (docs/references.md), docs/physics.md §5.1.

mod arcs;
mod contributions;
mod faces;
mod field;
mod images;
mod mirror;
mod rows;
mod visibility;
mod waves;

use glam::DVec3;
use sonel_acoustics::Bands;
use sonel_diffraction::{Spectrum, Wedge};
use sonel_geometry::Geometry;
use sonel_map::CoefficientTable;

use crate::exact::mirror::tree::ImageTree;
use crate::exact::mirror::{ImageSources, Radiator};
use crate::receiver::Sensitivity;
use crate::rendering::EdgeWork;
use contributions::Search;
use faces::Pair;
use field::Field;
use mirror::Mirror;
use waves::Waves;

pub(crate) use field::Place;
pub(crate) use images::Images;

/// How many resolutions from a plane a place may lie in it.
const IN_PLANE: f64 = 8.0;
/// How many resolutions out of a plane a source in it is moved, and a receiver. Where both are in one plane the field depends on which
/// is how much farther off it: as far as the receiver can be without being moved, and where it is moved to, is next to nothing.
pub(crate) const SOURCE_OUT: f64 = 128.0;
pub(crate) const RECEIVER_OUT: f64 = 16.0;
/// How many lifts from a line through a corner a place may be in line with it, and how far it is moved aside.
const IN_LINE: f64 = 2.0;
const BESIDE_LINE: f64 = 6.0;
/// Places that differ by no more than so many resolutions are the same.
const SAME_PLACE: f64 = 64.0;

/// All edges that diffract, and what they have to be asked with.
pub(crate) struct Edges {
    all: Vec<RoomEdge>,
    pairs: Vec<Pair>,
    spectrum: Spectrum,
    /// Wave number in the middle of each band [1/m].
    centres: Vec<f64>,
}

/// An edge of the room.
struct RoomEdge {
    /// About the scene's centre.
    wedge: Wedge,
    /// Its faces, seen from the air.
    faces: [Mirror; 2],
    /// Edges that hide it all at once.
    hiders: Vec<usize>,
}

/// Direct sound, or an image source that is visible from the receiver.
pub(crate) struct VisibleWave {
    /// Where it comes from.
    pub place: Place,
    /// Length of its way [m].
    pub length: f64,
    /// Unit direction from the receiver to where it comes from.
    pub towards: DVec3,
    /// Number of reflections.
    pub order: u32,
    /// ∏ (1−α)(1−s) times the source's directivity factor and the sensitivity of the receiver, per band.
    pub factor: Vec<f64>,
    /// Fluence per unit emitted energy per band, attenuated by air [1/m²].
    pub energy: Vec<f64>,
}

/// Sound that arrives over edges.
pub(crate) struct EdgeArrival {
    /// Length of its way [m].
    pub length: f64,
    /// Unit direction from the receiver to where it comes from.
    pub towards: DVec3,
    /// Number of reflections.
    pub order: u32,
    /// Fluence per unit emitted energy per band, attenuated by air [1/m²].
    pub energy: Vec<f64>,
}

/// What edges do at a receiver.
pub(crate) struct EdgeSound {
    /// What arrives over edges besides the visible waves.
    pub arrivals: Vec<EdgeArrival>,
    /// How much was computed.
    pub work: EdgeWork,
}

/// A receiver with what its exact field depends on.
pub(crate) struct ReceiverContext<'a> {
    pub geometry: &'a Geometry,
    pub table: &'a CoefficientTable,
    /// m per band [1/m].
    pub attenuation: &'a [f64],
    pub radiator: Radiator<'a>,
    /// About the scene's centre [m].
    pub receiver: DVec3,
    /// How sensitive the receiver is.
    pub sensitivity: Sensitivity,
    /// K: mirror images of at most so many reflections are known completely.
    pub complete_order: u32,
}

impl Edges {
    /// The edges of `geometry`; [`None`] where it has none that diffract.
    #[must_use]
    pub fn new(geometry: &Geometry, bands: &Bands, speed_of_sound: f64) -> Option<Self> {
        let mut all = room_edges(geometry);
        if all.is_empty() {
            return None;
        }
        let borders: Vec<(f64, f64)> = (0..bands.count()).map(|band| bands.edges(band)).collect();
        let spectrum = Spectrum::new(&borders, speed_of_sound);
        let hiders = faces::hiders(&all);
        all.iter_mut().zip(hiders).for_each(|(edge, hiders)| edge.hiders = hiders);
        let centre = |(low, high): &(f64, f64)| std::f64::consts::TAU * (low * high).sqrt() / speed_of_sound;
        Some(Self { pairs: faces::pairs(&all), all, centres: borders.iter().map(centre).collect(), spectrum })
    }

    /// The place of a source or receiver [m], or one beside it if it lies in the plane of a face: whether it sees an edge past the face
    /// would be for rounding to say, for each edge on its own. The field is continuous across the plane. `out` is how far [resolutions].
    #[must_use]
    pub fn beside_planes(&self, geometry: &Geometry, place: DVec3, out: f64) -> DVec3 {
        let resolution = f64::from(geometry.resolution());
        let faces = self.all.iter().flat_map(|edge| &edge.faces);
        faces.fold(place, |place, face| {
            let in_plane = face.height(place).abs() <= IN_PLANE * resolution;
            if in_plane { place + face.normal() * (out * resolution) } else { place }
        })
    }

    /// `receiver` [m], or a place beside it if it is in line with a corner and with the source or an image of it of one reflection. There two edges
    /// end where their wave is cut off, and two halves of both are not what a corner leaves. The field is continuous.
    #[must_use]
    pub fn beside_corners(&self, geometry: &Geometry, from: &Images, receiver: DVec3) -> DVec3 {
        let lift = f64::from(geometry.lift());
        let in_line = |place: DVec3| {
            let ends =
                self.all.iter().flat_map(|edge| [0.0, edge.wedge.length()].map(|end| edge.wedge.at(end)));
            let sources =
                || from.all.iter().take_while(|image| image.order() < 2).map(|image| image.position);
            ends.into_iter().any(|end| {
                sources().any(|source| {
                    let way = place - source;
                    let aside = (end - source).cross(way).length() / way.length();
                    aside * way.length() / source.distance(end) <= IN_LINE * lift
                })
            })
        };
        let steps =
            [DVec3::new(0.61, -0.53, 0.59), DVec3::new(-0.47, 0.67, 0.57), DVec3::new(0.71, 0.43, -0.55)];
        let places = steps.into_iter().map(|step| receiver + step * (BESIDE_LINE * lift));
        std::iter::once(receiver).chain(places).find(|place| !in_line(*place)).unwrap_or(receiver)
    }

    /// The images of the source, among `image_sources`, that edges are seen from.
    #[must_use]
    pub fn of_source(
        &self,
        geometry: &Geometry,
        table: &CoefficientTable,
        source: DVec3,
        image_sources: &ImageSources<'_>,
    ) -> Images {
        let of_arcs;
        let tree = match image_sources {
            _ if table.profile().is_some() => {
                let budget = images::most_images(self.all.len());
                of_arcs = ImageTree::new(geometry, table, Radiator::omni(source), budget, Some(1));
                Some(&of_arcs)
            }
            ImageSources::Tree(tree) => Some(tree),
            ImageSources::Lattice(_) => None,
        };
        let order = tree.map_or(0, |tree| tree.order_within(images::most_images(self.all.len())));
        Images::new(self, geometry, table, source, (tree, order))
    }

    /// What edges bring to one receiver; sets the energies of the `visible` waves that they change.
    pub fn arrivals_at(
        &self,
        at: &ReceiverContext<'_>,
        from: &Images,
        visible: &mut [VisibleWave],
    ) -> EdgeSound {
        let listener = Radiator::omni(at.receiver);
        let budget = images::most_images(self.all.len());
        let tree = ImageTree::new(at.geometry, at.table, listener, budget, Some(from.order()));
        let to = Images::new(self, at.geometry, at.table, at.receiver, (Some(&tree), tree.order()));
        let same_place = SAME_PLACE * f64::from(at.geometry.resolution());
        let field = Field::new(&self.spectrum, at.attenuation, visible, same_place);
        let search = Search { edges: self, at, from, to: &to, field: &field };
        let mut ranked = search.rank(visible);
        let mut waves = Waves { edges: self, at, from, to: &to, field, through: Vec::new() };
        while let Some(contribution) = ranked.next() {
            if let Some(energy) = waves.add(contribution) {
                ranked.found(&energy);
            }
        }
        let work = EdgeWork { computed: ranked.computed(), dropped: ranked.dropped() };
        EdgeSound { arrivals: waves.field.energies(visible), work }
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
            let faces = sector.faces.map(|(surface, side)| Mirror::new(geometry, surface, side));
            Some(RoomEdge { wedge, faces, hiders: Vec::new() })
        })
        .collect()
}
