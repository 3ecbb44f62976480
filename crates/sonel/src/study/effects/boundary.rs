//! The boundary term: decided in rendering, where the walls about each receiver are measured.
//!
//! References: [Waterhouse1955] (docs/references.md), `sonel_renderer::boundary`.

use std::f64::consts::LOG10_E;

use sonel_geometry::Geometry;
use sonel_map::Mode;
use sonel_renderer::boundary::{HIGHEST_HZ, weight};
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
    let area = geometry.area();
    let energy = |f: f64| weight(area / (4.0 * volume), scene.speed_of_sound / f, f);
    let level_db: Vec<f64> = nominal.iter().map(|&f| -10.0 * LOG10_E * libm::log(energy(f))).collect();
    let listed = nominal.iter().zip(&level_db).filter(|(f, _)| is_low(**f));
    let listed: Vec<String> = listed.map(|(f, db)| format!("−{db:.2} dB at {f} Hz")).collect();
    let reason = format!(
        "all but direct sound is lower by 10 lg(1 + c S/(8 V f)), V {volume:.0} m³, S {area:.0} m², {}; in rendering, for the walls about each receiver",
        listed.join(", ")
    );
    let bound = Some(Bound { decay: vec![0.0; level_db.len()], level_db });
    Decision { bound, ..decision(&is_low, reason) }
}
