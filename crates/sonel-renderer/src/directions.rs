//! Energies of a receiver by direction of incidence, summed where directions are requested.
//!
//! With u the unit vector from the receiver to where sound comes from and a its lateral axis, everything that brings the energy e also
//! brings e (a·u)², e |a·u| and e u: the energy of a figure-of-eight microphone across the aim, the product of its pressure with that of an
//! omnidirectional one, and the moment of first order. LF, LFC and the late lateral level are ratios of them. Sound
//! over several edges at once counts from the direction of its shortest way.
//!
//! References: [ISO3382-1] annex A (docs/references.md).

use glam::DVec3;

/// Columns of echograms that belong to one receiver, its energy first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Columns {
    /// In fine bins.
    pub fine: usize,
    /// Columns of the batches: the moments have none.
    pub coarse: usize,
}

impl Columns {
    /// Energy alone.
    pub const PLAIN: Self = Self { fine: 1, coarse: 1 };
    /// Energy, times (a·u)², times |a·u|, times each component of u.
    pub const DIRECTED: Self = Self { fine: 6, coarse: 3 };
    /// The first of the components of u.
    pub const MOMENT: usize = Self::DIRECTED.coarse;
}

/// Lateral axes of receivers, unit vectors; none where no directions are asked for.
#[derive(Debug, Clone, Default)]
pub(crate) struct Axes(Vec<DVec3>);

impl Axes {
    /// Lateral axes of receivers, or no directions.
    pub(crate) fn of(axes: impl IntoIterator<Item = Option<DVec3>>) -> Self {
        Self(axes.into_iter().flatten().collect())
    }

    /// Columns of each receiver.
    #[inline]
    pub(crate) fn columns(&self) -> Columns {
        if self.0.is_empty() { Columns::PLAIN } else { Columns::DIRECTED }
    }

    /// Weights of all columns but the first, of sound that comes to `receiver` from `towards`, of any length; none without directions.
    #[inline]
    pub(crate) fn weights(
        &self,
        receiver: usize,
        towards: DVec3,
    ) -> Option<[f64; Columns::DIRECTED.fine - 1]> {
        let axis = self.0.get(receiver)?;
        let towards = towards.normalize_or_zero();
        let cosine = axis.dot(towards);
        Some([cosine * cosine, cosine.abs(), towards.x, towards.y, towards.z])
    }
}

/// The lateral axis: horizontal and at right angles to `aim`, with `up` a unit vector. [`None`] where the aim is vertical.
#[must_use]
pub(crate) fn lateral_axis(aim: DVec3, up: DVec3) -> Option<DVec3> {
    /// Sine of the angle to the vertical up to which an aim has no lateral axis: 0.06°, less than an aim is known to.
    const VERTICAL: f64 = 1e-3;
    let across = up.cross(aim.normalize_or_zero());
    (across.length() > VERTICAL).then(|| across.normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lateral_axis_is_horizontal_and_across_the_aim() {
        let axis = lateral_axis(DVec3::new(1.0, 0.0, -3.0), DVec3::Z).unwrap();
        assert!((axis - DVec3::Y).length() < 1e-15);
        assert_eq!(lateral_axis(DVec3::NEG_Z, DVec3::Z), None);
        assert_eq!(lateral_axis(DVec3::ZERO, DVec3::Z), None);
    }

    #[test]
    fn weights_are_those_of_a_figure_of_eight_and_the_direction() {
        let axes = Axes::of([Some(DVec3::Y)]);
        let weights = axes.weights(0, DVec3::new(0.0, -6.0, 8.0)).unwrap();
        for (weight, expected) in weights.into_iter().zip([0.36, 0.6, 0.0, -0.6, 0.8]) {
            assert!((weight - expected).abs() < 1e-15, "{weights:?}");
        }
        assert_eq!(Axes::of([None]).weights(0, DVec3::Y), None);
    }
}
