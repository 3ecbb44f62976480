//! A simple, slow simulator of a box room, which may have a window, as a reference.
//!
//! One band, analytic walls, `f64`, one ray after another: a ray loses α of its weight at each wall and goes on as a
//! mirror or, with probability s, after the cosine law. Every crossing of a sphere about the receiver counts
//! weight/(π r²), at the time of the closest approach. No roulette, no connection, no density estimate, no index. A receiver outside counts
//! what goes straight on through the window; nothing comes back from there.
//!
//! The only bias is that of the sphere, of order (r/d)² per path of length d: the mean of 1/(4πd²) over the disc.
//!
//! Errors come from batches of rays with streams of their own; functions of the whole echogram are jackknifed.

use crate::uniform::Uniform;
use crate::vector::{difference, dot};
use crate::z_test::Estimate;

use std::f64::consts::{PI, TAU};

/// A box of walls x0 x1 y0 y1 z0 z1 with its corner in the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxRoom {
    /// Extent along x, y, z [m].
    pub size: [f64; 3],
    /// Absorption coefficient of each wall, 0…1.
    pub absorption: [f64; 6],
    /// Scattering coefficient of each wall, 0…1.
    pub scattering: [f64; 6],
    /// Speed of sound [m/s].
    pub speed_of_sound: f64,
    /// Energy attenuation of air [1/m].
    pub air_attenuation: f64,
    /// Part of a wall that sound passes.
    pub window: Option<Window>,
}

/// A rectangle in a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Number of the wall.
    pub wall: usize,
    /// Lower corner along the axes that follow that of the wall, in the order x y z x [m].
    pub low: [f64; 2],
    /// Upper corner [m].
    pub high: [f64; 2],
    /// Transmission coefficient, 0…1.
    pub transmission: f64,
    /// Absorption coefficient there, at least the transmission coefficient.
    pub absorption: f64,
}

/// Where, how finely and how long to count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Count {
    /// Position of the source [m], outside of the sphere.
    pub source: [f64; 3],
    /// Centre of the sphere [m], which lies wholly in the room or, if the room has a window, wholly outside.
    pub receiver: [f64; 3],
    /// Radius of the sphere [m].
    pub radius: f64,
    /// Width of a bin [s].
    pub bin_width: f64,
    /// Number of bins; rays end with the last.
    pub bins: usize,
    /// Batches, at least two: 32 give a good error.
    pub batches: usize,
    /// Rays of one batch.
    pub rays_per_batch: usize,
    /// Seed of the first batch; the others follow.
    pub seed: u64,
}

/// What a ray has met since it left the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum History {
    /// Nothing: L R.
    Direct,
    /// Mirrors only: L S⁺ R.
    Specular,
    /// A scattering wall just now: … D R.
    Diffuse,
    /// Mirrors since the last scattering wall: … D S⁺ R.
    DiffuseThenSpecular,
}

/// Fluences counted, per batch and class of path.
#[derive(Debug, Clone, PartialEq)]
pub struct Counted {
    bin_width: f64,
    /// By batch, history and bin [1/m²].
    batches: Vec<[Vec<f64>; 4]>,
}

impl Counted {
    /// Width of a bin [s].
    pub fn bin_width(&self) -> f64 {
        self.bin_width
    }

    /// Fluence per bin with its standard error [1/m²], all classes together.
    pub fn echogram(&self) -> Vec<Estimate> {
        let batches = self.batch_echograms();
        let bin = |i: usize| Estimate::of(&batches.iter().map(|batch| batch[i]).collect::<Vec<_>>());
        (0..batches[0].len()).map(bin).collect()
    }

    /// Fluence of all bins and classes [1/m²].
    pub fn total(&self) -> Estimate {
        self.sum(|_| true)
    }

    /// Fluence of all bins of one class [1/m²].
    pub fn class(&self, history: History) -> Estimate {
        self.sum(|class| class == history as usize)
    }

    /// Fluence of all bins that was scattered at least once [1/m²].
    pub fn scattered(&self) -> Estimate {
        self.sum(|class| class >= History::Diffuse as usize)
    }

    /// Any function of the mean echogram, with its jackknifed standard error.
    pub fn jackknife(&self, f: impl Fn(&[f64]) -> f64) -> Estimate {
        let batches = self.batch_echograms();
        let count = batches.len() as f64;
        let bins = batches[0].len();
        let sum = (0..bins).map(|i| batches.iter().map(|batch| batch[i]).sum::<f64>()).collect::<Vec<_>>();
        let mean = |values: &[f64], n: f64| values.iter().map(|x| x / n).collect::<Vec<_>>();
        let without =
            |batch: &Vec<f64>| sum.iter().zip(batch).map(|(s, b)| (s - b).max(0.0)).collect::<Vec<_>>();
        let parts = batches.iter().map(|batch| f(&mean(&without(batch), count - 1.0))).collect::<Vec<_>>();
        let sigma = Estimate::of(&parts).sigma * (count - 1.0);
        Estimate { value: f(&mean(&sum, count)), sigma }
    }

    fn sum(&self, keep: impl Fn(usize) -> bool) -> Estimate {
        let batch = |classes: &[Vec<f64>; 4]| {
            (0..4).filter(|&class| keep(class)).map(|class| classes[class].iter().sum::<f64>()).sum::<f64>()
        };
        Estimate::of(&self.batches.iter().map(batch).collect::<Vec<_>>())
    }

    fn batch_echograms(&self) -> Vec<Vec<f64>> {
        let add = |classes: &[Vec<f64>; 4]| {
            (0..classes[0].len()).map(|bin| classes.iter().map(|class| class[bin]).sum()).collect()
        };
        self.batches.iter().map(add).collect()
    }
}

impl BoxRoom {
    /// Counts the rays of an omnidirectional source that cross the sphere.
    pub fn count(&self, count: &Count) -> Counted {
        assert!(count.batches > 1, "no error from a single batch");
        let gap = difference(count.source, count.receiver);
        assert!(dot(gap, gap) > count.radius * count.radius, "the source lies in the receiver");
        assert!(self.holds(count) || self.is_outside(count), "the sphere reaches out of the room");
        let batches =
            (0..count.batches).map(|batch| self.batch(count, count.seed.wrapping_add(batch as u64)));
        Counted { bin_width: count.bin_width, batches: batches.collect() }
    }

    /// Whether the sphere lies wholly in the room.
    fn holds(&self, count: &Count) -> bool {
        (0..3).all(|k| count.receiver[k] > count.radius && count.receiver[k] < self.size[k] - count.radius)
    }

    /// Whether the sphere lies wholly outside of a room with a window.
    fn is_outside(&self, count: &Count) -> bool {
        let beyond =
            |k: usize| count.receiver[k] < -count.radius || count.receiver[k] > self.size[k] + count.radius;
        self.window.is_some() && (0..3).any(beyond)
    }

    /// The window, if it is at a place of a wall.
    fn window_at(&self, wall: usize, at: [f64; 3]) -> Option<&Window> {
        let place = [at[(wall / 2 + 1) % 3], at[(wall / 2 + 2) % 3]];
        let holds = |window: &&Window| {
            window.wall == wall && (0..2).all(|k| place[k] > window.low[k] && place[k] < window.high[k])
        };
        self.window.as_ref().filter(holds)
    }

    fn batch(&self, count: &Count, seed: u64) -> [Vec<f64>; 4] {
        let mut numbers = Uniform::new(seed);
        let mut classes = [(); 4].map(|()| vec![0.0; count.bins]);
        let share = 1.0 / (PI * count.radius * count.radius * count.rays_per_batch as f64);
        for _ in 0..count.rays_per_batch {
            self.follow(count, &mut numbers, |history, length, weight| {
                let bin = (length / self.speed_of_sound / count.bin_width) as usize;
                if let Some(bin) = classes[history as usize].get_mut(bin) {
                    *bin += share * weight * (-self.air_attenuation * length).exp();
                }
            });
        }
        classes
    }

    /// Follows one ray until the last bin; `crossing` gets history, path length [m] and weight.
    fn follow(&self, count: &Count, numbers: &mut Uniform, mut crossing: impl FnMut(History, f64, f64)) {
        let reach = self.speed_of_sound * count.bin_width * count.bins as f64;
        let (mut at, mut towards) = (count.source, numbers.unit_vector());
        let (mut length, mut weight, mut history) = (0.0, 1.0, History::Direct);
        let is_inside = self.holds(count);
        // How far on a line passes the receiver, if it meets the sphere: that lies wholly on this side of the walls or on the other.
        let passes = |at: [f64; 3], towards: [f64; 3]| {
            let to_receiver = difference(count.receiver, at);
            let along = dot(to_receiver, towards);
            let missed = dot(to_receiver, to_receiver) - along * along;
            (along > 0.0 && missed < count.radius * count.radius).then_some(along)
        };
        while length < reach && weight > 0.0 {
            if let Some(along) = passes(at, towards).filter(|_| is_inside) {
                crossing(history, length + along, weight);
            }
            let (wall, step) = self.next_wall(at, towards);
            at = [0, 1, 2].map(|k| at[k] + step * towards[k]);
            at[wall / 2] = if wall % 2 == 0 { 0.0 } else { self.size[wall / 2] };
            length += step;
            let window = self.window_at(wall, at);
            if let Some((window, along)) = window.zip(passes(at, towards).filter(|_| !is_inside)) {
                crossing(history, length + along, weight * window.transmission);
            }
            weight *= 1.0 - window.map_or(self.absorption[wall], |window| window.absorption);
            if numbers.next_f64() < self.scattering[wall] {
                towards = lambert(wall, numbers);
                history = History::Diffuse;
            } else {
                towards[wall / 2] = -towards[wall / 2];
                history = history.mirrored();
            }
        }
    }

    /// The wall a ray meets next, and how far it is [m].
    fn next_wall(&self, at: [f64; 3], towards: [f64; 3]) -> (usize, f64) {
        let distance = |axis: usize| {
            let plane = if towards[axis] > 0.0 { self.size[axis] } else { 0.0 };
            (plane - at[axis]) / towards[axis]
        };
        let mut nearest = (0, f64::INFINITY);
        for axis in (0..3).filter(|&axis| towards[axis].abs() > 0.0) {
            let step = distance(axis);
            if step < nearest.1 {
                nearest = (2 * axis + usize::from(towards[axis] > 0.0), step);
            }
        }
        nearest
    }
}

impl History {
    fn mirrored(self) -> Self {
        match self {
            Self::Direct | Self::Specular => Self::Specular,
            Self::Diffuse | Self::DiffuseThenSpecular => Self::DiffuseThenSpecular,
        }
    }
}

/// A direction into the room after the cosine law about the normal of a wall.
fn lambert(wall: usize, numbers: &mut Uniform) -> [f64; 3] {
    let axis = wall / 2;
    let radius_squared = numbers.next_f64();
    let (sin, cos) = (TAU * numbers.next_f64()).sin_cos();
    let radius = radius_squared.sqrt();
    let height = (1.0 - radius_squared).sqrt();
    let mut direction = [0.0; 3];
    direction[axis] = if wall.is_multiple_of(2) { height } else { -height };
    direction[(axis + 1) % 3] = radius * cos;
    direction[(axis + 2) % 3] = radius * sin;
    direction
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::diffuse_box::DiffuseBox;
    use crate::analytic::free_field;
    use crate::analytic::specular_box::SpecularBox;
    use crate::decay::reverberation_time;
    use crate::z_test::{Disagreement, Within, within_sigmas};

    const COUNT: Count = Count {
        source: [1.5, 1.2, 1.3],
        receiver: [4.2, 3.7, 2.1],
        radius: 0.4,
        bin_width: 0.002,
        bins: 500,
        batches: 32,
        rays_per_batch: 6000,
        seed: 1,
    };

    fn room(scattering: f64) -> BoxRoom {
        BoxRoom {
            size: [6.0, 5.0, 4.0],
            absorption: [0.2; 6],
            scattering: [scattering; 6],
            speed_of_sound: 343.0,
            air_attenuation: 0.0,
            window: None,
        }
    }

    fn images(reflection: [f64; 6], air_attenuation: f64) -> SpecularBox {
        SpecularBox { size: [6.0, 5.0, 4.0], reflection, speed_of_sound: 343.0, air_attenuation }
    }

    fn t30(echogram: &[f64]) -> f64 {
        reverberation_time(echogram, COUNT.bin_width, -5.0, -35.0)
    }

    /// Compares with a relative standard error of at most `part`.
    fn compare(estimate: Estimate, expected: f64, part: f64) -> Result<(), Disagreement> {
        within_sigmas(estimate, expected, Within { sigmas: 4.0, maximal_sigma: part * expected })
    }

    #[test]
    #[ignore = "long: cargo xtask accept"]
    fn mirrors_alone_give_the_image_sources() {
        let absorption = [0.1, 0.3, 0.2, 0.25, 0.15, 0.35];
        let walls = BoxRoom { absorption, air_attenuation: 0.003, ..room(0.0) };
        let counted = walls.count(&COUNT);
        let exact = images(absorption.map(|a| 1.0 - a), 0.003);
        let expected = exact.echogram(COUNT.source, COUNT.receiver, COUNT.bin_width, COUNT.bins);
        compare(counted.total(), expected.iter().sum(), 0.02).unwrap();
        compare(counted.jackknife(t30), t30(&expected), 0.02).unwrap();
        for window in 0..5 {
            let energy = |bins: &[f64]| bins[25 * window..25 * (window + 1)].iter().sum::<f64>();
            compare(counted.jackknife(energy), energy(&expected), 0.05).unwrap();
        }
        // A model without the loss in the air, and one whose decay is a tenth longer.
        let airless = images(absorption.map(|a| 1.0 - a), 0.0);
        let airless = airless.echogram(COUNT.source, COUNT.receiver, COUNT.bin_width, COUNT.bins);
        assert!(compare(counted.total(), airless.iter().sum(), 0.02).is_err());
        assert!(compare(counted.jackknife(t30), 1.1 * t30(&expected), 0.02).is_err());
    }

    #[test]
    #[ignore = "long: cargo xtask accept"]
    fn cosine_law_alone_gives_the_radiosity_solution() {
        let counted = room(1.0).count(&COUNT);
        let exact = DiffuseBox { size: [6.0, 5.0, 4.0], absorption: [0.2; 6], speed_of_sound: 343.0 };
        let divided = exact.divide([8; 3]);
        compare(counted.total(), divided.total_fluence(COUNT.source, COUNT.receiver), 0.01).unwrap();
        compare(counted.jackknife(t30), divided.reverberation_time(), 0.003).unwrap();
        assert!(
            compare(room(0.5).count(&COUNT).jackknife(t30), divided.reverberation_time(), 0.003).is_err()
        );
    }

    #[test]
    #[ignore = "long: cargo xtask accept"]
    fn half_scattering_gives_the_figures_found_before() {
        let counted = room(0.5).count(&COUNT);
        compare(counted.total(), 0.101_02, 0.01).unwrap();
        compare(counted.jackknife(t30), 0.600_8, 0.003).unwrap();
        assert!(compare(counted.jackknife(t30), 1.02 * 0.600_8, 0.003).is_err());
    }

    #[test]
    #[ignore = "long: cargo xtask accept"]
    fn classes_of_paths_add_up_and_hold_their_own() {
        let counted = room(0.5).count(&COUNT);
        let all = [History::Direct, History::Specular, History::Diffuse, History::DiffuseThenSpecular];
        let sum = all.iter().map(|&class| counted.class(class).value).sum::<f64>();
        assert!((sum / counted.total().value - 1.0).abs() < 1e-12);
        let distance = (2.7_f64 * 2.7 + 2.5 * 2.5 + 0.8 * 0.8).sqrt();
        compare(counted.class(History::Direct), free_field(distance, 0.0), 0.08).unwrap();
        // A path of mirrors alone keeps (1 − α)(1 − s) at each wall.
        let mirrored =
            images([0.4; 6], 0.0).echogram(COUNT.source, COUNT.receiver, COUNT.bin_width, COUNT.bins);
        let mirrored = mirrored.iter().sum::<f64>() - free_field(distance, 0.0);
        compare(counted.class(History::Specular), mirrored, 0.05).unwrap();
        assert!(compare(counted.class(History::Specular), 1.25 * mirrored, 0.05).is_err());
    }

    #[test]
    fn the_echogram_and_its_errors_are_those_of_the_batches() {
        let counted = room(0.5).count(&Count { batches: 8, rays_per_batch: 500, ..COUNT });
        let echogram = counted.echogram();
        let total = echogram.iter().map(|bin| bin.value).sum::<f64>();
        assert!((total / counted.total().value - 1.0).abs() < 1e-12);
        // The jackknife of a sum is the error of the mean.
        let jackknifed = counted.jackknife(|bins| bins.iter().sum());
        assert!((jackknifed.sigma / counted.total().sigma - 1.0).abs() < 1e-9);
        assert!((counted.jackknife(|bins| bins[40]).sigma / echogram[40].sigma - 1.0).abs() < 1e-9);
    }

    /// Images of the source send through the window those of their rays that meet it.
    #[test]
    fn a_window_lets_out_what_comes_straight_through_it() {
        let window =
            Window { wall: 1, low: [1.0, 0.5], high: [4.0, 3.0], transmission: 0.25, absorption: 1.0 };
        let dead = BoxRoom { absorption: [1.0; 6], window: Some(window), ..room(0.0) };
        let outside = Count { receiver: [14.0, 2.5, 2.0], ..COUNT };
        let (distance, aside) = ((12.5_f64.powi(2) + 1.3 * 1.3 + 0.7 * 0.7).sqrt(), [14.0, 2.5, 14.0]);
        let found = dead.count(&Count { rays_per_batch: 30_000, ..outside });
        compare(found.total(), 0.25 * free_field(distance, 0.0), 0.08).unwrap();
        assert!(compare(found.total(), free_field(distance, 0.0), 0.08).is_err());
        assert!(dead.count(&Count { receiver: aside, ..outside }).total().value <= 0.0, "not in sight");
        let mirror = BoxRoom { absorption: [0.0, 1.0, 1.0, 1.0, 1.0, 1.0], ..dead };
        let found = mirror.count(&Count { rays_per_batch: 30_000, ..outside });
        let image = (15.5_f64.powi(2) + 1.3 * 1.3 + 0.7 * 0.7).sqrt();
        compare(found.class(History::Specular), 0.25 * free_field(image, 0.0), 0.1).unwrap();
    }

    #[test]
    #[should_panic(expected = "out of the room")]
    fn a_sphere_through_a_wall_is_refused() {
        room(0.5).count(&Count { receiver: [0.2, 3.0, 2.0], ..COUNT });
    }
}
