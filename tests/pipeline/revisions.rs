//! Paths and echograms change only with their revision: digests of short runs that use every effect, and of random buildings.

use sonel_echogram::Response;
use sonel_geometry::Geometry;
use sonel_map::{Mode, Settings, SonelMap, Spectral};
use sonel_renderer::{Estimator, RenderSettings};
use sonel_tests::buildings::{Building, Place};
use sonel_tests::{Traced, shipped};

/// A run and the digests of its paths and its echograms.
struct Run {
    scene: &'static str,
    effects: &'static [&'static str],
    mode: Mode,
    spectral: Spectral,
    estimator: Estimator,
    digests: [&'static str; 2],
}

const ACCURATE: Run = Run {
    scene: "seed-room",
    effects: &["diffraction"],
    mode: Mode::Accurate,
    spectral: Spectral::Shared,
    estimator: Estimator::Auto,
    digests: ["1c8924053c68e676", "dd2532b69ccbe53c"],
};

/// The revisions that wrote the digests of [`RUNS`].
const REVISIONS: [u32; 2] = [7, 33];
const RUNS: [Run; 4] = [
    ACCURATE,
    Run {
        effects: &["diffraction"],
        mode: Mode::Paper,
        spectral: Spectral::PerBand,
        estimator: Estimator::Paper,
        digests: ["fba5ddbb1c8d38c0", "0b6fc70291845404"],
        ..ACCURATE
    },
    Run {
        scene: "two-rooms",
        effects: &["transmission", "air"],
        digests: ["df910507057870a3", "db860120f0a0878d"],
        ..ACCURATE
    },
    Run {
        scene: "shoebox",
        effects: &["air"],
        spectral: Spectral::PerBand,
        digests: ["18051300bce960da", "9b14767e2d23b8d9"],
        ..ACCURATE
    },
];

/// Random buildings that are digested together, and their digests: what a change does to a rare arrangement alone shows there.
const BUILDINGS: u64 = 30;
const OF_BUILDINGS: [&str; 2] = ["df0aec32fdf5b76c", "c7f86be0943c3c8f"];

impl Run {
    /// The digests that it has now.
    fn digests(&self) -> [String; 2] {
        let mut scene = shipped(self.scene);
        scene.duration = scene.duration.min(1.0);
        let survival = if self.mode == Mode::Paper { 1.0 } else { 0.15 };
        let (emissions, mode, spectral) = (64, self.mode, self.spectral);
        let settings = Settings { emissions, mode, spectral, survival, batches: 4, ..Settings::default() };
        let traced = Traced::with(self.effects, scene, settings);
        let settings = RenderSettings { rays: Some(256), bin: 0.01, ..RenderSettings::of(self.estimator) };
        let mut digests = [(); 2].map(|()| blake3::Hasher::new());
        add_paths(&mut digests[0], &traced.map);
        add_echograms(&mut digests[1], &traced.respond(settings));
        digests.map(|digest| short(&digest))
    }
}

/// The digests of the buildings now.
fn digests_of_buildings() -> [String; 2] {
    let mut digests = [(); 2].map(|()| blake3::Hasher::new());
    let mut heard = 0;
    for seed in 0..BUILDINGS {
        let mut building = Building::with_free_ends(seed);
        let geometry = Geometry::build(building.mesh.clone()).expect("a building has walls");
        let is_air = |place: &Place| geometry.check_place(place.position, &[]).is_ok();
        let places = (0..building.rooms.len()).filter_map(|room| building.place(room));
        let places: Vec<Place> = places.filter(is_air).take(3).collect();
        let places = places.split_first().filter(|(_, receivers)| !receivers.is_empty());
        let Some((source, receivers)) = places else { continue };
        let settings = Settings { emissions: 32, batches: 4, seed, ..Settings::default() };
        let traced = Traced::diffracting(building.scene(source.position, receivers, 0.1), settings);
        let settings =
            RenderSettings { mirror_order: Some(2), rays: Some(64), bin: 0.01, ..RenderSettings::default() };
        add_paths(&mut digests[0], &traced.map);
        add_echograms(&mut digests[1], &traced.respond(settings));
        heard += receivers.len();
    }
    assert!(heard > BUILDINGS as usize, "{heard} receivers");
    digests.map(|digest| short(&digest))
}

fn short(digest: &blake3::Hasher) -> String {
    digest.finalize().to_hex()[..16].to_owned()
}

fn add_echograms(digest: &mut blake3::Hasher, response: &Response) {
    for energy in response.energy.iter().chain(&response.arrivals.energy) {
        digest.update(&energy.to_le_bytes());
    }
}

/// Adds all vertices and the ledger.
fn add_paths(digest: &mut blake3::Hasher, map: &SonelMap) {
    for source in 0..map.header().scene.sources.len() as u32 {
        for emission in 0..map.layout().total {
            let path = map.path(source, emission).expect("a whole map");
            digest.update(bytemuck::cast_slice(path.vertices));
        }
    }
    for term in map.ledger().bands.iter().flat_map(|band| band.terms()) {
        digest.update(&term.to_le_bytes());
    }
}

#[test]
fn paths_and_echograms_change_with_their_revisions_alone() {
    let found = RUNS.iter().map(Run::digests).chain([digests_of_buildings()]).collect::<Vec<_>>();
    let kept: Vec<_> = RUNS.iter().map(|run| run.digests).chain([OF_BUILDINGS]).collect();
    for (number, what) in
        ["paths (sonel_tracer::REVISION)", "echograms (sonel_renderer::REVISION)"].iter().enumerate()
    {
        let same = found.iter().zip(&kept).all(|(found, kept)| found[number] == kept[number]);
        assert!(same, "other {what}: raise the revision, in REVISIONS too, and keep the digests {found:?}");
    }
    assert_eq!(
        REVISIONS,
        [sonel_tracer::REVISION, sonel_renderer::REVISION],
        "digests are of other revisions"
    );
}
