//! From a map to impulse responses, to a recording heard in the room, and to a table.

use std::io::Cursor;

use clap::Parser;
use sonel_sound::Recording;
use sonel_testkit::test_folder::TestFolder;

use crate::{printed, render, response, test_folder, trace};

const FILE: &str = "wav/1-speaker_1-listener.wav";

fn read(folder: &TestFolder, name: &str) -> Recording {
    Recording::read(Cursor::new(folder.bytes(name))).expect("a WAV file just written")
}

fn write(folder: &TestFolder, name: &str, recording: &Recording) {
    let mut file = Cursor::new(Vec::new());
    recording.write(&mut file).expect("memory");
    folder.write(name, file.into_inner());
}

fn analyze(folder: &TestFolder, words: &[&str]) -> anyhow::Result<String> {
    let paths = words.iter().map(|word| {
        if word.contains('.') { folder.path(word).display().to_string() } else { (*word).to_owned() }
    });
    let line: Vec<String> = std::iter::once("sonel-analyze".to_owned()).chain(paths).collect();
    printed(|out| sonel_analyze::run(&sonel_analyze::Arguments::try_parse_from(line)?, out, &mut Vec::new()))
}

/// A folder with a map, a response and an impulse response.
fn rendered() -> TestFolder {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "2k"]).expect("a valid scene");
    let sounds = folder.path("wav").display().to_string();
    render(&folder, "a.sonelmap", "a.npz", &["--wav", &sounds]).expect("a valid map");
    folder
}

#[test]
fn an_impulse_response_begins_with_the_direct_sound_and_is_the_same_with_any_number_of_threads() {
    let folder = rendered();
    let received = read(&folder, FILE);
    assert_eq!((received.sample_rate_hz, received.channels.len()), (48_000, 1));
    assert_eq!(received.channels[0].len(), 48 * 600 + 1);
    let distance = (2.9_f64.powi(2) + 1.8_f64.powi(2) + 0.3_f64.powi(2)).sqrt();
    let at = (distance / 343.0 * 48_000.0).round() as usize;
    let loudest = (0..received.channels[0].len())
        .max_by(|&a, &b| received.channels[0][a].abs().total_cmp(&received.channels[0][b].abs()));
    assert_eq!(loudest, Some(at));
    // Air takes 0.03 dB of the highest band on that way; between samples a pulse is a sinc.
    let off = std::f64::consts::PI * (at as f64 - distance / 343.0 * 48_000.0);
    assert!((f64::from(received.channels[0][at]) * distance - off.sin() / off).abs() < 0.01);
    let again = folder.path("again").display().to_string();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let ambix = ["--wav", &again, "--ambix", "3", "--aim"];
    pool.install(|| render(&folder, "a.sonelmap", "b.npz", &ambix)).unwrap();
    assert_eq!(folder.bytes(FILE), folder.bytes("again/1-speaker_1-listener.wav"));
    // The listener looks at the source as far as that is to the front: nothing of it comes from the side.
    let directed = read(&folder, "again/1-speaker_1-listener_ambix3.wav");
    assert!(directed.channels.len() == 16 && directed.channels[0] == received.channels[0]);
    let share = |channel: usize| f64::from(directed.channels[channel][at] / received.channels[0][at]);
    let ahead = 2.9_f64.hypot(1.8) / distance;
    assert!(share(1).abs() < 0.01 && (share(3) - ahead).abs() < 0.01, "{} {}", share(1), share(3));
    assert!((share(2).abs() - 0.3 / distance).abs() < 0.01, "{}", share(2));
    assert!(response(&folder, "b.npz").directions.is_some());
}

/// Mean of P₁P₂* over 100 … 300 Hz, over the root of the mean squares: that of sound from `begin` [s] on.
fn coherence(first: &Recording, second: &Recording, begin: f64) -> f64 {
    let spectra = [first, second].map(|recording| {
        let skipped = (begin * f64::from(recording.sample_rate_hz)) as usize;
        let tail: Vec<f64> =
            recording.channels[0][skipped..].iter().map(|sample| f64::from(*sample)).collect();
        (0..200).map(move |line| {
            let turn =
                std::f64::consts::TAU * (100.0 + f64::from(line)) / f64::from(recording.sample_rate_hz);
            tail.iter().enumerate().fold([0.0; 2], |[re, im], (at, sample)| {
                let (sin, cos) = (turn * at as f64).sin_cos();
                [re + sample * cos, im - sample * sin]
            })
        })
    });
    let [first, second] = spectra;
    let sums = first.zip(second).fold([0.0; 3], |[both, a, b], (p, q)| {
        [both + p[0] * q[0] + p[1] * q[1], a + p[0] * p[0] + p[1] * p[1], b + q[0] * q[0] + q[1] * q[1]]
    });
    sums[0] / (sums[1] * sums[2]).sqrt()
}

/// A diffuse field has 0.999; noise in the energies of the bins, σ of a tenth, takes σ²/4 of it.
#[test]
fn receivers_side_by_side_have_the_same_late_sound_and_distant_ones_do_not() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "10k"]).unwrap();
    let sounds = folder.path("wav").display().to_string();
    let places = ["--receiver", "a=3,2,1.2", "--receiver", "b=3.02,2,1.2", "--receiver", "c=4,3,1.5"];
    render(&folder, "a.sonelmap", "a.npz", &[&["--wav", &sounds], &places[..]].concat()).unwrap();
    let [a, b, c] = ["1-a", "2-b", "3-c"].map(|name| read(&folder, &format!("wav/1-speaker_{name}.wav")));
    let (near, far) = (coherence(&a, &b, 0.1), coherence(&a, &c, 0.1));
    println!("coherence at 2 cm {near:.4}, at 1.4 m {far:.4}");
    assert!(near > 0.99 && far < 0.5, "{near} {far}");
}

/// The same sound at another rate, and its direct sound at the sample of its time.
#[test]
fn impulse_responses_are_made_at_the_rate_that_is_asked_for() {
    let folder = rendered();
    let sounds = folder.path("slow").display().to_string();
    render(&folder, "a.sonelmap", "b.npz", &["--wav", &sounds, "--wav-rate", "16000"]).unwrap();
    let (fast, slow) = (read(&folder, FILE), read(&folder, "slow/1-speaker_1-listener.wav"));
    assert_eq!((slow.sample_rate_hz, slow.channels[0].len()), (16_000, 16 * 600 + 1));
    let spectrum = |recording: &Recording, frequency: f64| {
        let turn = std::f64::consts::TAU * frequency / f64::from(recording.sample_rate_hz);
        recording.channels[0].iter().enumerate().fold([0.0; 2], |[re, im], (at, sample)| {
            let (sin, cos) = (turn * at as f64).sin_cos();
            [re + f64::from(*sample) * cos, im - f64::from(*sample) * sin]
        })
    };
    for frequency in [100.0, 440.0, 1500.0, 3700.0, 6000.0] {
        let [a, b] = [&fast, &slow].map(|recording| spectrum(recording, frequency));
        let off = (a[0] - b[0]).hypot(a[1] - b[1]) / a[0].hypot(a[1]);
        assert!(off < 0.02, "{frequency} Hz: {off}");
    }
}

/// A room with two boxes as furniture, whose edges send arrivals of all sizes.
fn furnished(boxes: &[[f64; 6]]) -> String {
    let mut obj = "usemtl walls\n".to_owned();
    for (index, [x0, y0, z0, x1, y1, z1]) in boxes.iter().enumerate() {
        for corner in 0..8 {
            let [x, y, z] = [[x0, x1][corner & 1], [y0, y1][corner >> 1 & 1], [z0, z1][corner >> 2]];
            obj += &format!("v {x} {y} {z}\n");
        }
        let faces = [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]];
        for face in faces {
            // Normals point into the room: inwards for the room, outwards for furniture.
            let [a, b, c, d] = face.map(|corner| corner + 8 * index);
            obj += &if index == 0 { format!("f {d} {c} {b} {a}\n") } else { format!("f {a} {b} {c} {d}\n") };
        }
    }
    obj
}

#[test]
fn furnished_rooms_have_impulse_responses() {
    let room = [
        [0.0, 0.0, 0.0, 6.18, 3.9, 3.02],
        [0.96, 0.26, 0.0, 2.72, 0.86, 1.0],
        [0.69, 1.76, 0.0, 1.39, 2.71, 1.66],
    ];
    let scene = "name = 'furnished'\nmesh = 'room.obj'\nmaterials.walls.absorption = 0.3\n\
                 sources = [{ name = 'source', position = [2.01, 3.47, 1.6] }]\n";
    let folder = TestFolder::with(scene);
    folder.write("room.obj", furnished(&room));
    trace(&folder, "a.sonelmap", &["--packets", "1k"]).unwrap();
    let sounds = folder.path("wav").display().to_string();
    let mut words = vec!["--wav".to_owned(), sounds, "--receiver".to_owned(), "a=0.52,2.25,1.09".to_owned()];
    for (name, place) in ["3,2,1.2", "5.9,3.6,2.8", "0.3,3.5,0.4", "4.4,0.5,1.7"].iter().enumerate() {
        words.extend(["--receiver".to_owned(), format!("{name}={place}")]);
    }
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    render(&folder, "a.sonelmap", "a.npz", &words).unwrap();
    assert!(read(&folder, "wav/1-source_1-a.wav").channels[0].iter().any(|sample| *sample != 0.0));
}

#[test]
fn a_result_beyond_all_floats_is_refused() {
    let folder = test_folder();
    let loud = Recording { sample_rate_hz: 48_000, channels: vec![vec![3e38; 64]] };
    write(&folder, "loud.wav", &loud);
    let line = ["auralise", "loud.wav", "--recording", "loud.wav", "-o", "./heard"];
    let error = analyze(&folder, &line).unwrap_err();
    assert!(error.to_string().contains("lower the level of"), "{error}");
}

#[test]
fn a_recording_is_heard_through_the_room_at_its_own_rate_and_level() {
    let folder = rendered();
    let mut click = vec![0.0; 24_000];
    click[0] = 0.5;
    write(&folder, "click.wav", &Recording { sample_rate_hz: 48_000, channels: vec![click.clone()] });
    let hear = |recording: &str| {
        let line = ["auralise", FILE, "--recording", recording, "--gain", "0", "-o", "./heard"];
        analyze(&folder, &line).unwrap();
        read(&folder, "heard/heard.wav")
    };
    let (response, received) = (read(&folder, FILE), hear("click.wav"));
    for (sample, (response, received)) in response.channels[0].iter().zip(&received.channels[0]).enumerate() {
        assert!((0.5 * response - received).abs() < 1e-7, "sample {sample}");
    }
    write(&folder, "slow.wav", &Recording { sample_rate_hz: 24_000, channels: vec![click] });
    let slow = hear("slow.wav");
    assert_eq!((slow.sample_rate_hz, slow.channels[0].len()), (48_000, 48_000 + 48 * 600));
}

/// Energy and peak of a file of one channel.
fn loudness(folder: &TestFolder, name: &str) -> (f64, f32) {
    let samples = &read(folder, name).channels[0];
    let energy = samples.iter().map(|sample| f64::from(*sample).powi(2)).sum();
    (energy, samples.iter().fold(0.0, |peak, sample| sample.abs().max(peak)))
}

/// Two designs: what is heard of them has the ratio of their responses, and the louder one nearly reaches full scale.
#[test]
fn a_recording_has_one_gain_in_all_designs() {
    let folder = rendered();
    let hard = ["--set", "materials.walls.absorption=0.02", "--rays", "64"];
    render(&folder, "a.sonelmap", "hard.npz", &hard).unwrap();
    let clicks: Vec<f32> = (0..9000).map(|at| if at % 2999 == 0 { 0.3 } else { 0.0 }).collect();
    let click = Recording { sample_rate_hz: 48_000, channels: vec![clicks.clone()] };
    write(&folder, "clicks.wav", &click);
    let hear = |designs: &[&str], to: &[&str]| {
        analyze(&folder, &[&["auralise"], designs, &["--recording", "clicks.wav"], to].concat()).unwrap()
    };
    let table = hear(&["a.npz", "hard.npz"], &["-o", "./both"]);
    let [soft, hard] = ["1-a", "2-hard"].map(|name| format!("1-speaker_1-listener_{name}"));
    let [soft_file, hard_file] = [&soft, &hard].map(|name| format!("both/{name}.wav"));
    let ((soft_energy, soft_peak), (hard_energy, hard_peak)) =
        (loudness(&folder, &soft_file), loudness(&folder, &hard_file));
    let most = soft_peak.max(hard_peak);
    assert!(most <= 1.0 && most > 10_f32.powf(-0.05), "{most}");
    // Alone and without gain: the same files but for one factor.
    for (design, name, energy) in [("a.npz", "a", soft_energy), ("hard.npz", "hard", hard_energy)] {
        hear(&[design], &["-o", &format!("./{name}"), "--gain", "0"]);
        let (bare, _) = loudness(&folder, &format!("{name}/1-speaker_1-listener.wav"));
        let recorded: f64 = clicks.iter().map(|sample| f64::from(*sample).powi(2)).sum();
        let row = table.lines().find(|line| line.contains(&format!("-{name} "))).expect("a row");
        let stated: f64 = row.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!((10.0 * (bare / recorded).log10() - stated).abs() < 0.051, "{row}: {bare} {recorded}");
        let gain = 10.0 * (energy / bare).log10();
        assert!((gain - gain.round()).abs() < 1e-3, "{gain}");
    }
    assert!(hard_energy > 1.2 * soft_energy, "{hard_energy} {soft_energy}");
    write(&folder, "silence.wav", &Recording { sample_rate_hz: 48_000, channels: vec![vec![0.0; 99]] });
    let line = ["auralise", "a.npz", "--recording", "silence.wav", "-o", "./silent"];
    assert!(analyze(&folder, &line).unwrap_err().to_string().contains("nothing is heard"));
}

#[test]
fn what_cannot_be_heard_is_refused_and_nothing_is_lost() {
    let folder = rendered();
    write(
        &folder,
        "stereo.wav",
        &Recording { sample_rate_hz: 48_000, channels: vec![vec![0.1; 9], vec![0.1; 9]] },
    );
    folder.write("text.wav", "no sound");
    let refused = |words: &[&str], message: &str| {
        let error = format!("{:#}", analyze(&folder, words).unwrap_err());
        assert!(error.contains(message), "{words:?}: {error}");
    };
    for (recording, to, message) in [
        ("stereo.wav", "./heard", "2 channels: mix them to one"),
        ("text.wav", "./heard", "text.wav: this is not a WAV file"),
        ("none.wav", "./heard", "none.wav"),
        ("stereo.wav", "text.wav", "is not a folder"),
    ] {
        refused(&["auralise", FILE, "--recording", recording, "-o", to], message);
    }
    refused(&["auralise", FILE, "-o", "./heard"], "is an impulse response already");
    folder.write("heard/heard.wav", "no sound");
    let line = ["auralise", FILE, "--recording", "stereo.wav", "-o", "./heard"];
    refused(&line, "exists and is not a WAV file");
    refused(&["export", "a.npz", "-o", "table.npz"], "does not end in .csv");
    let error =
        render(&folder, "a.sonelmap", "c.npz", &["--wav", &folder.path("text.wav").display().to_string()]);
    assert!(format!("{:#}", error.unwrap_err()).contains("is not a folder"));
    assert_eq!(folder.text("text.wav"), "no sound");
    assert!(folder.text("heard/heard.wav") == "no sound" && !folder.path("c.npz").exists());
    let sounds = folder.path("sounds").display().to_string();
    let several = render(&folder, "a.sonelmap", "c.npz", &["--variant", "all", "--wav", &sounds]);
    assert!(several.unwrap_err().to_string().contains("sonel-analyze auralise A.npz B.npz --recording"));
}

#[test]
fn two_ears_are_those_of_the_head_and_a_file_that_is_no_head_is_refused_before_the_work() {
    let folder = rendered();
    let head = include_bytes!("../../crates/sonel-sound/tests/cardioid-head.sofa");
    folder.write("head.sofa", head);
    let [sounds, path] = ["ears", "head.sofa"].map(|name| folder.path(name).display().to_string());
    render(&folder, "a.sonelmap", "b.npz", &["--wav", &sounds, "--hrtf", &path]).unwrap();
    let single = read(&folder, "ears/1-speaker_1-listener.wav");
    let ears = read(&folder, "ears/1-speaker_1-listener_binaural.wav");
    assert_eq!((single.channels.len(), ears.channels.len()), (1, 2));
    let distance = (2.9_f64.powi(2) + 1.8_f64.powi(2) + 0.3_f64.powi(2)).sqrt();
    let at = (distance / 343.0 * 48_000.0).round() as usize;
    for ear in &ears.channels {
        // The listener looks at the source, whose direct sound the head delays by 32 samples.
        assert!((ear[at + 32] / single.channels[0][at] - 1.0).abs() < 1e-2);
    }
    assert!(response(&folder, "b.npz").directions.is_some());
    let found: serde_json::Value = serde_json::from_str(
        &analyze(&folder, &["iacc", "ears/1-speaker_1-listener_binaural.wav", "--json"]).unwrap(),
    )
    .unwrap();
    let table = analyze(&folder, &["iacc", "ears/1-speaker_1-listener_binaural.wav"]).unwrap();
    assert!(table.lines().all(|line| line == line.trim_end()), "{table}");
    let [early, late] =
        ["early", "late"].map(|key| found["recordings"][0]["means"][key]["value"].as_f64().unwrap());
    // Ears that are alike have 1.
    assert!([early, late].iter().all(|found| (0.05..0.9).contains(found)), "{early} {late}");
    folder.write("head.sofa", "no head");
    let refused = render(&folder, "a.sonelmap", "c.npz", &["--wav", &sounds, "--hrtf", &path]);
    let message = format!("{:#}", refused.unwrap_err());
    assert!(message.contains("head.sofa: no head-related impulse responses"), "{message}");
    assert!(!folder.path("c.npz").exists());
}

#[test]
fn a_stored_response_makes_the_sound_that_its_rendering_made() {
    let folder = rendered();
    let sounds = folder.path("wav").display().to_string();
    render(&folder, "a.sonelmap", "b.npz", &["--wav", &sounds, "--ambix", "1", "--wav-rate", "16000"])
        .unwrap();
    analyze(&folder, &["auralise", "b.npz", "-o", "./again", "--ambix", "1", "--wav-rate", "16000"]).unwrap();
    for name in ["1-speaker_1-listener.wav", "1-speaker_1-listener_ambix1.wav"] {
        assert_eq!(folder.bytes(&format!("wav/{name}")), folder.bytes(&format!("again/{name}")), "{name}");
    }
    analyze(&folder, &["auralise", "b.npz", "--wav", "./other", "--seed", "7"]).unwrap();
    assert_ne!(folder.bytes("other/1-speaker_1-listener.wav"), folder.bytes(FILE));
    let refused = |words: &[&str], part: &str| {
        let message = format!("{:#}", analyze(&folder, &[&["auralise"], words].concat()).unwrap_err());
        assert!(message.contains(part), "{message}");
    };
    refused(&["a.npz", "--wav", "./again", "--ambix", "1"], "a.npz: ");
    refused(&["a.sonelmap", "--wav", "./again"], "is a sonel map");
    refused(&["a.npz", "--wav", "a.npz"], "is not a folder");
    refused(&["a.npz"], "--output <DIR>");
}

#[test]
fn the_table_holds_every_bin_of_the_response() {
    let folder = rendered();
    analyze(&folder, &["export", "a.npz", "-o", "table.csv"]).unwrap();
    let (response, text) = (response(&folder, "a.npz"), folder.text("table.csv"));
    let mut rows = text.lines();
    let header = "source,receiver,center_frequency_hz,begin_s,end_s,energy_per_m2,x_m,y_m,z_m";
    assert_eq!(rows.next(), Some(header));
    let energies: Vec<f64> = rows.map(|row| row.split(',').nth(5).unwrap().parse().unwrap()).collect();
    assert_eq!(energies, response.energy);
}
