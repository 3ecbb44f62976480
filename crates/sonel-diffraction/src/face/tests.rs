//! Two edges of a panel and of a box against boundary elements, in their planes, and exchanged.

use super::*;
use glam::{DVec3, dvec3};
use sonel_testkit::analytic::rigid_sheet::RigidSheet;
use std::f64::consts::{PI, TAU};

const SIDES: [[f64; 2]; 2] = [[-1.0, 1.5], [-0.8, 1.2]];
const K: f64 = 3.0;

fn rims() -> [Wedge; 4] {
    let [y, z] = SIDES;
    let at = |i: usize, j: usize| dvec3(0.0, y[i], z[j]);
    let rim = |ends, inward| Wedge::new(ends, inward, -DVec3::X, TAU).unwrap();
    [
        rim([at(0, 0), at(1, 0)], DVec3::Z),
        rim([at(1, 0), at(1, 1)], -DVec3::Y),
        rim([at(1, 1), at(0, 1)], -DVec3::Z),
        rim([at(0, 1), at(0, 0)], DVec3::Y),
    ]
}

fn path(first: &Wedge, second: &Wedge, source: DVec3, receiver: DVec3) -> FacePath {
    let rim = |wedge| {
        let ends = [source, receiver].map(|point| Wedge::locate(wedge, point));
        let alone = ends.map(|end| end.unwrap().angle < PI);
        FaceEdge { wedge, ends, alone, at_second: false, part: [0.0, wedge.length()] }
    };
    FacePath::new(rim(first), rim(second), 1e-9, K).unwrap()
}

fn field(path: &FacePath) -> Complex {
    let both = path.ways().iter().flat_map(|way| way.amplitudes(K, path.length()));
    both.fold(Complex::ZERO, |sum, term| sum + term) * Complex::unit(-K * path.length())
}

fn free(from: DVec3, to: DVec3) -> Complex {
    Complex::unit(-K * from.distance(to)) * (1.0 / from.distance(to))
}

/// Everything over one rim, and everything over two.
fn orders(source: DVec3, receiver: DVec3) -> [Complex; 2] {
    let mirrored = source * dvec3(-1.0, 1.0, 1.0);
    let meets = |from: DVec3| {
        let place = from.lerp(receiver, from.x / (from.x - receiver.x));
        let within = |[low, high]: [f64; 2], at: f64| low < at && at < high;
        from.x * receiver.x < 0.0 && within(SIDES[0], place.y) && within(SIDES[1], place.z)
    };
    let lit = [(source, !meets(source)), (mirrored, meets(mirrored))].into_iter().filter(|(_, lit)| *lit);
    let mut orders = [lit.fold(Complex::ZERO, |sum, (from, _)| sum + free(from, receiver)), Complex::ZERO];
    for (i, first) in rims().iter().enumerate() {
        let ends = [source, receiver].map(|point| first.locate(point).unwrap());
        let over = EdgePath::new(first, ends[0], ends[1], [0.0, first.length()], Lit::default(), K);
        orders[0] = over.field(K).into_iter().fold(orders[0], |sum, term| sum + term);
        for (_, second) in rims().iter().enumerate().filter(|(j, _)| *j != i) {
            orders[1] += field(&path(first, second, source, receiver));
        }
    }
    orders
}

const SOURCE: DVec3 = dvec3(-3.0, 0.2, 0.4);

/// Against boundary elements, which know of no edge: in shadow, before the panel, beside it and far beside its plane. One order
/// alone is two to six times as far off.
#[test]
fn two_orders_are_what_boundary_elements_say() {
    let exact = RigidSheet { sides: SIDES, elements: [16, 14] }.scattered(SOURCE.to_array(), K);
    let beside = |x: f64| [dvec3(x, 0.3, 1.3), dvec3(x, 1.8, 0.9), dvec3(x, -1.2, 1.4), dvec3(x, 1.2, -1.8)];
    let over = |x: f64| [dvec3(x, 0.3, 0.1), dvec3(x, 1.2, 0.9), dvec3(x, -0.8, 0.5), dvec3(x, 1.2, -0.5)];
    let regions = [
        [over(0.3), over(1.5)].concat(),
        [over(-0.3), over(-1.5)].concat(),
        [beside(1e-3), beside(-0.1)].concat(),
        [beside(0.7), beside(-2.0)].concat(),
    ];
    for (region, receivers) in regions.iter().enumerate() {
        let mut errors = [0.0; 2];
        for &receiver in receivers {
            let (re, im) = exact.pressure(receiver.to_array());
            let exact = free(SOURCE, receiver) + Complex::new(re, im);
            let [once, twice] = orders(SOURCE, receiver);
            let error = |found: Complex| {
                (found - exact).square_of_modulus() / free(SOURCE, receiver).square_of_modulus()
            };
            errors[0] += error(once) / receivers.len() as f64;
            errors[1] += error(once + twice) / receivers.len() as f64;
        }
        let [once, twice] = errors.map(f64::sqrt);
        assert!(twice < 0.08 && once > 2.0 * twice, "{region}: {once} {twice}");
    }
}

/// In the plane beside the panel nothing is scattered, exactly, on either side of it.
#[test]
fn in_the_plane_two_orders_are_the_free_field() {
    for place in [dvec3(0.0, 0.3, 1.21), dvec3(0.0, 1.45, 1.25), dvec3(0.0, 1.9, 1.6), dvec3(0.0, -1.3, -2.0)]
    {
        for side in [1e-9, -1e-9] {
            let receiver = place + DVec3::X * side;
            let [once, twice] = orders(SOURCE, receiver);
            let left = (once + twice - free(SOURCE, receiver)).modulus() * SOURCE.distance(receiver);
            assert!(left < 1e-4, "{receiver}: {left}");
        }
    }
}

/// A box from the origin to here [m], its edges each between the plane of `axis` + 1 and that of `axis` + 2.
const BOX: DVec3 = dvec3(2.0, 1.0, 0.75);

struct BoxEdge {
    wedge: Wedge,
    /// (axis, whether it is the far one) of the planes of both faces.
    faces: [(usize, bool); 2],
}

fn edges_of_box() -> Vec<BoxEdge> {
    let mut edges = Vec::new();
    for (axis, far) in (0..12).map(|i| (i / 4, [i % 2 == 1, i % 4 > 1])) {
        let [y, z] = [(axis + 1) % 3, (axis + 2) % 3];
        let unit = DVec3::AXES;
        let start = unit[y] * (BOX[y] * f64::from(far[0])) + unit[z] * (BOX[z] * f64::from(far[1]));
        let out = |side: usize| if far[side] { 1.0 } else { -1.0 };
        let ends = [start, start + unit[axis] * BOX[axis]];
        let wedge = Wedge::new(ends, -unit[z] * out(1), unit[y] * out(0), 1.5 * PI).unwrap();
        edges.push(BoxEdge { wedge, faces: [(y, far[0]), (z, far[1])] });
    }
    edges
}

fn meets_box(from: DVec3, to: DVec3) -> bool {
    let (mut first, mut last) = (0.0f64, 1.0f64);
    for axis in 0..3 {
        let way = to[axis] - from[axis];
        let at = [1e-9, BOX[axis] - 1e-9].map(|border| (border - from[axis]) / way);
        (first, last) = (first.max(at[0].min(at[1])), last.min(at[0].max(at[1])));
    }
    first < last
}

/// Everything over one edge of the box, over its parallel edges, and over those that meet.
fn orders_of_box(source: DVec3, receiver: DVec3) -> [Complex; 3] {
    let mut orders = [Complex::ZERO; 3];
    if !meets_box(source, receiver) {
        orders[0] += free(source, receiver);
    }
    for (axis, at, sign) in (0..3).flat_map(|axis| [(axis, 0.0, -1.0), (axis, BOX[axis], 1.0)]) {
        let mut image = source;
        image[axis] = 2.0 * at - source[axis];
        let place = image.lerp(receiver, (at - image[axis]) / (receiver[axis] - image[axis]));
        let is_on = |other: usize| other == axis || (place[other] > 0.0 && place[other] < BOX[other]);
        let before = |point: DVec3| (point[axis] - at) * sign > 0.0;
        if before(source) && before(receiver) && (0..3).all(is_on) {
            orders[0] += free(image, receiver);
        }
    }
    let edges = edges_of_box();
    let sees = |edge: &BoxEdge, point| !meets_box(point, edge.wedge.at(0.5 * edge.wedge.length()));
    for (i, first) in edges.iter().enumerate().filter(|(_, edge)| sees(edge, source)) {
        let whole = [0.0, first.wedge.length()];
        let ends = [source, receiver].map(|point| first.wedge.locate(point));
        if let ([Some(from), Some(to)], true) = (ends, sees(first, receiver)) {
            let over = EdgePath::new(&first.wedge, from, to, whole, Lit::default(), K);
            orders[0] = over.field(K).into_iter().fold(orders[0], |sum, term| sum + term);
        }
        for (j, second) in edges.iter().enumerate().filter(|(j, edge)| *j != i && sees(edge, receiver)) {
            for (face, next) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                if first.faces[face] != second.faces[next] {
                    continue;
                }
                let edge = |wedge, at_second: usize| {
                    let ends = [source, receiver].map(|point| Wedge::locate(wedge, point));
                    let joint = at_second as f64 * wedge.angle();
                    let alone = ends.map(|end| end.is_some_and(|end| (end.angle - joint).abs() < PI));
                    FaceEdge { wedge, ends, alone, at_second: at_second == 1, part: [0.0, wedge.length()] }
                };
                let path = FacePath::new(edge(&first.wedge, face), edge(&second.wedge, next), 1e-9, K);
                orders[if i / 4 == j / 4 { 1 } else { 2 }] += field(&path.unwrap());
            }
        }
    }
    orders
}

/// Against boundary elements, about a box at all sides of it: with the edges that meet at its corners what is left of the error is
/// half of what it is with parallel ones alone, and a third of that of one order.
#[test]
fn about_a_box_two_orders_are_what_boundary_elements_say() {
    use sonel_testkit::analytic::rigid_box::RigidBox;
    let source = dvec3(-2.0, 0.3, 2.0);
    let exact = RigidBox { size: BOX.to_array(), elements: 0.17 }.scattered(source.to_array(), K);
    let mut errors = [0.0; 3];
    let mut count = 0.0;
    for (x, y, z) in (0..125).map(|i| (i / 25, i / 5 % 5, i % 5)) {
        let share = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) / 4.0;
        let receiver = dvec3(-1.21, -1.13, -0.87) + share * dvec3(4.3, 3.2, 2.6);
        let nearest = receiver.clamp(DVec3::ZERO, BOX);
        if receiver.distance(nearest) < 0.2 {
            continue;
        }
        let (re, im) = exact.pressure(receiver.to_array());
        let exact = free(source, receiver) + Complex::new(re, im);
        let mut sum = Complex::ZERO;
        for (error, order) in errors.iter_mut().zip(orders_of_box(source, receiver)) {
            sum += order;
            *error += (sum - exact).square_of_modulus() / free(source, receiver).square_of_modulus();
        }
        count += 1.0;
    }
    let [once, parallel, all] = errors.map(|error: f64| (error / count).sqrt());
    assert!(all < 0.1 && parallel > 2.0 * all && once > 3.0 * all, "{once} {parallel} {all}");
}

#[test]
fn exchange_of_source_and_receiver_changes_nothing() {
    let [first, second, ..] = &rims();
    for receiver in [dvec3(2.0, 0.5, 1.9), dvec3(0.01, 2.0, 0.5), dvec3(-1.0, 0.0, 0.0)] {
        let there = field(&path(first, second, SOURCE, receiver));
        let back = field(&path(second, first, receiver, SOURCE));
        assert!((there - back).modulus() <= 1e-12 * there.modulus(), "{there:?} {back:?}");
    }
}

#[test]
fn every_field_is_finite() {
    let [first, second, third, _] = &rims();
    let places = [
        DVec3::ZERO,
        dvec3(0.0, 1.5, 1.2),
        dvec3(0.0, 1.5, 4.0),
        dvec3(0.0, 1.5, 0.2),
        dvec3(1e-9, 3.0, 3.0),
    ];
    for other in [second, third] {
        for source in places {
            for receiver in places {
                assert!(
                    field(&path(first, other, source, receiver)).modulus().is_finite(),
                    "{source} {receiver}"
                );
            }
        }
    }
}
