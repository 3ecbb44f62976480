//! CPU seconds to an accuracy: 0.1 dB of every band's level and 1 % of T30, trace and render together.
//!
//! Each case is run with several seeds; the spread of the parameters, not their intervals, is scaled by 1/√N to the wanted
//! accuracy, and the CPU seconds with it. One thread; CPU seconds of the same machine and run. Words after `--` choose the cases whose names
//! begin with them.

#![allow(clippy::print_stdout)] // a benchmark reports to whoever runs it

use glam::DVec3;
use sonel::InMemory;
use sonel::study::pipeline::{Room, render_and_read};
use sonel::study::response::receivers_of;
use sonel_analysis::Parameter;
use sonel_console::Stopwatch;
use sonel_geometry::{Mesh, MeshTriangle};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::{Receiver, Scene};
use sonel_tests::{meshes, shipped};

/// Packets in the hall: about those of the default, where packets and visibility rays bring noise alike.
const HALL_PACKETS: u64 = 100_000;
/// Seeds of each case; fewer where a hundred receivers tell the spread as well.
const SEEDS: [u64; 2] = [12, 4];
const LEVEL_DB: f64 = 0.1;
const T30_RELATIVE: f64 = 0.01;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the first pool");
    println!("to reach {LEVEL_DB} dB of every band's level and {:.0} % of T30 (s.d.)", T30_RELATIVE * 100.0);
    let shoebox = shipped("shoebox");
    case("shoebox, s 0.5, 1 receiver", &shoebox, 4_000);
    case("shoebox, s 0.1, 1 receiver", &scattering(shoebox.clone(), 0.1), 4_000);
    case("shoebox, s 0.5, 100 receivers", &receivers(shoebox, 100), 2_000);
    case("seed room, 1 receiver", &shipped("seed-room"), 4_000);
    let mut hall = shipped("hall");
    case("hall, 6 receivers", &hall, HALL_PACKETS);
    hall.receivers.truncate(1);
    case("hall, 1 receiver", &hall, HALL_PACKETS);
    case("hall, 100 receivers", &receivers(hall.clone(), 100), HALL_PACKETS);
    let mut fine = hall;
    fine.mesh = tessellated(&fine.mesh, 100_000);
    let name = format!("hall of {} triangles", fine.mesh.triangles.len());
    case(&format!("{name}, 1 receiver"), &fine, HALL_PACKETS);
    case(&format!("{name}, 100"), &receivers(fine, 100), HALL_PACKETS);
}

/// The same surfaces in at least `count` triangles: every triangle in four as long as that is too few, then as many as needed
/// about their middles. Edges stay whole or are halved on both sides.
fn tessellated(mesh: &Mesh, count: usize) -> Mesh {
    let mut mesh = mesh.clone();
    while 4 * mesh.triangles.len() <= count {
        mesh = meshes::tessellated(&mesh, 1);
    }
    for number in 0..(count.saturating_sub(mesh.triangles.len())).div_ceil(2) {
        let triangle = mesh.triangles[number];
        let [a, b, c] = triangle.corners;
        let middle = mesh.vertices.len() as u32;
        mesh.vertices
            .push(triangle.corners.map(|corner| mesh.vertices[corner as usize]).iter().sum::<DVec3>() / 3.0);
        mesh.triangles[number].corners = [a, b, middle];
        mesh.triangles
            .extend([[b, c, middle], [c, a, middle]].map(|corners| MeshTriangle { corners, ..triangle }));
    }
    mesh
}

fn scattering(mut scene: Scene, scattering: f64) -> Scene {
    for material in &mut scene.materials {
        material.scattering.fill(scattering);
    }
    scene
}

/// `count` receivers about the first, on a square grid of 10 cm.
fn receivers(mut scene: Scene, count: usize) -> Scene {
    let first = scene.receivers[0].position;
    let across = scene.up.any_orthonormal_vector();
    let along = scene.up.cross(across);
    scene.receivers = (0..count)
        .map(|number| {
            let (row, column) = ((number / 10) as f64 - 4.5, (number % 10) as f64 - 4.5);
            let position: DVec3 = first + 0.1 * (row * across + column * along);
            Receiver::towards(&number.to_string(), position, scene.sources[0].position)
        })
        .collect();
    scene
}

fn case(name: &str, scene: &Scene, emissions: u64) {
    let mut chosen = std::env::args().skip(1).filter(|word| !word.starts_with('-')).peekable();
    if chosen.peek().is_some() && !chosen.any(|word| name.starts_with(&word)) {
        return;
    }
    let geometry = scene.geometry().expect("a sound mesh");
    let room = Room::within(scene, &geometry, &[]);
    let receivers = receivers_of(scene);
    let (mut levels, mut times, mut seconds) = (Vec::new(), Vec::new(), 0.0);
    let seeds = SEEDS[usize::from(receivers.len() >= 100)];
    for seed in 1..=seeds {
        let trace = Settings { emissions, seed, ..Settings::default() };
        let clock = Stopwatch::start();
        let traced = room.trace(trace, &mut InMemory, &clock).expect("a tight room");
        let render = RenderSettings::default();
        let (rendered, parameters) = render_and_read(&traced.map, &geometry, &receivers, &render, &clock)
            .expect("receivers within the room");
        seconds += (traced.seconds.total() + rendered.seconds.total()) / seeds as f64;
        let bands = || parameters.iter().flat_map(|receiver| &receiver.bands);
        let values = |parameter| -> Vec<f64> {
            bands().map(|band| band.parameter(parameter).as_ref().map_or(f64::NAN, |e| e.value)).collect()
        };
        levels.push(values(Parameter::Level));
        times.push(values(Parameter::T30).into_iter().map(f64::ln).collect::<Vec<_>>());
    }
    let (level, time) = (typical_spread(&levels), typical_spread(&times));
    let factor = (level / LEVEL_DB).powi(2).max((time / T30_RELATIVE).powi(2));
    println!(
        "{name:32} {emissions:6} emissions: s.d. {level:.3} dB, {:.2} % of T30, {seconds:.3} CPU s → {:.3} CPU s{}",
        100.0 * time,
        seconds * factor,
        refusals(&times)
    );
}

/// How many times were refused, if any: the spread then is that of the others.
fn refusals(runs: &[Vec<f64>]) -> String {
    let refused = runs.iter().flatten().filter(|time| time.is_nan()).count();
    let all = runs.len() * runs[0].len();
    if refused == 0 { String::new() } else { format!("; {refused} of {all} T30 refused as too noisy") }
}

/// Root mean square over receivers and bands, those with a value in every run, of the standard deviation over seeds.
fn typical_spread(runs: &[Vec<f64>]) -> f64 {
    let count = runs.len() as f64;
    let parameters: Vec<usize> =
        (0..runs[0].len()).filter(|&estimate| runs.iter().all(|run| run[estimate].is_finite())).collect();
    let variance = |estimate: usize| {
        let mean = runs.iter().map(|run| run[estimate]).sum::<f64>() / count;
        runs.iter().map(|run| (run[estimate] - mean).powi(2)).sum::<f64>() / (count - 1.0)
    };
    (parameters.iter().map(|&estimate| variance(estimate)).sum::<f64>() / parameters.len() as f64).sqrt()
}
