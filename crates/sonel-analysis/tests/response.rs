//! Whole responses: intervals from batches, reasons where there are none, the shape of the output.

use sonel_acoustics::{BandWidth, SourceChange};
use sonel_analysis::average::single_number;
use sonel_analysis::comparison::{Pairing, compare};
use sonel_analysis::estimate::NoInterval;
use sonel_analysis::modulation::{SPEECH_OCTAVES, Talk};
use sonel_analysis::receiver::parameters_of;
use sonel_analysis::{Estimate, Parameter, ParameterValue, Unsupported, parameters, report};
use sonel_echogram::{Arrivals, Batches, Response, batch_time_edges};
use sonel_testkit::exponential::ExponentialDecay;
use sonel_testkit::uniform::Uniform;

const DECAY: ExponentialDecay = ExponentialDecay { reverberation_time: 0.8, energy: 0.01 };
const DURATION: f64 = 1.2;
/// 3.43 m at 343 m/s.
const DIRECT_TIME: f64 = 0.01;

fn decay_between(edges: &[f64]) -> Vec<f64> {
    let since = |edge: f64| (edge - DIRECT_TIME).max(0.0);
    edges.windows(2).map(|pair| DECAY.energy_between(since(pair[0]), since(pair[1]))).collect()
}

/// One source, one receiver, the octaves of speech; `weight` and `batch` make the batches.
fn response(weight: &[f64], mut batch: impl FnMut(&[f64]) -> Vec<f32>) -> Response {
    let bands = SPEECH_OCTAVES.len();
    let fine: Vec<f64> = (0..=1200).map(|edge| f64::from(edge) * 0.001).collect();
    let coarse = batch_time_edges(DIRECT_TIME, DURATION);
    let mean = decay_between(&coarse);
    let energy: Vec<f32> = (0..weight.len() * bands).flat_map(|_| batch(&mean)).collect();
    Response {
        center_frequency_hz: SPEECH_OCTAVES.to_vec(),
        energy: decay_between(&fine).repeat(bands),
        time_edges_s: fine,
        receiver_names: vec!["seat 12".into()],
        receiver_positions: vec![[3.43, 0.0, 0.0]],
        receiver_directivities: Vec::new(),
        source_names: vec!["stage".into()],
        source_positions: vec![[0.0; 3]],
        source_power_level_db: vec![90.0; bands],
        speed_of_sound: 343.0,
        characteristic_impedance: 413.0,
        direct_times_s: Vec::new(),
        batches: (!weight.is_empty()).then(|| Batches {
            weight: weight.to_vec(),
            bins: coarse.len() - 1,
            time_edges_s: coarse,
            energy,
            kernel_difference: Vec::new(),
        }),
        missing: None,
        arrivals: Arrivals::default(),
        directions: None,
        provenance: Default::default(),
    }
}

fn certain(mean: &[f64]) -> Vec<f32> {
    mean.iter().map(|energy| *energy as f32).collect()
}

/// Discs of half the area find one part in a hundred less: the bias is two, and the interval extends to its side, for a band and for a mean of
/// bands. A decay that is off by the same part everywhere is as steep as before.
#[test]
fn the_bias_of_discs_extends_the_interval_to_its_side() {
    let mut biased = response(&[0.25; 4], certain);
    let batches = biased.batches.as_mut().expect("four batches");
    batches.kernel_difference = batches.energy.iter().map(|energy| -0.01 * energy).collect();
    let parameters = parameters(&biased);
    let sides = |estimate: ParameterValue| {
        let Estimate { value, interval, .. } = estimate.unwrap();
        interval.unwrap().map(|end| end - value)
    };
    let expected = 10.0 * 0.98_f64.log10();
    let level = parameters[0].bands[3].parameter(Parameter::Level).clone();
    for level in [level, single_number(&parameters[0], Parameter::Level)] {
        let [below, above] = sides(level);
        assert!((below / expected - 1.0).abs() < 1e-4 && above.abs() < 1e-6, "{below} {above}");
    }
    assert!(
        sides(parameters[0].bands[3].parameter(Parameter::T30).clone()).iter().all(|side| side.abs() < 1e-6)
    );
}

#[test]
fn values_are_the_closed_forms_and_certain_batches_have_no_width() {
    let parameters = parameters(&response(&[0.25; 4], certain));
    let band = &parameters[0].bands[3];
    for (parameter, expected) in [
        (Parameter::EarlyDecayTime, 0.8),
        (Parameter::T20, 0.8),
        (Parameter::T30, 0.8),
        (Parameter::ClarityC50, DECAY.clarity_db(0.05)),
        (Parameter::ClarityC80, DECAY.clarity_db(0.08)),
        (Parameter::DefinitionD50, DECAY.definition(0.05)),
        (Parameter::CenterTime, DECAY.center_time()),
    ] {
        let estimate = band.parameter(parameter).as_ref().unwrap();
        assert!((estimate.value - expected).abs() < 1e-6, "{parameter:?}: {}", estimate.value);
        let [low, high] = estimate.interval.clone().unwrap();
        assert!(high - low <= 0.0 && estimate.warning.is_none(), "{parameter:?}: {low} … {high}");
    }
    assert!(parameters.iter().flat_map(|receiver| receiver.parameters()).all(Result::is_ok));
}

#[test]
fn without_a_spread_there_are_values_with_a_reason() {
    for (weights, reason) in [(&[][..], NoInterval::NoBatches), (&[1.0], NoInterval::OneBatch)] {
        let parameters = parameters(&response(weights, certain));
        for estimate in parameters[0].parameters() {
            assert_eq!(estimate.as_ref().unwrap().interval, Err(reason.clone()));
        }
    }
    // A batch of no weight does not count.
    let parameters = parameters(&response(&[1.0, 0.0], certain));
    assert_eq!(parameters[0].speech_transmission_index.as_ref().unwrap().interval, Err(NoInterval::OneBatch));
}

#[test]
fn an_empty_echogram_has_reasons_everywhere() {
    let mut silent = response(&[0.5; 2], |mean| vec![0.0; mean.len()]);
    silent.energy.fill(0.0);
    let parameters = parameters(&silent);
    for estimate in
        parameters[0].bands.iter().flat_map(|band| Parameter::ALL.map(|which| band.parameter(which)))
    {
        assert_eq!(*estimate, Err(Unsupported::NoEnergy));
    }
    let speech = parameters[0].speech_transmission_index.as_ref().unwrap_err().to_string();
    assert_eq!(speech, "at 125 Hz: no energy arrives");
}

#[test]
fn speech_needs_its_octaves() {
    let mut narrow = response(&[], certain);
    narrow.center_frequency_hz[0] = 63.0;
    let missing = parameters(&narrow)[0].speech_transmission_index.as_ref().unwrap_err().to_string();
    assert_eq!(missing, "speech needs the octaves 125 to 8000 Hz; missing: 125 Hz");
}

/// Thirds of 0.5, 0.8 and 1.6 s whose powers are 3, 0 and −4 dB, and the octaves that they add up to.
#[test]
fn speech_in_third_octaves_is_that_of_the_octaves_they_add_up_to() {
    let of = |power: [f64; 3]| {
        let mut octaves = response(&[], certain);
        let weight = power.map(|level| libm::pow(10.0, 0.1 * level));
        let edges = octaves.time_edges_s.clone();
        let thirds = [0.5, 0.8, 1.6].map(|reverberation_time| {
            let decay = ExponentialDecay { reverberation_time, energy: 0.01 };
            let since = |edge: f64| (edge - DIRECT_TIME).max(0.0);
            let bins = edges.windows(2).map(|pair| decay.energy_between(since(pair[0]), since(pair[1])));
            bins.collect::<Vec<f64>>()
        });
        let sum = |bin: usize| (0..3).map(|k| weight[k] * thirds[k][bin]).sum::<f64>();
        octaves.energy = (0..edges.len() - 1).map(sum).collect::<Vec<_>>().repeat(SPEECH_OCTAVES.len());
        let all = BandWidth::Third.nominal_series().filter(|hz| (100.0..=10_000.0).contains(hz));
        let mut narrow = octaves.clone();
        narrow.center_frequency_hz = all.collect();
        narrow.energy = thirds.concat().repeat(SPEECH_OCTAVES.len());
        narrow.source_power_level_db = power.repeat(SPEECH_OCTAVES.len());
        [octaves, narrow].map(|response| {
            parameters(&response)[0].speech_transmission_index.as_ref().expect("an index").value
        })
    };
    let [octaves, thirds] = of([3.0, 0.0, -4.0]);
    assert!((octaves - thirds).abs() < 1e-4, "{octaves} {thirds}");
    let [_, alike] = of([0.0; 3]);
    assert!((octaves - alike).abs() > 0.01, "thirds of equal power are another octave");
}

/// Two loudspeakers whose decays are alike, the second 6 dB lower, and then a source that radiates as much as both.
#[test]
fn each_source_of_a_system_radiates_the_speech_with_its_gain() {
    let one = response(&[], certain);
    let mut two = one.clone();
    two.energy = one.energy.repeat(2);
    two.source_names.push("rear".into());
    two.source_positions.push([0.0; 3]);
    two.source_power_level_db = one.source_power_level_db.repeat(2);
    let noise_level_db = [40.0; 7];
    let talk = |power: f64| Talk { power_level_db: Some([power; 7]), noise_level_db };
    let found = |response: &Response, power: f64| {
        let row = parameters_of(response, Some(&talk(power))).swap_remove(0);
        let ratio = row.in_noise.clone().expect("noise").signal_to_noise_db.expect("a ratio").value;
        (ratio, row.speech_transmission_index.expect("an index"))
    };
    let lower = SourceChange { gain_db: -6.0, delay: 0.0 };
    let (ratio, index) = found(&two.together(&[SourceChange::default(), lower]), 60.0);
    let louder = 10.0 * libm::log10(1.0 + libm::pow(10.0, -0.6));
    let (expected, same) = found(&one, 60.0 + louder);
    assert!((ratio - expected).abs() < 1e-9 && (index.value - same.value).abs() < 1e-9, "{ratio} {expected}");
    assert!((ratio - found(&one, 60.0).0).abs() > 0.9, "one talker's power would be found out");
    // Without gains or delays they may be talkers.
    let (_, alike) = found(&two.together(&[SourceChange::default(); 2]), 60.0);
    assert!(index.warning.is_none() && alike.warning.is_some_and(|text| text.contains("different talkers")));
}

/// 95 % intervals over responses with noisy batches of unequal weight hold the closed forms in 90 … 99 % of the runs
/// (docs/physics.md §7): a perfect interval passes with 0.998 a parameter. Half as wide they do not.
#[test]
#[ignore = "long: cargo xtask accept"]
fn intervals_of_noisy_responses_cover_the_closed_forms() {
    const RUNS: usize = 200;
    let weights: Vec<f64> = (0..16).map(|g| [0.05, 0.075][g % 2]).collect();
    let checked =
        [Parameter::Strength, Parameter::T20, Parameter::T30, Parameter::ClarityC80, Parameter::CenterTime];
    let (mut covered, mut half_covered) = ([0; 6], [0; 6]);
    for run in 0..RUNS {
        let parameters = parameters(&noisy_response(&weights, run as u64));
        let band = &parameters[0].bands[2];
        let strength =
            10.0 * (400.0 * std::f64::consts::PI * DECAY.energy_between(0.0, DURATION - DIRECT_TIME)).log10();
        let truths = [strength, 0.8, 0.8, DECAY.clarity_db(0.08), DECAY.center_time(), speech_truth()];
        let estimates = checked
            .iter()
            .map(|which| band.parameter(*which))
            .chain([&parameters[0].speech_transmission_index]);
        for (at, (estimate, truth)) in estimates.zip(truths).enumerate() {
            let estimate = estimate.as_ref().unwrap();
            let [low, high] = estimate.interval.clone().unwrap();
            let miss = (estimate.value - truth).abs() / (0.5 * (high - low));
            covered[at] += usize::from(miss <= 1.0);
            half_covered[at] += usize::from(miss <= 0.5);
        }
    }
    let accepted = RUNS * 90 / 100..=RUNS * 99 / 100;
    assert!(covered.iter().all(|count| accepted.contains(count)), "{covered:?}");
    assert!(half_covered.iter().all(|count| !accepted.contains(count)), "{half_covered:?}");
}

/// Batches whose bins scatter by 5 % over √weight, in coarse bins, which are the fine ones as well.
fn noisy_response(weights: &[f64], seed: u64) -> Response {
    let mut numbers = Uniform::new(seed);
    let mut index = 0;
    let bands = SPEECH_OCTAVES.len();
    let mut noisy = response(weights, |mean| {
        let sigma = 0.05 / (weights[index / bands] * 16.0).sqrt();
        index += 1;
        // Uniform in ±√3 σ: bounded, so no energy is negative.
        mean.iter()
            .map(|e| (e * (1.0 + sigma * 3.0_f64.sqrt() * numbers.between(-1.0, 1.0))) as f32)
            .collect()
    });
    let batches = noisy.batches.as_ref().expect("made with batches");
    let row = bands * batches.bins;
    noisy.energy = (0..row)
        .map(|at| {
            weights
                .iter()
                .enumerate()
                .map(|(g, weight)| weight * f64::from(batches.energy[g * row + at]))
                .sum()
        })
        .collect();
    noisy.time_edges_s = batches.time_edges_s.clone();
    noisy
}

/// Equal octaves: the index is their transfer index.
fn speech_truth() -> f64 {
    let frequencies = sonel_analysis::modulation::MODULATION_FREQUENCIES;
    let index = |frequency: &f64| {
        let m = DECAY.modulation_transfer(*frequency);
        ((10.0 * (m / (1.0 - m)).log10()).clamp(-15.0, 15.0) + 15.0) / 30.0
    };
    frequencies.iter().map(index).sum::<f64>() / 14.0
}

#[test]
fn json_has_the_shape_of_the_interface() {
    let json = report::json(&parameters(&response(&[0.25; 4], certain)));
    let receiver = &json["receivers"][0];
    assert_eq!((receiver["source"].as_str(), receiver["name"].as_str()), (Some("stage"), Some("seat 12")));
    assert_eq!(receiver["position_m"].as_array().map(Vec::len), Some(3));
    assert!(receiver["speech_transmission_index"]["value"].is_f64());
    let bands = receiver["bands"].as_array().unwrap();
    assert_eq!(bands.len(), 7);
    for band in bands {
        assert!(band["center_frequency_hz"].is_number());
        for key in [
            "level_db",
            "strength_g_db",
            "early_decay_time_s",
            "t20_s",
            "t30_s",
            "clarity_c50_db",
            "clarity_c80_db",
            "definition_d50",
            "center_time_s",
        ] {
            assert!(band[key]["value"].is_f64(), "{key}");
            assert_eq!(band[key]["ci95"].as_array().map(Vec::len), Some(2), "{key}");
        }
        assert!(
            band["t30_s"]["curvature_percent"].is_f64() && band["t30_s"]["non_linearity_permille"].is_f64()
        );
    }
    let without = report::json(&parameters(&response(&[], certain)));
    let estimate = &without["receivers"][0]["bands"][0]["t20_s"];
    assert!(estimate["value"].is_f64() && estimate["ci95"].is_null() && estimate["reason"].is_string());
    let mut silent = response(&[], certain);
    silent.energy.fill(0.0);
    let estimate = &report::json(&parameters(&silent))["receivers"][0]["bands"][0]["t20_s"];
    assert!(estimate["value"].is_null() && estimate["reason"].is_string());
}

#[test]
fn csv_has_a_row_per_figure_and_the_table_a_line_per_band() {
    let parameters = parameters(&response(&[0.25; 4], certain));
    let mut rows = Vec::new();
    report::csv(&parameters, &mut rows).unwrap();
    let rows = String::from_utf8(rows).unwrap();
    // Head, speech, A-weighted level, two echo criteria, and the bands.
    assert_eq!(rows.lines().count(), 1 + 4 + 7 * Parameter::ALL.len());
    assert!(rows.starts_with(
        "source,receiver,center_frequency_hz,parameter,value,ci95_low,ci95_high,warning,reason,just_noticeable_difference,"
    ));
    assert!(
        rows.lines()
            .next()
            .unwrap()
            .ends_with("receiver_x_m,receiver_y_m,receiver_z_m,ci95_materials_low,ci95_materials_high")
    );
    assert!(rows.lines().skip(1).all(|row| row.ends_with(",0,0,0,3.43,0,0,,")), "{rows}");
    let table = report::table(&parameters, "Hall: ", false);
    assert!(table.starts_with("Hall: source \"stage\" at receiver \"seat 12\" (3.43, 0, 0) m"), "{table}");
    assert!(
        SPEECH_OCTAVES
            .iter()
            .all(|f| table.lines().any(|line| line.trim_start().starts_with(&f.to_string())))
    );
}

/// One batch holds all the energy of the late decay: no parameter that needs it is printed. A level that only varies from batch to
/// batch by half is.
#[test]
fn hopeless_noise_is_refused_with_its_reason() {
    let mut lopsided = response(&[0.25; 4], certain);
    let batches = lopsided.batches.as_mut().expect("four batches");
    let length = batches.energy.len() / 4;
    batches.energy[length..].iter_mut().enumerate().for_each(|(at, energy)| {
        // Three of four batches lose what arrives late.
        if at % batches.bins > batches.bins / 3 {
            *energy = 0.0;
        }
    });
    let parameters = parameters(&lopsided);
    let reason =
        parameters[0].bands[3].parameter(Parameter::T30).as_ref().expect_err("one batch decides").to_string();
    assert!(reason.starts_with("the noise is too high"), "{reason}");
    assert!(parameters[0].bands[3].parameter(Parameter::Level).is_ok());
}

/// The same noise in both, and one of them a part in a thousand louder: told apart batch by batch, not
/// by their intervals. Without any difference pairing finds none.
#[test]
fn shared_noise_leaves_small_differences_visible() {
    let weights = [1.0 / 16.0; 16];
    let quiet = noisy_response(&weights, 7);
    let mut loud = quiet.clone();
    loud.energy.iter_mut().for_each(|energy| *energy *= 1.001);
    loud.batches.as_mut().expect("batches").energy.iter_mut().for_each(|energy| *energy *= 1.001);
    let [quiet, loud] = [quiet, loud].map(|response| parameters(&response));
    let beyond = |a: &[_], b: &[_], pairing| compare(a, b, pairing).beyond_noise().count();
    assert_eq!(beyond(&quiet, &loud, Pairing::Independent), 0);
    assert!(beyond(&quiet, &loud, Pairing::Batches) > 7);
    assert_eq!(beyond(&quiet, &quiet, Pairing::Batches), 0);
    let mut pairs = 0;
    for seed in 0..40 {
        let [a, b] = [2 * seed, 2 * seed + 1].map(|seed| parameters(&noisy_response(&weights, 5000 + seed)));
        pairs += usize::from(beyond(&a, &b, Pairing::Batches) > 0);
    }
    assert!(pairs <= 3, "{pairs} of 40 pairs without difference are told apart");
}

/// Two responses of one decay are told apart once in a hundred comparisons at the most: more than 3 of 60 with a probability
/// below 4e-3. Tested each at 5 % alone, nearly all would be.
#[test]
fn noise_alone_makes_no_difference() {
    const RUNS: u64 = 60;
    let weights = [1.0 / 16.0; 16];
    let (mut apart, mut apart_at_five_percent) = (0, 0);
    for run in 0..RUNS {
        let [a, b] = [2 * run, 2 * run + 1].map(|seed| parameters(&noisy_response(&weights, 1000 + seed)));
        let comparison = compare(&a, &b, Pairing::Independent);
        // Parameters and five windows in seven bands, and speech; the sixth window lies behind both records.
        let tested = 7 * (Parameter::ALL.len() + 5) + 1;
        assert_eq!((comparison.differences.len(), comparison.not_tested), (tested, 0));
        apart += u64::from(comparison.beyond_noise().next().is_some());
        let alone =
            comparison.differences.iter().any(|found| found.interval[0] > 0.0 || found.interval[1] < 0.0);
        apart_at_five_percent += u64::from(alone);
    }
    assert!(apart <= 3, "{apart}");
    assert!(apart_at_five_percent > RUNS / 2, "{apart_at_five_percent}");
}

/// A tenth of a decibel in one band is found there and nowhere else.
#[test]
fn a_real_difference_is_found_where_it_is() {
    let weights = [1.0 / 16.0; 16];
    let a = noisy_response(&weights, 5000);
    let mut b = noisy_response(&weights, 5001);
    let factor = 10.0_f64.powf(0.01);
    let bins = b.bins();
    b.energy[2 * bins..3 * bins].iter_mut().for_each(|energy| *energy *= factor);
    let batches = b.batches.as_mut().unwrap();
    for batch in batches.energy.chunks_mut(7 * bins) {
        batch[2 * bins..3 * bins].iter_mut().for_each(|energy| *energy *= factor as f32);
    }
    let comparison = compare(&parameters(&a), &parameters(&b), Pairing::Independent);
    for found in comparison.beyond_noise() {
        assert_eq!(found.center_frequency_hz, Some(500.0), "{found:?}");
        assert!(found.estimate == "level_db" || found.estimate.starts_with("strength_g_"), "{found:?}");
        // 0.1 dB is a tenth of what is just noticeable; a window of ten bins has a σ of 0.024 dB.
        assert!(found.just_noticeable.is_none_or(|share| (share - 0.1).abs() < 0.1), "{found:?}");
    }
    let names: Vec<&str> = comparison.beyond_noise().map(|found| found.estimate).collect();
    assert!(names.contains(&"level_db") && names.contains(&"strength_g_db"), "{names:?}");
}

/// Energies of any size a double can have, with falls from one end of its range to the other, batches that agree with them or
/// not: every parameter is a number with an interval of numbers, or has a reason.
#[test]
fn whatever_the_energies_a_figure_is_a_number_or_has_a_reason() {
    const SIZES: [f64; 10] = [0.0, 1e-321, 1e-300, 1e-200, 1e-39, 1e-8, 1.0, 1e30, 1e200, 1e307];
    let mut random = Uniform::new(31);
    let (mut numbers, mut reasons) = (0, 0);
    for case in 0..80 {
        let mut strange = response(&[0.25; 4], certain);
        // The direct sound at once puts the limits of clarity on borders.
        strange.receiver_positions[0][0] = if case % 2 == 0 { 0.0 } else { 3.43 };
        for band in strange.energy.chunks_exact_mut(1200) {
            let fall = [1, 50, 51, 80, 200][random.below(5)];
            let (early, late) = band.split_at_mut(fall);
            for part in [early, late] {
                let sizes = [SIZES[random.below(10)], SIZES[random.below(10)]];
                part.iter_mut().for_each(|energy| *energy *= sizes[usize::from(random.below(4) == 0)]);
            }
        }
        for energy in &mut strange.batches.as_mut().expect("four batches").energy {
            *energy *= [0.0, 1e-36, 1.0, 1.0, 1e36][random.below(5)];
        }
        for receiver in parameters(&strange) {
            let windows = receiver.bands.iter().flat_map(|band| &band.windows);
            for estimate in receiver.parameters().chain(windows) {
                let Ok(estimate) = estimate else {
                    reasons += 1;
                    continue;
                };
                let ends = estimate.interval.clone().unwrap_or_default();
                let decay = estimate.decay.map_or(0.0, |decay| {
                    decay.non_linearity_permille + decay.curvature_percent.unwrap_or_default()
                });
                let sound = [estimate.value, ends[0], ends[1], decay].iter().all(|number| number.is_finite());
                assert!(sound, "case {case}: {estimate:?}");
                numbers += 1;
            }
            let printed = report::json(&[receiver]).to_string();
            assert_eq!(printed.matches("null").count(), printed.matches("\"reason\"").count(), "{printed}");
        }
    }
    assert!(numbers > 1000 && reasons > 1000, "{numbers} numbers, {reasons} reasons");
}

/// A level far below what the batches can hold is told without an interval, and the reason is not noise.
#[test]
fn what_is_too_quiet_for_the_batches_is_told_without_an_interval() {
    let mut quiet = response(&[0.25; 4], |mean| vec![0.0; mean.len()]);
    quiet.energy.iter_mut().for_each(|energy| *energy *= 1e-60);
    let parameters = parameters(&quiet);
    let level = parameters[0].bands[3].parameter(Parameter::Level).as_ref().expect("a level");
    assert!((-600.0..-500.0).contains(&level.value), "{}", level.value);
    assert_eq!(level.interval, Err(NoInterval::TooQuiet));
}
