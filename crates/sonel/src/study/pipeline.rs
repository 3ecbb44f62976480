//! The stages: a scene traced, its map rendered and its parameters read, with what each phase costs.
//!
//! Runs, pilots and studies call these functions, so that a pilot costs what a run does. Where the map is kept is the caller's choice
//! ([`MapStore`]; [`InMemory`] for short runs), and so is the clock ([`Observer::clock`]). Tracing and rendering are separate, so that one map can be
//! rendered in several ways.

use std::io::{Cursor, Seek, Write};

use sonel_acoustics::Material;
use sonel_analysis::{Parameter, ReceiverParameters};
use sonel_echogram::Response;
use sonel_geometry::Geometry;
use sonel_map::{EffectState, Ledger, MapError, MapHeader, MapWriter, Settings, ShardRange, SonelMap};
use sonel_renderer::{ReceiverPoint, RenderSettings};
use sonel_scene::Scene;
use sonel_tracer::{TracedChunk, Tracer};

use crate::observer::{Observer, Watch};
use crate::study::job::Job;
use crate::{Error, Result};

pub use crate::study::job::{RenderSeconds, RenderedMap};

/// Storage of a map while it is tried.
pub trait MapStore {
    /// File that the map is written to.
    type Writer: Write + Seek + Send;

    /// Begins a map.
    ///
    /// # Errors
    /// When there is no room for it.
    fn begin(&mut self) -> std::io::Result<Self::Writer>;

    /// Opens the map that was written.
    ///
    /// # Errors
    /// When it cannot be read.
    fn open(&mut self, written: Self::Writer) -> std::result::Result<SonelMap, MapError>;
}

/// Maps in memory: about 16 bytes a vertex, twice that while a map is opened.
#[derive(Debug, Clone, Copy, Default)]
pub struct InMemory;

impl MapStore for InMemory {
    type Writer = Cursor<Vec<u8>>;

    fn begin(&mut self) -> std::io::Result<Self::Writer> {
        Ok(Cursor::new(Vec::new()))
    }

    fn open(&mut self, written: Self::Writer) -> std::result::Result<SonelMap, MapError> {
        SonelMap::from_bytes(written.get_ref())
    }
}

/// A scene and its walls, ready for any number of trials.
#[derive(Clone)]
pub struct Room<'a> {
    scene: &'a Scene,
    effects: &'a [EffectState],
    geometry: &'a Geometry,
}

/// A traced map and what it cost.
pub struct TracedMap {
    /// The map.
    pub map: SonelMap,
    /// The ledger as the tracer kept it.
    pub ledger: Ledger,
    /// What it cost.
    pub seconds: TraceSeconds,
}

/// CPU seconds of tracing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TraceSeconds {
    /// Packets [s].
    pub trace: f64,
    /// Writing the map and its checksums [s].
    pub write: f64,
    /// Opening it [s].
    pub open: f64,
}

impl TraceSeconds {
    /// All of it.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.trace + self.write + self.open
    }
}

impl<'a> Room<'a> {
    /// Makes `scene` with the walls `geometry` ready. `effects` are those that [`crate::study::effects::decide`] decided for it; they go into the maps.
    #[must_use]
    pub fn within(scene: &'a Scene, geometry: &'a Geometry, effects: &'a [EffectState]) -> Self {
        Self { scene, effects, geometry }
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Walls.
    #[must_use]
    pub fn geometry(&self) -> &'a Geometry {
        self.geometry
    }

    /// Traces the whole run into a map.
    ///
    /// # Errors
    /// When the room leaks or the map cannot be stored.
    pub fn trace(
        &self,
        settings: Settings,
        store: &mut impl MapStore,
        observer: &dyn Observer,
    ) -> Result<TracedMap> {
        trace(&self.whole_run(settings), self.geometry, None, store, observer)
    }

    /// The provenance of the whole run with `settings`.
    #[must_use]
    pub fn whole_run(&self, settings: Settings) -> MapHeader {
        whole_run(self.scene, self.effects.to_vec(), settings)
    }
}

/// The provenance of a whole run of `scene` with `settings`, whose map states `effects`.
#[must_use]
pub fn whole_run(scene: &Scene, effects: Vec<EffectState>, settings: Settings) -> MapHeader {
    let tool_version = env!("CARGO_PKG_VERSION").to_owned();
    MapHeader { tool_version, settings, shard: ShardRange::WHOLE, effects, scene: scene.clone() }
}

/// Traces the run of `header`, whose walls are `geometry`, into `store`: all of its shard, or what it has beyond the map `beginning`.
///
/// # Errors
/// When the room leaks or the map cannot be stored; [`Error::Stopped`].
pub fn trace(
    header: &MapHeader,
    geometry: &Geometry,
    beginning: Option<&SonelMap>,
    store: &mut impl MapStore,
    observer: &dyn Observer,
) -> Result<TracedMap> {
    const STEP: &str = "tracing";
    let watch = Watch(observer);
    let clock = watch.clock();
    let begin = clock.process();
    let tracer = Tracer::of(header, geometry);
    let total = tracer.packets(header.shard) * header.scene.sources.len() as u64;
    let mut writer = MapWriter::begin(store.begin()?).map_err(Error::Write)?;
    let (mut done, mut write) = (0, 0.0);
    let sink = |chunk: TracedChunk| {
        done += chunk.paths.ends.len() as u64;
        watch.progress(STEP, done as f64 / total.max(1) as f64)?;
        // Other threads trace meanwhile; only this one writes.
        let before = clock.thread();
        let pushed = writer.push_chunk(chunk.source, chunk.first_emission, &chunk.paths, &chunk.ledger);
        write += clock.thread() - before;
        pushed.map_err(Error::Write)
    };
    let ledger = match beginning {
        Some(beginning) => tracer.extend(beginning, sink),
        None => tracer.run(header.shard, sink),
    }?;
    watch.progress(STEP, 1.0)?;
    let traced = clock.process() - begin - write;
    let before = clock.process();
    let written = writer.finish(header, geometry).map_err(Error::Write)?;
    let finished = clock.process();
    let map = store.open(written)?;
    let seconds =
        TraceSeconds { trace: traced, write: write + finished - before, open: clock.process() - finished };
    Ok(TracedMap { map, ledger, seconds })
}

/// Renders every source of `map`, whose walls are `geometry`, at `receivers` and reads the parameters, source by source and receiver by
/// receiver.
///
/// # Errors
/// When a receiver is impossible, a setting out of range, or the map damaged; [`Error::Stopped`].
pub fn render_and_read(
    map: &SonelMap,
    geometry: &Geometry,
    receivers: &[ReceiverPoint],
    settings: &RenderSettings,
    observer: &dyn Observer,
) -> Result<(RenderedMap, Vec<ReceiverParameters>)> {
    Job::of(map, geometry, receivers, Watch(observer)).read(settings, &Parameter::ALL)
}

/// The response of `map` and, behind its bands, of variants of its materials: they share packets, rays and random numbers with it, so that
/// differences have hardly any noise of their own. Edges do not diffract, and what reveals the bias of discs is left out: it is the same in
/// all variants. So is the provenance.
///
/// # Errors
/// When the map cannot be rendered; [`Error::Stopped`].
pub fn render_variants(
    map: &mut SonelMap,
    geometry: &Geometry,
    receivers: &[ReceiverPoint],
    settings: &RenderSettings,
    variants: &[Vec<Material>],
    observer: &dyn Observer,
) -> Result<Response> {
    let before = map.widen(variants);
    let settings = RenderSettings { edges: false, ..settings.clone() };
    let rendered = Job::of(map, geometry, receivers, Watch(observer)).render(&settings);
    map.narrow(before);
    let mut response = Response { provenance: Default::default(), ..rendered?.response };
    response.batches.iter_mut().for_each(|batches| batches.kernel_difference.clear());
    Ok(response)
}
