//! Bound of edge diffraction, from a short run rendered with and without it.
//!
//! Edges change deterministic paths only, so both renderings use the same packets and their difference has no noise. The
//! energy it is compared with has noise and is taken three standard errors below the estimate. A level then changes by at
//! most 10 lg(1 + |ΔF|/F). What edges change comes early: it moves the beginning of the decay curve against
//! its rest by no more than that, and the slope of a line fitted over 30 dB by at most 3/2 of it in 30. One integral serves all
//! bands of an edge: where one band calls for it, all have it.

use std::f64::consts::LOG10_E;

use glam::DVec3;
use sonel_analysis::{Parameter, ParameterValue};
use sonel_geometry::Geometry;
use sonel_map::{EffectState, Settings};
use sonel_renderer::{ReceiverPoint, RenderSettings};
use sonel_scene::Scene;

use super::spec::Request;
use super::{ASKED, Bound, Decision, Effect, Question};
use crate::pipeline::{Clock, InMemory, PipelineError, Rendered, TracedMap, render_and_read, trace};
use crate::response::receivers_of;

/// Most receivers that are listened at: of more, as many evenly among them.
pub const LISTENERS: usize = 8;
/// Packets of the short run: the diffuse field to a few per cent.
const EMISSIONS: u64 = 1024;
/// Visibility rays of a listener.
const RAYS: u32 = 2048;
/// Image-source paths of the short run: edges change all images, but those of more reflections bring too little to matter, and take most of the time in
/// rooms of few walls.
const MIRROR_ORDER: u32 = 4;
/// Why nothing diffracts.
const NO_EDGE: &str = "no free or convex edge";
/// Points of a sequence that are tried for a place in the air.
const TRIES: u32 = 4096;
/// Levels over which T30 is fitted [dB].
const T30_RANGE_DB: f64 = 30.0;
/// Change of a fitted slope over the range, in units of a step somewhere in the curve, at most: 6 x (1 − x) with the step in the middle.
const STEP_IN_SLOPE: f64 = 1.5;
/// Half-widths of a 95 % interval that make three standard errors.
const HALF_WIDTHS: f64 = 1.5;
/// What a level that has no interval may be wrong by [dB].
const UNKNOWN_DB: f64 = 3.0;

/// Decides on diffraction.
pub(super) fn decide(
    asked: Question,
    scene: &Scene,
    geometry: &Geometry,
    clock: &dyn Clock,
) -> Result<Decision, PipelineError> {
    let request = asked.request;
    let bands = scene.bands.count();
    let count = geometry.diffracting_edges().count();
    let decision = |on: bool, reason: String| Decision::new(Effect::Diffraction, vec![on; bands], reason);
    if count == 0 {
        let bound = Some(Bound::nothing(bands));
        return Ok(Decision { bound, ..decision(false, NO_EDGE.to_owned()) });
    }
    if let Some(on) = request.decided().filter(|_| !asked.weigh) {
        return Ok(decision(on, format!("{ASKED}, {count} edges")));
    }
    let found = weigh_edges(asked, scene, geometry, clock)?;
    let on = request.decided().unwrap_or_else(|| asked.exceeding(&found.bound).contains(&true));
    let why = if request == Request::Auto { String::new() } else { format!("{ASKED}, ") };
    let reason = format!("{why}{} {}", describe(count, scene, geometry), found.describe(count, scene));
    let cost = format!("{:.2} CPU-s a receiver", found.seconds);
    Ok(Decision { bound: Some(found.bound), cost, ..decision(on, reason) })
}

/// The same in the founding paper's mode, whose diffraction is part of the method and weighed by nobody.
pub(super) fn decide_for_paper(request: Request, scene: &Scene, geometry: &Geometry) -> Decision {
    let bands = scene.bands.count();
    let (on, reason) = match (geometry.diffracting_edges().count(), request) {
        (_, Request::Off) => (false, ASKED.to_owned()),
        (0, _) => (false, NO_EDGE.to_owned()),
        (count, _) => {
            (true, format!("as in the paper, in zones of half a wavelength on either side of {count} edges"))
        }
    };
    Decision::new(Effect::Diffraction, vec![on; bands], reason)
}

/// `effects` without diffraction.
pub(crate) fn left_out(effects: &[EffectState]) -> Vec<EffectState> {
    let name = Effect::Diffraction.name();
    effects.iter().filter(|effect| effect.name != name).cloned().collect()
}

fn describe(count: usize, scene: &Scene, geometry: &Geometry) -> String {
    let length = |ends: [DVec3; 2]| ends[0].distance(ends[1]);
    let longest = geometry.diffracting_edges().map(|edge| length(edge.ends)).fold(0.0, f64::max);
    let highest = scene.bands.nominal().iter().copied().fold(0.0, f64::max);
    let short = longest < 0.25 * scene.speed_of_sound / highest;
    let edges = if count == 1 { "edge" } else { "edges" };
    format!("{count} {edges}{}", if short { ", none longer than λ/4," } else { "" })
}

/// What edges are worth.
struct EdgeBound {
    bound: Bound,
    listening_points: String,
    /// A receiver that no sound reaches without edges, and the index of the highest such band.
    alone: Option<(String, usize)>,
    /// CPU seconds a receiver.
    seconds: f64,
}

impl EdgeBound {
    /// Predicate of a sentence on `count` edges.
    fn describe(&self, count: usize, scene: &Scene) -> String {
        let (change, are, path) =
            if count == 1 { ("changes", "is", "path") } else { ("change", "are", "paths") };
        if let Some((receiver, band)) = &self.alone {
            return format!("{are} the only {path} to \"{receiver}\" at {} Hz", scene.bands.nominal()[*band]);
        }
        let (level_db, band) = self
            .bound
            .level_db
            .iter()
            .zip(scene.bands.nominal())
            .fold((0.0, 0.0), |most, (&level, &band)| if level >= most.0 { (level, band) } else { most });
        let decay = self.bound.decay.iter().copied().fold(0.0, f64::max);
        format!(
            "{change} levels by up to {level_db:.2} dB ({band} Hz) and T by up to {:.2} %, {}",
            100.0 * decay,
            self.listening_points
        )
    }
}

/// Renders the receivers one after the other; where nobody asks for the bound itself, until one calls for edges.
fn weigh_edges(
    asked: Question,
    scene: &Scene,
    geometry: &Geometry,
    clock: &dyn Clock,
) -> Result<EdgeBound, PipelineError> {
    let (listening_points, all) = listening_points(scene, geometry);
    let traced = |on: bool| -> Result<TracedMap, PipelineError> {
        let settings = Settings { emissions: EMISSIONS, ..Settings::default() };
        let state =
            EffectState::new(Effect::Diffraction.name(), vec![on; scene.bands.count()], String::new());
        trace(scene, geometry, vec![state], settings, &mut InMemory, clock)
    };
    let maps = [traced(false)?, traced(true)?];
    // Arcs have no image-source paths.
    let mirror_order = (scene.sound_speed_gradient == 0.0).then_some(MIRROR_ORDER);
    let render = RenderSettings { rays: Some(RAYS), mirror_order, ..RenderSettings::default() };
    let bound = Bound::nothing(scene.bands.count());
    let mut found = EdgeBound { bound, listening_points: all, alone: None, seconds: 0.0 };
    let mut seconds = 0.0;
    for (number, listener) in (1..).zip(&listening_points) {
        let render_and_read = |traced: &TracedMap| {
            render_and_read(&traced.map, geometry, std::slice::from_ref(listener), &render, clock)
        };
        let (without, with) = (render_and_read(&maps[0])?, render_and_read(&maps[1])?);
        seconds += (with.seconds.deterministic - without.seconds.deterministic).max(0.0);
        let change = change(scene.bands.count(), &without, &with);
        if let Some(band) = change.level_db.iter().rposition(|level| level.is_infinite()) {
            found.alone.get_or_insert((listener.name.clone(), band));
        }
        found.bound.extend(&change);
        found.seconds = seconds / f64::from(number) / scene.sources.len().max(1) as f64;
        let is_sure =
            asked.request == Request::Auto && !asked.weigh && asked.exceeding(&found.bound).contains(&true);
        if is_sure && (number as usize) < listening_points.len() {
            found.listening_points = format!("already at \"{}\"", listener.name);
            break;
        }
    }
    Ok(found)
}

/// The largest change between two renderings of the same packets.
fn change(bands: usize, without: &Rendered, with: &Rendered) -> Bound {
    let mut bound = Bound::nothing(bands);
    for (without, with) in without.parameters.iter().zip(&with.parameters) {
        for (band, (without, with)) in without.bands.iter().zip(&with.bands).enumerate() {
            let level = level_change(without.parameter(Parameter::Level), with.parameter(Parameter::Level));
            bound.level_db[band] = bound.level_db[band].max(level);
        }
    }
    bound.decay = bound.level_db.iter().map(|level| STEP_IN_SLOPE * level / T30_RANGE_DB).collect();
    bound
}

/// 10 lg(1 + |ΔF|/F), F three standard errors low [dB]; infinite where there is sound with the effect only.
fn level_change(without: &ParameterValue, with: &ParameterValue) -> f64 {
    let (without, with) = match (without, with) {
        (Ok(without), Ok(with)) => (without, with),
        (Err(_), Err(_)) => return 0.0,
        _ => return f64::INFINITY,
    };
    let uncertain =
        without.interval.as_ref().map_or(UNKNOWN_DB, |interval| HALF_WIDTHS * (without.value - interval[0]));
    let ratio = libm::pow(10.0, (with.value - without.value).abs() / 10.0);
    10.0 * LOG10_E * libm::log1p((ratio - 1.0) * libm::pow(10.0, uncertain.max(0.0) / 10.0))
}

/// Where the room is listened to, and how to say that.
fn listening_points(scene: &Scene, geometry: &Geometry) -> (Vec<ReceiverPoint>, String) {
    let named = receivers_of(scene);
    match named.len() {
        0 => {
            let places = places(scene, geometry);
            let described = format!("at {} places in the air", places.len());
            (places, described)
        }
        1 => (named, "at the scene's receiver".to_owned()),
        count if count <= LISTENERS => (named, format!("at the scene's {count} receivers")),
        count => {
            let chosen = (0..LISTENERS).map(|number| named[number * count / LISTENERS].clone()).collect();
            (chosen, format!("at {LISTENERS} of the scene's {count} receivers"))
        }
    }
}

/// Places spread evenly over the air, for scenes without receivers: points of the sequence of Halton in the box about everything.
pub(crate) fn places(scene: &Scene, geometry: &Geometry) -> Vec<ReceiverPoint> {
    let sources: Vec<DVec3> = scene.sources.iter().map(|source| source.position).collect();
    let (low, high) = sources.iter().fold(geometry.bounds(), |(low, high), at| (low.min(*at), high.max(*at)));
    let least = f64::from(geometry.resolution());
    let in_air = |place: &DVec3| {
        geometry.obstacle(*place, &sources).is_none()
            && sources.iter().all(|source| source.distance(*place) > least)
    };
    (1..=TRIES)
        .map(|number| {
            low + (high - low) * DVec3::from_array([2, 3, 5].map(|base| radical_inverse(number, base)))
        })
        .filter(in_air)
        .take(LISTENERS)
        .enumerate()
        .map(|(number, position)| ReceiverPoint::omni(&format!("place {}", number + 1), position))
        .collect()
}

/// The digits of `number` in `base` mirrored at the point.
fn radical_inverse(mut number: u32, base: u32) -> f64 {
    let (mut inverse, mut digit) = (0.0, 1.0);
    while number > 0 {
        digit /= f64::from(base);
        inverse += digit * f64::from(number % base);
        number /= base;
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{BandWidth, Bands, Material};

    #[test]
    fn edges_that_are_the_only_path_have_no_change_in_decibels() {
        let bands = Bands::new(vec![500.0, 1000.0], BandWidth::Octave).unwrap();
        let scene = Scene::shoebox([5.0, 4.0, 3.0], Material::uniform("walls", 0.2, 0.5, 2), bands);
        let bound = Bound { level_db: vec![0.5, 2.0], decay: vec![0.01, 0.1] };
        let listening_points = "already at \"seat\"".to_owned();
        let mut found = EdgeBound { bound, listening_points, alone: None, seconds: 0.0 };
        let finite = "levels by up to 2.00 dB (1000 Hz) and T by up to 10.00 %, already at \"seat\"";
        assert_eq!(found.describe(7, &scene), format!("change {finite}"));
        assert_eq!(found.describe(1, &scene), format!("changes {finite}"));
        found.bound = Bound { level_db: vec![f64::INFINITY; 2], decay: vec![f64::INFINITY; 2] };
        found.alone = Some(("seat".to_owned(), 1));
        assert_eq!(found.describe(7, &scene), "are the only paths to \"seat\" at 1000 Hz");
        assert_eq!(found.describe(1, &scene), "is the only path to \"seat\" at 1000 Hz");
    }
}
