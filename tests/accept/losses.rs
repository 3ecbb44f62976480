//! Ten million segments in every shipped room, none lost, and a ledger that closes.

use sonel_map::{Fate, Settings, ShardRange};
use sonel_tests::shipped;
use sonel_tracer::Tracer;

#[test]
fn no_packet_slips_out_of_a_shipped_room() {
    for (name, emissions) in [("seed-room", 270_000), ("shoebox", 360_000), ("hall", 400_000)] {
        let scene = shipped(name);
        let geometry = scene.geometry().unwrap();
        let settings = Settings { emissions, ..Settings::default() };
        let ledger = Tracer::new(&scene, &geometry, settings)
            .run(ShardRange::WHOLE, |_| Ok::<(), sonel_tracer::TraceError>(()))
            .unwrap();
        println!("{name}: {} segments, residual {:.1e}", ledger.segments, ledger.worst_residual());
        assert!(ledger.segments >= 10_000_000, "{name}: {} segments", ledger.segments);
        assert_eq!(ledger.fates.count(Fate::Lost), 0, "{name}");
        assert!(ledger.worst_residual() < 1e-9, "{name}");
        for band in &ledger.bands {
            assert!(band.sampling.abs() <= 4.0 * band.sampling_sigma() + 1e-12, "{name}: {band:?}");
        }
    }
}
