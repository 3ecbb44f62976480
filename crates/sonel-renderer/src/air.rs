//! Attenuation by air along a path, e^(−m·length), for all bands at once.
//!
//! A table over length with a third-order correction to its nearest node: relative error below 1e-8, a few
//! multiplications a band instead of an exponential.

use sonel_map::{Lanes, to_lanes};

/// Largest m·(distance to a node): the fourth-order remainder x⁴/24 is then below 1e-9.
const LARGEST_STEP: f64 = 0.012;
/// Widest spacing of the nodes [m]: [`LARGEST_STEP`] is reached at m = 0.1/m, 0.4 dB/m.
const WIDEST_SPACING: f64 = 0.25;

/// e^(−m·length) for lengths up to a limit.
#[derive(Debug, Clone)]
pub(crate) struct AirTable {
    attenuation: Vec<Lanes>,
    spacing: f64,
    nodes: Vec<Lanes>,
}

impl AirTable {
    /// Number of nodes of a table for `attenuation` m per band [1/m] up to `reach` [m]; still air needs none.
    #[must_use]
    pub(crate) fn node_count(attenuation: &[f64], reach: f64) -> usize {
        if strongest(attenuation) <= 0.0 {
            return 0;
        }
        ((reach / spacing(attenuation)) as usize).saturating_add(2)
    }

    /// A table for `attenuation` m per band [1/m] up to `reach` [m].
    #[must_use]
    pub(crate) fn new(attenuation: &[f64], reach: f64) -> Self {
        let spacing = spacing(attenuation);
        let nodes = (0..Self::node_count(attenuation, reach))
            .flat_map(|node| to_lanes(attenuation.iter().map(|m| libm::exp(-m * node as f64 * spacing))))
            .collect();
        Self { attenuation: to_lanes(attenuation.iter().copied()), spacing, nodes }
    }

    /// Multiplies `energy` by the attenuation over `length`, at most the reach [m].
    #[inline]
    pub(crate) fn attenuate(&self, length: f64, energy: &mut [Lanes]) {
        if self.nodes.is_empty() {
            return;
        }
        let node = (length / self.spacing + 0.5) as usize;
        let rest = length - node as f64 * self.spacing;
        let lanes = self.attenuation.len();
        let row = &self.nodes[node * lanes..(node + 1) * lanes];
        let correction = |x: f64| 1.0 - x * (1.0 - x * (0.5 - x * (1.0 / 6.0)));
        for ((energy, &at_node), &attenuation) in energy.iter_mut().zip(row).zip(&self.attenuation) {
            *energy *= at_node * (attenuation * rest).map(correction);
        }
    }
}

fn strongest(attenuation: &[f64]) -> f64 {
    attenuation.iter().copied().fold(0.0, f64::max)
}

fn spacing(attenuation: &[f64]) -> f64 {
    (2.0 * LARGEST_STEP / strongest(attenuation)).min(WIDEST_SPACING)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_map::BandValues;

    #[test]
    fn the_table_is_the_exponential() {
        let attenuation = [1e-5, 0.001, 0.03, 0.3, 0.1];
        let table = AirTable::new(&attenuation, 500.0);
        for step in 0..5000 {
            let length = f64::from(step) * 0.1;
            let mut energy = vec![Lanes::ONE; 2];
            table.attenuate(length, &mut energy);
            for (band, m) in attenuation.iter().enumerate() {
                let exact = (-m * length).exp();
                assert!((energy.band(band) / exact - 1.0).abs() < 1e-8, "{length} m, m = {m}");
            }
        }
    }

    #[test]
    fn still_air_needs_no_table_and_takes_nothing() {
        let mut energy = [Lanes::ONE];
        AirTable::new(&[0.0, 0.0], 100.0).attenuate(1e12, &mut energy);
        assert_eq!(energy, [Lanes::ONE]);
        assert_eq!(AirTable::node_count(&[0.0, 0.0], 1e12), 0);
    }
}
