//! The geometry of a scene: everything that rays and receivers ask about the walls.

use crate::block::Facet;
use crate::bodies::Bodies;
use crate::cells::{CellPlace, Cells, Drawing, Known};
use crate::conform::{Conformed, conform};
use crate::cracks::{Facing, find_cracks, joined_up};
use crate::edges::{Edge, Survey};
use crate::index::{Index, Met};
use crate::layers::{Layers, Redrawn, unite};
use crate::orient::{Oriented, orient};
use crate::probe::{LocalPlane, Probe};
use crate::rim::{Rim, keep_inside, rims};
use crate::rooms::FaceKind;
use crate::scale::Scale;
use crate::section::cut;
use crate::shoebox::{Shoebox, recognise};
use crate::surfaces::{Partition, partition};
use crate::topology::{SharedEdge, leave_out, shared_edges};
use crate::{
    AirSector, Crack, Crossing, Departure, GeometryError, Hit, Mesh, PlaneId, Side, Surface, SurfaceId,
};
use glam::{DVec3, Vec3};
use std::fmt;

mod air;
mod faces;
mod nearest;
mod passage;
mod regions;
mod sight;

use faces::Faces;
pub use passage::Passage;
pub use regions::Regions;
pub use sight::{Crossed, End, Leg, MOST_ROUNDS, Sight};

/// Most times that a hit at the rim of a triangle is aimed anew, each time at a surface nearer to the origin. Chosen, not measured: as many
/// faces as meet in a usual corner.
const AIMS: usize = 8;

/// A mesh made ready for rays: welded, oriented, its planar surfaces found, indexed.
pub struct Geometry {
    mesh: Mesh,
    scale: Scale,
    bounds: (DVec3, DVec3),
    surfaces: Vec<Surface>,
    of_triangle: Vec<SurfaceId>,
    local: Vec<Vec3>,
    rims: Vec<Rim>,
    index: Index,
    pub(crate) cells: Cells,
    /// Pairs of triangles that coincide.
    twins: Vec<[u32; 2]>,
    is_watertight: bool,
    open_edges: Vec<[u32; 2]>,
    cracks: Vec<Crack>,
    crossings: Vec<Crossing>,
    redrawn: Vec<Redrawn>,
    masonry: Vec<CellPlace>,
    edges: Vec<Edge>,
    exposed: Vec<f64>,
    dropped: usize,
    shoebox: Option<Shoebox>,
}

impl fmt::Debug for Geometry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Geometry").field("triangles", &self.mesh.triangles.len()).finish_non_exhaustive()
    }
}

impl Geometry {
    /// Welds a mesh, makes it conform, orients it, finds its planar surfaces and edges and builds the index.
    ///
    /// # Errors
    /// [`GeometryError`] when the mesh has no triangle with an area, coordinates that are not finite or corners that
    /// do not exist.
    pub fn build(mesh: Mesh) -> Result<Self, GeometryError> {
        Self::with_kinds(mesh, |_| FaceKind::Wall, &[])
    }

    /// The same, where the `kind` of a material's faces is known. `air_at` are places [m] that alone are air, whatever the
    /// drawing says, with all that no face divides from them; without them the drawing tells.
    ///
    /// # Errors
    /// The errors of [`Self::build`].
    pub fn with_kinds(
        mesh: Mesh,
        kind: impl Fn(u32) -> FaceKind,
        air_at: &[DVec3],
    ) -> Result<Self, GeometryError> {
        validate(&mesh)?;
        let welded = mesh.welded();
        if welded.mesh.triangles.is_empty() {
            return Err(GeometryError::Empty { dropped: welded.dropped });
        }
        let mut mesh = welded.mesh;
        let (low, high) = mesh.bounds();
        let scale = Scale::of_bounds(low, high);
        let tolerance = f64::from(scale.resolution());
        let is_border = |material: u32| kind(material) == FaceKind::Interface;
        let is_left_out = mesh.triangles.iter().map(|triangle| is_border(triangle.material)).collect();
        let bodies = Bodies::of(mesh.clone(), is_left_out, tolerance);
        let mut known = Known { bodies: Some(&bodies), air_at, is_cut_out: false };
        let Conformed { crossings, stacks } = conform(&mut mesh, tolerance)?;
        let mut layers = unite(&mut mesh, &stacks, is_border, known, tolerance);
        let mut arranged = Arranged::find(&mut mesh, &kind, &layers, known, tolerance);
        let mut masonry = Vec::new();
        if arranged.oriented.cells.has_masonry && arranged.oriented.cells.is_room {
            let cells = &arranged.oriented.cells;
            masonry = cells.listed(&mesh, |cell| !cell.is_air);
            let faces = 0..mesh.triangles.len() as u32;
            let is_out: Vec<bool> = faces.map(|face| cells.is_air(face) == [false; 2]).collect();
            layers.leave_out(&mut mesh, &is_out);
            known.is_cut_out = true;
            arranged = Arranged::find(&mut mesh, &kind, &layers, known, tolerance);
        }
        let Arranged { edges, all_edges, facing, is_interface, oriented } = arranged;
        let Oriented { cells, open_edges } = oriented;
        let Layers { twins, redrawn, .. } = layers;
        let bounds = if cells.has_masonry { mesh.bounds() } else { (low, high) };
        let is_watertight = cells.is_room && cells.inside().all(|(_, cell)| !cell.is_air || !cell.is_cracked);
        let faces = Faces { cells: &cells, is_interface: &is_interface, twins: &twins };
        let (closed, in_shell) = (faces.closed(), faces.in_shell());
        let all_edges = all_edges.as_deref().unwrap_or(&edges);
        let Partition { surfaces, of_triangle, planes } =
            partition(&mesh, all_edges, &closed, &is_interface, tolerance);
        let about_center =
            |(normal, offset): (DVec3, f64)| LocalPlane { normal, offset: offset - normal.dot(scale.center) };
        let planes = planes.into_iter().map(about_center).collect();
        let local: Vec<Vec3> = mesh.vertices.iter().map(|&v| scale.to_local(v)).collect();
        let facets = facets(&mesh, &local, &surfaces, &of_triangle);
        let plane_of: Vec<PlaneId> = facets.iter().map(|facet| facet.plane).collect();
        let rims = rims(&mesh, all_edges, &plane_of, f64::from(scale.lift()));
        let exposed = faces.exposed(&mesh, surfaces.len(), &of_triangle);
        let shoebox = recognise(&surfaces, bounds.0, bounds.1, tolerance).filter(|_| cells.is_room);
        let index = Index::build(&facets, planes, in_shell, scale.lift(), scale.resolution());
        let mut geometry = Self {
            mesh,
            scale,
            bounds,
            surfaces,
            of_triangle,
            local,
            rims,
            index,
            cells,
            twins,
            is_watertight,
            open_edges,
            cracks: joined_up(&edges, &facing),
            crossings,
            redrawn,
            masonry,
            edges: Vec::new(),
            exposed,
            dropped: welded.dropped,
            shoebox,
        };
        if !geometry.cells.is_room {
            geometry.leave_out_outer_sides();
        }
        geometry.edges = geometry.survey(&edges, tolerance);
        Ok(geometry)
    }

    /// The edges at which sound may diffract, of those that triangles share.
    fn survey(&self, shared: &[SharedEdge], tolerance: f64) -> Vec<Edge> {
        let mut is_second = vec![false; self.mesh.triangles.len()];
        self.twins.iter().for_each(|&[_, second]| is_second[second as usize] = true);
        let survey = Survey {
            mesh: &self.mesh,
            shared,
            surfaces: &self.surfaces,
            of_triangle: &self.of_triangle,
            tolerance,
            cells: &self.cells,
            is_second: &is_second,
        };
        survey.edges()
    }

    /// The welded and oriented mesh, in world coordinates. Its triangles are those of the original in their order, less
    /// the dropped ones; where others touch or cross them, triangles are divided and parts appended.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Triangles of the original mesh that were dropped because they have no area.
    pub fn dropped_triangles(&self) -> usize {
        self.dropped
    }

    /// World position of the origin of local coordinates [m].
    pub fn center(&self) -> DVec3 {
        self.scale.center
    }

    /// World to local coordinates [m].
    pub fn to_local(&self, world: DVec3) -> Vec3 {
        self.scale.to_local(world)
    }

    /// Local to world coordinates [m].
    pub fn to_world(&self, local: Vec3) -> DVec3 {
        self.scale.to_world(local)
    }

    /// Largest local coordinate of any vertex [m].
    pub fn extent(&self) -> f32 {
        self.scale.extent
    }

    /// Distance [m] below which two positions cannot be told apart; every tolerance is a multiple of it.
    pub fn resolution(&self) -> f32 {
        self.scale.resolution()
    }

    /// Distance [m] from a surface at which rays leave it.
    pub fn lift(&self) -> f32 {
        self.scale.lift()
    }

    /// Lower and upper corner of the box around the scene, in world coordinates [m].
    pub fn bounds(&self) -> (DVec3, DVec3) {
        self.bounds
    }

    /// The planar surfaces.
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// One planar surface.
    pub fn surface(&self, surface: SurfaceId) -> &Surface {
        &self.surfaces[surface.0 as usize]
    }

    /// The straight edges of the surfaces.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The edges that diffract, each with the sectors of air into which it does: free ones, and those whose air exceeds π
    /// in front of their surfaces or behind.
    pub fn diffracting_edges(&self) -> impl Iterator<Item = &Edge> {
        self.edges.iter().filter(|edge| !edge.sectors.is_empty())
    }

    /// The surface a triangle of [`Geometry::mesh`] belongs to.
    pub fn triangle_surface(&self, triangle: u32) -> SurfaceId {
        self.of_triangle[triangle as usize]
    }

    /// Leaves a surface: the start of a ray from a position on it, towards one of its sides.
    ///
    /// The origin is put one lift off the surface's plane, so far that rounding cannot bring it back, and the plane
    /// is remembered as one not to test. This is the only function that leaves a surface.
    pub fn leave(&self, position: Vec3, surface: SurfaceId, side: Side) -> Departure {
        let Surface { normal, offset, plane, .. } = *self.surface(surface);
        let outward = side.sign() * normal;
        let offset = side.sign() * (offset - normal.dot(self.scale.center));
        let position = position.as_dvec3();
        let height = f64::from(self.scale.lift()) - (outward.dot(position) - offset);
        Departure { origin: (position + height * outward).as_vec3(), plane: Some(plane) }
    }

    /// Footprints of other surfaces on the front and back of one: the segments in which they cut its plane lifted to that side by
    /// [`Geometry::lift`], in local coordinates [m]. Walls at its border stand on it too.
    pub fn footprints(&self, surface: SurfaceId) -> [Vec<[DVec3; 2]>; 2] {
        let stood_on = self.surface(surface);
        let own = || stood_on.triangles.iter().flat_map(|&triangle| self.local_corners(triangle));
        let lift = self.scale.lift();
        let low = own().fold(Vec3::INFINITY, Vec3::min) - lift;
        let high = own().fold(Vec3::NEG_INFINITY, Vec3::max) + lift;
        let mut standing = Vec::new();
        self.index.near_box(low, high, |triangle| {
            if self.surface(self.of_triangle[triangle as usize]).plane != stood_on.plane {
                standing.push(triangle);
            }
        });
        standing.sort_unstable();
        let height = stood_on.offset - stood_on.normal.dot(self.scale.center);
        [Side::Front, Side::Back].map(|side| {
            let offset = height + side.sign() * f64::from(lift);
            let lifted = LocalPlane { normal: stood_on.normal, offset };
            let corners = |triangle: &u32| self.local_corners(*triangle).map(|corner| corner.as_dvec3());
            standing.iter().filter_map(|it| cut(corners(it), |corner| lifted.height(corner))).collect()
        })
    }

    /// Calls `visit` for every triangle whose box may come within `reach` [m] of that of another one, which is visited too.
    pub(crate) fn visit_near(&self, triangle: u32, reach: f32, visit: impl FnMut(u32)) {
        let [a, b, c] = self.local_corners(triangle);
        self.index.near_box(a.min(b).min(c) - reach, a.max(b).max(c) + reach, visit);
    }

    /// Leaves an edge: the start of a ray from a local position on it, within a right angle of the middle of one of its sectors.
    ///
    /// The origin is put one lift off the edge, so that no rounding brings it behind a face.
    pub fn leave_edge(&self, position: Vec3, sector: &AirSector) -> Departure {
        let lift = f64::from(self.scale.lift());
        Departure::free((position.as_dvec3() + lift * sector.middle()).as_vec3())
    }

    /// The first surface that a ray along a unit direction meets. Of surfaces at equal distance it is the one with the
    /// lowest triangle.
    pub fn closest_hit(&self, from: Departure, direction: Vec3) -> Option<Hit> {
        let ray = Probe::new(from.origin, direction, [from.plane, None]);
        let Met { distance, triangle, weights, .. } = self.index.nearest(&ray)?;
        let point = ray.at(distance);
        // Most points are off the rim, by more than the error of the weights.
        let rim = self.rims[triangle as usize];
        let is_off_rim = (0..3).all(|corner| weights[corner] > 2.0 * rim[corner]);
        Some(if is_off_rim {
            self.hit(from, direction, point, triangle)
        } else {
            self.settle(from, direction, point, triangle)
        })
    }

    /// Makes a hit of the point and triangle that a ray along `direction` met first. A point at the rim of its triangle is moved off it; where
    /// faces meet there, one that is in the way to the new place is met instead, so that no ray gets behind a face.
    fn settle(&self, from: Departure, mut direction: Vec3, mut point: DVec3, mut triangle: u32) -> Hit {
        for _ in 0..AIMS {
            let corners = self.local_corners(triangle).map(|corner| corner.as_dvec3());
            let Some(kept) = keep_inside(corners, point, self.rims[triangle as usize]) else { break };
            point = kept;
            let towards = kept.as_vec3() - from.origin;
            if towards == Vec3::ZERO {
                break;
            }
            let plane = self.surface(self.of_triangle[triangle as usize]).plane;
            let aim = Probe::new(from.origin, towards, [from.plane, Some(plane)]);
            let Some(met) = self.index.nearest(&aim).filter(|met| met.distance < 1.0) else { break };
            (point, triangle, direction) = (aim.at(met.distance), met.triangle, towards);
        }
        self.hit(from, direction, point, triangle)
    }

    /// The hit of a ray along `direction` at a point of a triangle.
    #[inline]
    fn hit(&self, from: Departure, direction: Vec3, point: DVec3, triangle: u32) -> Hit {
        let surface = self.of_triangle[triangle as usize];
        let from_front = direction.as_dvec3().dot(self.surface(surface).normal) < 0.0;
        let side = if from_front { Side::Front } else { Side::Back };
        let distance = point.distance(from.origin.as_dvec3()) as f32;
        Hit { position: point.as_vec3(), distance, triangle, surface, side }
    }

    fn local_corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].corners.map(|corner| self.local[corner as usize])
    }

    /// Whether anything lies strictly between the start and a local position [m].
    ///
    /// A surface whose plane passes within [`Geometry::resolution`] of the far end does not count. The surface that was
    /// left does when the far end is behind it.
    pub fn is_blocked(&self, from: Departure, to: Vec3) -> bool {
        let clearance = f64::from(self.resolution());
        self.is_behind(from, to, clearance) || self.crosses(from.origin, to, [from.plane, None], clearance)
    }

    /// The straight way from the start to a local position [m] past surfaces that `passes` alone; [`None`] where there is none. Nothing is asked
    /// where nothing is between.
    pub fn reaches(&self, from: Departure, to: Vec3, passes: impl Fn(SurfaceId) -> bool) -> Option<Sight> {
        if !self.is_blocked(from, to) {
            return Some(Sight::default());
        }
        let sight = self.sight([from.origin.as_dvec3(), to.as_dvec3()], from.plane, passes)?;
        let aim = (to.as_dvec3() - sight.shift).as_vec3();
        (!self.is_behind(from, aim, f64::from(self.resolution()))).then_some(sight)
    }

    /// Whether anything lies between two positions on surfaces, each lifted to the side that is to see the other.
    ///
    /// The planes of both surfaces are ignored, unless one position is behind the other's surface.
    pub fn is_blocked_between_surfaces(&self, from: Departure, to: Departure) -> bool {
        self.is_behind(from, to.origin, 0.0)
            || self.is_behind(to, from.origin, 0.0)
            || self.crosses(from.origin, to.origin, [from.plane, to.plane], 0.0)
    }

    /// Whether a point is on the other side of the plane that was left, by more than `clearance` [m].
    fn is_behind(&self, from: Departure, to: Vec3, clearance: f64) -> bool {
        from.plane.is_some_and(|plane| {
            let plane = self.index.plane(plane);
            let (here, there) = (plane.height(from.origin.as_dvec3()), plane.height(to.as_dvec3()));
            here * there < 0.0 && there.abs() > clearance
        })
    }

    /// Whether any surface but those of the ignored planes lies between two points.
    fn crosses(&self, from: Vec3, to: Vec3, ignored: [Option<PlaneId>; 2], clearance: f64) -> bool {
        from != to && self.index.any_before_tip(&Probe::new(from, to - from, ignored), clearance)
    }

    /// Whether the scene is a closed room: one hull reaches as far as anything. It may have cracks.
    pub fn is_closed_room(&self) -> bool {
        self.cells.is_room
    }

    /// Whether the scene is a closed room without cracks, which nothing leaves.
    pub fn is_watertight(&self) -> bool {
        self.is_watertight
    }

    /// Cracks of the mesh, the largest area first: gaps up to [`WIDEST_CRACK`](crate::WIDEST_CRACK) between open edges. Their
    /// rims do not diffract.
    pub fn cracks(&self) -> &[Crack] {
        &self.cracks
    }

    /// Crossings of faces as drawn, in the order of the mesh.
    pub fn crossings(&self) -> &[Crossing] {
        &self.crossings
    }

    /// The edges at which the part of the mesh of the largest extents is open: their ends in world coordinates [m]. A face
    /// lacks a neighbour there. None where that part is a closed shell or has nothing but cracks.
    pub fn open_edges(&self) -> Vec<[DVec3; 2]> {
        let at = |vertex: u32| self.mesh.vertices[vertex as usize];
        self.open_edges.iter().map(|ends| ends.map(at)).collect()
    }

    /// The scene as a rectangular room, if it is exactly one empty axis-aligned box with one surface for each wall,
    /// however tessellated.
    pub fn as_shoebox(&self) -> Option<Shoebox> {
        self.shoebox
    }
}

/// The edges of a mesh, its cracks and the cells between.
struct Arranged {
    /// Without those of interfaces.
    edges: Vec<SharedEdge>,
    /// With them, where there are any.
    all_edges: Option<Vec<SharedEdge>>,
    facing: Vec<Facing>,
    is_interface: Vec<bool>,
    oriented: Oriented,
}

impl Arranged {
    /// Finds the cells of a mesh and orients it in place.
    fn find(
        mesh: &mut Mesh,
        kind: &impl Fn(u32) -> FaceKind,
        layers: &Layers,
        known: Known<'_>,
        tolerance: f64,
    ) -> Self {
        let kinds: Vec<FaceKind> = mesh.triangles.iter().map(|triangle| kind(triangle.material)).collect();
        let is_interface: Vec<bool> = kinds.iter().map(|&kind| kind == FaceKind::Interface).collect();
        let mut edges = shared_edges(mesh);
        let all_edges = is_interface.contains(&true).then(|| edges.clone());
        leave_out(&mut edges, &is_interface);
        let facing = find_cracks(mesh, &mut edges, tolerance);
        let drawing = Drawing {
            edges: &edges,
            cracks: &facing,
            is_left_out: &is_interface,
            kinds: &kinds,
            twins: &layers.twins,
            is_doubled: &layers.is_doubled,
            known,
            tolerance,
        };
        let oriented = orient(mesh, &drawing);
        Self { edges, all_edges, facing, is_interface, oriented }
    }
}

/// The triangles as the index takes them, with their corners about the scene's centre.
fn facets(mesh: &Mesh, local: &[Vec3], surfaces: &[Surface], of_triangle: &[SurfaceId]) -> Vec<Facet> {
    let facet = |(number, surface): (u32, &SurfaceId)| Facet {
        corners: mesh.triangles[number as usize].corners.map(|corner| local[corner as usize]),
        triangle: number,
        plane: surfaces[surface.0 as usize].plane,
    };
    (0..).zip(of_triangle).map(facet).collect()
}

pub(crate) fn validate(mesh: &Mesh) -> Result<(), GeometryError> {
    let count = mesh.vertices.len().max(mesh.triangles.len());
    if count > i32::MAX as usize {
        return Err(GeometryError::TooLarge { count });
    }
    let mut lost = (0..mesh.vertices.len()).filter(|&v| !mesh.vertices[v].is_finite());
    if let Some(first) = lost.next() {
        return Err(GeometryError::NotFinite { first, count: 1 + lost.count() });
    }
    let exists = |corner: &u32| (*corner as usize) < mesh.vertices.len();
    let mut wrong = (0..mesh.triangles.len()).filter(|&t| !mesh.triangles[t].corners.iter().all(exists));
    if let Some(first) = wrong.next() {
        return Err(GeometryError::NoSuchVertex { first, count: 1 + wrong.count() });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{dvec3, vec3};

    #[test]
    fn a_shoebox_knows_itself() {
        let geometry = Geometry::build(Mesh::shoebox([10.0, 7.0, 3.0], [0, 1, 2, 3, 4, 5])).unwrap();
        let shoebox = geometry.as_shoebox().unwrap();
        assert_eq!((shoebox.min, shoebox.max), (DVec3::ZERO, dvec3(10.0, 7.0, 3.0)));
        for (wall, surface) in shoebox.walls.iter().enumerate() {
            assert_eq!(geometry.surface(*surface).material, wall as u32);
        }
        assert!((geometry.volume().unwrap() - 210.0).abs() < 1e-9);
        assert!((geometry.area() - 242.0).abs() < 1e-9);
        assert!((geometry.exposed_area(4) - 70.0).abs() < 1e-9);
        assert!(geometry.contains(dvec3(0.1, 0.1, 0.1)));
        assert!(!geometry.contains(dvec3(-0.1, 0.1, 0.1)));
        assert!((geometry.distance_to_nearest_surface(dvec3(5.0, 3.0, 1.0)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn walls_leave_footprints_where_they_stand() {
        let mut mesh = Mesh::shoebox([10.0, 7.0, 3.0], [0; 6]);
        let first = mesh.vertices.len() as u32;
        // One screen stands on the floor, another hangs a centimetre above it.
        for (x, z) in [(5.0, 0.0), (6.0, 0.01)] {
            mesh.vertices.extend([dvec3(x, 2.0, z), dvec3(x, 5.0, z), dvec3(x, 3.0, 2.0)]);
        }
        for corner in [first, first + 3] {
            mesh.triangles
                .push(crate::MeshTriangle { corners: [corner, corner + 1, corner + 2], material: 1 });
        }
        let geometry = Geometry::build(mesh).unwrap();
        let floor = geometry.surfaces().iter().position(|surface| surface.normal.z > 0.9).unwrap();
        let [above, below] = geometry.footprints(SurfaceId(floor as u32));
        assert!(below.is_empty(), "nothing is under the floor");
        let world = |local: DVec3| local + geometry.center();
        let of_screen: Vec<_> = above.iter().filter(|[a, _]| (world(*a).x - 5.5).abs() < 1.0).collect();
        // The floor's diagonal divides the screen that stands on it.
        let ends = || of_screen.iter().flat_map(|ends| ends.iter().map(|&end| world(end)));
        let [from, to] = [f64::min, f64::max].map(|pick| ends().map(|end| end.y).reduce(pick).unwrap());
        assert!(ends().all(|end| (end.x - 5.0).abs() < 1e-6));
        assert!((from - 2.0).abs() < 1e-4 && (to - 5.0).abs() < 1e-4);
        // Both triangles of each wall: the diagonal ends on the floor.
        assert_eq!(above.len() - of_screen.len(), 8);
    }

    #[test]
    fn what_is_behind_the_surface_left_is_blocked() {
        let mut mesh = Mesh::shoebox([10.0, 7.0, 3.0], [0; 6]);
        let first = mesh.vertices.len() as u32;
        let screen = [dvec3(5.0, 2.0, 0.0), dvec3(5.0, 5.0, 0.0), dvec3(5.0, 3.0, 2.0)];
        mesh.vertices.extend(screen);
        mesh.triangles.push(crate::MeshTriangle { corners: [first, first + 1, first + 2], material: 1 });
        let geometry = Geometry::build(mesh).unwrap();
        let at = |x: f64, y: f64, z: f64| geometry.to_local(dvec3(x, y, z));
        let screen = geometry.triangle_surface(12);
        let seen_from = |side: Side| geometry.leave(at(5.0, 3.0, 0.5), screen, side);
        // The screen's front is at positive x.
        for (side, x) in [(Side::Front, 6.0), (Side::Back, 4.0)] {
            assert!(!geometry.is_blocked(seen_from(side), at(x, 3.0, 1.0)));
            assert!(geometry.is_blocked(seen_from(side.opposite()), at(x, 3.0, 1.0)));
            assert!(!geometry.is_blocked(seen_from(side), at(5.0, 3.0, 2.5)));
        }
        assert!(geometry.is_blocked_between_surfaces(seen_from(Side::Front), seen_from(Side::Back)));
        let wall = geometry.triangle_surface(0);
        let on_wall = geometry.leave(at(0.0, 3.0, 0.5), wall, Side::Front);
        assert!(geometry.is_blocked_between_surfaces(seen_from(Side::Front), on_wall));
        assert!(!geometry.is_blocked_between_surfaces(seen_from(Side::Back), on_wall));
        assert!(!geometry.is_blocked(seen_from(Side::Back), at(0.0, 3.0, 0.5)));
    }

    #[test]
    fn a_ray_meets_the_wall_ahead_and_leaves_it_again() {
        let geometry = Geometry::build(Mesh::shoebox([10.0, 7.0, 3.0], [0, 1, 2, 3, 4, 5])).unwrap();
        let start = geometry.to_local(dvec3(1.0, 2.0, 1.0));
        let hit = geometry.closest_hit(Departure::free(start), vec3(1.0, 0.0, 0.0)).unwrap();
        assert!((hit.distance - 9.0).abs() < 1e-5);
        assert_eq!(hit.side, Side::Front);
        assert_eq!(geometry.surface(hit.surface).material, 1);
        let again = geometry.leave(hit.position, hit.surface, hit.side);
        let back = geometry.closest_hit(again, vec3(-1.0, 0.0, 0.0)).unwrap();
        assert!((back.distance - 10.0).abs() < 1e-4);
        assert!(!geometry.is_blocked(again, start));
        assert!(geometry.is_blocked(Departure::free(start), geometry.to_local(dvec3(12.0, 2.0, 1.0))));
    }
}
