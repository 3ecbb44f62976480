//! Directivities in SOFA (`sofa/make.py`): one source measured in three ways is one balloon with left, right, up and down where they belong; what
//! is none is refused.

use glam::{DVec3, dvec3};
use sonel_acoustics::{Balloon, BandWidth, Bands, Directivity};
use sonel_scene::load_balloon;

fn file(name: &str) -> Vec<u8> {
    std::fs::read(format!("{}/tests/sofa/{name}.sofa", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn read(name: &str, bands: &[f64]) -> Result<(Balloon, Vec<String>), String> {
    let bands = Bands::new(bands.to_vec(), BandWidth::Octave).unwrap();
    load_balloon(&format!("dir/{name}.sofa"), &file(name), &bands).map_err(|errors| errors.to_string())
}

/// The energy that the source has towards x ahead, y left, z up: mean 1 over the sphere.
fn energy(direction: DVec3, band: usize) -> f64 {
    1.0 + [1.0, -0.5][band] * direction.dot(dvec3(0.4, 0.25, 0.15))
}

/// Sources that aim anywhere have it ahead, to their left and above, to rounding in the directions that were measured, as they are nodes of the
/// grid in three planes; elsewhere within the error of linear interpolation, 30² / 8 of the second derivative and as much of the norm.
#[test]
fn a_source_has_its_sides_however_it_was_measured() {
    for name in ["spherical", "turned", "turntable"] {
        let (balloon, notes) = read(name, &[500.0, 1000.0]).unwrap();
        assert_eq!((balloon.shape(), balloon.name()), ([72, 37, 2], &*format!("{name}.sofa")));
        assert!(notes[0].starts_with("62 directions, 6 frequencies from 400 to 1250 Hz"), "{notes:?}");
        for (ahead, up) in [(DVec3::X, DVec3::Z), (dvec3(0.6, 0.0, 0.8), DVec3::Y)] {
            let left = up.cross(ahead);
            let directivity = Directivity::measured(balloon.clone(), ahead, up).unwrap();
            let off = |x: f64, y: f64, z: f64| {
                let found = directivity.towards(ahead, x * ahead + y * left + z * up);
                [0, 1]
                    .map(|band| (found.factor(band) / energy(dvec3(x, y, z), band) - 1.0).abs())
                    .into_iter()
                    .fold(0.0, f64::max)
            };
            let (half, root) = (0.5, 0.75_f64.sqrt());
            for (x, y, z) in [
                (1.0, 0.0, 0.0),
                (-1.0, 0.0, 0.0),
                (0.0, 1.0, 0.0),
                (0.0, -1.0, 0.0),
                (0.0, 0.0, 1.0),
                (0.0, 0.0, -1.0),
                (root, half, 0.0),
                (half, -root, 0.0),
                (-half, 0.0, root),
                (0.0, root, -half),
            ] {
                assert!(off(x, y, z) < 1e-6, "{name}: {x} {y} {z}: {}", off(x, y, z));
            }
            let between = off(0.48, 0.64, 0.6).max(off(-0.8, -0.36, 0.48));
            assert!(between < 2.0 * (30.0_f64.to_radians()).powi(2) / 8.0 * 0.5, "{name}: {between}");
        }
    }
}

#[test]
fn the_mean_over_the_sphere_is_one() {
    let (balloon, _) = read("turned", &[500.0, 1000.0]).unwrap();
    assert!([0, 1].iter().all(|band| (balloon.mean(*band) - 1.0).abs() < 1e-12));
    assert!((balloon.on_axis(0) - 1.4).abs() < 1e-6 && (balloon.on_axis(1) - 0.8).abs() < 1e-6);
}

#[test]
fn what_is_no_directivity_is_refused_with_a_reason() {
    for (name, expected) in [
        ("half", "37 directions leave a gap: none is within 30° of azimuth 0°, elevation -90°"),
        ("radians", "ReceiverPosition is in \"radian, radian, metre\"; degrees and metres are read"),
        (
            "hrtf",
            "the file holds the convention SimpleFreeFieldHRTF; a directivity is FreeFieldDirectivityTF",
        ),
        ("not-finite", "Data.Real or Data.Imag holds NaN"),
        ("at-the-source", "receiver 1 of measurement 1 is at the source, or nowhere"),
        ("upright", "SourceView and SourceUp of measurement 1 are no two directions"),
    ] {
        let said = read(name, &[500.0]).expect_err(name);
        assert!(said.starts_with(&format!("dir/{name}.sofa: ")) && said.contains(expected), "{name}: {said}");
    }
    let said = read("turned", &[63.0, 500.0, 4000.0]).unwrap_err();
    assert!(
        said.contains(
            "no frequency within the bands 63, 4000 Hz; the file has 6 frequencies from 400 to 1250 Hz"
        ),
        "{said}"
    );
    let bands = Bands::new(vec![500.0], BandWidth::Octave).unwrap();
    for cut in (0..file("spherical").len()).step_by(997) {
        assert!(load_balloon("d.sofa", &file("spherical")[..cut], &bands).is_err(), "cut at {cut}");
    }
    assert!(load_balloon("d.sofa", b"azimuth_deg,polar_deg,500", &bands).is_err());
}
