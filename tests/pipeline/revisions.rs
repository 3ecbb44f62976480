//! Paths and echograms change only with their revision: digests of short runs that use every effect.

use sonel_map::{Mode, Settings, SonelMap, Spectral};
use sonel_renderer::{Estimator, RenderSettings};
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
    digests: ["1c8924053c68e676", "864bb3bbd21fbd89"],
};

/// The revisions that wrote the digests of [`RUNS`].
const REVISIONS: [u32; 2] = [7, 32];
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
        digests: ["df910507057870a3", "d68684e826ff10d9"],
        ..ACCURATE
    },
    Run {
        scene: "shoebox",
        effects: &["air"],
        spectral: Spectral::PerBand,
        digests: ["18051300bce960da", "98c499898c014956"],
        ..ACCURATE
    },
];

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
        let response = traced.respond(settings);
        let mut echograms = blake3::Hasher::new();
        for energy in response.energy.iter().chain(&response.arrivals.energy) {
            echograms.update(&energy.to_le_bytes());
        }
        [paths(&traced.map), echograms.finalize().to_hex()[..16].to_owned()]
    }
}

/// Digest of all vertices and of the ledger.
fn paths(map: &SonelMap) -> String {
    let mut digest = blake3::Hasher::new();
    for source in 0..map.header().scene.sources.len() as u32 {
        for emission in 0..map.layout().total {
            let path = map.path(source, emission).expect("a whole map");
            digest.update(bytemuck::cast_slice(path.vertices));
        }
    }
    for term in map.ledger().bands.iter().flat_map(|band| band.terms()) {
        digest.update(&term.to_le_bytes());
    }
    digest.finalize().to_hex()[..16].to_owned()
}

#[test]
fn paths_and_echograms_change_with_their_revisions_alone() {
    let found: Vec<[String; 2]> = RUNS.iter().map(Run::digests).collect();
    let kept = RUNS.map(|run| run.digests);
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
