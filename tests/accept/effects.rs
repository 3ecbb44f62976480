//! `auto` against all effects in twenty-one scenes: what it leaves out changes no more than promised, and no more than a tenth of a
//! just-noticeable difference; each effect is missed where a scene needs it. The quick form is in tests/physics.

use sonel::study::effects::{Effect, THRESHOLD};
use sonel_acoustics::just_noticeable;
use sonel_tests::effect_scenes::{Outcome, against, scenes};

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
            let changed = outcome.level_db.iter().any(|&db| db > THRESHOLD * just_noticeable::LEVEL_DB)
                || outcome.decay.iter().any(|&t| t > THRESHOLD * just_noticeable::EARLY_DECAY_TIME);
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
