//! The boundary term: less absorption, and all but direct sound by the factor of its band, in every estimator.

use glam::{DMat3, DVec3};
use sonel_acoustics::modes::spared;
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_map::Settings;
use sonel_renderer::{Estimator, PathClass, RenderSettings, Rendering};
use sonel_scene::Scene;
use sonel_tests::Traced;

const BANDS: [f64; 3] = [63.0, 250.0, 1000.0];
const SIZE: [f64; 3] = [8.0, 6.0, 4.0];
const ABSORPTION: [f64; 3] = [0.1, 0.2, 0.3];

fn render(traced: &Traced, estimator: Estimator, boundary: bool) -> Rendering {
    traced.render(RenderSettings { boundary, ..RenderSettings::of(estimator) })
}

fn walls(absorption: Vec<f64>) -> Material {
    Material { absorption, ..Material::uniform("walls", 0.1, 0.4, BANDS.len()) }
}

/// Against the same packets between walls that absorb as modes in a box are counted (sonel-acoustics), times what levels change by.
#[test]
fn walls_absorb_less_and_all_but_direct_sound_is_lower() {
    let bands = Bands::new(BANDS.to_vec(), BandWidth::Octave).expect("octaves");
    let scene =
        Scene::shoebox(SIZE, walls(ABSORPTION.to_vec()), bands).with_source("source", [2.1, 1.7, 1.4]);
    let wavelength = |f: f64| if f > 500.0 { 0.0 } else { scene.speed_of_sound / f };
    let by_size = DMat3::from_diagonal(DVec3::from_array(SIZE).recip());
    let absorbed = BANDS.map(|f| 1.0 - spared(by_size, wavelength(f)));
    let [x, y, z] = SIZE;
    let (volume, area) = (x * y * z, 2.0 * (x * y + y * z + z * x));
    let scene = scene.clone().with_receiver("receiver", [5.8, 4.3, 2.1]);
    let traced = || Traced::new(scene.clone(), Settings { emissions: 500, seed: 3, ..Settings::default() });
    let (mut less, as_drawn) = (traced(), traced());
    let absorption = ABSORPTION.into_iter().zip(absorbed).map(|(alpha, absorbed)| alpha * absorbed).collect();
    less.map.change(vec![walls(absorption)], scene.sources.clone());
    for estimator in [Estimator::Auto, Estimator::Gather, Estimator::Sphere] {
        let (with, without) = (render(&as_drawn, estimator, true), render(&less, estimator, false));
        for (band, f) in BANDS.into_iter().enumerate() {
            let factor = with.boundary[0][band];
            let layers = wavelength(f) * area / (8.0 * volume);
            let near: f64 = SIZE.iter().map(|length| (0.5 * wavelength(f) / length).powi(3) / 3.0).sum();
            let expected = absorbed[band] / (1.0 + layers) + near;
            assert!((factor / expected - 1.0).abs() < 0.015, "{f} Hz: {factor} for {expected}");
            let direct = PathClass::Direct as usize;
            assert!((with.classes[direct].1[band] / without.classes[direct].1[band] - 1.0).abs() < 1e-12);
            let rest = |rendering: &Rendering| rendering.energy(0, band) - rendering.classes[direct].1[band];
            let (found, expected) = (rest(&with) / rest(&without), factor * absorbed[band]);
            assert!((found / expected - 1.0).abs() < 0.01, "{estimator:?}, {f} Hz: {found} for {expected}");
        }
        let steady = render(&as_drawn, estimator, false);
        let change = with.energy(0, 0) / steady.energy(0, 0);
        assert!(change < 0.95, "{estimator:?}: levels fall, whatever walls absorb: {change}");
    }
}
