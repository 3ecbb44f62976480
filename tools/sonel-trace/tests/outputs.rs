//! What happens to a map under its name when the machine fails: a killed process, a full disk, no permission, no file.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "the functions that tests share are no #[test] themselves")]

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

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
/// Somebody without rights.
const NOBODY: u32 = 65_534;

struct Bench {
    folder: TempDir,
}

impl Bench {
    fn open() -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        std::fs::write(bench.path("scene.toml"), SCENE).unwrap();
        std::fs::write(bench.path("room.sonelmap"), "the old one").unwrap();
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn arguments(&self, map: &Path, sonels: &str) -> Vec<PathBuf> {
        let words = ["-o".into(), map.to_owned(), "--quiet".into(), "--sonels".into(), sonels.into()];
        [self.path("scene.toml")].into_iter().chain(words).collect()
    }

    fn old_one_is_there(&self) -> bool {
        std::fs::read(self.path("room.sonelmap")).unwrap() == b"the old one"
    }

    /// Names in the folder but those of scene and map.
    fn others(&self) -> Vec<String> {
        std::fs::read_dir(self.folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .filter(|name| name != "scene.toml" && name != "room.sonelmap")
            .collect()
    }
}

/// Runs `command`, which must end with code 2 and one message that says all of `parts`.
fn refused(command: &mut Command, parts: &[&str]) {
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.starts_with("error: ") && said.lines().count() == 1, "{said}");
    for part in parts {
        assert!(said.contains(part), "no \"{part}\" in: {said}");
    }
}

#[test]
fn a_killed_run_leaves_the_old_map_and_a_file_that_says_what_it_is() {
    let bench = Bench::open();
    let mut child = Command::new(PROGRAM)
        .args(bench.arguments(&bench.path("room.sonelmap"), "20M"))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    let written = || {
        let sizes = bench.others().into_iter().map(|name| bench.path(&name).metadata().unwrap().len());
        sizes.sum::<u64>() > 1 << 20
    };
    while !written() {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it could be killed");
        assert!(begun.elapsed() < Duration::from_secs(60), "nothing was written");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(bench.old_one_is_there());
    let others = bench.others();
    assert_eq!(others.len(), 1, "{others:?}");
    assert!(others[0].starts_with("room.sonelmap.") && others[0].ends_with(".unfinished"), "{others:?}");
    // Whoever takes it for a map is told.
    let file = std::fs::File::open(bench.path(&others[0])).unwrap();
    assert!(matches!(sonel_map::SonelMap::open(&file), Err(sonel_map::MapError::Incomplete)));
}

/// A limit on the size of files fails a write as a full disk does. The shell sets it and ignores the signal that goes with it.
#[test]
fn a_full_disk_leaves_the_old_map_and_says_so() {
    let bench = Bench::open();
    for blocks in ["0", "1", "100"] {
        let mut limited = Command::new("sh");
        limited.args(["-c", "trap '' XFSZ; ulimit -f $0; exec \"$@\"", blocks, PROGRAM]);
        limited.args(bench.arguments(&bench.path("room.sonelmap"), "20k"));
        refused(&mut limited, &["room.sonelmap", "untouched"]);
        assert!(bench.old_one_is_there());
        assert_eq!(bench.others(), [""; 0], "{blocks} blocks");
    }
    // The limit is what fails it: with room enough it is written.
    let mut ample = Command::new("sh");
    ample.args(["-c", "trap '' XFSZ; ulimit -f $0; exec \"$@\"", "1000000", PROGRAM]);
    ample.args(bench.arguments(&bench.path("room.sonelmap"), "20k"));
    assert!(ample.status().unwrap().success() && !bench.old_one_is_there());
}

#[test]
fn what_is_no_file_cannot_be_written() {
    let bench = Bench::open();
    let pipe = bench.path("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for target in [&pipe, Path::new("/dev/null"), bench.folder.path()] {
        let mut command = Command::new(PROGRAM);
        refused(command.args(bench.arguments(target, "100")), &[&target.to_string_lossy(), "another output"]);
    }
    let mut command = Command::new(PROGRAM);
    let nowhere = bench.path("nowhere/room.sonelmap");
    refused(command.args(bench.arguments(&nowhere, "100")), &["nowhere", "create it first"]);
    // Nobody may create files there, not even who may do everything.
    #[cfg(target_os = "linux")]
    {
        let mut command = Command::new(PROGRAM);
        let system = Path::new("/proc/room.sonelmap");
        refused(command.args(bench.arguments(system, "100")), &["/proc", "choose another folder"]);
    }
}

#[test]
fn a_scene_may_come_through_a_pipe_but_not_from_a_folder() {
    let bench = Bench::open();
    let pipe = bench.path("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let to = pipe.clone();
    let writer = std::thread::spawn(move || std::fs::write(to, SCENE).unwrap());
    let target = bench.path("piped.sonelmap");
    let mut arguments = bench.arguments(&target, "100");
    arguments[0] = pipe;
    assert!(Command::new(PROGRAM).args(&arguments).status().unwrap().success());
    writer.join().unwrap();
    arguments[0] = bench.folder.path().to_owned();
    refused(
        Command::new(PROGRAM).args(&arguments),
        &["cannot read the scene", &arguments[0].to_string_lossy()],
    );
}

/// Permissions bind everybody but the superuser, who becomes nobody for this test.
#[test]
fn without_permission_the_folder_or_the_scene_is_named() {
    let bench = Bench::open();
    let set = |path: &Path, mode| std::fs::set_permissions(path, PermissionsExt::from_mode(mode)).unwrap();
    // The superuser's folders may be closed to nobody: a copy of the program is not.
    let program = bench.path("program");
    std::fs::copy(PROGRAM, &program).unwrap();
    set(&program, 0o755);
    let closed = bench.path("closed");
    std::fs::create_dir(&closed).unwrap();
    set(&closed, 0o555);
    set(bench.folder.path(), 0o755);
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
        unprivileged().args(bench.arguments(&target, "100")),
        &["cannot write in", &closed.to_string_lossy(), "choose another folder"],
    );
    set(&bench.path("scene.toml"), 0o000);
    refused(unprivileged().args(bench.arguments(&target, "100")), &["cannot read the scene", "scene.toml"]);
    set(&closed, 0o755);
}
