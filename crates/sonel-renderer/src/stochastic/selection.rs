//! Which sonels are connected to the receivers, and the weight of each.
//!
//! Late in a room of unequal surfaces few packets carry nearly all energy, and the others take nearly all time. A sonel of energy e is
//! selected with probability p = min(1, e / ē) and then weighted by 1/p, so that the mean stays: threshold sampling [DuffieldLundThorup2005].
//! With ē = Σe² / Σe over the sonels about its time and place no more of them are selected than equal ones would have the same variance,
//! (Σe)² / Σe², and the variance that they bring is at most doubled. Of several bands the one with the largest e / ē decides.
//!
//! Nor do all that are selected matter to each receiver: they are [connected](super::connection) to it in proportion to max(1, e / ē) cos θ / d².

use std::ops::Range;

use glam::{DVec3, Vec3};
use sonel_map::{BandValues, Lanes};

/// Windows of time in a run: 47 ms of three seconds, in which a room decays by some dB. Chosen, not measured; doubled, thresholds follow the
/// decay more closely from half as many sonels each.
const WINDOWS: usize = 64;
/// Parts of the scene along each axis: a room behind a wall has thresholds of its own. Chosen, not measured; doubled, each cell has an eighth
/// of the sonels to estimate them from.
const PARTS: usize = 4;
const CELLS: usize = PARTS * PARTS * PARTS;

/// Grid of times and places for sonels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Neighbourhoods {
    lanes: usize,
    windows_per_length: f64,
    parts_per_length: Vec3,
}

impl Neighbourhoods {
    /// Selection for paths up to `reach` [m] in a scene of `extents` [m], in so many lanes of bands.
    #[must_use]
    pub(crate) fn new(lanes: usize, reach: f64, extents: DVec3) -> Self {
        let parts_per_length = (PARTS as f64 / extents.max(DVec3::splat(f64::MIN_POSITIVE))).as_vec3();
        Self { lanes, windows_per_length: WINDOWS as f64 / reach, parts_per_length }
    }

    fn count(&self) -> usize {
        WINDOWS * CELLS * self.lanes
    }

    /// Bands of the sonels about `place` (about the scene's centre [m]) after paths of `length` [m].
    #[inline]
    fn around(&self, length: f64, place: Vec3) -> Range<usize> {
        let window = ((length * self.windows_per_length) as usize).min(WINDOWS - 1);
        let parts = (place * self.parts_per_length + PARTS as f32 / 2.0).to_array();
        let [x, y, z] = parts.map(|part| (part as usize).min(PARTS - 1));
        let at = ((window * PARTS + z) * PARTS + y) * PARTS + x;
        at * self.lanes..(at + 1) * self.lanes
    }
}

/// Energies of sonels by time, place and band.
#[derive(Debug, Clone)]
pub(crate) struct SonelCounts {
    neighbourhoods: Neighbourhoods,
    /// Σe.
    sums: Vec<Lanes>,
    /// Σe².
    squares: Vec<Lanes>,
}

impl SonelCounts {
    /// Nothing counted yet.
    #[must_use]
    pub(crate) fn new(neighbourhoods: Neighbourhoods) -> Self {
        let empty = vec![Lanes::ZERO; neighbourhoods.count()];
        Self { neighbourhoods, sums: empty.clone(), squares: empty }
    }

    /// Counts a sonel at `place` (about the scene's centre [m]) after a path of `length` [m] that carries `energy`.
    pub(crate) fn count(&mut self, length: f64, place: Vec3, energy: &[Lanes]) {
        let around = self.neighbourhoods.around(length, place);
        self.sums[around.clone()].add(energy);
        self.squares[around].add_product(energy, energy);
    }

    /// Adds what `other` counted.
    pub(crate) fn add(&mut self, other: &Self) {
        self.sums.add(&other.sums);
        self.squares.add(&other.squares);
    }

    /// Selection of sonels.
    #[must_use]
    pub(crate) fn selection(&self) -> SonelSelection {
        let mut inverse_thresholds = vec![Lanes::splat(f64::MAX); self.sums.len()];
        let sums = self.sums.values().zip(self.squares.values());
        for (inverse, (sum, square)) in inverse_thresholds.values_mut().zip(sums) {
            if square > 0.0 {
                *inverse = sum / square;
            }
        }
        SonelSelection { neighbourhoods: self.neighbourhoods, inverse_thresholds }
    }
}

/// Selection of sonels.
#[derive(Debug, Clone)]
pub(crate) struct SonelSelection {
    neighbourhoods: Neighbourhoods,
    /// 1/ē.
    inverse_thresholds: Vec<Lanes>,
}

impl SonelSelection {
    /// e / ē of a sonel at `place` (about the scene's centre [m]) after a path of `length` [m] that carries `energy`. Where nothing was counted it has
    /// no bound.
    #[inline]
    #[must_use]
    pub(crate) fn brightness(&self, length: f64, place: Vec3, energy: &[Lanes]) -> f64 {
        let inverse = &self.inverse_thresholds[self.neighbourhoods.around(length, place)];
        let ratios = inverse.iter().zip(energy).map(|(&inverse, &energy)| energy * inverse);
        ratios.fold(Lanes::ZERO, Lanes::max).largest()
    }
}

/// Selects sonels of one path, each with its own probability and at even distances: systematic sampling, with less noise than single choices.
/// Each path begins anew, so that no path changes what is selected of another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Selector {
    due: f64,
}

impl Selector {
    /// A selector that begins at a random `offset`, 0 … 1.
    #[must_use]
    pub(crate) fn new(offset: f64) -> Self {
        Self { due: offset }
    }

    /// Whether the next sonel is selected, whose `probability` that is.
    #[inline]
    pub(crate) fn takes(&mut self, probability: f64) -> bool {
        self.due += probability;
        let takes = self.due >= 1.0;
        self.due -= f64::from(u8::from(takes));
        takes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_map::to_lanes;
    use sonel_testkit::uniform::Uniform;

    /// Energies over four decades, as of packets that met hard and soft surfaces by chance.
    fn energies() -> Vec<Vec<Lanes>> {
        let mut random = Uniform::new(3);
        (0..20_000).map(|_| vec![Lanes::splat(libm::exp(-9.0 * random.between(0.0, 1.0)))]).collect()
    }

    const HERE: Vec3 = Vec3::splat(-4.0);
    const THERE: Vec3 = Vec3::splat(4.0);

    fn nothing() -> SonelCounts {
        SonelCounts::new(Neighbourhoods::new(1, 100.0, DVec3::splat(10.0)))
    }

    fn counts(energies: &[Vec<Lanes>]) -> SonelCounts {
        let mut counts = nothing();
        energies.iter().for_each(|energy| counts.count(50.0, HERE, energy));
        counts
    }

    #[test]
    fn selected_sonels_stand_for_all_and_are_few() {
        let energies = energies();
        let selection = counts(&energies).selection();
        let (sum, squares) = energies
            .iter()
            .fold((0.0, 0.0), |(sum, squares), e| (sum + e[0][0], squares + e[0][0] * e[0][0]));
        let estimate = |offset: f64, weigh: fn(f64) -> f64| {
            let mut selector = Selector::new(offset);
            let (mut found, mut taken) = (0.0, 0);
            for energy in &energies {
                let probability = selection.brightness(50.0, HERE, energy).min(1.0);
                if selector.takes(probability) {
                    found += energy[0][0] / weigh(probability);
                    taken += 1;
                }
            }
            (found, taken)
        };
        let offsets = || (0..64).map(|step| (f64::from(step) + 0.5) / 64.0);
        let mean = |weigh| offsets().map(|offset| estimate(offset, weigh).0).sum::<f64>() / 64.0;
        let (most, taken) = (sum * sum / squares, estimate(0.3, |p| p).1);
        assert!(f64::from(taken) <= most + 1.0 && most < 5_000.0, "{taken} of at most {most}");
        let error = (squares / 64.0).sqrt();
        assert!((mean(|p| p) - sum).abs() < 4.0 * error, "{} {sum}", mean(|p| p));
        assert!(
            (mean(|_| 1.0) - sum).abs() > 4.0 * error,
            "sonels that stand for themselves alone are rejected"
        );
    }

    #[test]
    fn equal_sonels_and_times_without_any_are_all_selected() {
        let equal = vec![to_lanes([0.25, 0.5]); 10];
        let selection = counts(&equal).selection();
        assert!(selection.brightness(50.0, HERE, &equal[0]) >= 1.0);
        assert!(selection.brightness(90.0, HERE, &equal[0]) >= 1.0, "nothing was counted there");
        assert!(selection.brightness(50.0, HERE, &to_lanes([0.025, 0.05])) < 0.5);
    }

    #[test]
    fn a_quiet_room_has_thresholds_of_its_own() {
        let mut counts = nothing();
        (0..100).for_each(|_| counts.count(5.0, HERE, &[Lanes::splat(1.0)]));
        (0..100).for_each(|_| counts.count(5.0, THERE, &[Lanes::splat(1e-3)]));
        let selection = counts.selection();
        assert!(selection.brightness(5.0, THERE, &[Lanes::splat(1e-3)]) > 0.999);
        assert!(selection.brightness(5.0, HERE, &[Lanes::splat(1e-3)]) < 0.002);
    }
}
