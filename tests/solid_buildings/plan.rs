//! Plans of buildings: convex pieces of rooms, walls and columns, each with what is beside it.

use glam::{DVec2, dvec2};
use sonel_testkit::uniform::Uniform;

/// Walls that divide rooms, at most: 6 rooms in each of two storeys.
const MOST_WALLS: usize = 5;
/// Least width of a room [m], and least distance of corners of the plan [m].
const LEAST_WIDTH: f64 = 1.6;
const LEAST_DETAIL: f64 = 0.02;
/// Places of the plan are one within this [m].
pub(super) const SAME: f64 = 1e-9;

/// A convex piece of the plan, counterclockwise.
pub(super) type Outline = Vec<DVec2>;

/// What a piece of the plan is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    Room,
    /// A part of a wall.
    Wall {
        wall: usize,
        part: Part,
    },
    /// A column, or a shaft.
    Column(usize),
}

/// Part of a wall along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Before,
    /// Where an opening may be; whether it holds the pane.
    Opening {
        is_pane: bool,
    },
    After,
}

/// A piece of the plan, and what is beside it.
pub(super) struct Piece {
    pub(super) outline: Outline,
    pub(super) purpose: Purpose,
    pub(super) borders: Vec<Border>,
}

/// A part of the rim of a piece: its ends, and the piece beyond.
pub(super) struct Border {
    pub(super) ends: [DVec2; 2],
    pub(super) beyond: Option<usize>,
}

/// The pieces of a random plan.
pub(super) fn pieces(random: &mut Uniform) -> Vec<Piece> {
    loop {
        let plan = plan(random);
        if has_distinct_corners(&plan) {
            return with_borders(plan);
        }
    }
}

/// A plan: pieces with what they are for.
fn plan(random: &mut Uniform) -> Vec<(Outline, Purpose)> {
    let (x, y) = (random.between(6.0, 13.0), random.between(5.0, 10.0));
    // Every second has an oblique outer wall.
    let slant = if random.below(2) == 0 { 0.0 } else { random.between(0.3, 0.3 * x) };
    let inner = vec![dvec2(0.0, 0.0), dvec2(x, 0.0), dvec2(x - slant, y), dvec2(0.0, y)];
    let lines: Vec<(DVec2, DVec2)> = sides(&inner).map(|[from, to]| (from, outward(from, to))).collect();
    let mut rest = vec![dvec2(-90.0, -90.0), dvec2(90.0, -90.0), dvec2(90.0, 90.0), dvec2(-90.0, 90.0)];
    for (from, outward) in &lines {
        rest = cut(&rest, *from + random.between(0.2, 0.4) * *outward, *outward)[0].clone();
    }
    let mut walls: Vec<Outline> = Vec::new();
    for (from, outward) in lines {
        let [within, wall] = cut(&rest, from, outward);
        (rest, _) = (within, walls.push(wall));
    }
    let mut rooms = vec![rest];
    for _ in 0..1 + random.below(MOST_WALLS) {
        divide(random, &mut rooms, &mut walls);
    }
    let mut pieces: Vec<(Outline, Purpose)> = Vec::new();
    for (number, wall) in walls.iter().enumerate() {
        pieces.extend(wall_pieces(random, wall, number, &walls));
    }
    for (number, room) in rooms.into_iter().enumerate() {
        pieces.extend(room_pieces(random, room, number));
    }
    pieces
}

/// Divides a random room by a wall, if there is space: along one of its sides or oblique.
fn divide(random: &mut Uniform, rooms: &mut Vec<Outline>, walls: &mut Vec<Outline>) {
    let room = random.below(rooms.len());
    let outline = rooms[room].clone();
    let [from, to] = sides(&outline).nth(random.below(outline.len())).expect("a side");
    let turn = if random.below(2) == 0 { 0.0 } else { random.between(-0.7, 0.7) };
    let across = DVec2::from_angle(turn).rotate(outward(from, to));
    let heights: Vec<f64> = outline.iter().map(|corner| across.dot(*corner)).collect();
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let at = random.between(low, high);
    let thickness = random.between(0.1, 0.25);
    let [below, rest] = cut(&outline, at * across, across);
    let [wall, above] = cut(&rest, (at + thickness) * across, across);
    let is_room = |outline: &Outline| outline.len() > 2 && width(outline) > LEAST_WIDTH;
    if wall.len() == 4 && is_room(&below) && is_room(&above) {
        rooms[room] = below;
        rooms.push(above);
        walls.push(wall);
    }
}

/// A wall in pieces: what is before an opening, the opening with a pane, and what is behind it.
fn wall_pieces(
    random: &mut Uniform,
    wall: &Outline,
    number: usize,
    walls: &[Outline],
) -> Vec<(Outline, Purpose)> {
    let [from, to] = sides(wall).max_by(|a, b| length(a).total_cmp(&length(b))).expect("a wall has sides");
    let (along, aside) = ((to - from).normalize(), outward(from, to));
    let coordinate = |corner: &DVec2| along.dot(*corner);
    let corners = || wall.iter().map(coordinate);
    let (low, high) = (corners().fold(f64::INFINITY, f64::min), corners().fold(f64::NEG_INFINITY, f64::max));
    let middle = 0.5 * (low + high);
    // Between the ends of both sides.
    let first = corners().filter(|it| *it < middle).fold(low, f64::max) + 0.2;
    let last = corners().filter(|it| *it > middle).fold(high, f64::min) - 0.2;
    let whole = vec![(wall.clone(), Purpose::Wall { wall: number, part: Part::After })];
    if last - first < 1.0 {
        return whole;
    }
    let (mut open, mut close) = (random.between(first, last - 0.6), 0.0);
    close = random.between(open + 0.4, last).max(close);
    // Other walls that end on this one: flush with one of them it may end in an L.
    let is_on = |corner: &&DVec2| sides(wall).any(|side| height_over(&side, **corner).abs() < SAME);
    let others = walls.iter().enumerate().filter(|(at, _)| *at != number).map(|(_, other)| other);
    let ends: Vec<Vec<f64>> = others
        .map(|other| {
            other.iter().filter(is_on).map(coordinate).filter(|it| (first..last).contains(it)).collect()
        })
        .filter(|ends: &Vec<f64>| ends.len() == 2)
        .collect();
    if let Some(ends) = ends.first().filter(|_| random.below(2) == 0) {
        let (near, far) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        if near > open + 0.3 {
            close = near;
        } else if far < close - 0.3 {
            open = far;
        }
    }
    let [before, rest] = cut(wall, open * along, along);
    let [opening, after] = cut(&rest, close * along, along);
    let depth = width(&opening);
    let [rest, outer] = cut(&opening, from - 0.4 * depth * aside, aside);
    let [inner, pane] = cut(&rest, from - 0.6 * depth * aside, aside);
    let part = |outline, part| (outline, Purpose::Wall { wall: number, part });
    let frame = Part::Opening { is_pane: false };
    vec![
        part(before, Part::Before),
        part(inner, frame),
        part(pane, Part::Opening { is_pane: true }),
        part(outer, frame),
        part(after, Part::After),
    ]
}

/// A room, divided about a column if it has one.
fn room_pieces(random: &mut Uniform, room: Outline, number: usize) -> Vec<(Outline, Purpose)> {
    let middle = room.iter().sum::<DVec2>() / room.len() as f64;
    let half = random.between(0.12, 0.25);
    if random.below(2) == 0 || width(&room) < 2.0 {
        return vec![(room, Purpose::Room)];
    }
    let along = DVec2::from_angle(random.between(0.0, 1.5));
    let mut rest = room;
    let mut pieces = Vec::new();
    for outward in [along, -along, along.perp(), -along.perp()] {
        let [within, beyond] = cut(&rest, middle + half * outward, outward);
        pieces.push((beyond, Purpose::Room));
        rest = within;
    }
    pieces.push((rest, Purpose::Column(number)));
    pieces
}

fn with_borders(plan: Vec<(Outline, Purpose)>) -> Vec<Piece> {
    let outlines: Vec<Outline> = plan.iter().map(|(outline, _)| outline.clone()).collect();
    let borders = |outline: &Outline| {
        let mut borders = Vec::new();
        for side @ [from, to] in sides(outline) {
            let is_between = |corner: &&DVec2| {
                let share = (**corner - from).dot(to - from) / length(&side).powi(2);
                height_over(&side, **corner).abs() < SAME && share > 0.0 && share < 1.0
            };
            let mut corners: Vec<DVec2> = outlines.iter().flatten().filter(is_between).copied().collect();
            corners.extend([from, to]);
            corners.sort_by(|a, b| from.distance(*a).total_cmp(&from.distance(*b)));
            corners.dedup_by(|a, b| a.distance(*b) < 10.0 * SAME);
            borders.extend(corners.windows(2).map(|ends| {
                let beyond = 0.5 * (ends[0] + ends[1]) + 1e-5 * outward(from, to);
                let is_in = |outline: &Outline| sides(outline).all(|side| height_over(&side, beyond) < 0.0);
                Border { ends: [ends[0], ends[1]], beyond: outlines.iter().position(is_in) }
            }));
        }
        borders
    };
    plan.into_iter()
        .map(|(outline, purpose)| Piece { borders: borders(&outline), outline, purpose })
        .collect()
}

/// Whether corners are the same or apart, also from sides.
fn has_distinct_corners(plan: &[(Outline, Purpose)]) -> bool {
    let is_clear = |distance: f64| !(SAME..LEAST_DETAIL).contains(&distance);
    let corners = || plan.iter().flat_map(|(outline, _)| outline.iter().copied());
    let off = |[from, to]: [DVec2; 2], corner: DVec2| {
        let share = ((corner - from).dot(to - from) / from.distance_squared(to)).clamp(0.0, 1.0);
        from.lerp(to, share).distance(corner)
    };
    plan.iter().all(|(outline, _)| {
        outline.len() > 2 && sides(outline).all(|side| corners().all(|corner| is_clear(off(side, corner))))
    })
}

fn sides(outline: &Outline) -> impl Iterator<Item = [DVec2; 2]> + '_ {
    outline.iter().zip(outline.iter().cycle().skip(1)).map(|(from, to)| [*from, *to])
}

fn length([from, to]: &[DVec2; 2]) -> f64 {
    from.distance(*to)
}

/// Unit normal of a side, to its right.
fn outward(from: DVec2, to: DVec2) -> DVec2 {
    -(to - from).normalize().perp()
}

/// Distance of a place from the line of a side, to its right.
fn height_over([from, to]: &[DVec2; 2], place: DVec2) -> f64 {
    outward(*from, *to).dot(place - *from)
}

pub(super) fn area(outline: &[DVec2]) -> f64 {
    let Some(&first) = outline.first() else { return 0.0 };
    outline.windows(2).map(|ends| 0.5 * (ends[0] - first).perp_dot(ends[1] - first)).sum()
}

/// Least distance of two parallel lines that an outline is between.
fn width(outline: &Outline) -> f64 {
    let depth =
        |side: [DVec2; 2]| outline.iter().map(|corner| -height_over(&side, *corner)).fold(0.0, f64::max);
    sides(outline).map(depth).fold(f64::INFINITY, f64::min)
}

/// The parts of an outline below and above a line through a place.
fn cut(outline: &Outline, place: DVec2, normal: DVec2) -> [Outline; 2] {
    let mut parts = [Outline::new(), Outline::new()];
    let height = |corner: DVec2| {
        let height = normal.dot(corner - place);
        if height.abs() < SAME { 0.0 } else { height }
    };
    for [from, to] in sides(outline) {
        let (here, there) = (height(from), height(to));
        for (part, sign) in parts.iter_mut().zip([-1.0, 1.0]) {
            part.extend((sign * here >= 0.0).then_some(from));
            part.extend((here * there < 0.0).then(|| from.lerp(to, here / (here - there))));
        }
    }
    parts.map(|part| if part.len() > 2 && area(&part) > SAME { part } else { Outline::new() })
}

/// What two outlines have in common.
pub(super) fn common(a: &Outline, b: &Outline) -> Outline {
    sides(b).fold(a.clone(), |rest, [from, to]| cut(&rest, from, outward(from, to))[0].clone())
}

/// An outline whose sides beside another one are longer by `reach` there, if they are parallel.
pub(super) fn lengthened(outline: &Outline, side: usize, reach: f64) -> Option<Outline> {
    let count = outline.len();
    let at = |step: usize| outline[(side + step) % count];
    let (before, behind) = ((at(0) - at(count - 1)).normalize(), (at(1) - at(2)).normalize());
    let mut longer = outline.clone();
    longer[side] += reach * before;
    longer[(side + 1) % count] += reach * before;
    (before.distance(behind) < 1e-9).then_some(longer)
}
