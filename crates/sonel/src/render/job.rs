//! A rendering and its provenance.

use std::f64::consts::LOG10_E;
use std::sync::{Arc, LazyLock};

use serde_json::{Value, json};
use sonel_acoustics::{Directivity, Material, energy_to_level_db};
use sonel_echogram::{Response, side_by_side};
use sonel_geometry::Geometry;
use sonel_map::{SonelMap, hexadecimal};
use sonel_renderer::{Columns, ReceiverPoint, RenderSettings, Renderer, Rendering};
use sonel_scene::{Scene, Source};
use sonel_study::forecast::Effort;
use sonel_study::plan::RenderLoad;
use sonel_study::response::{self, PART};

use crate::Result;
use crate::error::At;
use crate::feasible::Demand;
use crate::observer::Watch;
use crate::prepared::Prepared;
use crate::version::version;

/// Version of the renderer, as responses state it.
pub static VERSION: LazyLock<String> = LazyLock::new(|| version(sonel_renderer::REVISION));

/// CPU time for a sonel at a receiver [s], with its share of rays and edges: 0.25 µs in the hall and an office (docs/planning.md), a fifth of
/// that in a shoebox.
const SECONDS_PER_SONEL: f64 = 0.25e-6;

/// Map and receivers of a rendering.
#[derive(Clone, Copy)]
pub(super) struct Job<'a> {
    /// The map.
    pub map: &'a SonelMap,
    /// Walls.
    pub geometry: &'a Arc<Geometry>,
    /// Name of the map in messages.
    pub label: &'a str,
    /// Earlier preparation of the map.
    pub prepared: &'a Prepared,
    /// Number of batches; by default all.
    pub batches: Option<u32>,
    /// Own memory that it may take [bytes].
    pub memory: Option<f64>,
    /// Receivers.
    pub receivers: &'a [ReceiverPoint],
    /// Observer.
    pub watch: Watch<'a>,
}

/// Result of a rendering.
pub(super) struct Run<'a> {
    /// By whom.
    pub renderer: Renderer<'a>,
    /// Settings.
    pub settings: RenderSettings,
    /// The response.
    pub response: Response,
    /// (wall, CPU) seconds by the observer's clock when rendering itself began.
    pub opened: (f64, f64),
    /// CPU seconds of checking the map and rendering.
    pub seconds: f64,
}

impl<'a> Job<'a> {
    /// Renders with `settings`.
    pub(super) fn render(&self, settings: RenderSettings) -> Result<Run<'a>> {
        const STEP: &str = "rendering";
        let Self { map, geometry, label, receivers, watch, .. } = *self;
        let begin = watch.seconds().1;
        let renderer = self.prepared.renderer(map, geometry, &settings);
        let renderer = renderer.and_then(|renderer| match self.batches {
            Some(count) => renderer.with_batches(count),
            None => Ok(renderer),
        });
        let renderer = renderer.at(|| label.to_owned())?;
        self.demand(&renderer, &settings).admit(self.memory, "give fewer receivers or wider bins", watch)?;
        let opened = watch.seconds();
        renderer.check_receivers(receivers)?;
        let parts = receivers.chunks(PART).enumerate().map(|(part, some)| {
            let sources = map.header().scene.sources.len();
            let all = (receivers.len().div_ceil(PART) * sources) as f64;
            let progress =
                |source, share| watch.progress(STEP, ((part * sources + source) as f64 + share) / all);
            self.part(&renderer, &settings, some, progress)
        });
        let response = side_by_side(parts.collect::<Result<_>>()?);
        map.require_unchanged().at(|| label.to_owned())?;
        watch.progress(STEP, 1.0);
        let seconds = watch.seconds().1 - begin;
        Ok(Run { renderer, settings, response, opened, seconds })
    }

    /// The response of some of the receivers; `progress` receives the index of the source and the share of it that is done.
    fn part(
        &self,
        renderer: &Renderer<'_>,
        settings: &RenderSettings,
        receivers: &[ReceiverPoint],
        progress: impl Fn(usize, f64) + Send + Sync,
    ) -> Result<Response> {
        let Self { map, prepared, .. } = *self;
        let mut sums = match prepared.sums(map, settings, receivers, renderer.batches()) {
            Some(sums) => sums,
            None => response::begin(map, renderer, receivers)?,
        };
        for (source, sums) in sums.iter_mut().enumerate() {
            renderer.extend(sums, &mut |share| progress(source, share));
        }
        if renderer.batches() < map.header().settings.batches && self.receivers.len() <= PART {
            prepared.keep_sums(map, settings, receivers, renderer.batches(), &sums);
        }
        let renderings: Vec<Rendering> = sums.into_iter().map(|sums| renderer.finish(sums)).collect();
        let response = response::assemble(map, renderer, receivers, &renderings);
        Ok(Response { metadata: metadata(map, renderer, settings, &renderings), ..response })
    }
    /// What a rendering takes.
    fn demand(&self, renderer: &Renderer<'_>, settings: &RenderSettings) -> Demand {
        let traced = self.map.header().settings;
        let scene = &self.map.header().scene;
        let pairs = scene.sources.len() as f64 * self.receivers.len() as f64;
        let sonels = self.map.vertex_count() as f64 / scene.sources.len() as f64;
        let rays = settings.rays(traced.emissions);
        let effort = Effort { emissions: traced.emissions, rays, batches: renderer.batches() };
        let load = RenderLoad {
            columns: if settings.directions { Columns::DIRECTED } else { Columns::PLAIN },
            casts_rays: renderer.gathers_by_mirrors(),
            segments: sonels / traced.emissions.max(1) as f64,
        };
        Demand {
            cpu_seconds: SECONDS_PER_SONEL * sonels * pairs,
            map_bytes: 0.0,
            memory_bytes: load.memory(effort, scene, self.receivers.len(), settings.bin),
        }
    }
}

/// Provenance: everything that decided the response and nothing that depends on machine or clock.
fn metadata(
    map: &SonelMap,
    renderer: &Renderer<'_>,
    settings: &RenderSettings,
    renderings: &[Rendering],
) -> Value {
    let header = map.header();
    let sources = renderings.iter().zip(&header.scene.sources);
    let mut metadata = json!({
        "tool": "sonel-render",
        "tool_version": *VERSION,
        "scene": header.scene.name,
        "scene_digest": hexadecimal(&header.scene.digest),
        "mesh_digest": hexadecimal(&header.scene.mesh_digest),
        "map_digest": hexadecimal(&map.digest()),
        "map_tool_version": header.tool_version,
        "seed": settings.seed.unwrap_or(header.settings.seed),
        "emissions": header.settings.emissions,
        "batches": header.settings.batches,
        "up": header.scene.up.to_array(),
        "survival": header.settings.survival,
        "options": {
            "bin_s": settings.bin,
            "estimator": settings.estimator.name(),
            "order": settings.mirror_order,
            "rays": settings.rays(header.settings.emissions),
            "radius_m": settings.gather_radius,
            "air_attenuation": renderer.attenuation(),
        },
        "sources": sources.map(|(rendering, source)| shares(renderer, rendering, source)).collect::<Vec<_>>(),
    });
    if let Some(volume) = renderer.volume() {
        metadata["volume_m3"] = volume.into();
    }
    if renderer.batches() < header.settings.batches {
        metadata["options"]["batches"] = renderer.batches().into();
    }
    if settings.directions {
        metadata["options"]["directions"] = true.into();
    }
    if map.drawn_with().is_some() {
        metadata["options"]["changed"] = changes(&header.scene);
    }
    metadata
}

/// Materials and directivities in use.
fn changes(scene: &Scene) -> Value {
    let materials: serde_json::Map<String, Value> = scene
        .materials
        .iter()
        .map(|Material { name, absorption, scattering, transmission, .. }| {
            let coefficients =
                json!({ "absorption": absorption, "scattering": scattering, "transmission": transmission });
            (name.clone(), coefficients)
        })
        .collect();
    let directivities: serde_json::Map<String, Value> =
        scene.sources.iter().map(|source| (source.name.clone(), directivity(&source.directivity))).collect();
    json!({ "materials": materials, "directivities": directivities })
}

/// Orders and energy per path class of one source, with the gain and delay that its scene states.
fn shares(renderer: &Renderer<'_>, rendering: &Rendering, source: &Source) -> Value {
    let bands = source.power_level_db.len();
    let classes: Vec<Value> = renderer
        .path_classes()
        .map(|class| {
            let energy: Vec<&[f64]> = rendering.class_energies[class as usize].chunks(bands).collect();
            let samples = |receiver: usize| -> Vec<Option<f64>> {
                (0..bands).map(|band| rendering.effective_sample_size(class, receiver, band)).collect()
            };
            json!({
                "class": class.notation(),
                "estimator": renderer.owner(class),
                "reason": renderer.reason(class, rendering.mirror_order),
                "energy": energy,
                "effective_sample_size": (0..energy.len()).map(samples).collect::<Vec<_>>(),
            })
        })
        .collect();
    let edges: Vec<Value> = rendering
        .edge_work
        .iter()
        .map(|work| json!({ "computed": work.computed, "dropped_db": 10.0 * LOG10_E * libm::log1p(work.dropped) }))
        .collect();
    let mut shares = json!({
        "mirror_order": rendering.mirror_order,
        "image_order": rendering.image_order,
        "sphere_radius_m": rendering.sphere_radius,
        "edges": edges,
        "classes": classes,
    });
    if !source.change.is_none() {
        shares["gain_db"] = source.change.gain_db.into();
        shares["delay_s"] = source.change.delay.into();
    }
    shares
}

/// A pattern's name; of a file also its directivity index per band and the side that is up.
pub(super) fn directivity(directivity: &Directivity) -> Value {
    match directivity {
        Directivity::Pattern(pattern) => json!(pattern.name()),
        Directivity::Measured { balloon, up } => {
            let bands = 0..balloon.shape()[2];
            let index: Vec<f64> = bands.map(|band| energy_to_level_db(balloon.on_axis(band))).collect();
            json!({ "file": balloon.name(), "directivity_index_db": index, "up": up.to_array() })
        }
    }
}
