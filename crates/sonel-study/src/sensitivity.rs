//! How the parameters at receivers change with the coefficients of materials: derivatives with intervals, all from one rendering.
//!
//! Every coefficient of every material is raised a little in a variant of its own; the variants stand behind the bands of the scene
//! ([`SonelMap::widen`]) and share packets, rays and random numbers with them, so that differences have hardly any noise of their own.
//! Their intervals come from leaving out one batch at a time. Edges do not diffract in them. References: docs/what-if.md.

use sonel_acoustics::{Coefficient, Material};
use sonel_analysis::sensitivity::{Sensitivity, slopes};
use sonel_analysis::{Parameter, parameters};
use sonel_geometry::Geometry;
use sonel_map::SonelMap;
use sonel_renderer::{ReceiverPoint, RenderError, RenderSettings, Renderer};

use crate::response;

/// By how much a coefficient is raised or lowered: small beside what bends a parameter, large beside rounding.
const STEP: f64 = 1e-3;

/// A coefficient of a material of the scene, and by how much its variant differs.
struct Variant {
    material: usize,
    coefficient: Coefficient,
    /// By band; 0 where no packet could tell.
    steps: Vec<f64>,
}

/// Derivatives of `wanted` at `receivers` by absorption and scattering of every material in use. `map` has all variants as further bands
/// afterwards.
///
/// # Errors
/// When the map cannot be rendered, or bends packets.
pub fn sensitivities(
    map: &mut SonelMap,
    geometry: &Geometry,
    settings: RenderSettings,
    receivers: &[ReceiverPoint],
    wanted: &[Parameter],
    progress: &mut dyn FnMut(usize, f64),
) -> Result<Vec<Sensitivity>, RenderError> {
    if map.header().bending_reach().is_some() {
        return Err(RenderError::Settings(
            "its packets were bent: trace the scene with --effects auto,-bending".to_owned(),
        ));
    }
    let scene = map.header().scene.clone();
    let variants = variants(&scene.materials, geometry);
    let changed: Vec<Vec<Material>> =
        variants.iter().map(|variant| variant.applied(&scene.materials)).collect();
    map.widen(&changed);
    let renderer = Renderer::new(map, geometry, settings)?;
    let renderings = response::render(map, &renderer, receivers, progress)?;
    let figures = parameters(&response::assemble(map, &renderer, receivers, &renderings));
    let mut found = Vec::new();
    for figures in &figures {
        for (index, variant) in variants.iter().enumerate() {
            found.extend(wanted.iter().map(|&parameter| Sensitivity {
                source: figures.source.clone(),
                receiver: figures.name.clone(),
                material: scene.materials[variant.material].name.clone(),
                coefficient: variant.coefficient,
                parameter,
                slopes: slopes(figures, (index + 1) * scene.bands.count(), &variant.steps, parameter),
            }));
        }
    }
    Ok(found)
}

/// Absorption and scattering of every material in use that packets can tell in any band.
fn variants(materials: &[Material], geometry: &Geometry) -> Vec<Variant> {
    let in_use = |index: usize| geometry.surfaces().iter().any(|surface| surface.material as usize == index);
    let mut variants = Vec::new();
    for (index, material) in materials.iter().enumerate().filter(|(index, _)| in_use(*index)) {
        let bands = 0..material.absorption.len();
        let absorption = bands.clone().map(|band| {
            // A black surface reflects nothing that could be weighed anew.
            if material.absorption[band] < 1.0 - STEP { STEP } else { 0.0 }
        });
        // What was never scattered, or always, cannot be.
        let scattering = bands.map(|band| match material.scattering[band] {
            _ if material.absorption[band] >= 1.0 => 0.0,
            s if s <= 0.0 || s >= 1.0 => 0.0,
            s if s < 0.5 => STEP.min(s),
            s => -STEP.min(1.0 - s),
        });
        let of = |coefficient, steps: Vec<f64>| Variant { material: index, coefficient, steps };
        variants.push(of(Coefficient::Absorption, absorption.collect()));
        variants.push(of(Coefficient::Scattering, scattering.collect()));
    }
    variants.retain(|variant| variant.steps.iter().any(|&step| step.abs() > 0.0));
    variants
}

impl Variant {
    fn applied(&self, materials: &[Material]) -> Vec<Material> {
        let mut changed = materials.to_vec();
        let material = &mut changed[self.material];
        let values = match self.coefficient {
            Coefficient::Scattering => &mut material.scattering,
            _ => &mut material.absorption,
        };
        for (value, step) in values.iter_mut().zip(&self.steps) {
            *value += step;
        }
        changed
    }
}
