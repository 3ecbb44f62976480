//! L E R and L S E R: diffraction of direct sound and image sources at edges.
//!
//! One rule: an image of the source × one edge or two × an image of the receiver, at any order of images. A path over edges is a path of air: each of
//! its legs is a clear ray between ends in general position, past the middle of the air of the edge. What an object hides comes over its own edges
//! ([`waves`]), so that a leg that ends leaves no step. Which paths are computed is a matter of their bounds ([`contributions`]); what they add up
//! to, of the image source over walls that they belong to ([`field`]) and of the [`bodies`] that scatter them.
//!
//! Faces are rigid for what they shade. In a mirror image absorption and scattering of its plane are those of the room, and the
//! terms of the image take over from the one to the other as the image fades (docs/diffraction.md).
//!
//! Where the speed of sound has a gradient, edges are those of even air, of direct sound alone.
//!
//! References: [Svensson1999] (docs/references.md), docs/physics.md §5.1.

mod bodies;
mod contributions;
mod faces;
mod field;
mod images;
mod mirror;
mod waves;

use glam::DVec3;
use rayon::prelude::*;
use sonel_acoustics::Bands;
use sonel_diffraction::{Complex, Spectrum, Wedge};
use sonel_geometry::{End, Geometry, Side, SurfaceId};
use sonel_map::{BandValues, CoefficientTable};

use crate::exact::mirror::tree::{ImageTree, Seed};
use crate::exact::mirror::{ImageSources, MirrorArrival, Radiator};
use crate::receiver::Sensitivity;
use crate::rendering::EdgeWork;
use bodies::Bodies;
use contributions::Search;
use faces::Joined;
use field::Field;
use mirror::Mirror;
use waves::Waves;

use field::ImagePlace;
pub(crate) use images::Images;

/// Distance up to which positions are the same [resolutions]: corners may be off by one each. The rest is a margin, chosen.
const SAME_PLACE: f64 = 8.0;

/// Distance of the test points from an edge [resolutions]: corners of the mesh may be one off its line.
const OFF_EDGE: f64 = 2.0;

/// Edges that diffract, and the tables for their contributions.
pub(crate) struct Edges {
    all: Vec<RoomEdge>,
    bodies: Bodies,
    /// What may be between two edges. Floors are the walls that bodies stand on: with its mirror image in them a body is one.
    joined: Vec<Joined>,
    spectrum: Spectrum,
    /// Wave number in the middle of each band [1/m].
    centres: Vec<f64>,
}

/// An edge of the room.
struct RoomEdge {
    /// About the scene's centre.
    wedge: Wedge,
    /// Faces, seen from the air.
    faces: [Mirror; 2],
    /// From the edge a hair into the middle of its air [m].
    off: DVec3,
}

/// Direct sound, or an image source that is visible from the receiver.
pub(crate) struct VisibleWave {
    /// Apparent position of its source over the walls alone.
    pub place: ImagePlace,
    /// The same over walls and bodies.
    pub whole: ImagePlace,
    /// Bodies that mirror it.
    pub bodies: Vec<u32>,
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
    /// Share of the map's batches that is rendered.
    pub share: f64,
}

impl Edges {
    /// The edges of `geometry`; [`None`] where it has none that diffract.
    #[must_use]
    pub(crate) fn new(geometry: &Geometry, bands: &Bands, speed_of_sound: f64) -> Option<Self> {
        let bodies = Bodies::new(geometry);
        let all = room_edges(geometry, &bodies);
        if all.is_empty() {
            return None;
        }
        let borders: Vec<(f64, f64)> = (0..bands.count()).map(|band| bands.edges(band)).collect();
        let spectrum = Spectrum::new(&borders, speed_of_sound);
        let centre = |(low, high): &(f64, f64)| std::f64::consts::TAU * (low * high).sqrt() / speed_of_sound;
        let floors: Vec<Mirror> = bodies
            .floors()
            .into_iter()
            .map(|surface| Mirror::new(geometry, &bodies, (surface, Side::Front)))
            .collect();
        Some(Self {
            joined: faces::joined(&all, &bodies, floors),
            bodies,
            all,
            centres: borders.iter().map(centre).collect(),
            spectrum,
        })
    }

    /// Whether a body is small beside the longest wave, so that some sound passes it.
    fn is_small(&self, body: u32) -> bool {
        self.bodies.scattered(body, self.spectrum.range()[0]) != Complex::from(1.0)
    }

    /// The wave `found` from a `source`, seen from the `receiver` [m], with its `energy` per band [1/m²].
    #[must_use]
    pub(crate) fn visible(
        &self,
        geometry: &Geometry,
        [source, receiver]: [DVec3; 2],
        found: &MirrorArrival<'_>,
        energy: Vec<f64>,
    ) -> VisibleWave {
        // On which side of it a point is does not matter to its image in a plane.
        let mirror = |&surface: &SurfaceId| Mirror::new(geometry, &self.bodies, (surface, Side::Front));
        let mirrors: Vec<Mirror> = found.mirrors.iter().rev().map(mirror).collect();
        // Of an arc, the place that it begins at.
        let arrives = if found.order == 0 { source } else { receiver + found.towards * found.length };
        let place = |mirrors: &[&Mirror], position: DVec3| {
            ImagePlace::new(position, mirrors.iter().map(|mirror| mirror.plane), found.through.clone())
        };
        let walls: Vec<&Mirror> = mirrors.iter().filter(|mirror| mirror.is_wall()).collect();
        let of_walls = if walls.len() == mirrors.len() {
            arrives
        } else {
            walls.iter().fold(source, |point, mirror| mirror.image(point))
        };
        VisibleWave {
            place: place(&walls, of_walls),
            whole: place(&mirrors.iter().collect::<Vec<_>>(), arrives),
            bodies: waves::bodies_of(&mirrors, &[]),
            length: found.length,
            towards: found.towards,
            order: found.order,
            factor: found.factor.values().take(self.spectrum.bands()).collect(),
            energy,
        }
    }

    /// The images of the source, among `image_sources`, that edges are seen from.
    #[must_use]
    pub(crate) fn of_source<'t>(
        &'t self,
        geometry: &'t Geometry,
        table: &'t CoefficientTable,
        source: DVec3,
        image_sources: &'t ImageSources,
    ) -> Images<'t> {
        let tree = match image_sources {
            ImageSources::Tree(tree) => Some(tree),
            ImageSources::Lattice(_) => None,
        };
        let order = tree.map_or(0, |tree| tree.order_within(images::most_images(self.all.len())));
        let places = [source, geometry.in_general_position(source, End::Source)];
        Images::new(self, geometry, table, places, tree, order)
    }

    /// Arrivals over edges at one receiver besides the `visible` waves, and how complete they are; sets the energies of those that edges change. What little they would change beside `others`,
    /// the fluence of all that is neither visible wave nor edge [1/m² per band], is left out.
    pub(crate) fn arrivals_at(
        &self,
        at: &ReceiverContext<'_>,
        from: &Images<'_>,
        visible: &mut [VisibleWave],
        others: &[f64],
    ) -> (Vec<EdgeArrival>, EdgeWork) {
        let budget = images::most_images(self.all.len());
        let order = Some(from.order());
        let seed = Seed::new(at.geometry, at.table, at.receiver, End::Receiver, budget, order);
        let tree = ImageTree::new(at.geometry, seed);
        let places = [at.receiver, at.geometry.in_general_position(at.receiver, End::Receiver)];
        let to = Images::new(self, at.geometry, at.table, places, Some(&tree), tree.order());
        let same_place = SAME_PLACE * f64::from(at.geometry.resolution());
        let field = Field::new(self, at.attenuation, visible, same_place);
        let search = Search { at, from, to: &to };
        let mut ranked = search.rank(visible, others);
        let cells =
            [at.radiator.position, at.receiver].map(|end| at.geometry.cell_at(end + at.geometry.center()));
        let mut waves = Waves { at, from, to: &to, field, is_sealed: cells[0] != cells[1] };
        waves.add_straight();
        while let Some(next) = ranked.next() {
            let found: Vec<_> = next.into_par_iter().map(|contribution| waves.find(contribution)).collect();
            for found in found.into_iter().flatten() {
                ranked.found(&found.energy);
                waves.add(found);
            }
        }
        let work = EdgeWork { computed: ranked.computed(), left_out: ranked.left_out().collect() };
        (waves.field.energies(visible), work)
    }
}

/// The edges of `geometry` that diffract, each once for every sector of air into which it does.
fn room_edges(geometry: &Geometry, bodies: &Bodies) -> Vec<RoomEdge> {
    let local = |point: DVec3| point - geometry.center();
    geometry
        .diffracting_edges()
        .flat_map(|edge| edge.sectors.iter().map(move |sector| (edge, sector)))
        .filter_map(|(edge, sector)| {
            let wedge = Wedge::new(edge.ends.map(local), sector.inward, sector.normal, sector.angle)?;
            let faces = sector.faces.map(|face| Mirror::new(geometry, bodies, face));
            let off = OFF_EDGE * f64::from(geometry.resolution()) * sector.middle();
            Some(RoomEdge { wedge, faces, off })
        })
        .collect()
}

impl RoomEdge {
    /// The body that it belongs to.
    fn body(&self) -> u32 {
        self.faces[0].body
    }
}
