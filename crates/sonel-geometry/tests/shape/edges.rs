//! Edges: whole, of the right kind, with the right angle.

use crate::rooms;
use glam::{DVec3, dvec3};
use sonel_geometry::{Edge, EdgeShape, Geometry};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn of_shape(geometry: &Geometry, shape: EdgeShape) -> Vec<&Edge> {
    geometry.edges().iter().filter(|edge| edge.shape == shape).collect()
}

#[test]
fn a_box_has_twelve_concave_edges_however_tessellated() {
    for mesh in [
        rooms::shoebox(),
        rooms::turned(rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 16), dvec3(1e5, 0.0, 0.0)),
    ] {
        let geometry = Geometry::build(mesh).unwrap();
        assert_eq!(geometry.edges().len(), 12);
        let concave = of_shape(&geometry, EdgeShape::Concave);
        assert!(concave.len() == 12 && concave.iter().all(|e| (e.wedge_angle - FRAC_PI_2).abs() < 1e-6));
        let total: f64 = concave.iter().map(|edge| edge.length()).sum();
        assert!((total - 80.0).abs() < 1e-6);
        assert!(concave.iter().all(|edge| edge.surfaces.len() == 2));
    }
}

#[test]
fn an_l_shaped_room_has_one_convex_edge() {
    let geometry = Geometry::build(rooms::turned(rooms::l_room(), DVec3::ZERO)).unwrap();
    let convex = of_shape(&geometry, EdgeShape::Convex);
    assert_eq!((convex.len(), geometry.edges().len()), (1, 18));
    assert!((convex[0].wedge_angle - 1.5 * PI).abs() < 1e-9);
    assert!((convex[0].length() - 3.0).abs() < 1e-9);
}

#[test]
fn a_needle_of_a_room_has_a_needle_of_an_angle() {
    let geometry = Geometry::build(rooms::wedge_room(5.0)).unwrap();
    let sharpest = geometry.edges().iter().map(|edge| edge.wedge_angle).fold(TAU, f64::min);
    assert!((sharpest - 5f64.to_radians()).abs() < 1e-9);
}

#[test]
fn a_screen_is_free_but_for_its_foot() {
    for mesh in [rooms::screened_room(), rooms::turned(rooms::screened_room(), dvec3(0.0, 1e4, 0.0))] {
        let geometry = Geometry::build(mesh).unwrap();
        let free = of_shape(&geometry, EdgeShape::Free);
        assert!(free.len() == 3 && free.iter().all(|edge| (edge.wedge_angle - TAU).abs() < 1e-12));
        let length: f64 = free.iter().map(|edge| edge.length()).sum();
        assert!((length - 7.0).abs() < 1e-9);
        let foot = of_shape(&geometry, EdgeShape::Junction);
        assert!(foot.len() == 1 && (foot[0].length() - 3.0).abs() < 1e-9);
    }
}

#[test]
fn a_change_of_material_is_a_seam_and_a_welded_foot_a_junction() {
    let mut mesh = rooms::tessellated_box(dvec3(4.0, 4.0, 2.0), 4);
    for triangle in mesh.triangles.iter_mut().filter(|t| t.material == 4).take(16) {
        triangle.material = 10;
    }
    let foot = [dvec3(1.0, 1.0, 0.0), dvec3(1.0, 2.0, 0.0)];
    rooms::add_quad(&mut mesh, 9, [foot[0], foot[1], foot[1] + DVec3::Z, foot[0] + DVec3::Z]);
    let geometry = Geometry::build(mesh).unwrap();
    let seams = of_shape(&geometry, EdgeShape::Seam);
    assert!(seams.len() == 1 && (seams[0].length() - 4.0).abs() < 1e-12);
    let junctions = of_shape(&geometry, EdgeShape::Junction);
    assert!(junctions.len() == 1 && (junctions[0].length() - 1.0).abs() < 1e-12);
}

#[test]
fn a_pillar_has_free_sides_and_a_foot_and_head_at_junctions() {
    let mut mesh = rooms::shoebox();
    let pillar = sonel_geometry::Mesh::shoebox([0.5, 0.6, 3.0], [7; 6]);
    for triangle in &pillar.triangles {
        let corners = triangle.corners.map(|c| pillar.vertices[c as usize] + dvec3(4.0, 2.0, 0.0));
        rooms::add(&mut mesh, 7, &[corners]);
    }
    for mesh in [mesh.clone(), rooms::turned(mesh, dvec3(0.0, 1e4, 0.0))] {
        let geometry = Geometry::build(mesh).unwrap();
        let convex = of_shape(&geometry, EdgeShape::Convex);
        assert!(convex.len() == 4 && convex.iter().all(|edge| (edge.length() - 3.0).abs() < 1e-9));
        assert!(convex.iter().all(|edge| (edge.wedge_angle - 1.5 * PI).abs() < 1e-9));
        assert_eq!(of_shape(&geometry, EdgeShape::Junction).len(), 8);
        assert_eq!(of_shape(&geometry, EdgeShape::Concave).len(), 12);
    }
}

/// Ends and angles of the edges that diffract, in one order.
fn diffracting(mesh: sonel_geometry::Mesh) -> Vec<([i64; 6], i64)> {
    let geometry = Geometry::build(mesh).unwrap();
    let micro = |x: f64| (x * 1e6).round() as i64;
    let of = |edge: &Edge| {
        let mut ends = edge.ends.map(|end| end.to_array().map(micro));
        ends.sort_unstable();
        let [[a, b, c], [d, e, f]] = ends;
        edge.sectors.iter().map(|sector| ([a, b, c, d, e, f], micro(sector.angle))).collect::<Vec<_>>()
    };
    let mut found: Vec<_> = geometry.diffracting_edges().flat_map(of).collect();
    found.sort_unstable();
    found
}

/// A room of 6 m × 5 m × 3 m less a box, whose walls are the faces between cells of air and of none.
fn room_without(low: DVec3, high: DVec3) -> sonel_geometry::Mesh {
    let cuts: [Vec<f64>; 3] = std::array::from_fn(|axis| {
        let mut cuts = vec![0.0, low[axis], high[axis], SIZE[axis]];
        cuts.dedup();
        cuts
    });
    let is_air = |place: DVec3| {
        let within = |low: DVec3, high: DVec3| place.cmpgt(low).all() && place.cmplt(high).all();
        within(DVec3::ZERO, SIZE) && !within(low, high)
    };
    let mut mesh = sonel_geometry::Mesh::default();
    let cells = |axis: usize| cuts[axis].windows(2).map(|cell| [cell[0], cell[1]]);
    for cell in cells(0).flat_map(|x| cells(1).flat_map(move |y| cells(2).map(move |z| [x, y, z]))) {
        let at = |shares: [f64; 3]| {
            DVec3::from_array(std::array::from_fn(|axis| {
                cell[axis][0] + shares[axis] * (cell[axis][1] - cell[axis][0])
            }))
        };
        let sides = (0..3).flat_map(|axis| [(axis, 0.0), (axis, 1.0)]);
        for (axis, side) in sides.filter(|_| is_air(at([0.5; 3]))) {
            let on = |u: f64, v: f64, depth: f64| {
                let mut shares = [depth; 3];
                (shares[(axis + 1) % 3], shares[(axis + 2) % 3]) = (u, v);
                at(shares)
            };
            if !is_air(on(0.5, 0.5, 3.0 * side - 1.0) * 1e-2 + on(0.5, 0.5, side) * 0.99) {
                rooms::add_quad(
                    &mut mesh,
                    0,
                    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| on(u, v, side)),
                );
            }
        }
    }
    mesh
}

const SIZE: DVec3 = dvec3(6.0, 5.0, 3.0);

/// In a corner, at a wall, between two walls, at a wall above the floor; with a whole edge of the hull: at an end wall from wall to wall
/// on the floor and below the ceiling, over the whole floor.
#[test]
fn a_solid_drawn_flush_into_a_hull_has_the_edges_of_one_mesh() {
    let cases = [
        ([0.0, 0.0, 0.0], [1.0, 0.8, 1.2], 3),
        ([2.0, 0.0, 0.0], [3.5, 0.7, 0.9], 5),
        ([0.0, 2.0, 0.0], [6.0, 2.6, 0.9], 2),
        ([2.0, 0.0, 0.5], [3.5, 0.7, 0.9], 8),
        ([4.0, 0.0, 0.0], [6.0, 5.0, 0.9], 1),
        ([5.0, 0.0, 2.5], [6.0, 5.0, 3.0], 1),
        ([0.0, 0.0, 0.0], [6.0, 5.0, 0.2], 0),
    ];
    for (low, high, count) in cases {
        let (low, high) = (DVec3::from_array(low), DVec3::from_array(high));
        let mut flush = sonel_geometry::Mesh::shoebox(SIZE.to_array(), [0; 6]);
        let solid = sonel_geometry::Mesh::shoebox((high - low).to_array(), [0; 6]);
        for triangle in &solid.triangles {
            rooms::add(
                &mut flush,
                1,
                &[triangle.corners.map(|corner| solid.vertices[corner as usize] + low)],
            );
        }
        let turned = diffracting(rooms::turned(flush.clone(), dvec3(0.0, 1e3, 0.0)));
        assert_eq!(turned.len(), count, "{low} {high}, turned");
        let [drawn, cut] =
            [flush.clone(), room_without(low, high)].map(|mesh| Geometry::build(mesh).unwrap());
        assert!((drawn.volume().unwrap() - cut.volume().unwrap()).abs() < 1e-9, "{low} {high}");
        assert!((drawn.area() - cut.area()).abs() < 1e-9, "{low} {high}: {} {}", drawn.area(), cut.area());
        assert!(!drawn.contains(0.5 * (low + high)));
        let found = diffracting(flush);
        assert_eq!(found, diffracting(room_without(low, high)), "{low} {high}");
        assert_eq!(found.len(), count, "{low} {high}");
    }
}

fn sectors(geometry: &Geometry) -> Vec<(f64, f64)> {
    let of = |edge: &Edge| edge.sectors.iter().map(|s| (edge.length(), s.angle)).collect::<Vec<_>>();
    geometry.diffracting_edges().flat_map(of).collect()
}

#[test]
fn only_free_and_convex_edges_diffract() {
    let count = |mesh| sectors(&Geometry::build(mesh).unwrap()).len();
    assert_eq!(count(rooms::shoebox()), 0);
    assert_eq!(count(rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 5)), 0);
    assert_eq!(count(rooms::l_room()), 1);
    assert_eq!(count(rooms::screened_room()), 3);
}

#[test]
fn a_sector_begins_at_its_first_face_and_opens_into_the_air() {
    let geometry = Geometry::build(rooms::l_room()).unwrap();
    let edge = geometry.diffracting_edges().next().unwrap();
    let sector = edge.sectors[0];
    assert!((sector.angle - 1.5 * PI).abs() < 1e-9);
    let middle = 0.5 * (edge.ends[0] + edge.ends[1]);
    for degrees in [5.0f64, 135.0, 265.0] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        assert!(geometry.contains(middle + 0.5 * (cosine * sector.inward + sine * sector.normal)));
    }
    let normals = sector.faces.map(|(surface, side)| side.sign() * geometry.surface(surface).normal);
    assert!((normals[0] - sector.normal).length() < 1e-9 && normals[1].dot(sector.normal).abs() < 1e-9);
}

/// A folded sheet in free air diffracts where it is convex: behind, if its front is the hollow.
#[test]
fn a_folded_sheet_diffracts_on_its_outside() {
    let mut mesh = sonel_geometry::Mesh::default();
    rooms::add_quad(&mut mesh, 0, [DVec3::ZERO, DVec3::X, dvec3(1.0, 0.0, 2.0), DVec3::Z * 2.0]);
    rooms::add_quad(&mut mesh, 1, [DVec3::ZERO, DVec3::Z * 2.0, dvec3(0.0, 1.0, 2.0), DVec3::Y]);
    let mut found = sectors(&Geometry::build(mesh).unwrap());
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    assert_eq!(found.len(), 7);
    assert!((found[0].1 - 1.5 * PI).abs() < 1e-9 && (found[0].0 - 2.0).abs() < 1e-9);
    assert!(found[1..].iter().all(|(_, angle)| (angle - TAU).abs() < 1e-9));
}

/// A screen of two materials, one with a vertex more in its rim, stands beside another that touches it at a corner.
#[test]
fn collinear_pieces_are_joined_across_materials_and_t_junctions() {
    let mut mesh = sonel_geometry::Mesh::default();
    let quad = |mesh: &mut _, material, x: [f64; 2], z: [f64; 2]| {
        let at = |x, z| dvec3(x, 0.0, z);
        rooms::add_quad(mesh, material, [at(x[0], z[0]), at(x[1], z[0]), at(x[1], z[1]), at(x[0], z[1])]);
    };
    quad(&mut mesh, 0, [0.0, 1.0], [0.0, 1.0]);
    quad(&mut mesh, 1, [1.0, 2.0], [0.0, 0.5]);
    quad(&mut mesh, 1, [1.0, 2.0], [0.5, 1.0]);
    let found = sectors(&Geometry::build(mesh.clone()).unwrap());
    let lengths: Vec<f64> = found.iter().map(|(length, _)| *length).collect();
    assert_eq!(lengths.iter().filter(|length| (**length - 2.0).abs() < 1e-9).count(), 2, "{lengths:?}");
    assert_eq!(lengths.len(), 4);
    // Above the corner (2, 1), to the right of the first screen: their rims are on one line but on opposite sides.
    quad(&mut mesh, 0, [2.0, 3.0], [1.0, 2.0]);
    assert_eq!(sectors(&Geometry::build(mesh).unwrap()).len(), 8);
}
