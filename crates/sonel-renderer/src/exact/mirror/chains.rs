//! Which chains of mirrors are enumerated: those that cost no more than a limit together, be it in number or in loss.

use sonel_geometry::{Geometry, Shoebox, SurfaceId};
use sonel_map::{BandValues, CoefficientTable};

/// A mirror loses at least so much [0.01 dB], so that chains end in a room without absorption.
const LEAST_LOSS: f64 = 10.0;
/// A mirror loses at most so much [0.01 dB]: more than any chain may.
const MOST_LOSS: f64 = 10_000.0;

/// Chains of mirrors whose costs do not exceed a limit.
#[derive(Debug, Clone)]
pub(crate) struct Chains {
    /// Of the mirror in each surface.
    costs: Vec<u32>,
    /// Largest sum.
    pub limit: u32,
}

impl Chains {
    /// Chains of up to `order` mirrors.
    #[must_use]
    pub(crate) fn by_order(geometry: &Geometry, order: u32) -> Self {
        Self { costs: vec![1; geometry.surfaces().len()], limit: order }
    }

    /// The chains of an empty `room` that lose least, in hundredths of a decibel: about so many `images` and no more than `most` [0.01 dB]
    /// in the strongest band. Flutter between two hard walls is followed to any order, while chains over soft ones end soon.
    #[must_use]
    pub(crate) fn by_loss(
        geometry: &Geometry,
        room: &Shoebox,
        table: &CoefficientTable,
        (images, most): (f64, f64),
    ) -> Self {
        let loss = |energy: f64| (-1000.0 * libm::log10(energy)).clamp(LEAST_LOSS, MOST_LOSS);
        let surfaces = geometry.surfaces().iter();
        let losses: Vec<f64> =
            surfaces.map(|it| loss(table.material(it.material).specular.energy.largest())).collect();
        let along = |axis: usize| [0, 1].map(|end| losses[room.walls[2 * axis + end].0 as usize]);
        let means = [0, 1, 2].map(|axis| along(axis).iter().sum::<f64>() / 2.0);
        // Images within a loss Λ fill an octahedron of half-axes Λ over the mean loss along each axis, or a rhombus where one axis has next to none.
        let [x, y, z] = means;
        let flat = libm::sqrt(0.5 * images * (x * y).min(y * z).min(z * x));
        let limit = libm::cbrt(0.75 * images * (x * y * z)).min(flat).min(most);
        Self { costs: losses.iter().map(|&loss| libm::ceil(loss) as u32).collect(), limit: limit as u32 }
    }

    /// Mirrors of the longest chains.
    #[must_use]
    pub(crate) fn order(&self) -> u32 {
        self.limit / self.costs.iter().min().copied().unwrap_or(1)
    }

    /// What mirrors cost that cost `run` before the one in `surface`.
    #[must_use]
    pub(crate) fn after(&self, run: u32, surface: SurfaceId) -> u32 {
        run.saturating_add(self.cost(surface))
    }

    /// What the mirror in `surface` costs.
    #[must_use]
    pub(crate) fn cost(&self, surface: SurfaceId) -> u32 {
        self.costs[surface.0 as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::Material;
    use sonel_geometry::Mesh;

    /// Highest orders of mirrors in the walls x = 0 and y = 0 alone, where those along x mirror `hard` of the energy and all others `soft`.
    fn orders([hard, soft]: [f64; 2]) -> [u32; 2] {
        let room = Geometry::build(Mesh::shoebox([7.0, 5.0, 3.0], [0, 0, 1, 1, 1, 1])).unwrap();
        let walls = [hard, soft].map(|energy| Material::uniform("walls", 1.0 - energy, 0.0, 1));
        let table = CoefficientTable::new(&walls, 1, 0.0).with_geometry(&room);
        let shoebox = room.as_shoebox().unwrap();
        let chains = Chains::by_loss(&room, &shoebox, &table, (44_000.0, 4000.0));
        [0, 2].map(|wall: usize| chains.limit / chains.cost(shoebox.walls[wall]))
    }

    #[test]
    fn hard_walls_are_followed_to_higher_orders_than_soft_ones() {
        assert_eq!(orders([0.8, 0.8]), [32, 32]);
        assert_eq!(orders([0.95, 0.2]), [173, 5]);
        assert_eq!(orders([0.5, 0.0]), [13, 0]);
        assert_eq!(orders([0.0, 1.0]), [0, 148], "two axes share the images");
        assert!(orders([1.0, 1.0]).into_iter().all(|order| (30..=33).contains(&order)));
    }
}
