//! `tradeoff` from outside: a mirroring box, whose exact answer is known, and a box where it is not.

use serde_json::Value;
use sonel_testkit::analytic::specular_box::SpecularBox;
use sonel_testkit::test_folder::TestFolder;

use crate::analyze;

fn scene(scattering: f64) -> String {
    format!(
        "name = \"Small box\"\nshoebox = [6.0, 5.0, 4.0]\nduration_s = 0.8\n\
         [bands]\ncenter_frequencies_hz = [500, 1000]\n\
         [air]\nspeed_of_sound = 343.0\nattenuation = false\n\
         [materials.walls]\nabsorption = 0.3\nscattering = {scattering}\n\
         [[sources]]\nname = \"stage\"\nposition = [1.5, 1.2, 1.3]\n\
         [[receivers]]\nname = \"seat\"\nposition = [4.2, 3.7, 2.1]\n"
    )
}

/// The JSON of a sweep with `options`, and what was printed.
fn sweep(folder: &TestFolder, options: &[&str]) -> (Value, String) {
    let words = ["tradeoff", "scene.toml", "-o", "out", "--repeats", "4", "--quiet"];
    let printed = analyze(folder, &[&words[..], options].concat()).done().out;
    (serde_json::from_str(&folder.text("out/tradeoff.json")).expect("JSON"), printed)
}

fn curve<'a>(json: &'a Value, setting: &str, parameter: &str) -> &'a Value {
    let curves = json["curves"].as_array().expect("a list");
    curves
        .iter()
        .find(|curve| curve["setting"] == setting && curve["parameter"] == parameter)
        .expect("a curve")
}

#[test]
fn a_mirroring_box_is_judged_by_its_exact_answer() {
    let folder = TestFolder::with(&scene(0.0));
    let options = ["--packets", "500,2k,8k", "--estimator", "auto,sphere"];
    let (json, printed) = sweep(&folder, &options);
    assert_eq!(json["reference"]["kind"], "exact");

    let room = SpecularBox {
        size: [6.0, 5.0, 4.0],
        reflection: [0.7; 6],
        speed_of_sound: 343.0,
        air_attenuation: 0.0,
    };
    let fluence: f64 = room.echogram([1.5, 1.2, 1.3], [4.2, 3.7, 2.1], 0.001, 800).iter().sum();
    let levels =
        json["parameters"].as_array().unwrap().iter().filter(|estimate| estimate["parameter"] == "level_db");
    let references: Vec<f64> = levels.map(|estimate| estimate["reference"].as_f64().unwrap()).collect();
    // 90 dB of source power, and 10 lg(ρc / 400) of air at 20 °C and 50 % (docs/physics.md §1).
    let expected = 90.0 + 10.0 * fluence.log10() + 0.12;
    assert!(references.iter().all(|level| (level - expected).abs() < 0.005), "{references:?} not {expected}");

    let auto = curve(&json, "auto", "level_db");
    assert!(auto["points"].as_array().unwrap().iter().all(|point| {
        point["bias"]["value"].as_f64().unwrap().abs() < 1e-4 && point["efficiency"]["value"].is_null()
    }));
    let sphere = &curve(&json, "sphere", "level_db")["points"];
    let deviation = |n: usize| sphere[n]["standard_deviation"]["value"].as_f64().unwrap();
    assert!(deviation(0) > 1.5 * deviation(2) && deviation(2) > 0.02, "{sphere}");
    assert!(printed.contains("auto samples nothing"), "{printed}");
}

#[test]
fn a_scattering_box_is_judged_by_a_longer_run_and_everything_is_written() {
    let folder = TestFolder::with(&scene(0.5));
    let options = ["--packets", "2k,8k", "--mode", "accurate,paper"];
    let (json, printed) = sweep(&folder, &options);
    assert_eq!(
        (&json["reference"]["kind"], &json["reference"]["packets"]),
        (&"longest run".into(), &32_000.into())
    );
    let names = ["README.md", "bias.svg", "cost.svg", "deviation.svg", "efficiency.svg", "tradeoff.json"];
    for name in names {
        assert!(!folder.text(&format!("out/{name}")).is_empty(), "{name}");
    }
    assert_eq!(std::fs::read_dir(folder.path("out")).unwrap().count(), 6, "nothing unfinished is left");
    let page = folder.text("out/README.md");
    assert!(page.contains("tradeoff scene.toml -o out") && page.contains(printed.trim()), "{page}");
    let points = |curve: &Value| curve["points"].as_array().unwrap().len();
    // Roulette on absorption alone leaves too few packets for the late decay: some of its T30 are refused.
    assert_eq!(
        [points(curve(&json, "accurate", "t30_s")), points(curve(&json, "paper", "level_db"))],
        [2, 2]
    );
    // Two settings, two numbers of packets, two bands, four parameters.
    assert_eq!(json["parameters"].as_array().unwrap().len(), 32);
    let seconds = json["seconds"].as_array().unwrap();
    assert!(seconds.iter().all(|row| row["cpu_s"].as_array().unwrap().len() == 4));
    assert!(seconds.iter().all(|row| row["phases"]["trace_s"].as_f64().unwrap() > 0.0));
    // The paper's method is no other physics: four standard errors of these runs are 0.2 dB.
    let bias = curve(&json, "paper", "level_db")["points"][1]["bias"]["value"].as_f64().unwrap();
    assert!(bias.abs() < 0.2, "{bias}");
}

#[test]
fn impossible_sweeps_are_refused_with_all_their_mistakes() {
    let folder = TestFolder::with(&scene(0.5));
    let words =
        ["tradeoff", "scene.toml", "-o", "out", "--survival", "0.1,2", "--packets", "0", "--radius", "-1"];
    let refused = analyze(&folder, &words).refused();
    for word in ["--survival", "--packets", "--radius"] {
        assert!(refused.contains(word), "{word}: {refused}");
    }
    let bare = scene(0.5).split("[[receivers]]").next().unwrap().to_owned();
    folder.write("scene.toml", bare);
    assert!(analyze(&folder, &["tradeoff", "scene.toml", "-o", "out"]).refused().contains("no receiver"));
    assert!(!folder.path("out").exists());
}
