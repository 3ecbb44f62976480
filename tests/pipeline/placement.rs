//! Receivers and grids where nothing can stand.

use serde_json::json;
use sonel_testkit::test_folder::TestFolder;

use crate::{printed, render, response, test_folder, trace};

/// What rendering `options` says on stderr, with the JSON of stdout.
fn rendered(folder: &TestFolder, options: &[&str]) -> (String, serde_json::Value) {
    use clap::Parser;
    let mut line = folder.line("sonel-render", "a.sonelmap", "a.npz", options);
    line.extend(["--json".into(), "--rays".into(), "64".into()]);
    let mut log = Vec::new();
    let out =
        printed(|out| sonel_render::run(&sonel_render::Arguments::try_parse_from(line)?, out, &mut log));
    let told = serde_json::from_str(&out.expect("a valid map")).expect("JSON");
    (String::from_utf8(log).expect("text"), told)
}

/// Walls, the outside and the source are left out and counted: the grid that a person would choose.
#[test]
fn a_grid_from_wall_to_wall_leaves_out_what_is_no_place() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "200"]).expect("a valid scene");
    let (log, told) = rendered(&folder, &["--grid", "0:6:7,0:4:5,1.5"]);
    // 4 x 3 points are off the walls, one of them is the source; x = 6 is outside.
    assert!(
        log.contains("note: 24 of 35 points are left out: 18 on surfaces, 5 outside the room, 1 at a source"),
        "{log}"
    );
    let left_out =
        json!({ "on_surfaces": 18, "in_closed_objects": 0, "outside": 5, "at_sources": 1, "below_faces": 0 });
    assert_eq!(told["grid"], json!({ "points": 35, "left_out": left_out }));
    assert_eq!(response(&folder, "a.npz").receivers(), 11);
    let nowhere =
        format!("{:#}", render(&folder, "a.sonelmap", "a.npz", &["--grid", "0,0:4:5,0"]).expect_err("walls"));
    assert!(nowhere.contains("5 of 5 points are left out: 5 on surfaces"), "{nowhere}");
}

/// A single receiver there is an error that says where one could stand, 0.1 m from the walls; a millimetre from a wall one can.
#[test]
fn a_receiver_on_a_wall_is_an_error_with_the_nearest_free_place() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "200"]).expect("a valid scene");
    for (place, words) in [
        ("0,2,1.2", "is 0 m from a surface, at least 0.0095 mm are needed; (0.1, 2, 1.2) m is free"),
        ("5,4,3", "(4.9, 3.9, 2.9) m is free"),
        ("5.5,2,1", "is outside the room, 0.5000 m from its nearest surface"),
    ] {
        let receiver = format!("m={place}");
        let from_option = render(&folder, "a.sonelmap", "a.npz", &["--receiver", &receiver]);
        folder.write("m.csv", format!("name,x,y,z\nm,{place}\n"));
        let file = folder.path("m.csv").display().to_string();
        let from_file = render(&folder, "a.sonelmap", "a.npz", &["--receivers", &file]);
        for result in [from_option, from_file] {
            let error = format!("{:#}", result.expect_err("no place"));
            assert!(error.contains(words), "{error}");
        }
        let scene = folder.text("scene.toml");
        folder.write("scene.toml", scene.replace("[3.9, 2.8, 1.2]", &format!("[{place}]")));
        let error = format!("{:#}", trace(&folder, "b.sonelmap", &[]).expect_err("no place"));
        assert!(error.contains("receivers[1].position") && error.contains(words), "{error}");
        folder.write("scene.toml", scene);
    }
    let surface = ["--receiver", "microphone=0.001,2,1.2", "--rays", "64"];
    render(&folder, "a.sonelmap", "a.npz", &surface).expect("a millimetre is far enough");
}

/// A mesh with a free partition and a closed object, and the same without its ceiling: in the open too nothing stands in a solid.
#[test]
fn partitions_and_solids_of_meshes_are_no_places() {
    let vertices = |low: [f64; 3], high: [f64; 3]| -> String {
        let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { high[axis] } else { low[axis] });
        (0..8).map(corner).map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect()
    };
    let walls = |first: usize, faces: &[[usize; 4]]| -> String {
        faces
            .iter()
            .map(|face| {
                let corners = face.map(|corner| (first + corner).to_string()).join(" ");
                format!("f {corners}\n")
            })
            .collect()
    };
    const BOX: [[usize; 4]; 6] =
        [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
    let partition = "v 2 0 0\nv 2 2 0\nv 2 2 1\nv 2 0 1\n";
    for (ceiling, outside) in [(6, "outside the room"), (5, "")] {
        let mesh = format!(
            "usemtl walls\n{}{}{partition}{}{}f 17 18 19 20\n",
            vertices([0.0; 3], [4.0, 4.0, 3.0]),
            vertices([3.0, 3.0, 0.5], [3.5, 3.5, 1.5]),
            walls(1, &BOX[..ceiling]),
            walls(9, &BOX)
        );
        let folder = TestFolder::with(
            "mesh = \"room.obj\"\nduration_s = 0.1\n[bands]\ncenter_frequencies_hz = [1000]\n\
             [materials.walls]\nabsorption = 0.5\n[[sources]]\nposition = [1.0, 1.0, 1.2]\n",
        );
        folder.write("room.obj", mesh);
        trace(&folder, "a.sonelmap", &["--packets", "200", "--effects", "none"]).expect("a valid scene");
        for (place, words) in
            [("2,1,0.5", "from a surface"), ("3.25,3.25,1", "inside a closed object"), ("5,1,1", outside)]
        {
            let receiver = format!("m={place}");
            match render(&folder, "a.sonelmap", "a.npz", &["--receiver", &receiver, "--rays", "64"]) {
                Err(error) => {
                    assert!(!words.is_empty() && format!("{error:#}").contains(words), "{place}: {error:#}");
                }
                Ok(_) => assert!(words.is_empty(), "{place} was accepted"),
            }
        }
        let (log, _) = rendered(&folder, &["--grid", "2:3.25:2,1:3.25:2,0.5:1:2"]);
        assert!(log.contains("points are left out: ") && log.contains("1 inside closed objects"), "{log}");
    }
}

/// The seats of the hall rise on the stalls and lie on a balcony, under which the rear of the stalls is.
#[test]
fn an_audience_is_covered_on_slopes_and_balconies_and_drawn_as_a_map() {
    let folder = TestFolder::with("");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/hall/scene.toml");
    let line =
        ["sonel-trace", scene, "-o", &folder.path("a.sonelmap").display().to_string()].map(str::to_owned);
    let line = line.into_iter().chain(["--packets", "100"].map(str::to_owned));
    printed(|out| {
        sonel_trace::run(&clap::Parser::try_parse_from(line.collect::<Vec<_>>())?, out, &mut Vec::new())
    })
    .expect("a valid scene");
    let quick =
        ["--spacing", "4", "--bin", "0.1", "--rays", "8", "--order", "1", "--effects", "-diffraction"];
    let audience = |more: &[&str]| render(&folder, "a.sonelmap", "a.npz", &[more, &quick].concat());
    audience(&["--audience", "seats"]).expect("seats");
    let found = response(&folder, "a.npz");
    assert_eq!(found.receiver_names[..2], ["seats 1", "seats 2"].map(str::to_owned));
    let heights = found.receiver_positions.iter().map(|position| position[2]);
    let [lowest, highest] = [heights.clone().fold(f64::MAX, f64::min), heights.fold(f64::MIN, f64::max)];
    assert!(highest - lowest > 4.0, "{lowest} … {highest}");
    let plot = folder.line("sonel-analyze", "a.npz", "a.svg", &["--what", "map", "--band", "1000"]);
    let plot = [plot[..1].to_vec(), vec!["plot".into()], plot[1..].to_vec()].concat();
    printed(|out| sonel_analyze::run(&clap::Parser::try_parse_from(plot)?, out, &mut Vec::new()))
        .expect("a map");
    assert!(folder.text("a.svg").contains("G, 1000 Hz"));
    for (options, words) in [
        (&["--audience", "seat"][..], "the scene has no material \"seat\"; it has \"seats\""),
        (&["--audience", "seats", "--height", "-1"], "--height -1 m is not a length"),
        (&["--audience", "seats", "--height", "50"], "14 below another face"),
    ] {
        let error = format!("{:#}", audience(options).expect_err("no audience"));
        assert!(error.contains(words), "{error}");
    }
}
