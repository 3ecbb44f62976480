//! Bending of packets at edges: on only where requested.
//!
//! Bent packets carry late sound around edges, in every band along paths of its own. It costs ten times the CPU time in the
//! hall, and intervals several times as wide. A scattering coefficient of 0.1 approximates a wave solver as well
//! (docs/effects.md), so scattering represents it by default, as in other programs.
//!
//! The paper's mode has edges of its own. References: docs/diffraction.md, docs/effects.md.

use sonel_geometry::Geometry;
use sonel_map::Mode;
use sonel_map::edges::{bending_edges, whole_reach};
use sonel_scene::Scene;

use super::spec::Request;
use super::{ASKED, Bound, Decision, Effect, ON_ARCS};
use crate::pipeline::PAPER_BENDS_NOTHING;

/// Decides on bending.
pub(super) fn decide(request: Request, mode: Mode, scene: &Scene, geometry: &Geometry) -> Decision {
    let wavelengths = scene.wavelengths();
    let bands = wavelengths.len();
    let count = bending_edges(geometry, &wavelengths).lines().len();
    let off = |reason: String| Decision::new(Effect::Bending, vec![false; bands], reason);
    if count == 0 {
        return Decision {
            bound: Some(Bound::nothing(bands)),
            ..off("no edge is sharp and large enough".to_owned())
        };
    }
    match request.decided() {
        _ if mode == Mode::Paper => off(PAPER_BENDS_NOTHING.to_owned()),
        _ if scene.sound_speed_gradient != 0.0 => off(ON_ARCS.to_owned()),
        Some(true) => {
            let reach = whole_reach(&wavelengths);
            let nominal = scene.bands.nominal();
            let farthest = |band: usize| format!("{:.3} m at {} Hz", reach[band], nominal[band]);
            let ends =
                if bands > 1 { format!("{} to {}", farthest(0), farthest(bands - 1)) } else { farthest(0) };
            Decision {
                cost: "several times the CPU time; bent bands share no paths".to_owned(),
                reach,
                ..Decision::new(
                    Effect::Bending,
                    vec![true; bands],
                    format!("{ASKED}, {count} edges; they bend up to {ends}"),
                )
            }
        }
        Some(false) => off(ASKED.to_owned()),
        None => off(format!("not requested, scattering coefficients usually include it ({count} edges)")),
    }
}
