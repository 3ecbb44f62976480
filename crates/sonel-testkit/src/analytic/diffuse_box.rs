//! The shoebox with Lambertian walls: a deterministic radiosity solution.
//!
//! The walls are divided into patches of constant radiosity (Galerkin). What one patch sends to another, and what a
//! source or a receiver sees of it, are closed forms, so the only errors are those of the division: of second order
//! in the patch size, hence removed by [`extrapolate`]. Travel times are those between the centres of the patches.
//!
//! Three answers: the steady state, the decay rate as the eigenvalue of the exchange weighted with e^(μ l/c), and an
//! echogram by marching in time.
//!
//! References: [Kuttruff2009] (integral equation of the irradiation), [Howell2010] (form factors), [Nosal2004].

use std::f64::consts::{LN_10, PI};

use super::form_factor::{parallel_exchange, perpendicular_exchange, solid_angle};
use super::free_field;
use crate::vector::distance;

/// Where an iteration has converged: relative change of its result.
const CONVERGED: f64 = 1e-12;

/// A box whose walls reflect 1 − α of the energy after the cosine law. Its corner is the origin, no loss in the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiffuseBox {
    /// Extent along x, y, z [m].
    pub size: [f64; 3],
    /// Absorption coefficients, 0…1, of the walls x0 x1 y0 y1 z0 z1.
    pub absorption: [f64; 6],
    /// Speed of sound [m/s].
    pub speed_of_sound: f64,
}

/// One rectangle of a wall.
struct Patch {
    wall: usize,
    /// Number along each axis; that of the wall's own axis is unused.
    cell: [usize; 3],
    centre: [f64; 3],
}

/// A box divided into patches, with all exchanges between them. Memory is that of the square of their number.
pub struct DividedBox {
    room: DiffuseBox,
    /// Cells along each axis.
    cells: [usize; 3],
    /// Extent of a cell along each axis [m].
    step: [f64; 3],
    patches: Vec<Patch>,
    /// Part of the energy incident on patch j (column) that arrives at patch i (row) with its next arrival.
    passed_on: Vec<f64>,
}

/// Removes an error of second order: the value for patches of half the size, and the one for the full size.
pub fn extrapolate(coarse: f64, fine: f64) -> f64 {
    fine + (fine - coarse) / 3.0
}

impl DiffuseBox {
    /// Divides each axis into as many equal cells as given.
    pub fn divide(&self, cells: [usize; 3]) -> DividedBox {
        let step = [0, 1, 2].map(|k| self.size[k] / cells[k] as f64);
        let patches = patches(self.size, cells, step);
        let mut divided = DividedBox { room: *self, cells, step, patches, passed_on: Vec::new() };
        divided.passed_on = divided.exchange();
        divided
    }
}

/// The two axes that span the walls across `axis`, ascending.
fn across(axis: usize) -> [usize; 2] {
    [[1, 2], [0, 2], [0, 1]][axis]
}

fn patches(size: [f64; 3], cells: [usize; 3], step: [f64; 3]) -> Vec<Patch> {
    let mut patches = Vec::new();
    for wall in 0..6 {
        let axis = wall / 2;
        let [a, b] = across(axis);
        for i in 0..cells[a] {
            for j in 0..cells[b] {
                let (mut cell, mut centre) = ([0; 3], [0.0; 3]);
                (cell[a], cell[b]) = (i, j);
                centre[a] = (i as f64 + 0.5) * step[a];
                centre[b] = (j as f64 + 0.5) * step[b];
                centre[axis] = if wall % 2 == 0 { 0.0 } else { size[axis] };
                patches.push(Patch { wall, cell, centre });
            }
        }
    }
    patches
}

/// Form-factor exchanges by offset, computed once each.
struct Exchanges {
    /// Per axis: walls across it, by absolute offsets along the other two.
    parallel: [Vec<f64>; 3],
    /// Per axis: walls along it, by absolute offset, then by the distances along the other two axes (ascending).
    perpendicular: [Vec<f64>; 3],
}

impl Exchanges {
    fn new(size: [f64; 3], cells: [usize; 3], step: [f64; 3]) -> Self {
        let parallel = [0, 1, 2].map(|axis| {
            let [a, b] = across(axis);
            let offset = |i: usize, j: usize| [i as f64 * step[a], j as f64 * step[b]];
            (0..cells[a])
                .flat_map(|i| (0..cells[b]).map(move |j| (i, j)))
                .map(|(i, j)| parallel_exchange([step[a], step[b]], offset(i, j), size[axis]))
                .collect()
        });
        let perpendicular = [0, 1, 2].map(|axis| {
            let [a, b] = across(axis);
            (0..cells[axis])
                .flat_map(|y| (0..cells[a]).flat_map(move |i| (0..cells[b]).map(move |j| (y, i, j))))
                .map(|(y, i, j)| {
                    let near = [i as f64 * step[a], j as f64 * step[b]];
                    let far = [near[0] + step[a], near[1] + step[b]];
                    perpendicular_exchange(near, far, step[axis], y as f64 * step[axis])
                })
                .collect()
        });
        Self { parallel, perpendicular }
    }

    /// A·F [m²] between two patches; zero within one wall.
    fn between(&self, cells: [usize; 3], p: &Patch, q: &Patch) -> f64 {
        let (axis, other) = (p.wall / 2, q.wall / 2);
        if p.wall == q.wall {
            return 0.0;
        }
        if axis == other {
            let [a, b] = across(axis);
            let (i, j) = (p.cell[a].abs_diff(q.cell[a]), p.cell[b].abs_diff(q.cell[b]));
            return self.parallel[axis][i * cells[b] + j];
        }
        let shared = 3 - axis - other;
        // Distance in cells from the common line, of a patch along an axis towards the wall given.
        let from = |along: usize, cell: usize, wall: usize| {
            if wall.is_multiple_of(2) { cell } else { cells[along] - 1 - cell }
        };
        let [a, b] = across(shared);
        let (on_a, on_b) = if axis == b { (p, q) } else { (q, p) };
        // A wall across b extends along a, from its common line with the wall across a.
        let (i, j) = (from(a, on_a.cell[a], on_b.wall), from(b, on_b.cell[b], on_a.wall));
        let y = p.cell[shared].abs_diff(q.cell[shared]);
        self.perpendicular[shared][(y * cells[a] + i) * cells[b] + j]
    }
}

impl DividedBox {
    /// Fluence of all sound, the direct sound included, at a receiver [1/m²].
    pub fn total_fluence(&self, source: [f64; 3], receiver: [f64; 3]) -> f64 {
        let incident = self.steady_incident(source);
        let seen = (0..self.patches.len()).map(|i| incident[i] * self.seen_from(i, receiver)).sum::<f64>();
        free_field(distance(source, receiver), 0.0) + seen
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
            if !((next - rate).abs() > 1e-10 * rate) {
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

    fn exchange(&self) -> Vec<f64> {
        let exchanges = Exchanges::new(self.room.size, self.cells, self.step);
        let number = self.patches.len();
        let mut passed_on = vec![0.0; number * number];
        for (i, p) in self.patches.iter().enumerate() {
            for (j, q) in self.patches.iter().enumerate() {
                let kept = 1.0 - self.room.absorption[q.wall];
                passed_on[i * number + j] = kept * exchanges.between(self.cells, p, q) / self.area(q);
            }
        }
        passed_on
    }

    fn area(&self, patch: &Patch) -> f64 {
        let [a, b] = across(patch.wall / 2);
        self.step[a] * self.step[b]
    }

    /// Solid angle of a patch seen from a point inside [sr].
    fn solid_angle(&self, patch: &Patch, from: [f64; 3]) -> f64 {
        let axis = patch.wall / 2;
        let plane = across(axis);
        let low = plane.map(|k| patch.cell[k] as f64 * self.step[k] - from[k]);
        let high = [low[0] + self.step[plane[0]], low[1] + self.step[plane[1]]];
        solid_angle(low, high, (patch.centre[axis] - from[axis]).abs())
    }

    /// Energy of the direct sound on each patch.
    fn first_incident(&self, source: [f64; 3]) -> Vec<f64> {
        self.patches.iter().map(|patch| self.solid_angle(patch, source) / (4.0 * PI)).collect()
    }

    /// Fluence at a receiver per energy incident on patch `i` [1/m²]: radiance (1 − α)/(π A) times the solid angle.
    fn seen_from(&self, i: usize, receiver: [f64; 3]) -> f64 {
        let patch = &self.patches[i];
        let kept = 1.0 - self.room.absorption[patch.wall];
        kept * self.solid_angle(patch, receiver) / (PI * self.area(patch))
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
        let weight = |i: usize, j: usize| {
            let length = distance(self.patches[i].centre, self.patches[j].centre);
            (rate * length / self.room.speed_of_sound).exp()
        };
        let number = self.patches.len();
        let weighted = (0..number * number)
            .map(|at| {
                if self.passed_on[at] > 0.0 {
                    self.passed_on[at] * weight(at / number, at % number)
                } else {
                    0.0
                }
            })
            .collect::<Vec<_>>();
        let mut growth = 0.0;
        loop {
            let next = weighted.chunks(number).map(|row| product(row, shape)).collect::<Vec<_>>();
            let now = next.iter().sum::<f64>() / shape.iter().sum::<f64>();
            let scale = number as f64 / next.iter().sum::<f64>();
            *shape = next.into_iter().map(|x| x * scale).collect();
            if !((now - growth).abs() > CONVERGED * now) {
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
            let delay = delay(distance(self.patches[i].centre, self.patches[j].centre));
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
