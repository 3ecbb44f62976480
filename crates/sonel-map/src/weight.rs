//! Energy of a path in every band, by the balance heuristic over leads.
//!
//! e_j = D · ∏ f_j / Σ_k n_k ∏ p_k, with n_k the packets of lead k (docs/physics.md §2; [Veach1995],
//! [Wilkie2014]). Numerators and denominators are kept as products relative to a common power of two, which is divided
//! out exactly whenever they become small, so that nothing underflows however long the path.

use glam::Vec3;
use sonel_acoustics::{BandValues, Directivity, Lanes, lanes_of};
use sonel_scene::Source;

use crate::coefficients::{CoefficientTable, EventRow};
use crate::emission::PacketStart;

/// Products below this are scaled up by its inverse: far from both underflow and any effect on the sum.
const RESCALE_BELOW: f64 = f64::from_bits((1023 - 256) << 52);
const RESCALE_BY: f64 = f64::from_bits((1023 + 256) << 52);

/// Running products of one path. One value serves many paths in turn; [`PathWeight::emit`] starts the next.
#[derive(Debug, Clone)]
pub struct PathWeight {
    /// ∏ f_j.
    feeding: Vec<Lanes>,
    energy: Vec<Lanes>,
    drawing: Vec<EventDraw>,
    /// Directivity factor times the unit of energy times `part`.
    numerator: Vec<Lanes>,
    /// Part of the energy emitted that the packet has by splitting, without the directivity factor: other sources have the same paths.
    part: f64,
    /// Leads whose packets are mixed with this one.
    leads: f64,
}

/// Products of four columns of leads.
#[derive(Debug, Clone, Copy, Default)]
struct EventDraw {
    /// ∏ p_k.
    product: Lanes,
    /// n_k.
    counts: Lanes,
    /// Leads that each column stands for.
    sizes: Lanes,
}

impl PathWeight {
    /// Room for the columns of `table`.
    #[must_use]
    pub fn of(table: &CoefficientTable) -> Self {
        let energy = vec![Lanes::ZERO; lanes_of(table.bands())];
        Self {
            feeding: energy.clone(),
            drawing: vec![EventDraw::default(); lanes_of(table.leads())],
            numerator: energy.clone(),
            energy,
            part: 1.0,
            leads: 0.0,
        }
    }

    /// Starts a path whose first direction has the directivity factor `source_factor`. Energies are in units of `unit`: 1
    /// for the estimate of the packet's batch, N_g / N for its part of the whole run.
    pub fn emit(&mut self, source_factor: f64, unit: f64, start: &PacketStart) {
        self.part = 1.0;
        self.numerator.fill(Lanes::splat(source_factor * unit));
        self.leads = start.sizes.values().sum();
        self.feeding.copy_from_slice(&start.carried);
        let mut weighted = Lanes::ZERO;
        for ((drawing, &counts), &sizes) in self.drawing.iter_mut().zip(&start.counts).zip(&start.sizes) {
            let product = sizes.select(Lanes::ONE, Lanes::ZERO);
            *drawing = EventDraw { product, counts, sizes };
            weighted += product * counts;
        }
        self.balance(weighted.sum());
    }

    /// Starts a path that leaves `source` in a unit `direction`, as [`Self::emit`].
    pub fn emit_from(&mut self, source: &Source, direction: Vec3, unit: f64, start: &PacketStart) {
        let radiation = match &source.directivity {
            // In single precision, like the direction: the bytes of maps and responses depend on it.
            Directivity::Pattern(pattern) => {
                let cosine = direction.dot(source.aim.as_vec3());
                return self.emit(pattern.factor(f64::from(cosine)), unit, start);
            }
            measured @ Directivity::Measured { .. } => {
                measured.towards(source.aim, direction.as_dvec3().normalize())
            }
        };
        self.emit(1.0, unit, start);
        radiation.weigh(&mut self.numerator);
        radiation.weigh(&mut self.energy);
    }

    /// Energy in every band, per unit emitted energy times the unit given to [`Self::emit`] [1].
    #[inline]
    #[must_use]
    pub fn energy(&self) -> &[Lanes] {
        &self.energy
    }

    /// N times the energy in every band times its factor in `factors`, added up, if every lead had equally many packets and the source no
    /// directivity: a function of the path alone, so that a run can be extended.
    #[must_use]
    pub fn compared(&self, factors: &[Lanes]) -> f64 {
        let fed =
            self.feeding.iter().zip(factors).fold(Lanes::ZERO, |sum, (&fed, &factor)| sum + fed * factor);
        let drawn = self.drawing.iter().fold(Lanes::ZERO, |sum, lead| sum + lead.product * lead.sizes);
        self.part * self.leads * fed.sum() / drawn.sum()
    }

    /// Becomes the weight of each of two packets that the packet is split into.
    pub fn halve(&mut self) {
        self.part *= 0.5;
        self.numerator.scale(0.5);
        self.energy.scale(0.5);
    }

    /// Passes through `event`.
    #[inline]
    pub fn pass(&mut self, event: &EventRow) {
        self.feeding.multiply(&event.energy);
        let mut weighted = Lanes::ZERO;
        for (drawing, &probability) in self.drawing.iter_mut().zip(&event.probability) {
            drawing.product *= probability;
            weighted += drawing.product * drawing.counts;
        }
        let mut weighted = weighted.sum();
        if weighted < RESCALE_BELOW && weighted > 0.0 {
            self.rescale();
            weighted *= RESCALE_BY;
        }
        self.balance(weighted);
    }

    /// e_j from the products and Σ n_k ∏ p_k.
    #[inline]
    fn balance(&mut self, weighted: f64) {
        let factor = if weighted > 0.0 { weighted.recip() } else { 0.0 };
        self.energy.set_product(&self.feeding, &self.numerator, factor);
    }

    #[cold]
    fn rescale(&mut self) {
        self.feeding.scale(RESCALE_BY);
        self.drawing.iter_mut().for_each(|drawing| drawing.product *= RESCALE_BY);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{Material, to_lanes};

    fn material(absorption: [f64; 3], scattering: [f64; 3]) -> Material {
        Material {
            name: "wall".into(),
            absorption: absorption.to_vec(),
            scattering: scattering.to_vec(),
            transmission: vec![0.0; 3],
            law: sonel_acoustics::AbsorptionLaw::Uniform,
            source: None,
        }
    }

    /// Three bands that led one packet each.
    fn start() -> PacketStart {
        PacketStart {
            counts: to_lanes([1.0; 3]),
            carried: to_lanes([1.0; 3]),
            sizes: to_lanes([1.0; 3]),
            expected: to_lanes([1.0 / 3.0; 3]),
        }
    }

    #[test]
    fn equal_bands_carry_weight_one_without_roulette() {
        let table = CoefficientTable::new(&[material([0.0; 3], [0.5; 3])], 3, 0.15);
        let mut weight = PathWeight::of(&table);
        weight.emit(1.0, 1.0, &start());
        for bounce in 0..100_000 {
            let row = table.material(0);
            weight.pass(if bounce % 2 == 0 { &row.specular } else { &row.diffuse });
        }
        assert!(weight.energy().values().take(3).all(|energy| (energy - 1.0 / 3.0).abs() < 1e-15));
    }

    /// Expected energy after each bounce, by enumerating lead and event, is the true one: α .2/.9/.01 and s .5/.05/.95.
    #[test]
    fn balance_is_unbiased_over_all_histories() {
        let (absorption, scattering) = ([0.2, 0.9, 0.01], [0.5, 0.05, 0.95]);
        let table = CoefficientTable::new(&[material(absorption, scattering)], 3, 0.15);
        let row = table.material(0);
        let depth = 6;
        let mut expected = [0.0; 3];
        for lead in 0..3 {
            for history in 0..1 << depth {
                let mut weight = PathWeight::of(&table);
                weight.emit(1.0, 1.0, &start());
                let mut probability = 1.0;
                for step in 0..depth {
                    let event = if history >> step & 1 == 0 { &row.specular } else { &row.diffuse };
                    probability *= event.probability[0][lead];
                    weight.pass(event);
                }
                for (band, sum) in expected.iter_mut().enumerate() {
                    let energy = weight.energy()[0][band];
                    assert!(energy <= 3.0, "weight bounded by the number of bands");
                    *sum += probability * energy;
                }
            }
        }
        for band in 0..3 {
            let truth = (1.0_f64 - absorption[band]).powi(depth);
            assert!((expected[band] / truth - 1.0).abs() < 1e-12, "band {band}");
        }
    }

    #[test]
    fn a_million_bounces_neither_underflow_nor_lose_the_dominant_band() {
        let table = CoefficientTable::new(&[material([0.5; 3], [0.5; 3])], 3, 1.0);
        let mut weight = PathWeight::of(&table);
        weight.emit(1.0, 1.0, &start());
        for _ in 0..1_000_000 {
            weight.pass(&table.material(0).diffuse);
        }
        assert!((weight.energy()[0][0] - 1.0 / 3.0).abs() < 1e-9);
    }
}
