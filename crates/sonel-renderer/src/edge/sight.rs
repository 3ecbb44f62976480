//! Edges that are about to go out of sight behind other edges where no ways over both are followed.
//!
//! An edge that is parallel to another one hides it from a receiver all at once. What the hidden one sends would go on over both
//! ([`apart`](super::apart)); where those ways would be too many it falls to nothing before it is hidden.

use glam::DVec3;
use sonel_diffraction::Wedge;

use super::apart::{NEARLY, Pairs};
use super::chain::Chain;
use super::mirror::PlaneMirror;
use super::passage::{Border, CORNER};
use super::world::{RoomEdge, World};

/// How much longer [m] a way past another edge is over that than straight on where it is far enough from being hidden: centimetres before it is.
/// Wider, passages over two edges would be left that longer ones complete which fade.
const CLEAR: f64 = 4e-4;
/// The same where ways over edges apart are left out since there are too many: of what goes past many edges in line as little as possible must be
/// lost.
pub(super) const CROWDED: f64 = 1e-4;
/// The same in rooms about two mirrors, where nothing goes on over edges apart: a decimetre.
const OF_TWO_MIRRORS: f64 = 2e-3;

/// How much longer [m] ways past other edges are over these where nothing is lost, among edges that have `pairs` and after so many mirrors.
#[must_use]
pub(super) fn clear(pairs: Option<&Pairs>, mirrors: u32) -> f64 {
    match pairs {
        _ if mirrors > 1 => OF_TWO_MIRRORS,
        Some(_) => CLEAR,
        None => CROWDED,
    }
}

/// For each edge all others that hide it all at once where no way goes on over both: of the `pairs` that see one another those that do so in
/// places only, and where no pairs are followed all that are parallel and of no common face.
#[must_use]
pub(super) fn hiders(edges: &[RoomEdge], faces: &[Vec<Border>], pairs: Option<&Pairs>) -> Vec<Vec<usize>> {
    if let Some(pairs) = pairs {
        return partners(edges.len(), &pairs.partly);
    }
    let mut of_one_face = vec![Vec::new(); edges.len()];
    for face in faces {
        for (edge, _) in face {
            of_one_face[*edge].extend(face.iter().map(|(other, _)| *other));
        }
    }
    let hides = |edge: usize, other: usize| {
        let [one, two] = [edge, other].map(|of| &edges[of].wedge);
        edge != other && one.sine_to(two) <= NEARLY && !of_one_face[edge].contains(&other)
    };
    (0..edges.len()).map(|edge| (0..edges.len()).filter(|&other| hides(edge, other)).collect()).collect()
}

/// For each of so many edges those that it is paired with.
fn partners(edges: usize, pairs: &[[usize; 2]]) -> Vec<Vec<usize>> {
    let mut partners = vec![Vec::new(); edges];
    for &[one, other] in pairs {
        partners[one].push(other);
        partners[other].push(one);
    }
    partners
}

/// Those of `edges` that the mirrors of `chain` end at, by index, and where they are in the unfolded room.
#[must_use]
pub(super) fn borders(chain: &Chain, edges: &[RoomEdge]) -> Vec<(usize, Wedge)> {
    let of_mirror = |(met, mirror): (usize, &PlaneMirror)| {
        let is_own = |edge: &RoomEdge| edge.faces.iter().any(|face| face.plane == mirror.plane);
        let own = edges.iter().enumerate().filter(|(_, edge)| is_own(edge));
        let later = &chain.mirrors()[met + 1..];
        let unfolded = |wedge| later.iter().fold(wedge, |wedge, mirror| mirror.image_of_wedge(&wedge));
        own.map(|(index, edge)| (index, unfolded(edge.wedge))).collect::<Vec<_>>()
    };
    chain.mirrors().iter().enumerate().flat_map(of_mirror).collect()
}

/// The edges and borders that hide `edge` all at once where no way goes on over both.
pub(super) fn hiding(world: &World, edge: usize) -> impl Iterator<Item = &Wedge> {
    let hiders = world.hiders.get(edge).into_iter().flatten().map(|&other| &world.edges[other].wedge);
    hiders.chain(world.hidden_by.get(edge).into_iter().flat_map(|borders| borders.iter()))
}

/// The pieces of a `part` [m] of `edge` that those of `others` which are parallel to it are about to hide from some of the `ends`, each with what is
/// left of its sound: 0 where it is about to be seen no more, 1 where ways past the others are longer by `clear` [m]. The pieces end where an
/// end of the edge that hides them is in line.
#[must_use]
pub(super) fn pieces<'a>(
    edge: &Wedge,
    part: [f64; 2],
    others: impl IntoIterator<Item = &'a Wedge>,
    ends: &[DVec3],
    clear: f64,
) -> Vec<([f64; 2], f64)> {
    let parallel = others.into_iter().filter(|other| edge.sine_to(other) <= NEARLY);
    let hiding: Vec<(&Wedge, DVec3)> = parallel
        .flat_map(|other| ends.iter().map(move |&end| (other, end)))
        .filter(|(other, end)| beyond_line(edge, other, *end) < clear)
        .collect();
    let mut cuts: Vec<f64> = hiding.iter().flat_map(|(other, end)| shadow(edge, other, *end)).collect();
    cuts.retain(|cut| (part[0]..part[1]).contains(cut));
    cuts.extend(part);
    cuts.sort_by(f64::total_cmp);
    let left = |piece: [f64; 2]| {
        let middle = edge.at(0.5 * (piece[0] + piece[1]));
        hiding.iter().map(|(other, end)| past(other, middle, *end, clear)).product()
    };
    let pieces = cuts.windows(2).map(|piece| [piece[0], piece[1]]);
    pieces.map(|piece| (piece, left(piece))).filter(|([from, to], left)| from < to && *left > 0.0).collect()
}

/// How far a point is from the line of an edge [m], and where along it [m].
fn about(edge: &Wedge, point: DVec3) -> (f64, f64) {
    let along = (point - edge.at(0.0)).dot(edge.direction());
    (point.distance(edge.at(along)), along)
}

/// How much longer the way from `edge` to `end` is over the line of another one than straight, across both [m].
fn beyond_line(edge: &Wedge, other: &Wedge, end: DVec3) -> f64 {
    let place = other.at(0.5 * other.length());
    about(edge, place).0 + about(other, end).0 - about(edge, end).0
}

/// From where to where on the line of `edge` [m] another one hides it from `end`.
fn shadow(edge: &Wedge, other: &Wedge, end: DVec3) -> [f64; 2] {
    let (distance, along) = about(edge, end);
    let stretched = distance / about(other, end).0.max(CORNER);
    [0.0, other.length()].map(|place| along + (about(edge, other.at(place)).1 - along) * stretched)
}

/// What is left of the sound that goes over `edge` at `point` [m] to the `ends`: 0 where one of `others` that are parallel to it is about to hide it, 1
/// where ways past them are longer by `clear` [m].
#[must_use]
pub(super) fn in_line<'a>(
    edge: &Wedge,
    others: impl IntoIterator<Item = &'a Wedge>,
    point: DVec3,
    ends: &[DVec3],
    clear: f64,
) -> f64 {
    let parallel = others.into_iter().filter(|other| edge.sine_to(other) <= NEARLY);
    parallel.flat_map(|other| ends.iter().map(move |&end| past(other, point, end, clear))).product()
}

/// What is left of the sound of a place on an edge at `end` past an `other` edge: 0 where that is about to hide it. The rim of a sheet hides
/// nothing of what lies in the plane of the sheet.
#[must_use]
pub(super) fn past(other: &Wedge, place: DVec3, end: DVec3, clear: f64) -> f64 {
    let along = (place - other.at(0.0)).dot(other.direction());
    let in_plane = other.is_rim()
        && other.locate(place).is_some_and(|at| libm::sin(at.angle).abs() * at.radius <= CORNER);
    if in_plane || place.distance(other.at(along)) <= CORNER {
        return 1.0;
    }
    smooth(beyond_straight(other, place, end) / clear)
}

/// How much longer the way from one place to another is over an edge than straight on [m].
#[must_use]
pub(super) fn beyond_straight(wedge: &Wedge, from: DVec3, to: DVec3) -> f64 {
    let along = [from, to].map(|end| (end - wedge.at(0.0)).dot(wedge.direction()));
    let [near, far] = [(from, along[0]), (to, along[1])].map(|(end, along)| end.distance(wedge.at(along)));
    let share = if near + far > 0.0 { near / (near + far) } else { 0.5 };
    let over = wedge.at((along[0] + (along[1] - along[0]) * share).clamp(0.0, wedge.length()));
    from.distance(over) + over.distance(to) - from.distance(to)
}

/// From 0 to 1, level at both ends.
#[must_use]
pub(super) fn smooth(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn the_way_over_an_edge_is_the_shortest_there_is() {
        let ends = [dvec3(0.0, -1.0, 1.0), dvec3(0.0, 2.0, 1.5)];
        let wedge = Wedge::new(ends, DVec3::NEG_Z, DVec3::X, 5.0).unwrap();
        for (from, to) in [
            (dvec3(-2.0, 0.3, 0.4), dvec3(3.0, 0.5, 0.2)),
            (dvec3(-2.0, 4.0, 0.4), dvec3(3.0, 5.0, 0.2)),
            (ends[0], dvec3(3.0, 0.5, 0.2)),
        ] {
            let over = (0..=3000).map(|step| wedge.at(wedge.length() * f64::from(step) / 3000.0));
            let shortest = over.map(|at| from.distance(at) + at.distance(to)).fold(f64::INFINITY, f64::min);
            let found = beyond_straight(&wedge, from, to);
            assert!((found - (shortest - from.distance(to))).abs() < 1e-6, "{found}");
        }
    }

    #[test]
    fn an_edge_hides_what_is_in_line_but_a_rim_nothing_of_its_own_plane() {
        let ends = [DVec3::ZERO, dvec3(0.0, 2.0, 0.0)];
        let [rim, edge] = [std::f64::consts::TAU, 4.7]
            .map(|angle| Wedge::new(ends, DVec3::NEG_Z, DVec3::NEG_X, angle).unwrap());
        let (above, below) = (dvec3(0.0, 1.0, 1.0), dvec3(1e-6, 1.0, -1.0));
        let past = |wedge: &Wedge, place, end| past(wedge, place, end, CLEAR);
        assert!(past(&edge, above, below) < 1e-3 && past(&rim, above, below) >= 1.0);
        let (before, behind) = (dvec3(-1.0, 1.0, 0.3), dvec3(1.0, 1.0, -0.3));
        for wedge in [rim, edge] {
            assert!(past(&wedge, before, behind) < 1e-9);
            assert!(past(&wedge, before, behind + 0.1 * DVec3::Z) >= 1.0);
        }
    }

    #[test]
    fn a_short_edge_is_about_to_hide_only_what_is_behind_it() {
        let along_y = |x: f64, [from, to]: [f64; 2], z: f64| {
            Wedge::new([dvec3(x, from, z), dvec3(x, to, z)], DVec3::NEG_Z, DVec3::X, 5.0).unwrap()
        };
        let (edge, other) = (along_y(0.0, [-2.0, 2.0], 0.0), along_y(1.0, [-0.25, 0.5], 0.0));
        let seen = |height: f64| pieces(&edge, [0.5, 4.0], [&other], &[dvec3(2.0, 0.0, height)], CLEAR);
        let nearly_hidden = seen(1e-3);
        let ends: Vec<f64> = nearly_hidden.iter().flat_map(|(piece, _)| *piece).collect();
        let expected = [0.5, 1.5, 1.5, 3.0, 3.0, 4.0];
        assert!(ends.iter().zip(expected).all(|(end, expected)| (end - expected).abs() < 1e-3), "{ends:?}");
        let left: Vec<f64> = nearly_hidden.iter().map(|(_, left)| *left).collect();
        assert!(left[0] >= 1.0 && left[1] < 0.01 && left[2] >= 1.0, "{left:?}");
        assert_eq!(seen(0.1), [([0.5, 4.0], 1.0)]);
    }
}
