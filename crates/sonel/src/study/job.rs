//! A rendering and its provenance.

use std::sync::LazyLock;

use crate::study::forecast::Effort;
use crate::study::memory::RenderLoad;
use crate::study::response::{self, PART};
use sonel_acoustics::{Directivity, Material, energy_to_level_db};
use sonel_analysis::{Parameter, ReceiverParameters, some_parameters};
use sonel_echogram::provenance::{
    self, ByName, Changed, Coefficients, EdgeContributions, NearestSurface, Options, PathClass,
    SourceRendering,
};
use sonel_echogram::{Provenance, Response, side_by_side};
use sonel_geometry::Geometry;
use sonel_map::{SonelMap, hexadecimal};
use sonel_renderer::{Columns, ReceiverPoint, RenderSettings, Renderer, Rendering};
use sonel_scene::{Scene, Source};

use crate::error::At;
use crate::feasible::Demand;
use crate::observer::{Watch, unless_stopped};
use crate::prepared::Prepared;
use crate::version::version;
use crate::{Error, Result};

/// Version of the renderer, as responses state it.
pub static VERSION: LazyLock<String> = LazyLock::new(|| version(sonel_renderer::REVISION));

/// CPU time for a sonel at a receiver [s], with its share of rays and edges: 0.25 µs in the hall and an office (docs/planning.md), a fifth of
/// that in a shoebox.
const SECONDS_PER_SONEL: f64 = 0.25e-6;

const STEP: &str = "rendering";
/// Largest change of a level that is stated [dB]: what is left out where nothing is heard may be any multiple of it.
const MOST_CHANGE: f64 = 30.0;

/// Map and receivers of a rendering.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    /// The map.
    pub map: &'a SonelMap,
    /// Walls.
    pub geometry: &'a Geometry,
    /// Name of the map in messages.
    pub label: Option<&'a str>,
    /// Earlier preparations of the map, where they are kept.
    pub prepared: Option<&'a Prepared>,
    /// Number of batches; by default all.
    pub batches: Option<u32>,
    /// Own memory [bytes] and time [s] that it may take; none where its demand is not asked for.
    pub allowed: Option<[Option<f64>; 2]>,
    /// Receivers.
    pub receivers: &'a [ReceiverPoint],
    /// Observer.
    pub watch: Watch<'a>,
}

/// A rendered map and what it cost.
pub struct RenderedMap {
    /// Echograms, batches and provenance.
    pub response: Response,
    /// Packets of the map, rays, and batches that were rendered.
    pub effort: Effort,
    /// Whether visibility rays were cast.
    pub casts_rays: bool,
    /// (wall, CPU) seconds by the observer's clock when rendering itself began.
    pub opened: (f64, f64),
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

impl RenderSeconds {
    /// All of it.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.prepare + self.deterministic + self.sweep + self.parameters
    }
}

impl<'a> Job<'a> {
    /// A job that keeps nothing and may take what it takes.
    pub(crate) fn of(
        map: &'a SonelMap,
        geometry: &'a Geometry,
        receivers: &'a [ReceiverPoint],
        watch: Watch<'a>,
    ) -> Self {
        Self { map, geometry, label: None, prepared: None, batches: None, allowed: None, receivers, watch }
    }

    /// Renders with `settings` and reads the `wanted` parameters.
    pub(crate) fn read(
        &self,
        settings: &RenderSettings,
        wanted: &[Parameter],
    ) -> Result<(RenderedMap, Vec<ReceiverParameters>)> {
        let mut rendered = self.render(settings)?;
        let begin = self.watch.seconds().1;
        let parameters = some_parameters(&rendered.response, wanted);
        rendered.seconds.parameters = self.watch.seconds().1 - begin;
        Ok((rendered, parameters))
    }

    /// Renders with `settings`.
    pub(crate) fn render(&self, settings: &RenderSettings) -> Result<RenderedMap> {
        let Self { map, geometry, receivers, watch, .. } = *self;
        let begin = watch.seconds().1;
        let renderer = match self.prepared {
            Some(prepared) => prepared.renderer(map, geometry, settings),
            None => Renderer::new(map, geometry, settings.clone()),
        };
        let renderer = renderer.and_then(|renderer| match self.batches {
            Some(count) => renderer.with_batches(count),
            None => Ok(renderer),
        });
        let renderer = self.at_label(renderer)?;
        let traced = map.header().settings;
        let rays = settings.rays(traced.emissions);
        let effort = Effort { emissions: traced.emissions, rays, batches: renderer.batches() };
        if let Some(allowed) = self.allowed {
            let demand = self.demand(&renderer, settings, effort);
            demand.admit(allowed, "give fewer receivers, fewer rays or wider bins", watch)?;
        }
        let opened = watch.seconds();
        let seconds = RenderSeconds { prepare: opened.1 - begin, ..RenderSeconds::default() };
        let mut found = (false, seconds);
        renderer.check_receivers(receivers)?;
        let parts = receivers.chunks(PART).enumerate();
        let parts = parts.map(|(part, some)| -> Result<Response> {
            let renderings = self.renderings(&renderer, settings, (part, some), &mut found)?;
            let response = response::assemble(map, &renderer, some, &renderings);
            Ok(Response { provenance: provenance(map, &renderer, settings, (some, &renderings)), ..response })
        });
        let response = side_by_side(receivers.len(), parts)?;
        self.at_label(map.require_unchanged())?;
        watch.progress(STEP, 1.0)?;
        let (casts_rays, seconds) = found;
        Ok(RenderedMap { response, effort, casts_rays, opened, seconds })
    }

    /// `result` with the name of the map, where it has one.
    fn at_label<T, E: Into<Error>>(&self, result: std::result::Result<T, E>) -> Result<T> {
        match self.label {
            Some(label) => result.at(|| label.to_owned()),
            None => result.map_err(Into::into),
        }
    }

    /// The renderings of all sources at the receivers of a part. Whether rays were cast, and what it cost, is added.
    fn renderings(
        &self,
        renderer: &Renderer<'_>,
        settings: &RenderSettings,
        (part, receivers): (usize, &[ReceiverPoint]),
        (casts_rays, seconds): &mut (bool, RenderSeconds),
    ) -> Result<Vec<Rendering>> {
        let Self { map, watch, .. } = *self;
        let sources = map.header().scene.sources.len();
        let all = (self.receivers.len().div_ceil(PART) * sources) as f64;
        let begin = watch.seconds().1;
        let kept = self.prepared.and_then(|kept| kept.sums(map, settings, receivers, renderer.batches()));
        let mut sums = match kept {
            Some(sums) => sums,
            None => response::begin(map, renderer, receivers)?,
        };
        let begun = watch.seconds().1;
        for (source, sums) in sums.iter_mut().enumerate() {
            let before = (part * sources + source) as f64;
            let mut progress = |share| watch.0.progress(STEP, (before + share) / all);
            unless_stopped(renderer.extend(sums, &mut progress))?;
            *casts_rays |= renderer.casts_rays(sums);
        }
        let swept = watch.seconds().1;
        if let Some(prepared) = self.prepared
            && renderer.batches() < map.header().settings.batches
            && self.receivers.len() <= PART
        {
            prepared.keep_sums(map, settings, receivers, renderer.batches(), &sums);
        }
        let renderings = sums.into_iter().map(|sums| renderer.finish(sums)).collect();
        seconds.sweep += swept - begun;
        seconds.deterministic += begun - begin + watch.seconds().1 - swept;
        Ok(renderings)
    }

    /// What a rendering takes.
    fn demand(&self, renderer: &Renderer<'_>, settings: &RenderSettings, effort: Effort) -> Demand {
        let scene = &self.map.header().scene;
        let pairs = scene.sources.len() as f64 * self.receivers.len() as f64;
        let sonels = self.map.vertex_count() as f64 / scene.sources.len() as f64;
        let load = RenderLoad {
            columns: if settings.directions { Columns::DIRECTED } else { Columns::PLAIN },
            casts_rays: renderer.gathers_by_mirrors(),
            segments: sonels / effort.emissions.max(1) as f64,
        };
        // A segment of a ray beyond those by default costs as much as a sonel (classroom: 0.3 µs).
        let default = RenderSettings::default().rays(effort.emissions);
        let of_rays = load.segments * f64::from(effort.rays.saturating_sub(default));
        Demand {
            cpu_seconds: SECONDS_PER_SONEL * (sonels + of_rays) * pairs,
            map_bytes: 0.0,
            memory_bytes: load.memory(effort, scene, self.receivers.len(), settings.bin),
        }
    }
}

/// Everything that decided the response and nothing that depends on machine or clock.
fn provenance(
    map: &SonelMap,
    renderer: &Renderer<'_>,
    settings: &RenderSettings,
    (receivers, renderings): (&[ReceiverPoint], &[Rendering]),
) -> Provenance {
    let header = map.header();
    let (traced, scene) = (&header.settings, &header.scene);
    let sources = renderings.iter().zip(&scene.sources);
    Provenance {
        tool: Some("sonel-render".to_owned()),
        tool_version: Some(VERSION.clone()),
        scene: Some(scene.name.clone()),
        scene_digest: Some(hexadecimal(&scene.digest)),
        mesh_digest: Some(hexadecimal(&scene.mesh_digest)),
        map_digest: Some(hexadecimal(&map.digest())),
        map_tool_version: Some(header.tool_version.clone()),
        seed: Some(settings.seed.unwrap_or(traced.seed)),
        emissions: Some(traced.emissions),
        batches: Some(traced.batches),
        up: Some(scene.up.to_array()),
        survival: Some(traced.survival),
        options: Some(Options {
            bin_s: settings.bin,
            estimator: settings.estimator.name().to_owned(),
            order: settings.mirror_order,
            rays: settings.rays(traced.emissions),
            radius_m: settings.gather_radius,
            air_attenuation: renderer.attenuation(),
            boundary_absorption: renderer.absorbed(),
            batches: Some(renderer.batches()).filter(|&some| some < traced.batches),
            directions: settings.directions,
            changed: map.drawn_with().map(|_| changes(scene)),
        }),
        sources: sources.map(|(rendering, source)| of_source(renderer, rendering, source)).collect(),
        volume_m3: renderer.volume(),
        height_m: Some(renderer.height(scene.up)),
        nearest_surfaces: receivers.iter().map(|receiver| nearest(renderer, receiver)).collect(),
        ..Provenance::default()
    }
}

fn nearest(renderer: &Renderer<'_>, receiver: &ReceiverPoint) -> NearestSurface {
    let (distance_m, material) = renderer.nearest_surface(receiver);
    NearestSurface { distance_m, material: material.to_owned() }
}

/// Materials and directivities in use.
fn changes(scene: &Scene) -> Changed {
    let material = |Material { name, absorption, scattering, transmission, .. }: &Material| {
        let coefficients = Coefficients {
            absorption: absorption.clone(),
            scattering: scattering.clone(),
            transmission: transmission.clone(),
        };
        (name.clone(), coefficients)
    };
    let directivities =
        scene.sources.iter().map(|source| (source.name.clone(), directivity(&source.directivity)));
    Changed {
        materials: ByName(scene.materials.iter().map(material).collect()),
        directivities: ByName(directivities.collect()),
    }
}

/// Change of a level [dB] by a share of its energy, within the [`MOST_CHANGE`] either way.
fn change_db(share: f64) -> f64 {
    (10.0 * libm::log10(1.0 + share.max(-1.0))).clamp(-MOST_CHANGE, MOST_CHANGE)
}

/// Orders and energy per path class of one source, with the gain and delay that its scene states.
fn of_source(renderer: &Renderer<'_>, rendering: &Rendering, source: &Source) -> SourceRendering {
    let bands = source.power_level_db.len();
    let class = |class: sonel_renderer::PathClass| {
        let energy = rendering.class_energies[class as usize].chunks(bands);
        let samples = |receiver: usize| -> Vec<Option<f64>> {
            (0..bands).map(|band| rendering.effective_sample_size(class, receiver, band)).collect()
        };
        PathClass {
            class: class.notation().to_owned(),
            estimator: renderer.owner(class).to_owned(),
            reason: renderer.reason(class, rendering.mirror_order),
            effective_sample_size: (0..energy.len()).map(samples).collect(),
            energy: energy.map(<[f64]>::to_vec).collect(),
        }
    };
    let edges = rendering.edge_work.iter().map(|work| EdgeContributions {
        computed: work.computed,
        left_out_db: work.left_out.iter().map(|sd| [-1.96, 1.96].map(|z| change_db(z * sd))).collect(),
    });
    let boundary = rendering.boundary.iter().filter(|factors| !factors.is_empty());
    let boundary = boundary.map(|factors| factors.iter().map(|&factor| energy_to_level_db(factor)).collect());
    let stated = Some(source.change).filter(|change| !change.is_none());
    SourceRendering {
        mirror_order: rendering.mirror_order,
        sphere_radius_m: rendering.sphere_radius.clone(),
        boundary_db: boundary.collect(),
        edges: edges.collect(),
        classes: renderer.path_classes().map(class).collect(),
        gain_db: stated.map(|change| change.gain_db),
        delay_s: stated.map(|change| change.delay),
    }
}

/// A pattern's name; of a file also its directivity index per band and the side that is up.
pub(crate) fn directivity(directivity: &Directivity) -> provenance::Directivity {
    match directivity {
        Directivity::Pattern(pattern) => provenance::Directivity::Pattern(pattern.name().to_owned()),
        Directivity::Measured { balloon, up } => {
            let bands = 0..balloon.shape()[2];
            let index = bands.map(|band| energy_to_level_db(balloon.on_axis(band)));
            provenance::Directivity::Measured {
                file: balloon.name().to_owned(),
                directivity_index_db: index.collect(),
                up: up.to_array(),
            }
        }
    }
}
