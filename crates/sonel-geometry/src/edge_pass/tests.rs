//! Passages in rooms with screens, and against the definition in rooms of chance.

use super::*;
use crate::{Mesh, MeshTriangle};
use glam::dvec3;
use std::f64::consts::TAU;

/// A box of 20 m × 10 m × 6 m with a screen across its middle, 3 m high and 4 m wide, that stands on the floor.
fn screened() -> Geometry {
    let mut mesh = Mesh::shoebox([20.0, 10.0, 6.0], [0; 6]);
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend([
        dvec3(10.0, 3.0, 0.0),
        dvec3(10.0, 7.0, 0.0),
        dvec3(10.0, 7.0, 3.0),
        dvec3(10.0, 3.0, 3.0),
    ]);
    for corners in [[0, 1, 2], [0, 2, 3]] {
        let corners = corners.map(|corner| first + corner);
        mesh.triangles.push(MeshTriangle { corners, material: 0 });
    }
    Geometry::build(mesh).unwrap()
}

/// Every edge, at any distance.
#[allow(clippy::unnecessary_wraps, reason = "an index asks for it so")]
fn any(_: &Edge, _: &EdgeFaces) -> Option<f64> {
    Some(f64::INFINITY)
}

/// Edges of three limits, by their length.
#[allow(clippy::unnecessary_wraps, reason = "an index asks for it so")]
fn limited(edge: &Edge, _: &EdgeFaces) -> Option<f64> {
    Some([0.4, 2.0, 8.0][(100.0 * edge.length()) as usize % 3])
}

type Limit = fn(&Edge, &EdgeFaces) -> Option<f64>;

fn first(geometry: &Geometry, from: DVec3, to: DVec3, reach: f64) -> Option<EdgePass> {
    let index = EdgeIndex::new(geometry, any);
    let local = |point: DVec3| point - geometry.center();
    index.first(geometry, &Way::between(local(from), local(to), reach), |_, _| true)
}

/// Starts beside the screen, ever nearer to being abreast of its top.
#[test]
fn a_foot_is_found_again_from_a_distance_in_f32() {
    let geometry = screened();
    let index = EdgeIndex::new(&geometry, any);
    let mut passed = 0;
    for step in 0..400 {
        let before = libm::pow(10.0, -f64::from(step) / 80.0);
        let origin = dvec3(10.0 - before, 5.0, 3.3 + 0.002 * f64::from(step)) - geometry.center();
        let direction = dvec3(1.0, 0.01, 0.0).normalize();
        let way = Way { origin, direction, from: 0.0, to: 5.0, reach: 3.0 };
        let Some(edge_pass) = index.first(&geometry, &way, |_, _| true) else { continue };
        passed += 1;
        let line = index.lines()[edge_pass.edge as usize];
        let found =
            line.closest(origin, edge_pass.along, f64::from(edge_pass.distance as f32), edge_pass.side);
        let error = found.distance(origin + edge_pass.at * direction);
        assert!(error < 0.03 * edge_pass.at, "{error:e} of {:e}", edge_pass.at);
    }
    assert!((150..350).contains(&passed), "{passed} passages, and ways that start abreast");
}

#[test]
fn a_way_over_a_screen_passes_its_top() {
    let geometry = screened();
    let edge_pass = first(&geometry, dvec3(1.0, 4.0, 4.0), dvec3(19.0, 6.0, 4.0), 2.0).unwrap();
    assert!((edge_pass.distance - 1.0).abs() < 1e-9);
    assert!((edge_pass.at - 0.5 * dvec3(18.0, 2.0, 0.0).length()).abs() < 1e-9);
    let back = first(&geometry, dvec3(19.0, 6.0, 4.0), dvec3(1.0, 4.0, 4.0), 2.0).unwrap();
    assert_ne!(edge_pass.side, back.side);
    assert!(first(&geometry, dvec3(1.0, 4.0, 4.0), dvec3(19.0, 6.0, 4.0), 0.99).is_none(), "out of reach");
    assert!(
        first(&geometry, dvec3(1.0, 4.0, 4.0), dvec3(9.0, 5.0, 4.0), 2.0).is_none(),
        "ends before the edge"
    );
}

#[test]
fn only_the_nearest_edge_in_sight_is_passed() {
    let geometry = screened();
    // Beside the screen at half its height: its side is 0.5 m away, the end of its top edge farther.
    let edge_pass = first(&geometry, dvec3(1.0, 2.5, 1.5), dvec3(19.0, 2.5, 1.5), 5.0).unwrap();
    assert!((edge_pass.distance - 0.5).abs() < 1e-9);
    // Down along the face of the screen, 2 m before it: the top is passed at its height, whatever is behind the sheet.
    let edge_pass = first(&geometry, dvec3(8.0, 5.0, 5.0), dvec3(8.0, 5.0, 0.5), 5.0).unwrap();
    assert!((edge_pass.distance - 2.0).abs() < 1e-9);
}

#[test]
fn edges_behind_walls_are_not_passed() {
    let geometry = screened();
    // Outside of the room, above its ceiling.
    assert!(first(&geometry, dvec3(1.0, 5.0, 7.0), dvec3(19.0, 5.0, 7.0), 9.0).is_none());
}

/// Numbers of chance in 0 … 1, the same ones in every run.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A point of the box from the origin to `size`, `margin` off its walls.
    fn point(&mut self, size: DVec3, margin: f64) -> DVec3 {
        let share = dvec3(self.next(), self.next(), self.next());
        DVec3::splat(margin) + share * (size - 2.0 * margin)
    }
}

const ROOM: DVec3 = dvec3(14.0, 10.0, 5.0);

/// A room with slanting sheets and boxes of chance, some of which pierce each other.
fn furnished(chance: &mut Chance, sheets: usize, boxes: usize) -> Geometry {
    let mut mesh = Mesh::shoebox(ROOM.to_array(), [0; 6]);
    let mut add = |vertices: &[DVec3], triangles: &[[u32; 3]]| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(vertices);
        mesh.triangles.extend(
            triangles
                .iter()
                .map(|corners| MeshTriangle { corners: corners.map(|corner| first + corner), material: 0 }),
        );
    };
    for _ in 0..sheets {
        let at = chance.point(ROOM, 2.0);
        let (u, v) = (chance.point(DVec3::splat(3.0), 0.0) - 1.5, chance.point(DVec3::splat(3.0), 0.0) - 1.5);
        add(&[at, at + 0.6 * u, at + 0.6 * (u + v), at + 0.6 * v], &[[0, 1, 2], [0, 2, 3]]);
    }
    for _ in 0..boxes {
        let (at, size) = (chance.point(ROOM, 1.5), chance.point(DVec3::splat(1.2), 0.1));
        let solid = Mesh::shoebox(size.to_array(), [0; 6]);
        let vertices: Vec<DVec3> = solid.vertices.iter().map(|&vertex| at + vertex).collect();
        let triangles: Vec<[u32; 3]> = solid.triangles.iter().map(|triangle| triangle.corners).collect();
        add(&vertices, &triangles);
    }
    Geometry::build(mesh).unwrap()
}

/// What a way passes first, by the words of the definition: every edge is asked, and whether it is in sight.
fn by_definition(geometry: &Geometry, index: &EdgeIndex, way: &Way) -> Option<(u32, f64)> {
    let sectors: Vec<_> = geometry.diffracting_edges().map(|edge| edge.sectors.clone()).collect();
    let sees = |from: DVec3, edge: usize, along: f64| {
        let point = index.lines[edge].point(along);
        let offset = from - point;
        let turn = |sector: &crate::AirSector| {
            libm::atan2(offset.dot(sector.normal), offset.dot(sector.inward)).rem_euclid(TAU)
        };
        sectors[edge].iter().any(|sector| sector.angle >= TAU || turn(sector) <= sector.angle)
            && !geometry.is_blocked(Departure::free(from.as_vec3()), point.as_vec3())
    };
    let mut feet: Vec<(f64, usize, f64, f64)> = Vec::new();
    for (edge, line) in index.lines.iter().enumerate() {
        let Some((at, along, squared)) = line.nearest(way.origin, way.direction) else { continue };
        let distance = squared.sqrt();
        let within = at > way.from && at < way.to && along > 0.0 && along < line.length;
        let reach = way.reach.min(index.limits[edge]);
        if within && distance >= index.least && distance <= reach && at >= 2e-3 * distance {
            feet.push((at, edge, along, distance));
        }
    }
    feet.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let stands = |&&(at, edge, along, distance): &&(f64, usize, f64, f64)| {
        let closest = way.origin + at * way.direction;
        let is_nearer = |other: usize| {
            let (squared, along) = index.lines[other].distance_squared(closest);
            let hides = index.limits[other] >= index.limits[edge];
            other != edge && hides && squared < distance * distance && sees(closest, other, along)
        };
        sees(closest, edge, along) && !(0..index.lines.len()).any(is_nearer)
    };
    feet.iter().find(stands).map(|&(at, edge, ..)| (edge as u32, at))
}

#[test]
fn what_is_found_is_what_the_definition_says() {
    let mut chance = Chance(7);
    let (mut ways, mut passed, mut hidden) = (0, 0, 0);
    for (sheets, boxes, limit) in
        [(1, 0, any as Limit), (2, 1, limited), (6, 3, any), (20, 12, limited), (60, 30, any)]
    {
        let geometry = furnished(&mut chance, sheets, boxes);
        let index = EdgeIndex::new(&geometry, limit);
        assert!(index.lines.len() >= 4 * sheets);
        for number in 0..400 {
            let [from, to] =
                [chance.point(ROOM, 0.1), chance.point(ROOM, 0.1)].map(|p| p - geometry.center());
            let way =
                Way { from: chance.next(), ..Way::between(from, to, [0.2, 1.0, 4.0, 20.0][number % 4]) };
            let found =
                index.first(&geometry, &way, |_, _| true).map(|edge_pass| (edge_pass.edge, edge_pass.at));
            assert_eq!(found, by_definition(&geometry, &index, &way), "{way:?}");
            ways += 1;
            passed += usize::from(found.is_some());
            // Of all that come near, others than the first are passed: the rays matter.
            let mut feet = search::Feet::new(&index, &way, |_, _| true, (way.from, u32::MAX));
            for group in &index.groups {
                feet.limit_to(group.limit);
                group.hierarchy.search(&mut feet);
            }
            let nearest = feet.few.found().first().map(|near| (near.edge, near.order));
            hidden += usize::from(nearest != found);
        }
    }
    assert!(passed > ways / 4 && passed < 3 * ways / 4 && hidden > ways / 4, "{passed} {hidden} of {ways}");
}

#[test]
fn edges_that_do_not_count_are_passed_by_none() {
    let geometry = furnished(&mut Chance(3), 8, 4);
    let index = EdgeIndex::new(&geometry, any);
    let mut chance = Chance(11);
    let mut passed = 0;
    for _ in 0..200 {
        let [from, to] = [chance.point(ROOM, 0.1), chance.point(ROOM, 0.1)].map(|p| p - geometry.center());
        let way = Way::between(from, to, 5.0);
        let Some(first) = index.first(&geometry, &way, |_, _| true) else { continue };
        passed += 1;
        let other = index.first(&geometry, &way, |edge, _| edge != first.edge);
        let behind = index.first(&geometry, &Way { from: first.at, ..way }, |edge, _| edge != first.edge);
        assert_eq!(other, behind);
    }
    assert!(passed > 50);
}

/// Edges that a way comes near, by the words of the definition: places on it are asked one after another.
#[test]
fn what_is_passed_anywhere_on_a_way_is_near_there() {
    let mut chance = Chance(13);
    let (mut asked, mut near, mut hidden) = (0, 0, 0);
    for (sheets, boxes, limit) in [(1, 0, any as Limit), (6, 3, limited), (20, 12, any)] {
        let geometry = furnished(&mut chance, sheets, boxes);
        let index = EdgeIndex::new(&geometry, limit);
        for number in 0..60 {
            let [from, to] =
                [chance.point(ROOM, 0.1), chance.point(ROOM, 0.1)].map(|p| p - geometry.center());
            let way = Way::between(from, to, [0.2, 1.0, 4.0][number % 3]);
            let mut nearby = Vec::new();
            index.nearby(&way, |found| nearby.push(found));
            for step in 0..40 {
                let at = way.to * (f64::from(step) + chance.next()) / 40.0;
                let place = way.origin + at * way.direction;
                for (edge, line) in index.lines.iter().enumerate() {
                    let along = (place - line.origin).dot(line.along);
                    let distance = place.distance(line.point(along));
                    let reach = way.reach.min(index.limits[edge]);
                    let is_near = along > 0.0 && along < line.length && distance <= reach;
                    let holds = |found: &Nearby| {
                        found.edge == edge as u32 && found.part[0] <= at && at <= found.part[1]
                    };
                    assert_eq!(nearby.iter().any(holds), is_near, "edge {edge} at {at} of {way:?}");
                    near += usize::from(is_near);
                }
                let nearest = index.nearest(&geometry, place, way.reach);
                assert_eq!(nearest, nearest_by_definition(&geometry, &index, place, way.reach));
                asked += 1;
                let of_all = |a: &usize, b: &usize| {
                    let squared = |edge: usize| index.lines[edge].distance_squared(place).0;
                    squared(*a).total_cmp(&squared(*b))
                };
                let of_all = (0..index.lines.len()).min_by(of_all).unwrap();
                hidden += usize::from(nearest.first().is_some_and(|(edge, _)| *edge != of_all as u32));
            }
        }
    }
    assert!(near > asked && hidden > 0, "{near} {hidden} of {asked}");
}

fn nearest_by_definition(
    geometry: &Geometry,
    index: &EdgeIndex,
    place: DVec3,
    reach: f64,
) -> Vec<(u32, f64)> {
    let near = |edge: usize| {
        let (squared, along) = index.lines[edge].distance_squared(place);
        let is_seen =
            index.air_holds(place, edge as u32, along) && index.is_clear(geometry, place, edge as u32, along);
        (squared < reach * reach && is_seen).then_some((squared, edge, along))
    };
    let mut all: Vec<_> = (0..index.lines.len()).filter_map(near).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let is_hidden = |&(squared, edge, _): &(f64, usize, f64)| {
        all.iter()
            .any(|other| (other.0, other.1) < (squared, edge) && index.limits[other.1] >= index.limits[edge])
    };
    let passed = all.iter().filter(|near| near.0.sqrt() <= index.limits[near.1] && !is_hidden(near));
    passed.map(|&(_, edge, along)| (edge as u32, along)).collect()
}

/// A plate of two materials, 3 m × 2 m, with a step of 0.3 m below one side.
#[test]
fn faces_are_measured_across_materials_and_plates_seen_edge_on_have_no_size() {
    let mut mesh = Mesh::default();
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [3.0, 0.0, 0.0],
        [3.0, 2.0, 0.0],
        [1.0, 2.0, 0.0],
        [0.0, 2.0, 0.0],
    ];
    mesh.vertices.extend(corners.map(DVec3::from_array));
    mesh.vertices.extend([dvec3(0.0, 0.0, -0.3), dvec3(0.0, 2.0, -0.3)]);
    for (quad, material) in [([0, 1, 4, 5], 0), ([1, 2, 3, 4], 1), ([0, 5, 7, 6], 1)] {
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let corners = corners.map(|corner: usize| quad[corner]);
            mesh.triangles.push(MeshTriangle { corners, material });
        }
    }
    let geometry = Geometry::build(mesh).unwrap();
    let index = EdgeIndex::new(&geometry, any);
    let at = |x: f64, y: f64, z: f64| {
        let place = dvec3(x, y, z) - geometry.center();
        let is_there = |line: &EdgeLine| line.distance_squared(place).0 < 1e-12;
        index.faces()[index.lines().iter().position(is_there).unwrap()]
    };
    let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    let rim = at(3.0, 1.0, 0.0);
    close(rim.size(), 2.0);
    close(rim.size_seen(DVec3::X), 0.0);
    close(rim.size_seen(DVec3::Z), 2.0);
    close(rim.size_seen(dvec3(0.8, 0.0, 0.6)), 1.8);
    let step = at(0.0, 1.0, 0.0);
    close(step.size(), 2.0);
    close(step.size_seen(DVec3::X), 0.3);
    close(at(0.0, 1.0, -0.3).size(), 0.3);
    assert_eq!(EdgeFaces::from_rows(step.rows()), step);
}
