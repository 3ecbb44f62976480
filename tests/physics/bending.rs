//! Packets bent at edges: the angles they take, the energy they keep, the obstacles that bend none.

use std::convert::Infallible;

use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::edges::whole_reach;
use sonel_map::{Event, Settings, ShardRange, Spectral};
use sonel_renderer::Estimator;
use sonel_scene::Scene;
use sonel_testkit::z_test::{Estimate, Within, within_sigmas};
use sonel_tests::Traced;
use sonel_tests::bent::{add_box, add_quad, received, screened};
use sonel_tracer::Tracer;

/// A screen in the plane x = 0 that ends at z = 0, and a black wall at x = 10 m, both as good as endless.
fn knife_edge(frequency: f64) -> Scene {
    let mut mesh = Mesh { vertices: Vec::new(), triangles: Vec::new() };
    let far = 2000.0;
    add_quad(&mut mesh, [[0.0, -far, -far], [0.0, far, -far], [0.0, far, 0.0], [0.0, -far, 0.0]], 0);
    add_quad(&mut mesh, [[10.0, -far, -far], [10.0, far, -far], [10.0, far, far], [10.0, -far, far]], 0);
    let bands = Bands::new(vec![frequency], BandWidth::Octave).expect("octaves");
    let mut scene = Scene::from_parts(mesh, vec![Material::uniform("black", 1.0, 0.0, 1)], bands, 30.0)
        .with_source("source", [-10.0, 0.0, 0.0])
        .without_air_attenuation();
    scene.speed_of_sound = 343.0;
    scene
}

/// Share of all packets that should arrive on the wall between two heights: over the angle at which they leave, the normal
/// probability that they are turned into the directions between.
fn expected_share(frequency: f64, heights: [f64; 2], gamma: f64) -> f64 {
    let wavelength = 343.0 / frequency;
    let widest = f64::asin(5.0 * wavelength / 10.0);
    let steps = 20_000;
    let normal = |x: f64| 0.5 * libm::erfc(-x / std::f64::consts::SQRT_2);
    let mut share = 0.0;
    for step in 0..steps {
        let angle = widest * (f64::from(step) + 0.5) / f64::from(steps);
        let distance = 10.0 * angle.sin();
        let foot = [10.0 * angle.cos() * angle.cos() - 10.0, 10.0 * angle.cos() * angle.sin()];
        let sigma = gamma * wavelength / (4.0 * std::f64::consts::PI * distance);
        // Downward, towards the edge, is positive.
        let turned = |height: f64| {
            let [ahead, aside] = [10.0 - foot[0], height - foot[1]];
            (angle - aside.atan2(ahead)).tan()
        };
        share += normal(turned(heights[0]) / sigma) - normal(turned(heights[1]) / sigma);
    }
    let straight = |height: f64| f64::atan2(height, 20.0).max(widest);
    (share * widest / f64::from(steps) + straight(heights[1]) - straight(heights[0])) / std::f64::consts::TAU
}

#[test]
fn packets_behind_a_knife_edge_are_as_many_as_their_law_says() {
    let frequency = 2000.0;
    let scene = knife_edge(frequency);
    let geometry = scene.geometry().unwrap();
    let settings = Settings { emissions: 1_500_000, ..Settings::default() };
    // About the boundary, and at Fresnel numbers of 1 and of 2 behind it.
    let height = |fresnel: f64| -2.0 * fresnel / (2.0_f64 / (343.0 / frequency * 5.0)).sqrt();
    let bins =
        [(0.2, -0.2), (1.3, 0.7), (2.5, 1.5), (-2.0, -3.0)].map(|(low, high)| [height(low), height(high)]);
    let mut counts = [0_u32; 4];
    Tracer::bending(&scene, &geometry, settings, Some(&whole_reach(&scene.wavelengths())))
        .run(ShardRange::WHOLE, |chunk| {
            for vertex in &chunk.paths.vertices {
                if vertex.event() == Some(Event::Absorbed) && vertex.position.x > 0.0 {
                    let at = geometry.to_world(vertex.position);
                    for (count, bin) in counts.iter_mut().zip(bins) {
                        *count += u32::from(at.x > 5.0 && (bin[0]..bin[1]).contains(&at.z));
                    }
                }
            }
            Ok::<(), Infallible>(())
        })
        .unwrap();
    for (count, bin) in counts.into_iter().zip(bins) {
        let value = f64::from(count) / settings.emissions as f64;
        let estimate = Estimate { value, sigma: value / f64::from(count).sqrt() };
        let within = Within { sigmas: 4.0, maximal_sigma: 0.1 * value };
        within_sigmas(estimate, expected_share(frequency, bin, 0.87), within).unwrap();
    }
    let value = f64::from(counts[2]) / settings.emissions as f64;
    let estimate = Estimate { value, sigma: value / f64::from(counts[2]).sqrt() };
    let spoilt = expected_share(frequency, bins[2], 1.5);
    assert!(
        within_sigmas(estimate, spoilt, Within { sigmas: 4.0, maximal_sigma: value }).is_err(),
        "another spread"
    );
}

#[test]
fn the_ledger_closes_past_edges_in_every_band() {
    for (emissions, spectral) in [(20_011, Spectral::Shared), (4_000, Spectral::PerBand)] {
        let settings = Settings { emissions, spectral, ..Settings::default() };
        let scene = screened([0.2, 0.3, 0.1, 0.4], [0.5, 0.3, 0.7, 0.9], 1.0);
        let traced = Traced::bending(scene, settings);
        let bends = traced.map.ledger();
        assert_eq!(bends, traced.ledger);
        for (band, ledger) in traced.ledger.bands.iter().enumerate() {
            assert!(ledger.relative_residual() < 1e-9, "{spectral:?} band {band}: {ledger:?}");
            assert!(ledger.sampling_sigma() < 0.05, "{spectral:?} band {band}: {ledger:?}");
            assert!(
                ledger.sampling.abs() <= 4.0 * ledger.sampling_sigma() + 1e-12,
                "{spectral:?} band {band}: {ledger:?}"
            );
        }
        let survey = sonel_analysis::survey::survey(&traced.map, &traced.geometry);
        let frequencies = [125.0, 250.0, 1000.0, 4000.0];
        assert_eq!(
            sonel_analysis::survey::differences(&traced.ledger, &survey.ledger, &frequencies),
            [""; 0]
        );
    }
}

/// A closed room with a box of `size` hung in its middle.
fn with_box(frequencies: Vec<f64>, size: f64) -> Scene {
    let mut mesh = Mesh::shoebox([9.0, 8.0, 7.0], [0; 6]);
    add_box(&mut mesh, [4.0, 3.0, 2.5], [size; 3], 0);
    let count = frequencies.len();
    let bands = Bands::new(frequencies, BandWidth::Octave).expect("octaves");
    let mut scene = Scene::from_parts(mesh, vec![Material::uniform("wall", 0.1, 0.5, count)], bands, 0.4)
        .with_source("source", [2.0, 2.0, 1.5])
        .with_receiver("receiver", [7.0, 6.0, 2.0])
        .without_air_attenuation();
    scene.speed_of_sound = 343.0;
    scene
}

fn bends(traced: &Traced) -> usize {
    let paths = (0..traced.map.layout().total).filter_map(|emission| traced.map.path(0, emission));
    paths.flat_map(|path| path.vertices).filter(|vertex| vertex.event() == Some(Event::Bent)).count()
}

/// λ/2 is 1.37 m at 125 Hz and 0.17 m at 1000 Hz.
#[test]
fn boxes_smaller_than_half_a_wave_bend_nothing_and_change_nothing() {
    let settings = Settings { emissions: 2_000, ..Settings::default() };
    let result = |traced: &Traced| received(traced, Estimator::Connection, 1 << 13);
    let small = Traced::bending(with_box(vec![125.0], 1.3), settings);
    assert_eq!(bends(&small), 0);
    assert_eq!(result(&small), result(&Traced::new(with_box(vec![125.0], 1.3), settings)));
    let large = Traced::bending(with_box(vec![125.0], 1.45), settings);
    assert!(bends(&large) > 100);
    assert_ne!(result(&large), result(&Traced::new(with_box(vec![125.0], 1.45), settings)));
    // Each band on paths of its own: what is long enough is as it is without edges, number by number.
    let alone = Settings { spectral: Spectral::PerBand, ..settings };
    let scene = || with_box(vec![125.0, 1000.0], 0.5);
    let [bent, straight] = [Traced::bending(scene(), alone), Traced::new(scene(), alone)];
    let [bent_levels, straight_levels] =
        [&bent, &straight].map(|traced| received(traced, Estimator::Connection, 1 << 13));
    assert_eq!(bent_levels[0][0], straight_levels[0][0]);
    assert_ne!(bent_levels[0][1], straight_levels[0][1]);
    let short = Traced::bending(with_box(vec![1000.0], 0.5), settings);
    assert!(bends(&short) > 100);
}

/// A plate of 4 m × 2 m about the origin, which is horizontal or upright and seen along x from 5 m away.
fn plate(is_upright: bool) -> Scene {
    let mut mesh = Mesh::default();
    let corners = [[-2.0, -1.0], [2.0, -1.0], [2.0, 1.0], [-2.0, 1.0]];
    add_quad(&mut mesh, corners.map(|[y, d]| if is_upright { [0.0, y, d] } else { [d, y, 0.0] }), 0);
    let bands = Bands::new(vec![500.0], BandWidth::Octave).expect("octaves");
    let mut scene = Scene::from_parts(mesh, vec![Material::uniform("plate", 0.1, 0.5, 1)], bands, 0.1)
        .with_source("source", [-5.0, 0.2, 0.1])
        .without_air_attenuation();
    scene.speed_of_sound = 343.0;
    scene
}

/// λ/2 is 0.343 m: a plate of 4 m is as deep where it is seen at 4.9°. The way from the source to its middle rises by 1.1°.
#[test]
fn plates_seen_edge_on_bend_nothing() {
    let settings = Settings { emissions: 40_000, ..Settings::default() };
    let slopes = |is_upright: bool| {
        let traced = Traced::bending(plate(is_upright), settings);
        let mut slopes: Vec<[f64; 2]> = Vec::new();
        let mut before = 0.0;
        traced.for_each_segment(|_, _, segment| {
            let way = (segment.end - segment.start).as_dvec3().normalize();
            if segment.history.bends == 1 && !segment.history.diffused && segment.history.order == 0 {
                slopes.push([before, way.z.abs()]);
            }
            before = way.z.abs();
        });
        slopes
    };
    let upright = slopes(true);
    assert!(upright.iter().filter(|[before, _]| *before < 0.15).count() > 100, "{}", upright.len());
    let level = slopes(false);
    // The sides of 2 m have a depth of 4 m.
    let least = 0.5 * 343.0 / 500.0 / 4.0;
    let lowest = |of: usize| level.iter().map(|slopes| slopes[of]).fold(1.0, f64::min);
    assert!(lowest(0) > least - 1e-3, "{}", lowest(0));
    // Nothing is turned from where the plate is seen to where it is not.
    assert!(lowest(1) > least - 1e-3, "{}", lowest(1));
    assert!(level.len() > 100, "{} bends over the plate seen from above and below", level.len());
}
