//! Images of a source over the planar surfaces of any geometry, validated at every receiver.
//!
//! A node is an image source with its sequence of reflecting surfaces, walls and interfaces between airs. A sequence is omitted only
//! where it can carry no energy: no band reflects there as a mirror, the surface shows its solid side to the image, or the beam of the
//! chain before it misses the surface. What stands in the way is found out at every receiver.

use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;
use sonel_geometry::{Crossed, End, Geometry, PlaneId, Side, SurfaceId};
use sonel_map::{BandValues, CoefficientTable, Lanes, lanes_of};

use super::beam::{Beam, Polygon, outline};
use super::chain::{self, Ends, Reflection, SurfaceSide};
use super::{MirrorArrival, Radiator};

/// No chain is longer, however few the surfaces.
const ORDER_LIMIT: u32 = 24;

/// Thicknesses of the thickest partition by which ways may be shifted out of their beams: a row of three rooms, and back.
const SHIFTS: f64 = 4.0;

/// Angle outside its beam up to which a chain is tried [rad]: beams are cut a resolution inside the surfaces that they light.
const BEAM_SLACK: f64 = 1e-4;

/// Height over a mirror, in resolutions, up to which a facet only touches it. What is cut off there grows with the beams behind it, which are
/// a resolution generous: they stay larger than the true ones up to a thousand times the distance.
const TOUCHING: f64 = 1e-3;

/// Of every so many beams of an order one tells about how many follow, where they are so many more.
const SAMPLED: usize = 32;
/// Beams over those that fit that a sample finds too many [1], which are not counted then.
const FAR_MORE: usize = 2;
/// Beams that are followed at once, by all processors.
const AT_ONCE: usize = 1024;

/// Image sources up to the order K that fits the budget.
#[derive(Debug)]
pub(crate) struct ImageTree {
    order: u32,
    nodes: Vec<Node>,
    /// Inward normals of the beams' sides.
    sides: Vec<DVec3>,
    seed: Seed,
}

/// What a tree grows from: of equal seeds grow equal trees.
#[derive(Debug, PartialEq)]
pub(crate) struct Seed {
    /// Position of the source, or of another end of ways, about the scene's centre [m].
    position: DVec3,
    /// That position in general position, of which the nodes are images.
    origin: DVec3,
    facets: Vec<Facet>,
    /// Most nodes.
    budget: usize,
    /// Highest order.
    most: u32,
}

impl Seed {
    /// Of an `end` of ways at `position` (about the scene's centre [m]), for order by order while it fits `budget` nodes, up to order `most`.
    #[must_use]
    pub(crate) fn new(
        geometry: &Geometry,
        table: &CoefficientTable,
        position: DVec3,
        end: End,
        budget: usize,
        most: Option<u32>,
    ) -> Self {
        let origin = geometry.in_general_position(position, end);
        let most = most.unwrap_or(ORDER_LIMIT);
        Self { position, origin, facets: facets(geometry, table), budget, most }
    }
}

#[derive(Debug, Clone, Copy)]
struct Node {
    reflection: Reflection,
    /// Index of the node before, none for first-order images.
    parent: Option<u32>,
    order: u32,
    /// Range of the sides of its beam.
    sides: (u32, u32),
}

/// A mirror with its outline.
#[derive(Debug, PartialEq)]
struct Facet {
    mirror: SurfaceSide,
    plane: PlaneId,
    /// Convex polygon about the surface, about the scene's centre [m].
    outline: Vec<DVec3>,
    centre: DVec3,
    radius: f64,
}

/// A beam while the tree grows.
struct Grown {
    beam: Beam,
    /// The last reflection of its chain and the plane of its mirror.
    last: Option<(Reflection, PlaneId)>,
    /// The image of the radiator itself.
    of_radiator: DVec3,
    parent: Option<u32>,
    /// Its node, once it has one.
    index: Option<u32>,
}

impl ImageTree {
    /// Grows the tree.
    #[must_use]
    pub(crate) fn new(geometry: &Geometry, seed: Seed) -> Self {
        let Seed { position, origin, budget, most, .. } = seed;
        let mut tree = Self { order: 0, nodes: Vec::new(), sides: Vec::new(), seed };
        let source = Beam::new(origin, &[]);
        let mut last_order =
            vec![Grown { beam: source, of_radiator: position, last: None, parent: None, index: None }];
        while tree.order < most {
            let room_left = budget - tree.nodes.len();
            let Some(mut next) = grow(geometry, &tree.seed.facets, &last_order, room_left) else { break };
            if next.is_empty() {
                // Nothing can follow: every longer chain is complete as well.
                tree.order = most;
                break;
            }
            tree.order += 1;
            for grown in &mut next {
                tree.adopt(grown);
            }
            last_order = next;
        }
        tree
    }

    /// Whether it has grown from `seed`.
    #[must_use]
    pub(crate) fn is_of(&self, seed: &Seed) -> bool {
        self.seed == *seed
    }

    fn adopt(&mut self, grown: &mut Grown) {
        let index = self.nodes.len() as u32;
        let (reflection, _) = grown.last.expect("every beam but the source's has a mirror");
        let first_side = self.sides.len() as u32;
        self.sides.extend(grown.beam.sides());
        let sides = (first_side, self.sides.len() as u32);
        self.nodes.push(Node { reflection, parent: grown.parent, order: self.order, sides });
        grown.index = Some(index);
    }

    /// K.
    #[must_use]
    pub(crate) fn order(&self) -> u32 {
        self.order
    }

    /// Visits the image-source paths of `radiator`, which is at the position of the tree, that reach `receiver`.
    pub(crate) fn visit(
        &self,
        radiator: Radiator<'_>,
        geometry: &Geometry,
        table: &CoefficientTable,
        receiver: DVec3,
        mut found: impl FnMut(&MirrorArrival<'_>),
    ) {
        let mut factor = vec![Lanes::ZERO; lanes_of(table.bands())];
        let ends = Ends {
            radiator,
            origin: self.seed.origin,
            receiver,
            displaced: geometry.in_general_position(receiver, End::Receiver),
        };
        let slack = SHIFTS * thickest(geometry, table);
        for node in self.nodes.iter().filter(|node| self.is_in_beam(node, ends.displaced, slack)) {
            let chain: SmallVec<[&Reflection; 8]> = self.chain(node).collect();
            if let Some((arrival, _)) = chain::arrive(geometry, table, &ends, &chain, &mut factor) {
                found(&arrival);
            }
        }
    }

    /// Number of the images of up to `order` reflections, which come first.
    #[must_use]
    pub(crate) fn count(&self, order: u32) -> usize {
        self.nodes.partition_point(|node| node.order <= order)
    }

    /// The highest order up to which there are no more than `most` images.
    #[must_use]
    pub(crate) fn order_within(&self, most: usize) -> u32 {
        (0..=self.order).take_while(|&order| self.count(order) <= most).last().unwrap_or(0)
    }

    /// Position of image number `image` of the radiator relative to the scene's centre [m], as it is and in general position.
    #[must_use]
    pub(crate) fn positions(&self, image: usize) -> [DVec3; 2] {
        let Reflection { of_radiator, image, .. } = self.nodes[image].reflection;
        [of_radiator, image]
    }

    /// Inward unit normals of the sides of the beam of image number `image`; all sides contain the image.
    #[must_use]
    pub(crate) fn sides(&self, image: usize) -> &[DVec3] {
        let (first, end) = self.nodes[image].sides;
        &self.sides[first as usize..end as usize]
    }

    /// The mirrors of image number `image`, the last one first.
    pub(crate) fn mirrors(&self, image: usize) -> impl Iterator<Item = (SurfaceId, Side)> + '_ {
        self.chain(&self.nodes[image]).map(|Reflection { mirror, .. }| (mirror.surface, mirror.side))
    }

    /// The reflections of a node, the last one first.
    fn chain<'a>(&'a self, leaf: &'a Node) -> impl Iterator<Item = &'a Reflection> {
        let parent = |node: &&'a Node| node.parent.map(|parent| &self.nodes[parent as usize]);
        std::iter::successors(Some(leaf), parent).map(|node| &node.reflection)
    }

    /// Whether nothing but what is `ignored` is on the way from the origin over the chain of image number `image` to `place` [m], in general
    /// position.
    pub(crate) fn is_clear(
        &self,
        geometry: &Geometry,
        image: usize,
        place: DVec3,
        ignored: impl FnMut(&Crossed) -> bool,
    ) -> bool {
        let leaf = &self.nodes[image];
        self.is_in_beam(leaf, place, 0.0)
            && chain::connect(geometry, self.chain(leaf), [self.seed.origin, place], ignored).is_some()
    }

    /// Whether a place is in the beam of a node, `slack` [m] about it included.
    fn is_in_beam(&self, node: &Node, place: DVec3, slack: f64) -> bool {
        let sides = &self.sides[node.sides.0 as usize..node.sides.1 as usize];
        let offset = place - node.reflection.image;
        let outside = -BEAM_SLACK * offset.length() - slack;
        sides.iter().all(|side| side.dot(offset) >= outside)
    }
}

/// Thickness of the thickest partition that sound passes [m].
fn thickest(geometry: &Geometry, table: &CoefficientTable) -> f64 {
    if !table.transmits() {
        return 0.0;
    }
    let surfaces = (0..geometry.surfaces().len() as u32).map(SurfaceId);
    let partitions = surfaces.filter(|&surface| table.mean_row(surface).is_partition);
    partitions.filter_map(|surface| geometry.partition_thickness(surface)).fold(0.0, f64::max)
}

/// Surfaces that mirror anything in any band, from the sides that face air, and interfaces.
fn facets(geometry: &Geometry, table: &CoefficientTable) -> Vec<Facet> {
    let mut facets = Vec::new();
    for (index, surface) in geometry.surfaces().iter().enumerate() {
        let id = SurfaceId(index as u32);
        let is_interface = table.propagation().interface(id, Side::Front).is_some();
        if !is_interface && table.material(surface.material).specular.energy.largest() <= 0.0 {
            continue;
        }
        let corners: Vec<DVec3> = surface
            .triangles
            .iter()
            .flat_map(|&triangle| geometry.mesh().triangles[triangle as usize].corners)
            .map(|corner| geometry.mesh().vertices[corner as usize] - geometry.center())
            .collect();
        let outline = outline(&corners, surface.normal);
        let centre = outline.iter().sum::<DVec3>() / outline.len() as f64;
        let radius = outline.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max);
        let sides = if surface.closed { &[Side::Front][..] } else { &[Side::Front, Side::Back] };
        for &side in sides {
            let mirror = SurfaceSide { surface: id, side };
            facets.push(Facet { mirror, plane: surface.plane, outline: outline.clone(), centre, radius });
        }
    }
    facets
}

/// All beams that follow from those of one order, or none where they are more than `room_left`: far more are told by a sample.
fn grow(geometry: &Geometry, facets: &[Facet], parents: &[Grown], room_left: usize) -> Option<Vec<Grown>> {
    let samples = parents.len() / SAMPLED;
    let sampled = parents.iter().step_by(SAMPLED).take(samples);
    let followed: usize = sampled.map(|parent| follow(geometry, facets, parent).len()).sum();
    if samples >= SAMPLED && followed * SAMPLED > FAR_MORE * room_left {
        return None;
    }
    let mut next = Vec::new();
    for parents in parents.chunks(AT_ONCE) {
        let beams: Vec<Vec<Grown>> =
            parents.par_iter().map(|parent| follow(geometry, facets, parent)).collect();
        next.extend(beams.into_iter().flatten());
        if next.len() > room_left {
            return None;
        }
    }
    Some(next)
}

/// The beams that follow from one.
fn follow(geometry: &Geometry, facets: &[Facet], parent: &Grown) -> Vec<Grown> {
    let mut lit = Polygon::default();
    let mut beams = Vec::new();
    for facet in facets {
        if is_lit(geometry, parent, facet, &mut lit) {
            let reflection = Reflection::new(geometry, facet.mirror, [parent.beam.apex, parent.of_radiator]);
            beams.push(Grown {
                beam: Beam::new(reflection.image, &lit.corners),
                of_radiator: reflection.of_radiator,
                last: Some((reflection, facet.plane)),
                parent: parent.index,
                index: None,
            });
        }
    }
    beams
}

/// Whether the beam of `parent` lights something of `facet`, and what: its part `lit`.
fn is_lit(geometry: &Geometry, parent: &Grown, facet: &Facet, lit: &mut Polygon) -> bool {
    if facet.mirror.height(geometry, parent.beam.apex) <= 0.0
        || parent.last.as_ref().is_some_and(|(_, plane)| *plane == facet.plane)
        || parent.beam.misses(facet.centre, facet.radius)
    {
        return false;
    }
    lit.set(&facet.outline);
    if let Some((last, _)) = &parent.last {
        let tolerance = f64::from(geometry.resolution());
        lit.clip(|corner| last.mirror.height(geometry, corner) - TOUCHING * tolerance);
        parent.beam.clip(lit, tolerance);
    }
    !lit.corners.is_empty()
}
