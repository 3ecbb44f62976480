//! Straight paths through partitions: each band is multiplied by τ.
//!
//! Where no material transmits, partitions cost no time.
//!
//! References: docs/physics.md §3.

use glam::{DVec3, Vec3};
use sonel_geometry::{Departure, Geometry, Sight, SurfaceId};
use sonel_map::{BandValues, CoefficientTable, Lanes};
use sonel_scene::Leg;

/// Partitions that a way passes, in order, and how those with thickness shift it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Partitions(Sight);

impl Partitions {
    /// Partitions between a start and a local position [m]; [`None`] where something is between that nothing passes.
    #[inline]
    #[must_use]
    pub(crate) fn between(
        geometry: &Geometry,
        table: &CoefficientTable,
        from: Departure,
        to: Vec3,
    ) -> Option<Self> {
        if table.transmits() {
            geometry.reaches(from, to, |surface| table.mean_row(surface).is_partition).map(Self)
        } else {
            (!geometry.is_blocked(from, to)).then(Self::default)
        }
    }

    /// Partitions on the straight way between two local positions [m] in general position; [`None`] where something is between that nothing
    /// passes.
    #[must_use]
    pub(crate) fn on_way(geometry: &Geometry, table: &CoefficientTable, ends: [DVec3; 2]) -> Option<Self> {
        if table.transmits() {
            geometry.sight(ends, None, |surface| table.mean_row(surface).is_partition).map(Self)
        } else {
            geometry.is_clear(ends, None).then(Self::default)
        }
    }

    /// Partitions on a `leg` from a local position [m], or from one lifted off a surface, to another; [`None`] where something is on it that
    /// nothing passes.
    #[must_use]
    pub(crate) fn along(
        geometry: &Geometry,
        table: &CoefficientTable,
        mut from: Vec3,
        leg: &Leg,
        to: Vec3,
    ) -> Option<Self> {
        let mut passed = Self::default();
        for joint in leg.arc.joints(leg.time) {
            let joint = joint.as_vec3();
            let chord = joint - from;
            // A partition with thickness may be left beyond the end of the chord.
            while (joint - from).dot(chord) > 0.0 {
                let Some(hit) = geometry.hit_on_chord(from, joint) else {
                    from = joint;
                    break;
                };
                if !passed.pass(table, hit.surface) {
                    return None;
                }
                from = geometry.pass(&hit)?.departure.origin;
            }
        }
        let end = Self::between(geometry, table, Departure::free(from), to)?;
        passed.extend(end);
        Some(passed)
    }

    /// Notes that `surface` is passed; false where nothing passes it.
    fn pass(&mut self, table: &CoefficientTable, surface: SurfaceId) -> bool {
        let passes = table.mean_row(surface).is_partition;
        if passes {
            self.0.surfaces.push(surface);
        }
        passes
    }

    /// By how much the way to a place misses it [m]: the way to p runs as one to p less this.
    #[must_use]
    pub(crate) fn shift(&self) -> DVec3 {
        self.0.shift
    }

    /// Length of the way within partitions [m].
    #[must_use]
    pub(crate) fn thickness(&self) -> f64 {
        self.0.thickness
    }

    /// Materials of the partitions in ascending order: which of two faces of a wall is met does not matter.
    #[must_use]
    pub(crate) fn materials(&self, geometry: &Geometry) -> Vec<u32> {
        let mut materials: Vec<u32> =
            self.0.surfaces.iter().map(|&id| geometry.surface(id).material).collect();
        materials.sort_unstable();
        materials
    }

    /// Adds those of `other`.
    pub(crate) fn extend(&mut self, other: Self) {
        self.0.surfaces.extend(other.0.surfaces);
        self.0.shift += other.0.shift;
        self.0.thickness += other.0.thickness;
    }

    /// Takes from `energy` what they hold back.
    #[inline]
    pub(crate) fn attenuate(&self, table: &CoefficientTable, energy: &mut [Lanes]) {
        for &surface in &self.0.surfaces {
            energy.multiply(&table.mean_row(surface).transmitted.energy);
        }
    }
}

impl From<Sight> for Partitions {
    fn from(sight: Sight) -> Self {
        Self(sight)
    }
}
