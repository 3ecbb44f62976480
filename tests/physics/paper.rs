//! The founding paper's rendering pass against the best estimators of the same classes, without diffraction: the same energy, up to
//! noise and the bias that its kernels state.

use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_map::{Mode, Settings, Spectral};
use sonel_renderer::{CoarseEchogram, Estimator, PathClass, RenderSettings, Rendering};
use sonel_scene::Scene;
use sonel_testkit::z_test::{Disagreement, Estimate, Within, agree};
use sonel_tests::{Traced, shipped};

const SECOND_SEED: u64 = 2;

/// Bare energies are within a hundredth and a half, or the test would say nothing.
const LARGEST_ERROR: f64 = 0.015;

fn as_the_paper_traces(emissions: u64) -> Settings {
    Settings {
        emissions,
        survival: 1.0,
        spectral: Spectral::PerBand,
        mode: Mode::Paper,
        ..Settings::default()
    }
}

fn by_the_paper(rays: u32) -> RenderSettings {
    RenderSettings { estimator: Estimator::Paper, rays, bin: 0.01, ..RenderSettings::default() }
}

fn by_the_best() -> RenderSettings {
    RenderSettings { bin: 0.01, ..RenderSettings::default() }
}

fn sums(batches: &[Vec<CoarseEchogram>], band: usize) -> Estimate {
    Estimate::of(&batches.iter().map(|batch| batch[0].band(band).sum()).collect::<Vec<_>>())
}

/// Whether `factor` times the energy of `paper` is that of `best` within four joint standard errors and the stated bias.
fn same_energy(paper: &Rendering, best: &Rendering, band: usize, factor: f64) -> Result<(), Disagreement> {
    let (energy, expected) = (sums(&paper.batches, band), sums(&best.batches, band));
    let bias = 2.0 * sums(&paper.kernel_differences, band).value.abs();
    let found = Estimate { value: factor * energy.value, ..energy };
    let value = found.value - (found.value - expected.value).clamp(-bias, bias);
    let within = Within { sigmas: 4.0, maximal_sigma: LARGEST_ERROR * expected.value };
    agree(Estimate { value, ..found }, expected, within)
}

/// What δ applied once more would leave of the energy in `band`.
fn with_delta_twice(rendering: &Rendering, band: usize, delta: f64) -> f64 {
    let of = |class: PathClass| rendering.classes[class as usize].1[band];
    let gathered = of(PathClass::Diffuse) + of(PathClass::DiffuseMirror);
    let all: f64 = PathClass::ALL.iter().map(|&class| of(class)).sum();
    1.0 - (1.0 - delta) * gathered / all
}

fn box_of(alpha: [f64; 2], scattering: [f64; 2]) -> Scene {
    let bands = Bands::new(vec![500.0, 1000.0], BandWidth::Octave).expect("two bands");
    let walls = Material {
        absorption: alpha.to_vec(),
        scattering: scattering.to_vec(),
        ..Material::uniform("walls", 0.0, 0.0, 2)
    };
    let mut scene = Scene::shoebox([6.0, 5.0, 4.0], walls, bands)
        .with_source("source", [1.5, 1.2, 1.3])
        .with_receiver("receiver", [4.2, 3.7, 2.1])
        .with_duration(1.0);
    scene.speed_of_sound = 343.0;
    scene
}

/// Paper paths and the paper's pass against paths shared by the bands and the best estimators. With δ applied twice it is
/// rejected.
#[test]
fn a_box_sounds_the_same_by_the_paper_s_means() {
    let (alpha, scattering) = ([0.2, 0.4], [0.5, 0.8]);
    let paper =
        Traced::new(box_of(alpha, scattering), as_the_paper_traces(40_000)).render(by_the_paper(65_536));
    let settings = Settings { seed: SECOND_SEED, ..Settings::default() };
    let best = Traced::new(box_of(alpha, scattering), settings).render(by_the_best());
    for band in [0, 1] {
        same_energy(&paper, &best, band, 1.0).expect("the same energy");
        let delta = (1.0 - alpha[band]) * scattering[band];
        assert!(same_energy(&paper, &best, band, with_delta_twice(&paper, band, delta)).is_err());
    }
}

/// Mirrors alone: the sphere about the source finds what image sources do. With the direct sound counted by the rays as well it
/// is rejected.
#[test]
fn a_sphere_about_the_source_stands_for_its_images() {
    let scene = || box_of([0.2, 0.3], [0.0, 0.0]);
    let paper = Traced::new(scene(), as_the_paper_traces(64)).render(by_the_paper(1 << 18));
    let best = Traced::new(scene(), Settings { emissions: 64, ..Settings::default() }).render(by_the_best());
    let of = |class: PathClass| paper.classes[class as usize].1[0];
    let doubled = 1.0 + of(PathClass::Direct) / (of(PathClass::Direct) + of(PathClass::LongMirrorChain));
    same_energy(&paper, &best, 0, 1.0).expect("the same energy");
    same_energy(&paper, &best, 1, 1.0).expect("the same energy");
    assert!(same_energy(&paper, &best, 0, doubled).is_err());
}

/// The paper's room, its screen in the way, and its known level; a map of the best mode serves too.
#[test]
fn the_seed_room_has_its_level_by_the_paper_s_means() {
    let level = |rendering: &Rendering| 10.0 * sums(&rendering.batches, 0).value.log10();
    let paper = Traced::new(shipped("seed-room"), Settings { emissions: 60_000, ..Settings::default() })
        .render(by_the_paper(65_536));
    let settings = Settings { emissions: 20_000, seed: SECOND_SEED, ..Settings::default() };
    let best = Traced::new(shipped("seed-room"), settings).render(by_the_best());
    same_energy(&paper, &best, 0, 1.0).expect("the same energy");
    assert!((level(&best) + 31.48).abs() < 0.1, "{} dB", level(&best));
    assert!(same_energy(&paper, &best, 0, with_delta_twice(&paper, 0, 0.425)).is_err());
}
