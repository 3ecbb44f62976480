//! Any two estimators of the same class agree within their joint interval, in every shipped scene.

use sonel_map::Settings;
use sonel_renderer::{Estimator, RenderSettings};
use sonel_tests::{Traced, late_batch_fluence, shipped};

/// Where late sound begins, in bins of one millisecond.
const LATE_MS: usize = 100;

#[test]
fn estimators_agree_in_every_shipped_scene() {
    for (name, emissions, order) in
        [("seed-room", 200_000, None), ("shoebox", 200_000, None), ("hall", 400_000, Some(2))]
    {
        let traced = Traced::new(shipped(name), Settings { emissions, ..Settings::default() });
        let receivers = traced.map.header().scene.receivers.len();
        let bands = traced.map.header().scene.bands.count();
        let renderings =
            [Estimator::Auto, Estimator::Connection, Estimator::Gather, Estimator::Sphere].map(|estimator| {
                let settings = RenderSettings {
                    estimator,
                    mirror_order: order,
                    rays: Some(65_536),
                    ..RenderSettings::default()
                };
                traced.render(settings)
            });
        for receiver in 0..receivers {
            for band in (0..bands).step_by(3) {
                let level = |(mean, error): (f64, f64)| (10.0 * mean.log10(), 4.343 * error / mean);
                let levels = |first_bin: usize| {
                    renderings
                        .each_ref()
                        .map(|rendering| level(late_batch_fluence(rendering, receiver, band, first_bin)))
                };
                // Balls average over the shadows of early reflections: they are heard for what comes later.
                let (all, late) = (levels(0), levels(LATE_MS));
                println!("{name} receiver {receiver} band {band}: {all:.3?}, late {late:.3?}");
                for (levels, first, second) in [(all, 0, 1), (all, 0, 2), (late, 0, 3), (late, 2, 3)] {
                    let ((a, da), (b, db)) = (levels[first], levels[second]);
                    // Batches are shared, so the joint error is at most the sum; 0.03 dB for the radii's bias.
                    assert!(da < 0.25 && db < 0.25, "too noisy to mean anything");
                    assert!(
                        (a - b).abs() < 4.0 * (da * da + db * db).sqrt() + 0.03,
                        "{name} {receiver} {band}: {levels:?}"
                    );
                }
            }
        }
    }
}
