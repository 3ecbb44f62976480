//! Time and energy: very long, very quiet, very short, very near.

use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_analysis::{Parameter, Unsupported, parameters};
use sonel_map::{
    BandClasses, BatchStart, ChunkLedger, CoefficientTable, EmissionLayout, Event, Fate, PathWeight,
    Settings, Spectral,
};
use sonel_renderer::{Air, Estimator, RenderSettings, Renderer};
use sonel_scene::Scene;
use sonel_testkit::analytic::diffuse_sphere::DiffuseSphere;
use sonel_testkit::analytic::free_field;
use sonel_tests::{Traced, fluence, meshes};

use super::form;

const SPEED: f64 = 343.0;

/// A box of even walls with one band, without air.
fn even_box(size: [f64; 3], absorption: f64, scattering: f64, duration: f64) -> Scene {
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave");
    let mut scene = Scene::shoebox(size, Material::uniform("walls", absorption, scattering, 1), bands)
        .with_source("source", [1.5, 1.2, 1.3])
        .without_air_attenuation()
        .with_duration(duration);
    scene.speed_of_sound = SPEED;
    scene
}

/// T30 with its standard error where walls of α would make it `nominal` seconds by Eyring's formula, and what Eyring says.
fn long_reverberation(absorption: f64) -> ([f64; 2], f64) {
    let size = [12.0, 10.0, 8.0];
    let scene = even_box(size, absorption, 1.0, 60.0).with_receiver("receiver", [8.2, 6.7, 5.1]);
    let traced = Traced::new(scene, Settings { emissions: form(256, 8_000), ..Settings::default() });
    assert!(traced.ledger.worst_residual() < 1e-9);
    let settings = RenderSettings { bin: 0.01, ..RenderSettings::default() };
    let parameters = parameters(&traced.respond(settings));
    let t30 = parameters[0].bands[0].parameter(Parameter::T30).clone().expect("a decay by 35 dB");
    let surface = 2.0 * (12.0 * 10.0 + 10.0 * 8.0 + 8.0 * 12.0);
    let rate = SPEED * surface * -(-absorption).ln_1p() / (4.0 * 960.0);
    ([t30.value, t30.error.expect("batches").sigma], 6.0 * std::f64::consts::LN_10 / rate)
}

/// 60 s of reverberation: 3000 arrivals of every packet. Kuttruff's correction of Eyring is below a thousandth for walls
/// that reflect so much.
#[test]
fn a_minute_of_reverberation() {
    let ([t30, sigma], eyring) = long_reverberation(0.00435);
    println!("T30 {t30:.2} ± {sigma:.2} s, Eyring {eyring:.2} s");
    assert!(sigma < form(0.02, 0.005) * eyring, "too noisy to mean anything: {sigma}");
    assert!((t30 - eyring).abs() < 4.0 * sigma + 1e-3 * eyring, "{t30} ± {sigma} instead of {eyring}");
    let ([other, _], _) = long_reverberation(0.0048);
    assert!((other - eyring).abs() > 4.0 * sigma + 1e-3 * eyring, "α 0.0048 instead of 0.00435 is noticed");
}

/// Arrivals of one packet: three minutes of reverberation in a room of 6 m.
const ARRIVALS: u32 = 10_000;

/// Relative residual of the ledger of `packets` packets, and of a plain sum in `f32`.
fn drift(packets: u32) -> (f64, f64) {
    let walls = Material::uniform("walls", 1.0 / f64::from(ARRIVALS), 0.5, 1);
    let table = CoefficientTable::new(&[walls], 1, 0.0);
    let (mut weight, mut ledger) = (PathWeight::of(&table), ChunkLedger::new(1));
    let layout = EmissionLayout { total: u64::from(packets), bands: 1, sets: 1, batches: 1 };
    let batch = BatchStart::new(&layout, 0, Spectral::Shared);
    let row = table.material(0);
    let (mut single, mut remaining) = (0.0_f32, 0.0);
    for _ in 0..packets {
        weight.emit(1.0, 1.0, batch.packet(0));
        ledger.emitted(1.0, &batch.packet(0).expected, weight.energy());
        for arrival in 0..ARRIVALS {
            ledger.segment(weight.energy(), arrival > 0);
            ledger.arrived(weight.energy(), row);
            single += (weight.energy()[0][0] * row.dissipated[0][0]) as f32;
            weight.pass(&row.diffuse);
        }
        remaining += weight.energy()[0][0];
        ledger.segment(weight.energy(), true);
        ledger.ended(Event::Expired, weight.energy());
        ledger.close();
    }
    let ledger = ledger.finish(&BandClasses::separate(1));
    (ledger.worst_residual(), (1.0 - f64::from(single) - remaining).abs())
}

/// A thousand million arrivals in one ledger, which a run closes every 512 packets. What is left is 1 − α, which is rounded
/// once: 1e-16 of a packet at each of its arrivals.
#[test]
fn ledgers_do_not_drift() {
    let packets = form(300, 100_000);
    let (residual, single) = drift(packets);
    println!(
        "{packets} packets of {ARRIVALS} arrivals in one ledger: residual {residual:.1e}, in single precision {single:.1e}"
    );
    assert!(residual < 1e-11, "{residual:e}");
    assert!(single > 1e-4, "single precision is noticed: {single:e}");
}

/// Decay [dB] of a sphere of Lambert walls between two windows of 50 ms that begin at 0.4 s and `until` [s].
fn decay_in_sphere(absorption: f64, until: f64, settings: Settings) -> f64 {
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave");
    let walls = Material::uniform("walls", absorption, 1.0, 1);
    let mut scene = Scene::from_parts(meshes::sphere(5.0, 5), vec![walls], bands, until + 0.05)
        .with_source("source", [0.3, 0.2, 0.1])
        .with_receiver("receiver", [1.0, -0.5, 0.7])
        .without_air_attenuation();
    scene.speed_of_sound = SPEED;
    let traced = Traced::new(scene, settings);
    let settings =
        RenderSettings { bin: 0.05, estimator: Estimator::Connection, ..RenderSettings::default() };
    let rendering = traced.render(settings);
    let energy = |time: f64| rendering.total.get(0, (time / 0.05).round() as usize, 0);
    10.0 * (energy(0.4) / energy(until)).log10()
}

/// 200 dB below the first window the decay of a sphere is still its exact one: weights reach 1e-20 without roulette.
#[test]
fn two_hundred_decibels_of_decay() {
    let settings = Settings { emissions: form(1_000, 20_000), survival: 0.0, ..Settings::default() };
    let sphere = DiffuseSphere { radius: 5.0, absorption: 0.5, speed_of_sound: SPEED };
    let until = 1.75;
    let expected = 60.0 * (until - 0.4) / sphere.reverberation_time();
    let found = decay_in_sphere(0.5, until, settings);
    println!("decay of {found:.2} dB, expected {expected:.2} dB");
    assert!(expected > 200.0);
    // Weights e^(−a n) make the number of arrivals n count: its spread √n is 0.06 dB of the mean with so many packets.
    assert!((found - expected).abs() < form(1.0, 0.3), "{found} instead of {expected}");
    let other = decay_in_sphere(0.52, until, settings);
    assert!((other - expected).abs() > 2.0, "α 0.52 instead of 0.5 is noticed: {other}");
}

/// α = 0.999 without roulette: weights are (1 − α)^n down to 1e-270, subnormal beyond, and then nothing.
#[test]
fn weights_may_vanish() {
    let scene = even_box([6.0, 5.0, 4.0], 0.999, 0.5, 3.0).with_receiver("receiver", [4.2, 3.7, 2.1]);
    let settings = Settings { emissions: 64, survival: 0.0, ..Settings::default() };
    let traced = Traced::new(scene, settings);
    let (mut least, mut worst) = (f64::INFINITY, 0.0_f64);
    traced.for_each_segment(|_, share, segment| {
        let energy = 64.0 * share * segment.energy[0][0];
        assert!((0.0..=1.0 + 1e-9).contains(&energy), "{energy:e}");
        least = least.min(energy);
        let expected = (1.0_f64 - 0.999).powi(segment.history.order as i32);
        if expected > 1e-270 {
            worst = worst.max((energy / expected - 1.0).abs());
        }
    });
    println!("weights down to {least:.1e}, to {worst:.1e} of themselves while above 1e-270");
    assert!(worst < 1e-12 && least < 1e-280, "{worst:e}, {least:e}");
    assert_eq!(traced.ledger.fates.count(Fate::Expired), 64);
    assert!(traced.ledger.worst_residual() < 1e-9);
    let rendering = traced.render(RenderSettings::default());
    assert!((0..3000).all(|bin| rendering.total.get(0, bin, 0).is_finite()));
}

/// The same energy in bins of a microsecond and of a second; arrivals exactly on a border belong to the later bin.
#[test]
fn bins_of_any_width_hold_the_same_energy() {
    // Direct sound after c/128, of which every digit is exact: 1/128 s to the last bit.
    let scene =
        even_box([6.0, 5.0, 4.0], 0.3, 0.5, 0.2).with_receiver("receiver", [1.5 + SPEED / 128.0, 1.2, 1.3]);
    let traced = Traced::new(scene, Settings { emissions: 500, ..Settings::default() });
    let render = |bin: f64| traced.render(RenderSettings { bin, ..RenderSettings::default() });
    let all = |bin: f64, bins: usize| fluence(&render(bin), bins, 0, 0);
    let usual = all(0.001, 200);
    for (bin, bins) in [(1e-6, 200_000), (1.0, 1), (0.2, 1), (0.01, 20)] {
        let deviation = (all(bin, bins) / usual - 1.0).abs();
        println!("bins of {bin} s: {deviation:.1e}");
        assert!(deviation < 1e-12, "bins of {bin} s: {deviation:e}");
    }
    let direct = free_field(SPEED / 128.0, 0.0);
    let rendering = render(1.0 / 1024.0);
    assert!(rendering.total.get(0, 7, 0) < 1e-300, "nothing before the direct sound");
    assert!(rendering.total.get(0, 8, 0) >= direct * (1.0 - 1e-12));
}

/// The run ends before the direct sound: nothing arrives, and every parameter says why.
#[test]
fn a_run_shorter_than_the_direct_sound() {
    let scene = even_box([60.0, 5.0, 4.0], 0.3, 0.5, 0.05).with_receiver("receiver", [55.0, 3.7, 2.1]);
    let traced = Traced::new(scene, Settings { emissions: 500, ..Settings::default() });
    let parameters = parameters(&traced.respond(RenderSettings::default()));
    for parameter in Parameter::ALL {
        let reason = parameters[0].bands[0].parameter(parameter).as_ref().expect_err("no number");
        assert!(matches!(reason, Unsupported::NoEnergy | Unsupported::DirectOutside { .. }), "{reason:?}");
    }
}

/// Source and receiver from a metre to a micrometre apart, far below any wavelength: the direct sound is 1/(4πr²).
#[test]
fn the_direct_sound_below_a_wavelength() {
    for distance in [1.0, 1e-2, 1e-4, 1e-5] {
        let scene =
            even_box([6.0, 5.0, 4.0], 0.3, 0.5, 0.1).with_receiver("receiver", [1.5 + distance, 1.2, 1.3]);
        let traced = Traced::new(scene, Settings { emissions: 64, ..Settings::default() });
        let rendering = traced.render(RenderSettings::default());
        let found = rendering.arrivals[0].energy[0];
        // The difference of two coordinates that are rounded to 1e-16 m.
        let expected = free_field((1.5 + distance) - 1.5, 0.0);
        assert!((found / expected - 1.0).abs() < 1e-9, "{distance} m: {found:e} instead of {expected:e}");
    }
}

/// No map makes the renderer ask for more memory than any echogram is worth.
#[test]
fn echograms_beyond_all_measure_are_refused() {
    let scene = even_box([6.0, 5.0, 4.0], 0.3, 0.5, 1e300);
    let traced = Traced::new(scene, Settings { emissions: 64, ..Settings::default() });
    let air = Air::Attenuation(vec![1e-3]);
    for (settings, remedy) in [
        (RenderSettings::default(), "shorter `duration`"),
        (RenderSettings { bin: 1e299, air, ..RenderSettings::default() }, "without `air`"),
    ] {
        let refused = Renderer::new(&traced.map, &traced.geometry, settings).err().expect("too much");
        assert!(refused.to_string().contains(remedy), "{refused}");
    }
}
