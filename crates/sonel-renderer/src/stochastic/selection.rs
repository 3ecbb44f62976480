//! Which sonels are connected to the receivers, and the weight of each.
//!
//! Late in a room of unequal surfaces few packets carry nearly all energy, and the others take nearly all time. A sonel of energy e is
//! selected with probability p = min(1, e / ē) and then weighted by 1/p, so that the mean stays: threshold sampling [DuffieldLundThorup2005].
//! With ē = Σe² / Σe over the sonels about its time no more of them are selected than equal ones would have the same variance,
//! (Σe)² / Σe², and the variance that they bring is at most doubled. Of several bands the one with the largest e / ē decides.

use sonel_map::Lanes;

/// Windows of time in a run: 20 ms of three seconds, in which a room decays by less than 1 dB.
const WINDOWS: usize = 128;

/// What sonels carry, by window of time and band.
#[derive(Debug, Clone)]
pub struct SonelSelection {
    lanes: usize,
    windows_per_length: f64,
    /// Σe by window.
    sums: Vec<Lanes>,
    /// Σe² by window.
    squares: Vec<Lanes>,
}

impl SonelSelection {
    /// Nothing counted yet, of paths up to `reach` [m].
    #[must_use]
    pub fn new(lanes: usize, reach: f64) -> Self {
        let empty = vec![[0.0; 4]; WINDOWS * lanes];
        Self { lanes, windows_per_length: WINDOWS as f64 / reach, sums: empty.clone(), squares: empty }
    }

    /// Bands of the window of paths of `length` [m].
    #[inline]
    fn window(&self, length: f64) -> std::ops::Range<usize> {
        let window = ((length * self.windows_per_length) as usize).min(WINDOWS - 1);
        window * self.lanes..(window + 1) * self.lanes
    }

    /// Counts a sonel after a path of `length` [m] that carries `energy`.
    pub fn count(&mut self, length: f64, energy: &[Lanes]) {
        let window = self.window(length);
        let (sums, squares) = (&mut self.sums[window.clone()], &mut self.squares[window]);
        for ((sum, square), energy) in sums.iter_mut().zip(squares).zip(energy) {
            for lane in 0..4 {
                sum[lane] += energy[lane];
                square[lane] += energy[lane] * energy[lane];
            }
        }
    }

    /// Adds what `other` counted.
    pub fn add(&mut self, other: &Self) {
        crate::deposit::add_lanes(&mut self.sums, &other.sums);
        crate::deposit::add_lanes(&mut self.squares, &other.squares);
    }

    /// p of a sonel after a path of `length` [m] that carries `energy`. Where nothing was counted it is 1.
    #[inline]
    #[must_use]
    pub fn probability(&self, length: f64, energy: &[Lanes]) -> f64 {
        let window = self.window(length);
        let mut largest = 0.0_f64;
        for ((sum, square), energy) in self.sums[window.clone()].iter().zip(&self.squares[window]).zip(energy)
        {
            for lane in 0..4 {
                let share = if square[lane] > 0.0 {
                    energy[lane] * sum[lane] / square[lane]
                } else {
                    f64::from(u8::from(energy[lane] > 0.0))
                };
                largest = largest.max(share);
            }
        }
        largest.min(1.0)
    }
}

/// Selects sonels of one path, each with its own probability and at even distances: systematic sampling, with less noise than single choices.
/// Each path begins anew, so that no path changes what is selected of another.
#[derive(Debug, Clone, Copy)]
pub struct Selector {
    due: f64,
}

impl Selector {
    /// A selector that begins at a random `offset`, 0 … 1.
    #[must_use]
    pub fn new(offset: f64) -> Self {
        Self { due: offset }
    }

    /// Whether the next sonel is selected, whose `probability` that is.
    #[inline]
    pub fn takes(&mut self, probability: f64) -> bool {
        self.due += probability;
        let takes = self.due >= 1.0;
        self.due -= f64::from(u8::from(takes));
        takes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_testkit::uniform::Uniform;

    /// Energies over four decades, as of packets that met hard and soft surfaces by chance.
    fn energies() -> Vec<Vec<Lanes>> {
        let mut random = Uniform::new(3);
        (0..20_000).map(|_| vec![[libm::exp(-9.0 * random.between(0.0, 1.0)); 4]]).collect()
    }

    fn selection(energies: &[Vec<Lanes>]) -> SonelSelection {
        let mut selection = SonelSelection::new(1, 100.0);
        energies.iter().for_each(|energy| selection.count(50.0, energy));
        selection
    }

    #[test]
    fn selected_sonels_stand_for_all_and_are_few() {
        let energies = energies();
        let selection = selection(&energies);
        let (sum, squares) = energies
            .iter()
            .fold((0.0, 0.0), |(sum, squares), e| (sum + e[0][0], squares + e[0][0] * e[0][0]));
        let estimate = |offset: f64, weigh: fn(f64) -> f64| {
            let mut selector = Selector::new(offset);
            let (mut found, mut taken) = (0.0, 0);
            for energy in &energies {
                let probability = selection.probability(50.0, energy);
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
        let equal = vec![vec![[0.25, 0.5, 0.0, 0.0]]; 10];
        let selection = selection(&equal);
        assert!(selection.probability(50.0, &equal[0]) >= 1.0);
        assert!(selection.probability(90.0, &equal[0]) >= 1.0, "nothing was counted there");
        assert!(selection.probability(50.0, &[[0.025, 0.05, 0.0, 0.0]]) < 0.5);
    }
}
