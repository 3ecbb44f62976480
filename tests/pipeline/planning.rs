//! Plans and targets: what they promise comes true, and the run is that of the number of packets it ends with.

use clap::Parser;
use serde_json::Value;
use sonel_console::Outcome;
use sonel_testkit::test_folder::TestFolder;

use crate::{render, test_folder, trace};

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

/// Runs `sonel-trace` with a target; how it ended, and its report.
fn until(folder: &TestFolder, map: &str, options: &[&str]) -> (Outcome, Value) {
    let line = folder.line("sonel-trace", "scene.toml", map, &[options, &["--json"]].concat());
    let arguments = sonel_trace::Arguments::try_parse_from(line).expect("sound options");
    let mut out = Vec::new();
    let outcome = sonel_trace::run(&arguments, &mut out, &mut Vec::new()).expect("a valid scene");
    (outcome, json(&String::from_utf8(out).expect("text")))
}

#[test]
fn a_run_until_a_target_is_the_run_of_its_number_of_sonels() {
    let folder = test_folder();
    let (outcome, report) = until(&folder, "a.sonelmap", &["--until", "t30<1%,level<0.1dB,c80<0.2dB"]);
    assert_eq!(outcome, Outcome::Done);
    assert_eq!(report["until"]["reached"], true);
    let worst = &report["until"]["worst"];
    assert!(worst["half_width_jnd"].as_f64().unwrap() <= worst["limit_jnd"].as_f64().unwrap());
    let packets = report["until"]["packets"].to_string();
    trace(&folder, "b.sonelmap", &["--packets", &packets]).unwrap();
    assert!(folder.bytes("a.sonelmap") == folder.bytes("b.sonelmap"), "{packets} packets");
}

#[test]
fn what_is_out_of_reach_is_said_and_the_map_is_that_of_the_sonels_reached() {
    let folder = test_folder();
    let (outcome, report) = until(&folder, "a.sonelmap", &["--until", "t30<0.01jnd", "--packets", "3k"]);
    assert_eq!(outcome, Outcome::Missed);
    assert_eq!(
        (&report["until"]["reached"], &report["until"]["packets"]),
        (&Value::Bool(false), &Value::from(3000))
    );
    trace(&folder, "b.sonelmap", &["--packets", "3k"]).unwrap();
    assert!(folder.bytes("a.sonelmap") == folder.bytes("b.sonelmap"));
}

#[test]
fn a_map_goes_on_until_a_target() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "1k"]).unwrap();
    let map = folder.path("a.sonelmap").display().to_string();
    let (outcome, report) = until(&folder, "b.sonelmap", &["--until", "t30<0.3jnd", "--extend", &map]);
    assert_eq!(outcome, Outcome::Done);
    trace(&folder, "c.sonelmap", &["--packets", &report["until"]["packets"].to_string()]).unwrap();
    assert!(folder.bytes("b.sonelmap") == folder.bytes("c.sonelmap"));
}

#[test]
fn plans_ask_for_more_where_less_uncertainty_is_wanted() {
    let folder = test_folder();
    let scene = folder.path("scene.toml").display().to_string();
    let arguments =
        sonel_trace::Arguments::try_parse_from(["sonel-trace", &scene, "--plan", "--json", "--quiet"])
            .unwrap();
    let mut out = Vec::new();
    assert_eq!(sonel_trace::run(&arguments, &mut out, &mut Vec::new()).unwrap(), Outcome::Done);
    let plan = json(&String::from_utf8(out).unwrap());
    let rows = plan["plan"]["rows"].as_array().unwrap();
    let accuracies: Vec<f64> = rows.iter().map(|row| row["just_noticeable"].as_f64().unwrap()).collect();
    assert_eq!(accuracies, [1.0, 0.5, 0.2, 0.1, 0.05]);
    let packets: Vec<u64> = rows.iter().map(|row| row["packets"].as_u64().unwrap()).collect();
    assert!(packets.windows(2).all(|pair| pair[0] <= pair[1]) && packets[4] > 10 * packets[2], "{packets:?}");
    assert_eq!(plan["effects"].as_array().unwrap().len(), 6);
    assert_eq!(rows[0]["half_widths"].as_array().unwrap().len(), 3);
}

/// Half-widths after a planned run within a factor of 1.5, two and a half standard deviations of both estimates; those planned for
/// a quarter of the packets are found out.
#[test]
fn predicted_intervals_come_true() {
    let folder = test_folder();
    let report = json(&trace(&folder, "a.sonelmap", &["--plan", "--json", "--packets", "40k"]).unwrap());
    let widths = |key: &str| report[key]["half_widths_jnd"].as_object().unwrap().clone();
    let (predicted, achieved) = (widths("predicted"), widths("achieved"));
    assert_eq!(predicted.len(), 4);
    let near = |scale: f64| {
        predicted.iter().all(|(estimate, width)| {
            let ratio = achieved[estimate].as_f64().unwrap() / (scale * width.as_f64().unwrap());
            (1.0 / 1.5..1.5).contains(&ratio)
        })
    };
    assert!(near(1.0), "{predicted:?} {achieved:?}");
    assert!(!near(2.0));
}

#[test]
fn targets_that_cannot_be_read_say_what_can() {
    let folder = test_folder();
    for (options, part) in [
        (&["--until", "rt60<1%"][..], "level, g, edt"),
        (&["--until", "t30<1dB"], "t30<1%"),
        (&["--until", "t30<1%", "--at-most", "soon"], "60s"),
        (&["--until", "t30<1%", "--shard", "1/2"], "--plan"),
        (&["--packets", "1G"], "--at-most allows 10 min on "),
    ] {
        let error = format!("{:#}", trace(&folder, "a.sonelmap", options).unwrap_err());
        assert!(error.contains(part), "{options:?}: {error}");
    }
}

/// Runs `sonel-render` with a target; how it ended, and its report.
fn render_until(folder: &TestFolder, map: &str, response: &str, options: &[&str]) -> (Outcome, Value) {
    let line = folder.line("sonel-render", map, response, &[options, &["--json"]].concat());
    let arguments = sonel_render::Arguments::try_parse_from(line).expect("sound options");
    let mut out = Vec::new();
    let outcome = sonel_render::run(&arguments, &mut out, &mut Vec::new()).expect("a valid map");
    (outcome, json(&String::from_utf8(out).expect("text")))
}

#[test]
fn a_rendering_until_a_target_is_that_of_its_number_of_rays() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "20k"]).unwrap();
    // Rays that gather in small discs are most of the noise: they are added.
    let gathered = ["--estimator", "gather", "--until", "level<0.026jnd"];
    let (outcome, report) = render_until(&folder, "a.sonelmap", "a.npz", &gathered);
    assert_eq!((outcome, &report["until"]["reached"]), (Outcome::Done, &Value::Bool(true)));
    let worst = &report["until"]["worst"];
    assert!(worst["half_width_jnd"].as_f64().unwrap() <= worst["limit_jnd"].as_f64().unwrap());
    let rays = report["until"]["rays"].as_u64().unwrap();
    assert!(rays > 2_500 && report["until"]["iterations"].as_u64().unwrap() > 1, "{}", report["until"]);
    render(&folder, "a.sonelmap", "b.npz", &["--estimator", "gather", "--rays", &rays.to_string()]).unwrap();
    assert!(folder.bytes("a.npz") == folder.bytes("b.npz"), "{rays} rays");
}

#[test]
fn a_target_that_some_batches_keep_takes_no_more_of_them() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "20k"]).unwrap();
    let (outcome, report) = render_until(&folder, "a.sonelmap", "a.npz", &["--until", "t30<5%,level<0.5dB"]);
    let (until, worst) = (&report["until"], &report["until"]["worst"]);
    assert_eq!((outcome, &until["reached"]), (Outcome::Done, &Value::Bool(true)));
    assert!(worst["half_width_jnd"].as_f64().unwrap() <= worst["limit_jnd"].as_f64().unwrap());
    let batches = until["batches"].as_u64().unwrap();
    assert!(batches < 32, "{until}");
    assert!(until.get("rays_wanted").is_some() && until.get("packets_wanted").is_some(), "{until}");
    render(&folder, "a.sonelmap", "b.npz", &["--batches", &batches.to_string()]).unwrap();
    assert!(folder.bytes("a.npz") == folder.bytes("b.npz"), "{batches} batches");
}

#[test]
fn rays_stop_where_they_may_be_no_more() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "20k"]).unwrap();
    let gathered = ["--estimator", "gather", "--until", "level<0.01jnd"];
    // A quarter of the batches, then, where there is time, all of them.
    for (bound, iterations) in [(["--rays", "2048"], 2), (["--at-most", "0.001s"], 1)] {
        let (outcome, report) =
            render_until(&folder, "a.sonelmap", "a.npz", &[&gathered[..], &bound].concat());
        assert_eq!(
            (outcome, &report["until"]["iterations"]),
            (Outcome::Missed, &Value::from(iterations)),
            "{bound:?}"
        );
        assert_eq!(report["until"]["reached"], false);
    }
}

/// A map without rays is told how many packets it lacks, and with them the target is near: within a factor of 1.5, two and a half
/// standard deviations of both estimates.
#[test]
fn what_rays_cannot_reach_takes_the_sonels_that_are_said() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "4k"]).unwrap();
    let (outcome, report) = render_until(&folder, "a.sonelmap", "a.npz", &["--until", "level<0.02jnd"]);
    assert_eq!((outcome, &report["until"]["iterations"]), (Outcome::Missed, &Value::from(2)));
    render(&folder, "a.sonelmap", "b.npz", &[]).unwrap();
    assert!(folder.bytes("a.npz") == folder.bytes("b.npz"));
    let packets = report["until"]["packets_wanted"].as_u64().unwrap();
    assert!(packets > 8_000, "{packets}");
    let map = folder.path("a.sonelmap").display().to_string();
    let achieved = |packets: u64| {
        let packets = packets.to_string();
        trace(&folder, "longer.sonelmap", &["--extend", &map, "--packets", &packets]).unwrap();
        let (_, report) = render_until(&folder, "longer.sonelmap", "c.npz", &["--until", "level<0.02jnd"]);
        report["until"]["worst"]["half_width_jnd"].as_f64().unwrap() / 0.02
    };
    let near = |ratio: f64| (1.0 / 1.5..1.5).contains(&ratio);
    let right = achieved(packets);
    assert!(near(right), "{right} with {packets} packets");
    assert!(!near(achieved(packets / 4)), "a quarter of them is found out");
}

#[test]
fn plans_of_a_map_say_which_rays_and_which_sonels_are_wanting() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "20k"]).unwrap();
    let options = ["--estimator", "gather", "--plan", "--json"];
    let report = json(&render(&folder, "a.sonelmap", "a.npz", &options).unwrap());
    render(&folder, "a.sonelmap", "b.npz", &options[..2]).unwrap();
    assert!(folder.bytes("a.npz") == folder.bytes("b.npz"), "a plan changes nothing");
    let rows = report["plan"]["rows"].as_array().unwrap();
    let rays: Vec<u64> = rows.iter().map(|row| row["rays"].as_u64().unwrap()).collect();
    assert!(rays.windows(2).all(|pair| pair[0] <= pair[1]) && rays[0] < rays[4], "{rays:?}");
    assert!(rows[0]["packets_wanted"].is_null(), "one just-noticeable difference is easy");
    assert!(rows[4]["packets_wanted"].as_u64().unwrap() > 20_000, "a twentieth is beyond 20 000 packets");
    assert!(rows.iter().all(|row| row["packets"] == 20_000));
}

/// Half-widths of a planned rendering within a factor of 1.5, as above.
#[test]
fn what_is_predicted_of_a_rendering_comes_true() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "40k"]).unwrap();
    let report = json(&render(&folder, "a.sonelmap", "a.npz", &["--plan", "--json"]).unwrap());
    let widths = |key: &str| report[key]["half_widths_jnd"].as_object().unwrap().clone();
    let (predicted, achieved) = (widths("predicted"), widths("achieved"));
    let near = |scale: f64| {
        predicted.iter().all(|(estimate, width)| {
            let ratio = achieved[estimate].as_f64().unwrap() / (scale * width.as_f64().unwrap());
            (1.0 / 1.5..1.5).contains(&ratio)
        })
    };
    assert!(predicted.len() == 4 && near(1.0), "{predicted:?} {achieved:?}");
    assert!(!near(2.0));
    assert!(["predicted", "achieved"].iter().all(|key| report[key]["render_cpu_s"].as_f64().unwrap() > 0.0));
}

#[test]
fn targets_and_plans_of_a_map_that_make_no_sense_are_errors() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "1k"]).unwrap();
    for (options, part) in [
        (&["--until", "rt60<1%"][..], "level, g, edt"),
        (&["--until", "t30<1dB"], "t30<1%"),
        (&["--until", "t30<1%", "--at-most", "soon"], "60s"),
        (&["--rays", "4G"], "--at-most allows 10 min on "),
        (&["--until", "t30<1%", "--rays", "0"], "give 1 … 4294967295 rays"),
    ] {
        let error = format!("{:#}", render(&folder, "a.sonelmap", "a.npz", options).unwrap_err());
        assert!(error.contains(part), "{options:?}: {error}");
    }
    let without_output = |line: &[&str]| {
        let line = [&["sonel-render", "a.sonelmap"], line].concat();
        sonel_render::Arguments::try_parse_from(line).map_err(|error| error.to_string())
    };
    assert!(without_output(&["--plan"]).is_ok());
    assert!(without_output(&[]).unwrap_err().contains("--output"));
    assert!(without_output(&["--plan", "--until", "t30<1%"]).unwrap_err().contains("--output"));
}
