//! The field of one edge against known values, Macdonald, a plain sum, its own symmetries, and a model that is wrong.

use super::*;
use crate::spectrum::{Spectrum, Wave};
use glam::DVec3;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2, TAU};

const OCTAVES: [f64; 6] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0];

fn octaves() -> Spectrum {
    Spectrum::new(&OCTAVES.map(|f| (f * FRAC_1_SQRT_2, f * SQRT_2)), 343.0)
}

fn wedge(angle: f64, length: f64) -> Wedge {
    let half = DVec3::Z * 0.5 * length;
    Wedge::new([-half, half], DVec3::X, DVec3::Y, angle).unwrap()
}

#[test]
fn sines_of_multiples_are_exact_on_both_sides_of_the_series() {
    let one = Complex::from(1.0);
    for size in [1e-12, 1e-3, 0.3, 0.34, 0.36, 1.0, 30.0] {
        for angle in [0.0, -0.25, -0.4, -0.49] {
            let sine = unit(angle * PI) * size;
            let cosine = (one + sine * sine).sqrt();
            let third = sine * (sine * sine * 4.0 + Complex::from(3.0));
            for (index, exact) in [(1.0, sine), (2.0, sine * cosine * 2.0), (3.0, third)] {
                let found = multiple_sine(index, sine, cosine);
                assert!((found - exact).norm() < 3e-8 * exact.norm(), "{index} {size} {angle}");
            }
            let half = multiple_sine(0.5, sine, cosine);
            let exact = sine * sine * (cosine + one).inv() * 0.5;
            assert!((half * half - exact).norm() < 3e-8 * exact.norm(), "{size} {angle}");
        }
    }
}

fn at(radius: f64, degrees: f64, along: f64) -> WedgePoint {
    WedgePoint { radius, angle: degrees.to_radians(), along }
}

fn waves(path: &EdgePath, spectrum: &Spectrum) -> Vec<Wave> {
    path.lengths()
        .enumerate()
        .map(|(piece, length)| Wave {
            length,
            amplitude: path
                .amplitudes(piece, spectrum.wave_numbers())
                .into_iter()
                .map(|terms| terms.into_iter().fold(Complex::ZERO, |a, b| a + b))
                .collect(),
        })
        .collect()
}

/// Energy in shadow relative to free field at `distance` [dB].
fn loss_db(path: &EdgePath, distance: f64) -> Vec<f64> {
    let spectrum = octaves();
    spectrum
        .energy(&waves(path, &spectrum))
        .iter()
        .map(|e| -10.0 * (e * distance * distance).log10())
        .collect()
}

fn assert_close(found: &[f64], expected: [f64; 6], tolerance: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance, "{found} instead of {expected}");
    }
}

/// Known insertion losses of a half plane, 10 m + 10 m.
#[test]
fn a_screen_shades_as_known() {
    let cases = [
        (1.0f64, [8.13, 9.60, 11.41, 13.62, 16.19, 19.01]),
        (3.0, [12.78, 15.43, 18.30, 21.26, 24.26, 27.26]),
    ];
    for (below, expected) in cases {
        let radius = 10f64.hypot(below);
        let angle = (10.0 / below).atan().to_degrees();
        let path = EdgePath::new(
            &wedge(TAU, 4000.0),
            at(radius, angle, 2000.0),
            at(radius, 360.0 - angle, 2000.0),
            [0.0, 4000.0],
            Visibility::default(),
            [1.0, 100.0],
        );
        assert_close(&loss_db(&path, 20.0), expected, 0.012);
    }
}

/// A known 270° corner.
#[test]
fn a_corner_shades_as_known() {
    let (source, receiver) = (at(8.0, 30.0, 200.0), at(6.0, 235.0, 202.0));
    let path = EdgePath::new(
        &wedge(1.5 * PI, 400.0),
        source,
        receiver,
        [0.0, 400.0],
        Visibility::default(),
        [1.0, 100.0],
    );
    let distance = (64.0 + 36.0 - 96.0 * 205f64.to_radians().cos() + 4.0).sqrt();
    assert_close(&loss_db(&path, distance), [7.13, 9.49, 12.11, 14.94, 17.88, 20.87], 0.012);
}

fn total(angle: f64, source: WedgePoint, receiver: WedgePoint, spectrum: &Spectrum) -> Vec<f64> {
    let path = EdgePath::new(
        &wedge(angle, 4000.0),
        source,
        receiver,
        [0.0, 4000.0],
        Visibility::default(),
        spectrum.range(),
    );
    let mut waves = waves(&path, spectrum);
    let turns = [
        receiver.angle - source.angle,
        receiver.angle + source.angle,
        2.0 * angle - receiver.angle - source.angle,
    ];
    for turn in turns.into_iter().filter(|turn| turn.abs() < PI) {
        let across = source.radius.powi(2) + receiver.radius.powi(2)
            - 2.0 * source.radius * receiver.radius * turn.cos();
        let way = (across + (receiver.along - source.along).powi(2)).sqrt();
        waves.push(spectrum.flat(way, 1.0 / way));
    }
    spectrum.energy(&waves)
}

/// Against Macdonald's solution, from deep shadow through the boundary to the doubly lit side: Fresnel numbers −3 … 100.
#[test]
fn a_screen_is_macdonalds_everywhere() {
    let spectrum = octaves();
    let source = at(7.0, 70.0, 2000.0);
    let mut fresnel = [f64::INFINITY, f64::NEG_INFINITY];
    for (radius, height) in [(5.0, 1.0), (0.3, 0.0), (30.0, -8.0)] {
        for degrees in [1.0, 90.0, 109.9, 110.1, 200.0, 249.99, 250.01, 252.0, 300.0, 359.0] {
            let receiver = at(radius, degrees, 2000.0 + height);
            let exact = sonel_testkit::analytic::half_plane::HalfPlane {
                source: (source.radius, source.angle, source.along),
                receiver: (receiver.radius, receiver.angle, receiver.along),
            };
            let found = total(TAU, source, receiver, &spectrum);
            // In the shadow nothing interferes, and few frequencies make a mean.
            let many = if degrees > 252.0 { 20 } else { 150 };
            for (band, centre, count) in [(0, 125.0, 30), (5, 4000.0, many)] {
                let expected = exact.band_energy((centre * FRAC_1_SQRT_2, centre * SQRT_2), 343.0, count);
                let error = 10.0 * (found[band] / expected).log10();
                assert!(error.abs() < 0.02, "{radius} m, {degrees}°, {centre} Hz: {error} dB");
                let turn = receiver.angle - source.angle;
                let detour = (source.radius + radius).hypot(height);
                let straight = (49.0 + radius * radius - 14.0 * radius * turn.cos() + height * height).sqrt();
                let number = (if turn > PI { 2.0 } else { -2.0 }) * (detour - straight) * centre / 343.0;
                fresnel = [fresnel[0].min(number), fresnel[1].max(number)];
            }
        }
    }
    assert!(fresnel[0] < -3.0 && fresnel[1] > 100.0, "{fresnel:?}");
}

/// Against the sources along a finite edge added up one by one, for edges of any length about the shortest way.
#[test]
fn finite_edges_are_the_sum_of_their_parts() {
    let spectrum = octaves();
    let mut worst: f64 = 0.0;
    for (degrees, angle) in [(270.0f64, 300.0f64), (360.0, 340.0), (181.0, 180.0), (359.0, 300.0)] {
        for part in [[0.0, 30.0], [14.9, 15.1], [15.3, 20.0], [2.0, 11.0]] {
            let wedge_angle = f64::to_radians(degrees);
            let (source, receiver) = (at(4.0, 20.0, 13.0), at(6.0, angle.min(degrees - 30.0), 18.0));
            let path = EdgePath::new(
                &wedge(wedge_angle, 30.0),
                source,
                receiver,
                part,
                Visibility::default(),
                [1.0, 100.0],
            );
            let found = spectrum.energy(&waves(&path, &spectrum));
            let parts = sonel_testkit::analytic::wedge_edge::WedgeEdge {
                angle: wedge_angle,
                edge: (part[0], part[1]),
                source: (source.radius, source.angle, source.along),
                receiver: (receiver.radius, receiver.angle, receiver.along),
            };
            for (band, centre) in [(0, 125.0), (3, 1000.0)] {
                let expected = parts.band_energy(None, (centre * FRAC_1_SQRT_2, centre * SQRT_2), 343.0, 60);
                worst = worst.max((10.0 * (found[band] / expected).log10()).abs());
                assert!(worst < 0.05, "{degrees}°, {part:?}, {centre} Hz: {worst} dB");
            }
        }
    }
}

/// 1 mm steps across the boundaries of shadow and of reflection: each wave with its own terms is continuous.
#[test]
fn a_receiver_walks_across_every_boundary_without_a_step() {
    assert!(largest_step(false) < 0.1, "{}", largest_step(false));
}

/// All four terms on the direct path: the model that has to be rejected.
#[test]
fn with_all_terms_on_the_direct_path_it_would_step() {
    assert!(largest_step(true) > 0.3, "{}", largest_step(true));
}

/// Largest change of the energy of the direct path or of the image between neighbours [dB].
fn largest_step(all_on_the_direct_path: bool) -> f64 {
    let spectrum = octaves();
    let wedge = wedge(TAU, 40.0);
    let (source, radius) = (at(7.0, 70.0, 20.0), 5.0);
    let mut largest: f64 = 0.0;
    for boundary in [PI - source.angle, PI + source.angle] {
        let mut before: Option<Vec<f64>> = None;
        for step in -40..=40 {
            let angle = boundary + f64::from(step) * 0.001 / radius;
            let receiver = WedgePoint { radius, angle, along: 21.0 };
            let path =
                EdgePath::new(&wedge, source, receiver, [0.0, 40.0], Visibility::default(), spectrum.range());
            let group = |of_group: [f64; WAVES], turn: f64| {
                let mut waves: Vec<Wave> = path
                    .lengths()
                    .enumerate()
                    .map(|(piece, length)| {
                        let sum = |terms: [Complex; WAVES]| {
                            (0..WAVES).fold(Complex::ZERO, |sum, i| sum + terms[i] * of_group[i])
                        };
                        let terms = path.amplitudes(piece, spectrum.wave_numbers()).into_iter();
                        Wave { length, amplitude: terms.map(sum).collect() }
                    })
                    .collect();
                if turn.abs() < PI {
                    let across = 49.0 + radius * radius - 14.0 * radius * turn.cos();
                    waves.push(spectrum.flat((across + 1.0).sqrt(), 1.0 / (across + 1.0).sqrt()));
                }
                spectrum.energy(&waves)
            };
            let (direct, image) = (angle - source.angle, angle + source.angle);
            let energies = if all_on_the_direct_path {
                let image = if image < PI { 1.0 } else { 0.0 };
                // The image is an arrival of its own where it is lit and nothing elsewhere.
                let way =
                    (49.0 + radius * radius - 14.0 * radius * (angle + source.angle).cos() + 1.0f64).sqrt();
                group([1.0; WAVES], direct).iter().map(|e| e + image / (way * way)).collect::<Vec<f64>>()
            } else {
                let second = group([0.0, 1.0, 1.0], image);
                group([1.0, 0.0, 0.0], direct).iter().zip(second).map(|(a, b)| a + b).collect()
            };
            if let Some(before) = before {
                for (now, before) in energies.iter().zip(before) {
                    largest = largest.max((10.0 * (now / before).log10()).abs());
                }
            }
            before = Some(energies);
        }
    }
    largest
}

/// A source on the edge radiates into the air of the wedge only: 2π/θ_w of its free field.
#[test]
fn on_the_edge_the_field_is_that_of_the_solid_angle() {
    for degrees in [181.0, 225.0, 270.0, 359.0, 360.0] {
        let angle = f64::to_radians(degrees);
        let path = EdgePath::new(
            &wedge(angle, 4e4),
            at(0.0, 0.0, 2e4),
            at(3.0, 100.0, 2e4 + 1.0),
            [0.0, 4e4],
            Visibility::default(),
            [1.0, 100.0],
        );
        let way = 10f64.sqrt();
        for k in [2.0, 70.0] {
            let field = path.field(k).into_iter().fold(Complex::ZERO, |a, b| a + b);
            let waves = unit(-k * way) * (1.0 / way);
            let lit =
                [100.0f64, 100.0, 2.0 * degrees - 100.0].iter().filter(|turn| turn.abs() < 180.0).count();
            let total = field + waves * lit as f64;
            assert!(
                (total.norm() * way - TAU / angle).abs() < 1e-3,
                "{degrees}° {k}: {}",
                total.norm() * way
            );
        }
    }
}

/// What an edge that is as good as endless and all waves that it leaves lit make together, at wave number `k` [1/m].
fn everything(angle: f64, source: WedgePoint, receiver: WedgePoint, k: f64) -> Complex {
    let middle = |point: WedgePoint| WedgePoint { along: point.along + 2e4, ..point };
    let (source, receiver) = (middle(source), middle(receiver));
    let (between, sum) = (receiver.angle - source.angle, receiver.angle + source.angle);
    let turns = [between, sum, 2.0 * angle - sum];
    let [direct, first, second] = turns.map(|turn| Some(turn.abs() < PI));
    let lit = Visibility { direct, faces: [first, second], within: 1e-6 };
    let path = EdgePath::new(&wedge(angle, 4e4), source, receiver, [0.0, 4e4], lit, [1.0, 100.0]);
    let wave = |turn: f64| {
        let across = source.radius.powi(2) + receiver.radius.powi(2)
            - 2.0 * source.radius * receiver.radius * turn.cos();
        let way = (across + (source.along - receiver.along).powi(2)).sqrt();
        unit(-k * way) * (1.0 / way)
    };
    let clear = turns.into_iter().filter(|turn| turn.abs() < PI).map(wave);
    path.field(k).into_iter().chain(clear).fold(Complex::ZERO, |a, b| a + b)
}

/// A ridge of a millionth of a degree is a wall: the direct wave and one image, also where the image lies on the ridge.
#[test]
fn an_edge_of_nearly_no_angle_is_a_wall() {
    for receiver in [20.0, 100.0, 119.999, 120.0, 120.001, 170.0] {
        let (source, receiver) = (at(4.0, 60.0, 0.0), at(3.0, receiver, 1.0));
        for k in [2.0, 70.0] {
            let wall = everything(PI, source, receiver, k);
            let ridge = |beyond: f64| (everything(PI + beyond, source, receiver, k) - wall).norm();
            assert!(ridge(2e-8) < 1e-5, "{}: {}", receiver.angle, ridge(2e-8));
            assert!(ridge(2e-2) > 1e-4, "a ridge of a degree is heard: {}", ridge(2e-2));
        }
    }
}

/// A fold of nearly no solid is a sheet.
#[test]
fn a_wedge_of_nearly_no_solid_is_a_sheet() {
    for degrees in [10.0, 130.0, 245.0, 300.0, 350.0] {
        let (source, receiver) = (at(4.0, 60.0, 0.0), at(3.0, degrees, 1.0));
        for k in [2.0, 70.0] {
            let sheet = everything(TAU, source, receiver, k);
            let fold = |less: f64| (everything(TAU - less, source, receiver, k) - sheet).norm();
            assert!(
                fold(1e-8) < 1e-5 && fold(1e-2) > fold(1e-8),
                "{degrees}°: {} {}",
                fold(1e-8),
                fold(1e-2)
            );
        }
    }
}

/// On the line of an edge, beyond its end, nothing arrives from it; beside the line it grows as the distance to the power ν.
#[test]
fn on_the_line_of_an_edge_nothing_arrives_from_it() {
    for (angle, degrees) in [(TAU, 300.0), (1.5 * PI, 200.0)] {
        for k in [2.0, 70.0] {
            let field = |radius: f64| {
                let (source, receiver) = (at(3.0, 60.0, 1.0), at(radius, degrees, 5.0));
                let path = EdgePath::new(
                    &wedge(angle, 2.0),
                    source,
                    receiver,
                    [0.0, 2.0],
                    Visibility::default(),
                    [1.0, 100.0],
                );
                path.field(k).into_iter().fold(Complex::ZERO, |a, b| a + b).norm()
            };
            assert!(field(0.0) < 1e-3 * field(0.1), "{}", field(0.0));
            let growth = (field(1e-4) / field(1e-6)).log10() / 2.0;
            assert!((growth - PI / angle).abs() < 0.01, "{growth}");
        }
    }
}

/// Edges much shorter than the wavelength radiate as much as they are long.
#[test]
fn an_edge_shorter_than_the_wavelength_fades_with_its_length() {
    let k = 2.0;
    let loudness = |length: f64| {
        let part = [25.0 - 0.5 * length, 25.0 + 0.5 * length];
        let path = EdgePath::new(
            &wedge(TAU, 50.0),
            at(4.0, 70.0, 25.0),
            at(3.0, 300.0, 25.5),
            part,
            Visibility::default(),
            [k, k],
        );
        path.field(k).into_iter().fold(Complex::ZERO, |a, b| a + b).norm()
    };
    for length in [0.3, 0.03, 0.003] {
        let ratio = loudness(length) / loudness(0.5 * length);
        assert!((ratio - 2.0).abs() < 0.01, "{length} m: {ratio}");
    }
    assert!((loudness(30.0) / loudness(15.0) - 2.0).abs() > 0.5, "long ones do not");
}

#[test]
fn exchange_of_source_and_receiver_changes_nothing() {
    let (a, b) = (at(4.0, 20.0, 3.0), at(0.7, 250.0, 8.0));
    let path = |from, to| {
        EdgePath::new(&wedge(1.5 * PI, 9.0), from, to, [0.0, 9.0], Visibility::default(), [1.0, 100.0])
    };
    for k in [1.0, 20.0] {
        for (there, back) in path(a, b).field(k).into_iter().zip(path(b, a).field(k)) {
            assert!((there - back).norm() < 1e-12 * there.norm().max(1e-3));
        }
    }
}

proptest::proptest! {
    /// Sources and receivers anywhere, on faces, on the edge and on its line included; edges of any length and angle.
    #[test]
    fn every_field_is_finite(
        angle in proptest::prop_oneof![proptest::strategy::Just(TAU), PI..TAU, PI..PI + 1e-6],
        length in proptest::prop_oneof![1e-4..1e-2, 0.1..50.0],
        radii in proptest::array::uniform2(proptest::prop_oneof![proptest::strategy::Just(0.0), 1e-7..1e-3, 0.01..100.0]),
        shares in proptest::array::uniform2(proptest::prop_oneof![proptest::strategy::Just(0.0), proptest::strategy::Just(1.0), 0.0..1.0]),
        along in proptest::array::uniform2(proptest::prop_oneof![proptest::strategy::Just(0.0), -60.0..60.0]),
    ) {
        let point = |i: usize| WedgePoint { radius: radii[i], angle: shares[i] * angle, along: along[i] };
        let path = EdgePath::new(&wedge(angle, length), point(0), point(1), [0.0, length], Visibility::default(), [0.5, 100.0]);
        let way = (point(0).radius - point(1).radius).hypot(along[0] - along[1]);
        for k in [0.5, 20.0, 200.0] {
            for term in path.field(k) {
                proptest::prop_assert!(term.re.is_finite() && term.im.is_finite());
                // No term is larger than the wave that it completes, but for that of a receiver at the source.
                proptest::prop_assert!(term.norm() * way <= 1.5 + 1e-6, "{}", term.norm() * way);
            }
        }
    }
}
