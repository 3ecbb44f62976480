//! What a pilot predicts of error and time comes true within a factor of 1.5 in nine of ten scenes.

use glam::dvec3;
use sonel::study::evaluation_receivers::{MOST, evaluation_receivers};
use sonel::study::forecast::Effort;
use sonel::study::pilot::{self, PilotConfig};
use sonel::study::pipeline::{Room, render_and_read};
use sonel::study::spread::{PLANNED, readings};
use sonel::{Clock, InMemory};
use sonel_acoustics::{Bands, Material};
use sonel_console::Stopwatch;
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_tests::{meshes, shipped};

fn boxed(size: [f64; 3], absorption: f64, scattering: f64) -> Scene {
    let bands = Bands::octaves();
    let material = Material::uniform("walls", absorption, scattering, bands.count());
    Scene::shoebox(size, material, bands)
}

/// Two rooms, joined by a door 1 m wide and 2 m high.
fn coupled() -> Scene {
    let mut scene = boxed([6.0, 5.0, 3.0], 0.12, 0.4);
    scene.materials.push(Material::uniform("live", 0.05, 0.3, scene.bands.count()));
    let mut mesh = Mesh::default();
    let quad = |mesh: &mut Mesh, material, corners: [[f64; 3]; 4]| {
        meshes::add_quad(mesh, material, corners.map(glam::DVec3::from));
    };
    // A single box 12 x 5 x 3 m, halves of different material, with a thin wall at x = 6 m that leaves the door open.
    for (material, x0, x1) in [(0, 0.0, 6.0), (1, 6.0, 12.0)] {
        quad(&mut mesh, material, [[x0, 0.0, 0.0], [x0, 5.0, 0.0], [x1, 5.0, 0.0], [x1, 0.0, 0.0]]);
        quad(&mut mesh, material, [[x0, 0.0, 3.0], [x1, 0.0, 3.0], [x1, 5.0, 3.0], [x0, 5.0, 3.0]]);
        quad(&mut mesh, material, [[x0, 0.0, 0.0], [x1, 0.0, 0.0], [x1, 0.0, 3.0], [x0, 0.0, 3.0]]);
        quad(&mut mesh, material, [[x0, 5.0, 0.0], [x0, 5.0, 3.0], [x1, 5.0, 3.0], [x1, 5.0, 0.0]]);
    }
    quad(&mut mesh, 0, [[0.0, 0.0, 0.0], [0.0, 0.0, 3.0], [0.0, 5.0, 3.0], [0.0, 5.0, 0.0]]);
    quad(&mut mesh, 1, [[12.0, 0.0, 0.0], [12.0, 5.0, 0.0], [12.0, 5.0, 3.0], [12.0, 0.0, 3.0]]);
    quad(&mut mesh, 0, [[6.0, 0.0, 0.0], [6.0, 2.0, 0.0], [6.0, 2.0, 3.0], [6.0, 0.0, 3.0]]);
    quad(&mut mesh, 0, [[6.0, 3.0, 0.0], [6.0, 5.0, 0.0], [6.0, 5.0, 3.0], [6.0, 3.0, 3.0]]);
    quad(&mut mesh, 0, [[6.0, 2.0, 2.0], [6.0, 3.0, 2.0], [6.0, 3.0, 3.0], [6.0, 2.0, 3.0]]);
    scene.mesh = mesh;
    scene
        .with_duration(1.6)
        .with_source("source", [2.0, 1.5, 1.5])
        .with_receiver("other room", [9.0, 3.4, 1.2])
}

/// A room with a free-standing screen between source and receiver.
fn screened() -> Scene {
    let mut scene = boxed([8.0, 6.0, 4.0], 0.15, 0.3);
    let corners = [dvec3(4.0, 1.0, 0.5), dvec3(4.0, 5.0, 0.5), dvec3(4.0, 5.0, 2.8), dvec3(4.0, 1.0, 2.8)];
    meshes::add_quad(&mut scene.mesh, 0, corners);
    scene.with_source("source", [1.5, 2.5, 1.4]).with_receiver("behind the screen", [6.4, 3.4, 1.2])
}

fn scenes() -> Vec<(&'static str, Scene)> {
    let placed = |scene: Scene| {
        scene.with_source("source", [1.6, 1.3, 1.4]).with_receiver("receiver", [4.4, 2.1, 1.1])
    };
    vec![
        ("shoebox", shipped("shoebox")),
        ("seed room", shipped("seed-room")),
        ("hall", shipped("hall")),
        ("dead box", placed(boxed([6.0, 5.0, 3.0], 0.6, 0.3))),
        ("live box", placed(boxed([6.0, 5.0, 3.0], 0.04, 0.3))),
        ("smooth box", placed(boxed([7.0, 5.0, 3.2], 0.15, 0.08))),
        ("rough box", placed(boxed([10.0, 8.0, 5.0], 0.2, 1.0))),
        ("corridor", placed(boxed([30.0, 2.5, 2.8], 0.1, 0.2))),
        ("screen", screened()),
        ("coupled rooms", coupled()),
    ]
}

/// How far a prediction may be off.
const FACTOR: f64 = 1.5;
/// In how many cases it must not be.
const SHARE: f64 = 0.9;
/// Emissions of the runs that are predicted.
const EMISSIONS: u64 = 50_000;

/// Ratios of achieved to predicted.
#[derive(Default)]
struct Ratios(Vec<f64>);

impl Ratios {
    /// Part of them within the factor, had predictions been `scale` times as large.
    fn within(&self, scale: f64) -> f64 {
        let within = |ratio: &&f64| (1.0 / FACTOR..FACTOR).contains(&(**ratio / scale));
        self.0.iter().filter(within).count() as f64 / self.0.len() as f64
    }
}

/// What was predicted of runs, and what they found.
#[derive(Default)]
struct Record {
    /// Standard errors of parameters.
    errors: Ratios,
    /// Half-widths of intervals, standard error and bias together.
    widths: Ratios,
    /// Where a half-width lies: logarithms of it over the lower and the upper bound of its range.
    ranges: Vec<[f64; 2]>,
    /// CPU seconds.
    times: Ratios,
}

impl Record {
    /// Part of the half-widths inside their ranges, had these been `scale` times as high.
    fn inside(&self, scale: f64) -> f64 {
        let inside = |[low, high]: &&[f64; 2]| *low >= libm::log(scale) && *high <= libm::log(scale);
        self.ranges.iter().filter(inside).count() as f64 / self.ranges.len() as f64
    }

    fn add(&mut self, other: Self) {
        self.errors.0.extend(other.errors.0);
        self.widths.0.extend(other.widths.0);
        self.ranges.extend(other.ranges);
        self.times.0.extend(other.times.0);
    }
}

/// What was predicted and found of every parameter in one run in `scene`, and of CPU seconds.
fn compare(name: &str, scene: &Scene) -> Record {
    let geometry = scene.geometry().expect("walls");
    let room = Room::within(scene, &geometry, &[]);
    let receivers = evaluation_receivers(scene, room.geometry(), MOST);
    let settings = Settings { emissions: EMISSIONS, ..Settings::default() };
    let effort = Effort::of_trace(EMISSIONS, settings.batches);
    let config = PilotConfig { room: &room, settings, receivers: &receivers, seconds: None };
    let clock = Stopwatch::start();
    let pilot = pilot::run(&config, &clock).expect("a pilot");
    let spent = clock.process();
    let traced = room.trace(settings, &mut InMemory, &clock).expect("a run");
    let render = RenderSettings::default();
    let (rendered, parameters) =
        render_and_read(&traced.map, &geometry, &receivers, &render, &clock).expect("a run");
    let mut record = Record::default();
    for (spread, found) in pilot.spreads.iter().zip(readings(&parameters, &PLANNED)) {
        let (Ok(predicted), Ok([low, high])) =
            (pilot.half_width(spread, effort), pilot.range(spread, effort))
        else {
            continue;
        };
        if let Ok(found) = &found.half_width {
            record.errors.0.push(found.noise / predicted.noise);
            record.widths.0.push(found.total() / predicted.total());
            record.ranges.push([libm::log(found.total() / low), libm::log(found.total() / high)]);
        }
    }
    let (price, traced, received) = (pilot.price(effort), traced.seconds, rendered.seconds);
    let trace = (traced.trace + traced.write) / price.trace;
    let render = (traced.open + received.total() - received.parameters) / price.render;
    record.times.0.extend([trace, render]);
    println!(
        "{name}: standard errors within {FACTOR}: {:.2}, half-widths {:.2}, in their ranges {:.2}; time of trace {trace:.2}, of \
         render {render:.2}; pilot of {} emissions {:.2} of the run",
        record.errors.within(1.0),
        record.widths.within(1.0),
        record.inside(1.0),
        pilot.effort.emissions,
        spent / (traced.total() + received.total()),
    );
    record
}

/// Standard errors and times within the factor; half-widths, which may or may not take noise of areas for bias, in their ranges.
#[test]
fn predictions_come_true_in_nine_of_ten() {
    let mut all = Record::default();
    for (name, scene) in scenes() {
        all.add(compare(name, &scene));
    }
    let [errors, widths, times] = [&all.errors, &all.widths, &all.times].map(|ratios| ratios.within(1.0));
    let inside = all.inside(1.0);
    println!("errors {errors:.3}, half-widths {widths:.3}, in ranges {inside:.3}, times {times:.3}");
    // Known-wrong: predictions for four times, or a quarter, of the packets.
    assert!([0.5, 2.0].iter().all(|&scale| all.errors.within(scale) < SHARE && all.inside(scale) < SHARE));
    assert!(times >= SHARE, "times: {:?}", all.times.0);
    assert!(errors >= SHARE, "standard errors: {errors}");
    assert!(inside >= SHARE, "ranges: {inside}");
}
