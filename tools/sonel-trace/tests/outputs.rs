//! What happens to a map under its name when the machine fails: a killed process, a full disk, no permission, no file.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "the functions that tests share are no #[test] themselves")]

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use sonel_testkit::workshop::{Ended, Workshop};

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

fn workshop() -> Workshop {
    let shop = Workshop::with(SCENE);
    shop.write("room.sonelmap", "the old one");
    shop
}

fn arguments(shop: &Workshop, map: &Path, sonels: &str) -> Vec<PathBuf> {
    let words = ["-o".into(), map.to_owned(), "--quiet".into(), "--sonels".into(), sonels.into()];
    [shop.path("scene.toml")].into_iter().chain(words).collect()
}

fn old_one_is_there(shop: &Workshop) -> bool {
    shop.bytes("room.sonelmap") == b"the old one"
}

/// Names in the folder but those of scene and map.
fn others(shop: &Workshop) -> Vec<String> {
    shop.names().into_iter().filter(|name| name != "scene.toml" && name != "room.sonelmap").collect()
}

/// Runs `command`, which must end with code 2 and one message that says all of `parts`.
fn refused(command: &mut Command, parts: &[&str]) {
    let said = Ended::of(command).refused();
    assert!(said.starts_with("error: ") && said.lines().count() == 1, "{said}");
    for part in parts {
        assert!(said.contains(part), "no \"{part}\" in: {said}");
    }
}

#[test]
fn a_killed_run_leaves_the_old_map_and_a_file_that_says_what_it_is() {
    let shop = workshop();
    let mut child = Command::new(PROGRAM)
        .args(arguments(&shop, &shop.path("room.sonelmap"), "20M"))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    let written = || {
        let sizes = others(&shop).into_iter().map(|name| shop.path(&name).metadata().unwrap().len());
        sizes.sum::<u64>() > 1 << 20
    };
    while !written() {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it could be killed");
        assert!(begun.elapsed() < Duration::from_secs(60), "nothing was written");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(old_one_is_there(&shop));
    let others = others(&shop);
    assert_eq!(others.len(), 1, "{others:?}");
    assert!(others[0].starts_with("room.sonelmap.") && others[0].ends_with(".unfinished"), "{others:?}");
    // Whoever takes it for a map is told.
    let file = std::fs::File::open(shop.path(&others[0])).unwrap();
    assert!(matches!(sonel_map::SonelMap::open(&file), Err(sonel_map::MapError::Incomplete)));
}

/// A limit on the size of files fails a write as a full disk does. The shell sets it and ignores the signal that goes with it.
#[test]
fn a_full_disk_leaves_the_old_map_and_says_so() {
    let shop = workshop();
    for blocks in ["0", "1", "100"] {
        let mut limited = Command::new("sh");
        limited.args(["-c", "trap '' XFSZ; ulimit -f $0; exec \"$@\"", blocks, PROGRAM]);
        limited.args(arguments(&shop, &shop.path("room.sonelmap"), "20k"));
        refused(&mut limited, &["room.sonelmap", "untouched"]);
        assert!(old_one_is_there(&shop));
        assert_eq!(others(&shop), [""; 0], "{blocks} blocks");
    }
    // The limit is what fails it: with room enough it is written.
    let mut ample = Command::new("sh");
    ample.args(["-c", "trap '' XFSZ; ulimit -f $0; exec \"$@\"", "1000000", PROGRAM]);
    ample.args(arguments(&shop, &shop.path("room.sonelmap"), "20k"));
    assert!(ample.status().unwrap().success() && !old_one_is_there(&shop));
}

#[test]
fn what_is_no_file_cannot_be_written() {
    let shop = workshop();
    let pipe = shop.pipe("pipe");
    for target in [&pipe, Path::new("/dev/null"), shop.folder()] {
        let mut command = Command::new(PROGRAM);
        refused(
            command.args(arguments(&shop, target, "100")),
            &[&target.to_string_lossy(), "another output"],
        );
    }
    let mut command = Command::new(PROGRAM);
    let nowhere = shop.path("nowhere/room.sonelmap");
    refused(command.args(arguments(&shop, &nowhere, "100")), &["nowhere", "create it first"]);
    // Nobody may create files there, not even who may do everything.
    #[cfg(target_os = "linux")]
    {
        let mut command = Command::new(PROGRAM);
        let system = Path::new("/proc/room.sonelmap");
        refused(command.args(arguments(&shop, system, "100")), &["/proc", "choose another folder"]);
    }
}

/// A program that opened a pipe would wait for a writer that never comes.
#[test]
fn what_is_no_file_cannot_be_read() {
    let shop = workshop();
    let (pipe, target) = (shop.pipe("pipe"), shop.path("room.sonelmap"));
    for scene in [&pipe, Path::new("/dev/null"), shop.folder()] {
        let mut arguments = arguments(&shop, &target, "100");
        arguments[0] = scene.to_owned();
        let parts = ["cannot read the scene", &scene.to_string_lossy(), "no ordinary file"];
        refused(Command::new(PROGRAM).args(&arguments), &parts);
    }
    let mesh = SCENE.replace("shoebox = [5.0, 4.0, 3.0]", "mesh = \"pipe\"");
    shop.write("scene.toml", mesh);
    refused(
        Command::new(PROGRAM).args(arguments(&shop, &target, "100")),
        &["cannot read `pipe`: no ordinary file"],
    );
    shop.write("scene.toml", SCENE);
    let mut extending = arguments(&shop, &target, "100");
    extending.extend(["--extend".into(), pipe]);
    refused(Command::new(PROGRAM).args(extending), &["pipe", "no ordinary file"]);
    assert!(old_one_is_there(&shop));
}

/// Permissions bind everybody but the superuser, who becomes nobody for this test.
#[test]
fn without_permission_the_folder_or_the_scene_is_named() {
    let shop = workshop();
    let set = |path: &Path, mode| std::fs::set_permissions(path, PermissionsExt::from_mode(mode)).unwrap();
    // The superuser's folders may be closed to nobody: a copy of the program is not.
    let program = shop.path("program");
    std::fs::copy(PROGRAM, &program).unwrap();
    set(&program, 0o755);
    let closed = shop.path("closed");
    std::fs::create_dir(&closed).unwrap();
    set(&closed, 0o555);
    set(shop.folder(), 0o755);
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
        unprivileged().args(arguments(&shop, &target, "100")),
        &["cannot write in", &closed.to_string_lossy(), "choose another folder"],
    );
    set(&shop.path("scene.toml"), 0o000);
    refused(unprivileged().args(arguments(&shop, &target, "100")), &["cannot read the scene", "scene.toml"]);
    set(&closed, 0o755);
}
