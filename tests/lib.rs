//! What the tests across crates share: a scene traced into a map in memory, and the map rendered.

pub mod airs;
pub mod buildings;
pub mod change;
pub mod changed_box;
pub mod coupled_door;
pub mod effect_scenes;
pub mod estimates;
pub mod furniture;
pub mod general_position;
pub mod material_uncertainty;
pub mod meshes;
pub mod octaves;
pub mod row_of_rooms;
pub mod solid_buildings;
pub mod specular_paths;
pub mod two_airs;
pub mod two_rooms;
pub mod uneven_box;
pub mod window;
pub mod wrong_levels;

use std::path::Path;

use sonel::study::pipeline::{self, TracedMap};
use sonel::study::response::receivers_of;
use sonel::study::sensitivity::VariedMap;
use sonel::{InMemory, Silent};
use sonel_analysis::map_comparison;
use sonel_echogram::Response;
use sonel_geometry::Geometry;
use sonel_map::{BandClasses, EffectState, Emissions, Ledger, PathWeight, Segment, Settings, SonelMap};
use sonel_renderer::deposit::TimeBins;
use sonel_renderer::{ReceiverPoint, RenderSettings, Renderer, Rendering};
use sonel_scene::{Effect, Loaded, Scene};

/// A shipped scene.
#[must_use]
pub fn shipped(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name);
    let text = std::fs::read_to_string(folder.join("scene.toml")).expect("a shipped scene");
    let Loaded { scene, .. } =
        sonel_scene::load(&text, name, &mut |mesh| std::fs::read(folder.join(mesh))).expect("a valid scene");
    scene
}

/// A traced scene.
pub struct Traced {
    /// Its walls.
    pub geometry: Geometry,
    /// Its map.
    pub map: SonelMap,
    /// The ledger as the tracer kept them.
    pub ledger: Ledger,
    /// Whether edges diffract in rendering.
    pub edges: bool,
}

impl Traced {
    /// Traces `scene` into a map in memory.
    #[must_use]
    pub fn new(scene: Scene, settings: Settings) -> Self {
        Self::with_effects(scene, settings, Vec::new())
    }

    /// Traces `scene` into a map that is rendered with edges.
    #[must_use]
    pub fn diffracting(scene: Scene, settings: Settings) -> Self {
        Self::with(&["diffraction"], scene, settings)
    }

    /// Traces `scene` with `effects` on in all bands.
    #[must_use]
    pub fn with(effects: &[&str], scene: Scene, settings: Settings) -> Self {
        let on = vec![true; scene.bands.count()];
        let state = |&name: &&str| EffectState {
            effect: Effect::named(name).expect("the name of an effect"),
            on: on.clone(),
            reason: String::new(),
        };
        let states = effects.iter().map(state).collect();
        Self { edges: effects.contains(&"diffraction"), ..Self::with_effects(scene, settings, states) }
    }

    fn with_effects(scene: Scene, settings: Settings, effects: Vec<EffectState>) -> Self {
        let geometry = scene.geometry().expect("a sound mesh");
        let header = pipeline::whole_run(&scene, effects, settings);
        let TracedMap { map, ledger, .. } =
            pipeline::trace(&header, &geometry, None, &mut InMemory, &Silent).expect("a tight room");
        Self { geometry, map, ledger, edges: false }
    }

    /// Ready to be compared with another map.
    #[must_use]
    pub fn as_traced(&self) -> map_comparison::Traced<'_> {
        map_comparison::Traced { map: &self.map, geometry: &self.geometry }
    }

    /// Renders source 0 at the scene's receivers. The coarse borders are those of the fine bins.
    #[must_use]
    pub fn render(&self, settings: RenderSettings) -> Rendering {
        let bins = TimeBins::new(settings.bin, self.scene().duration, self.scene().speed_of_sound);
        let borders = vec![bins.edges(); self.scene().receivers.len()];
        self.render_with(settings, &borders).0
    }

    /// Renders source 0 at the scene's receivers with coarse `borders` [s] of their own; also the borders of the fine bins.
    #[must_use]
    pub fn render_with(&self, settings: RenderSettings, borders: &[Vec<f64>]) -> (Rendering, Vec<f64>) {
        let receivers = receivers_of(self.scene());
        let renderer = self.renderer(settings);
        let rendering = renderer.render(0, &receivers, borders).expect("sound receivers");
        (rendering, renderer.bins().edges())
    }

    /// Renders all sources at the scene's receivers into a response, as `sonel-render` would.
    #[must_use]
    pub fn respond(&self, settings: RenderSettings) -> Response {
        let (receivers, settings) = (receivers_of(self.scene()), self.fitted(&settings));
        let rendered = pipeline::render_and_read(&self.map, &self.geometry, &receivers, &settings, &Silent);
        rendered.expect("sound receivers").0.response
    }

    /// A renderer of the map, with edges where they diffract.
    #[must_use]
    pub fn renderer(&self, settings: RenderSettings) -> Renderer<'_> {
        Renderer::new(&self.map, &self.geometry, self.fitted(&settings)).expect("a valid map")
    }

    /// The map, to be varied at `receivers`.
    pub fn varied<'a>(&'a mut self, receivers: &'a [ReceiverPoint], render: RenderSettings) -> VariedMap<'a> {
        let render = self.fitted(&render);
        VariedMap { map: &mut self.map, geometry: &self.geometry, receivers, render }
    }

    /// Visits every segment of every path of source 0: index of the emission, share of its batch in the run, segment.
    pub fn for_each_segment(&self, mut visit: impl FnMut(u64, f64, &Segment<'_>)) {
        let classes = BandClasses::separate(self.scene().bands.count());
        let emissions = Emissions::of_map(&self.map, self.geometry.center(), &classes);
        let table = self.map.coefficients(&self.map.header().scene.materials, &classes);
        let mut weight = PathWeight::of(&table);
        for batch in 0..emissions.layout.batches {
            for path in self.map.batch_paths(0, batch) {
                let share = emissions.share(path.emission);
                emissions.follow(0, path, 1.0, &table, &mut weight, |segment| {
                    visit(path.emission, share, segment);
                });
            }
        }
    }

    /// `settings` with edges where they diffract.
    fn fitted(&self, settings: &RenderSettings) -> RenderSettings {
        RenderSettings { edges: settings.edges && self.edges, ..settings.clone() }
    }

    fn scene(&self) -> &Scene {
        &self.map.header().scene
    }
}

/// Fluence at `receiver` in `band`, summed over time [1/m²].
#[must_use]
pub fn fluence(rendering: &Rendering, bins: usize, receiver: usize, band: usize) -> f64 {
    (0..bins).map(|bin| rendering.total.get(receiver, bin, band)).sum()
}

/// Mean and standard error over batches of equal weight of each batch's fluence at `receiver` in `band`.
#[must_use]
pub fn batch_fluence(rendering: &Rendering, receiver: usize, band: usize) -> (f64, f64) {
    late_batch_fluence(rendering, receiver, band, 0)
}

/// The same of what arrives in coarse bin `first` and later.
#[must_use]
pub fn late_batch_fluence(rendering: &Rendering, receiver: usize, band: usize, first: usize) -> (f64, f64) {
    let batches = rendering.batches.iter();
    let sums: Vec<f64> = batches.map(|batch| batch[receiver].band(band).skip(first).sum()).collect();
    let count = sums.len() as f64;
    let mean = sums.iter().sum::<f64>() / count;
    let variance = sums.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, (variance / count).sqrt())
}
