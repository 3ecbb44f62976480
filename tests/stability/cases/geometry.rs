//! Geometry: rays at edges and vertices, meshes drawn badly, rooms of any size, anywhere.

use glam::{DVec3, Vec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::{Departure, Geometry, Mesh, Side};
use sonel_map::{Fate, Settings};
use sonel_renderer::{DiscreteArrival, Estimator, RenderSettings};
use sonel_scene::Scene;
use sonel_testkit::uniform::Uniform;
use sonel_testkit::z_test::{Estimate, Within, agree};
use sonel_tests::estimates::{Windows, agree_in_windows, windows};
use sonel_tests::meshes;
use sonel_tests::uneven_box::{BORDERS, SIZE, WILD};
use sonel_tests::{Traced, shipped};

use super::form;

/// Packets where those paths are asked for that do not depend on any.
const FEWEST: u64 = 32;
/// Largest standard error as a part of the energy in a window.
const LARGEST_ERROR: f64 = 0.03;

/// What is heard in the box of uneven walls drawn as `mesh`, and its image-source paths.
fn received(mesh: Mesh, seed: u64) -> (Vec<Windows>, Vec<DiscreteArrival>) {
    let scene = Scene { mesh, ..WILD.scene() };
    let with = |emissions| Traced::new(scene.clone(), Settings { emissions, seed, ..Settings::default() });
    let traced = with(form(40_000, 200_000));
    assert_eq!(traced.ledger.fates.count(Fate::Lost), 0);
    assert_eq!(traced.ledger.fates.count(Fate::Escaped), 0);
    let received = windows(&traced, RenderSettings::default(), &BORDERS).swap_remove(0);
    let chains = RenderSettings { mirror_order: Some(3), ..RenderSettings::default() };
    (received, with(FEWEST).render(chains).arrivals)
}

/// What differs between the box drawn well and drawn as `mesh`.
fn differences(mesh: Mesh) -> Vec<String> {
    let (well, chains) = received(Mesh::shoebox(SIZE, [0, 1, 2, 3, 4, 5]), 1);
    let (badly, found) = received(mesh, 2);
    let mut wrong = other_chains(&chains, &found);
    for (band, (well, badly)) in well.iter().zip(&badly).enumerate() {
        wrong.extend(agree_in_windows(badly, well, LARGEST_ERROR).err().map(|e| format!("band {band}: {e}")));
    }
    wrong
}

/// Image-source paths that are missing, or longer or louder by more than 1e-4.
fn other_chains(chains: &[DiscreteArrival], found: &[DiscreteArrival]) -> Vec<String> {
    let mut wrong = Vec::new();
    if chains.len() != found.len() {
        wrong.push(format!("{} image-source paths instead of {}", found.len(), chains.len()));
    }
    for (chain, found) in chains.iter().zip(found) {
        let energies = chain.energy.iter().zip(&found.energy);
        let worst = energies.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        if (chain.length / found.length - 1.0).abs() > 1e-4 || worst > 1e-4 {
            wrong.push(format!("{found:?} instead of {chain:?}"));
        }
    }
    wrong
}

fn box_of_walls() -> Mesh {
    Mesh::shoebox(SIZE, [0, 1, 2, 3, 4, 5])
}

fn sounds_like_the_box(mesh: Mesh) {
    let wrong = differences(mesh);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What [`Geometry::resolution`] is in the box [m].
fn resolution() -> f64 {
    f64::from(Geometry::build(box_of_walls()).expect("a box").resolution())
}

#[test]
fn winding_is_of_no_consequence() {
    sounds_like_the_box(meshes::turned_over(meshes::tessellated(&box_of_walls(), 2)));
}

#[test]
fn faces_drawn_twice_are_heard_once() {
    sounds_like_the_box(meshes::doubled(&box_of_walls()));
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn faces_overlapping_in_a_wall_are_heard_once() {
    sounds_like_the_box(meshes::overlapped(box_of_walls()));
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn needles_and_triangles_without_area_are_of_no_consequence() {
    for distance in [1e-2, 0.1 * resolution()] {
        sounds_like_the_box(meshes::needled(&box_of_walls(), distance));
    }
}

#[test]
fn t_junctions_are_of_no_consequence() {
    let mesh = meshes::divided(&box_of_walls(), |_, wall| wall % 2 == 0);
    sounds_like_the_box(meshes::divided(&mesh, |triangle, _| triangle % 3 == 0));
}

/// A second box that shares the wall x = 6 m and its corners: three faces meet in each of its four edges.
fn with_a_box_beside(mesh: Mesh) -> Mesh {
    let mut both = mesh;
    let corners = [dvec3(6.0, 0.0, 0.0), dvec3(6.0, 5.0, 0.0), dvec3(6.0, 5.0, 4.0), dvec3(6.0, 0.0, 4.0)];
    let far = corners.map(|corner| corner.with_x(9.0));
    for side in 0..4 {
        let next = (side + 1) % 4;
        meshes::add_quad(&mut both, 2, [corners[side], corners[next], far[next], far[side]]);
    }
    meshes::add_quad(&mut both, 2, far);
    both
}

/// The first box sounds as it does alone, in all its chains and in the energy of every band; in the second there is silence.
#[test]
fn edges_of_three_faces_keep_two_rooms_apart() {
    let (well, chains) = received(box_of_walls(), 1);
    let (beside, found) = received(with_a_box_beside(box_of_walls()), 2);
    let wrong = other_chains(&chains, &found);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // The errors of windows at the most add up.
    let all = |windows: &Windows| Estimate {
        value: windows.iter().map(|window| window.value).sum(),
        sigma: windows.iter().map(|window| window.sigma).sum(),
    };
    for (well, beside) in well.iter().zip(&beside) {
        let within = Within { sigmas: 4.0, maximal_sigma: LARGEST_ERROR * all(well).value };
        agree(all(beside), all(well), within).expect("the box alone");
    }
    let scene = Scene { mesh: with_a_box_beside(box_of_walls()), receivers: Vec::new(), ..WILD.scene() };
    let next_door = Traced::new(
        scene.with_receiver("next door", [7.5, 2.0, 2.0]),
        Settings { emissions: 1_000, ..Settings::default() },
    );
    assert_eq!(next_door.ledger.fates.count(Fate::Lost), 0);
    let rendering = next_door.render(RenderSettings::default());
    assert!(rendering.classes.iter().flat_map(|(_, energy)| energy).all(|energy| energy.abs() < 1e-300));
}

#[test]
fn cracks_below_the_tolerance_are_of_no_consequence() {
    sounds_like_the_box(meshes::cracked(&meshes::tessellated(&box_of_walls(), 2), 0.1 * resolution()));
}

/// Walls 1 cm apart: 0.98 ‰ of the surface is open, so that the room absorbs 0.4 % more and the energy of that share escapes.
#[test]
fn a_room_with_cracks_sounds_like_the_closed_one() {
    let closed = Mesh::shoebox([40.0, 30.0, 20.0], [0, 1, 2, 3, 4, 5]);
    let apart = meshes::walls_apart(&closed, 0.01);
    let traced = |mesh: &Mesh, seed: u64| {
        let bands = Bands::new(vec![500.0, 1000.0], BandWidth::Octave).expect("two octaves");
        let walls = Material::uniform("walls", 0.2, 0.3, bands.count());
        let scene = Scene::from_parts(mesh.clone(), vec![walls; 6], bands, 2.0)
            .without_air_attenuation()
            .with_source("stage", [8.0, 11.0, 3.0])
            .with_receiver("seat", [29.0, 17.0, 5.0]);
        Traced::new(scene, Settings { emissions: form(16_000, 100_000), seed, ..Settings::default() })
    };
    let (closed, cracked) = (traced(&closed, 1), traced(&apart, 2));
    assert!(cracked.geometry.is_closed_room() && cracked.geometry.diffracting_edges().count() == 0);
    let [well, badly] = [&closed, &cracked].map(|traced| {
        let borders = [0.0, 0.2, 0.5, 1.0, 2.0];
        windows(traced, RenderSettings::default(), &borders).swap_remove(0)
    });
    for (well, badly) in well.iter().zip(&badly) {
        agree_in_windows(badly, well, LARGEST_ERROR).expect("the closed room");
    }
    assert_eq!(cracked.ledger.fates.count(Fate::Lost), 0);
    assert_eq!(closed.ledger.fates.count(Fate::Escaped) + closed.ledger.fates.count(Fate::Lost), 0);
    for band in &cracked.ledger.bands {
        assert!(band.relative_residual() < 1e-9);
        // A thousandth of what arrives, which is 1/α of what is emitted. A crack of 14 mm shows its full width to few.
        let share = band.escaped / band.emitted;
        assert!((0.003..0.006).contains(&share), "{share}");
    }
}

/// The sibling of all of these: a wall that is another one by a tenth is heard.
#[test]
fn a_box_that_is_another_one_is_told_apart() {
    let mut mesh = box_of_walls();
    mesh.vertices.iter_mut().for_each(|vertex| vertex.z *= 1.1);
    assert!(differences(mesh).len() > 8);
}

/// Rays aimed at the edges and vertices of a mesh from points in its air that meet nothing, or the solid side of a closed
/// shell.
fn leaks(
    geometry: &Geometry,
    inside: &[DVec3],
    rays: u64,
    closest: impl Fn(Vec3, Vec3) -> Option<(u32, Side)>,
) -> u64 {
    let mut random = Uniform::new(13);
    let mesh = geometry.mesh();
    let mut leaks = 0;
    for ray in 0..rays {
        let from = geometry.to_local(inside[random.below(inside.len())]);
        let [a, b, _] = meshes::corners(mesh, random.below(mesh.triangles.len()));
        let along = if ray % 4 == 0 { 0.0 } else { random.next_f64() };
        let towards = (geometry.to_local(a.lerp(b, along)) - from).normalize();
        let in_air = closest(from, towards).is_some_and(|(triangle, side)| {
            side == Side::Front || !geometry.surface(geometry.triangle_surface(triangle)).closed
        });
        leaks += u64::from(!in_air);
    }
    leaks
}

/// Rooms and points in their air.
fn rooms() -> Vec<(&'static str, Mesh, Vec<DVec3>)> {
    let boxed = vec![dvec3(1.5, 1.2, 1.3), dvec3(4.2, 3.7, 2.1), dvec3(5.999, 4.999, 3.999)];
    let hall = shipped("hall");
    let seats = hall.receivers.iter().map(|receiver| receiver.position).collect();
    vec![
        ("box", box_of_walls(), boxed.clone()),
        ("tessellated box", meshes::tessellated(&box_of_walls(), 4), boxed.clone()),
        (
            "cracked box",
            meshes::cracked(&meshes::tessellated(&box_of_walls(), 4), 0.1 * resolution()),
            boxed.clone(),
        ),
        ("needles", meshes::needled(&meshes::tessellated(&box_of_walls(), 2), 1e-4), boxed),
        (
            "sphere",
            meshes::sphere(5.0, form(5, 7)),
            vec![DVec3::ZERO, dvec3(4.9, 0.3, 0.2), dvec3(1.0, -2.0, 3.0)],
        ),
        ("four sheets in one edge", pinwheel(), vec![dvec3(1.5, 1.2, 1.3), dvec3(4.2, 3.7, 2.1)]),
        ("hall", hall.mesh, seats),
    ]
}

/// The box with four sheets that meet in an upright edge in its middle, and two that meet in its ends.
fn pinwheel() -> Mesh {
    let mut mesh = box_of_walls();
    let [low, high] = [dvec3(3.0, 2.5, 1.0), dvec3(3.0, 2.5, 3.0)];
    for along in [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y] {
        meshes::add_quad(&mut mesh, 2, [low, low + along, high + along, high]);
        meshes::add(&mut mesh, 2, [high, high + along, high + 0.5 * along + 0.5 * DVec3::Z]);
    }
    mesh
}

#[test]
fn no_ray_slips_through_an_edge_or_a_vertex() {
    let mut rays = 0;
    for (name, mesh, inside) in rooms() {
        let geometry = Geometry::build(mesh).expect("a sound mesh");
        let count = form(50_000, 17_000_000);
        let closest = |from, towards| {
            geometry.closest_hit(Departure::free(from), towards).map(|hit| (hit.triangle, hit.side))
        };
        assert_eq!(leaks(&geometry, &inside, count, closest), 0, "{name}");
        rays += count;
    }
    println!("{rays} rays at edges and vertices, none lost");
}

/// The sibling: the same in `f32`, with strict comparisons and without looking at neighbours.
#[test]
fn a_leaky_triangle_test_is_found() {
    let (_, mesh, inside) = rooms().swap_remove(0);
    let geometry = Geometry::build(mesh).expect("a box");
    let local =
        |triangle: usize| meshes::corners(geometry.mesh(), triangle).map(|corner| geometry.to_local(corner));
    let closest = |from: Vec3, towards: Vec3| {
        let met = (0..geometry.mesh().triangles.len()).find(|&triangle| {
            let [a, b, c] = local(triangle).map(|corner| corner - from);
            [(a, b), (b, c), (c, a)].into_iter().all(|(a, b)| a.cross(b).dot(towards) < 0.0)
        });
        met.map(|triangle| (triangle as u32, Side::Front))
    };
    assert!(leaks(&geometry, &inside, 10_000, closest) > 100);
}

/// Packets live in all these rooms without any being lost.
#[test]
fn no_packet_is_lost() {
    let mut segments = 0;
    for (name, mesh, inside) in rooms() {
        let materials = if name == "hall" { shipped("hall").materials } else { WILD.scene().materials };
        let bands = if name == "hall" { shipped("hall").bands } else { WILD.scene().bands };
        let scene =
            Scene::from_parts(mesh, materials, bands, 2.0).with_source("source", inside[0].to_array());
        let geometry = scene.geometry().expect("a sound mesh");
        assert!(geometry.is_closed_room(), "{name}");
        let settings = Settings { emissions: form(1_000, 200_000), survival: 0.0, ..Settings::default() };
        let mut fates = sonel_map::Fates::default();
        let summary = sonel_tracer::Tracer::new(&scene, &geometry, settings)
            .run(sonel_map::ShardRange::WHOLE, |_| Ok::<(), sonel_tracer::TraceError>(()))
            .expect("a tight room");
        fates.add(&summary.fates);
        assert_eq!(fates.count(Fate::Lost) + fates.count(Fate::Escaped), 0, "{name}");
        assert!(summary.worst_residual() < 1e-9, "{name}: {}", summary.worst_residual());
        segments += summary.segments;
    }
    println!("{segments} segments traced, none lost");
}

/// The box of uneven walls `factor` times as large, with times that fit.
fn scaled(factor: f64) -> Scene {
    let mut scene = WILD.scene();
    scene.mesh.vertices.iter_mut().for_each(|vertex| *vertex *= factor);
    scene.sources.iter_mut().for_each(|source| source.position *= factor);
    scene.receivers.iter_mut().for_each(|receiver| receiver.position *= factor);
    scene.duration *= factor;
    scene
}

/// What is heard in it, levels and times scaled back.
fn heard_in_scaled(scene: Scene, factor: f64, seed: u64, estimator: Estimator) -> Vec<Windows> {
    let traced =
        Traced::new(scene, Settings { emissions: form(20_000, 200_000), seed, ..Settings::default() });
    assert_eq!(traced.ledger.fates.count(Fate::Lost), 0);
    let borders = BORDERS.map(|border| border * factor);
    let settings = RenderSettings { bin: 0.001 * factor, estimator, ..RenderSettings::default() };
    let mut received = windows(&traced, settings, &borders).swap_remove(0);
    for window in received.iter_mut().flatten() {
        window.value *= factor * factor;
        window.sigma *= factor * factor;
    }
    received
}

/// Largest relative deviation of any window.
fn worst(first: &[Windows], second: &[Windows]) -> f64 {
    let pairs = first.iter().flatten().zip(second.iter().flatten());
    pairs.map(|(first, second)| (first.value / second.value - 1.0).abs()).fold(0.0, f64::max)
}

/// By powers of two nothing is rounded: every length of the program scales with the scene, or it is an absolute one. From
/// a box of 6 mm to one of 25 km, by the estimators that draw no random numbers for a place.
#[test]
fn no_length_is_absolute() {
    let heard_in_scaled = |scene, factor| heard_in_scaled(scene, factor, 1, Estimator::Connection);
    let here = heard_in_scaled(scaled(1.0), 1.0);
    for exponent in [-10, 13] {
        let factor = 2.0_f64.powi(exponent);
        let deviation = worst(&here, &heard_in_scaled(scaled(factor), factor));
        println!("scaled by 2^{exponent}: {deviation:.1e}");
        assert!(deviation < 1e-9, "scaled by 2^{exponent}: {deviation:e}");
    }
    let mut with_air = scaled(2.0);
    with_air.air_attenuation.fill(1e-6);
    assert!(
        worst(&here, &heard_in_scaled(with_air, 2.0)) > 1e-6,
        "a millionth per metre is an absolute length"
    );
}

/// By other factors the scene is rounded anew, and the result is the same within its noise.
#[test]
fn a_room_may_have_any_size() {
    let here = heard_in_scaled(scaled(1.0), 1.0, 1, Estimator::Auto);
    for (factor, seed) in [(1e-3, 2), (1e4, 3)] {
        let there = heard_in_scaled(scaled(factor), factor, seed, Estimator::Auto);
        for (band, (here, there)) in here.iter().zip(&there).enumerate() {
            let outcome = agree_in_windows(there, here, LARGEST_ERROR);
            assert!(outcome.is_ok(), "scaled by {factor}, band {band}: {outcome:?}");
        }
    }
}

/// Image-source paths of the box turned by an odd angle and moved by `shift` [m] along each axis: largest deviation of a length
/// [m] and of an energy.
fn chains_moved_by(shift: f64) -> (f64, f64) {
    let turn = glam::DQuat::from_axis_angle(dvec3(0.48, 0.6, 0.64).normalize(), 0.7);
    let mut scene = WILD.scene();
    let place = |position: &mut DVec3| *position = turn * *position + shift;
    scene.mesh.vertices.iter_mut().for_each(place);
    scene.sources.iter_mut().map(|source| &mut source.position).for_each(place);
    scene.receivers.iter_mut().map(|receiver| &mut receiver.position).for_each(place);
    let arrivals = |scene: Scene| {
        let settings = RenderSettings { mirror_order: Some(4), ..RenderSettings::default() };
        Traced::new(scene, Settings { emissions: 64, ..Settings::default() }).render(settings).arrivals
    };
    let (here, there) = (arrivals(WILD.scene()), arrivals(scene));
    assert_eq!(here.len(), there.len());
    let (mut length, mut energy) = (0.0_f64, 0.0_f64);
    for (here, there) in here.iter().zip(&there) {
        assert_eq!(here.order, there.order);
        length = length.max((here.length - there.length).abs());
        for (here, there) in here.energy.iter().zip(&there.energy) {
            energy = energy.max((here / there - 1.0).abs());
        }
    }
    (length, energy)
}

/// A hundred kilometres away double precision leaves 0.015 nm of a coordinate.
#[test]
fn a_room_a_hundred_kilometres_away_has_the_same_mirror_chains() {
    let (length, energy) = chains_moved_by(1e5);
    println!("moved by 1e5 m and turned: lengths to {length:.1e} m, energies to {energy:.1e}");
    assert!(length < 1e-8 && energy < 1e-8, "{length:e} m, {energy:e}");
}

/// A closed slab of `thickness` [m] across the box at x = 3 m, from the floor to the ceiling and from wall to wall but
/// for a gap of 1 m, and the same as a sheet without thickness.
fn slab(thickness: Option<f64>) -> Mesh {
    let mut mesh = box_of_walls();
    let (low, high) = (dvec3(3.0, 1.0, 0.5), dvec3(3.0, 4.5, 3.5));
    match thickness {
        Some(thickness) => meshes::add_box(&mut mesh, 2, low, high + thickness * DVec3::X),
        None => meshes::add_quad(&mut mesh, 2, [low, low.with_y(high.y), high, low.with_z(high.z)]),
    }
    mesh
}

/// A slab thinner than its rounding becomes a sheet or stays a slab: in either case it is heard as one. The larger error of
/// the quick form is that of the shadow, where little arrives.
#[test]
#[ignore = "long: cargo xtask accept"]
fn panels_thinner_than_the_resolution_are_panels() {
    let emissions = form(30_000, 400_000);
    let received = |mesh: Mesh, seed: u64| {
        let traced =
            Traced::new(Scene { mesh, ..WILD.scene() }, Settings { emissions, seed, ..Settings::default() });
        assert_eq!(traced.ledger.fates.count(Fate::Lost), 0);
        let of_images = RenderSettings {
            estimator: Estimator::Connection,
            mirror_order: Some(2),
            ..RenderSettings::default()
        };
        let rendering = traced.render(of_images);
        assert!(rendering.arrivals.iter().all(|arrival| arrival.order > 0), "the direct sound is blocked");
        windows(&traced, RenderSettings::default(), &BORDERS).swap_remove(0)
    };
    let sheet = received(slab(None), 1);
    let slabs = [(0.01 * resolution(), 2), (resolution(), 3), (3.0 * resolution(), 4), (1e-4, 5)];
    for (thickness, seed) in slabs.into_iter().step_by(form(2, 1)) {
        for (band, (thin, sheet)) in received(slab(Some(thickness)), seed).iter().zip(&sheet).enumerate() {
            let outcome = agree_in_windows(thin, sheet, form(0.08, LARGEST_ERROR));
            assert!(outcome.is_ok(), "{thickness:e} m, band {band}: {outcome:?}");
        }
    }
}

/// Between two boxes: nothing gets into the inner one.
#[test]
fn sound_around_a_room_in_a_room_stays_outside() {
    let mut mesh = Mesh::shoebox(SIZE, [0; 6]);
    let (low, high) = (dvec3(1.0, 1.0, 1.0), dvec3(5.0, 4.0, 3.0));
    meshes::add_box(&mut mesh, 1, low, high);
    let source = [0.5, 0.5, 0.5];
    let scene = Scene { mesh, ..WILD.scene() };
    let geometry = scene.geometry().expect("a room");
    assert!(geometry.contains(source.into()) && !geometry.contains(dvec3(3.0, 2.0, 2.0)));
    assert!((geometry.volume().expect("a closed room") - (120.0 - 24.0)).abs() < 1e-9);
    let mut scene = scene;
    scene.sources[0].position = source.into();
    scene.receivers.clear();
    let traced = Traced::new(scene, Settings { emissions: form(5_000, 200_000), ..Settings::default() });
    assert_eq!(traced.ledger.fates.count(Fate::Lost), 0);
    let margin = 1e-4;
    traced.for_each_segment(|_, _, segment| {
        let middle = geometry.to_world(0.5 * (segment.start + segment.end));
        let inside = middle.cmpgt(low + margin).all() && middle.cmplt(high - margin).all();
        assert!(!inside, "{middle}");
    });
}
