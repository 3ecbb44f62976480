//! Edges that hide edges of other objects: what comes over the hidden one ends nowhere at once.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};
use sonel_geometry::Mesh;
use sonel_tests::meshes;

use super::mirrored_edges::{FLOOR, Field, OBSTACLE, SOURCE, VOID, hall};

/// The source in the open, where all is 2.5 m higher.
const HIGHER: DVec3 = dvec3(-4.0, -0.3, 3.4);

/// Adds a sheet 6 m wide in the plane of `x`, its lower end tilted by `tilt` [rad].
fn add_sheet(mesh: &mut Mesh, x: f64, [low, high]: [f64; 2], tilt: f64) {
    let lower = |y: f64| [y, low + tilt * y];
    let corners = [lower(-3.0), lower(3.0), [3.0, high], [-3.0, high]].map(|[y, z]| dvec3(x, y, z));
    meshes::add_quad(mesh, OBSTACLE, corners);
}

/// Two screens one behind the other.
fn screens(tilt: f64) -> Mesh {
    let mut mesh = hall(VOID);
    add_sheet(&mut mesh, 0.0, [3.0, 5.0], 0.0);
    add_sheet(&mut mesh, 2.0, [2.7, 4.5], tilt);
    mesh
}

/// Strips about a cylinder, whose rims all see one another: more pairs than are followed.
fn add_crowd(mesh: &mut Mesh) {
    for strip in 0..26 {
        let [one, other] = [0.0, 0.3].map(|share| {
            let (sine, cosine) = (TAU * (f64::from(strip) + share) / 26.0).sin_cos();
            [-8.0 + 1.5 * cosine, 4.0 + 1.5 * sine]
        });
        let corner = |[x, z]: [f64; 2], y: f64| dvec3(x, y, z);
        let corners = [corner(one, -7.0), corner(one, -6.0), corner(other, -6.0), corner(other, -7.0)];
        meshes::add_quad(mesh, OBSTACLE, corners);
    }
}

/// Where the plane through two edges (x, z) is at the height `z`.
fn in_line([one, other]: [[f64; 2]; 2], z: f64) -> DVec3 {
    dvec3(other[0] + (other[0] - one[0]) * (z - other[1]) / (other[1] - one[1]), 0.4, z)
}

/// A receiver crosses the plane through an edge and one of another object that hides it: two screens in the open and on a floor, edges that
/// are all but parallel, two boxes of which one edge is shaded itself, and a box above a floor with its image.
#[test]
fn an_edge_that_hides_another_is_passed_without_a_step() {
    let lower = [[0.0, 3.0], [2.0, 2.7]];
    let below = in_line(lower, 2.0);
    let across = [below, in_line([[0.0, 5.0], [2.0, 2.7]], 2.0), in_line([[0.0, 3.0], [2.0, 4.5]], 6.1)];
    let mut on_floor = hall(FLOOR);
    add_sheet(&mut on_floor, 0.0, [0.0, 2.0], 0.0);
    add_sheet(&mut on_floor, 2.0, [0.0, 1.6], 0.0);
    let over_an_image = [in_line([[0.0, -2.0], [2.0, 1.6]], 2.64)];
    let past_the_shaded = [in_line([[0.8, 4.0], [2.0, 3.3]], 2.0)];
    let mut above = hall(FLOOR);
    meshes::add_box(&mut above, OBSTACLE, dvec3(0.0, -3.0, 1.1), dvec3(0.8, 3.0, 2.0));
    let past_the_image = [in_line([[0.0, -1.1], [0.8, 1.1]], 2.64)];
    for (name, mesh, source, places) in [
        ("screens", screens(0.0), HIGHER, &across[..]),
        ("nearly parallel", screens(1e-4), HIGHER, &[below]),
        ("screens on a floor", on_floor, SOURCE, &over_an_image),
        ("boxes", boxes(), HIGHER, &past_the_shaded),
        ("a box above a floor", above, SOURCE, &past_the_image),
    ] {
        for absorption in [0.0, 0.6] {
            let field = Field::new(mesh.clone(), absorption, source, &["diffraction"]);
            for &place in places {
                let step = field.largest_step(place, DVec3::X);
                assert!(step < 0.1, "{name}, α = {absorption}, {place}: {step} dB");
            }
        }
    }
    let mut crowded = screens(0.0);
    add_crowd(&mut crowded);
    let step = Field::new(crowded, 0.0, HIGHER, &["diffraction"]).largest_step(below, DVec3::X);
    assert!(step > 1.0, "what this test would find, where pairs are too many: {step} dB");
}

/// A source does so, and is heard as a receiver there would hear it.
#[test]
fn a_source_that_is_hidden_is_heard_as_a_receiver_hears() {
    let below = in_line([[0.0, 3.0], [2.0, 2.7]], 2.0);
    let places = [-5e-4, -1e-5, 1e-5, 5e-4].map(|offset| below + offset * DVec3::X);
    let there = Field::new(screens(0.0), 0.0, HIGHER, &["diffraction"]).heard(&places);
    let from = |place| Field::new(screens(0.0), 0.0, place, &["diffraction"]);
    for (there, back) in there.iter().zip(places.map(|place| from(place).heard(&[HIGHER])[0])) {
        for (there, back) in there.iter().zip(back) {
            assert!((there / back - 1.0).abs() < 1e-3, "{there} {back}");
        }
    }
}

/// Two boxes in the open, one behind the other, the second one narrower and higher.
fn boxes() -> Mesh {
    let mut mesh = hall(VOID);
    meshes::add_box(&mut mesh, OBSTACLE, dvec3(0.0, -3.0, 3.1), dvec3(0.8, 3.0, 4.0));
    meshes::add_box(&mut mesh, OBSTACLE, dvec3(2.0, -2.0, 3.3), dvec3(2.6, 3.0, 4.4));
    mesh
}

/// `distance` [m] beyond the second of two edges (x, z), in the plane through both, and straight out of that plane.
fn beyond([one, other]: [[f64; 2]; 2], distance: f64) -> (DVec3, DVec3) {
    let along = dvec3(other[0] - one[0], 0.0, other[1] - one[1]).normalize();
    (dvec3(other[0], 0.4, other[1]) + along * distance, DVec3::Y.cross(along))
}

/// Where no way goes on over both edges, what comes over the hidden one falls to nothing before it is hidden: over corners and over three edges of
/// a solid, over edges that see one another in places only, and where there are too many ways. In the planes of the faces of
/// two boxes, before, between and behind them, and in line with their edges; behind two screens, on a floor and in the open.
#[test]
fn what_goes_on_over_no_edge_ends_before_it_is_hidden() {
    let tops = [[[0.0, 4.0], [0.8, 4.0]], [[2.0, 4.4], [2.6, 4.4]]];
    let [first, second] = tops;
    let about_boxes = [
        beyond(first, 0.3),
        beyond(first, 1.0),
        beyond([first[1], first[0]], 0.3),
        beyond(second, 0.3),
        beyond(second, 1.0),
        beyond(second, 3.5),
        beyond([second[1], second[0]], 0.3),
        beyond([first[1], second[0]], 1.0),
        beyond([[0.8, 3.1], [2.6, 3.3]], 0.3),
        beyond([[0.8, 3.1], [2.6, 3.3]], 2.0),
    ];
    let mut on_floor = hall(FLOOR);
    add_sheet(&mut on_floor, 0.0, [0.0, 2.0], 0.0);
    add_sheet(&mut on_floor, 2.0, [0.0, 1.6], 0.0);
    let over_both = [0.3, 1.0, 2.0].map(|distance| beyond([[0.0, 2.0], [2.0, 1.6]], distance));
    let past_both = [0.3, 1.0].map(|distance| beyond([[0.0, 5.0], [2.0, 4.5]], distance));
    for (name, mesh, source, places) in [
        ("boxes", boxes(), HIGHER, &about_boxes[..]),
        ("screens on a floor", on_floor.clone(), SOURCE, &over_both),
        ("screens on a floor, a low source", on_floor, SOURCE.with_z(0.3), &over_both),
        ("screens", screens(0.0), HIGHER, &past_both),
    ] {
        let field = Field::new(mesh, 0.0, source, &["diffraction"]);
        for &(place, along) in places {
            let step = field.largest_step(place, along);
            assert!(step < 0.1, "{name}, {place}: {step} dB");
        }
    }
}

/// An edge that another object mirrors goes out of sight behind an edge of its own object, or beyond the border of the mirror; and what is seen
/// of an edge shrinks to nothing at its end. The source is behind the mirrors.
#[test]
fn images_of_edges_go_out_of_sight_without_a_step() {
    let mut on_floor = hall(FLOOR);
    add_sheet(&mut on_floor, 0.0, [0.0, 2.0], 0.0);
    add_sheet(&mut on_floor, 2.0, [0.0, 1.6], 0.0);
    let about_boxes = [
        beyond([[-0.4, 4.4], [2.0, 3.3]], 1.0),
        beyond([[-0.4, 4.4], [2.0, 3.3]], 2.8),
        beyond([[4.0, 4.0], [2.0, 4.4]], 0.6),
        // The upper side of the first box, mirrored in the second one and in its own rear.
        (dvec3(1.4, 0.4, 3.953), DVec3::Z),
    ];
    let behind_screens = [
        beyond([[-2.0, 2.7], [2.0, 4.5]], 1.1),
        beyond([[4.0, 5.0], [2.0, 4.5]], 1.0),
        // The lower edge of the first screen, mirrored in both, over the upper one of the second.
        (dvec3(3.0, 0.4, 4.7625), DVec3::Z),
        (dvec3(3.0, 0.4, 4.807), DVec3::Z),
    ];
    // The upper ends of the upright edges and of their images, seen over the second screen.
    let over_the_second = [(dvec3(3.0, 0.4, 1.4556), DVec3::Z), (dvec3(3.0, 0.4, 1.511), DVec3::Z)];
    for (name, mesh, source, places) in [
        ("boxes", boxes(), HIGHER, &about_boxes[..]),
        ("screens", screens(0.0), HIGHER, &behind_screens),
        ("screens on a floor", on_floor, SOURCE, &over_the_second),
    ] {
        let field = Field::new(mesh, 0.0, source, &["diffraction"]);
        for &(place, along) in places {
            let step = field.largest_step(place, along);
            assert!(step < 0.1, "{name}, {place}: {step} dB");
        }
    }
}

/// Receivers that see an edge past the end of another one, near the plane of a face that goes on over an edge across: what they hear over both completes
/// what is hidden, and fades in the plane. In the plane of a screen, beside it.
/// Where a rear edge goes out of sight beside that end, of which nobody can tell in the plane itself how much is seen; and deep in the shadow of two
/// screens, where what the ends of an edge send is as loud as what comes over it, and rotates with ways of its own.
#[test]
fn beside_the_ends_of_edges_nothing_steps() {
    let past_the_end = [[2.5, 3.1, 4.5], [2.5, 3.3, 4.5], [2.5, 3.6, 4.5], [3.0, 3.6, 4.6], [3.5, 3.2, 4.7]];
    let beside_a_screen = [[2.0, 3.5, 3.6]];
    for (name, mesh, places) in
        [("boxes", boxes(), &past_the_end[..]), ("screens", screens(0.0), &beside_a_screen)]
    {
        let field = Field::new(mesh, 0.0, HIGHER, &["diffraction"]);
        for &place in places {
            let step = field.largest_step(place.into(), DVec3::X);
            assert!(step < 0.1, "{name}, {place:?}: {step} dB");
        }
    }
    let mut on_floor = hall(FLOOR);
    add_sheet(&mut on_floor, 0.0, [0.0, 2.0], 0.0);
    add_sheet(&mut on_floor, 2.0, [0.0, 1.6], 0.0);
    let past_the_rear = dvec3(4.304572517635998, 5.348196016637381, 5.168190839212);
    let in_deep_shadow = dvec3(6.487189, -0.39861, 0.702562);
    for (name, mesh, source, place, along) in [
        ("boxes", boxes(), HIGHER, past_the_rear, dvec3(-1.0, 0.0, 3.0)),
        ("screens on a floor", on_floor, SOURCE, in_deep_shadow, dvec3(1.0, 0.0, 5.0)),
    ] {
        let step = Field::new(mesh, 0.0, source, &["diffraction"]).largest_step(place, along.normalize());
        assert!(step < 0.1, "{name}, {place}: {step} dB");
    }
}

/// A box above an open floor.
fn above_a_floor() -> Mesh {
    let mut mesh = hall(FLOOR);
    meshes::add_box(&mut mesh, OBSTACLE, dvec3(0.0, -3.0, 1.1), dvec3(0.8, 3.0, 2.0));
    mesh
}

/// The top of a box would show the source where the floor and then its underside do. Neither image is the other one: a receiver in the second one
/// hears what it does where the source is a little lower, and loses it without a step.
#[test]
fn images_in_one_place_are_told_apart_by_their_mirrors() {
    let from = |height| Field::new(above_a_floor(), 0.0, SOURCE.with_z(height), &["diffraction"]);
    let (bottom, top) = (1.1, 2.0);
    let field = from(top - bottom);
    for height in [0.3499, 0.5986, 0.8082] {
        let place = dvec3(1.5, 0.4, height);
        let step = field.largest_step(place, DVec3::Z);
        assert!(step < 0.02, "{place}: {step} dB");
        let heard = |field: &Field| field.heard(&[place])[0];
        let change = |other: f64| {
            let pairs = heard(&field).into_iter().zip(heard(&from(top - bottom - other)));
            pairs.map(|(one, other)| (10.0 * (one / other).log10()).abs()).fold(0.0, f64::max)
        };
        assert!(
            change(1e-3) < 0.05 && change(0.05) > 0.1,
            "{place}: {} dB, {} dB",
            change(1e-3),
            change(0.05)
        );
    }
}

/// Receivers that cross the planes of faces beside objects: where another object hides part of the last edge of the face, beyond the corner of a face or
/// screen, above a floor, in the plane in which faces of both boxes lie, where what is on either side of it is far from the same, and in both
/// planes where that crosses another one.
#[test]
fn planes_of_faces_are_crossed_without_a_step() {
    let beside_what_is_hidden = [([2.36556, 3.28716, 4.0], DVec3::Z), ([3.12643, 3.96699, 4.0], DVec3::Z)];
    let beyond_a_corner = [([2.0, 4.84676, 6.58348], DVec3::X), ([-0.2863, 3.92962, 4.0], DVec3::Z)];
    let of_both = [[5.19683, 3.0, 3.77601], [6.70526, 3.0, 3.80406], [3.83034, 3.0, 3.61557]];
    let between_both = [[1.60675, 3.0, 4.5441], [1.30686, 3.0, 3.31694]];
    let of_both: Vec<_> = of_both.into_iter().chain(between_both).map(|place| (place, DVec3::Y)).collect();
    let where_planes_cross = [([5.19683, 3.003, 4.0], DVec3::Z), ([5.19683, 3.0, 4.002], DVec3::Y)];
    let about_boxes = [&beside_what_is_hidden[..], &beyond_a_corner, &of_both, &where_planes_cross].concat();
    let about_screens = [([2.0, -3.70296, 0.3722], DVec3::X), ([5.1579, 3.0, 3.80406], DVec3::Y)];
    let over_the_corner = [([0.0, 4.106248, 3.446326], DVec3::X)];
    for (name, mesh, source, places) in [
        ("boxes", boxes(), HIGHER, &about_boxes[..]),
        ("screens", screens(0.0), HIGHER, &about_screens),
        ("a box above a floor", above_a_floor(), SOURCE, &over_the_corner),
    ] {
        let field = Field::new(mesh, 0.0, source, &["diffraction"]);
        for &(place, along) in places {
            let step = field.largest_step(place.into(), along);
            assert!(step < 0.1, "{name}, {place:?}: {step} dB");
        }
    }
    let field = Field::new(boxes(), 0.0, HIGHER, &["diffraction"]);
    let (place, along) = of_both[0];
    let sides = field.heard(&[-0.03, 0.03].map(|offset| DVec3::from(place) + offset * along));
    let apart = sides[0].iter().zip(sides[1]).map(|(one, other)| (10.0 * (one / other).log10()).abs());
    let largest = apart.fold(0.0, f64::max);
    assert!(largest > 1.0, "what is crossed in five centimetres: {largest} dB");
}
