//! A pipeline run is the programs without files: the same map, the same echograms, and seconds that add up.

use std::sync::Mutex;

use sonel::study::effects::{EffectSpec, decide, states};
use sonel::study::pipeline::{RenderedMap, Room, TracedMap, render_and_read};
use sonel::study::response::receivers_of;
use sonel::{Clock, InMemory, Observer, Silent};
use sonel_analysis::ReceiverParameters;
use sonel_echogram::Response;
use sonel_map::{Mode, Settings, SonelMap, Vertex};
use sonel_renderer::RenderSettings;
use sonel_testkit::test_folder::TestFolder;

use crate::{render, response, test_folder, trace};

/// A map and its rendering.
struct Run {
    traced: TracedMap,
    rendered: RenderedMap,
    parameters: Vec<ReceiverParameters>,
}

fn run(folder: &TestFolder, emissions: u64, observer: &dyn Observer) -> Run {
    let text = String::from_utf8(folder.bytes("scene.toml")).expect("text");
    let loaded =
        sonel_scene::load(&text, "scene.toml", &mut |_| unreachable!("a shoebox")).expect("a valid scene");
    let mut scene = loaded.scene;
    let geometry = scene.geometry().expect("walls");
    let decisions = decide(&EffectSpec::default(), Mode::Accurate, &mut scene, &geometry);
    let effects = states(&decisions, Mode::Accurate);
    let settings = Settings { emissions, ..Settings::default() };
    let room = Room::within(&scene, &geometry, &effects);
    let traced = room.trace(settings, &mut InMemory, observer).expect("a tight room");
    let (receivers, render) =
        (receivers_of(&scene), RenderSettings { boundary: true, ..RenderSettings::default() });
    let (rendered, parameters) =
        render_and_read(&traced.map, &geometry, &receivers, &render, observer).expect("a rendering");
    Run { traced, rendered, parameters }
}

#[test]
fn a_trial_traces_and_hears_what_the_programs_do() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "1k"]).unwrap();
    render(&folder, "a.sonelmap", "a.npz", &[]).unwrap();
    let run = run(&folder, 1000, &Silent);
    let map = SonelMap::from_bytes(&folder.bytes("a.sonelmap")).unwrap();
    let paths = |map: &SonelMap| -> Vec<Vec<Vertex>> {
        (0..1000).map(|emission| map.path(0, emission).expect("a whole map").vertices.to_vec()).collect()
    };
    let tried = &run.traced.map;
    assert!(paths(tried) == paths(&map) && tried.ledger() == map.ledger());
    assert_eq!(
        (&tried.header().effects, &tried.header().scene),
        (&map.header().effects, &map.header().scene)
    );
    let written = response(&folder, "a.npz");
    // Another program and another map file: all else is the same.
    let provenance = written.provenance.clone();
    assert!(Response { provenance, ..run.rendered.response } == written);
    assert!(run.parameters == sonel_analysis::parameters(&written));
}

/// A clock that goes on by a second whenever the process asks for the time, and by a tenth when a thread does.
#[derive(Default)]
struct Counting(Mutex<(f64, f64)>);

impl Observer for Counting {
    fn clock(&self) -> Option<&dyn Clock> {
        Some(self)
    }
}

impl Clock for Counting {
    fn wall(&self) -> f64 {
        0.0
    }

    fn process(&self) -> f64 {
        let mut times = self.0.lock().expect("nobody panicked");
        times.0 += 1.0;
        times.0
    }

    fn thread(&self) -> f64 {
        let mut times = self.0.lock().expect("nobody panicked");
        times.1 += 0.1;
        times.1
    }
}

#[test]
fn every_second_of_a_trial_is_in_one_phase() {
    let clock = Counting::default();
    let run = run(&test_folder(), 1000, &clock);
    let (traced, received) = (run.traced.seconds, run.rendered.seconds);
    // Two chunks, each written within two readings of the thread's clock.
    assert!((traced.write - (1.0 + 2.0 * 0.1)).abs() < 1e-9, "{traced:?}");
    assert!(traced.open > 0.0 && traced.trace > 0.0);
    assert!(
        [received.prepare, received.deterministic, received.sweep, received.parameters]
            .iter()
            .all(|&s| s > 0.0)
    );
    // One source, one part of the receivers.
    assert!((received.sweep - 1.0).abs() < 1e-9, "{received:?}");
    let asked = clock.process();
    let all = traced.total() + received.total();
    assert!(all <= asked && all > 0.5 * asked, "{all} of {asked}");
}
