//! Modes of a room that are of order zero between two of its walls [Kuttruff2009].
//!
//! Modes of other orders have twice their mean energy at a wall that reflects, those of order zero the same everywhere between the two: they lose half
//! as much there. Their share is that of a box, counted to all powers of the wavelength that a count of points in a lattice has.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

/// n nᵀ of a unit normal. Summed over the walls of a room with their areas, over twice its volume, it is the `walls` of [`spared`] [1/m].
pub fn facing(normal: DVec3) -> DMat3 {
    DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z)
}

/// Sum of the diagonal.
pub fn trace(matrix: DMat3) -> f64 {
    matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
}

/// What `walls` [1/m] absorb less of the modes at a `wavelength` [m] than of rays, of what these lose [1]: p/2, with p the mean over the walls of
/// the share of modes that are of order zero across them.
pub fn spared(walls: DMat3, wavelength: f64) -> f64 {
    let [one, two, three] = [walls, walls * walls, walls * walls * walls].map(trace);
    let of_zero = 0.5 * wavelength * (two + wavelength / TAU * (one * two - three));
    let of_all = one + 0.25 * wavelength * (one * one + wavelength / TAU * 0.5 * one * (one * one - two));
    if one > 0.0 { 0.5 * (of_zero / of_all).min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Modes of a box in an octave, counted one by one: their mean loss, of those that have waves along all axes.
    #[test]
    fn what_walls_spare_is_that_of_modes_counted_one_by_one() {
        let size = DVec3::new(7.1, 5.3, 3.9);
        let walls = DMat3::from_diagonal(size.recip());
        for (wavelength, within) in [(1.0, 0.02), (2.0, 0.03), (4.0, 0.1)] {
            let orders = |axis: usize| (0..(3.0 * size[axis] / wavelength) as u32 + 1).map(f64::from);
            let triples = orders(0)
                .flat_map(|x| orders(1).flat_map(move |y| orders(2).map(move |z| DVec3::new(x, y, z))));
            let in_octave =
                |order: &DVec3| (0.707..1.414).contains(&(0.5 * wavelength * (order / size).length()));
            let lost = triples.filter(in_octave).map(|order| {
                let at_wall = DVec3::select(order.cmpeq(DVec3::ZERO), DVec3::splat(0.5), DVec3::ONE);
                (at_wall / size).element_sum() / size.recip().element_sum()
            });
            let lost: Vec<f64> = lost.collect();
            let mean = lost.iter().sum::<f64>() / lost.len() as f64;
            let found = 1.0 - spared(walls, wavelength);
            assert!(
                (found / mean - 1.0).abs() < within,
                "{found} for {mean} of {} modes, λ {wavelength} m",
                lost.len()
            );
            assert!(within > 0.09 || 1.0 - mean > 2.0 * within, "{mean} is told from rays");
        }
    }
}
