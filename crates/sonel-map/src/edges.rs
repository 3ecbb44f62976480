//! Edges that bend packets, and what passing one means to every band.
//!
//! A packet led by band k that passes an edge at the distance b is bent where b is within the band's reach, at most [`REACH_WAVELENGTHS`] of its wavelengths, by an
//! angle with the density of [`sonel_diffraction::bending`]; else it goes straight on. Bands share paths as they do at
//! surfaces (docs/physics.md §2): what band j does to its energy is what a packet led by it would do, f_j = p_j, so a
//! bend keeps the energy of a band over all angles, and a band that would not have taken the way has none there.
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use glam::DVec3;
pub use sonel_diffraction::bending::REACH as REACH_WAVELENGTHS;
use sonel_diffraction::bending::{concentration, tangent};
use sonel_geometry::{EdgeIndex, EdgeLine, Geometry};

use crate::coefficients::{Lanes, to_lanes};
use crate::format::EdgeRow;
use crate::header::{BENDING, MapHeader};
use crate::vertex::EdgePlace;

/// Least angle of the air about an edge that bends [rad], five quarters of π: what is blunter shades hardly more than a
/// wall that is not quite flat, but would be passed at every step along a pillar of many sides.
const BLUNTEST: f64 = 1.25 * core::f64::consts::PI;

/// The edges of `geometry` that bend, in the order in which vertices name them.
#[must_use]
pub fn bending_edges(geometry: &Geometry) -> EdgeIndex {
    EdgeIndex::new(geometry, |edge| edge.sectors.iter().any(|sector| sector.angle >= BLUNTEST))
}

/// The largest reach of bands of the given `wavelengths` [m]: beyond it an edge turns nothing by as much as a degree.
#[must_use]
pub fn whole_reach(wavelengths: &[f64]) -> Vec<f64> {
    wavelengths.iter().map(|wavelength| REACH_WAVELENGTHS * wavelength).collect()
}

/// What passing edges means to the bands.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeTable {
    lines: Vec<EdgeLine>,
    /// Largest distance at which each band is bent [m]; below zero for bands that never are.
    reach: Vec<Lanes>,
    /// Of the density of the angle, see [`concentration`] [1/m].
    concentration: Vec<Lanes>,
    /// Natural logarithm of it.
    log_concentration: Vec<Lanes>,
}

impl EdgeTable {
    /// Edges along `lines` for bands of the given `wavelengths` [m], each bent up to its `reach` [m] and not at all where that is zero.
    #[must_use]
    pub fn new(lines: Vec<EdgeLine>, wavelengths: &[f64], reach: &[f64]) -> Self {
        let reach = reach.iter().map(|&reach| if reach > 0.0 { reach } else { -1.0 });
        let concentration: Vec<f64> = wavelengths.iter().map(|&length| concentration(length)).collect();
        Self {
            lines,
            reach: to_lanes(reach),
            log_concentration: to_lanes(concentration.iter().map(|&c| libm::log(c))),
            concentration: to_lanes(concentration),
        }
    }

    /// The largest distance at which any band of those with `energy` is bent [m]; below zero where none is.
    #[must_use]
    pub fn reach(&self, energy: &[Lanes]) -> f64 {
        let mut reach = -1.0_f64;
        for (energy, of_band) in energy.iter().zip(&self.reach) {
            for lane in 0..4 {
                reach = reach.max(if energy[lane] > 0.0 { of_band[lane] } else { -1.0 });
            }
        }
        reach
    }

    /// How far from edges `band` is bent [m]; below zero where nowhere.
    #[must_use]
    pub fn reach_of(&self, band: usize) -> f64 {
        self.reach[band / 4][band % 4]
    }

    /// Whether `band` is bent at `distance` from an edge [m].
    #[inline]
    #[must_use]
    pub fn bends(&self, band: usize, distance: f64) -> bool {
        distance <= self.reach[band / 4][band % 4]
    }

    /// The tangent of the angle by which a packet led by `band` is bent at `distance` [m], for a `normal` number.
    #[must_use]
    pub fn tangent(&self, band: usize, distance: f64, normal: f64) -> f64 {
        tangent(normal, self.concentration(band), distance)
    }

    /// 2k/γ of `band` [1/m], see [`mod@sonel_diffraction::bending`].
    #[must_use]
    pub fn concentration(&self, band: usize) -> f64 {
        self.concentration[band / 4][band % 4]
    }

    /// The line of an edge.
    #[inline]
    #[must_use]
    pub fn line(&self, edge: u32) -> &EdgeLine {
        &self.lines[edge as usize]
    }

    /// Where a packet that comes from `from` passes an edge at `place`, about the scene's centre [m].
    #[inline]
    #[must_use]
    pub fn foot(&self, from: DVec3, edge: u32, place: &EdgePlace) -> DVec3 {
        self.line(edge).foot(from, f64::from(place.along), f64::from(place.distance), place.side)
    }

    /// For every band the density of the angle in passing at `place`, relative to the largest of all bands': zero where the
    /// band goes straight on.
    pub(crate) fn bent(&self, place: &EdgePlace, factors: &mut [Lanes]) {
        let distance = f64::from(place.distance);
        let slant = distance * f64::from(place.tangent);
        let mut largest = f64::NEG_INFINITY;
        for (index, factor) in factors.iter_mut().enumerate() {
            for lane in 0..4 {
                let normal = self.concentration[index][lane] * slant;
                factor[lane] = if distance <= self.reach[index][lane] {
                    self.log_concentration[index][lane] - 0.5 * normal * normal
                } else {
                    f64::NEG_INFINITY
                };
                largest = largest.max(factor[lane]);
            }
        }
        for factor in factors.iter_mut().flatten() {
            *factor = if *factor > f64::NEG_INFINITY { libm::exp(*factor - largest) } else { 0.0 };
        }
    }

    /// Takes from `energy` what is bent at `distance` from an edge [m].
    #[inline]
    pub fn keep_straight(&self, distance: f64, energy: &mut [Lanes]) {
        for (energy, reach) in energy.iter_mut().zip(&self.reach) {
            for lane in 0..4 {
                energy[lane] = if distance <= reach[lane] { 0.0 } else { energy[lane] };
            }
        }
    }

    /// For every band 1 where it goes straight on at `place`, 0 where it is bent.
    pub(crate) fn straight(&self, place: &EdgePlace, factors: &mut [Lanes]) {
        for (factor, reach) in factors.iter_mut().zip(&self.reach) {
            for lane in 0..4 {
                factor[lane] = if f64::from(place.distance) <= reach[lane] { 0.0 } else { 1.0 };
            }
        }
    }
}

/// The rows of the edges of `geometry` that bend.
pub(crate) fn rows(geometry: &Geometry) -> Vec<EdgeRow> {
    let world = |point: DVec3| (point + geometry.center()).to_array();
    let row = |line: &EdgeLine| EdgeRow { ends: [world(line.origin), world(line.point(line.length))] };
    bending_edges(geometry).lines().iter().map(row).collect()
}

/// The lines of `rows` about `center`.
pub(crate) fn lines(rows: &[EdgeRow], center: DVec3) -> Vec<EdgeLine> {
    rows.iter().map(|row| EdgeLine::new(row.ends.map(|end| DVec3::from_array(end) - center))).collect()
}

/// Length of an edge [m].
pub(crate) fn length(row: &EdgeRow) -> f64 {
    let [from, to] = row.ends.map(DVec3::from_array);
    from.distance(to)
}

/// Whether the rows can be edges; the reason where not.
pub(crate) fn check_rows(rows: &[EdgeRow]) -> Result<(), String> {
    let is_sound = |row: &EdgeRow| length(row).is_finite() && length(row) > 0.0;
    match rows.iter().position(|row| !is_sound(row)) {
        Some(edge) => Err(format!("edge {edge} has no two ends")),
        None => Ok(()),
    }
}

/// Whether `header` says of each of its `bands` how far from edges it is bent; the reason where not.
pub(crate) fn check_reach(header: &MapHeader, bands: usize) -> Result<(), String> {
    let Some(bending) = header.effects.iter().find(|effect| effect.name == BENDING) else { return Ok(()) };
    if !bending.on.contains(&true) {
        let nothing = bending.reach.iter().all(|&reach| reach == 0.0);
        return if nothing { Ok(()) } else { Err("edges have a reach, and no band is bent".to_owned()) };
    }
    let agrees = |(&on, &reach): (&bool, &f64)| reach.is_finite() && reach >= 0.0 && (reach > 0.0) == on;
    if bending.on.len() != bands || bending.reach.len() != bands {
        return Err("not one state and one reach of bending per band".to_owned());
    }
    if !bending.on.iter().zip(&bending.reach).all(agrees) {
        return Err("bands are bent within a reach, or not and without any".to_owned());
    }
    Ok(())
}

/// Whether the rows are those of `geometry`, within what its positions can tell apart; the first difference where not.
pub(crate) fn compare(rows: &[EdgeRow], geometry: &Geometry) -> Result<(), String> {
    let ours = self::rows(geometry);
    if rows.len() != ours.len() {
        return Err(format!("it has {} edges that bend, here are {}", rows.len(), ours.len()));
    }
    let resolution = f64::from(geometry.resolution());
    let is_same = |(theirs, ours): (&EdgeRow, &EdgeRow)| {
        theirs
            .ends
            .as_flattened()
            .iter()
            .zip(ours.ends.as_flattened())
            .all(|(a, b)| (a - b).abs() <= resolution)
    };
    match rows.iter().zip(&ours).position(|pair| !is_same(pair)) {
        Some(edge) => Err(format!("edge {edge} is another one")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_diffraction::bending::density;
    use sonel_geometry::Side;

    fn table() -> EdgeTable {
        EdgeTable::new(
            vec![EdgeLine::new([DVec3::ZERO, DVec3::Z])],
            &[1.0, 0.5, 0.1, 1.0],
            &[5.0, 2.5, 0.5, 0.0],
        )
    }

    fn place(distance: f32, tangent: f32) -> EdgePlace {
        EdgePlace { along: 0.5, distance, tangent, side: Side::Front }
    }

    #[test]
    fn bends_weigh_bands_by_their_densities() {
        let table = table();
        for (distance, tangent) in [(0.3_f32, 0.05_f32), (1e-3, -40.0), (0.49, 0.3)] {
            let mut factors = [[0.0; 4]];
            table.bent(&place(distance, tangent), &mut factors);
            let density =
                |band: usize| density(f64::from(tangent), table.concentration[0][band], f64::from(distance));
            for band in [1, 2] {
                let expected = density(band) / density(0);
                assert!((factors[0][band] / factors[0][0] / expected - 1.0).abs() < 1e-9);
            }
            assert_eq!((factors[0][3], factors[0].iter().copied().fold(0.0, f64::max)), (0.0, 1.0));
        }
    }

    #[test]
    fn out_of_reach_of_a_band_it_goes_straight_on() {
        let table = table();
        let mut factors = [[9.0; 4]];
        table.bent(&place(2.0, 0.1), &mut factors);
        assert_eq!(factors, [[factors[0][0], factors[0][1], 0.0, 0.0]]);
        table.straight(&place(2.0, 0.0), &mut factors);
        assert_eq!(factors, [[0.0, 0.0, 1.0, 1.0]]);
        assert!((table.reach(&[[1.0, 0.0, 1.0, 1.0]]) - 5.0).abs() < 1e-12);
        assert!((table.reach(&[[0.0, 0.0, 1.0, 1.0]]) - 0.5).abs() < 1e-12);
        assert!(table.reach(&[[0.0, 0.0, 0.0, 1.0]]) < 0.0);
    }
}
