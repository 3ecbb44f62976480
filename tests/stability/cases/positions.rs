//! Positions: on walls, in corners, at edges and shadow boundaries, at images, inside and outside.

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::{Fate, Settings};
use sonel_renderer::{Estimator, PathClass, ReceiverPoint, RenderSettings, Renderer, Rendering};
use sonel_scene::{Receiver, Scene};
use sonel_testkit::analytic::specular_box::SpecularBox;
use sonel_tests::{Traced, meshes};

use super::form;

const SIZE: [f64; 3] = [6.0, 5.0, 4.0];
const SOURCE: [f64; 3] = [1.5, 1.2, 1.3];
const SPEED: f64 = 343.0;
/// The free screen stands in the plane x = 3 m between these corners.
const SCREEN: [DVec3; 2] = [dvec3(3.0, 1.0, 0.0), dvec3(3.0, 3.5, 2.5)];

/// A box of α 0.3 and `scattering`, with a screen or without.
fn room(scattering: f64, screen: bool) -> Scene {
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave");
    let mut mesh = Mesh::shoebox(SIZE, [0; 6]);
    if screen {
        let [low, high] = SCREEN;
        meshes::add_quad(&mut mesh, 0, [low, low.with_y(high.y), high, low.with_z(high.z)]);
    }
    let mut scene = Scene::from_parts(mesh, vec![Material::uniform("walls", 0.3, scattering, 1)], bands, 0.2)
        .with_source("source", SOURCE)
        .without_air_attenuation();
    scene.speed_of_sound = SPEED;
    scene
}

fn traced(scene: Scene) -> Traced {
    Traced::new(scene, Settings { emissions: form(1_000, 50_000), ..Settings::default() })
}

/// Renders `traced` at one position, or says why not.
fn at(traced: &Traced, position: DVec3, settings: RenderSettings) -> Result<Rendering, String> {
    received(&traced.renderer(settings), position)
}

fn received(renderer: &Renderer<'_>, position: DVec3) -> Result<Rendering, String> {
    let receiver = ReceiverPoint::omni("here", position);
    let borders = [vec![0.0, 0.05, 0.2]];
    renderer.render(0, &[receiver], &borders).map_err(|error| error.to_string())
}

/// The image of the source in the screen: nothing of infinite loudness stands there.
fn image_in_screen() -> DVec3 {
    DVec3::from(SOURCE).with_x(2.0 * SCREEN[0].x - SOURCE[0])
}

/// A point behind the screen on the line from the source over its upper edge.
fn on_shadow_boundary() -> DVec3 {
    let edge = dvec3(3.0, 2.0, 2.5);
    edge + (edge - DVec3::from(SOURCE)).normalize()
}

/// Where no receiver would be put on purpose.
fn places() -> Vec<(&'static str, DVec3)> {
    let [_, top] = SCREEN;
    vec![
        ("on a wall", dvec3(0.0, 2.0, 1.7)),
        ("on an edge of the room", dvec3(6.0, 0.0, 1.7)),
        ("in a corner", dvec3(6.0, 0.0, 4.0)),
        ("a micrometre from a wall", dvec3(1e-6, 2.0, 1.7)),
        ("a micrometre from an edge", dvec3(6.0 - 1e-6, 1e-6, 1.7)),
        ("a micrometre from a corner", dvec3(6.0 - 1e-6, 1e-6, 4.0 - 1e-6)),
        ("a tenth of a millimetre from a wall", dvec3(1e-4, 2.0, 1.7)),
        ("on the screen", dvec3(3.0, 2.0, 1.7)),
        ("on the screen's edge", dvec3(3.0, 2.0, 2.5)),
        ("on the screen's corner", top),
        ("a micrometre from the screen", dvec3(3.0 + 1e-6, 2.0, 1.7)),
        ("on the shadow boundary", on_shadow_boundary()),
        ("at the source's image in the screen", image_in_screen()),
        ("in the plane of the screen", dvec3(3.0, 4.5, 1.7)),
        ("below the source, face to face", dvec3(1.5, 1.2, 1e-4)),
        ("next to the source", DVec3::from(SOURCE) + dvec3(1e-4, 0.0, 0.0)),
    ]
}

/// Every place is refused with a reason or has finite energies, by every estimator.
#[test]
fn every_place_is_heard_or_refused() {
    let traced = traced(room(0.5, true));
    let mut refused = Vec::new();
    for estimator in Estimator::COMPARABLE {
        let mirror_order = form(Some(4), None);
        let settings = RenderSettings {
            estimator,
            rays: Some(form(256, 1_024)),
            mirror_order,
            ..RenderSettings::default()
        };
        let renderer = traced.renderer(settings);
        for (place, position) in places() {
            match received(&renderer, position) {
                Ok(rendering) => {
                    let energies: Vec<f64> = (0..200).map(|bin| rendering.total.get(0, bin, 0)).collect();
                    let sound = energies.iter().all(|energy| energy.is_finite() && *energy >= 0.0);
                    assert!(sound, "{place}, {estimator:?}: {energies:?}");
                    assert!(energies.iter().sum::<f64>() > 0.0, "{place}, {estimator:?}: silence");
                }
                Err(reason) => refused.push(format!("{place}: {reason}")),
            }
        }
    }
    refused.sort();
    refused.dedup();
    println!("refused:\n  {}", refused.join("\n  "));
    let reasons = ["from a surface, at least", "outside the room"];
    let has_reason = |refused: &String| reasons.iter().any(|reason| refused.contains(reason));
    assert!(refused.iter().all(has_reason) && refused.len() < places().len(), "{refused:?}");
}

/// At the source, outside the room and beyond numbers: refused by name.
#[test]
fn impossible_places_are_refused() {
    let traced = traced(room(0.5, true));
    for (position, words) in [
        (DVec3::from(SOURCE), "is at source"),
        (DVec3::from(SOURCE) + 1e-9, "is at source"),
        (dvec3(-1e-3, 2.0, 1.7), "outside the room"),
        (dvec3(7.0, 2.0, 1.7), "outside the room, 1.0000 m from its nearest surface"),
        (dvec3(f64::NAN, 2.0, 1.7), "not finite"),
    ] {
        let reason = at(&traced, position, RenderSettings::default()).expect_err("impossible");
        assert!(reason.contains(words), "{position}: {reason}");
    }
}

/// Image-source paths up to order 3 at `receiver` that deviate from the images of the box by more than 1e-5; `as_tree` hides a
/// speck in a corner, which makes the box a geometry like any other.
fn wrong_chains(source: [f64; 3], receiver: [f64; 3], as_tree: bool, reflection: f64) -> Vec<String> {
    let mut scene = room(0.0, false);
    if as_tree {
        let speck = dvec3(5.97, 4.97, 3.97);
        meshes::add(&mut scene.mesh, 0, [speck, speck + 0.005 * DVec3::X, speck + 0.005 * DVec3::Y]);
    }
    scene.sources[0].position = source.into();
    scene.receivers = vec![Receiver::towards("receiver", receiver.into(), source.into())];
    let traced = Traced::new(scene, Settings { emissions: 64, ..Settings::default() });
    let settings = RenderSettings { mirror_order: Some(3), ..RenderSettings::default() };
    let found = traced.render(settings).arrivals;
    let exact =
        SpecularBox { size: SIZE, reflection: [reflection; 6], speed_of_sound: SPEED, air_attenuation: 0.0 };
    let expected = exact.arrivals_to_order(source, receiver, 3);
    let mut wrong = Vec::new();
    if found.len() != expected.len() {
        wrong.push(format!("{} chains instead of {}", found.len(), expected.len()));
    }
    // Several arrivals may be due at the same time: compared are the energies that have arrived by each time.
    let by = |time: f64| -> [f64; 2] {
        let due = |t: f64| t <= time * (1.0 + 1e-6);
        let found =
            found.iter().filter(|arrival| due(arrival.length / SPEED)).map(|arrival| arrival.energy[0]);
        let expected = expected.iter().filter(|arrival| due(arrival.time)).map(|arrival| arrival.fluence);
        [found.sum(), expected.sum()]
    };
    for arrival in &expected {
        let [found, expected] = by(arrival.time);
        if (found / expected - 1.0).abs() > 1e-5 {
            wrong.push(format!("{found:e} instead of {expected:e} by {} s", arrival.time));
        }
    }
    wrong
}

/// Source and receiver close to a wall, an edge and a corner: the images fall together in pairs, fours and eights, and
/// each is heard. An empty box is exact down to the least distance that is allowed, 11.5 µm in this room.
#[test]
fn images_that_fall_together_are_all_heard() {
    let mut wrong = Vec::new();
    for (as_tree, distances) in [(false, &[1e-2, 1.2e-5][..]), (true, &[1e-2, 1e-4])] {
        for &d in distances {
            let near = [[d, 2.0, 1.7], [d, d, 1.7], [d, 5.0 - d, 4.0 - d]];
            for place in near {
                for (source, receiver) in [(SOURCE, place), (place, SOURCE), (place, [d, 3.3, 2.9])] {
                    let found = wrong_chains(source, receiver, as_tree, 0.7);
                    wrong.extend(
                        found
                            .first()
                            .map(|first| format!("tree {as_tree}, {source:?} to {receiver:?}: {first}")),
                    );
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(!wrong_chains(SOURCE, [1e-3, 2.0, 1.7], false, 0.701).is_empty(), "another wall is noticed");
}

/// A source close to a wall, an edge, a corner or an end of the screen: every packet is accounted for.
#[test]
fn packets_start_anywhere() {
    for d in [1e-3, 1e-4, 1.2e-5] {
        for position in [
            dvec3(d, 2.0, 1.7),
            dvec3(d, d, 1.7),
            dvec3(6.0 - d, 5.0 - d, 4.0 - d),
            dvec3(3.0 + d, 2.0, 1.7),
            dvec3(3.0, 2.0, 2.5 + d),
            dvec3(3.0 - d, 3.5, d),
        ] {
            let mut scene = room(0.5, true);
            scene.sources[0].position = position;
            let traced = traced(scene);
            assert_eq!(traced.ledger.fates.count(Fate::Lost), 0, "{position}");
            assert!(traced.ledger.worst_residual() < 1e-9, "{position}");
        }
    }
}

/// Across the shadow boundary the direct sound is there or not, and everything else goes on as before: by a step of a
/// millimetre it changes by less than its noise.
#[test]
fn a_shadow_boundary_has_two_sides_and_no_third() {
    let traced = traced(room(0.5, true));
    let along = (on_shadow_boundary() - DVec3::from(SOURCE)).cross(DVec3::Y).normalize();
    let settings = RenderSettings { rays: Some(4096), ..RenderSettings::default() };
    let received = |step: f64| {
        let rendering = at(&traced, on_shadow_boundary() + step * along, settings.clone());
        rendering.expect("in the room").classes.map(|(_, energy)| energy[0])
    };
    let [lit, dark, between] = [1e-3, -1e-3, 0.0].map(received);
    let (lit, dark) = if lit[0] > dark[0] { (lit, dark) } else { (dark, lit) };
    assert!(lit[0] > 0.0 && dark[0].abs() < 1e-300, "{lit:?} {dark:?}");
    let direct = between[PathClass::Direct as usize];
    assert!(direct.abs() < 1e-300 || (direct / lit[0] - 1.0).abs() < 1e-2, "{direct:e}");
    let diffuse = PathClass::Diffuse as usize;
    assert!((lit[diffuse] / dark[diffuse] - 1.0).abs() < 0.01, "{lit:?} {dark:?}");
}

/// A source at every place where no receiver would be put: refused with a sentence, or every packet is accounted for.
#[test]
fn every_place_of_a_source_is_sound_or_refused() {
    let mut refused = 0;
    for (place, position) in places() {
        let mut scene = room(0.5, true);
        scene.sources[0].position = position;
        let geometry = scene.geometry().expect("a box");
        let settings = Settings { emissions: form(500, 50_000), ..Settings::default() };
        let tracer = sonel_tracer::Tracer::new(&scene, &geometry, settings);
        match tracer.run(sonel_map::ShardRange::WHOLE, |_| Ok::<(), sonel_tracer::TraceError>(())) {
            Ok(summary) => {
                assert_eq!(
                    summary.fates.count(Fate::Lost) + summary.fates.count(Fate::Escaped),
                    0,
                    "{place}"
                );
                assert!(summary.worst_residual() < 1e-9, "{place}: {}", summary.worst_residual());
            }
            Err(error) => {
                refused += 1;
                assert!(error.to_string().contains("from a surface, at least"), "{place}: {error}");
            }
        }
    }
    assert!((1..11).contains(&refused), "{refused} places are refused");
}

/// Behind the screen at the source's image in it: the chain that would be of no length does not exist.
#[test]
fn the_image_in_a_screen_is_dark() {
    let traced = traced(room(0.5, true));
    let settings = RenderSettings { mirror_order: Some(3), ..RenderSettings::default() };
    let arrivals = at(&traced, image_in_screen(), settings).expect("in the room").arrivals;
    let shortest = arrivals.iter().map(|arrival| arrival.length).fold(f64::INFINITY, f64::min);
    assert!(shortest >= image_in_screen().distance(SOURCE.into()), "{shortest}");
    assert!(arrivals.len() > 10);
}

/// A hut on the ground in the open.
fn hut(source: [f64; 3], receiver: [f64; 3]) -> Scene {
    let mut scene = room(0.5, false);
    let ground = |x: f64, y: f64| dvec3(x, y, 0.0);
    let corners = [ground(-20.0, -20.0), ground(20.0, -20.0), ground(20.0, 20.0), ground(-20.0, 20.0)];
    scene.mesh = Mesh::default();
    meshes::add_quad(&mut scene.mesh, 0, corners);
    meshes::add_box(&mut scene.mesh, 0, dvec3(4.0, -5.0, 0.0), dvec3(5.0, 5.0, 3.0));
    scene.mesh = meshes::turned_over(scene.mesh);
    scene.sources[0].position = source.into();
    scene.receivers = vec![Receiver::towards("receiver", receiver.into(), source.into())];
    scene
}

/// Outside a closed object in the open: its front mirrors, it hides what is behind it, and nothing gets into it. One that
/// faced inward, as a room does, would mirror nothing.
#[test]
fn a_hut_in_the_open_is_heard_from_outside() {
    let (source, before, behind) = ([1.0, 0.0, 1.5], [2.0, 1.0, 1.5], [8.0, 0.0, 1.5]);
    let traced = traced(hut(source, before));
    assert_eq!(traced.ledger.fates.count(Fate::Lost), 0);
    assert!(traced.ledger.fates.count(Fate::Escaped) > 100 && traced.ledger.worst_residual() < 1e-9);
    traced.for_each_segment(|_, _, segment| {
        let at = traced.geometry.to_world(0.5 * (segment.start + segment.end));
        let is_inside = at.x > 4.001 && at.x < 4.999 && at.y.abs() < 4.999 && at.z < 2.999;
        assert!(!is_inside, "{at}");
    });
    let lengths = |receiver: [f64; 3]| -> Vec<f64> {
        let settings = RenderSettings { mirror_order: Some(1), ..RenderSettings::default() };
        let rendering = at(&traced, receiver.into(), settings).expect("in the open");
        rendering.arrivals.iter().map(|arrival| arrival.length).collect()
    };
    // Straight, by the ground, by the front at x = 4 m.
    let expected = [2.0_f64.sqrt(), 11.0_f64.sqrt(), 26.0_f64.sqrt()];
    let found = lengths(before);
    assert_eq!(found.len(), expected.len(), "{found:?}");
    assert!(found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-5), "{found:?}");
    assert!(lengths(behind).is_empty(), "hidden");
}

/// A hut without ground is a room: a source outside of it is named, not its packets lost.
#[test]
fn a_source_outside_the_room_is_refused() {
    let mut scene = room(0.5, false);
    scene.sources[0].position = dvec3(7.0, 2.0, 1.0);
    let geometry = scene.geometry().expect("a box");
    let tracer = sonel_tracer::Tracer::new(&scene, &geometry, Settings::default());
    let refused = tracer.run(sonel_map::ShardRange::WHOLE, |_| Ok::<(), sonel_tracer::TraceError>(()));
    let refused = refused.expect_err("outside").to_string();
    assert!(refused.contains("\"source\" at [7, 2, 1] m is outside the room"), "{refused}");
}

/// In the solid of a wall 1 cm thick there is no air: source and receiver there are refused. In its cavity they hear one another and
/// nothing else, a millimetre from either face.
#[test]
fn inside_a_wall_there_is_air_only_in_cavities() {
    let mut scene = room(0.0, false);
    meshes::add_box(&mut scene.mesh, 0, dvec3(3.0, 0.5, 0.5), dvec3(3.01, 4.5, 3.5));
    let solid = traced(scene.clone());
    let reason = at(&solid, dvec3(3.005, 2.0, 2.0), RenderSettings::default()).expect_err("no air");
    assert!(reason.contains("inside a closed object"), "{reason}");
    meshes::add_box(&mut scene.mesh, 0, dvec3(3.004, 1.0, 1.0), dvec3(3.006, 4.0, 3.0));
    let geometry = scene.geometry().expect("a box");
    assert!(geometry.contains(dvec3(3.005, 2.0, 2.0)) && !geometry.contains(dvec3(3.002, 2.0, 2.0)));
    scene.sources[0].position = dvec3(3.005, 2.0, 2.0);
    let cavity = traced(scene);
    assert_eq!(cavity.ledger.fates.count(Fate::Lost), 0);
    let settings = RenderSettings { mirror_order: Some(1), ..RenderSettings::default() };
    let received = |position: DVec3| at(&cavity, position, settings.clone()).expect("air");
    assert!(received(dvec3(3.005, 2.5, 2.0)).arrivals[0].length < 0.6);
    let outside: f64 = received(dvec3(4.0, 2.5, 2.0)).classes.iter().map(|(_, energy)| energy[0]).sum();
    assert!(outside.abs() < 1e-300, "{outside:e}");
}
