//! Edges that bend packets: factors f and densities p of every band at a passed edge.
//!
//! A packet led by band k that passes an edge at the distance b is bent where b is within the band's reach, at most [`REACH_WAVELENGTHS`] of its wavelengths, by an
//! angle with the density of [`sonel_diffraction::bending`]; else it goes straight on.
//!
//! An edge bends a band where one of its faces is at least [`LEAST_FACE`] wavelengths long and, as the packet sees it, deep: smaller objects and
//! plates seen edge-on cast no shadow ([`sonel_geometry::EdgeFaces`]). Where an angle would turn the packet so that it sees no such face any more, and the
//! opposite angle would not, it is turned by the opposite angle: else packets would gather edge-on to plates, from where nothing turns them.
//!
//! Bands share paths as they do at surfaces (docs/physics.md §2): what band j does to its energy is what a packet led by it would do,
//! f_j = p_j, so a bend keeps the energy of a band over all angles, and a band that would not have taken the way has none there.
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use glam::DVec3;
pub use sonel_diffraction::bending::REACH as REACH_WAVELENGTHS;
use sonel_diffraction::bending::{concentration, tangent};
use sonel_geometry::{EdgeFaces, EdgeIndex, EdgeLine, Geometry, Side};

use crate::format::{EdgeRow, FacesRow};
use crate::header::{BENDING, MapHeader};
use crate::lanes::{Lanes, to_lanes};
use crate::vertex::EdgePlace;

/// Least angle of the air about an edge that bends [rad], five quarters of π: what is blunter shades hardly more than a
/// wall that is not quite flat, but would be passed at every step along a pillar of many sides.
const BLUNTEST: f64 = 1.25 * core::f64::consts::PI;

/// Least depth and length of a face whose edge bends, in wavelengths.
pub const LEAST_FACE: f64 = 0.5;

/// The edges of `geometry` that bend any band of the given `wavelengths` [m], in the order in which vertices name them. Each is passed within
/// the largest reach of its bands.
#[must_use]
pub fn bending_edges(geometry: &Geometry, wavelengths: &[f64]) -> EdgeIndex {
    EdgeIndex::new(geometry, |edge, faces| {
        let size = faces.size();
        let bent = wavelengths.iter().filter(|&&wavelength| size >= LEAST_FACE * wavelength);
        let longest = bent.copied().fold(0.0, f64::max);
        let is_sharp = edge.sectors.iter().any(|sector| sector.angle >= BLUNTEST);
        (is_sharp && longest > 0.0).then_some(REACH_WAVELENGTHS * longest)
    })
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
    faces: Vec<EdgeFaces>,
    wavelengths: Vec<f64>,
    /// Largest distance at which each band is bent [m]; below zero for bands that never are.
    reach: Vec<Lanes>,
    /// Least size of a face at whose edge it is bent [m].
    least_face: Vec<Lanes>,
    /// Of the density of the angle, see [`concentration`] [1/m].
    concentration: Vec<Lanes>,
    /// Natural logarithm of it.
    log_concentration: Vec<Lanes>,
}

/// How large the faces of an edge are to a packet that passes it, see [`EdgeFaces::size_seen`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizesSeen {
    /// Before it is turned [m].
    pub before: f64,
    /// Behind, turned [m].
    turned: f64,
    /// Behind, if it were turned by the opposite angle [m].
    opposite: f64,
}

/// Where a packet passed an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passing {
    /// The closest point of the shortest distance, about the scene's centre [m].
    pub closest: DVec3,
    /// What is stored of it.
    pub place: EdgePlace,
    /// What it sees of the faces.
    pub seen: SizesSeen,
}

impl EdgeTable {
    /// Edges along `lines`, with `faces`, for bands of the given `wavelengths` [m], each bent up to its `reach` [m] and not at all where that is zero.
    #[must_use]
    pub fn new(lines: Vec<EdgeLine>, faces: Vec<EdgeFaces>, wavelengths: &[f64], reach: &[f64]) -> Self {
        let reach = reach.iter().map(|&reach| if reach > 0.0 { reach } else { -1.0 });
        let concentration: Vec<f64> = wavelengths.iter().map(|&length| concentration(length)).collect();
        Self {
            lines,
            faces,
            wavelengths: wavelengths.to_vec(),
            reach: to_lanes(reach),
            least_face: to_lanes(wavelengths.iter().map(|wavelength| LEAST_FACE * wavelength)),
            log_concentration: to_lanes(concentration.iter().map(|&c| libm::log(c))),
            concentration: to_lanes(concentration),
        }
    }

    /// The table of the edges of `index`.
    #[must_use]
    pub fn of(index: &EdgeIndex, wavelengths: &[f64], reach: &[f64]) -> Self {
        Self::new(index.lines().to_vec(), index.faces().to_vec(), wavelengths, reach)
    }

    /// Wavelengths at the centres of the bands [m].
    #[must_use]
    pub fn wavelengths(&self) -> &[f64] {
        &self.wavelengths
    }

    /// The largest distance at which any band of those with `energy` is bent by any edge [m]; below zero where none is.
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

    /// Whether faces of `size` [m] are large enough for their edge to bend `band`.
    #[inline]
    #[must_use]
    pub fn is_large(&self, band: usize, size: f64) -> bool {
        size >= self.least_face[band / 4][band % 4]
    }

    /// Whether `band` is bent at `distance` from an edge whose faces are of the `size` [m] as the packet sees them before.
    #[inline]
    #[must_use]
    pub fn bends(&self, band: usize, distance: f64, size: f64) -> bool {
        distance <= self.reach_of(band) && self.is_large(band, size)
    }

    /// Whether any band of those with `energy` is bent at the square of a distance [m²] from `edge` on a way in a unit `direction`.
    #[must_use]
    pub fn bends_any(&self, energy: &[Lanes], edge: u32, squared: f64, direction: DVec3) -> bool {
        let (distance, size) = (squared.sqrt(), self.faces[edge as usize].size_seen(direction));
        let carries = |band: &usize| energy[band / 4][band % 4] > 0.0;
        (0..self.wavelengths.len()).filter(carries).any(|band| self.bends(band, distance, size))
    }

    /// How often `band` takes the angle by which it is turned, relative to the density of the law: 1, or 2 where only this one of two opposite
    /// angles leaves it seeing a face that is large enough, or 0 where only the other does.
    #[inline]
    #[must_use]
    pub fn preference(&self, band: usize, seen: &SizesSeen) -> f64 {
        match (self.is_large(band, seen.turned), self.is_large(band, seen.opposite)) {
            (true, false) => 2.0,
            (false, true) => 0.0,
            _ => 1.0,
        }
    }

    /// The tangent of the angle by which a packet led by `band` is bent at `distance` [m], for a `normal` number, one of two opposite ones.
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

    /// The faces of an edge.
    #[inline]
    #[must_use]
    pub fn faces(&self, edge: u32) -> &EdgeFaces {
        &self.faces[edge as usize]
    }

    /// How a packet that comes from `from` passes an edge at `place`, about the scene's centre [m].
    #[must_use]
    pub fn passing(&self, from: DVec3, edge: u32, place: &EdgePlace) -> Passing {
        let (along, distance) = (f64::from(place.along), f64::from(place.distance));
        let closest = self.line(edge).closest(from, along, distance, place.side);
        let before = (closest - from).normalize_or_zero();
        let seen = self.sizes_seen(edge, closest, before, (place.side, f64::from(place.tangent)));
        Passing { closest, place: *place, seen }
    }

    /// What a packet in the unit direction `before` sees of the faces of an edge that it passes on `side` with its closest point at `closest point`, turned by the angle
    /// with the given `tangent`.
    #[must_use]
    pub fn sizes_seen(
        &self,
        edge: u32,
        closest: DVec3,
        before: DVec3,
        (side, tangent): (Side, f64),
    ) -> SizesSeen {
        let (line, faces) = (self.line(edge), &self.faces[edge as usize]);
        let behind = |tangent: f64| faces.size_seen(line.turned(closest, before, side, tangent));
        SizesSeen { before: faces.size_seen(before), turned: behind(tangent), opposite: behind(-tangent) }
    }

    /// For every band the density of the angle in `passing`, relative to the largest of all bands', times its preference: zero where the
    /// band goes straight on.
    pub(crate) fn bent(&self, passing: &Passing, factors: &mut [Lanes]) {
        let distance = f64::from(passing.place.distance);
        let slant = distance * f64::from(passing.place.tangent);
        let mut largest = f64::NEG_INFINITY;
        factors.as_flattened_mut().fill(f64::NEG_INFINITY);
        for band in 0..self.wavelengths.len() {
            if self.bends(band, distance, passing.seen.before) {
                let normal = self.concentration(band) * slant;
                let density = self.log_concentration[band / 4][band % 4] - 0.5 * normal * normal;
                factors[band / 4][band % 4] = density;
                largest = largest.max(density);
            }
        }
        for (band, factor) in factors.as_flattened_mut().iter_mut().enumerate() {
            let is_bent = *factor > f64::NEG_INFINITY;
            *factor = if is_bent {
                libm::exp(*factor - largest) * self.preference(band, &passing.seen)
            } else {
                0.0
            };
        }
    }

    /// Takes from `energy` what is bent at `distance` from an edge whose faces are of the `size` [m] as the packet sees them.
    #[inline]
    pub fn keep_straight(&self, distance: f64, size: f64, energy: &mut [Lanes]) {
        for ((energy, reach), least) in energy.iter_mut().zip(&self.reach).zip(&self.least_face) {
            for lane in 0..4 {
                energy[lane] =
                    if distance <= reach[lane] && size >= least[lane] { 0.0 } else { energy[lane] };
            }
        }
    }

    /// For every band 1 where it goes straight on in `passing`, 0 where it is bent.
    pub(crate) fn straight(&self, passing: &Passing, factors: &mut [Lanes]) {
        factors.as_flattened_mut().fill(1.0);
        self.keep_straight(f64::from(passing.place.distance), passing.seen.before, factors);
    }
}

/// The rows of the edges of `geometry` that bend any band of the given `wavelengths` [m], and of their faces.
pub(crate) fn rows(geometry: &Geometry, wavelengths: &[f64]) -> (Vec<EdgeRow>, Vec<FacesRow>) {
    let world = |point: DVec3| (point + geometry.center()).to_array();
    let row = |line: &EdgeLine| EdgeRow { ends: [world(line.origin), world(line.point(line.length))] };
    let index = bending_edges(geometry, wavelengths);
    let faces = index.faces().iter().map(|faces| FacesRow { faces: faces.rows() });
    (index.lines().iter().map(row).collect(), faces.collect())
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

/// The faces of `rows`.
pub(crate) fn faces(rows: &[FacesRow]) -> Vec<EdgeFaces> {
    rows.iter().map(|row| EdgeFaces::from_rows(row.faces)).collect()
}

/// Whether the rows can be edges with their faces; the reason where not.
pub(crate) fn check_rows(rows: &[EdgeRow], faces: &[FacesRow]) -> Result<(), String> {
    if rows.len() != faces.len() {
        return Err(format!("it has {} edges and the faces of {}", rows.len(), faces.len()));
    }
    let is_finite = |row: &FacesRow| row.faces.as_flattened().iter().all(|number| number.is_finite());
    if let Some(edge) = faces.iter().position(|row| !is_finite(row)) {
        return Err(format!("edge {edge} has faces of no size"));
    }
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
pub(crate) fn compare(rows: &[EdgeRow], geometry: &Geometry, wavelengths: &[f64]) -> Result<(), String> {
    let (ours, _) = self::rows(geometry, wavelengths);
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

    /// An edge of two faces of a kilometre.
    fn table() -> EdgeTable {
        let faces = EdgeFaces::from_rows([[1e3, 0.0, 0.0, 1e3], [0.0, 1e3, 0.0, 1e3]]);
        let lines = vec![EdgeLine::new([DVec3::ZERO, DVec3::Z])];
        EdgeTable::new(lines, vec![faces], &[1.0, 0.5, 0.1, 1.0], &[5.0, 2.5, 0.5, 0.0])
    }

    /// A packet in the direction of x.
    fn passing(table: &EdgeTable, distance: f32, tangent: f32) -> Passing {
        let place = EdgePlace { along: 0.5, distance, tangent, side: Side::Back };
        let found = table.passing(DVec3::new(-4.0, f64::from(distance), 0.5), 0, &place);
        assert!(found.closest.distance(DVec3::new(0.0, f64::from(distance), 0.5)) < 1e-6);
        found
    }

    #[test]
    fn bends_weigh_bands_by_their_densities() {
        let table = table();
        for (distance, tangent) in [(0.3_f32, 0.05_f32), (1e-3, -40.0), (0.49, 0.3)] {
            let mut factors = [[0.0; 4]];
            table.bent(&passing(&table, distance, tangent), &mut factors);
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
        table.bent(&passing(&table, 2.0, 0.1), &mut factors);
        assert_eq!(factors, [[factors[0][0], factors[0][1], 0.0, 0.0]]);
        table.straight(&passing(&table, 2.0, 0.0), &mut factors);
        assert_eq!(factors, [[0.0, 0.0, 1.0, 1.0]]);
        assert!((table.reach(&[[1.0, 0.0, 1.0, 1.0]]) - 5.0).abs() < 1e-12);
        assert!((table.reach(&[[0.0, 0.0, 1.0, 1.0]]) - 0.5).abs() < 1e-12);
        assert!(table.reach(&[[0.0, 0.0, 0.0, 1.0]]) < 0.0);
    }

    /// The rim of a plate that is 0.3 m deep from y = 0 on: bands bend whose half waves fit into what is seen of it.
    #[test]
    fn small_faces_and_plates_seen_edge_on_bend_nothing() {
        let plate = |normal: DVec3| {
            let [x, y, z] = (0.3 * normal).to_array();
            let faces = EdgeFaces::from_rows([[x, y, z, 1.0], [0.0; 4]]);
            EdgeTable { faces: vec![faces], ..table() }
        };
        let bent = |table: &EdgeTable, tangent: f32| {
            let mut factors = [[0.0; 4]];
            table.bent(&passing(table, 0.01, tangent), &mut factors);
            factors[0].map(|factor| factor > 0.0)
        };
        assert_eq!(bent(&plate(DVec3::X), 0.0), [false, true, true, false], "1 m wave, 0.3 m plate");
        assert_eq!(
            bent(&plate(DVec3::new(0.6, 0.8, 0.0)), 0.0),
            [false, false, true, false],
            "seen 0.18 m deep"
        );
        assert_eq!(bent(&plate(DVec3::Y), 0.0), [false; 4], "edge-on");
        // Seen 0.06 m deep: only away from the plane of the plate, where it is seen well.
        let slanting = plate(DVec3::new(0.2, 0.96_f64.sqrt(), 0.0));
        let away = if bent(&slanting, 0.1)[2] { 0.1 } else { -0.1 };
        assert_eq!((bent(&slanting, away)[2], bent(&slanting, -away)[2]), (true, false));
    }
}
