//! Where sources and receivers may stand: in air that a source can reach, and clear of every surface.
//!
//! In a closed room the air is what is within its hull but in no solid. In the open everything closed is a solid, unless a source stands in it:
//! sound does not pass surfaces.

use std::fmt;

use glam::DVec3;
use thiserror::Error;

use crate::Geometry;
use crate::cells::OUTSIDE;

/// Clearance in lifts. Rays leave a surface one lift above it, so that nearer than that a point is behind the start of
/// rays from the wall. The second lift keeps image-source paths along the wall, which start one lift above it too.
const LIFTS_PER_CLEARANCE: f64 = 2.0;
/// Distances from every surface at which places are proposed [m]: that of a microphone beside a wall if there is room, else a millimetre.
/// The first is chosen, not measured.
const PROPOSED_DISTANCES: [f64; 2] = [0.1, 1e-3];
/// Steps of proposed coordinates in a metre: 0.1 mm, a tenth of the smallest of [`PROPOSED_DISTANCES`].
const PROPOSED_PER_METRE: f64 = 1e4;
/// A corner has this many walls to be moved away from, one after the other.
const PUSHES: u32 = 3;

/// Why nothing can stand at a position.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("{obstacle}{}", proposal(.free))]
pub struct Misplaced {
    /// The obstacle.
    pub obstacle: Obstacle,
    /// The nearest free position that was found [m].
    pub free: Option<DVec3>,
}

/// Obstacle to a source or receiver; `distance` is that to the nearest surface [m].
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Obstacle {
    /// A surface that is too near.
    #[error("is {} from a surface, at least {} are needed", Length(*.distance), Length(*.clearance))]
    Surface {
        /// [m].
        distance: f64,
        /// Smallest distance allowed [m].
        clearance: f64,
    },
    /// A closed object.
    #[error("is inside a closed object where no sound arrives, {} from its surface", Length(*.distance))]
    Solid {
        /// [m].
        distance: f64,
    },
    /// The hull of the closed room, or its walls with thickness.
    #[error("is outside the room, {} from its nearest surface", Length(*.distance))]
    Hull {
        /// [m].
        distance: f64,
    },
}

/// A length in the unit that suits it.
struct Length(f64);

impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            zero if zero <= 0.0 => write!(f, "0 m"),
            small if small < 1e-3 => write!(f, "{:.4} mm", 1e3 * small),
            length => write!(f, "{length:.4} m"),
        }
    }
}

fn proposal(free: &Option<DVec3>) -> String {
    free.map(|DVec3 { x, y, z }| format!("; ({x}, {y}, {z}) m is free")).unwrap_or_default()
}

impl Geometry {
    /// Least distance of sources and receivers from every surface [m]: some ten micrometres in a room of 10 m.
    pub fn clearance(&self) -> f64 {
        LIFTS_PER_CLEARANCE * f64::from(self.lift())
    }

    /// Checks that a source or receiver can stand at a world position [m]; `sources` are the positions of all sources.
    ///
    /// # Errors
    /// Checks a position for sources and receivers; the error has the obstacle and the nearest free position found.
    pub fn check_place(&self, point: DVec3, sources: &[DVec3]) -> Result<(), Misplaced> {
        match self.obstacle(point, sources) {
            None => Ok(()),
            Some(obstacle) => {
                let away = |distance: f64| self.free_place(point, sources, distance, PUSHES);
                Err(Misplaced { obstacle, free: PROPOSED_DISTANCES.into_iter().find_map(away) })
            }
        }
    }

    /// The obstacle to a source or receiver at a world position [m]; `sources` as in [`Geometry::check_place`].
    pub fn obstacle(&self, point: DVec3, sources: &[DVec3]) -> Option<Obstacle> {
        let (distance, clearance) = (self.distance_to_nearest_surface(point), self.clearance());
        if distance < clearance {
            return Some(Obstacle::Surface { distance, clearance });
        }
        let cell = self.cell_at(point);
        if self.cells.is_room && cell == OUTSIDE {
            return Some(Obstacle::Hull { distance });
        }
        let is_reached = || !self.cells.is_room && sources.iter().any(|&source| self.cell_at(source) == cell);
        if self.cells.cell(cell).is_air || is_reached() {
            return None;
        }
        Some(Obstacle::Solid { distance })
    }

    /// A free position near `point`, at least `distance` [m] from every surface: beside the nearest surface, then beside the next one, at most
    /// `pushes` times.
    fn free_place(&self, point: DVec3, sources: &[DVec3], distance: f64, pushes: u32) -> Option<DVec3> {
        let (triangle, closest) = self.closest_point(point);
        let normal = self.surface(self.triangle_surface(triangle)).normal;
        let step = distance.max(2.0 * self.clearance());
        let rounded = |place: DVec3| (place * PROPOSED_PER_METRE).round() / PROPOSED_PER_METRE;
        let beside = [step, -step].map(|step| rounded(closest + step * normal));
        let is_apart = |place| self.distance_to_nearest_surface(place) >= step - 1.0 / PROPOSED_PER_METRE;
        let is_free = |place: &DVec3| is_apart(*place) && self.obstacle(*place, sources).is_none();
        beside.into_iter().find(is_free).or_else(|| {
            let mut pushed = beside.into_iter().filter(|_| pushes > 1);
            pushed.find_map(|place| self.free_place(place, sources, distance, pushes - 1))
        })
    }
}
