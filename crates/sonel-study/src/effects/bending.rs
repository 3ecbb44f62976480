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
//! [`sonel_map::edges::REACH_WAVELENGTHS`] wavelengths. It is cut where what lies beyond is below the thresholds; a band of which that is all is not bent. In the open,
//! where shadows are filled by nothing else, there is no such bound, and everything is bent.
//!
//! The paper's mode has edges of its own. References: docs/diffraction.md, docs/effects.md.

mod words;
mod worth;

use sonel_geometry::Geometry;
use sonel_map::edges::{bending_edges, whole_reach};
use sonel_map::{EffectState, Mode};
use sonel_scene::Scene;

use super::spec::Wish;
use super::{ASKED, Bound, Decision, Effect, Question};
use crate::trial::{Clock, TrialError};
use words::{cost, in_words};
use worth::Worth;

/// Packets of the short run.
const EMISSIONS: u64 = 512;

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
    let edges = bending_edges(geometry, &scene.wavelengths());
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
