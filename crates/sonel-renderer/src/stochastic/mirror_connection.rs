//! … D S^k R over chains of mirrors that lose little: from every sonel a connection to one of the receiver's mirror images, chosen at random.
//!
//! F += e · δ · cos θ / (π d²) · ∏ (1−α)(1−s) · e^(−m·length) / P(image), with d to the image (docs/physics.md §4). Choosing one
//! image a sonel costs one connection more, however many images there are; a map holds so many sonels that the choice
//! hardly adds to the noise. Images are chosen in proportion to what they can be expected to bring: their mirrors' energy
//! times the solid angle in which they are seen, which in an empty box falls with the square of the distance and
//! elsewhere is found by following rays from the receiver. A share of the choices ignores these rays, so that an image
//! they missed is chosen too: the estimate stays unbiased.

use glam::DVec3;
use sonel_geometry::{Departure, End, Geometry};
use sonel_map::{BandValues, CoefficientTable, Lanes};
use sonel_sampling::{ScrambledSobol, warp};

use crate::exact::mirror::Image;
use crate::exact::mirror::chains::Chains;
use crate::exact::mirror::lattice::ImageLattice;
use crate::exact::mirror::tree::{ImageTree, Seed};
use crate::receiver::{PreparedReceiver, Sensitivity};
use crate::stochastic::alias::AliasTable;
use crate::stochastic::connection::DiffuseSonel;
use crate::stochastic::estimate::{Arriving, Deposit};

/// Most mirrors of a chain where they are not ranked by their losses.
const ORDER_LIMIT: u32 = 32;
/// About how many images of one receiver in an empty box, and what they lose at most in the strongest band [0.01 dB]: what is beyond lies below the
/// end of T30, but is noisy. In a flat room a quarter as many left 0.2 % of the energy to spheres, and with it most of the variance of T30.
const LATTICE_LIMITS: (f64, f64) = (44_000.0, 4000.0);
/// Most surfaces of a geometry whose images are connected; in others most images are hidden from most sonels and visibility rays serve.
/// Chosen, not measured; doubled, rooms of up to 128 surfaces are connected.
const SURFACE_LIMIT: usize = 64;
/// Most images of one receiver. Chosen, not measured: each takes some of the [`PILOT_RAYS`] to weigh; doubled, chains may be longer.
const NODE_LIMIT: usize = 10_000;
/// Rays that measure in which solid angle a receiver sees its images: one that is seen by 1 % of them is known within 16 % (binomial standard
/// error).
const PILOT_RAYS: u32 = 4096;
/// Share of the choices that do not rely on those rays: an image that they missed weighs at most ten times as much as by these alone.
const BLIND_SHARE: f64 = 0.1;

/// The images of one receiver and how they are chosen.
#[derive(Debug)]
pub(crate) struct ReceiverImages {
    /// [`PreparedReceiver::brightest`].
    brightest: f64,
    sensitivity: Sensitivity,
    images: Vec<Image>,
    /// 1 / P(image).
    inverse_probability: Vec<f64>,
    choice: AliasTable,
    /// Largest cost of a chain.
    limit: u32,
    /// Mirrors to be checked; none in an empty box, where every image in front of a surface is seen from it.
    tree: Option<ImageTree>,
}

/// The chains over which receivers of a scene, and sources next to them, have images, where the highest order of image sources was `asked` for.
#[must_use]
pub(crate) fn image_chains(geometry: &Geometry, table: &CoefficientTable, asked: Option<u32>) -> Chains {
    // The factor of an image of a receiver would depend on the sonel.
    if table.is_angular() {
        return Chains::by_order(geometry, 0);
    }
    match geometry.as_shoebox() {
        Some(room) if asked.is_none() => Chains::by_loss(geometry, &room, table, LATTICE_LIMITS),
        _ if geometry.surfaces().len() <= SURFACE_LIMIT => Chains::by_order(geometry, ORDER_LIMIT),
        _ => Chains::by_order(geometry, 0),
    }
}

impl ReceiverImages {
    /// The images of `receiver` over `chains`, all of which a general geometry may not reach. [`None`] without any.
    #[must_use]
    pub(crate) fn new(
        geometry: &Geometry,
        table: &CoefficientTable,
        receiver: &PreparedReceiver,
        chains: &Chains,
    ) -> Option<Self> {
        if chains.limit == 0 {
            return None;
        }
        let (images, weights, tree) = match geometry.as_shoebox() {
            Some(room) => {
                let images =
                    ImageLattice::new(geometry, &room, table, receiver.exact, chains.clone()).images();
                let weights = weights_without_visibility(geometry, &images, receiver.exact);
                (images, weights, None)
            }
            None => {
                let most = Some(chains.limit);
                let seed = Seed::new(geometry, table, receiver.exact, End::Source, NODE_LIMIT, most);
                let tree = ImageTree::new(geometry, seed);
                let images = tree.images(table);
                let weights = pilot_weights(geometry, &tree, &images, receiver.exact);
                (images, weights, Some(tree))
            }
        };
        let total: f64 = weights.iter().sum();
        (total > 0.0).then(|| Self {
            brightest: receiver.brightest,
            sensitivity: receiver.sensitivity,
            inverse_probability: weights.iter().map(|weight| total / weight).collect(),
            choice: AliasTable::new(&weights),
            images,
            limit: tree.as_ref().map_or(chains.limit, ImageTree::order),
            tree,
        })
    }

    /// The largest cost of a chain over which it has images.
    #[must_use]
    pub(crate) fn limit(&self) -> u32 {
        self.limit
    }

    /// Connects `sonel` to the image that the uniform number `choice` selects. `receiver` is its number in `deposit`; sound comes to it from
    /// `first`, or from where the way over the image ends.
    #[inline]
    pub(crate) fn connect(
        &self,
        sonel: &DiffuseSonel<'_>,
        (receiver, first): (usize, Option<DVec3>),
        choice: f64,
        scratch: &mut [Lanes],
        deposit: &mut Deposit<'_, '_>,
    ) {
        let medium = deposit.medium;
        let index = self.choice.choose(choice);
        let image = &self.images[index];
        let from = sonel.position.as_dvec3();
        let offset = image.position - from;
        let projected = offset.dot(sonel.normal.as_dvec3());
        if projected <= 0.0 {
            return;
        }
        let squared = offset.length_squared();
        let distance = squared.sqrt();
        let length = sonel.length + distance;
        let Some(bin) = medium.bins.bin(length) else { return };
        let towards = match &self.tree {
            None => -offset * image.signs,
            Some(tree) => {
                // From off the surface: rounding may put a sonel behind it, where a way leads under the foot of a wall.
                let Departure { origin, plane } = sonel.departure;
                let Some(towards) = tree.connect(medium.geometry, index, origin.as_dvec3(), plane) else {
                    return;
                };
                towards
            }
        };
        // What is brighter than the receiver's limit is left to its rays.
        let solid_angle = (projected / (distance * squared)).min(self.brightest);
        let weight = solid_angle * self.inverse_probability[index] * self.sensitivity.to(towards);
        scratch.set_product(sonel.radiosity, &image.factor, weight);
        let towards = first.unwrap_or(towards);
        deposit.add(Arriving { receiver, towards, length, bin }, scratch);
    }
}

/// What an image brings if nothing hides it, up to a factor: its mirrors' energy times the solid angle under which the room is seen from
/// it. A room of surface S looks from afar like a body of the mean projection S/4, and fills all directions from inside:
/// S/4 / (D² + S/(16π)), D the distance of the image from the receiver.
fn weights_without_visibility(geometry: &Geometry, images: &[Image], receiver: DVec3) -> Vec<f64> {
    let inside = geometry.area() / (16.0 * core::f64::consts::PI);
    let weight =
        |image: &Image| mirrored_energy(image) / (image.position.distance_squared(receiver) + inside);
    images.iter().map(weight).collect()
}

fn mirrored_energy(image: &Image) -> f64 {
    image.factor.values().sum()
}

/// What an image brings as seen by rays from the receiver, with a share of [`weights_without_visibility`].
fn pilot_weights(geometry: &Geometry, tree: &ImageTree, images: &[Image], receiver: DVec3) -> Vec<f64> {
    let mut seen = vec![0.0; images.len()];
    let directions = ScrambledSobol::numbered(0, 0, 0);
    for ray in 0..PILOT_RAYS {
        let direction = warp::uniform_sphere(directions.point(ray)).as_dvec3();
        tree.follow(geometry, direction, |image| seen[image] += mirrored_energy(&images[image]));
    }
    let blind = weights_without_visibility(geometry, images, receiver);
    let (seen_total, blind_total) = (seen.iter().sum::<f64>(), blind.iter().sum::<f64>());
    if seen_total <= 0.0 || blind_total <= 0.0 {
        return blind;
    }
    seen.iter()
        .zip(&blind)
        .map(|(seen, blind)| (1.0 - BLIND_SHARE) * seen / seen_total + BLIND_SHARE * blind / blind_total)
        .collect()
}
