//! What a plan says of bending: what it may change, how far edges bend, what it costs.

use sonel_geometry::Geometry;
use sonel_map::{EffectState, Settings};
use sonel_scene::Scene;

use super::super::Effect;
use super::{EMISSIONS, Worth};
use crate::trial::{Clock, InMemory, TrialError, trace};

/// How far edges bend, and what they are worth.
pub(super) fn in_words(scene: &Scene, reach: &[f64], worth: Option<&Worth>) -> String {
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
pub(super) fn cost(
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
