//! Every key of the scene file reaches its value in the compiled scene.

use std::fs;
use std::path::Path;

use glam::{DVec3, dvec3};
use sonel_acoustics::{Air, BandWidth, Pattern, sabine_time};
use sonel_scene::{Document, Loaded, PolygonMesh, Scene, Value, load};

fn load_good(name: &str) -> Loaded {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/good").join(name);
    load(&fs::read_to_string(&path).unwrap(), name, &mut |mesh| fs::read(path.with_file_name(mesh))).unwrap()
}

fn load_shoebox(rest: &str) -> Scene {
    let text = format!("shoebox = [10, 7, 3]\nsources = [{{ position = [2, 2, 1.5] }}]\n{rest}");
    load(&text, "scene.toml", &mut |_| panic!("a shoebox opens no mesh")).unwrap().scene
}

#[track_caller]
fn assert_near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1.0), "{found} is not {expected}");
    }
}

#[test]
fn room_keys() {
    let scene = load_good("every-key.toml").scene;
    assert_eq!(scene.name, "Every key of the interface");
    assert_near(&[scene.duration, scene.speed_of_sound], &[2.5, 340.0]);
    assert_eq!(scene.up, DVec3::Y);
    assert_eq!(scene.bands.width(), BandWidth::Octave);
    assert_near(scene.bands.nominal(), &[125.0, 500.0, 2000.0]);
    let air = Air { temperature_celsius: 15.0, relative_humidity_percent: 40.0, pressure_kpa: 100.0 };
    assert_eq!(scene.air, air);
    let midbands = [0, 1, 2].map(|band| scene.bands.exact_midband(band));
    assert_near(&scene.air_attenuation, &midbands.map(|frequency| air.energy_attenuation(frequency)));
}

#[test]
fn mesh_is_in_metres_and_closed() {
    let scene = load_good("every-key.toml").scene;
    let geometry = scene.geometry().unwrap();
    assert!(geometry.is_closed_room());
    assert_near(&[geometry.volume().unwrap()], &[60.0]);
    assert!(geometry.bounds().1.distance(dvec3(4.0, 3.0, 5.0)) < 1e-12);
    // The curtain covers the walls x = 0 and x = 4 m.
    assert!((geometry.exposed_area(1) - 30.0).abs() < 1e-9);
    assert!((geometry.exposed_area(0) - 64.0).abs() < 1e-9);
}

#[test]
fn variants_have_what_they_state_and_the_rest_of_their_material() {
    let scene = load_shoebox(
        "[materials.walls]\nabsorption = 0.3\nscattering = 0.2\ntransmission = 0.1\n\
         variants = [{ absorption = 0.5 }, { library = \"plaster-painted\", transmission = 0.0, scattering = 0.4 }]\n",
    );
    let [soft, plaster] = &scene.variants[0][..] else { panic!("two variants") };
    assert_near(&[soft.absorption[3], soft.scattering[3], soft.transmission[3]], &[0.5, 0.2, 0.1]);
    assert_near(&[plaster.absorption[3], plaster.scattering[3], plaster.transmission[3]], &[0.02, 0.4, 0.0]);
    // The default duration is that of the hardest walls.
    let alone = load_shoebox("[materials.walls]\nabsorption = 0.02\nscattering = 0.2\n");
    assert_near(&[scene.duration], &[alone.duration]);
}

#[test]
fn named_variants_choose_among_the_variants_of_materials() {
    let scene = load_shoebox(
        "[materials.walls]\nabsorption = 0.3\nvariants = [{ absorption = 0.6 }]\n\
         [variants.soft]\nwalls = { absorption = 0.6 }\n\
         [variants.\"as it was\"]\nwalls = { library = \"plaster-painted\" }\n",
    );
    assert_eq!(scene.variants[0].len(), 2, "one that is there is not added again");
    let [soft, old] = ["soft", "as it was"].map(|name| scene.design(name).expect("a variant"));
    assert_near(&[soft[0].absorption[3], old[0].absorption[3]], &[0.6, 0.02]);
    assert!(scene.design("hard").is_none());
}

#[test]
fn material_keys() {
    let scene = load_good("every-key.toml").scene;
    let [concrete, curtain, interface] = &scene.materials[..] else { panic!("three materials") };
    assert_near(&interface.absorption, &[1.0; 3]);
    assert_eq!((concrete.name.as_str(), curtain.name.as_str()), ("concrete", "velvet curtain"));
    assert_eq!((concrete.source.as_deref(), curtain.source.as_deref()), (Some("a table"), None));
    assert_near(&concrete.absorption, &[0.1, 0.2, 0.3]);
    assert_near(&concrete.scattering, &[0.5, 0.5, 1.0]);
    assert_near(&[0, 1, 2].map(|band| concrete.diffuse(band)), &[0.45, 0.4, 0.7]);
    assert_near(&concrete.transmission, &[0.0; 3]);
    assert_near(&curtain.absorption, &[0.5; 3]);
    assert_near(&curtain.scattering, &[0.1, 0.2, 0.3]);
}

#[test]
fn region_keys() {
    let scene = load_good("every-key.toml").scene;
    let media = scene.media.as_ref().unwrap();
    let [region] = &media.regions[..] else { panic!("one region") };
    assert_eq!((region.name.as_str(), region.inside), ("under the ceiling", dvec3(3.0, 2.8, 2.0)));
    let air = Air { temperature_celsius: 30.0, relative_humidity_percent: 30.0, ..scene.air };
    assert_eq!(region.air, air);
    let speed = scene.speed_of_sound * (air.temperature_kelvin() / scene.air.temperature_kelvin()).sqrt();
    assert_near(&[region.speed_of_sound, region.density], &[speed, air.density()]);
    assert!(
        region.air_attenuation.iter().zip(&scene.air_attenuation).all(|(m, own)| (*m > 0.0) == (*own > 0.0))
    );
    assert_eq!((media.interfaces.as_slice(), media.at_sources.as_slice()), (&[2][..], &[0, 0][..]));
}

#[test]
fn a_gradient_of_the_speed_of_sound_is_read_or_refused() {
    let text = |gradient: f64, more: &str| {
        format!(
            "shoebox = [10, 7, 3]\nduration_s = 0.5\nsources = [{{ position = [2, 2, 1.5] }}]\n\
             [air]\nspeed_of_sound = 340\nsound_speed_gradient = {gradient}\n[materials.walls]\nabsorption = 0.2\n{more}"
        )
    };
    let read = |gradient, more: &str| load(&text(gradient, more), "scene.toml", &mut |_| panic!("no mesh"));
    let scene = read(-0.1, "").unwrap().scene;
    assert_near(&[scene.sound_speed_gradient, scene.speed_of_sound], &[-0.1, 340.0]);
    assert!(
        scene.profile(DVec3::ZERO).is_some() && read(0.0, "").unwrap().scene.profile(DVec3::ZERO).is_none()
    );
    let refused = |gradient, more, reason: &str| {
        let errors = read(gradient, more).unwrap_err().to_string();
        assert!(errors.starts_with("scene.toml:6:24: air.sound_speed_gradient: "), "{errors}");
        assert!(errors.contains(reason) && errors.lines().count() == 1, "{errors}");
    };
    refused(-120.0, "", "-20 m/s at the height 3 m");
    refused(16.1, "", "gradient times duration is at most 8");
    refused(-0.1, "absorption_law = \"locally-reacting\"\n", "absorption_law cannot be combined");
    refused(-120.0, "[[receivers]]\nposition = [4, 4, 2]\n", "the speed of sound");
}

#[test]
fn source_and_receiver_keys() {
    let scene = load_good("every-key.toml").scene;
    let [stage, pit] = &scene.sources[..] else { panic!("two sources") };
    assert_eq!((stage.name.as_str(), stage.position), ("stage", dvec3(2.0, 1.5, 2.0)));
    assert_near(&stage.power_level_db, &[80.0, 85.5, 90.0]);
    assert_eq!((stage.directivity.clone(), stage.aim), (Pattern::FigureEight.into(), -DVec3::Z));
    assert_near(&pit.power_level_db, &[70.0; 3]);
    assert_eq!(pit.directivity, Pattern::Omni.into());

    let [towards_source, aimed] = &scene.receivers[..] else { panic!("two receivers") };
    assert_eq!((towards_source.name.as_str(), towards_source.position), ("seat 12", dvec3(3.0, 1.0, 4.0)));
    assert!(towards_source.aim.distance(dvec3(-1.0, 0.5, -2.0).normalize()) < 1e-12);
    assert!(aimed.aim.distance(dvec3(0.6, 0.0, 0.8)) < 1e-12);
}

#[test]
fn the_digest_of_the_scene_leaves_out_the_name_of_its_mesh() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/good");
    let text = fs::read_to_string(folder.join("every-key.toml")).unwrap().replace("\"every-key.obj\"", "");
    assert_eq!(load_good("every-key.toml").scene.digest, *blake3::hash(text.as_bytes()).as_bytes());
}

/// A sample absorbs more than a wall without end, so what it measured is less of a wall; what is measured above 1 is a wall as well.
#[test]
fn absorption_of_a_sample_is_read_as_that_of_a_wall() {
    let text = |rest: &str| {
        format!("shoebox = [10, 7, 3]\nsources = [{{ position = [2, 2, 1.5] }}]\n[materials.walls]\n{rest}")
    };
    let read = |rest: &str| load(&text(rest), "scene.toml", &mut |_| panic!("a shoebox opens no mesh"));
    let law = "absorption_law = \"locally-reacting\"\n";
    let stated = "absorption = [0.1, 1.1, 0.54, 0.54, 0.54, 0.9, 0.9, 0.02]\nsample_area = 10.8\n";
    let scene = read(&format!("{law}{stated}variants = [{{ scattering = 0.4 }}]")).unwrap().scene;
    let found = &scene.materials[0].absorption;
    // By Gaussian quadrature of the formula in another program.
    for (found, expected) in found.iter().zip([0.092, 0.739, 0.440, 0.461, 0.483]) {
        assert!((found - expected).abs() < 1.5e-3, "{found} is not {expected}");
    }
    assert!((found[7] - 0.02).abs() < 1e-3, "{found:?}");
    assert_near(&scene.variants[0][0].absorption, found);
    for (rest, reason) in [
        (stated.to_owned(), "state absorption_law"),
        (format!("{law}{stated}").replace("10.8", "1e4"), "at most 100 m²"),
        (format!("{law}{stated}").replace("1.1,", "1.9,"), "no locally reacting sample"),
        (format!("{law}{stated}").replace("sample_area = 10.8", ""), "1.1 is outside 0 … 1; give 1"),
    ] {
        let errors = read(&rest).unwrap_err().to_string();
        assert!(errors.contains(reason) && errors.lines().count() == 1, "{errors}");
    }
}

/// Half a person per m² is half of `audience-1`, 0.55 at 500 Hz; 1.25 is midway to `audience-1.5`, 0.71.
#[test]
fn people_absorb_by_their_number() {
    let read = |people: &str| {
        let text = format!(
            "shoebox = [10, 7, 3]\nsources = [{{ position = [2, 2, 1.5] }}]\n[materials.walls]\nabsorption = 0.1\npeople = {people}"
        );
        load(&text, "scene.toml", &mut |_| panic!("a shoebox opens no mesh"))
    };
    let at_500_hz = |people: &str| read(people).unwrap().scene.materials[0].absorption[3];
    for (people, expected) in [("0.5", 0.325), ("1", 0.55), ("1.25", 0.63), ("2", 0.87)] {
        assert!((at_500_hz(people) - expected).abs() < 1e-12, "{people}");
    }
    assert!(read("2.5").unwrap_err().to_string().contains("give at most 2"));
    assert!(read("0").unwrap_err().to_string().contains("not positive"));
}

#[test]
fn units_scale_the_mesh() {
    for (unit, length) in
        [("m", 1.0), ("dm", 0.1), ("mm", 0.001), ("cm", 0.01), ("in", 0.0254), ("ft", 0.3048)]
    {
        let text = format!(
            "mesh = \"m.obj\"\nmesh_unit = \"{unit}\"\nduration_s = 1\nmaterials.w.absorption = 0.1\n\
             sources = [{{ position = [0, 0, 100] }}]"
        );
        let obj = b"v 0 0 0\nv 2 0 0\nv 0 3 0\nusemtl w\nf 1 2 3\n";
        let scene = load(&text, "scene.toml", &mut |_| Ok(obj.to_vec())).unwrap().scene;
        assert_near(&scene.mesh.vertices[2].to_array(), &[0.0, 3.0 * length, 0.0]);
    }
}

#[test]
fn coordinates_far_from_the_origin_keep_double_precision() {
    let text = "mesh = \"m.obj\"\nduration_s = 1\nmaterials.w.absorption = 0.1\n\
                sources = [{ position = [5000000, 0, 100] }]";
    let obj = b"v 5000000.123456 0 0\nv 5000002 0 0\nv 5000000 3 0\nusemtl w\nf 1 2 3\n";
    let scene = load(text, "scene.toml", &mut |_| Ok(obj.to_vec())).unwrap().scene;
    assert_near(&[scene.mesh.vertices[0].x], &[5_000_000.123_456]);
}

#[test]
fn walls_of_a_shoebox_take_their_own_material() {
    let scene = load_good("shoebox-walls.toml").scene;
    let geometry = scene.geometry().unwrap();
    let area = |name: &str| {
        let index = scene.materials.iter().position(|material| material.name == name).unwrap();
        geometry.exposed_area(index as u32)
    };
    assert_near(&["walls", "z0", "y1", "ceiling"].map(area), &[142.0, 70.0, 30.0, 0.0]);
    assert_eq!(scene.bands.count(), 24);
    assert_near(&scene.air_attenuation, &[0.0; 24]);
    // δ = 0.3 beside α = 0.7 is all that is reflected; nothing is where α = 1.
    let scattering = |name: &str| scene.materials.iter().find(|m| m.name == name).unwrap().scattering[0];
    assert_near(&[scattering("z0"), scattering("y1")], &[1.0, 0.0]);
}

#[test]
fn duration_follows_the_longest_sabine_time() {
    let scene = load_shoebox(
        "air.attenuation = false\nmaterials.walls.absorption = [0.4, 0.1, 0.4, 0.4, 0.4, 0.4, 0.4, 0.4]",
    );
    let longest = sabine_time(210.0, 24.2, 0.0, scene.speed_of_sound);
    assert!(scene.duration >= 1.2 * longest && scene.duration < 1.2 * longest + 0.01);
}

#[test]
fn defaults() {
    let scene = load_shoebox("materials.walls.absorption = 0.2");
    assert_eq!(scene.air, Air::default());
    assert_near(&[scene.speed_of_sound], &[Air::default().speed_of_sound()]);
    assert_eq!(scene.bands.count(), 8);
    assert_near(&scene.materials[0].scattering, &[0.1; 8]);
    assert_near(&scene.sources[0].power_level_db, &[90.0; 8]);
    assert_eq!((scene.up, scene.receivers.len()), (DVec3::Z, 0));
}

#[test]
fn temperature_sets_the_speed_of_sound() {
    let scene = load_shoebox("air.temperature_celsius = 0\nmaterials.walls.absorption = 0.2");
    assert_near(&[scene.speed_of_sound], &[343.2 * (273.15f64 / 293.15).sqrt()]);
}

#[test]
fn transmission_by_share_and_by_sound_reduction() {
    let keys = "[bands]\ncenter_frequencies_hz = [500, 1000]\n[materials.walls]\nabsorption = 0.5\n";
    for (key, expected) in [
        ("transmission = [0.5, 0.02]", [0.5, 0.02]),
        ("sound_reduction_db = [10, 45]", [0.1, 10f64.powf(-4.5)]),
    ] {
        assert_near(&load_shoebox(&format!("{keys}{key}")).materials[0].transmission, &expected);
    }
}

/// What lets everything through is not there.
#[test]
fn holes_are_left_out() {
    let hole = "[materials.walls]\nabsorption = 0.5\n[materials.z1]\nabsorption = 1\ntransmission = 1";
    let ajar = hole.replace("transmission = 1", "transmission = 0.999");
    assert_eq!(load_shoebox(hole).mesh.triangles.len(), 10);
    assert_eq!(load_shoebox(&ajar).mesh.triangles.len(), 12);
}

#[test]
fn a_scene_made_in_code_is_that_of_its_saved_file() {
    let mut mesh = PolygonMesh::new(
        (0..8)
            .map(|i| [f64::from(i >> 2 & 1) * 4.0, f64::from(i >> 1 & 1) * 3.0, f64::from(i & 1)])
            .collect(),
    );
    let sides: [[u32; 4]; 6] =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    for (index, side) in sides.iter().enumerate() {
        mesh.face(side, if index == 4 { "car\"pet" } else { "plaster" });
    }
    let material = |absorption: f64| Value::table([("absorption", absorption)]);
    let keys = |y: f64| {
        [
            ("sources", vec![Value::table([("position", vec![1.0, y, 0.5])])].into()),
            ("name", Value::from("a \"room\"")),
            ("materials", Value::table([("plaster", material(0.1)), ("car\"pet", material(0.4))])),
            ("closed", true.into()),
        ]
    };
    let made = Document::new(keys(1.0), Some(mesh.clone()));
    let mut obj = Vec::new();
    mesh.write_obj(&mut obj).unwrap();
    let read = sonel_scene::load(&made.to_toml(), "scene.toml", &mut |name| {
        assert_eq!(name, Document::MESH_NAME);
        Ok(obj.clone())
    });
    assert_eq!(made.load().unwrap().scene, read.unwrap().scene);
    let wrong = Document::new(keys(9.0), Some(mesh)).load().unwrap_err().to_string();
    assert!(wrong.starts_with("scene: sources[1].position: "), "{wrong}");
}

/// Sources that move leave walls where they are, and everything else is as in a scene that is read anew: refusals, too.
#[test]
fn walls_of_an_earlier_scene_are_taken_over() {
    let text = |x: f64, between: f64| {
        format!(
            "shoebox = [4, 3, 2]\n[materials.walls]\nabsorption = {between}\n[[sources]]\nposition = [{x}, 1, 1]\n\
             [[receivers]]\nposition = [2, 2, 1]\n"
        )
    };
    let load = |text: &str| sonel_scene::load(text, "s.toml", &mut |_| panic!("a shoebox has no mesh"));
    let earlier = load(&text(1.0, 0.2)).unwrap();
    let reload = |text: &str| {
        let walls = (&earlier.scene, &earlier.geometry);
        sonel_scene::reload(text, "s.toml", &mut |_| panic!("nothing is read"), walls)
    };
    let moved = reload(&text(3.0, 0.2)).unwrap();
    assert_eq!(moved.scene, load(&text(3.0, 0.2)).unwrap().scene);
    assert!(std::sync::Arc::ptr_eq(&moved.geometry, &earlier.geometry));
    let [outside, anew] = [reload(&text(9.0, 0.2)), load(&text(9.0, 0.2))].map(|wrong| wrong.unwrap_err());
    assert_eq!(outside.to_string(), anew.to_string());
    assert_ne!(earlier.scene, moved.scene, "the sources are elsewhere");
}

#[test]
fn what_failed_is_compared_with_nothing() {
    let text = "shoebox = [4, 3, 2]\n[materials.walls]\nabsorption = [0.6, 1.2, 0.6, 0.6, 0.6, 0.6, 0.6, 0.6]\n\
                transmission = 0.5\n[[sources]]\nposition = [1, 1, 1]\n";
    let load = |text: &str| sonel_scene::load(text, "s.toml", &mut |_| panic!("a shoebox has no mesh"));
    let errors = load(text).unwrap_err();
    assert_eq!(errors.problems.len(), 1, "{errors}");
    let less = load(&text.replace("1.2", "0.4")).unwrap_err().to_string();
    assert!(less.contains("transmission 0.5 exceeds absorption 0.4 at 125 Hz"), "{less}");
}
