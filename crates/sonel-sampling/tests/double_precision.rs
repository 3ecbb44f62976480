//! The warps against the same maps in double precision, written down on their own: directions, densities, frames.
//!
//! Uniform numbers have 24 bits, so that all hard ones can be tried: both ends, quarter turns and their neighbours.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3, dvec3};
use sonel_sampling::{Frame, warp};

/// Distance between neighbouring uniform numbers.
const STEP: f64 = 1.0 / 16_777_216.0;
/// Rounding of one operation in `f32`.
const ROUNDING: f64 = 6e-8;

/// Uniform numbers: a coarse grid, both ends to the last bits, quarter turns and their neighbours.
fn numbers() -> Vec<f64> {
    let grid = (0..257).map(|at| f64::from(at) / 257.0);
    let low = [0.0, STEP, 2.0 * STEP, 3.0 * STEP, 1e3 * STEP, 1e5 * STEP];
    let turns = (1..8).flat_map(|eighth| {
        let at = f64::from(eighth) / 8.0;
        [at - STEP, at, at + STEP]
    });
    let all = grid.chain(low).chain(low.map(|at| 1.0 - STEP - at)).chain(turns);
    all.map(|at| (at / STEP).floor() * STEP).collect()
}

fn sphere([u, v]: [f64; 2]) -> DVec3 {
    let (z, radius) = (1.0 - 2.0 * u, 2.0 * (u * (1.0 - u)).sqrt());
    dvec3(radius * (TAU * v).cos(), radius * (TAU * v).sin(), z)
}

fn lambert([u, v]: [f64; 2]) -> DVec3 {
    dvec3(u.sqrt() * (TAU * v).cos(), u.sqrt() * (TAU * v).sin(), (1.0 - u).sqrt())
}

fn uniform_hemisphere([u, v]: [f64; 2]) -> DVec3 {
    let radius = (u * (2.0 - u)).sqrt();
    dvec3(radius * (TAU * v).cos(), radius * (TAU * v).sin(), 1.0 - u)
}

/// Largest distance between what a warp makes of the hard numbers and what `exact` does.
fn largest_deviation(warp: fn([f32; 2]) -> Vec3, exact: fn([f64; 2]) -> DVec3) -> f64 {
    let (numbers, mut largest) = (numbers(), 0.0_f64);
    for &u in &numbers {
        for &v in &numbers {
            let found = warp([u as f32, v as f32]);
            assert!(found.is_finite() && (found.length() - 1.0).abs() < 1e-6, "{u}, {v}: {found}");
            largest = largest.max(found.as_dvec3().distance(exact([u, v])));
        }
    }
    largest
}

/// Lambert directions to a few roundings. On the sphere 1 − z² cancels near the poles: half a rounding of 1, over twice the
/// radius where the square of z is first rounded, is 8e-7.
#[test]
fn directions_are_those_of_double_precision() {
    let on_sphere = largest_deviation(warp::uniform_sphere, sphere);
    let about_normal = largest_deviation(warp::cosine_hemisphere, lambert);
    println!("sphere {on_sphere:.1e}, Lambert {about_normal:.1e}");
    assert!(on_sphere < 1e-6, "{on_sphere:e}");
    assert!(about_normal < 6.0 * ROUNDING, "{about_normal:e}");
    let other = largest_deviation(warp::cosine_hemisphere, uniform_hemisphere);
    assert!(other > 0.1, "a uniform hemisphere is another law: {other:e}");
}

/// Towards the horizon cos θ falls to 2⁻¹² and keeps its relative precision: nothing cancels.
#[test]
fn grazing_cosines_keep_their_digits() {
    for u in numbers() {
        let (found, exact) = (f64::from(warp::cosine_hemisphere([u as f32, 0.3]).z), (1.0 - u).sqrt());
        assert!((found / exact - 1.0).abs() < 2.0 * ROUNDING, "{u}: {found} instead of {exact}");
    }
}

/// Deviation of a frame about `normal` from orthogonality and unit length.
fn crookedness([tangent, bitangent]: [Vec3; 2], normal: Vec3) -> f64 {
    let [t, b, n] = [tangent, bitangent, normal].map(Vec3::as_dvec3);
    let angles = [t.dot(b), t.dot(n), b.dot(n)].map(f64::abs);
    let lengths = [t, b].map(|axis| (axis.length() - 1.0).abs());
    angles
        .into_iter()
        .chain(lengths)
        .fold(0.0, |worst, off| if off.is_nan() { f64::INFINITY } else { worst.max(off) })
}

/// The frame without the sign of z in it, which divides by nothing at −z.
fn without_sign(normal: Vec3) -> [Vec3; 2] {
    let a = 1.0 / (1.0 + normal.z);
    let b = -normal.x * normal.y * a;
    [
        Vec3::new(1.0 - normal.x * normal.x * a, b, -normal.x),
        Vec3::new(b, 1.0 - normal.y * normal.y * a, -normal.y),
    ]
}

/// Frames about normals at and beside both poles.
#[test]
fn frames_stand_upright_beside_their_poles() {
    let (mut worst, mut other) = (0.0_f64, 0.0_f64);
    for tilt in [0.0, 1e-30, 1e-7, 1e-5, 3e-4, 1e-3, 0.1, 1.0, 1.57] {
        for turn in 0..32 {
            let about = TAU * f64::from(turn) / 32.0;
            for sign in [1.0, -1.0] {
                let (sine, cosine) = f64::sin_cos(tilt);
                let normal = dvec3(sine * about.cos(), sine * about.sin(), sign * cosine).as_vec3();
                let frame = Frame::about(normal);
                worst = worst.max(crookedness([frame.tangent, frame.bitangent], normal));
                other = other.max(crookedness(without_sign(normal), normal));
            }
        }
    }
    println!("frames {worst:.1e}, without the sign {other:.1e}");
    assert!(worst < 4.0 * ROUNDING, "{worst:e}");
    assert!(other > 1e-4, "without the sign frames fall over: {other:e}");
}
