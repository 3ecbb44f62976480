//! What lies between the last vertex of a path and a receiver.

use crate::exact::mirror::chains::Chains;
use glam::Vec3;
use sonel_geometry::{Departure, Geometry};
use sonel_map::{CoefficientTable, Lanes};

use crate::air::AirTable;
use crate::deposit::TimeBins;
use crate::partition::Partitions;
use crate::receiver::PreparedReceiver;
use crate::regions::Airs;

/// Medium between a sonel and a receiver.
#[derive(Clone, Copy)]
pub(crate) struct Medium<'a> {
    /// Walls.
    pub geometry: &'a Geometry,
    /// Coefficients of the surfaces.
    pub table: &'a CoefficientTable,
    /// Chains of mirrors over which receivers have images.
    pub chains: &'a Chains,
    /// Time bins.
    pub bins: &'a TimeBins,
    /// Attenuation, in every air, of the energies that packets carry.
    pub air: &'a AirTable,
    /// The airs.
    pub airs: &'a Airs,
}

impl Medium<'_> {
    /// Makes `energy` that comes to `receiver`, straight over the last `length` times c₀/c [m], the receiver's, but for what every air takes.
    #[inline]
    pub(crate) fn receive(&self, receiver: &PreparedReceiver, length: f64, energy: &mut [Lanes]) {
        self.airs.receive(receiver.air, length, energy);
    }

    /// Partitions on a straight path; [`None`] where it is blocked.
    #[inline]
    #[must_use]
    pub(crate) fn partitions(&self, from: Departure, to: Vec3) -> Option<Partitions> {
        Partitions::between(self.geometry, self.table, from, to)
    }
}
