//! Estimators: almost no sonels, discs beyond their surface, thin walls, receivers beside walls.

use glam::dvec3;
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::{Estimator, PathClass, ReceiverPoint, RenderSettings, Rendering};
use sonel_scene::Scene;
use sonel_testkit::z_test::{Estimate, Within, agree};
use sonel_tests::{Traced, batch_fluence, meshes};

use super::form;

const SIZE: [f64; 3] = [6.0, 5.0, 4.0];

fn scene(mesh: Mesh, scattering: f64, receiver: [f64; 3]) -> Scene {
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave");
    let walls = Material::uniform("walls", 0.2, scattering, 1);
    let mut scene = Scene::from_parts(mesh, vec![walls], bands, 0.2)
        .with_source("source", [1.5, 1.2, 1.3])
        .with_receiver("receiver", receiver)
        .without_air_attenuation();
    scene.speed_of_sound = 343.0;
    scene
}

fn rendering(scene: Scene, settings: Settings, estimator: Estimator) -> Rendering {
    Traced::new(scene, settings).render(RenderSettings {
        estimator,
        rays: Some(4_096),
        ..RenderSettings::default()
    })
}

fn energies(rendering: &Rendering) -> Vec<f64> {
    (0..200).map(|bin| rendering.total.get(0, bin, 0)).collect()
}

/// One, two and three packets in as many batches, and batches without any: every energy is a number.
#[test]
fn a_handful_of_packets_is_enough_to_be_finite() {
    for emissions in [1, 3, 40] {
        for batches in [1, 32] {
            for estimator in Estimator::COMPARABLE {
                let scene = scene(Mesh::shoebox(SIZE, [0; 6]), 0.5, [4.2, 3.7, 2.1]);
                let settings = Settings { emissions, batches, ..Settings::default() };
                let energies = energies(&rendering(scene, settings, estimator));
                let sound = energies.iter().all(|energy| energy.is_finite() && *energy >= 0.0);
                assert!(sound, "{emissions} in {batches}, {estimator:?}");
            }
        }
    }
}

/// Every sonel at one point: a cardioid far away behind a pinhole would do, a floor of 0.1 mm that alone scatters does. Discs are
/// larger than all they hold, and the estimators stay finite and agree within their noise that nothing is there twice.
#[test]
fn all_sonels_may_be_at_one_point() {
    let received = |estimator: Estimator| {
        let mut mesh = Mesh::shoebox(SIZE, [0; 6]);
        let (middle, half) = (dvec3(3.0, 2.5, 2.0), 5e-5);
        let corner = |x: f64, y: f64| middle + half * dvec3(x, y, 0.0);
        meshes::add_quad(
            &mut mesh,
            1,
            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        );
        let mut scene = scene(mesh, 1.0, [4.2, 3.7, 2.1]);
        let mut black = scene.materials[0].clone();
        black.absorption[0] = 1.0;
        let speck = std::mem::replace(&mut scene.materials[0], black);
        scene.materials.push(speck);
        // So near that many packets meet it.
        scene.sources[0].position = middle + dvec3(0.0, 0.0, 2e-4);
        let settings = Settings { emissions: form(20_000, 200_000), ..Settings::default() };
        let rendering = rendering(scene, settings, estimator);
        assert!(
            energies(&rendering).iter().all(|energy| energy.is_finite() && *energy >= 0.0),
            "{estimator:?}"
        );
        rendering.classes[PathClass::Diffuse as usize].1[0]
    };
    // A fraction of the sphere about the source, α = 0.2, Lambert, at the receiver's distance and angle.
    let to = dvec3(4.2, 3.7, 2.1) - dvec3(3.0, 2.5, 2.0);
    let share = solid_angle_of_square(5e-5, 2e-4) / (4.0 * std::f64::consts::PI);
    let cosine = to.z / to.length();
    let expected = share * 0.8 * cosine / (std::f64::consts::PI * to.length_squared());
    let found = received(Estimator::Connection);
    println!("all sonels within 0.1 mm: {:.3} of what a Lambert point sends", found / expected);
    // A share of N packets, four standard errors.
    let hits = share * form(20_000.0, 200_000.0);
    assert!((found / expected - 1.0).abs() < 4.0 / f64::sqrt(hits), "{found:e} instead of {expected:e}");
    for estimator in Estimator::COMPARABLE {
        received(estimator);
    }
}

/// Solid angle of a square of half side `half` [m] from `height` [m] above its middle.
fn solid_angle_of_square(half: f64, height: f64) -> f64 {
    4.0 * (half * half / (half * half + height * height)).asin()
}

/// Two rooms with a wall between them: a sheet, or a slab of `thickness` [m], or a sheet with a slit of 5 cm at its top.
fn divided_room(thickness: f64, slit: bool) -> Mesh {
    let mut mesh = Mesh::shoebox(SIZE, [0; 6]);
    let top = if slit { SIZE[2] - 0.05 } else { SIZE[2] };
    let (low, high) = (dvec3(3.0, 0.0, 0.0), dvec3(3.0 + thickness, SIZE[1], top));
    let mut face = |x: f64| {
        let at = |y: f64, z: f64| dvec3(x, y, z);
        meshes::add_quad(
            &mut mesh,
            0,
            [at(low.y, low.z), at(high.y, low.z), at(high.y, high.z), at(low.y, high.z)],
        );
    };
    face(low.x);
    if thickness > 0.0 {
        face(high.x);
    }
    mesh
}

/// Energy behind the wall, by an estimator.
fn behind(mesh: Mesh, estimator: Estimator) -> f64 {
    let settings = Settings { emissions: form(5_000, 100_000), ..Settings::default() };
    // Three millimetres behind the sheet, one behind the slab.
    energies(&rendering(scene(mesh, 0.5, [3.003, 2.2, 1.9]), settings, estimator)).iter().sum()
}

/// Not a packet, not a connection, not an image, not a disc gets through or under a sheet without thickness or a slab of 2 mm that stand
/// on the one floor of both rooms.
#[test]
fn thin_walls_do_not_leak() {
    for estimator in Estimator::COMPARABLE {
        for thickness in [0.0, 0.002] {
            let energy = behind(divided_room(thickness, false), estimator);
            assert!(energy.abs() < 1e-300, "{thickness} m, {estimator:?}: {energy:e}");
        }
    }
    for estimator in [Estimator::Auto, Estimator::Connection] {
        assert!(behind(divided_room(0.0, true), estimator) > 1e-6, "{estimator:?}: a slit is heard");
    }
}

/// A sphere of 512 facets: every disc is larger than its surface. What it gathers is what connections and spheres bring.
#[test]
#[ignore = "long: cargo xtask accept"]
fn discs_may_be_larger_than_their_surface() {
    let received = |absorption: f64, estimator: Estimator, seed: u64| {
        let mut scene = scene(meshes::sphere(2.0, 3), 0.5, [0.7, -0.4, 0.5]);
        scene.sources[0].position = dvec3(-0.6, 0.5, 0.3);
        scene.materials[0].absorption[0] = absorption;
        let settings = Settings { emissions: form(20_000, 200_000), seed, ..Settings::default() };
        let (value, sigma) = batch_fluence(&rendering(scene, settings, estimator), 0, 0);
        Estimate { value, sigma }
    };
    let (gather, connection) = (received(0.2, Estimator::Gather, 1), received(0.2, Estimator::Connection, 2));
    println!(
        "facets: gather {:.5} ± {:.5}, spheres {:.5} ± {:.5}",
        gather.value, gather.sigma, connection.value, connection.sigma
    );
    let within = Within { sigmas: 4.0, maximal_sigma: 0.02 * connection.value };
    agree(gather, connection, within).expect("the same room");
    assert!(
        agree(received(0.25, Estimator::Gather, 3), connection, within).is_err(),
        "other walls are noticed"
    );
}

/// Fluence of a room of Lambert walls at `distance` [m] from one of them, and the loudest of 32 batches over their mean.
fn beside_a_wall(distance: f64, seed: u64, absorption: f64) -> (Estimate, f64) {
    let mut scene = scene(Mesh::shoebox(SIZE, [0; 6]), 1.0, [distance, 2.2, 1.9]);
    scene.materials[0].absorption[0] = absorption;
    let settings = Settings { emissions: form(40_000, 400_000), seed, ..Settings::default() };
    let rendering = rendering(scene, settings, Estimator::Auto);
    let (value, sigma) = batch_fluence(&rendering, 0, 0);
    let loudest = rendering.batches.iter().map(|batch| batch[0].band(0).sum::<f64>()).fold(0.0, f64::max);
    (Estimate { value, sigma }, loudest / value)
}

/// Connections and discs share what comes from beside a receiver: no batch is half as loud again as the others, and the
/// field at a tenth of a millimetre from a wall is that at a centimetre.
#[test]
fn beside_a_wall_nothing_stands_out() {
    let (usual, _) = beside_a_wall(0.01, 1, 0.2);
    let within = Within { sigmas: 4.0, maximal_sigma: form(0.05, 0.02) * usual.value };
    let most = form(1.5, 1.15);
    for (distance, seed) in [(1e-3, 2), (1e-4, 3)] {
        let (near, loudest) = beside_a_wall(distance, seed, 0.2);
        let [value, sigma] = [near.value, near.sigma].map(|energy| energy / usual.value);
        println!(
            "{distance} m from a wall: {value:.3} ± {sigma:.3} of that at 1 cm, loudest batch {loudest:.2}"
        );
        agree(near, usual, within).unwrap_or_else(|error| panic!("{distance} m: {error}"));
        assert!(loudest < most, "{distance} m: {loudest}");
    }
    let (darker, _) = beside_a_wall(1e-3, 4, 0.25);
    assert!(darker.sigma < within.maximal_sigma, "another room is told by its energy, not by its noise");
    assert!(agree(darker, usual, within).is_err(), "other walls are noticed");
}

/// Radius of the discs [m].
const DISC: f64 = 0.25;

/// A millimetre in front of a sonel: the largest that any of 64 packets brings, each a batch of its own, as a part of the most
/// that it may. A sonel that brings e δ cos θ / (π d²) beyond what one at twice the radius of a disc would is gathered:
/// connected it brings at most e δ / (4 π h²), gathered at most e δ (4 π / M) M / (π A), where every ray finds it.
fn largest_contribution(estimator: Estimator) -> f64 {
    const PACKETS: u32 = 64;
    let settings = Settings { emissions: PACKETS.into(), batches: PACKETS, ..Settings::default() };
    let scene = scene(Mesh::shoebox(SIZE, [0; 6]), 1.0, [3.0, 2.5, 2.0]);
    let traced = Traced::new(scene, settings);
    let (mut energy, mut spot) = (vec![0.0; PACKETS as usize], None);
    traced.for_each_segment(|emission, share, segment| {
        let at = traced.geometry.to_world(segment.end);
        if segment.arrival.is_some() {
            energy[traced.map.layout().batch(emission) as usize] += share * segment.energy[0][0];
        }
        // Well within the wall x = 0, where discs are whole.
        let amid = at.x < 1e-4 && at.y > 1.0 && at.y < SIZE[1] - 1.0 && at.z > 1.0 && at.z < SIZE[2] - 1.0;
        if amid && segment.history.order < 3 {
            spot = Some(at);
        }
    });
    let position = spot.expect("one of hundreds of arrivals").with_x(1e-3);
    let settings = RenderSettings {
        estimator,
        rays: Some(form(4_096, 65_536)),
        gather_radius: Some(DISC),
        ..RenderSettings::default()
    };
    let renderer = traced.renderer(settings);
    let receiver = ReceiverPoint::omni("in front of a sonel", position);
    let rendering = renderer.render(0, &[receiver], &[vec![0.0, 0.2]]).expect("in the room");
    let direct = rendering.classes[PathClass::Direct as usize].1[0];
    let most = 0.8 * (0.25 + 4.0) / (std::f64::consts::PI * DISC * DISC);
    let contributions = rendering.batches.iter().zip(&energy).map(|(batch, energy)| {
        let brought = batch[0].band(0).sum::<f64>() - direct;
        // What a batch estimates is what all packets would bring if they were like its own.
        brought / (most * energy * f64::from(PACKETS))
    });
    contributions.fold(0.0, f64::max)
}

/// The largest contribution of a single sonel is bounded. That of connections alone, the sibling, is not.
#[test]
fn no_sonel_outshines_the_others() {
    let shared = largest_contribution(Estimator::Auto);
    let alone = largest_contribution(Estimator::Connection);
    println!("a millimetre in front of a sonel: {shared:.3} of the bound, by connections alone {alone:.0}");
    assert!(shared > 0.0 && shared <= 1.0, "{shared}");
    assert!(alone > 10.0, "connections alone have no bound: {alone}");
}
