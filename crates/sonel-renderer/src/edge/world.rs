//! The edges of the room as a base path meets them: for the direct path as they are; for one that planes mirror, unfolded: those
//! behind the last plane with the images of those before it.
//!
//! In the unfolded room the base path is straight, from the image of the source to the receiver, and all ways over edges that are
//! mirrored as often are ways over the edges of one of its copies: source, mirror, edge, receiver over one before the plane; source, edge,
//! mirror, receiver over an image. A face that stands on the mirror goes on in its image, and an edge that ends there does:
//! source, edge, mirror, another edge or the same, receiver is a way over two edges of the doubled face.

mod unfolding;

use std::sync::Arc;

use glam::DVec3;
use sonel_diffraction::Wedge;
use sonel_diffraction::face::Orders;
use sonel_geometry::Geometry;

use super::apart::{Apart, NEARLY, Shore, across, apart, hide};
use super::chain::Chain;
use super::mirror::{PERPENDICULAR, PlaneMirror};
use super::passage::{Border, Passage, faces, passages};
use super::sight::{CROWDED, borders, clear, hiders};
use super::view::joined;
use unfolding::Unfolding;

/// Resolutions within which an end lies in the mirror.
const IN_MIRROR: f64 = 8.0;

/// An edge of the room, or the image of one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RoomEdge {
    /// About the scene's centre.
    pub wedge: Wedge,
    /// The plane of each face, and on which side of its normal the air is.
    pub faces: [PlaneMirror; 2],
}

/// The room as it is met after some of the mirrors and before the others.
#[derive(Debug, Clone, Default)]
pub(crate) struct Copy {
    /// Mirrors between the source and an edge, as met from the source.
    pub before: Chain,
    /// Mirrors between the receiver and an edge, as met from the receiver.
    pub behind: Chain,
    /// Mirrors that part it from other copies.
    pub beside: Vec<PlaneMirror>,
}

/// All edges that a base path meets.
pub(crate) struct World {
    /// The mirrors that show the source: none for the direct path.
    pub shown: Chain,
    /// The mirror that is met both before and after edges, by what is part of the direct path's field.
    pub behind: Option<PlaneMirror>,
    pub edges: Vec<RoomEdge>,
    /// The part of each edge that is met alone [m].
    pub alone: Vec<[f64; 2]>,
    /// Edges that are passed one after the other.
    pub passages: Vec<Passage>,
    /// The same where nothing but air joins them.
    pub apart: Vec<Apart>,
    /// The borders of each face.
    pub faces: Vec<Vec<Border>>,
    /// Planes whose images of its base path are followed among those that this one completes.
    pub shows: Vec<PlaneMirror>,
    /// Which passages there are; where those over two edges are left out what comes over one fades to nothing where it would go on over a
    /// second one.
    pub orders: Orders,
    /// For each edge those apart that it sees, which hide it all at once.
    across: Vec<Vec<usize>>,
    /// Whether it has only the edges near a path, so that what comes over them fades to nothing far from it.
    pub is_near: bool,
    /// How much longer a way past an edge that may hide it is over that than straight on where nothing of it is lost [m].
    pub clear: f64,
    /// For each edge those that hide it all at once, where nothing goes over both; else nothing.
    pub hiders: Vec<Vec<usize>>,
    /// The edges that its mirrors end at.
    pub borders: Vec<Wedge>,
    /// For each edge those of them that hide it all at once, where nothing goes over both.
    pub hidden_by: Vec<Arc<[Wedge]>>,
    copies: Vec<Copy>,
    /// Up to where each edge is in which copy [m].
    parts: Vec<Vec<(f64, usize)>>,
}

impl World {
    /// The room of `edges` as it is.
    #[must_use]
    pub fn new(geometry: &Geometry, edges: Vec<RoomEdge>) -> Self {
        let faces = faces(&edges);
        let (passages, orders) = passages(&edges, &faces);
        let here = Copy::default();
        let apart = apart(&edges, &faces, &passages, |places| {
            joined(geometry, None, places.map(|(_, place, into_air)| (&here, place, into_air)))
        });
        let hiders = hiders(&edges, &faces, apart.as_ref());
        let clear = clear(apart.as_ref(), 0);
        let whole = Self::with_ways(edges, passages, orders, apart.unwrap_or_default().ways, faces);
        Self { hiders, clear, ..whole }.hiding()
    }

    fn with_ways(
        edges: Vec<RoomEdge>,
        passages: Vec<Passage>,
        orders: Orders,
        apart: Vec<Apart>,
        faces: Vec<Vec<Border>>,
    ) -> Self {
        Self {
            across: across(edges.len(), &apart),
            shown: Chain::default(),
            behind: None,
            alone: edges.iter().map(|edge| [0.0, edge.wedge.length()]).collect(),
            parts: vec![vec![(f64::INFINITY, 0)]; edges.len()],
            edges,
            passages,
            apart,
            faces,
            shows: Vec::new(),
            orders,
            is_near: false,
            clear: CROWDED,
            hiders: Vec::new(),
            borders: Vec::new(),
            hidden_by: Vec::new(),
            copies: vec![Copy::default()],
        }
    }

    /// The `room` unfolded about the mirrors of `shown`, if there is any edge before them.
    #[must_use]
    pub fn about(geometry: &Geometry, room: &Self, shown: Chain) -> Option<Self> {
        let (world, originals) = Self::unfolded(geometry, &room.edges, shown);
        let borders = borders(&world.shown, &room.edges);
        let is_one = world.shown.order() == 1;
        let goes_on = |passed: &[usize], border| is_one && room.goes_on(passed, border);
        Some(world.ending_at(&borders, &originals, goes_on)).filter(|world| !world.edges.is_empty())
    }

    /// What of the room of `real` edges is before the mirrors of `shown`, and its images; and of which of these edges.
    fn unfolded(geometry: &Geometry, real: &[RoomEdge], shown: Chain) -> (Self, Vec<usize>) {
        let unfolding = Unfolding::of(geometry, real, &shown);
        let (passages, orders, apart, faces) = unfolding.ways();
        let originals = unfolding.originals();
        let Unfolding { edges, parts, copies, .. } = unfolding;
        let hiders = hiders(&edges, &faces, apart.as_ref());
        let clear = clear(apart.as_ref(), shown.order());
        let whole = Self::with_ways(edges, passages, orders, apart.unwrap_or_default().ways, faces);
        (Self { shown, copies, parts, hiders, clear, ..whole }.hiding(), originals)
    }

    /// The same where `real` are the edges near a path, each in those copies of the room that `in_copies` says, and met alone.
    #[must_use]
    pub fn near(geometry: &Geometry, real: &[RoomEdge], in_copies: &[Vec<bool>], shown: Chain) -> Self {
        let unfolding = Unfolding::of(geometry, real, &shown);
        let is_near = unfolding.holds(in_copies);
        let Unfolding { edges, parts, copies, .. } = unfolding;
        let alone = Orders { most: 1, along_a_face: false };
        let whole = Self::with_ways(edges, Vec::new(), alone, Vec::new(), Vec::new());
        let part = |(part, is_near): (&[f64; 2], bool)| if is_near { *part } else { [0.0; 2] };
        let alone = whole.alone.iter().zip(is_near).map(part).collect();
        let hiders = hiders(&whole.edges, &[], None);
        Self { shown, alone, hiders, copies, parts, is_near: true, ..whole }
    }

    /// The copies of a room that is unfolded about the mirrors of `shown`.
    #[must_use]
    pub fn copies(shown: &Chain) -> Vec<Copy> {
        unfolding::copies(shown).0
    }

    /// What the image in `mirror` adds to the `room` for a path that meets the mirror before the first and after the last edge: the ways that
    /// go over an image, and, to be taken away, those over edges of the room that go on in theirs.
    #[must_use]
    pub fn behind(geometry: &Geometry, room: &Self, mirror: &PlaneMirror) -> [Self; 2] {
        let unfolding = Unfolding::behind(geometry, &room.edges, mirror);
        let goes_on: Vec<Option<bool>> = (0..room.edges.len()).map(|edge| unfolding.goes_on(edge)).collect();
        let (mut passages, orders, apart, faces) = unfolding.ways();
        let hiders = hiders(&unfolding.edges, &faces, apart.as_ref());
        let clear = clear(apart.as_ref(), 1);
        let mut apart = apart.unwrap_or_default().ways;
        let across = across(unfolding.edges.len(), &apart);
        let originals = unfolding.originals();
        let Unfolding { edges, parts, copies, .. } = unfolding;
        let alone: Vec<[f64; 2]> = parts.iter().map(|parts| stretch(parts, 1)).collect();
        let is_image = |edge: usize| parts[edge].iter().any(|&(_, copy)| copy == 1);
        passages.retain(|way| way.edges.iter().any(|passed| is_image(passed.edge)));
        apart.retain(|way| way.edges().into_iter().any(is_image));
        let ways = Self::with_ways(edges, passages, orders, apart, faces);
        let with_images = Self { behind: Some(*mirror), alone, copies, parts, hiders, clear, across, ..ways };
        let borders = borders(&Chain::of(&[*mirror]), &room.edges);
        let with_images = with_images.hiding().ending_at(&borders, &originals, |_, _| false);
        let is_in_both = |passed: &[usize]| {
            let edges = || passed.iter().map(|&edge| goes_on[edge]);
            edges().all(|edge| edge.is_some()) && edges().any(|edge| edge == Some(true))
        };
        let passed = |way: &Passage| way.edges.iter().map(|passed| passed.edge).collect::<Vec<usize>>();
        let passages = room.passages.iter().filter(|way| is_in_both(&passed(way))).cloned().collect();
        let apart = room.apart.iter().filter(|way| is_in_both(&way.edges())).cloned().collect();
        let alone = vec![[0.0; 2]; room.edges.len()];
        let taken = Self::with_ways(room.edges.clone(), passages, room.orders, apart, room.faces.clone());
        [with_images, Self { alone, hiders: room.hiders.clone(), clear: room.clear, ..taken }]
    }

    /// Tells edges and passages which of the `borders` of the mirrors hide them: all over which what is passed does not go on. The edges that
    /// are, as `originals` of the room, are told from the border on.
    fn ending_at(
        mut self,
        borders: &[(usize, Wedge)],
        originals: &[usize],
        goes_on: impl Fn(&[usize], usize) -> bool,
    ) -> Self {
        let hiding = |passed: &[usize]| -> Arc<[Wedge]> {
            let of_room: Vec<usize> = passed.iter().map(|&edge| originals[edge]).collect();
            let own = &self.edges[passed[0]].wedge;
            let hides =
                |border: &&(usize, Wedge)| own.sine_to(&border.1) <= NEARLY && !goes_on(&of_room, border.0);
            borders.iter().filter(hides).map(|border| border.1).collect()
        };
        let hidden_by: Vec<Arc<[Wedge]>> = (0..self.edges.len()).map(|edge| hiding(&[edge])).collect();
        let of_passage = |passage: &Passage| {
            let passed: Vec<usize> = passage.edges.iter().map(|passed| passed.edge).collect();
            let back: Vec<usize> = passed.iter().rev().copied().collect();
            [hiding(&passed), hiding(&back)]
        };
        let of_passages: Vec<[Arc<[Wedge]>; 2]> = self.passages.iter().map(of_passage).collect();
        self.passages.iter_mut().zip(of_passages).for_each(|(passage, borders)| passage.borders = borders);
        self.borders = borders.iter().map(|border| border.1).collect();
        self.hidden_by = hidden_by;
        self
    }

    /// Whether a way over edges apart goes on from the first of the edges `passed` over `border`.
    fn goes_on(&self, passed: &[usize], border: usize) -> bool {
        let (edge, before) = match *passed {
            [edge] => (edge, None),
            [edge, before] => (edge, Some(before)),
            _ => return false,
        };
        let is_from =
            |side: &Shore| side.edge == edge && side.beyond.as_ref().map(|joined| joined.edge) == before;
        self.apart.iter().any(|way| way.across(edge) == Some(border) && way.sides.iter().any(is_from))
    }

    /// Leaves out passages over three edges of a face, and those over more than `most`.
    pub fn shorten(&mut self, most: usize) {
        self.passages.retain(|way| way.edges.len() <= most && !way.is_along_a_face());
        self.orders = Orders { most: self.orders.most.min(most.max(1)), along_a_face: false };
    }

    /// Tells passages where they end since no way goes on over edges apart.
    pub fn hide(&mut self) {
        hide(&mut self.passages, &self.apart, &self.across);
    }

    fn hiding(mut self) -> Self {
        self.hide();
        self
    }

    /// Where the place `point` on an edge is [m].
    #[must_use]
    pub fn copy(&self, edge: usize, point: DVec3) -> &Copy {
        let wedge = &self.edges[edge].wedge;
        let along = (point - wedge.at(0.0)).dot(wedge.direction());
        let parts = &self.parts[edge];
        let part = parts.iter().find(|(end, _)| along <= *end).or(parts.last());
        &self.copies[part.expect("every edge is somewhere").1]
    }

    /// Where the middle of an edge is.
    #[must_use]
    pub fn copy_at_middle(&self, edge: usize) -> &Copy {
        let wedge = &self.edges[edge].wedge;
        self.copy(edge, wedge.at(0.5 * wedge.length()))
    }
}

impl Copy {
    /// All mirrors of a path that a `face`, as it is unfolded, mirrors here.
    #[must_use]
    pub fn with(&self, face: &PlaneMirror) -> Chain {
        let behind = self.behind.reversed();
        let face = self.behind.image_of(face);
        Chain::of(&[self.before.mirrors(), &[face], behind.mirrors()].concat())
    }

    /// Whether a `face`, as it is unfolded, may show here an image of three reflections.
    #[must_use]
    pub fn may_show_thrice(&self, face: &PlaneMirror) -> bool {
        let face = self.behind.image_of(face);
        let ends = [self.before.mirrors().last(), self.behind.mirrors().last()];
        let is_one = matches!(ends, [Some(one), Some(other)] if one.plane == other.plane);
        let beside = || ends.into_iter().flatten();
        self.before.order() + self.behind.order() >= 2
            // What is mirrored before and behind a face at a right angle to the mirror is mirrored in the face alone.
            && !(is_one && beside().all(|mirror| mirror.is_across(&face)))
            // From a mirror sound goes to what is turned towards it.
            && !beside().any(|mirror| mirror.is_turned_with(&face))
    }
}

/// From where to where an edge of `parts` is in `copy` [m].
fn stretch(parts: &[(f64, usize)], copy: usize) -> [f64; 2] {
    let from = |part: usize| part.checked_sub(1).map_or(0.0, |before| parts[before].0);
    let found = parts.iter().position(|&(_, of)| of == copy);
    found.map_or([0.0; 2], |part| [from(part), parts[part].0])
}

impl RoomEdge {
    /// The part of it that is before `mirror`, if any is by more than `within` [m].
    pub fn before(&self, mirror: &PlaneMirror, within: f64) -> Option<Self> {
        let length = self.wedge.length();
        let [low, high] = [0.0, length].map(|end| mirror.height(self.wedge.at(end)));
        if low.max(high) <= within {
            return None;
        }
        let crossing = length * low / (low - high);
        let wedge = match (low < 0.0, high < 0.0) {
            (true, _) => self.wedge.between([crossing, length]),
            (_, true) => self.wedge.between([0.0, crossing]),
            _ => self.wedge,
        };
        Some(Self { wedge, ..*self })
    }

    /// Its image behind all mirrors of `chain`.
    pub fn image(&self, chain: &Chain) -> Self {
        let image = |wedge: Wedge, mirror: &PlaneMirror| mirror.image_of_wedge(&wedge);
        Self {
            wedge: chain.mirrors().iter().fold(self.wedge, image),
            faces: self.faces.map(|face| chain.image_of(&face)),
        }
    }

    /// Its end in `mirror`, if it ends there at a right angle [m].
    fn foot(&self, mirror: &PlaneMirror, within: f64) -> Option<DVec3> {
        if self.wedge.direction().cross(mirror.normal()).length() > PERPENDICULAR {
            return None;
        }
        let ends = [0.0, self.wedge.length()].map(|end| self.wedge.at(end));
        ends.into_iter().find(|&end| mirror.height(end).abs() <= within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, dvec3};
    use sonel_geometry::{Mesh, MeshTriangle, Side, SurfaceId};

    /// The edges of a screen in the plane x = 0 with these corners `[y, z]`, unfolded about floor and walls, as far as they are named: by a point
    /// in each and its normal.
    fn unfolded([low, high]: [[f64; 2]; 2], mirrors: &[(DVec3, DVec3)]) -> World {
        let mut mesh = Mesh::default();
        let mut add = |corners: [DVec3; 4]| {
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(corners);
            let triangles = [[0, 1, 2], [0, 2, 3]].map(|corners: [u32; 3]| corners.map(|c| first + c));
            mesh.triangles.extend(triangles.map(|corners| MeshTriangle { corners, material: 0 }));
        };
        add([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]
            .map(|[y, z]| dvec3(0.0, y, z)));
        for &(point, normal) in mirrors {
            let (u, v) =
                (9.0 * normal.any_orthonormal_vector(), 9.0 * normal.cross(normal.any_orthonormal_vector()));
            add([point - u - v, point + u - v, point + u + v, point - u + v]);
        }
        let geometry = Geometry::build(mesh).unwrap();
        let of_screen = super::super::room_edges(&geometry)
            .into_iter()
            .filter(|edge| geometry.surface(edge.faces[0].surface).normal.x.abs() > 0.5)
            .collect::<Vec<RoomEdge>>();
        let mirror = |&(point, normal): &(DVec3, DVec3)| {
            let surfaces = (0..geometry.surfaces().len()).map(|surface| SurfaceId(surface as u32));
            let sides = surfaces.flat_map(|surface| [Side::Front, Side::Back].map(|side| (surface, side)));
            let mut planes = sides.map(|(surface, side)| PlaneMirror::new(&geometry, surface, side));
            let is_it = |plane: &PlaneMirror| {
                plane.normal().dot(normal) > 0.9 && plane.height(point - geometry.center()).abs() < 1e-6
            };
            planes.find(is_it).unwrap()
        };
        let mirrors: Vec<PlaneMirror> = mirrors.iter().map(mirror).collect();
        World::unfolded(&geometry, &of_screen, Chain::of(&mirrors)).0
    }

    const FLOOR: (DVec3, DVec3) = (DVec3::ZERO, DVec3::Z);

    fn lengths(world: &World) -> Vec<f64> {
        let length = |edge: &RoomEdge| (1e6 * edge.wedge.length()).round() * 1e-6;
        let mut lengths: Vec<f64> = world.edges.iter().map(length).collect();
        lengths.sort_by(f64::total_cmp);
        lengths
    }

    #[test]
    fn a_screen_on_a_floor_is_one_of_twice_the_height() {
        let world = unfolded([[-1.0, 0.0], [1.0, 2.0]], &[FLOOR]);
        assert_eq!(lengths(&world), [2.0, 2.0, 4.0, 4.0]);
        assert_eq!(world.passages.len(), 6, "each rim with each");
    }

    #[test]
    fn a_screen_above_a_floor_and_its_image_are_two() {
        let world = unfolded([[-1.0, 0.5], [1.0, 2.0]], &[FLOOR]);
        assert_eq!((world.edges.len(), world.passages.len()), (8, 12));
        let mirror = world.shown.mirrors()[0];
        let is_before = |edge: usize| mirror.height(world.edges[edge].wedge.at(0.0)) > 0.0;
        let [one, other] = [0, 1].map(|of| world.passages.iter().map(move |way| way.edges[of].edge));
        assert!(one.zip(other).all(|(one, other)| is_before(one) == is_before(other)));
    }

    #[test]
    fn a_screen_in_a_corner_is_one_of_four_times_the_size() {
        let wall = (dvec3(0.0, -1.0, 0.0), DVec3::Y);
        for mirrors in [[FLOOR, wall], [wall, FLOOR]] {
            let world = unfolded([[-1.0, 0.0], [1.0, 3.0]], &mirrors);
            assert_eq!(lengths(&world), [4.0, 4.0, 6.0, 6.0]);
            assert_eq!(world.passages.len(), 6, "each rim with each");
        }
    }

    #[test]
    fn between_walls_that_face_one_another_a_screen_is_one_of_three_times_the_width() {
        let walls = [(dvec3(0.0, -1.0, 0.0), DVec3::Y), (dvec3(0.0, 1.0, 0.0), DVec3::NEG_Y)];
        for mirrors in [walls, [walls[1], walls[0]]] {
            let world = unfolded([[-1.0, 0.5], [1.0, 3.0]], &mirrors);
            assert_eq!(lengths(&world), [6.0, 6.0]);
            let top = (0..2).find(|&edge| world.edges[edge].wedge.at(0.0).z > 0.0).unwrap();
            let orders = [0.5, 2.5, 4.5].map(|along| {
                let copy = world.copy(top, world.edges[top].wedge.at(along));
                [copy.before.order(), copy.behind.order()]
            });
            assert!(orders == [[2, 0], [1, 1], [0, 2]] || orders == [[0, 2], [1, 1], [2, 0]], "{orders:?}");
        }
    }
}
