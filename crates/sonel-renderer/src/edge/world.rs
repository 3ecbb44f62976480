//! The edges of the room as a base path meets them: for the direct path as they are; for one that a plane mirrors, unfolded: those
//! before the plane with their images behind it.
//!
//! In the doubled room the base path is straight, from the image of the source to the receiver, and all ways over edges that are
//! mirrored once are ways over the edges of either half: source, mirror, edge, receiver over one before the plane; source, edge,
//! mirror, receiver over an image. A face that stands on the mirror goes on in its image, and an edge that ends there does:
//! source, edge, mirror, another edge or the same, receiver is a way over two edges of the doubled face.

use sonel_diffraction::Wedge;
use sonel_geometry::{Departure, Geometry};

use super::mirror::PlaneMirror;
use super::passage::{Border, Passage, faces, is_convex, passages};

/// Sine of the angle within which a direction is perpendicular [1].
pub(crate) const PERPENDICULAR: f64 = 1e-6;
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
    /// Edges that are passed one after the other.
    pub passages: Vec<Passage>,
}

impl World {
    /// The room of `edges` as it is.
    #[must_use]
    pub fn new(edges: Vec<RoomEdge>) -> Self {
        let passages = passages(&edges, &faces(&edges));
        Self { mirror: None, edges, passages }
    }

    /// What of the room of `real` edges is before `mirror`, and its image.
    #[must_use]
    pub fn doubled(geometry: &Geometry, real: &[RoomEdge], mirror: &PlaneMirror) -> Self {
        let within = IN_MIRROR * f64::from(geometry.resolution());
        let before: Vec<RoomEdge> = real.iter().filter_map(|edge| edge.before(mirror, within)).collect();
        // What meets the mirror in an edge that diffracts goes round that and not on in an image.
        let goes_round = |face: &PlaneMirror| {
            let has = |edge: &RoomEdge, plane| edge.faces.iter().any(|of| of.plane == plane);
            real.iter().any(|edge| has(edge, mirror.plane) && has(edge, face.plane))
        };
        let mut edges = Vec::new();
        // Where each edge and its image are among them.
        let mut halves: Vec<[usize; 2]> = Vec::new();
        for edge in &before {
            let first = edges.len();
            if let Some(whole) = edge.with_its_image(mirror, within)
                && !edge.faces.iter().any(goes_round)
            {
                edges.push(whole);
                halves.push([first; 2]);
            } else {
                edges.extend([*edge, edge.image(mirror)]);
                halves.push([first, first + 1]);
            }
        }
        let mut doubled = Vec::new();
        for face in faces(&before) {
            let half = |image: usize| face.iter().map(move |&(edge, of)| (edge, of, image));
            let borders = |half: &mut dyn Iterator<Item = (usize, usize, usize)>| {
                half.map(|(edge, of, image)| (halves[edge][image], of)).collect::<Vec<Border>>()
            };
            let mut whole = borders(&mut half(0).chain(half(1)));
            whole.sort_unstable();
            whole.dedup();
            let planes: Vec<&PlaneMirror> = face.iter().map(|&(edge, of)| &before[edge].faces[of]).collect();
            let is_whole = !planes.iter().any(|face| goes_round(face))
                && stands(geometry, &planes, mirror, within)
                && (is_convex(&edges, &whole) || whole.iter().all(|&(edge, _)| edges[edge].wedge.is_rim()));
            if is_whole {
                doubled.push(whole);
            } else {
                doubled.extend([0, 1].map(|image| borders(&mut half(image))));
            }
        }
        let mut passages = passages(&edges, &doubled);
        passages.retain(|passage| is_mirrored(geometry, &edges, passage, mirror));
        Self { mirror: Some(*mirror), edges, passages }
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
            _ if sine > PERPENDICULAR => return None,
            (true, _) => self.wedge.between([-length, length]),
            (_, true) => self.wedge.between([0.0, 2.0 * length]),
            _ => return None,
        };
        Some(Self { wedge, ..*self })
    }
}

/// Whether a face in `planes`, which are one, is at a right angle to `mirror` and stands on it.
fn stands(geometry: &Geometry, planes: &[&PlaneMirror], mirror: &PlaneMirror, within: f64) -> bool {
    let mesh = geometry.mesh();
    let at_foot = |triangle: u32| {
        let corners = mesh.triangles[triangle as usize].corners;
        let height = |corner: u32| mirror.height(mesh.vertices[corner as usize] - geometry.center());
        corners.iter().filter(|&&corner| height(corner).abs() <= within).count() >= 2
    };
    planes.iter().all(|plane| mirror.normal().dot(plane.normal()).abs() <= PERPENDICULAR)
        && planes.iter().any(|plane| geometry.surface(plane.surface).triangles.iter().any(|&t| at_foot(t)))
}

/// Whether there is a mirror, which may have an end, between neighbouring edges of a passage that are not on one side of it.
fn is_mirrored(geometry: &Geometry, edges: &[RoomEdge], passage: &Passage, mirror: &PlaneMirror) -> bool {
    passage.edges.windows(2).all(|pair| {
        let [from, to] = [&pair[0], &pair[1]].map(|passed| {
            let wedge = &edges[passed.edge].wedge;
            wedge.at(0.5 * wedge.length())
        });
        let [above, below] = [mirror.height(from), -mirror.height(to)];
        if above * below <= 0.0 {
            return true;
        }
        let face = &edges[pair[0].edge].faces[usize::from(pair[0].at_second[1])];
        let off = (mirror.normal() + face.normal()) * (FELT * f64::from(geometry.lift()));
        let foot = from + (to - from) * (above / (above + below)) + off;
        let hit = geometry.closest_hit(Departure::free(foot.as_vec3()), -mirror.normal().as_vec3());
        hit.is_some_and(|hit| geometry.surface(hit.surface).plane == mirror.plane)
    })
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
