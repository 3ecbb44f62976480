//! What bending of packets is worth: by how much ways are turned, and where that leads them.
//!
//! Bending keeps energy and turns as many ways to the left as to the right, so a field that is as bright in all directions does not
//! notice it. What is felt of an angle θ is of second order: ½ θ² of the energy of a leg, at most half of it, goes where it would not have gone.
//! x = ⟨½ θ²⟩ is taken over the legs of a short run, weighted by their energy, with the spread γ/(2kb) of each edge that they pass at
//! a distance b. What is turned meets other walls and flies other lengths. With exposed surfaces that absorb between α_min and α_max, and
//! e^(−a) of the energy left behind a leg, a = −ln(1 − ᾱ), T changes by y = x (1 + (α_max − α_min)/a) of itself at most: where a decay is sustained by
//! ways that meet nothing that absorbs, as between parallel walls above seats, everything that is turned away from them ends. Levels change by 2x + y:
//! the first leg, the last, and what T sustains.
//!
//! What far edges do to x falls as 1/b, and near ones do the rest: the reach in which edges bend need not be the whole one of
//! [`REACH_WAVELENGTHS`] wavelengths. It is cut where what lies beyond is below the thresholds; a band of which that is all is not bent. In the open,
//! where shadows are filled by nothing else, there is no such bound, and everything is bent.
//!
//! The paper's mode has edges of its own. References: docs/diffraction.md, docs/effects.md.

use std::f64::consts::LOG10_E;

use sonel_acoustics::mean_absorption;
use sonel_analysis::reading::Reading;
use sonel_geometry::{EdgeIndex, Geometry, Way};
use sonel_map::edges::{REACH_WAVELENGTHS, bending_edges, whole_reach};
use sonel_map::{EdgeTable, EffectState, Mode, PathWeight, Segment, Settings, SonelMap};
use sonel_scene::Scene;

use super::spec::Wish;
use super::{ASKED, Bound, Decision, Effect, Question};
use crate::trial::{Clock, InMemory, TrialError, trace};

/// Packets of the short run.
const EMISSIONS: u64 = 512;
/// Relative change of a level in units of x, besides what T sustains: by the first leg and the last.
const LEGS: f64 = 2.0;
/// Reaches that are weighed: the whole one and halves of it, half octaves apart.
const REACHES: usize = 25;

/// Decides on bending.
pub(super) fn decide(
    asked: Question,
    mode: Mode,
    scene: &Scene,
    geometry: &Geometry,
    clock: &dyn Clock,
) -> Result<Decision, TrialError> {
    let wish = asked.wish;
    let is_weighed = wish == Wish::Auto || asked.weigh;
    let bands = scene.bands.count();
    let edges = bending_edges(geometry);
    let count = edges.lines().len();
    let off = |reason: &str| Decision::new(Effect::Bending, vec![false; bands], reason.to_owned());
    if count == 0 {
        return Ok(Decision { bound: Some(Bound::nothing(bands)), ..off("no edge is sharp enough") });
    }
    if mode == Mode::Paper {
        return Ok(off(PAPER));
    }
    let worth = if geometry.is_closed_room() && is_weighed {
        Some(Worth::of(scene, geometry, &edges, clock)?)
    } else {
        None
    };
    let (reach, why) = match (wish.decided(), &worth) {
        (Some(true), _) => (whole_reach(&scene.wavelengths()), format!("{ASKED}, {count} edges")),
        (Some(false), _) => (vec![0.0; bands], ASKED.to_owned()),
        (None, Some(worth)) => (worth.reach(asked), format!("{count} edges")),
        (None, None) => (
            whole_reach(&scene.wavelengths()),
            format!("in the open nothing else fills shadows, {count} edges"),
        ),
    };
    let on: Vec<bool> = reach.iter().map(|&reach| reach > 0.0).collect();
    let cost = if on.contains(&true) && is_weighed {
        cost(scene, geometry, &reach, worth.as_ref(), clock)?
    } else {
        String::new()
    };
    let reason = format!("{why}{}", in_words(scene, &reach, worth.as_ref()));
    Ok(Decision {
        cost,
        rest: worth.as_ref().map(|worth| worth.beyond(&reach)),
        bound: worth.map(|worth| worth.bound()),
        reach: if on.contains(&true) { reach } else { Vec::new() },
        ..Decision::new(Effect::Bending, on, reason)
    })
}

/// Why the paper's mode is without.
const PAPER: &str = "the paper bends nothing";

/// `effects` for the paper's mode, decided for another.
pub(crate) fn left_out(effects: Vec<EffectState>) -> Vec<EffectState> {
    let name = Effect::Bending.name();
    let without = |effect: EffectState| {
        let off = vec![false; effect.on.len()];
        if effect.name == name { EffectState::new(name, off, PAPER.to_owned()) } else { effect }
    };
    effects.into_iter().map(without).collect()
}

/// What the bands lose beyond each reach, see [`Worth::outside`].
struct Worth {
    wavelengths: Vec<f64>,
    /// x of the edges beyond each of the [`REACHES`] and beyond none, by band.
    outside: Vec<[f64; REACHES + 1]>,
    /// Share of the legs that pass an edge within each of them, by band.
    met: Vec<[f64; REACHES]>,
    /// y/x by band.
    contrast: Vec<f64>,
}

impl Worth {
    fn of(
        scene: &Scene,
        geometry: &Geometry,
        edges: &EdgeIndex,
        clock: &dyn Clock,
    ) -> Result<Self, TrialError> {
        let settings = Settings { emissions: EMISSIONS, ..Settings::default() };
        let traced = trace(scene, geometry, Vec::new(), settings, &mut InMemory, clock)?;
        let (bands, wavelengths) = (scene.bands.count(), scene.wavelengths());
        let table = EdgeTable::new(edges.lines().to_vec(), &wavelengths, &whole_reach(&wavelengths));
        let mut legs = vec![Legs::default(); bands];
        each_leg(&traced.map, geometry, |segment| {
            let distances = passed(segment, geometry, edges, &table);
            for (band, legs) in legs.iter_mut().enumerate() {
                let energy = segment.energy[band / 4][band % 4];
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
    fn bound(&self) -> Bound {
        self.bound_of(|band| self.outside[band][REACHES])
    }

    /// Which of the reaches weighed is that of `band`; [`REACHES`] for none.
    fn step(&self, band: usize, reach: f64) -> usize {
        (0..REACHES).find(|&step| nth_reach(self.wavelengths[band], step) <= reach).unwrap_or(REACHES)
    }

    /// What leaving out edges beyond `reach` changes, which is one of those weighed.
    fn beyond(&self, reach: &[f64]) -> Bound {
        self.bound_of(|band| self.outside[band][self.step(band, reach[band])])
    }

    /// Share of the ways of `band` that are bent within `reach`.
    fn bent(&self, band: usize, reach: f64) -> f64 {
        self.met[band].get(self.step(band, reach)).copied().unwrap_or(0.0)
    }

    /// The shortest reach of each band beyond which nothing matters; zero where nothing matters at all.
    fn reach(&self, asked: Question) -> Vec<f64> {
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

/// How far edges bend, and what they are worth.
fn in_words(scene: &Scene, reach: &[f64], worth: Option<&Worth>) -> String {
    let (first, last) = (0, scene.bands.count() - 1);
    let ends = if first == last { vec![first] } else { vec![first, last] };
    let nominal = scene.bands.nominal();
    let mut words = String::new();
    if let Some(worth) = worth {
        let bound = worth.bound();
        let of = |&band: &usize| {
            format!(
                "{:.2} dB and {:.2} % of T at {} Hz",
                bound.level_db[band],
                100.0 * bound.decay[band],
                nominal[band]
            )
        };
        let each: Vec<String> = ends.iter().map(of).collect();
        words += &format!(" may change up to {}", each.join(", "));
    }
    let bent: Vec<String> =
        ends_of_bent(reach).map(|band| format!("{:.3} m at {} Hz", reach[band], nominal[band])).collect();
    if !bent.is_empty() {
        words += &format!("; they bend up to {}", bent.join(" to "));
    }
    words
}

/// What bending costs, in words: time a segment as two short runs take it, and what bands share no longer.
fn cost(
    scene: &Scene,
    geometry: &Geometry,
    reach: &[f64],
    worth: Option<&Worth>,
    clock: &dyn Clock,
) -> Result<String, TrialError> {
    let on = reach.iter().map(|&reach| reach > 0.0).collect();
    let bent =
        EffectState { reach: reach.to_vec(), ..EffectState::new(Effect::Bending.name(), on, String::new()) };
    let seconds = |effects: Vec<EffectState>| -> Result<f64, TrialError> {
        let settings = Settings { emissions: EMISSIONS, ..Settings::default() };
        let traced = trace(scene, geometry, effects, settings, &mut InMemory, clock)?;
        Ok(traced.seconds.trace / traced.books.segments as f64)
    };
    let ratio = seconds(vec![bent])? / seconds(Vec::new())?;
    let nominal = scene.bands.nominal();
    let shares: Vec<String> = worth
        .into_iter()
        .flat_map(|worth| ends_of_bent(reach).map(move |band| (band, worth.bent(band, reach[band]))))
        .map(|(band, share)| format!("{:.0} % of those at {} Hz", 100.0 * share, nominal[band]))
        .collect();
    let of = if shares.is_empty() { String::new() } else { format!(" ({})", shares.join(", ")) };
    let parted = format!("what bands would share of the ways that are bent{of}");
    // Without a clock there are no times.
    Ok(if ratio.is_finite() {
        format!("{ratio:.1} times the time a segment traced, and {parted}")
    } else {
        parted
    })
}

/// The first and the last band that is bent, or the one.
fn ends_of_bent(reach: &[f64]) -> impl Iterator<Item = usize> + '_ {
    let first = reach.iter().position(|&reach| reach > 0.0);
    let last = reach.iter().rposition(|&reach| reach > 0.0);
    first.into_iter().chain(last.filter(|_| first != last))
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

/// Distances at which one leg passes edges that would bend it [m], also where one has just done so: a shorter reach would let that be.
fn passed(segment: &Segment<'_>, geometry: &Geometry, edges: &EdgeIndex, table: &EdgeTable) -> Vec<f64> {
    let mut distances = Vec::new();
    let mut way = Way::between(segment.start.as_dvec3(), segment.end.as_dvec3(), table.reach(segment.energy));
    while let Some(passage) = edges.first(geometry, &way, |_| true) {
        distances.push(passage.distance);
        way.from = passage.at;
    }
    distances
}
