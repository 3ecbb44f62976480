//! What happens to a map under its name when the machine fails: a killed process, a full disk, no permission, no file.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "the functions that tests share are no #[test] themselves")]

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use sonel_testkit::test_folder::{Ended, TestFolder};

const SCENE: &str = r#"
name = "box"
shoebox = [5.0, 4.0, 3.0]
duration_s = 1.0
[bands]
center_frequencies_hz = [500, 1000]
[materials.walls]
absorption = 0.05
[[sources]]
name = "speaker"
position = [1.0, 1.0, 1.5]
"#;
const PROGRAM: &str = env!("CARGO_BIN_EXE_sonel-trace");
/// How an earlier map begins.
const OLD: &str = "SONELMAP, the old one";
/// Somebody without rights.
const NOBODY: u32 = 65_534;

fn test_folder() -> TestFolder {
    let folder = TestFolder::with(SCENE);
    folder.write("room.sonelmap", OLD);
    folder
}

fn arguments(folder: &TestFolder, map: &Path, packets: &str) -> Vec<PathBuf> {
    let words = ["-o".into(), map.to_owned(), "--quiet".into(), "--packets".into(), packets.into()];
    [folder.path("scene.toml")].into_iter().chain(words).collect()
}

fn old_one_is_there(folder: &TestFolder) -> bool {
    folder.bytes("room.sonelmap") == OLD.as_bytes()
}

/// Names in the folder but those of scene and map.
fn others(folder: &TestFolder) -> Vec<String> {
    folder.names().into_iter().filter(|name| name != "scene.toml" && name != "room.sonelmap").collect()
}

/// Runs `command`, which must end with code 2 and one message that says all of `parts`.
fn refused(command: &mut Command, parts: &[&str]) {
    let said = Ended::of(command).refused();
    assert!(said.starts_with("error: ") && said.lines().count() == 1, "{said}");
    for part in parts {
        assert!(said.contains(part), "no \"{part}\" in: {said}");
    }
}

/// Starts a long run and waits until it has written something.
fn begun(folder: &TestFolder) -> Child {
    let mut child = Command::new(PROGRAM)
        .args(arguments(folder, &folder.path("room.sonelmap"), "9M"))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    // A file may be gone between listing and asking: outputs are probed before the run.
    let size = |name: String| folder.path(&name).metadata().map_or(0, |data| data.len());
    let written = || others(folder).into_iter().map(size).sum::<u64>() > 1 << 20;
    while !written() {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it could be killed");
        assert!(begun.elapsed() < Duration::from_secs(60), "nothing was written");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

#[test]
fn a_killed_run_leaves_the_old_map_and_a_file_that_the_next_run_removes() {
    let folder = test_folder();
    let mut child = begun(&folder);
    let of_the_other = others(&folder);
    // While it runs, another run with the same output leaves its file alone.
    assert!(
        Command::new(PROGRAM)
            .args(arguments(&folder, &folder.path("room.sonelmap"), "100"))
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(others(&folder), of_the_other);
    child.kill().unwrap();
    child.wait().unwrap();
    let others_left = others(&folder);
    assert_eq!(others_left.len(), 1, "{others_left:?}");
    let left = &others_left[0];
    assert!(left.starts_with("room.sonelmap.") && left.ends_with(".unfinished"), "{left}");
    // Whoever takes it for a map is told.
    let file = std::fs::File::open(folder.path(left)).unwrap();
    assert!(matches!(sonel_map::SonelMap::open(&file), Err(sonel_map::MapError::Incomplete)));
    drop(file);
    let words = ["scene.toml", "-o", "room.sonelmap", "--packets", "100"];
    let said = folder.run(PROGRAM, &words).done().err;
    assert!(said.contains(&format!("{left}, left by a killed run")), "{said}");
    assert_eq!(others(&folder), [""; 0]);
}

/// Ctrl-C and `kill`.
#[test]
fn an_interrupted_run_leaves_the_old_map_and_nothing_else() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let folder = test_folder();
        let child = begun(&folder);
        let sent = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let ended = child.wait_with_output().unwrap();
        assert_eq!(ended.status.code(), Some(code));
        assert_eq!(
            String::from_utf8(ended.stderr).unwrap(),
            "error: interrupted; older outputs are untouched\n"
        );
        assert!(old_one_is_there(&folder));
        assert_eq!(others(&folder), [""; 0], "{signal}");
    }
}

#[test]
fn no_input_is_replaced() {
    let folder = test_folder();
    folder.write("room.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl walls\nf 1 2 3\n");
    let scene = SCENE.replace("shoebox = [5.0, 4.0, 3.0]", "mesh = \"room.obj\"");
    folder.write("scene.toml", &scene);
    std::fs::hard_link(folder.path("room.obj"), folder.path("link.sonelmap")).unwrap();
    std::os::unix::fs::symlink("scene.toml", folder.path("symbolic.sonelmap")).unwrap();
    for target in ["scene.toml", "room.obj", "link.sonelmap", "symbolic.sonelmap"] {
        let mut command = Command::new(PROGRAM);
        command.args(arguments(&folder, &folder.path(target), "100"));
        refused(&mut command, &[target, "is an input of this command", "choose another output"]);
    }
    folder.write("letter.txt", "dear");
    let mut command = Command::new(PROGRAM);
    refused(
        command.args(arguments(&folder, &folder.path("letter.txt"), "100")),
        &["exists and is not a sonel map"],
    );
    assert_eq!((folder.text("scene.toml"), folder.text("letter.txt")), (scene, "dear".to_owned()));
    assert_eq!(folder.text("link.sonelmap"), folder.text("room.obj"));
}

#[test]
fn what_options_read_is_not_replaced_either() {
    let folder = TestFolder::with(SCENE);
    folder.run(PROGRAM, &["scene.toml", "-o", "b.sonelmap", "--packets", "200"]).done();
    let before = folder.bytes("b.sonelmap");
    let words = ["scene.toml", "-o", "b.sonelmap", "--packets", "100", "--decision", "b.sonelmap"];
    let said = folder.run(PROGRAM, &words).refused();
    assert!(said.contains("b.sonelmap is an input of this command"), "{said}");
    assert_eq!(folder.bytes("b.sonelmap"), before);
    let words = ["scene.toml", "-o", "b.sonelmap", "--packets", "300", "--extend", "b.sonelmap"];
    folder.run(PROGRAM, &words).done();
    assert_ne!(folder.bytes("b.sonelmap"), before);
}

/// The effects alone would be sought for minutes.
#[test]
fn an_output_that_cannot_be_is_refused_before_the_scene_is_prepared() {
    let folder = test_folder();
    for (target, problem) in [("new/", "add a file name"), ("no/new.sonelmap", "does not exist")] {
        let mut command = Command::new(PROGRAM);
        command.current_dir(folder.folder()).args([
            "scene.toml",
            "-o",
            target,
            "--packets",
            "900M",
            "--quiet",
        ]);
        let said = Ended::of(&mut command).refused();
        assert!(said.contains(problem) && said.lines().count() == 1, "{said}");
    }
}

#[test]
fn names_do_not_command_the_terminal() {
    let folder = TestFolder::with(&SCENE.replace("\"box\"", "\"a\\u001B]0;b\\u0007\\u202Ec\""));
    let done = folder.run(PROGRAM, &["check", "scene.toml"]);
    let traced = folder.run(PROGRAM, &["scene.toml", "-o", "a.sonelmap", "--packets", "100", "--plan"]);
    let wrong = folder.run(PROGRAM, &["no\u{1b}[2J.toml", "-o", "b.sonelmap"]);
    for text in [&done.out, &done.err, &traced.out, &traced.err, &wrong.err] {
        assert!(!text.contains(['\u{1b}', '\u{7}', '\u{202e}']), "{text:?}");
    }
}

#[test]
fn runs_beyond_all_measure_are_refused_with_what_they_take() {
    let folder = test_folder();
    let target = folder.path("room.sonelmap");
    let mut command = Command::new(PROGRAM);
    refused(
        command.args(arguments(&folder, &target, "1e15")),
        &[
            "--packets 1000000000000000 is not feasible: map",
            "TB (limit 1.0 TB)",
            "CPU time",
            "memory",
            "--plan",
        ],
    );
    let mut command = Command::new(PROGRAM);
    let limited = command.args(arguments(&folder, &target, "1M")).args(["--memory", "1M"]);
    refused(limited, &["the run needs about: map", "--memory allows 1.0 MB", "give fewer packets"]);
    for threads in ["0", "1025", "10000", "many"] {
        let mut command = Command::new(PROGRAM);
        let said = Ended::of(command.args(arguments(&folder, &target, "100")).args(["--threads", threads]))
            .refused();
        assert!(said.contains("give 1 … 1024 threads"), "{said}");
    }
    assert!(old_one_is_there(&folder));
}

/// A limit on the size of files fails a write as a full disk does. The shell sets it and ignores the signal that goes with it.
#[test]
fn a_full_disk_leaves_the_old_map_and_says_so() {
    let folder = test_folder();
    for blocks in ["0", "1", "100"] {
        let mut limited = Command::new("sh");
        limited.args(["-c", "trap '' XFSZ; ulimit -f $0; exec \"$@\"", blocks, PROGRAM]);
        limited.args(arguments(&folder, &folder.path("room.sonelmap"), "6k"));
        refused(&mut limited, &["room.sonelmap", "untouched"]);
        assert!(old_one_is_there(&folder));
        assert_eq!(others(&folder), [""; 0], "{blocks} blocks");
    }
    // The limit is what fails it: with room enough it is written.
    let mut ample = Command::new("sh");
    ample.args(["-c", "trap '' XFSZ; ulimit -f $0; exec \"$@\"", "1000000", PROGRAM]);
    ample.args(arguments(&folder, &folder.path("room.sonelmap"), "6k"));
    assert!(ample.status().unwrap().success() && !old_one_is_there(&folder));
}

#[test]
fn what_is_no_file_cannot_be_written() {
    let folder = test_folder();
    let pipe = folder.pipe("pipe");
    for target in [&pipe, Path::new("/dev/null"), folder.folder()] {
        let mut command = Command::new(PROGRAM);
        refused(
            command.args(arguments(&folder, target, "100")),
            &[&target.to_string_lossy(), "another output"],
        );
    }
    let mut command = Command::new(PROGRAM);
    let nowhere = folder.path("nowhere/room.sonelmap");
    refused(command.args(arguments(&folder, &nowhere, "100")), &["nowhere", "create it first"]);
    // Nobody may create files there, not even who may do everything.
    #[cfg(target_os = "linux")]
    {
        let mut command = Command::new(PROGRAM);
        let system = Path::new("/proc/room.sonelmap");
        refused(command.args(arguments(&folder, system, "100")), &["/proc", "choose another folder"]);
    }
}

/// A program that opened a pipe would wait for a writer that never comes.
#[test]
fn what_is_no_file_cannot_be_read() {
    let folder = test_folder();
    let (pipe, target) = (folder.pipe("pipe"), folder.path("room.sonelmap"));
    for scene in [&pipe, Path::new("/dev/null"), folder.folder()] {
        let mut arguments = arguments(&folder, &target, "100");
        arguments[0] = scene.to_owned();
        let parts = ["cannot read the scene", &scene.to_string_lossy(), "not a regular file"];
        refused(Command::new(PROGRAM).args(&arguments), &parts);
    }
    let mesh = SCENE.replace("shoebox = [5.0, 4.0, 3.0]", "mesh = \"pipe\"");
    folder.write("scene.toml", mesh);
    refused(
        Command::new(PROGRAM).args(arguments(&folder, &target, "100")),
        &["cannot read `pipe`: not a regular file"],
    );
    folder.write("scene.toml", SCENE);
    let mut extending = arguments(&folder, &target, "100");
    extending.extend(["--extend".into(), pipe]);
    refused(Command::new(PROGRAM).args(extending), &["pipe", "not a regular file"]);
    assert!(old_one_is_there(&folder));
}

/// Permissions bind everybody but the superuser, who becomes nobody for this test.
#[test]
fn without_permission_the_folder_or_the_scene_is_named() {
    let folder = test_folder();
    let set = |path: &Path, mode| std::fs::set_permissions(path, PermissionsExt::from_mode(mode)).unwrap();
    // The superuser's folders may be closed to nobody: a copy of the program is not.
    let program = folder.path("program");
    std::fs::copy(PROGRAM, &program).unwrap();
    set(&program, 0o755);
    let closed = folder.path("closed");
    std::fs::create_dir(&closed).unwrap();
    set(&closed, 0o555);
    set(folder.folder(), 0o755);
    let unprivileged = || {
        let mut command = Command::new(&program);
        let may_do_everything = std::fs::File::create(closed.join("probe")).is_ok();
        if may_do_everything {
            command.uid(NOBODY).gid(NOBODY);
        }
        command
    };
    let target = closed.join("room.sonelmap");
    refused(
        unprivileged().args(arguments(&folder, &target, "100")),
        &["cannot write in", &closed.to_string_lossy(), "choose another folder"],
    );
    set(&folder.path("scene.toml"), 0o000);
    refused(
        unprivileged().args(arguments(&folder, &target, "100")),
        &["cannot read the scene", "scene.toml"],
    );
    set(&closed, 0o755);
}

/// What is asked of every command when nobody reads what it prints, or the disk below that is full.
#[test]
#[cfg(target_os = "linux")]
fn no_command_ends_well_without_what_it_was_asked_for() {
    use clap::CommandFactory;
    const LINES: [&str; 7] = [
        "scene.toml -o out/x.sonelmap --packets 500 --json",
        "scene.toml -o out/x.sonelmap --packets 900 --extend a.sonelmap",
        "scene.toml -o out/x.sonelmap --packets 300 --until level<9dB",
        "check scene.toml",
        "check twice.toml --fix out/x.obj",
        "new --shoebox 5,4,3 -o out/x.toml",
        "materials felt",
    ];
    for command in sonel_trace::Program::command().get_subcommands() {
        let name = command.get_name();
        assert!(LINES.iter().any(|line| line.split(' ').next() == Some(name)), "{name} has no line");
    }
    let folder = TestFolder::with(&SCENE.replace("1.0\n[bands]", "0.2\n[bands]"));
    // A box with one face twice.
    let corners = "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nv 0 0 3\nv 4 0 3\nv 4 3 3\nv 0 3 3\nusemtl walls\n";
    let faces = "f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\nf 1 2 3 4\n";
    folder.write("twice.obj", format!("{corners}{faces}"));
    folder.write("twice.toml", SCENE.replace("shoebox = [5.0, 4.0, 3.0]", "mesh = \"twice.obj\""));
    let line = arguments(&folder, &folder.path("a.sonelmap"), "500");
    Ended::of(Command::new(PROGRAM).args(line)).done();
    let faults_of = |line: &&str| {
        // They state CPU times.
        let states_times = line.contains("--json");
        sonel_testkit::broken_streams::faults(&folder, &format!("{PROGRAM} {line}"), states_times)
    };
    let faults: Vec<String> = LINES.iter().flat_map(faults_of).collect();
    assert!(faults.is_empty(), "{faults:#?}");
}
