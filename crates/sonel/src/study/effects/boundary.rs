//! The boundary term: decided in rendering, where the walls about each receiver are measured.
//!
//! References: [Waterhouse1955] (docs/references.md), `sonel_renderer::boundary`.

use std::f64::consts::LOG10_E;

use glam::DMat3;
use sonel_acoustics::modes::{facing, spared};
use sonel_geometry::{Geometry, SurfaceId};
use sonel_map::Mode;
use sonel_renderer::boundary::{wavelengths, weight};
use sonel_scene::Scene;

use super::spec::Request;
use super::{Bound, Decision, Effect, left_out};

/// Decides on the boundary term.
pub(super) fn decide(request: Request, mode: Mode, scene: &Scene, geometry: &Geometry) -> Decision {
    let wavelengths = wavelengths(scene);
    let is_low: Vec<bool> = wavelengths.iter().map(|of| *of > 0.0).collect();
    if let Some(why) = left_out(request, mode, "the paper has none") {
        return Decision::new(Effect::Boundary, vec![false; is_low.len()], why.to_owned());
    }
    let decision = |reason| Decision::new(Effect::Boundary, is_low, reason);
    let Some(volume) = geometry.volume() else {
        return decision("in rendering, by what encloses each receiver; nothing outdoors".to_owned());
    };
    let surfaces = (0..).map(SurfaceId).zip(geometry.surfaces());
    let walls: DMat3 =
        surfaces.map(|(id, it)| geometry.exposed(id) / (4.0 * volume) * facing(it.normal)).sum();
    let change = |&of: &f64| 10.0 * LOG10_E * libm::log(weight(walls, of));
    let longer = |&of: &f64| (1.0 - spared(2.0 * walls, of)).recip() - 1.0;
    let low = scene.bands.nominal().iter().zip(&wavelengths).filter(|(_, of)| **of > 0.0);
    let of_band =
        |(f, of)| format!("{:+.2} dB, {:.2} T at {f} Hz", change(of), 1.0 + longer(of)).replace('-', "−");
    let listed = low.map(of_band).collect::<Vec<_>>().join("; ");
    let reason = format!("all but direct sound: {listed}; in rendering, for the walls about each receiver");
    let level_db = wavelengths.iter().map(|of| change(of).abs()).collect();
    let bound = Some(Bound { level_db, decay: wavelengths.iter().map(longer).collect() });
    Decision { bound, ..decision(reason) }
}
