//! Advice on scattering coefficients: bare walls without any, and what waves do at low frequencies and rays do not.
//!
//! Sound between bare walls stays as it is until it is scattered. Two things turn it aside that rays do not see, and one coefficient of all
//! surfaces stands for both: s = max(0.1, a) + 0.2 Σ S m / Σ S.
//!
//! - Objects: desks, seats, shelves. Over the objects of the surface S, m = min(1, (1.5 w f/c)⁴): 0.3 is the usual s of furnished rooms,
//!   and a body of the width w, half its surface over its diagonal, scatters as Rayleigh's while it is less than two thirds of a wave across
//!   (docs/diffraction.md). An object is what convex edges hold together; what reaches across the room along an axis is a wall. Where all
//!   objects are low, as rows of seats in a high hall without a balcony, sound travels above them and they count for nothing.
//! - Absorption beside the way: no ray along a ceiling meets it, but the wave of order zero between floor and ceiling loses c B/V to their
//!   admittance B = Σ β S, half of what others lose. Rays do when they are scattered at that rate where they hit, c s N/2V with the area N across
//!   their way: a = 2 B / (κ N), of rays that lose κ of α where they hit ([`sonel_acoustics::modes`]). An admittance pushes the wave away: 1/(1 + 2x²/π²),
//!   x = kβh at a distance h, which is exact for small and for large x.
//!
//! Compared with waves from 63 to 250 Hz (docs/validation.md).

use glam::{DMat3, DVec3, Vec3Swizzles};
use sonel_acoustics::absorption_law::impedance;
use sonel_acoustics::modes::spared;
use sonel_acoustics::{AbsorptionLaw, Material};
use sonel_geometry::{Connected, Geometry, SurfaceId};

use crate::{Design, Scene};

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
/// Least share of the height that objects take together [1]. Chosen between rooms that they do not mix, a twelfth and a tenth, and others, from 0.135 on.
const TALL: f64 = 0.12;
/// Part of the surfaces beside a way that sound along it hits too [1]: its directions are up to 0.6 rad off an axis. Fitted to T30 of fifteen rooms:
/// five with absorbing ceilings were off by −2, +4, +12 % on average at 63, 125, 250 Hz; with half by −12, −8, −1, with twice by +22, +30, +34 %.
const ASIDE: f64 = 0.3;
/// Difference of scattering coefficients from which on the rule is named. Chosen: with it T changes by a tenth where absorption is uneven.
const NAMED: f64 = 0.02;
/// Frequency up to which the rule was compared with waves [Hz] (docs/validation.md).
const HIGHEST: f64 = 250.0;

/// The advice on `scene` and its variants, a sentence each.
pub(super) fn advice(scene: &Scene, geometry: &Geometry) -> Vec<String> {
    let by_rule = |(of, materials): (String, Vec<Material>)| {
        let rule = rule(scene, geometry, &materials)?.into_iter().zip(scene.bands.nominal());
        let least = rule.filter(|(s, _)| *s > 0.0).map(|(s, band)| format!("{s} at {band} Hz"));
        let least = least.collect::<Vec<String>>().join(", ");
        Some(format!(
            "{of}: waves are mixed more than rays: scattering of all surfaces is at least {least} (docs/validation.md)"
        ))
    };
    let of_design = |it: &Design| Some((format!("variants.{}", it.name), scene.design(&it.name)?));
    let designs = scene.designs.iter().filter_map(of_design);
    let all = std::iter::once(("materials".to_owned(), scene.materials.clone())).chain(designs);
    flat_walls(scene, geometry).into_iter().chain(all.filter_map(by_rule)).collect()
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

/// Materials with less scattering than the rule in some band, and the coefficients with it as a list of the scene file.
pub(crate) fn advised(scene: &Scene, geometry: &Geometry) -> Vec<(usize, String)> {
    let Some(rule) = rule(scene, geometry, &scene.materials) else { return Vec::new() };
    let with_rule = |(index, material): (usize, &Material)| {
        let stated = &material.scattering;
        let list: Vec<f64> = rule.iter().zip(stated).map(|(s, stated)| stated.max(*s)).collect();
        (list != *stated).then(|| (index, format!("{list:?}")))
    };
    scene.materials.iter().enumerate().filter_map(with_rule).collect()
}

/// The least scattering of all surfaces by the rule where walls are of `materials`, per band [1]; 0 where it says nothing. None where no wall has less.
fn rule(scene: &Scene, geometry: &Geometry, materials: &[Material]) -> Option<Vec<f64>> {
    let volume = geometry.volume()?;
    let (objects, axes) = (mixing_objects(scene, geometry), axes(scene, geometry));
    let area: f64 = objects.iter().map(|object| object.area).sum();
    let of_band = |band: usize| {
        let per_metre = scene.bands.exact_midband(band) / scene.speed_of_sound;
        let scattered = |object: &Object| {
            let waves = WIDE * per_metre * 0.5 * object.area / object.low.distance(object.high);
            object.area * libm::pow(waves, 4.0).min(1.0)
        };
        let share = objects.iter().map(scattered).sum::<f64>() / area.max(f64::MIN_POSITIVE);
        let beta = |m: u32| impedance(materials[m as usize].absorption[band]).map_or(1.0, f64::recip);
        let beside = beside_the_way(geometry, axes, beta, [volume, per_metre.recip()]);
        let s = (beside.max(FLAT) + (FURNISHED - FLAT) * share).min(1.0);
        if s <= FLAT || scene.bands.nominal()[band] > HIGHEST { 0.0 } else { (100.0 * s).round() / 100.0 }
    };
    let rule: Vec<f64> = (0..scene.bands.count()).map(of_band).collect();
    let is_less = |(index, material): (u32, &Material)| {
        let differs = rule.iter().zip(&material.scattering).any(|(s, stated)| s - stated > NAMED);
        differs && geometry.exposed_area(index) > 0.0
    };
    (0..).zip(materials).any(is_less).then_some(rule)
}

/// Along up, along what faces the largest wall, and along that wall.
fn axes(scene: &Scene, geometry: &Geometry) -> DMat3 {
    let faces = geometry.surfaces().iter().map(|it| it.area * it.normal.reject_from(scene.up));
    let largest = faces.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let across = largest.and_then(DVec3::try_normalize).unwrap_or(scene.up.any_orthonormal_vector());
    DMat3::from_cols(scene.up, across, scene.up.cross(across)).transpose()
}

/// Scattering along the axis that needs most of it [1], where walls have the specific `admittance` of a material; volume [m³] and wavelength [m].
fn beside_the_way(
    geometry: &Geometry,
    axes: DMat3,
    admittance: impl Fn(u32) -> f64,
    [volume, wavelength]: [f64; 2],
) -> f64 {
    let (mut area, mut absorbing) = (DVec3::ZERO, DVec3::ZERO);
    for (id, surface) in (0..).map(SurfaceId).zip(geometry.surfaces()) {
        let cosines = axes * surface.normal;
        let facing = geometry.exposed(id) * cosines * cosines;
        (area, absorbing) = (area + facing, absorbing + admittance(surface.material) * facing);
    }
    let pushed = 8.0 * volume / wavelength * absorbing / (area * area);
    let walls = DMat3::from_diagonal(area / (2.0 * volume));
    let lost = 2.0 * absorbing / (1.0 + 2.0 * pushed * pushed) / (1.0 - spared(walls, wavelength));
    let beside = |lost: DVec3, other: DVec3| lost / (area + ASIDE * other);
    (beside(lost.yzx(), area.zxy()) + beside(lost.zxy(), area.yzx())).max_element()
}

/// What stands or hangs in a room: its surface [m²] and the box about it [m].
struct Object {
    area: f64,
    low: DVec3,
    high: DVec3,
}

/// The objects of a room, if they are enough to mix its sound.
fn mixing_objects(scene: &Scene, geometry: &Geometry) -> Vec<Object> {
    let objects = objects(geometry);
    let area: f64 = objects.iter().map(|object| object.area).sum();
    let (low, high) = geometry.bounds();
    let bottom = objects.iter().map(|object| object.low).fold(high, DVec3::min);
    let top = objects.iter().map(|object| object.high).fold(low, DVec3::max);
    let are_low = (top - bottom).dot(scene.up) < TALL * (high - low).dot(scene.up);
    if are_low || area < SHARE * geometry.area() { Vec::new() } else { objects }
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
        let walls = Material::uniform("walls", 0.05, 0.1, OCTAVES.len());
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
        let (scene, geometry) = room([1.25, 0.5, 0.3], &desks(16));
        assert!(advised(&scene, &geometry).is_empty());
    }

    /// Waves of order zero under a ceiling of α = 0.6 in a room of 20 m × 14 m × 3 m lose c β/h, and least at high frequencies.
    #[test]
    fn sound_is_scattered_where_a_ceiling_absorbs_beside_its_way() {
        let advice = |ceiling: f64, turned: f64| {
            let bands = Bands::new(OCTAVES.to_vec(), BandWidth::Octave).unwrap();
            let mut mesh = Mesh::shoebox([20.0, 14.0, 3.0], [0, 0, 0, 0, 0, 1]);
            let turn = glam::DQuat::from_rotation_z(turned);
            mesh.vertices.iter_mut().for_each(|vertex| *vertex = turn * *vertex);
            let materials = [("walls", 0.06), ("ceiling", ceiling)];
            let materials = materials.map(|(name, absorption)| Material::uniform(name, absorption, 0.1, 4));
            let place = turn * DVec3::splat(1.0);
            let scene = Scene::from_parts(mesh, materials.to_vec(), bands, 1.0)
                .with_source("source", place.to_array());
            advised(&scene, &scene.geometry().unwrap())
        };
        let (wavelength, size) = (343.0 / 250.0, DVec3::new(20.0, 14.0, 3.0));
        let beta = |absorption: f64| impedance(absorption).unwrap().recip();
        let (up, across) = (280.0 * (beta(0.06) + beta(0.6)), 120.0 * beta(0.06));
        let lost =
            |b: f64, area: f64| 2.0 * b / (1.0 + 2.0 * (8.0 * 840.0 / wavelength * b / area.powi(2)).powi(2));
        let of_rays = lost(up, 560.0) / (84.0 + 0.3 * 120.0) + lost(across, 120.0) / (84.0 + 0.3 * 560.0);
        let expected = of_rays / (1.0 - spared(DMat3::from_diagonal(size.recip()), wavelength));
        for turned in [0.0, 0.4] {
            let found = advice(0.6, turned);
            assert_eq!(found.len(), 2, "walls and ceiling");
            let of_band: Vec<f64> =
                found[0].1.trim_matches(['[', ']']).split(", ").map(|s| s.parse().unwrap()).collect();
            assert!((of_band[2] - expected).abs() < 0.006, "{of_band:?}, {expected}");
            assert!(of_band[0] > of_band[1] && of_band[1] > of_band[2] && of_band[3] < 0.11, "{of_band:?}");
        }
        assert!(advice(0.06, 0.0).is_empty());
    }
}
