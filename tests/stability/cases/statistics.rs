//! Statistics: heavy tails among the batches are said, not hidden in an interval.

use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_analysis::{Parameter, parameters};
use sonel_echogram::Response;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::uniform::Uniform;
use sonel_tests::Traced;

use super::form;

fn response() -> Response {
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave");
    let scene = Scene::shoebox([6.0, 5.0, 4.0], Material::uniform("walls", 0.2, 0.5, 1), bands)
        .with_source("source", [1.5, 1.2, 1.3])
        .with_receiver("receiver", [4.2, 3.7, 2.1]);
    Traced::new(scene, Settings { emissions: 4_000, ..Settings::default() })
        .respond(RenderSettings::default())
}

fn normal(random: &mut Uniform) -> f64 {
    (-2.0 * (-random.next_f64()).ln_1p()).sqrt() * (std::f64::consts::TAU * random.next_f64()).cos()
}

/// The share of responses, each of whose batches is louder by a factor of its own, that warn of their level or refuse to state it.
fn warned(response: &Response, factor: impl Fn(&mut Uniform) -> f64) -> f64 {
    let mut random = Uniform::new(21);
    let runs = form(100, 2_000);
    let mut warned = 0;
    for _ in 0..runs {
        let mut response = response.clone();
        let batches = response.batches.as_mut().expect("batches");
        let length = batches.energy.len() / batches.weight.len();
        for batch in batches.energy.chunks_exact_mut(length) {
            let factor = factor(&mut random) as f32;
            batch.iter_mut().for_each(|energy| *energy *= factor);
        }
        let parameters = parameters(&response);
        let level = parameters[0].bands[0].parameter(Parameter::Level).as_ref();
        warned += u32::from(level.map_or(true, |level| level.warning.is_some()));
    }
    f64::from(warned) / f64::from(runs)
}

/// Batches that are normal are trusted; batches ruled by rare events are warned of.
#[test]
#[ignore = "long: cargo xtask accept"]
fn heavy_tails_are_said() {
    let response = response();
    let sound = warned(&response, |random| 1.0 + 0.05 * normal(random));
    let heavy = warned(&response, |random| (2.0 * normal(random)).exp());
    let rare = warned(&response, |random| if random.next_f64() < 0.03 { 50.0 } else { 1.0 });
    println!(
        "warned of: normal {sound:.3}, log-normal {heavy:.3}, one batch in thirty louder by 17 dB {rare:.3}"
    );
    assert!(sound < 0.04, "{sound}");
    assert!(heavy > 0.5, "{heavy}");
    // Of 32 batches none is loud with probability 0.38, exactly one with 0.37.
    assert!(rare > 0.2, "{rare}");
}
