//! Traces one packet from emission to its fate.

use sonel_geometry::{Geometry, Hit};
use sonel_map::coefficients::MaterialRow;
use sonel_map::{ChunkLedger, ChunkPaths, CoefficientTable, Event, PacketStart, PathWeight, Vertex, sweep};
use sonel_sampling::{Frame, Stream};
use sonel_scene::{Flight, Interface, Refraction, Source, refract};

use crate::interaction::{draw_event, mirrored, scattered};
use crate::splitting::SplitThresholds;
use crate::zone::{DiffractionZones, Way};

/// The surroundings of a packet: what all packets of a run share.
pub struct TracedScene<'a> {
    /// Walls.
    pub geometry: &'a Geometry,
    /// Coefficients per material, and propagation between them.
    pub table: CoefficientTable,
    /// Material and frame about the front normal, per surface.
    pub surfaces: Vec<Frame>,
    /// Path length at which a packet expires [m].
    pub reach: f64,
    /// Whether a packet that meets no surface is lost rather than gone.
    pub closed: bool,
    /// Zones in which the paper's packets are diffracted; none where they are not.
    pub(crate) zones: Option<DiffractionZones>,
}

/// A packet on its way.
#[derive(Clone, Copy)]
struct Packet {
    flight: Flight,
    /// See [`Emission::deciding`].
    deciding: usize,
    passed: Passed,
    /// Event at the last partition.
    passage: Passage,
    /// Whether it leaves a wall, see [`sonel_map::Segment::leaves_wall`].
    leaves_wall: bool,
}

/// Exit of a partition.
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

/// Start of one packet.
pub struct Emission<'a> {
    /// Where and in which unit direction it leaves the source.
    pub flight: Flight,
    /// Source.
    pub source: &'a Source,
    /// Column whose probabilities decide: that of its lead.
    pub deciding: usize,
    /// Start.
    pub start: &'a PacketStart,
    /// Share of its batch in the run.
    pub share: f64,
    /// Energies beyond which packets are split; none where no packet is.
    pub thresholds: Option<&'a SplitThresholds>,
}

/// Times that a packet and those that it becomes are split: where hardly one packet in a thousand finds the way into a room of long decay, the few
/// that [`SplitThresholds`] were found from did not, and those that do would become thousands.
const MOST_SPLITS: u32 = 64;

/// Records of packets.
pub struct Records {
    /// Paths.
    pub paths: ChunkPaths,
    /// Ledger of their energy.
    pub ledger: ChunkLedger,
    weight: PathWeight,
}

impl Records {
    /// Empty records for the columns of `table`.
    #[must_use]
    pub fn new(table: &CoefficientTable) -> Self {
        Self {
            paths: ChunkPaths::default(),
            ledger: ChunkLedger::new(table.bands()),
            weight: PathWeight::of(table),
        }
    }
}

impl TracedScene<'_> {
    /// Traces one packet to its end, leaving its path and its ledger in `records`.
    pub fn trace_packet(&self, emission: &Emission<'_>, stream: &mut Stream, records: &mut Records) {
        begin(emission, records);
        let Emission { flight, deciding, thresholds, .. } = *emission;
        let (passed, passage) = (Passed::None, Passage::On);
        let mut packet = Packet { flight, deciding, passed, passage, leaves_wall: false };
        let (mut second, mut splits) = (Vec::new(), 0);
        loop {
            let Some(last) = self.step(&mut packet, stream, records) else {
                let is_much = |of: &SplitThresholds| of.is_exceeded(&records.weight, packet.flight.length);
                if packet.leaves_wall && splits < MOST_SPLITS && thresholds.is_some_and(is_much) {
                    splits += 1;
                    let place = packet.flight.position.as_vec3();
                    records.paths.vertices.push(Vertex::nowhere(place, Event::Split));
                    records.weight.halve();
                    second.push((packet, records.weight.clone()));
                }
                continue;
            };
            records.ledger.ended(last.event().expect("made from an event"), records.weight.energy());
            records.paths.vertices.push(last);
            let Some(branched) = second.pop() else { break };
            (packet, records.weight) = branched;
        }
        records.ledger.close();
        records.paths.ends.push(records.paths.vertices.len() as u32);
    }

    /// Carries a packet to its next vertex, which `records` get unless it is the last: that is returned.
    #[inline]
    fn step(&self, packet: &mut Packet, stream: &mut Stream, records: &mut Records) -> Option<Vertex> {
        records.ledger.segment(records.weight.energy(), std::mem::take(&mut packet.leaves_wall));
        match std::mem::replace(&mut packet.passage, Passage::On) {
            Passage::On => {}
            Passage::Through(far) => {
                records.paths.vertices.push(self.emerge(&mut packet.flight, &far));
                return None;
            }
            Passage::Nowhere => {
                return Some(Vertex::nowhere(packet.flight.position.as_vec3(), Event::Left));
            }
        }
        let propagation = self.table.propagation();
        let hit = propagation.advance(self.geometry, &mut packet.flight, self.reach);
        if let Some(vertex) = self.diffract(packet, hit.as_ref(), stream) {
            records.paths.vertices.push(vertex);
            return None;
        }
        let Some(hit) = hit else { return Some(self.vanish(packet)) };
        let flight = &mut packet.flight;
        flight.length += propagation.length(flight.air, flight.position, hit.position.as_dvec3());
        if flight.length > self.reach {
            return Some(vertex(&hit, Event::Expired));
        }
        if let Some(interface) = propagation.interface(hit.surface, hit.side) {
            records.paths.vertices.push(self.meet_interface(interface, flight, &hit, stream));
            return None;
        }
        let event = self.meet_wall(packet, &hit, stream, records);
        let met = vertex(&hit, event);
        if event.is_final() {
            return Some(met);
        }
        records.paths.vertices.push(met);
        None
    }

    /// What becomes of a packet at a wall; where it goes on, the way on which it does.
    #[inline]
    fn meet_wall(&self, packet: &mut Packet, hit: &Hit, stream: &mut Stream, records: &mut Records) -> Event {
        let Records { ledger, weight, .. } = records;
        let flight = &mut packet.flight;
        let frame = &self.surfaces[hit.surface.0 as usize];
        let row = &*self.table.row(hit.surface, hit.position.as_dvec3() - flight.position);
        let event = decide(row, packet.deciding, stream, ledger, weight);
        flight.direction = match event {
            Event::Specular => mirrored(flight.direction, frame.normal),
            Event::Diffuse => scattered(frame, hit.side, stream.uniform_pair()),
            Event::Transmitted => flight.direction,
            _ => return Event::Absorbed,
        };
        packet.leaves_wall = true;
        packet.passed = match (event, packet.passed) {
            (Event::Transmitted, _) => Passed::Last,
            (_, Passed::Last) => Passed::Before,
            (_, before) => before,
        };
        flight.position = hit.position.as_dvec3();
        flight.departure = self.geometry.leave(hit.position, hit.surface, hit.side);
        if event == Event::Transmitted {
            let passage = self.geometry.pass(hit);
            flight.departure = passage.map_or(flight.departure, |passage| passage.departure);
            packet.passage = match passage {
                None => Passage::Nowhere,
                Some(passage) => passage.emerged.map_or(Passage::On, Passage::Through),
            };
        }
        event
    }

    /// Takes a packet out of the face of a partition that is `far`.
    fn emerge(&self, flight: &mut Flight, far: &Hit) -> Vertex {
        let end = far.position.as_dvec3();
        flight.length += flight.position.distance(end) * self.table.propagation().stretch(flight.air, end);
        flight.position = end;
        vertex(far, Event::Emerged)
    }

    /// Sends a packet on from an interface, into the other air or back: neither changes its energy, so there is nothing to record.
    fn meet_interface(
        &self,
        Interface { airs: [here, beyond], sides }: Interface,
        flight: &mut Flight,
        hit: &Hit,
        stream: &mut Stream,
    ) -> Vertex {
        let normal = self.geometry.surface(hit.surface).normal;
        let direction = flight.direction.as_dvec3().normalize();
        let Refraction { reflected, onward } = refract(direction, normal, sides);
        let returns = sides[0] != sides[1] && stream.uniform_fine() < reflected;
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
        flight.air = air;
        flight.position = hit.position.as_dvec3();
        flight.departure = self.geometry.leave(hit.position, hit.surface, side);
        vertex(hit, event)
    }

    /// Takes over a `path` that was traced before, as [`Self::trace_packet`] would trace it: nothing is cast.
    ///
    /// Energies depend on how many packets a run has, so the ledger of a shorter run is of no use for a longer one.
    pub fn take_over(&self, emission: &Emission<'_>, path: &[Vertex], records: &mut Records) {
        begin(emission, records);
        let Records { paths, ledger, weight } = records;
        let Flight { position: from, air, .. } = emission.flight;
        sweep((from, air), path, &self.table, weight, |segment| {
            if segment.is_part {
                return;
            }
            ledger.segment(segment.energy, segment.leaves_wall);
            if let Some(arrival) = segment.arrival {
                ledger.arrived(segment.energy, &self.table.row(arrival.surface, segment.direction()));
            }
            if segment.event.is_final() {
                ledger.ended(segment.event, segment.energy);
            }
        });
        ledger.close();
        paths.vertices.extend_from_slice(path);
        paths.ends.push(paths.vertices.len() as u32);
    }

    /// Sends a packet on from an edge whose zone it comes into before it meets anything else, or where it does. Its energy stays
    /// what it is, so there is nothing to record.
    #[inline]
    fn diffract(&self, packet: &mut Packet, hit: Option<&Hit>, stream: &mut Stream) -> Option<Vertex> {
        let zones = self.zones.as_ref()?;
        let flight = &mut packet.flight;
        let to = hit.map_or_else(|| self.table.propagation().end(flight, self.reach), |hit| hit.position);
        let way = Way { from: flight.position, to: to.as_dvec3(), hit };
        let caught = zones.catch(self.geometry, &way, packet.deciding)?;
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
    fn vanish(&self, packet: &Packet) -> Vertex {
        let event = match packet.passed {
            Passed::Last => Event::Left,
            Passed::None if self.closed => Event::Lost,
            _ => Event::Escaped,
        };
        Vertex::nowhere(self.table.propagation().end(&packet.flight, self.reach), event)
    }
}

/// Sends a packet on its way.
#[inline]
fn begin(emission: &Emission<'_>, records: &mut Records) {
    let Records { ledger, weight, .. } = records;
    weight.emit_from(emission.source, emission.flight.direction, emission.share, emission.start);
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
