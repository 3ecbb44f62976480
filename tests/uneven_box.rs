//! A box whose six walls and four bands differ, as a scene, as the rooms of the slow simulator, and the comparison of both.
//!
//! Two of the bands are alike, so that whatever treats equal bands as one is compared as well.

use rayon::prelude::*;
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::bruteforce::{BoxRoom, Count, Counted, History};
use sonel_testkit::z_test::{Disagreement, Estimate, Within, agree};

use crate::Traced;
use crate::estimates::{Windows, agree_in_windows, class_estimates, windows};

/// Extent [m].
pub const SIZE: [f64; 3] = [6.0, 5.0, 4.0];
/// Position of the source [m].
pub const SOURCE: [f64; 3] = [1.5, 1.2, 1.3];
/// Position of the receiver [m].
pub const RECEIVER: [f64; 3] = [4.2, 3.7, 2.1];
/// Speed of sound [m/s].
pub const SPEED: f64 = 343.0;
/// Simulated time [s].
pub const DURATION: f64 = 0.4;
/// Number of bands.
pub const BANDS: usize = 4;
/// Borders of the windows of time that are compared [s].
pub const BORDERS: [f64; 5] = [0.0, 0.03, 0.08, 0.16, DURATION];

/// Coefficients of every band and wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnevenBox {
    /// α, 0…1.
    pub absorption: [[f64; 6]; BANDS],
    /// s, 0…1.
    pub scattering: [[f64; 6]; BANDS],
}

/// Bands that differ as much as they can: reflecting halls and dead rooms, mirrors and Lambert walls.
pub const WILD: UnevenBox = UnevenBox {
    absorption: [
        [0.20, 0.30, 0.10, 0.25, 0.15, 0.40],
        [0.90, 0.70, 0.80, 0.95, 0.85, 0.60],
        [0.20, 0.30, 0.10, 0.25, 0.15, 0.40],
        [0.01, 0.05, 0.02, 0.01, 0.10, 0.03],
    ],
    scattering: [
        [0.50, 0.30, 0.80, 0.60, 0.20, 0.40],
        [0.05, 0.10, 0.05, 0.20, 0.05, 0.30],
        [0.50, 0.30, 0.80, 0.60, 0.20, 0.40],
        [0.95, 0.90, 0.60, 0.95, 0.80, 0.99],
    ],
};

/// How much is spent on a comparison, and how good it has to be.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Rays of the slow simulator in each of its 32 batches.
    pub rays_per_batch: usize,
    /// Radius of its receiver [m]: a bias of the order of its square.
    pub radius: f64,
    /// Emissions of each run.
    pub emissions: u64,
    /// Runs whose spread is the error of the class sums.
    pub runs: u64,
    /// Largest standard error of a class, as a part of all energy.
    pub class_error: f64,
    /// Largest standard error of a window, as a part of its energy.
    pub window_error: f64,
}

impl UnevenBox {
    /// The same α and s everywhere.
    #[must_use]
    pub fn even(absorption: f64, scattering: f64) -> Self {
        Self { absorption: [[absorption; 6]; BANDS], scattering: [[scattering; 6]; BANDS] }
    }

    /// With absorption coefficients larger by `more`.
    #[must_use]
    pub fn more_absorbing(mut self, more: f64) -> Self {
        self.absorption.iter_mut().flatten().for_each(|absorption| *absorption += more);
        self
    }

    /// With the coefficients of the walls `a` and `b` exchanged.
    #[must_use]
    pub fn exchanged(mut self, a: usize, b: usize) -> Self {
        for walls in self.absorption.iter_mut().chain(&mut self.scattering) {
            walls.swap(a, b);
        }
        self
    }

    /// As a scene with one source and one receiver, without air.
    #[must_use]
    pub fn scene(&self) -> Scene {
        let bands =
            Bands::new(vec![250.0, 500.0, 1000.0, 2000.0], BandWidth::Octave).expect("four octave bands");
        let wall = |wall: usize| Material {
            absorption: self.absorption.iter().map(|walls| walls[wall]).collect(),
            scattering: self.scattering.iter().map(|walls| walls[wall]).collect(),
            ..Material::uniform(&format!("wall {wall}"), 0.0, 0.0, BANDS)
        };
        let mesh = Mesh::shoebox(SIZE, [0, 1, 2, 3, 4, 5]);
        let mut scene = Scene::from_parts(mesh, (0..6).map(wall).collect(), bands, DURATION)
            .with_source("source", SOURCE)
            .with_receiver("receiver", RECEIVER)
            .without_air_attenuation();
        scene.speed_of_sound = SPEED;
        scene
    }

    /// What the slow simulator counts in `band`.
    #[must_use]
    pub fn count(&self, band: usize, effort: Effort) -> Counted {
        let room = BoxRoom {
            size: SIZE,
            absorption: self.absorption[band],
            scattering: self.scattering[band],
            speed_of_sound: SPEED,
            window: None,
            air_attenuation: 0.0,
        };
        let bin_width = 0.001;
        room.count(&Count {
            source: SOURCE,
            receiver: RECEIVER,
            radius: effort.radius,
            bin_width,
            bins: (DURATION / bin_width).round() as usize,
            batches: 32,
            rays_per_batch: effort.rays_per_batch,
            seed: 1_000 * (band as u64 + 1),
        })
    }
}

/// A room as the programs render it, to be compared with rooms that the slow simulator counts.
#[derive(Debug, Clone)]
pub struct Rendered {
    effort: Effort,
    /// By band and class.
    classes: Vec<[Estimate; 3]>,
    /// By band.
    windows: Vec<Windows>,
}

impl Rendered {
    /// Renders `room`.
    #[must_use]
    pub fn of(room: &UnevenBox, effort: Effort) -> Self {
        let settings = Settings { emissions: effort.emissions, ..Settings::default() };
        let classes = class_estimates(&room.scene(), settings, effort.runs);
        let whole = Settings { emissions: effort.emissions * effort.runs, ..settings };
        let traced = Traced::new(room.scene(), whole);
        let windows = windows(&traced, RenderSettings::default(), &BORDERS).swap_remove(0);
        Self { effort, classes, windows }
    }

    /// Compares what every class of path and every window of time brings in every band with what is `counted`. All
    /// disagreements, one sentence each.
    #[must_use]
    pub fn disagreements(&self, counted: &UnevenBox) -> Vec<String> {
        let effort = self.effort;
        let counts: Vec<Counted> =
            (0..BANDS).into_par_iter().map(|band| counted.count(band, effort)).collect();
        let mut wrong = Vec::new();
        for (band, count) in counts.iter().enumerate() {
            let mut judge = |what: &str, outcome: Result<(), Disagreement>| {
                wrong.extend(outcome.err().map(|error| format!("band {band}, {what}: {error}")));
            };
            let slow = slow_windows(count);
            judge("windows", agree_in_windows(&self.windows[band], &slow, effort.window_error));
            let all: f64 = slow.iter().map(|window| window.value).sum();
            let within = Within { sigmas: 4.0, maximal_sigma: effort.class_error * all };
            let histories = [History::Specular, History::Diffuse, History::DiffuseThenSpecular];
            for (history, class) in histories.into_iter().zip(self.classes[band]) {
                judge(&format!("{history:?}"), agree(class, count.class(history), within));
            }
        }
        wrong
    }
}

/// Energies between [`BORDERS`].
fn slow_windows(count: &Counted) -> Windows {
    let bin = |time: f64| (time / count.bin_width()).round() as usize;
    BORDERS
        .windows(2)
        .map(|borders| {
            let range = bin(borders[0])..bin(borders[1]);
            count.jackknife(|echogram| echogram[range.clone()].iter().sum())
        })
        .collect()
}
