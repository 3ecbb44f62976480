//! The boundary term: all but direct sound, by the factor of its band, in every estimator.

use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_map::Settings;
use sonel_renderer::{Estimator, PathClass, RenderSettings, Rendering};
use sonel_scene::Scene;
use sonel_tests::Traced;

const BANDS: [f64; 3] = [63.0, 250.0, 1000.0];
const SIZE: [f64; 3] = [8.0, 6.0, 4.0];

fn render(traced: &Traced, estimator: Estimator, boundary: bool) -> Rendering {
    traced.render(RenderSettings { boundary, ..RenderSettings::of(estimator) })
}

#[test]
fn all_but_direct_sound_is_lower_by_the_factor_of_its_band() {
    let bands = Bands::new(BANDS.to_vec(), BandWidth::Octave).expect("octaves");
    let walls =
        Material { absorption: vec![0.1, 0.2, 0.3], ..Material::uniform("walls", 0.1, 0.4, BANDS.len()) };
    let scene = Scene::shoebox(SIZE, walls, bands).with_source("source", [2.1, 1.7, 1.4]);
    let speed = scene.speed_of_sound;
    let scene = scene.with_receiver("receiver", [5.8, 4.3, 2.1]);
    let traced = Traced::new(scene, Settings { emissions: 500, seed: 3, ..Settings::default() });
    let [x, y, z] = SIZE;
    let (volume, area) = (x * y * z, 2.0 * (x * y + y * z + z * x));
    for estimator in [Estimator::Auto, Estimator::Gather, Estimator::Sphere] {
        let [with, without] = [true, false].map(|boundary| render(&traced, estimator, boundary));
        for (band, f) in BANDS.into_iter().enumerate() {
            let factor = with.boundary[0][band];
            let near: f64 = SIZE.iter().map(|length| (0.5 * speed / f / length).powi(3) / 3.0).sum();
            let inside = 1.0 / (1.0 + speed * area / (8.0 * volume * f)) + near;
            let expected = if f > 500.0 { 1.0 } else { inside };
            assert!((factor / expected - 1.0).abs() < 0.015, "{f} Hz: {factor} for {expected}");
            let direct = PathClass::Direct as usize;
            assert!((with.classes[direct].1[band] / without.classes[direct].1[band] - 1.0).abs() < 1e-12);
            let rest = |rendering: &Rendering| rendering.energy(0, band) - rendering.classes[direct].1[band];
            let found = rest(&with) / rest(&without);
            assert!((found / factor - 1.0).abs() < 1e-9, "{estimator:?}, {f} Hz: {found} for {factor}");
        }
    }
}
