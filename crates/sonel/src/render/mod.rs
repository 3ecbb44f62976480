//! The rendering of a map: options, plan, response.

mod audience;
mod change;
mod grid;
mod options;
mod planning;
mod refinement;
mod remedy;
mod sensitivity;
mod uncertainty;
mod until;

use std::sync::Arc;

use crate::study::plan::Plan;
use serde_json::{Value, json};
use sonel_acoustics::Material;
use sonel_analysis::what_if::{Fitness, fitness};
use sonel_echogram::provenance::{PathClass, SourceRendering};
use sonel_geometry::Geometry;
use sonel_map::{Mode, SonelMap};
use sonel_renderer::{Estimator, ReceiverPoint, RenderSettings};
use sonel_scene::Source;

use crate::error::At;
use crate::observer::{Observer, Watch};
use crate::plan::extend;
use crate::prepared::{Design, Prepared};
use crate::response::{Response, Surroundings};
use crate::study::job::{Job, RenderedMap};
use crate::until::Goal;
use crate::{Error, Map, Result};

pub use crate::study::job::VERSION;
pub use audience::Audience;
pub use change::Change;
pub use grid::{Axis, Grid, GridCounts};
pub use options::{Air, RenderEffects, RenderOptions};
pub use refinement::Refinement;
pub use uncertainty::{AbsorptionUncertainty, MaterialVariants};

/// Least change of a level by what was not computed that is said [dB]: a third of what is just noticeable.
const AUDIBLE_DB: f64 = 0.3;

/// A response and what is to be said of it.
#[derive(Debug)]
pub struct Rendered {
    /// Echograms of every source at every receiver.
    pub response: Response,
    /// Share of every path class, source by source.
    pub classes: Vec<Vec<ClassShare>>,
    /// Why intervals deserve less trust, or are wider than those of another trace: a sentence each.
    pub warnings: Vec<String>,
    /// Points of the grid and above the audience, where they were asked for.
    pub grid: Option<GridCounts>,
    /// Whether the targets of `until` were reached; none without.
    pub is_reached: Option<bool>,
    /// Seconds by the observer's clock: on the wall and of the processor, at the begin of the rendering itself and at the end.
    seconds: [(f64, f64); 2],
    /// Prediction and achievement, where there was a plan.
    pub comparison: Option<crate::plan::Comparison>,
    /// Further fields of the report.
    extra: Value,
}

/// The energy of a path class.
#[derive(Debug, Clone, PartialEq)]
pub struct ClassShare {
    /// The class as docs/physics.md writes it, such as `L S+ R`.
    pub class: String,
    /// Part of the energy of all receivers and bands, 0 … 1.
    pub share: f64,
    /// Estimator.
    pub estimator: String,
}

impl Rendered {
    /// The report of docs/interface.md; `seconds` are those at its end, by the observer's clock.
    #[must_use]
    pub fn report(&self, (wall, cpu): (f64, f64)) -> Value {
        let mut report = self.response.echograms().provenance.to_json();
        let opened = self.seconds[0];
        report["timings"] =
            json!({ "open_wall_s": opened.0, "open_cpu_s": opened.1, "wall_s": wall, "cpu_s": cpu });
        extend(&mut report, &self.extra);
        report["warnings"] = json!(self.warnings);
        if let Some(comparison) = &self.comparison {
            extend(&mut report, &comparison.json());
        }
        if let Some(grid) = self.grid {
            report["grid"] = grid.json();
        }
        report
    }

    /// What the boundary term changes, over all receivers; nothing without it.
    #[must_use]
    pub fn boundary(&self) -> Option<String> {
        let echograms = self.response.echograms();
        let changes = &echograms.provenance.sources.first()?.boundary_db;
        let absorbed = &echograms.provenance.options.as_ref()?.boundary_absorption;
        let of_band = |(band, f): (usize, &f64)| {
            let largest = |one: f64, other: f64| if one.abs() < other.abs() { other } else { one };
            let most = changes.iter().map(|of_receiver| of_receiver[band]).reduce(largest)?;
            let text = || format!("{most:+.2} dB, {:.2} α at {f} Hz", absorbed[band]).replace('-', "−");
            (most.abs() > 0.0).then(text)
        };
        let bands: Vec<String> =
            echograms.center_frequency_hz.iter().enumerate().filter_map(of_band).collect();
        let term = "boundary term (change of all but direct sound, absorption of walls)";
        (!bands.is_empty()).then(|| format!("{term}: {}", bands.join("; ")))
    }

    /// Seconds by the observer's clock at the end: on the wall, and of the processor.
    #[must_use]
    pub fn seconds(&self) -> (f64, f64) {
        self.seconds[1]
    }
}

impl Map {
    /// Renders echograms at `receivers` and the points of the options' grid and audience; without any, at the receivers of the scene.
    ///
    /// # Errors
    /// Options that are out of range or that the map does not support; a damaged map; a receiver on a surface; [`Error::Stopped`].
    pub fn render(
        &self,
        receivers: &[ReceiverPoint],
        options: &RenderOptions,
        observer: &dyn Observer,
    ) -> Result<Rendered> {
        self.prepare(receivers, options, observer)?.render(None, observer)
    }

    /// Predicts cost and intervals of renderings for several accuracies.
    ///
    /// # Errors
    /// The errors of [`Self::render`].
    pub fn plan(
        &self,
        receivers: &[ReceiverPoint],
        options: &RenderOptions,
        observer: &dyn Observer,
    ) -> Result<Plan> {
        self.prepare(receivers, options, observer)?.plan(observer)
    }

    /// Decides everything about a rendering and renders nothing.
    ///
    /// # Errors
    /// The errors of [`Self::render`].
    pub fn prepare<'a>(
        &'a self,
        receivers: &[ReceiverPoint],
        options: &'a RenderOptions,
        observer: &dyn Observer,
    ) -> Result<PreparedRendering<'a>> {
        options.check()?;
        let watch = Watch(observer);
        watch.require_clock(options.at_most)?;
        let begun = watch.seconds().1;
        let Design { map, geometry, warnings, .. } = self.changed(options)?;
        let scene = &map.header().scene;
        let settings = options.settings(scene)?;
        let (shown, audience) = (options.grid.as_ref(), options.audience.as_ref());
        let (receivers, grid) =
            grid::gather(receivers, shown, audience, options.shard, scene, &geometry, watch)?;
        let label = self.label();
        let opened = watch.seconds().1;
        Ok(PreparedRendering {
            label,
            prepared: self.prepared(),
            options,
            map,
            geometry,
            warnings,
            settings,
            receivers,
            grid,
            opened: opened - begun,
        })
    }

    /// The map with the materials and directivities that were asked for.
    fn changed(&self, options: &RenderOptions) -> Result<Design> {
        let of_file = self.sonels();
        if options.variant.is_none() && options.materials.is_none() && options.set.is_empty() {
            return self.unchanged();
        }
        if of_file.header().settings.mode == Mode::Paper || options.estimator == Estimator::Paper {
            return Err(Error::refused(
                "the paper's estimator draws events anew with the materials of the map: leave `set` and `materials` out",
            ));
        }
        let scene = &of_file.header().scene;
        let (variant, file) = (options.variant.as_deref(), options.materials.as_deref());
        let (materials, sources) = change::changed(scene, variant, file, &options.set)?;
        let batches = options.batches.unwrap_or(u32::MAX).min(of_file.layout().batches);
        let make = |materials, sources| self.design(materials, sources, batches);
        self.prepared().design(materials, sources, batches, make)
    }

    /// The map as it was traced.
    fn unchanged(&self) -> Result<Design> {
        let (map, warnings) = (self.sonels().clone(), Vec::new());
        Ok(Design { batches: map.layout().batches, map, geometry: self.walls()?, warnings })
    }

    /// The map with other materials and directivities, which the paths of `batches` carry.
    fn design(&self, materials: Vec<Material>, sources: Vec<Source>, batches: u32) -> Result<Design> {
        let geometry = self.walls()?;
        let label = || self.label().to_owned();
        let mut map = self.sonels().clone();
        map.require_whole().at(label)?;
        self.check()?;
        map.change(materials, sources);
        let Fitness { refusals, warnings } = fitness(&map, &geometry, batches);
        let command = || remedy::command(map.header(), map.drawn_with(), &geometry, self.label());
        if !refusals.is_empty() {
            let reasons = refusals.join("\nerror: ");
            return Err(Error::refused(format!(
                "{} does not support these materials: {reasons}; trace the scene for them: {}",
                self.label(),
                command()
            )));
        }
        let warned = |sentence| format!("{sentence}; for narrower intervals: {}", command());
        let warnings = warnings.into_iter().map(warned).collect();
        let geometry = match map.header().scene.has_faces_of(&self.sonels().header().scene) {
            true => geometry,
            false => Arc::new(map.header().scene.geometry().at(label)?),
        };
        Ok(Design { map, geometry, batches, warnings })
    }
}

/// A rendering about which everything is decided.
pub struct PreparedRendering<'a> {
    label: &'a str,
    prepared: &'a Prepared,
    options: &'a RenderOptions,
    map: SonelMap,
    pub(crate) geometry: Arc<Geometry>,
    warnings: Vec<String>,
    settings: RenderSettings,
    receivers: Vec<ReceiverPoint>,
    grid: Option<GridCounts>,
    /// CPU seconds of the preparation.
    opened: f64,
}

impl PreparedRendering<'_> {
    /// All receivers, in the order of the response.
    #[must_use]
    pub fn receivers(&self) -> &[ReceiverPoint] {
        &self.receivers
    }

    fn job<'b>(&'b self, watch: Watch<'b>) -> Job<'b> {
        let Self { label, prepared, map, geometry, receivers, options, .. } = self;
        Job {
            map,
            geometry,
            label: Some(*label),
            prepared: Some(*prepared),
            batches: options.batches,
            allowed: Some([options.memory, options.at_most.filter(|_| options.until.is_none())]),
            receivers,
            watch,
        }
    }

    /// Predicts cost and intervals of renderings for several accuracies.
    ///
    /// # Errors
    /// A damaged map; [`Error::Stopped`].
    pub fn plan(&self, observer: &dyn Observer) -> Result<Plan> {
        planning::plan(&self.job(Watch(observer)), &self.settings)
    }

    /// Renders. With a `plan` the report compares.
    ///
    /// # Errors
    /// A damaged map; a receiver on a surface; [`Error::Stopped`].
    pub fn render(self, plan: Option<&Plan>, observer: &dyn Observer) -> Result<Rendered> {
        let watch = Watch(observer);
        let job = self.job(watch);
        let (RenderedMap { mut response, effort, opened, seconds, .. }, extra, is_reached) =
            self.run(&job)?;
        let comparison =
            plan.map(|plan| planning::compare(plan, effort, &response, self.opened + seconds.total()));
        response.provenance.variant.clone_from(&self.options.variant);
        if let Some(shard) = self.options.shard {
            response.mark_as_part(shard.index, shard.count);
        }
        let classes = response.provenance.sources.iter().map(classes).collect();
        let warnings = self.warnings.into_iter().chain(left_out(&response)).collect();
        let header = self.map.header();
        let surroundings = Surroundings {
            volume: self.geometry.volume(),
            up: Some(header.scene.up),
            seed: self.settings.seed.unwrap_or(header.settings.seed),
        };
        let (response, seconds) = (Response::of(response, surroundings), [opened, watch.seconds()]);
        Ok(Rendered { response, classes, warnings, grid: self.grid, is_reached, seconds, comparison, extra })
    }

    /// Renders once, or until the targets are kept; with what the report states of it.
    fn run(&self, job: &Job<'_>) -> Result<(RenderedMap, Value, Option<bool>)> {
        let Some(targets) = &self.options.until else {
            return Ok((job.render(&self.settings)?, json!({}), None));
        };
        let (most, seconds) = (self.options.rays.map(u64::from), self.options.at_most);
        let goal = Goal { targets, most, seconds, watch: job.watch };
        let (rendered, extra, is_reached) = until::until(job, &self.settings, &goal)?;
        Ok((rendered, extra, Some(is_reached)))
    }
}

/// Says where sound over edges that was not computed may change a level by more than [`AUDIBLE_DB`].
fn left_out(response: &sonel_echogram::Response) -> Option<String> {
    let pairs = (0..response.sources()).flat_map(|s| (0..response.receivers()).map(move |r| (s, r)));
    let bands = pairs.flat_map(|(s, r)| (0..response.bands()).map(move |b| (s, r, b)));
    let change = |(s, r, b)| (-response.left_out_db(s, r, b)[0], r, b);
    let (most, r, b) = bands.map(change).max_by(|one, other| one.0.total_cmp(&other.0))?;
    (most > AUDIBLE_DB).then(|| {
        format!(
            "sound over edges that was not computed may change levels by up to {most:.1} dB (receiver \"{}\", {} Hz): their intervals hold it",
            response.receiver_names[r], response.center_frequency_hz[b]
        )
    })
}

/// The shares of the path classes of a source.
fn classes(source: &SourceRendering) -> Vec<ClassShare> {
    let energy = |class: &PathClass| class.energy.iter().flatten().sum::<f64>();
    let total: f64 = source.classes.iter().map(energy).sum();
    let share = |class: &PathClass| ClassShare {
        class: class.class.clone(),
        share: energy(class) / total.max(f64::MIN_POSITIVE),
        estimator: class.estimator.clone(),
    };
    source.classes.iter().map(share).collect()
}
