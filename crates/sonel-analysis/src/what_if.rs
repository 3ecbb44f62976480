//! Guards: changes of materials that the stored paths cannot represent by weights.
//!
//! Weights account for changed coefficients if every event that is possible now was possible when traced, the ledger
//! closes, no path with much energy was ended, and enough packets share the energy. References: docs/physics.md §2.

use rayon::prelude::*;
use sonel_acoustics::Material;
use sonel_geometry::Geometry;
use sonel_map::{Lanes, Ledger, PathWeight, SonelMap, Spectral};

use crate::reading::Reading;
use crate::survey::survey;

/// Balances may differ by so much of the emitted energy, or by so many standard deviations.
const BALANCE_SHARE: f64 = 0.01;
const BALANCE_SIGMAS: f64 = 4.0;
/// Part of the emitted energy that may be on its way where paths end; maps that were traced with more may have twice as much.
const TRUNCATED_SHARE: f64 = 1e-3;
/// Effective packets per window of time, beside those of the materials of the map: below the first refused, below the second warned of.
const LEAST_SAMPLES: [f64; 2] = [0.01, 0.1];
/// Windows of time into which the duration is divided.
const WINDOWS: usize = 16;
/// Windows with less of the arriving energy are not compared: −45 dB is below what T30 reads.
const LITTLE: f64 = 3e-5;

/// What is to be said of changed materials, a sentence each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Fitness {
    /// Why the paths cannot carry them.
    pub refusals: Vec<String>,
    /// Where they hardly can.
    pub warnings: Vec<String>,
}

/// Whether the paths of `map` carry the materials it has been given ([`SonelMap::change`]). Its paths must be sound
/// ([`SonelMap::check_paths`]); `geometry` is that of its scene.
#[must_use]
pub fn fitness(map: &SonelMap, geometry: &Geometry) -> Fitness {
    let Some(drawn_with) = map.drawn_with() else { return Fitness::default() };
    let refusals = unsupported(map, drawn_with, geometry);
    if !refusals.is_empty() {
        return Fitness { refusals, warnings: Vec::new() };
    }
    let mut fitness =
        Fitness { refusals: unbalanced(map, &survey(map, geometry).ledger), warnings: Vec::new() };
    thin_out(map, geometry, &mut fitness);
    fitness
}

/// The three events of a material with their energy factors.
fn events(material: &Material, band: usize) -> [(&'static str, f64); 3] {
    [
        ("mirrored", material.specular(band)),
        ("scattered", material.diffuse(band)),
        ("let through", material.transmission(band)),
    ]
}

/// Events with energy in a band that no packet can have taken: for every band some lead band must have drawn all that it needs.
fn unsupported(map: &SonelMap, drawn_with: &[Material], geometry: &Geometry) -> Vec<String> {
    let (scene, bands) = (&map.header().scene, map.header().scene.bands.count());
    let in_use = |index: usize| geometry.surfaces().iter().any(|surface| surface.material as usize == index);
    let missing = |band: usize, lead: usize| -> Vec<(usize, &'static str)> {
        let changed = scene.materials.iter().zip(drawn_with).enumerate().filter(|(index, _)| in_use(*index));
        changed
            .flat_map(|(index, (material, drawn))| {
                let pairs = events(material, band).into_iter().zip(events(drawn, lead));
                pairs
                    .filter(|((_, now), (_, then))| *now > 0.0 && *then <= 0.0)
                    .map(move |((event, _), _)| (index, event))
            })
            .collect()
    };
    let mut sentences = Vec::new();
    for band in 0..bands {
        let own = missing(band, band);
        let by_others = map.header().settings.spectral == Spectral::Shared
            && (0..bands).any(|lead| missing(band, lead).is_empty());
        if !by_others {
            sentences.extend(own.into_iter().map(|(index, event)| {
                format!(
                    "materials.{} at {} Hz: no packet of this map was {event} there; trace the scene with the changed material",
                    scene.materials[index].name,
                    scene.bands.nominal()[band]
                )
            }));
        }
    }
    sentences
}

/// Bands whose ledgers do not close with the new weights, or that have too much energy where paths end.
fn unbalanced(map: &SonelMap, found: &Ledger) -> Vec<String> {
    let traced = map.ledger();
    let centers = map.header().scene.bands.nominal();
    let mut sentences = Vec::new();
    for ((center, found), traced) in centers.iter().zip(&found.bands).zip(&traced.bands) {
        let allowed = (BALANCE_SHARE * found.emitted).max(BALANCE_SIGMAS * found.sampling_sigma());
        if found.sampling.abs() > allowed {
            sentences.push(format!(
                "at {center} Hz the energy balance with the changed materials errs by {:.1} %; trace the scene with them",
                100.0 * found.sampling / found.emitted
            ));
        }
        if found.truncated > (TRUNCATED_SHARE * found.emitted).max(2.0 * traced.truncated) {
            sentences.push(format!(
                "at {center} Hz the paths of this map end with {:.2} % of the energy left; trace the scene with the \
                 changed materials and a longer duration",
                100.0 * found.truncated / found.emitted
            ));
        }
    }
    sentences
}

/// Sums of arriving energies and of their squares, by window of time and band.
#[derive(Clone)]
struct Sums(Vec<Vec<[f64; 2]>>);

impl Sums {
    fn new(bands: usize) -> Self {
        Self(vec![vec![[0.0; 2]; bands]; WINDOWS])
    }

    fn add(&mut self, window: usize, energy: &[Lanes]) {
        for (band, [sum, squares]) in self.0[window].iter_mut().enumerate() {
            let energy = energy[band / 4][band % 4];
            *sum += energy;
            *squares += energy * energy;
        }
    }

    fn join(mut self, other: &Self) -> Self {
        for (mine, theirs) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            *mine = [mine[0] + theirs[0], mine[1] + theirs[1]];
        }
        self
    }

    /// Arriving energy of all windows of a band.
    fn total(&self, band: usize) -> f64 {
        self.0.iter().map(|bands| bands[band][0]).sum()
    }

    /// Packets of equal energy that would be as certain.
    fn effective(&self, window: usize, band: usize) -> f64 {
        let [sum, squares] = self.0[window][band];
        if squares > 0.0 { sum * sum / squares } else { 0.0 }
    }
}

/// Says in which windows too few packets share the energy.
fn thin_out(map: &SonelMap, geometry: &Geometry, fitness: &mut Fitness) {
    let [changed, drawn] =
        [Reading::new(map, geometry), Reading::as_drawn(map, geometry)].map(|reading| arrivals(&reading));
    let scene = &map.header().scene;
    for (band, center) in scene.bands.nominal().iter().enumerate() {
        let worst = (0..WINDOWS)
            .filter(|&window| changed.0[window][band][0] > LITTLE * changed.total(band))
            .map(|window| (window, changed.effective(window, band) / drawn.effective(window, band).max(1.0)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((window, share)) = worst else { continue };
        let [from, to] = [window, window + 1].map(|border| scene.duration * border as f64 / WINDOWS as f64);
        let sentence = format!(
            "at {center} Hz between {from:.2} and {to:.2} s the effective number of packets is {:.2} % of that with the map's own materials; trace the scene with the changed materials",
            100.0 * share
        );
        let [refused, warned] = LEAST_SAMPLES;
        if share < refused {
            fitness.refusals.push(sentence);
        } else if share < warned {
            fitness.warnings.push(sentence);
        }
    }
}

/// What arrives at surfaces, chunk by chunk so that sums do not depend on the number of threads.
fn arrivals(reading: &Reading<'_>) -> Sums {
    let scene = &reading.map.header().scene;
    let reach = scene.duration * scene.speed_of_sound;
    let window = |length: f64| ((length / reach * WINDOWS as f64) as usize).min(WINDOWS - 1);
    let batches: Vec<(u32, u32)> = (0..scene.sources.len() as u32)
        .flat_map(|source| (0..reading.emissions.layout.batches).map(move |batch| (source, batch)))
        .collect();
    let sums: Vec<Sums> = batches
        .into_par_iter()
        .map(|(source, batch)| {
            let (mut sums, mut weight) = (Sums::new(reading.bands), PathWeight::new(reading.bands));
            for path in reading.map.batch_paths(source, batch) {
                reading.follow(source, path, 1.0, &mut weight, |segment| {
                    if segment.arrival.is_some() {
                        sums.add(window(segment.end_length), segment.energy);
                    }
                });
            }
            sums
        })
        .collect();
    sums.iter().fold(Sums::new(reading.bands), Sums::join)
}
