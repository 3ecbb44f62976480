//! Checkups of scenes: their report, and what a short trace adds.

use crate::study::room_decay::RoomDecay;
use serde_json::{Value, json};
use sonel_scene::checkup::{Air, Checkup, Covering, Room, Times};

/// The checkup as JSON (docs/interface.md).
#[must_use]
pub fn report(checkup: &Checkup) -> Value {
    let all: Vec<String> = checkup.defaults.iter().cloned().chain(notes(checkup)).collect();
    let errors: Vec<String> = checkup.problems.iter().map(ToString::to_string).collect();
    json!({
        "room": room(checkup),
        "notes": all,
        "errors": errors,
        "warnings": checkup.warnings,
        "faults": checkup.faults,
    })
}

/// Sizes, areas and statistical times alone, which need no trace; null where there are none.
#[must_use]
pub fn room(checkup: &Checkup) -> Value {
    checkup.room.as_ref().map_or(Value::Null, room_json)
}

/// The notes of `checkup` but for defaults, and one where a short trace shows that Sabine's time does not hold.
#[must_use]
pub fn notes(checkup: &Checkup) -> Vec<String> {
    checkup.notes.iter().cloned().chain(uneven(checkup)).collect()
}

/// Times of a short trace this many times those of Sabine are named: twice what scattering, shape and few packets bring.
const UNEVEN: f64 = 1.3;

fn uneven(checkup: &Checkup) -> Option<String> {
    let (scene, geometry) = checkup.traceable.as_ref()?;
    // One source tells how its room decays.
    let mut scene = scene.clone();
    scene.sources.truncate(1);
    // A room that leaks is an error of a trace, not of a checkup.
    let decay = RoomDecay::of(&scene, geometry).ok()??;
    let times = &checkup.room.as_ref()?.times;
    let found = times.iter().enumerate().filter_map(|(band, times)| {
        let time = decay.reverberation_time(band).unwrap_or(f64::INFINITY);
        (time > UNEVEN * times.sabine).then_some((time / times.sabine, time, times))
    });
    let (_, time, times) = found.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let Times { center_hz, sabine, .. } = times;
    let time =
        if time.is_finite() { format!("T30 is {time:.2} s") } else { "T30 is longer still".to_owned() };
    Some(format!(
        "absorption is uneven: at {center_hz} Hz Sabine's time is {sabine:.2} s, but in a short trace {time}: sound stays between surfaces that \
         absorb little; statistical times do not hold, and scattering of these surfaces decides T"
    ))
}

fn room_json(room: &Room) -> Value {
    let coverings = room.coverings.iter().map(|Covering { name, area, absorption }| {
        json!({ "name": name, "area_m2": area, "absorption": absorption })
    });
    let times = room.times.iter().map(|times| {
        json!({
            "center_frequency_hz": times.center_hz,
            "mean_absorption": times.mean_absorption,
            "sabine_s": times.sabine,
            "eyring_s": times.eyring,
        })
    });
    // What is outside has neither volume nor place.
    let airs = room.airs.iter().map(|Air { volume, place, materials, points }| match volume.zip(*place) {
        None => json!({ "materials": materials, "points": points }),
        Some((volume, place)) => {
            json!({ "volume_m3": volume, "place_m": place.to_array(), "materials": materials, "points": points })
        }
    });
    let [triangles, surfaces] = room.counts;
    json!({
        "extents_m": room.extents.to_array(),
        "volume_m3": room.volume,
        "area_m2": room.area,
        "mean_free_path_m": room.mean_free_path,
        "schroeder_frequency_hz": room.schroeder_frequency,
        "triangles": triangles,
        "surfaces": surfaces,
        "materials": coverings.collect::<Vec<_>>(),
        "bands": times.collect::<Vec<_>>(),
        "airs": airs.collect::<Vec<_>>(),
    })
}
