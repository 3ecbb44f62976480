//! Energy factors f and event probabilities p per material, event and band.
//!
//! f_j multiplies the energy of band j: specular (1−α)(1−s), diffuse (1−α)s, transmitted τ. p_k is the
//! probability that a packet of lead k takes the event ([`Leads`]; docs/physics.md §2, §3). Bands and leads stand
//! in lanes of four so that the compiler vectorises over them; lanes beyond the last are zero.

use std::borrow::Cow;

use glam::DVec3;
use sonel_acoustics::{AbsorptionLaw, BandValues, Lanes, Material, to_lanes};
use sonel_geometry::{Geometry, SurfaceId};
use sonel_scene::Propagation;

use crate::classes::BandClasses;
use crate::format::SurfaceRow;
use crate::incidence;
use crate::leads::{LEAST_THROUGH, Leads};
use crate::spectral::Spectral;

/// Energy factors and probabilities of one event at one material.
#[derive(Debug, Clone, PartialEq)]
pub struct EventRow {
    /// f_j per band.
    pub energy: Vec<Lanes>,
    /// p_k per lead.
    pub probability: Vec<Lanes>,
}

/// One material in the form the packets need.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialRow {
    /// Mirror reflection.
    pub specular: EventRow,
    /// Lambert reflection.
    pub diffuse: EventRow,
    /// Straight transmission.
    pub transmitted: EventRow,
    /// α − τ: the part of the incident energy that turns to heat here.
    pub dissipated: Vec<Lanes>,
    /// a = 1 − α + τ: the part that goes on.
    pub passed_on: Vec<Lanes>,
    /// Whether no band reflects diffusely here.
    pub is_mirror: bool,
    /// Whether any band passes.
    pub is_partition: bool,
    /// Per lead: upper ends, in [0, 1], of the intervals of one uniform number for specular, diffuse and
    /// transmitted; beyond the last the packet ends.
    pub thresholds: Vec<[f64; 3]>,
}

impl MaterialRow {
    /// Takes `absorption` in place of its own, of a material that nothing passes.
    fn absorb(&mut self, absorption: impl Iterator<Item = Lanes>) {
        let energies = self.specular.energy.iter_mut().zip(&mut self.diffuse.energy);
        let balance = self.passed_on.iter_mut().zip(&mut self.dissipated);
        for ((absorption, (passed_on, dissipated)), (specular, diffuse)) in
            absorption.zip(balance).zip(energies)
        {
            // Lanes behind the last band pass nothing on.
            let (before, after) = (*passed_on, Lanes::ONE - absorption);
            let change = before.select(after / before, Lanes::ONE);
            *specular *= change;
            *diffuse *= change;
            *dissipated = before.select(Lanes::ONE - after, *dissipated);
            *passed_on = before.select(after, before);
        }
    }

    /// Share of the rays from receivers and of those that are always mirrored that goes through: all where nothing is mirrored, none where
    /// nothing passes.
    #[must_use]
    pub fn through(&self) -> f64 {
        match self.is_partition {
            false => 0.0,
            true if self.specular.energy.largest() > 0.0 => LEAST_THROUGH,
            true => 1.0,
        }
    }
}

/// All materials of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientTable {
    bands: usize,
    leads: usize,
    /// A block per material: its mean row, and behind it one for each range of angles where its absorption depends on them, for the
    /// probabilities of events.
    rows: Vec<MaterialRow>,
    /// Begin of the block of each material.
    first_rows: Vec<usize>,
    /// Law and [parameters](AbsorptionLaw::parameter) of materials whose absorption depends on the angle.
    laws: Vec<Option<(AbsorptionLaw, Vec<Lanes>)>>,
    /// Material and unit normal of every surface.
    surfaces: Vec<(u32, DVec3)>,
    transmits: bool,
    propagation: Propagation,
}

impl CoefficientTable {
    /// The table for `materials` over `bands` bands, each a lead, and the survival exponent β in [0, 1].
    #[must_use]
    pub fn new(materials: &[Material], bands: usize, survival: f64) -> Self {
        let leads = Leads::new(materials, &[], &[], survival, Spectral::PerBand);
        Self::grouped(materials, &BandClasses::separate(bands), &leads)
    }

    /// The table with one column for each of `classes`, for events drawn by `leads`, which are of as many materials.
    #[must_use]
    pub fn grouped(materials: &[Material], classes: &BandClasses, leads: &Leads) -> Self {
        let (mut rows, mut first_rows) = (Vec::new(), Vec::new());
        for (index, material) in materials.iter().enumerate() {
            first_rows.push(rows.len());
            rows.push(material_row(material, classes, &leads.probabilities(index, Material::clone)));
            if material.law.is_angular() {
                let at = |range| {
                    let seen = |material: &Material| seen_within(material, range);
                    material_row(&seen(material), classes, &leads.probabilities(index, seen))
                };
                rows.extend((0..incidence::RANGES).map(at));
            }
        }
        let laws = materials.iter().map(|material| law(material, classes)).collect();
        let transmits = rows.iter().any(|row| row.is_partition);
        let (bands, leads, surfaces) = (classes.count(), leads.classes().count(), Vec::new());
        Self { bands, leads, rows, first_rows, laws, surfaces, transmits, propagation: Propagation::Even }
    }

    /// The same for these surfaces of a map.
    #[must_use]
    pub(crate) fn with_surfaces(self, surfaces: &[SurfaceRow]) -> Self {
        let surface = |row: &SurfaceRow| (row.material, DVec3::from_array(row.normal));
        Self { surfaces: surfaces.iter().map(surface).collect(), ..self }
    }

    /// The same for the surfaces of `geometry`.
    #[must_use]
    pub fn with_geometry(self, geometry: &Geometry) -> Self {
        let surfaces = geometry.surfaces().iter();
        Self { surfaces: surfaces.map(|surface| (surface.material, surface.normal)).collect(), ..self }
    }

    /// Number of surfaces.
    #[must_use]
    pub fn surface_count(&self) -> usize {
        self.surfaces.len()
    }

    /// Whether absorption depends on the angle anywhere.
    #[inline]
    #[must_use]
    pub fn is_angular(&self) -> bool {
        self.rows.len() > self.first_rows.len()
    }

    /// The row of `surface` for a packet that meets it in `direction`, of any length: energies at that angle, probabilities of its range.
    #[inline]
    #[must_use]
    pub fn row(&self, surface: SurfaceId, direction: DVec3) -> Cow<'_, MaterialRow> {
        if self.is_angular() {
            self.row_at(surface, direction)
        } else {
            Cow::Borrowed(self.mean_row(surface))
        }
    }

    #[cold]
    fn row_at(&self, surface: SurfaceId, direction: DVec3) -> Cow<'_, MaterialRow> {
        let (material, normal) = self.surfaces[surface.0 as usize];
        let first = self.first_rows[material as usize];
        let Some((law, parameters)) = &self.laws[material as usize] else {
            return Cow::Borrowed(&self.rows[first]);
        };
        let cosine = direction.dot(normal).abs() / direction.length();
        let mut row = self.rows[first + 1 + incidence::range_of(cosine)].clone();
        row.absorb(parameters.iter().map(|of| of.map(|parameter| law.absorption_at(parameter, cosine))));
        Cow::Owned(row)
    }

    /// The row of `surface` at any angle: where absorption depends on it, that of diffuse incidence.
    #[inline]
    #[must_use]
    pub fn mean_row(&self, surface: SurfaceId) -> &MaterialRow {
        self.material(self.surfaces[surface.0 as usize].0)
    }

    /// By how much more `surface` reflects of what meets it in `direction` than of diffuse incidence; none where no angle matters.
    #[must_use]
    pub fn relative_reflection(&self, surface: SurfaceId, direction: DVec3) -> Option<Vec<Lanes>> {
        let (material, _) = self.surfaces[surface.0 as usize];
        self.laws[material as usize].as_ref()?;
        let row = self.row(surface, direction);
        let lanes = row.passed_on.iter().zip(&self.material(material).passed_on);
        // No wall of this kind absorbs all of diffuse incidence: nothing is divided by zero but the lanes behind the bands.
        Some(lanes.map(|(&part, &whole)| whole.select(part / whole, Lanes::ZERO)).collect())
    }

    /// Unit normal of `surface`.
    #[must_use]
    pub fn normal(&self, surface: SurfaceId) -> DVec3 {
        self.surfaces[surface.0 as usize].1
    }

    /// Multiplies `energy` by (1−α)(1−s) of `surface` met in `direction`, exactly at that angle.
    pub fn mirror(&self, surface: SurfaceId, direction: DVec3, energy: &mut [Lanes]) {
        let (material, normal) = self.surfaces[surface.0 as usize];
        let row = self.material(material);
        let Some((law, parameters)) = &self.laws[material as usize] else {
            return energy.multiply(&row.specular.energy);
        };
        let cosine = direction.dot(normal).abs() / direction.length();
        let means = row.specular.energy.iter().zip(&row.passed_on);
        for ((energy, (&factor, &mean)), parameter) in energy.iter_mut().zip(means).zip(parameters) {
            // (1−s) is what the mean row mirrors of what it reflects; no wall of this kind absorbs all.
            let mirrored = mean.select(factor / mean, Lanes::ZERO);
            *energy *= mirrored * (Lanes::ONE - parameter.map(|of| law.absorption_at(of, cosine)));
        }
    }

    /// The same with the `propagation` between surfaces, which is that of even air otherwise.
    #[must_use]
    pub fn with_propagation(self, propagation: Propagation) -> Self {
        Self { propagation, ..self }
    }

    /// Propagation between surfaces.
    #[inline]
    #[must_use]
    pub fn propagation(&self) -> &Propagation {
        &self.propagation
    }

    /// Number of columns of energies: bands, or classes of bands.
    #[must_use]
    pub fn bands(&self) -> usize {
        self.bands
    }

    /// Number of columns of probabilities: leads, or classes of leads.
    #[must_use]
    pub fn leads(&self) -> usize {
        self.leads
    }

    /// Whether anything passes any material.
    #[inline]
    #[must_use]
    pub fn transmits(&self) -> bool {
        self.transmits
    }

    /// The row of material number `material` at any angle: where absorption depends on it, that of diffuse incidence.
    #[inline]
    #[must_use]
    pub fn material(&self, material: u32) -> &MaterialRow {
        &self.rows[self.first_rows[material as usize]]
    }
}

/// What a material is to a diffuse field from the angles of range number `range`. Materials are within their law; only the step of a
/// derivative may lead beyond, where the softest wall stands for it.
fn seen_within(material: &Material, range: usize) -> Material {
    let law = material.law;
    let mean = |&absorption: &f64| {
        law.mean_between(law.parameter(absorption), incidence::bounds(range)).clamp(0.0, 1.0)
    };
    Material { absorption: material.absorption.iter().map(mean).collect(), ..material.clone() }
}

fn law(material: &Material, classes: &BandClasses) -> Option<(AbsorptionLaw, Vec<Lanes>)> {
    let law = material.law;
    let of = |band: usize| law.parameter(material.absorption[band]);
    law.is_angular().then(|| (law, to_lanes(classes.representatives().map(of))))
}

/// The row of a material whose events have these `probabilities` per class of leads.
fn material_row(material: &Material, classes: &BandClasses, probabilities: &[[f64; 3]]) -> MaterialRow {
    let (bands, of) = (classes.count(), || classes.representatives());
    let specular: Vec<f64> = of().map(|b| material.specular(b)).collect();
    let diffuse: Vec<f64> = of().map(|b| material.diffuse(b)).collect();
    let transmitted: Vec<f64> = of().map(|b| material.transmission[b]).collect();
    let passed_on: Vec<f64> = (0..bands).map(|b| specular[b] + diffuse[b] + transmitted[b]).collect();
    let row = |factors: &[f64], event: usize| EventRow {
        energy: to_lanes(factors.iter().copied()),
        probability: to_lanes(probabilities.iter().map(|events| events[event])),
    };
    let thresholds = probabilities.iter().map(|p| [p[0], p[0] + p[1], p[0] + p[1] + p[2]]).collect();
    MaterialRow {
        is_mirror: diffuse.iter().all(|&factor| factor <= 0.0),
        is_partition: transmitted.iter().any(|&factor| factor > 0.0),
        specular: row(&specular, 0),
        diffuse: row(&diffuse, 1),
        transmitted: row(&transmitted, 2),
        dissipated: to_lanes(of().map(|b| material.absorption[b] - material.transmission[b])),
        passed_on: to_lanes(passed_on.iter().copied()),
        thresholds,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(absorption: f64, scattering: f64, transmission: f64) -> Material {
        Material {
            name: "wall".into(),
            absorption: vec![absorption],
            scattering: vec![scattering],
            transmission: vec![transmission],
            law: AbsorptionLaw::Uniform,
            source: None,
        }
    }

    #[test]
    fn paper_roulette_draws_events_with_their_energy_factors() {
        let table = CoefficientTable::new(&[wall(0.15, 0.5, 0.0)], 1, 1.0);
        let row = table.material(0);
        let [specular, diffuse, transmitted] = row.thresholds[0];
        assert!((specular - 0.425).abs() + (diffuse - 0.85).abs() + (transmitted - 0.85).abs() < 1e-15);
        assert!((row.diffuse.energy[0][0] - row.diffuse.probability[0][0]).abs() < 1e-15);
    }

    #[test]
    fn without_roulette_a_packet_always_goes_on() {
        for (absorption, scattering, transmission) in [(0.2, 0.3, 0.0), (0.9, 1.0, 0.25), (1e-12, 0.0, 0.0)] {
            let table = CoefficientTable::new(&[wall(absorption, scattering, transmission)], 1, 0.0);
            assert!((table.material(0).thresholds[0][2] - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn all_angles_together_reflect_what_the_table_says() {
        let locally_reacting =
            |absorption| Material { law: AbsorptionLaw::LocallyReacting, ..wall(absorption, 0.3, 0.0) };
        for absorption in [0.0, 0.02, 0.5, 0.95] {
            let materials = [wall(absorption, 0.3, 0.0), locally_reacting(absorption)];
            let table = CoefficientTable::new(&materials, 1, 0.3);
            let ranges = &table.rows[table.first_rows[1] + 1..];
            let reflected: f64 = (0..incidence::RANGES)
                .map(|range| {
                    let [low, high] = incidence::bounds(range);
                    ranges[range].passed_on[0][0] * (high * high - low * low)
                })
                .sum();
            assert!((reflected - (1.0 - absorption)).abs() < 1e-9, "{absorption}: {reflected}");
            assert_eq!(table.material(0), table.material(1));
            assert!(absorption <= 0.0 || ranges[20] != *table.material(1));
        }
    }

    #[test]
    fn a_perfect_absorber_ends_every_packet() {
        let table = CoefficientTable::new(&[wall(1.0, 0.5, 0.0)], 1, 0.15);
        assert!(table.material(0).thresholds[0].iter().all(|&threshold| threshold <= 0.0));
    }
}
