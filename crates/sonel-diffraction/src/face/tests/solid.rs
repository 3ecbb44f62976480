//! Two and three edges of a box against boundary elements, and across the planes of its faces.

use super::*;
use sonel_testkit::analytic::rigid_box::RigidBox;

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

/// An edge that is passed: which, the face it is reached over, and the one that it is left over.
fn is_before(point: DVec3, (axis, far): (usize, bool)) -> bool {
    if far { point[axis] > BOX[axis] } else { point[axis] < 0.0 }
}

/// Everything over one edge of the box, and over two.
fn orders_of_box(source: DVec3, receiver: DVec3) -> [Complex; 2] {
    let mut orders = [Complex::ZERO; 2];
    if !meets_box(source, receiver) {
        orders[0] += free(source, receiver);
    }
    for face in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        let (axis, at) = (face.0, if face.1 { BOX[face.0] } else { 0.0 });
        let mut image = source;
        image[axis] = 2.0 * at - source[axis];
        let place = image.lerp(receiver, (at - image[axis]) / (receiver[axis] - image[axis]));
        let is_on = |other: usize| other == axis || (place[other] > 0.0 && place[other] < BOX[other]);
        if is_before(source, face) && is_before(receiver, face) && (0..3).all(is_on) {
            orders[0] += free(image, receiver);
        }
    }
    let edges = edges_of_box();
    let sees = |edge: &BoxEdge, point| edge.faces.iter().any(|&face| is_before(point, face));
    for edge in edges.iter().filter(|edge| sees(edge, source) && sees(edge, receiver)) {
        let [Some(from), Some(to)] = [source, receiver].map(|point| edge.wedge.locate(point)) else {
            continue;
        };
        let over =
            EdgePath::new(&edge.wedge, from, to, [0.0, edge.wedge.length()], Visibility::default(), [K, K]);
        orders[0] = over.field(K).into_iter().fold(orders[0], |sum, term| sum + term);
    }
    for first in &edges {
        for last in edges.iter().filter(|last| !std::ptr::eq(*last, first)) {
            let Some((face, of)) = common_face(first, last) else { continue };
            let end = |edge: &BoxEdge, point| {
                let point_about = edge.wedge.locate(point).filter(|_| sees(edge, point))?;
                Some(End { point: point_about, before: is_before(point, face) })
            };
            if let (Some(from), Some(to)) = (end(first, source), end(last, receiver))
                && let Some(path) =
                    FacePath::new([first.passed(of[0]), last.passed(of[1])], [from, to], 1e-9, [K, K])
            {
                orders[1] += field(&path);
            }
        }
    }
    orders
}

/// The face that two edges share, and which of its faces it is of each.
fn common_face(one: &BoxEdge, other: &BoxEdge) -> Option<((usize, bool), [usize; 2])> {
    (0..2).find_map(|of| {
        let face = one.faces[of];
        Some((face, [of, other.faces.iter().position(|other| *other == face)?]))
    })
}

impl BoxEdge {
    fn passed(&self, face: usize) -> FaceEdge<'_> {
        FaceEdge { wedge: &self.wedge, at_second: face == 1, part: [0.0, self.wedge.length()] }
    }
}

/// Against boundary elements, at all sides of a box, in sight of the source and in its shadow: every order brings the field nearer.
#[test]
fn about_a_box_two_orders_are_what_boundary_elements_say() {
    let (mut errors, mut counts) = ([[0.0; 2]; 2], [0.0; 2]);
    for source in [dvec3(-2.0, 0.3, 2.0), dvec3(-1.5, 0.4, 0.3)] {
        let exact = RigidBox { size: BOX.to_array(), elements: 0.17 }.scattered(source.to_array(), K);
        for (x, y, z) in (0..125).map(|i| (i / 25, i / 5 % 5, i % 5)) {
            let share = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) / 4.0;
            let receiver = dvec3(-1.21, -1.13, -0.87) + share * dvec3(4.3, 3.2, 2.6);
            if receiver.distance(receiver.clamp(DVec3::ZERO, BOX)) < 0.2 {
                continue;
            }
            let (re, im) = exact.pressure(receiver.to_array());
            let exact = free(source, receiver) + Complex::new(re, im);
            let region = usize::from(meets_box(source, receiver));
            let mut sum = Complex::ZERO;
            for (error, order) in errors[region].iter_mut().zip(orders_of_box(source, receiver)) {
                sum += order;
                *error += (sum - exact).norm_sqr() / free(source, receiver).norm_sqr();
            }
            counts[region] += 1.0;
        }
    }
    let [sight, shadow] = [0, 1].map(|of| errors[of].map(|error: f64| (error / counts[of]).sqrt()));
    for of in [sight, shadow] {
        eprintln!("box {} {}", of[0], of[1]);
        assert!(of[1] < 0.15 && of[1] < 0.5 * of[0], "{sight:?} {shadow:?}");
    }
}
