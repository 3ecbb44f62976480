//! Receivers side by side: late sound has the coherence of a diffuse field, direct sound its exact delay.

mod walk;

use std::f64::consts::{PI, TAU};

use glam::{DVec3, dvec3};
use realfft::RealFftPlanner;
use realfft::num_complex::Complex;
use sonel_acoustics::Pattern;
use sonel_echogram::provenance::NearestSurface;
use sonel_echogram::{Arrivals, Provenance, Response};
use sonel_sound::{Channels, Microphone, SoundSettings, Synthesizer};

const OCTAVES: [f64; 8] = [63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];
const DISTANCES: [f64; 6] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5];
const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::new(0.6, 0.0, 0.8)];
const SPEED: f64 = 343.0;
const ROOM: SoundSettings =
    SoundSettings { volume: Some(200.0), up: DVec3::Z, seed: 1, sample_rate_hz: 48_000, within: None };
const PLACE: DVec3 = dvec3(5.0, 3.0, -1.0);
const RATE: f64 = 48_000.0;
/// Bins of 1 ms with late sound, as strong in each.
const LATE: std::ops::Range<usize> = 100..400;

/// Late sound at these places [m], a source at the origin, and direct sound where it is asked for.
fn response(places: &[DVec3], with_direct: bool) -> Response {
    let (bins, count) = (500, places.len());
    let mut energy = vec![0.0; count * OCTAVES.len() * bins];
    let mut arrivals = Arrivals::default();
    for (receiver, place) in places.iter().enumerate() {
        let time = place.length() / SPEED;
        let direct = 1.0 / (4.0 * PI * place.length_squared());
        let rows = receiver * OCTAVES.len()..(receiver + 1) * OCTAVES.len();
        for row in energy.chunks_exact_mut(bins).skip(rows.start).take(rows.len()) {
            if with_direct {
                row[(1000.0 * time) as usize] = direct;
            } else {
                row[LATE].fill(1.0);
            }
        }
        if with_direct {
            arrivals.source.push(0);
            arrivals.receiver.push(receiver as u32);
            arrivals.time_s.push(time);
            arrivals.energy.extend([direct; OCTAVES.len()]);
            arrivals.direction.extend((-*place / place.length()).to_array());
            arrivals.order.push(0);
            arrivals.kind.push(0);
        }
    }
    Response {
        center_frequency_hz: OCTAVES.to_vec(),
        time_edges_s: (0..=bins).map(|edge| edge as f64 * 0.001).collect(),
        receiver_names: (0..count).map(|number| number.to_string()).collect(),
        receiver_positions: places.iter().map(|place| place.to_array()).collect(),
        receiver_directivities: Vec::new(),
        source_names: vec!["stage".to_owned()],
        source_positions: vec![[0.0; 3]],
        source_power_level_db: vec![90.0; OCTAVES.len()],
        speed_of_sound: SPEED,
        characteristic_impedance: 412.0,
        direct_times_s: Vec::new(),
        energy,
        batches: None,
        missing: None,
        arrivals,
        directions: None,
        provenance: Provenance {
            nearest_surfaces: vec![NearestSurface { distance_m: 2.0, material: "wall".to_owned() }; count],
            ..Provenance::default()
        },
    }
}

type Spectrum = Vec<Complex<f64>>;

fn spectrum(pressure: &[f32]) -> Spectrum {
    let mut samples: Vec<f64> = pressure.iter().map(|sample| f64::from(*sample)).collect();
    samples.resize(1 << 15, 0.0);
    let plan = RealFftPlanner::new().plan_fft_forward(samples.len());
    let mut spectrum = plan.make_output_vec();
    plan.process(&mut samples, &mut spectrum).expect("buffers of the plan");
    spectrum
}

fn frequency(index: usize) -> f64 {
    index as f64 * RATE / f64::from(1 << 15)
}

/// Lines of the octave about `center` [Hz].
fn lines(center: f64) -> impl Iterator<Item = usize> {
    let of = |frequency: f64| (frequency * f64::from(1 << 15) / RATE).ceil() as usize;
    of(center * 0.5_f64.sqrt())..of(center * 2.0_f64.sqrt())
}

/// sin(kd)/kd.
fn diffuse(frequency: f64, distance: f64) -> f64 {
    let kd = TAU * frequency * distance / SPEED;
    kd.sin() / kd
}

/// Where the coherence of receivers differs from that of a diffuse field; the second one has the seed of the first, one of so many, plus `other`.
fn problems(seeds: u64, other: u64) -> Vec<String> {
    let mut places = vec![PLACE];
    places.extend(AXES.iter().flat_map(|axis| DISTANCES.map(|distance| PLACE + distance * *axis)));
    let response = response(&places, false);
    let mut sums = [[[0.0; 3]; OCTAVES.len()]; DISTANCES.len()];
    for seed in 1..=seeds {
        let of = |r: usize, seed: u64| {
            let synthesizer = Synthesizer::new(&response, SoundSettings { seed, ..ROOM });
            spectrum(&synthesizer.impulse_response(0, r).expect("arrivals of the echogram"))
        };
        let first = of(0, seed);
        for r in 1..places.len() {
            let second = of(r, seed + other);
            for (sums, center) in sums[(r - 1) % DISTANCES.len()].iter_mut().zip(OCTAVES) {
                for line in lines(center) {
                    let (a, b) = (first[line], second[line]);
                    for (sum, part) in sums.iter_mut().zip([(a * b.conj()).re, a.norm_sqr(), b.norm_sqr()]) {
                        *sum += part;
                    }
                }
            }
        }
    }
    let mut problems = Vec::new();
    for (sums, distance) in sums.iter().zip(DISTANCES) {
        for ([both, first, second], center) in sums.iter().zip(OCTAVES) {
            let found = both / (first * second).sqrt();
            let (sum, count) = lines(center).fold((0.0, 0.0), |(sum, count), line| {
                (sum + diffuse(frequency(line), distance), count + 1.0)
            });
            let expected = sum / count;
            // The standard error of a coherence over BT independent values is (1 − γ²)/√BT; one in 10⁴ tests is off by more in 48 values.
            let values = seeds as f64 * center * 0.5_f64.sqrt() * 0.001 * LATE.len() as f64;
            let allowed = 4.9 * (1.0 - expected * expected) / values.sqrt() + 0.001;
            if (found - expected).abs() > allowed {
                problems.push(format!(
                    "{center} Hz, {distance} m: {found:.4} instead of {expected:.4} ± {allowed:.4}"
                ));
            }
        }
    }
    problems
}

#[test]
fn late_sound_has_the_coherence_of_a_diffuse_field() {
    let found = problems(4, 0);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn draws_of_their_own_at_every_receiver_are_told_from_a_diffuse_field() {
    // At 63 … 500 Hz and all distances up to 5 cm, where a diffuse field has 0.9 and more.
    assert!(problems(1, 1000).len() > 20);
}

/// Two steps differ by 2 (1 − sin(kd)/kd) of the energy, each within its spread; a click would be a step that differs by more.
#[test]
fn a_receiver_that_moves_does_not_click() {
    let places: Vec<DVec3> = (0..30).map(|step| PLACE + 0.001 * f64::from(step) * AXES[2]).collect();
    let response = response(&places, false);
    let synthesizer = Synthesizer::new(&response, ROOM);
    let spectra: Vec<Spectrum> =
        (0..places.len()).map(|r| spectrum(&synthesizer.impulse_response(0, r).unwrap())).collect();
    for center in OCTAVES {
        let values = center * 0.5_f64.sqrt() * 0.001 * LATE.len() as f64;
        for pair in spectra.windows(2) {
            let (mut difference, mut energy, mut expected) = (0.0, 0.0, 0.0);
            for line in lines(center) {
                difference += (pair[1][line] - pair[0][line]).norm_sqr();
                energy += pair[0][line].norm_sqr();
                expected += 2.0 * pair[0][line].norm_sqr() * (1.0 - diffuse(frequency(line), 0.001));
            }
            // Beside this, few of 14 400 waves cross an end of the echogram: a step of 2.9 µs holds a seventh of a wave.
            let allowed = expected * (1.0 + 4.9 / values.sqrt()) + 4.0 / 14_400.0 * energy;
            assert!(
                difference < allowed,
                "{center} Hz: {:e}, not {:e}",
                difference / energy,
                allowed / energy
            );
        }
    }
}

/// To 0.1° of phase and 0.01 dB up to 20 kHz.
#[test]
fn direct_sound_has_the_delay_of_its_way() {
    let places: Vec<DVec3> = DISTANCES.iter().map(|distance| PLACE + *distance * AXES[1]).collect();
    let response = response(&places, true);
    let synthesizer = Synthesizer::new(&response, ROOM);
    for (r, place) in places.iter().enumerate() {
        let found = spectrum(&synthesizer.impulse_response(0, r).unwrap());
        for line in (1..(20_000.0 * f64::from(1 << 15) / RATE) as usize).step_by(97) {
            let expected =
                Complex::from_polar(1.0 / place.length(), -TAU * frequency(line) * place.length() / SPEED);
            let ratio = found[line] / expected;
            assert!((ratio - 1.0).norm() < 1.5e-3, "{r}, {} Hz: {ratio}", frequency(line));
        }
    }
}

fn microphone(position: DVec3) -> Microphone {
    Microphone { name: "mic".to_owned(), position, pattern: Pattern::Omni, aim: DVec3::X }
}

/// Late sound to the bit but for rounding where bins are alike, and direct sound to 0.1° and 0.01 dB: an array has what receivers at its microphones have.
#[test]
fn microphones_get_what_receivers_in_their_places_get() {
    let offsets: Vec<DVec3> =
        AXES.iter().zip([0.02, 0.1, 0.3]).map(|(axis, distance)| distance * *axis).collect();
    let array: Vec<Microphone> = offsets.iter().map(|offset| microphone(*offset)).collect();
    let mut places = vec![PLACE];
    places.extend(offsets.iter().map(|offset| PLACE + *offset));
    for with_direct in [true, false] {
        let response = response(&places, with_direct);
        let synthesizer = Synthesizer::new(&response, ROOM);
        let channels = synthesizer.heard((0, 0), Channels::Array(&array)).unwrap();
        for (r, channel) in channels.iter().enumerate() {
            let receiver = synthesizer.impulse_response(0, r + 1).unwrap();
            // Where late sound begins and ends, waves come with their bin at the receiver; those are spread by milliseconds.
            let inside = if with_direct { 0..receiver.len() } else { 6000..18_400 };
            let (mut difference, mut sum) = (0.0, 0.0);
            for at in inside {
                difference += f64::from(channel[at] - receiver[at]).powi(2);
                sum += f64::from(receiver[at]).powi(2);
            }
            assert!(difference < 1e-8 * sum, "{with_direct} {r}: {}", difference / sum);
        }
    }
}

/// A figure of eight that looks away from the source turns the sign of its direct sound; late sound needs directions, which this response has not.
#[test]
fn arrays_that_cannot_be_are_named() {
    let synthesized = |microphone: Microphone, response: &Response| {
        Synthesizer::new(response, ROOM)
            .heard((0, 0), Channels::Array(&[microphone]))
            .map_err(|error| error.to_string())
    };
    let response = response(&[PLACE], true);
    let eight = Microphone { pattern: Pattern::FigureEight, ..microphone(DVec3::ZERO) };
    for (microphone, message) in [
        (microphone(dvec3(1.2, 0.0, 0.0)), "at most 1 m"),
        (microphone(dvec3(f64::NAN, 0.0, 0.0)), "NaN m from its receiver"),
        (eight, "`directions`"),
    ] {
        assert!(synthesized(microphone, &response).unwrap_err().contains(message));
    }
    let mut beside = response;
    beside.provenance.nearest_surfaces =
        vec![NearestSurface { distance_m: 0.25, material: "screen".to_owned() }];
    assert!(synthesized(microphone(dvec3(0.0, 0.24, 0.0)), &beside).is_ok());
    let message = synthesized(microphone(dvec3(0.0, 0.25, 0.0)), &beside).unwrap_err();
    for part in
        ["\"mic\" is at [5, 3.25, -1] m", "\"0\"", "\"screen\"", "0.250 m; [5.000, 3.225, -1.000] m is free"]
    {
        assert!(message.contains(part), "{message}");
    }
    beside.provenance.nearest_surfaces.clear();
    assert!(synthesized(microphone(DVec3::ZERO), &beside).unwrap_err().contains("render it again"));
    let near = self::response(&[dvec3(0.3, 0.0, 0.0)], true);
    assert!(synthesized(microphone(dvec3(-0.295, 0.0, 0.0)), &near).unwrap_err().contains("from a source"));
    assert!(
        Synthesizer::new(&near, ROOM)
            .heard((0, 0), Channels::Array(&[]))
            .unwrap_err()
            .to_string()
            .contains("no microphones")
    );
}
