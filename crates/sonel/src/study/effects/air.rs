//! Air attenuation of packets: bound of its effect.
//!
//! Sound that decays at a rate of k per second has e-folded after c/k metres, and air takes m of it a metre: without air T is longer by
//! x = m c/k of itself and levels are up to 10 lg(1 + x) higher. In a closed room k is that of Eyring, c A/(4V) with A = −S ln(1 − ᾱ), and x = 4mV/A; where
//! absorption is uneven and walls are mirrors rooms decay more slowly, so x is taken [`SLOWEST`] times. In the open nothing sustains the
//! sound, and x is m times the longest way. No sound decays more slowly than along the diameter between the least absorbing surfaces, and that
//! is taken where it is less.
//!
//! Direct sound, image sources and edges always have the air attenuation of the scene.
//!
//! References: [Eyring1930] (docs/references.md), ISO 9613-1 by way of `sonel-acoustics`.

use std::f64::consts::LOG10_E;

use glam::DVec3;
use sonel_acoustics::mean_absorption;
use sonel_geometry::Geometry;
use sonel_scene::Scene;

use super::spec::Request;
use super::{ASKED, Bound, Decision, Effect};

/// Slowest decay relative to Eyring's [1]: seven times as slow is a box of mirrors (10 × 8 × 3 m, α = 0.05) whose floor alone absorbs
/// (α = 0.6, T30 4.2 s for Eyring's 0.60 s), 2.6 times with s = 0.1.
const SLOWEST: f64 = 8.0;
/// Longest paths in the open [diameters of the scene]: there and back, twice. Chosen, not measured; doubled, air is simulated in scenes of half
/// the size.
const LONGEST_WAY: f64 = 4.0;

/// Decides on air, and changes the scene's as was asked; what changes less than `threshold` just-noticeable differences may be left out.
pub(super) fn decide(request: Request, threshold: f64, scene: &mut Scene, geometry: &Geometry) -> Decision {
    match request {
        Request::Off => scene.leave_out(Effect::Air),
        Request::On => scene.attenuate_by_air(),
        Request::Auto | Request::Scene => {}
    }
    let attenuates: Vec<bool> = strongest(scene).iter().map(|&m| m > 0.0).collect();
    if !attenuates.contains(&true) {
        let why = if request == Request::Off { ASKED } else { "the scene has none" };
        return Decision::new(Effect::Air, attenuates, why.to_owned());
    }
    let losses = losses(scene, geometry);
    let bound = Bound {
        level_db: losses.iter().map(|loss| 10.0 * LOG10_E * libm::log1p(loss.most)).collect(),
        decay: losses.iter().map(|loss| loss.most).collect(),
    };
    let on = if request == Request::Auto { bound.exceeds(threshold) } else { attenuates };
    let reason = if request == Request::Auto { reason(scene, &losses) } else { ASKED.to_owned() };
    Decision {
        bound: Some(bound),
        cost: "one factor a deposit".to_owned(),
        ..Decision::new(Effect::Air, on, reason)
    }
}

/// Attenuation of a band by air along the paths [Np]: the likely and the largest one.
struct Loss {
    likely: f64,
    most: f64,
}

fn losses(scene: &Scene, geometry: &Geometry) -> Vec<Loss> {
    let loss = |(band, m): (usize, f64)| {
        let (likely, most) = ways(scene, geometry, band);
        Loss { likely: m * likely, most: m * most }
    };
    strongest(scene).into_iter().enumerate().map(loss).collect()
}

/// m per band of the air that attenuates most [1/m].
fn strongest(scene: &Scene) -> Vec<f64> {
    let mut strongest = scene.air_attenuation.clone();
    for region in scene.media.iter().flat_map(|media| &media.regions) {
        for (strongest, m) in strongest.iter_mut().zip(&region.air_attenuation) {
            *strongest = strongest.max(*m);
        }
    }
    strongest
}

/// Likely and longest way over which the sound of a band e-folds [m].
fn ways(scene: &Scene, geometry: &Geometry, band: usize) -> (f64, f64) {
    let run = scene.duration * scene.speed_of_sound;
    let diameter = diameter(scene, geometry);
    let Some(volume) = geometry.volume().filter(|volume| *volume > 0.0) else {
        let longest = (LONGEST_WAY * diameter).min(run);
        return (longest, longest);
    };
    let materials = || scene.materials.iter().map(|material| material.absorption[band]).enumerate();
    let walls = || materials().map(|(material, alpha)| (geometry.exposed_area(material as u32), alpha));
    let area: f64 = walls().map(|(area, _)| area).sum();
    let absorption = -area * libm::log1p(-mean_absorption(walls()));
    let likely = (4.0 * volume / absorption).min(run);
    let least = walls().filter(|(area, _)| *area > 0.0).map(|(_, alpha)| alpha).fold(1.0, f64::min);
    let along_diameter = -diameter / libm::log1p(-least);
    (likely, (SLOWEST * likely).min(along_diameter.max(likely)).min(run))
}

/// Diameter of everything there is [m].
fn diameter(scene: &Scene, geometry: &Geometry) -> f64 {
    let places = scene.sources.iter().map(|source| source.position);
    let places = places.chain(scene.receivers.iter().map(|receiver| receiver.position));
    let (low, high) = places
        .fold(geometry.bounds(), |(low, high): (DVec3, DVec3), place| (low.min(place), high.max(place)));
    low.distance(high)
}

fn reason(scene: &Scene, losses: &[Loss]) -> String {
    let nominal = scene.bands.nominal();
    let percent = |band: usize| 100.0 * losses[band].likely;
    let last = losses.len() - 1;
    let of = |band: usize| format!("{:.2} % at {} Hz", percent(band), nominal[band]);
    let range = if last == 0 { of(0) } else { format!("{} to {}", of(0), of(last)) };
    format!("air adds {range} to the absorption of surfaces (4mV/A)")
}
