//! Guards: changes of materials that the stored paths cannot represent by weights.
//!
//! Weights account for changed coefficients if every event that is possible now was possible when traced, the ledger
//! closes, and enough packets share the energy.
//!
//! **Packets.** An arrival multiplies the second moment of a packet's energy by Σ f²/p over its events, with the factors f of the changed
//! materials and the probabilities p of a lead; by Σ f²/p′ in a trace with the changed materials. The product of both ratios along the
//! path is that of the variances, for the best lead times the number of sets that divide the packets. Sums of squares would miss the rare
//! packets that carry most. References: docs/physics.md §2.

use rayon::prelude::*;
use sonel_acoustics::Material;
use sonel_geometry::Geometry;
use sonel_map::{
    Along, BandClasses, BandLedger, BandValues, ChunkLedger, Leads, Ledger, MapHeader, PathWeight, SonelMap,
    Spectral,
};

use crate::reading::Reading;

/// Largest difference of energy balances, as a share of the emitted energy [1]: 0.04 dB. Chosen, not measured.
const BALANCE_SHARE: f64 = 0.01;
/// Largest difference of energy balances [standard deviations]: exceeded once in 16 000 normal values.
const BALANCE_SIGMAS: f64 = 4.0;
/// Largest share of the emitted energy under way at the end of the run [1]: −30 dB, near the end of T30; maps that were traced with more may
/// have twice as much. Chosen, not measured.
const TRUNCATED_SHARE: f64 = 1e-3;
/// Widths of intervals relative to those of a trace with the changed materials [1]: above the first a warning, above the second a refusal. At 3
/// a trace has the interval for a ninth of the packets. Chosen, not measured.
const WIDEST: [f64; 2] = [3.0, 20.0];
/// Windows of time into which the duration is divided: 2 dB of a decay by 60 dB each. Chosen, not measured; doubled, each has half the packets.
const WINDOWS: usize = 32;
/// Windows after less than this part of the arriving energy is left are not compared: T30 reads down to −35 dB.
const LITTLE: f64 = 1e-4;
/// Logarithm of the largest ratio of variances [nepers]: far above what is refused, far below where doubles overflow.
const FAR: f64 = 50.0;

/// Remarks on changed materials, a sentence each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Fitness {
    /// Why the paths cannot carry them.
    pub refusals: Vec<String>,
    /// Where they hardly can.
    pub warnings: Vec<String>,
}

/// Whether the paths of the first `batches` of `map` carry the materials it has been given ([`SonelMap::change`]). They must be valid
/// ([`SonelMap::check_paths`]); `geometry` is that of its scene.
#[must_use]
pub fn fitness(map: &SonelMap, geometry: &Geometry, batches: u32) -> Fitness {
    if map.drawn_with().is_none() {
        return Fitness::default();
    }
    let refusals = unsupported(map, geometry);
    if !refusals.is_empty() {
        return Fitness { refusals, warnings: Vec::new() };
    }
    let Read { ledger, sums } = read(map, geometry, batches);
    let (traced, scene) = (map.ledger(), &map.header().scene);
    let mut flaws = Flaws::default();
    for (band, &center) in scene.bands.nominal().iter().enumerate() {
        let traced = &traced.bands[band];
        flaws.balance(center, &ledger.bands[band], traced.truncated / traced.emitted);
    }
    if flaws.refused.iter().any(|refused| !refused.is_empty()) {
        return flaws.fitness();
    }
    for (band, &center) in scene.bands.nominal().iter().enumerate() {
        flaws.paths(center, widest(&sums, band, scene.duration));
    }
    flaws.fitness()
}

/// Flaws of each kind by band: nominal centre [Hz], how bad, and a sentence without the band.
#[derive(Default)]
struct Flaws {
    refused: [Vec<(f64, f64, String)>; 3],
    warned: Vec<(f64, f64, String)>,
}

impl Flaws {
    /// Looks at the ledger of a band with the new weights, and at the share of energy that was truncated as traced.
    fn balance(&mut self, center: f64, found: &BandLedger, traced: f64) {
        let allowed = (BALANCE_SHARE * found.emitted).max(BALANCE_SIGMAS * found.sampling_sigma());
        let percent = |energy: f64| 100.0 * energy / found.emitted;
        if found.sampling.abs() > allowed {
            let error = percent(found.sampling);
            let sentence = format!("the energy balance with the changed materials errs by {error:.1} %");
            self.refused[0].push((center, error.abs(), sentence));
        }
        if found.truncated > (TRUNCATED_SHARE * found.emitted).max(2.0 * traced * found.emitted) {
            let left = percent(found.truncated);
            let sentence = format!(
                "the paths of this map end with {left:.2} % of the energy left: they need a longer duration"
            );
            self.refused[1].push((center, left, sentence));
        }
    }

    /// Looks at the paths of a band.
    fn paths(&mut self, center: f64, (width, [from, to]): (f64, [f64; 2])) {
        let [warned, refused] = WIDEST;
        if width > warned {
            let sentence = format!(
                "few packets carry the energy between {from:.2} and {to:.2} s: intervals are about {:.0} times as wide as those of a trace with the changed materials",
                width.min(1000.0)
            );
            let kind = if width > refused { &mut self.refused[2] } else { &mut self.warned };
            kind.push((center, width, sentence));
        }
    }

    /// A sentence for each kind: that of the worst band.
    fn fitness(self) -> Fitness {
        let sentence = |flaws: Vec<(f64, f64, String)>| {
            let centers: Vec<String> = flaws.iter().map(|(center, ..)| center.to_string()).collect();
            let (_, _, worst) = flaws.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
            Some(format!("at {} Hz {worst}", centers.join(", ")))
        };
        Fitness {
            refusals: self.refused.into_iter().filter_map(sentence).collect(),
            warnings: sentence(self.warned).into_iter().collect(),
        }
    }
}

/// The three events of a material.
const EVENTS: [&str; 3] = ["mirrored", "scattered", "let through"];

/// Events with energy in a band that no packet can have taken: for every band some lead must have drawn all that it needs.
fn unsupported(map: &SonelMap, geometry: &Geometry) -> Vec<String> {
    let (scene, leads) = (&map.header().scene, map.leads());
    let (bands, count) = (scene.bands.count(), leads.classes().bands());
    let in_use = |index: usize| geometry.surfaces().iter().any(|surface| surface.material as usize == index);
    let used: Vec<usize> = (0..scene.materials.len()).filter(|&index| in_use(index)).collect();
    let missing = |band: usize, lead: usize| -> Vec<(usize, usize)> {
        let of = |&index: &usize| {
            let now = energies(&scene.materials[index], band);
            let then = leads.drawn(index, lead);
            (0..3)
                .filter(move |&event| now[event] > 0.0 && then[event] <= 0.0)
                .map(move |event| (index, event))
        };
        used.iter().flat_map(of).collect()
    };
    let by_others = map.header().settings.spectral == Spectral::Shared;
    let mut found: Vec<((usize, usize), Vec<f64>)> = Vec::new();
    for band in 0..bands {
        let mut mixed = (0..count).filter(|lead| by_others || lead % bands == band);
        if mixed.any(|lead| missing(band, lead).is_empty()) {
            continue;
        }
        for what in missing(band, band) {
            let center = scene.bands.nominal()[band];
            match found.iter_mut().find(|(known, _)| *known == what) {
                Some((_, centers)) => centers.push(center),
                None => found.push((what, vec![center])),
            }
        }
    }
    let sentence = |((index, event), centers): ((usize, usize), Vec<f64>)| {
        let centers: Vec<String> = centers.iter().map(f64::to_string).collect();
        let (name, event) = (&scene.materials[index].name, EVENTS[event]);
        format!("materials.{name} at {} Hz: no packet of this map was {event} there", centers.join(", "))
    };
    found.into_iter().map(sentence).collect()
}

/// The energy factors of [`EVENTS`].
fn energies(material: &Material, band: usize) -> [f64; 3] {
    [material.specular(band), material.diffuse(band), material.transmission(band)]
}

/// Sums over the arrivals in a window of time, of a band.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// Σ e.
    energy: f64,
    /// Σ e times the ratio of variances.
    excess: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.energy += other.energy;
        self.excess += other.excess;
    }
}

/// Widest intervals of `band` relative to those of a trace with these materials, and the window of time [s].
fn widest(sums: &[Vec<Sums>], band: usize, duration: f64) -> (f64, [f64; 2]) {
    let total: f64 = sums.iter().map(|bands| bands[band].energy).sum();
    let (mut left, mut width) = (total, (0.0, [0.0; 2]));
    for (window, sums) in sums.iter().map(|bands| bands[band]).enumerate() {
        if left <= LITTLE * total {
            break;
        }
        left -= sums.energy;
        let wide = (sums.excess / sums.energy).sqrt();
        if wide > width.0 {
            width = (wide, [window, window + 1].map(|border| duration * border as f64 / WINDOWS as f64));
        }
    }
    width
}

/// Logarithms of the ratio of variances that an arrival brings, by material, class of leads and band.
struct Excess {
    ratios: Vec<Vec<Vec<f64>>>,
    /// Logarithm of the number of sets.
    sets: f64,
}

impl Excess {
    fn new(map: &SonelMap) -> Self {
        let MapHeader { scene, settings, .. } = map.header();
        let (leads, bands) = (map.leads(), scene.bands.count());
        let fresh = Leads::new(&scene.materials, &[], &[], settings.survival, settings.spectral);
        let by_others = settings.spectral == Spectral::Shared;
        let moment = |factors: [f64; 3], probabilities: [f64; 3]| -> f64 {
            let of = |(factor, probability)| if factor > 0.0 { factor * factor / probability } else { 0.0 };
            factors.into_iter().zip(probabilities).map(of).sum()
        };
        let ratio = |material: usize, lead: usize, band: usize| {
            let factors = energies(&scene.materials[material], band);
            let (now, then) =
                (moment(factors, leads.drawn(material, lead)), moment(factors, fresh.drawn(material, band)));
            match () {
                () if !by_others && lead % bands != band => f64::INFINITY,
                () if then > 0.0 => libm::log(now / then),
                () => 0.0,
            }
        };
        let of_material = |material: usize| {
            let of_lead = |lead: usize| (0..bands).map(|band| ratio(material, lead, band)).collect();
            leads.classes().representatives().map(of_lead).collect()
        };
        Self {
            ratios: (0..scene.materials.len()).map(of_material).collect(),
            sets: libm::log(f64::from(map.layout().sets)),
        }
    }

    /// Ratio of the variances in `band` after arrivals that add up to `exponents`.
    fn ratio(&self, exponents: &[Vec<f64>], band: usize) -> f64 {
        let least = exponents.iter().map(|bands| bands[band]).fold(f64::INFINITY, f64::min);
        libm::exp((least + self.sets).min(FAR))
    }
}

/// What paths say.
struct Read {
    ledger: Ledger,
    /// By window and band.
    sums: Vec<Vec<Sums>>,
}

/// Reads the first `batches`, one by one so that sums do not depend on the number of threads.
fn read(map: &SonelMap, geometry: &Geometry, batches: u32) -> Read {
    let (reading, excess) = (Reading::new(map, geometry), Excess::new(map));
    let sources = 0..map.header().scene.sources.len() as u32;
    let batches: Vec<(u32, u32)> =
        sources.flat_map(|source| (0..batches).map(move |batch| (source, batch))).collect();
    let of = |batch| read_batch(&reading, &excess, geometry, batch);
    let found: Vec<Read> = batches.into_par_iter().map(of).collect();
    let nothing = vec![vec![Sums::default(); reading.bands]; WINDOWS];
    let mut total = Read { ledger: Ledger::new(reading.bands), sums: nothing };
    for found in &found {
        total.ledger.add(&found.ledger);
        for (mine, theirs) in total.sums.iter_mut().flatten().zip(found.sums.iter().flatten()) {
            mine.add(theirs);
        }
    }
    total
}

fn read_batch(
    reading: &Reading<'_>,
    excess: &Excess,
    geometry: &Geometry,
    (source, batch): (u32, u32),
) -> Read {
    let scene = &reading.map.header().scene;
    let step = scene.duration * scene.speed_of_sound / WINDOWS as f64;
    let mut sums = vec![vec![Sums::default(); reading.bands]; WINDOWS];
    let (mut weight, mut ledger) = (PathWeight::of(&reading.table), ChunkLedger::new(reading.bands));
    let none = vec![vec![0.0; reading.bands]; reading.table.leads()];
    for path in reading.map.batch_paths(source, batch) {
        let mut exponents = Along::new(none.clone());
        reading.account(source, path, &mut weight, &mut ledger, |segment| {
            exponents.enter(segment);
            let Some(arrival) = segment.arrival else { return };
            let window = ((segment.end_length / step) as usize).min(WINDOWS - 1);
            for (band, sums) in sums[window].iter_mut().enumerate() {
                let energy = segment.energy.band(band);
                sums.energy += energy;
                sums.excess += energy * excess.ratio(&exponents.now, band);
            }
            let material = geometry.surface(arrival.surface).material as usize;
            for (exponents, ratios) in exponents.now.iter_mut().zip(&excess.ratios[material]) {
                exponents.iter_mut().zip(ratios).for_each(|(exponent, ratio)| *exponent += ratio);
            }
        });
    }
    Read { ledger: ledger.finish(&BandClasses::separate(reading.bands)), sums }
}
