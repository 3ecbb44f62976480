//! Energy is neither made nor lost: ledger, lossless and black boxes, Σ incident / emitted, mean free path.

use sonel_acoustics::{Bands, Material, Pattern};
use sonel_map::{
    BandValues, BatchStart, CoefficientTable, EmissionLayout, Fate, PathWeight, Settings, Spectral,
};
use sonel_scene::Scene;
use sonel_tests::Traced;

const SIZE: [f64; 3] = [6.0, 5.0, 4.0];

fn room(material: Material, duration: f64) -> Scene {
    let bands = Bands::octaves();
    Scene::shoebox(SIZE, material, bands)
        .with_source("source", [1.5, 1.2, 1.3])
        .with_duration(duration)
        .without_air_attenuation()
}

/// Absorption and scattering that differ wildly between bands.
fn colourful() -> Material {
    Material {
        absorption: vec![0.2, 0.9, 0.01, 0.99, 0.5, 0.05, 0.3, 0.6],
        scattering: vec![0.5, 0.05, 0.95, 0.5, 0.1, 0.9, 0.3, 0.7],
        ..Material::uniform("walls", 0.0, 0.0, 8)
    }
}

/// Closed to 1e-9, with a sampling term within 4σ of zero whose σ is small, for ragged counts as well.
#[test]
fn the_ledger_closes_in_every_band() {
    for (emissions, spectral, survival) in [
        (20_000, Spectral::Shared, 0.15),
        (20_011, Spectral::Shared, 1.0),
        (5_003, Spectral::PerBand, 1.0),
        (5_000, Spectral::PerBand, 0.0),
    ] {
        let settings = Settings { emissions, spectral, survival, ..Settings::default() };
        let traced = Traced::new(room(colourful(), 2.0), settings);
        assert_eq!(traced.map.ledger(), traced.ledger, "the map carries the tracer's ledger");
        assert_eq!(traced.ledger.fates.count(Fate::Lost), 0);
        for (band, ledger) in traced.ledger.bands.iter().enumerate() {
            assert!((ledger.emitted - 1.0).abs() < 1e-9, "{settings:?} band {band}: {ledger:?}");
            assert!(ledger.relative_residual() < 1e-9, "{settings:?} band {band}: {ledger:?}");
            assert!(ledger.sampling_sigma() < 0.05, "{settings:?} band {band}: {ledger:?}");
            assert!(
                ledger.sampling.abs() <= 4.0 * ledger.sampling_sigma() + 1e-12,
                "{settings:?} band {band}: {ledger:?}"
            );
        }
    }
}

/// A directional source samples its own power: within 4σ, with shared bands as with bands on their own. A sequence whose
/// points go to the leading bands in turn would send each band into one part of the sphere.
#[test]
fn directional_sources_emit_what_they_should_in_every_band() {
    for spectral in [Spectral::Shared, Spectral::PerBand] {
        let mut scene = room(colourful(), 1.0);
        scene.sources[0].directivity = Pattern::Cardioid.into();
        scene.sources[0].aim = glam::DVec3::new(0.6, 0.0, 0.8);
        let traced = Traced::new(scene, Settings { emissions: 8_000, spectral, ..Settings::default() });
        for (band, ledger) in traced.ledger.bands.iter().enumerate() {
            assert!(ledger.relative_residual() < 1e-9);
            assert!(ledger.sampling_sigma() < 0.05, "{spectral:?} band {band}: {ledger:?}");
            assert!(
                ledger.sampling.abs() <= 4.0 * ledger.sampling_sigma(),
                "{spectral:?} band {band}: {ledger:?}"
            );
        }
    }
}

/// With equal scattering and no roulette every packet passes on exactly what is expected.
#[test]
fn nothing_is_sampled_where_nothing_is_random() {
    let material = Material { scattering: vec![0.4; 8], ..colourful() };
    let settings = Settings { emissions: 2_000, survival: 0.0, ..Settings::default() };
    let traced = Traced::new(room(material, 1.0), settings);
    for ledger in &traced.ledger.bands {
        assert!(ledger.sampling.abs() < 1e-12, "{ledger:?}");
    }
}

/// A ledger that is told the wrong coefficients does not balance: the residual is a test that can fail.
#[test]
fn a_wrong_absorption_leaves_a_residual() {
    use sonel_map::coefficients::MaterialRow;
    use sonel_map::{ChunkLedger, Event};
    let table = CoefficientTable::new(&[Material::uniform("walls", 0.2, 0.5, 1)], 1, 0.0);
    let wrong = CoefficientTable::new(&[Material::uniform("walls", 0.25, 0.5, 1)], 1, 0.0);
    let residual = |absorbing: &CoefficientTable| {
        let (mut weight, mut ledger) = (PathWeight::of(&table), ChunkLedger::new(1));
        let layout = EmissionLayout { total: 1, bands: 1, sets: 1, batches: 1 };
        let batch = BatchStart::new(&layout, 0, Spectral::Shared);
        weight.emit(1.0, 1.0, batch.packet(0));
        ledger.emitted(1.0, &batch.packet(0).expected, weight.energy());
        for bounce in 0..10 {
            ledger.segment(weight.energy(), bounce > 0);
            let row = table.material(0);
            let dissipated = absorbing.material(0).dissipated.clone();
            ledger.arrived(weight.energy(), &MaterialRow { dissipated, ..row.clone() });
            weight.pass(&row.diffuse);
        }
        ledger.segment(weight.energy(), true);
        ledger.ended(Event::Expired, weight.energy());
        ledger.close();
        ledger.finish(&sonel_map::BandClasses::separate(1)).worst_residual()
    };
    assert!(residual(&table) < 1e-12);
    assert!(residual(&wrong) > 1e-3);
}

/// α = 0: after any number of bounces a packet carries what it started with, whatever β.
#[test]
fn a_lossless_box_keeps_its_energy() {
    for survival in [0.0, 0.15, 1.0] {
        let settings = Settings { emissions: 64, survival, ..Settings::default() };
        let traced = Traced::new(room(Material::uniform("walls", 0.0, 0.5, 8), 5.0), settings);
        let mut arrivals = 0;
        traced.for_each_segment(|_, weight, segment| {
            arrivals += 1;
            for band in 0..8 {
                let energy = weight * segment.energy.band(band) * 64.0;
                assert!((energy - 1.0).abs() < 1e-9, "after {} reflections: {energy}", segment.history.order);
            }
        });
        assert!(arrivals > 64 * 400);
        assert_eq!(traced.ledger.fates.count(Fate::Expired), 64);
        assert!(traced.ledger.bands.iter().all(|ledger| (ledger.truncated - 1.0).abs() < 1e-9));
    }
}

/// α = 1: every packet ends where it first arrives.
#[test]
fn black_walls_swallow_everything_at_once() {
    let settings = Settings { emissions: 1_000, ..Settings::default() };
    let traced = Traced::new(room(Material::uniform("walls", 1.0, 0.5, 8), 1.0), settings);
    assert_eq!(traced.map.vertex_count(), 1_000);
    for ledger in &traced.ledger.bands {
        assert!((ledger.absorbed - 1.0).abs() < 1e-12 && ledger.sampling.abs() < 1e-12, "{ledger:?}");
    }
}

/// Σ incident energy / emitted energy = 1/α for walls of one α: a geometric series.
#[test]
fn incident_energy_is_the_geometric_series() {
    let absorption = 0.2;
    let emissions = 20_000;
    let settings = Settings { emissions, ..Settings::default() };
    let traced = Traced::new(room(Material::uniform("walls", absorption, 0.5, 8), 3.0), settings);
    let mut per_packet = vec![0.0; emissions as usize];
    traced.for_each_segment(|emission, weight, segment| {
        if segment.arrival.is_some() {
            per_packet[emission as usize] += weight * segment.energy[0][0];
        }
    });
    let sum: f64 = per_packet.iter().sum();
    let mean = sum / emissions as f64;
    let sigma = per_packet.iter().map(|incident| (incident - mean).powi(2)).sum::<f64>().sqrt();
    assert!(sigma < 0.02, "too noisy to mean anything: {sigma}");
    assert!((sum - 1.0 / absorption).abs() < 4.0 * sigma, "{sum} ± {sigma}");
}

/// Mean free path of diffuse walls: 4V/S within 4σ, σ below half a percent; a plain average of the axes is rejected.
#[test]
fn the_mean_free_path_is_four_volumes_per_surface() {
    let settings = Settings { emissions: 2_000, survival: 0.0, ..Settings::default() };
    let traced = Traced::new(room(Material::uniform("walls", 0.0, 1.0, 8), 1.0), settings);
    let [x, y, z] = SIZE;
    let expected = 4.0 * x * y * z / (2.0 * (x * y + y * z + z * x));
    let (mut lengths, mut bounces) = (vec![0.0; 2_000], vec![0.0; 2_000]);
    traced.for_each_segment(|emission, _, segment| {
        // The first piece starts inside the room and the last is cut by the clock: both are no wall-to-wall chords.
        if segment.history.order > 0 && segment.arrival.is_some() {
            lengths[emission as usize] += segment.end_length - segment.start_length;
            bounces[emission as usize] += 1.0;
        }
    });
    let (length, count): (f64, f64) = (lengths.iter().sum(), bounces.iter().sum());
    let mean = length / count;
    let spread: f64 = lengths
        .iter()
        .zip(&bounces)
        .map(|(length, count)| (length - mean * count).powi(2))
        .sum::<f64>()
        .sqrt();
    let sigma = spread / count;
    assert!(sigma < 0.005 * expected, "too noisy to mean anything: {sigma}");
    // Cutting at a fixed time prefers short chords: a relative bias of the order of one over the number of bounces.
    let cut = expected * 2_000.0 / count;
    assert!((mean - expected).abs() < 4.0 * sigma + cut, "{mean} instead of {expected} ± {sigma}");
    assert!(((x + y + z) / 3.0 - mean).abs() > 8.0 * sigma + cut);
}
