//! A run extended is the longer run.
#![allow(clippy::unwrap_used, reason = "the functions that tests share are no #[test] themselves")]

use std::io::Cursor;

use glam::DVec3;
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::{Mesh, MeshTriangle};
use sonel_map::{EffectState, Event, MapHeader, MapWriter, Mode, Settings, ShardRange, SonelMap, Spectral};
use sonel_scene::{Effect, Scene, Source};
use sonel_tracer::{TraceError, TracedChunk, Tracer};

fn scene(absorption: f64, mesh: Mesh) -> Scene {
    let bands = Bands::new(vec![250.0, 500.0, 1000.0], BandWidth::Octave).unwrap();
    let wall = Material {
        name: "wall".to_owned(),
        absorption: vec![absorption, 0.9, 0.05],
        scattering: vec![0.5, 0.1, 0.9],
        transmission: vec![0.0; 3],
        law: sonel_acoustics::AbsorptionLaw::Uniform,
        source: None,
    };
    let mut scene = Scene::from_parts(mesh, vec![wall], bands, 0.4);
    scene.sources.push(Source::omni("a", DVec3::new(1.0, 1.5, 1.2), 3));
    scene.sources.push(Source::omni("b", DVec3::new(3.0, 2.5, 1.7), 3));
    scene
}

fn closed() -> Scene {
    scene(0.2, Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]))
}

/// Without its last wall, and with walls that let sound through.
fn open() -> Scene {
    let mut mesh = Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]);
    mesh.triangles.truncate(10);
    let mut scene = scene(0.2, mesh);
    scene.materials[0].transmission = vec![0.0, 0.25, 0.01];
    scene
}

/// With a screen on its floor, whose edges diffract in the paper's mode.
fn screened() -> Scene {
    let mut mesh = Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]);
    let first = mesh.vertices.len() as u32;
    let corners = [[2.5, 0.0, 0.0], [2.5, 2.5, 0.0], [2.5, 2.5, 1.5], [2.5, 0.0, 1.5]];
    mesh.vertices.extend(corners.map(DVec3::from));
    for corners in [[0, 1, 2], [0, 2, 3]] {
        mesh.triangles.push(MeshTriangle { corners: corners.map(|corner| first + corner), material: 0 });
    }
    scene(0.2, mesh)
}

/// Divided by a wall with thickness, with walls that let sound through.
fn divided() -> Scene {
    let mut mesh = Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]);
    let first = mesh.vertices.len() as u32;
    let solid = Mesh::shoebox([0.3, 4.0, 3.0], [0; 6]);
    mesh.vertices.extend(solid.vertices.iter().map(|vertex| *vertex + DVec3::new(2.0, 0.0, 0.0)));
    mesh.triangles.extend(solid.triangles.iter().map(|triangle| {
        let [a, b, c] = triangle.corners.map(|corner| corner + first);
        MeshTriangle { corners: [a, c, b], ..*triangle }
    }));
    let mut scene = scene(0.2, mesh);
    scene.materials[0].transmission = vec![0.0, 0.25, 0.01];
    scene
}

fn settings(emissions: u64) -> Settings {
    Settings { emissions, batches: 7, ..Settings::default() }
}

/// Provenance of a run in which edges diffract.
fn header(scene: &Scene, settings: Settings) -> MapHeader {
    MapHeader {
        tool_version: "test".to_owned(),
        settings,
        shard: ShardRange::WHOLE,
        effects: vec![EffectState { effect: Effect::Diffraction, on: vec![true; 3], reason: String::new() }],
        scene: scene.clone(),
    }
}

/// The chunks of a run, or of a run that goes on from `beginning`.
fn chunks(scene: &Scene, settings: Settings, beginning: Option<&SonelMap>) -> Vec<TracedChunk> {
    let (geometry, header) = (scene.geometry().unwrap(), header(scene, settings));
    let tracer = Tracer::of(&header, &geometry);
    let mut chunks = Vec::new();
    let sink = |chunk| {
        chunks.push(chunk);
        Ok::<(), TraceError>(())
    };
    match beginning {
        Some(beginning) => tracer.extend(beginning, sink),
        None => tracer.run(ShardRange::WHOLE, sink),
    }
    .unwrap();
    chunks
}

fn map(scene: &Scene, settings: Settings) -> SonelMap {
    let mut writer = MapWriter::begin(Cursor::new(Vec::new())).unwrap();
    for chunk in chunks(scene, settings, None) {
        writer.push_chunk(chunk.source, chunk.first_emission, &chunk.paths, &chunk.ledger).unwrap();
    }
    let bytes = writer.finish(&header(scene, settings), &scene.geometry().unwrap()).unwrap().into_inner();
    SonelMap::from_bytes(&bytes).unwrap()
}

fn has(chunks: &[TracedChunk], event: Event) -> bool {
    chunks.iter().flat_map(|chunk| &chunk.paths.vertices).any(|vertex| vertex.event() == Some(event))
}

#[test]
fn an_extended_run_is_the_longer_run_with_every_kind_of_event() {
    let mut met = Vec::new();
    for (survival, spectral, mode) in [
        (0.15, Spectral::Shared, Mode::Accurate),
        (0.0, Spectral::Shared, Mode::Accurate),
        (0.5, Spectral::PerBand, Mode::Accurate),
        (1.0, Spectral::PerBand, Mode::Paper),
    ] {
        for scene in [closed(), open(), screened(), divided()] {
            let of = |emissions| Settings { survival, spectral, mode, ..settings(emissions) };
            let long = chunks(&scene, of(1200), None);
            met.extend(Event::ALL.into_iter().filter(|&event| has(&long, event)));
            for short in [1, 100, 512, 700, 1199] {
                let beginning = map(&scene, of(short));
                let extended = chunks(&scene, of(1200), Some(&beginning));
                assert!(extended == long, "{short} of 1200, {spectral:?}");
            }
        }
    }
    let events = [
        Event::Absorbed,
        Event::Diffracted,
        Event::Emerged,
        Event::Escaped,
        Event::Expired,
        Event::Left,
        Event::Split,
        Event::Transmitted,
    ];
    assert!(events.iter().all(|event| met.contains(event)), "{met:?}");
}

/// The ledger of the shorter run is not that of the longer one: what is compared above could differ.
#[test]
fn the_first_chunk_of_a_shorter_run_has_the_same_paths_and_other_ledgers() {
    let first = |emissions| chunks(&closed(), settings(emissions), None).swap_remove(0);
    let (short, long) = (first(600), first(1200));
    assert!(short.paths == long.paths && short.ledger != long.ledger);
}
