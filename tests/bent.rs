//! A room whose edges bend packets, and what is heard in it.

use glam::DVec3;
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::{Mesh, MeshTriangle};
use sonel_renderer::{Estimator, RenderSettings};
use sonel_scene::Scene;
use sonel_testkit::z_test::Estimate;

use crate::{Traced, batch_fluence};

/// Adds a rectangle of `material` to `mesh`.
pub fn add_quad(mesh: &mut Mesh, corners: [[f64; 3]; 4], material: u32) {
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(corners.map(DVec3::from));
    for corners in [[0, 1, 2], [0, 2, 3]] {
        mesh.triangles.push(MeshTriangle { corners: corners.map(|corner| first + corner), material });
    }
}

/// Adds a box of `material` with a corner at `from`.
pub fn add_box(mesh: &mut Mesh, from: [f64; 3], size: [f64; 3], material: u32) {
    let first = mesh.vertices.len() as u32;
    let solid = Mesh::shoebox(size, [material; 6]);
    mesh.vertices.extend(solid.vertices.iter().map(|&vertex| vertex + DVec3::from(from)));
    mesh.triangles.extend(solid.triangles.iter().map(|triangle| MeshTriangle {
        // Turned, so that the air is outside.
        corners: [2, 1, 0].map(|corner| first + triangle.corners[corner]),
        ..*triangle
    }));
}

/// A room of four bands, divided by a screen of half its height with two free edges. A box before it and a shelf behind it bend some of the bands.
#[must_use]
pub fn screened(absorption: [f64; 4], scattering: [f64; 4], duration: f64) -> Scene {
    let bands = Bands::new(vec![125.0, 250.0, 1000.0, 4000.0], BandWidth::Octave).expect("octaves");
    let mut mesh = Mesh::shoebox([12.0, 9.0, 6.0], [0; 6]);
    add_quad(&mut mesh, [[6.0, 0.0, 0.0], [6.0, 6.0, 0.0], [6.0, 6.0, 3.5], [6.0, 0.0, 3.5]], 0);
    add_box(&mut mesh, [4.6, 2.0, 1.0], [0.6, 0.5, 0.6], 0);
    add_quad(&mut mesh, [[7.5, 3.0, 2.0], [9.0, 3.0, 2.0], [9.0, 5.0, 2.0], [7.5, 5.0, 2.0]], 0);
    let material = Material {
        absorption: absorption.to_vec(),
        scattering: scattering.to_vec(),
        ..Material::uniform("walls", 0.0, 0.0, 4)
    };
    let mut scene = Scene::from_parts(mesh, vec![material], bands, duration)
        .with_source("source", [2.0, 3.0, 1.5])
        .without_air_attenuation();
    scene.speed_of_sound = 343.0;
    scene
}

/// Energy at each receiver in each band, estimated with so many rays where the estimator has any.
#[must_use]
pub fn received(traced: &Traced, estimator: Estimator, rays: u32) -> Vec<Vec<Estimate>> {
    let settings =
        RenderSettings { estimator, mirror_order: Some(0), rays: Some(rays), ..RenderSettings::default() };
    let rendering = traced.render(settings);
    let scene = &traced.map.header().scene;
    let (receivers, bands) = (scene.receivers.len(), scene.bands.count());
    let band = |receiver, band| {
        let (value, sigma) = batch_fluence(&rendering, receiver, band);
        Estimate { value, sigma }
    };
    (0..receivers).map(|receiver| (0..bands).map(|b| band(receiver, b)).collect()).collect()
}
