//! `image` from outside: both files, the same bytes with any number of threads, and what it says of bad options.

use sonel_testkit::test_folder::TestFolder;

use crate::{SCENE, analyze, trace};

const CAMERA: [&str; 8] = ["--eye", "1,1,1", "--look", "5,4,2", "--fov", "80", "--size", "40x30"];

fn folder() -> TestFolder {
    let (one_source, _) = SCENE.rsplit_once("[[sources]]").expect("two sources");
    let folder = TestFolder::with(one_source);
    trace(&folder, "a.sonelmap", &["--packets", "1500"]);
    folder
}

#[test]
fn both_pictures_are_written_and_do_not_depend_on_the_threads() {
    let folder = folder();
    let image = |threads: &str| {
        let options = ["--windows", "0-20ms,20-200ms", "--threads", threads];
        let words = [&["image", "a.sonelmap", "-o", "e.exr"], &CAMERA[..], &options[..]].concat();
        let ended = analyze(&folder, &words).done();
        assert!(ended.out.is_empty() && ended.err.contains("100.0 % of the pixels show fronts"), "{ended:?}");
        [folder.bytes("e.exr"), folder.bytes("e.png")]
    };
    let [values, drawing] = image("1");
    assert!(values.starts_with(b"\x76\x2f\x31\x01") && drawing.starts_with(b"\x89PNG"));
    for name in ["band.00250Hz", "band.01000Hz", "20-200ms"] {
        assert!(values.windows(name.len()).any(|part| part == name.as_bytes()), "{name}");
    }
    // The second run replaces the files of the first.
    assert_eq!([values, drawing], image("2"));
}

#[test]
fn a_camera_outside_looks_into_the_room() {
    let folder = folder();
    let image = |look: &str| {
        let options = ["--eye", "-9,2.5,2", "--look", look, "--fov", "10", "--size", "9x9"];
        analyze(&folder, &[&["image", "a.sonelmap", "-o", "e.exr"], &options[..]].concat()).done().err
    };
    assert!(image("6,2.5,2").contains("100.0 % of the pixels show fronts"));
    assert!(image("-20,2.5,2").contains("100.0 % no surface"));
}

#[test]
fn everything_that_is_wrong_is_said() {
    let folder = folder();
    let refused = |options: &[&str]| {
        let words = [&["image", "a.sonelmap", "-o", "e.exr"], options].concat();
        let ended = analyze(&folder, &words);
        assert_eq!(ended.code, Some(2), "{ended:?}");
        ended.err
    };
    let all = refused(&[
        "--eye",
        "0,1,1",
        "--look",
        "0,1,1",
        "--fov",
        "190",
        "--windows",
        "0-30ms,20-40ms,100-900ms",
        "--band",
        "500",
        "--source",
        "pit",
    ]);
    for problem in [
        "give two different points",
        "190° cannot be drawn",
        "mm to a surface: move it away",
        "from 0 to 0.03 s and from 0.02 to 0.04 s overlap",
        "from 0.1 to 0.9 s is not within the 0.2 s",
        "no band \"500\"; choose sum or one of 250, 1000 Hz",
        "no source \"pit\"; it has \"stage, left\"",
    ] {
        assert!(all.contains(problem), "{problem}: {all}");
    }
    let with = |options: &[&str]| refused(&[&CAMERA[..], options].concat());
    assert!(with(&["--windows", "20"]).contains("write FROM-TO with a unit"));
    assert!(with(&["--radius", "0"]).contains("must be above 0 m"));
    assert!(with(&["--range", "0:-40"]).contains("the lower first"));
    let ended = analyze(&folder, &[&["image", "a.sonelmap", "-o", "e.npz"], &CAMERA[..]].concat());
    assert!(ended.err.contains("does not end in .exr"), "{ended:?}");
    folder.write("e.exr", "a picture of somebody");
    assert!(with(&[]).contains("exists and is not a picture of sonel-analyze"));
}
