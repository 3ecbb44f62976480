//! The public face: what observers hear and decide, what options refuse, what maps keep.

mod snippets;

use std::ops::ControlFlow;
use std::sync::Mutex;

use sonel::{
    Change, Error, Map, Material, MaterialKey, Observer, Parameter, RenderOptions, Response, Scene, Severity,
    Silent, TraceOptions,
};

fn room() -> Scene {
    Scene::shoebox([5.0, 4.0, 3.0])
        .material("walls", Material::new(0.3).with(MaterialKey::Scattering, 0.5))
        .source("source", [1.0, 1.0, 1.5])
        .receiver("receiver", [3.9, 2.8, 1.2])
        .duration(0.2)
        .build(&Silent)
        .expect("a valid scene")
}

fn options(packets: u64) -> TraceOptions<'static> {
    TraceOptions { packets: Some(packets), ..TraceOptions::default() }
}

/// Hears everything, and stops the work at a step.
#[derive(Default)]
struct Heard {
    stop_at: Option<&'static str>,
    steps: Mutex<Vec<(String, f64)>>,
    messages: Mutex<Vec<(Severity, String)>>,
}

impl Observer for Heard {
    fn progress(&self, step: &str, share: f64) -> ControlFlow<()> {
        self.steps.lock().expect("no panic").push((step.to_owned(), share));
        if self.stop_at == Some(step) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn message(&self, severity: Severity, text: &str) -> ControlFlow<()> {
        self.messages.lock().expect("no panic").push((severity, text.to_owned()));
        ControlFlow::Continue(())
    }
}

#[test]
fn an_observer_hears_progress_and_warnings() {
    let heard = Heard::default();
    room().trace(&options(20), &heard).expect("a map");
    let steps = heard.steps.into_inner().expect("no panic");
    assert!(steps.iter().all(|(step, _)| step == "tracing"));
    assert!(steps.is_sorted_by(|a, b| a.1 <= b.1) && (steps[steps.len() - 1].1 - 1.0).abs() < 1e-12);
    let messages = heard.messages.into_inner().expect("no panic");
    assert!(
        messages.iter().any(|(severity, text)| *severity == Severity::Warning && text.contains("20 packets"))
    );
}

#[test]
fn an_observer_stops_traces_and_renderings() {
    let stops = |step| Heard { stop_at: Some(step), ..Heard::default() };
    let stopped = room().trace(&options(2000), &stops("tracing")).unwrap_err();
    assert!(matches!(stopped, Error::Stopped));
    let map = room().trace(&options(200), &stops("rendering")).expect("nothing is rendered").map;
    let stopped = map.render(&[], &RenderOptions::default(), &stops("rendering")).unwrap_err();
    assert!(matches!(stopped, Error::Stopped));
    map.render(&[], &RenderOptions::default(), &Silent).expect("the map is as it was");
}

/// The refinement ends with the rendering of the whole map; what comes before are those of its first batches, with wider intervals.
#[test]
fn renderings_are_refined_up_to_the_whole_map() {
    let map = || room().trace(&options(4000), &Silent).expect("a map").map;
    let refined: Vec<Response> = map()
        .refine(&[], &RenderOptions::default(), &Silent)
        .map(|rendered| rendered.expect("a valid map").response)
        .collect();
    // Of a map of their own, which keeps nothing of other renderings.
    let with = |batches| {
        let options = RenderOptions { batches, ..RenderOptions::default() };
        map().render(&[], &options, &Silent).expect("a valid map").response
    };
    assert_eq!(map().refinement_steps(), [4, 8, 16, 32]);
    let energy = |response: &Response| response.echograms().energy.clone();
    assert_eq!(energy(&refined[3]), energy(&with(None)));
    assert_eq!(refined[3].echograms().provenance, with(None).echograms().provenance);
    for (step, batches) in [(0, 4), (1, 8), (2, 16)] {
        let stored = refined[step].echograms().batches.as_ref().expect("batches");
        assert_eq!(
            (stored.weight.len(), energy(&refined[step])),
            (batches as usize, energy(&with(Some(batches))))
        );
        assert!((stored.weight.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert_ne!(energy(&refined[step]), energy(&refined[step + 1]));
    }
    let half_width =
        |response: &Response| response.parameters().at(Parameter::Level, 1000.0).expect("1 kHz")[0].1;
    assert!(half_width(&refined[0]) > half_width(&refined[3]));
}

/// A change is judged by the batches that are rendered: one that few have carried is judged anew for all.
#[test]
fn all_batches_are_judged_though_a_few_were_before() {
    let warned = |map: &Map, batches| {
        let set = vec!["materials.walls.scattering=0.73".parse().expect("a change")];
        let options = RenderOptions { set, batches, ..RenderOptions::default() };
        format!("{:?}", map.render(&[], &options, &Silent).map(|rendered| rendered.warnings))
    };
    let fresh = || room().trace(&options(500), &Silent).expect("a map").map;
    let map = fresh();
    let (few, all) = (warned(&map, Some(4)), warned(&map, None));
    assert_eq!(all, warned(&fresh(), None));
    assert_ne!(all, few, "both have the same warning: the test would not see which batches were judged");
}

#[test]
fn batches_that_a_map_lacks_are_refused() {
    let map = room().trace(&TraceOptions { batches: Some(5), ..options(200) }, &Silent).expect("a map").map;
    for batches in [0, 6] {
        let options = RenderOptions { batches: Some(batches), ..RenderOptions::default() };
        let refused = map.render(&[], &options, &Silent).unwrap_err();
        assert!(format!("{refused:#}").contains("5 batches"), "{refused}");
        assert!(
            map.refine(&[], &RenderOptions { bin: -1.0, ..options }, &Silent).count() == 1,
            "the first error ends it"
        );
    }
    // None of its parts has packets enough for intervals that hold.
    assert_eq!(map.refinement_steps(), [5]);
}

/// Renderings of a map in other designs do not take one another's preparations.
#[test]
fn kept_preparations_are_those_of_their_options() {
    let map = room().trace(&options(500), &Silent).expect("a map").map;
    let again = || room().trace(&options(500), &Silent).expect("a map").map;
    let set = |absorption: f64| {
        let set = vec![Change::of("materials.walls.absorption", absorption.into()).expect("a change")];
        RenderOptions { set, ..RenderOptions::default() }
    };
    let designs =
        [RenderOptions::default(), set(0.25), RenderOptions { order: Some(1), ..set(0.25) }, set(0.35)];
    for _ in 0..2 {
        for options in &designs {
            let render = |map: &Map| {
                map.render(&[], options, &Silent).expect("a map").response.echograms().energy.clone()
            };
            assert_eq!(render(&map), render(&again()));
        }
    }
}

#[test]
fn options_are_refused_by_their_fields() {
    let scene = room();
    let late = TraceOptions { until: Some("t30<1%".parse().unwrap()), at_most: Some(1.0), ..options(200) };
    for (wrong, words) in [
        (late, "`at_most` needs an observer with a clock"),
        (TraceOptions { at_most: Some(1.0), ..options(200) }, "`at_most` needs an observer with a clock"),
        (
            TraceOptions { survival: Some(2.0), batches: Some(0), ..options(0) },
            "`batches` 0 is outside 1 … 4096",
        ),
    ] {
        let error = scene.trace(&wrong, &Silent).unwrap_err();
        assert!(matches!(error, Error::Options(_)), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
    let map = scene.trace(&options(200), &Silent).expect("a map").map;
    let error =
        map.render(&[], &RenderOptions { bin: 0.0, ..RenderOptions::default() }, &Silent).unwrap_err();
    assert!(matches!(&error, Error::Options(problems) if problems[0].starts_with("`bin` 0 s")), "{error}");
}

#[test]
fn files_hold_what_was_saved_and_changes_leave_the_map_alone() {
    let folder = sonel_testkit::test_folder::TestFolder::with("");
    let map = room().trace(&options(500), &Silent).expect("a map").map;
    let path = folder.path("room.sonelmap");
    map.save(&path).expect("a file");
    let opened = Map::open(&path).expect("a map");
    assert_eq!(opened.digest(), map.digest());

    let energies = |map: &Map, set: Vec<Change>| {
        let options = RenderOptions { set, rays: Some(64), ..RenderOptions::default() };
        map.render(&[], &options, &Silent).expect("a response").response
    };
    let before = energies(&opened, Vec::new());
    let felt = Change::of("materials.walls.absorption", 0.5.into()).expect("a change");
    let felt = energies(&opened, vec![felt]);
    let after = energies(&opened, Vec::new());
    let sum = |response: &Response| response.echograms().energy.iter().sum::<f64>();
    assert!(sum(&felt) < sum(&before));
    assert!(before.echograms() == after.echograms());

    let path = folder.path("room.npz");
    before.save(&path).expect("a file");
    let read = Response::open(&path).expect("a response");
    assert!(read.echograms() == before.echograms() && read.surroundings() == before.surroundings());
    let levels = read.parameters();
    let (level, half_width) = levels.at(Parameter::Level, 1000.0).expect("1 kHz")[0];
    assert!(levels.at(Parameter::Level, 1100.0).is_err());
    let estimate = levels.value(Parameter::Level, 0, 0, 4).as_ref().expect("a level");
    assert!((estimate.value - level).abs() < 1e-12 && half_width > 0.0);
}

#[test]
fn a_scene_made_in_code_has_the_map_of_its_file() {
    let folder = sonel_testkit::test_folder::TestFolder::with("");
    let made = room();
    let path = made.save(folder.path("room")).expect("a folder");
    let read = Scene::load(&path, &Silent).expect("a valid scene");
    let digest = |scene: &Scene| scene.trace(&options(200), &Silent).expect("a map").map.digest();
    assert_eq!(digest(&read), digest(&made));
    assert!(made.save(folder.path("room")).unwrap_err().to_string().contains("exists: delete it first"));
    assert!(made.check().expect("a scene").problems.is_empty());
}

/// Random places of the first source of every shipped scene: with the walls of the scene as it was, and read anew, it is the same scene with the
/// same map, or refused alike.
#[test]
fn a_scene_whose_source_moves_is_the_one_that_is_read_anew() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut random = sonel_testkit::uniform::Uniform::new(1);
    let (mut moved, mut refused) = (0, 0);
    let scenes = std::fs::read_dir(folder).expect("the scenes");
    let mut paths: Vec<_> = scenes.map(|scene| scene.expect("a scene").path().join("scene.toml")).collect();
    paths.sort();
    for path in paths {
        let before = Scene::load(&path, &Silent).expect("a valid scene");
        let (low, high) = before.geometry().bounds();
        for _ in 0..6 {
            let at = [0, 1, 2].map(|axis| random.between(low[axis], high[axis]));
            let text = before.to_toml();
            let source = text.find("[[sources]]").expect("sources");
            let begin = source + text[source..].find("position = [").expect("a position");
            let end = begin + text[begin..].find(']').expect("a list");
            let text = format!("{}position = {at:?}{}", &text[..begin], &text[end + 1..]);
            let kept = before.with_sources_of(text.clone(), &Silent);
            match (kept, Scene::load_text(text, &path, &Silent)) {
                (Ok(kept), Ok(anew)) => {
                    assert!(kept.compiled() == anew.compiled() && kept.files() == anew.files(), "{at:?}");
                    let few = TraceOptions { duration: Some(0.1), ..options(32) };
                    let digest = |scene: &Scene| scene.trace(&few, &Silent).expect("a map").map.digest();
                    assert_eq!(digest(&kept), digest(&anew), "{} {at:?}", path.display());
                    moved += 1;
                }
                (Err(kept), Err(anew)) => {
                    assert_eq!(format!("{kept:#}"), format!("{anew:#}"));
                    refused += 1;
                }
                (kept, anew) => panic!("{} {at:?}: {kept:?}, anew {anew:?}", path.display()),
            }
        }
    }
    assert!(moved > 50 && refused > 0, "{moved} moved, {refused} refused");
}
