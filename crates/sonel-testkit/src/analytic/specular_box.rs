//! The shoebox with mirroring walls: an energetic sum over the lattice of image sources.
//!
//! Exact for arrivals and energies of geometrical acoustics. The corner of the box is the origin; the walls are
//! x0 x1 y0 y1 z0 z1. Along each axis the images are numbered by k: even ones are copies of the source shifted by
//! k lengths, odd ones mirrored copies; |k| is the number of reflections by that pair of walls.
//!
//! Reference: [AllenBerkley1979], with energies in place of pressures.

use super::free_field;
use crate::vector::distance;

/// A box whose walls reflect a part of the energy like mirrors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecularBox {
    /// Extent along x, y, z [m].
    pub size: [f64; 3],
    /// Reflected part of the energy, 0…1, of the walls x0 x1 y0 y1 z0 z1.
    pub reflection: [f64; 6],
    /// Speed of sound [m/s].
    pub speed_of_sound: f64,
    /// Energy attenuation of air [1/m].
    pub air_attenuation: f64,
}

/// The sound of one image source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrival {
    /// Travel time [s].
    pub time: f64,
    /// Fluence per unit emitted energy [1/m²].
    pub fluence: f64,
    /// Number of reflections.
    pub order: u32,
    /// Reflections by each of the walls x0 x1 y0 y1 z0 z1.
    pub reflections: [u32; 6],
    /// Position of the image source [m].
    pub image: [f64; 3],
}

/// Where the image of number `k` lies on an axis of length `size`, for a source at `position`.
fn image_coordinate(k: i64, size: f64, position: f64) -> f64 {
    if k % 2 == 0 { k as f64 * size + position } else { (k + 1) as f64 * size - position }
}

/// How often image `k` was mirrored by the lower and the upper wall of its axis. A path to an image beyond the
/// upper wall ends with a reflection there, and the two walls take turns.
fn wall_counts(k: i64) -> [u32; 2] {
    let order = k.unsigned_abs() as u32;
    let (first, second) = (order.div_ceil(2), order / 2);
    if k > 0 { [second, first] } else { [first, second] }
}

impl SpecularBox {
    /// All arrivals up to `time` [s], in order of time.
    pub fn arrivals_until(&self, source: [f64; 3], receiver: [f64; 3], time: f64) -> Vec<Arrival> {
        let reach = time * self.speed_of_sound;
        // Image k is at least (|k| − 1) lengths away from any point of the box.
        let limits = self.size.map(|size| (reach / size) as i64 + 1);
        self.sorted(source, receiver, limits, |arrival| arrival.time <= time)
    }

    /// All arrivals of at most `order` reflections, in order of time.
    pub fn arrivals_to_order(&self, source: [f64; 3], receiver: [f64; 3], order: u32) -> Vec<Arrival> {
        self.sorted(source, receiver, [i64::from(order); 3], |arrival| arrival.order <= order)
    }

    /// Fluence in each of `count` bins of `bin_width` [s], from time zero.
    pub fn echogram(&self, source: [f64; 3], receiver: [f64; 3], bin_width: f64, count: usize) -> Vec<f64> {
        let mut bins = vec![0.0; count];
        let reach = bin_width * count as f64 * self.speed_of_sound;
        self.visit(source, receiver, self.size.map(|size| (reach / size) as i64 + 1), |arrival| {
            if let Some(bin) = bins.get_mut((arrival.time / bin_width) as usize) {
                *bin += arrival.fluence;
            }
        });
        bins
    }

    fn sorted(
        &self,
        source: [f64; 3],
        receiver: [f64; 3],
        limits: [i64; 3],
        keep: impl Fn(&Arrival) -> bool,
    ) -> Vec<Arrival> {
        let mut arrivals = Vec::new();
        self.visit(source, receiver, limits, |arrival| {
            if keep(&arrival) {
                arrivals.push(arrival);
            }
        });
        arrivals.sort_by(|a, b| a.time.total_cmp(&b.time));
        arrivals
    }

    fn visit(&self, source: [f64; 3], receiver: [f64; 3], limits: [i64; 3], mut see: impl FnMut(Arrival)) {
        let coordinate = |axis: usize, k| image_coordinate(k, self.size[axis], source[axis]);
        for i in -limits[0]..=limits[0] {
            for j in -limits[1]..=limits[1] {
                for k in -limits[2]..=limits[2] {
                    let image = [coordinate(0, i), coordinate(1, j), coordinate(2, k)];
                    see(self.arrival([i, j, k], image, receiver));
                }
            }
        }
    }

    fn arrival(&self, number: [i64; 3], image: [f64; 3], receiver: [f64; 3]) -> Arrival {
        let [[x0, x1], [y0, y1], [z0, z1]] = number.map(wall_counts);
        let reflections = [x0, x1, y0, y1, z0, z1];
        let kept = self.reflection.iter().zip(reflections).map(|(r, n)| r.powi(n as i32)).product::<f64>();
        let length = distance(image, receiver);
        Arrival {
            time: length / self.speed_of_sound,
            fluence: kept * free_field(length, self.air_attenuation),
            order: reflections.iter().sum(),
            reflections,
            image,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: SpecularBox = SpecularBox {
        size: [6.0, 5.0, 4.0],
        reflection: [0.9, 0.8, 0.7, 0.6, 0.5, 0.4],
        speed_of_sound: 343.0,
        air_attenuation: 0.002,
    };
    const SOURCE: [f64; 3] = [1.5, 1.2, 1.3];
    const RECEIVER: [f64; 3] = [4.2, 3.7, 2.1];

    #[test]
    fn the_direct_sound_and_six_first_reflections_are_those_of_the_mirrors() {
        let arrivals = ROOM.arrivals_to_order(SOURCE, RECEIVER, 1);
        assert_eq!(arrivals.len(), 7);
        let mirrors = [(0, 0.0), (0, 6.0), (1, 0.0), (1, 5.0), (2, 0.0), (2, 4.0)];
        for (wall, (axis, plane)) in mirrors.into_iter().enumerate() {
            let mut image = SOURCE;
            image[axis] = 2.0 * plane - image[axis];
            let found = arrivals.iter().find(|a| a.order == 1 && a.reflections[wall] == 1).unwrap();
            assert!(distance(found.image, image) < 1e-12);
            let expected = ROOM.reflection[wall] * free_field(distance(image, RECEIVER), 0.002);
            assert!((found.fluence / expected - 1.0).abs() < 1e-12);
        }
        assert_eq!(arrivals[0].order, 0);
    }

    #[test]
    fn an_order_has_four_n_squared_plus_two_images() {
        let arrivals = ROOM.arrivals_to_order(SOURCE, RECEIVER, 7);
        for order in 1..=7 {
            let found = arrivals.iter().filter(|a| a.order == order).count();
            assert_eq!(found as u32, 4 * order * order + 2);
        }
    }

    /// Mirrors the source by one wall after another, over all sequences; an image counts when the path back from
    /// the receiver meets the walls in that sequence, inside of the box.
    fn traced(room: &SpecularBox, order: u32) -> Vec<(f64, f64)> {
        let mut found = Vec::new();
        for code in 0..6_u32.pow(order) {
            let walls = (0..order).map(|n| (code / 6_u32.pow(n) % 6) as usize).collect::<Vec<_>>();
            let mut images = vec![SOURCE];
            for &wall in &walls {
                let mut image = images[images.len() - 1];
                let plane = if wall % 2 == 0 { 0.0 } else { room.size[wall / 2] };
                image[wall / 2] = 2.0 * plane - image[wall / 2];
                images.push(image);
            }
            let mut at = RECEIVER;
            let valid = (0..walls.len()).rev().all(|n| {
                let (image, axis) = (images[n + 1], walls[n] / 2);
                let plane = if walls[n] % 2 == 0 { 0.0 } else { room.size[axis] };
                let part = (plane - at[axis]) / (image[axis] - at[axis]);
                let next = [0, 1, 2].map(|k| at[k] + part * (image[k] - at[k]));
                let inside = (0..3).all(|k| next[k] > -1e-9 && next[k] < room.size[k] + 1e-9);
                at = next;
                part > 1e-9 && part < 1.0 && inside
            });
            if valid {
                let length = distance(images[images.len() - 1], RECEIVER);
                let kept = walls.iter().map(|&wall| room.reflection[wall]).product::<f64>();
                found.push((length / room.speed_of_sound, kept * free_field(length, room.air_attenuation)));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    #[test]
    fn the_lattice_is_what_mirroring_wall_by_wall_finds() {
        for order in 1..=4 {
            let lattice = ROOM.arrivals_to_order(SOURCE, RECEIVER, order);
            let lattice = lattice.iter().filter(|a| a.order == order).collect::<Vec<_>>();
            let traced = traced(&ROOM, order);
            assert_eq!(lattice.len(), traced.len(), "order {order}");
            for (a, b) in lattice.iter().zip(&traced) {
                assert!((a.time - b.0).abs() < 1e-12 && (a.fluence / b.1 - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn swapped_walls_are_noticed() {
        let swapped = SpecularBox { reflection: [0.8, 0.9, 0.7, 0.6, 0.5, 0.4], ..ROOM };
        let total = |room: &SpecularBox| room.echogram(SOURCE, RECEIVER, 0.001, 500).iter().sum::<f64>();
        assert!((total(&swapped) / total(&ROOM) - 1.0).abs() > 1e-3);
    }

    #[test]
    fn source_and_receiver_may_be_exchanged() {
        let (there, back) =
            (ROOM.arrivals_until(SOURCE, RECEIVER, 0.1), ROOM.arrivals_until(RECEIVER, SOURCE, 0.1));
        assert_eq!(there.len(), back.len());
        // Images in one plane arrive together, in either order: the energies are compared as sums over time.
        let moment =
            |arrivals: &[Arrival], n| arrivals.iter().map(|a| a.fluence * a.time.powi(n)).sum::<f64>();
        (0..4).for_each(|n| assert!((moment(&there, n) / moment(&back, n) - 1.0).abs() < 1e-12));
    }

    #[test]
    fn the_echogram_sums_every_arrival_and_their_number_grows_with_the_cube_of_time() {
        let arrivals = ROOM.arrivals_until(SOURCE, RECEIVER, 0.3);
        let echogram = ROOM.echogram(SOURCE, RECEIVER, 0.003, 100);
        let sum = arrivals.iter().map(|a| a.fluence).sum::<f64>();
        assert!((echogram.iter().sum::<f64>() / sum - 1.0).abs() < 1e-12);
        let sphere = 4.0 / 3.0 * std::f64::consts::PI * (0.3_f64 * 343.0).powi(3) / 120.0;
        assert!((arrivals.len() as f64 / sphere - 1.0).abs() < 0.01, "{} of {sphere}", arrivals.len());
    }
}
