//! `plot` from outside: curves, early reflections, plans, and what it lacks.

use std::fs::File;

use sonel_echogram::{Arrivals, Response};
use sonel_map::{SonelMap, hexadecimal};
use sonel_testkit::test_folder::{Ended, TestFolder};

use crate::commands::{MAP, RESPONSE, SCENE, render};
use crate::{analyze, trace};

fn plot(folder: &TestFolder, options: &[&str]) -> Ended {
    analyze(folder, &[&["plot", RESPONSE], options].concat())
}

/// The response of [`render`] after a change.
fn rendered(change: impl FnOnce(&mut Response)) -> TestFolder {
    let folder = TestFolder::with(SCENE);
    render(&folder);
    self::change(&folder, change);
    folder
}

/// Changes the response in `folder`.
fn change(folder: &TestFolder, change: impl FnOnce(&mut Response)) {
    let mut response = Response::read(std::io::Cursor::new(folder.bytes(RESPONSE))).expect("a response");
    change(&mut response);
    response.write(File::create(folder.path(RESPONSE)).expect("a folder")).expect("written");
}

/// Six receivers on a grid of three by two, the last of which gets nothing, and the map of their scene.
fn grid() -> TestFolder {
    let folder = rendered(|response| {
        let positions = (0..6).map(|i| [f64::from(1 + i % 3), f64::from(1 + i / 3), 1.2]);
        response.receiver_positions = positions.collect();
        response.receiver_names = (0..6).map(|i| format!("grid {i}")).collect();
        let bins = response.bins();
        response.energy = response.energy.repeat(6);
        response.energy[5 * bins..].fill(0.0);
        response.source_positions = vec![[1.5, 1.2, 1.3]];
    });
    trace(&folder, MAP, &["--packets", "200"]);
    let map = SonelMap::open(&File::open(folder.path(MAP)).expect("a map")).expect("a map");
    let scene = &map.header().scene;
    change(&folder, |response| {
        response.provenance.scene_digest = Some(hexadecimal(&scene.digest));
        response.provenance.mesh_digest = Some(hexadecimal(&scene.mesh_digest));
    });
    folder
}

#[test]
fn a_response_is_drawn_and_what_it_lacks_is_named() {
    let folder = TestFolder::with(SCENE);
    render(&folder);
    plot(&folder, &["-o", "room.svg"]).done();
    let text = folder.text("room.svg");
    for word in ["test room", "Echogram", "Decay", "T30 [s]", "1000 Hz", "</svg>"] {
        assert!(text.contains(word), "{word}");
    }
    plot(&folder, &["--what", "decay", "-o", "room.svg"]).done();
    let text = folder.text("room.svg");
    assert!(text.contains("Decay") && !text.contains("Echogram"));
    plot(&folder, &["--what", "decay", "-o", "room.png"]).done();
    assert!(folder.bytes("room.png").starts_with(b"\x89PNG"));

    let refused = plot(&folder, &["--receiver", "seat 13", "-o", "room.svg"]).refused();
    assert!(refused.contains("no receiver \"seat 13\"; it has \"seat 12\""), "{refused}");
    assert!(plot(&folder, &["-o", "room.pdf"]).refused().contains("neither in .svg nor in .png"));
    folder.write("photo.png", b"\x89PNG\r\n\x1a\nmine");
    assert!(
        plot(&folder, &["-o", "photo.png"])
            .refused()
            .contains("exists and is not a picture of sonel-analyze")
    );
    folder.write("logo.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"/>");
    let refused = plot(&folder, &["-o", "logo.svg"]).refused();
    assert!(refused.contains("exists and is not a drawing of sonel-analyze"), "{refused}");
    assert_eq!(folder.text("room.svg"), text, "the older drawing is untouched");
}

#[test]
fn a_grid_is_a_plan_with_walls_and_receivers_without_a_value_are_grey() {
    let folder = grid();
    let map = ["--what", "map", "--band", "1000", "-o", "map.svg"];
    let without = plot(&folder, &[&map[..], &["--parameter", "t30"]].concat()).done();
    assert!(without.err.contains("no value at 1 of 6 receivers"), "{without:?}");
    let lines = |text: &str| text.matches("stroke-width=\"3\"").count();
    let bare = folder.text("map.svg");
    assert!(
        bare.contains("T30 [s]")
            && bare.contains("T30, 1000 Hz: &quot;stage&quot;, room")
            && bare.contains("#C8C8C8")
    );
    plot(&folder, &[&["room.sonelmap"], &map[..], &["--parameter", "t30"]].concat()).done();
    // Two triangles of each of four walls are cut.
    assert_eq!((lines(&bare), lines(&folder.text("map.svg"))), (0, 8));
    plot(&folder, &["--what", "map", "--band", "1000", "-o", "map.png"]).done();
}

#[test]
fn maps_that_cannot_be_drawn_say_why() {
    let folder = grid();
    folder.write("scene.toml", SCENE.replace("5.0, 4.0]", "5.0, 3.9]"));
    trace(&folder, "other.sonelmap", &["--packets", "200"]);
    let refused = |options: &[&str]| plot(&folder, &[options, &["-o", "map.svg"]].concat()).refused();
    for (options, message) in [
        (&["--what", "map"][..], "no receiver has a value"),
        (&["--what", "map", "--band", "500"], "no band of 500 Hz; it has 1000"),
        (&["--what", "map", "--parameter", "lf", "--band", "1000"], "render with `directions`"),
        (&["--what", "map", "--parameter", "sti", "--band", "1000"], "omit --band"),
        (&["--what", "map", "--parameter", "rt60"], "is not a parameter: write one of"),
        (&["--what", "decay", "room.sonelmap"], "only --what map uses a map"),
        (&["--what", "map", "room.sonelmap", "room.sonelmap"], "second map"),
        (&["--what", "map", "--band", "1000", "other.sonelmap"], "room is of another scene than the map"),
        (&["--what", "early"], "lists no arrival"),
    ] {
        let found = refused(options);
        assert!(found.contains(message), "{options:?}: {found}");
    }
    let alone = analyze(&folder, &["plot", "room.sonelmap", "-o", "map.svg"]).refused();
    assert!(alone.contains("no response among the files"), "{alone}");
    assert!(!folder.path("map.svg").exists());
}

#[test]
fn two_receivers_at_one_place_are_one_dot_and_a_note() {
    let folder = rendered(|response| {
        response.receiver_positions = vec![[1.0, 1.0, 1.2]; 2];
        response.receiver_names = ["a", "b"].map(str::to_owned).to_vec();
        response.energy = response.energy.repeat(2);
    });
    let ended = plot(&folder, &["--what", "map", "--band", "1000", "-o", "map.svg"]).done();
    assert!(ended.err.contains("same place of the plan: 1 receiver;"), "{ended:?}");
}

#[test]
fn early_reflections_are_named_by_their_number_of_reflections() {
    let folder = rendered(|response| {
        response.arrivals = Arrivals {
            source: vec![0; 2],
            receiver: vec![0; 2],
            time_s: vec![0.01, 0.0155],
            energy: vec![1e-3, 1e-4],
            direction: vec![1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
            order: vec![0, 1],
            kind: vec![0, 1],
        };
    });
    plot(&folder, &["--what", "early", "-o", "early.svg"]).done();
    let text = folder.text("early.svg");
    assert!(text.contains("direct sound") && text.contains("1 reflection") && text.contains("all bands"));
    assert!(
        plot(&folder, &["--what", "early", "--band", "63", "-o", "e.svg"]).refused().contains("it has 1000")
    );
}
