//! Receivers that cross the planes of the faces of sheets and solids, where one edge more or less is in sight: nothing may step.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};
use sonel_geometry::Mesh;
use sonel_testkit::analytic::free_field;
use sonel_testkit::uniform::Uniform;
use sonel_tests::meshes::{add, add_box, add_quad};

use super::diffraction::{heard, largest_change, open_scene, rendered, screen};

/// How far from the plane [m]: steps of 1 mm, and of a micrometre about the plane itself.
const OFFSETS: [f64; 9] = [-3.5e-3, -2.5e-3, -1.5e-3, -0.5e-3, -1e-6, 0.0, 1e-6, 0.5e-3, 1.5e-3];
/// Those next to the plane: what f32 cannot tell from it, in a room of 60 m, and beyond.
const CLOSE: [f64; 5] = [-3e-4, -1e-4, 0.0, 1e-4, 3e-4];

/// By how much the levels on either side of the plane differ [dB], each extrapolated to it by a parabola from where receivers do not yet hear what
/// is between both sides, 5 mm off it.
fn difference_of_sides(mesh: &Mesh, absorption: f64, source: DVec3, walk: (DVec3, DVec3)) -> f64 {
    let side = |sign: f64| {
        let offsets = [5.2e-3, 7.2e-3, 9.2e-3].map(|offset| sign * offset);
        let [a, b, c] = offsets;
        let shares = [b * c / ((a - b) * (a - c)), a * c / ((b - a) * (b - c)), a * b / ((c - a) * (c - b))];
        let energies = crossed(mesh, absorption, source, walk, &offsets);
        let level = |band: usize| -> f64 {
            energies.iter().zip(shares).map(|(energy, share)| share * 10.0 * energy[band].log10()).sum()
        };
        (0..energies[0].len()).map(level).collect::<Vec<f64>>()
    };
    let differences = side(-1.0).into_iter().zip(side(1.0)).map(|(below, above)| (below - above).abs());
    differences.fold(0.0, f64::max)
}

/// Energies at `offsets` [m] along `normal` from `at`.
fn crossed(
    mesh: &Mesh,
    absorption: f64,
    source: DVec3,
    (at, normal): (DVec3, DVec3),
    offsets: &[f64],
) -> Vec<Vec<f64>> {
    let receivers: Vec<[f64; 3]> = offsets.iter().map(|offset| (at + offset * normal).to_array()).collect();
    let scene = open_scene(mesh.clone(), absorption, source.to_array(), &receivers);
    heard(&rendered(scene), receivers.len())
}

/// A closed box in the middle of a room that swallows everything.
fn boxed(size: DVec3) -> Mesh {
    let mut mesh = Mesh::shoebox([60.0; 3], [1; 6]);
    mesh.vertices.iter_mut().for_each(|vertex| *vertex -= 30.0);
    add_box(&mut mesh, 0, DVec3::ZERO, size);
    mesh
}

/// The same scene with a sheet far away that has so many rims that nothing is diffracted more than once.
fn crowded(mut mesh: Mesh) -> Mesh {
    let corner = |at: u32| {
        let (sine, cosine) = (TAU * f64::from(at % 48) / 48.0).sin_cos();
        dvec3(25.0, 4.0 * cosine, 25.0 + 4.0 * sine)
    };
    for at in 0..48 {
        add(&mut mesh, 0, [dvec3(25.0, 0.0, 25.0), corner(at), corner(at + 1)]);
    }
    mesh
}

/// A sheet in the plane x = 0 of rectangles [[y, y], [z, z]].
fn pieces(rectangles: &[[[f64; 2]; 2]]) -> Mesh {
    let mut mesh = Mesh::default();
    for [y, z] in rectangles {
        let corner = |i: usize, j: usize| dvec3(0.0, y[i], z[j]);
        add_quad(&mut mesh, 0, [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]);
    }
    mesh
}

fn angled() -> Mesh {
    pieces(&[[[-1.0, 1.0], [-0.8, 0.0]], [[-1.0, 0.0], [0.0, 1.2]]])
}

fn forked() -> Mesh {
    pieces(&[[[-1.5, 1.5], [-0.8, -0.2]], [[-1.5, -0.6], [-0.2, 1.2]], [[0.8, 1.5], [-0.2, 0.9]]])
}

fn with_a_window() -> Mesh {
    pieces(&[
        [[-2.0, 2.0], [-1.5, -0.4]],
        [[-2.0, 2.0], [0.8, 2.0]],
        [[-2.0, -0.9], [-0.4, 0.8]],
        [[0.7, 2.0], [-0.4, 0.8]],
    ])
}

/// Off a thin rigid sheet the sound that it scatters is opposite on both sides, and none in its plane beside it: there it is as
/// if the sheet were not there, and a receiver that crosses the plane hears no step, beside a rim, a corner and a notch and in a window,
/// whatever the shape.
#[test]
fn the_plane_of_a_sheet_is_crossed_without_a_step() {
    let source = dvec3(-3.0, 0.2, 0.4);
    let beside = |width: f64| {
        let half = 0.5 * width;
        let places =
            [[0.1, 1.25], [0.9 * half, 1.4], [half + 0.1, 1.3], [half + 0.05, 0.3], [-half - 1.0, -0.5]];
        (screen([-half, half], [-0.8, 1.2]), places.to_vec())
    };
    let sheets = [
        beside(0.7),
        beside(2.5),
        beside(8.0),
        (angled(), vec![[-0.5, 1.25], [0.1, 0.1], [0.4, 0.6], [1.1, -0.3], [2.0, 1.5], [-1.3, 0.3]]),
        (forked(), vec![[0.1, -0.1], [0.2, 0.7], [0.7, 1.1], [1.0, 1.2], [2.3, 0.4], [-1.6, 1.4]]),
        (with_a_window(), vec![[0.0, 0.2], [0.65, 0.75], [-0.8, 0.0], [2.1, 0.3], [0.3, 2.3], [-2.4, -1.9]]),
    ];
    for (mesh, places) in sheets {
        for (place, absorption) in places.iter().flat_map(|place| [(place, 0.0), (place, 0.6)]) {
            let at = dvec3(0.0, place[0], place[1]);
            let energies = crossed(&mesh, absorption, source, (at, DVec3::X), &OFFSETS);
            let step = largest_change(&energies);
            let sides = difference_of_sides(&mesh, absorption, source, (at, DVec3::X));
            assert!(step < 0.1 && sides < 0.1, "α = {absorption}, {at}: {step}, both sides {sides} dB");
            let free = free_field(source.distance(at), 0.0);
            // Where sheets absorb, what they scatter is not opposite on both sides.
            for energy in energies[4..7].iter().flatten().filter(|_| absorption <= 0.0) {
                let off = 10.0 * (energy / free).log10();
                assert!(off.abs() < 0.1, "{at}: {off} dB off the free field");
            }
        }
    }
    let walk = (dvec3(0.0, -0.5, 1.25), DVec3::X);
    let sides = [angled(), crowded(angled())].map(|mesh| difference_of_sides(&mesh, 0.0, source, walk));
    assert!(
        sides[0] < 0.1 && sides[1] > 1.0,
        "without and with edges too many for second order: {sides:?} dB"
    );
}

/// About solids a receiver that crosses the plane of a face hears no step, in the plane itself and a micrometre off it neither, in sight
/// of the source and where nothing comes over less than two edges: what comes over the far edges goes on over the near ones.
#[test]
fn the_planes_of_a_box_are_crossed_without_a_step() {
    let mesh = boxed(dvec3(2.0, 1.0, 0.75));
    let sources = [dvec3(-2.0, 0.3, 2.0), dvec3(-1.5, -1.5, 0.4)];
    for (source, at, normal) in [
        (sources[0], dvec3(-0.3, 0.5, 0.75), DVec3::Z),
        (sources[0], dvec3(1.0, 1.2, 0.75), DVec3::Z),
        (sources[0], dvec3(1.0, 1.8, 0.75), DVec3::Z),
        (sources[0], dvec3(2.2, 1.2, 0.75), DVec3::Z),
        (sources[1], dvec3(2.2, 1.0, 0.25), DVec3::Y),
        (sources[1], dvec3(2.0, 1.2, 0.2), DVec3::X),
    ] {
        let step = largest_change(&crossed(&mesh, 0.0, source, (at, normal), &OFFSETS));
        let sides = difference_of_sides(&mesh, 0.0, source, (at, normal));
        assert!(step < 0.1 && sides < 0.1, "{source}, {at}: {step}, both sides {sides} dB");
    }
    let walk = (dvec3(2.5, 0.55, 0.75), DVec3::Z);
    let sides = [mesh.clone(), crowded(mesh)]
        .map(|mesh| difference_of_sides(&mesh, 0.0, dvec3(-1.5, 0.47, 0.7), walk));
    assert!(
        sides[0] < 0.1 && sides[1] > 1.0,
        "without and with edges too many for second order: {sides:?} dB"
    );
}

/// Where the source itself lies in the plane of a face, or on the line of an edge, all along the face would be for rounding to say: still
/// nothing begins at once, in that plane and in others.
#[test]
fn a_source_in_the_plane_of_a_face_makes_no_step() {
    let mesh = boxed(dvec3(2.0, 1.0, 0.75));
    for (source, at, normal) in [
        (dvec3(-2.0, 1.0, 0.4), dvec3(3.29, 1.0, 0.4), DVec3::Y),
        (dvec3(-2.0, 1.0, 0.4), dvec3(2.2934, 1.0, 0.8738), DVec3::Y),
        (dvec3(-2.0, 1.0, 0.4), dvec3(2.2, 0.4, 0.75), DVec3::Z),
        (dvec3(-1.5, -1.5, 0.75), dvec3(2.263, 0.7, 0.75), DVec3::Z),
        (dvec3(-2.0, 1.0, 0.75), dvec3(2.22, 1.0, 0.65), DVec3::Y),
        (dvec3(-2.0, 1.0, 0.75), dvec3(2.29, -0.29, 0.75), DVec3::Z),
    ] {
        let close = [-1.5e-4, -1.2e-4, -1.1e-4, -1e-4, -0.9e-4, 0.0, 1e-4, 1.1e-4, 1.2e-4, 1.5e-4];
        let step = largest_change(&crossed(&mesh, 0.6, source, (at, normal), &close));
        // What is heard right next to the plane is between both sides, which differ by what both forms lack beside corners.
        let sides = difference_of_sides(&mesh, 0.6, source, (at, normal));
        assert!(step < 0.1 && sides < 0.2, "{source}, {at}: {step}, both sides {sides} dB");
    }
}

/// Nor does a level change by much within a millimetre where the source is millimetres off the plane, behind the solid and above it, where no way
/// runs past a corner.
#[test]
fn a_source_beside_the_plane_of_a_face_makes_no_slope() {
    for size in [dvec3(2.0, 1.0, 0.75), dvec3(0.5, 0.5, 0.5), dvec3(1.5, 6.0, 2.5)] {
        let mesh = boxed(size);
        let middle = 0.45 * size.y;
        let walks = [
            (dvec3(size.x + 0.5, middle + 0.1, size.z), DVec3::Z),
            (dvec3(size.x + 0.2, middle, size.z), DVec3::Z),
            (dvec3(size.x, middle, size.z + 0.4), DVec3::X),
        ];
        for height in [-2e-3, 5e-4, 2e-3, 8e-3] {
            let source = dvec3(-1.5, middle + 0.02, size.z + height);
            for walk in walks {
                let step = largest_change(&crossed(&mesh, 0.0, source, walk, &OFFSETS));
                let sides = difference_of_sides(&mesh, 0.0, source, walk);
                assert!(step < 0.1 && sides < 0.1, "{size}, {source}, {}: {step}, {sides} dB", walk.0);
            }
        }
        let source = dvec3(-1.5, middle + 0.02, size.z + 2e-3);
        let sides = difference_of_sides(&crowded(mesh), 0.0, source, walks[0]);
        assert!(
            sides > 1.0,
            "what this test would find, where edges are too many for second order: {sides} dB"
        );
    }
}

/// Beside a solid, where ways run past its corners, a source within millimetres of a plane of it is heard differently above and below that: what
/// is between both is crossed slowly.
#[test]
fn beside_a_solid_a_grazed_plane_is_crossed_slowly() {
    for (size, source, place, sides) in [
        (dvec3(2.0, 1.0, 0.75), [-2.21891, 0.85417, 0.75035], [1.14866, -0.73952, 0.75], 0.3),
        (dvec3(1.5, 6.0, 2.5), [-1.19507, 5.40816, 2.50092], [2.55053, 6.36237, 2.5], 0.15),
        (dvec3(0.5, 0.5, 0.5), [-1.38073, -0.29703, 0.50055], [1.62768, 1.92685, 0.5], 0.15),
    ] {
        let walk = (DVec3::from(place), DVec3::Z);
        let change =
            |offsets: &[f64]| largest_change(&crossed(&boxed(size), 0.0, source.into(), walk, offsets));
        let step = change(&OFFSETS);
        assert!(step < 0.1, "{size}, {}: {step} dB", walk.0);
        let apart = change(&[-8e-3, 8e-3]);
        assert!(apart > sides, "{size}, {}: what is crossed, {apart} dB", walk.0);
    }
}

/// The same anywhere about a box, a wall and a board, nearer to the plane: where a field is all interference, it may change by more within
/// a millimetre.
#[test]
fn no_plane_of_a_solid_is_heard() {
    let mut random = Uniform::new(11);
    for size in [dvec3(2.0, 1.0, 0.75), dvec3(4.0, 0.3, 2.0), dvec3(1.2, 0.8, 0.03)] {
        let mesh = boxed(size);
        for source in [dvec3(-2.0, 0.31, 1.97), dvec3(-1.5, 0.13, 0.011), dvec3(-0.3, 0.1, -1.0)] {
            for place in 0..5 {
                let axis = place % 3;
                let mut at = DVec3::from_array([0; 3].map(|_| random.next_f64())) - 0.5;
                at = at * (size + 2.0) + 0.5 * size;
                at[axis] = if place % 2 == 0 { 0.0 } else { size[axis] };
                if at.distance(at.clamp(DVec3::ZERO, size)) > 0.05 {
                    let walk = (at, DVec3::AXES[axis]);
                    let step = largest_change(&crossed(&mesh, 0.6, source, walk, &CLOSE));
                    let sides = difference_of_sides(&mesh, 0.6, source, walk);
                    assert!(
                        step < 0.1 && sides < 0.1,
                        "{size}, {source}, {at}: {step}, both sides {sides} dB"
                    );
                }
            }
        }
    }
}
