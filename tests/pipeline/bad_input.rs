//! Errors name the file and the remedy, and leave older outputs alone.

use crate::{render, test_folder, trace};

fn complaint(result: anyhow::Result<String>) -> String {
    format!("{:#}", result.expect_err("bad input is refused"))
}

#[test]
fn a_bad_scene_is_reported_with_all_its_problems() {
    let folder = test_folder();
    let text = folder.text("scene.toml");
    let bad = text
        .replace("absorption = 0.5", "absorption = 1.5\ncolour = \"red\"")
        .replace("[1.0, 1.0, 1.5]", "[9.0, 1.0, 1.5]");
    folder.write("scene.toml", bad);
    let complaint = complaint(trace(&folder, "a.sonelmap", &[]));
    for part in ["scene.toml:17", "scene.toml:18", "colour", "scene.toml:23", "position"] {
        assert!(complaint.contains(part), "no {part} in: {complaint}");
    }
    assert!(!folder.path("a.sonelmap").exists());
}

#[test]
fn files_that_are_no_maps_are_refused_and_older_outputs_stay() {
    let folder = test_folder();
    // As much of a response as tells it from other files.
    let older = [b"PK\x03\x04".as_slice(), &[0; 26], b"format_version.npy"].concat();
    folder.write("a.npz", &older);
    folder.write("no.sonelmap", "this is a letter");
    assert!(complaint(render(&folder, "no.sonelmap", "a.npz", &[])).contains("not a sonel map"));
    assert!(complaint(render(&folder, "missing.sonelmap", "a.npz", &[])).contains("missing.sonelmap"));
    trace(&folder, "a.sonelmap", &["--packets", "1k"]).unwrap();
    let mut damaged = folder.bytes("a.sonelmap");
    damaged[5000] ^= 1;
    folder.write("damaged.sonelmap", &damaged);
    assert!(complaint(render(&folder, "damaged.sonelmap", "a.npz", &[])).contains("damaged at byte"));
    folder.write("cut.sonelmap", &damaged[..damaged.len() / 2]);
    assert!(complaint(render(&folder, "cut.sonelmap", "a.npz", &[])).contains("cut"));
    assert_eq!(folder.bytes("a.npz"), older);
}

#[test]
fn impossible_receivers_are_all_named() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "1k"]).unwrap();
    let options = ["--receiver", "on=1,1,1.5", "--receiver", "out=7,1,1", "--receiver", "fine=2,2,1"];
    let complaint_text = complaint(render(&folder, "a.sonelmap", "a.npz", &options));
    assert!(
        complaint_text.contains("\"on\" is at source") && complaint_text.contains("\"out\""),
        "{complaint_text}"
    );
    assert!(!folder.path("a.npz").exists());
    let twice = ["--receiver", "a=1,2,1", "--receiver", "a=2,2,1"];
    assert!(complaint(render(&folder, "a.sonelmap", "a.npz", &twice)).contains("share a name"));
}

#[test]
fn contradicting_options_are_refused() {
    let folder = test_folder();
    for (options, part) in [
        (&["--mode", "paper", "--survival", "0.5"][..], "--survival"),
        (&["--mode", "paper", "--spectral", "shared"], "--spectral"),
        (&["--survival", "2"], "outside 0"),
        (&["--packets", "many"], "count"),
        (&["--packets", "0"], "at least 1"),
        (&["--shard", "3/2"], "shard"),
        (&["--effects", "auto,+echo"], "unknown effect"),
        (&["--duration", "-1"], "duration"),
        (&["--duration", "NaN"], "duration"),
        (&["--duration", "1e300"], "at most 3600"),
    ] {
        let complaint = complaint(trace(&folder, "a.sonelmap", options));
        assert!(complaint.contains(part), "{options:?}: {complaint}");
    }
    assert!(!folder.path("a.sonelmap").exists());
}

/// The paper has no image-source paths whose order could be asked for.
#[test]
fn the_paper_s_estimator_takes_no_order() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "100"]).unwrap();
    let options = ["--estimator", "paper", "--order", "3"];
    assert!(complaint(render(&folder, "a.sonelmap", "a.npz", &options)).contains("--order"));
}

#[test]
fn a_shard_is_not_rendered_alone() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "2k", "--shard", "1/2"]).unwrap();
    assert!(complaint(render(&folder, "a.sonelmap", "a.npz", &[])).contains("shard 1 of 2"));
}

#[test]
fn outputs_that_cannot_be_are_refused_before_the_work() {
    let folder = test_folder();
    std::fs::create_dir(folder.path("folder.sonelmap")).unwrap();
    assert!(complaint(trace(&folder, "folder.sonelmap", &[])).contains("not a regular file"));
    assert!(complaint(trace(&folder, "nowhere/a.sonelmap", &[])).contains("does not exist"));
}

/// No option makes the renderer ask for more memory than any echogram is worth. What maps ask for is in tests/stability.
#[test]
fn echograms_beyond_all_measure_are_refused() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "100"]).unwrap();
    for bin in ["1e-300", "1e-9"] {
        let complaint = complaint(render(&folder, "a.sonelmap", "a.npz", &["--bin", bin]));
        assert!(complaint.contains("wider bins (--bin)"), "{bin}: {complaint}");
    }
    assert!(!folder.path("a.npz").exists());
}

#[cfg(unix)]
#[test]
fn a_pipe_is_no_map() {
    let folder = test_folder();
    folder.pipe("pipe");
    assert!(complaint(render(&folder, "pipe", "a.npz", &[])).contains("not a regular file"));
}

/// Every file that an option reads, as the output: whatever the reason, it is refused and the file stays as it was.
#[test]
fn no_output_replaces_what_an_option_reads() {
    let folder = test_folder();
    trace(&folder, "b.sonelmap", &["--packets", "100"]).unwrap();
    folder.write("seats.csv", "name,x,y,z\na,2,2,1\n");
    folder.write("felt.toml", "[materials.walls]\nabsorption = 0.5\n");
    folder.write("source.csv", "azimuth,polar\n");
    let path = |name: &str| folder.path(name).display().to_string();
    let set = format!("sources.speaker.directivity={}", path("source.csv"));
    let [map, seats, felt] = ["b.sonelmap", "seats.csv", "felt.toml"].map(path);
    let traced: [(&str, &[&str]); 2] = [("b.sonelmap", &["--decision", &map]), ("scene.toml", &[])];
    let rendered: [(&str, &[&str]); 4] = [
        ("b.sonelmap", &[]),
        ("seats.csv", &["--receivers", &seats]),
        ("felt.toml", &["--materials", &felt]),
        ("source.csv", &["--set", &set]),
    ];
    for (file, options) in traced {
        let old = folder.bytes(file);
        complaint(trace(&folder, file, options));
        assert_eq!(folder.bytes(file), old, "{file}");
    }
    for (file, options) in rendered {
        let old = folder.bytes(file);
        complaint(render(&folder, "b.sonelmap", file, options));
        assert_eq!(folder.bytes(file), old, "{file}");
    }
}

#[test]
fn a_missing_folder_is_said_before_the_scene_is_read() {
    let folder = test_folder();
    folder.write("scene.toml", "not a scene");
    for (output, reason) in
        [("maps/", "names a folder"), ("nowhere/a.sonelmap", "does not exist"), ("..", "names a folder")]
    {
        let said = complaint(trace(&folder, output, &[]));
        assert!(said.contains(reason), "{output}: {said}");
    }
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "100"]).unwrap();
    let sounds = folder.path("nowhere/wav").display().to_string();
    let said = complaint(render(&folder, "a.sonelmap", "a.npz", &["--wav", &sounds]));
    assert!(said.contains("cannot make the folder") && !folder.path("a.npz").exists(), "{said}");
}
