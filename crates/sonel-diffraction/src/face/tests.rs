//! Edges of sheets against boundary elements, in their planes, and exchanged; of a box in [`solid`], of barriers in [`barrier`].

mod barrier;
mod solid;

use super::*;
use crate::edge_path::EdgePath;
use glam::{DVec3, dvec3};
use sonel_testkit::analytic::rigid_sheet::RigidSheet;
use std::f64::consts::{PI, TAU};

/// The panel [m].
const SIDES: [[f64; 2]; 2] = [[-1.0, 1.5], [-0.8, 1.2]];
const K: f64 = 3.0;

/// A sheet in the plane x = 0: closed lines (y, z) [m] with the sheet on their left.
struct Sheet(Vec<Vec<[f64; 2]>>);

impl Sheet {
    fn panel() -> Self {
        let [y, z] = SIDES;
        Self(vec![vec![[y[0], z[0]], [y[1], z[0]], [y[1], z[1]], [y[0], z[1]]]])
    }

    fn sides(&self) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
        self.0.iter().flat_map(|line| (0..line.len()).map(|i| [line[i], line[(i + 1) % line.len()]]))
    }

    fn rims(&self) -> Vec<Wedge> {
        let rim = |ends: [[f64; 2]; 2]| {
            let ends = ends.map(|[y, z]| dvec3(0.0, y, z));
            Wedge::new(ends, DVec3::X.cross(ends[1] - ends[0]), -DVec3::X, TAU).unwrap()
        };
        self.sides().map(rim).collect()
    }

    /// Whether a place in its plane is on it: a line from there crosses its rims an odd number of times.
    fn has(&self, place: DVec3) -> bool {
        let crosses = |[a, b]: &[[f64; 2]; 2]| {
            let at = a[0] + (b[0] - a[0]) * (place.z - a[1]) / (b[1] - a[1]);
            (a[1] > place.z) != (b[1] > place.z) && at > place.y
        };
        self.sides().filter(crosses).count() % 2 == 1
    }

    /// Everything over one rim, and everything over two.
    fn orders(&self, source: DVec3, receiver: DVec3) -> [Complex; 2] {
        let mirrored = source * dvec3(-1.0, 1.0, 1.0);
        let meets = |from: DVec3| {
            from.x * receiver.x < 0.0 && self.has(from.lerp(receiver, from.x / (from.x - receiver.x)))
        };
        let lit = [(source, !meets(source)), (mirrored, meets(mirrored))];
        let lit = lit.into_iter().filter(|(_, lit)| *lit);
        let mut orders =
            [lit.fold(Complex::ZERO, |sum, (from, _)| sum + free(from, receiver)), Complex::ZERO];
        let rims = self.rims();
        for (i, first) in rims.iter().enumerate() {
            let ends = [source, receiver].map(|point| first.locate(point).unwrap());
            let over =
                EdgePath::new(first, ends[0], ends[1], [0.0, first.length()], Visibility::default(), [K, K]);
            orders[0] = over.field(K).into_iter().fold(orders[0], |sum, term| sum + term);
            for (_, second) in rims.iter().enumerate().filter(|(j, _)| *j != i) {
                if let Some(path) = path([first, second], source, receiver) {
                    orders[1] += field(&path);
                }
            }
        }
        orders
    }
}

/// Over two rims of a sheet.
fn path([first, second]: [&Wedge; 2], source: DVec3, receiver: DVec3) -> Option<FacePath> {
    let rim = |wedge| FaceEdge { wedge, at_second: false, part: [0.0, Wedge::length(wedge)] };
    let end = |wedge: &Wedge, point| {
        let point = wedge.locate(point).unwrap();
        End { point, before: point.angle < PI }
    };
    FacePath::new([rim(first), rim(second)], [end(first, source), end(second, receiver)], 1e-9, [K, K])
}

fn field(path: &FacePath) -> Complex {
    path.amplitudes(&K.into()).into_iter().flatten().flatten().fold(Complex::ZERO, |sum, term| sum + term)
        * unit(-K * path.length())
}

fn free(from: DVec3, to: DVec3) -> Complex {
    unit(-K * from.distance(to)) * (1.0 / from.distance(to))
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
            let [once, twice] = Sheet::panel().orders(SOURCE, receiver);
            let error = |found: Complex| (found - exact).norm_sqr() / free(SOURCE, receiver).norm_sqr();
            errors[0] += error(once) / receivers.len() as f64;
            errors[1] += error(once + twice) / receivers.len() as f64;
        }
        let [once, twice] = errors.map(f64::sqrt);
        eprintln!("region {once} {twice}");
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
            let [once, twice] = Sheet::panel().orders(SOURCE, receiver);
            let left = (once + twice - free(SOURCE, receiver)).norm() * SOURCE.distance(receiver);
            assert!(left < 1e-4, "{receiver}: {left}");
        }
    }
}

#[test]
fn exchange_of_source_and_receiver_changes_nothing() {
    let rims = Sheet::panel().rims();
    let [first, second, ..] = &rims[..] else { unreachable!() };
    for receiver in [dvec3(2.0, 0.5, 1.9), dvec3(0.01, 2.0, 0.5), dvec3(-1.0, 0.0, 0.0)] {
        let there = field(&path([first, second], SOURCE, receiver).unwrap());
        let back = field(&path([second, first], receiver, SOURCE).unwrap());
        assert!((there - back).norm() <= 1e-12 * there.norm(), "{there:?} {back:?}");
    }
}

#[test]
fn every_field_is_finite() {
    let rims = Sheet::panel().rims();
    let [first, second, third, _] = &rims[..] else { unreachable!() };
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
                let found = path([first, other], source, receiver).map(|path| field(&path));
                assert!(found.is_none_or(|field| field.norm().is_finite()), "{source} {receiver}");
            }
        }
    }
}
