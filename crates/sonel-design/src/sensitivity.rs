//! Derivatives of parameters by the coefficients of materials, with intervals, from one rendering.
//!
//! Every coefficient of every material is raised a little in a variant of its own; the variants stand behind the bands of the scene
//! ([`SonelMap::widen`]) and share packets, rays and random numbers with them, so that differences have hardly any noise of their own.
//! Their intervals come from leaving out one batch at a time. Edges do not diffract in them. References: docs/what-if.md.

use sonel_acoustics::{Coefficient, Material};
use sonel_analysis::sensitivity::{Sensitivity, Slope, slopes};
use sonel_analysis::{Parameter, ReceiverParameters, parameters};
use sonel_geometry::Geometry;
use sonel_map::SonelMap;
use sonel_renderer::{ReceiverPoint, RenderError, RenderSettings};

use sonel::study::pipeline::{NoClock, render_and_read};
use sonel::study::response;

/// By how much a coefficient is raised or lowered: small beside what bends a parameter, large beside rounding.
const STEP: f64 = 1e-3;

/// A coefficient of a material of the scene, and by how much its variant differs.
#[derive(Debug, Clone)]
pub(crate) struct Variant {
    pub material: usize,
    pub coefficient: Coefficient,
    /// By band; 0 where no packet could tell.
    pub steps: Vec<f64>,
}

/// Figures of a map and of its variants: band b of variant v is band (v + 1) B + b of B.
pub(crate) struct Varied {
    pub variants: Vec<Variant>,
    pub bands: usize,
    pub parameters: Vec<ReceiverParameters>,
}

impl Varied {
    /// The slopes of a parameter at one source and receiver by the coefficient of variant number `variant`.
    pub(crate) fn slopes(&self, place: usize, variant: usize, parameter: Parameter) -> Vec<Option<Slope>> {
        let first = (variant + 1) * self.bands;
        slopes(&self.parameters[place], first, &self.variants[variant].steps, parameter)
    }
}

/// A map whose materials are varied, and where and how it is rendered.
pub struct VariedMap<'a> {
    /// The map, whose paths have been checked.
    pub map: &'a mut SonelMap,
    /// The walls of its scene.
    pub geometry: &'a Geometry,
    /// Receivers.
    pub receivers: &'a [ReceiverPoint],
    /// Settings of the renderings.
    pub render: RenderSettings,
}

/// Derivatives of `wanted` by absorption and scattering of every material in use.
///
/// # Errors
/// When the map cannot be rendered.
pub fn sensitivities(
    mut map: VariedMap<'_>,
    wanted: &[Parameter],
    progress: &mut (dyn FnMut(usize, f64) + Send),
) -> Result<Vec<Sensitivity>, RenderError> {
    let materials = map.map.header().scene.materials.iter();
    let names: Vec<String> = materials.map(|material| material.name.clone()).collect();
    let both = [Coefficient::Absorption, Coefficient::Scattering];
    let varied = map.vary(&both, progress)?;
    let mut found = Vec::new();
    for (place, parameters) in varied.parameters.iter().enumerate() {
        for (index, variant) in varied.variants.iter().enumerate() {
            found.extend(wanted.iter().map(|&parameter| Sensitivity {
                source: parameters.source.clone(),
                receiver: parameters.name.clone(),
                material: names[variant.material].clone(),
                coefficient: variant.coefficient,
                parameter,
                slopes: varied.slopes(place, index, parameter),
            }));
        }
    }
    Ok(found)
}

impl VariedMap<'_> {
    /// Renders it and reads the parameters.
    ///
    /// # Errors
    /// When the map cannot be rendered.
    pub(crate) fn read(&self) -> Result<Vec<ReceiverParameters>, sonel::Error> {
        Ok(render_and_read(self.map, self.geometry, self.receivers, &self.render, &NoClock)?.parameters)
    }

    /// Renders it with a variant for each of `coefficients` of every material in use.
    ///
    /// # Errors
    /// When the map cannot be rendered.
    pub(crate) fn vary(
        &mut self,
        coefficients: &[Coefficient],
        progress: &mut (dyn FnMut(usize, f64) + Send),
    ) -> Result<Varied, RenderError> {
        let scene = &self.map.header().scene;
        let (materials, bands) = (scene.materials.clone(), scene.bands.count());
        let mut variants = variants(&materials, self.geometry);
        variants.retain(|variant| coefficients.contains(&variant.coefficient));
        let changed: Vec<Vec<Material>> =
            variants.iter().map(|variant| variant.applied(&materials)).collect();
        let Self { map, geometry, receivers, render } = self;
        let response = response::render_variants(map, geometry, receivers, render, &changed, progress)?;
        Ok(Varied { variants, bands, parameters: parameters(&response) })
    }
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

/// The entry of `material` for a coefficient.
pub(crate) fn values(material: &mut Material, coefficient: Coefficient) -> &mut Vec<f64> {
    match coefficient {
        Coefficient::Scattering => &mut material.scattering,
        _ => &mut material.absorption,
    }
}

/// A coefficient of `material` in a band.
pub(crate) fn value(material: &Material, coefficient: Coefficient, band: usize) -> f64 {
    match coefficient {
        Coefficient::Scattering => material.scattering[band],
        _ => material.absorption[band],
    }
}

impl Variant {
    fn applied(&self, materials: &[Material]) -> Vec<Material> {
        let mut changed = materials.to_vec();
        let values = values(&mut changed[self.material], self.coefficient);
        values.iter_mut().zip(&self.steps).for_each(|(value, step)| *value += step);
        changed
    }
}
