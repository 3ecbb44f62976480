//! A trace of any drawing ends with a map that its reader accepts, or with a reason.
//!
//! Drawings are rooms with needles, specks and strips of about the resolution, which cross, touch and coincide. The normal of a part
//! lower than the resolution is rounding, not a number at worst.
#![allow(clippy::unwrap_used, reason = "the functions that tests share are no #[test] themselves")]

use sonel_tracer::TraceError;
use std::io::Cursor;

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::{Geometry, Mesh, MeshTriangle};
use sonel_map::{MapHeader, MapWriter, Mode, Settings, ShardRange, SonelMap};
use sonel_scene::{Scene, Source};
use sonel_testkit::uniform::Uniform;
use sonel_tracer::Tracer;

/// Drawings; the larger number in release, where `cargo xtask accept` runs it.
const DRAWINGS: u64 = if cfg!(debug_assertions) { 200 } else { 50_000 };
/// Size of the room [m].
const SIZE: [f64; 3] = [6.0, 5.0, 4.0];
/// Most slivers in it.
const SLIVERS: usize = 30;
/// Packets of each trace.
const PACKETS: u64 = 64;

/// A length [m] of evenly distributed logarithm.
fn any_length(random: &mut Uniform, low: f64, high: f64) -> f64 {
    low * libm::pow(high / low, random.next_f64())
}

/// A direction, half of the time along an axis, as most of what people draw.
fn any_direction(random: &mut Uniform) -> DVec3 {
    if random.below(2) == 0 {
        return [DVec3::X, DVec3::Y, DVec3::Z][random.below(3)];
    }
    let mut coordinate = || random.between(-1.0, 1.0);
    dvec3(coordinate(), coordinate(), coordinate()).try_normalize().unwrap_or(DVec3::X)
}

/// A corner of the mesh, a place within about the resolution of one, on a side of a triangle, or anywhere.
fn any_place(random: &mut Uniform, mesh: &Mesh) -> DVec3 {
    let corner = mesh.vertices[random.below(mesh.vertices.len())];
    match random.below(4) {
        0 => corner,
        1 => corner + any_length(random, 1e-9, 1e-4) * any_direction(random),
        2 => {
            let [a, b, _] = mesh.corners(random.below(mesh.triangles.len()) as u32);
            a.lerp(b, random.next_f64())
        }
        _ => DVec3::from(SIZE.map(|size| random.between(0.0, size))),
    }
}

fn add(mesh: &mut Mesh, corners: [DVec3; 3]) {
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(corners);
    mesh.triangles.push(MeshTriangle { corners: [first, first + 1, first + 2], material: 0 });
}

/// A room with slivers.
fn drawing(seed: u64) -> Mesh {
    let mut random = Uniform::new(seed);
    let random = &mut random;
    let mut mesh = Mesh::shoebox(SIZE, [0; 6]);
    for _ in 0..1 + random.below(SLIVERS) {
        let [from, to, apart] = [0; 3].map(|_| any_place(random, &mesh));
        let width = any_length(random, 1e-8, 1e-2) * any_direction(random);
        match random.below(4) {
            // A needle.
            0 => add(&mut mesh, [from, from + width, to]),
            // A speck.
            1 => {
                let size = any_length(random, 1e-7, 1e-1);
                let [a, b] = [0; 2].map(|_| size * any_direction(random));
                add(&mut mesh, [from, from + a, from + b]);
            }
            // A strip.
            2 => {
                add(&mut mesh, [from, from + width, to + width]);
                add(&mut mesh, [from, to + width, to]);
            }
            // A triangle through all of them.
            _ => add(&mut mesh, [from + width, to, apart]),
        }
    }
    mesh
}

fn scene(mesh: Mesh) -> Scene {
    let bands = Bands::new(vec![500.0], BandWidth::Octave).unwrap();
    let mut scene = Scene::from_parts(mesh, vec![Material::uniform("wall", 0.2, 0.3, 1)], bands, 0.2);
    scene.sources.push(Source::omni("source", dvec3(1.1, 1.7, 1.3), 1));
    scene
}

/// The map of a trace, written and read again; none where the trace ends with a reason.
fn traced(scene: &Scene, geometry: &Geometry, settings: Settings) -> Option<SonelMap> {
    let header = MapHeader {
        tool_version: "test".to_owned(),
        settings,
        shard: ShardRange::WHOLE,
        effects: Vec::new(),
        scene: scene.clone(),
    };
    let mut writer = MapWriter::begin(Cursor::new(Vec::new())).unwrap();
    let sink = |chunk: sonel_tracer::TracedChunk| {
        writer.push_chunk(chunk.source, chunk.first_emission, &chunk.paths, &chunk.ledger).unwrap();
        Ok::<(), TraceError>(())
    };
    Tracer::of(&header, geometry).run(ShardRange::WHOLE, sink).ok()?;
    let bytes = writer.finish(&header, geometry).unwrap().into_inner();
    Some(SonelMap::from_bytes(&bytes).unwrap())
}

/// What is wrong with the map of a trace in a drawing.
fn fault(mesh: Mesh, seed: u64) -> Option<String> {
    let scene = scene(mesh);
    let geometry = scene.geometry().ok()?;
    let mode = [Mode::Accurate, Mode::Paper][(seed % 2) as usize];
    let map = traced(&scene, &geometry, Settings { emissions: PACKETS, seed, mode, ..Settings::default() })?;
    let surfaces = geometry.surfaces();
    if let Some(surface) = surfaces.iter().find(|surface| !surface.normal.is_normalized()) {
        return Some(format!("a surface of {} m² without a normal", surface.area));
    }
    map.check_paths(surfaces.len() as u32).err().map(|error| error.to_string())
}

#[test]
fn a_trace_among_slivers_ends_with_a_map_that_reads_or_with_a_reason() {
    let faults: Vec<String> =
        (0..DRAWINGS).filter_map(|seed| Some(format!("{seed}: {}", fault(drawing(seed), seed)?))).collect();
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults[..faults.len().min(20)].join("\n"));
}

/// The campaign reads maps: most traces have one.
#[test]
fn most_traces_among_slivers_have_a_map() {
    let has_map = |seed: &u64| {
        let scene = scene(drawing(*seed));
        let geometry = scene.geometry().unwrap();
        traced(&scene, &geometry, Settings { emissions: PACKETS, ..Settings::default() }).is_some()
    };
    let maps = (0..40).filter(has_map).count();
    assert!(maps > 30, "{maps} of 40");
}
