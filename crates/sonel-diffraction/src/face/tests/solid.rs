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
type Passed = (usize, [usize; 2]);

/// All ways over `count` edges, along one face or from face to face.
fn ways(edges: &[BoxEdge], count: usize) -> Vec<Vec<Passed>> {
    let mut ways: Vec<Vec<Passed>> =
        (0..edges.len()).flat_map(|edge| [vec![(edge, [1, 0])], vec![(edge, [0, 1])]]).collect();
    for _ in 1..count {
        let longer = |way: &Vec<Passed>| {
            let &(edge, [_, out]) = way.last().unwrap();
            let joint = edges[edge].faces[out];
            let next = edges.iter().enumerate().filter(|(other, _)| *other != edge);
            let next: Vec<Passed> = next
                .filter_map(|(other, next)| Some((other, next.faces.iter().position(|f| *f == joint)?)))
                .flat_map(|(other, face)| [(other, [face, 1 - face]), (other, [face, face])])
                .collect();
            let way = way.clone();
            next.into_iter().map(move |next| [&way[..], &[next]].concat())
        };
        ways = ways.iter().flat_map(longer).collect();
    }
    // How the last edge is left is all the same.
    ways.retain(|way| way.last().is_some_and(|&(_, [reached, left])| reached != left));
    ways
}

fn is_before(point: DVec3, (axis, far): (usize, bool)) -> bool {
    if far { point[axis] > BOX[axis] } else { point[axis] < 0.0 }
}

/// Everything over one edge of the box, over two, and over three.
fn orders_of_box(source: DVec3, receiver: DVec3) -> [Complex; 3] {
    let mut orders = [Complex::ZERO; 3];
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
        let over = EdgePath::new(&edge.wedge, from, to, [0.0, edge.wedge.length()], Lit::default(), K);
        orders[0] = over.field(K).into_iter().fold(orders[0], |sum, term| sum + term);
    }
    for count in [2, 3] {
        for way in ways(&edges, count) {
            let passed: Vec<FaceEdge<'_>> =
                way.iter().map(|&(edge, faces)| edges[edge].passed(faces)).collect();
            let end = |at: usize, side: usize, point| {
                let (edge, faces) = way[at];
                sees(&edges[edge], point).then_some(())?;
                let before = is_before(point, edges[edge].faces[faces[side]]);
                Some(End { point: edges[edge].wedge.locate(point)?, before })
            };
            if let (Some(from), Some(to)) = (end(0, 1, source), end(count - 1, 0, receiver))
                && let Some(path) = FacePath::new(&passed, [from, to], 1e-9, K, Orders::ALL)
            {
                orders[count - 1] += field(&path);
            }
        }
    }
    orders
}

impl BoxEdge {
    fn passed(&self, faces: [usize; 2]) -> FaceEdge<'_> {
        let part = [0.0, self.wedge.length()];
        FaceEdge { wedge: &self.wedge, at_second: faces.map(|face| face == 1), part, outline: &[] }
    }
}

/// Against boundary elements, at all sides of a box, in sight of the source and in its shadow: every order brings the field nearer.
#[test]
fn about_a_box_three_orders_are_what_boundary_elements_say() {
    let (mut errors, mut counts) = ([[0.0; 3]; 2], [0.0; 2]);
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
                *error += (sum - exact).square_of_modulus() / free(source, receiver).square_of_modulus();
            }
            counts[region] += 1.0;
        }
    }
    let [sight, shadow] = [0, 1].map(|of| errors[of].map(|error: f64| (error / counts[of]).sqrt()));
    for of in [sight, shadow] {
        assert!(of[2] < 0.1 && of[2] < 0.9 * of[1] && of[1] < 0.5 * of[0], "{sight:?} {shadow:?}");
    }
}

/// A source a millimetre over the plane of the top: whatever crosses that plane or another hears no step within the millimetre. Ways over a third
/// edge of the same face are what makes it so.
#[test]
fn a_source_beside_a_plane_is_heard_without_a_step() {
    let source = dvec3(-1.5, 0.4, BOX.z + 1e-3);
    let mut largest = [0.0f64; 2];
    for (place, across) in [
        (dvec3(2.5, 0.3, BOX.z), DVec3::Z),
        (dvec3(2.2, 0.5, BOX.z), DVec3::Z),
        (dvec3(1.0, 2.4, BOX.z), DVec3::Z),
        (dvec3(2.0, 1.4, 0.6), DVec3::X),
        (dvec3(2.0, 0.45, 1.15), DVec3::X),
    ] {
        let heard = [-1e-3, -1e-4, -1e-6, 1e-6, 1e-4, 1e-3].map(|offset| {
            let orders = orders_of_box(source, place + across * offset);
            [orders[0] + orders[1] + orders[2], orders[0] + orders[1]].map(Complex::modulus)
        });
        for pair in heard.windows(2) {
            for (largest, [from, to]) in largest.iter_mut().zip([0, 1].map(|of| [pair[0][of], pair[1][of]])) {
                *largest = largest.max((20.0 * (from / to).log10()).abs());
            }
        }
    }
    assert!(largest[0] < 0.1 && largest[1] > 0.5, "{largest:?} dB");
}

/// Across the planes of the faces, anywhere about the box, in sight of the source and deep in its shadow: two orders step, three do
/// not.
#[test]
fn the_planes_of_a_box_are_crossed_without_a_step() {
    let mut random = Uniform::new(5);
    let mut largest = [0.0f64; 3];
    for source in [dvec3(-2.0, 0.3, 2.0), dvec3(-1.5, 0.4, 0.3), dvec3(-1.5, -1.5, 0.4)] {
        for place in 0..30 {
            let axis = place % 3;
            let mut at =
                (DVec3::from_array([0; 3].map(|_| random.next_f64())) - 0.5) * (BOX + 2.0) + 0.5 * BOX;
            at[axis] = if place % 2 == 0 { 0.0 } else { BOX[axis] };
            if at.distance(at.clamp(DVec3::ZERO, BOX)) < 0.05 {
                continue;
            }
            let [below, above] = [-1e-8, 1e-8].map(|offset| {
                let mut place = at;
                place[axis] += offset;
                orders_of_box(source, place)
            });
            let mut sums = [Complex::ZERO; 2];
            for order in 0..3 {
                sums[0] += below[order];
                sums[1] += above[order];
                let step = (20.0 * (sums[0].modulus() / sums[1].modulus()).log10()).abs();
                largest[order] = largest[order].max(step);
            }
        }
    }
    assert!(largest[2] < 0.01 && largest[1] > 1.0, "{largest:?}");
}
