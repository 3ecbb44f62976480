//! x = ⟨½ θ²⟩ and the bounds that follow from it, by band and reach.

use std::f64::consts::LOG10_E;

use sonel_acoustics::mean_absorption;
use sonel_analysis::reading::Reading;
use sonel_geometry::{EdgeIndex, Geometry, Way};
use sonel_map::edges::{REACH_WAVELENGTHS, whole_reach};
use sonel_map::{EdgeTable, PathWeight, Segment, Settings, SonelMap};
use sonel_scene::Scene;

use super::super::{Bound, Question};
use super::EMISSIONS;
use crate::trial::{Clock, InMemory, TrialError, trace};

/// Relative change of a level in units of x, besides what T sustains: by the first leg and the last.
const LEGS: f64 = 2.0;
/// Reaches that are weighed: the whole one and halves of it, half octaves apart.
const REACHES: usize = 25;

/// What the bands lose beyond each reach, see [`Worth::outside`].
pub(super) struct Worth {
    wavelengths: Vec<f64>,
    /// x of the edges beyond each of the [`REACHES`] and beyond none, by band.
    outside: Vec<[f64; REACHES + 1]>,
    /// Share of the legs that pass an edge within each of them, by band.
    met: Vec<[f64; REACHES]>,
    /// y/x by band.
    contrast: Vec<f64>,
}

impl Worth {
    pub fn of(
        scene: &Scene,
        geometry: &Geometry,
        edges: &EdgeIndex,
        clock: &dyn Clock,
    ) -> Result<Self, TrialError> {
        let settings = Settings { emissions: EMISSIONS, ..Settings::default() };
        let traced = trace(scene, geometry, Vec::new(), settings, &mut InMemory, clock)?;
        let (bands, wavelengths) = (scene.bands.count(), scene.wavelengths());
        let table = EdgeTable::of(edges, &wavelengths, &whole_reach(&wavelengths));
        let mut legs = vec![Legs::default(); bands];
        each_leg(&traced.map, geometry, |segment| {
            let passed = passed(segment, geometry, edges, &table);
            for (band, legs) in legs.iter_mut().enumerate() {
                let energy = segment.energy[band / 4][band % 4];
                let bending = passed.iter().filter(|(_, size)| table.is_large(band, *size));
                let distances: Vec<f64> = bending.map(|(distance, _)| *distance).collect();
                legs.add(energy, &distances, wavelengths[band], |distance| {
                    table.tangent(band, distance, 1.0)
                });
            }
        });
        Ok(Self {
            outside: legs.iter().map(|legs| legs.turned.map(|turned| legs.share(turned))).collect(),
            met: legs.iter().map(|legs| legs.met.map(|met| legs.share(met))).collect(),
            contrast: (0..bands).map(|band| contrast(scene, geometry, band)).collect(),
            wavelengths,
        })
    }

    /// What `x` means in `band`: changes of the level [dB] and of T.
    fn changes(&self, band: usize, x: f64) -> (f64, f64) {
        let y = x * self.contrast[band];
        (10.0 * LOG10_E * libm::log1p(LEGS * x + y), y)
    }

    fn bound_of(&self, x: impl Fn(usize) -> f64) -> Bound {
        let (level_db, decay) = (0..self.outside.len()).map(|band| self.changes(band, x(band))).unzip();
        Bound { level_db, decay }
    }

    /// What leaving bending out changes.
    pub fn bound(&self) -> Bound {
        self.bound_of(|band| self.outside[band][REACHES])
    }

    /// Which of the reaches weighed is that of `band`; [`REACHES`] for none.
    fn step(&self, band: usize, reach: f64) -> usize {
        (0..REACHES).find(|&step| nth_reach(self.wavelengths[band], step) <= reach).unwrap_or(REACHES)
    }

    /// What leaving out edges beyond `reach` changes, which is one of those weighed.
    pub fn beyond(&self, reach: &[f64]) -> Bound {
        self.bound_of(|band| self.outside[band][self.step(band, reach[band])])
    }

    /// Share of the ways of `band` that are bent within `reach`.
    pub fn bent(&self, band: usize, reach: f64) -> f64 {
        self.met[band].get(self.step(band, reach)).copied().unwrap_or(0.0)
    }

    /// The shortest reach of each band beyond which nothing matters; zero where nothing matters at all.
    pub fn reach(&self, asked: Question) -> Vec<f64> {
        let mut reach: Vec<f64> =
            self.wavelengths.iter().map(|&wavelength| nth_reach(wavelength, 0)).collect();
        for step in (0..=REACHES).skip(1) {
            let rest = self.bound_of(|band| self.outside[band][step]);
            for (band, matters) in asked.exceeding(&rest).into_iter().enumerate() {
                if !matters {
                    reach[band] = if step == REACHES { 0.0 } else { nth_reach(self.wavelengths[band], step) };
                }
            }
        }
        reach
    }
}

/// A reach that is weighed [m].
fn nth_reach(wavelength: f64, step: usize) -> f64 {
    REACH_WAVELENGTHS * wavelength * libm::exp2(-0.5 * step as f64)
}

/// Sums over the legs of a short run in one band, weighted by their energy.
#[derive(Clone, Default)]
struct Legs {
    energy: f64,
    /// ½ θ², at most ½, of the edges beyond each reach and beyond none.
    turned: [f64; REACHES + 1],
    /// Legs that pass an edge within each reach.
    met: [f64; REACHES],
}

impl Legs {
    /// Adds one leg that passes edges at `distances` [m].
    fn add(&mut self, energy: f64, distances: &[f64], wavelength: f64, angle: impl Fn(f64) -> f64) {
        self.energy += energy;
        let whole = nth_reach(wavelength, 0);
        let passed: Vec<f64> = distances.iter().copied().filter(|&distance| distance <= whole).collect();
        if passed.is_empty() || energy <= 0.0 {
            return;
        }
        let nearest = passed.iter().copied().fold(whole, f64::min);
        for step in 0..=REACHES {
            let reach = if step == REACHES { 0.0 } else { nth_reach(wavelength, step) };
            let beyond = passed.iter().filter(|&&distance| distance > reach);
            let square: f64 = beyond.map(|&distance| angle(distance) * angle(distance)).sum();
            self.turned[step] += 0.5 * energy * square.min(1.0);
            if step < REACHES && nearest <= reach {
                self.met[step] += energy;
            }
        }
    }

    fn share(&self, sum: f64) -> f64 {
        if self.energy > 0.0 { sum / self.energy } else { 0.0 }
    }
}

/// y/x of `band`: 1 + (α_max − α_min)/a.
fn contrast(scene: &Scene, geometry: &Geometry, band: usize) -> f64 {
    let walls = || {
        let wall = |material: usize| {
            (geometry.exposed_area(material as u32), scene.materials[material].absorption[band])
        };
        (0..scene.materials.len()).map(wall).filter(|(area, _)| *area > 0.0)
    };
    let (least, most) =
        walls().fold((1.0_f64, 0.0_f64), |(least, most), (_, alpha)| (least.min(alpha), most.max(alpha)));
    let difference = (most - least).max(0.0);
    if difference > 0.0 { 1.0 - difference / libm::log1p(-mean_absorption(walls())) } else { 1.0 }
}

fn each_leg(map: &SonelMap, geometry: &Geometry, mut visit: impl FnMut(&Segment<'_>)) {
    let reading = Reading::new(map, geometry);
    let mut weight = PathWeight::new(reading.bands);
    for source in 0..map.header().scene.sources.len() as u32 {
        for path in (0..reading.layout.total).filter_map(|emission| map.path(source, emission)) {
            reading.emit(source, path.emission, 1.0, &mut weight);
            reading.sweep(source, path, &mut weight, &mut visit);
        }
    }
}

/// Distances at which one leg passes edges that would bend it, and sizes of the faces that it sees of them [m], also where one has just done so: a
/// shorter reach would let that be.
fn passed(
    segment: &Segment<'_>,
    geometry: &Geometry,
    edges: &EdgeIndex,
    table: &EdgeTable,
) -> Vec<(f64, f64)> {
    let mut passed = Vec::new();
    let mut way = Way::between(segment.start.as_dvec3(), segment.end.as_dvec3(), table.reach(segment.energy));
    while let Some(passage) = edges.first(geometry, &way, |_, _| true) {
        passed.push((passage.distance, table.faces(passage.edge).size_seen(way.direction)));
        way.from = passage.at;
    }
    passed
}
