//! Partitions with thickness between rooms in a row, drawn as solids and as gaps between shells, against the slow simulator: what enters one
//! face leaves the other, whatever is beside the thickness.

use sonel_map::Settings;
use sonel_renderer::{Estimator, RenderSettings};
use sonel_testkit::row_of_rooms::RowOfRooms;
use sonel_testkit::z_test::{Estimate, Within, agree};
use sonel_tests::row_of_rooms::{Drawn, fluences, row, scene};
use sonel_tests::{Traced, batch_fluence};

/// What the rooms get.
fn found(row: RowOfRooms, drawn: Drawn, estimator: Estimator, seed: u64) -> Vec<Estimate> {
    let settings = Settings { emissions: 40_000, seed, ..Settings::default() };
    let traced = Traced::with(&["transmission"], scene(row, drawn), settings);
    assert!(traced.geometry.is_watertight() && traced.ledger.worst_residual() < 1e-9);
    let rendering = traced.render(RenderSettings { estimator, ..RenderSettings::default() });
    (0..row.rooms)
        .map(|receiver| {
            let (value, sigma) = batch_fluence(&rendering, receiver, 0);
            Estimate { value, sigma }
        })
        .collect()
}

/// Whether all rooms get what the slow simulator counts.
fn check(found: &[Estimate], counted: &[Estimate]) -> Result<(), String> {
    for (room, (found, counted)) in found.iter().zip(counted).enumerate() {
        let off = 10.0 * (found.value / counted.value).log10();
        println!(
            "room {room}: {off:+.3} dB ± {:.3} ± {:.3}",
            4.343 * found.sigma / found.value,
            4.343 * counted.sigma / counted.value
        );
        let within = Within { sigmas: 4.0, maximal_sigma: 0.03 * found.value };
        agree(*found, *counted, within).map_err(|off| format!("room {room}: {off}"))?;
    }
    Ok(())
}

#[test]
fn three_rooms_in_a_row_get_what_passes_whatever_the_thickness() {
    let row = row(3, 0.4);
    let counted = fluences(row, 40_000);
    for (seed, drawn) in [
        (1, Drawn::Sheets),
        (2, Drawn::Sheets),
        (3, Drawn::Solids(0.1)),
        (4, Drawn::Solids(1.0)),
        (5, Drawn::Shells(0.3)),
    ] {
        println!("{drawn:?}");
        let found = found(row, drawn, Estimator::Auto, seed);
        check(&found, &counted).unwrap_or_else(|flaw| panic!("{drawn:?}: {flaw}"));
        // A loss of 0.3 dB at each partition.
        let weak: Vec<Estimate> = counted
            .iter()
            .zip([1.0, 0.933, 0.871])
            .map(|(it, loss)| Estimate { value: loss * it.value, ..*it })
            .collect();
        assert!(check(&found, &weak).is_err(), "a loss in the thickness is found");
    }
}
