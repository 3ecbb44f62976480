//! Energy on surfaces as a camera sees it: against what a source sends to black walls, the ledger, and a sphere that reflects evenly.

use glam::DVec3;
use sonel_acoustics::{Bands, Material};
use sonel_geometry::{Geometry, Mesh, Side};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_renderer::picture::{Camera, Picture, Windows};
use sonel_scene::Scene;
use sonel_tests::Traced;

use crate::diffuse_sphere;

const SIZE: [f64; 3] = [6.0, 5.0, 4.0];
const SOURCE: DVec3 = DVec3::new(3.0, 2.5, 2.0);
/// Index of the band that air attenuates most.
const HIGHEST: usize = 7;

/// A box that absorbs everything at the first arrival, with the source in the middle.
fn black_box(emissions: u64, air: bool) -> Traced {
    let bands = Bands::octaves();
    let walls = Material::uniform("walls", 1.0, 0.0, bands.count());
    let scene = Scene::from_parts(Mesh::shoebox(SIZE, [0; 6]), vec![walls], bands, 0.05)
        .with_source("source", SOURCE.to_array());
    let scene = if air { scene } else { scene.without_air_attenuation() };
    Traced::new(scene, Settings { emissions, ..Settings::default() })
}

fn picture(traced: &Traced, camera: &Camera, window: [f64; 2], radius: f64) -> Picture {
    let scene = &traced.map.header().scene;
    let windows = Windows::new(&[window], scene.speed_of_sound, scene.duration).expect("within the run");
    let settings = RenderSettings { gather_radius: Some(radius), ..RenderSettings::default() };
    let renderer = traced.renderer(settings);
    renderer.picture(0, camera, &windows, &mut |_| {}).expect("a small picture")
}

fn camera(geometry: &Geometry, eye: DVec3, look: DVec3, fov: f64, pixels: u32) -> Camera {
    Camera::new(eye, look, fov, [pixels, pixels], geometry).expect("a place in the room")
}

/// What each pixel shows: energy in `band` of the first window with its standard error, position and normal.
fn pixels(traced: &Traced, picture: &Picture, band: usize) -> Vec<(f64, f64, DVec3, DVec3)> {
    let window = &picture.windows[0];
    let seen = picture.seen.iter().zip(&window.energy[band]).zip(&window.relative_error);
    seen.map(|((hit, &energy), &error)| {
        let hit = hit.expect("the camera is inside");
        assert_eq!(hit.side, Side::Front);
        let (energy, error) = (f64::from(energy), f64::from(energy * error));
        (energy, error, traced.geometry.to_world(hit.position), traced.geometry.surface(hit.surface).normal)
    })
    .collect()
}

#[test]
fn a_black_wall_receives_what_the_source_sends_there() {
    let (traced, radius) = (black_box(250_000, true), 0.25);
    let attenuation = traced.map.header().scene.air_attenuation[HIGHEST];
    let eye = DVec3::new(1.0, 2.0, 1.0);
    let camera = camera(&traced.geometry, eye, DVec3::new(6.0, 2.5, 2.0), 60.0, 60);
    let picture = picture(&traced, &camera, [0.0, 0.05], radius);
    // Whole discs: on the border the middle of what is left is not the point.
    let (low, high) = (DVec3::splat(radius), DVec3::from_array(SIZE) - radius);
    let off_borders =
        |at: DVec3| (0..3).filter(|&axis| at[axis] > low[axis] && at[axis] < high[axis]).count() == 2;
    let outcome = |exact: &dyn Fn(f64, f64) -> f64| {
        let found = pixels(&traced, &picture, HIGHEST);
        let inside: Vec<_> = found.into_iter().filter(|(.., at, _)| off_borders(*at)).collect();
        assert!(inside.len() > 2000, "{}", inside.len());
        let misses = inside.iter().filter(|(energy, error, at, normal)| {
            let offset = *at - SOURCE;
            let distance = offset.length();
            let exact = exact(distance, offset.dot(*normal).abs() / distance);
            assert!(*error < 0.1 * energy, "too noisy to mean anything");
            // The mean over a disc is h²/8 of the Laplacian too large, which is at most 9/d² of the value here.
            (energy - exact).abs() > 3.0 * error + 9.0 / 8.0 * (radius / distance).powi(2) * exact
        });
        misses.count() as f64 / inside.len() as f64
    };
    let sphere = |distance: f64| 1.0 / (4.0 * std::f64::consts::PI * distance * distance);
    let misses = outcome(&|d, cos| sphere(d) * cos * (-attenuation * d).exp());
    assert!(misses < 0.01, "{misses} of the pixels are off");
    assert!(
        outcome(&|d, _| sphere(d) * (-attenuation * d).exp()) > 0.3,
        "irradiance without cosine is rejected"
    );
    assert!(outcome(&|d, cos| 1.25 * sphere(d) * cos) > 0.5, "other air is rejected");
}

/// Σ E dA over the six walls, each pixel with the area that it shows.
#[test]
fn six_views_add_up_to_the_first_arrivals_of_the_ledger() {
    let traced = black_box(100_000, false);
    let absorbed = traced.ledger.bands[0].absorbed / traced.ledger.bands[0].emitted;
    let pixels_across = 160_u32;
    let view = |look: DVec3| -> f64 {
        let camera = camera(&traced.geometry, SOURCE, SOURCE + look, 90.0, pixels_across);
        let picture = picture(&traced, &camera, [0.0, 0.05], 0.15);
        let cell = (2.0 / f64::from(pixels_across)).powi(2);
        let shown = pixels(&traced, &picture, 0).into_iter().map(|(energy, _, at, normal)| {
            let offset = at - SOURCE;
            let direction = offset.normalize();
            // Solid angle of the pixel over the cosine at the wall.
            let area =
                cell * direction.dot(look).powi(3) * offset.length_squared() / direction.dot(normal).abs();
            energy * area
        });
        shown.sum()
    };
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let views: Vec<f64> = axes.into_iter().flat_map(|axis| [view(axis), view(-axis)]).collect();
    let total: f64 = views.iter().sum();
    assert!((total / absorbed - 1.0).abs() < 0.003, "{total} instead of {absorbed}: {views:?}");
    assert!(views.iter().all(|view| *view > 0.05), "a wall left out is noticed: {views:?}");
}

/// Behind the first arrivals, irradiance in a diffuse sphere is uniform: (1 − α)/α of the energy on the whole surface.
#[test]
fn late_irradiance_in_a_diffuse_sphere_is_uniform() {
    let absorption = 0.3;
    let traced = diffuse_sphere::sphere(absorption, 1.2, [0.0; 3], 60_000);
    // From 0.2 m behind the direct sound on: of the first reflections two in ten thousand are earlier.
    let begin = (diffuse_sphere::RADIUS + 0.2) / diffuse_sphere::SPEED;
    let exact = (1.0 - absorption) / absorption / traced.geometry.area();
    let eye = DVec3::new(2.0, -1.0, 0.5);
    let camera = camera(&traced.geometry, eye, DVec3::ZERO, 100.0, 50);
    let found = |begin: f64| {
        let picture = picture(&traced, &camera, [begin, 1.2], 0.4);
        pixels(&traced, &picture, 0)
    };
    let outcome = |found: &[(f64, f64, DVec3, DVec3)]| {
        let count = found.len() as f64;
        let mean = found.iter().map(|(energy, ..)| energy).sum::<f64>() / count;
        let misses = found.iter().filter(|(energy, error, ..)| (energy - exact).abs() > 1.96 * error).count();
        (mean / exact, misses as f64 / count)
    };
    let (mean, misses) = outcome(&found(begin));
    assert!((mean - 1.0).abs() < 0.02, "{mean} of the exact irradiance");
    assert!((0.02..0.09).contains(&misses), "{misses} of the pixels are off, one in twenty should be");
    assert!(outcome(&found(0.0)).1 > 0.5, "with the first arrivals it is not");
}
