//! A speed of sound that rises or falls with height: arcs against an integrated ray equation, the edge of the shadow zone, levels against
//! tubes of neighbouring rays, the diffuse field, estimators among themselves, hops over ground, and what is hard.

use core::f64::consts::PI;

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::{Arc, Mesh, SAGITTA, SpeedProfile};
use sonel_map::{BandClasses, Emissions, Event, Fate, Settings};
use sonel_renderer::{Estimator, PathClass, RenderError, RenderSettings, Renderer, Rendering};
use sonel_scene::Scene;
use sonel_testkit::z_test::{Estimate, Within, within_sigmas};
use sonel_tests::meshes::add_quad;
use sonel_tests::{Traced, batch_fluence, late_batch_fluence};

/// Speed of sound at height 0 [m/s], that of default air.
fn speed() -> f64 {
    sonel_acoustics::Air::default().speed_of_sound()
}

fn profile(gradient: f64) -> SpeedProfile {
    SpeedProfile::new(speed(), gradient * DVec3::Z).expect("a gradient")
}

/// Place and slowness of a ray after `time`, by the Runge–Kutta method: dx/dt = c² p, dp/dt = −∇c/c.
fn integrate(gradient: f64, from: DVec3, direction: DVec3, time: f64) -> (DVec3, DVec3) {
    let slope = |(place, slowness): (DVec3, DVec3)| {
        let speed = speed() + gradient * place.z;
        (speed * speed * slowness, -gradient / speed * DVec3::Z)
    };
    let steps = 4000;
    let step = time / f64::from(steps);
    let mut state = (from, direction / (speed() + gradient * from.z));
    for _ in 0..steps {
        let add = |a: (DVec3, DVec3), b: (DVec3, DVec3), share: f64| (a.0 + share * b.0, a.1 + share * b.1);
        let first = slope(state);
        let second = slope(add(state, first, 0.5 * step));
        let third = slope(add(state, second, 0.5 * step));
        let fourth = slope(add(state, third, step));
        for (part, share) in [(first, 1.0), (second, 2.0), (third, 2.0), (fourth, 1.0)] {
            state = add(state, part, share * step / 6.0);
        }
    }
    state
}

#[test]
fn arcs_are_what_the_ray_equation_integrates_to() {
    let from = dvec3(0.0, 0.0, 2.0);
    for gradient in [0.1, -0.1, 2.0] {
        for degrees in [0.0_f64, 1.0, -30.0, 60.0, 90.0] {
            let direction = dvec3(degrees.to_radians().cos(), 0.0, degrees.to_radians().sin());
            let time = 1.5;
            let (place, slowness) = integrate(gradient, from, direction, time);
            let arc = Arc::leaving(profile(gradient), from, direction);
            assert!(arc.at(time).distance(place) < 1e-6, "{gradient} {degrees}: {}", arc.at(time) - place);
            assert!(arc.direction(time).distance(slowness.normalize()) < 1e-9);
            let found = profile(gradient).travel_time(from, place);
            assert!((found / time - 1.0).abs() < 1e-9, "{found}");
        }
    }
}

/// Ground of 320 × 40 m about the line from source to receivers, which is z = 0.
fn ground(absorption: f64, gradient: f64, duration: f64) -> Scene {
    let mut mesh = Mesh::default();
    let corner = |x: f64, y: f64| dvec3(x, y, 0.0);
    let quad = [corner(-20.0, -20.0), corner(300.0, -20.0), corner(300.0, 20.0), corner(-20.0, 20.0)];
    add_quad(&mut mesh, 0, quad);
    let bands = Bands::new(vec![500.0, 8000.0], BandWidth::Octave).expect("octaves");
    let material = Material::uniform("ground", absorption, 0.0, 2);
    let scene = Scene::from_parts(mesh, vec![material], bands, duration).without_air_attenuation();
    Scene { sound_speed_gradient: gradient, ..scene }
}

fn settings(emissions: u64) -> Settings {
    Settings { emissions, seed: 7, ..Settings::default() }
}

/// Energy of direct sound at a receiver.
fn direct(rendering: &Rendering, receiver: usize) -> f64 {
    let direct = rendering.arrivals.iter().find(|arrival| arrival.receiver == receiver && arrival.order == 0);
    direct.map_or(0.0, |arrival| arrival.energy[0])
}

#[test]
fn the_shadow_zone_begins_at_the_analytic_range() {
    let radius = speed() / 0.1;
    for (source, receiver) in [(2.0, 2.0), (2.0, 0.5), (0.3, 4.0)] {
        // The arc that touches the ground at its lowest point.
        let way = |height: f64| (2.0 * radius * height - height * height).sqrt();
        let edge = way(source) + way(receiver);
        let scene = |gradient| {
            let scene = ground(0.3, gradient, 1.0).with_source("source", [0.0, 0.0, source]);
            let ranges = [0.5, 0.999, 1.001, 1.1].map(|share| share * edge);
            ranges.iter().fold(scene, |scene, &x| scene.with_receiver("receiver", [x, 0.0, receiver]))
        };
        let seen = |gradient| {
            let rendering = Traced::new(scene(gradient), settings(64)).render(RenderSettings::default());
            [0, 1, 2, 3].map(|receiver| direct(&rendering, receiver) > 0.0)
        };
        assert_eq!(seen(-0.1), [true, true, false, false], "upward refraction {source} {receiver}");
        assert_eq!(seen(0.1), [true; 4], "downward refraction");
        assert_eq!(seen(0.0), [true; 4], "even air");
    }
}

/// Fluence per unit emitted energy from the tube of rays about that to `to`, in the plane y = 0: energy of dΩ = cos φ dφ dβ crosses
/// x dβ · dn.
fn tube(gradient: f64, from: DVec3, to: DVec3) -> f64 {
    let profile = profile(gradient);
    let (arc, time) = (Arc::between(profile, from, to), profile.travel_time(from, to));
    let elevation = arc.direction(0.0).z.asin();
    let width = 1e-4;
    let ray = |offset: f64| {
        let angle = elevation + offset;
        integrate(gradient, from, dvec3(angle.cos(), 0.0, angle.sin()), time).0
    };
    let apart = ray(width).distance(ray(-width)) / (2.0 * width);
    elevation.cos() / (4.0 * PI * (to.x - from.x) * apart)
}

#[test]
fn direct_sound_has_the_level_and_time_of_its_tube_of_rays() {
    let from = dvec3(0.0, 0.0, 20.0);
    let places = [[150.0, 0.0, 20.0], [40.0, 0.0, 35.0], [250.0, 0.0, 1.5], [1.0, 0.0, 40.0]];
    for gradient in [0.1, -0.1, 4.0, -4.0, 1e-9] {
        let scene = ground(0.3, gradient, 1.0).with_source("source", from.to_array());
        let scene = places.iter().fold(scene, |scene, &place| scene.with_receiver("receiver", place));
        let scene = scene.with_receiver("above", [0.0, 0.0, 30.0]);
        let traced = Traced::new(scene, settings(64));
        let rendering = traced.render(RenderSettings::default());
        let direct: Vec<_> = rendering.arrivals.iter().filter(|arrival| arrival.order == 0).collect();
        for arrival in direct.iter().filter(|arrival| arrival.receiver < places.len()) {
            let to = DVec3::from_array(places[arrival.receiver]);
            let expected = tube(gradient, from, to);
            assert!((arrival.energy[0] / expected - 1.0).abs() < 1e-6, "{gradient} {to}");
            let straight = 1.0 / (4.0 * PI * from.distance_squared(to));
            if gradient.abs() < 1e-6 {
                assert!((arrival.energy[0] / straight - 1.0).abs() < 1e-6, "it joins even air");
                assert!((arrival.length / from.distance(to) - 1.0).abs() < 1e-6);
            } else if gradient.abs() > 1.0 {
                assert!((arrival.energy[0] / straight - 1.0).abs() > 1e-3, "not as in even air");
            }
            let time = profile(gradient).travel_time(from, to);
            assert!((arrival.length / speed() / time - 1.0).abs() < 1e-9);
        }
        // Where sound slows down by 4 m/s a metre, the arcs over 150 m would pass below the ground.
        assert_eq!(direct.len(), if gradient < -1.0 { 3 } else { 5 }, "{gradient}");
        // Straight up the time is an integral of 1/c.
        let above = direct.iter().find(|arrival| arrival.receiver == places.len());
        let ends = [20.0, 30.0].map(|z| speed() + gradient * z);
        let time = if gradient.abs() < 1e-6 { 10.0 / ends[0] } else { (ends[1] / ends[0]).ln() / gradient };
        assert!((above.expect("nothing between").length / speed() / time - 1.0).abs() < 1e-6);
    }
}

/// Air that becomes faster upwards so much that it matters in a room [1/s].
const STEEP: f64 = 60.0;

fn room(absorption: f64, scattering: f64, gradient: f64) -> Scene {
    let bands = Bands::new(vec![500.0, 8000.0], BandWidth::Octave).expect("octaves");
    let walls = Material::uniform("walls", absorption, scattering, 2);
    let scene = Scene::from_parts(Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]), vec![walls], bands, 0.13)
        .without_air_attenuation()
        .with_source("source", [1.2, 1.6, 0.5])
        .with_receiver("low", [3.4, 2.5, 0.8])
        .with_receiver("high", [3.6, 2.4, 2.4]);
    Scene { sound_speed_gradient: gradient, ..scene }
}

/// Fluence of direct sound at `center` by counting lengths of chords in a ball of `radius`, with its standard error over packets.
fn counted(traced: &Traced, center: DVec3, radius: f64) -> Estimate {
    let center = center - traced.geometry.center();
    let (mut sum, mut squares) = (0.0, 0.0);
    let packets = traced.map.layout().total as f64;
    let volume = 4.0 / 3.0 * PI * radius.powi(3);
    let mut of_packet = (u64::MAX, 0.0);
    traced.for_each_segment(|emission, share, segment| {
        if segment.history.order > 0 {
            return;
        }
        let (start, end) = (segment.start.as_dvec3(), segment.end.as_dvec3());
        let along = end - start;
        let middle = (center - start).dot(along) / along.length_squared();
        let miss = (center - start - middle * along).length_squared();
        let half = (radius * radius - miss).max(0.0).sqrt() / along.length();
        let within = (middle + half).min(1.0) - (middle - half).max(0.0);
        if half == 0.0 || within <= 0.0 {
            return;
        }
        if of_packet.0 != emission {
            squares += of_packet.1 * of_packet.1;
            of_packet = (emission, 0.0);
        }
        let fluence = segment.energy[0][0] * share * within * along.length() / volume;
        of_packet.1 += fluence;
        sum += fluence;
    });
    squares += of_packet.1 * of_packet.1;
    Estimate { value: sum, sigma: (squares - sum * sum / packets).sqrt() }
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn packets_on_arcs_bring_what_the_direct_arc_does() {
    let traced = Traced::new(room(1.0, 0.0, STEEP), settings(300_000));
    let exact = traced.render(RenderSettings::default());
    for (receiver, place) in [[3.4, 2.5, 0.8], [3.6, 2.4, 2.4]].into_iter().enumerate() {
        let found = counted(&traced, DVec3::from_array(place), 0.45);
        let within = Within { sigmas: 4.0, maximal_sigma: 0.04 * found.value };
        let expected = direct(&exact, receiver);
        within_sigmas(found, expected, within).unwrap_or_else(|problem| panic!("{receiver}: {problem}"));
        let even = Traced::new(room(1.0, 0.0, 0.0), settings(64)).render(RenderSettings::default());
        if receiver == 1 {
            assert!(within_sigmas(found, direct(&even, receiver), within).is_err(), "straight paths");
        }
    }
}

/// As in regions of different air: where nothing is lost, the energy per volume of a diffuse field goes as 1/c³, fluence as 1/c².
#[test]
#[ignore = "long: cargo xtask accept"]
fn the_diffuse_field_in_a_gradient_is_even_per_mode() {
    let emissions = 5200;
    for scattering in [1.0, 0.4] {
        let traced = Traced::new(room(0.0, scattering, STEEP), settings(emissions));
        assert!(traced.ledger.worst_residual() < 1e-9);
        assert_eq!(traced.ledger.fates.count(Fate::Expired), emissions, "nothing is lost");
        let first = 40;
        let bins = 130;
        let area = 20.0;
        let at = |z: f64| speed() + STEEP * z;
        // ∫ c⁻³ dV over the height of 3 m.
        let modes = area / (2.0 * STEEP) * (at(0.0).powi(-2) - at(3.0).powi(-2));
        for estimator in [Estimator::Auto, Estimator::Sphere] {
            let rendering = traced.render(RenderSettings::of(estimator));
            for (receiver, height) in [0.8, 2.4].into_iter().enumerate() {
                let (value, sigma) = late_batch_fluence(&rendering, receiver, 0, first);
                let duration = f64::from(bins - first as i32) * 1e-3;
                let expected = duration * at(height).powi(-2) / modes;
                let found = Estimate { value, sigma };
                let within = Within { sigmas: 4.0, maximal_sigma: 0.03 * expected };
                within_sigmas(found, expected, within)
                    .unwrap_or_else(|problem| panic!("{scattering} {estimator:?} {receiver}: {problem}"));
                let even = duration * at(height) / (3.0 * area);
                assert!(within_sigmas(found, even, within).is_err(), "the same energy per volume everywhere");
            }
        }
    }
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn estimators_agree_in_a_gradient() {
    let traced = Traced::new(room(0.3, 0.5, STEEP), settings(20_000));
    let even = Traced::new(room(0.3, 0.5, 0.0), settings(4000)).render(RenderSettings::default());
    let received = |estimator| traced.render(RenderSettings::of(estimator));
    let (auto, sphere) = (received(Estimator::Auto), received(Estimator::Sphere));
    let mut apart = 0.0_f64;
    for receiver in 0..2 {
        let [a, b, c] = [&auto, &sphere, &even].map(|rendering| batch_fluence(rendering, receiver, 0));
        let sigmas = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() / a.1.hypot(b.1);
        assert!(a.1 < 0.03 * a.0 && b.1 < 0.03 * b.0);
        assert!(sigmas(a, b) < 4.0, "{receiver}: {a:?} {b:?}");
        apart = apart.max(sigmas(c, b));
    }
    assert!(apart > 6.0, "even air agrees too: {apart}");
    for class in [PathClass::Edge, PathClass::DiffuseMirror] {
        assert!(auto.classes[class as usize].1.iter().all(|&energy| energy == 0.0), "{class:?}");
    }
}

/// Height above the ground at which a ray from `from` arrives over x = `reach`, with its reflections at z = 0; none where it never does.
fn shoot(gradient: f64, from: DVec3, elevation: f64, reach: f64) -> Option<(f64, u32)> {
    let (mut from, mut direction) = (from, dvec3(elevation.cos(), 0.0, elevation.sin()));
    for reflections in 0..50 {
        let arc = Arc::leaving(profile(gradient), from, direction);
        // Beyond `until` the arc is past the ground or past the receiver.
        let mut until = 1e-4;
        let is_past = |time: f64| arc.at(time).z < 0.0 || arc.at(time).x > reach;
        while !is_past(until) {
            until *= 1.1;
            if until > 60.0 {
                return None;
            }
        }
        let mut low = 1e-6;
        for _ in 0..60 {
            let middle = 0.5 * (low + until);
            *(if is_past(middle) { &mut until } else { &mut low }) = middle;
        }
        let end = arc.at(low);
        if end.x > reach - 1e-6 {
            return Some((end.z, reflections));
        }
        from = dvec3(end.x, 0.0, 0.0);
        direction = arc.direction(low) * dvec3(1.0, 1.0, -1.0);
    }
    None
}

/// Fluences over each number of reflections, from a fan of rays: where neighbours pass on both sides of the receiver, the tube between them.
fn fan(gradient: f64, from: DVec3, to: DVec3, rays: i32) -> Vec<(u32, f64)> {
    const STEP: f64 = 2e-5;
    let reach = to.x - from.x;
    let ray = |number: i32| (f64::from(number) * STEP, shoot(gradient, from, f64::from(number) * STEP, to.x));
    let rays: Vec<_> = (-rays..rays).map(ray).collect();
    let tube = |ends: &[(f64, Option<(f64, u32)>)]| {
        let ((angle, low), (_, high)) = (ends[0], ends[1]);
        let ((low, reflections), (high, same)) = (low?, high?);
        let is_between = reflections == same && (low < to.z) != (high < to.z);
        // dΩ = cos φ dφ dβ crosses x dβ dz.
        let arriving = (speed() + gradient * to.z) / (speed() + gradient * from.z) * angle.cos();
        let across = (high - low).abs() / STEP * arriving;
        is_between.then(|| (reflections, angle.cos() / (4.0 * PI * reach * across)))
    };
    rays.windows(2).filter_map(tube).collect()
}

/// All ways over level ground, however many reflections they have, and their tubes of rays.
#[test]
fn reflections_at_level_ground_are_those_of_a_fan_of_rays() {
    let from = dvec3(0.0, 0.0, 1.5);
    for (gradient, places) in
        [(0.1, [[50.0, 1.5], [140.0, 4.0], [280.0, 1.5]]), (-0.1, [[20.0, 1.5], [60.0, 3.0], [90.0, 1.2]])]
    {
        let scene = ground(0.0, gradient, 1.5).with_source("source", from.to_array());
        let scene = places.iter().fold(scene, |scene, &[x, z]| scene.with_receiver("receiver", [x, 0.0, z]));
        let rendering = Traced::new(scene, settings(64)).render(RenderSettings::default());
        for (receiver, [x, z]) in places.into_iter().enumerate() {
            let mut found: Vec<(u32, f64)> = rendering
                .arrivals
                .iter()
                .filter(|arrival| arrival.receiver == receiver)
                .map(|arrival| (arrival.order, arrival.energy[0]))
                .collect();
            let mut expected = fan(gradient, from, dvec3(x, 0.0, z), 10_000);
            let order = |a: &(u32, f64), b: &(u32, f64)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
            found.sort_by(order);
            expected.sort_by(order);
            assert_eq!(found.len(), expected.len(), "{gradient} {x}: {found:?} {expected:?}");
            assert!(found.len() > 1, "it is reflected");
            for ((reflections, energy), (same, tube)) in found.into_iter().zip(expected) {
                assert_eq!(reflections, same);
                assert!((energy / tube - 1.0).abs() < 0.02, "{gradient} {x} {reflections}: {energy} {tube}");
            }
        }
    }
}

/// Downward refraction over a mirror: every hop is 2 (c₀/g) tan φ long, cos φ = c₀/c cos φ₀ of the source.
#[test]
fn packets_hop_over_the_ground_along_arcs() {
    let (gradient, height) = (0.8, 0.5);
    let scene = ground(0.0, gradient, 1.0).with_source("source", [0.0, 0.0, height]);
    let traced = Traced::new(scene, settings(20_000));
    let center = traced.geometry.center();
    let emissions = Emissions::of_map(&traced.map, center, &BandClasses::separate(1));
    let mut hops = 0;
    for emission in 0..emissions.layout.total {
        let level = emissions.direction(0, emission).truncate().length();
        let cosine = f64::from(level) * speed() / (speed() + gradient * height);
        let slope = (1.0 - cosine * cosine).sqrt() / cosine;
        let path = traced.map.path(0, emission).expect("the whole run").vertices;
        for ends in path.windows(2) {
            if ends.iter().any(|end| end.event() != Some(Event::Specular)) {
                continue;
            }
            let found = f64::from(ends[0].position.distance(ends[1].position));
            let expected = 2.0 * speed() / gradient * slope;
            // Where a chord meets the ground, it is up to its sagitta below the arc.
            let early = 1.01 * SAGITTA / slope;
            assert!((found - expected).abs() < 1e-4 * expected + early, "{found} {expected}");
            assert!(early > 0.1 * expected || (found - 1.01 * expected).abs() > early, "it could not fail");
            hops += 1;
        }
    }
    assert!(hops > 300, "{hops}");
    assert!(traced.ledger.worst_residual() < 1e-9);
    assert_eq!(traced.ledger.fates.count(Fate::Lost), 0);
}

#[test]
fn what_knows_straight_paths_only_is_refused() {
    let traced = Traced::new(room(0.3, 0.5, STEEP), settings(64));
    let refused = |settings: RenderSettings| {
        matches!(Renderer::new(&traced.map, &traced.geometry, settings), Err(RenderError::Settings(_)))
    };
    assert!(refused(RenderSettings::of(Estimator::Gather)) && refused(RenderSettings::of(Estimator::Paper)));
    assert!(refused(RenderSettings { mirror_order: Some(2), ..RenderSettings::default() }));
    assert!(!refused(RenderSettings::of(Estimator::Connection)) && !refused(RenderSettings::default()));
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn every_way_over_level_ground_is_found_from_random_places() {
    let mut random = sonel_testkit::uniform::Uniform::new(3);
    for trial in 0..40 {
        let gradient = random.between(0.03, 0.3) * if trial % 2 == 0 { 1.0 } else { -1.0 };
        let from = dvec3(0.0, 0.0, random.between(0.5, 5.0));
        let to = dvec3(random.between(10.0, 250.0), 0.0, random.between(0.5, 5.0));
        let scene = ground(0.0, gradient, 1.5).with_source("source", from.to_array());
        let scene = scene.with_receiver("receiver", to.to_array());
        let rendering = Traced::new(scene, settings(64)).render(RenderSettings::default());
        let sum = |energies: Vec<f64>| (energies.len(), energies.into_iter().sum::<f64>());
        let found = sum(rendering.arrivals.iter().map(|arrival| arrival.energy[0]).collect());
        let expected = sum(fan(gradient, from, to, 40_000).into_iter().map(|(_, energy)| energy).collect());
        assert_eq!(found.0, expected.0, "{gradient} {from} {to}");
        assert!((found.1 - expected.1).abs() <= 0.02 * expected.1, "{gradient} {from} {to}");
    }
}
