//! Which bands come the way that a connection or a visibility ray has found.
//!
//! A packet that goes there passes the same edges as a traced one, by the same rules: a band within whose reach it passes any is
//! bent there, and arrives elsewhere unless the way turns there, too. So a straight connection carries the bands alone that go straight on;
//! ways that turn are those of rays ([`crate::stochastic::gather`]), and what is left is heard by the spheres of [`crate::stochastic::crossing`]. No energy is counted straight and bent.
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use glam::DVec3;
use sonel_geometry::{EdgeIndex, EdgeLine, EdgePass, Geometry, Nearby, Side, Way};
use sonel_map::{BendHistory, EdgeTable, Lanes, SizesSeen, bending_edges};

/// The edges of a room that bend, with what they do to the bands.
pub struct Bends {
    index: EdgeIndex,
    table: EdgeTable,
    /// Number and concentration of the bands that are bent, as of the law of bending.
    bent: Vec<(usize, f64)>,
}

/// Where a packet is bent, and by which edge.
#[derive(Debug, Clone, Copy)]
pub struct Turn {
    /// Number of the edge.
    pub edge: u32,
    /// The closest point of its shortest distance from the way before, about the scene's centre [m].
    pub closest: DVec3,
    /// That distance [m].
    pub distance: f64,
    /// Unit direction of the packet before.
    pub before: DVec3,
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
    #[must_use]
    pub fn lifted(self, lift: f64) -> f64 {
        self.steepness.map_or(0.0, |steepness| lift / steepness.max(f64::MIN_POSITIVE))
    }
}

impl Bends {
    /// Those of `geometry`, which must be the edges of `table`.
    #[must_use]
    pub fn new(geometry: &Geometry, table: &EdgeTable, columns: usize) -> Self {
        let bent = (0..columns).filter(|&band| table.reach_of(band) > 0.0);
        Self {
            index: bending_edges(geometry, table.wavelengths()),
            bent: bent.map(|band| (band, table.concentration(band))).collect(),
            table: table.clone(),
        }
    }

    /// The lines of the edges.
    #[must_use]
    pub fn lines(&self) -> &[EdgeLine] {
        self.index.lines()
    }

    /// Whether `band` is bent at `distance` from an edge whose faces a packet sees in this `size` [m].
    #[inline]
    #[must_use]
    pub fn bends(&self, band: usize, distance: f64, size: f64) -> bool {
        self.table.bends(band, distance, size)
    }

    /// How often `band` takes an angle, see [`EdgeTable::preference`].
    #[inline]
    #[must_use]
    pub fn preference(&self, band: usize, seen: &SizesSeen) -> f64 {
        self.table.preference(band, seen)
    }

    /// What a packet that is bent in `turn` by the angle with the given `tangent` sees of the faces of the edge.
    #[must_use]
    pub fn sizes_seen(&self, turn: &Turn, tangent: f64) -> SizesSeen {
        let line = self.table.line(turn.edge);
        let is_front = line.along.cross(turn.closest - line.origin).dot(turn.before) >= 0.0;
        let side = if is_front { Side::Front } else { Side::Back };
        self.table.sizes_seen(turn.edge, turn.closest, turn.before, (side, tangent))
    }

    /// What a way in a unit `direction` sees of the faces of `edge` [m].
    #[must_use]
    pub fn size_seen(&self, edge: u32, direction: DVec3) -> f64 {
        self.table.faces(edge).size_seen(direction)
    }

    /// Whether `edge` bends `band` from any direction.
    #[must_use]
    pub fn may_bend(&self, band: usize, edge: u32) -> bool {
        self.table.is_large(band, self.table.faces(edge).size())
    }

    /// Number and concentration of the bands that are bent.
    #[must_use]
    pub fn bent(&self) -> &[(usize, f64)] {
        &self.bent
    }

    /// The first passage on `way`, of any edge that bends any band of those with `energy`, but those in `passed`.
    #[must_use]
    pub fn next(
        &self,
        geometry: &Geometry,
        way: &Way,
        passed: &[Turn],
        energy: &[Lanes],
    ) -> Option<EdgePass> {
        let counts = |edge: u32, squared: f64| {
            passed.iter().all(|turn| turn.edge != edge)
                && self.table.bends_any(energy, edge, squared, way.direction)
        };
        if way.reach < 0.0 { None } else { self.index.first(geometry, way, counts) }
    }

    /// Calls `found` for all edges that `way` comes near, seen or not.
    pub fn nearby(&self, way: &Way, found: impl FnMut(Nearby)) {
        self.index.nearby(way, found);
    }

    /// How far from edges `band` is bent [m].
    #[must_use]
    pub fn reach_of_band(&self, band: usize) -> f64 {
        self.table.reach_of(band)
    }

    /// The edges within `reach` [m] that may be passed at `place` by what has its closest point there, and the points of them that are nearest.
    #[must_use]
    pub fn nearest(&self, geometry: &Geometry, place: DVec3, reach: f64) -> Vec<(u32, DVec3)> {
        let point = |(edge, along): (u32, f64)| {
            let line = &self.lines()[edge as usize];
            (along > 0.0 && along < line.length).then(|| (edge, line.point(along)))
        };
        self.index.nearest(geometry, place, reach).into_iter().filter_map(point).collect()
    }

    /// The largest distance at which any band of `energy` is bent [m]; below zero where none is.
    #[must_use]
    pub fn reach_of(&self, energy: &[Lanes]) -> f64 {
        self.table.reach(energy)
    }

    /// Distance that packets keep from surfaces and feet in passing edges [m].
    #[must_use]
    pub fn least_distance(&self) -> f64 {
        self.index.least_distance()
    }

    /// Takes from `energy` what does not go straight from one place to the other. A call, since most rooms have no edge and connections no
    /// room for it.
    #[inline(never)]
    pub fn keep_straight(&self, geometry: &Geometry, ends: [WayEnd; 2], energy: &mut [Lanes]) {
        self.keep_turned(geometry, ends, &[], energy);
    }

    /// Takes from `energy` what does not go from one place to the other by `turns`, all of them and no others, in this order.
    pub fn keep_turned(
        &self,
        geometry: &Geometry,
        [from, to]: [WayEnd; 2],
        turns: &[Turn],
        energy: &mut [Lanes],
    ) {
        let lift = self.index.least_distance();
        let mut bend_history = BendHistory::new(from.lifted(lift));
        let mut place = from.place;
        for turn in turns {
            let way = Way {
                origin: place,
                direction: turn.before,
                from: bend_history.clear,
                to: place.distance(turn.closest) + lift,
                reach: self.table.reach(energy),
            };
            if !self.keep_unbent(geometry, way, &bend_history, Some(turn.edge), energy) {
                energy.fill([0.0; 4]);
                return;
            }
            bend_history.bend(turn.edge, turn.distance);
            place = turn.closest;
        }
        let mut way = Way::between(place, to.place, self.table.reach(energy));
        way.from = bend_history.clear;
        way.to -= to.lifted(lift);
        self.keep_unbent(geometry, way, &bend_history, None, energy);
    }

    /// Takes from `energy` what the edges on `way` bend before `last` is passed; whether that is passed.
    fn keep_unbent(
        &self,
        geometry: &Geometry,
        mut way: Way,
        bend_history: &BendHistory,
        last: Option<u32>,
        energy: &mut [Lanes],
    ) -> bool {
        while let Some(edge_pass) = bend_history.next((&self.index, &self.table), geometry, &way, energy) {
            if Some(edge_pass.edge) == last {
                return true;
            }
            // What matters to the bands that are left is behind, and within their reach.
            let size = self.size_seen(edge_pass.edge, way.direction);
            self.table.keep_straight(edge_pass.distance, size, energy);
            way.reach = self.table.reach(energy);
            way.from = edge_pass.at;
        }
        false
    }
}
