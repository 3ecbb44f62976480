//! Known rooms from scene file to parameter: levels, decay times and clarity with intervals
//! that are narrow enough to mean something (docs/physics.md §8). The founding paper's room is in `accept`, `known_rooms`.

use clap::Parser;
use sonel_analysis::modal::ModalBands;
use sonel_analysis::{Parameter, parameters};

use sonel_testkit::test_folder::TestFolder;

use crate::{printed, render, response, test_folder, trace};

/// A parameter that must be: value, largest deviation, largest half-width of its interval.
type Expectation = (Parameter, f64, f64, f64);

fn check(folder: &TestFolder, options: &[&str], band: usize, expectations: &[Expectation]) {
    trace(folder, "a.sonelmap", options).expect("a valid scene");
    // Closed forms are those of rays.
    render(folder, "a.sonelmap", "a.npz", &["--effects", "-boundary"]).expect("a valid map");
    let response = response(folder, "a.npz");
    let parameters = parameters(&response);
    let mut wrong = Vec::new();
    for &(parameter, expected, tolerance, widest) in expectations {
        let estimate =
            parameters[0].bands[band].parameter(parameter).as_ref().expect("a parameter the data support");
        let Ok([low, high]) = estimate.interval else { panic!("{parameter:?} has no interval") };
        let deviation = (estimate.value - expected).abs();
        if !(deviation <= tolerance && (high - low) / 2.0 <= widest) {
            wrong.push(format!("{parameter:?}: {} in [{low}, {high}] instead of {expected}", estimate.value));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Strength of a total fluence [dB].
fn strength(fluence: f64) -> f64 {
    10.0 * (400.0 * std::f64::consts::PI * fluence).log10()
}

fn small_box(scattering: f64) -> TestFolder {
    TestFolder::with(&format!(
        "name = \"Box 6 x 5 x 4 m\"\nshoebox = [6.0, 5.0, 4.0]\nduration_s = 1.5\n\
         [air]\nspeed_of_sound = 343.0\nattenuation = false\n\
         [materials.walls]\nabsorption = 0.2\nscattering = {scattering}\n\
         [[sources]]\nname = \"source\"\nposition = [1.5, 1.2, 1.3]\n\
         [[receivers]]\nname = \"receiver\"\nposition = [4.2, 3.7, 2.1]\n"
    ))
}

#[test]
fn diffuse_box() {
    let expected = [
        (Parameter::Strength, strength(0.101_62), 0.05, 0.05),
        (Parameter::T30, 0.611, 0.006, 0.006),
        (Parameter::ClarityC80, 6.89, 0.1, 0.1),
    ];
    check(&small_box(1.0), &["--packets", "100k"], 3, &expected);
}

#[test]
fn mixed_box() {
    let expected = [
        (Parameter::Strength, strength(0.101_02), 0.05, 0.05),
        (Parameter::T30, 0.600_8, 0.006, 0.006),
        (Parameter::EarlyDecayTime, 0.597, 0.006, 0.006),
        (Parameter::ClarityC80, 7.25, 0.1, 0.1),
    ];
    check(&small_box(0.5), &["--packets", "100k"], 3, &expected);
}

/// Half a just-noticeable difference of each parameter, and a fifth more: half-widths of 32 batches err by 13 %.
#[test]
fn the_default_number_of_packets_is_the_same_in_every_room() {
    let folder = small_box(0.5);
    let halves = [(Parameter::Strength, 0.6), (Parameter::T30, 0.018), (Parameter::ClarityC80, 0.6)];
    let expected = halves.map(|(parameter, widest)| {
        let value = match parameter {
            Parameter::T30 => 0.600_8,
            Parameter::ClarityC80 => 7.25,
            _ => strength(0.101_02),
        };
        (parameter, value, 1.5 * widest, widest)
    });
    check(&folder, &[], 3, &expected);
    let traced = std::fs::read(folder.path("a.sonelmap")).unwrap();
    let packets = sonel_map::SonelMap::from_bytes(&traced).unwrap().header().settings.emissions;
    assert_eq!(packets, 16_000);
    trace(&folder, "b.sonelmap", &["--packets", &packets.to_string()]).unwrap();
    assert!(traced == std::fs::read(folder.path("b.sonelmap")).unwrap(), "other bytes than with --packets");
    trace(&folder, "c.sonelmap", &["--packets", "2k", "--seed", "2"]).unwrap();
    let decision = folder.path("c.sonelmap").display().to_string();
    let decided = ["--seed", "3", "--decision", &decision];
    trace(&folder, "d.sonelmap", &decided).unwrap();
    let decided = std::fs::read(folder.path("d.sonelmap")).unwrap();
    assert_eq!(sonel_map::SonelMap::from_bytes(&decided).unwrap().header().settings.emissions, 2000);
}

/// 2000 √(0.76 s/120 m³) = 159 Hz at 63 Hz, where walls absorb four fifths; in ten times the volume 50 Hz.
#[test]
fn bands_below_the_schroeder_frequency_are_named() {
    let folder = small_box(0.5);
    trace(&folder, "a.sonelmap", &["--packets", "2k"]).unwrap();
    render(&folder, "a.sonelmap", "a.npz", &[]).unwrap();
    let response = response(&folder, "a.npz");
    let volume = response.provenance.volume_m3.unwrap();
    let named = ModalBands::of(&parameters(&response), volume).unwrap().to_string();
    assert!(named.starts_with("63, 125 Hz are below the Schroeder frequency (15"), "{named}");
    assert!(named.contains("standard deviations of about 2.") && named.contains(" %, "), "{named}");
    assert_eq!(ModalBands::of(&parameters(&response), 10.0 * volume), None);
}

/// Noise is stated from 125 Hz on, the first band of the room is 63 Hz.
#[test]
fn speech_in_noise_is_listed_though_the_first_band_has_none() {
    let folder = small_box(0.5);
    trace(&folder, "a.sonelmap", &["--packets", "2k"]).unwrap();
    render(&folder, "a.sonelmap", "a.npz", &[]).unwrap();
    let ask = |options: &[&str]| {
        let path = folder.path("a.npz").display().to_string();
        let line = [&["sonel-analyze", "parameters", &path, "--noise", "NR-35"], options].concat();
        let arguments = sonel_analyze::Arguments::try_parse_from(line).unwrap();
        printed(|out| sonel_analyze::run(&arguments, out, &mut Vec::new())).unwrap()
    };
    assert!(ask(&[]).contains("U50 [dB]") && ask(&["--mean"]).contains("U50 [dB]"), "{}", ask(&[]));
    let json: serde_json::Value = serde_json::from_str(&ask(&["--format", "json"])).unwrap();
    let bands = json["receivers"][0]["bands"].as_array().unwrap();
    assert!(
        bands[0]["useful_to_detrimental_u50_db"].is_null()
            && bands[1]["useful_to_detrimental_u50_db"]["value"].is_number(),
        "{json:#}"
    );
    assert!(
        json["receivers"][0]["single_numbers"]["useful_to_detrimental_u50_db"]["value"].is_number(),
        "{json:#}"
    );
}

/// Image sources alone: no noise at all.
#[test]
fn mirror_box() {
    let expected = [
        (Parameter::Strength, strength(0.100_788), 0.01, 1e-4),
        (Parameter::EarlyDecayTime, 0.605, 0.006, 1e-3),
        (Parameter::T30, 0.668, 0.0067, 1e-3),
        (Parameter::ClarityC80, 7.333, 0.1, 1e-3),
    ];
    check(&small_box(0.0), &[], 3, &expected);
}

/// Kuttruff's and the radiosity solution's T30 of 10 × 8 × 5 m, Lambert walls, α = 0.2; Eyring's 0.849 s is rejected.
#[test]
fn diffuse_box_of_kuttruff() {
    let folder = TestFolder::with(
        "name = \"Box 10 x 8 x 5 m\"\nshoebox = [10.0, 8.0, 5.0]\nduration_s = 1.6\n\
         [bands]\ncenter_frequencies_hz = [1000]\n[air]\nspeed_of_sound = 343.0\nattenuation = false\n\
         [materials.walls]\nabsorption = 0.2\nscattering = 1.0\n\
         [[sources]]\nname = \"source\"\nposition = [2.5, 2.0, 1.5]\n\
         [[receivers]]\nname = \"receiver\"\nposition = [7.0, 5.5, 3.0]\n",
    );
    check(&folder, &["--packets", "60k"], 0, &[(Parameter::T30, 0.888, 0.005 * 0.888, 0.004)]);
}

/// A variant of a map beside it: differences are those of the values, and sharper than those of runs of their own.
#[test]
fn several_responses_stand_side_by_side_with_differences_from_the_first() {
    let folder = test_folder();
    trace(&folder, "room.sonelmap", &["--packets", "1500"]).unwrap();
    let softer = ["--rays", "64", "--set", "materials.walls.absorption=0.5"];
    render(&folder, "room.sonelmap", "before.npz", &softer[..2]).unwrap();
    render(&folder, "room.sonelmap", "after.npz", &softer).unwrap();
    folder.write("scene.toml", folder.text("scene.toml").replace("\"listener\"", "\"other\""));
    trace(&folder, "other.sonelmap", &["--packets", "500"]).unwrap();
    render(&folder, "other.sonelmap", "other.npz", &softer[..2]).unwrap();
    let ask = |files: &[&str], more: &[&str]| {
        let files = files.iter().map(|name| folder.path(name).display().to_string());
        let line = ["sonel-analyze", "parameters"].map(str::to_owned).into_iter().chain(files);
        let line: Vec<String> = line.chain(more.iter().map(|word| (*word).to_owned())).collect();
        printed(|out| {
            sonel_analyze::run(&sonel_analyze::Arguments::try_parse_from(line)?, out, &mut Vec::new())
        })
    };
    let both = ["before.npz", "after.npz"];
    let table = ask(&both, &[]).unwrap();
    assert!(table.contains("before") && table.contains("after − before"), "{table}");
    let levels: Vec<&str> = table.lines().filter(|line| line.trim_start().starts_with("L [dB]")).collect();
    assert_eq!(levels.len(), 4, "three bands and a single number: {table}");
    assert!(levels[0].ends_with(" *"), "{table}");
    let json: serde_json::Value = serde_json::from_str(&ask(&both, &["--format", "json"]).unwrap()).unwrap();
    let level = |response: usize| {
        let value = &json["responses"][response]["receivers"][0]["bands"][0]["level_db"];
        let ends = [0, 1].map(|end| value["ci95"][end].as_f64().unwrap());
        (value["value"].as_f64().unwrap(), 0.5 * (ends[1] - ends[0]))
    };
    let is_level = |found: &&serde_json::Value| {
        found["parameter"] == "level_db" && found["center_frequency_hz"] == 250.0
    };
    let found = json["differences"].as_array().unwrap().iter().find(is_level).unwrap();
    let ends = [0, 1].map(|end| found["difference"]["ci95"][end].as_f64().unwrap());
    assert!((found["difference"]["value"].as_f64().unwrap() - (level(1).0 - level(0).0)).abs() < 1e-12);
    assert!(0.5 * (ends[1] - ends[0]) < 0.8 * level(0).1.hypot(level(1).1), "{found}");
    assert_eq!((&found["beyond_noise"], &found["response"]), (&true.into(), &"after".into()));
    // The same response differs by nothing.
    let same = ask(&["before.npz", "before.npz"], &["--mean"]).unwrap();
    assert!(same.contains("(0)") && !same.contains(" *\n"), "{same}");
    let csv = ask(&both, &["--format", "csv"]).unwrap();
    let rows: Vec<&str> = csv.lines().filter(|row| row.contains(",250,level_db,")).collect();
    assert!(rows.len() == 2 && rows[0].ends_with(",,,,") && rows[1].contains(",after,"), "{rows:?}");
    let error = format!("{:#}", ask(&["before.npz", "other.npz"], &[]).unwrap_err());
    assert!(error.contains("in common"), "{error}");
}
