//! Edges where paths are arcs are those of even air, of direct sound.

use glam::dvec3;
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::{PathClass, RenderSettings};
use sonel_scene::Scene;
use sonel_tests::Traced;
use sonel_tests::meshes::add_quad;

const BANDS: [f64; 2] = [500.0, 2000.0];
/// Where the screen stands and how high it is [m].
const SCREEN: (f64, f64) = (100.0, 6.0);

/// A screen of 300 m in the open that reflects nothing, over rigid ground where there is one.
fn outdoors(gradient: f64, has_ground: bool, source: [f64; 2], receivers: &[[f64; 2]]) -> Scene {
    let mut mesh = Mesh::default();
    let quad = |corners: [[f64; 3]; 4]| corners.map(|[x, y, z]| dvec3(x, y, z));
    let (x, height) = SCREEN;
    let (wide, foot) = (150.0, if has_ground { 0.0 } else { -90.0 });
    add_quad(&mut mesh, 1, quad([[x, -wide, foot], [x, wide, foot], [x, wide, height], [x, -wide, height]]));
    if has_ground {
        let ends = [-50.0, 350.0];
        add_quad(
            &mut mesh,
            0,
            quad([[ends[0], -wide, 0.0], [ends[1], -wide, 0.0], [ends[1], wide, 0.0], [ends[0], wide, 0.0]]),
        );
    }
    let bands = Bands::new(BANDS.to_vec(), BandWidth::Octave).expect("octaves");
    let materials = vec![Material::uniform("rigid", 0.0, 0.0, 2), Material::uniform("dull", 1.0, 0.0, 2)];
    let materials = materials.into_iter().take(2).collect();
    let scene = Scene::from_parts(mesh, materials, bands, 1.2)
        .with_source("source", [source[0], 0.0, source[1]])
        .without_air_attenuation();
    let scene = Scene { sound_speed_gradient: gradient, ..scene };
    receivers.iter().fold(scene, |scene, &[x, z]| scene.with_receiver("receiver", [x, 0.0, z]))
}

/// Direct sound with what comes over edges, per receiver and band [1/m²].
fn over_edges(scene: Scene, order: Option<u32>) -> Vec<[f64; 2]> {
    let count = scene.receivers.len();
    let traced = Traced::diffracting(scene, Settings { emissions: 64, ..Settings::default() });
    let rendering = traced.render(RenderSettings { mirror_order: order, ..RenderSettings::default() });
    let energy = |receiver: usize, band: usize| {
        let of = [PathClass::Direct, PathClass::Edge]
            .map(|class| rendering.class_energies[class as usize][receiver * 2 + band]);
        of[0] + of[1]
    };
    (0..count).map(|receiver| [energy(receiver, 0), energy(receiver, 1)]).collect()
}

/// Deep in shadow no arc arrives and none is needed: there is the sound that even air brings over the edge.
#[test]
fn edges_in_a_gradient_are_those_of_even_air() {
    let receivers = [[160.0, -20.0], [220.0, -30.0], [130.0, -10.0]];
    let [even, bent] =
        [0.0, -0.1].map(|gradient| over_edges(outdoors(gradient, false, [0.0, 2.0], &receivers), Some(0)));
    for (bent, even) in bent.iter().flatten().zip(even.iter().flatten()) {
        assert!(*even > 0.0 && (bent / even - 1.0).abs() < 1e-6, "{bent:e} {even:e}");
    }
    let lit = over_edges(outdoors(-0.1, false, [0.0, 2.0], &[[240.0, 40.0]]), Some(0));
    assert!(lit[0][0] > 4.0 * even[0][0], "where the arc arrives it is heard");
}
