//! Image sources of one end of a path, and the part of each edge visible from them.
//!
//! A source has images in the mirrors that its sound meets before an edge, a receiver in those between the edge and itself. All images up
//! to the highest order whose number times that of the edges is affordable are taken. Visibility is computed on demand and
//! cached: straight ways in general position lead to places a hair off the edge, in the air about it.

use std::borrow::Cow;

use glam::DVec3;
use sonel_geometry::{Crossed, Geometry, SurfaceId};
use sonel_map::{BandValues, CoefficientTable, Lanes, lanes_of};

use super::mirror::Mirror;
use super::{Edges, RoomEdge};
use crate::exact::mirror::tree::ImageTree;

/// Most images of a source or a receiver. Chosen, not measured; doubled, edges are seen in more mirrors at up to twice the time.
const IMAGES: usize = 256;
/// Most images times edges, which bounds time and memory; rooms of more than 32 edges have fewer images. Chosen, not measured.
const IMAGES_TIMES_EDGES: usize = 1 << 13;
/// Least distance from a mirror of an edge that it shows [resolutions]: corners may be one off their planes. The rest is a margin, chosen.
pub(super) const OFF_THE_MIRROR: f64 = 8.0;

/// An end of a path, or its image in mirrors.
#[derive(Debug, Clone, Default)]
pub(super) struct Image {
    /// The mirrors, the one next to the end of the path first.
    pub mirrors: Vec<Mirror>,
    /// About the scene's centre [m].
    pub position: DVec3,
    /// The same in general position.
    pub displaced: DVec3,
    /// ∏ (1−α)(1−s) of the mirrors, per band.
    pub factor: Vec<f64>,
    /// The part of each edge within its beam [m from the start of the edge].
    pub parts: Vec<Option<[f64; 2]>>,
    /// Inward normals of the sides of the beam through the mirrors; all sides contain the image.
    sides: Vec<DVec3>,
}

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
    lit: Vec<std::sync::OnceLock<Vec<usize>>>,
}

const POINTS: u32 = 5;

/// Most images that are affordable beside so many edges.
pub(crate) fn most_images(edges: usize) -> usize {
    (IMAGES_TIMES_EDGES / edges.max(1)).min(IMAGES)
}

impl Image {
    /// Number of reflections in bodies.
    pub(super) fn mirrors_in_bodies(&self) -> usize {
        self.mirrors.iter().filter(|mirror| !mirror.is_wall()).count()
    }

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
        let factor = vec![1.0; table.bands()];
        let mut all = vec![Image { position: place, displaced, factor, ..Image::default() }];
        if let Some(tree) = tree {
            all.extend((0..tree.count(order)).map(|image| {
                let mut mirrors: Vec<Mirror> =
                    tree.mirrors(image).map(|mirror| Mirror::new(geometry, &edges.bodies, mirror)).collect();
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
                    parts: Vec::new(),
                    mirrors,
                }
            }));
        }
        let least = OFF_THE_MIRROR * f64::from(geometry.resolution());
        for image in &mut all {
            image.parts = edges.all.iter().map(|edge| image.within_beam(edge, least)).collect();
        }
        let lit = all.iter().map(|_| std::sync::OnceLock::new()).collect();
        Self { edges, geometry, table, tree, all, order, lit }
    }

    /// Up to which order they are complete.
    #[must_use]
    pub(crate) fn order(&self) -> u32 {
        self.order
    }

    /// Edges of which something may be visible from an image.
    #[must_use]
    pub(super) fn lit(&self, image: usize) -> &[usize] {
        self.lit[image].get_or_init(|| {
            let edges = self.edges.all.iter().enumerate();
            let is_lit = |(index, edge): &(usize, &RoomEdge)| {
                let Some([from, to]) = self.all[image].parts[*index] else { return false };
                (0..POINTS).any(|point| {
                    let share = (f64::from(point) + 0.5) / f64::from(POINTS);
                    self.sees(image, edge.wedge.at(from + (to - from) * share) + edge.off, &[edge.body()])
                        .is_some()
                })
            };
            edges.filter(is_lit).map(|(index, _)| index).collect()
        })
    }

    /// Whether something of an edge may be visible from an image.
    #[must_use]
    pub(super) fn is_lit(&self, image: usize, edge: usize) -> bool {
        self.lit(image).binary_search(&edge).is_ok()
    }

    /// What is passed between the end, over the mirrors of an image, and `place` [m], by sound that the bodies `own` scatter; [`None`] where
    /// something is between that nothing passes.
    #[must_use]
    pub(super) fn sees(&self, image: usize, place: DVec3, own: &[u32]) -> Option<Passed> {
        let mut leg = Leg { images: self, own, partitions: Vec::new(), bodies: Vec::new() };
        let is_seen = match self.tree {
            Some(tree) if image > 0 => {
                tree.is_clear(self.geometry, image - 1, place, |face| leg.passes(face))
            }
            _ => leg.is_clear([self.all[0].displaced, place]),
        };
        is_seen.then(|| leg.passed())
    }

    /// Likewise between two places [m].
    #[must_use]
    pub(super) fn between(&self, places: [DVec3; 2], own: &[u32]) -> Option<Passed> {
        let mut leg = Leg { images: self, own, partitions: Vec::new(), bodies: Vec::new() };
        leg.is_clear(places).then(|| leg.passed())
    }

    /// Likewise over a mirror between them.
    #[must_use]
    pub(super) fn over(&self, floor: &Mirror, [from, to]: [DVec3; 2], own: &[u32]) -> Option<Passed> {
        let image = floor.image(to);
        let share = floor.height(from) / (floor.height(from) - floor.height(image));
        if !(0.0..1.0).contains(&share) {
            return None;
        }
        let mut leg = Leg { images: self, own, partitions: Vec::new(), bodies: Vec::new() };
        let mut is_mirrored = false;
        let is_hidden = self.geometry.visit_between([from, image], None, |face| {
            is_mirrored |= face.plane == floor.plane;
            face.plane != floor.plane && face.share < share && !leg.passes(&face)
        });
        let meets = from.lerp(image, share);
        let is_clear = !is_hidden
            && is_mirrored
            && !self.geometry.visit_between([meets, to], Some(floor.plane), |face| !leg.passes(&face));
        is_clear.then(|| leg.passed())
    }

    /// The direction in which sound leaves the end over an image for `place` [m].
    #[must_use]
    pub(super) fn leaving(&self, image: usize, place: DVec3) -> DVec3 {
        self.all[image].unfold(place) - self.all[0].position
    }
}

/// What sound passes on its way.
#[derive(Debug, Clone, Default)]
pub(super) struct Passed {
    /// Materials of partitions, in ascending order.
    pub through: Vec<u32>,
    /// Bodies that are small beside the longest wave.
    pub bodies: Vec<u32>,
}

impl Passed {
    /// Adds what is passed later.
    pub(super) fn extend(&mut self, other: Self) {
        self.through.extend(other.through);
        self.through.sort_unstable();
        self.bodies.extend(other.bodies);
        self.bodies.sort_unstable();
        self.bodies.dedup();
    }
}

/// A straight piece of a way, while what it passes is found.
struct Leg<'a> {
    images: &'a Images<'a>,
    /// Bodies that are not passed because they scatter the sound.
    own: &'a [u32],
    partitions: Vec<Crossed>,
    bodies: Vec<u32>,
}

impl Leg<'_> {
    fn is_clear(&mut self, places: [DVec3; 2]) -> bool {
        !self.images.geometry.visit_between(places, None, |face| !self.passes(&face))
    }

    /// Whether sound passes a face.
    fn passes(&mut self, face: &Crossed) -> bool {
        if self.images.table.mean_row(face.surface).is_partition {
            self.partitions.push(*face);
            return true;
        }
        let body = self.images.edges.bodies.of(face.surface);
        let is_passed = self.images.edges.is_small(body) && !self.own.contains(&body);
        if is_passed {
            self.bodies.push(body);
        }
        is_passed
    }

    fn passed(mut self) -> Passed {
        self.bodies.sort_unstable();
        self.bodies.dedup();
        Passed { through: materials_of(self.images.geometry, self.partitions), bodies: self.bodies }
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

/// (1−α)(1−s) per band of a mirror met in `direction`.
#[must_use]
pub(super) fn specular(table: &CoefficientTable, surface: SurfaceId, direction: DVec3) -> Vec<f64> {
    let mut factor = vec![Lanes::ONE; lanes_of(table.bands())];
    table.mirror(surface, direction, &mut factor);
    factor.values().collect()
}
