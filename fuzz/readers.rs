//! What reads each kind of input, for fuzz targets and for the test that damages their seeds (`tests/pipeline/readers.rs`). Whatever is given is
//! read or refused with a reason: no panic, and what is read can be used.

use std::io::Cursor;

use sonel::study::criteria::Criterion;
use sonel::{Change, Effects, Grid, Targets, Variants};
use sonel_acoustics::{BandWidth, Bands};

/// Reads bytes; whether they were accepted.
pub(super) type Reader = fn(&[u8]) -> bool;

/// The readers and what they read.
pub(super) const READERS: [(&str, Reader); 13] = [
    ("dxf", |bytes| mesh("dxf", bytes)),
    ("gltf", |bytes| mesh(if bytes.starts_with(b"glTF") { "glb" } else { "gltf" }, bytes)),
    ("material-file", material_file),
    ("materials", materials),
    ("npz", response),
    ("obj", |bytes| mesh("obj", bytes)),
    ("ply", |bytes| mesh("ply", bytes)),
    ("scene", scene),
    ("sofa", sofa),
    ("stl", |bytes| mesh("stl", bytes)),
    ("table", table),
    ("wav", recording),
    ("words", words),
];

/// Reads bytes by the reader `name`; whether they were accepted.
///
/// # Panics
/// Where there is no such reader.
pub(super) fn read(name: &str, bytes: &[u8]) -> bool {
    let (_, reader) = READERS.iter().find(|(known, _)| *known == name).expect("a known reader");
    reader(bytes)
}

const SCENE: &str = "duration_s = 1\nmaterials.walls.absorption = 0.1\nmaterials.floor.absorption = 0.1\n\
                     sources = [{ position = [1, 1, 1] }]\n";
const MESH: &[u8] = b"v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nusemtl walls\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

fn bands() -> Bands {
    Bands::new(vec![500.0, 1000.0], BandWidth::Octave).expect("octaves")
}

fn loaded(text: &str, mesh: &[u8]) -> bool {
    match sonel_scene::load(text, "scene.toml", &mut |_| Ok(mesh.to_vec())) {
        Ok(loaded) => {
            assert!(loaded.scene.geometry().is_ok() && loaded.scene.duration > 0.0);
            true
        }
        Err(errors) => {
            assert!(!errors.problems.is_empty());
            false
        }
    }
}

fn mesh(ending: &str, bytes: &[u8]) -> bool {
    loaded(&format!("mesh = \"m.{ending}\"\n{SCENE}"), bytes)
}

fn scene(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).is_ok_and(|text| loaded(text, MESH))
}

/// Those of other programs: the first byte chooses the format.
fn material_file(bytes: &[u8]) -> bool {
    let endings = ["txt", "Li8", "json", "dat"];
    let Some((first, rest)) = bytes.split_first() else { return false };
    let name = format!("m.{}", endings[usize::from(*first) % endings.len()]);
    sonel_scene::library::read_file(&name, rest).is_ok()
}

fn materials(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let bands = bands();
    let is_fitting = |material: &sonel_acoustics::Material| material.problems(bands.count()).is_empty();
    sonel_scene::load_materials(text, "m.toml", &bands).is_ok_and(|materials| {
        assert!(materials.iter().all(is_fitting));
        true
    })
}

fn response(bytes: &[u8]) -> bool {
    let Ok(response) = sonel_echogram::Response::read(Cursor::new(bytes)) else { return false };
    let _ = sonel_analysis::parameters(&response);
    true
}

fn recording(bytes: &[u8]) -> bool {
    let Ok(recording) = sonel_sound::Recording::read(bytes) else { return false };
    assert!(recording.channels.iter().flatten().all(|sample| sample.is_finite()));
    if let Ok(response) = sonel_sound::measured::response(&recording, "seat") {
        let _ = sonel_analysis::parameters(&response);
    }
    true
}

/// Responses of a head, and directivities.
fn sofa(bytes: &[u8]) -> bool {
    let is_head = head(bytes);
    sonel_scene::load_balloon("d.sofa", bytes, &bands()).is_ok() || is_head
}

fn head(bytes: &[u8]) -> bool {
    sonel_sound::Head::read(bytes, sonel_sound::SAMPLE_RATE_HZ).is_ok_and(|head| {
        let is_finite = |ear| head.response(glam::DVec3::X, ear).iter().all(|sample| sample.is_finite());
        assert!((0..2).all(is_finite));
        true
    })
}

/// Tables of directivity, and receivers in TOML.
fn table(bytes: &[u8]) -> bool {
    let text = std::str::from_utf8(bytes).unwrap_or_default();
    let is_balloon = sonel_scene::load_balloon("d.csv", bytes, &bands()).is_ok();
    sonel_scene::load_receivers(text, "r.toml").is_ok() || is_balloon
}

/// Words of the command line, one a line: NAME=VALUE of `--set` and `--for`, effects, targets of `--until` and of reports, grids.
fn words(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let accepted = |word: &str| {
        let (name, value) = word.split_once('=').unwrap_or((word, ""));
        let (is_change, is_variant) =
            (Change::parse(name, value).is_ok(), Variants::parse(name, value).is_ok());
        let (effects, targets) = (word.parse::<Effects>().is_ok(), word.parse::<Targets>().is_ok());
        let is_criterion = word.parse::<Criterion>().is_ok();
        is_change || is_variant || effects || targets || is_criterion || word.parse::<Grid>().is_ok()
    };
    text.lines().filter(|line| accepted(line)).count() > 0
}
