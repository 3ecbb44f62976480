//! Mesh formats: the same room in each is the same scene, damaged files are refused, and what names, units and axes mean.

use std::io;

use glam::{DVec3, dvec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use sonel_scene::checkup::check;
use sonel_scene::{Draft, DraftOptions, Loaded, Scene, SceneErrors, draft, load};
use sonel_testkit::meshes::{self, Triangle, room};

/// A scene with the given mesh and two materials.
fn scene(mesh: &str, keys: &str) -> String {
    format!(
        "mesh = \"{mesh}\"\n{keys}\nduration_s = 1\n[materials]\nwalls.absorption = 0.1\nfloor.absorption = 0.2\n\
         [[sources]]\nposition = [2.0, 2.0, 1.5]\n"
    )
}

fn load_with(name: &str, keys: &str, bytes: &[u8]) -> Result<Loaded, SceneErrors> {
    load(&scene(name, keys), "scene.toml", &mut |path| match path {
        "././room data.bin" => Ok(meshes::gltf_buffer(&room())),
        _ if path == name => Ok(bytes.to_vec()),
        _ => Err(io::ErrorKind::NotFound.into()),
    })
}

fn loaded(name: &str, keys: &str, bytes: &[u8]) -> Loaded {
    load_with(name, keys, bytes).unwrap_or_else(|errors| panic!("{name}: {errors}"))
}

/// The only problem of a file.
fn refused(name: &str, bytes: &[u8]) -> String {
    let errors = load_with(name, "", bytes).expect_err(name);
    assert_eq!(errors.problems.len(), 1, "{errors}");
    errors.to_string()
}

fn is_same(a: &Scene, b: &Scene) -> bool {
    a == b && a.mesh == b.mesh
}

#[test]
fn the_same_room_is_the_same_scene_in_every_format() {
    type Write = fn(&[Triangle]) -> Vec<(&'static str, Vec<u8>)>;
    let kinds: [(Vec<Triangle>, Write, usize); 2] =
        [(room(), meshes::named_files, 6), (meshes::nameless(&room()), meshes::files, 9)];
    for (triangles, write, count) in kinds {
        let files = write(&triangles);
        assert_eq!(files.len(), count);
        let by_name = |(name, bytes): &(&str, Vec<u8>)| {
            load(&scene(name, ""), "scene.toml", &mut |path| match path {
                "././room data.bin" => Ok(meshes::gltf_buffer(&triangles)),
                _ => Ok(bytes.clone()),
            })
            .unwrap_or_else(|errors| panic!("{name}: {errors}"))
            .scene
        };
        let first = by_name(&files[0]);
        assert_eq!((first.mesh.triangles.len(), first.mesh.vertices.len()), (14, 12));
        for file in &files[1..] {
            assert!(is_same(&first, &by_name(file)), "{}", file.0);
        }
        // A wall of another size is another scene.
        let mut other = triangles.clone();
        other[0].0[1][0] = 10.5;
        assert_ne!(by_name(&write(&other)[0]).mesh_digest, first.mesh_digest);
    }
}

/// Exporters turn the root about x by a quaternion or a matrix of 32-bit numbers, and turn it back below.
#[test]
fn right_angles_of_nodes_and_blocks_keep_the_coordinates() {
    let gltf = String::from_utf8(meshes::gltf(&room(), false)).unwrap();
    let turned = gltf.replace(r#""nodes":[0]"#, r#""nodes":[2]"#).replace(
        r#""scale":[2,2,2]}"#,
        r#""scale":[2,2,2]},{"children":[3],"rotation":[0.70710677,0,0,0.7071068]},
        {"children":[0],"matrix":[1,0,0,0,0,-4.371139e-8,-1,0,0,1,-4.371139e-8,0,0,0,0,1]}"#,
    );
    let [plain, turned] = [gltf, turned].map(|text| loaded("room.gltf", "", text.as_bytes()).scene);
    assert!(is_same(&plain, &turned));
    let aslant = meshes::gltf(&room(), false);
    let aslant =
        String::from_utf8(aslant).unwrap().replace(r#""scale""#, r#""rotation":[0.0001,0,0,1],"scale""#);
    assert_ne!(loaded("room.gltf", "", aslant.as_bytes()).scene.mesh_digest, plain.mesh_digest);
    let quarter = extents("0 INSERT 8 walls 2 b 10 5 20 0 30 1 50 90", "walls");
    assert_eq!(quarter, (dvec3(3.0, 0.0, 1.0), dvec3(5.0, 1.0, 1.0)));
}

#[test]
fn the_axes_of_the_file_stay_where_the_scene_says_which_is_up() {
    let glb = meshes::gltf(&room(), true);
    let keys = "mesh_up = \"y\"\nmesh_unit = \"m\"";
    let errors = load_with("room.glb", keys, &glb).unwrap_err();
    assert!(errors.to_string().contains("sources[1].position"), "{errors}");
    let text = scene("room.glb", keys).replace("[2.0, 2.0, 1.5]", "[2.0, 1.5, -2.0]");
    let Loaded { scene, .. } = load(&text, "scene.toml", &mut |_| Ok(glb.clone())).unwrap();
    assert_eq!(scene.up, DVec3::Y);
    assert!(scene.mesh.vertices.contains(&dvec3(10.0, 3.0, -7.0)));
}

#[test]
fn the_unit_of_the_file_holds_unless_the_scene_states_one() {
    let dxf = meshes::dxf(&room(), false);
    let notes = loaded("room.dxf", "", &dxf).notes.join("\n");
    assert!(notes.contains("room.dxf: mesh_unit: mm (the file says so)"), "{notes}");
    assert!(notes.contains("1 LINE ignored"), "{notes}");
    let far = load_with("room.dxf", "mesh_unit = \"m\"", &dxf).unwrap();
    assert!(far.scene.mesh.vertices.contains(&dvec3(10_000.0, 7000.0, 0.0)));
}

/// A DXF file with these entities and a block `b` that holds one face of 1 × 2 on layer 0, its base point at (1, 0, 0).
fn drawing(entities: &str) -> Vec<u8> {
    let face = "0 3DFACE 8 0 10 1 20 0 30 0 11 2 21 0 31 0 12 2 22 2 32 0 13 1 23 2 33 0";
    let text = format!(
        "0 SECTION 2 BLOCKS 0 BLOCK 2 b 10 1 20 0 30 0 {face} 0 ENDBLK 0 ENDSEC 0 SECTION 2 ENTITIES {entities} 0 ENDSEC 0 EOF"
    );
    text.replace(' ', "\n").into_bytes()
}

fn extents(entities: &str, name: &str) -> (DVec3, DVec3) {
    let text = scene("d.dxf", "").replace("walls.", &format!("\"{name}\".").replace('~', " "));
    let Loaded { scene, .. } =
        load(&text, "scene.toml", &mut |_| Ok(drawing(entities))).unwrap_or_else(|errors| panic!("{errors}"));
    scene.geometry().unwrap().bounds()
}

fn is_near(found: (DVec3, DVec3), low: [f64; 3], high: [f64; 3]) -> bool {
    found.0.distance(low.into()) < 1e-12 && found.1.distance(high.into()) < 1e-12
}

#[test]
fn inserted_blocks_are_scaled_turned_and_repeated() {
    let at = |more: &str| format!("0 INSERT 8 walls 2 b 10 5 20 0 30 1{more}");
    assert!(is_near(extents(&at(""), "walls"), [5.0, 0.0, 1.0], [6.0, 2.0, 1.0]));
    assert!(is_near(extents(&at(" 41 3 42 2 43 1"), "walls"), [5.0, 0.0, 1.0], [8.0, 4.0, 1.0]));
    assert!(is_near(extents(&at(" 50 90"), "walls"), [3.0, 0.0, 1.0], [5.0, 1.0, 1.0]));
    assert!(is_near(extents(&at(" 70 2 71 3 44 10 45 4"), "walls"), [5.0, 0.0, 1.0], [16.0, 10.0, 1.0]));
    // Seen from below: x is turned, and so is the place of the block.
    assert!(is_near(extents(&at(" 210 0 220 0 230 -1"), "walls"), [-6.0, 0.0, -1.0], [-5.0, 2.0, -1.0]));
    let plain = "0 3DFACE 8 0 62 3 10 0 20 0 30 0 11 1 21 0 31 0 12 1 22 1 32 0 13 1 23 1 33 0";
    assert!(is_near(extents(plain, "color 3"), [0.0; 3], [1.0, 1.0, 0.0]));
    let vertex = |x: i32, y: i32| format!(" 0 VERTEX 70 64 10 {x} 20 {y} 30 0");
    let mesh: String =
        [(0, 0), (0, 1), (2, 0), (2, 1), (4, 0), (4, 1)].iter().map(|(x, y)| vertex(*x, *y)).collect();
    let mesh = format!("0 POLYLINE 8 walls 70 16 71 3 72 2{mesh} 0 SEQEND");
    assert!(is_near(extents(&mesh, "walls"), [0.0; 3], [4.0, 1.0, 0.0]));
}

#[test]
fn buffers_of_gltf_files_are_beside_them() {
    for uri in ["../a.bin", "sub/../../a.bin", "/etc/passwd", "..\\\\a.bin", "C:/a.bin", "file:///a.bin"] {
        let gltf = format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"uri":"{uri}","byteLength":4}}],"scenes":[{{"nodes":[]}}]}}"#
        );
        let said = refused("a.gltf", gltf.as_bytes());
        assert!(said.contains("is not beside or below the file"), "{uri}: {said}");
    }
}

/// Escapes of a URI are bytes of UTF-8; what is none stays. A link may lead nowhere else than where `/./` says.
#[test]
fn buffers_of_gltf_files_are_found_by_their_uri() {
    for (uri, expected) in [
        ("h%C3%A4ll.bin", "parts/./häll.bin"),
        ("häll.bin", "parts/./häll.bin"),
        ("sub%2Fa%20b.bin", "parts/./sub/a b.bin"),
        ("50%.bin", "parts/./50%.bin"),
        ("%FF%zz%4.bin", "parts/./%FF%zz%4.bin"),
    ] {
        let gltf = String::from_utf8(meshes::gltf(&room(), false)).unwrap().replace("room%20data.bin", uri);
        let found = load(&scene("parts/a.gltf", ""), "scene.toml", &mut |path| match path {
            "parts/a.gltf" => Ok(gltf.clone().into_bytes()),
            _ if path == expected => Ok(meshes::gltf_buffer(&room())),
            _ => Err(io::ErrorKind::NotFound.into()),
        });
        assert!(found.is_ok(), "{uri}: {found:?}");
    }
}

/// Names of older files of Windows are Latin-1; a byte order mark is no part of a name.
#[test]
fn names_in_latin_1_and_after_a_mark_are_read() {
    let obj = String::from_utf8(meshes::obj(&room())).unwrap().replace("walls", "Wände");
    let latin_1: Vec<u8> = obj.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap()).collect();
    let marked = [b"\xef\xbb\xbf", obj.as_bytes()].concat();
    let scene = scene("a.obj", "").replace("walls.", "\"Wände\".");
    let of = |bytes: &[u8]| load(&scene, "scene.toml", &mut |_| Ok(bytes.to_vec())).expect("a scene").scene;
    let expected = of(obj.as_bytes());
    assert!([latin_1, marked].iter().all(|bytes| is_same(&of(bytes), &expected)));
}

#[test]
fn a_statement_of_many_lines_and_a_polygon_of_many_corners_take_no_longer_than_their_size() {
    let begun = std::time::Instant::now();
    let count = 20_000;
    let mut obj = String::new();
    for index in 0..count {
        let (sin, cos) = (f64::from(index) / f64::from(count) * std::f64::consts::TAU).sin_cos();
        obj += &format!("v {cos} {sin} 0\n");
    }
    obj += "f";
    for index in 1..=count {
        obj += &format!(" \\\n{index}");
    }
    let _ = load_with("a.obj", "", obj.as_bytes());
    obj += &" \\\n".repeat(300_000);
    let _ = load_with("a.obj", "", obj.as_bytes());
    // With the square of their number these are minutes.
    assert!(begun.elapsed() < std::time::Duration::from_secs(20), "{:?}", begun.elapsed());
}

#[test]
fn colours_name_the_surfaces_of_stl_and_ply() {
    let mut stl = meshes::stl_binary(&room());
    for (i, attribute) in [(0, 0x8000u16 | 31 << 10), (1, 0x8000 | 31)] {
        let at = 84 + 50 * i + 48;
        stl[at..at + 2].copy_from_slice(&attribute.to_le_bytes());
    }
    let errors = load_with("c.stl", "", &stl).unwrap_err().to_string();
    assert!(errors.contains("c.stl: colour #ff0000: no table [materials.\"#ff0000\"]"), "{errors}");
    assert!(errors.contains("c.stl: colour #0000ff"), "{errors}");
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
               property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
               property list uchar uint vertex_index\nend_header\n0 0 0 9 8 7\n1 0 0 9 8 7\n1 1 0 9 8 7\n0 1 0 9 8 7\n4 0 1 2 3\n";
    assert!(refused("c.ply", ply.as_bytes()).contains("c.ply: colour #090807: no table"));
}

/// I-Simpa writes the layer of every face and the names of the layers.
#[test]
fn layers_name_the_surfaces_of_ply() {
    let ply = |layer: u32| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
             property list uchar int vertex_indices\nproperty int layer_id\nelement layer 2\n\
             property list uchar uchar layer_name\nend_header\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2 {layer}\n5 102 108 111 111 114\n4 98 97 99 107\n"
        )
    };
    let scene = loaded("c.ply", "", ply(0).as_bytes()).scene;
    assert_eq!(scene.materials[scene.mesh.triangles[0].material as usize].name, "floor");
    assert!(refused("c.ply", ply(1).as_bytes()).contains("back"));
    assert!(refused("c.ply", ply(2).as_bytes()).contains("no layer 2: the file names 2, counted from 0"));
}

/// A polygon with a hole, drawn as one outline that walks a bridge to the hole there and back.
#[test]
fn a_keyhole_has_the_area_of_its_outline_less_that_of_its_hole() {
    let vertices = ["0 0 0", "6 0 0", "6 5 0", "0 5 0", "2 1 0", "2 3 0", "4 3 0", "4 1 0"];
    let obj = |outline: &[usize]| {
        let vertices: String = vertices.iter().map(|vertex| format!("v {vertex}\n")).collect();
        let outline: String = outline.iter().map(|corner| format!(" {}", corner + 1)).collect();
        format!("{vertices}usemtl floor\nf{outline}\n")
    };
    let ply = |outline: &[usize]| {
        let head = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                    property list uchar int vertex_indices\nend_header\n";
        let outline: String = [outline.len()].iter().chain(outline).map(|word| format!("{word} ")).collect();
        format!("{head}{}\n{outline}\n", vertices.join("\n"))
    };
    type File<'a> = &'a dyn Fn(&[usize]) -> String;
    for (name, file) in [("k.obj", &obj as File<'_>), ("k.ply", &ply)] {
        let mesh = loaded(name, "", file(&[0, 1, 2, 3, 0, 4, 5, 6, 7, 4]).as_bytes()).scene.mesh;
        let area = |triangle: u32| {
            let [a, b, c] = mesh.corners(triangle);
            0.5 * (b - a).cross(c - a).z
        };
        let areas: Vec<f64> = (0..mesh.triangles.len() as u32).map(area).collect();
        assert!(
            (areas.iter().sum::<f64>() - 26.0).abs() < 1e-9 && areas.iter().all(|area| *area > 0.0),
            "{name}: {areas:?}"
        );
        for outline in [&[0, 1, 2, 3, 1][..], &[0, 1, 2, 1, 0, 3]] {
            let said = refused(name, file(outline).as_bytes());
            assert!(said.contains("occurs twice"), "{name}, {outline:?}: {said}");
        }
    }
    assert!(refused("k.obj", obj(&[0, 0, 1, 2]).as_bytes()).contains("occurs twice; split the face"));
    assert_eq!(loaded("k.ply", "", ply(&[0, 0, 1, 2]).as_bytes()).scene.mesh.triangles.len(), 1);
}

#[test]
fn groups_name_the_surfaces_of_obj_files_without_materials() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\ng floor\nf 1 2 3\nv 0 0 1\no walls\nf 1 2 4\n";
    let scene = loaded("g.obj", "", obj.as_bytes()).scene;
    assert_eq!(scene.mesh.triangles.iter().map(|triangle| triangle.material).collect::<Vec<_>>(), [1, 0]);
    let nameless = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    assert_eq!(loaded("n.obj", "", nameless.as_bytes()).scene.mesh.triangles[0].material, 0);
    let late = nameless.to_owned() + "usemtl walls\nf 1 3 2\n";
    assert!(
        refused("l.obj", late.as_bytes()).contains("l.obj:4:1: f: no usemtl names the material of this face")
    );
}

#[test]
fn mistakes_are_named_with_their_place() {
    let room = room();
    let cut = |bytes: Vec<u8>| bytes[..bytes.len() - 40].to_vec();
    let cases = [
        (
            "a.stl",
            cut(meshes::stl_binary(&room)),
            "a.stl: the file has 744 bytes, 784 for its 14 triangles: export it again",
        ),
        (
            "b.stl",
            b"solid a\nfacet normal 0 0 1\nvertex 0 0\nendfacet\n".to_vec(),
            "b.stl:3:1: vertex `0 0`: a vertex has three numbers",
        ),
        ("c.dxf", cut(meshes::dxf(&room, false)), "no EOF: the file is cut off or not DXF"),
        ("d.dxf", drawing("0 INSERT 2 c"), "INSERT: no block `c` in the file"),
        (
            "e.dxf",
            b"AutoCAD Binary DXF\r\n".to_vec(),
            "e.dxf: binary DXF is not read: save as text (ASCII) DXF",
        ),
        ("f.glb", cut(meshes::gltf(&room, true)), "the glTF reader refuses the file"),
        ("g.glb", b"glTF\x02\0\0\0\x01\0\0\0".to_vec(), "g.glb: the file is cut off in its header"),
        ("other/h.gltf", meshes::gltf(&room, false), "cannot read its buffer `other/room data.bin`"),
        (
            "i.ply",
            cut(meshes::ply(&room, false)),
            "the PLY reader refuses the file: Line 63: Unexpected end of file",
        ),
        (
            "i.ply",
            b"ply\nformat binary_little_endian 1.0\nelement junk 9000000000000000\nend_header\n".to_vec(),
            "9000000000000000 rows of \"junk\" are announced",
        ),
        ("j.skp", Vec::new(), "j.skp: .skp files are not read: export OBJ, glTF, STL, PLY or DXF"),
        ("k.stl", b"solid\nendsolid\n".to_vec(), "k.stl: the mesh has no face; export polygons"),
    ];
    for (name, bytes, expected) in cases {
        let found = load_with(name, "", &bytes).expect_err(name).to_string();
        assert!(found.contains(expected), "{name}: {found}");
    }
}

#[test]
fn nodes_that_are_no_tree_and_blocks_in_themselves_end() {
    let glb = meshes::gltf(&room(), false);
    let text = String::from_utf8(glb).unwrap();
    let circle = text.replace("\"mesh\":0", "\"children\":[0],\"mesh\":0");
    assert_ne!(circle, text);
    assert!(refused("a.gltf", circle.as_bytes()).contains("the nodes are not a tree"));
    let endless = String::from_utf8(drawing("0 INSERT 2 b"))
        .unwrap()
        .replace("0\nENDBLK", "0\nINSERT\n2\nb\n0\nENDBLK");
    assert!(
        load_with("b.dxf", "", endless.as_bytes())
            .unwrap_err()
            .to_string()
            .contains("blocks in blocks without end")
    );
}

/// A file of some format.
fn file() -> impl Strategy<Value = (&'static str, Vec<u8>)> {
    prop::sample::select(
        meshes::files(&room()).into_iter().chain(meshes::named_files(&room())).collect::<Vec<_>>(),
    )
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 768, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn files_that_are_cut_off_are_refused_or_lack_faces((name, bytes) in file(), share in 0.0..1.0) {
        let kept = (share * bytes.len() as f64) as usize;
        match load_with(name, "", &bytes[..kept]) {
            Err(errors) => prop_assert!(!errors.problems.is_empty()),
            Ok(loaded) => {
                let is_obj_or_solid = name.ends_with("obj") || name == "text.stl";
                // A number that is cut off in the last line of a text is a number.
                let is_last_line = !bytes[kept..bytes.len() - 1].contains(&b'\n');
                prop_assert!(is_last_line || is_obj_or_solid && loaded.scene.mesh.triangles.len() <= 14, "{name} {kept}");
            }
        }
    }

    #[test]
    fn files_with_wrong_bytes_never_panic(
        (name, mut bytes) in file(),
        changes in prop::collection::vec((0.0..1.0, any::<u8>()), 1..6),
    ) {
        for (share, byte) in changes {
            let at = (share * bytes.len() as f64) as usize;
            bytes[at] = byte;
        }
        match load_with(name, "", &bytes) {
            Err(errors) => prop_assert!(!errors.problems.is_empty()),
            Ok(loaded) => prop_assert!(loaded.scene.geometry().is_ok()),
        }
        // Neither a checkup nor a draft asks more of a mesh.
        prop_assert!(check(&scene(name, ""), "scene.toml", &mut |_| Ok(bytes.clone())).is_ok());
        if let Ok(Draft { text, .. }) = draft(name, name, &DraftOptions::default(), &mut |_| Ok(bytes.clone())) {
            // A room of implausible size has no default duration.
            let text = format!("duration_s = 1\n{text}");
            prop_assert!(load(&text, "scene.toml", &mut |_| Ok(bytes.clone())).is_ok(), "{}", text);
        }
    }

    #[test]
    fn any_bytes_of_any_format_never_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..300),
        begin in prop::sample::select(vec![&b""[..], b"glTF\x02\0\0\0", b"ply\nformat ascii 1.0\n", b"solid ", b"0\nSECTION\n", b"{\"asset\":{\"version\":\"2.0\"},"]),
        ending in prop::sample::select(vec!["obj", "glb", "gltf", "stl", "ply", "dxf"]),
    ) {
        let bytes = [begin, &bytes].concat();
        let result = load_with(&format!("m.{ending}"), "", &bytes);
        prop_assert!(result.is_err());
    }
}
