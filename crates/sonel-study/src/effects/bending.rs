//! What bending of packets is worth: by how much ways are turned.
//!
//! Bending keeps energy and turns as many ways to the left as to the right, so a field that is as bright in all directions does not
//! notice it. What is felt of an angle θ is of second order: with a brightness that changes by its own value over a radian ½ θ², of which T
//! changes by no more, since no more of the energy meets another absorption; and levels by three times that: the first leg, the last, and what T
//! sustains. ⟨½ θ²⟩ is taken over the legs of a short run, weighted by their energy, with the spread γ/(2kb) of each edge that they pass at
//! a distance b. In the open, where shadows are filled by nothing else, there is no such bound.
//!
//! It costs more than other effects: time, paths that bands share no longer, and what images of the receiver and visibility rays would hear
//! with less noise. So it is left out unless it is asked for, and the reason says what that may change. The paper's mode has edges of its own.
//!
//! References: docs/diffraction.md, docs/effects.md.

use std::f64::consts::LOG10_E;

use sonel_analysis::reading::Reading;
use sonel_geometry::{EdgeIndex, Geometry, Way};
use sonel_map::edges::{REACH_WAVELENGTHS, bending_edges};
use sonel_map::{EdgeTable, Mode, PathWeight, Segment, Settings, SonelMap};
use sonel_scene::Scene;

use super::spec::Wish;
use super::{ASKED, Bound, Decision, Effect};
use crate::trial::{Clock, InMemory, TrialError, trace};

/// Packets of the short run.
const EMISSIONS: u64 = 512;
/// Relative change of a level in units of ⟨½ θ²⟩.
const LEGS: f64 = 3.0;

/// Decides on bending; `weigh` asks for the bound even if it was decided about.
pub(super) fn decide(
    wish: Wish,
    mode: Mode,
    scene: &Scene,
    geometry: &Geometry,
    weigh: bool,
    clock: &dyn Clock,
) -> Result<Decision, TrialError> {
    let bands = scene.bands.count();
    let edges = bending_edges(geometry);
    let count = edges.lines().len();
    let off = |reason: &str| Decision::new(Effect::Bending, vec![false; bands], reason.to_owned());
    if count == 0 {
        return Ok(Decision { bound: Some(Bound::nothing(bands)), ..off("no edge is sharp enough") });
    }
    if mode == Mode::Paper {
        return Ok(off("the paper bends nothing"));
    }
    let asked = wish.asked_by_name();
    let bound = if geometry.is_closed_room() && (asked.is_none() || weigh) {
        Some(bound(&turned(scene, geometry, &edges, clock)?))
    } else {
        None
    };
    let worth =
        bound.as_ref().map_or_else(String::new, |bound| format!("; it may {}", changes(bound, scene)));
    let reason = match asked {
        Some(true) => format!("{ASKED}, {count} edges, up to {REACH_WAVELENGTHS} wavelengths from them"),
        Some(false) => ASKED.to_owned(),
        None => format!("left out unless asked for with +bending{worth}"),
    };
    let on = asked == Some(true);
    let cost = if on {
        "a segment up to twice, and paths of their own for the bands".to_owned()
    } else {
        String::new()
    };
    Ok(Decision { bound, cost, ..Decision::new(Effect::Bending, vec![on; bands], reason) })
}

/// The bound that follows from ⟨½ θ²⟩ of each band.
fn bound(turned: &[f64]) -> Bound {
    Bound {
        level_db: turned.iter().map(|x| 10.0 * LOG10_E * libm::log1p(LEGS * x)).collect(),
        decay: turned.to_vec(),
    }
}

fn changes(bound: &Bound, scene: &Scene) -> String {
    let (first, last) = (0, scene.bands.count() - 1);
    let of = |band: usize| {
        format!(
            "{:.2} dB and {:.2} % of T at {} Hz",
            bound.level_db[band],
            100.0 * bound.decay[band],
            scene.bands.nominal()[band]
        )
    };
    if first == last {
        format!("change up to {}", of(first))
    } else {
        format!("change up to {}, {}", of(first), of(last))
    }
}

/// ⟨½ θ²⟩ of each band over the legs of a short run without bending.
fn turned(
    scene: &Scene,
    geometry: &Geometry,
    edges: &EdgeIndex,
    clock: &dyn Clock,
) -> Result<Vec<f64>, TrialError> {
    let settings = Settings { emissions: EMISSIONS, ..Settings::default() };
    let traced = trace(scene, geometry, Vec::new(), settings, &mut InMemory, clock)?;
    let bands = scene.bands.count();
    let table = EdgeTable::new(edges.lines().to_vec(), &scene.wavelengths(), &vec![true; bands]);
    let mut sums = vec![(0.0, 0.0); bands];
    each_leg(&traced.map, geometry, |segment| {
        let turns = turns(segment, geometry, edges, &table, bands);
        for (band, (sum, turned)) in sums.iter_mut().zip(turns).enumerate() {
            let energy = segment.energy[band / 4][band % 4];
            sum.0 += energy * turned;
            sum.1 += energy;
        }
    });
    Ok(sums.into_iter().map(|(turned, energy)| if energy > 0.0 { turned / energy } else { 0.0 }).collect())
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

/// ½ θ² of each band on one leg, all edges that it passes together, at most ½.
fn turns(
    segment: &Segment<'_>,
    geometry: &Geometry,
    edges: &EdgeIndex,
    table: &EdgeTable,
    bands: usize,
) -> Vec<f64> {
    let mut squares = vec![0.0_f64; bands];
    let mut way = Way::between(segment.start.as_dvec3(), segment.end.as_dvec3(), table.reach(segment.energy));
    while let Some(passage) = edges.first(geometry, &way, |_| true) {
        for (band, square) in squares.iter_mut().enumerate() {
            if table.bends(band, passage.distance) {
                let angle = table.tangent(band, passage.distance, 1.0);
                *square += angle * angle;
            }
        }
        way.from = passage.at + passage.distance;
    }
    squares.iter().map(|square| 0.5 * square.min(1.0)).collect()
}
