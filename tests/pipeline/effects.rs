//! Effects from the scene to the warning: what `sonel-trace` decides, `sonel-render` follows and misses.

use sonel_testkit::test_folder::TestFolder;

use crate::{render, response, trace};

/// A dead room whose receiver sees the source past a screen; behind the screen nothing else is heard.
const SCREENED: &str = r#"
name = "Screened"
mesh = "screened.obj"
duration_s = 0.2

[bands]
center_frequencies_hz = [250, 500]

[materials.walls]
absorption = 0.97
scattering = 0.5

[[sources]]
name = "speaker"
position = [2.0, 5.0, 1.5]

[[receivers]]
name = "in front"
position = [4.0, 5.0, 1.5]
"#;

/// A box of 20 m × 10 m × 4 m and a screen in it at x = 12 m, 2 m high.
const MESH: &str = "
v 0 0 0\nv 20 0 0\nv 20 10 0\nv 0 10 0\nv 0 0 4\nv 20 0 4\nv 20 10 4\nv 0 10 4
v 12 3 0\nv 12 7 0\nv 12 7 2\nv 12 3 2
usemtl walls
f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\nf 9 10 11 12
";

fn folder() -> TestFolder {
    let folder = TestFolder::with(SCREENED);
    folder.write("screened.obj", MESH);
    folder
}

fn effect(report: &str, name: &str) -> serde_json::Value {
    let report: serde_json::Value = serde_json::from_str(report).expect("JSON");
    let effects = report["effects"].as_array().expect("effects");
    effects.iter().find(|effect| effect["name"] == name).expect("of every effect").clone()
}

/// Energy in all bands at a receiver behind the screen.
fn behind(folder: &TestFolder, options: &[&str]) -> f64 {
    let options = [&["--receiver", "behind=13,5,0.6", "--estimator", "connection"][..], options].concat();
    render(folder, "auto.sonelmap", "behind.npz", &options).expect("a response");
    response(folder, "behind.npz").arrivals.energy.iter().sum()
}

/// The scene's receiver sees the source, and the map knows nothing of the other one: edges are computed where they matter.
#[test]
fn edges_are_computed_where_the_receivers_are() {
    let folder = folder();
    trace(&folder, "auto.sonelmap", &["--packets", "2k"]).unwrap();
    assert!(behind(&folder, &[]) > 10.0 * behind(&folder, &["--effects", "-diffraction"]));
    let refused = |result: anyhow::Result<String>| result.expect_err("not here").to_string();
    let error = refused(trace(&folder, "b.sonelmap", &["--effects", "auto,-diffraction"]));
    assert!(error.contains("--effects -diffraction,-boundary of the rendering"), "{error}");
    let error =
        format!("{:#}", render(&folder, "auto.sonelmap", "b.npz", &["--effects", "-air"]).unwrap_err());
    assert!(error.contains("give other effects to the trace"), "{error}");
}

/// In a room of 8 × 6 × 4 m levels at 63 Hz are lower by default, and at 1 kHz the same; responses state by how much. Outdoors nothing is.
#[test]
fn rooms_have_the_boundary_term_unless_it_is_left_out() {
    let room = SCREENED
        .replace("mesh = \"screened.obj\"", "shoebox = [8.0, 6.0, 4.0]")
        .replace("[250, 500]", "[63, 1000]")
        .replace("0.97", "0.1");
    let folder = TestFolder::with(&room);
    trace(&folder, "a.sonelmap", &["--packets", "500", "--effects", "none"]).unwrap();
    let heard = |name: &str, options: &[&str]| {
        render(&folder, "a.sonelmap", name, options).expect("a response");
        let response = response(&folder, name);
        let bands: Vec<f64> = response.energy.chunks(response.bins()).map(|bins| bins.iter().sum()).collect();
        let absorbed = response.provenance.options.expect("how it was rendered").boundary_absorption;
        (bands, response.provenance.sources[0].boundary_db.clone(), absorbed)
    };
    let (with, stated, absorbed) = heard("with.npz", &[]);
    let (without, nothing, all) = heard("without.npz", &["--effects", "-boundary"]);
    assert!(all.is_empty() && (0.75..0.85).contains(&absorbed[0]) && absorbed[1] >= 1.0, "{absorbed:?}");
    assert!(
        nothing.is_empty() && (stated[0][0] + 2.1).abs() < 0.1 && stated[0][1].abs() < 1e-12,
        "{stated:?}"
    );
    let factor = 10_f64.powf(0.1 * stated[0][0]);
    assert!(with[0] < 0.8 * without[0] && with[0] > factor * without[0], "{with:?} {without:?}");
    // Energies of all bands choose what is connected.
    assert!((with[1] / without[1] - 1.0).abs() < 2e-3, "{with:?} {without:?}");
}

/// A screen of 400 m × 200 m in the open, and nothing else: behind it there is sound, by default.
#[test]
fn nobody_is_left_without_sound_behind_a_screen() {
    let folder = TestFolder::with(&SCREENED.replace("[2.0, 5.0, 1.5]", "[-10.0, 0.0, 0.0]"));
    folder.write(
        "screened.obj",
        "v 0 -200 -100\nv 0 200 -100\nv 0 200 100\nv 0 -200 100\nusemtl walls\nf 1 2 3 4\n",
    );
    trace(&folder, "open.sonelmap", &["--packets", "1k", "--duration", "0.8"]).unwrap();
    let heard = |options: &[&str]| -> f64 {
        let options = [&["--receiver", "behind=15,0,0"][..], options].concat();
        render(&folder, "open.sonelmap", "behind.npz", &options).expect("a response");
        response(&folder, "behind.npz").energy.iter().sum()
    };
    assert!(heard(&[]) > 0.0);
    assert!(heard(&["--effects", "-diffraction"]) <= 0.0, "nothing else arrives there");
}

#[test]
fn air_that_is_left_out_for_packets_stays_with_what_is_computed_one_by_one() {
    let folder = folder();
    let report = trace(&folder, "auto.sonelmap", &["--packets", "2k", "--json"]).unwrap();
    assert_eq!(effect(&report, "air")["on"], false);
    render(&folder, "auto.sonelmap", "auto.npz", &[]).unwrap();
    trace(&folder, "all.sonelmap", &["--packets", "2k", "--effects", "auto,+air"]).unwrap();
    render(&folder, "all.sonelmap", "all.npz", &[]).unwrap();
    let (auto, all) = (response(&folder, "auto.npz"), response(&folder, "all.npz"));
    assert!(
        !auto.arrivals.energy.is_empty() && auto.arrivals.energy == all.arrivals.energy,
        "exact either way"
    );
    let sum = |energy: &[f64]| energy.iter().sum::<f64>();
    assert!(sum(&auto.energy) > sum(&all.energy), "packets carry air only where it was asked for");
}
