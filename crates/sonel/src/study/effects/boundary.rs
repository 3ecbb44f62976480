//! The boundary term: decided in rendering, where the walls about each receiver are measured.
//!
//! References: [Waterhouse1955] (docs/references.md), `sonel_renderer::boundary`.

use std::f64::consts::LOG10_E;

use glam::DMat3;
use sonel_geometry::{Geometry, SurfaceId};
use sonel_map::Mode;
use sonel_renderer::boundary::{HIGHEST_HZ, facing, weight};
use sonel_scene::Scene;

use super::spec::Request;
use super::{Bound, Decision, Effect, left_out};

/// Decides on the boundary term.
pub(super) fn decide(request: Request, mode: Mode, scene: &Scene, geometry: &Geometry) -> Decision {
    let nominal = scene.bands.nominal();
    let decision = |on: &dyn Fn(f64) -> bool, reason| {
        Decision::new(Effect::Boundary, nominal.iter().map(|&f| on(f)).collect(), reason)
    };
    if let Some(why) = left_out(request, mode, "the paper has none") {
        return decision(&|_| false, why.to_owned());
    }
    let is_low = |f: f64| f <= HIGHEST_HZ;
    let Some(volume) = geometry.volume() else {
        let reason = "in rendering, in proportion to what encloses each receiver; nothing outdoors";
        return decision(&is_low, reason.to_owned());
    };
    let surfaces = (0..).map(SurfaceId).zip(geometry.surfaces());
    let walls: DMat3 =
        surfaces.map(|(id, it)| geometry.exposed(id) / (4.0 * volume) * facing(it.normal)).sum();
    let change = |f: f64| 10.0 * LOG10_E * libm::log(weight(walls, scene.speed_of_sound / f, f));
    let listed = nominal.iter().filter(|f| is_low(**f)).map(|&f| format!("{:+.2} dB at {f} Hz", change(f)));
    let listed = listed.collect::<Vec<_>>().join(", ").replace('-', "−");
    let reason = format!("all but direct sound: {listed}; in rendering, for the walls about each receiver");
    let level_db: Vec<f64> = nominal.iter().map(|&f| change(f).abs()).collect();
    let bound = Some(Bound { decay: vec![0.0; level_db.len()], level_db });
    Decision { bound, ..decision(&is_low, reason) }
}
