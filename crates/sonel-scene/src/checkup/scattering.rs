//! Advice on scattering coefficients: bare walls without any, and what objects in the room add at low frequencies.
//!
//! Sound between bare walls stays as it is until objects scatter it: desks, seats, shelves. Rays do not see that waves pass what is small beside
//! them, so the coefficient of all surfaces is s = 0.1 + 0.2 Σ S m / Σ S over the objects of the surface S, with m = min(1, (1.5 w f/c)⁴):
//! 0.3 is the usual one of furnished rooms, and a body of the width w, half its surface over its diagonal, scatters as Rayleigh's while it is
//! less than two thirds of a wave across (docs/diffraction.md). An object is what convex edges hold together; what reaches across the
//! room along an axis is a wall. Where all objects are low, as rows of seats in a high hall without a balcony, sound travels
//! above them and there is no advice. Compared with waves from 63 to 250 Hz (docs/validation.md).

use glam::DVec3;
use sonel_acoustics::{AbsorptionLaw, Material};
use sonel_geometry::{Connected, Geometry, SurfaceId};

use crate::Scene;

/// Absorption below which a wall counts as hard [1]: sound reflects 60 times and more within a reverberation time. Chosen, not measured; doubled,
/// rooms with moderate absorption are named too.
const HARD: f64 = 0.2;
/// Scattering of bare walls [1]: below it, half of the energy stays specular over seven reflections. The default of scenes.
const FLAT: f64 = 0.1;
/// Scattering of rooms with objects larger than the wave [1] (docs/formats/scene.md).
const FURNISHED: f64 = 0.3;
/// Widths of an object per wave from which on it scatters all that it does [1], as that of edges (docs/diffraction.md).
const WIDE: f64 = 1.5;
/// Least share of the surface that is of objects [1]. Chosen: a column or a lectern does not mix the sound of a room.
const SHARE: f64 = 0.05;
/// Least share of the height that objects take together [1]. Chosen between rooms that they do not mix, a twelfth and a tenth, and a fifth.
const TALL: f64 = 0.15;
/// Difference of scattering coefficients from which on the rule is named. Chosen: with it T changes by a tenth where absorption is uneven.
const NAMED: f64 = 0.02;
/// Frequency up to which the rule was compared with waves [Hz] (docs/validation.md).
const HIGHEST: f64 = 250.0;

/// The advice on `scene`, a sentence each.
pub(super) fn advice(scene: &Scene, geometry: &Geometry) -> Vec<String> {
    let sentence = |(index, list): (usize, String)| {
        let name = &scene.materials[index].name;
        format!("materials.{name}: objects in the room scatter: scattering = {list} (docs/validation.md)")
    };
    let objects = advised(scene, geometry).into_iter().map(sentence);
    flat_walls(scene, geometry).into_iter().chain(objects).collect()
}

/// Says so where most of a closed room is hard, flat and uniformly absorbing in some band.
fn flat_walls(scene: &Scene, geometry: &Geometry) -> Option<String> {
    geometry.volume()?;
    let is_flat = |material: &Material, band: usize| {
        let [absorption, scattering] = [material.absorption[band], material.scattering[band]];
        material.law == AbsorptionLaw::Uniform && absorption < HARD && scattering < FLAT
    };
    let share = |(band, center)| {
        let flat = (0_u32..).zip(&scene.materials).filter(|(_, material)| is_flat(material, band));
        (flat.map(|(index, _)| geometry.exposed_area(index)).sum::<f64>() / geometry.area(), center)
    };
    let shares = scene.bands.nominal().iter().enumerate().map(share);
    let (share, center) = shares.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(share, _)| *share > 0.5)?;
    Some(format!(
        "{:.0} % of the surface is hard and flat (absorption below {HARD}, scattering below {FLAT}) at {center} Hz: simulated sound between bare parallel walls decays more slowly than in measured rooms; use scattering of {FLAT} in a bare room, {FURNISHED} in a furnished one, or absorption_law = \"locally-reacting\" for hard walls (docs/validation.md)",
        100.0 * share
    ))
}

/// Materials whose scattering is below that of the rule in some band, and the coefficients with it as a list of the scene file.
pub(crate) fn advised(scene: &Scene, geometry: &Geometry) -> Vec<(usize, String)> {
    let objects = if geometry.volume().is_some() { objects(geometry) } else { Vec::new() };
    let area: f64 = objects.iter().map(|object| object.area).sum();
    let (low, high) = geometry.bounds();
    let bottom = objects.iter().map(|object| object.low).fold(high, DVec3::min);
    let top = objects.iter().map(|object| object.high).fold(low, DVec3::max);
    if (top - bottom).dot(scene.up) < TALL * (high - low).dot(scene.up) || area < SHARE * geometry.area() {
        return Vec::new();
    }
    let by_rule = |(band, stated): (usize, &f64)| {
        let per_metre = scene.bands.exact_midband(band) / scene.speed_of_sound;
        let scattered = |object: &Object| {
            let waves = WIDE * per_metre * 0.5 * object.area / object.low.distance(object.high);
            object.area * libm::pow(waves, 4.0).min(1.0)
        };
        let s = FLAT + (FURNISHED - FLAT) * objects.iter().map(scattered).sum::<f64>() / area;
        if scene.bands.nominal()[band] > HIGHEST { *stated } else { stated.max((100.0 * s).round() / 100.0) }
    };
    let of_material = |(index, material): (usize, &Material)| {
        let advised: Vec<f64> = material.scattering.iter().enumerate().map(by_rule).collect();
        let differs = advised.iter().zip(&material.scattering).any(|(advised, s)| advised - s > NAMED);
        (differs && geometry.exposed_area(index as u32) > 0.0).then(|| (index, format!("{advised:?}")))
    };
    scene.materials.iter().enumerate().filter_map(of_material).collect()
}

/// What stands or hangs in a room: its surface [m²] and the box about it [m].
struct Object {
    area: f64,
    low: DVec3,
    high: DVec3,
}

fn objects(geometry: &Geometry) -> Vec<Object> {
    let count = geometry.surfaces().len();
    let (mut connected, mut has_rim) = (Connected::new(count), vec![false; count]);
    for edge in geometry.diffracting_edges() {
        edge.surfaces.windows(2).for_each(|pair| connected.join(pair[0].0, pair[1].0));
        edge.surfaces.iter().for_each(|id| has_rim[id.0 as usize] = true);
    }
    let (low, high) = geometry.bounds();
    let across = 0.99 * (high - low);
    let object = |group: Vec<u32>| {
        let ids = || group.iter().copied().map(SurfaceId);
        let triangles: Vec<u32> = ids().flat_map(|id| &geometry.surface(id).triangles).copied().collect();
        let (low, high) = geometry.mesh().bounds_of(&triangles);
        let is_wall = !has_rim[group[0] as usize] || (high - low).cmpge(across).any();
        (!is_wall).then(|| Object { area: ids().map(|id| geometry.exposed(id)).sum(), low, high })
    };
    connected.groups(0..count as u32).into_iter().filter_map(object).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{BandWidth, Bands};
    use sonel_geometry::{Mesh, MeshTriangle};

    const OCTAVES: [f64; 4] = [63.0, 125.0, 250.0, 1000.0];

    /// A room of 9 m × 7 m × 3 m with blocks of `size` [m] at `places` [m].
    fn room(size: [f64; 3], places: &[[f64; 3]]) -> (Scene, Geometry) {
        let bands = Bands::new(OCTAVES.to_vec(), BandWidth::Octave).unwrap();
        let mut mesh = Mesh::shoebox([9.0, 7.0, 3.0], [0; 6]);
        for &place in places {
            let first = mesh.vertices.len() as u32;
            let block = Mesh::shoebox(size, [0; 6]);
            mesh.vertices.extend(block.vertices.iter().map(|vertex| *vertex + DVec3::from(place)));
            mesh.triangles.extend(block.triangles.iter().map(|triangle| {
                let [a, b, c] = triangle.corners.map(|corner| corner + first);
                MeshTriangle { corners: [a, c, b], ..*triangle }
            }));
        }
        let walls = Material::uniform("walls", 0.3, 0.1, OCTAVES.len());
        let scene = Scene::from_parts(mesh, vec![walls], bands, 1.0).with_source("source", [0.3, 0.3, 0.3]);
        let geometry = scene.geometry().unwrap();
        (scene, geometry)
    }

    fn desks(count: usize) -> Vec<[f64; 3]> {
        (0..count).map(|i| [1.0 + 2.0 * (i % 4) as f64, 1.0 + 1.5 * (i / 4) as f64, 0.2]).collect()
    }

    /// A desk of 1.25 m × 0.5 m × 0.75 m is as large as a wave at 250 Hz and passed by that of 63 Hz.
    #[test]
    fn desks_mix_the_sound_of_waves_that_are_not_longer() {
        let (scene, geometry) = room([1.25, 0.5, 0.75], &desks(16));
        let surface = 2.0 * (1.25 * 0.5 + 0.5 * 0.75 + 1.25 * 0.75);
        let width = 0.5 * surface / (1.25_f64.powi(2) + 0.25 + 0.75 * 0.75).sqrt();
        let share = |f: f64| (1.5 * width * f / scene.speed_of_sound).powi(4).min(1.0);
        let exact = scene.bands.exact_midband(1);
        let expected = (100.0 * (0.1 + 0.2 * share(exact))).round() / 100.0;
        let advice = advised(&scene, &geometry);
        assert_eq!(advice, [(0, format!("[0.1, {expected:?}, 0.3, 0.1]"))]);
        assert!(expected > 0.1 && expected < 0.2);
    }

    #[test]
    fn few_objects_and_partitions_mix_none() {
        let (scene, geometry) = room([1.25, 0.5, 0.75], &desks(2));
        assert!(advised(&scene, &geometry).is_empty());
        // From one wall to the opposite one.
        let (scene, geometry) = room([9.0, 0.5, 2.0], &[[0.0, 3.0, 0.5]]);
        assert!(advised(&scene, &geometry).is_empty());
        let (scene, geometry) = room([7.0, 0.5, 2.0], &[[1.0, 3.0, 0.5]]);
        assert_eq!(advised(&scene, &geometry).len(), 1);
    }

    #[test]
    fn sound_travels_above_low_objects() {
        let (scene, geometry) = room([1.25, 0.5, 0.4], &desks(16));
        assert!(advised(&scene, &geometry).is_empty());
    }
}
