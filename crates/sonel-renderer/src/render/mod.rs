//! Rendering a map: deterministic classes once, the others batch by batch.
//!
//! Each batch of emissions is an estimate of its own; the echogram is their mean weighted by N_g / N plus the
//! deterministic arrivals, and the spread between batches is the interval (docs/physics.md §7). Batches are rendered on
//! all cores and added in order, so neither the number of threads nor the receivers that share a call change a bit.

pub(crate) mod batch;
mod deterministic;
mod lateral;
mod ownership;
mod paper_batch;
mod specular;
mod sums;
mod survey;

use std::ops::ControlFlow;
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use sonel_geometry::Geometry;
use sonel_map::{BandClasses, CoefficientTable, Emissions, SonelMap};
use sonel_scene::{Propagation, Scene, Source};

use crate::air::AirTable;
use crate::ball::AboutReceiver;
use crate::boundary::Modes;
use crate::deposit::TimeBins;
use crate::disc_size::{DISC_PER_FREE_PATH, disc_radius, filled, free_path};
use crate::error::RenderError;
use crate::exact::edge::Edges;
use crate::exact::level::Levels;
use crate::exact::mirror::chains::Chains;
use crate::exact::mirror::{ImageSources, lattice_room};
use crate::paper::Paper;
use crate::receiver::{PreparedReceiver, ReceiverPoint};
use crate::regions::{Airs, carries, distance_to_interface, fit_settings, refuse_regions, straight_length};
use crate::rendering::Rendering;
use crate::settings::{Air, Estimator, RenderSettings};
use crate::stochastic::gather::GatherSettings;
use crate::stochastic::gather::disc::Sheet;
use crate::stochastic::mirror_connection::image_chains;
use survey::SonelSurvey;

pub use sums::BatchSums;

/// Hears the share of the work that is done, and says whether to go on.
pub type Progress<'a> = &'a mut (dyn FnMut(f64) -> ControlFlow<()> + Send);

/// Receivers rendered in one sweep: few enough that the echograms they share stay in the cache, which halves the time of a
/// connection; sweeping the paths again costs less than a connection each.
pub const RECEIVERS_IN_FLIGHT: u32 = 8;
/// Visibility rays of a batch from all of them, where one receiver alone has no more: each leaves some twenty discs of 250 bytes.
pub const RAYS_IN_FLIGHT: u32 = 8192;

/// Most nodes of the table of attenuation: a thousand kilometres of ordinary air. Length and attenuation are those that a
/// map states.
const MOST_AIR_NODES: usize = 1 << 22;

/// State of a rendering that no receiver changes: for one choice of settings and materials.
pub struct Preparation {
    pub(crate) settings: RenderSettings,
    pub(crate) bins: TimeBins,
    /// The airs of the scene.
    pub(crate) airs: Airs,
    /// Attenuation, in every air, of the energies that packets carry.
    pub(crate) carried_air: AirTable,
    /// Bands that neither coefficients nor air tell apart: all estimators work on these.
    pub(crate) classes: BandClasses,
    pub(crate) table: CoefficientTable,
    /// What modes do, with the boundary term.
    modes: Option<Modes>,
    /// The edges in each air, where they diffract.
    pub(crate) edges: Vec<Edges>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) emissions: Emissions,
    /// Over which receivers have images where these are a lattice, and sources as places next to receivers see them.
    pub(crate) chains: Chains,
    /// Level surfaces where the speed of sound has a gradient and no estimator is forced.
    pub(crate) levels: Option<Levels>,
    /// Image sources of each source, found when they are first asked for.
    pub(crate) image_sources: Vec<OnceLock<Arc<ImageSources>>>,
    /// Surveys of the sonels, by source, made with the rest.
    surveys: Vec<OnceLock<SonelSurvey>>,
    /// Surfaces laid out and how rays gather on them; none where a forced estimator does without.
    pub(crate) gather: Option<(Vec<Sheet>, GatherSettings)>,
    /// The paper's own pass, where it is asked for: it stands for all classes but the direct sound.
    pub(crate) paper: Option<Paper>,
}

/// A map made ready for rendering.
pub struct Renderer<'a> {
    pub(crate) map: &'a SonelMap,
    pub(crate) geometry: &'a Geometry,
    /// What no receiver changes; shared, so that it outlives borrows of the map.
    pub(crate) prepared: Arc<Preparation>,
    /// A preparation of the same map, such as for other materials, of which something may be taken over.
    earlier: Option<Arc<Preparation>>,
    /// Number of batches that are rendered, the first ones of the map.
    pub(crate) batches: u32,
}

/// Attenuation by the air that is asked for, per band [1/m].
fn attenuation(scene: &Scene, settings: &RenderSettings, bins: &TimeBins) -> Result<Vec<f64>, RenderError> {
    let attenuation = match &settings.air {
        Air::OfScene => &scene.air_attenuation,
        Air::Attenuation(attenuation) => attenuation,
    };
    if AirTable::node_count(attenuation, bins.reach) > MOST_AIR_NODES {
        return Err(RenderError::Settings(format!(
            "the air attenuation of up to {} per metre over {} m exceeds the table: trace again with a \
             shorter `duration`, or render without `air`",
            attenuation.iter().copied().fold(0.0, f64::max),
            bins.reach
        )));
    }
    Ok(attenuation.clone())
}

/// The edges in each air of `scene`.
fn edges(scene: &Scene, geometry: &Geometry) -> Vec<Edges> {
    let speeds = scene.stretches().into_iter().map(|stretch| scene.speed_of_sound / stretch);
    speeds.filter_map(|speed| Edges::new(geometry, &scene.bands, speed)).collect()
}

impl<'a> Renderer<'a> {
    /// Prepares `map`, whose walls are `geometry`, and checks every path of it.
    ///
    /// # Errors
    /// When the map is a shard or damaged, or a setting is out of range.
    pub fn new(
        map: &'a SonelMap,
        geometry: &'a Geometry,
        settings: RenderSettings,
    ) -> Result<Self, RenderError> {
        let settings = fit_settings(&map.header().scene, settings)?;
        map.require_whole()?;
        map.check_surfaces(geometry)?;
        map.check_paths(geometry.surfaces().len() as u32)?;
        let scene = &map.header().scene;
        settings.check(scene.duration)?;
        refuse_regions(scene, &settings)?;
        let bins = TimeBins::new(settings.bin, scene.duration, scene.speed_of_sound);
        let attenuation = attenuation(scene, &settings, &bins)?;
        let traced = &map.header().settings;
        let by_paper = settings.estimator == Estimator::Paper;
        let diffracts = settings.edges && !by_paper && geometry.diffracting_edges().next().is_some();
        // Edges and the boundary term tell all bands apart.
        let all_apart = || BandClasses::separate(scene.bands.count());
        let classes = if diffracts || settings.boundary { all_apart() } else { map.classes(&attenuation) };
        let carried = carries(&settings.air, map);
        let (airs, least) = Airs::new(scene, &settings.air, &classes, &attenuation, &carried, bins.reach);
        let table = map.coefficients(&scene.materials, &classes);
        let modes = settings.boundary.then(|| Modes::new(geometry, &table, scene));
        let table = modes.as_ref().map_or(table, |it| map.coefficients(&it.materials, &classes));
        let has_lattice = settings.estimator == Estimator::Auto && lattice_room(geometry, &table).is_some();
        let sources = scene.sources.len();
        let rays = GatherSettings {
            rays: settings.rays(traced.emissions).div_ceil(traced.batches),
            reach: bins.reach / scene.stretches().into_iter().fold(1.0, f64::min),
            // Unasked not where the images of a receiver are a lattice. Where planes are few, rays are as fast as connections to images and half
            // as noisy.
            by_mirrors: !has_lattice,
        };
        let prepared = Preparation {
            edges: if diffracts { edges(scene, geometry) } else { Vec::new() },
            chains: image_chains(geometry, &table, settings.mirror_order),
            levels: table
                .propagation()
                .profile()
                .filter(|_| settings.estimator.connects_diffuse())
                .map(|profile| Levels::new(geometry, profile)),
            image_sources: (0..sources).map(|_| OnceLock::new()).collect(),
            gather: settings.estimator.has_rays().then(|| (Sheet::all(geometry), rays)),
            paper: by_paper.then(|| Paper::new(geometry, map.header(), &settings)),
            airs,
            carried_air: AirTable::new(&least, bins.reach),
            table,
            modes,
            normals: geometry.surfaces().iter().map(|surface| surface.normal.as_vec3().normalize()).collect(),
            emissions: Emissions::of_map(map, geometry.center(), &classes),
            surveys: (0..sources).map(|_| OnceLock::new()).collect(),
            classes,
            settings,
            bins,
        };
        let renderer =
            Self { map, geometry, prepared: Arc::new(prepared), earlier: None, batches: traced.batches };
        for source in 0..sources {
            renderer.survey(source);
        }
        Ok(renderer)
    }

    /// The renderer of the same `map` and `geometry` that `prepared` was made for.
    #[must_use]
    pub fn resume(map: &'a SonelMap, geometry: &'a Geometry, prepared: Arc<Preparation>) -> Self {
        Self { map, geometry, prepared, earlier: None, batches: map.header().settings.batches }
    }

    /// With what may be taken over of an `earlier` preparation of the same map: image sources, where other materials leave them.
    #[must_use]
    pub fn after(self, earlier: Option<Arc<Preparation>>) -> Self {
        Self { earlier, ..self }
    }

    /// The preparation, for [`Self::resume`].
    #[must_use]
    pub fn preparation(&self) -> Arc<Preparation> {
        Arc::clone(&self.prepared)
    }

    /// Renders the first `count` batches alone, as estimates of their own: quicker, with wider intervals.
    ///
    /// # Errors
    /// [`RenderError::Settings`] where the map has fewer, or none is wanted.
    pub fn with_batches(self, count: u32) -> Result<Self, RenderError> {
        let all = self.map.header().settings.batches;
        if count == 0 || count > all {
            return Err(RenderError::Settings(format!("the map has {all} batches: give 1 … {all} of them")));
        }
        Ok(Self { batches: count, ..self })
    }

    /// Number of batches that are rendered.
    #[must_use]
    pub fn batches(&self) -> u32 {
        self.batches
    }

    /// Weights of the rendered batches in their mean, N_g over the number of their emissions; their sum is 1.
    #[must_use]
    pub fn batch_weights(&self) -> Vec<f64> {
        let rendered = &self.prepared.emissions.batches[..self.batches as usize];
        let sum: f64 = rendered.iter().map(|batch| batch.weight).sum();
        // Weights of a whole map are those that it states, bit for bit.
        let whole = self.batches as usize == self.prepared.emissions.batches.len();
        rendered.iter().map(|batch| if whole { batch.weight } else { batch.weight / sum }).collect()
    }

    /// Survey of the sonels of `source`.
    pub(crate) fn survey(&self, source: usize) -> &SonelSurvey {
        self.prepared.surveys[source].get_or_init(|| self.make_survey(source))
    }

    /// Image sources of `source`.
    pub(crate) fn image_sources(&self, source: usize) -> &ImageSources {
        let known = &self.prepared.image_sources[source];
        if let Some(found) = known.get() {
            return found;
        }
        let position = self.map.header().scene.sources[source].position - self.geometry.center();
        let enumerates = self.connects_diffuse() && self.prepared.table.propagation().is_straight();
        let most = if enumerates { self.prepared.settings.mirror_order } else { Some(0) };
        let earlier = self.earlier.as_ref().and_then(|earlier| earlier.image_sources[source].get());
        let made = ImageSources::enumerate(self.geometry, &self.prepared.table, position, most, earlier);
        // Made outside the lock, because all processors take part: one of them may meanwhile begin a task that asks for the same.
        known.get_or_init(|| made)
    }

    /// The time bins.
    #[must_use]
    pub fn bins(&self) -> &TimeBins {
        &self.prepared.bins
    }

    /// Volume of the air in the room [m³]; none where it is not closed.
    #[must_use]
    pub fn volume(&self) -> Option<f64> {
        self.geometry.volume()
    }

    /// Height of the model along a unit vector `up` [m].
    #[must_use]
    pub fn height(&self, up: DVec3) -> f64 {
        let (low, high) = self.geometry.bounds();
        (high - low).dot(up.abs())
    }

    /// [`Rendering::missing`] in the room, or in the box about an open scene.
    #[must_use]
    pub fn missing(&self, rendering: &Rendering) -> (Vec<f64>, Vec<f64>) {
        let box_volume = || {
            let (low, high) = self.geometry.bounds();
            let side = (high - low).max_element();
            side * side * side
        };
        rendering.missing(&self.prepared.bins, self.geometry.volume().unwrap_or_else(box_volume))
    }

    /// Attenuation by air in use, per band [1/m].
    #[must_use]
    pub fn attenuation(&self) -> Vec<f64> {
        self.prepared.classes.spread(&self.prepared.airs.air(0).attenuation)
    }

    /// What walls absorb with the boundary term, of what they absorb of rays [1], per band; nothing without it.
    #[must_use]
    pub fn absorbed(&self) -> Vec<f64> {
        self.prepared.modes.as_ref().map(|modes| modes.absorbed.clone()).unwrap_or_default()
    }

    /// When direct sound of `source` arrives, or would arrive, at a world position [m]: [s].
    #[must_use]
    pub fn direct_time(&self, source: usize, receiver: DVec3) -> f64 {
        let scene = &self.map.header().scene;
        straight_length(scene, self.geometry, source, receiver) / scene.speed_of_sound
    }

    /// The edges where all paths are in one air.
    pub(crate) fn edges_in(&self, air: u32) -> Option<&Edges> {
        self.prepared.edges.get(air as usize)
    }

    /// [`straight_length`] from a source to a receiver.
    pub(crate) fn straight_length(&self, source: usize, receiver: &PreparedReceiver) -> f64 {
        let (scene, center) = (&self.map.header().scene, self.geometry.center());
        match self.prepared.table.propagation() {
            Propagation::Even => (scene.sources[source].position - center).distance(receiver.exact),
            _ => straight_length(scene, self.geometry, source, receiver.exact + center),
        }
    }

    /// Seed of the renderer's own choices.
    pub(crate) fn seed(&self) -> u64 {
        self.prepared.settings.seed.unwrap_or(self.map.header().settings.seed)
    }

    /// Refuses `receivers` that are at a source, on a surface, in no air or without coordinates.
    ///
    /// # Errors
    /// [`RenderError::Receivers`] with all problems of all receivers.
    pub fn check_receivers(&self, receivers: &[ReceiverPoint]) -> Result<(), RenderError> {
        let scene = &self.map.header().scene;
        let sources: Vec<DVec3> = scene.sources.iter().map(|source| source.position).collect();
        let mut problems = Vec::new();
        for receiver in receivers {
            let (name, position) = (&receiver.name, receiver.position);
            if !position.is_finite() {
                problems.push(format!("receiver \"{name}\": its position is not finite"));
                continue;
            }
            for source in &scene.sources {
                if coincide(source, position, self.geometry) {
                    problems.push(format!(
                        "receiver \"{name}\" is at source \"{}\", where the direct sound is infinite: move it",
                        source.name
                    ));
                }
            }
            if let Err(misplaced) = self.geometry.check_place(position, &sources) {
                problems.push(format!("receiver \"{name}\" at {position} m {misplaced}"));
            }
            problems.extend(self.lateral_problem(receiver));
        }
        if problems.is_empty() { Ok(()) } else { Err(RenderError::Receivers(problems)) }
    }

    /// Renders one source. `borders` gives for every receiver the coarse time borders [s] of its batches.
    ///
    /// # Errors
    /// [`RenderError::Receivers`] with all problems of all receivers.
    pub fn render(
        &self,
        source: usize,
        receivers: &[ReceiverPoint],
        borders: &[Vec<f64>],
    ) -> Result<Rendering, RenderError> {
        let mut sums = self.begin(source, receivers, borders)?;
        let _ = self.extend(&mut sums, &mut |_| ControlFlow::Continue(()));
        Ok(self.finish(sums))
    }

    /// Whether connections own … D R.
    pub(crate) fn connects_diffuse(&self) -> bool {
        self.prepared.settings.estimator.connects_diffuse()
    }

    /// Whether visibility rays own what mirrors show.
    #[must_use]
    pub fn gathers_by_mirrors(&self) -> bool {
        self.prepared.gather.as_ref().is_some_and(|(_, settings)| settings.by_mirrors)
    }

    /// Whether visibility rays are cast from any receiver of `sums`: where they own what mirrors show, beside surfaces, and in the
    /// paper's pass.
    #[must_use]
    pub fn casts_rays(&self, sums: &BatchSums) -> bool {
        let beside_surfaces = || sums.receivers.iter().any(PreparedReceiver::is_near_surface);
        self.gathers_by_mirrors()
            || self.prepared.paper.is_some()
            || self.prepared.gather.is_some() && beside_surfaces()
    }

    /// Receivers as `source` is heard at them.
    fn prepare(&self, source: usize, receivers: &[ReceiverPoint]) -> Vec<PreparedReceiver> {
        let (settings, traced) = (&self.prepared.settings, &self.map.header().settings);
        let SonelSurvey { sample, scale: of_all, density, .. } = self.survey(source);
        let of_room = free_path(self.geometry);
        let scene = &self.map.header().scene;
        let airs = scene.media.as_ref().map(|media| media.airs(self.geometry));
        let wide = |radius| if settings.gather_radius.is_some() { radius } else { filled(radius, *density) };
        // In a corner discs are small: in an edge of a box one run in twenty was off by six standard deviations where those drew the line.
        let of_room_disc = disc_radius(DISC_PER_FREE_PATH, of_room, settings, traced);
        let (geometry, table, modes) = (self.geometry, &self.prepared.table, self.prepared.modes.as_ref());
        receivers
            .par_iter()
            .map(|r| {
                let position = geometry.to_local(r.position);
                let outlook = sample.seen_from(geometry, table, position);
                let scale = outlook.scale.map_or(*of_all, |scale| scale.in_halves_of(of_room));
                let disc = || disc_radius(DISC_PER_FREE_PATH, scale.free_path, settings, traced);
                let disc = self.prepared.gather.is_some().then(disc);
                let wide = disc.map(wide);
                let interface = distance_to_interface(scene, geometry, position);
                let narrow = wide.map(|wide| wide.min(of_room_disc));
                let about = AboutReceiver {
                    free_path: scale.distance,
                    interface,
                    solid_angles: &outlook.solid_angles,
                };
                let air = airs.as_ref().map_or(0, |airs| airs.at(r.position));
                PreparedReceiver {
                    air,
                    stretch: table.propagation().stretch(air, r.position - geometry.center()),
                    lateral_axis: settings.directions.then(|| self.lateral_axis(r)).flatten(),
                    directions: outlook.directions,
                    boundary: modes.map_or(Vec::new(), |it| it.weights(geometry, table, position)),
                    disc_radius: wide.unwrap_or(0.0),
                    ..PreparedReceiver::new(r, geometry, about, traced.emissions, narrow)
                }
            })
            .collect()
    }
}

/// Whether a source of `scene` is at `position` [m], where its direct sound is infinite.
#[must_use]
pub fn is_at_source(position: DVec3, scene: &Scene, geometry: &Geometry) -> bool {
    scene.sources.iter().any(|source| coincide(source, position, geometry))
}

fn coincide(source: &Source, position: DVec3, geometry: &Geometry) -> bool {
    source.position.distance(position) <= f64::from(geometry.resolution())
}
