//! Closed forms, double slopes, truncated records, and reasons where there is no number.

use super::*;
use crate::listed::Arrival;
use crate::modulation::{self, MODULATION_FREQUENCIES};
use sonel_testkit::exponential::ExponentialDecay;

const SCALE: Option<LevelScale> =
    Some(LevelScale { source_power_level_db: 90.0, characteristic_impedance: 400.0 });
const TIMES: [f64; 4] = [0.3, 1.0, 2.5, 8.0];
/// On a border of every width below, and on none.
const DIRECT_TIMES: [f64; 3] = [0.0, 0.02, 0.023_71];

/// Energy of `decay` that sets in at `direct_time`, in bins between `edges`.
fn bins(decay: ExponentialDecay, direct_time: f64, edges: &[f64]) -> Vec<f64> {
    let since = |edge: f64| (edge - direct_time).max(0.0);
    edges.windows(2).map(|pair| decay.energy_between(since(pair[0]), since(pair[1]))).collect()
}

fn equal_edges(width: f64, duration: f64) -> Vec<f64> {
    (0..=(duration / width).ceil() as usize).map(|edge| edge as f64 * width).collect()
}

/// Bins of 1, 2, 3, 1, 2, 3 … times `width`.
fn unequal_edges(width: f64, duration: f64) -> Vec<f64> {
    let mut edges = vec![0.0];
    while edges[edges.len() - 1] < duration {
        edges.push(edges[edges.len() - 1] + width * (1 + (edges.len() - 1) % 3) as f64);
    }
    edges
}

fn read(decay: ExponentialDecay, direct_time: f64, edges: &[f64]) -> Values {
    let energy = bins(decay, direct_time, edges);
    Values::read(Echogram { edges, energy: &energy, direct_time, arrivals: &[] }, SCALE)
}

fn all(values: &Values) -> [Result<f64, Unsupported>; PARAMETER_COUNT] {
    Parameter::ALL.map(|parameter| values.value(parameter))
}

/// Everything but level and strength, in the order of `Parameter::ALL`.
fn closed_forms(decay: ExponentialDecay) -> [f64; 7] {
    let time = decay.reverberation_time;
    let (c50, c80) = (decay.clarity_db(0.05), decay.clarity_db(0.08));
    [time, time, time, c50, c80, decay.definition(0.05), decay.center_time()]
}

/// Transfer index of an exponential decay, written down again.
fn transfer_index(decay: ExponentialDecay) -> f64 {
    let index = |frequency: &f64| {
        let m = decay.modulation_transfer(*frequency);
        ((10.0 * (m / (1.0 - m)).log10()).clamp(-15.0, 15.0) + 15.0) / 30.0
    };
    MODULATION_FREQUENCIES.iter().map(index).sum::<f64>() / 14.0
}

fn worst_error(values: &Values, decay: ExponentialDecay) -> f64 {
    let mut worst = 0.0_f64;
    for (value, expected) in all(values)[2..].iter().zip(closed_forms(decay)) {
        worst = worst.max((value.clone().unwrap() - expected).abs() / expected.abs().max(1e-3));
    }
    let curve = values.curve.as_ref().unwrap();
    let mut borders = modulation::Borders::default();
    let transfers = modulation::modulation_transfers(&[(curve, 1.0)], &mut borders);
    for (frequency, transfer) in MODULATION_FREQUENCIES.into_iter().zip(transfers) {
        worst = worst.max((transfer - decay.modulation_transfer(frequency)).abs());
    }
    let index = modulation::transfer_index(&[(curve, 1.0)], &mut borders, 1.0);
    let speech = modulation::speech_transmission_index(&[index; 7]);
    worst.max((index - transfer_index(decay)).abs()).max((speech - transfer_index(decay)).abs())
}

#[test]
fn the_parameters_of_every_response_are_the_first_ones() {
    for (index, parameter) in Parameter::ALL.into_iter().enumerate() {
        assert_eq!(parameter as usize, index, "{parameter:?}");
    }
}

/// docs/physics.md §8: closed forms to 1e-6, for any bins, onset on and off their borders, long and short records.
#[test]
fn exponential_decays_have_their_closed_forms() {
    for time in TIMES {
        let decay = ExponentialDecay { reverberation_time: time, energy: 0.02 };
        for direct_time in DIRECT_TIMES {
            for depth_db in [36.0, 60.0, 200.0] {
                let duration = direct_time + 0.1 + time * depth_db / 60.0;
                for edges in [
                    equal_edges(0.000_5, duration),
                    equal_edges(0.001, duration),
                    equal_edges(0.005, duration),
                    unequal_edges(0.002, duration),
                ] {
                    let error = worst_error(&read(decay, direct_time, &edges), decay);
                    assert!(error < 1e-6, "T {time}, t0 {direct_time}, {depth_db} dB: {error:e}");
                }
            }
        }
    }
}

/// Direct sound with a decay behind it: wide bins put it on the wrong side of limits and delay it.
#[test]
fn bins_too_wide_for_a_limit_are_refused() {
    let decay = ExponentialDecay { reverberation_time: 0.5, energy: 0.5 };
    let values = |width: f64| {
        let edges = equal_edges(width, 2.0);
        let mut energy = bins(decay, 0.02, &edges);
        energy[(0.02 / width).floor() as usize] += 0.5;
        all(&Values::read(
            Echogram { edges: &edges, energy: &energy, direct_time: 0.02, arrivals: &[] },
            SCALE,
        ))
    };
    let [c50, c80] = [0.05, 0.08].map(|limit: f64| {
        let late = 0.5 * (-decay.rate() * limit).exp();
        10.0 * ((1.0 - late) / late).log10()
    });
    let expected = [c50, c80, 1.0 - 0.5 * (-decay.rate() * 0.05).exp(), 0.5 / decay.rate()];
    for width in [0.001, 0.008] {
        for ((value, expected), parameter) in
            values(width)[5..].iter().zip(expected).zip(&Parameter::ALL[5..])
        {
            let error = (value.clone().unwrap() - expected).abs();
            assert!(error < parameter.just_noticeable(expected), "{parameter:?}, {width} s: {error}");
        }
    }
    let reasons: Vec<String> =
        values(0.2)[5..].iter().map(|value| value.clone().unwrap_err().to_string()).collect();
    for (reason, most) in reasons.iter().zip(["12.5", "20.0", "12.5", "10.0"]) {
        assert!(
            reason.contains(&format!("at most {most} ms are allowed: render with a shorter `bin`")),
            "{reason}"
        );
    }
    let single = values(2.0)[2..].iter().map(|value| value.clone().unwrap_err()).collect::<Vec<_>>();
    assert_eq!(single, vec![Unsupported::SingleBin; PARAMETER_COUNT - 2]);
}

#[test]
fn another_decay_has_other_figures() {
    let decay = ExponentialDecay { reverberation_time: 1.0, energy: 0.02 };
    let other = ExponentialDecay { reverberation_time: 1.000_1, energy: 0.02 };
    assert!(worst_error(&read(other, 0.02, &equal_edges(0.001, 3.0)), decay) > 1e-5);
    // An onset that is 0.1 ms late is seen as well.
    let edges = equal_edges(0.001, 3.0);
    let energy = bins(decay, 0.020_1, &edges);
    let late =
        Values::read(Echogram { edges: &edges, energy: &energy, direct_time: 0.02, arrivals: &[] }, SCALE);
    assert!(worst_error(&late, decay) > 1e-5);
}

#[test]
fn a_straight_decay_is_linear_and_not_curved() {
    let decay = ExponentialDecay { reverberation_time: 1.3, energy: 1.0 };
    let values = read(decay, 0.023_71, &equal_edges(0.001, 3.0));
    for parameter in [Parameter::T20, Parameter::T30] {
        let quality = values.quality(parameter).unwrap();
        assert!(quality.non_linearity_permille < 1e-6);
        assert!(quality.curvature_percent.unwrap().abs() < 1e-6);
    }
    assert_eq!(values.quality(Parameter::T30).unwrap().range_db.map(|x| x as i32), [-5, -35]);
    assert_eq!(values.quality(Parameter::EarlyDecayTime).unwrap().curvature_percent, None);
    assert!(values.quality(Parameter::ClarityC80).is_none());
}

#[test]
fn level_and_strength_are_those_of_the_recorded_energy() {
    // 1/(4π·100) is the free field at 10 m: G = 0 dB.
    let energy = [0.25, 0.75].map(|share| share / (400.0 * std::f64::consts::PI));
    let echogram = Echogram { edges: &[0.0, 0.001, 0.002], energy: &energy, direct_time: 0.0, arrivals: &[] };
    let values = Values::read(echogram, SCALE);
    assert!((values.value(Parameter::Level).unwrap() - 59.007_901).abs() < 1e-6);
    assert!(values.value(Parameter::Strength).unwrap().abs() < 1e-12);
}

/// Two slopes against the analytic curve: clarity and centre time exact, times by regression over fine samples.
#[test]
fn two_slopes_are_those_of_the_analytic_curve() {
    let fast = ExponentialDecay { reverberation_time: 0.5, energy: 0.9 };
    let slow = ExponentialDecay { reverberation_time: 2.5, energy: 0.1 };
    let (edges, direct_time) = (equal_edges(0.001, 6.0), 0.02);
    let energy: Vec<f64> = bins(fast, direct_time, &edges)
        .iter()
        .zip(bins(slow, direct_time, &edges))
        .map(|(a, b)| a + b)
        .collect();
    let values = Values::read(Echogram { edges: &edges, energy: &energy, direct_time, arrivals: &[] }, SCALE);
    let remaining = |t: f64| 0.9 * (-fast.rate() * t).exp() + 0.1 * (-slow.rate() * t).exp();
    let value = |parameter: Parameter| values.value(parameter).unwrap();
    for (parameter, limit) in [(Parameter::ClarityC50, 0.05), (Parameter::ClarityC80, 0.08)] {
        let expected = 10.0 * (1.0 / remaining(limit) - 1.0).log10();
        assert!((value(parameter) - expected).abs() < 1e-9);
    }
    let center = 0.9 / fast.rate() + 0.1 / slow.rate();
    // A level that is linear within bins of width h errs by h²/12 (ln S)'' on average, at most (k₁ − k₂)²/4.
    let interpolation = 1e-6 / 12.0 * 0.25 * (fast.rate() - slow.rate()).powi(2);
    assert!((value(Parameter::CenterTime) / center - 1.0).abs() < interpolation);
    for (parameter, range) in [
        (Parameter::EarlyDecayTime, DecayRange::EARLY),
        (Parameter::T20, DecayRange::T20),
        (Parameter::T30, DecayRange::T30),
    ] {
        let expected = sampled_regression(&remaining, range);
        let error = value(parameter) / expected - 1.0;
        assert!(error.abs() < 1e-4, "{parameter:?}: {} not {expected}", value(parameter));
    }
    let sampled = [DecayRange::T30, DecayRange::T20].map(|range| sampled_regression(&remaining, range));
    let quality = values.quality(Parameter::T30).unwrap();
    let curvature = 100.0 * (sampled[0] / sampled[1] - 1.0);
    assert!((quality.curvature_percent.unwrap() / curvature - 1.0).abs() < 1e-3, "{quality:?}");
    // ISO 3382-2 annex B: above 10 ‰ a decay is far from a straight line.
    assert!(quality.non_linearity_permille > 10.0, "{quality:?}");
}

/// Regression over samples of 10 µs.
fn sampled_regression(remaining: &dyn Fn(f64) -> f64, range: DecayRange) -> f64 {
    let level = |t: f64| 10.0 * remaining(t).log10();
    let points: Vec<(f64, f64)> = (0..300_000)
        .map(|i| (f64::from(i) * 1e-5, level(f64::from(i) * 1e-5)))
        .filter(|(_, level)| *level <= range.from_db && *level >= range.to_db)
        .collect();
    let count = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / count, sum.1 + p.1 / count));
    let covariance: f64 = points.iter().map(|p| (p.0 - mean.0) * (p.1 - mean.1)).sum();
    let variance: f64 = points.iter().map(|p| (p.0 - mean.0) * (p.0 - mean.0)).sum();
    -60.0 * variance / covariance
}

/// Truncated at −38 dB: exact with the tail, percents off without.
#[test]
fn the_tail_beyond_the_record_is_compensated() {
    let decay = ExponentialDecay { reverberation_time: 1.0, energy: 1.0 };
    let edges = equal_edges(0.001, 38.0 / 60.0);
    let t30 = read(decay, 0.0, &edges).value(Parameter::T30).unwrap();
    assert!((t30 - 1.0).abs() < 1e-6);
    let plain = sonel_testkit::decay::reverberation_time(&bins(decay, 0.0, &edges), 0.001, -5.0, -35.0);
    assert!((plain - 1.0).abs() > 0.02, "{plain}");
}

#[test]
fn what_the_record_does_not_reach_has_a_reason() {
    let decay = ExponentialDecay { reverberation_time: 1.0, energy: 1.0 };
    let values = |depth_db: f64| all(&read(decay, 0.0, &equal_edges(0.001, depth_db / 60.0)));
    let reason = |values: &[Result<f64, Unsupported>], parameter: Parameter| {
        values[parameter as usize].clone().unwrap_err().to_string()
    };
    let of_30_db = values(30.0);
    assert!(of_30_db[Parameter::T20 as usize].is_ok());
    assert!(reason(&of_30_db, Parameter::T30).contains("reaches only -30.0 dB, -35 dB are needed"));
    let of_12_db = values(12.0);
    assert!(of_12_db[Parameter::EarlyDecayTime as usize].is_ok());
    assert!(reason(&of_12_db, Parameter::T20).contains("-25 dB"));
    let of_5_db = values(5.0);
    assert!(of_5_db[Parameter::Strength as usize].is_ok());
    assert!(reason(&of_5_db, Parameter::ClarityC80).contains("5.0 dB of the decay"));
}

#[test]
fn an_echogram_without_decay_has_reasons_and_no_numbers() {
    let edges = equal_edges(0.01, 1.0);
    let reasons = |energy: &[f64], direct_time: f64| -> Vec<Unsupported> {
        let values = Values::read(Echogram { edges: &edges, energy, direct_time, arrivals: &[] }, SCALE);
        all(&values).into_iter().filter_map(Result::err).collect()
    };
    let mut energy = [0.0; 100];
    assert_eq!(reasons(&energy, 0.1), vec![Unsupported::NoEnergy; PARAMETER_COUNT]);
    let too_short = Unsupported::DirectOutside { direct_time: 1.5, end: 1.0 };
    assert_eq!(reasons(&energy, 1.5), vec![too_short; PARAMETER_COUNT]);
    energy[10] = 1.0;
    // Direct sound alone: it has a level, early energy and a centre, but neither late energy nor a slope.
    let direct_alone = reasons(&energy, 0.1);
    let (times, ratios) = direct_alone.split_at(3);
    assert!(times.iter().all(|reason| matches!(reason, Unsupported::TooSteep { .. })), "{direct_alone:?}");
    assert!(
        ratios.iter().all(|reason| matches!(reason, Unsupported::NothingLate { .. })),
        "{direct_alone:?}"
    );
    assert_eq!(ratios.last(), Some(&Unsupported::NothingLate { limit_ms: 80.0 }));
    assert!(matches!(reasons(&energy, 1.5)[0], Unsupported::DirectOutside { .. }));
    assert_eq!(reasons(&energy, 0.5)[0], Unsupported::NoReverberation);
    assert_eq!(reasons(&[1.0; 100], 0.1), vec![Unsupported::NotDecaying; PARAMETER_COUNT - 2]);
}

/// Direct sound, reflections next to the limits of 50 and 80 ms and a decay, in bins that no limit is a border of: with their times all
/// parameters are right; without, EDT and clarity are wrong by more than a tenth of what is noticeable.
#[test]
fn listed_arrivals_are_divided_at_their_own_times() {
    let decay = ExponentialDecay { reverberation_time: 0.9, energy: 0.3 };
    let direct_time = 0.010_3;
    let reflections = [(0.0, 0.4), (0.007_2, 0.1), (0.049_6, 0.1), (0.050_4, 0.05), (0.080_3, 0.05)];
    let arrivals = reflections.map(|(time, energy)| Arrival { time: direct_time + time, energy });
    let edges = equal_edges(0.001, 2.5);
    let mut energy = bins(decay, direct_time, &edges);
    for arrival in &arrivals {
        energy[(arrival.time / 0.001).floor() as usize] += arrival.energy;
    }
    let read = |arrivals: &[Arrival]| {
        all(&Values::read(Echogram { edges: &edges, energy: &energy, direct_time, arrivals }, SCALE))
    };
    let remaining = |t: f64| {
        let listed = reflections.iter().filter(|(time, _)| *time >= t).map(|(_, energy)| energy);
        0.3 * (-decay.rate() * t).exp() + listed.sum::<f64>()
    };
    let clarity = |limit: f64| 10.0 * (1.0 / remaining(limit) - 1.0).log10();
    let center: f64 =
        0.3 / decay.rate() + reflections.iter().map(|(time, energy)| time * energy).sum::<f64>();
    let edt = sampled_regression(&remaining, DecayRange::EARLY);
    let expected = [clarity(0.05), clarity(0.08), 1.0 - remaining(0.05), center];
    let (exact, binned) = (read(&arrivals), read(&[]));
    for ((found, expected), parameter) in exact[5..].iter().zip(expected).zip(&Parameter::ALL[5..]) {
        // The level between two points is linear, that of a decay with reflections to come is not: 10⁻⁴ of it within a bin.
        assert!((found.clone().unwrap() - expected).abs() < 1e-4, "{parameter:?}: {found:?} not {expected}");
    }
    let error = |values: &[Result<f64, Unsupported>]| values[2].clone().unwrap() / edt - 1.0;
    assert!(error(&exact).abs() < 3e-4 && error(&binned).abs() > 5e-3, "{exact:?} {binned:?}, not {edt}");
    assert!((binned[6].clone().unwrap() - expected[1]).abs() > 0.1, "{binned:?}");
}

/// Rounding may put an arrival into the bin before the border that it lies on, and batches are rounded to single precision: no energy
/// counts twice, and none appears.
#[test]
fn a_listed_arrival_is_taken_from_the_bin_that_holds_it() {
    let decay = ExponentialDecay { reverberation_time: 0.3, energy: 0.1 };
    let edges = equal_edges(0.001, 0.4);
    let mut energy = bins(decay, 0.0, &edges);
    energy[49] += 1.0;
    for (time, energy_listed) in [(0.05, 1.0), (0.049_3, 1.000_000_06), (0.049_3, 7.0)] {
        let arrivals = [Arrival { time, energy: energy_listed }];
        let echogram = Echogram { edges: &edges, energy: &energy, direct_time: 0.0, arrivals: &arrivals };
        let curve = DecayCurve::new(echogram).unwrap();
        let early = curve.remaining(0.0).unwrap() - curve.remaining(0.049).unwrap();
        let late = curve.remaining(0.05).unwrap();
        assert!((early - decay.energy_between(0.0, 0.049)).abs() < 1e-12, "{early}");
        let listed = if time < 0.05 { 0.0 } else { 1.0 };
        assert!((late - listed - decay.energy_between(0.05, 1e3)).abs() < 1e-9, "{late}");
    }
}

#[test]
fn every_parameter_is_known_by_its_key_and_by_its_short_name() {
    for (index, parameter) in Parameter::EVERY.into_iter().enumerate() {
        assert_eq!(parameter as usize, index);
        for name in [parameter.key().to_owned(), parameter.short_name().to_uppercase()] {
            assert_eq!(Parameter::named(&name), Some(parameter), "{name}");
        }
    }
    assert_eq!(Parameter::named("rt60"), None);
}
