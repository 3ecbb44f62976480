//! Planar surfaces: maximal coplanar, edge-connected regions of one material.
//!
//! A region is judged over all its vertices against the plane of its largest triangle, so a finely tessellated curved
//! wall is never chained into one plane, however small the angle from facet to facet.

use crate::Mesh;
use crate::topology::SharedEdge;
use foldhash::HashMap;
use glam::DVec3;
use smallvec::SmallVec;
use std::iter::successors;

/// Cosine between normals from which on two faces are parallel: 1.4 mrad, 1.4 mm over a metre. Chosen, not measured; 1 − 4e-6 doubles the
/// angle.
pub(crate) const PARALLEL: f64 = 1.0 - 1e-6;

/// Index of a [`Surface`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SurfaceId(pub u32);

/// A plane of the scene: equal for all coplanar surfaces, whatever their material, position or orientation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PlaneId(pub u32);

/// A side of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// The side the normal points to.
    Front,
    /// The other side.
    Back,
}

impl Side {
    /// The other side.
    pub fn opposite(self) -> Self {
        match self {
            Side::Front => Side::Back,
            Side::Back => Side::Front,
        }
    }

    /// +1 for the front, −1 for the back: what the surface's normal is multiplied by to point to this side.
    pub fn sign(self) -> f64 {
        match self {
            Side::Front => 1.0,
            Side::Back => -1.0,
        }
    }
}

/// A maximal coplanar, edge-connected region of one material.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Unit normal, pointing to the [`Side::Front`].
    pub normal: DVec3,
    /// The surface is at normal · x = offset [m], in world coordinates.
    pub offset: f64,
    /// The plane it shares with all surfaces coplanar to it.
    pub plane: PlaneId,
    /// Index of its material.
    pub material: u32,
    /// Area of one side [m²].
    pub area: f64,
    /// Centre of the area, in world coordinates [m].
    pub centroid: DVec3,
    /// Triangles in ascending order.
    pub triangles: Vec<u32>,
    /// Whether it is part of a closed shell of a closed room, so that only its front faces the air.
    pub closed: bool,
    /// Whether it is no wall but the border between two airs.
    pub interface: bool,
}

/// The surfaces of a mesh and how triangles and planes map to them.
pub(crate) struct Partition {
    pub surfaces: Vec<Surface>,
    /// The surface of each triangle.
    pub of_triangle: Vec<SurfaceId>,
    /// For each plane the unit normal and offset (world) of the largest surface on it.
    pub planes: Vec<(DVec3, f64)>,
}

/// Gathers triangles into surfaces and surfaces into planes, within `tolerance` [m].
pub(crate) fn partition(
    mesh: &Mesh,
    edges: &[SharedEdge],
    closed: &[bool],
    interface: &[bool],
    tolerance: f64,
) -> Partition {
    let regions = grow_regions(mesh, &neighbours(mesh, edges, closed), tolerance);
    let mut of_triangle = vec![SurfaceId(0); mesh.triangles.len()];
    let mut surfaces = Vec::with_capacity(regions.len());
    for region in regions {
        for &triangle in &region {
            of_triangle[triangle as usize] = SurfaceId(surfaces.len() as u32);
        }
        surfaces.push(surface(mesh, region, closed, interface));
    }
    let planes = share_planes(mesh, &mut surfaces, tolerance);
    Partition { surfaces, of_triangle, planes }
}

/// For each triangle those of its material with which it shares an edge, all `closed` or none.
fn neighbours(mesh: &Mesh, edges: &[SharedEdge], closed: &[bool]) -> Vec<SmallVec<[u32; 4]>> {
    let mut neighbours = vec![SmallVec::new(); mesh.triangles.len()];
    for edge in edges {
        for &a in &edge.faces {
            for &b in &edge.faces {
                let kind = |face: u32| (mesh.triangles[face as usize].material, closed[face as usize]);
                if a != b && kind(a) == kind(b) {
                    neighbours[a as usize].push(b);
                }
            }
        }
    }
    neighbours
}

/// Floods regions from their largest triangle; regions are listed by their lowest triangle.
fn grow_regions(mesh: &Mesh, neighbours: &[SmallVec<[u32; 4]>], tolerance: f64) -> Vec<Vec<u32>> {
    let count = mesh.triangles.len() as u32;
    let areas: Vec<f64> = (0..count).map(|i| mesh.vector_area(i).length()).collect();
    let mut seeds: Vec<u32> = (0..count).collect();
    seeds.sort_unstable_by(|&a, &b| areas[b as usize].total_cmp(&areas[a as usize]).then(a.cmp(&b)));
    let mut taken = vec![false; count as usize];
    let mut regions = Vec::new();
    for seed in seeds {
        if std::mem::replace(&mut taken[seed as usize], true) {
            continue;
        }
        let normal = mesh.vector_area(seed).normalize();
        let offset = plane_offset(mesh, normal, &[seed]);
        let mut region = vec![seed];
        let mut next = 0;
        while next < region.len() {
            for &candidate in &neighbours[region[next] as usize] {
                let flat = || {
                    mesh.corners(candidate).iter().all(|v| (normal.dot(*v) - offset).abs() <= tolerance)
                        && mesh.vector_area(candidate).dot(normal) > 0.0
                };
                if !taken[candidate as usize] && flat() {
                    taken[candidate as usize] = true;
                    region.push(candidate);
                }
            }
            next += 1;
        }
        region.sort_unstable();
        regions.push(region);
    }
    regions.sort_by_key(|region| region[0]);
    regions
}

/// Mean of normal · x over the corners of some triangles.
fn plane_offset(mesh: &Mesh, normal: DVec3, triangles: &[u32]) -> f64 {
    let sum: f64 = triangles.iter().flat_map(|&t| mesh.corners(t)).map(|v| normal.dot(v)).sum();
    sum / (3 * triangles.len()) as f64
}

fn surface(mesh: &Mesh, triangles: Vec<u32>, closed: &[bool], interface: &[bool]) -> Surface {
    let mut vector_area = DVec3::ZERO;
    let mut area = 0.0;
    let mut moment = DVec3::ZERO;
    for &triangle in &triangles {
        let part = mesh.vector_area(triangle);
        vector_area += part;
        area += part.length();
        let [a, b, c] = mesh.corners(triangle);
        moment += part.length() * (a + b + c) / 3.0;
    }
    let normal = vector_area.normalize();
    Surface {
        normal,
        offset: plane_offset(mesh, normal, &triangles),
        plane: PlaneId(0),
        material: mesh.triangles[triangles[0] as usize].material,
        area,
        centroid: moment / area,
        closed: closed[triangles[0] as usize],
        interface: interface[triangles[0] as usize],
        triangles,
    }
}

/// Gives coplanar surfaces a common plane, judged over all their vertices; the largest surface of each plane names it.
fn share_planes(mesh: &Mesh, surfaces: &mut [Surface], tolerance: f64) -> Vec<(DVec3, f64)> {
    let mut order: Vec<usize> = (0..surfaces.len()).collect();
    order.sort_unstable_by(|&a, &b| surfaces[b].area.total_cmp(&surfaces[a].area).then(a.cmp(&b)));
    let (low, high) = mesh.bounds();
    let center = 0.5 * (low + high);
    let mut lattice = PlaneLattice::new(center, (high - center).length());
    for index in order {
        let surface = &surfaces[index];
        let on = |&(normal, offset): &(DVec3, f64)| {
            surface
                .triangles
                .iter()
                .flat_map(|&t| mesh.corners(t))
                .all(|v| (normal.dot(v) - offset).abs() <= tolerance)
        };
        surfaces[index].plane = lattice.find_or_add(surface.normal, surface.offset, on);
    }
    lattice.planes
}

/// Planes hashed by normal and distance from the scene's centre. Each is filed under both of its normals.
struct PlaneLattice {
    planes: Vec<(DVec3, f64)>,
    /// The last filing of each cell; filings 2 i and 2 i + 1 are those of plane i.
    last: HashMap<[i32; 4], u32>,
    /// For each filing the one before it in its cell.
    previous: Vec<Option<u32>>,
    center: DVec3,
    radius: f64,
}

/// Two descriptions of one plane differ by less than this in their unit normals. A small surface's normal is uncertain
/// by the tolerance over its size, so surfaces smaller than 10⁴ tolerances may keep a plane of their own; that costs
/// nothing but a plane.
const NORMAL_SPREAD: f64 = 1e-4;
/// Width of a cell [spreads]: a plane has candidates in a second cell along an axis in 2 of 8 cases. Speed alone depends on it.
const SPREADS_PER_CELL: f64 = 8.0;

impl PlaneLattice {
    fn new(center: DVec3, radius: f64) -> Self {
        Self { planes: Vec::new(), last: HashMap::default(), previous: Vec::new(), center, radius }
    }

    /// The first plane that `on` accepts, or a new one.
    fn find_or_add(&mut self, normal: DVec3, offset: f64, on: impl Fn(&(DVec3, f64)) -> bool) -> PlaneId {
        let place = self.place(normal, offset);
        let mut found = u32::MAX;
        let span = place.map(|x| cell(x - 1.0)..=cell(x + 1.0));
        for x in span[0].clone() {
            for y in span[1].clone() {
                for z in span[2].clone() {
                    for w in span[3].clone() {
                        let last = self.last.get(&[x, y, z, w]).copied();
                        for filing in successors(last, |&filing| self.previous[filing as usize]) {
                            let candidate = filing / 2;
                            if candidate < found && on(&self.planes[candidate as usize]) {
                                found = candidate;
                            }
                        }
                    }
                }
            }
        }
        if found == u32::MAX {
            found = self.planes.len() as u32;
            self.planes.push((normal, offset));
            for place in [place, place.map(|x| -x)] {
                let filing = self.previous.len() as u32;
                self.previous.push(self.last.insert(place.map(cell), filing));
            }
        }
        PlaneId(found)
    }

    /// Normal and distance from the centre, in spreads: a normal that is off by one spread moves the plane by no more
    /// than one at the far end of the scene.
    fn place(&self, normal: DVec3, offset: f64) -> [f64; 4] {
        let distance = (offset - normal.dot(self.center)) / self.radius;
        [normal.x, normal.y, normal.z, distance].map(|x| x / NORMAL_SPREAD)
    }
}

fn cell(spreads: f64) -> i32 {
    (spreads / SPREADS_PER_CELL).floor() as i32
}
