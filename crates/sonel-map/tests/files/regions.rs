//! Maps of several airs: what is written is read, and what cannot be is refused.

use std::io::Cursor;

use glam::DVec3;
use sonel_acoustics::{Air, Material};
use sonel_geometry::{FaceKind, Geometry, MeshTriangle, Side};
use sonel_map::provenance::differences;
use sonel_map::{ChunkPaths, Event, Fates, Ledger, MapError, MapHeader, MapWriter, SonelMap, Vertex};
use sonel_scene::{Media, Region};

use crate::{forged, hand_made};

/// The box of other tests with warm air above 2 m. The interface is the last surface.
fn header() -> MapHeader {
    let mut header = hand_made::header(2);
    let mut scene = header.scene;
    let first = scene.mesh.vertices.len() as u32;
    let corners = [[0.0, 0.0, 2.0], [5.0, 0.0, 2.0], [5.0, 4.0, 2.0], [0.0, 4.0, 2.0]];
    scene.mesh.vertices.extend(corners.map(DVec3::from_array));
    for corners in [[0, 1, 2], [0, 2, 3]] {
        scene
            .mesh
            .triangles
            .push(MeshTriangle { corners: corners.map(|corner| corner + first), material: 2 });
    }
    scene.materials.push(Material::uniform("layer", 1.0, 0.0, 3));
    let air = Air { temperature_celsius: 40.0, ..scene.air };
    let warm = Region {
        name: "warm".to_owned(),
        inside: DVec3::new(2.5, 2.0, 2.5),
        speed_of_sound: air.speed_of_sound(),
        density: air.density(),
        air_attenuation: vec![0.001; 3],
        air,
    };
    let kind = |material| if material == 2 { FaceKind::Interface } else { FaceKind::Wall };
    let geometry = Geometry::with_kinds(scene.mesh.clone(), kind, &[]).unwrap();
    let sources: Vec<DVec3> = scene.sources.iter().map(|source| source.position).collect();
    scene.media = Some(Media::find(&geometry, vec![warm], vec![2], &sources).unwrap());
    header.scene = scene;
    header
}

/// Two paths of three vertices that begin with `first` at the interface or the floor.
fn bytes(first: Event, at_interface: bool) -> Vec<u8> {
    let header = header();
    let geometry = header.scene.geometry().unwrap();
    let triangle = |interface| if interface { geometry.mesh().triangles.len() as u32 - 1 } else { 0 };
    let vertex = |interface, event| {
        let surface = geometry.triangle_surface(triangle(interface));
        let at = geometry.surface(surface).centroid - geometry.center();
        Vertex::new(at.as_vec3(), surface, Side::Back, event)
    };
    let path = [vertex(at_interface, first), vertex(true, Event::Refracted), vertex(false, Event::Absorbed)];
    let paths = ChunkPaths { ends: vec![3, 6], vertices: [path, path].concat() };
    let mut ledger = Ledger::new(3);
    (ledger.fates, ledger.segments) = (Fates::from_counts([2, 0, 0, 0, 0]), 6);
    let mut writer = MapWriter::begin(Cursor::new(Vec::new())).unwrap();
    for source in 0..2 {
        writer.push_chunk(source, 0, &paths, &ledger).unwrap();
    }
    writer.finish(&header, &geometry).unwrap().into_inner()
}

fn read(bytes: &[u8]) -> Result<(SonelMap, Geometry), MapError> {
    let map = SonelMap::from_bytes(bytes)?;
    let geometry = map.header().scene.geometry()?;
    map.check_surfaces(&geometry)?;
    map.check_paths(geometry.surfaces().len() as u32)?;
    Ok((map, geometry))
}

#[test]
fn a_map_of_two_airs_is_read_as_it_was_written() {
    let (map, geometry) = read(&bytes(Event::Returned, true)).unwrap();
    assert_eq!(map.header().scene, header().scene);
    let media = map.header().scene.media.as_ref().unwrap();
    assert_eq!(
        (media.at_sources.clone(), media.airs(&geometry).at(DVec3::new(1.0, 1.0, 2.9))),
        (vec![0, 0], 1)
    );
    let mut other = header();
    assert!(differences(map.header(), &other).is_empty());
    other.scene.media.as_mut().unwrap().regions[0].speed_of_sound += 1.0;
    assert_eq!(differences(map.header(), &other).len(), 1);
    other.scene.leave_out(sonel_scene::Effect::Refraction);
    assert!(differences(map.header(), &other).iter().any(|found| found.what == "regions of other air"));
    assert_eq!(other.scene.geometry().unwrap().surfaces().len(), 6);
}

#[test]
fn events_are_where_they_can_be() {
    for (event, at_interface, is_sound) in [
        (Event::Refracted, true, true),
        (Event::Returned, true, true),
        (Event::Specular, false, true),
        (Event::Refracted, false, false),
        (Event::Returned, false, false),
        (Event::Specular, true, false),
        (Event::Diffuse, true, false),
    ] {
        let found = read(&bytes(event, at_interface));
        assert_eq!(found.is_ok(), is_sound, "{event:?} {at_interface}");
        let rules = |error: &MapError| error.to_string().contains("a path breaks the rules of the format");
        assert!(found.err().is_none_or(|error| rules(&error)));
    }
}

#[test]
fn no_number_among_the_regions_makes_the_reader_panic() {
    let sound = bytes(Event::Returned, true);
    let length = forged::section(&sound, "regions").range.len();
    let mut refused = 0;
    for at in 0..=length - 8 {
        for value in forged::ABSURD {
            let forged = forged::in_section(&sound, "regions", at, &value.to_le_bytes());
            refused += usize::from(read(&forged).is_err());
        }
    }
    assert!(refused > 2 * length, "{refused} of {length}");
    let nothing = f64::NAN.to_le_bytes();
    // Its place, length of the name first.
    let place = 8 + 8 + "warm".len();
    assert!(matches!(
        read(&forged::in_section(&sound, "regions", place, &nothing)),
        Err(MapError::Damaged { .. })
    ));
}

#[test]
fn a_gradient_of_the_speed_of_sound_is_read_as_it_was_written_or_refused() {
    let write = |gradient: f64| {
        let mut header = hand_made::header(hand_made::EMISSIONS);
        header.scene.sound_speed_gradient = gradient;
        let geometry = header.scene.geometry().unwrap();
        let mut writer = MapWriter::begin(Cursor::new(Vec::new())).unwrap();
        for source in 0..2 {
            writer
                .push_chunk(source, 0, &hand_made::paths(&geometry, source), &hand_made::ledger(source))
                .unwrap();
        }
        (writer.finish(&header, &geometry).unwrap().into_inner(), header)
    };
    let (bytes, header) = write(-0.1);
    let map = SonelMap::from_bytes(&bytes).unwrap();
    assert_eq!(map.header().scene, header.scene);
    let even = write(0.0);
    assert_eq!(even.0, hand_made::bytes(), "even air leaves no trace");
    let names: Vec<String> = differences(&header, &even.1).into_iter().map(|found| found.what).collect();
    assert_eq!(names, ["gradient of the speed of sound [1/s]"]);
    for impossible in [f64::NAN, f64::INFINITY, 1e6] {
        assert!(matches!(SonelMap::from_bytes(&write(impossible).0), Err(MapError::Damaged { .. })));
    }
}
