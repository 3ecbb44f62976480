//! A simple, slow simulator of equal box rooms in a row, with partitions between them, as a reference.
//!
//! As [`crate::bruteforce`], with walls of one material and energies alone. Partitions have no thickness: what meets one face leaves the
//! other at the same place, reflected and transmitted rays in equal numbers.

use crate::uniform::Uniform;
use crate::vector::{difference, dot};
use crate::z_test::Estimate;

use std::f64::consts::{PI, TAU};

/// The rooms, from x = 0 on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowOfRooms {
    /// Number of rooms.
    pub rooms: usize,
    /// Extent of each along x, y, z [m].
    pub size: [f64; 3],
    /// Absorption coefficient of walls and partitions, 0…1.
    pub absorption: f64,
    /// Scattering coefficient of all of them, 0…1.
    pub scattering: f64,
    /// Transmission coefficient of the partitions, 0 … absorption.
    pub transmission: f64,
}

/// A ray that carries less is of no matter.
const LEAST_WEIGHT: f64 = 1e-7;
const BATCHES: u64 = 32;

impl RowOfRooms {
    /// Fluences of an omnidirectional source of unit energy at receivers, by spheres of `radius` [m] within their rooms.
    pub fn fluences(
        &self,
        source: [f64; 3],
        receivers: &[[f64; 3]],
        radius: f64,
        rays: usize,
    ) -> Vec<Estimate> {
        let share = 1.0 / (PI * radius * radius * rays as f64);
        let batch = |seed: u64| {
            let mut numbers = Uniform::new(seed);
            let mut sums = vec![0.0; receivers.len()];
            for _ in 0..rays {
                self.follow(source, &mut numbers, |at, towards, step, weight| {
                    for (sum, &receiver) in sums.iter_mut().zip(receivers) {
                        let offset = difference(receiver, at);
                        let along = dot(offset, towards);
                        let missed = dot(offset, offset) - along * along;
                        if along > 0.0 && along < step && missed < radius * radius {
                            *sum += share * weight;
                        }
                    }
                });
            }
            sums
        };
        let sums: Vec<Vec<f64>> = (1..=BATCHES).map(batch).collect();
        let of = |receiver: usize| sums.iter().map(|sums| sums[receiver]).collect::<Vec<f64>>();
        (0..receivers.len()).map(|receiver| Estimate::of(&of(receiver))).collect()
    }

    /// Follows one ray; `leg` gets where it begins, direction, length [m] and weight of each.
    fn follow(
        &self,
        source: [f64; 3],
        numbers: &mut Uniform,
        mut leg: impl FnMut([f64; 3], [f64; 3], f64, f64),
    ) {
        let (mut at, mut towards, mut weight) = (source, numbers.unit_vector(), 1.0);
        let mut room = (at[0] / self.size[0]) as usize;
        while weight > LEAST_WEIGHT {
            let low = [room as f64 * self.size[0], 0.0, 0.0];
            let distance = |k: usize| {
                let plane = if towards[k] > 0.0 { low[k] + self.size[k] } else { low[k] };
                if towards[k] == 0.0 { f64::INFINITY } else { (plane - at[k]) / towards[k] }
            };
            let axis = (0..3).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).expect("three axes");
            let (step, is_up) = (distance(axis).max(0.0), towards[axis] > 0.0);
            leg(at, towards, step, weight);
            at = [0, 1, 2].map(|k| at[k] + step * towards[k]);
            at[axis] = if is_up { low[axis] + self.size[axis] } else { low[axis] };
            let is_partition = axis == 0 && if is_up { room + 1 < self.rooms } else { room > 0 };
            if is_partition && numbers.next_f64() < 0.5 {
                weight *= 2.0 * self.transmission;
                room = if is_up { room + 1 } else { room - 1 };
                continue;
            }
            weight *= (1.0 - self.absorption) * if is_partition { 2.0 } else { 1.0 };
            if numbers.next_f64() < self.scattering {
                let across = numbers.next_f64();
                let (sin, cos) = (TAU * numbers.next_f64()).sin_cos();
                towards[(axis + 1) % 3] = across.sqrt() * cos;
                towards[(axis + 2) % 3] = across.sqrt() * sin;
                towards[axis] = if is_up { -1.0 } else { 1.0 } * (1.0 - across).sqrt();
            } else {
                towards[axis] = -towards[axis];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bruteforce::{BoxRoom, Count};
    use crate::z_test::{Within, agree};

    const ROW: RowOfRooms =
        RowOfRooms { rooms: 2, size: [3.0, 4.0, 2.5], absorption: 0.3, scattering: 0.5, transmission: 0.0 };
    const SOURCE: [f64; 3] = [1.0, 1.1, 1.2];
    const RECEIVER: [f64; 3] = [2.0, 3.0, 1.4];

    #[test]
    fn a_room_behind_nothing_is_a_box() {
        let room = BoxRoom {
            size: ROW.size,
            absorption: [ROW.absorption; 6],
            scattering: [ROW.scattering; 6],
            speed_of_sound: 343.0,
            air_attenuation: 0.0,
            window: None,
        };
        let counted = room.count(&Count {
            source: SOURCE,
            receiver: RECEIVER,
            radius: 0.4,
            bin_width: 0.01,
            bins: 60,
            batches: 32,
            rays_per_batch: 4000,
            seed: 5,
        });
        let found = ROW.fluences(SOURCE, &[RECEIVER, [4.5, 2.0, 1.2]], 0.4, 4000);
        let within = Within { sigmas: 4.0, maximal_sigma: 0.02 * found[0].value };
        agree(found[0], counted.total(), within).unwrap();
        assert!(found[1].value <= 0.0, "nothing passes");
        let leaky =
            RowOfRooms { transmission: ROW.absorption, ..ROW }.fluences(SOURCE, &[RECEIVER], 0.4, 4000);
        assert!(leaky[0].value > found[0].value, "what passes comes back");
    }
}
