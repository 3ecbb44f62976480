//! The founding paper's diffraction of packets, [Kapralos2006] sections 3 and 3.1.3.
//!
//! Every surface is continued in its plane beyond its diffracting edges by λ/2. Within λ/2 of such an edge, on the surface or on its
//! continuation, a packet is neither reflected nor absorbed: it is projected onto the edge and sent on from there with all its
//! energy. The nearest edge counts. λ is that of the band's centre, so that a packet carries one band.
//!
//! Where the paper leaves a choice (which edges, which hemisphere), docs/paper-mode.md has the reading and its reason.

use glam::{DVec3, Vec3};
use sonel_geometry::{AirSector, Departure, Edge, Geometry, Hit, PlaneId};
use sonel_sampling::{Frame, warp};

/// The rim of one face at one edge.
struct Rim {
    edge: u32,
    sector: AirSector,
    plane: PlaneId,
    /// First end of the edge, about the scene's centre [m].
    origin: DVec3,
    /// Unit vector to the other end.
    along: DVec3,
    length: f64,
    /// Unit vectors across the edge: into the face, and from the face into the air.
    inward: DVec3,
    normal: DVec3,
}

/// All edges of a scene with their zones.
pub(crate) struct DiffractionZones {
    rims: Vec<Rim>,
    /// λ/2 per band [m]; zero in bands that are not diffracted.
    widths: Vec<f64>,
    /// Distance from a plane up to which a way starts on it, and from the ends of an edge that packets keep, where a wall may stand [m].
    margin: f64,
}

/// A packet on its way from where it was to what it meets.
pub(crate) struct Way<'a> {
    /// Begin, relative to the scene's centre [m].
    pub from: DVec3,
    /// End without deflection [m].
    pub to: DVec3,
    /// Hit at the end; none in the open.
    pub hit: Option<&'a Hit>,
}

/// Edge zone that caught a packet.
pub(crate) struct ZoneHit<'a> {
    /// Number of the edge among those that diffract.
    pub edge: u32,
    /// The place on the edge, about the scene's centre [m].
    pub place: Vec3,
    sector: &'a AirSector,
}

/// A place in the zone of a rim.
#[derive(Clone, Copy)]
struct Candidate<'a> {
    rim: &'a Rim,
    /// Share of the way.
    share: f64,
    /// Distance from the edge [m].
    aside: f64,
    /// Distance along the edge from its first end [m].
    along: f64,
}

impl DiffractionZones {
    /// The zones of all diffracting edges; `wavelengths` are those of the bands [m], zero where nothing is diffracted.
    #[must_use]
    pub(crate) fn new(geometry: &Geometry, wavelengths: &[f64]) -> Self {
        let edges = geometry.diffracting_edges().enumerate();
        Self {
            rims: edges.flat_map(|(number, edge)| rims(geometry, number as u32, edge)).collect(),
            widths: wavelengths.iter().map(|wavelength| 0.5 * wavelength).collect(),
            margin: STARTS_ON_PLANE * f64::from(geometry.resolution()),
        }
    }

    /// The zone of `band` that `way` comes into first; [`None`] where it comes into none.
    #[must_use]
    pub(crate) fn catch(&self, geometry: &Geometry, way: &Way<'_>, band: usize) -> Option<ZoneHit<'_>> {
        let width = self.widths[band];
        let length = way.from.distance(way.to);
        let mut first: Option<Candidate<'_>> = None;
        for rim in &self.rims {
            let Some(found) = self.beside(rim, way).or_else(|| within(rim, way, geometry)) else { continue };
            let on_edge = (0.0..=rim.length).contains(&found.along);
            let is_first = first.is_none_or(|first| {
                let later = (found.share - first.share) * length;
                if later.abs() <= self.margin { found.aside < first.aside } else { later < 0.0 }
            });
            if found.aside <= width && on_edge && is_first {
                first = Some(found);
            }
        }
        let Candidate { rim, share, along, .. } = first?;
        let along = if rim.length > 2.0 * self.margin {
            along.clamp(self.margin, rim.length - self.margin)
        } else {
            0.5 * rim.length
        };
        let place = (rim.origin + along * rim.along).as_vec3();
        let from = match way.hit {
            Some(hit) if share >= 1.0 => geometry.leave(hit.position, hit.surface, hit.side),
            _ => Departure::free(way.from.lerp(way.to, share).as_vec3()),
        };
        // No zone reaches through a wall.
        (!geometry.is_blocked(from, place)).then_some(ZoneHit { edge: rim.edge, place, sector: &rim.sector })
    }

    /// Crossing of `way` with the continuation of a face beyond its rim.
    #[inline]
    fn beside<'a>(&self, rim: &'a Rim, way: &Way<'_>) -> Option<Candidate<'a>> {
        let here = (way.from - rim.origin).dot(rim.normal);
        let there = (way.to - rim.origin).dot(rim.normal);
        if here * there >= 0.0 || here.abs() <= self.margin {
            return None;
        }
        let share = here / (here - there);
        let offset = way.from.lerp(way.to, share) - rim.origin;
        let aside = -offset.dot(rim.inward);
        (aside > 0.0).then(|| Candidate { rim, share, aside, along: offset.dot(rim.along) })
    }
}

impl ZoneHit<'_> {
    /// Next leg of the packet, by two uniform numbers: any direction of the hemisphere about the middle of the air.
    #[must_use]
    pub(crate) fn onward(&self, geometry: &Geometry, u: [f32; 2]) -> (Departure, Vec3) {
        let local = warp::uniform_sphere(u);
        let frame = Frame::about(self.sector.middle().as_vec3().normalize());
        (geometry.leave_edge(self.place, self.sector), frame.outward(local.with_z(local.z.abs())))
    }
}

/// Distance from a plane within which a path starts on it [resolutions]: rays leave surfaces and edges by four. The rest is a margin, chosen.
const STARTS_ON_PLANE: f64 = 16.0;

/// Position of the end of `way` on the face within the rim, arriving from the air.
#[inline]
fn within<'a>(rim: &'a Rim, way: &Way<'_>, geometry: &Geometry) -> Option<Candidate<'a>> {
    let hit = way.hit?;
    if geometry.surface(hit.surface).plane != rim.plane || (way.to - way.from).dot(rim.normal) >= 0.0 {
        return None;
    }
    let offset = way.to - rim.origin;
    let aside = offset.dot(rim.inward);
    (aside >= 0.0).then(|| Candidate { rim, share: 1.0, aside, along: offset.dot(rim.along) })
}

fn rims(geometry: &Geometry, number: u32, edge: &Edge) -> Vec<Rim> {
    let [origin, end] = edge.ends.map(|end| end - geometry.center());
    let of = |sector: &AirSector, face: usize, inward: DVec3, normal: DVec3| Rim {
        edge: number,
        sector: *sector,
        plane: geometry.surface(sector.faces[face].0).plane,
        origin,
        along: (end - origin).normalize(),
        length: origin.distance(end),
        inward,
        normal,
    };
    let both = |sector: &AirSector| {
        let second = of(sector, 1, sector.second_inward(), sector.second_normal());
        [of(sector, 0, sector.inward, sector.normal), second]
    };
    edge.sectors.iter().flat_map(both).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;
    use sonel_geometry::{Mesh, MeshTriangle};

    const HALF_WAVE: f64 = 0.5;

    /// A box of 20 m × 10 m × 6 m with a screen across its middle, 4 m wide and 3 m high, that stands on the floor.
    fn screened() -> Geometry {
        let mut mesh = Mesh::shoebox([20.0, 10.0, 6.0], [0; 6]);
        sheet(&mut mesh, [[10.0, 3.0, 0.0], [10.0, 7.0, 0.0], [10.0, 7.0, 3.0], [10.0, 3.0, 3.0]]);
        Geometry::build(mesh).unwrap()
    }

    fn sheet(mesh: &mut Mesh, corners: [[f64; 3]; 4]) {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners.map(DVec3::from_array));
        for corners in [[0, 1, 2], [0, 2, 3]].map(|triangle| triangle.map(|corner| first + corner)) {
            mesh.triangles.push(MeshTriangle { corners, material: 0 });
        }
    }

    /// Where a packet from `from` towards `to` is caught, in the scene's axes.
    fn caught(geometry: &Geometry, from: DVec3, to: DVec3) -> Option<DVec3> {
        let zones = DiffractionZones::new(geometry, &[2.0 * HALF_WAVE]);
        let start = from - geometry.center();
        let hit = geometry.closest_hit(Departure::free(start.as_vec3()), (to - from).normalize().as_vec3());
        let way = Way { from: start, to: hit.unwrap().position.as_dvec3(), hit: hit.as_ref() };
        zones.catch(geometry, &way, 0).map(|caught| geometry.to_world(caught.place))
    }

    /// Level flights towards the plane of the screen at 5 m and the height `z`.
    fn over_the_top(geometry: &Geometry, z: f64) -> Option<DVec3> {
        caught(geometry, dvec3(4.0, 5.0, z), dvec3(16.0, 5.0, z))
    }

    #[test]
    fn packets_are_caught_within_half_a_wavelength_on_either_side_of_the_rim() {
        let geometry = screened();
        for z in [2.51, 2.9, 3.1, 3.49] {
            let place = over_the_top(&geometry, z).unwrap();
            assert!(place.distance(dvec3(10.0, 5.0, 3.0)) < 1e-4, "{z}: {place}");
        }
        for z in [1.0, 2.49, 3.51, 5.0] {
            assert!(over_the_top(&geometry, z).is_none(), "{z}");
        }
        // The screen stands on the floor: its foot is no edge.
        assert!(over_the_top(&geometry, 0.1).is_none());
        assert!(caught(&geometry, dvec3(16.0, 5.0, 2.8), dvec3(4.0, 5.0, 2.8)).is_some(), "from behind");
    }

    #[test]
    fn the_nearest_edge_catches() {
        let geometry = screened();
        let place = caught(&geometry, dvec3(4.0, 3.1, 2.8), dvec3(16.0, 3.1, 2.8)).unwrap();
        assert!(place.distance(dvec3(10.0, 3.0, 2.8)) < 1e-4, "{place}");
        let place = caught(&geometry, dvec3(4.0, 3.2, 2.9), dvec3(16.0, 3.2, 2.9)).unwrap();
        assert!(place.distance(dvec3(10.0, 3.2, 3.0)) < 1e-4, "{place}");
    }

    #[test]
    fn no_zone_reaches_through_a_wall() {
        let mut mesh = Mesh::shoebox([20.0, 10.0, 6.0], [0; 6]);
        sheet(&mut mesh, [[10.0, 3.0, 0.0], [10.0, 7.0, 0.0], [10.0, 7.0, 3.0], [10.0, 3.0, 3.0]]);
        // A shelf 0.2 m above the rim.
        sheet(&mut mesh, [[8.0, 2.0, 3.2], [12.0, 2.0, 3.2], [12.0, 8.0, 3.2], [8.0, 8.0, 3.2]]);
        let geometry = Geometry::build(mesh).unwrap();
        assert!(over_the_top(&geometry, 3.1).is_some());
        let over_the_shelf = caught(&geometry, dvec3(9.0, 5.0, 3.4), dvec3(11.0, 5.0, 3.4));
        assert!(over_the_shelf.is_none(), "{over_the_shelf:?}");
    }

    /// A solid block: both its faces are continued, and whoever leaves its edge stays in the air.
    #[test]
    fn a_block_is_left_into_the_air() {
        let mut mesh = Mesh::shoebox([20.0, 10.0, 6.0], [0; 6]);
        let mut block = Mesh::shoebox([4.0, 4.0, 3.0], [0; 6]);
        let first = mesh.vertices.len() as u32;
        for triangle in &mut block.triangles {
            triangle.corners = triangle.corners.map(|corner| first + corner);
            triangle.corners.swap(1, 2);
        }
        mesh.vertices.extend(block.vertices.iter().map(|vertex| *vertex + dvec3(8.0, 3.0, 0.0)));
        mesh.triangles.extend(block.triangles);
        let geometry = Geometry::build(mesh).unwrap();
        // Onto the side face, over its continuation, onto the top, over the continuation of the top.
        for (from, to) in [
            ([2.0, 5.0, 2.8], [19.0, 5.0, 2.8]),
            ([2.0, 5.0, 3.2], [19.0, 5.0, 3.2]),
            ([9.0, 5.0, 5.0], [8.3, 5.0, 3.0]),
            ([7.8, 5.0, 5.0], [7.7, 5.0, 1.0]),
        ] {
            let place = caught(&geometry, DVec3::from_array(from), DVec3::from_array(to)).unwrap();
            assert!(place.distance(dvec3(8.0, 5.0, 3.0)) < 1e-4, "{from:?}: {place}");
        }
        let edge = geometry.diffracting_edges().next().unwrap();
        let place = geometry.to_local(0.5 * (edge.ends[0] + edge.ends[1]));
        let caught = ZoneHit { edge: 0, place, sector: &edge.sectors[0] };
        for step in 0..1000_u16 {
            let u = [f32::from(step) / 1000.0, f32::from(step * 37 % 1000) / 1000.0];
            let (departure, direction) = caught.onward(&geometry, u);
            let hit = geometry.closest_hit(departure, direction).unwrap();
            assert!(hit.distance > 1.0, "{direction} ends after {} m", hit.distance);
        }
    }

    /// Mean cosine with the middle of the air: ½ for directions uniform on the hemisphere; Lambert's ⅔ is rejected.
    #[test]
    fn an_edge_sends_evenly_into_its_hemisphere() {
        let geometry = screened();
        let edge = geometry.diffracting_edges().next().unwrap();
        let sector = &edge.sectors[0];
        let caught = ZoneHit { edge: 0, place: geometry.to_local(edge.ends[0]), sector };
        let cells = 64_u16;
        let grid = (0..cells * cells).map(|cell| {
            [
                (f32::from(cell % cells) + 0.5) / f32::from(cells),
                (f32::from(cell / cells) + 0.5) / f32::from(cells),
            ]
        });
        let mean = |cosine: &dyn Fn([f32; 2]) -> f64| {
            grid.clone().map(cosine).sum::<f64>() / f64::from(cells * cells)
        };
        let even = mean(&|u| caught.onward(&geometry, u).1.as_dvec3().dot(sector.middle()));
        let lambert = mean(&|u| f64::from(warp::cosine_hemisphere(u).z));
        assert!((even - 0.5).abs() < 1e-3, "{even}");
        assert!((lambert - 0.5).abs() > 0.1);
    }
}
