//! A long screen on a rigid floor in the open: four paths over its rim, two of each image source.
//!
//! Source, receiver and their images in the floor pair up to four paths, each with Macdonald's field of a half plane. The direct path and the
//! path that the floor reflects on both sides belong to the source, the two others to its image: paths of one image source interfere, image
//! sources add by energy (docs/diffraction.md).

use core::f64::consts::PI;

use glam::dvec3;
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::analytic::half_plane::HalfPlane;
use sonel_tests::{Traced, fluence, meshes};

const OCTAVES: [f64; 5] = [63.0, 125.0, 250.0, 500.0, 1000.0];
const SPEED_OF_SOUND: f64 = 343.0;
const HEIGHT: f64 = 3.0;
/// (along x, height) of source and receiver [m].
const SOURCE: (f64, f64) = (-10.0, 0.5);
const RECEIVER: (f64, f64) = (15.0, 1.5);

fn outdoors(effects: &[&str], emissions: u64, scattering: f64) -> Traced {
    let mut mesh = Mesh::default();
    let quad = |corners: [[f64; 3]; 4]| corners.map(|[x, y, z]| dvec3(x, y, z));
    let ground = [[-90.0, -90.0, 0.0], [90.0, -90.0, 0.0], [90.0, 90.0, 0.0], [-90.0, 90.0, 0.0]];
    meshes::add_quad(&mut mesh, 0, quad(ground));
    let screen = [[0.0, -80.0, 0.0], [0.0, 80.0, 0.0], [0.0, 80.0, HEIGHT], [0.0, -80.0, HEIGHT]];
    meshes::add_quad(&mut mesh, 0, quad(screen));
    let bands = Bands::new(OCTAVES.to_vec(), BandWidth::Octave).expect("octaves");
    let rigid = Material::uniform("rigid", 0.0, scattering, OCTAVES.len());
    let mut scene = Scene::from_parts(mesh, vec![rigid], bands, 0.3)
        .with_source("source", [SOURCE.0, 0.0, SOURCE.1])
        .with_receiver("receiver", [RECEIVER.0, 0.0, RECEIVER.1])
        .without_air_attenuation();
    scene.speed_of_sound = SPEED_OF_SOUND;
    Traced::with(effects, scene, Settings { emissions, ..Settings::default() })
}

/// Polar coordinates about the rim: the angle goes from the face at the source over the air above to the other face.
fn polar((x, z): (f64, f64)) -> (f64, f64, f64) {
    let (away, below) = (x, HEIGHT - z);
    let from_down = away.atan2(below);
    (away.hypot(below), if x < 0.0 { -from_down } else { 2.0 * PI - from_down }, 0.0)
}

/// |p|² of two paths for a source of free field 1/r, each mirrored in the floor or not (−1 or 1) at the source and at the receiver; the mean
/// over an octave [1/m²].
fn two_paths(center: f64, signs: [(f64, f64); 2]) -> f64 {
    let mirrored = |(x, z): (f64, f64), sign: f64| polar((x, sign * z));
    let paths =
        signs.map(|(s, r)| HalfPlane { source: mirrored(SOURCE, s), receiver: mirrored(RECEIVER, r) });
    let (low, count) = (center / 2.0_f64.sqrt(), 60);
    let energy = (0..count).map(|step| {
        let frequency = low * (1.0 + (f64::from(step) + 0.5) / f64::from(count));
        let k = 2.0 * PI * frequency / SPEED_OF_SOUND;
        let sum =
            paths.map(|path| path.pressure(k)).into_iter().fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        sum.0 * sum.0 + sum.1 * sum.1
    });
    energy.sum::<f64>() / f64::from(count)
}

#[test]
fn behind_a_screen_the_paths_of_each_image_source_interfere() {
    let rendering = outdoors(&["diffraction"], 64, 0.0).render(RenderSettings::default());
    for (band, center) in OCTAVES.into_iter().enumerate() {
        let direct = two_paths(center, [(1.0, 1.0), (-1.0, -1.0)]);
        let of_image = two_paths(center, [(1.0, -1.0), (-1.0, 1.0)]);
        let off = 10.0 * (rendering.energy(0, band) * 4.0 * PI / (direct + of_image)).log10();
        assert!(off.abs() < 0.3, "{center} Hz: {off:+.2} dB");
    }
}

/// Discs and spheres hear packets whose ways are shorter than any to the receiver.
#[test]
fn nothing_is_heard_before_the_straight_way() {
    let rendering = outdoors(&["diffraction"], 2_000, 0.3).render(RenderSettings::default());
    let straight = (RECEIVER.0 - SOURCE.0).hypot(RECEIVER.1 - SOURCE.1);
    let before = (straight / SPEED_OF_SOUND / RenderSettings::default().bin) as usize;
    for (band, center) in OCTAVES.into_iter().enumerate() {
        let share = fluence(&rendering, before, 0, band) / rendering.energy(0, band);
        assert!(share <= 0.0, "{center} Hz: {share}");
    }
}
