//! Image sources of one end of a path, and the part of each edge visible from them.
//!
//! A source has images in the mirrors that its sound meets before an edge, a receiver in those between the edge and itself. All images up
//! to the highest order whose number times that of the edges is affordable are taken. Visibility is computed on demand and
//! cached: straight ways in general position lead to places a hair off the edge, in the air about it.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;
use sonel_diffraction::WedgePoint;
use sonel_geometry::{Crossed, Geometry, SurfaceId};
use sonel_map::{BandValues, CoefficientTable, Lanes, lanes_of};

use super::mirror::Mirror;
use super::objects::SHELL;
use super::visibility::stretches;
use super::{Edges, RoomEdge};
use crate::exact::mirror::tree::ImageTree;

/// Most images of a source or a receiver. Chosen, not measured; doubled, edges are seen in more mirrors at up to twice the time.
const IMAGES: usize = 256;
/// Most images times edges, which bounds time and memory; rooms of more than 32 edges have fewer images. Chosen, not measured.
const IMAGES_TIMES_EDGES: usize = 1 << 13;
/// Least distance from a mirror of an edge that it shows [resolutions]: corners may be one off their planes. The rest is a margin, chosen.
pub(super) const OFF_THE_MIRROR: f64 = 8.0;

/// An end of a path, or its image in mirrors.
#[derive(Debug)]
pub(super) struct Image {
    /// The mirrors, the one next to the end of the path first.
    pub mirrors: Vec<Mirror>,
    /// About the scene's centre [m].
    pub position: DVec3,
    /// The same in general position.
    pub displaced: DVec3,
    /// ∏ (1−α)(1−s) of the mirrors, per band.
    pub factor: Vec<f64>,
    /// Whether any part of each edge may be visible.
    pub edges: Vec<bool>,
    /// Inward normals of the sides of the beam through the mirrors; all sides contain the image.
    sides: Vec<DVec3>,
}

/// Parts of an edge that are visible from an image.
#[derive(Debug)]
pub(super) struct View {
    /// The image about the edge.
    pub point: WedgePoint,
    /// Visible parts, from the start of the edge [m].
    pub parts: Vec<[f64; 2]>,
    /// Other objects that it is seen past as if they were not there, in ascending order.
    pub objects: Vec<u32>,
    /// Materials of the partitions that it is seen through, in ascending order.
    pub through: Vec<u32>,
}

/// Objects and materials of partitions.
type Seen = (Vec<u32>, Vec<u32>);

/// Views computed so far, by image and edge.
type Views = HashMap<(usize, usize), Arc<Vec<View>>>;

/// Images of one end.
pub(crate) struct Images<'t> {
    pub(crate) edges: &'t Edges,
    geometry: &'t Geometry,
    table: &'t CoefficientTable,
    tree: Option<&'t ImageTree>,
    /// The end first, then by order.
    pub(super) all: Vec<Image>,
    /// Up to which order they are complete.
    order: u32,
    views: Mutex<Views>,
}

/// Most images that are affordable beside so many edges.
pub(crate) fn most_images(edges: usize) -> usize {
    (IMAGES_TIMES_EDGES / edges.max(1)).min(IMAGES)
}

impl Image {
    /// Number of reflections.
    pub(super) fn order(&self) -> u32 {
        self.mirrors.len() as u32
    }

    /// Image of `point`, behind the mirrors, as seen from the end of the path.
    pub(super) fn unfold(&self, point: DVec3) -> DVec3 {
        self.mirrors.iter().rev().fold(point, |point, mirror| mirror.image(point))
    }

    /// The part of an edge within the beam [m from its start].
    fn within_beam(&self, edge: &RoomEdge, least: f64) -> Option<[f64; 2]> {
        let ends = [0.0, edge.wedge.length()].map(|along| edge.wedge.at(along));
        let mut part = [0.0, 1.0];
        let mut clip = |[at_start, at_end]: [f64; 2]| {
            let crossing = at_start / (at_start - at_end);
            match (at_start < 0.0, at_end < 0.0) {
                (true, true) => part[1] = -1.0,
                (true, false) => part[0] = crossing.max(part[0]),
                (false, true) => part[1] = crossing.min(part[1]),
                (false, false) => {}
            }
        };
        if let Some(last) = self.mirrors.last() {
            clip(ends.map(|end| last.height(end) - least));
        }
        self.sides.iter().for_each(|side| clip(ends.map(|end| side.dot(end - self.displaced))));
        (part[0] < part[1]).then(|| part.map(|share| share * edge.wedge.length()))
    }
}

impl<'t> Images<'t> {
    /// The images of a place [m], which is displaced into general position, in `tree`, up to `order` reflections.
    #[must_use]
    pub(crate) fn new(
        edges: &'t Edges,
        geometry: &'t Geometry,
        table: &'t CoefficientTable,
        [place, displaced]: [DVec3; 2],
        tree: Option<&'t ImageTree>,
        order: u32,
    ) -> Self {
        let mut all = vec![Image {
            mirrors: Vec::new(),
            position: place,
            displaced,
            factor: vec![1.0; table.bands()],
            edges: Vec::new(),
            sides: Vec::new(),
        }];
        if let Some(tree) = tree {
            all.extend((0..tree.count(order)).map(|image| {
                let mut mirrors: Vec<Mirror> = tree
                    .mirrors(image)
                    .map(|mirror| Mirror::new(geometry, edges.objects.of(mirror.0), mirror))
                    .collect();
                mirrors.reverse();
                let factor = (0..table.bands()).map(|band| {
                    let of = |mirror: &Mirror| table.mean_row(mirror.surface).specular.energy.band(band);
                    mirrors.iter().map(of).product()
                });
                Image {
                    factor: factor.collect(),
                    position: tree.positions(image)[0],
                    displaced: tree.positions(image)[1],
                    sides: tree.sides(image).to_vec(),
                    edges: Vec::new(),
                    mirrors,
                }
            }));
        }
        let least = OFF_THE_MIRROR * f64::from(geometry.resolution());
        for image in &mut all {
            image.edges = edges.all.iter().map(|edge| image.within_beam(edge, least).is_some()).collect();
        }
        Self { edges, geometry, table, tree, all, order, views: Mutex::default() }
    }

    /// Up to which order they are complete.
    #[must_use]
    pub(crate) fn order(&self) -> u32 {
        self.order
    }

    /// Parts of an edge that are visible from an image, those through the same partitions together.
    #[must_use]
    pub(super) fn views(&self, image: usize, edge: usize) -> Arc<Vec<View>> {
        let views = || self.views.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = views().get(&(image, edge)) {
            return known.clone();
        }
        let seen = Arc::new(self.look(image, edge).unwrap_or_default());
        views().insert((image, edge), seen.clone());
        seen
    }

    fn look(&self, image: usize, index: usize) -> Option<Vec<View>> {
        let (of, edge) = (&self.all[image], &self.edges.all[index]);
        let within = of.within_beam(edge, OFF_THE_MIRROR * f64::from(self.geometry.resolution()))?;
        let part = edge.wedge.between(within);
        let point = edge.wedge.locate(of.displaced)?;
        let seen = stretches(&part, |place| self.seen_past(image, edge, place));
        let view = |((objects, through), parts): (Seen, Vec<[f64; 2]>)| {
            let parts = parts.into_iter().map(|part| part.map(|along| along + within[0])).collect();
            View { point, parts, objects, through }
        };
        Some(seen.into_iter().map(view).collect())
    }

    /// The other objects on the way from the end over the mirrors of an image to `place` on `edge`, and the materials of the partitions on it; [`None`]
    /// where something else is on it. Its own object is opaque to an edge.
    fn seen_past(&self, image: usize, edge: &RoomEdge, place: DVec3) -> Option<Seen> {
        let (geometry, objects_of) = (self.geometry, &self.edges.objects);
        let (mut passed, mut objects) = (Vec::new(), Vec::new());
        let place = place + edge.off;
        let ignored = |face: &Crossed| {
            let is_own = edge.faces.iter().any(|own| own.surface == face.surface);
            if !is_own && self.table.mean_row(face.surface).is_partition {
                passed.push(*face);
                return true;
            }
            let object = objects_of.of(face.surface);
            objects.push(object);
            object != SHELL && object != edge.object
        };
        let is_seen = match self.tree {
            Some(tree) if image > 0 => tree.is_clear(geometry, image - 1, place, ignored),
            _ => {
                let mut ignored = ignored;
                !geometry.visit_between([self.all[0].displaced, place], None, |face| !ignored(&face))
            }
        };
        objects.sort_unstable();
        objects.dedup();
        is_seen.then(|| (objects, materials_of(geometry, passed)))
    }

    /// The direction in which sound leaves the end over an image for `place` [m].
    #[must_use]
    pub(super) fn leaving(&self, image: usize, place: DVec3) -> DVec3 {
        self.all[image].unfold(place) - self.all[0].position
    }
}

/// The materials of the partitions that faces belong to, in ascending order; of one with thickness both faces are passed.
fn materials_of(geometry: &Geometry, mut faces: Vec<Crossed>) -> Vec<u32> {
    faces.sort_by_key(|face| face.plane);
    let same = f64::from(geometry.resolution());
    faces.dedup_by(|one, other| one.plane == other.plane && one.place.distance(other.place) <= same);
    let is_thick = |face: &Crossed| geometry.partition_thickness(face.surface).is_some();
    let material = |face: Crossed| geometry.surface(face.surface).material;
    let (thick, sheets): (Vec<Crossed>, Vec<Crossed>) = faces.into_iter().partition(is_thick);
    let mut of_thick: Vec<u32> = thick.into_iter().map(material).collect();
    of_thick.sort_unstable();
    let mut materials: Vec<u32> =
        of_thick.into_iter().step_by(2).chain(sheets.into_iter().map(material)).collect();
    materials.sort_unstable();
    materials
}

impl Image {
    /// ∏ (1−α)(1−s) per band of its mirrors, for sound between it and `place`.
    pub(super) fn factor_towards(&self, table: &CoefficientTable, place: DVec3) -> Cow<'_, [f64]> {
        if !table.is_angular() {
            return Cow::Borrowed(&self.factor);
        }
        let mut direction = place - self.position;
        let mut product = vec![1.0; self.factor.len()];
        for mirror in self.mirrors.iter().rev() {
            let factor = specular(table, mirror.surface, direction);
            product.iter_mut().zip(factor).for_each(|(product, factor)| *product *= factor);
            let normal = table.normal(mirror.surface);
            direction -= 2.0 * direction.dot(normal) * normal;
        }
        Cow::Owned(product)
    }
}

impl View {
    /// The longest visible part [m].
    pub(super) fn longest(&self) -> [f64; 2] {
        let length = |part: &&[f64; 2]| part[1] - part[0];
        *self.parts.iter().max_by(|a, b| length(a).total_cmp(&length(b))).expect("a view has parts")
    }

    /// The parts that are visible in `other` as well [m].
    pub(super) fn common<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = [f64; 2]> + 'a {
        let both =
            |one: &'a [f64; 2]| other.parts.iter().map(|other| [one[0].max(other[0]), one[1].min(other[1])]);
        self.parts.iter().flat_map(both).filter(|[from, to]| from < to)
    }
}

/// (1−α)(1−s) per band of a mirror met in `direction`.
#[must_use]
pub(super) fn specular(table: &CoefficientTable, surface: SurfaceId, direction: DVec3) -> Vec<f64> {
    let mut factor = vec![Lanes::ONE; lanes_of(table.bands())];
    table.mirror(surface, direction, &mut factor);
    factor.values().collect()
}
