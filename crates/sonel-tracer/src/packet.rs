//! Traces one packet from emission to its fate.

use glam::{DVec3, Vec3};
use sonel_geometry::{Arc, Departure, Geometry, Hit, SpeedProfile};
use sonel_map::coefficients::MaterialRow;
use sonel_map::{
    CHUNK_EMISSIONS, ChunkLedger, ChunkPaths, CoefficientTable, Event, PacketStart, PathWeight, Vertex,
};
use sonel_sampling::{Frame, Stream};
use sonel_scene::Source;

use crate::interaction::{draw_event, mirrored, scattered};
use crate::refraction::{Airs, Refraction, refract};
use crate::zone::{DiffractionZones, Way};

/// The surroundings of a packet: what all packets of a run share.
pub struct Surroundings<'a> {
    /// Walls.
    pub geometry: &'a Geometry,
    /// Coefficients per material.
    pub table: CoefficientTable,
    /// Material and frame about the front normal, per surface.
    pub surfaces: Vec<Frame>,
    /// Path length at which a packet expires [m].
    pub reach: f64,
    /// See [`sonel_map::Settings::extinction_threshold`].
    pub extinction_threshold: f64,
    /// The airs, where the scene has more than one.
    pub(crate) airs: Option<Airs>,
    /// The speed of sound about the scene's centre where it has a gradient, and that of the scene [m/s].
    pub(crate) profile: Option<(SpeedProfile, f64)>,
    /// Whether a packet that meets no surface is lost rather than gone.
    pub closed: bool,
    /// Zones in which the paper's packets are diffracted; none where they are not.
    pub(crate) zones: Option<DiffractionZones>,
}

/// Where a packet stands: its last vertex, and how it goes on.
struct Flight {
    position: DVec3,
    departure: Departure,
    direction: Vec3,
    /// Travel time times the speed of sound of the scene's air [m].
    length: f64,
    /// c₀/c of the air that it is in.
    stretch: f64,
    /// See [`Emission::deciding`].
    deciding: usize,
    passed: Passed,
    /// What the last partition does with it.
    passage: Passage,
}

/// Where a partition leads.
#[derive(Clone, Copy)]
enum Passage {
    /// On, or there was none.
    On,
    /// To the place opposite, on the face and side given.
    Through(Hit),
    /// Nowhere: no face is opposite.
    Nowhere,
}

/// Partitions that a packet has passed.
#[derive(Clone, Copy, PartialEq)]
enum Passed {
    None,
    /// Any, and it has been reflected since.
    Before,
    /// The last surface that it met was one.
    Last,
}

/// How one packet begins.
pub struct Emission<'a> {
    /// Place of the source about the scene's centre [m].
    pub position: DVec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Number of the air at the source.
    pub air: u32,
    /// Its source.
    pub source: &'a Source,
    /// Column whose probabilities decide: that of its lead.
    pub deciding: usize,
    /// How it starts.
    pub start: &'a PacketStart,
    /// Share of its batch in the run.
    pub share: f64,
}

/// Arrivals of a packet that a chunk has room for from the start: those of a reverberant room.
const EXPECTED_ARRIVALS: usize = 48;

/// What packets leave behind.
pub struct Records {
    /// Their paths.
    pub paths: ChunkPaths,
    /// Their energy.
    pub ledger: ChunkLedger,
    weight: PathWeight,
}

impl Records {
    /// Empty records for the columns of `table`.
    #[must_use]
    pub fn new(table: &CoefficientTable) -> Self {
        Self {
            paths: ChunkPaths {
                ends: Vec::with_capacity(CHUNK_EMISSIONS as usize),
                vertices: Vec::with_capacity(CHUNK_EMISSIONS as usize * EXPECTED_ARRIVALS),
            },
            ledger: ChunkLedger::new(table.bands()),
            weight: PathWeight::of(table),
        }
    }
}

impl Surroundings<'_> {
    /// Traces one packet to its end, leaving its path and its ledger in `records`.
    pub fn trace_packet(&self, emission: &Emission<'_>, stream: &mut Stream, records: &mut Records) {
        begin(emission, records);
        let mut flight = Flight {
            position: emission.position,
            departure: Departure::free(emission.position.as_vec3()),
            direction: emission.direction,
            length: 0.0,
            stretch: self.airs.as_ref().map_or(1.0, |airs| airs.stretch(emission.air)),
            deciding: emission.deciding,
            passed: Passed::None,
            passage: Passage::On,
        };
        let last = loop {
            if let Some(last) = self.step(&mut flight, stream, records) {
                break last;
            }
        };
        let Records { paths, ledger, weight } = records;
        ledger.ended(last.event().expect("made from an event"), weight.energy());
        paths.vertices.push(last);
        paths.ends.push(paths.vertices.len() as u32);
    }

    /// Carries a packet to its next vertex, which `records` get unless it is the last: that is returned.
    #[inline]
    fn step(&self, flight: &mut Flight, stream: &mut Stream, records: &mut Records) -> Option<Vertex> {
        records.ledger.segment(records.weight.energy());
        match std::mem::replace(&mut flight.passage, Passage::On) {
            Passage::On => {}
            Passage::Through(far) => {
                records.paths.vertices.push(Self::emerge(flight, &far));
                return None;
            }
            Passage::Nowhere => return Some(Vertex::nowhere(flight.position.as_vec3(), Event::Left)),
        }
        let hit = match &self.profile {
            None => self.geometry.closest_hit(flight.departure, flight.direction),
            Some(profile) => self.fly(profile, flight),
        };
        if let Some(vertex) = self.diffract(flight, hit.as_ref(), stream) {
            records.paths.vertices.push(vertex);
            return None;
        }
        let Some(hit) = hit else { return Some(self.vanish(flight)) };
        let end = hit.position.as_dvec3();
        flight.length += match &self.profile {
            None => flight.position.distance(end) * flight.stretch,
            Some((profile, speed)) => profile.travel_time(flight.position, end) * speed,
        };
        if flight.length > self.reach {
            return Some(vertex(&hit, Event::Expired));
        }
        if let Some(airs) = &self.airs
            && let Some(vertex) = self.meet_interface(airs, flight, &hit, stream)
        {
            records.paths.vertices.push(vertex);
            return None;
        }
        let event = self.meet_wall(flight, &hit, stream, records);
        let met = vertex(&hit, event);
        if event.is_final() {
            return Some(met);
        }
        records.paths.vertices.push(met);
        None
    }

    /// What becomes of a packet at a wall; where it goes on, the way on which it does.
    #[inline]
    fn meet_wall(&self, flight: &mut Flight, hit: &Hit, stream: &mut Stream, records: &mut Records) -> Event {
        let Records { ledger, weight, .. } = records;
        let frame = &self.surfaces[hit.surface.0 as usize];
        let row = &*self.table.row(hit.surface, hit.position.as_dvec3() - flight.position);
        let event = decide(row, flight.deciding, stream, ledger, weight);
        flight.direction = match event {
            Event::Specular => mirrored(flight.direction, frame.normal),
            Event::Diffuse => scattered(frame, hit.side, stream.uniform_pair()),
            Event::Transmitted => flight.direction,
            _ => return Event::Absorbed,
        };
        if weight.is_extinct(self.extinction_threshold) {
            return Event::Extinguished;
        }
        flight.passed = match (event, flight.passed) {
            (Event::Transmitted, _) => Passed::Last,
            (_, Passed::Last) => Passed::Before,
            (_, before) => before,
        };
        flight.position = hit.position.as_dvec3();
        flight.departure = self.geometry.leave(hit.position, hit.surface, hit.side);
        if event == Event::Transmitted {
            let passage = self.geometry.pass(hit);
            flight.departure = passage.map_or(flight.departure, |passage| passage.departure);
            flight.passage = match passage {
                None => Passage::Nowhere,
                Some(passage) => passage.emerged.map_or(Passage::On, Passage::Through),
            };
        }
        event
    }

    /// Takes a packet out of the face of a partition that is `far`.
    fn emerge(flight: &mut Flight, far: &Hit) -> Vertex {
        let end = far.position.as_dvec3();
        flight.length += flight.position.distance(end) * flight.stretch;
        flight.position = end;
        vertex(far, Event::Emerged)
    }

    /// What a packet meets on its arc, chord by chord, and in a closed room what it would meet after the end of the run; it then goes in the
    /// direction that it has there.
    fn fly(&self, (profile, speed): &(SpeedProfile, f64), flight: &mut Flight) -> Option<Hit> {
        let arc = Arc::leaving(*profile, flight.position, flight.direction.as_dvec3().normalize());
        let remaining = (self.reach - flight.length) / speed;
        let limit = if self.closed { remaining + profile.longest_time() } else { remaining };
        let (mut from, mut time) = (flight.departure.origin, 0.0);
        while time < limit {
            let end = arc.chord_end(time);
            let to = arc.at(end).as_vec3();
            if let Some(hit) = self.geometry.hit_on_chord(from, to) {
                let passed = profile.travel_time(flight.position, hit.position.as_dvec3());
                // The arc meets the surface elsewhere than its chord: with another direction, which many reflections would add up.
                let surface = self.geometry.surface(hit.surface);
                let offset = surface.offset - surface.normal.dot(self.geometry.center());
                let missing = offset - surface.normal.dot(arc.at(passed));
                let approach = surface.normal.dot(arc.direction(passed)) * profile.speed_at(arc.at(passed));
                let later = Some(missing / approach).filter(|later| later.abs() < end - time).unwrap_or(0.0);
                flight.direction = arc.direction(passed + later).as_vec3();
                return Some(hit);
            }
            (from, time) = (to, end);
        }
        None
    }

    /// Sends a packet on from an interface, into the other air or back: neither changes its energy, so there is nothing to record. None where it
    /// has met a wall.
    fn meet_interface(
        &self,
        airs: &Airs,
        flight: &mut Flight,
        hit: &Hit,
        stream: &mut Stream,
    ) -> Option<Vertex> {
        let [here, beyond] = airs.across(hit.surface, hit.side)?;
        let pair = airs.pair([here, beyond]);
        let normal = self.geometry.surface(hit.surface).normal;
        let direction = flight.direction.as_dvec3().normalize();
        let Refraction { reflected, onward } = refract(direction, normal, pair);
        let returns = pair[0] != pair[1] && stream.uniform_fine() < reflected;
        let (event, air, side) = match onward.filter(|_| !returns) {
            Some(onward) => {
                flight.direction = onward.as_vec3().normalize();
                (Event::Refracted, beyond, hit.side.opposite())
            }
            None => {
                flight.direction = mirrored(flight.direction, normal.as_vec3());
                (Event::Returned, here, hit.side)
            }
        };
        flight.stretch = airs.stretch(air);
        flight.position = hit.position.as_dvec3();
        flight.departure = self.geometry.leave(hit.position, hit.surface, side);
        Some(vertex(hit, event))
    }

    /// Records a packet whose path was traced before, as [`Self::trace_packet`] does for the same emission and the same random numbers,
    /// and leaves its path in `records`: nothing is cast. False where the path is not what `trace_packet` would find.
    ///
    /// Energies depend on how many packets a run has, so the ledger of a shorter run is of no use for a longer one.
    #[must_use]
    pub fn replay(
        &self,
        emission: &Emission<'_>,
        path: &[Vertex],
        stream: &mut Stream,
        records: &mut Records,
    ) -> bool {
        begin(emission, records);
        let Records { paths, ledger, weight } = records;
        let (mut last, mut position) = (None, emission.position);
        for vertex in path {
            let Some(event) = vertex.event() else { return false };
            ledger.segment(weight.energy());
            if event == Event::Diffracted {
                stream.uniform_pair();
            }
            if event.is_at_interface() {
                let airs = self.airs.as_ref().and_then(|airs| {
                    airs.across(vertex.surface(), vertex.side()).map(|across| airs.pair(across))
                });
                let Some([here, beyond]) = airs else { return false };
                if here != beyond {
                    stream.uniform_fine();
                }
            }
            if event.leaves_sonel() {
                let row = &*self.table.row(vertex.surface(), vertex.position.as_dvec3() - position);
                let drawn = decide(row, emission.deciding, stream, ledger, weight);
                let extinct = drawn != Event::Absorbed && weight.is_extinct(self.extinction_threshold);
                if event != if extinct { Event::Extinguished } else { drawn } {
                    return false;
                }
                if event == Event::Diffuse {
                    stream.uniform_pair();
                }
            }
            position = vertex.position.as_dvec3();
            last = Some(event);
        }
        let Some(last) = last else { return false };
        ledger.ended(last, weight.energy());
        paths.vertices.extend_from_slice(path);
        paths.ends.push(paths.vertices.len() as u32);
        true
    }

    /// Sends a packet on from an edge whose zone it comes into before it meets anything else, or where it does. Its energy stays
    /// what it is, so there is nothing to record.
    #[inline]
    fn diffract(&self, flight: &mut Flight, hit: Option<&Hit>, stream: &mut Stream) -> Option<Vertex> {
        let zones = self.zones.as_ref()?;
        let to = match hit {
            Some(hit) => hit.position.as_dvec3(),
            None => self.end_of_run(flight).as_dvec3(),
        };
        let caught = zones.catch(self.geometry, &Way { from: flight.position, to, hit }, flight.deciding)?;
        let length = flight.length + flight.position.distance(caught.place.as_dvec3());
        // Too late to matter: it goes straight on to its end.
        if length > self.reach {
            return None;
        }
        let (departure, direction) = caught.onward(self.geometry, stream.uniform_pair());
        *flight = Flight { position: caught.place.as_dvec3(), departure, direction, length, ..*flight };
        Some(Vertex::on_edge(caught.place, caught.edge))
    }

    /// The last vertex of a packet that met no surface: where it would be at the end of the run.
    fn vanish(&self, flight: &Flight) -> Vertex {
        let event = match flight.passed {
            Passed::Last => Event::Left,
            Passed::None if self.closed => Event::Lost,
            _ => Event::Escaped,
        };
        Vertex::nowhere(self.end_of_run(flight), event)
    }

    /// Where a packet that meets nothing is at the end of the run.
    fn end_of_run(&self, flight: &Flight) -> Vec3 {
        let remaining = self.reach - flight.length;
        if let Some((profile, speed)) = self.profile {
            let direction = flight.direction.as_dvec3().normalize();
            return Arc::leaving(profile, flight.position, direction).at(remaining / speed).as_vec3();
        }
        flight.departure.origin + flight.direction * (remaining / flight.stretch) as f32
    }
}

/// Sends a packet on its way.
#[inline]
fn begin(emission: &Emission<'_>, records: &mut Records) {
    let Records { ledger, weight, .. } = records;
    weight.emit_from(emission.source, emission.direction, emission.share, emission.start);
    ledger.emitted(emission.share, &emission.start.expected, weight.energy());
}

/// Records an arrival, and what became of the packet there.
#[inline]
fn decide(
    row: &MaterialRow,
    deciding: usize,
    stream: &mut Stream,
    ledger: &mut ChunkLedger,
    weight: &mut PathWeight,
) -> Event {
    ledger.arrived(weight.energy(), row);
    let event = draw_event(&row.thresholds[deciding], stream.uniform_fine());
    weight.pass(match event {
        Event::Specular => &row.specular,
        Event::Diffuse => &row.diffuse,
        Event::Transmitted => &row.transmitted,
        _ => return event,
    });
    event
}

fn vertex(hit: &Hit, event: Event) -> Vertex {
    Vertex::new(hit.position, hit.surface, hit.side, event)
}
