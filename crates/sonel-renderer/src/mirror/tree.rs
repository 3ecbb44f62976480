//! Images of a source over the planar surfaces of any geometry, validated at every receiver.
//!
//! A node is an image reached over a chain of surfaces. A chain is left out only where it can carry nothing: no band
//! reflects there as a mirror, the surface shows its solid side to the image, or it lies wholly behind the last mirror.

use std::collections::HashMap;

use glam::DVec3;
use sonel_geometry::{Departure, Geometry, Side, SurfaceId};
use sonel_map::{CoefficientTable, Lanes, lanes_of};

use super::{Image, MirrorArrival, Radiator};

/// Nodes of one source: what a receiver can afford to validate in about a millisecond.
const NODE_LIMIT: usize = 20_000;
/// Nodes of one source when the order was asked for: some hundred megabytes.
const ASKED_NODE_LIMIT: usize = 2_000_000;
/// No chain is longer, however few the surfaces.
const ORDER_LIMIT: u32 = 24;

/// Image sources up to the order K that fits the budget.
#[derive(Debug)]
pub struct ImageTree {
    order: u32,
    nodes: Vec<Node>,
    /// The node that follows another over a mirror.
    children: HashMap<(Option<u32>, Mirror), u32>,
    radiator: Radiator,
    lanes: usize,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    image: DVec3,
    mirror: Mirror,
    /// Index of the node before, none for first-order images.
    parent: Option<u32>,
    order: u32,
}

/// A surface seen from one side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Mirror {
    surface: SurfaceId,
    side: Side,
}

impl ImageTree {
    /// Grows the tree order by order while it fits the budget; `most` limits K further.
    #[must_use]
    pub fn new(geometry: &Geometry, table: &CoefficientTable, radiator: Radiator, most: Option<u32>) -> Self {
        let mirrors = mirrors(geometry, table);
        let (mut nodes, mut order): (Vec<Node>, u32) = (Vec::new(), 0);
        let mut last_order = 0..0;
        while order < most.unwrap_or(ORDER_LIMIT) {
            let room_left = if most.is_some() { ASKED_NODE_LIMIT } else { NODE_LIMIT } - nodes.len();
            let parents: Vec<(Option<u32>, DVec3)> = if order == 0 {
                vec![(None, radiator.position)]
            } else {
                last_order.clone().map(|index: usize| (Some(index as u32), nodes[index].image)).collect()
            };
            let Some(next) = grow(geometry, &mirrors, &nodes, &parents, order + 1, room_left) else { break };
            order += 1;
            if next.is_empty() {
                // Nothing can follow: every longer chain is complete as well.
                order = most.unwrap_or(ORDER_LIMIT);
                break;
            }
            last_order = nodes.len()..nodes.len() + next.len();
            nodes.extend(next);
        }
        let children = nodes
            .iter()
            .enumerate()
            .map(|(index, node)| ((node.parent, node.mirror), index as u32))
            .collect();
        Self { order, nodes, children, radiator, lanes: lanes_of(table.bands()) }
    }

    /// K.
    #[must_use]
    pub fn order(&self) -> u32 {
        self.order
    }

    /// Visits the chains that reach `receiver`.
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
            let Some(leaving) = self.validate(geometry, node, receiver, departure) else { continue };
            self.specular_factor(geometry, table, node, &mut factor);
            let directivity = self.radiator.factor(leaving);
            for value in factor.iter_mut().flatten() {
                *value *= directivity;
            }
            let offset = node.image - receiver;
            let length = offset.length();
            found(&MirrorArrival { length, towards: offset / length, order: node.order, factor: &factor });
        }
    }

    /// ∏ (1−α)(1−s) along the chain of `leaf`, per band.
    fn specular_factor(
        &self,
        geometry: &Geometry,
        table: &CoefficientTable,
        leaf: &Node,
        factor: &mut [Lanes],
    ) {
        factor.fill([1.0; 4]);
        let mut link = Some(leaf);
        while let Some(node) = link {
            let material = geometry.surface(node.mirror.surface).material;
            for (factor, specular) in factor.iter_mut().zip(&table.material(material).specular.energy) {
                for lane in 0..4 {
                    factor[lane] *= specular[lane];
                }
            }
            link = node.parent.map(|parent| &self.nodes[parent as usize]);
        }
    }

    /// All images with their orders and ∏ (1−α)(1−s).
    #[must_use]
    pub fn images(&self, geometry: &Geometry, table: &CoefficientTable) -> Vec<Image> {
        self.nodes
            .iter()
            .map(|node| {
                let mut factor = vec![[0.0; 4]; self.lanes];
                self.specular_factor(geometry, table, node, &mut factor);
                Image { position: node.image, order: node.order, factor }
            })
            .collect()
    }

    /// Whether the chain of image number `image` leads from `point`, left by `departure`, to the origin of the tree.
    #[must_use]
    pub fn connects(&self, geometry: &Geometry, image: usize, point: DVec3, departure: Departure) -> bool {
        self.validate(geometry, &self.nodes[image], point, departure).is_some()
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
    /// tree to the first reflection where the whole path is clear.
    fn validate(&self, geometry: &Geometry, leaf: &Node, from: DVec3, departure: Departure) -> Option<DVec3> {
        let (mut point, mut departure) = (from, departure);
        let mut node = leaf;
        loop {
            let Mirror { surface, side } = node.mirror;
            let reflection = crossing(geometry, node.mirror, point, node.image)?;
            let direction = (node.image - point).normalize().as_vec3();
            let hit = geometry.closest_hit(departure, direction)?;
            if hit.surface != surface || hit.side != side {
                return None;
            }
            departure = geometry.leave(hit.position, surface, side);
            point = reflection;
            match node.parent {
                Some(parent) => node = &self.nodes[parent as usize],
                None => break,
            }
        }
        let blocked = geometry.is_blocked(departure, self.radiator.position.as_vec3());
        (!blocked).then_some(point - self.radiator.position)
    }
}

/// Surfaces that mirror anything in any band, from the sides that face air.
fn mirrors(geometry: &Geometry, table: &CoefficientTable) -> Vec<Mirror> {
    let mut mirrors = Vec::new();
    for (index, surface) in geometry.surfaces().iter().enumerate() {
        let specular = &table.material(surface.material).specular.energy;
        if specular.iter().flatten().all(|&factor| factor <= 0.0) {
            continue;
        }
        let surface_id = SurfaceId(index as u32);
        mirrors.push(Mirror { surface: surface_id, side: Side::Front });
        if !surface.closed {
            mirrors.push(Mirror { surface: surface_id, side: Side::Back });
        }
    }
    mirrors
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

/// Where the line from `point`, on the mirror's side, to `image`, behind it, crosses its plane.
fn crossing(geometry: &Geometry, mirror: Mirror, point: DVec3, image: DVec3) -> Option<DVec3> {
    let (above, below) = (height(geometry, mirror, point), height(geometry, mirror, image));
    (above > 0.0 && below < 0.0).then(|| point + (image - point) * (above / (above - below)))
}

/// All images one order further, or none where they are more than `room_left`.
fn grow(
    geometry: &Geometry,
    mirrors: &[Mirror],
    nodes: &[Node],
    parents: &[(Option<u32>, DVec3)],
    order: u32,
    room_left: usize,
) -> Option<Vec<Node>> {
    let mut next = Vec::new();
    for &(parent, image) in parents {
        let last = parent.map(|index| nodes[index as usize].mirror);
        for &mirror in mirrors {
            if last.is_some_and(|last| !can_follow(geometry, last, mirror))
                || height(geometry, mirror, image) <= 0.0
            {
                continue;
            }
            if next.len() == room_left {
                return None;
            }
            next.push(Node { image: reflected(geometry, mirror, image), mirror, parent, order });
        }
    }
    Some(next)
}

/// Whether sound leaving `last` can meet `mirror`: another plane, some of it in front of `last`.
fn can_follow(geometry: &Geometry, last: Mirror, mirror: Mirror) -> bool {
    let (before, after) = (geometry.surface(last.surface), geometry.surface(mirror.surface));
    let tolerance = f64::from(geometry.resolution());
    before.plane != after.plane
        && after.triangles.iter().any(|&triangle| {
            geometry.mesh().triangles[triangle as usize].corners.iter().any(|&corner| {
                let corner = geometry.mesh().vertices[corner as usize] - geometry.center();
                height(geometry, last, corner) > tolerance
            })
        })
}
