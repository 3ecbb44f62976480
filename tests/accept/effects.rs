//! `auto` against all effects in twenty-one scenes: what it leaves out changes no more than promised, and no more than a tenth of a
//! just-noticeable difference; each effect is missed where a scene needs it. The quick form is in tests/physics.

use sonel_analysis::{Figure, Parameter};
use sonel_scene::Scene;
use sonel_study::effects::{Bound, DECAY, Effect, LEVEL_DB};
use sonel_study::trial::Heard;
use sonel_tests::occasions::{Outcome, against, in_low_bands, promised, run, scenes};

const EMISSIONS: u64 = 4_000;
/// Rounding of decibels and regressions.
const ROUNDING: f64 = 1e-6;

fn row(name: &str, outcome: &Outcome) -> String {
    let on = |effect: Effect| {
        let decision =
            outcome.decisions.iter().find(|decision| decision.effect == effect).expect("of every one");
        let count = decision.on.iter().filter(|&&on| on).count();
        if count == decision.on.len() { "on".to_owned() } else { format!("{count}/{}", decision.on.len()) }
    };
    let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let promised = outcome.promised();
    format!(
        "| {name} | {} | {} | {} | {:.3} dB | {:.3} dB | {:.2} % | {:.2} % | {:.2} |",
        on(Effect::Diffraction),
        on(Effect::Air),
        on(Effect::Directivity),
        most(&mut promised.iter().map(|bound| bound.0)),
        most(&mut outcome.level_db.iter().copied()),
        100.0 * most(&mut promised.iter().map(|bound| bound.1)),
        100.0 * most(&mut outcome.decay.iter().copied()),
        outcome.time,
    )
}

#[test]
fn what_auto_leaves_out_changes_no_more_than_promised() {
    for scene in scenes() {
        let outcome = against(&scene, "all", EMISSIONS);
        println!("{}", row(&scene.name, &outcome));
        for (band, (level_db, decay)) in outcome.promised().into_iter().enumerate() {
            let (found, time) = (outcome.level_db[band], outcome.decay[band]);
            assert!(
                found <= level_db + ROUNDING,
                "{}, band {band}: {found} dB, promised {level_db}",
                scene.name
            );
            assert!(time <= decay + ROUNDING, "{}, band {band}: T30 {time}, promised {decay}", scene.name);
        }
    }
}

#[test]
fn every_effect_is_missed_where_it_is_needed() {
    for effect in [Effect::Diffraction, Effect::Air, Effect::Directivity] {
        let missed = scenes().into_iter().filter(|scene| {
            let outcome = against(scene, &format!("auto,-{}", effect.name()), EMISSIONS);
            let changed =
                outcome.level_db.iter().any(|&db| db > LEVEL_DB) || outcome.decay.iter().any(|&t| t > DECAY);
            assert!(
                !changed || outcome.decisions[effect as usize].on.contains(&true),
                "{}: {} was left out and is missed",
                scene.name,
                effect.name()
            );
            changed
        });
        let missed: Vec<String> = missed.map(|scene| scene.name).collect();
        println!("{}: missed in {}", effect.name(), missed.join(", "));
        assert!(!missed.is_empty(), "no scene needs {}", effect.name());
    }
}

/// Packets of runs in all bands, each of which has paths of its own where it is bent.
const EMISSIONS_IN_ALL_BANDS: u64 = 16_000;

/// Standard errors that one of six hundred changes exceeds in one run of thirty.
const SURE_OF_HUNDREDS: f64 = 4.0;

/// All of every scene, in all its bands: what is bent differs between both runs, so that noise is added to what is promised.
#[test]
fn auto_and_all_agree_in_every_scene() {
    for scene in scenes() {
        let [auto, all] = ["auto", "all"].map(|spec| run(&scene, spec, EMISSIONS_IN_ALL_BANDS));
        let (level_db, decay) = promised(&auto.decisions, &all.decisions).into_iter().unzip();
        holds(&scene.name, [&auto.heard, &all.heard], &Bound { level_db, decay }, SURE_OF_HUNDREDS);
    }
}

/// Packets that tell bending from noise: every run finds paths of its own.
const BENT_EMISSIONS: u64 = 60_000;
/// Standard errors that one of the forty changes compared here exceeds in one run of ten; a 95 % half-width is two.
const SURE: f64 = 3.0;

/// Change of a figure and its 95 % half-width.
struct Change {
    by: f64,
    half_width: f64,
}

/// Every figure of `parameter` that both have: (band, change).
fn changes(parameter: Parameter, without: &Heard, with: &Heard) -> Vec<(usize, Change)> {
    let half_width = |figure: &sonel_analysis::Estimate| {
        figure.interval.as_ref().map_or(f64::INFINITY, |[low, high]| 0.5 * (high - low))
    };
    let change = |(without, with): (&Figure, &Figure)| -> Option<Change> {
        let (without, with) = (without.as_ref().ok()?, with.as_ref().ok()?);
        let unit = if parameter == Parameter::T30 { without.value } else { 1.0 };
        let half_width = half_width(without).hypot(half_width(with)) / unit;
        Some(Change { by: (with.value - without.value) / unit, half_width })
    };
    let places = without.figures.iter().zip(&with.figures);
    places
        .flat_map(|(without, with)| without.bands.iter().zip(&with.bands).enumerate())
        .filter_map(|(band, (without, with))| {
            Some((band, change((without.figure(parameter), with.figure(parameter)))?))
        })
        .collect()
}

/// Closed rooms with edges, in their low bands only: there bending is strongest, and bands that differ less share more of their paths.
fn rooms_with_edges() -> Vec<Scene> {
    let names = [
        "small tile",
        "office screen",
        "seat rows",
        "reflector array",
        "balcony",
        "coupled rooms",
        "Enclosure with a screen",
        "Concert hall",
    ];
    names
        .into_iter()
        .map(|name| {
            let scene = scenes().into_iter().find(|scene| scene.name == name).expect("one of them");
            in_low_bands(&scene)
        })
        .collect()
}

/// Holds every change of levels and T30 between two runs of `scene` against what is `promised`, with `sure` standard errors of both. Whether
/// one exceeds the thresholds by as much.
fn holds(scene: &str, [without, with]: [&Heard; 2], promised: &Bound, sure: f64) -> bool {
    let mut missed = false;
    for (parameter, promised) in [(Parameter::Level, &promised.level_db), (Parameter::T30, &promised.decay)] {
        for (band, change) in changes(parameter, without, with) {
            println!(
                "{scene}, band {band}, {parameter:?}: {:.4} ± {:.4}, promised {:.4}",
                change.by, change.half_width, promised[band]
            );
            let noise = 0.5 * sure * change.half_width;
            assert!(change.by.abs() <= promised[band] + noise + ROUNDING, "{scene}");
            let threshold = if parameter == Parameter::T30 { DECAY } else { LEVEL_DB };
            missed |= change.by.abs() > threshold + noise;
        }
    }
    missed
}

#[test]
fn bending_changes_no_more_than_promised_and_is_missed_in_the_hall() {
    let mut missed = Vec::new();
    for scene in rooms_with_edges() {
        let without = run(&scene, "auto,-bending", BENT_EMISSIONS);
        let auto = run(&scene, "auto", BENT_EMISSIONS);
        let all = run(&scene, "auto,+bending", BENT_EMISSIONS);
        let decision = &auto.decisions[Effect::Bending as usize];
        let (bound, rest) = (decision.bound.as_ref(), decision.rest.as_ref());
        if holds(&scene.name, [&without.heard, &all.heard], bound.expect("a closed room"), SURE) {
            missed.push(scene.name.clone());
        }
        println!("with the reach of auto, {:?} m:", decision.reach);
        assert!(
            !holds(&scene.name, [&auto.heard, &all.heard], rest.expect("a closed room"), SURE),
            "{}",
            scene.name
        );
    }
    println!("bending: missed in {}", missed.join(", "));
    assert!(missed.contains(&"Concert hall".to_owned()), "{missed:?}");
}
