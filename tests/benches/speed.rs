//! Speed benchmark: segments traced against bare rays, connections against bare shadow rays.
//!
//! All parameters are for one thread and CPU seconds, measured in one run, so that their ratios mean something on a busy
//! machine. The bare rays are those of the traced paths themselves, cast again without anything else.
//!
//! Typical values, in parentheses the ratio to the bare rays of the same paths:
//!
//! | | seed room, 14 triangles | hall, 5108 triangles |
//! |---|---|---|
//! | closest hits | 14.1 M/s | 3.4 M/s |
//! | segments traced | 9.0 M/s (0.64) | 2.9 M/s (0.86) |
//! | connections, 16 receivers | 16.3 M/s (0.69) | 7.4 M/s (0.78) |
//! | connections, 1 receiver | 9.9 M/s (0.50) | 3.8 M/s (0.64) |
//! | tracing into a file against tracing alone | 1.10 | 1.09 |
//! | bytes per stored sonel | 16.1 | 16.5 |
//!
//! Exact edges take 1.16 times as long in the seed room.

#![allow(clippy::print_stdout)] // a benchmark reports to whoever runs it

use std::hint::black_box;
use std::io::BufWriter;
use std::time::Duration;

use cpu_time::ProcessTime;
use glam::Vec3;
use sonel::study::response::receivers_of;
use sonel_acoustics::Coefficient;
use sonel_analysis::Parameter;
use sonel_geometry::{Departure, Geometry};
use sonel_map::{MapWriter, Settings, SonelMap};
use sonel_renderer::{EdgeWork, ReceiverPoint, RenderSettings};
use sonel_scene::Scene;
use sonel_tests::{Traced, shipped};

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the first pool");
    let chosen: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    for name in ["shoebox", "seed-room", "hall"] {
        if !chosen.is_empty() && !chosen.iter().any(|word| word == name) {
            continue;
        }
        let scene = shipped(name);
        println!("{name}: {} triangles, {} bands", scene.mesh.triangles.len(), scene.bands.count());
        measure(scene);
    }
    if chosen.is_empty() || chosen.iter().any(|word| word == "what-if") {
        measure_what_if();
    }
    for (name, counts, allowed) in EDGES {
        if chosen.is_empty() || chosen.iter().any(|word| word == "edges") {
            counts.iter().for_each(|&count| measure_edges_alone(name, count, allowed));
        }
    }
}

/// CPU seconds of the hall rendered at six receivers as traced, with every material changed, and with derivatives by all coefficients.
fn measure_what_if() {
    let settings = Settings { emissions: 60_000, ..Settings::default() };
    let mut traced = Traced::diffracting(shipped("hall"), settings);
    let scene = traced.map.header().scene.clone();
    let as_traced = cpu_seconds(|| drop(black_box(traced.respond(RenderSettings::default()))));
    let wanted = [Parameter::Level, Parameter::EarlyDecayTime, Parameter::T30, Parameter::ClarityC80];
    let (receivers, both) = (receivers_of(&scene), [Coefficient::Absorption, Coefficient::Scattering]);
    let render = RenderSettings::default();
    let all = cpu_seconds(|| {
        let found = traced.varied(&receivers, render).vary(&both, &sonel::Silent);
        black_box(found.expect("a valid map").sensitivities(&wanted));
    });
    let mut materials = scene.materials.clone();
    let change = |value: &mut f64| *value = 0.9 * *value + 0.02;
    for material in &mut materials {
        material.absorption.iter_mut().chain(&mut material.scattering).for_each(change);
    }
    traced.map.change(materials, scene.sources);
    let changed = cpu_seconds(|| drop(black_box(traced.respond(RenderSettings::default()))));
    println!(
        "what-if, hall, 60 000 packets: rendering {as_traced:.1} CPU-s; {:.2} of it with all materials changed (1 wanted), {:.2} with \
         derivatives by all coefficients (2 wanted)",
        changed / as_traced,
        all / as_traced
    );
}

fn cpu_seconds(work: impl FnOnce()) -> f64 {
    let start = ProcessTime::now();
    work();
    start.elapsed().as_secs_f64()
}

/// Scenes, numbers of receivers, and CPU seconds that edges may take for the first of them.
const EDGES: [(&str, &[usize], f64); 3] =
    [("Concert hall", &[6], 2.0), ("office screen", &[50, 1000], 5.0), ("coupled rooms", &[6], 1.0)];

/// CPU seconds that edges take at `count` receivers: the difference to a map without.
fn measure_edges_alone(name: &str, count: usize, allowed: f64) {
    let scene = sonel_tests::effect_scenes::scenes().into_iter().find(|scene| scene.name == name);
    let scene = scene.expect("one of them");
    let render = |effects: &[&str]| {
        let traced = Traced::with(effects, scene.clone(), Settings { emissions: 64, ..Settings::default() });
        let settings =
            RenderSettings { estimator: sonel_renderer::Estimator::Connection, ..Default::default() };
        let receivers = spread(&traced, count);
        let renderer = traced.renderer(settings);
        let borders = vec![vec![0.0, scene.duration]; receivers.len()];
        let start = ProcessTime::now();
        let rendering = renderer.render(0, &receivers, &borders).expect("sound receivers");
        (start.elapsed().as_secs_f64(), rendering)
    };
    let ((with, rendering), (without, _)) = (render(&["diffraction"]), render(&[]));
    let most = rendering.edge_work.iter().map(|work| work.computed).max().unwrap_or(0);
    let left_out = |work: &EdgeWork| work.left_out.iter().copied().fold(0.0, f64::max);
    let dropped = rendering.edge_work.iter().map(left_out).fold(0.0, f64::max);
    println!(
        "edges, {name}, {count} receivers: {:.2} CPU-s ({allowed} allowed for the fewest), up to {most} contributions, the others expected \
         to change {:.2} dB",
        with - without,
        10.0 * dropped.ln_1p() * std::f64::consts::LOG10_E
    );
}

/// The receivers of the scene, or `count` places spread over its floor where it has fewer.
fn spread(traced: &Traced, count: usize) -> Vec<ReceiverPoint> {
    let known = &traced.map.header().scene.receivers;
    if known.len() == count {
        return known.iter().map(ReceiverPoint::from).collect();
    }
    let (low, high) = traced.geometry.bounds();
    let place = |index: usize| {
        let share = |step: f64| 0.08 + 0.84 * (step * (index as f64 + 0.5)).fract();
        // The additive sequence of the plastic number.
        let share = glam::DVec3::new(share(0.754_877_666), share(0.569_840_291), 0.4);
        ReceiverPoint::omni(&index.to_string(), low + share * (high - low))
    };
    (0..count).map(place).collect()
}

/// From so many edges on the exact ones take minutes, and are not measured.
const MANY_EDGES: usize = 100;

fn measure(scene: Scene) {
    let settings = Settings { emissions: 20_000, ..Settings::default() };
    let geometry = scene.geometry().expect("a sound mesh");
    let traced = Traced::new(scene.clone(), settings);
    let rays = bare_rays(&traced.map, &traced.geometry);
    let trace = || {
        sonel_tracer::Tracer::new(&scene, &geometry, settings)
            .run(sonel_map::ShardRange::WHOLE, |chunk| {
                black_box(&chunk);
                Ok::<(), sonel_tracer::TraceError>(())
            })
            .expect("a tight room")
            .segments
    };
    let cast = || {
        rays.iter()
            .filter(|(from, direction)| traced.geometry.closest_hit(*from, *direction).is_some())
            .count()
    };
    let (trace_time, closest_time, segments) = in_turn(trace, cast);
    let rate = |count: u64, time: Duration| count as f64 / time.as_secs_f64() / 1e6;
    let bare = rate(rays.len() as u64, closest_time);
    let tracing = rate(segments, trace_time);
    println!(
        "  {segments} segments, {} vertices, {:.1} bytes per vertex",
        traced.map.vertex_count(),
        traced.map.byte_length() as f64 / traced.map.vertex_count() as f64
    );
    println!(
        "  tracing      {tracing:7.2} M segments/s   {:.2} of bare closest-hit rays ({bare:.2} M/s)",
        tracing / bare
    );
    if geometry.diffracting_edges().count() < MANY_EDGES {
        measure_edges(&scene);
    }
    measure_writing(&scene, &geometry, settings);
    for count in [1, 16] {
        measure_connections(&traced, count);
    }
}

/// How much longer a segment takes from the source to the echogram of one receiver, everything at its defaults, with edges that
/// diffract.
fn measure_edges(scene: &Scene) {
    let settings = Settings { emissions: 4_000, ..Settings::default() };
    let segments = |traced: &Traced| {
        black_box(traced.render(RenderSettings::default()));
        traced.ledger.segments
    };
    type Trace = fn(Scene, Settings) -> Traced;
    let run = |trace: Trace| segments(&trace(scene.clone(), settings));
    let (with, without, _) = in_turn(|| run(Traced::diffracting), || run(Traced::new));
    let ratio = with.as_secs_f64() / without.as_secs_f64();
    println!("  edges, trace and render: {ratio:.3} of the time");
}

/// How much longer tracing takes when the map goes to a file.
fn measure_writing(scene: &Scene, geometry: &Geometry, settings: Settings) {
    let tracer = sonel_tracer::Tracer::new(scene, geometry, Settings { emissions: 100_000, ..settings });
    let write = || {
        let file = BufWriter::with_capacity(1 << 20, tempfile::tempfile().expect("a temporary file"));
        let mut writer = MapWriter::begin(file).expect("a disk with room");
        tracer
            .run(sonel_map::ShardRange::WHOLE, |chunk| {
                let pushed =
                    writer.push_chunk(chunk.source, chunk.first_emission, &chunk.paths, &chunk.ledger);
                pushed.map_err(sonel::Error::from)
            })
            .expect("a tight room")
    };
    let trace = || {
        tracer
            .run(sonel_map::ShardRange::WHOLE, |chunk| {
                black_box(&chunk);
                Ok::<(), sonel_tracer::TraceError>(())
            })
            .expect("a tight room")
    };
    let (written, traced, _) = in_turn(write, trace);
    println!(
        "  tracing into a file takes {:.2} of the time without",
        written.as_secs_f64() / traced.as_secs_f64()
    );
}

fn measure_connections(traced: &Traced, count: usize) {
    let scene = &traced.map.header().scene;
    let receivers: Vec<ReceiverPoint> = (0..count)
        .map(|index| {
            let aside = glam::DVec3::new(0.1, 0.0, 0.05) * index as f64;
            ReceiverPoint::omni(&index.to_string(), scene.receivers[0].position + aside)
        })
        .collect();
    let settings = RenderSettings {
        estimator: sonel_renderer::Estimator::Connection,
        mirror_order: Some(0),
        ..Default::default()
    };
    let renderer = traced.renderer(settings);
    let borders = vec![vec![0.0, scene.duration]; count];
    let shadows = shadow_rays(traced, &receivers);
    let render = || renderer.render(0, &receivers, &borders).expect("sound receivers");
    let cast = || shadows.iter().filter(|(from, to)| traced.geometry.is_blocked(*from, *to)).count();
    let (render_time, shadow_time, _) = in_turn(render, cast);
    let rate = |count: usize, time: Duration| count as f64 / time.as_secs_f64() / 1e6;
    let (connecting, bare) = (rate(shadows.len(), render_time), rate(shadows.len(), shadow_time));
    println!(
        "  {count:3} receivers {connecting:6.2} M connections/s {:.2} of bare any-hit rays ({bare:.2} M/s), {} connections",
        connecting / bare,
        shadows.len()
    );
}

/// Runs of each kind; the shortest counts.
const REPEATS: u32 = 12;

/// The shortest CPU times of `work` and of `bare`, run in turn so that both meet the same neighbours on the machine, and
/// what the last `work` returned.
fn in_turn<T, U>(mut work: impl FnMut() -> T, mut bare: impl FnMut() -> U) -> (Duration, Duration, T) {
    let (mut shortest, mut last) = ([Duration::MAX; 2], None);
    for _ in 0..REPEATS {
        let start = ProcessTime::now();
        last = Some(black_box(work()));
        shortest[0] = shortest[0].min(start.elapsed());
        let start = ProcessTime::now();
        black_box(bare());
        shortest[1] = shortest[1].min(start.elapsed());
    }
    (shortest[0], shortest[1], last.expect("at least one repeat"))
}

fn bare_rays(map: &SonelMap, geometry: &Geometry) -> Vec<(Departure, Vec3)> {
    let source = geometry.to_local(map.header().scene.sources[0].position);
    let mut rays = Vec::new();
    for emission in 0..map.layout().total {
        let (mut from, mut at) = (Departure::free(source), source);
        for vertex in map.path(0, emission).expect("a whole map").vertices {
            rays.push((from, (vertex.position - at).normalize_or(Vec3::X)));
            from = geometry.leave(vertex.position, vertex.surface(), vertex.side());
            at = vertex.position;
        }
    }
    rays
}

fn shadow_rays(traced: &Traced, receivers: &[ReceiverPoint]) -> Vec<(Departure, Vec3)> {
    let geometry = &traced.geometry;
    let mut rays = Vec::new();
    for emission in 0..traced.map.layout().total {
        for vertex in traced.map.path(0, emission).expect("a whole map").vertices {
            let normal = geometry.surface(vertex.surface()).normal.as_vec3() * geometry_sign(vertex.side());
            for receiver in receivers {
                let to = geometry.to_local(receiver.position);
                if normal.dot(to - vertex.position) > 0.0 {
                    rays.push((geometry.leave(vertex.position, vertex.surface(), vertex.side()), to));
                }
            }
        }
    }
    rays
}

fn geometry_sign(side: sonel_geometry::Side) -> f32 {
    side.sign() as f32
}
