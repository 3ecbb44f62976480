//! Sphere with Lambert walls: chords are independent, so decay and irradiance have closed forms (docs/physics.md §8).

use glam::DVec3;
use sonel_acoustics::{Bands, Material};
use sonel_geometry::{Mesh, MeshTriangle};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::analytic::diffuse_sphere::DiffuseSphere;
use sonel_testkit::decay::reverberation_time;
use sonel_testkit::z_test::{Estimate, Within, within_sigmas};
use sonel_tests::{Traced, batch_fluence};

pub(crate) const RADIUS: f64 = 5.0;
pub(crate) const SPEED: f64 = 343.0;

/// An icosahedron, each face divided in four `times` times and pushed out to the sphere.
fn icosphere(times: u32) -> Mesh {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut faces: Vec<[DVec3; 3]> = Vec::new();
    let corners: Vec<DVec3> = [(0.0, 1.0, golden), (1.0, golden, 0.0), (golden, 0.0, 1.0)]
        .into_iter()
        .flat_map(|(x, y, z): (f64, f64, f64)| {
            // Every sign of the two coordinates that are not zero.
            [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(s, t)| match (x, y, z) {
                (0.0, _, _) => DVec3::new(0.0, s * y, t * z),
                (_, _, 0.0) => DVec3::new(s * x, t * y, 0.0),
                _ => DVec3::new(s * x, 0.0, t * z),
            })
        })
        .collect();
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in &corners[j + 1..] {
                let edge = 2.0 + 1e-9;
                if a.distance(b) < edge && b.distance(c) < edge && c.distance(a) < edge {
                    faces.push([a, b, c]);
                }
            }
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..times {
        faces = faces
            .into_iter()
            .flat_map(|[a, b, c]| {
                let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
                let [a, b, c] = [a, b, c].map(DVec3::normalize);
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    let mut mesh = Mesh::default();
    for face in faces {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(face.map(|corner| corner.normalize() * RADIUS));
        mesh.triangles.push(MeshTriangle { corners: [first, first + 1, first + 2], material: 0 });
    }
    mesh
}

pub(crate) fn sphere(absorption: f64, duration: f64, source: [f64; 3], emissions: u64) -> Traced {
    let bands = Bands::octaves();
    let walls = Material::uniform("walls", absorption, 1.0, bands.count());
    let mut scene = Scene::from_parts(icosphere(3), vec![walls], bands, duration)
        .without_air_attenuation()
        .with_source("source", source)
        .with_receiver("near", [1.0, -0.5, 0.7])
        .with_receiver("far", [-1.2, 2.0, -1.9]);
    scene.speed_of_sound = SPEED;
    Traced::new(scene, Settings { emissions, ..Settings::default() })
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn decay_is_that_of_independent_chords() {
    for (absorption, duration) in [(0.3, 1.2), (0.5, 0.7)] {
        let traced = sphere(absorption, duration, [0.0; 3], 60_000);
        // The facets' mean free path 4V/S is a little shorter than the sphere's 4R/3.
        let radius = 3.0 * traced.geometry.volume().unwrap() / traced.geometry.area();
        let exact = DiffuseSphere { radius, absorption, speed_of_sound: SPEED }.reverberation_time();
        let rendering = traced.render(RenderSettings::default());
        let bins = (duration / 0.001).round() as usize;
        for receiver in 0..2 {
            let energies: Vec<f64> = (0..bins).map(|bin| rendering.total.get(receiver, bin, 0)).collect();
            // The source in the middle sends all packets to the wall at once: the first free paths are not yet mixed.
            let time = reverberation_time(&energies, 0.001, -20.0, -50.0);
            let eyring = 55.26 * radius / 3.0 / (-SPEED * (1.0 - absorption).ln());
            assert!((time / exact - 1.0).abs() < 0.005, "α = {absorption}: {time} s instead of {exact} s");
            assert!(
                (eyring / exact - 1.0).abs() > 0.02,
                "Eyring's formula is rejected by the same tolerance"
            );
        }
    }
}

/// Irradiance by diffuse reflections is uniform, and so is the fluence they send to any point inside.
#[test]
fn reflected_fluence_is_uniform_and_exact() {
    let traced = sphere(0.3, 1.2, [0.0; 3], 60_000);
    let radius = 3.0 * traced.geometry.volume().unwrap() / traced.geometry.area();
    let exact = DiffuseSphere { radius, absorption: 0.3, speed_of_sound: SPEED }.reflected_fluence();
    let rendering = traced.render(RenderSettings::default());
    for receiver in 0..2 {
        let direct =
            rendering.arrivals.iter().find(|a| a.receiver == receiver && a.order == 0).unwrap().energy[0];
        let (mean, error) = batch_fluence(&rendering, receiver, 0);
        let reflected = mean - direct;
        assert!(error < 0.01 * exact, "too noisy to mean anything: {error}");
        assert!(
            (reflected - exact).abs() < 4.0 * error + 0.003 * exact,
            "{reflected} ± {error} instead of {exact}"
        );
    }
}

/// Cells of equal area on the sphere: slabs of height, cut in equal sectors.
const CELLS: usize = 16;

fn cell(position: DVec3) -> usize {
    let height = ((position.z / RADIUS + 1.0) * 2.0).clamp(0.0, 3.0) as usize;
    let angle = position.y.atan2(position.x) / std::f64::consts::TAU + 0.5;
    4 * height + ((angle * 4.0) as usize).min(3)
}

/// Energy arriving in each cell after at least `least` reflections, per unit emitted energy, with errors from the batches.
fn incident(traced: &Traced, least: u32) -> Vec<Estimate> {
    let layout = traced.map.layout();
    let mut energy = vec![[0.0; CELLS]; layout.batches as usize];
    traced.for_each_segment(|emission, _, segment| {
        if segment.arrival.is_some() && segment.history.order >= least {
            let place = cell(segment.end.as_dvec3());
            energy[layout.batch(emission) as usize][place] += segment.energy[0][0];
        }
    });
    (0..CELLS).map(|cell| Estimate::of(&energy.iter().map(|batch| batch[cell]).collect::<Vec<_>>())).collect()
}

/// From a source far from the middle: what has been reflected arrives evenly, to what (1 − α)/α leaves for each cell. The
/// first arrivals do not, and are told apart.
#[test]
#[ignore = "long: cargo xtask accept"]
fn reflected_irradiance_is_uniform() {
    let absorption = 0.3;
    let traced = sphere(absorption, 1.2, [2.0, 1.0, -1.5], 160_000);
    let share = |least: u32| {
        let all: f64 = (1.0 - absorption).powi(least as i32) / absorption;
        let expected = all / CELLS as f64;
        let within = Within { sigmas: 4.0, maximal_sigma: 0.006 * expected };
        incident(&traced, least)
            .into_iter()
            .map(|estimate| within_sigmas(estimate, expected, within))
            .collect::<Vec<_>>()
    };
    assert!(share(1).iter().all(Result::is_ok), "{:?}", share(1));
    let first_too = share(0);
    assert!(first_too.iter().filter(|outcome| outcome.is_err()).count() > CELLS / 2, "{first_too:?}");
}
