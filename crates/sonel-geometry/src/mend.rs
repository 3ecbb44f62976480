//! Closing cracks: corners and open edges that a drawing leaves a little apart are brought together.
//!
//! Only open edges are touched. Corners on them that are nearer to one another than the tolerance become one; where a
//! corner lies beside another open edge, the triangle of that edge is divided there. A corner is moved to where the planes
//! of its triangles meet (least squares, weighted by area), so that walls stay plane: walls that stop short of one another
//! are extended. Three rules keep what is drawn:
//!
//! - Two sides of a thin panel are not joined: open edges that run side by side, with faces that go the same way.
//! - Corners are joined only if no side of a triangle at them is shorter than twice their distance, and put on an edge only
//!   if its triangle is at least twice as high: no triangle collapses, and details finer than the tolerance remain.
//! - No triangle is turned over.

use crate::Mesh;
use crate::boundary::{ALIKE, OpenEdge, open_edges};
use crate::geometry::validate;
use crate::grid::BoxGrid;
use crate::scale::Scale;
use crate::stitch::{edge_grid, share_along, stitch_where};
use crate::topology::{edges_where, shared_edges};
use foldhash::HashMap;
use glam::{DMat3, DVec3};

/// A mesh with its cracks closed, and what that took.
#[derive(Debug, Clone, PartialEq)]
pub struct Mended {
    /// The mesh, without unused vertices and triangles without area.
    pub mesh: Mesh,
    /// Corners that were joined to another beyond the scene's resolution.
    pub joined: usize,
    /// Corners that were put on an open edge.
    pub attached: usize,
    /// Triangles that were dropped because they have no area, before or after.
    pub dropped: usize,
}

/// Least sides and heights of triangles over the distance by which corners are moved [1]: with 2 at least half of each is left. Chosen;
/// doubled, cracks at triangles lower than four times their width stay open.
const SIDES_PER_DISTANCE: f64 = 2.0;
/// Largest move of a corner over its distance to its partner [1]. Chosen, not measured: planes that meet at 60° and more ask for less;
/// doubled, corners of more acute planes keep to them.
const MOVES_PER_DISTANCE: f64 = 2.0;
/// Weights of the distance moved against the distances to the planes [1]; the first that keeps to [`MOVES_PER_DISTANCE`] counts, later ones
/// serve planes that are nearly parallel. The lowest is above rounding of a 3 × 3 inverse (1e-16 × condition), steps of 100 are chosen.
const WEIGHTS_OF_STAYING: [f64; 5] = [1e-9, 1e-7, 1e-5, 1e-3, 1e-1];

impl Mesh {
    /// Closes cracks up to `tolerance` [m]; none where there is nothing to do, or no valid mesh.
    pub fn mended(&self, tolerance: f64) -> Option<Mended> {
        validate(self).ok()?;
        let welded = self.welded();
        let mut mesh = welded.mesh;
        let (low, high) = mesh.bounds();
        let resolution = f64::from(Scale::of_bounds(low, high).resolution());
        if mesh.triangles.is_empty() {
            return None;
        }
        if tolerance <= resolution || edges_where(&mesh, |faces| faces == 1).is_empty() {
            return None;
        }
        // A wall that crosses another has its corner on the rim of that one, near the end: such corners are to be joined.
        let at = mesh.vertices.clone();
        stitch_where(&mut mesh, resolution, |edge, vertex, share| {
            has_room(edge, share, at[vertex as usize], tolerance)
        });
        let rims = Rims::new(&mesh, tolerance);
        let merges = rims.merges();
        let joined: usize = merges.iter().map(|merge| merge.corners.len() - 1).sum();
        let attached = merges.iter().filter(|merge| !merge.edges.is_empty()).count();
        if merges.is_empty() {
            return None;
        }
        let mut renamed: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
        let mut places = mesh.vertices.clone();
        for CornerMerge { corners, place, .. } in &merges {
            for &corner in corners {
                renamed[corner as usize] = corners[0];
            }
            places[corners[0] as usize] = *place;
        }
        let arms = rims.renamed_arms(&renamed);
        mesh.vertices = places.clone();
        for triangle in &mut mesh.triangles {
            triangle.corners = triangle.corners.map(|corner| renamed[corner as usize]);
        }
        stitch_where(&mut mesh, tolerance, |edge, vertex, share| {
            let arms = arms.get(&vertex).map_or(&[][..], Vec::as_slice);
            has_room(edge, share, places[vertex as usize], tolerance)
                && !arms.iter().any(|arm| arm.lies_along(edge))
        });
        let again = mesh.welded();
        Some(Mended { mesh: again.mesh, joined, attached, dropped: welded.dropped + again.dropped })
    }
}

/// Corners that become one, the edges they are put on, and where.
struct CornerMerge {
    corners: Vec<u32>,
    edges: Vec<usize>,
    place: DVec3,
}

/// An open edge as seen from one of its ends.
#[derive(Clone, Copy)]
struct Arm {
    away: DVec3,
    inward: DVec3,
}

impl Arm {
    /// Whether it and an edge that its corner lies beside are rims of two sides of a panel.
    fn lies_along(&self, edge: &OpenEdge) -> bool {
        self.away.dot(edge.along).abs() > ALIKE && self.inward.dot(edge.inward) > ALIKE
    }

    /// The test of [`Arm::lies_along`] for an edge at a corner to be joined to its own.
    fn lies_on(&self, other: &Self) -> bool {
        self.away.dot(other.away) > ALIKE && self.inward.dot(other.inward) > ALIKE
    }
}

/// Whether a corner at a share of an edge's length can be put on it: farther than the tolerance [m] from its ends, and much
/// nearer to it than its triangle is high.
fn has_room(edge: &OpenEdge, share: f64, corner: DVec3, tolerance: f64) -> bool {
    let along = share * edge.length();
    let distance = edge.at(along).distance(corner);
    along.min(edge.length() - along) > tolerance && SIDES_PER_DISTANCE * distance <= edge.height
}

/// The open edges of a mesh and the corners on them.
struct Rims<'a> {
    mesh: &'a Mesh,
    tolerance: f64,
    edges: Vec<OpenEdge>,
    /// For each corner of an open edge those edges.
    arms: HashMap<u32, Vec<Arm>>,
    /// The corners of open edges in ascending order.
    corners: Vec<u32>,
    /// Triangles at each corner of an open edge.
    faces: HashMap<u32, Vec<u32>>,
    /// The shortest side at each corner of the mesh [m].
    shortest: Vec<f64>,
}

impl<'a> Rims<'a> {
    fn new(mesh: &'a Mesh, tolerance: f64) -> Self {
        let shared = shared_edges(mesh);
        let edges = open_edges(mesh, &shared);
        let mut arms: HashMap<u32, Vec<Arm>> = HashMap::default();
        for edge in &edges {
            for end in edge.ends {
                arms.entry(end).or_default().push(Arm { away: edge.away_from(end), inward: edge.inward });
            }
        }
        let mut corners: Vec<u32> = arms.keys().copied().collect();
        corners.sort_unstable();
        let mut faces: HashMap<u32, Vec<u32>> = HashMap::default();
        for (face, triangle) in mesh.triangles.iter().enumerate() {
            for corner in triangle.corners.into_iter().filter(|corner| arms.contains_key(corner)) {
                faces.entry(corner).or_default().push(face as u32);
            }
        }
        let mut shortest = vec![f64::INFINITY; mesh.vertices.len()];
        for edge in &shared {
            let [from, to] = edge.ends.map(|end| mesh.vertices[end as usize]);
            for end in edge.ends {
                shortest[end as usize] = shortest[end as usize].min(from.distance(to));
            }
        }
        Self { mesh, tolerance, edges, arms, corners, faces, shortest }
    }

    fn point(&self, corner: u32) -> DVec3 {
        self.mesh.vertices[corner as usize]
    }

    /// Open edges at each corner, under its new name.
    fn renamed_arms(&self, renamed: &[u32]) -> HashMap<u32, Vec<Arm>> {
        let mut arms: HashMap<u32, Vec<Arm>> = HashMap::default();
        for corner in &self.corners {
            arms.entry(renamed[*corner as usize]).or_default().extend(&self.arms[corner]);
        }
        arms
    }

    /// Corners that are brought together, with their position.
    fn merges(&self) -> Vec<CornerMerge> {
        let attached = self.attachments();
        let mut merges = Vec::new();
        for corners in self.groups() {
            let mut edges: Vec<usize> = corners
                .iter()
                .flat_map(|corner| attached.get(corner).into_iter().flatten())
                .copied()
                .collect();
            edges.sort_unstable();
            edges.dedup();
            if corners.len() + edges.len() < 2 {
                continue;
            }
            let place = self.meeting_point(&corners, &edges);
            if !self.turns_over(&corners, place) {
                merges.push(CornerMerge { corners, edges, place });
            }
        }
        merges
    }

    /// Corners by the corner they become, each group in ascending order: any two of a group may be joined. The nearest are joined
    /// first.
    fn groups(&self) -> Vec<Vec<u32>> {
        let boxes: Vec<_> = self
            .corners
            .iter()
            .map(|&corner| (self.point(corner) - self.tolerance, self.point(corner) + self.tolerance))
            .collect();
        let grid = BoxGrid::new(&boxes);
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (here, &corner) in self.corners.iter().enumerate() {
            for &there in grid.around(self.point(corner)) {
                let there = there as usize;
                if here < there && self.may_join(corner, self.corners[there]) {
                    pairs.push((self.point(corner).distance(self.point(self.corners[there])), here, there));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut group: Vec<usize> = (0..self.corners.len()).collect();
        let mut members: Vec<Vec<u32>> = self.corners.iter().map(|&corner| vec![corner]).collect();
        for (_, a, b) in pairs {
            let (a, b) = (group[a].min(group[b]), group[a].max(group[b]));
            let all = || members[a].iter().all(|&u| members[b].iter().all(|&v| self.may_join(u, v)));
            if a != b && all() {
                let others = std::mem::take(&mut members[b]);
                for corner in &others {
                    group[self.corners.binary_search(corner).expect("it is one of the corners")] = a;
                }
                members[a].extend(others);
                members[a].sort_unstable();
            }
        }
        members.retain(|members| !members.is_empty());
        members
    }

    fn may_join(&self, u: u32, v: u32) -> bool {
        let distance = self.point(u).distance(self.point(v));
        let side = self.shortest[u as usize].min(self.shortest[v as usize]);
        distance <= self.tolerance
            && SIDES_PER_DISTANCE * distance <= side
            && !self.arms[&u].iter().any(|a| self.arms[&v].iter().any(|b| a.lies_on(b)))
    }

    /// For each corner that lies beside open edges, between their ends, those edges.
    fn attachments(&self) -> HashMap<u32, Vec<usize>> {
        let grid = edge_grid(&self.edges, self.tolerance);
        let mut attached: HashMap<u32, Vec<usize>> = HashMap::default();
        for &corner in &self.corners {
            for &index in grid.around(self.point(corner)) {
                let edge = &self.edges[index as usize];
                let Some(share) = share_along(edge.points, self.point(corner), self.tolerance) else {
                    continue;
                };
                let own = self.mesh.triangles[edge.face as usize].corners.contains(&corner);
                let is_panel = self.arms[&corner].iter().any(|arm| arm.lies_along(edge));
                if !own && !is_panel && has_room(edge, share, self.point(corner), self.tolerance) {
                    attached.entry(corner).or_default().push(index as usize);
                }
            }
        }
        attached
    }

    /// Point where the planes of the triangles at some corners and edges meet, as near as possible to the middle of the corners.
    fn meeting_point(&self, corners: &[u32], edges: &[usize]) -> DVec3 {
        let middle = corners.iter().map(|&corner| self.point(corner)).sum::<DVec3>() / corners.len() as f64;
        let from_middle = |corner: &u32| self.point(*corner).distance(middle);
        let spread = corners.iter().map(from_middle).fold(0.0, f64::max);
        let beside = edges.iter().map(|&edge| {
            let edge = &self.edges[edge];
            edge.at(edge.project(middle)).distance(middle)
        });
        let farthest = MOVES_PER_DISTANCE * beside.fold(spread, f64::max);
        let faces = corners.iter().flat_map(|&corner| &self.faces[&corner]).copied();
        let faces = faces.chain(edges.iter().map(|&edge| self.edges[edge].face));
        let (mut pull, mut towards, mut weight) = (DMat3::ZERO, DVec3::ZERO, 0.0);
        for face in faces {
            let area = self.mesh.vector_area(face);
            let normal = area.normalize_or_zero();
            let height = normal.dot(self.mesh.corners(face)[0] - middle);
            pull += area.length() * DMat3::from_cols(normal.x * normal, normal.y * normal, normal.z * normal);
            towards += area.length() * height * normal;
            weight += area.length();
        }
        let moves = WEIGHTS_OF_STAYING
            .map(|staying| (pull + DMat3::from_diagonal(DVec3::splat(staying * weight))).inverse() * towards);
        middle + moves.into_iter().find(|by| by.length() <= farthest).unwrap_or(DVec3::ZERO)
    }

    /// Whether moving some corners to one place turns a triangle over.
    fn turns_over(&self, corners: &[u32], place: DVec3) -> bool {
        corners.iter().flat_map(|&corner| &self.faces[&corner]).any(|&face| {
            let [a, b, c] = self.mesh.triangles[face as usize]
                .corners
                .map(|corner| if corners.contains(&corner) { place } else { self.point(corner) });
            (b - a).cross(c - a).dot(self.mesh.vector_area(face)) <= 0.0
        })
    }
}
