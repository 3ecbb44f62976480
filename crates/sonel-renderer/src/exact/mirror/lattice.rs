//! Image sources of an empty box: a lattice, all visible from everywhere inside.

use glam::DVec3;
use sonel_geometry::{Geometry, Shoebox};
use sonel_map::{BandValues, CoefficientTable, Lanes, lanes_of};

use super::chains::Chains;
use super::{LatticeImage, MirrorArrival, Radiator};

/// Images along the three axes; the image (i, j, k) is their combination.
#[derive(Debug)]
pub(crate) struct ImageLattice {
    chains: Chains,
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
    /// Their cost.
    cost: u32,
    /// −1 where the image is inverted.
    sign: f64,
    /// ∏ (1−α)(1−s) over those reflections, per band.
    factor: Vec<Lanes>,
}

impl ImageLattice {
    /// The lattice of a source at `position` (about the scene's centre [m]) in `room`, of the images over `chains`.
    #[must_use]
    pub(crate) fn new(
        geometry: &Geometry,
        room: &Shoebox,
        table: &CoefficientTable,
        position: DVec3,
        chains: Chains,
    ) -> Self {
        let walls = room.walls.map(|wall| table.mean_row(wall).specular.energy.as_slice());
        let (low, high) = (room.min - geometry.center(), room.max - geometry.center());
        let costs = room.walls.map(|wall| chains.cost(wall));
        let axis = |axis: usize| {
            let walls = [0, 1].map(|end| (walls[2 * axis + end], costs[2 * axis + end]));
            axis_images(chains.limit, position[axis], [low[axis], high[axis]], walls)
        };
        let axes = [axis(0), axis(1), axis(2)];
        Self { chains, axes, lanes: lanes_of(table.bands()) }
    }

    /// The chains that its images are over.
    #[must_use]
    pub(crate) fn chains(&self) -> &Chains {
        &self.chains
    }

    /// All images with their ∏ (1−α)(1−s).
    #[must_use]
    pub(crate) fn images(&self) -> Vec<LatticeImage> {
        let [xs, ys, zs] = &self.axes;
        let mut images = Vec::new();
        for (x, y) in xs.iter().flat_map(|x| ys.iter().map(move |y| (x, y))) {
            for z in zs {
                let cost = x.cost + y.cost + z.cost;
                if cost == 0 || cost > self.chains.limit {
                    continue;
                }
                let mut factor = x.factor.clone();
                factor.multiply(&y.factor);
                factor.multiply(&z.factor);
                images.push(LatticeImage {
                    position: DVec3::new(x.coordinate, y.coordinate, z.coordinate),
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
            for y in ys.iter().filter(|y| x.cost + y.cost <= self.chains.limit) {
                let (dx, dy) = (x.coordinate - receiver.x, y.coordinate - receiver.y);
                if dx * dx + dy * dy > reach * reach {
                    continue;
                }
                plane.set_product(&x.factor, &y.factor, 1.0);
                for z in zs.iter().filter(|z| x.cost + y.cost + z.cost <= self.chains.limit) {
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

/// Images along one axis with walls at `ends`, each with its factors and cost: order |n|, the n-th towards positive or negative coordinates.
fn axis_images(limit: u32, source: f64, ends: [f64; 2], walls: [(&[Lanes], u32); 2]) -> Vec<AxisImage> {
    let (length, inside) = (ends[1] - ends[0], source - ends[0]);
    let images = |sign: i64| {
        (0..).map(move |order| sign * order).map(|n: i64| {
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
                cost: low_hits * walls[0].1 + high_hits * walls[1].1,
                sign: if inverted { -1.0 } else { 1.0 },
                factor: wall_factor(walls.map(|(factor, _)| factor), [low_hits, high_hits]),
            }
        })
    };
    let within = |sign| images(sign).take_while(|image| image.cost <= limit);
    let mut images: Vec<AxisImage> = within(-1).collect();
    images.reverse();
    images.extend(within(1).skip(1));
    images
}

fn wall_factor(walls: [&[Lanes]; 2], hits: [u32; 2]) -> Vec<Lanes> {
    let mut factor = vec![Lanes::ONE; walls[0].len()];
    for (wall, hits) in walls.into_iter().zip(hits) {
        (0..hits).for_each(|_| factor.multiply(wall));
    }
    factor
}
