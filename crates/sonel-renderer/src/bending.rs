//! What bending leaves of the straight way from a sonel to a receiver.
//!
//! A packet that goes there passes the same edges as a traced one, by the same rules: a band within whose reach it passes any is
//! bent and arrives elsewhere. So the connection carries the bands alone that go straight on. Ways that are bent once have
//! connections of their own ([`crate::bent_connection`]), the rest is heard by the spheres of [`crate::crossing`]. No energy is
//! counted straight and bent.
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use glam::DVec3;
use sonel_geometry::{EdgeIndex, EdgeLine, Geometry, Passage, Way};
use sonel_map::{EdgeTable, Lanes, bending_edges};

/// The edges of a room that bend, with what they do to the bands.
pub struct Bends {
    index: EdgeIndex,
    table: EdgeTable,
    /// The largest of all bands.
    reach: f64,
    /// Number and concentration of the bands that are bent, as of the law of bending.
    bent: Vec<(usize, f64)>,
}

/// Where a straight way begins or ends.
#[derive(Debug, Clone, Copy)]
pub struct WayEnd {
    /// About the scene's centre [m].
    pub place: DVec3,
    /// Cosine of the way with the normal of the surface there; none in the air.
    pub steepness: Option<f64>,
}

impl WayEnd {
    /// An end in the air.
    #[must_use]
    pub fn in_air(place: DVec3) -> Self {
        Self { place, steepness: None }
    }

    /// An end at a surface to whose normal the way has the cosine `steepness`.
    #[must_use]
    pub fn at_surface(place: DVec3, steepness: f64) -> Self {
        Self { place, steepness: Some(steepness) }
    }

    /// How far from it a way is as high as `lift` above its surface [m].
    fn lifted(self, lift: f64) -> f64 {
        self.steepness.map_or(0.0, |steepness| lift / steepness.max(f64::MIN_POSITIVE))
    }
}

impl Bends {
    /// Those of `geometry`, which must be the edges of `table`.
    #[must_use]
    pub fn new(geometry: &Geometry, table: &EdgeTable, columns: usize) -> Self {
        let reach = table.reach(&vec![[1.0; 4]; columns.div_ceil(4)]);
        let bent = (0..columns).filter(|&band| table.bends(band, 0.0));
        Self {
            index: bending_edges(geometry),
            reach,
            bent: bent.map(|band| (band, table.concentration(band))).collect(),
            table: table.clone(),
        }
    }

    /// The lines of the edges.
    #[must_use]
    pub fn lines(&self) -> &[EdgeLine] {
        self.index.lines()
    }

    /// The largest distance at which any band is bent [m].
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Whether `band` is bent at `distance` from an edge [m].
    #[inline]
    #[must_use]
    pub fn bends(&self, band: usize, distance: f64) -> bool {
        self.table.bends(band, distance)
    }

    /// Number and concentration of the bands that are bent.
    #[must_use]
    pub fn bent(&self) -> &[(usize, f64)] {
        &self.bent
    }

    /// Whether a packet that leaves `from` in `direction` passes `edge` at `foot`; takes from `energy` what is bent before.
    pub fn keep_bent_at(
        &self,
        geometry: &Geometry,
        (from, steepness): (DVec3, f64),
        (edge, foot, direction): (u32, DVec3, DVec3),
        energy: &mut [Lanes],
    ) -> bool {
        let mut way = Way {
            origin: from,
            direction,
            from: self.index.least_distance() / steepness.max(f64::MIN_POSITIVE),
            to: from.distance(foot) + self.index.least_distance(),
            reach: self.table.reach(energy),
        };
        while let Some(passage) = self.next(geometry, &way, |_| true) {
            if passage.edge == edge {
                return true;
            }
            self.keep_past(&passage, &mut way, energy);
        }
        false
    }

    /// Takes from `energy` what is bent again between a `foot` where `edge` was passed at `distance` [m], and `to`.
    pub fn keep_bent_once(
        &self,
        geometry: &Geometry,
        (edge, foot, distance): (u32, DVec3, f64),
        to: DVec3,
        energy: &mut [Lanes],
    ) {
        let way = Way { from: distance, ..Way::between(foot, to, self.table.reach(energy)) };
        self.keep_unbent(geometry, way, |other| other != edge, energy);
    }

    /// Takes from `energy` what does not go straight from one place to the other. A call, since most rooms have no edge and connections no
    /// room for it.
    #[inline(never)]
    pub fn keep_straight(&self, geometry: &Geometry, [from, to]: [WayEnd; 2], energy: &mut [Lanes]) {
        let lift = self.index.least_distance();
        let mut way = Way::between(from.place, to.place, self.table.reach(energy));
        way.from = from.lifted(lift);
        way.to -= to.lifted(lift);
        self.keep_unbent(geometry, way, |_| true, energy);
    }

    /// Takes from `energy` what the edges on `way` bend.
    fn keep_unbent(
        &self,
        geometry: &Geometry,
        mut way: Way,
        counts: impl Fn(u32) -> bool,
        energy: &mut [Lanes],
    ) {
        while let Some(passage) = self.next(geometry, &way, &counts) {
            self.keep_past(&passage, &mut way, energy);
        }
    }

    /// The first passage on `way`; none is looked for where no band has any energy left.
    fn next(&self, geometry: &Geometry, way: &Way, counts: impl Fn(u32) -> bool) -> Option<Passage> {
        if way.reach < 0.0 { None } else { self.index.first(geometry, way, counts) }
    }

    /// Takes from `energy` what is bent at `passage`, and leaves what of `way` matters to the bands that still have some: what is
    /// behind, and within their reach.
    fn keep_past(&self, passage: &Passage, way: &mut Way, energy: &mut [Lanes]) {
        self.table.keep_straight(passage.distance, energy);
        way.reach = self.table.reach(energy);
        way.from = passage.at;
    }
}
