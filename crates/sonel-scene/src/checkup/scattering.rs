//! Advice on scattering coefficients: large bare walls, and faces that are small beside the wave.
//!
//! A face scatters at its rim as well, the more the smaller it is beside the wave, whatever its surface. ODEON's rule [ChristensenRindel2005] makes
//! s = 1 − (1 − s₀) K_w K_l of the scattering coefficient s₀ of the surface, with K = min(1, f/f₀) for the width w and the length l of a face,
//! f₀ = c a/(2 (w cos θ)²) and c a/(2 l²), a = 2 d₁ d₂/(d₁ + d₂) by the distances of source and receiver. Here both distances are the mean
//! free path and cos θ is 2/3, its mean in a diffuse field; l is the diagonal of the box about the face, and w its area over that. A face that ends in
//! corners of the room alone has no rim: its neighbours continue it as mirrors do, and K = 1.

use glam::DVec3;
use sonel_acoustics::{AbsorptionLaw, Material, mean_free_path};
use sonel_geometry::{Connected, Geometry, SurfaceId};

use crate::Scene;

/// Absorption below which a wall counts as hard [1]: sound reflects 60 times and more within a reverberation time. Chosen, not measured; doubled,
/// rooms with moderate absorption are named too.
const HARD: f64 = 0.2;
/// Scattering below which a wall counts as flat [1]: over seven reflections half of the energy stays specular. The default of scenes is just
/// not below it.
const FLAT: f64 = 0.1;
/// Mean of cos θ of sound that meets a wall in a diffuse field.
const MEAN_COSINE: f64 = 2.0 / 3.0;
/// Difference of scattering coefficients from which on the rule is named: about what a coefficient is known to.
const NAMED: f64 = 0.1;
/// Frequency up to which the rule was compared with waves [Hz] (docs/validation.md).
const HIGHEST: f64 = 250.0;
/// Cosine between the normals of two faces that continue one another as a curved wall does: 30°.
const CURVED: f64 = 0.866;

/// The advice on `scene`, a sentence each.
pub(super) fn advice(scene: &Scene, geometry: &Geometry) -> Vec<String> {
    flat_walls(scene, geometry).into_iter().chain(small_faces(scene, geometry)).collect()
}

/// Says so where most of a closed room is hard, flat and uniformly absorbing in some band.
fn flat_walls(scene: &Scene, geometry: &Geometry) -> Option<String> {
    geometry.volume()?;
    let share = |band: usize| {
        let is_flat = |material: &Material| {
            material.law == AbsorptionLaw::Uniform
                && material.absorption[band] < HARD
                && material.scattering[band] < FLAT
        };
        let area = |(index, material)| if is_flat(material) { geometry.exposed_area(index) } else { 0.0 };
        (0_u32..).zip(&scene.materials).map(area).sum::<f64>() / geometry.area()
    };
    let shares = scene.bands.nominal().iter().enumerate().map(|(band, center)| (share(band), center));
    let (share, center) = shares.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(share, _)| *share > 0.5)?;
    Some(format!(
        "{:.0} % of the surface is hard and flat (absorption below {HARD}, scattering below {FLAT}) at {center} Hz: simulated sound between bare parallel walls decays more slowly than in measured rooms; use scattering of 0.3, or absorption_law = \"locally-reacting\" for hard walls (docs/validation.md)",
        100.0 * share
    ))
}

/// Faces of one material that continue one another: a plane, or facets of a curve.
struct Face {
    material: u32,
    area: f64,
    low: DVec3,
    high: DVec3,
    /// Whether sound diffracts anywhere at its rim.
    has_rim: bool,
}

impl Face {
    /// K_w K_l of sound that comes and goes over distances of `free_path` [m], at `per_metre` waves a metre.
    fn specular_share(&self, free_path: f64, per_metre: f64) -> f64 {
        if !self.has_rim {
            return 1.0;
        }
        let length = self.low.distance(self.high);
        let share = |size: f64| (2.0 * size * size * per_metre / free_path).min(1.0);
        share(MEAN_COSINE * self.area / length) * share(length)
    }
}

/// For each material whose faces are small beside the wave in some band, the coefficients that the rule gives.
fn small_faces(scene: &Scene, geometry: &Geometry) -> Vec<String> {
    let Some(volume) = geometry.volume() else { return Vec::new() };
    let free_path = mean_free_path(volume, geometry.area());
    let faces = faces(geometry);
    let advise = |(index, material): (u32, &Material)| {
        let of_material: Vec<&Face> = faces.iter().filter(|face| face.material == index).collect();
        let area: f64 = of_material.iter().map(|face| face.area).sum();
        let surface = material.scattering.iter().copied().fold(1.0, f64::min);
        let advised = |(band, stated): (usize, &f64)| {
            let per_metre = scene.bands.exact_midband(band) / scene.speed_of_sound;
            let specular = |face: &&Face| face.area * face.specular_share(free_path, per_metre);
            let by_rule = 1.0 - (1.0 - surface) * of_material.iter().map(specular).sum::<f64>() / area;
            if scene.bands.nominal()[band] > HIGHEST { *stated } else { by_rule.max(*stated) }
        };
        let advised: Vec<f64> = material.scattering.iter().enumerate().map(advised).collect();
        let differs = advised.iter().zip(&material.scattering).any(|(by_rule, s)| by_rule - s > NAMED);
        (area > 0.0 && differs).then(|| {
            let list: Vec<String> = advised.iter().map(|s| format!("{s:.2}")).collect();
            format!(
                "materials.{}: its faces are small beside the wave and scatter at their rims: scattering = [{}] by ODEON's rule s = 1 − (1 − s₀) K_w K_l, s₀ = {surface} (docs/validation.md)",
                material.name,
                list.join(", ")
            )
        })
    };
    (0_u32..).zip(&scene.materials).filter_map(advise).collect()
}

fn faces(geometry: &Geometry) -> Vec<Face> {
    let count = geometry.surfaces().len();
    let mut connected = Connected::new(count);
    for pair in geometry.edges().iter().flat_map(|edge| edge.surfaces.windows(2)) {
        let [one, other] = [pair[0], pair[1]].map(|id| geometry.surface(id));
        if one.material == other.material && one.normal.dot(other.normal).abs() > CURVED {
            connected.join(pair[0].0, pair[1].0);
        }
    }
    let mut has_rim = vec![false; count];
    geometry.diffracting_edges().flat_map(|edge| &edge.surfaces).for_each(|id| has_rim[id.0 as usize] = true);
    let of_group = |group: Vec<u32>| {
        let ids = || group.iter().copied().map(SurfaceId);
        let triangles: Vec<u32> = ids().flat_map(|id| &geometry.surface(id).triangles).copied().collect();
        let (low, high) = geometry.mesh().bounds_of(&triangles);
        Face {
            material: geometry.surface(SurfaceId(group[0])).material,
            area: ids().map(|id| geometry.exposed(id)).sum(),
            low,
            high,
            has_rim: ids().any(|id| has_rim[id.0 as usize]),
        }
    };
    connected.groups(0..count as u32).into_iter().map(of_group).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{BandWidth, Bands};
    use sonel_geometry::Mesh;

    const OCTAVES: [f64; 4] = [63.0, 125.0, 500.0, 1000.0];

    /// A room of 20 m × 10 m × 6 m with a block of `size` [m] of another material on its floor.
    fn room(size: [f64; 3]) -> (Scene, Geometry) {
        let bands = Bands::new(OCTAVES.to_vec(), BandWidth::Octave).unwrap();
        let material = |name| Material::uniform(name, 0.3, 0.2, OCTAVES.len());
        let mut mesh = Mesh::shoebox([20.0, 10.0, 6.0], [0; 6]);
        let first = mesh.vertices.len() as u32;
        let block = Mesh::shoebox(size, [1; 6]);
        mesh.vertices.extend(block.vertices.iter().map(|vertex| *vertex + DVec3::new(1.0, 1.0, 0.5)));
        mesh.triangles.extend(block.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.corners.map(|corner| corner + first);
            sonel_geometry::MeshTriangle { corners: [a, c, b], ..*triangle }
        }));
        let scene = Scene::from_parts(mesh, vec![material("walls"), material("block")], bands, 1.0)
            .with_source("source", [0.3, 0.3, 0.3]);
        let geometry = scene.geometry().unwrap();
        (scene, geometry)
    }

    #[test]
    fn a_table_is_small_beside_the_wave_and_neither_a_stage_nor_a_wall_is() {
        let (hall, geometry) = room([0.8, 0.6, 0.7]);
        let advice = advice(&hall, &geometry);
        assert!(matches!(&advice[..], [one] if one.starts_with("materials.block:")), "{advice:?}");
        let (hall, geometry) = room([17.0, 7.0, 5.0]);
        assert!(super::advice(&hall, &geometry).is_empty());
    }

    /// A square of 1 m: K_w K_l is the square of 2 · ⅔ · 1 m² · f/(c a) while both are below 1.
    #[test]
    fn the_share_of_a_square_is_that_of_the_rule() {
        let high = DVec3::new(1.0, 1.0, 0.0);
        let face = Face { material: 0, area: 1.0, low: DVec3::ZERO, high, has_rim: true };
        let (free_path, per_metre) = (8.0, 250.0 / 343.0);
        let (length, width) = (2f64.sqrt(), 1.0 / 2f64.sqrt());
        let limit = |size: f64| 343.0 * free_path / (2.0 * size * size);
        let by_hand = (250.0 / limit(length)).min(1.0) * (250.0 / limit(width * 2.0 / 3.0)).min(1.0);
        assert!((face.specular_share(free_path, per_metre) - by_hand).abs() < 1e-12);
        assert!((face.specular_share(free_path, 10.0 * per_metre) - 1.0).abs() > 0.1, "still small");
        assert!((face.specular_share(free_path, 1e3) - 1.0).abs() < 1e-12);
    }
}
