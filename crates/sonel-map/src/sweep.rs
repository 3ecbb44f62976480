//! Sweeping a path: its segments in order, each with energy in every band, length and history.

use glam::{DVec3, Vec3};
use sonel_acoustics::Lanes;
use sonel_geometry::{Side, SurfaceId};
use sonel_scene::Leg;

use crate::coefficients::CoefficientTable;
use crate::vertex::{Event, Vertex};
use crate::weight::PathWeight;

/// History of a packet before a segment. Transmissions and edges leave no trace in it (docs/physics.md §4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SegmentHistory {
    /// Reflections so far.
    pub order: u32,
    /// Mirror reflections since the last diffuse one, or since the source.
    pub specular_run: u32,
    /// Whether there was a diffuse reflection at all.
    pub diffused: bool,
    /// Interfaces met since the last diffuse reflection, or since the source: passed, or returned from.
    pub interfaces: u32,
    /// Those of them that were passed.
    pub refractions: u32,
}

impl SegmentHistory {
    fn after(self, event: Event) -> Self {
        match event {
            Event::Specular => Self { order: self.order + 1, specular_run: self.specular_run + 1, ..self },
            Event::Diffuse => {
                Self { order: self.order + 1, specular_run: 0, diffused: true, interfaces: 0, refractions: 0 }
            }
            Event::Refracted => {
                Self { interfaces: self.interfaces + 1, refractions: self.refractions + 1, ..self }
            }
            Event::Returned => Self { interfaces: self.interfaces + 1, ..self },
            _ => self,
        }
    }

    /// Number of mirror reflections at walls and interfaces, where there was nothing else since the source: the order of an image source.
    #[must_use]
    pub fn image_order(&self) -> Option<u32> {
        (!self.diffused && self.refractions == 0).then_some(self.specular_run + self.interfaces)
    }
}

/// A sonel: where a segment met a surface within the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrival {
    /// The surface met.
    pub surface: SurfaceId,
    /// The side arrived on.
    pub side: Side,
    /// Event of the packet here.
    pub event: Event,
}

/// What a visitor of segments keeps along a path: at each fork the second packet goes on with what there was when the first did.
#[derive(Debug, Clone)]
pub struct Along<T> {
    /// Present value.
    pub now: T,
    kept: Vec<T>,
}

impl<T: Clone> Along<T> {
    /// Begins with `start`.
    #[must_use]
    pub fn new(start: T) -> Self {
        Self { now: start, kept: Vec::new() }
    }

    /// To be called first with every segment.
    #[inline]
    pub fn enter(&mut self, segment: &Segment<'_>) {
        if segment.resumes {
            self.now = self.kept.pop().expect("one is kept for each that waits");
        }
        self.kept.resize(segment.waiting, self.now.clone());
    }
}

/// One straight piece of a path: a leg, or a chord of it where the speed of sound has a gradient.
#[derive(Debug, Clone, Copy)]
pub struct Segment<'a> {
    /// Begin, relative to the scene's centre [m].
    pub start: Vec3,
    /// End [m].
    pub end: Vec3,
    /// Path length from the source to its beginning, each leg in another air times c₀/c: travel time times the scene's speed of sound [m].
    pub start_length: f64,
    /// The same to its end [m].
    pub end_length: f64,
    /// Number of the air that it is in, 0 for the scene's.
    pub air: u32,
    /// Energy in flight per unit emitted energy of the batch, per band, without air [1]: the incident energy at the end.
    pub energy: &'a [Lanes],
    /// History before it.
    pub history: SegmentHistory,
    /// The sonel at its end; none where the packet was sent on from an edge, met an interface, came out of a partition, goes on along its arc, escaped or
    /// arrived after the end of the run.
    pub arrival: Option<Arrival>,
    /// Whether it is a chord of an arc that goes on behind its end.
    pub is_part: bool,
    /// Event at its end.
    pub event: Event,
    /// Whether it leaves a wall, where its energy is what remained of that which arrived.
    pub leaves_wall: bool,
    /// Packets that split off before it and are still to be visited.
    pub waiting: usize,
    /// Whether it is the first of one that split off.
    pub resumes: bool,
}

impl Segment<'_> {
    /// From its beginning to its end [m].
    #[inline]
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        self.end.as_dvec3() - self.start.as_dvec3()
    }
}

/// Where a packet is on its way.
#[derive(Clone, Copy)]
struct Way {
    start: DVec3,
    start_length: f64,
    air: u32,
    history: SegmentHistory,
    leaves_wall: bool,
}

/// Visits the segments of a path from `source` (about the scene's centre [m]) in the given air, those of packets that it splits into one packet
/// after the other. `weight` must have been started for this path by [`PathWeight::emit`]; `table` must know the surfaces.
pub fn sweep(
    (source, air): (DVec3, u32),
    vertices: &[Vertex],
    table: &CoefficientTable,
    weight: &mut PathWeight,
    mut visit: impl FnMut(&Segment<'_>),
) {
    let history = SegmentHistory::default();
    let mut way = Way { start: source, start_length: 0.0, air, history, leaves_wall: false };
    let (mut second, mut resumes) = (Vec::new(), false);
    let propagation = table.propagation();
    for vertex in vertices {
        let Some(event) = vertex.event() else { return };
        if event == Event::Split {
            weight.halve();
            second.push((way, weight.clone()));
            continue;
        }
        let Way { start, start_length, air, history, leaves_wall } = way;
        let end = vertex.position.as_dvec3();
        let end_length = start_length + propagation.length(air, start, end);
        let (surface, side) = (vertex.surface(), vertex.side());
        let segment = Segment {
            is_part: false,
            start: start.as_vec3(),
            end: end.as_vec3(),
            start_length,
            end_length,
            air,
            energy: weight.energy(),
            history,
            arrival: event.leaves_sonel().then_some(Arrival { surface, side, event }),
            event,
            leaves_wall,
            waiting: second.len(),
            resumes: std::mem::take(&mut resumes),
        };
        if propagation.is_straight() || start == end {
            visit(&segment);
        } else {
            visit_chords(propagation.leg(start, end), &segment, &mut visit);
        }
        if event.is_final() {
            let Some((branched, its_weight)) = second.pop() else { return };
            (way, *weight, resumes) = (branched, its_weight, true);
            continue;
        }
        way = Way {
            start: end,
            start_length: end_length,
            air,
            history: history.after(event),
            leaves_wall: false,
        };
        if event.is_at_interface() {
            let beyond = usize::from(event == Event::Refracted);
            way.air = propagation.interface(surface, side).map_or(air, |it| it.airs[beyond]);
        } else if !matches!(event, Event::Diffracted | Event::Emerged) {
            let row = &*table.row(surface, end - start);
            weight.pass(match event {
                Event::Diffuse => &row.diffuse,
                Event::Transmitted => &row.transmitted,
                _ => &row.specular,
            });
            way.leaves_wall = true;
        }
    }
}

/// Visits the chords of a segment that is an arc.
#[cold]
fn visit_chords(leg: Option<Leg>, whole: &Segment<'_>, visit: &mut dyn FnMut(&Segment<'_>)) {
    let Some(Leg { arc, time, .. }) = leg else { return visit(whole) };
    let step = (whole.end_length - whole.start_length) / f64::from(arc.chords(time));
    let mut chord =
        Segment { end: whole.start, end_length: whole.start_length, arrival: None, is_part: true, ..*whole };
    for (number, joint) in (1..).zip(arc.joints(time)) {
        let end_length = whole.start_length + f64::from(number) * step;
        chord = Segment {
            start: chord.end,
            start_length: chord.end_length,
            end: joint.as_vec3(),
            end_length,
            ..chord
        };
        visit(&chord);
        chord.resumes = false;
    }
    visit(&Segment { start: chord.end, start_length: chord.end_length, resumes: chord.resumes, ..*whole });
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{BandValues, Material, to_lanes};
    use sonel_geometry::{Geometry, Mesh};

    use crate::emission::PacketStart;

    /// Visits the segments of a path along x that meets walls of α = 0.2.
    fn follow(events: &[Event], visit: impl FnMut(&Segment<'_>)) {
        let room = Geometry::build(Mesh::shoebox([6.0, 4.0, 3.0], [0; 6])).unwrap();
        let walls = [Material::uniform("walls", 0.2, 0.5, 1)];
        let table = CoefficientTable::new(&walls, 1, 0.0).with_geometry(&room);
        let one = || to_lanes([1.0]);
        let start = PacketStart { counts: one(), carried: one(), sizes: one(), expected: one() };
        let mut weight = PathWeight::of(&table);
        weight.emit(1.0, 1.0, &start);
        let vertex = |(at, &event): (usize, &Event)| {
            Vertex::new(Vec3::X * at as f32, SurfaceId(0), Side::Front, event)
        };
        let path: Vec<Vertex> = events.iter().enumerate().map(vertex).collect();
        sweep((DVec3::ZERO, 0), &path, &table, &mut weight, visit);
    }

    #[test]
    fn what_is_kept_along_a_path_comes_back_with_each_packet_that_split_off() {
        use Event::{Absorbed, Diffuse, Split};
        let (mut before, mut found) = (Along::new(0), Vec::new());
        let path = [Diffuse, Split, Split, Diffuse, Absorbed, Split, Absorbed, Absorbed, Diffuse, Absorbed];
        follow(&path, |segment| {
            before.enter(segment);
            found.push(before.now);
            before.now += 1;
        });
        assert_eq!(found, [0, 1, 2, 1, 1, 1, 2]);
    }

    #[test]
    fn the_second_packet_of_a_fork_begins_where_the_first_did_with_its_energy() {
        use Event::{Absorbed, Diffuse, Split};
        let mut found = Vec::new();
        follow(&[Diffuse, Split, Diffuse, Absorbed, Diffuse, Absorbed], |segment| {
            found.push((segment.waiting, segment.start_length, segment.end_length, segment.energy.band(0)));
        });
        let halves = [0.4, 0.32];
        let expected = [
            (0, 0.0, 0.0, 1.0),
            (1, 0.0, 2.0, halves[0]),
            (1, 2.0, 3.0, halves[1]),
            (0, 0.0, 4.0, halves[0]),
            (0, 4.0, 5.0, halves[1]),
        ];
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert_eq!((found.0, found.1, found.2), (expected.0, expected.1, expected.2));
            assert!((found.3 - expected.3).abs() < 1e-15, "{found:?}");
        }
    }
}
