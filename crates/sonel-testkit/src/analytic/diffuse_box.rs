//! The shoebox with Lambertian walls: a deterministic radiosity solution.
//!
//! The walls are divided into patches of constant radiosity (Galerkin), finer towards the edges of the box, where
//! the irradiance varies like a broken power of the distance. What one patch sends to another, and what a source or
//! a receiver sees of it, are closed forms; travel times are means over the ways from patch to patch. The only
//! errors are those of the division: of second order in the patch size, hence reduced by [`extrapolate`]. Eight
//! cells along each axis with four to extrapolate from give T60 to 4e-4 and the steady state to 1e-3.
//!
//! Three answers: the steady state, the decay rate as the eigenvalue of the exchange weighted with e^(μ l/c), and an
//! echogram by marching in time.
//!
//! Reference: [Kuttruff2009], integral equation of the irradiation strength.

use std::f64::consts::{LN_10, PI};

use super::free_field;
use super::patches::{Patch, across, divide, form_factors, lengths};
use crate::quadrature::integrate_rectangle;
use crate::vector::distance;

/// Where an iteration has converged: relative change of its result.
const CONVERGED: f64 = 1e-12;
/// Where the secants have: above the error of the eigenvalues they pass through.
const SETTLED: f64 = 1e-10;

/// A box whose walls reflect 1 − α of the energy after the cosine law. Its corner is the origin, no loss in the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiffuseBox {
    /// Extent along x, y, z [m].
    pub size: [f64; 3],
    /// Absorption coefficients, 0…1 exclusive of 1 and not all 0, of the walls x0 x1 y0 y1 z0 z1.
    pub absorption: [f64; 6],
    /// Speed of sound [m/s].
    pub speed_of_sound: f64,
}

/// A box divided into patches, with all exchanges between them. Memory is that of the square of their number.
pub struct DividedBox {
    room: DiffuseBox,
    patches: Vec<Patch>,
    /// Part of the energy incident on patch j (column) that arrives at patch i (row) with its next arrival.
    passed_on: Vec<f64>,
    /// Mean length of the ways from patch to patch [m], weighted with the energy they carry.
    length: Vec<f64>,
}

/// Removes an error of second order: the value for patches of half the size, and the one for the full size.
pub fn extrapolate(coarse: f64, fine: f64) -> f64 {
    fine + (fine - coarse) / 3.0
}

impl DiffuseBox {
    /// Divides each axis into as many cells as given, their ends spaced like the cosines of equal angles.
    pub fn divide(&self, cells: [usize; 3]) -> DividedBox {
        let lossy = self.absorption.iter().all(|a| (0.0..1.0).contains(a))
            && self.absorption.iter().any(|&a| a > 0.0);
        assert!(lossy, "absorption {:?} leaves no decay to compute", self.absorption);
        let patches = divide(self.size, cells);
        let length = lengths(&patches);
        let mut passed_on = form_factors(&patches);
        for row in passed_on.chunks_mut(patches.len()) {
            row.iter_mut().zip(&patches).for_each(|(part, from)| *part *= 1.0 - self.absorption[from.wall]);
        }
        DividedBox { room: *self, patches, passed_on, length }
    }
}

impl DividedBox {
    /// Fluence of all sound, the direct sound included, at a receiver [1/m²].
    pub fn total_fluence(&self, source: [f64; 3], receiver: [f64; 3]) -> f64 {
        let (first, all) = (self.first_incident(source), self.steady_incident(source));
        let later = (0..all.len()).map(|i| (all[i] - first[i]) * self.seen_from(i, receiver)).sum::<f64>();
        let once = self.patches.iter().map(|patch| self.once_reflected(patch, source, receiver)).sum::<f64>();
        free_field(distance(source, receiver), 0.0) + once + later
    }

    /// Fluence by way of a single reflection from a patch [1/m²], by quadrature: irradiance and view of the receiver
    /// both vary too much over a patch to be multiplied as means.
    fn once_reflected(&self, patch: &Patch, source: [f64; 3], receiver: [f64; 3]) -> f64 {
        let axis = patch.wall / 2;
        let [a, b] = across(axis);
        let flux = |at: [f64; 3], from: [f64; 3]| {
            let length = distance(at, from);
            (at[axis] - from[axis]).abs() / (PI * length.powi(3))
        };
        let both = |[x, y]: [f64; 2]| {
            let mut at = patch.centre;
            (at[a], at[b]) = (x, y);
            0.25 * flux(at, source) * flux(at, receiver)
        };
        let ends = |side: usize| [patch.extent[a][side], patch.extent[b][side]];
        (1.0 - self.room.absorption[patch.wall]) * integrate_rectangle(ends(0), ends(1), both)
    }

    /// All energy that ever arrives at a wall x0 x1 y0 y1 z0 z1, per unit emitted energy.
    pub fn incident_on_walls(&self, source: [f64; 3]) -> [f64; 6] {
        let mut walls = [0.0; 6];
        for (patch, energy) in self.patches.iter().zip(self.steady_incident(source)) {
            walls[patch.wall] += energy;
        }
        walls
    }

    /// Decay rate of the late energy [1/s]: the μ for which the exchange weighted with e^(μ l/c) has the largest
    /// eigenvalue 1.
    pub fn decay_rate(&self) -> f64 {
        let mut shape = vec![1.0; self.patches.len()];
        let mut log_growth = |rate: f64| self.growth(rate, &mut shape).ln();
        // ln of the eigenvalue is nearly linear in μ, with the mean free time as slope: secants converge fast.
        let free_time = {
            let [x, y, z] = self.room.size;
            2.0 * x * y * z / (x * y + y * z + z * x) / self.room.speed_of_sound
        };
        let (mut before, mut value_before) = (0.0, log_growth(0.0));
        let mut rate = -value_before / free_time;
        loop {
            let value = log_growth(rate);
            let next = rate - value * (rate - before) / (value - value_before);
            if (next - rate).abs() <= SETTLED * rate {
                return next;
            }
            (before, value_before, rate) = (rate, value, next);
        }
    }

    /// Time of a decay of the late energy by 60 dB [s].
    pub fn reverberation_time(&self) -> f64 {
        6.0 * LN_10 / self.decay_rate()
    }

    /// Fluence at a receiver in each of `count` bins of `bin_width` [s], direct sound included.
    ///
    /// Energy is delayed by a fraction of a bin by sharing it between two, so centres of energy are kept. Delays of
    /// less than a bin between adjacent patches are rounded up to one: keep c·bin_width below half a patch.
    pub fn echogram(&self, source: [f64; 3], receiver: [f64; 3], bin_width: f64, count: usize) -> Vec<f64> {
        let number = self.patches.len();
        let delay = |length: f64| length / self.room.speed_of_sound / bin_width;
        let mut incident = vec![0.0; number * count];
        for (i, energy) in self.first_incident(source).into_iter().enumerate() {
            share(
                &mut incident,
                delay(distance(source, self.patches[i].centre)),
                count,
                |bin| bin * number + i,
                energy,
            );
        }
        let routes = self.routes(|length| delay(length).max(1.0));
        for now in 0..count {
            let (past, future) = incident.split_at_mut((now + 1) * number);
            let present = &past[now * number..];
            for (j, &energy) in present.iter().enumerate().filter(|&(_, &energy)| energy > 0.0) {
                for route in &routes[j] {
                    let at = (route.delay - 1) * number + route.to;
                    if let Some(bin) = future.get_mut(at) {
                        *bin += energy * route.earlier;
                    }
                    if let Some(bin) = future.get_mut(at + number) {
                        *bin += energy * route.later;
                    }
                }
            }
        }
        let mut heard = vec![0.0; count];
        let direct = distance(source, receiver);
        share(&mut heard, delay(direct), count, |bin| bin, free_field(direct, 0.0));
        for (i, patch) in self.patches.iter().enumerate() {
            let (late, seen) = (delay(distance(patch.centre, receiver)), self.seen_from(i, receiver));
            for now in 0..count {
                share(&mut heard, now as f64 + late, count, |bin| bin, incident[now * number + i] * seen);
            }
        }
        heard
    }

    /// Energy of the direct sound on each patch.
    fn first_incident(&self, source: [f64; 3]) -> Vec<f64> {
        self.patches.iter().map(|patch| patch.solid_angle(source) / (4.0 * PI)).collect()
    }

    /// Fluence at a receiver per energy incident on patch `i` [1/m²]: radiance (1 − α)/(π A) times the solid angle.
    fn seen_from(&self, i: usize, receiver: [f64; 3]) -> f64 {
        let patch = &self.patches[i];
        let kept = 1.0 - self.room.absorption[patch.wall];
        kept * patch.solid_angle(receiver) / (PI * patch.area)
    }

    fn row(&self, i: usize) -> &[f64] {
        let number = self.patches.len();
        &self.passed_on[i * number..(i + 1) * number]
    }

    /// All energy that ever arrives, per patch: the sum over generations.
    fn steady_incident(&self, source: [f64; 3]) -> Vec<f64> {
        let mut generation = self.first_incident(source);
        let mut total = generation.clone();
        loop {
            generation = (0..total.len()).map(|i| product(self.row(i), &generation)).collect();
            total.iter_mut().zip(&generation).for_each(|(sum, energy)| *sum += energy);
            if generation.iter().sum::<f64>() <= CONVERGED * total.iter().sum::<f64>() {
                return total;
            }
        }
    }

    /// Largest eigenvalue of the exchange weighted with e^(`rate`·l/c), by iteration from `shape`, which becomes
    /// the eigenvector.
    fn growth(&self, rate: f64, shape: &mut Vec<f64>) -> f64 {
        let weighted = self.passed_on.iter().zip(&self.length);
        let weighted = weighted
            .map(|(energy, length)| energy * (rate * length / self.room.speed_of_sound).exp())
            .collect::<Vec<_>>();
        let number = self.patches.len();
        let mut growth = 0.0;
        loop {
            let next = weighted.chunks(number).map(|row| product(row, shape)).collect::<Vec<_>>();
            let now = next.iter().sum::<f64>() / shape.iter().sum::<f64>();
            let scale = number as f64 / next.iter().sum::<f64>();
            *shape = next.into_iter().map(|x| x * scale).collect();
            if (now - growth).abs() <= CONVERGED * now {
                return now;
            }
            growth = now;
        }
    }

    /// Per patch of departure, where its energy goes and when; `delay` in bins from a length.
    fn routes(&self, delay: impl Fn(f64) -> f64) -> Vec<Vec<Route>> {
        let number = self.patches.len();
        let route = |i: usize, j: usize| {
            let energy = self.passed_on[i * number + j];
            let delay = delay(self.length[i * number + j]);
            let later = energy * delay.fract();
            Route { to: i, delay: delay as usize, earlier: energy - later, later }
        };
        let reached = |i: usize, j: usize| self.passed_on[i * number + j] > 0.0;
        (0..number).map(|j| (0..number).filter(|&i| reached(i, j)).map(|i| route(i, j)).collect()).collect()
    }
}

/// A way from one patch to another, its energy split between the two bins about its travel time.
struct Route {
    to: usize,
    /// Whole bins, at least 1.
    delay: usize,
    earlier: f64,
    later: f64,
}

/// Adds `energy` at a time of `position` bins, shared between two bins; what falls behind the last is dropped.
fn share(bins: &mut [f64], position: f64, count: usize, index: impl Fn(usize) -> usize, energy: f64) {
    let (first, part) = (position as usize, position.fract());
    for (bin, energy) in [(first, energy * (1.0 - part)), (first + 1, energy * part)] {
        if bin < count {
            bins[index(bin)] += energy;
        }
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::{incident_per_emitted, mean_free_path};
    use crate::decay;
    use crate::z_test::{Estimate, Within, within_sigmas};

    const SOURCE: [f64; 3] = [1.5, 1.2, 1.3];
    const RECEIVER: [f64; 3] = [4.2, 3.7, 2.1];

    fn room(size: [f64; 3]) -> DiffuseBox {
        DiffuseBox { size, absorption: [0.2; 6], speed_of_sound: 343.0 }
    }

    fn late_time(size: [f64; 3]) -> f64 {
        let time = |cells| room(size).divide([cells; 3]).reverberation_time();
        extrapolate(time(4), time(8))
    }

    #[test]
    fn the_walls_receive_the_emitted_energy_over_the_absorption() {
        let incident = room([6.0, 5.0, 4.0]).divide([6, 5, 4]).incident_on_walls(SOURCE);
        assert!((incident.iter().sum::<f64>() - incident_per_emitted(0.2)).abs() < 1e-9, "{incident:?}");
    }

    #[test]
    fn uneven_walls_absorb_what_was_emitted() {
        let absorption = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        let uneven = DiffuseBox { absorption, ..room([6.0, 5.0, 4.0]) };
        let incident = uneven.divide([4; 3]).incident_on_walls(SOURCE);
        let absorbed = incident.iter().zip(absorption).map(|(energy, part)| energy * part).sum::<f64>();
        assert!((absorbed - 1.0).abs() < 1e-10, "{absorbed}");
    }

    #[test]
    fn the_steady_state_is_what_a_monte_carlo_integration_of_the_same_room_gives() {
        // A separate program: 2·10⁷ rays of the cosine law, a connection to the receiver from each reflection.
        let reference = Estimate { value: 0.101_615_4, sigma: 0.000_008_7 };
        let fluence = |cells| room([6.0, 5.0, 4.0]).divide([cells; 3]).total_fluence(SOURCE, RECEIVER);
        let found = extrapolate(fluence(4), fluence(8));
        let within = Within { sigmas: 4.0, maximal_sigma: 1e-5 };
        within_sigmas(reference, found, within).unwrap();
        // Without extrapolation, and from the receiver's side, which is another sum.
        assert!(within_sigmas(reference, fluence(8), within).is_err());
        let back = room([6.0, 5.0, 4.0]).divide([8; 3]).total_fluence(RECEIVER, SOURCE);
        assert!((back / fluence(8) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_decay_has_the_reverberation_time_of_the_physics_page_and_not_that_of_eyring() {
        let time = late_time([10.0, 8.0, 5.0]);
        assert!((time / 0.888 - 1.0).abs() < 5e-4, "{time}");
        let free_time = mean_free_path(400.0, 340.0) / 343.0;
        let eyring = 6.0 * LN_10 * free_time / -0.8_f64.ln();
        assert!((eyring - 0.849).abs() < 5e-4 && (time / eyring - 1.0).abs() > 0.04, "{eyring}");
    }

    #[test]
    fn little_absorption_decays_after_sabine() {
        let almost_lossless = DiffuseBox { absorption: [1e-4; 6], ..room([6.0, 5.0, 4.0]) };
        let time = |cells| almost_lossless.divide([cells; 3]).reverberation_time();
        let sabine = 6.0 * LN_10 * mean_free_path(120.0, 148.0) / 343.0 / 1e-4;
        let ratio = extrapolate(time(4), time(8)) / sabine;
        assert!((ratio - 1.0).abs() < 3e-4, "{ratio}");
    }

    #[test]
    #[ignore = "long: cargo xtask accept"]
    fn the_echogram_has_the_late_decay_of_the_eigenvalue() {
        let divided = room([6.0, 5.0, 4.0]).divide([8; 3]);
        let bins = divided.echogram(SOURCE, RECEIVER, 0.000_5, 2400);
        let late = decay::reverberation_time(&bins, 0.000_5, -25.0, -45.0);
        assert!((late / divided.reverberation_time() - 1.0).abs() < 1e-3, "{late}");
        let total = divided.total_fluence(SOURCE, RECEIVER);
        assert!((bins.iter().sum::<f64>() / total - 1.0).abs() < 2e-3);
        let other = room([6.0, 5.0, 4.2]).divide([8; 3]).reverberation_time();
        assert!((late / other - 1.0).abs() > 0.01, "{other}");
    }
}
