//! Images of three reflections and more end at edges as those of one and two do: nobody hears them begin, and in a corner of three planes
//! they are what goes past a whole obstacle of which an eighth stands there.

use glam::{DVec3, dvec3};
use sonel_geometry::Mesh;

use super::mirrored_edges::{BANDS, FLOOR, Field, VOID};
use super::twofold::{self, add_along_y, add_sheet, arrivals, boundaries, largest, steps};

/// Where images begin and end behind a thin barrier from wall to wall in a room that reflects nine tenths.
#[test]
fn later_images_begin_and_end_without_a_step() {
    let mut mesh = Mesh::shoebox([8.0, 6.0, 3.0], [FLOOR; 6]);
    add_along_y(&mut mesh, [0.0, 6.0], &[[3.6, 0.0], [3.6, 1.3]]);
    let field =
        |effects: &[&str]| Field { order: 4, ..Field::new(mesh.clone(), 0.1, twofold::SOURCE, effects) };
    let (without, with) = (field(&[]), field(&["diffraction"]));
    let ends = [dvec3(6.14, 2.95, 0.85), dvec3(6.16, 3.05, 2.15)];
    let along = (ends[1] - ends[0]).normalize();
    let places = boundaries(&without, ends, 3..=4);
    assert!(places.len() >= 10, "{}", places.len());
    for (place, step) in places.iter().zip(steps(&with, &places, along)) {
        assert!(step < 0.1, "{place}: {step} dB");
    }
    let known_wrong = largest(&without, &places, along);
    assert!(known_wrong > 0.3, "images begin at once without edges: {known_wrong} dB");
}

/// Largest difference of the levels of what three planes mirror past the top of a screen that stands in their corner from those past all of its images
/// in the open, at places in sight and in shadow, per band [dB].
fn errors(effects: &[&str]) -> [f64; BANDS] {
    let source = dvec3(-4.0, 0.9, 0.7);
    let moved = |mut mesh: Mesh, by: DVec3| {
        mesh.vertices.iter_mut().for_each(|vertex| *vertex -= by);
        mesh
    };
    let mut corner = moved(
        Mesh::shoebox([18.0, 12.0, 9.0], [FLOOR, VOID, FLOOR, VOID, FLOOR, VOID]),
        dvec3(6.0, 0.0, 0.0),
    );
    let mut open = moved(Mesh::shoebox([36.0, 24.0, 18.0], [VOID; 6]), dvec3(18.0, 12.0, 9.0));
    add_sheet(&mut corner, 0.0, [0.0, 11.0], [0.0, 6.0]);
    add_sheet(&mut open, 0.0, [-11.0, 11.0], [-6.0, 6.0]);
    let image = dvec3(-12.0 - source.x, -source.y, -source.z);
    let corner = Field { order: 3, ..Field::new(corner, 0.0, source, effects) };
    let open = Field::new(open, 0.0, image, &["diffraction"]);
    // In line with the top of the screen the places are 8.51 m high.
    let places = [8.2, 8.4, 8.5, 8.52, 8.6, 8.8].map(|z| dvec3(3.0, 1.3, z));
    let whole = open.heard(&places);
    let heard = places.map(|place| {
        let of_image = arrivals(&corner, place)
            .into_iter()
            .find(|arrival| (place + DVec3::from(arrival.towards) * arrival.length).distance(image) < 0.1);
        of_image.map_or(vec![0.0; BANDS], |arrival| arrival.energy)
    });
    std::array::from_fn(|band| {
        let error = |at: usize| (10.0 * (heard[at][band] / whole[at][band]).log10()).abs();
        (0..places.len()).map(error).fold(0.0, f64::max)
    })
}

#[test]
fn in_a_corner_of_three_planes_stands_an_eighth() {
    let found = errors(&["diffraction"]);
    assert!(found[0] < 0.6 && found[1..].iter().all(|&error| error < 0.35), "{found:?} dB");
    let cut_off = errors(&[]);
    assert!(cut_off.iter().all(|&error| error > 3.0), "without edges: {cut_off:?} dB");
}
