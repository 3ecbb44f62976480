//! Image sources of an empty box: a lattice, all visible from everywhere inside.

use glam::DVec3;
use sonel_geometry::{Geometry, Shoebox};
use sonel_map::{BandValues, CoefficientTable, Lanes, lanes_of};

use super::{Image, MirrorArrival, Radiator};

/// Largest K: about a third of a million images.
const ORDER_LIMIT: u32 = 64;
/// Chains whose specular factor is below this in every band are left to the noisy estimator, which then owns next to
/// nothing.
const NEGLIGIBLE_FACTOR: f64 = 1e-8;

/// Images along the three axes; the image (i, j, k) is their combination.
#[derive(Debug)]
pub(crate) struct ImageLattice {
    order: u32,
    axes: [Vec<AxisImage>; 3],
    lanes: usize,
}

/// One image along one axis.
#[derive(Debug)]
struct AxisImage {
    /// Coordinate about the scene's centre [m].
    coordinate: f64,
    /// Reflections at this axis' two walls.
    order: u32,
    /// −1 where the image is inverted.
    sign: f64,
    /// ∏ (1−α)(1−s) over those reflections, per band.
    factor: Vec<Lanes>,
}

impl ImageLattice {
    /// The lattice of a source at `position` (about the scene's centre [m]) in `room`, up to the order that carries energy within `reach` [m].
    #[must_use]
    pub(crate) fn new(
        geometry: &Geometry,
        room: &Shoebox,
        table: &CoefficientTable,
        position: DVec3,
        reach: f64,
        most: Option<u32>,
    ) -> Self {
        let walls = room.walls.map(|wall| table.mean_row(wall).specular.energy.as_slice());
        let (low, high) = (room.min - geometry.center(), room.max - geometry.center());
        let order = most.unwrap_or_else(|| affordable_order(&walls, high - low, reach));
        let axis = |axis: usize| {
            axis_images(
                order,
                position[axis],
                [low[axis], high[axis]],
                [walls[2 * axis], walls[2 * axis + 1]],
            )
        };
        let axes = [axis(0), axis(1), axis(2)];
        Self { order, axes, lanes: lanes_of(table.bands()) }
    }

    /// K.
    #[must_use]
    pub(crate) fn order(&self) -> u32 {
        self.order
    }

    /// All images with their orders and ∏ (1−α)(1−s).
    #[must_use]
    pub(crate) fn images(&self) -> Vec<Image> {
        let [xs, ys, zs] = &self.axes;
        let mut images = Vec::new();
        for (x, y) in xs.iter().flat_map(|x| ys.iter().map(move |y| (x, y))) {
            for z in zs {
                let order = x.order + y.order + z.order;
                if order == 0 || order > self.order {
                    continue;
                }
                let mut factor = x.factor.clone();
                factor.multiply(&y.factor);
                factor.multiply(&z.factor);
                images.push(Image {
                    position: DVec3::new(x.coordinate, y.coordinate, z.coordinate),
                    order,
                    signs: DVec3::new(x.sign, y.sign, z.sign),
                    factor,
                });
            }
        }
        images
    }

    /// Visits all images of `radiator`, which is at the position of the lattice, within `reach` [m] of `receiver`.
    pub(crate) fn visit(
        &self,
        radiator: Radiator<'_>,
        receiver: DVec3,
        reach: f64,
        mut found: impl FnMut(&MirrorArrival<'_>),
    ) {
        let [xs, ys, zs] = &self.axes;
        let (mut plane, mut factor) = (vec![Lanes::ZERO; self.lanes], vec![Lanes::ZERO; self.lanes]);
        for x in xs {
            for y in ys.iter().filter(|y| x.order + y.order <= self.order) {
                let (dx, dy) = (x.coordinate - receiver.x, y.coordinate - receiver.y);
                if dx * dx + dy * dy > reach * reach {
                    continue;
                }
                plane.set_product(&x.factor, &y.factor, 1.0);
                for z in zs.iter().filter(|z| x.order + y.order + z.order <= self.order) {
                    let order = x.order + y.order + z.order;
                    let offset = DVec3::new(dx, dy, z.coordinate - receiver.z);
                    let length = offset.length();
                    if order == 0 || length > reach {
                        continue;
                    }
                    let leaving = -offset * DVec3::new(x.sign, y.sign, z.sign);
                    factor.set_product(&plane, &z.factor, 1.0);
                    radiator.towards(leaving).weigh(&mut factor);
                    let towards = offset / length;
                    found(&MirrorArrival {
                        length,
                        towards,
                        order,
                        mirrors: Vec::new(),
                        factor: &factor,
                        through: Vec::new(),
                    });
                }
            }
        }
    }
}

/// The order at which no band's image sources matter any more, or at which all images lie beyond `reach`.
fn affordable_order(walls: &[&[Lanes]; 6], size: DVec3, reach: f64) -> u32 {
    let most_mirroring = walls.iter().map(|wall| wall.largest()).fold(0.0, f64::max);
    let by_energy = if most_mirroring <= 0.0 {
        0
    } else if most_mirroring < 1.0 {
        libm::ceil(libm::log(NEGLIGIBLE_FACTOR) / libm::log(most_mirroring)) as u32
    } else {
        ORDER_LIMIT
    };
    // A path of length d crosses at most d·|cos| / L + 1 walls of each axis; their sum is largest along (1/Lx, 1/Ly, 1/Lz).
    let by_time = libm::ceil(reach * size.recip().length()) as u32 + 3;
    by_energy.min(by_time).min(ORDER_LIMIT)
}

/// Images along one axis with walls at `ends`: order |n|, the n-th towards positive or negative coordinates.
fn axis_images(order: u32, source: f64, ends: [f64; 2], walls: [&[Lanes]; 2]) -> Vec<AxisImage> {
    let (length, inside) = (ends[1] - ends[0], source - ends[0]);
    let limit = i64::from(order);
    (-limit..=limit)
        .map(|n| {
            let inverted = n.rem_euclid(2) == 1;
            let from_low =
                if inverted { (n + 1) as f64 * length - inside } else { n as f64 * length + inside };
            let hits = n.unsigned_abs() as u32;
            // Going up, the upper wall is met first and then every other time; going down, the lower one.
            let (first, second) = (hits.div_ceil(2), hits / 2);
            let (low_hits, high_hits) = if n > 0 { (second, first) } else { (first, second) };
            AxisImage {
                coordinate: ends[0] + from_low,
                order: hits,
                sign: if inverted { -1.0 } else { 1.0 },
                factor: wall_factor(walls, [low_hits, high_hits]),
            }
        })
        .collect()
}

fn wall_factor(walls: [&[Lanes]; 2], hits: [u32; 2]) -> Vec<Lanes> {
    let mut factor = vec![Lanes::ONE; walls[0].len()];
    for (wall, hits) in walls.into_iter().zip(hits) {
        (0..hits).for_each(|_| factor.multiply(wall));
    }
    factor
}
