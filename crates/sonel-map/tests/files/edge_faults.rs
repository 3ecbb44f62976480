//! Maps whose packets passed edges, damaged where they say so: edges that are none, places beside them, angles that cannot be.

use std::io::Cursor;

use glam::{DVec3, Vec3};
use sonel_geometry::{Geometry, MeshTriangle, Side};
use sonel_map::edges::whole_reach;
use sonel_map::{
    BandClasses, ChunkPaths, EdgePlace, EffectState, Emissions, Event, Fates, Ledger, MapError, MapHeader,
    MapWriter, PathWeight, SonelMap, Vertex,
};

use crate::{forged, hand_made};

/// Surfaces of the box and of the panel in it.
const SURFACES: u32 = 7;
/// Bytes of a chunk before its vertices, and of a vertex.
const ENDS: usize = 64;
const VERTEX: usize = 16;
/// Where in a row of the directory the chunk's offset and digest stand.
const OFFSET_AT: usize = 24;
const DIGEST_AT: usize = 32;

/// The box of other tests with a panel of 2 m × 1 m, past which packets are bent in all bands where `bends`.
fn header(bends: bool) -> MapHeader {
    let mut header = hand_made::header(2);
    let mesh = &mut header.scene.mesh;
    let first = mesh.vertices.len() as u32;
    mesh.vertices
        .extend([[2.0, 1.0, 1.0], [2.0, 3.0, 1.0], [2.0, 3.0, 2.0], [2.0, 1.0, 2.0]].map(DVec3::from_array));
    for corners in [[0, 1, 2], [0, 2, 3]] {
        mesh.triangles.push(MeshTriangle { corners: corners.map(|corner| corner + first), material: 0 });
    }
    if bends {
        let reason = "asked for".to_owned();
        let reach = whole_reach(&header.scene.wavelengths());
        header.effects.push(EffectState { reach, ..EffectState::new("bending", vec![true; 3], reason) });
    }
    header
}

fn place() -> EdgePlace {
    EdgePlace { along: 0.5, distance: 0.25, tangent: 0.125, side: Side::Front }
}

/// Two paths: bent, reflected, absorbed; passed straight on, sent on from an edge, absorbed.
fn paths(geometry: &Geometry) -> ChunkPaths {
    let wall = geometry.triangle_surface(0);
    let at = (geometry.surface(wall).centroid - geometry.center()).as_vec3();
    let on_wall = |event| Vertex::new(at, wall, Side::Front, event);
    let straight = EdgePlace { tangent: 0.0, ..place() };
    let vertices = vec![
        Vertex::at_edge(1, &place(), Event::Bent),
        on_wall(Event::Specular),
        on_wall(Event::Absorbed),
        Vertex::at_edge(2, &straight, Event::Passed),
        Vertex::on_edge(Vec3::new(0.1, 0.2, 0.3), 3),
        on_wall(Event::Absorbed),
    ];
    ChunkPaths { ends: vec![3, 6], vertices }
}

fn bytes(bends: bool) -> Vec<u8> {
    let header = header(bends);
    let geometry = header.scene.geometry().unwrap();
    let mut ledger = Ledger::new(3);
    (ledger.fates, ledger.segments) = (Fates::from_counts([2, 0, 0, 0, 0, 0]), 6);
    let mut writer = MapWriter::begin(Cursor::new(Vec::new())).unwrap();
    for source in 0..2 {
        writer.push_chunk(source, 0, &paths(&geometry), &ledger).unwrap();
    }
    writer.finish(&header, &geometry).unwrap().into_inner()
}

fn read(bytes: &[u8]) -> Result<SonelMap, MapError> {
    let map = SonelMap::from_bytes(bytes)?;
    map.check_surfaces(&map.header().scene.geometry()?)?;
    map.check_paths(SURFACES)?;
    Ok(map)
}

/// Sweeps every path of a map that was found sound.
fn touch(map: &SonelMap) -> usize {
    let classes = BandClasses::separate(map.header().scene.bands.count());
    let emissions = Emissions::of_map(map, map.header().scene.geometry().unwrap().center(), &classes);
    let table = map.coefficients(&classes);
    let mut weight = PathWeight::of(&table);
    let mut finite = 0;
    for path in map.chunk_paths((0, 0)) {
        emissions.follow(0, path, 1.0, (&table, &mut weight), |segment| {
            finite += usize::from(segment.end.is_finite() && segment.end_length.is_finite());
        });
    }
    finite
}

/// `sound` with `value` at byte `at` of vertex number `vertex` of the first chunk, its checksums made to fit.
fn with_vertex(sound: &[u8], vertex: usize, at: usize, value: [u8; 4]) -> Vec<u8> {
    let row = forged::section(sound, "chunks").range.start + OFFSET_AT;
    let chunk = u64::from_le_bytes(sound[row..row + 8].try_into().unwrap()) as usize;
    let mut forged = sound.to_vec();
    let place = chunk + ENDS + vertex * VERTEX + at;
    forged[place..place + 4].copy_from_slice(&value);
    let digest = blake3::hash(&forged[chunk..chunk + ENDS + 6 * VERTEX]);
    forged::in_section(&forged, "chunks", DIGEST_AT, digest.as_bytes())
}

/// The tag of `vertex` with another edge.
fn tag(vertex: &Vertex, edge: u32) -> [u8; 4] {
    let [.., tag]: [u32; 4] = bytemuck::cast(*vertex);
    (tag & 31 | edge << 5).to_le_bytes()
}

#[test]
fn a_map_with_edges_is_read_to_the_end() {
    let sound = bytes(true);
    assert_eq!(touch(&read(&sound).unwrap()), 6);
    // The same values once more, through the forger, change nothing.
    let [along, ..]: [u32; 4] = bytemuck::cast(Vertex::at_edge(1, &place(), Event::Bent));
    assert_eq!(with_vertex(&sound, 0, 0, along.to_le_bytes()), sound);
}

#[test]
fn edges_that_are_none_and_places_that_cannot_be_are_refused() {
    let sound = bytes(true);
    let bent = Vertex::at_edge(1, &place(), Event::Bent);
    let passed = Vertex::at_edge(2, &place(), Event::Passed);
    let number = |value: f32| value.to_le_bytes();
    let cases = [
        ("the first edge that is none", 0, 12, tag(&bent, 4)),
        ("an edge far beyond", 0, 12, tag(&bent, (1 << 27) - 1)),
        ("the same passed straight on", 3, 12, tag(&passed, 4)),
        ("before its first end", 0, 0, number(-0.01)),
        ("behind its last end", 0, 0, number(2.5)),
        ("nowhere on it", 0, 0, number(f32::NAN)),
        ("on the edge itself", 0, 4, number(0.0)),
        ("at a negative distance", 0, 4, number(-1.0)),
        ("endlessly far from it", 0, 4, number(f32::INFINITY)),
        ("an angle that is none", 0, 8, number(f32::NAN)),
        ("an endless tangent", 0, 8, number(f32::NEG_INFINITY)),
        ("an angle of what goes straight on", 3, 8, number(0.5)),
    ];
    for (name, vertex, at, value) in cases {
        let error = read(&with_vertex(&sound, vertex, at, value)).expect_err(name);
        assert!(matches!(error, MapError::Damaged { .. }), "{name}: {error}");
        assert!(error.to_string().contains("a path breaks the rules of the format"), "{name}: {error}");
    }
    // A steep angle is none of these.
    assert_eq!(touch(&read(&with_vertex(&sound, 0, 8, number(-1e20))).unwrap()), 6);
}

#[test]
fn edges_that_cannot_be_and_edges_of_another_scene_are_refused() {
    let sound = bytes(true);
    let row = |at: usize, value: f64| forged::in_section(&sound, "edges", at, &value.to_le_bytes());
    for value in [f64::NAN, f64::INFINITY] {
        assert!(matches!(read(&row(48, value)), Err(MapError::Damaged { .. })), "{value}");
    }
    let first = forged::section(&sound, "edges").range.start;
    let start: [u8; 24] = sound[first..first + 24].try_into().unwrap();
    let without_length = forged::in_section(&sound, "edges", 24, &start);
    assert!(matches!(read(&without_length), Err(MapError::Damaged { .. })));
    assert!(matches!(read(&row(0, 1.5)), Err(MapError::ForeignSurfaces { .. })));
}

#[test]
fn maps_from_before_edges_had_faces_are_told_from_damaged_ones() {
    let sound = bytes(true);
    let stated_at = forged::section(&sound, "edges.faces").stated_at;
    let renamed = forged::in_header(&sound, stated_at - 1, b"?");
    let error = read(&renamed).expect_err("no faces");
    assert!(
        error.to_string().contains("earlier version") && error.to_string().contains("trace it again"),
        "{error}"
    );
    let faces = |value: f64| forged::in_section(&sound, "edges.faces", 0, &value.to_le_bytes());
    assert!(matches!(read(&faces(f64::NAN)), Err(MapError::Damaged { .. })));
}

#[test]
fn sections_of_edges_that_are_cut_off_or_missing_are_refused() {
    let sound = bytes(true);
    let stated_at = forged::section(&sound, "edges").stated_at;
    for length in [0, 1, 47, 48, 144, 193, u64::MAX] {
        let error = read(&forged::in_header(&sound, stated_at + 8, &length.to_le_bytes()))
            .expect_err("another length");
        assert!(matches!(error, MapError::Damaged { .. } | MapError::Truncated { .. }), "{length}: {error}");
    }
    let renamed = forged::in_header(&sound, stated_at - 1, b"?");
    assert!(read(&renamed).is_err());
    // Packets that were bent where the map says that none is.
    assert!(matches!(read(&bytes(false)), Err(MapError::Damaged { .. })));
    let on = sound.windows(7).rposition(|name| name == b"bending").unwrap();
    let states = on + 7 + 8;
    assert_eq!(sound[states..states + 3], [1; 3], "the states of the bands");
    let error = read(&forged::in_header(&sound, states, &[0; 3])).expect_err("edges without bending");
    assert!(error.to_string().contains("no band is bent"), "{error}");
}

#[test]
fn a_reach_that_contradicts_the_effect_is_refused() {
    let sound = bytes(true);
    let row =
        |band: usize, value: f64| forged::in_section(&sound, "edges.reach", 8 * band, &value.to_le_bytes());
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = read(&row(1, value)).expect_err("no reach");
        assert!(error.to_string().contains("within a reach"), "{value}: {error}");
    }
    assert_eq!(touch(&read(&row(1, 0.3)).unwrap()), 6);
    let stated_at = forged::section(&sound, "edges.reach").stated_at;
    for length in [0_u64, 8, 16, 32] {
        assert!(read(&forged::in_header(&sound, stated_at + 8, &length.to_le_bytes())).is_err(), "{length}");
    }
}

#[test]
fn no_number_in_edges_or_at_them_makes_the_reader_panic() {
    let sound = bytes(true);
    for at in (0..forged::section(&sound, "edges").range.len() - 8).step_by(4) {
        for value in forged::ABSURD {
            if let Ok(map) = read(&forged::in_section(&sound, "edges", at, &value.to_le_bytes())) {
                touch(&map);
            }
        }
    }
    for vertex in 0..6 {
        for at in [0, 4, 8, 12] {
            for value in [0, 1, 31, 32, 1 << 30, 0x7f7f_ffff, 0x7f80_0000, u32::MAX] {
                if let Ok(map) = read(&with_vertex(&sound, vertex, at, value.to_le_bytes())) {
                    touch(&map);
                }
            }
        }
    }
}

#[test]
fn every_flipped_bit_of_a_map_with_edges_is_found() {
    let mut bytes = bytes(true);
    let edges = forged::section(&bytes, "edges").range;
    for bit in edges.start * 8..edges.end * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(SonelMap::from_bytes(&bytes).is_err(), "byte {}, bit {}", bit / 8, bit % 8);
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}
