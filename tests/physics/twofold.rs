//! Images of two reflections end at edges as those of one do: nobody hears them begin, and in a corner they are what goes past a whole obstacle
//! of which a quarter stands there.

use std::ops::RangeInclusive;

use glam::{DVec3, dvec3};
use rayon::prelude::*;
use sonel_geometry::Mesh;
use sonel_renderer::{DiscreteArrival, ReceiverPoint, RenderSettings};
use sonel_testkit::uniform::Uniform;
use sonel_tests::meshes;

use super::mirrored_edges::{BANDS, FLOOR, Field, OBSTACLE, VOID};

pub(super) const SOURCE: DVec3 = dvec3(1.4, 2.3, 0.9);

/// Adds what has the outline `[x, z]`.
pub(super) fn add_along_y(mesh: &mut Mesh, ends: [f64; 2], outline: &[[f64; 2]]) {
    for side in outline.windows(2) {
        let [[a, b], [c, d]] = [0, 1].map(|end| ends.map(|y| dvec3(side[end][0], y, side[end][1])));
        meshes::add_quad(mesh, OBSTACLE, [a, b, d, c]);
    }
}

pub(super) fn add_sheet(mesh: &mut Mesh, x: f64, [y0, y1]: [f64; 2], [z0, z1]: [f64; 2]) {
    let corners = [[y0, z0], [y1, z0], [y1, z1], [y0, z1]].map(|[y, z]| dvec3(x, y, z));
    meshes::add_quad(mesh, OBSTACLE, corners);
}

pub(super) fn arrivals(field: &Field, place: DVec3) -> Vec<DiscreteArrival> {
    let settings =
        RenderSettings { mirror_order: Some(field.order), rays: Some(512), ..RenderSettings::default() };
    let renderer = field.traced.renderer(settings);
    let receiver = ReceiverPoint { position: place, ..field.ear.clone() };
    let rendering = renderer.render(0, &[receiver], &[vec![0.0, 0.3]]);
    rendering.expect("a sound receiver").arrivals
}

/// A path without edges: number of its reflections, and where its image is [mm].
type Path = (u32, [i64; 3]);

/// A place on a walk, and what reaches it.
type Place = (DVec3, Vec<Path>);

/// What reaches `place` where nothing is diffracted.
fn seen(without: &Field, place: DVec3) -> Place {
    let path = |arrival: &DiscreteArrival| {
        let image = place + DVec3::from(arrival.towards) * arrival.length;
        (arrival.order, image.to_array().map(|x| (1e3 * x).round() as i64))
    };
    let mut paths: Vec<Path> = arrivals(without, place).iter().map(path).collect();
    paths.sort_unstable();
    (place, paths)
}

/// Adds the places between two others, to half a micrometre, where a path begins or ends that has so many reflections.
fn add_boundaries(without: &Field, ends: [Place; 2], orders: &RangeInclusive<u32>, found: &mut Vec<DVec3>) {
    let [(from, one), (to, other)] = &ends;
    let odd = one
        .iter()
        .filter(|path| !other.contains(path))
        .chain(other.iter().filter(|path| !one.contains(path)));
    if !odd.into_iter().any(|(order, _)| orders.contains(order)) {
        return;
    }
    let middle = 0.5 * (*from + *to);
    if from.distance(*to) < 1e-6 {
        found.push(middle);
        return;
    }
    let middle = seen(without, middle);
    let [from, to] = ends;
    add_boundaries(without, [from, middle.clone()], orders, found);
    add_boundaries(without, [middle, to], orders, found);
}

/// The places on the way between `ends` where a path of so many reflections begins or ends.
pub(super) fn boundaries(without: &Field, ends: [DVec3; 2], orders: RangeInclusive<u32>) -> Vec<DVec3> {
    let places: Vec<Place> = (0..=40)
        .into_par_iter()
        .map(|step| seen(without, ends[0].lerp(ends[1], f64::from(step) / 40.0)))
        .collect();
    let mut found = Vec::new();
    for pair in places.windows(2) {
        add_boundaries(without, [pair[0].clone(), pair[1].clone()], &orders, &mut found);
    }
    found
}

/// Largest change of any band over the boundary at each of `places` and within a millimetre about it [dB].
pub(super) fn steps(field: &Field, places: &[DVec3], along: DVec3) -> Vec<f64> {
    let about = |&place: &DVec3| [-5e-4, -3e-6, 3e-6, 5e-4].map(|offset| place + offset * along);
    let received = field.received(&places.iter().flat_map(about).collect::<Vec<DVec3>>());
    let change = |pair: &[[f64; BANDS]], band: usize| (10.0 * (pair[0][band] / pair[1][band]).log10()).abs();
    let step = |received: &[[f64; BANDS]]| {
        let pairs = received.windows(2);
        pairs.flat_map(|pair| (0..BANDS).map(move |band| change(pair, band))).fold(0.0, f64::max)
    };
    received.chunks(4).map(step).collect()
}

/// Largest of them at `places`.
pub(super) fn largest(field: &Field, places: &[DVec3], along: DVec3) -> f64 {
    steps(field, places, along).into_iter().fold(0.0, f64::max)
}

/// Images of two reflections behind a thin barrier from wall to wall in a room whose walls all reflect, and of one between sheets that face one another in the open with a third one between.
#[test]
fn images_begin_and_end_without_a_step() {
    let mut barrier = Mesh::shoebox([8.0, 6.0, 3.0], [FLOOR; 6]);
    add_along_y(&mut barrier, [0.0, 6.0], &[[3.6, 0.0], [3.6, 1.3]]);
    let mut open = Mesh::shoebox([24.0, 20.0, 16.0], [VOID; 6]);
    open.vertices.iter_mut().for_each(|vertex| *vertex -= dvec3(8.0, 6.0, 7.0));
    add_sheet(&mut open, 0.0, [1.5, 4.5], [0.5, 2.5]);
    add_sheet(&mut open, 6.0, [1.0, 4.0], [0.7, 2.9]);
    add_sheet(&mut open, 3.4, [2.2, 3.1], [0.4, 1.9]);
    let upwards = [dvec3(6.13, 2.9, 0.2), dvec3(6.15, 3.0, 1.5)];
    let across = [dvec3(5.2, 0.3, 1.05), dvec3(5.25, 3.0, 1.1)];
    for (name, mesh, absorption, ends, order) in
        [("a thin barrier", barrier, 0.6, upwards, 2), ("sheets in the open", open, 0.0, across, 1)]
    {
        let without = Field::new(mesh.clone(), absorption, SOURCE, &[]);
        let field = Field::new(mesh, absorption, SOURCE, &["diffraction"]);
        let along = (ends[1] - ends[0]).normalize();
        let all = boundaries(&without, ends, order..=order);
        let places: Vec<DVec3> = all.iter().copied().step_by(7).collect();
        println!("{name}: {} of {} boundaries", places.len(), all.len());
        assert!(!places.is_empty(), "{name}");
        for (place, step) in places.iter().zip(steps(&field, &places, along)) {
            assert!(step < 0.1, "{name}, α = {absorption}, {place}: {step} dB");
        }
        let known_wrong = largest(&without, &places, along);
        assert!(known_wrong > 0.15, "{name}: images begin at once without edges: {known_wrong} dB");
    }
}

/// Two to four sheets that face one another in the open, and walks between and behind them: where direct sound or an image of one or two
/// reflections begins. Of two sheets no step is above 0.25 dB. With more, what has passed two edges ends at the third one (docs/decisions.md).
#[test]
#[ignore = "long: cargo xtask accept"]
fn nothing_begins_with_a_step_between_two_sheets_anywhere() {
    let mut draw = Uniform::new(1);
    let mut found = [Vec::new(), Vec::new()];
    for number in 0..36 {
        let mut within = |low: f64, high: f64| draw.between(low, high);
        let mut open = Mesh::shoebox([24.0, 20.0, 16.0], [VOID; 6]);
        open.vertices.iter_mut().for_each(|vertex| *vertex -= dvec3(8.0, 6.0, 7.0));
        let count = 2 + number % 3;
        let apart = 6.0 / f64::from(count - 1);
        for sheet in 0..count {
            let x = apart * f64::from(sheet) + within(-0.3, 0.3);
            let [y, z] = [within(0.5, 2.5), within(0.2, 1.2)];
            add_sheet(&mut open, x, [y, y + within(1.0, 3.0)], [z, z + within(0.8, 2.0)]);
        }
        let source = dvec3(within(0.5, 0.6), within(1.8, 2.6), within(0.8, 1.4));
        // Between two sheets, or behind the last.
        let x = 6.0 - apart * within(0.35, 0.65) + if number % 2 == 0 { 0.0 } else { apart };
        let ends = [dvec3(x, 0.3, within(0.6, 1.6)), dvec3(x + 0.1, 5.7, within(0.6, 1.6))];
        let [without, field] =
            [&[][..], &["diffraction"]].map(|effects| Field::new(open.clone(), 0.0, source, effects));
        let along = (ends[1] - ends[0]).normalize();
        let places: Vec<DVec3> = boundaries(&without, ends, 0..=2).into_iter().take(6).collect();
        found[usize::from(count > 2)].extend(steps(&field, &places, along));
    }
    let beyond = |steps: &[f64], limit: f64| steps.iter().filter(|step| **step > limit).count();
    let largest = found.each_ref().map(|steps| steps.iter().copied().fold(0.0, f64::max));
    for (steps, sheets) in found.iter().zip(["two sheets", "three and four"]) {
        println!("{sheets}: {} boundaries, above 0.1 dB {}", steps.len(), beyond(steps, 0.1));
    }
    println!("largest: {largest:?} dB");
    assert!(found[0].len() > 30 && largest[0] < 0.25 && largest[1] > 0.25, "{largest:?} dB");
}

/// What a corner of two rigid planes mirrors goes past an obstacle that stands in it as it goes from the image of the source in both past the four
/// images of that obstacle, which are one. What runs over an edge and its own image is left out: it matters where the obstacle is as large as the
/// wavelength.
#[test]
fn in_a_corner_stands_a_quarter() {
    let source = dvec3(-4.0, 0.9, 0.7);
    let moved = |mut mesh: Mesh, by: DVec3| {
        mesh.vertices.iter_mut().for_each(|vertex| *vertex -= by);
        mesh
    };
    let corner = || {
        moved(Mesh::shoebox([24.0, 20.0, 8.0], [VOID, VOID, FLOOR, VOID, FLOOR, VOID]), dvec3(12.0, 0.0, 0.0))
    };
    let open = || moved(Mesh::shoebox([24.0, 40.0, 16.0], [VOID; 6]), dvec3(12.0, 20.0, 8.0));
    let mut sheets = [corner(), open()];
    add_sheet(&mut sheets[0], 0.0, [0.0, 3.0], [0.0, 2.0]);
    add_sheet(&mut sheets[1], 0.0, [-3.0, 3.0], [-2.0, 2.0]);
    let places = [dvec3(3.0, 1.3, 0.6), dvec3(3.0, 2.2, 1.1), dvec3(1.6, 0.3, 0.2), dvec3(5.0, 2.2, 0.4)];
    let [corner, open] = sheets;
    let corner = Field { order: 3, ..Field::new(corner, 0.0, source, &["diffraction"]) };
    let heard_of_both = places.map(|place| {
        let of_both = arrivals(&corner, place).into_iter().filter(|arrival| arrival.order == 2);
        of_both.fold([0.0; BANDS], |sum, found| std::array::from_fn(|band| sum[band] + found.energy[band]))
    });
    let errors = |depth: f64| -> [f64; BANDS] {
        let open = Field::new(open.clone(), 0.0, dvec3(source.x, -source.y, -depth), &["diffraction"]);
        let whole = open.received(&places);
        std::array::from_fn(|band| {
            let error = |at: usize| (10.0 * (heard_of_both[at][band] / whole[at][band]).log10()).abs();
            (0..places.len()).map(error).fold(0.0, f64::max)
        })
    };
    let largest = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
    let found = errors(source.z);
    assert!(found[0] < 1.5 && found[1] < 0.5 && largest(&found[2..]) < 0.1, "{found:?} dB");
    let other = largest(&errors(source.z + 0.05));
    assert!(other > 0.5, "an image five centimetres lower is noticed: {other} dB");
}
