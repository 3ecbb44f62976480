//! What `auto` leaves out changes no more than promised, and what it leaves in is missed where it is left out: one scene an effect, and one that
//! needs none. All of them are in tests/accept.

use std::f64::consts::{PI, TAU};

use sonel_acoustics::Material;
use sonel_map::Mode;
use sonel_map::edges::whole_reach;
use sonel_study::effects::{Bound, DECAY, Decision, Effect, LEVEL_DB, decide};
use sonel_study::trial::NoClock;
use sonel_tests::occasions::{against, floating_screen, scenes};

const EMISSIONS: u64 = 1_000;
/// Rounding of decibels and regressions.
const ROUNDING: f64 = 1e-6;

#[test]
fn what_auto_leaves_out_changes_no_more_than_promised() {
    let chosen = ["dead booth", "small tile", "small and dry", "Enclosure with a screen"];
    for scene in scenes().into_iter().filter(|scene| chosen.contains(&scene.name.as_str())) {
        let outcome = against(&scene, "all", EMISSIONS);
        let changed = outcome.level_db.iter().zip(&outcome.decay);
        for ((found, time), (level_db, decay)) in changed.zip(outcome.promised()) {
            assert!(*found <= level_db + ROUNDING, "{}: {found} dB, promised {level_db}", scene.name);
            assert!(*time <= decay + ROUNDING, "{}: T30 {time}, promised {decay}", scene.name);
        }
        // The sibling: a promise of a tenth is broken wherever something was left out.
        let left_out = outcome.promised().into_iter().any(|(level_db, _)| level_db > 0.0);
        let broken =
            outcome.level_db.iter().zip(outcome.promised()).any(|(found, (db, _))| *found > 0.1 * db);
        assert_eq!(left_out, broken, "{}", scene.name);
    }
}

#[test]
fn what_auto_leaves_in_is_missed() {
    for (name, effect) in [
        ("barrier outdoors", Effect::Diffraction),
        ("huge and dry", Effect::Air),
        ("cardioid, turned away", Effect::Directivity),
    ] {
        let scene = scenes().into_iter().find(|scene| scene.name == name).expect("one of them");
        let outcome = against(&scene, &format!("auto,-{}", effect.name()), EMISSIONS);
        assert!(outcome.decisions[effect as usize].on.contains(&true), "{name}");
        assert!(outcome.level_db.iter().any(|&change| change > LEVEL_DB), "{name}: {:?}", outcome.level_db);
    }
}

fn bending(scene: &sonel_scene::Scene, spec: &str) -> Decision {
    let (mut scene, geometry) = (scene.clone(), scene.geometry().expect("walls"));
    let spec = spec.parse().expect("a specification");
    let mut decisions = decide(&spec, Mode::Accurate, &mut scene, &geometry, false, &NoClock).expect("a run");
    decisions.swap_remove(Effect::Bending as usize)
}

fn bound(scene: &sonel_scene::Scene) -> Bound {
    bending(scene, "auto,-diffraction").bound.expect("a closed room")
}

/// In a diffuse field a way of the mean length 4V/S passes an edge of length L nearer than b with the probability 2πbL/S (the mean shadow of
/// a cylinder is a quarter of its surface), and is turned there by b₀/b, at most by one: ⟨½ θ²⟩ = π L b₀ (2 − b₀/5λ)/S.
#[test]
fn ways_are_turned_in_a_diffuse_field_as_chords_tell() {
    let (scene, length, surface) = floating_screen();
    let found = bound(&scene).decay;
    for (band, wavelength) in scene.wavelengths().into_iter().enumerate() {
        let nearest = 0.87 * wavelength / (2.0 * TAU);
        let expected = |length: f64| PI * length * nearest * (2.0 - nearest / (5.0 * wavelength)) / surface;
        let ratio = found[band] / expected(length);
        assert!((ratio - 1.0).abs() < 0.25, "band {band}: {} instead of {}", found[band], expected(length));
        let short = found[band] / expected(0.6 * length);
        assert!((short - 1.0).abs() > 0.25, "edges that are shorter by two fifths are told apart");
    }
}

fn by_name(name: &str) -> sonel_scene::Scene {
    scenes().into_iter().find(|scene| scene.name == name).expect("one of them")
}

#[test]
fn bending_is_on_where_its_bound_exceeds_the_thresholds() {
    let seats = bending(&by_name("seat rows"), "auto");
    let bound = seats.bound.as_ref().expect("a closed room");
    // Rows 0.8 m high and 0.5 m wide: half a wave at 63 and 125 Hz is longer.
    assert!(bound.decay[..2].iter().all(|&decay| decay <= 0.0), "{:?}", bound.decay);
    let from_500 = &bound.decay[3..];
    assert!(from_500[0] > 0.02 && from_500.is_sorted_by(|low, high| low > high), "{:?}", bound.decay);
    for (band, &on) in seats.on.iter().enumerate() {
        assert_eq!(
            on,
            bound.level_db[band] > LEVEL_DB || bound.decay[band] > DECAY,
            "band {band}: {bound:?}"
        );
    }
    assert!(!seats.on[0] && seats.on[3] && seats.reason.contains("% of T at 63 Hz"), "{}", seats.reason);
    assert!(!bending(&by_name("Enclosure with a screen"), "auto").on.contains(&true));
    assert!(bending(&by_name("Enclosure with a screen"), "all").on.iter().all(|&on| on));
    assert_eq!(bending(&by_name("dead booth"), "auto,+bending").bound.expect("nothing").decay, [0.0; 8]);
    // Nothing tells what it is worth in the open.
    let outdoors = bending(&by_name("barrier outdoors"), "auto");
    assert!(outdoors.bound.is_none() && outdoors.on.iter().all(|&on| on));
}

/// Who asks for less gets less: three tenths of just-noticeable differences may be missing.
#[test]
fn a_coarser_threshold_leaves_out_more() {
    let scene = by_name("seat rows");
    let [fine, coarse] = ["auto", "auto:0.3"].map(|spec| bending(&scene, spec));
    let count = |decision: &Decision| decision.on.iter().filter(|&&on| on).count();
    assert!(count(&coarse) > 0 && count(&coarse) < count(&fine), "{:?} {:?}", coarse.on, fine.on);
    assert!(coarse.reach[4] < 0.5 * fine.reach[4], "{:?} {:?}", coarse.reach, fine.reach);
    let rest = coarse.rest.expect("a closed room");
    assert!(
        rest.decay.iter().all(|&t| t <= 3.0 * DECAY) && rest.decay.iter().any(|&t| t > DECAY),
        "{rest:?}"
    );
}

/// What lies beyond the reach is left out as an effect is that does not matter.
#[test]
fn edges_bend_as_far_as_it_matters() {
    let scene = by_name("seat rows");
    let seats = bending(&scene, "auto");
    let rest = seats.rest.as_ref().expect("a closed room");
    assert!(
        rest.level_db.iter().all(|&db| db <= LEVEL_DB) && rest.decay.iter().all(|&t| t <= DECAY),
        "{rest:?}"
    );
    let whole = whole_reach(&scene.wavelengths());
    for ((&reach, whole), &on) in seats.reach.iter().zip(&whole).zip(&seats.on) {
        assert!(if on { reach > 0.0 && reach < 0.5 * whole } else { reach <= 0.0 }, "{reach} of {whole}");
    }
    assert_eq!(bending(&scene, "auto,+bending").reach, whole);
    // Steps are half octaves: what a tenth of the reach would leave out does matter.
    assert!(rest.decay[3] > 0.2 * DECAY, "{rest:?}");
}

/// Ways that meet nothing that absorbs sustain a decay; what edges turn away from them ends sooner where some walls absorb more than others.
#[test]
fn walls_that_differ_count_for_more() {
    let scene = by_name("seat rows");
    let (alike, mut uneven) = (bound(&scene), scene.clone());
    uneven.materials.push(Material::uniform("absorber", 0.8, 0.3, scene.bands.count()));
    uneven.mesh.triangles[0].material = 1;
    uneven.mesh.triangles[1].material = 1;
    let differing = bound(&uneven);
    assert!(differing.decay[3] > 2.0 * alike.decay[3], "{:?} {:?}", differing.decay, alike.decay);
}
