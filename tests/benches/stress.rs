//! Large meshes: from 20 to 1.3 million triangles, what a segment costs, and what loading, tracing and rendering take.
//!
//! The room is the same box each time, its walls waved so that no two triangles are coplanar: every triangle is a surface of
//! its own. One thread, CPU seconds; memory is the peak of the process so far, `VmHWM` of `/proc/self/status`.
//! 1 310 720 triangles and 5000 packets take 20 s to load, 0.22 s to trace, 6.2 s to render, and 2954 MB.

#![allow(clippy::print_stdout)] // a benchmark reports to whoever runs it

use cpu_time::ProcessTime;
use glam::DVec3;
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_tests::{Traced, meshes};

/// Extent of the box [m].
const SIZE: [f64; 3] = [20.0, 15.0, 10.0];
/// Height of the waves [m].
const WAVES: f64 = 0.05;
/// What the largest may take [MB].
const MOST_MEMORY: f64 = 4096.0;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the first pool");
    println!("triangles  surfaces  load/s  trace/s  Mseg/s  per segment  render/s  peak/MB");
    let mut plain = None;
    for times in [0, 2, 4, 6, 8] {
        let scene = waved_box(times);
        let triangles = scene.mesh.triangles.len();
        let start = ProcessTime::now();
        let geometry = scene.geometry().expect("a sound mesh");
        let load = start.elapsed().as_secs_f64();
        let surfaces = geometry.surfaces().len();
        let settings = Settings { emissions: 5_000, ..Settings::default() };
        let start = ProcessTime::now();
        let segments = sonel_tracer::Tracer::new(&scene, &geometry, settings)
            .run(sonel_map::ShardRange::WHOLE, |_| Ok::<(), sonel_tracer::TraceError>(()))
            .expect("a tight room")
            .segments;
        let trace = start.elapsed().as_secs_f64();
        drop(geometry);
        let traced = Traced::new(scene, settings);
        let start = ProcessTime::now();
        let rendering = traced.render(RenderSettings::default());
        let render = start.elapsed().as_secs_f64();
        assert!(rendering.total.get(0, 100, 0).is_finite());
        let per_segment = trace / segments as f64;
        let slowdown = per_segment / *plain.get_or_insert(per_segment);
        let peak = peak_memory();
        println!(
            "{triangles:9}  {surfaces:8}  {load:6.2}  {trace:7.2}  {:6.2}  {slowdown:10.2}x  {render:8.2}  {peak:7.0}",
            1e-6 / per_segment
        );
        assert!(peak < MOST_MEMORY, "{triangles} triangles take {peak} MB");
    }
}

/// The box in 20 · 4^`times` triangles, vertices inside its walls moved along the normals by waves.
fn waved_box(times: u32) -> Scene {
    let bands = Bands::new(vec![500.0, 1000.0, 2000.0, 4000.0], BandWidth::Octave).expect("four octaves");
    let mut mesh = meshes::tessellated(&halved_box(), times);
    for vertex in &mut mesh.vertices {
        let on = DVec3::from(SIZE).to_array();
        for axis in 0..3 {
            let (u, v) = (vertex[(axis + 1) % 3], vertex[(axis + 2) % 3]);
            let inside = |at: f64, size: f64| 1e-9 < at && at < size - 1e-9;
            let within = inside(u, on[(axis + 1) % 3]) && inside(v, on[(axis + 2) % 3]);
            if within && !inside(vertex[axis], on[axis]) {
                vertex[axis] += WAVES * (1.7 * u).sin() * (2.3 * v + 0.5).cos();
            }
        }
    }
    Scene::from_parts(mesh, vec![Material::uniform("walls", 0.2, 0.5, 4)], bands, 1.0)
        .with_source("source", [4.0, 5.0, 3.0])
        .with_receiver("receiver", [14.0, 9.0, 4.0])
}

/// The walls of the box, those along x in two halves: 20 triangles, so that some power of four makes more than a million.
fn halved_box() -> Mesh {
    let [x, y, z] = SIZE;
    let mut mesh = Mesh::default();
    let mut wall = |corners: [[f64; 3]; 4]| meshes::add_quad(&mut mesh, 0, corners.map(DVec3::from));
    for end in [0.0, x] {
        wall([[end, 0.0, 0.0], [end, y, 0.0], [end, y, z], [end, 0.0, z]]);
    }
    for [from, to] in [[0.0, 0.5 * x], [0.5 * x, x]] {
        for side in [0.0, y] {
            wall([[from, side, 0.0], [to, side, 0.0], [to, side, z], [from, side, z]]);
        }
        for height in [0.0, z] {
            wall([[from, 0.0, height], [to, 0.0, height], [to, y, height], [from, y, height]]);
        }
    }
    mesh.welded().mesh
}

/// Largest resident memory of this process so far [MB]; NaN where the system does not tell.
fn peak_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|rest| rest.trim().trim_end_matches("kB").trim().parse::<f64>().ok());
    kib.map_or(f64::NAN, |kib| kib / 1024.0)
}
