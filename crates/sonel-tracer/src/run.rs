//! All packets of a run, in chunks of constant size, handed over in order.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use sonel_geometry::{Departure, Geometry, Misplaced, NearestSide};
use sonel_map::{
    BandClasses, CHUNK_EMISSIONS, ChunkPaths, CoefficientTable, Emissions, Event, Fate, Leads, Ledger,
    MapHeader, Mode, Settings, ShardRange, SonelMap, Spectral,
};
use sonel_sampling::{Frame, Purpose, StreamFamily};
use sonel_scene::{Flight, Propagation, Scene, Source};
use thiserror::Error;

use crate::packet::{Emission, Records, TracedScene};
use crate::splitting::{SplitThresholds, UnderWay};
use crate::zone::DiffractionZones;

/// Chunks traced before they are handed over together, while the next are traced: bounds the memory, whatever the number of
/// threads.
pub const CHUNKS_IN_FLIGHT: u64 = 32;

/// Lost packets per segment beyond which a run is aborted: watertight casting measured none in 10⁸.
const LOSS_BUDGET_PER_SEGMENT: f64 = 1e-7;

/// Why a run was aborted.
#[derive(Debug, Error)]
pub enum TraceError {
    /// Packets slipped out of a watertight room.
    #[error(
        "{lost} of {packets} packets were lost through the walls of a watertight room, the first {place}; please report the scene"
    )]
    Leaking {
        /// Packets lost.
        lost: u64,
        /// Packets traced.
        packets: u64,
        /// Edge nearest to the path of the first of them.
        place: NearestSide,
    },
    /// A source is on a surface or in no air.
    #[error("source \"{name}\" at {position} m {misplaced}")]
    Misplaced {
        /// Name of the source.
        name: String,
        /// Position [m].
        position: DVec3,
        /// The obstacle.
        misplaced: Misplaced,
    },
}

/// One chunk of traced packets.
#[derive(Debug, Clone, PartialEq)]
pub struct TracedChunk {
    /// Index of the source.
    pub source: u32,
    /// Emission index of the first path.
    pub first_emission: u64,
    /// The paths.
    pub paths: ChunkPaths,
    /// Ledger.
    pub ledger: Ledger,
}

/// A scene made ready for tracing.
pub struct Tracer<'a> {
    scene: &'a Scene,
    settings: Settings,
    classes: BandClasses,
    /// Classes of leads.
    leads: BandClasses,
    surroundings: TracedScene<'a>,
    emissions: Emissions,
}

/// What the packets of a run have besides their surroundings.
struct Run<'a> {
    emissions: &'a Emissions,
    seed: u64,
    /// By source; empty where no packet is split.
    thresholds: Vec<SplitThresholds>,
}

/// Packets of the runs before a run that find its thresholds, at most a chunk: the first without splitting, the second split by the first.
pub const PILOTS: [u64; 2] = [CHUNK_EMISSIONS / 4, CHUNK_EMISSIONS];
/// Packets of these that one processor traces at a time.
const PART: u64 = 32;

impl<'a> Tracer<'a> {
    /// Prepares `scene`, whose walls are `geometry`.
    #[must_use]
    pub fn new(scene: &'a Scene, geometry: &'a Geometry, settings: Settings) -> Self {
        let bands = scene.bands.count();
        let still = vec![0.0; bands];
        let classes = BandClasses::alike(&scene.materials, &scene.sources, &still, settings.spectral);
        let Scene { materials, variants, designs, .. } = scene;
        let leads = Leads::new(materials, variants, designs, settings.survival, settings.spectral);
        let frames = geometry.surfaces().iter().map(|it| Frame::about(it.normal.as_vec3().normalize()));
        let surroundings = TracedScene {
            geometry,
            table: CoefficientTable::grouped(&scene.materials, &classes, &leads)
                .with_geometry(geometry)
                .with_propagation(Propagation::of(scene, geometry.center())),
            surfaces: frames.collect(),
            reach: scene.duration * scene.speed_of_sound,
            closed: geometry.is_watertight(),
            zones: None,
        };
        let (center, layout) = (geometry.center(), settings.layout(scene));
        let emissions = Emissions::new(scene, center, &settings, layout, &classes, leads.classes());
        Self { scene, settings, classes, leads: leads.classes().clone(), surroundings, emissions }
    }

    /// Energies beyond which packets are split, by source.
    fn thresholds(&self) -> Vec<SplitThresholds> {
        if self.settings.mode == Mode::Paper || self.settings.spectral == Spectral::PerBand {
            return Vec::new();
        }
        let [first, second] = PILOTS;
        let unsplit = self.under_way(first, Vec::new());
        let split = self.under_way(second, unsplit.iter().map(|found| found.thresholds(found)).collect());
        split.iter().zip(&unsplit).map(|(found, paced)| found.thresholds(paced)).collect()
    }

    /// Energies under way of a run of `packets` with random numbers of its own, by source.
    fn under_way(&self, packets: u64, thresholds: Vec<SplitThresholds>) -> Vec<UnderWay> {
        let settings = Settings { emissions: packets, seed: !self.settings.seed, ..self.settings };
        let (layout, center) = (settings.layout(self.scene), self.surroundings.geometry.center());
        let emissions = Emissions::new(self.scene, center, &settings, layout, &self.classes, &self.leads);
        let run = Run { emissions: &emissions, seed: settings.seed, thresholds };
        let of_source = |source| {
            // In parts, which the processors share: all packets are one chunk.
            let parts = (0..packets.div_ceil(PART)).into_par_iter().map(|part| part * PART);
            let parts = parts.map(|first| first..packets.min(first + PART));
            let parts: Vec<_> = parts.map(|part| self.trace_packets(&run, source, part, None)).collect();
            let paths = parts.iter().flat_map(|part| part.paths.from(part.first_emission));
            UnderWay::of(source, paths, &emissions, &self.surroundings.table, self.surroundings.reach)
        };
        (0..self.scene.sources.len() as u32).into_par_iter().map(of_source).collect()
    }

    /// Prepares the run that `header` states: its scene, whose walls are `geometry`, its settings, and of its effects those that
    /// are traced.
    ///
    /// # Panics
    /// When the paper's diffraction is on though bands share paths: a zone is as wide as one band's wave is long.
    #[must_use]
    pub fn of(header: &'a MapHeader, geometry: &'a Geometry) -> Self {
        let (scene, settings) = (&header.scene, header.settings);
        let mut tracer = Self::new(scene, geometry, settings);
        if settings.mode == Mode::Paper
            && let Some(wavelengths) = header.diffracted_wavelengths()
        {
            assert_eq!(settings.spectral, Spectral::PerBand, "the paper traces every band on its own");
            tracer.surroundings.zones = Some(DiffractionZones::new(geometry, &wavelengths));
        }
        tracer
    }

    /// Packets of one source in `shard`.
    #[must_use]
    pub fn packets(&self, shard: ShardRange) -> u64 {
        self.emissions.layout.emissions(self.chunks(shard)).count() as u64
    }

    /// Traces `shard` of the run. `sink` receives the chunks in the order of sources and emissions; its return value
    /// stops the run when it fails. Returns the ledger of all chunks.
    ///
    /// # Errors
    /// [`TraceError::Misplaced`] when a source is on a surface or in no air, [`TraceError::Leaking`] when that room loses
    /// packets, and that of `sink`.
    pub fn run<E: From<TraceError> + Send>(
        &self,
        shard: ShardRange,
        sink: impl FnMut(TracedChunk) -> Result<(), E> + Send,
    ) -> Result<Ledger, E> {
        self.trace(shard, None, sink)
    }

    /// Runs the whole run as [`Self::run`] does, but takes paths from `beginning`, a valid map that this [`crate::REVISION`] traced of the same scene
    /// with the same settings but fewer emissions: the same chunks come out, and only what is new is traced.
    ///
    /// # Errors
    /// The errors of [`Self::run`].
    pub fn extend<E: From<TraceError> + Send>(
        &self,
        beginning: &SonelMap,
        sink: impl FnMut(TracedChunk) -> Result<(), E> + Send,
    ) -> Result<Ledger, E> {
        self.trace(ShardRange::WHOLE, Some(beginning), sink)
    }

    fn trace<E: From<TraceError> + Send>(
        &self,
        shard: ShardRange,
        known: Option<&SonelMap>,
        mut sink: impl FnMut(TracedChunk) -> Result<(), E> + Send,
    ) -> Result<Ledger, E> {
        self.check_sources()?;
        let sources = 0..self.scene.sources.len() as u32;
        let mut groups = sources.flat_map(|source| self.groups(shard).map(move |group| (source, group)));
        let run = Run { emissions: &self.emissions, seed: self.settings.seed, thresholds: self.thresholds() };
        let trace = |(source, group): (u32, Range<u64>)| -> Vec<_> {
            let chunks = group.into_par_iter().map(|chunk| self.emissions.layout.emissions(chunk..chunk + 1));
            chunks.map(|chunk| self.trace_packets(&run, source, chunk, known)).collect()
        };
        let mut total = Ledger::new(self.scene.bands.count());
        let mut first_lost = None;
        let mut traced = groups.next().map(trace);
        while let Some(group) = traced {
            let next = groups.next();
            let hand_over = || -> Result<(), E> {
                for chunk in group {
                    total.add(&chunk.ledger);
                    first_lost = first_lost.or_else(|| self.first_lost(&chunk));
                    sink(chunk)?;
                }
                first_lost.map_or(Ok(()), |way| Ok(self.check_losses(&total, way)?))
            };
            // One group is written while the next is traced.
            let (following, handed_over) = rayon::join(|| next.map(trace), hand_over);
            handed_over?;
            traced = following;
        }
        Ok(total)
    }

    fn check_sources(&self) -> Result<(), TraceError> {
        let positions: Vec<DVec3> = self.scene.sources.iter().map(|source| source.position).collect();
        for Source { name, position, .. } in &self.scene.sources {
            if let Err(misplaced) = self.surroundings.geometry.check_place(*position, &positions) {
                return Err(TraceError::Misplaced { name: name.clone(), position: *position, misplaced });
            }
        }
        Ok(())
    }

    /// The chunks of `shard`, as many at a time as are traced together.
    fn groups(&self, shard: ShardRange) -> impl Iterator<Item = Range<u64>> {
        let chunks = self.chunks(shard);
        let end = chunks.end;
        chunks.step_by(CHUNKS_IN_FLIGHT as usize).map(move |first| first..end.min(first + CHUNKS_IN_FLIGHT))
    }

    fn chunks(&self, shard: ShardRange) -> Range<u64> {
        shard.chunks(self.emissions.layout.chunks())
    }

    /// Traces the packets of a source with some `indices`.
    fn trace_packets(
        &self,
        Run { emissions, seed, thresholds }: &Run<'_>,
        source: u32,
        indices: Range<u64>,
        known: Option<&SonelMap>,
    ) -> TracedChunk {
        let mut records = Records::new(&self.surroundings.table);
        let streams = StreamFamily::new(*seed, Purpose::Packet, [source, 0, 0, 0]);
        let (position, air) = emissions.origin(source);
        for index in indices.clone() {
            let direction = emissions.direction(source, index);
            let departure = Departure::free(position.as_vec3());
            let emission = Emission {
                flight: Flight { position, departure, direction, length: 0.0, air },
                source: &self.scene.sources[source as usize],
                deciding: self.leads.of(emissions.layout.lead(index) as usize),
                start: emissions.start(index),
                share: emissions.share(index),
                thresholds: thresholds.get(source as usize),
            };
            match known.and_then(|map| map.path(source, index)) {
                None => self.surroundings.trace_packet(&emission, &mut streams.stream(index), &mut records),
                Some(path) => self.surroundings.take_over(&emission, path.vertices, &mut records),
            }
        }
        TracedChunk {
            source,
            first_emission: indices.start,
            paths: records.paths,
            ledger: records.ledger.finish(&self.classes),
        }
    }

    /// The way of the first packet of a chunk that met no surface of a watertight room [m].
    fn first_lost(&self, chunk: &TracedChunk) -> Option<[DVec3; 2]> {
        if chunk.ledger.fates.count(Fate::Lost) == 0 {
            return None;
        }
        let vertices = &chunk.paths.vertices;
        let lost = vertices.iter().position(|vertex| vertex.event() == Some(Event::Lost))?;
        let starts = &chunk.paths.ends[..chunk.paths.ends.partition_point(|&end| end as usize <= lost)];
        let path = &vertices[starts.last().map_or(0, |&start| start as usize)..lost];
        let center = self.surroundings.geometry.center();
        let from = path.last().map_or(self.scene.sources[chunk.source as usize].position, |vertex| {
            vertex.position.as_dvec3() + center
        });
        Some([from, vertices[lost].position.as_dvec3() + center])
    }

    fn check_losses(&self, ledger: &Ledger, first: [DVec3; 2]) -> Result<(), TraceError> {
        let (lost, packets) = (ledger.fates.count(Fate::Lost), ledger.fates.total());
        if lost as f64 > 1.0 + LOSS_BUDGET_PER_SEGMENT * ledger.segments as f64 {
            let place = self.surroundings.geometry.nearest_side(first);
            return Err(TraceError::Leaking { lost, packets, place });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{BandWidth, Bands, Material};
    use sonel_geometry::Mesh;

    /// A box with a hole that is taken for watertight, and the same box whole.
    #[test]
    fn lost_packets_are_placed() {
        let traced = |triangles: usize| {
            let mut mesh = Mesh::shoebox([5.0, 4.0, 3.0], [0; 6]);
            mesh.triangles.truncate(triangles);
            let bands = Bands::new(vec![1000.0], BandWidth::Octave).unwrap();
            let scene = Scene::from_parts(mesh, vec![Material::uniform("walls", 0.1, 0.5, 1)], bands, 0.1)
                .with_source("source", [1.0, 2.0, 1.5]);
            let geometry = Geometry::build(scene.mesh.clone()).unwrap();
            let settings = Settings { emissions: 1000, ..Settings::default() };
            let mut tracer = Tracer::new(&scene, &geometry, settings);
            tracer.surroundings.closed = true;
            let traced = tracer.run(ShardRange::WHOLE, |_| Ok::<(), TraceError>(()));
            (traced.map_err(|error| error.to_string()), geometry)
        };
        assert!(traced(12).0.is_ok());
        let (error, geometry) = traced(11);
        let error = error.unwrap_err();
        let near = |ends: &[DVec3; 2]| {
            let at = |point: DVec3| point.to_array().map(|x| format!("{x:.3}")).join(", ");
            error.contains(&at(ends[0])) && error.contains(&at(ends[1]))
        };
        assert!(geometry.open_edges().iter().any(near), "{error}");
        assert!(error.contains("at the edge of triangle"), "{error}");
    }
}
