//! What a checkup finds, and that a drafted scene is a scene.

use std::io;

use sonel_scene::checkup::{Checkup, check};
use sonel_scene::{Draft, DraftOptions, Purpose, draft, draft_shoebox, load};
use sonel_testkit::meshes::{self, Triangle, room};

const SCENE: &str = "mesh = \"room.obj\"\nduration_s = 1\n[bands]\ncenter_frequencies_hz = [125, 1000]\n[air]\nspeed_of_sound = 343.0\n\
                     attenuation = false\n[materials]\nwalls.absorption = [0.1, 0.2]\nwalls.scattering = 0.1\n\
                     floor.absorption = [0.3, 0.3]\nfloor.scattering = 0.1\n[[sources]]\nposition = [2.0, 2.0, 1.5]\n";

fn checked(scene: &str, triangles: &[Triangle]) -> Checkup {
    check(scene, "scene.toml", &mut |_| Ok(meshes::obj(triangles))).unwrap()
}

/// The empty box of the room.
fn empty() -> Vec<Triangle> {
    room()[..12].to_vec()
}

/// The only fault, in a mesh that can be traced all the same.
fn fault(triangles: &[Triangle]) -> String {
    let Checkup { problems, faults, .. } = checked(SCENE, triangles);
    assert!(problems.is_empty(), "{problems:?}");
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(load(SCENE, "scene.toml", &mut |_| Ok(meshes::obj(triangles))).is_ok());
    faults[0].clone()
}

fn quad([a, b, c, d]: [[f64; 3]; 4]) -> [Triangle; 2] {
    [([a, b, c], "walls"), ([a, c, d], "walls")]
}

/// The six walls of a box, corner to corner.
fn box_between(low: [f64; 3], high: [f64; 3]) -> Vec<Triangle> {
    let size = |corner: [f64; 3]| {
        let at = |axis: usize| if corner[axis] > 0.0 { high[axis] } else { low[axis] };
        [at(0), at(1), at(2)]
    };
    empty().into_iter().map(|(corners, _)| (corners.map(size), "walls")).collect()
}

#[test]
fn hard_flat_walls_are_noted_unless_they_scatter_or_react_locally() {
    let noted = |law: &str, scattering: &str| {
        let walls = format!("walls.scattering = {scattering}\nwalls.absorption_law = \"{law}\"");
        let scene = SCENE.replace("walls.scattering = 0.1", &walls);
        let Checkup { notes, problems, .. } = checked(&scene, &empty());
        assert!(problems.is_empty(), "{problems:?}");
        notes.into_iter().find(|note| note.contains("hard and flat"))
    };
    let note = noted("uniform", "[0.05, 0.3]").expect("walls are 71 % of the surface");
    assert!(note.starts_with("71 % of the surface") && note.contains("at 125 Hz"), "{note}");
    assert_eq!(noted("uniform", "0.1"), None);
    assert_eq!(noted("locally-reacting", "0.05"), None);
}

#[test]
fn sizes_and_times_are_those_of_the_textbook() {
    let checkup = checked(SCENE, &empty());
    assert!(checkup.is_clean(), "{checkup:?}");
    let room = checkup.room.unwrap();
    let near =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9 * expected, "{found} {expected}");
    near(room.volume.unwrap(), 210.0);
    near(room.area, 242.0);
    near(room.mean_free_path.unwrap(), 4.0 * 210.0 / 242.0);
    let names: Vec<(&str, f64)> =
        room.coverings.iter().map(|covering| (covering.name.as_str(), covering.area)).collect();
    assert_eq!(names[0].0, "walls");
    near(names[0].1, 172.0);
    near(names[1].1, 70.0);
    // 24 ln 10 V / (c A), and with −S ln(1 − α) for A.
    let factor = 24.0 * 10f64.ln() * 210.0 / 343.0;
    for (times, area) in room.times.iter().zip([172.0 * 0.1 + 70.0 * 0.3, 172.0 * 0.2 + 70.0 * 0.3]) {
        near(times.mean_absorption, area / 242.0);
        near(times.sabine, factor / area);
        near(times.eyring, factor / (-242.0 * (1.0 - area / 242.0).ln()));
    }
    // 2000 √(T / V), which holds for 343 m/s.
    let longest = room.times[0].sabine;
    assert!((room.schroeder_frequency.unwrap() / (2000.0 * (longest / 210.0).sqrt()) - 1.0).abs() < 0.01);
}

#[test]
fn holes_are_placed() {
    let message = fault(&empty()[..10]);
    assert!(message.contains("1 hole: 10 × 7 × 0 m about (5, 3.5, 3) m, 4 edges, rim 34 m"), "{message}");
}

#[test]
fn crossing_faces_are_placed() {
    let screen = quad([[6.0, 2.0, -0.5], [6.0, 5.0, -0.5], [6.0, 5.0, 2.0], [6.0, 2.0, 2.0]]);
    let checkup = checked(SCENE, &[empty(), screen.to_vec()].concat());
    let crossing = checkup.faults.iter().find(|fault| fault.contains("cross")).unwrap();
    assert!(crossing.contains("pairs of triangles cross: from (6, "), "{crossing}");
    assert!(checkup.problems.is_empty());
}

#[test]
fn slivers_and_doubled_faces_are_named() {
    let sliver = ([[2.0, 1.0, 1.0], [6.0, 1.0, 1.0], [4.0, 1.0, 1.0005]], "walls");
    let faults = checked(SCENE, &[empty(), vec![sliver]].concat()).faults;
    assert_eq!(faults[0], "1 sliver: 4 m long, 0.5 mm high at (4, 1, 1) m");
    let doubled = [empty(), vec![empty()[3]]].concat();
    assert!(fault(&doubled).contains("is left out"));
}

#[test]
fn surfaces_in_solids_are_named() {
    let panel = quad([[6.0, 2.5, 1.0], [6.0, 3.5, 1.0], [6.0, 3.5, 1.5], [6.0, 2.5, 1.5]]);
    let solid = box_between([5.0, 2.0, 0.5], [7.0, 4.0, 2.0]);
    let message = fault(&[empty(), solid, panel.to_vec()].concat());
    assert!(
        message.contains("1 surface inside solids, which no sound reaches: 0.5 m² about (6, 3, 1.25) m"),
        "{message}"
    );
}

/// A stage from wall to wall at the end wall has a whole edge of the room.
#[test]
fn flush_solids_are_no_faults() {
    let stage = box_between([7.0, 0.0, 0.0], [10.0, 7.0, 0.9]);
    let triangles = [empty(), stage].concat();
    let scene = SCENE.replace("duration_s", "closed = true\nduration_s");
    let checkup = checked(&scene, &triangles);
    assert!(checkup.is_clean(), "{checkup:?}");
    let room = checkup.room.unwrap();
    assert!((room.volume.unwrap() - (210.0 - 18.9)).abs() < 1e-9);
    assert!((room.area - (242.0 - 2.0 * 2.7)).abs() < 1e-9, "{}", room.area);
    let within = scene + "[[receivers]]\nposition = [8.0, 3.0, 0.5]\n";
    let problem = &checked(&within, &triangles).problems[0].message;
    assert!(problem.contains("receivers[1].position: [8, 3, 0.5] is inside a closed object"), "{problem}");
}

#[test]
fn receivers_behind_an_opaque_partition_are_warned_of() {
    let partition = |top| quad([[5.0, 0.0, 0.0], [5.0, 7.0, 0.0], [5.0, 7.0, top], [5.0, 0.0, top]]).to_vec();
    let scene = SCENE.to_owned()
        + "[[receivers]]\nposition = [3.0, 2.0, 1.5]\n[[receivers]]\nposition = [8.0, 2.0, 1.5]\n";
    let sealed = [empty(), partition(3.0)].concat();
    let warnings = checked(&scene, &sealed).warnings;
    assert_eq!(load(&scene, "scene.toml", &mut |_| Ok(meshes::obj(&sealed))).unwrap().warnings, warnings);
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    let sentence =
        "receivers[2].position: [8, 2, 1.5] is sealed off from every source, so no sound arrives; ";
    assert!(warning.starts_with(sentence), "{warning}");
    // A gap of 0.1 m below the ceiling, a wall that transmits, a source on the other side, no closed room.
    let none = Vec::<String>::new();
    assert_eq!(checked(&scene, &[empty(), partition(2.9)].concat()).warnings, none);
    let thin = scene.replace("walls.scattering", "walls.transmission = 0.01\nwalls.scattering");
    assert_eq!(checked(&thin, &sealed).warnings, none);
    let beyond = scene.clone() + "[[sources]]\nposition = [9.0, 2.0, 1.5]\n";
    assert_eq!(checked(&beyond, &sealed).warnings, none);
    assert_eq!(checked(&scene, &sealed[1..]).warnings, none);
}

/// Fifteen thousand surfaces, one of them a panel in a solid: each is looked up in what is on its two sides, none is left out.
#[test]
fn surfaces_in_solids_are_named_in_rooms_of_many_surfaces() {
    let pyramid = |at: usize| {
        let [x, y, z] = [at % 20, at / 20 % 20, at / 400].map(|step| 0.3 * step as f64 + 0.3);
        let [a, b, c, d] =
            [[x, y, z / 3.0], [x + 0.1, y, z / 3.0], [x, y + 0.1, z / 3.0], [x, y, z / 3.0 + 0.05]];
        [[a, c, b], [a, b, d], [b, c, d], [c, a, d]].map(|corners| (corners, "walls"))
    };
    let panel = quad([[8.5, 2.5, 1.0], [8.5, 3.5, 1.0], [8.5, 3.5, 1.5], [8.5, 2.5, 1.5]]);
    let solid = box_between([8.0, 2.0, 0.5], [9.0, 4.0, 2.0]);
    let pyramids = (0..3800).flat_map(pyramid).collect();
    let Checkup { faults, .. } = checked(SCENE, &[empty(), solid, panel.to_vec(), pyramids].concat());
    assert!(faults.iter().any(|fault| fault.starts_with("1 surface inside solids")), "{faults:?}");
}

/// Exporters cut a polygon with corners in one line into triangles without area, the same ones on both sides of the line.
#[test]
fn triangles_without_area_double_none() {
    let line = [[10.0, 0.0, 3.0], [10.0, 2.0, 3.0], [10.0, 7.0, 3.0]];
    let triangles = [empty(), vec![(line, "walls"), (line, "floor")]].concat();
    let checkup = checked(SCENE, &triangles);
    assert!(checkup.is_clean(), "{checkup:?}");
    assert_eq!(checkup.repairs, ["mesh: triangles without area dropped: 2"]);
}

/// Furniture that is closed in itself has air in it, which no source is in.
#[test]
fn sealed_rooms_are_named_unless_a_source_is_there_or_walls_transmit() {
    let closet =
        [box_between([6.0, 3.0, 0.5], [8.0, 5.0, 2.0]), box_between([6.1, 3.1, 0.6], [7.9, 4.9, 1.9])];
    let triangles = [empty(), closet.concat()].concat();
    assert!(fault(&triangles).starts_with("air is sealed off from every source"));
    let within = SCENE.to_owned() + "[[sources]]\nposition = [7.0, 4.0, 1.0]\n";
    assert_eq!(checked(&within, &triangles).faults, Vec::<String>::new());
    let thin = SCENE.replace("walls.scattering", "walls.transmission = 0.01\nwalls.scattering");
    assert_eq!(checked(&thin, &triangles).faults, Vec::<String>::new());
}

#[test]
fn what_lies_outside_the_room_is_placed() {
    let outside = quad([[15.0, 2.5, 1.0], [15.0, 3.5, 1.0], [15.0, 3.5, 1.5], [15.0, 2.5, 1.5]]);
    let message = fault(&[empty(), outside.to_vec()].concat());
    assert!(message.contains("1 surface beyond the largest part: 0.5 m² about (15, 3, 1.25) m"), "{message}");
}

#[test]
fn faces_that_lie_over_others_are_placed() {
    let carpet = quad([[2.0, 2.0, 0.0003], [5.0, 2.0, 0.0003], [5.0, 5.0, 0.0003], [2.0, 5.0, 0.0003]]);
    let message = fault(&[empty(), carpet.to_vec()].concat());
    assert!(message.contains("within 1 mm: 9 m² about (3.5, 3.5,"), "{message}");
}

#[test]
fn faces_that_lie_in_others_are_named_with_both_materials() {
    let carpet = quad([[2.0, 2.0, 0.0], [5.0, 2.0, 0.0], [5.0, 5.0, 0.0], [2.0, 5.0, 0.0]]);
    let message = fault(&[empty(), carpet.to_vec()].concat());
    assert!(message.contains("9 m² of walls about (3.5, 3.5, 0) m lie in faces of floor"), "{message}");
}

/// Steps of an audience hide a part of the riser between them, an opaque partition divides floor and ceiling: all are heard.
#[test]
fn surfaces_that_sound_reaches_in_part_are_reached() {
    let steps = [0.3, 0.6, 0.9].into_iter().zip([4.0, 5.0, 6.0]);
    let steps = steps.flat_map(|(height, x)| box_between([x, 1.0, 0.0], [x + 1.0, 5.0, height]));
    let faults = checked(SCENE, &[empty(), steps.collect()].concat()).faults;
    assert!(!faults.iter().any(|fault| fault.contains("no sound reaches")), "{faults:?}");
}

#[test]
fn a_cabinet_without_its_bottom_is_told_from_a_room() {
    let cabinet = box_between([3.0, 3.0, 0.0], [4.0, 4.0, 2.0]);
    let bottomless: Vec<Triangle> =
        cabinet.into_iter().filter(|(corners, _)| corners.iter().any(|corner| corner[2] > 0.0)).collect();
    let message = fault(&[empty(), bottomless].concat());
    assert!(message.contains("counts in the volume: 2 m³ about (3.5, 3.5, 1) m"), "{message}");
}

/// Exporters round the copies of a face differently: the room stays closed, and the repaired mesh has one of each.
#[test]
fn faces_doubled_but_for_rounding_are_left_out() {
    let moved = |(corners, name): &Triangle| (corners.map(|[x, y, z]| [x + 1e-6, y, z]), *name);
    let triangles = [empty(), empty().iter().take(2).map(moved).collect()].concat();
    let checkup = checked(SCENE, &triangles);
    assert_eq!(checkup.repairs.len(), 2, "{:?}", checkup.repairs);
    assert!(checkup.repairs[1].contains("are drawn more than once"), "{:?}", checkup.repairs);
    assert_eq!(checkup.faults[..], checkup.repairs[1..]);
    assert!((checkup.room.unwrap().volume.unwrap() - 210.0).abs() < 1e-3);
    assert_eq!(checkup.repaired.unwrap().to_obj().unwrap().matches("\nf ").count(), 12);
}

#[test]
fn units_that_make_a_room_of_the_mesh_are_proposed() {
    let larger = |factor: [f64; 3]| -> Vec<String> {
        let scaled = |[x, y, z]: [f64; 3]| [factor[0] * x, factor[1] * y, factor[2] * z];
        let triangles: Vec<Triangle> =
            empty().into_iter().map(|(corners, name)| (corners.map(scaled), name)).collect();
        checked(SCENE, &triangles).warnings
    };
    let [warning] = &larger([1000.0; 3])[..] else { panic!("a warning") };
    assert!(
        warning.ends_with("check mesh_unit: \"mm\" makes it 10 × 7 × 3 m, \"cm\" makes it 100 × 70 × 30 m"),
        "{warning}"
    );
    let [warning] = &larger([500.0, 1.0, 1.0])[..] else { panic!("a warning") };
    assert!(warning.contains("5000 m (usual: 1 … 1000 m); check mesh_unit"), "{warning}");
    assert_eq!(larger([50.0, 1.0, 1.0]), Vec::<String>::new());
}

#[test]
fn a_repaired_mesh_needs_no_repair() {
    // The ceiling hangs half a millimetre too high, a wall is there twice.
    let raise = |corners: [[f64; 3]; 3]| corners.map(|[x, y, z]| [x, y, if z > 2.0 { 3.0005 } else { z }]);
    let mut triangles = empty();
    for triangle in &mut triangles[10..] {
        triangle.0 = raise(triangle.0);
    }
    triangles.push(triangles[4]);
    let checkup = checked(SCENE, &triangles);
    assert!(
        checkup.notes.iter().any(|note| note.contains("cracks up to 1 mm closed")),
        "{:?}",
        checkup.notes
    );
    assert!(checkup.faults[0].contains("is left out"), "{:?}", checkup.faults);
    let obj = checkup.repaired.unwrap().to_obj().unwrap();
    let scene = SCENE.replace("duration_s", "mesh_weld = 0\nduration_s");
    let again = check(&scene, "scene.toml", &mut |_| Ok(obj.clone().into_bytes())).unwrap();
    assert!(again.is_clean(), "{again:?}");
    assert_eq!(again.repaired.unwrap().to_obj().unwrap(), obj);
    let colour = SCENE.replace("floor", "\"#ff0000\"");
    assert!(
        checked(&colour, &empty())
            .repaired
            .unwrap()
            .to_obj()
            .unwrap_err()
            .to_string()
            .contains("\"#ff0000\"")
    );
}

#[test]
fn unknown_materials_leave_the_sizes() {
    let scene = SCENE.replace("floor", "flor").replace("[2.0, 2.0, 1.5]", "[2.0, 2.0, 15]");
    let checkup = checked(&scene, &empty());
    let said: Vec<String> = checkup.problems.iter().map(ToString::to_string).collect();
    assert!(
        said.iter()
            .any(|problem| problem.contains("usemtl floor: no table")
                && problem.contains("did you mean `flor`?")),
        "{said:?}"
    );
    assert!(said.iter().any(|problem| problem.contains("is outside the room")), "{said:?}");
    let room = checkup.room.unwrap();
    assert!((room.volume.unwrap() - 210.0).abs() < 1e-9 && room.times.is_empty());
    assert!(room.coverings.iter().any(|covering| covering.name == "floor" && covering.absorption.is_none()));
}

#[test]
fn drafts_are_scenes_in_every_format() {
    let triangles: Vec<Triangle> = room()
        .into_iter()
        .map(|(corners, name)| (corners, if name == "floor" { "Floor parquet" } else { "Strange \\name" }))
        .collect();
    let obj = ("named.obj", meshes::obj(&triangles));
    for (name, bytes) in meshes::files(&room()).into_iter().chain([obj]) {
        let mut open = |path: &str| -> io::Result<Vec<u8>> {
            Ok(if path == "././room data.bin" {
                meshes::gltf_buffer(&meshes::nameless(&room()))
            } else {
                bytes.clone()
            })
        };
        let Draft { text, warnings, .. } = draft(name, "a \"room\"", &DraftOptions::default(), &mut open)
            .unwrap_or_else(|errors| panic!("{name}: {errors}"));
        assert!(warnings.is_empty(), "{warnings:?}");
        let loaded = load(&text, "scene.toml", &mut open).unwrap_or_else(|errors| panic!("{text}\n{errors}"));
        assert_eq!((loaded.scene.sources.len(), loaded.scene.receivers.len()), (1, 1), "{text}");
        assert_eq!(loaded.scene.name, "a \"room\"");
        if name == "named.obj" {
            assert!(text.contains("[materials.\"Floor parquet\"]\nlibrary = \"floor-parquet\""), "{text}");
            assert!(text.contains("[materials.\"Strange \\\\name\"]\nabsorption = 0.1 "), "{text}");
        }
    }
    let none = DraftOptions::default();
    let errors = draft("a.stl", "a", &none, &mut |_| Ok(b"solid".to_vec())).unwrap_err();
    assert_eq!(errors.to_string(), "a.stl: the mesh has no face; export polygons");
    assert!(draft("a.stl", "a", &none, &mut |_| Err(io::ErrorKind::NotFound.into())).is_err());
}

/// A room 3 m high whose file has y up, read with z up: its floor stands, and a place in the axes of the plan is outside.
#[test]
fn a_model_on_its_side_is_warned_of() {
    let turned: Vec<Triangle> = room()[..12]
        .iter()
        .map(|(corners, _)| {
            let level = corners.iter().all(|corner| (corner[2] - corners[0][2]).abs() < 1e-9);
            let name = if level && corners[0][2] <= 0.0 { "Floor_wood" } else { "walls" };
            (corners.map(|[x, y, z]| [x, z, -y]), name)
        })
        .collect();
    let place = room_middle();
    let scene = |up: &str, position: [f64; 3]| {
        SCENE
            .replace("floor.", "Floor_wood.")
            .replace("duration_s = 1\n", &format!("duration_s = 1\n{up}"))
            .replace("[2.0, 2.0, 1.5]", &format!("{position:?}"))
    };
    let upright = checked(&scene("mesh_up = \"y\"\n", [place[0], place[2], -place[1]]), &turned);
    assert!(upright.warnings.is_empty() && upright.problems.is_empty(), "{:?}", upright.problems);
    let lying = checked(&scene("", place), &turned);
    assert!(
        lying.warnings.iter().any(|warning| warning.contains(
            "materials.Floor_wood: 100 % of its area is vertical, so the model seems to lie on its side; set mesh_up = \"y\""
        )),
        "{:?}",
        lying.warnings
    );
    let problems: Vec<String> = lying.problems.iter().map(ToString::to_string).collect();
    assert!(problems.iter().any(|problem| problem.contains("with y and z swapped, [")), "{problems:?}");
}

/// The middle of the room.
fn room_middle() -> [f64; 3] {
    let corners = || empty().into_iter().flat_map(|(corners, _)| corners);
    [0, 1, 2].map(|axis| {
        let along = || corners().map(|corner: [f64; 3]| corner[axis]);
        0.5 * (along().fold(f64::INFINITY, f64::min) + along().fold(f64::NEG_INFINITY, f64::max))
    })
}

/// The room in another unit, drafted.
fn drafted_in(length: f64, options: &DraftOptions<'_>) -> Result<Draft, String> {
    let scaled = |corner: [f64; 3]| corner.map(|x| x / length);
    let triangles: Vec<Triangle> =
        empty().into_iter().map(|(corners, name)| (corners.map(scaled), name)).collect();
    let draft = draft("a.obj", "a", options, &mut |_| Ok(meshes::obj(&triangles)));
    draft.map_err(|errors| errors.to_string())
}

/// 10 × 7 × 3 m: as many centimetres are a room in no other unit, as many decimetres or millimetres may be a hall.
/// What `new` writes as advice is what `check` advises, which then has nothing to add.
#[test]
fn a_drafted_room_with_objects_scatters_as_advised() {
    let block = |x: f64, y: f64| box_between([x, y, 0.5], [x + 1.25, y + 0.5, 1.25]);
    let blocks = (0..16).flat_map(|i| block(1.0 + 2.0 * f64::from(i % 4), 1.0 + 1.3 * f64::from(i / 4)));
    let triangles: Vec<Triangle> = empty().into_iter().chain(blocks).collect();
    let open = &mut |_: &str| Ok(meshes::obj(&triangles));
    let Draft { text, .. } = draft("a.obj", "a", &DraftOptions::default(), &mut *open).unwrap();
    assert_eq!(text.matches("# advice").count(), 2, "walls and floor: {text}");
    let mut advised = |text: &str| {
        let Checkup { notes, problems, .. } = check(text, "scene.toml", &mut *open).unwrap();
        assert!(problems.is_empty(), "{problems:?}");
        notes.iter().filter(|note| note.contains("waves are mixed")).count()
    };
    let without: String =
        text.lines().filter(|line| !line.contains("# advice")).collect::<Vec<_>>().join("\n");
    // A variant absorbs beside more ways than the scene.
    let soft = format!("{text}\n[variants.soft]\nwalls = {{ absorption = 0.7 }}\n");
    assert_eq!([advised(&text), advised(&without), advised(&soft)], [0, 1, 1]);
}

#[test]
fn a_draft_finds_the_unit_or_asks_for_it() {
    let none = DraftOptions::default();
    let metres = drafted_in(1.0, &none).unwrap();
    assert!(
        !metres.text.contains("mesh_unit")
            && metres.notes.contains(&"unit: m, which makes a room of 10 × 7 × 3 m".into())
    );
    for (length, unit, other) in [
        (0.1, "dm (10 × 7 × 3 m)", "m (100 × 70 × 30 m)"),
        (0.001, "mm (10 × 7 × 3 m)", "cm (100 × 70 × 30 m)"),
    ] {
        let asked = drafted_in(length, &none).unwrap_err();
        assert!(asked.contains(unit) && asked.contains(other) && asked.contains("`unit`"), "{asked}");
    }
    let stated = drafted_in(0.001, &DraftOptions { unit: Some("mm"), ..none }).unwrap();
    assert!(stated.text.contains("mesh_unit = \"mm\"\n") && stated.warnings.is_empty(), "{}", stated.text);
    let vast = drafted_in(1e-5, &none).unwrap();
    assert!(vast.warnings.iter().any(|warning| warning.contains("implausibly large")), "{:?}", vast.warnings);
}

/// The room with y up, under names and without.
#[test]
fn a_draft_recognises_y_up_and_a_room_upside_down() {
    let turned = |name: fn(bool, f64) -> &'static str, turn: fn([f64; 3]) -> [f64; 3]| {
        let triangles: Vec<Triangle> = room()[..12]
            .iter()
            .map(|(corners, _)| {
                let is_level = corners.iter().all(|corner| (corner[2] - corners[0][2]).abs() < 1e-9);
                (corners.map(turn), name(is_level, corners[0][2]))
            })
            .collect();
        draft("a.obj", "a", &DraftOptions::default(), &mut |_| Ok(meshes::obj(&triangles))).unwrap()
    };
    let named = |is_level: bool, height: f64| match (is_level, height > 1.0) {
        (false, _) => "walls",
        (true, false) => "Floor_1",
        (true, true) => "ceiling",
    };
    let upright = turned(named, |[x, y, z]| [x, z, -y]);
    assert!(upright.text.contains("mesh_up = \"y\"\n"), "{}", upright.text);
    assert!(upright.notes.iter().any(|note| note.starts_with("up: y, as \"")), "{:?}", upright.notes);
    assert!(upright.warnings.is_empty(), "{:?}", upright.warnings);
    let over = turned(named, |[x, y, z]| [x, -y, -z]);
    assert!(
        !over.text.contains("mesh_up") && over.warnings[0].contains("above the ceiling"),
        "{:?}",
        over.warnings
    );
    let nameless = turned(|_, _| "paint", |[x, y, z]| [x, z, -y]);
    assert!(nameless.text.contains("mesh_up = \"y\"\n"), "{}", nameless.text);
    assert!(nameless.notes.iter().any(|note| note.contains("a guess")), "{:?}", nameless.notes);
}

/// Bedrooms, a classroom and a corridor without names: furniture stands on the floor.
#[test]
fn a_draft_recognises_what_is_up_by_furniture() {
    let desk = |x: f64, y: f64| box_between([x, y, 0.0], [x + 1.2, y + 0.6, 0.75]);
    let bedroom = |size: [f64; 3]| {
        let bed = box_between([0.0, 0.0, 0.0], [2.0, 0.9, 0.5]);
        let wardrobe = box_between([size[0] - 0.6, 0.5, 0.0], [size[0], 2.0, 2.1]);
        let shelf = box_between([1.0, 0.0, 1.4], [1.8, 0.25, 1.6]);
        [box_between([0.0; 3], size), bed, wardrobe, shelf].concat()
    };
    let class = (0..12).flat_map(|at| desk(1.0 + 2.0 * f64::from(at % 3), 1.0 + 1.2 * f64::from(at / 3)));
    let rooms = [
        bedroom([4.0, 3.2, 2.5]),
        bedroom([3.4, 4.4, 2.4]),
        [box_between([0.0; 3], [9.0, 7.0, 3.0]), class.collect()].concat(),
        box_between([0.0; 3], [12.0, 1.5, 2.5]),
    ];
    for (room, is_y) in rooms.iter().flat_map(|room| [(room, false), (room, true)]) {
        let turn = |[x, y, z]: [f64; 3]| if is_y { [x, z, -y] } else { [x, y, z] };
        let triangles: Vec<Triangle> = room.iter().map(|(corners, _)| (corners.map(turn), "paint")).collect();
        let found =
            draft("a.obj", "a", &DraftOptions::default(), &mut |_| Ok(meshes::obj(&triangles))).unwrap();
        assert_eq!(found.text.contains("mesh_up = \"y\"\n"), is_y, "{:?}", found.notes);
    }
}

#[test]
fn a_drafted_shoebox_is_a_scene_with_a_target_and_materials_to_choose_from() {
    for purpose in Purpose::ALL.map(Some).into_iter().chain([None]) {
        let options = DraftOptions { purpose, ..DraftOptions::default() };
        let Draft { text, warnings, notes } = draft_shoebox([9.0, 7.0, 3.0], &options).unwrap();
        assert!(
            warnings.is_empty() && notes.len() == usize::from(purpose.is_some()),
            "{warnings:?} {notes:?}"
        );
        let loaded = load(&text, "scene.toml", &mut |_| panic!("no mesh")).unwrap();
        assert_eq!((loaded.scene.sources.len(), loaded.scene.receivers.len()), (1, 3));
        // Every entry that is offered is one.
        let other = text.replace("\nlibrary", "\n# library").replace(
            "# library = \"ceiling-mineral-tile-suspended",
            "library = \"ceiling-mineral-tile-suspended",
        );
        let other = other
            .replace("# library = \"carpet-thin", "library = \"carpet-thin")
            .replace("# library = \"panel-fabric", "library = \"panel-fabric");
        assert!(load(&other, "scene.toml", &mut |_| panic!("no mesh")).is_ok(), "{other}");
    }
    assert!(draft_shoebox([9.0, -7.0, 3.0], &DraftOptions::default()).is_err());
    assert!(draft_shoebox([f64::NAN, 7.0, 3.0], &DraftOptions::default()).is_err());
}

/// Floor, ceiling and side walls run through under two faces that transmit: what is between them is no air.
#[test]
fn the_inside_of_a_partition_of_two_faces_is_no_room() {
    let face = |x: f64| {
        let corners = [[x, 0.0, 0.0], [x, 4.0, 0.0], [x, 4.0, 3.0], [x, 0.0, 3.0]];
        quad(corners).map(|(corners, _)| (corners, "partition"))
    };
    let volume = |transmission: f64| {
        let partition = format!(
            "[materials]\npartition.absorption = 0.2\npartition.scattering = 0.1\npartition.transmission = {transmission}"
        );
        let scene = SCENE.replace("[materials]", &partition);
        let triangles = [&box_between([0.0; 3], [6.0, 4.0, 3.0])[..], &face(3.0), &face(3.5)].concat();
        let Checkup { problems, room, .. } = checked(&scene, &triangles);
        assert!(problems.is_empty(), "{problems:?}");
        room.unwrap().volume.unwrap()
    };
    assert!((volume(0.01) - 66.0).abs() < 1e-6, "{}", volume(0.01));
    assert!((volume(0.0) - 72.0).abs() < 1e-6, "{}", volume(0.0));
}
