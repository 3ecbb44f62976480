//! Arrangements of furniture in the open against the wave equation: what several objects leave of the direct sound.
//!
//! The wave solver has cubes of 0.1 m and walls that absorb at normal incidence about them; its level is that of the same box without furniture.
//! For a plate of 1.6 m × 1.4 m it is 0.1 and 1.1 dB below boundary elements at 63 and 125 Hz.

use std::f64::consts::{PI, SQRT_2};

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::waves::{Places, WaveRoom, step};
use sonel_tests::furniture::{errors, summary};
use sonel_tests::{Traced, meshes};

const CELL: f64 = 0.1;
const SPEED: f64 = 343.0;
const OCTAVES: [f64; 2] = [63.0, 125.0];
/// Corner of the box of air and its cells.
const LOW: DVec3 = dvec3(-2.5, -3.0, -2.0);
const COUNTS: [usize; 3] = [85, 60, 60];
const STEPS: usize = 420;
/// Frequencies of an octave.
const TONES: u32 = 8;

/// Boxes from … to [m], all in whole cells.
type Furniture = Vec<[DVec3; 2]>;

/// Numbers in whole cells.
struct Draw(u64);

impl Draw {
    fn between(&mut self, low: i32, high: i32) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let range = (high - low + 1) as u64;
        0.1 * f64::from(low + ((self.0 >> 33) % range) as i32)
    }
}

/// A panel of one cell, a table, a chair, a lectern, a rail, between the source and the receiver or beside them.
fn furniture(number: u32, draw: &mut Draw) -> Furniture {
    let mut boxes = Vec::new();
    let mut add = |x: [f64; 2], y: [f64; 2], z: [f64; 2]| {
        boxes.push([dvec3(x[0], y[0], z[0]), dvec3(x[1], y[1], z[1])]);
    };
    let screen = |x: f64, draw: &mut Draw| {
        let half = draw.between(5, 10);
        ([x, x + 0.1], [-half, half], [draw.between(0, 3), draw.between(10, 18)])
    };
    let table = |x: f64, draw: &mut Draw| {
        let (half, depth) = (draw.between(5, 9), draw.between(6, 9));
        ([x, x + depth], [-half, half], [0.7, 0.8])
    };
    let of = |parts: ([f64; 2], [f64; 2], [f64; 2]), add: &mut dyn FnMut([f64; 2], [f64; 2], [f64; 2])| {
        add(parts.0, parts.1, parts.2);
    };
    match number % 5 {
        0 => {
            of(screen(draw.between(8, 14), draw), &mut add);
            of(table(draw.between(-4, 0), draw), &mut add);
        }
        1 => {
            of(screen(draw.between(6, 10), draw), &mut add);
            of(screen(draw.between(16, 22), draw), &mut add);
        }
        2 => {
            for x in [0.5, 1.4, 2.3] {
                let side = draw.between(-3, 3);
                add([x, x + 0.5], [side - 0.3, side + 0.2], [0.4, 0.5]);
                add([x + 0.5, x + 0.6], [side - 0.3, side + 0.2], [0.5, draw.between(8, 12)]);
            }
        }
        3 => {
            let x = draw.between(4, 8);
            add([x, x + 0.5], [-0.3, 0.3], [0.0, draw.between(9, 13)]);
            of(table(draw.between(18, 26), draw), &mut add);
        }
        _ => {
            let x = draw.between(8, 16);
            add([x, x + draw.between(4, 9)], [-1.0, 1.0], [0.3, 0.4]);
            of(screen(draw.between(26, 28), draw), &mut add);
        }
    }
    boxes
}

const SOURCE: DVec3 = dvec3(0.05, 0.05, 1.15);
const RECEIVER: DVec3 = dvec3(3.25, 0.05, 1.15);

/// Energy per octave at the receiver in the box with `furniture`.
fn of_waves(furniture: &Furniture) -> [f64; 2] {
    let middle = |cell: [usize; 3]| LOW + CELL * (DVec3::from_array(cell.map(|index| index as f64)) + 0.5);
    let is_solid = |place: DVec3| {
        furniture.iter().any(|[low, high]| place.cmpgt(*low).all() && place.cmplt(*high).all())
    };
    let wall = |cell: [usize; 3], axis: usize| {
        let here = middle(cell);
        if is_solid(here) != is_solid(here + CELL * DVec3::AXES[axis]) {
            return Some(0.0);
        }
        (cell[axis] == 0 || cell[axis] + 2 == COUNTS[axis]).then_some(1.0)
    };
    let cell_of = |place: DVec3| ((place - LOW) / CELL).floor().to_array().map(|index| index as usize);
    let room = WaveRoom::new(COUNTS, cell_of(SOURCE), wall);
    let receivers = [cell_of(RECEIVER)];
    let places = Places { source: cell_of(SOURCE), receivers: &receivers };
    let signal = room.responses(&places, STEPS).swap_remove(0);
    let time = step(CELL, SPEED);
    OCTAVES.map(|centre| {
        let tone = |number: u32| {
            let frequency = centre / SQRT_2 * (1.0 + (f64::from(number) + 0.5) / f64::from(TONES));
            let turn = |index: usize| 2.0 * PI * frequency * time * index as f64;
            let sum = signal.iter().enumerate().fold([0.0; 2], |[re, im], (index, p)| {
                [re + p * turn(index).cos(), im - p * turn(index).sin()]
            });
            sum[0] * sum[0] + sum[1] * sum[1]
        };
        (0..TONES).map(tone).sum()
    })
}

/// Level of all sound re free field per octave [dB].
fn of_edges(furniture: &Furniture, with_edges: bool) -> [f64; 2] {
    let mut mesh = Mesh::default();
    for [low, high] in furniture {
        meshes::add_box(&mut mesh, 0, *low, *high);
    }
    // Closed objects alone would be rooms.
    let far = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]].map(|[x, y]| dvec3(x, y, -40.0));
    meshes::add_quad(&mut mesh, 0, far);
    let bands = Bands::new(OCTAVES.to_vec(), BandWidth::Octave).expect("octaves");
    let mut scene = Scene::from_parts(mesh, vec![Material::uniform("rigid", 0.0, 0.0, 2)], bands, 0.1)
        .with_source("source", SOURCE.to_array())
        .with_receiver("receiver", RECEIVER.to_array())
        .without_air_attenuation();
    scene.speed_of_sound = SPEED;
    let settings = Settings { emissions: 64, ..Settings::default() };
    let traced = if with_edges { Traced::diffracting } else { Traced::new }(scene, settings);
    let rendering = traced.render(RenderSettings::default());
    let free = 1.0 / (4.0 * PI * SOURCE.distance_squared(RECEIVER));
    [0, 1].map(|band| 10.0 * (rendering.energy(0, band) / free).max(1e-9).log10())
}

#[test]
fn twenty_arrangements_of_furniture_shade_as_waves_say() {
    let mut draw = Draw(7);
    let empty = of_waves(&Vec::new());
    let (mut squares, mut worst, mut without) = ([0.0; 2], [0.0_f64; 2], [0.0; 2]);
    for number in 0..20 {
        let furniture = furniture(number, &mut draw);
        let waves = of_waves(&furniture);
        let (found, clear) = (of_edges(&furniture, true), of_edges(&furniture, false));
        let known: [f64; 2] = [0, 1].map(|band| 10.0 * (waves[band] / empty[band]).log10());
        println!("{number}: waves {known:.1?} edges {found:.1?} without {clear:.1?}");
        for band in 0..2 {
            squares[band] += (found[band] - known[band]).powi(2) / 20.0;
            worst[band] = worst[band].max((found[band] - known[band]).abs());
            without[band] += (clear[band] - known[band]).powi(2) / 20.0;
        }
    }
    println!(
        "rms {:.2?} dB, worst {worst:.2?} dB, without edges {:.1?} dB",
        squares.map(f64::sqrt),
        without.map(f64::sqrt)
    );
    for band in 0..2 {
        assert!(squares[band].sqrt() < 1.5 && worst[band] < 3.0, "{} Hz: {worst:?}", OCTAVES[band]);
        assert!(without[band].sqrt() > 3.0, "direct sound alone is rejected");
    }
}

/// rms per octave from 63 Hz to 1 kHz over seven arrangements of several objects, a tenth above what docs/diffraction.md states [dB].
const ALLOWED: [f64; 5] = [1.1, 1.95, 2.1, 1.3, 1.3];

#[test]
fn several_objects_shade_as_waves_say() {
    let names = ["desks", "two-screens", "corner", "pillar", "door", "seats", "lectern"];
    let all: Vec<_> = names.iter().flat_map(|name| errors(name, true)).collect();
    let (rms, worst) = summary(&all);
    println!("rms {rms:.2?}, worst {worst:.1} dB");
    assert!(
        rms.iter().zip(ALLOWED).all(|(rms, allowed)| *rms < allowed) && worst < 5.0,
        "{rms:.2?} {worst:.1} dB"
    );
    let without: Vec<_> = names.iter().flat_map(|name| errors(name, false)).collect();
    assert!(summary(&without).0.iter().all(|rms| *rms > 5.0), "silence is rejected");
}
