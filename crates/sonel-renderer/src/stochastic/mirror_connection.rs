//! … D S^k R in an empty box, over chains of mirrors that lose little: from every sonel a connection to one of the receiver's mirror images,
//! chosen at random.
//!
//! F += e · δ · cos θ / (π d²) · ∏ (1−α)(1−s) · e^(−m·length) / P(image), with d to the image (docs/physics.md §4). Choosing one
//! image a sonel costs one connection more, however many images there are; a map holds so many sonels that the choice
//! hardly adds to the noise. Images are chosen in proportion to what they can be expected to bring: their mirrors' energy
//! times the solid angle in which they are seen.

use glam::DVec3;
use sonel_geometry::{Geometry, Shoebox};
use sonel_map::{BandValues, CoefficientTable, Lanes};

use crate::exact::mirror::chains::Chains;
use crate::exact::mirror::lattice::ImageLattice;
use crate::exact::mirror::{LatticeImage, lattice_room};
use crate::receiver::{PreparedReceiver, Sensitivity};
use crate::stochastic::alias::AliasTable;
use crate::stochastic::connection::DiffuseSonel;
use crate::stochastic::estimate::{Arriving, Deposit};

/// Most mirrors of a chain where they are not ranked by their losses.
const ORDER_LIMIT: u32 = 32;
/// About how many images of one receiver in an empty box, and what they lose at most in the strongest band [0.01 dB]: what is beyond lies below the
/// end of T30, but is noisy. In a flat room a quarter as many left 0.2 % of the energy to spheres, and with it most of the variance of T30.
const LATTICE_LIMITS: (f64, f64) = (44_000.0, 4000.0);

/// The images of one receiver and how they are chosen.
#[derive(Debug)]
pub(crate) struct ReceiverImages {
    /// [`PreparedReceiver::brightest`].
    brightest: f64,
    sensitivity: Sensitivity,
    images: Vec<LatticeImage>,
    /// 1 / P(image).
    inverse_probability: Vec<f64>,
    choice: AliasTable,
}

/// The chains over which receivers have images, where the highest order of image sources was `asked` for.
#[must_use]
pub(crate) fn image_chains(geometry: &Geometry, table: &CoefficientTable, asked: Option<u32>) -> Chains {
    match lattice_room(geometry, table).filter(|_| asked.is_none()) {
        Some(room) => Chains::by_loss(geometry, &room, table, LATTICE_LIMITS),
        None => Chains::by_order(geometry, ORDER_LIMIT),
    }
}

impl ReceiverImages {
    /// The images of `receiver` in an empty `room` over `chains`. [`None`] without any.
    #[must_use]
    pub(crate) fn new(
        geometry: &Geometry,
        (room, chains): (&Shoebox, &Chains),
        table: &CoefficientTable,
        receiver: &PreparedReceiver,
    ) -> Option<Self> {
        let images = ImageLattice::new(geometry, room, table, receiver.exact, chains.clone()).images();
        let weights = weights(geometry, &images, receiver.exact);
        let total: f64 = weights.iter().sum();
        (total > 0.0).then(|| Self {
            brightest: receiver.brightest,
            sensitivity: receiver.sensitivity,
            inverse_probability: weights.iter().map(|weight| total / weight).collect(),
            choice: AliasTable::new(&weights),
            images,
        })
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
        let length = squared.sqrt();
        let Some(bin) = medium.bins.bin(sonel.length + length) else { return };
        let towards = -offset * image.signs;
        // What is brighter than the receiver's limit is left to its rays.
        let solid_angle = (projected / (length * squared)).min(self.brightest);
        let weight = solid_angle * self.inverse_probability[index] * self.sensitivity.to(towards);
        scratch.set_product(sonel.radiosity, &image.factor, weight);
        let towards = first.unwrap_or(towards);
        deposit.add(Arriving { receiver, towards, length, bin }, scratch);
    }
}

/// What images bring, up to a factor: its mirrors' energy times the solid angle under which the room is seen from
/// it. A room of surface S looks from afar like a body of the mean projection S/4, and fills all directions from inside:
/// S/4 / (D² + S/(16π)), D the distance of the image from the receiver.
fn weights(geometry: &Geometry, images: &[LatticeImage], receiver: DVec3) -> Vec<f64> {
    let inside = geometry.area() / (16.0 * core::f64::consts::PI);
    let weight = |image: &LatticeImage| {
        image.factor.values().sum::<f64>() / (image.position.distance_squared(receiver) + inside)
    };
    images.iter().map(weight).collect()
}
