//! Edge diffraction: computed in rendering, at each receiver as far as it matters there; traced only in the founding paper's mode.
//!
//! References: docs/effects.md, docs/paper-mode.md.

use sonel_geometry::Geometry;
use sonel_map::Mode;
use sonel_scene::Scene;

use super::spec::Request;
use super::{ASKED, Bound, Decision, Effect};

/// Decides on diffraction.
pub(super) fn decide(request: Request, mode: Mode, scene: &Scene, geometry: &Geometry) -> Decision {
    let bands = scene.bands.count();
    let decision = |on: bool, reason: String| Decision::new(Effect::Diffraction, vec![on; bands], reason);
    let count = geometry.diffracting_edges().count();
    let edges = if count == 1 { "edge" } else { "edges" };
    match (count, request, mode) {
        (_, Request::Off, _) => decision(false, ASKED.to_owned()),
        (0, ..) => {
            let bound = Some(Bound::nothing(bands));
            Decision { bound, ..decision(false, "no free or convex edge".to_owned()) }
        }
        (.., Mode::Paper) => decision(
            true,
            format!("as in the paper, in zones of half a wavelength on either side of {count} {edges}"),
        ),
        (.., Mode::Accurate) => {
            decision(true, format!("{count} {edges}, computed in rendering where they matter"))
        }
    }
}
