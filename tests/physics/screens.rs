//! A screen between a talker and a listener at their desks, in the open, against the wave equation.

use std::f64::consts::PI;

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_tests::{Traced, meshes};

const SOURCE: DVec3 = dvec3(0.0, 0.0, 1.2);
const RECEIVER: DVec3 = dvec3(3.0, 0.0, 1.2);
const OCTAVES: [f64; 2] = [63.0, 125.0];
/// What the error may be [dB], a tenth above the largest: that of the screen alone at 125 Hz, where the differences are 1.1 dB below boundary elements.
const ALLOWED: f64 = 2.4;

/// Which of screen, the talker's desk and the listener's desk stand there, how high the screen is [m], and levels re free field [dB] of finite
/// differences with cells of 0.1 m. At 250 Hz these are doubtful: boundary elements give −9.3 dB for the first one, not −5.7.
const KNOWN: [(&str, f64, [f64; 2]); 7] = [
    ("screen", 1.4, [0.5, -1.1]),
    ("screen talker", 1.4, [0.5, -0.9]),
    ("screen listener", 1.4, [0.6, -0.7]),
    ("screen talker listener", 1.4, [0.6, 0.4]),
    ("talker listener", 1.4, [0.3, 1.6]),
    ("screen", 1.8, [1.3, 0.9]),
    ("screen talker listener", 1.8, [1.6, 2.1]),
];

/// Levels re free field at `receivers` [dB].
fn levels(parts: &str, top: f64, receivers: &[DVec3], effects: &[&str]) -> Vec<[f64; 2]> {
    let mut mesh = Mesh::default();
    // Closed objects alone would be rooms.
    let far = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]].map(|[x, y]| dvec3(x, y, -20.0));
    meshes::add_quad(&mut mesh, 0, far);
    for part in parts.split(' ') {
        let desk = |mesh: &mut Mesh, x: f64| {
            meshes::add_box(mesh, 0, dvec3(x, -0.8, 0.72), dvec3(x + 0.8, 0.8, 0.75));
        };
        match part {
            "talker" => desk(&mut mesh, -0.2),
            "listener" => desk(&mut mesh, 2.8),
            _ => {
                let corners = [[-0.8, 0.0], [0.8, 0.0], [0.8, top], [-0.8, top]];
                meshes::add_quad(&mut mesh, 0, corners.map(|[y, z]| dvec3(0.8, y, z)));
            }
        }
    }
    let bands = Bands::new(OCTAVES.to_vec(), BandWidth::Octave).expect("octaves");
    let mut scene = Scene::from_parts(mesh, vec![Material::uniform("rigid", 0.0, 0.0, 2)], bands, 0.1)
        .with_source("source", SOURCE.to_array())
        .without_air_attenuation();
    scene.speed_of_sound = 343.0;
    let scene = receivers.iter().fold(scene, |scene, at| scene.with_receiver("ear", at.to_array()));
    let traced = Traced::with(effects, scene, Settings { emissions: 32, ..Settings::default() });
    let rendering = traced.render(RenderSettings::default());
    let level = |index: usize, band: usize| {
        let free = 1.0 / (4.0 * PI * SOURCE.distance_squared(receivers[index]));
        10.0 * (rendering.energy(index, band) / free).max(1e-12).log10()
    };
    (0..receivers.len()).map(|index| [level(index, 0), level(index, 1)]).collect()
}

#[test]
fn a_desk_beside_a_screen_hides_little_of_it() {
    for (parts, top, known) in KNOWN {
        let found = levels(parts, top, &[RECEIVER], &["diffraction"])[0];
        let largest = |found: [f64; 2]| (found[0] - known[0]).abs().max((found[1] - known[1]).abs());
        assert!(largest(found) < ALLOWED, "{parts}, {top} m: {found:.1?} for {known:?} dB");
        let straight = levels(parts, top, &[RECEIVER], &[])[0];
        assert!(!parts.contains("screen") || largest(straight) > ALLOWED, "silence is rejected");
    }
}

/// Up past the shadows of desk and screen.
#[test]
fn nobody_hears_a_step_who_rises_from_a_desk_behind_a_screen() {
    let heights = |from: f64| (0..16).map(move |step| from + 0.01 * f64::from(step));
    let walks = [0.6, 1.8].map(|from| heights(from).map(|z| dvec3(2.7, 0.13, z)).collect::<Vec<DVec3>>());
    let largest = |effects: &[&str]| {
        let of_walk = |places: &Vec<DVec3>| {
            let levels = levels("screen talker listener", 1.4, places, effects);
            let step = |pair: &[[f64; 2]]| {
                (0..2).map(|band| (pair[0][band] - pair[1][band]).abs()).fold(0.0, f64::max)
            };
            levels.windows(2).map(step).fold(0.0, f64::max)
        };
        walks.iter().map(of_walk).fold(0.0, f64::max)
    };
    let step = largest(&["diffraction"]);
    assert!(step < 1.0, "{step} dB");
    assert!(largest(&[]) > 3.0, "without edges there is one");
}
