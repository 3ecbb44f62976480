//! The edges of the room as a base path meets them: for the direct path as they are; for one that a plane mirrors, unfolded: those
//! before the plane with their images behind it.
//!
//! In the doubled room the base path is straight, from the image of the source to the receiver, and all ways over edges that are
//! mirrored once are ways over the edges of either half: source, mirror, edge, receiver over one before the plane; source, edge,
//! mirror, receiver over an image. A face that stands on the mirror goes on in its image, and an edge that ends there does:
//! source, edge, mirror, another edge or the same, receiver is a way over two edges of the doubled face.

use std::ops::Range;

use sonel_diffraction::Wedge;
use sonel_geometry::{Departure, Geometry, PlaneId};

use super::mirror::PlaneMirror;
use super::passage::{Border, Passage, faces, is_convex, passages};

/// Resolutions within which an end lies in the mirror.
const IN_MIRROR: f64 = 8.0;

/// How far off a face, in lifts, the mirror that it stands on is felt for.
const FELT: f64 = 16.0;

/// An edge of the room, or the image of one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RoomEdge {
    /// About the scene's centre.
    pub wedge: Wedge,
    /// The plane of each face, and on which side of its normal the air is.
    pub faces: [PlaneMirror; 2],
}

/// All edges that a base path meets.
pub(crate) struct World {
    /// The mirror about which it is doubled; none for the direct path.
    pub mirror: Option<PlaneMirror>,
    pub edges: Vec<RoomEdge>,
    /// Those that are met alone.
    pub alone: Range<usize>,
    /// Edges that are passed one after the other.
    pub passages: Vec<Passage>,
}

impl World {
    /// The room of `edges` as it is.
    #[must_use]
    pub fn new(edges: Vec<RoomEdge>) -> Self {
        let passages = passages(&edges, &faces(&edges));
        Self { mirror: None, alone: 0..edges.len(), edges, passages }
    }

    /// What of the room of `real` edges is before `mirror`, and its image.
    #[must_use]
    pub fn doubled(geometry: &Geometry, real: &[RoomEdge], mirror: &PlaneMirror) -> Self {
        let halves = Halves::new(geometry, real, mirror);
        let (edges, places, _) = halves.edges();
        let passages = halves.passages(&edges, &places);
        Self { mirror: Some(*mirror), alone: 0..edges.len(), edges, passages }
    }

    /// What the image in `mirror` adds to the `room` for a path that meets the mirror before the first and after the last edge: the ways that
    /// go over an image, and, to be taken away, those over edges of the room that go on in theirs.
    #[must_use]
    pub fn behind(geometry: &Geometry, room: &Self, mirror: &PlaneMirror) -> [Self; 2] {
        let halves = Halves::new(geometry, &room.edges, mirror);
        let (edges, places, real) = halves.edges();
        let mut passages = halves.passages(&edges, &places);
        passages.retain(|way| way.edges.iter().any(|passed| passed.edge >= real));
        let with_images = Self { mirror: Some(*mirror), alone: real..edges.len(), edges, passages };
        let goes_on: Vec<Option<bool>> = room
            .edges
            .iter()
            .map(|edge| edge.before(mirror, halves.within).map(|edge| halves.whole(&edge).is_some()))
            .collect();
        let is_in_both = |way: &&Passage| {
            let edges = || way.edges.iter().map(|passed| goes_on[passed.edge]);
            edges().all(|edge| edge.is_some()) && edges().any(|edge| edge == Some(true))
        };
        let passages = room.passages.iter().filter(is_in_both).cloned().collect();
        [with_images, Self { mirror: None, edges: room.edges.clone(), alone: 0..0, passages }]
    }

    /// The part of an edge that is behind the mirror [m].
    #[must_use]
    pub fn behind_mirror(&self, edge: &RoomEdge) -> [f64; 2] {
        let length = edge.wedge.length();
        let Some(mirror) = self.mirror else { return [0.0; 2] };
        let [low, high] = [0.0, length].map(|end| mirror.height(edge.wedge.at(end)));
        let crossing = || length * low / (low - high);
        match (low < 0.0, high < 0.0) {
            (true, true) => [0.0, length],
            (true, false) => [0.0, crossing()],
            (false, true) => [crossing(), length],
            (false, false) => [0.0; 2],
        }
    }
}

/// A room about to be doubled.
struct Halves<'a> {
    geometry: &'a Geometry,
    mirror: &'a PlaneMirror,
    /// Resolution [m] of what is in the mirror.
    within: f64,
    /// Edges before the mirror.
    before: Vec<RoomEdge>,
    /// Planes that meet the mirror in an edge that diffracts: they go round that and not on in an image.
    round: Vec<PlaneId>,
}

impl<'a> Halves<'a> {
    fn new(geometry: &'a Geometry, real: &[RoomEdge], mirror: &'a PlaneMirror) -> Self {
        let within = IN_MIRROR * f64::from(geometry.resolution());
        let before = real.iter().filter_map(|edge| edge.before(mirror, within)).collect();
        let at_mirror = real.iter().filter(|edge| edge.faces.iter().any(|face| face.plane == mirror.plane));
        let round = at_mirror.flat_map(|edge| edge.faces.map(|face| face.plane)).collect();
        Self { geometry, mirror, within, before, round }
    }

    /// An edge and its image as one, if it stands on the mirror.
    fn whole(&self, edge: &RoomEdge) -> Option<RoomEdge> {
        let goes_on = edge.faces.iter().all(|face| !self.round.contains(&face.plane));
        edge.with_its_image(self.mirror, self.within).filter(|_| goes_on)
    }

    /// The edges before the mirror and behind it, where each and its image are among them, and how many of them have no part behind it: the
    /// first ones.
    fn edges(&self) -> (Vec<RoomEdge>, Vec<[usize; 2]>, usize) {
        let wholes: Vec<Option<RoomEdge>> = self.before.iter().map(|edge| self.whole(edge)).collect();
        let is_whole = |edge: &usize| wholes[*edge].is_some();
        let (whole, apart): (Vec<usize>, Vec<usize>) = (0..self.before.len()).partition(is_whole);
        let mut edges: Vec<RoomEdge> = apart.iter().map(|&edge| self.before[edge]).collect();
        edges.extend(whole.iter().filter_map(|&edge| wholes[edge]));
        edges.extend(apart.iter().map(|&edge| self.before[edge].image(self.mirror)));
        let mut places = vec![[0; 2]; self.before.len()];
        for (place, &edge) in apart.iter().enumerate() {
            places[edge] = [place, self.before.len() + place];
        }
        for (place, &edge) in whole.iter().enumerate() {
            places[edge] = [apart.len() + place; 2];
        }
        (edges, places, apart.len())
    }

    /// The passages among `edges`, of which `places` says for each before the mirror where it and its image are.
    fn passages(&self, edges: &[RoomEdge], places: &[[usize; 2]]) -> Vec<Passage> {
        let mut doubled = Vec::new();
        for face in faces(&self.before) {
            let [real, image] = [0, 1].map(|half| -> Vec<Border> {
                face.iter().map(|&(edge, of)| (places[edge][half], of)).collect()
            });
            let mut whole = [real.clone(), image.clone()].concat();
            whole.sort_unstable();
            whole.dedup();
            let of_sheet = || whole.iter().all(|&(edge, _)| edges[edge].wedge.is_rim());
            if self.stands(&face) && (is_convex(edges, &whole) || of_sheet()) {
                doubled.push(whole);
            } else {
                doubled.extend([real, image]);
            }
        }
        let mut passages = passages(edges, &doubled);
        passages.retain(|way| self.is_mirrored(edges, way));
        passages
    }

    /// Whether a face stands on the mirror at a right angle.
    fn stands(&self, face: &[Border]) -> bool {
        let (mesh, center) = (self.geometry.mesh(), self.geometry.center());
        let is_at_foot = |triangle: u32| {
            let corners = mesh.triangles[triangle as usize].corners;
            let height = |corner: u32| self.mirror.height(mesh.vertices[corner as usize] - center);
            corners.iter().filter(|&&corner| height(corner).abs() <= self.within).count() >= 2
        };
        let planes = || face.iter().map(|&(edge, of)| &self.before[edge].faces[of]);
        planes().all(|plane| self.mirror.is_across(plane) && !self.round.contains(&plane.plane))
            && planes().any(|plane| {
                self.geometry.surface(plane.surface).triangles.iter().any(|&triangle| is_at_foot(triangle))
            })
    }

    /// Whether there is a mirror, which may have an end, between edges that sound passes one after the other on different sides of it.
    fn is_mirrored(&self, edges: &[RoomEdge], way: &Passage) -> bool {
        way.edges.windows(2).all(|pair| {
            let [from, to] = [pair[0], pair[1]].map(|passed| {
                let wedge = &edges[passed.edge].wedge;
                wedge.at(0.5 * wedge.length())
            });
            let [above, below] = [self.mirror.height(from), -self.mirror.height(to)];
            if above * below <= 0.0 {
                return true;
            }
            let face = &edges[pair[0].edge].faces[usize::from(pair[0].at_second[1])];
            let off = (self.mirror.normal() + face.normal()) * (FELT * f64::from(self.geometry.lift()));
            let foot = from + (to - from) * (above / (above + below)) + off;
            let departure = Departure::free(foot.as_vec3());
            let hit = self.geometry.closest_hit(departure, -self.mirror.normal().as_vec3());
            hit.is_some_and(|hit| self.geometry.surface(hit.surface).plane == self.mirror.plane)
        })
    }
}

impl RoomEdge {
    /// The part of it that is before `mirror`, if any is by more than `within` [m].
    fn before(&self, mirror: &PlaneMirror, within: f64) -> Option<Self> {
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

    fn image(&self, mirror: &PlaneMirror) -> Self {
        let faces = [0, 1].map(|face| mirror.image_of(&self.faces[face]));
        Self { wedge: mirror.image_of_wedge(&self.wedge), faces }
    }

    /// The edge and its image as one, if it ends in `mirror` at a right angle.
    fn with_its_image(&self, mirror: &PlaneMirror, within: f64) -> Option<Self> {
        let length = self.wedge.length();
        let sine = self.wedge.direction().cross(mirror.normal()).length();
        let [low, high] = [0.0, length].map(|end| mirror.height(self.wedge.at(end)).abs());
        let wedge = match (low <= within, high <= within) {
            _ if sine > super::mirror::PERPENDICULAR => return None,
            (true, _) => self.wedge.between([-length, length]),
            (_, true) => self.wedge.between([0.0, 2.0 * length]),
            _ => return None,
        };
        Some(Self { wedge, ..*self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;
    use sonel_geometry::{Mesh, MeshTriangle, Side, SurfaceId};

    /// A floor, and a screen in the plane x = 0 from y = −1 to 1 that begins at a height of `low`.
    fn doubled(low: f64) -> World {
        let sheet = |corners: [glam::DVec3; 4], first: u32| {
            let triangle = |[a, b, c]: [u32; 3]| MeshTriangle {
                corners: [first + a, first + b, first + c],
                material: 0,
            };
            (corners, [triangle([0, 1, 2]), triangle([0, 2, 3])])
        };
        let floor = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]].map(|[x, y]| dvec3(x, y, 0.0));
        let screen = [[-1.0, low], [1.0, low], [1.0, 2.0], [-1.0, 2.0]].map(|[y, z]| dvec3(0.0, y, z));
        let mut mesh = Mesh::default();
        for (corners, triangles) in [sheet(floor, 0), sheet(screen, 4)] {
            mesh.vertices.extend(corners);
            mesh.triangles.extend(triangles);
        }
        let geometry = Geometry::build(mesh).unwrap();
        let on_floor = |surface: SurfaceId| geometry.surface(surface).normal.z.abs() > 0.5;
        let floor = (0..2).map(SurfaceId).find(|&surface| on_floor(surface)).unwrap();
        let side = if geometry.surface(floor).normal.z > 0.0 { Side::Front } else { Side::Back };
        let of_screen = super::super::room_edges(&geometry)
            .into_iter()
            .filter(|edge| !on_floor(edge.faces[0].surface))
            .collect::<Vec<RoomEdge>>();
        World::doubled(&geometry, &of_screen, &PlaneMirror::new(&geometry, floor, side))
    }

    #[test]
    fn a_screen_on_a_floor_is_one_of_twice_the_height() {
        let world = doubled(0.0);
        let mut lengths: Vec<f64> = world.edges.iter().map(|edge| edge.wedge.length()).collect();
        lengths.sort_by(f64::total_cmp);
        assert_eq!(lengths.len(), 4);
        assert!(lengths.iter().zip([2.0, 2.0, 4.0, 4.0]).all(|(a, b)| (a - b).abs() < 1e-6), "{lengths:?}");
        assert_eq!(world.passages.len(), 6, "each rim with each");
    }

    #[test]
    fn a_screen_above_a_floor_and_its_image_are_two() {
        let world = doubled(0.5);
        assert_eq!((world.edges.len(), world.passages.len()), (8, 12));
        let mirror = world.mirror.unwrap();
        let is_before = |edge: usize| mirror.height(world.edges[edge].wedge.at(0.0)) > 0.0;
        let [one, other] = [0, 1].map(|of| world.passages.iter().map(move |way| way.edges[of].edge));
        assert!(one.zip(other).all(|(one, other)| is_before(one) == is_before(other)));
    }
}
