//! A box whose walls are changed on the map, with the slow simulator of the test kit for the changed walls.

use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_analysis::what_if::{Fitness, fitness};
use sonel_analysis::{Parameter, parameters};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::bruteforce::{BoxRoom, Count, Counted};
use sonel_testkit::decay::reverberation_time;
use sonel_testkit::z_test::Estimate;

use crate::Traced;

/// Absorption and scattering coefficient of the walls x0 x1 y0 y1 z0 z1.
pub type Walls = [[f64; 2]; 6];

const SIZE: [f64; 3] = [7.0, 5.0, 3.2];
const SOURCE: [f64; 3] = [1.7, 1.4, 1.5];
const RECEIVER: [f64; 3] = [5.1, 3.2, 1.2];
const SPEED: f64 = 343.0;
/// Simulated time [s].
const DURATION: f64 = 2.5;

/// The parameters that are compared.
pub const READ: [Parameter; 3] = [Parameter::Level, Parameter::T20, Parameter::T30];

/// The box of an uneven room: dead behind the source, hard above.
#[must_use]
pub fn with_floor(floor: [f64; 2]) -> Walls {
    [[0.3, 0.05], [0.1, 0.3], [0.1, 0.3], [0.1, 0.3], floor, [0.02, 0.2]]
}

fn materials(walls: &Walls) -> Vec<Material> {
    let material = |(wall, &[absorption, scattering]): (usize, &[f64; 2])| {
        Material::uniform(&format!("w{wall}"), absorption, scattering, 1)
    };
    walls.iter().enumerate().map(material).collect()
}

/// The box as a scene of one band, which carries `others` besides.
#[must_use]
pub fn scene(walls: &Walls, others: &[Walls]) -> Scene {
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave band");
    let mut scene =
        Scene::from_parts(Mesh::shoebox(SIZE, [0, 1, 2, 3, 4, 5]), materials(walls), bands, DURATION)
            .with_source("source", SOURCE)
            .with_receiver("receiver", RECEIVER)
            .without_air_attenuation();
    scene.speed_of_sound = SPEED;
    if !others.is_empty() {
        scene.variants = vec![Vec::new(); 6];
    }
    for other in others {
        for (wall, material) in materials(other).into_iter().enumerate() {
            if material != scene.materials[wall] && !scene.variants[wall].contains(&material) {
                scene.variants[wall].push(material);
            }
        }
    }
    scene
}

/// A map of `scene` given other walls.
#[must_use]
pub fn changed(scene: &Scene, walls: &Walls, settings: Settings) -> (Traced, Fitness) {
    let mut traced = Traced::new(scene.clone(), settings);
    traced.map.change(materials(walls), scene.sources.clone());
    let fitness = fitness(&traced.map, &traced.geometry, traced.map.layout().batches);
    (traced, fitness)
}

/// Value and interval of each of [`READ`], where there is one.
#[must_use]
pub fn read(traced: &Traced) -> [Option<(f64, [f64; 2])>; 3] {
    let all = parameters(&traced.respond(RenderSettings::default()));
    READ.map(|parameter| {
        let estimate = all[0].bands[0].parameter(parameter).as_ref().ok()?;
        Some((estimate.value, *estimate.interval.as_ref().ok()?))
    })
}

/// Each of [`READ`] as the slow simulator counts it in the box; the level [dB] with the scene's source.
#[must_use]
pub fn counted(walls: &Walls, rays_per_batch: usize) -> [Estimate; 3] {
    const BIN: f64 = 0.002;
    let room = BoxRoom {
        size: SIZE,
        absorption: walls.map(|[absorption, _]| absorption),
        scattering: walls.map(|[_, scattering]| scattering),
        speed_of_sound: SPEED,
        air_attenuation: 0.0,
        window: None,
    };
    let counted: Counted = room.count(&Count {
        source: SOURCE,
        receiver: RECEIVER,
        radius: 0.35,
        bin_width: BIN,
        bins: (DURATION / BIN).round() as usize,
        batches: 32,
        rays_per_batch,
        seed: 77,
    });
    let impedance = scene(walls, &[]).impedance();
    let level = |bins: &[f64]| 90.0 + 10.0 * (bins.iter().sum::<f64>() * impedance / 400.0).log10();
    [
        counted.jackknife(level),
        counted.jackknife(|bins| reverberation_time(bins, BIN, -5.0, -25.0)),
        counted.jackknife(|bins| reverberation_time(bins, BIN, -5.0, -35.0)),
    ]
}
