//! A rendering and its provenance.

use std::f64::consts::LOG10_E;
use std::sync::{Arc, LazyLock};

use serde_json::{Value, json};
use sonel_acoustics::{Directivity, Material, energy_to_level_db};
use sonel_echogram::Response;
use sonel_geometry::Geometry;
use sonel_map::{SonelMap, hexadecimal};
use sonel_renderer::{Columns, ReceiverPoint, RenderSettings, Renderer, Rendering};
use sonel_scene::Source;
use sonel_study::forecast::Effort;
use sonel_study::plan::RenderLoad;
use sonel_study::response;

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
    /// From which map.
    pub map: &'a SonelMap,
    /// By whom.
    pub renderer: Renderer<'a>,
    /// Settings.
    pub settings: RenderSettings,
    /// By source.
    pub renderings: Vec<Rendering>,
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
        let sources = map.header().scene.sources.len() as f64;
        let mut sums = match self.prepared.sums(map, &settings, receivers, renderer.batches()) {
            Some(sums) => sums,
            None => response::begin(map, &renderer, receivers)?,
        };
        for (source, sums) in sums.iter_mut().enumerate() {
            renderer.extend(sums, &mut |share| watch.progress(STEP, (source as f64 + share) / sources));
        }
        if renderer.batches() < map.header().settings.batches {
            self.prepared.keep_sums(map, &settings, receivers, renderer.batches(), &sums);
        }
        let renderings: Vec<Rendering> = sums.into_iter().map(|sums| renderer.finish(sums)).collect();
        map.require_unchanged().at(|| label.to_owned())?;
        watch.progress(STEP, 1.0);
        let seconds = watch.seconds().1 - begin;
        let response = response::assemble(map, &renderer, receivers, &renderings);
        let run = Run { map, renderer, settings, renderings, response, opened, seconds };
        let metadata = run.metadata();
        Ok(Run { response: Response { metadata, ..run.response }, ..run })
    }
}

impl Job<'_> {
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

impl Run<'_> {
    /// Provenance: everything that decided the response and nothing that depends on machine or clock.
    fn metadata(&self) -> Value {
        let header = self.map.header();
        let mut metadata = json!({
            "tool": "sonel-render",
            "tool_version": *VERSION,
            "scene": header.scene.name,
            "scene_digest": hexadecimal(&header.scene.digest),
            "mesh_digest": hexadecimal(&header.scene.mesh_digest),
            "map_digest": hexadecimal(&self.map.digest()),
            "map_tool_version": header.tool_version,
            "seed": self.settings.seed.unwrap_or(header.settings.seed),
            "emissions": header.settings.emissions,
            "batches": header.settings.batches,
            "up": header.scene.up.to_array(),
            "survival": header.settings.survival,
            "options": {
                "bin_s": self.settings.bin,
                "estimator": self.settings.estimator.name(),
                "order": self.settings.mirror_order,
                "rays": self.settings.rays(header.settings.emissions),
                "radius_m": self.settings.gather_radius,
                "air_attenuation": self.renderer.attenuation(),
            },
            "sources": self.renderings.iter().zip(&header.scene.sources).map(|(rendering, source)| self.shares(rendering, source)).collect::<Vec<_>>(),
        });
        if let Some(volume) = self.renderer.volume() {
            metadata["volume_m3"] = volume.into();
        }
        if self.renderer.batches() < header.settings.batches {
            metadata["options"]["batches"] = self.renderer.batches().into();
        }
        if self.settings.directions {
            metadata["options"]["directions"] = true.into();
        }
        if self.map.drawn_with().is_some() {
            metadata["options"]["changed"] = self.changes();
        }
        metadata
    }

    /// Materials and directivities in use.
    fn changes(&self) -> Value {
        let scene = &self.map.header().scene;
        let materials: serde_json::Map<String, Value> = scene
            .materials
            .iter()
            .map(|Material { name, absorption, scattering, transmission, .. }| {
                let coefficients =
                    json!({ "absorption": absorption, "scattering": scattering, "transmission": transmission });
                (name.clone(), coefficients)
            })
            .collect();
        let directivities: serde_json::Map<String, Value> = scene
            .sources
            .iter()
            .map(|source| (source.name.clone(), directivity(&source.directivity)))
            .collect();
        json!({ "materials": materials, "directivities": directivities })
    }

    /// Orders and energy per path class of one source, with the gain and delay that its scene states.
    fn shares(&self, rendering: &Rendering, source: &Source) -> Value {
        let classes: Vec<Value> = self
            .renderer
            .path_classes()
            .map(|class| {
                let energy = &rendering.class_energies[class as usize];
                let energy: Vec<&[f64]> = energy.chunks(self.response.bands()).collect();
                let samples = |receiver: usize| -> Vec<Option<f64>> {
                    let bands = 0..self.response.bands();
                    bands.map(|band| rendering.effective_sample_size(class, receiver, band)).collect()
                };
                json!({
                    "class": class.notation(),
                    "estimator": self.renderer.owner(class),
                    "reason": self.renderer.reason(class, rendering.mirror_order),
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
