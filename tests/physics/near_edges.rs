//! Scenes of too many planes and edges to unfold all of them: images end at the edges near each path, and nobody hears them begin there either.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};
use sonel_geometry::Mesh;
use sonel_tests::meshes;

use super::mirrored_edges::{self, FLOOR, Field, OBSTACLE, VOID};
use super::twofold::{SOURCE, add_along_y, add_sheet, boundaries, largest, steps};

/// The same scene with a disc out of sight of so many rims that the room is unfolded near each path.
fn crowded(mut mesh: Mesh) -> Mesh {
    let middle = dvec3(4.0, -3.0, 1.0);
    let rim = |at: u32| {
        let (sine, cosine) = (TAU * f64::from(at % 400) / 400.0).sin_cos();
        middle + dvec3(cosine, 0.0, sine)
    };
    for at in 0..400 {
        meshes::add(&mut mesh, VOID, [middle, rim(at), rim(at + 1)]);
    }
    mesh
}

fn room() -> Mesh {
    Mesh::shoebox([8.0, 6.0, 3.0], [FLOOR; 6])
}

/// Largest difference of any band between two fields at `places` [dB].
fn difference(fields: [&Field; 2], places: &[DVec3]) -> f64 {
    let [one, other] = fields.map(|field| field.heard(places));
    let pairs = one.iter().zip(&other).flat_map(|(one, other)| one.iter().zip(other));
    pairs.map(|(one, other)| (10.0 * (one / other).log10()).abs()).fold(0.0, f64::max)
}

/// Images of one reflection and of two about a barrier, a hanging sheet and a box.
#[test]
fn images_in_a_crowded_room_begin_and_end_without_a_step() {
    let [mut thin, mut hanging, mut solid] = [room(), room(), room()];
    add_along_y(&mut thin, [0.0, 6.0], &[[3.6, 0.0], [3.6, 1.3]]);
    add_sheet(&mut hanging, 3.6, [1.6, 4.1], [1.0, 2.2]);
    mirrored_edges::add_standing_box(&mut solid, dvec3(3.6, 1.6, 0.0), dvec3(4.3, 4.1, 1.3));
    let upwards = [dvec3(6.13, 2.9, 0.2), dvec3(6.17, 3.1, 2.8)];
    let across = [dvec3(5.2, 0.3, 1.05), dvec3(5.3, 5.7, 1.15)];
    for (name, mesh, absorption, ends) in [
        ("a thin barrier", thin, 0.6, upwards),
        ("a hanging sheet", hanging, 0.0, across),
        ("a box", solid, 0.0, across),
    ] {
        let mesh = crowded(mesh);
        let without = Field::new(mesh.clone(), absorption, SOURCE, &[]);
        let field = Field::new(mesh, absorption, SOURCE, &["diffraction"]);
        let along = (ends[1] - ends[0]).normalize();
        let places = boundaries(&without, ends, 1..=2);
        assert!(places.len() >= 3, "{name}: {}", places.len());
        for (&place, step) in places.iter().zip(steps(&field, &places, along)) {
            assert!(step < 0.1, "{name}, α = {absorption}, {place}: {step} dB");
        }
        let known_wrong = largest(&without, &places, along);
        assert!(known_wrong > 0.15, "{name}: images begin at once without edges: {known_wrong} dB");
    }
}

/// What is next to a path is a part of what changes it: what is farther off is missing, and second order.
#[test]
fn a_crowded_room_sounds_as_it_does_alone() {
    let mut mesh = room();
    add_sheet(&mut mesh, 3.6, [1.6, 4.1], [1.0, 2.2]);
    let places = [dvec3(5.2, 1.2, 1.05), dvec3(6.1, 2.9, 0.6), dvec3(6.2, 3.1, 2.1), dvec3(5.3, 5.0, 1.2)];
    let [without, alone] =
        [&[][..], &["diffraction"]].map(|effects| Field::new(mesh.clone(), 0.3, SOURCE, effects));
    let crowded = Field::new(crowded(mesh), 0.3, SOURCE, &["diffraction"]);
    let [found, known_wrong] = [&crowded, &without].map(|field| difference([field, &alone], &places));
    assert!(found < 1.8, "{found} dB");
    assert!(known_wrong > 2.5, "without edges: {known_wrong} dB");
}

/// A floor of two materials is one plane. What it mirrors past a screen is as strong as the floor is there, and so is what completes it.
#[test]
fn a_plane_of_two_materials_mirrors_as_it_does_at_the_foot() {
    let mut mesh = Mesh::shoebox([24.0, 20.0, 8.0], [VOID; 6]);
    mesh.vertices.iter_mut().for_each(|vertex| *vertex -= dvec3(12.0, 10.0, 0.5));
    let mut add_floor = |material: u32, x: [f64; 2]| {
        let corners = [[x[0], -9.0], [x[1], -9.0], [x[1], 9.0], [x[0], 9.0]];
        meshes::add_quad(&mut mesh, material, corners.map(|[x, y]| dvec3(x, y, 0.0)));
    };
    add_floor(FLOOR, [2.0, 11.0]);
    add_floor(OBSTACLE, [-11.0, 2.0]);
    add_sheet(&mut mesh, 1.0, [-3.0, 3.0], [0.6, 2.0]);
    let source = dvec3(-4.0, 0.2, 0.9);
    let ends = [dvec3(4.0, 0.4, 0.5), dvec3(4.02, 0.45, 3.9)];
    let along = (ends[1] - ends[0]).normalize();
    let [without, field] =
        [&[][..], &["diffraction"]].map(|effects| Field::of(mesh.clone(), [0.0, 0.8], source, effects));
    let places = boundaries(&without, ends, 1..=1);
    assert!(places.len() >= 2, "{places:?}");
    let [found, known_wrong] = [&field, &without].map(|field| largest(field, &places, along));
    assert!(found < 0.1, "{found} dB");
    assert!(known_wrong > 1.0, "the image begins at once without edges: {known_wrong} dB");
}
