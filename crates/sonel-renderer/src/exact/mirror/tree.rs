//! Images of a source over the planar surfaces of any geometry, validated at every receiver.
//!
//! A node is an image source with its sequence of reflecting surfaces. A sequence is omitted only where it can carry no
//! energy: no band
//! reflects there as a mirror, the surface shows its solid side to the image, or the beam of the chain before it misses
//! the surface. What stands in the way is found out at every receiver.

use std::collections::HashMap;

use glam::DVec3;
use sonel_geometry::{Departure, Geometry, PlaneId, Side, SurfaceId};
use sonel_map::{CoefficientTable, Lanes, lanes_of};

use super::beam::{Beam, clip, hull};
use super::{Image, MirrorArrival, Radiator};
use crate::partition::Partitions;

/// Asked whether a surface lets a straight way through.
type Passes<'a> = &'a mut dyn FnMut(SurfaceId) -> bool;

/// No chain is longer, however few the surfaces.
const ORDER_LIMIT: u32 = 24;

/// Within so many lifts of the place where two mirrors meet a ray does not tell which of them is met first; their planes do.
pub(crate) const IN_CORNER: f64 = 16.0;

/// How far outside its beam a chain is still tried [rad]: beams are cut a resolution inside the surfaces that they light.
const BEAM_SLACK: f64 = 1e-4;

/// Part of the scene's extent within which rounding of `f64` does not tell on which side of a plane an image path is.
const SAME_PLACE: f64 = 1e-12;

/// Image sources up to the order K that fits the budget.
#[derive(Debug)]
pub struct ImageTree<'a> {
    order: u32,
    nodes: Vec<Node>,
    /// Inward normals of the beams' sides.
    sides: Vec<DVec3>,
    /// The node that follows another over a mirror.
    children: HashMap<(Option<u32>, Mirror), u32>,
    radiator: Radiator<'a>,
    lanes: usize,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    image: DVec3,
    mirror: Mirror,
    /// Index of the node before, none for first-order images.
    parent: Option<u32>,
    order: u32,
    /// Range of the sides of its beam.
    sides: (u32, u32),
}

/// A surface seen from one side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Mirror {
    surface: SurfaceId,
    side: Side,
}

/// A mirror with its outline.
#[derive(Debug)]
struct Facet {
    mirror: Mirror,
    plane: PlaneId,
    /// Convex hull of the surface, about the scene's centre [m].
    outline: Vec<DVec3>,
    centre: DVec3,
    radius: f64,
}

/// A beam while the tree grows.
struct Grown {
    beam: Beam,
    /// The last mirror of its chain and that mirror's plane.
    last: Option<(Mirror, PlaneId)>,
    parent: Option<u32>,
    /// Its node, once it has one.
    index: Option<u32>,
}

impl<'t> ImageTree<'t> {
    /// Grows the tree order by order while it fits `budget` nodes, up to order `most`.
    #[must_use]
    pub fn new(
        geometry: &Geometry,
        table: &CoefficientTable,
        radiator: Radiator<'t>,
        budget: usize,
        most: Option<u32>,
    ) -> Self {
        let most = most.unwrap_or(ORDER_LIMIT);
        let facets = facets(geometry, table);
        let mut tree = Self {
            order: 0,
            nodes: Vec::new(),
            sides: Vec::new(),
            children: HashMap::new(),
            radiator,
            lanes: lanes_of(table.bands()),
        };
        let source = Beam::new(radiator.position, &[]);
        let mut last_order = vec![Grown { beam: source, last: None, parent: None, index: None }];
        while tree.order < most {
            let Some(mut next) = grow(geometry, &facets, &last_order, budget - tree.nodes.len()) else {
                break;
            };
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

    fn adopt(&mut self, grown: &mut Grown) {
        let index = self.nodes.len() as u32;
        let (mirror, _) = grown.last.expect("every beam but the source's has a mirror");
        let first_side = self.sides.len() as u32;
        self.sides.extend(grown.beam.sides());
        let sides = (first_side, self.sides.len() as u32);
        self.nodes.push(Node {
            image: grown.beam.apex,
            mirror,
            parent: grown.parent,
            order: self.order,
            sides,
        });
        self.children.insert((grown.parent, mirror), index);
        grown.index = Some(index);
    }

    /// K.
    #[must_use]
    pub fn order(&self) -> u32 {
        self.order
    }

    /// Visits the image-source paths that reach `receiver`.
    pub fn visit(
        &self,
        geometry: &Geometry,
        table: &CoefficientTable,
        receiver: DVec3,
        mut found: impl FnMut(&MirrorArrival<'_>),
    ) {
        let mut factor = vec![[0.0; 4]; self.lanes];
        for node in &self.nodes {
            let departure = Departure::free(receiver.as_vec3());
            let mut passed = Partitions::default();
            let mut pass = |surface| passed.pass(geometry, table, surface);
            let passes: Option<Passes<'_>> = if table.transmits() { Some(&mut pass) } else { None };
            let Some(leaving) = self.validate(geometry, node, receiver, departure, passes) else {
                continue;
            };
            self.mirror(table, node, node.image - receiver, &mut factor);
            passed.attenuate(geometry, table, &mut factor);
            self.radiator.towards(leaving).weigh(&mut factor);
            let offset = node.image - receiver;
            let length = offset.length();
            let planes = self.chain(node).map(|node| geometry.surface(node.mirror.surface).plane).collect();
            let towards = offset / length;
            let through = passed.materials(geometry);
            found(&MirrorArrival { length, towards, order: node.order, planes, factor: &factor, through });
        }
    }

    /// ∏ (1−α)(1−s) along the chain of `leaf` for sound that reaches its last mirror from `towards`, seen from the receiver.
    fn mirror(&self, table: &CoefficientTable, leaf: &Node, mut towards: DVec3, factor: &mut [Lanes]) {
        factor.fill([1.0; 4]);
        for node in self.chain(leaf) {
            table.mirror(node.mirror.surface, towards, factor);
            if table.is_angular() {
                let normal = table.normal(node.mirror.surface);
                towards -= 2.0 * towards.dot(normal) * normal;
            }
        }
    }

    /// The same where no angle matters.
    fn specular_factor(
        &self,
        geometry: &Geometry,
        table: &CoefficientTable,
        leaf: &Node,
        factor: &mut [Lanes],
    ) {
        factor.fill([1.0; 4]);
        for node in self.chain(leaf) {
            let material = geometry.surface(node.mirror.surface).material;
            for (factor, specular) in factor.iter_mut().zip(&table.material(material).specular.energy) {
                for lane in 0..4 {
                    factor[lane] *= specular[lane];
                }
            }
        }
    }

    /// Number of the images of up to `order` reflections, which come first.
    #[must_use]
    pub fn count(&self, order: u32) -> usize {
        self.nodes.partition_point(|node| node.order <= order)
    }

    /// The highest order up to which there are no more than `most` images.
    #[must_use]
    pub fn order_within(&self, most: usize) -> u32 {
        (0..=self.order).take_while(|&order| self.count(order) <= most).last().unwrap_or(0)
    }

    /// Where image number `image` is, about the scene's centre [m].
    #[must_use]
    pub fn position(&self, image: usize) -> DVec3 {
        self.nodes[image].image
    }

    /// Inward unit normals of the sides of the beam of image number `image`; all sides contain the image.
    #[must_use]
    pub fn sides(&self, image: usize) -> &[DVec3] {
        let (first, end) = self.nodes[image].sides;
        &self.sides[first as usize..end as usize]
    }

    /// The mirrors of image number `image`, the last one first.
    pub fn mirrors(&self, image: usize) -> impl Iterator<Item = (SurfaceId, Side)> + '_ {
        self.chain(&self.nodes[image]).map(|node| (node.mirror.surface, node.mirror.side))
    }

    /// A node and those before it.
    fn chain<'a>(&'a self, leaf: &'a Node) -> impl Iterator<Item = &'a Node> {
        let parent = |node: &&'a Node| node.parent.map(|parent| &self.nodes[parent as usize]);
        std::iter::successors(Some(leaf), parent)
    }

    /// All images with their orders and ∏ (1−α)(1−s).
    #[must_use]
    pub fn images(&self, geometry: &Geometry, table: &CoefficientTable) -> Vec<Image> {
        self.nodes
            .iter()
            .map(|node| {
                let mut factor = vec![[0.0; 4]; self.lanes];
                self.specular_factor(geometry, table, node, &mut factor);
                Image { position: node.image, order: node.order, signs: DVec3::ONE, factor }
            })
            .collect()
    }

    /// The direction in which the origin of the tree sees `point`, left by `departure`, over the chain of image number `image` [m];
    /// [`None`] where something is in the way.
    #[must_use]
    pub fn connect(
        &self,
        geometry: &Geometry,
        image: usize,
        point: DVec3,
        departure: Departure,
    ) -> Option<DVec3> {
        self.validate(geometry, &self.nodes[image], point, departure, None)
    }

    /// The longest chain along which the mirror path from the origin in `direction` runs, and all its beginnings: image
    /// numbers in ascending order of reflections.
    pub fn follow(&self, geometry: &Geometry, direction: DVec3, mut found: impl FnMut(usize)) {
        let (mut departure, mut direction) =
            (Departure::free(self.radiator.position.as_vec3()), direction.as_vec3());
        let mut parent = None;
        for _ in 0..self.order {
            let Some(hit) = geometry.closest_hit(departure, direction) else { return };
            let mirror = Mirror { surface: hit.surface, side: hit.side };
            let Some(&index) = self.children.get(&(parent, mirror)) else { return };
            found(index as usize);
            parent = Some(index);
            let normal = geometry.surface(hit.surface).normal.as_vec3();
            direction = (direction - 2.0 * direction.dot(normal) * normal).normalize();
            departure = geometry.leave(hit.position, hit.surface, hit.side);
        }
    }

    /// Follows the chain backwards from `from`, which is left by `departure`. Returns the offset from the origin of the
    /// tree to the first reflection where nothing is in the way but what `passes`; none where nothing does.
    fn validate(
        &self,
        geometry: &Geometry,
        leaf: &Node,
        from: DVec3,
        departure: Departure,
        mut passes: Option<Passes<'_>>,
    ) -> Option<DVec3> {
        let sides = &self.sides[leaf.sides.0 as usize..leaf.sides.1 as usize];
        let offset = from - leaf.image;
        let outside = -BEAM_SLACK * offset.length();
        if sides.iter().any(|side| side.dot(offset) < outside) {
            return None;
        }
        let (mut point, mut departure) = (from, departure);
        let corner = IN_CORNER * f64::from(geometry.lift());
        let mut node = leaf;
        let mut last = None;
        let mut is_in_corner = false;
        loop {
            let Mirror { surface, side } = node.mirror;
            let reflection = crossing(geometry, node.mirror, last, point, node.image)?;
            last = Some(node.mirror);
            let parent = node.parent.map(|parent| &self.nodes[parent as usize]);
            let next = parent.and_then(|next| crossing(geometry, next.mirror, last, reflection, next.image));
            let goes_to_corner = next.is_some_and(|next| next.distance(reflection) <= corner);
            // In a corner the origin is lifted off one mirror after the other.
            let mut position = departure.origin;
            if !is_in_corner {
                let direction = (node.image - point).normalize().as_vec3();
                position = loop {
                    let hit = geometry.closest_hit(departure, direction)?;
                    let met = Mirror { surface: hit.surface, side: hit.side };
                    let is_next = || goes_to_corner && parent.is_some_and(|next| met == next.mirror);
                    if met == node.mirror || is_next() {
                        break hit.position;
                    }
                    if !passes.as_mut().is_some_and(|passes| passes(hit.surface)) {
                        return None;
                    }
                    departure = geometry.pass(&hit, direction);
                };
            }
            departure = geometry.leave(position, surface, side);
            point = reflection;
            is_in_corner = goes_to_corner;
            match parent {
                Some(parent) => node = parent,
                None => break,
            }
        }
        let to = self.radiator.position.as_vec3();
        let reaches = match passes {
            Some(passes) => geometry.reaches(departure, to, passes),
            None => !geometry.is_blocked(departure, to),
        };
        let open = reaches && self.stays_aside(geometry, leaf, from);
        open.then_some(point - self.radiator.position)
    }

    /// Whether the chain of `leaf` from `from` stays on its side of everything that stands where it is mirrored.
    fn stays_aside(&self, geometry: &Geometry, leaf: &Node, from: DVec3) -> bool {
        let mut points = vec![from];
        let mut planes = Vec::new();
        let mut last = None;
        for node in self.chain(leaf) {
            let before = points[points.len() - 1];
            let Some(point) = crossing(geometry, node.mirror, last, before, node.image) else {
                return false;
            };
            last = Some(node.mirror);
            points.push(point);
            planes.push(geometry.surface(node.mirror.surface).plane);
        }
        points.push(self.radiator.position);
        // Where mirrors meet, the path turns at all of them at once.
        let corner = IN_CORNER * f64::from(geometry.lift());
        (1..=planes.len()).all(|turn| {
            let at = points[turn];
            let beside = |&other: &usize| points[other].distance(at) > corner;
            let first = (0..turn).rev().find(beside).unwrap_or(0);
            let last = (turn..points.len()).find(beside).unwrap_or(points.len() - 1);
            geometry.stays_aside(points[first], at, points[last], &planes[first..last - 1])
        })
    }
}

/// Surfaces that mirror anything in any band, from the sides that face air.
fn facets(geometry: &Geometry, table: &CoefficientTable) -> Vec<Facet> {
    let mut facets = Vec::new();
    for (index, surface) in geometry.surfaces().iter().enumerate() {
        let specular = &table.material(surface.material).specular.energy;
        if specular.iter().flatten().all(|&factor| factor <= 0.0) {
            continue;
        }
        let corners: Vec<DVec3> = surface
            .triangles
            .iter()
            .flat_map(|&triangle| geometry.mesh().triangles[triangle as usize].corners)
            .map(|corner| geometry.mesh().vertices[corner as usize] - geometry.center())
            .collect();
        let outline = hull(&corners, surface.normal);
        let centre = outline.iter().sum::<DVec3>() / outline.len() as f64;
        let radius = outline.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max);
        let sides = if surface.closed { &[Side::Front][..] } else { &[Side::Front, Side::Back] };
        for &side in sides {
            let mirror = Mirror { surface: SurfaceId(index as u32), side };
            facets.push(Facet { mirror, plane: surface.plane, outline: outline.clone(), centre, radius });
        }
    }
    facets
}

/// Signed distance of `point` (about the scene's centre) above the mirror's plane, positive on its side [m].
fn height(geometry: &Geometry, mirror: Mirror, point: DVec3) -> f64 {
    let surface = geometry.surface(mirror.surface);
    let offset = surface.offset - surface.normal.dot(geometry.center());
    (surface.normal.dot(point) - offset) * mirror.side.sign()
}

fn reflected(geometry: &Geometry, mirror: Mirror, point: DVec3) -> DVec3 {
    let normal = geometry.surface(mirror.surface).normal * mirror.side.sign();
    point - 2.0 * height(geometry, mirror, point) * normal
}

/// Where the line from `point`, on the mirror's side, to `image`, behind it, crosses its plane; `last` is the mirror on which
/// `point` lies.
///
/// A line through the corner of two mirrors meets both in one point, and image-source paths over them in either order would do, or
/// neither: of the two it is the one in ascending order of surfaces.
fn crossing(
    geometry: &Geometry,
    mirror: Mirror,
    last: Option<Mirror>,
    point: DVec3,
    image: DVec3,
) -> Option<DVec3> {
    let (above, below) = (height(geometry, mirror, point), height(geometry, mirror, image));
    let same_place = SAME_PLACE * f64::from(geometry.extent());
    let is_above = match last {
        Some(last) if above.abs() <= same_place => last.surface < mirror.surface,
        _ => above > 0.0,
    };
    (is_above && below < 0.0).then(|| point + (image - point) * (above / (above - below)))
}

/// All beams that follow from those of one order, or none where they are more than `room_left`.
fn grow(geometry: &Geometry, facets: &[Facet], parents: &[Grown], room_left: usize) -> Option<Vec<Grown>> {
    let mut next = Vec::new();
    for parent in parents {
        for facet in facets {
            let Some(aperture) = lit_part(geometry, parent, facet) else { continue };
            if next.len() == room_left {
                return None;
            }
            let image = reflected(geometry, facet.mirror, parent.beam.apex);
            let beam = Beam::new(image, &aperture);
            next.push(Grown {
                beam,
                last: Some((facet.mirror, facet.plane)),
                parent: parent.index,
                index: None,
            });
        }
    }
    Some(next)
}

/// The part of `facet` that the beam of `parent` lights; none where it lights nothing.
fn lit_part(geometry: &Geometry, parent: &Grown, facet: &Facet) -> Option<Vec<DVec3>> {
    if height(geometry, facet.mirror, parent.beam.apex) <= 0.0 {
        return None;
    }
    let Some((last, plane)) = parent.last else { return Some(facet.outline.clone()) };
    if plane == facet.plane || parent.beam.misses(facet.centre, facet.radius) {
        return None;
    }
    let tolerance = f64::from(geometry.resolution());
    let above = clip(&facet.outline, |corner| height(geometry, last, corner) - tolerance);
    let rest = parent.beam.clip(above, tolerance);
    (!rest.is_empty()).then_some(rest)
}
