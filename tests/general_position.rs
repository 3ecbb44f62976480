//! What must not be wrong in a random building, with edges: sound in sealed rooms, image-source sums, closed meshes called open.

use glam::DVec3;
use rayon::prelude::*;
use sonel_geometry::{End, Geometry};
use sonel_map::Settings;
use sonel_renderer::{DiscreteArrival, Estimator, RenderSettings};
use sonel_testkit::analytic::specular_box::SpecularBox;

use crate::buildings::{ABSORPTION, Building, Place, SCATTERING};
use crate::specular_paths::{Mirrors, SpecularPath};
use crate::{Traced, fluence};

/// Receivers of a building, two of them in the room of the source.
const RECEIVERS: usize = 5;
/// Emissions: enough that packets come near most corners.
const EMISSIONS: u64 = 64;
/// Order up to which image sources are compared.
const ORDER: u32 = 4;
/// Image sources are in one place within this [m].
const SAME_PLACE: f64 = 1e-6;
/// Duration [s], and its bins of a millisecond.
pub const DURATION: f64 = 0.1;
const BINS: usize = 100;
/// Speed of sound [m/s].
const SPEED: f64 = 343.0;

/// Pairs of source and receiver that were judged in buildings, and what was wrong, as sentences. Every path of up to `order` reflections is
/// looked for among the triangles as drawn.
#[must_use]
pub fn judged(seeds: std::ops::Range<u64>, estimators: &[Estimator], order: u32) -> (usize, Vec<String>) {
    let all: Vec<(usize, Vec<String>)> =
        seeds.into_par_iter().map(|seed| building(seed, estimators, order)).collect();
    let pairs = all.iter().map(|(pairs, _)| pairs).sum();
    (pairs, all.into_iter().flat_map(|(_, faults)| faults).collect())
}

/// Pairs and faults of the building of a seed.
fn building(seed: u64, estimators: &[Estimator], order: u32) -> (usize, Vec<String>) {
    let mut building = Building::new(seed);
    let at = building.any_room();
    let Some(source) = building.place(at) else { return (0, Vec::new()) };
    let mut receivers: Vec<Place> = Vec::new();
    for _ in 0..RECEIVERS {
        let room = if receivers.len() < 2 { source.room } else { building.any_room() };
        let place = building.place(room).filter(|place| place.position.distance(source.position) > 0.1);
        receivers.extend(place);
    }
    let mut faults = Vec::new();
    let geometry = Geometry::build(building.mesh.clone()).expect("a building has walls");
    if !geometry.is_watertight() {
        faults.push(format!("{seed}: not watertight"));
    }
    let is_air = |place: &Place| geometry.check_place(place.position, &[]).is_ok();
    // Few drawings leave open which of their boxes are solid.
    let right = building.volume();
    let is_told = geometry.volume().is_some_and(|volume| (volume / right - 1.0).abs() < 1e-6);
    let refused =
        receivers.iter().chain([&source]).find(|place| building.is_at_hull(place) && !is_air(place));
    faults.extend(refused.filter(|_| is_told).map(|place| format!("{seed}: {place:?} is air")));
    receivers.retain(is_air);
    if !is_air(&source) || receivers.is_empty() {
        return (0, faults);
    }
    let regions = geometry.regions(|_| false);
    let is_one_air = |place: &&Place| {
        (regions.at(place.position) == regions.at(source.position)) == place.is_connected(&source)
    };
    let wrong = receivers.iter().find(|place| !is_one_air(place));
    faults.extend(wrong.map(|place| format!("{seed}: regions of {place:?} and {source:?}")));
    let scene = building.scene(source.position, &receivers, DURATION);
    let settings = Settings { emissions: EMISSIONS, seed, ..Settings::default() };
    let mirrors = Mirrors::of(&scene.mesh);
    let traced = Traced::diffracting(scene, settings);
    for &estimator in estimators {
        let settings = RenderSettings { mirror_order: Some(ORDER), ..RenderSettings::of(estimator) };
        let rendering = traced.render(settings);
        for (index, place) in receivers.iter().enumerate() {
            let all = fluence(&rendering, BINS, index, 0);
            let room = &building.rooms[place.room];
            if estimator == Estimator::Auto {
                let of_receiver = rendering.arrivals.iter().filter(|it| it.receiver == index);
                let ends = [source.position, place.position];
                let wrong = wrong_path(&mirrors, &geometry, ends, order, of_receiver);
                faults.extend(wrong.map(|path| format!("{seed}: {path} from {source:?} to {place:?}")));
            }
            if !place.is_connected(&source) {
                let leaks = || format!("{seed} {estimator:?}: {all:e} leaks from {source:?} to {place:?}");
                faults.extend((all > 0.0).then(leaks));
            } else if estimator == Estimator::Auto && is_told && room.is_empty_box() {
                let of_images =
                    rendering.arrivals.iter().filter(|it| it.receiver == index && it.order <= ORDER);
                let found: f64 = of_images.map(|it| it.energy[0]).sum();
                let ratio = found / image_sum(&building, &source, place);
                let wrong = || format!("{seed}: images bring {ratio} from {source:?} to {place:?}");
                faults.extend(((ratio - 1.0).abs() > 1e-6).then(wrong));
            }
        }
    }
    (receivers.len(), faults)
}

/// Sum of the image sources of the box that a room is.
fn image_sum(building: &Building, source: &Place, receiver: &Place) -> f64 {
    let room = &building.rooms[source.room];
    let [low, high] = room.bounds;
    let reflection = room.walls.map(|wall| (1.0 - ABSORPTION[wall as usize]) * (1.0 - SCATTERING));
    let size = (high - low).to_array();
    let exact = SpecularBox { size, reflection, speed_of_sound: SPEED, air_attenuation: 0.0 };
    let [from, to] = [source, receiver].map(|place| (place.on_grid - low).to_array());
    exact
        .arrivals_to_order(from, to, ORDER)
        .iter()
        .filter(|it| it.time <= DURATION)
        .map(|it| it.fluence)
        .sum()
}

/// A path that is listed and is none, or is missing, among those of at most `order` reflections.
pub fn wrong_path<'a>(
    mirrors: &Mirrors,
    geometry: &Geometry,
    ends: [DVec3; 2],
    order: u32,
    arrivals: impl IntoIterator<Item = &'a DiscreteArrival>,
) -> Option<String> {
    let displacements =
        [End::Source, End::Receiver].map(|end| geometry.in_general_position(DVec3::ZERO, end));
    let longest = DURATION * SPEED - SAME_PLACE;
    let mut missing = mirrors.paths(ends, displacements, order, longest);
    for it in arrivals.into_iter().filter(|it| it.order <= order && !it.over_edges && it.length <= longest) {
        let image = ends[1] + it.length * DVec3::from(it.towards);
        let is_it = |path: &SpecularPath| path.order == it.order && path.image.distance(image) <= SAME_PLACE;
        match missing.iter().position(is_it) {
            Some(at) => missing.swap_remove(at),
            None => return Some(format!("a path of order {} by {image} is none", it.order)),
        };
    }
    missing.first().map(|path| format!("{path:?} is missing"))
}

/// Pairs of source and receiver in buildings with [free ends](Building::with_free_ends) that are not one air, and those of them to which sound
/// comes over edges, as sentences. Reflections are not sought: paths over edges need no packets.
#[must_use]
pub fn leaks_over_edges(seeds: std::ops::Range<u64>) -> (usize, Vec<String>) {
    let of_building = |seed: u64| {
        let mut building = Building::with_free_ends(seed);
        let geometry = Geometry::build(building.mesh.clone()).expect("a building has walls");
        let is_air = |place: &Place| geometry.check_place(place.position, &[]).is_ok();
        let places: Vec<Place> =
            (0..building.rooms.len()).filter_map(|room| building.place(room)).filter(is_air).collect();
        let Some((source, receivers)) = places.split_first() else { return (0, Vec::new()) };
        let sealed: Vec<Place> =
            receivers.iter().filter(|place| !place.is_connected(source)).copied().collect();
        if sealed.is_empty() {
            return (0, Vec::new());
        }
        let scene = building.scene(source.position, &sealed, DURATION);
        let settings = Settings { emissions: EMISSIONS, seed, ..Settings::default() };
        let rendering = Traced::diffracting(scene, settings).render(RenderSettings::default());
        let energy = |index: usize| fluence(&rendering, BINS, index, 0);
        let leaks = sealed.iter().enumerate().filter(|(index, _)| energy(*index) > 0.0);
        let said =
            leaks.map(|(index, place)| format!("{seed}: {:e} from {source:?} to {place:?}", energy(index)));
        (sealed.len(), said.collect())
    };
    let all: Vec<(usize, Vec<String>)> = seeds.into_par_iter().map(of_building).collect();
    let pairs = all.iter().map(|(pairs, _)| pairs).sum();
    (pairs, all.into_iter().flat_map(|(_, leaks)| leaks).collect())
}
