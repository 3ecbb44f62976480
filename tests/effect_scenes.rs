//! Scenes from trivial to hard, each an occasion for effects or for leaving them out, and what `auto` makes of them.

use glam::{DVec3, dvec3};
use sonel::InMemory;
use sonel::study::effects::{Decision, EffectSpec, decide, states};
use sonel::study::pipeline::{Room, render_and_read};
use sonel::study::response::receivers_of;
use sonel_acoustics::{Air, BandWidth, Bands, Material, Pattern};
use sonel_analysis::{Parameter, ParameterValue, ReceiverParameters};
use sonel_console::Stopwatch;
use sonel_geometry::Mesh;
use sonel_map::{Mode, Settings};
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;

use crate::airs::with_air;
use crate::{meshes, shipped};

/// What `auto` decided for a scene, and what it changed.
pub struct Outcome {
    /// Decisions of `auto`.
    pub decisions: Vec<Decision>,
    /// What the other run had.
    pub others: Vec<Decision>,
    /// Largest change of a level against all effects, per band [dB].
    pub level_db: Vec<f64>,
    /// Largest relative change of T30, per band.
    pub decay: Vec<f64>,
    /// CPU seconds of the other run, in units of those of `auto`.
    pub time: f64,
}

impl Outcome {
    /// The sum of the bounds of what `auto` left out and the other run did not, per band: (level [dB], relative change of T30).
    #[must_use]
    pub fn promised(&self) -> Vec<(f64, f64)> {
        promised(&self.decisions, &self.others)
    }
}

/// The sum of the bounds of what `decisions` leave out and `others` do not, per band: (level [dB], relative change of T30).
#[must_use]
pub fn promised(decisions: &[Decision], others: &[Decision]) -> Vec<(f64, f64)> {
    let left_out = |band: usize| {
        decisions.iter().zip(others).filter(move |(_, other)| other.on[band]).filter_map(
            move |(decision, _)| (!decision.on[band]).then_some(decision.bound.as_ref()).flatten(),
        )
    };
    let sum = |band: usize| {
        left_out(band)
            .fold((0.0, 0.0), |sum, bound| (sum.0 + bound.level_db[band], sum.1 + bound.decay[band]))
    };
    (0..decisions[0].on.len()).map(sum).collect()
}

/// A scene traced and heard.
pub struct Run {
    /// What was heard.
    pub parameters: Vec<ReceiverParameters>,
    /// What was decided.
    pub decisions: Vec<Decision>,
    /// CPU seconds of both passes, without those of the decision.
    pub seconds: f64,
}

/// Traces and hears `scene` with the effects of `spec`, `emissions` packets.
#[must_use]
pub fn run(scene: &Scene, spec: &str, emissions: u64) -> Run {
    let mut scene = scene.clone();
    let geometry = scene.geometry().expect("walls");
    let spec: EffectSpec = spec.parse().expect("a specification");
    let decisions = decide(&spec, Mode::Accurate, &mut scene, &geometry);
    let states = states(&decisions, Mode::Accurate);
    let room = Room::within(&scene, &geometry, &states);
    let settings = Settings { emissions, seed: 7, ..Settings::default() };
    let clock = Stopwatch::start();
    let traced = room.trace(settings, &mut InMemory, &clock).expect("a run");
    let render = RenderSettings { rays: Some(4096), edges: spec.diffracts(), ..RenderSettings::default() };
    let (rendered, parameters) =
        render_and_read(&traced.map, &geometry, &receivers_of(&scene), &render, &clock).expect("a run");
    Run { seconds: traced.seconds.total() + rendered.seconds.total(), parameters, decisions }
}

/// `auto` against `other` in the same packets.
#[must_use]
pub fn against(scene: &Scene, other: &str, emissions: u64) -> Outcome {
    let [auto, other] = ["auto", other].map(|spec| run(scene, spec, emissions));
    let bands = scene.bands.count();
    let change = |parameter: Parameter, change: fn(f64, f64) -> f64| -> Vec<f64> {
        let mut largest = vec![0.0_f64; bands];
        for (one, other) in auto.parameters.iter().zip(&other.parameters) {
            for (band, (one, other)) in one.bands.iter().zip(&other.bands).enumerate() {
                let found = changed(one.parameter(parameter), other.parameter(parameter), change);
                largest[band] = largest[band].max(found);
            }
        }
        largest
    };
    Outcome {
        time: other.seconds / auto.seconds,
        decisions: auto.decisions,
        others: other.decisions,
        level_db: change(Parameter::Level, |one, other| (one - other).abs()),
        decay: change(Parameter::T30, |one, other| (one / other - 1.0).abs()),
    }
}

fn changed(one: &ParameterValue, other: &ParameterValue, change: fn(f64, f64) -> f64) -> f64 {
    match (one, other, &one.as_ref().err()) {
        (Ok(one), Ok(other), _) => change(one.value, other.value),
        (Err(_), Err(_), _) => 0.0,
        // A time that one of the two refuses as too noisy says nothing; a level that only one of them has says all.
        _ => f64::INFINITY,
    }
}

fn octaves(centers: &[f64]) -> Bands {
    Bands::new(centers.to_vec(), BandWidth::Octave).expect("octaves")
}

fn all_octaves() -> Bands {
    octaves(&[63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0])
}

fn walls(absorption: f64, scattering: f64, bands: &Bands) -> Material {
    Material::uniform("walls", absorption, scattering, bands.count())
}

fn shoebox(name: &str, size: [f64; 3], absorption: f64, scattering: f64, bands: Bands) -> Scene {
    let material = walls(absorption, scattering, &bands);
    let [x, y, z] = size;
    let mut scene = Scene::shoebox(size, material, bands)
        .with_source("source", [0.2 * x, 0.3 * y, 0.4 * z])
        .with_receiver("near", [0.5 * x, 0.6 * y, 0.45 * z])
        .with_receiver("far", [0.85 * x, 0.8 * y, 0.5 * z]);
    scene.name = name.to_owned();
    scene.duration = scene.duration.min(4.0);
    scene
}

/// A box with things in it, all of one material.
fn furnished(name: &str, size: [f64; 3], absorption: f64, bands: Bands, add: impl Fn(&mut Mesh)) -> Scene {
    let mut scene = shoebox(name, size, absorption, 0.3, bands);
    add(&mut scene.mesh);
    scene
}

/// Sheets in the open, over nothing.
fn open(name: &str, bands: Bands, source: [f64; 3], receiver: [f64; 3], add: impl Fn(&mut Mesh)) -> Scene {
    let mut mesh = Mesh { vertices: Vec::new(), triangles: Vec::new() };
    add(&mut mesh);
    let material = walls(0.1, 0.2, &bands);
    let mut scene = Scene::from_parts(mesh, vec![material], bands, 1.0)
        .with_source("source", source)
        .with_receiver("receiver", receiver);
    scene.name = name.to_owned();
    scene
}

fn screen(mesh: &mut Mesh, x: f64, y: [f64; 2], z: [f64; 2]) {
    let at = |y: f64, z: f64| dvec3(x, y, z);
    meshes::add_quad(mesh, 0, [at(y[0], z[0]), at(y[1], z[0]), at(y[1], z[1]), at(y[0], z[1])]);
}

fn shelf(mesh: &mut Mesh, z: f64, low: [f64; 2], high: [f64; 2]) {
    let at = |x: f64, y: f64| dvec3(x, y, z);
    meshes::add_quad(
        mesh,
        0,
        [at(low[0], low[1]), at(high[0], low[1]), at(high[0], high[1]), at(low[0], high[1])],
    );
}

/// A diffuse room with a screen that touches nothing, the length of its edges [m] and the surface of everything [m²].
#[must_use]
pub fn floating_screen() -> (Scene, f64, f64) {
    let mut scene = shoebox("floating screen", [7.0, 5.0, 3.0], 0.1, 1.0, octaves(&[1000.0, 2000.0]));
    screen(&mut scene.mesh, 4.0, [1.0, 4.0], [0.5, 2.5]);
    (scene, 2.0 * (3.0 + 2.0), 2.0 * (35.0 + 21.0 + 15.0) + 2.0 * 6.0)
}

fn air(temperature_celsius: f64, relative_humidity_percent: f64) -> Air {
    Air { temperature_celsius, relative_humidity_percent, ..Air::default() }
}

/// A cardioid that looks away from the receivers.
fn with_cardioid(mut scene: Scene) -> Scene {
    scene.name = "cardioid, turned away".to_owned();
    scene.sources[0].directivity = Pattern::Cardioid.into();
    scene.sources[0].aim = DVec3::NEG_X;
    scene
}

/// Twenty-one of them.
#[must_use]
pub fn scenes() -> Vec<Scene> {
    let low = || octaves(&[63.0, 125.0, 250.0]);
    vec![
        shoebox("dead booth", [3.0, 2.5, 2.2], 0.5, 0.5, all_octaves()),
        shoebox("live cellar", [6.0, 4.0, 2.5], 0.02, 0.3, all_octaves()),
        shoebox("specular box", [7.0, 5.0, 3.0], 0.15, 0.0, all_octaves()),
        shoebox("diffuse box", [7.0, 5.0, 3.0], 0.15, 1.0, all_octaves()),
        shoebox("low octaves", [7.0, 5.0, 3.0], 0.3, 0.3, low()),
        with_air(shoebox("huge and humid", [60.0, 40.0, 20.0], 0.15, 0.3, all_octaves()), air(30.0, 90.0)),
        with_air(shoebox("huge and dry", [60.0, 40.0, 20.0], 0.15, 0.3, all_octaves()), air(20.0, 10.0)),
        with_air(shoebox("small and dry", [4.0, 3.0, 2.5], 0.2, 0.3, all_octaves()), air(20.0, 10.0)),
        with_air(shoebox("cold store", [10.0, 8.0, 4.0], 0.1, 0.2, all_octaves()), air(-20.0, 60.0)),
        shoebox("corridor", [40.0, 2.5, 3.0], 0.1, 0.2, all_octaves()),
        with_cardioid(shoebox("", [8.0, 6.0, 3.0], 0.3, 0.3, all_octaves())),
        shipped("seed-room"),
        shipped("hall"),
        open("barrier outdoors", all_octaves(), [-10.0, 0.0, 1.0], [10.0, 1.0, 1.5], |mesh| {
            screen(mesh, 0.0, [-40.0, 40.0], [0.0, 3.0]);
        }),
        open("deep shadow", all_octaves(), [-2.0, 0.0, 0.5], [2.0, 0.0, 0.5], |mesh| {
            screen(mesh, 0.0, [-30.0, 30.0], [-30.0, 6.0]);
        }),
        furnished("office screen", [8.0, 6.0, 3.0], 0.4, all_octaves(), |mesh| {
            screen(mesh, 3.0, [1.0, 5.0], [0.0, 1.8]);
        }),
        furnished("small tile", [8.0, 6.0, 3.0], 0.2, low(), |mesh| {
            shelf(mesh, 2.0, [4.0, 3.0], [4.1, 3.1]);
        }),
        furnished("seat rows", [16.0, 12.0, 6.0], 0.2, all_octaves(), |mesh| {
            for row in 0..5 {
                let x = 5.0 + f64::from(row);
                meshes::add_box(mesh, 0, dvec3(x, 2.0, 0.1), dvec3(x + 0.5, 10.0, 0.9));
            }
        }),
        furnished("reflector array", [16.0, 12.0, 9.0], 0.15, all_octaves(), |mesh| {
            for (i, j) in (0..2).flat_map(|i| (0..2).map(move |j| (i, j))) {
                let (x, y) = (3.0 + 2.0 * f64::from(i), 4.0 + 2.0 * f64::from(j));
                shelf(mesh, 6.5, [x, y], [x + 1.2, y + 1.2]);
            }
        }),
        furnished("balcony", [12.0, 8.0, 6.0], 0.2, all_octaves(), |mesh| {
            shelf(mesh, 4.0, [8.0, 1.0], [11.0, 7.0]);
        }),
        furnished("coupled rooms", [10.0, 6.0, 3.0], 0.15, all_octaves(), |mesh| {
            screen(mesh, 4.5, [0.0, 4.8], [0.0, 3.0]);
        }),
    ]
}
