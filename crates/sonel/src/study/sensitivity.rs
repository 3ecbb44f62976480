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
use sonel_renderer::{ReceiverPoint, RenderSettings};

use crate::study::pipeline::render_variants;
use crate::{Observer, Result};

/// By how much a coefficient is raised or lowered: small beside what bends a parameter, large beside rounding.
const STEP: f64 = 1e-3;

/// A coefficient of a material of the scene, and by how much its variant differs.
#[derive(Debug, Clone)]
pub struct Variant {
    /// Index of the material.
    pub material: usize,
    /// Coefficient of the material.
    pub coefficient: Coefficient,
    /// By band; 0 where no packet could tell.
    pub steps: Vec<f64>,
}

/// Parameters of a map and of its variants: band b of variant v is band (v + 1) B + b of B.
pub struct Varied {
    /// The variants.
    pub variants: Vec<Variant>,
    /// Names of all materials of the scene.
    pub materials: Vec<String>,
    /// Number of bands B.
    pub bands: usize,
    /// Source by source, receiver by receiver.
    pub parameters: Vec<ReceiverParameters>,
}

impl Varied {
    /// Derivatives of `wanted` by the coefficient of every variant.
    #[must_use]
    pub fn sensitivities(&self, wanted: &[Parameter]) -> Vec<Sensitivity> {
        let mut found = Vec::new();
        for (place, parameters) in self.parameters.iter().enumerate() {
            for (index, variant) in self.variants.iter().enumerate() {
                found.extend(wanted.iter().map(|&parameter| Sensitivity {
                    source: parameters.source.clone(),
                    receiver: parameters.name.clone(),
                    material: self.materials[variant.material].clone(),
                    coefficient: variant.coefficient,
                    parameter,
                    slopes: self.slopes(place, index, parameter),
                }));
            }
        }
        found
    }

    /// The slopes of a parameter at one source and receiver by the coefficient of variant number `variant`.
    #[must_use]
    pub fn slopes(&self, place: usize, variant: usize, parameter: Parameter) -> Vec<Option<Slope>> {
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

impl VariedMap<'_> {
    /// Renders it with a variant for each of `coefficients` of every material in use.
    ///
    /// # Errors
    /// When the map cannot be rendered; [`crate::Error::Stopped`].
    pub fn vary(&mut self, coefficients: &[Coefficient], observer: &dyn Observer) -> Result<Varied> {
        let scene = &self.map.header().scene;
        let (materials, bands) = (scene.materials.clone(), scene.bands.count());
        let mut variants = variants(&materials, self.geometry);
        variants.retain(|variant| coefficients.contains(&variant.coefficient));
        let changed: Vec<Vec<Material>> =
            variants.iter().map(|variant| variant.applied(&materials)).collect();
        let Self { map, geometry, receivers, render } = self;
        let response = render_variants(map, geometry, receivers, render, &changed, observer)?;
        let materials = materials.into_iter().map(|material| material.name).collect();
        Ok(Varied { variants, materials, bands, parameters: parameters(&response) })
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

impl Variant {
    fn applied(&self, materials: &[Material]) -> Vec<Material> {
        let mut changed = materials.to_vec();
        let material = &mut changed[self.material];
        let values = match self.coefficient {
            Coefficient::Scattering => &mut material.scattering,
            _ => &mut material.absorption,
        };
        values.iter_mut().zip(&self.steps).for_each(|(value, step)| *value += step);
        changed
    }
}
