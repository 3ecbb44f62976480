//! Receivers that only a small lit part of all directions reaches: outside of a room, behind a window or an opening.

use sonel_analysis::{Parameter, parameters};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_testkit::z_test::{Estimate, Within, agree};
use sonel_tests::window::RoomWithWindow;
use sonel_tests::{Traced, batch_fluence};

const WINDOW: RoomWithWindow =
    RoomWithWindow { corners: [[1.0, 0.5], [4.0, 2.5]], transmission: Some(0.01), scattering: 0.5 };
const NEAR: [f64; 3] = [16.0, 2.5, 1.5];
const FAR: [f64; 3] = [58.0, 2.5, 1.5];
const INSIDE: [f64; 3] = [3.5, 3.5, 1.2];

fn traced(room: RoomWithWindow, receivers: &[[f64; 3]], emissions: u64) -> Traced {
    Traced::with(&["transmission"], room.scene(receivers), Settings { emissions, ..Settings::default() })
}

/// Of the rays to all directions three in ten thousand would meet the window.
#[test]
#[ignore = "long: cargo xtask accept"]
fn a_window_far_away_is_heard_with_few_sonels() {
    let traced = traced(WINDOW, &[NEAR, FAR], 5_000);
    let rendering = traced.render(RenderSettings::default());
    for (index, (receiver, radius)) in [(NEAR, 0.7), (FAR, 1.5)].into_iter().enumerate() {
        let (value, sigma) = batch_fluence(&rendering, index, 0);
        let counted = WINDOW.fluence(receiver, radius, 300_000);
        let within = Within { sigmas: 4.0, maximal_sigma: 0.06 * value };
        let found = Estimate { value, sigma };
        assert!(sigma < 0.03 * value, "{receiver:?}: {found:?}");
        agree(found, counted, within).unwrap_or_else(|off| panic!("{receiver:?}: {off}"));
        let without_mirrors = Estimate {
            value: value - rendering.classes[sonel_renderer::PathClass::DiffuseMirror as usize].1[0],
            sigma,
        };
        assert!(
            index > 0 || agree(without_mirrors, counted, within).is_err(),
            "without what mirrors in the room show"
        );
    }
    for found in parameters(&traced.respond(RenderSettings::default())) {
        let level = found.bands[0].parameter(Parameter::Level).as_ref().expect("a level");
        let [low, high] = *level.interval.as_ref().expect("an interval");
        assert!(high - low > 0.05 && high - low < 2.0, "{level:?}");
    }
}

/// Balls and discs have the size that they have in the room without the ground of 120 m about it.
#[test]
fn sizes_follow_the_room_and_not_the_ground() {
    let radius = |rendering: &sonel_renderer::Rendering| rendering.sphere_radius[0];
    let outdoors = radius(&traced(WINDOW, &[INSIDE], 5_000).render(RenderSettings::default()));
    let mut alone = WINDOW.scene(&[INSIDE]);
    alone.mesh.triangles.retain(|triangle| triangle.material != 2);
    let alone = radius(
        &Traced::new(alone, Settings { emissions: 5_000, ..Settings::default() })
            .render(RenderSettings::default()),
    );
    assert!((outdoors / alone).log2().abs() <= 0.6, "{outdoors} m, {alone} m in the room alone");
}
