//! The boundary term: what the modes of a room are at low frequencies and rays are not.
//!
//! - Absorption. Modes of order zero between two walls have half the energy there that others have, and lose half as much. With p the mean share
//!   of such modes every wall absorbs κ = 1 − p/2 of its α ([`sonel_acoustics::modes`]): decays are 1/κ as long.
//! - Levels. Waves are in phase where a wall reflects them, so that a layer of λ/8 there holds as much energy again [Waterhouse1955]. Rays spread the same
//!   energy over the volume alone: in the interior they are too loud by 1 + t, t = λ/(2ℓ) with the mean free path ℓ = 4V/S, which ISO 3741 calls
//!   the boundary correction. Where walls are not much farther apart than half a wave, waves of order zero take over, which have no node there. Levels
//!   of steady sound change by κ/(1 + t) + Σ (λ/2L)³/3 of three axes with distances L between walls, whatever the lesser absorption would make of
//!   them. The sum, fitted to eight rooms of 21 to 190 m³ at 63 Hz, and this κ, chosen with 31 rooms up to 250 Hz in view, are our own
//!   (docs/validation.md). Beyond 1.1, the largest of these rooms, the sum stays.
//!
//! Walls are those of random flights, for levels about the receiver, so a room with a door counts as itself, for absorption about the sources. What comes
//! back from a wall with the amplitude r is in phase by 2r/(1 + r²) of its energy: a black wall has no layer, and is a hole to all of the room. Where
//! half of the flights are lost there is no room. Holds for receivers a quarter of a wavelength off the walls.

use glam::{DMat3, Vec3};
use sonel_acoustics::Material;
use sonel_acoustics::modes::{facing, spared, trace};
use sonel_geometry::{Departure, Geometry};
use sonel_map::{BandValues, CoefficientTable, Lanes, to_lanes};
use sonel_sampling::{Frame, Purpose, StreamFamily, warp};
use sonel_scene::Scene;

/// Highest centre of a band with the term [Hz]: waves were compared up to 250 Hz, in one room to 500 Hz (docs/validation.md).
pub const HIGHEST_HZ: f64 = 500.0;
/// Random walks from a receiver, and flights of each: with them the term has a standard error of 0.01 dB in a room of one wavelength.
const WALKS: u64 = 512;
const FLIGHTS: u32 = 12;
/// First flights, which depend on the place: the fifth from a corner of a box is 2 % short in the mean.
const FORGOTTEN: u32 = 4;
/// Largest sum of walls near one another that waves were compared with [1]: rooms of 21 and 23 m³ at 63 Hz (docs/validation.md).
const NEAREST: f64 = 1.1;

/// Wavelengths in air at the centres of bands [m]; none above the [highest](HIGHEST_HZ).
pub fn wavelengths(scene: &Scene) -> Vec<f64> {
    let of_band = |&f: &f64| if f > HIGHEST_HZ { 0.0 } else { scene.speed_of_sound / f };
    scene.bands.nominal().iter().map(of_band).collect()
}

/// What walls are to the modes of a room.
pub(crate) struct Modes {
    /// The materials of the scene as modes meet them.
    pub materials: Vec<Material>,
    /// What they absorb, of what they absorb of rays [1], per band.
    pub absorbed: Vec<f64>,
    wavelengths: Vec<f64>,
}

impl Modes {
    /// Of the room about the sources.
    pub(crate) fn new(geometry: &Geometry, table: &CoefficientTable, scene: &Scene) -> Self {
        let sources: Vec<Vec3> = scene.sources.iter().map(|it| geometry.to_local(it.position)).collect();
        let (walls, wavelengths) = (walls_about(geometry, table, &sources), wavelengths(scene));
        let absorbed = walls.iter().zip(&wavelengths).map(|(walls, of)| 1.0 - spared(2.0 * *walls, *of));
        let absorbed: Vec<f64> = absorbed.collect();
        let mut materials = scene.materials.clone();
        for Material { absorption, transmission, .. } in &mut materials {
            for ((absorption, through), absorbed) in absorption.iter_mut().zip(transmission).zip(&absorbed) {
                *absorption = *through + absorbed * (*absorption - *through);
            }
        }
        Self { materials, absorbed, wavelengths }
    }

    /// Factors on the energy of everything but direct sound at a `place` (about the scene's centre [m]), per band.
    pub(crate) fn weights(&self, geometry: &Geometry, table: &CoefficientTable, place: Vec3) -> Vec<Lanes> {
        let walls = walls_about(geometry, table, &[place]).into_iter().zip(&self.wavelengths);
        let weights = walls.map(|(walls, wavelength)| weight(walls, *wavelength)).zip(&self.absorbed);
        to_lanes(weights.map(|(weight, absorbed)| absorbed * weight))
    }
}

/// Factor on levels where flights meet the `walls` that [`facing`] adds up to [1/m], at a wavelength [m].
pub fn weight(walls: DMat3, wavelength: f64) -> f64 {
    let layers = 0.5 * wavelength * walls;
    let interior = (1.0 - spared(2.0 * walls, wavelength)) / (1.0 + trace(layers));
    interior + (8.0 / 3.0 * trace(layers * layers * layers)).min(NEAREST)
}

/// n nᵀ/ℓ of flights between walls about `places`, times (1 − e)(1 − 2e) where a share e of them is lost [1/m], per band.
fn walls_about(geometry: &Geometry, table: &CoefficientTable, places: &[Vec3]) -> Vec<DMat3> {
    let family = StreamFamily::new(0, Purpose::BoundaryFlight, [0; 4]);
    let (mut flights, mut length, mut layers) = (0.0, 0.0, vec![DMat3::ZERO; table.bands()]);
    for walk in 0..WALKS {
        let mut stream = family.stream(walk);
        let mut from = Departure::free(places[walk as usize % places.len()]);
        let mut direction = warp::uniform_sphere(stream.uniform_pair());
        for flight in 0..FLIGHTS {
            let counted = f64::from(flight >= FORGOTTEN);
            let Some(hit) = geometry.closest_hit(from, direction) else {
                flights += counted;
                break;
            };
            length += counted * f64::from(hit.distance);
            let surface = geometry.surface(hit.surface);
            if surface.interface {
                from = geometry.leave(hit.position, hit.surface, hit.side.opposite());
                continue;
            }
            flights += counted;
            let row = table.mean_row(hit.surface);
            let reflected = row.specular.energy.values().zip(row.diffuse.energy.values());
            for (layer, (specular, diffuse)) in layers.iter_mut().zip(reflected) {
                let square = specular + diffuse;
                *layer += counted * 2.0 * square.sqrt() / (1.0 + square) * facing(surface.normal);
            }
            from = geometry.leave(hit.position, hit.surface, hit.side);
            let outward = (hit.side.sign() * surface.normal).as_vec3().normalize();
            direction = Frame::about(outward).outward(warp::cosine_hemisphere(stream.uniform_pair()));
        }
    }
    let kept = |layer: DMat3| (2.0 * trace(layer) / flights - 1.0).max(0.0) / length.max(f64::MIN_POSITIVE);
    layers.into_iter().map(|layer| kept(layer) * layer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use sonel_acoustics::Material;
    use sonel_geometry::{Mesh, MeshTriangle};

    const SIZE: [f64; 3] = [9.0, 6.0, 4.0];

    /// A box with a share of its ceiling.
    fn room(ceiling: f64) -> Geometry {
        let mut mesh = Mesh::shoebox(SIZE, [0; 6]);
        let is_above = |t: &MeshTriangle| t.corners.iter().all(|&c| mesh.vertices[c as usize].z >= SIZE[2]);
        let walls: Vec<MeshTriangle> = mesh.triangles.iter().filter(|t| !is_above(t)).copied().collect();
        mesh.triangles = walls;
        let first = mesh.vertices.len() as u32;
        let length = SIZE[0] * ceiling;
        let corners = [[0.0, 0.0], [length, 0.0], [length, SIZE[1]], [0.0, SIZE[1]]];
        mesh.vertices.extend(corners.map(|[x, y]| DVec3::new(x, y, SIZE[2])));
        for corners in [[0, 2, 1], [0, 3, 2]].into_iter().filter(|_| ceiling > 0.0) {
            mesh.triangles.push(MeshTriangle { corners: corners.map(|corner| corner + first), material: 0 });
        }
        Geometry::build(mesh).unwrap()
    }

    /// Of walls that reflect everything, or absorb a share of it.
    fn about_walls(geometry: &Geometry, absorption: f64, [x, y, z]: [f64; 3]) -> f64 {
        let table = CoefficientTable::new(&[Material::uniform("walls", absorption, 0.5, 1)], 1, 0.15);
        let place = geometry.to_local(DVec3::new(x, y, z));
        trace(walls_about(geometry, &table.with_geometry(geometry), &[place])[0])
    }

    fn about(geometry: &Geometry, place: [f64; 3]) -> f64 {
        about_walls(geometry, 0.0, place)
    }

    #[test]
    fn flights_between_walls_are_as_long_as_the_mean_free_path() {
        let geometry = room(1.0);
        let expected = geometry.area() / (4.0 * geometry.volume().unwrap());
        for place in [[4.5, 3.0, 2.0], [8.5, 5.5, 0.2]] {
            let found = about(&geometry, place);
            assert!((found / expected - 1.0).abs() < 0.03, "{found} of {expected} at {place:?}");
        }
    }

    /// A share of the walls is missing: the layers are, and the room loses its character as much again. Outdoors there are none.
    #[test]
    fn a_hole_takes_its_share_and_the_open_takes_all() {
        let (closed, middle) = (room(1.0), [4.5, 3.0, 2.0]);
        let whole = about(&closed, middle);
        for missing in [0.01, 0.05, 0.2] {
            let found = about(&room(1.0 - missing), middle);
            let share = missing * SIZE[0] * SIZE[1] / closed.area();
            assert!((found / whole - (1.0 - 2.0 * share)).abs() < 0.03, "{missing}: {found} of {whole}");
        }
        let ground = Mesh {
            triangles: Mesh::shoebox(SIZE, [0; 6]).triangles[..2].to_vec(),
            ..Mesh::shoebox(SIZE, [0; 6])
        };
        assert!(about(&Geometry::build(ground).unwrap(), middle) <= 0.0);
    }

    /// Half of the energy that walls take leaves almost all of the layer; black walls have none.
    #[test]
    fn black_walls_have_no_layer() {
        let (closed, middle) = (room(1.0), [4.5, 3.0, 2.0]);
        let share = |absorption: f64| about_walls(&closed, absorption, middle) / about(&closed, middle);
        assert!(share(0.3) > 0.95 && share(0.5) > 0.8 && share(1.0) <= 0.0, "{} {}", share(0.3), share(0.5));
    }

    #[test]
    fn the_term_ends_above_its_highest_band_and_in_small_rooms() {
        let walls = DMat3::from_diagonal(DVec3::new(0.1, 0.2, 0.2));
        let absorbed = [2.0, 10.0].map(|wavelength| 1.0 - spared(2.0 * walls, wavelength));
        assert!((weight(walls, 2.0) - (absorbed[0] / 1.5 + 0.136 / 3.0)).abs() < 1e-12);
        assert!((weight(walls, 10.0) - (absorbed[1] / 3.5 + NEAREST)).abs() < 1e-12);
        assert!((weight(walls, 0.0) - 1.0).abs() < 1e-12);
    }
}
