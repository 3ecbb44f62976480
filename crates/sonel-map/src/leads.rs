//! Leads: the probabilities by which packets survive an arrival and events are drawn.
//!
//! A scene may state variants of its materials that a map shall carry besides ([`Scene::variants`]). With A the largest a = 1 − α + τ of a
//! material and its variants in a band, every packet of the band survives with A^β: roulette as of the variant that reflects most loses
//! packets of none. Then the event is drawn by shares of the survivors, (1−s) r specular, s r diffuse and t transmitted, with t = τ/a,
//! at least [`LEAST_THROUGH`] where 0 < τ and α < 1, and r = 1 − t. Variants that differ in shares have packets of their own, those of designs in these combinations alone: lead
//! v B + b draws with set v of shares in band b of B. The balance heuristic over all leads bounds the weights of every variant by the
//! number of sets, so its standard errors by the root of that (docs/physics.md §2; [Veach1995]).

use std::collections::BTreeSet;

use sonel_acoustics::Material;
use sonel_scene::{Design, Scene};

use crate::classes::BandClasses;
use crate::spectral::Spectral;

/// Least share of the packets that survive at a partition which pass it [1]. Chosen, not measured: next door as many packets matter as here;
/// doubled, rooms with a source have fewer.
pub const LEAST_THROUGH: f64 = 0.15;

/// Most sets of shares: with four the standard errors of a variant are at most twice those of its own trace.
pub const MOST_SETS: usize = 4;

/// The leads of a map.
#[derive(Debug, Clone)]
pub struct Leads {
    /// Every material and its variants.
    kinds: Vec<Vec<Material>>,
    /// For each set the kind of every material that has its shares.
    sets: Vec<Vec<usize>>,
    bands: usize,
    survival: f64,
    classes: BandClasses,
}

impl Leads {
    /// The leads of packets that meet `materials` and their `variants` (none, or a list for each) as `designs` choose them, with the survival exponent
    /// β in [0, 1].
    #[must_use]
    pub fn new(
        materials: &[Material],
        variants: &[Vec<Material>],
        designs: &[Design],
        survival: f64,
        spectral: Spectral,
    ) -> Self {
        let kinds = kinds(materials, variants);
        let bands = materials.first().map_or(0, |material| material.absorption.len());
        let sets: Vec<Vec<usize>> = sets(&kinds, designs).into_iter().take(MOST_SETS).collect();
        let classes = BandClasses::separate(sets.len() * bands);
        let leads = Self { kinds, sets, bands, survival, classes };
        if spectral == Spectral::PerBand {
            return leads;
        }
        let columns = (0..leads.sets.len() * bands).map(|lead| leads.column(lead));
        let classes = BandClasses::equal(columns);
        Self { classes, ..leads }
    }

    /// Leads with equal probabilities everywhere.
    #[must_use]
    pub fn classes(&self) -> &BandClasses {
        &self.classes
    }

    /// Probabilities of specular, diffuse and transmitted at a material whose kinds are `seen` so, per class of leads.
    pub(crate) fn probabilities(
        &self,
        material: usize,
        seen: impl Fn(&Material) -> Material,
    ) -> Vec<[f64; 3]> {
        let kinds: Vec<Material> = self.kinds[material].iter().map(seen).collect();
        self.classes.representatives().map(|lead| self.probability(material, &kinds, lead)).collect()
    }

    /// Probabilities of specular, diffuse and transmitted that `lead` has at a material: where its absorption depends on the angle, at the
    /// mean of diffuse incidence.
    #[must_use]
    pub fn drawn(&self, material: usize, lead: usize) -> [f64; 3] {
        self.probability(material, &self.kinds[material], lead)
    }

    fn probability(&self, material: usize, kinds: &[Material], lead: usize) -> [f64; 3] {
        let (set, band) = (lead / self.bands, lead % self.bands);
        let most = kinds.iter().map(|kind| kind.passed_on(band)).fold(0.0, f64::max);
        let survival = if most > 0.0 { libm::pow(most, self.survival) } else { 0.0 };
        shares(&kinds[self.sets[set][material]], band).map(|share| share * survival)
    }

    /// Coefficients that distinguish a lead from others.
    fn column(&self, lead: usize) -> Vec<u64> {
        let band = lead % self.bands;
        let of = |material: usize| {
            let kinds = &self.kinds[material];
            let is_angular = kinds[0].law.is_angular();
            let angular = kinds.iter().filter(move |_| is_angular).map(move |kind| kind.absorption[band]);
            self.probability(material, kinds, lead).into_iter().chain(angular)
        };
        (0..self.kinds.len()).flat_map(of).map(f64::to_bits).collect()
    }
}

/// Number of sets of shares for `scene`, at most one more than [`MOST_SETS`].
#[must_use]
pub fn set_count(scene: &Scene) -> usize {
    sets(&kinds(&scene.materials, &scene.variants), &scene.designs).len()
}

fn kinds(materials: &[Material], variants: &[Vec<Material>]) -> Vec<Vec<Material>> {
    let of = |(index, material): (usize, &Material)| {
        let others = variants.get(index).cloned().unwrap_or_default();
        [vec![material.clone()], others].concat()
    };
    materials.iter().enumerate().map(of).collect()
}

/// The first of `kinds` that has the shares of one of them.
fn alike(kinds: &[Material], one: usize) -> usize {
    let bands = kinds[one].absorption.len();
    let of = |kind: &Material| -> Vec<[f64; 3]> { (0..bands).map(|band| shares(kind, band)).collect() };
    kinds.iter().position(|kind| of(kind) == of(&kinds[one])).unwrap_or(one)
}

/// The kinds of the scene, those of its `designs`, and with what no design has all combinations of them; at most one more than [`MOST_SETS`].
fn sets(kinds: &[Vec<Material>], designs: &[Design]) -> BTreeSet<Vec<usize>> {
    let mut sets = BTreeSet::from([vec![0; kinds.len()]]);
    for design in designs {
        let mut set = vec![0; kinds.len()];
        for &(material, variant) in &design.choices {
            set[material as usize] = alike(&kinds[material as usize], variant as usize + 1);
        }
        sets.insert(set);
    }
    for (material, kinds) in kinds.iter().enumerate() {
        let known = sets.clone();
        let is_free =
            |&kind: &usize| alike(kinds, kind) == kind && known.iter().all(|set| set[material] != kind);
        for kind in (0..kinds.len()).filter(is_free) {
            sets.extend(known.iter().map(|set| [&set[..material], &[kind], &set[material + 1..]].concat()));
        }
        sets = sets.into_iter().take(MOST_SETS + 1).collect();
    }
    sets
}

/// Shares of specular, diffuse and transmitted in the packets of a band that survive.
fn shares(material: &Material, band: usize) -> [f64; 3] {
    let (back, through) = (1.0 - material.absorption[band], material.transmission[band]);
    let scattering = material.scattering[band];
    let through = match through / (back + through) {
        _ if through <= 0.0 => 0.0,
        _ if back <= 0.0 => 1.0,
        share => share.max(LEAST_THROUGH),
    };
    [(1.0 - scattering) * (1.0 - through), scattering * (1.0 - through), through]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(absorption: [f64; 2], scattering: f64) -> Material {
        Material { absorption: absorption.to_vec(), ..Material::uniform("wall", 0.0, scattering, 2) }
    }

    fn leads(materials: &[Material], variants: &[Vec<Material>]) -> Leads {
        Leads::new(materials, variants, &[], 0.15, Spectral::Shared)
    }

    #[test]
    fn absorption_has_packets_of_the_most_reflecting_variant() {
        let (floor, ceiling) = (wall([0.1, 0.2], 0.3), wall([1.0, 0.9], 0.1));
        let leads = leads(&[floor, ceiling], &[Vec::new(), vec![wall([0.04, 0.95], 0.1)]]);
        assert_eq!(leads.classes().bands(), 2, "one set");
        let found = leads.probabilities(1, Material::clone);
        for (found, most) in found.iter().zip([0.96_f64, 0.1]) {
            assert!((found.iter().sum::<f64>() - most.powf(0.15)).abs() < 1e-15);
            assert!((found[1] / found[0] - 1.0 / 9.0).abs() < 1e-15);
        }
    }

    #[test]
    fn scattering_has_packets_of_every_combination() {
        let kinds = |values: &[f64]| values.iter().map(|&s| wall([0.1; 2], s)).collect::<Vec<_>>();
        let leads = leads(&kinds(&[0.1, 0.2]), &[kinds(&[0.5]), kinds(&[0.6, 0.2])]);
        let sets: Vec<[f64; 2]> = leads
            .sets
            .iter()
            .map(|set| [0, 1].map(|material| leads.kinds[material][set[material]].scattering[0]))
            .collect();
        assert_eq!(sets, [[0.1, 0.2], [0.1, 0.6], [0.5, 0.2], [0.5, 0.6]]);
        // Both bands are equal.
        assert_eq!((leads.classes().bands(), leads.classes().count()), (8, 4));
    }

    /// Walls with three kinds of scattering and a floor with two, of which a design chooses both: its combination alone, and with the third kind.
    #[test]
    fn designs_have_packets_of_their_combination_alone() {
        let kinds = |values: &[f64]| values.iter().map(|&s| wall([0.1; 2], s)).collect::<Vec<_>>();
        let design = Design { name: "treated".to_owned(), choices: vec![(0, 0), (1, 0)] };
        let variants = [kinds(&[0.5, 0.7]), kinds(&[0.6])];
        let sets = |designs: &[Design]| {
            Leads::new(&kinds(&[0.1, 0.2]), &variants, designs, 0.15, Spectral::Shared).sets
        };
        assert_eq!(sets(&[design.clone(), design]), [[0, 0], [1, 1], [2, 0], [2, 1]]);
        assert_eq!(sets(&[]), [[0, 0], [0, 1], [1, 0], [1, 1]], "of six");
    }

    #[test]
    fn enough_packets_pass_a_partition_whatever_it_lets_through() {
        for transmission in [1e-6, 1e-3, 0.05, 0.3] {
            let material = Material { transmission: vec![transmission; 2], ..wall([0.4; 2], 0.3) };
            let [specular, diffuse, through] = shares(&material, 0);
            assert!((specular + diffuse + through - 1.0).abs() < 1e-15);
            assert!((through - (transmission / (0.6 + transmission)).max(LEAST_THROUGH)).abs() < 1e-15);
        }
    }
}
