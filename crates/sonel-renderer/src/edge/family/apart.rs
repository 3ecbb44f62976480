//! What goes over two edges apart, one after the other ([`ApartPath`]).

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use sonel_diffraction::apart::{Led, Products, Side, View};
use sonel_diffraction::face::{End, FaceEdge};
use sonel_diffraction::{ApartPath, Cell, Complex, WAVES, Wave, WedgePoint};

use super::super::apart::{Joined, Shore};
use super::super::image::SourceImage;
use super::super::mirror::{PlaneMirror, reflects};
use super::super::passage::Border;
use super::super::sight::in_line;
use super::super::view::{Leg, longest, stretches};
use super::super::{Reflection, RoomEdge};
use super::face::{excess, turn};
use super::several::Seen;
use super::{Family, faded};

/// tan ½θ of the angle from the plane of a face, beyond it, within which an edge of it goes out of sight.
const FADED: f64 = 0.1;

/// Ways that differ by no more than this rotate as one [m]: a sixth of a radian within an eighth of an octave at 4 kHz.
const ALIKE: f64 = 0.05;

/// A side as its end hears it.
#[derive(Clone, Copy)]
struct Heard<'a> {
    shore: &'a Shore,
    /// What of the outer edge is seen, and the share of what comes over it that is heard.
    part: [f64; 2],
    share: f64,
}

/// The edges at the air and the outer ones of both sides, by index.
#[derive(Clone, Copy)]
struct Passed {
    at_air: [usize; 2],
    outer: [usize; 2],
}

/// A wave that belongs to the image in a face of an edge.
#[derive(Clone, Copy)]
struct InFace {
    led: Led,
    edge: usize,
    face: usize,
}

impl Family<'_> {
    /// Adds what goes over pairs of edges apart in either direction, where the source sees the first and the receiver the last edge.
    pub(super) fn add_apart(&mut self, leg: &Leg<'_>, reflections: &[Reflection]) {
        let world = self.course.world;
        let mut is_outer = vec![false; world.edges.len()];
        let sides = world.apart.iter().flat_map(|way| &way.sides);
        sides.for_each(|side| is_outer[side.outer()] = true);
        let seen = |(index, edge)| if is_outer[index] { self.seen(index, edge, leg) } else { [None; 2] };
        let seen: Vec<Seen> = world.edges.iter().enumerate().map(seen).collect();
        let heard = |shore, end: usize| {
            let part = seen[Shore::outer(shore)][end]?;
            let share = self.in_sight(shore, end, leg);
            (share > 0.0).then_some(Heard { shore, part, share })
        };
        let ways = world.apart.iter().map(|way| way.sides.each_ref());
        let ways: Vec<[Heard<'_>; 2]> = ways
            .flat_map(|[one, other]| [[one, other], [other, one]])
            .filter_map(|[first, last]| Some([heard(first, 0)?, heard(last, 1)?]))
            .collect();
        for way in ways {
            self.add_way(way, leg, reflections);
        }
    }

    /// 1, and less where the outer edge is about to go out of sight of `end` [m] behind another edge, where what is left out, over one edge
    /// more, would begin: 0 in the plane of a face of it beyond another edge of that, and in the plane through it and one apart. Where a way
    /// begins there that completes such a one, over the face to the outer edge, it begins with nothing, too.
    fn in_sight(&self, shore: &Shore, of: usize, leg: &Leg<'_>) -> f64 {
        let (world, edge, end) = (self.course.world, shore.outer(), [leg.source, leg.receiver][of]);
        let angle = |(edge, face): Border| {
            let wedge = &world.edges[edge].wedge;
            let at = wedge.locate(end)?;
            Some(if face == 0 { at.angle } else { wedge.angle() - at.angle })
        };
        let mut share = 1.0;
        for face in &world.faces {
            let Some(own) = face.iter().find(|of| of.0 == edge) else { continue };
            let joins = shore.edge != edge && face.iter().any(|of| of.0 == shore.edge);
            let is_about = |above: &f64| *above < FRAC_PI_2 || joins && *above < 3.0 * FRAC_PI_2;
            let Some(above) = angle(*own).filter(is_about) else { continue };
            let low = libm::cos(above);
            for other in face.iter().filter(|of| of.0 != edge && !shore.known.contains(&of.0)) {
                let left = off_the_plane(from_the_face(&world.edges[other.0], other.1, end));
                share *= 1.0 - (1.0 - left) * low * low;
            }
        }
        let place = world.edges[edge].wedge.at(0.5 * world.edges[edge].wedge.length());
        for side in world.apart.iter().filter(|way| way.is_short()).flat_map(|way| way.across(edge)) {
            let wedge = &world.edges[side].wedge;
            if let (Some(from), Some(to)) = (wedge.locate(place), wedge.locate(end)) {
                share *= off_the_plane((from.angle - to.angle).abs());
            }
        }
        share
    }

    /// 1, and less towards 0 where both ends of an image are about to be behind its mirrors, so that it is followed no more, but see the outer
    /// edges past them.
    fn past_mirrors(&self, outer: [usize; 2], leg: &Leg<'_>) -> f64 {
        let world = self.course.world;
        let copies = outer.map(|edge| world.copy_at_middle(edge));
        let is_shown = copies[0].before.order() + copies[1].behind.order() > 0;
        if !self.is_image() || is_shown {
            return 1.0;
        }
        let left = |edge: usize, seeming: DVec3, real: DVec3| {
            let wedge = &world.edges[edge].wedge;
            let heights = world.shown.mirrors().iter().map(|mirror| mirror.height(real));
            let height = heights.fold(f64::INFINITY, f64::min).max(0.0);
            let sine = height / seeming.distance(wedge.at(0.5 * wedge.length()));
            off_the_plane(PI - sine.min(1.0))
        };
        left(outer[0], leg.source, leg.origin).max(left(outer[1], leg.receiver, leg.receiver))
    }

    /// The same where an end is about to lose sight of its outer edge past the border of a mirror: no way goes on over that.
    fn past_borders(&self, outer: [usize; 2], ends: [DVec3; 2]) -> f64 {
        let world = self.course.world;
        let left = outer.into_iter().zip(ends).map(|(edge, end)| {
            let wedge = &world.edges[edge].wedge;
            in_line(wedge, &world.borders, wedge.at(0.5 * wedge.length()), &[end], world.clear)
        });
        left.product()
    }

    /// Adds what goes from the source over both sides to the receiver.
    fn add_way(&mut self, heard: [Heard<'_>; 2], leg: &Leg<'_>, reflections: &[Reflection]) {
        let (geometry, world) = (self.at.geometry, self.course.world);
        let edges = &world.edges;
        let (ends, shores) = ([leg.source, leg.receiver], heard.map(|heard| heard.shore));
        let (at_air, outer) = (shores.map(|shore| shore.edge), shores.map(Shore::outer));
        let [across, first] = [at_air[1], at_air[0]];
        let passed = Passed { at_air, outer };
        let [at_air, outer] = [at_air, outer].map(|of| of.map(|edge| &edges[edge]));
        let left = self.past_mirrors(passed.outer, leg) * self.past_borders(passed.outer, ends);
        if left <= 0.0 {
            return;
        }
        let located = [0, 1].map(|of| outer[of].wedge.locate(ends[of]));
        let [Some(source), Some(receiver)] = located else { return };
        let is_before = |of: usize| {
            let plane = match &shores[of].beyond {
                Some(Joined { at_second: [_, true], .. }) => at_air[of].wedge.angle(),
                _ => 0.0,
            };
            at_air[of].wedge.locate(ends[of]).is_some_and(|at| (at.angle - plane).abs() < PI)
        };
        let is_base = self.is_direct();
        // What comes over an edge beyond, too, is heard over one stretch only.
        let heard_over = |edge: usize, shore: &Shore, is_seen: &dyn Fn(DVec3) -> bool| {
            let stretches = stretches(&edges[edge].wedge, is_seen);
            if shore.beyond.is_some() { longest(stretches).into_iter().collect() } else { stretches }
        };
        let past: [&dyn Fn() -> Vec<[f64; 2]>; 2] = [
            &|| heard_over(across, shores[1], &|at| leg.arrives(geometry, world.copy(across, at), at)),
            &|| heard_over(first, shores[0], &|at| leg.goes_on(geometry, world.copy(first, at), at)),
        ];
        let in_face = [0, 1].map(|of| {
            move |face: usize, point: DVec3| {
                is_base.then(|| reflects(geometry, &[at_air[of].faces[face]], ends[of], point))
            }
        });
        let within = self.doubt(source, receiver);
        let sides = [0, 1].map(|of| {
            let view = View { within, past: past[of], in_face: &in_face[of] };
            let end = End { point: [source, receiver][of], before: is_before(of) };
            side(&heard[of], [at_air[of], outer[of]], end, view)
        });
        if let Some(path) = ApartPath::new(sides, self.spectrum.smallest_k()) {
            self.add_apart_path(&path, passed, left, leg, reflections);
        }
    }

    /// Adds what is `left` of a path over the edges at the air and the outer edges: every product of two waves to the image in the faces that
    /// these belong to.
    fn add_apart_path(
        &mut self,
        path: &ApartPath,
        passed: Passed,
        left: f64,
        leg: &Leg<'_>,
        reflections: &[Reflection],
    ) {
        let (length, cells) = (path.length(), self.spectrum.cells());
        let [from, to] = path.crossings();
        let [first, last] = passed.outer.map(|edge| &self.course.world.edges[edge].wedge);
        let (first, last) = (first.at(from), last.at(to));
        let strength = self.at.radiator.factor(leg.leaving(first)).sqrt() * left;
        let through: Vec<f64> =
            (0..self.spectrum.bands()).map(|band| self.through(band, length) * strength).collect();
        let mut heard: Vec<(Option<usize>, Wave)> = Vec::new();
        for Products { lead, other, length, amplitudes } in path.products(self.spectrum.wave_numbers()) {
            let in_face = |led: Led, wave: usize| {
                let edge = if led.beyond { passed.outer } else { passed.at_air }[led.side];
                wave.checked_sub(1).map(|face| InFace { led, edge, face })
            };
            let of_others = if other.is_some() { WAVES } else { 1 };
            for (of_lead, of_other) in (0..WAVES * of_others).map(|wave| (wave / of_others, wave % of_others))
            {
                let waves = [in_face(lead, of_lead), other.and_then(|other| in_face(other, of_other))];
                let Some((image, left)) = self.left_of_both(waves, reflections) else { continue };
                let amplitudes = cells
                    .iter()
                    .zip(&amplitudes)
                    .zip(&left)
                    .map(|((cell, terms), left)| terms[of_lead][of_other] * (through[cell.band] * left));
                let image = image.filter(|&image| self.is_image() || self.images[image].lit.is_some());
                add_wave(&mut heard, image, Wave { length, amplitude: amplitudes.collect() }, cells);
            }
        }
        for (image, wave) in heard {
            let (waves, ways) = match image {
                Some(image) => {
                    let image = &mut self.images[image];
                    (&mut image.waves, &mut image.ways)
                }
                None => (&mut self.waves, &mut self.ways),
            };
            waves.push(wave);
            ways.push(length);
        }
        self.detours.push((length, leg.towards(last)));
    }

    /// The image that a product belongs to of a wave that a leading edge completes and one that the other edge does, each in a face of its
    /// edge where it is not the direct one, and what these leave of it in every cell; no image for the course.
    /// [`None`] where what the other edge completes is nowhere, since two mirrors would be needed, or one without its edges.
    fn left_of_both(
        &mut self,
        [of_lead, of_other]: [Option<InFace>; 2],
        reflections: &[Reflection],
    ) -> Option<(Option<usize>, Vec<f64>)> {
        let edges = &self.course.world.edges;
        let mut left = vec![1.0; self.spectrum.cells().len()];
        let of_other = of_other.filter(|of| is_mirrored(&edges[of.edge], of.face, of.led.ends[0]));
        if let Some(InFace { led, edge, face }) = of_other {
            if !self.is_shown(&edges[edge].faces[face]) {
                return None;
            }
            left = self.left_at(&edges[edge], face, led.ends);
        }
        let mut mirrors: Vec<InFace> = [of_lead, of_other].into_iter().flatten().collect();
        mirrors.sort_by_key(|mirror| mirror.led.side);
        if mirrors.is_empty() {
            return Some((None, left));
        }
        let shown = |image: SourceImage, of: &InFace| image.in_face(&edges[of.edge].faces[of.face]);
        let image = self.image_at(mirrors.iter().fold(self.course.seen(), shown), reflections);
        if let Some(InFace { led, edge, face }) = of_lead {
            let of_face = self.left(image, edge, face, led.ends);
            left.iter_mut().zip(of_face).for_each(|(left, of_face)| *left *= of_face);
        }
        Some((Some(image), left))
    }

    /// Whether the course is the base path in the room as it is.
    fn is_direct(&self) -> bool {
        std::ptr::eq(self.course.world, self.base.world) && self.course.order() == 0
    }

    /// Whether what the plane of a face shows of the base path has the terms of all edges.
    fn is_shown(&self, face: &PlaneMirror) -> bool {
        let is_followed = self.is_direct() && self.at.complete_order >= 2;
        is_followed && self.course.world.shows.iter().any(|mirror| mirror.is(face))
    }

    /// What the plane of a face of `edge` leaves in every cell of a wave between two points about it.
    fn left_at(&self, edge: &RoomEdge, face: usize, [from, to]: [WedgePoint; 2]) -> Vec<f64> {
        let turn = turn(edge, from, to, face);
        let mirrored: Vec<f64> = self.at.specular(&edge.faces[face]).map(f64::sqrt).collect();
        let away = excess(from, to, turn);
        let of = |cell: &Cell| {
            let mirrored = mirrored[cell.band];
            let dark = if turn > PI { 1.0 - faded(cell.k, away) } else { 0.0 };
            mirrored + (1.0 - mirrored) * dark
        };
        self.spectrum.cells().iter().map(of).collect()
    }
}

/// Adds a `wave` to those that are `heard` from the same image over as long a way.
fn add_wave(heard: &mut Vec<(Option<usize>, Wave)>, image: Option<usize>, wave: Wave, cells: &[Cell]) {
    let is_alike = |other: &&mut (Option<usize>, Wave)| {
        other.0 == image && (other.1.length - wave.length).abs() <= ALIKE
    };
    let Some((_, sum)) = heard.iter_mut().find(is_alike) else { return heard.push((image, wave)) };
    let longer = wave.length - sum.length;
    for ((sum, term), cell) in sum.amplitude.iter_mut().zip(wave.amplitude).zip(cells) {
        *sum += term * Complex::unit(-cell.k * longer);
    }
}

/// Whether a face of `edge` mirrors what is at `from` about it, since that is before its plane.
fn is_mirrored(edge: &RoomEdge, face: usize, from: WedgePoint) -> bool {
    (if face == 0 { from.angle } else { edge.wedge.angle() - from.angle }) < PI
}

/// Angle of `end` [m] about an edge from one of its faces, on whichever side of that [rad]: π in its plane beyond the edge.
fn from_the_face(edge: &RoomEdge, face: usize, end: DVec3) -> f64 {
    let over = (end - edge.wedge.at(0.0)).dot(edge.wedge.inward(face == 1));
    libm::atan2(edge.faces[face].height(end).abs(), over)
}

/// 0 at an angle of π [rad], and 1 away from it.
fn off_the_plane(angle: f64) -> f64 {
    let (sine, cosine) = libm::sincos(0.5 * (PI - angle));
    sine * sine / (sine * sine + (FADED * cosine) * (FADED * cosine))
}

/// A side over its edge at the air and its outer one, with its end about the latter.
fn side<'a>(heard: &Heard<'a>, [at_air, outer]: [&'a RoomEdge; 2], end: End, view: View<'a>) -> Side<'a> {
    let passed = |edge: &'a RoomEdge, at_second, part, outline| FaceEdge {
        wedge: &edge.wedge,
        at_second: [at_second; 2],
        part,
        outline,
    };
    let share = heard.share;
    let Some(joined) = &heard.shore.beyond else {
        let edge = passed(at_air, false, heard.part, &[]);
        return Side { edge, beyond: None, end, view, share };
    };
    let [of_outer, of_own] = joined.at_second;
    let edge = passed(at_air, of_own, [0.0, at_air.wedge.length()], &joined.outline);
    let beyond = Some(passed(outer, of_outer, heard.part, &joined.outline));
    Side { edge, beyond, end, view, share }
}
