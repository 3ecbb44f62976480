//! The stages: a scene traced, its map rendered and its parameters read, with what each phase costs.
//!
//! Runs, pilots and studies call these functions, so that a pilot costs what a run does. Where the map is kept is the caller's choice
//! ([`MapStore`]; [`InMemory`] for short runs), and so is the clock ([`Clock`]). Tracing and rendering are separate, so that one map can be
//! rendered in several ways.

use std::io::{Cursor, Seek, Write};
use std::sync::Arc;

use sonel_analysis::{ReceiverParameters, parameters};
use sonel_echogram::Response;
use sonel_geometry::Geometry;
use sonel_map::{EffectState, Ledger, MapError, MapHeader, MapWriter, Settings, ShardRange, SonelMap};
use sonel_renderer::{ReceiverPoint, RenderSettings, Renderer, Rendering};
use sonel_scene::Scene;
use sonel_tracer::{TracedChunk, Tracer};

use crate::study::response;
use crate::{Error, Result};

/// Seconds since any moments, which must not change during a run.
pub trait Clock: Sync {
    /// Time of the clock on the wall [s].
    fn wall(&self) -> f64;
    /// CPU time of all threads of the process [s].
    fn process(&self) -> f64;
    /// CPU time of the thread that asks [s].
    fn thread(&self) -> f64;
}

/// For trials whose cost does not matter: it is always the same time.
#[derive(Debug, Clone, Copy)]
pub struct NoClock;

impl Clock for NoClock {
    fn wall(&self) -> f64 {
        0.0
    }

    fn process(&self) -> f64 {
        0.0
    }

    fn thread(&self) -> f64 {
        0.0
    }
}

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
pub struct Room<'a> {
    scene: &'a Scene,
    effects: Vec<EffectState>,
    geometry: Arc<Geometry>,
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

/// The rendering of a map, and what it cost.
pub struct Rendered {
    /// By source.
    pub renderings: Vec<Rendering>,
    /// Echograms and batches.
    pub response: Response,
    /// Value and interval of every parameter, source by source and receiver by receiver.
    pub parameters: Vec<ReceiverParameters>,
    /// Whether visibility rays were cast.
    pub casts_rays: bool,
    /// What it cost.
    pub seconds: RenderSeconds,
}

/// CPU seconds of rendering.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RenderSeconds {
    /// Checking every path, laying out surfaces [s].
    pub prepare: f64,
    /// Direct sound, image-source paths and edges [s].
    pub deterministic: f64,
    /// Sweeping the paths: connections, gather and crossings together [s].
    pub sweep: f64,
    /// Reading the parameters with their intervals [s].
    pub parameters: f64,
}

impl TraceSeconds {
    /// All of it.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.trace + self.write + self.open
    }
}

impl RenderSeconds {
    /// All of it.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.prepare + self.deterministic + self.sweep + self.parameters
    }
}

impl<'a> Room<'a> {
    /// Makes `scene` with the walls `geometry` ready. `effects` are those that [`crate::study::effects::decide`] decided for it; they go into the maps.
    #[must_use]
    pub fn within(scene: &'a Scene, geometry: impl Into<Arc<Geometry>>, effects: Vec<EffectState>) -> Self {
        Self { scene, effects, geometry: geometry.into() }
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Walls.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Traces the whole run into a map.
    ///
    /// # Errors
    /// When the room leaks or the map cannot be stored.
    pub fn trace(
        &self,
        settings: Settings,
        store: &mut impl MapStore,
        clock: &dyn Clock,
    ) -> Result<TracedMap> {
        trace(&self.whole_run(settings), &self.geometry, None, store, clock, &mut |_| {})
    }

    /// The provenance of the whole run with `settings`.
    #[must_use]
    pub fn whole_run(&self, settings: Settings) -> MapHeader {
        whole_run(self.scene, self.effects.clone(), settings)
    }
}

/// The provenance of a whole run of `scene` with `settings`, whose map states `effects`.
#[must_use]
pub fn whole_run(scene: &Scene, effects: Vec<EffectState>, settings: Settings) -> MapHeader {
    let tool_version = env!("CARGO_PKG_VERSION").to_owned();
    MapHeader { tool_version, settings, shard: ShardRange::WHOLE, effects, scene: scene.clone() }
}

/// Traces the run of `header`, whose walls are `geometry`, into `store`: all of its shard, or what it has beyond the map `beginning`.
/// `progress` receives the share that is done.
///
/// # Errors
/// When the room leaks or the map cannot be stored.
pub fn trace(
    header: &MapHeader,
    geometry: &Geometry,
    beginning: Option<&SonelMap>,
    store: &mut impl MapStore,
    clock: &dyn Clock,
    progress: &mut (dyn FnMut(f64) + Send),
) -> Result<TracedMap> {
    let begin = clock.process();
    let tracer = Tracer::of(header, geometry);
    let total = tracer.packets(header.shard) * header.scene.sources.len() as u64;
    let mut writer = MapWriter::begin(store.begin()?).map_err(Error::Write)?;
    let (mut done, mut write) = (0, 0.0);
    let sink = |chunk: TracedChunk| {
        done += chunk.paths.ends.len() as u64;
        progress(done as f64 / total.max(1) as f64);
        // Other threads trace meanwhile; only this one writes.
        let before = clock.thread();
        let pushed = writer.push_chunk(chunk.source, chunk.first_emission, &chunk.paths, &chunk.ledger);
        write += clock.thread() - before;
        pushed
    };
    let ledger = match beginning {
        Some(beginning) => tracer.extend(beginning, sink),
        None => tracer.run(header.shard, sink),
    }?;
    progress(1.0);
    let traced = clock.process() - begin - write;
    let before = clock.process();
    let written = writer.finish(header, geometry).map_err(Error::Write)?;
    let finished = clock.process();
    let map = store.open(written)?;
    let seconds =
        TraceSeconds { trace: traced, write: write + finished - before, open: clock.process() - finished };
    Ok(TracedMap { map, ledger, seconds })
}

/// Renders every source of `map`, whose walls are `geometry`, at `receivers` and reads the parameters.
///
/// # Errors
/// When a receiver is impossible, a setting out of range, or the map damaged.
pub fn render_and_read(
    map: &SonelMap,
    geometry: &Geometry,
    receivers: &[ReceiverPoint],
    settings: &RenderSettings,
    clock: &dyn Clock,
) -> Result<Rendered> {
    let mut seconds = RenderSeconds::default();
    let begin = clock.process();
    let renderer = Renderer::new(map, geometry, settings.clone())?;
    seconds.prepare = clock.process() - begin;
    let (mut last, mut sweeping) = (clock.process(), None);
    let renderings = response::render(map, &renderer, receivers, &mut |source, share| {
        let now = clock.process();
        // What is deterministic is done before the first report of a source and after that of its last batch.
        if sweeping == Some(source) {
            seconds.sweep += now - last;
        } else {
            seconds.deterministic += now - last;
        }
        (last, sweeping) = (now, Some(source).filter(|_| share < 1.0));
    })?;
    let begin = clock.process();
    let response = response::assemble(map, &renderer, receivers, &renderings);
    let parameters = parameters(&response);
    seconds.parameters = clock.process() - begin;
    let casts_rays = renderer.casts_rays(receivers);
    Ok(Rendered { renderings, response, parameters, casts_rays, seconds })
}
