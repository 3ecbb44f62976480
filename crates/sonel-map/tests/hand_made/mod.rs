//! A small map made by hand, without a tracer: two sources in a box of two materials, every event a path can hold.

use std::io::Cursor;

use glam::{DVec3, Vec3};
use sonel_acoustics::{Bands, Material, Pattern};
use sonel_geometry::{Geometry, Mesh, Side};
use sonel_map::{
    ChunkPaths, EffectState, Event, Fates, Ledger, MapHeader, MapWriter, Settings, ShardRange, Vertex,
};
use sonel_scene::{Effect, Receiver, Scene, Source};

/// Emissions of each of the two sources.
pub(crate) const EMISSIONS: u64 = 7;

/// The scene: a closed box whose floor is of another material.
pub(crate) fn scene() -> Scene {
    let bands = Bands::new(vec![250.0, 500.0, 1000.0], sonel_acoustics::BandWidth::Octave).unwrap();
    let material = |name: &str, absorption: [f64; 3], source: Option<&str>| Material {
        name: name.to_owned(),
        absorption: absorption.to_vec(),
        scattering: vec![0.25, 0.5, 0.75],
        transmission: vec![0.0; 3],
        law: sonel_acoustics::AbsorptionLaw::Uniform,
        source: source.map(str::to_owned),
    };
    let materials =
        vec![material("walls", [0.1, 0.2, 0.3], None), material("floor", [0.5; 3], Some("chosen"))];
    let mesh = Mesh::shoebox([5.0, 4.0, 3.0], [0, 0, 0, 0, 1, 0]);
    let mut scene = Scene::from_parts(mesh, materials, bands, 0.5);
    // Stated here, so that the golden file depends on no formula.
    scene.speed_of_sound = 343.0;
    scene.air_attenuation = vec![0.001, 0.002, 0.004];
    scene.name = "Box".to_owned();
    let aim = DVec3::new(0.0, 0.0, 1.0);
    for (name, x) in [("left", 1.0), ("right", 4.0)] {
        scene.sources.push(Source { aim, ..Source::omni(name, DVec3::new(x, 2.0, 1.0), 3) });
    }
    scene.receivers.push(Receiver {
        name: "seat".to_owned(),
        position: DVec3::new(2.5, 3.0, 1.25),
        aim,
        pattern: Pattern::Omni,
    });
    (scene.digest, scene.mesh_digest) = ([1; 32], [2; 32]);
    scene
}

/// Provenance of a run of `emissions` per source.
pub(crate) fn header(emissions: u64) -> MapHeader {
    MapHeader {
        tool_version: "by hand".to_owned(),
        settings: Settings { emissions, seed: 11, batches: 2, ..Settings::default() },
        shard: ShardRange::WHOLE,
        effects: vec![EffectState {
            effect: Effect::Air,
            on: vec![false, true, true],
            reason: "asked for".to_owned(),
        }],
        scene: scene(),
    }
}

/// Paths of 1 to [`EMISSIONS`] vertices between points on the walls.
pub(crate) fn paths(geometry: &Geometry, source: u32) -> ChunkPaths {
    const BEFORE: [Event; 3] = [Event::Specular, Event::Diffuse, Event::Transmitted];
    const LAST: [Event; 5] = [Event::Absorbed, Event::Expired, Event::Left, Event::Escaped, Event::Lost];
    let mut paths = ChunkPaths::default();
    for emission in 0..EMISSIONS as usize {
        for step in 0..emission {
            let surface = geometry.triangle_surface(((step * 5 + source as usize) % 12) as u32);
            let at = geometry.surface(surface).centroid - geometry.center();
            let side = if step % 4 == 3 { Side::Back } else { Side::Front };
            paths.vertices.push(Vertex::new(at.as_vec3(), surface, side, BEFORE[step % BEFORE.len()]));
        }
        let end = Vec3::new(0.5, -0.25, emission as f32 * 0.125);
        paths.vertices.push(match LAST[emission % LAST.len()] {
            event @ (Event::Escaped | Event::Left | Event::Lost) => Vertex::nowhere(end, event),
            event => Vertex::new(end, geometry.triangle_surface(0), Side::Front, event),
        });
        paths.ends.push(paths.vertices.len() as u32);
    }
    paths
}

/// A ledger with a different number in every place; fates and segments are those of [`paths`].
pub(crate) fn ledger(source: u32) -> Ledger {
    let mut ledger = Ledger::new(3);
    for (index, band) in ledger.bands.iter_mut().enumerate() {
        let terms = std::array::from_fn(|term| f64::from(source) + index as f64 * 0.5 + term as f64 * 0.125);
        *band = sonel_map::BandLedger::from_terms(terms);
    }
    ledger.fates = Fates::from_counts([2, 1, 1, 2, 1]);
    ledger.segments = 28;
    ledger
}

/// The bytes of the map.
pub(crate) fn bytes() -> Vec<u8> {
    let header = header(EMISSIONS);
    let geometry = header.scene.geometry().unwrap();
    let mut writer = MapWriter::begin(Cursor::new(Vec::new())).unwrap();
    for source in 0..2 {
        writer.push_chunk(source, 0, &paths(&geometry, source), &ledger(source)).unwrap();
    }
    writer.finish(&header, &geometry).unwrap().into_inner()
}
