//! A straight edge between two faces, and coordinates about it.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Angle [rad] within which a point behind a face counts as on it: a micrometre at 10 m.
const ON_FACE: f64 = 1e-7;

/// A rigid wedge with a finite edge. The air about it spans an angle above 0 and up to 2π.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wedge {
    start: DVec3,
    along: DVec3,
    length: f64,
    inward: DVec3,
    normal: DVec3,
    angle: f64,
}

/// A point in cylindrical coordinates about a wedge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WedgePoint {
    /// Distance from the edge's line [m].
    pub radius: f64,
    /// Angle from the first face through the air [rad].
    pub angle: f64,
    /// Distance along the edge from its start [m].
    pub along: f64,
}

impl Wedge {
    /// A wedge with its edge between `ends` [m]. `inward` points from the edge into the first face, `normal` from that
    /// face into the air; only their parts across the edge count. `angle` is that of the air [rad].
    ///
    /// [`None`] for an edge without length, faces without direction and angles outside 0 … 2π.
    #[must_use]
    pub fn new(ends: [DVec3; 2], inward: DVec3, normal: DVec3, angle: f64) -> Option<Self> {
        let along = (ends[1] - ends[0]).try_normalize()?;
        let inward = (inward - along * inward.dot(along)).try_normalize()?;
        let normal = (normal - along * normal.dot(along) - inward * normal.dot(inward)).try_normalize()?;
        (angle > 0.0 && angle <= TAU + ON_FACE).then(|| Self {
            start: ends[0],
            along,
            length: ends[0].distance(ends[1]),
            inward,
            normal,
            angle: angle.min(TAU),
        })
    }

    /// The same wedge with its edge between two other places on its line [m from its start], the first one before the second.
    #[must_use]
    pub fn between(&self, [start, end]: [f64; 2]) -> Self {
        Self { start: self.at(start), length: end - start, ..*self }
    }

    /// Its mirror image, of which `image` maps points.
    #[must_use]
    pub fn mirrored(&self, image: impl Fn(DVec3) -> DVec3) -> Self {
        let start = image(self.start);
        let turned = |direction: DVec3| image(self.start + direction) - start;
        Self {
            start,
            along: turned(self.along),
            inward: turned(self.inward),
            normal: turned(self.normal),
            ..*self
        }
    }

    /// Angle of the air [rad].
    #[must_use]
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Whether it is the rim of a sheet, which has air all around.
    #[must_use]
    pub fn is_rim(&self) -> bool {
        TAU - self.angle <= ON_FACE
    }

    /// Length of the edge [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The point of the edge's line at `along` [m] from its start.
    #[must_use]
    pub fn at(&self, along: f64) -> DVec3 {
        self.start + self.along * along
    }

    /// Unit vector along the edge.
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        self.along
    }

    /// Unit vector from the edge into its first or its `second` face.
    #[must_use]
    pub fn inward(&self, second: bool) -> DVec3 {
        let (sine, cosine) = if second { libm::sincos(self.angle) } else { (0.0, 1.0) };
        self.inward * cosine + self.normal * sine
    }

    /// The place in the plane of the first or the `second` face that is beyond the edge as far and as high as `point`.
    pub(crate) fn beyond(&self, point: WedgePoint, second: bool) -> DVec3 {
        self.at(point.along) - self.inward(second) * point.radius
    }

    /// A point in the plane of a face, taken to be on it: at `angle` [rad].
    pub(crate) fn in_plane(&self, point: DVec3, angle: f64) -> WedgePoint {
        let offset = point - self.start;
        let along = offset.dot(self.along);
        WedgePoint { radius: (offset - self.along * along).length(), angle, along }
    }

    /// Distance along and from the line of the edge of any point, at no angle.
    pub(crate) fn along_and_radius(&self, point: DVec3) -> WedgePoint {
        self.in_plane(point, 0.0)
    }

    /// Where `point` is about the wedge; [`None`] where it is within the solid.
    #[must_use]
    pub fn locate(&self, point: DVec3) -> Option<WedgePoint> {
        let offset = point - self.start;
        let along = offset.dot(self.along);
        let across = offset - self.along * along;
        let radius = across.length();
        let around = libm::atan2(across.dot(self.normal), across.dot(self.inward)).rem_euclid(TAU);
        let solid = TAU - self.angle;
        // Behind which face a point is just beyond the air: the nearer one.
        let angle = match around - self.angle {
            beyond if beyond <= 0.0 => around,
            beyond if beyond <= ON_FACE => self.angle,
            beyond if solid - beyond <= ON_FACE => 0.0,
            _ if radius <= 0.0 => 0.0,
            _ => return None,
        };
        Some(WedgePoint { radius, angle, along })
    }
}

/// Position along the edge where the path from `source` to `receiver` over it is shortest [m].
#[must_use]
pub fn apex(source: WedgePoint, receiver: WedgePoint) -> f64 {
    let radii = source.radius + receiver.radius;
    let share = if radii > 0.0 { source.radius / radii } else { 0.5 };
    source.along + (receiver.along - source.along) * share
}

/// η of the place at `along` [m] on the edge: how far it is from the shortest way over the edge, as an angle where that is small.
/// Neither point is on the line of the edge.
#[must_use]
pub fn rapidity(source: WedgePoint, receiver: WedgePoint, along: f64) -> f64 {
    let of = |point: WedgePoint| libm::asinh((along - point.along) / point.radius);
    of(source) + of(receiver)
}

/// ν = π/θ_w of a wedge whose air spans `angle` [rad].
pub(crate) fn index(angle: f64) -> f64 {
    PI / angle
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn corner() -> Wedge {
        Wedge::new([DVec3::ZERO, DVec3::Z * 3.0], DVec3::X, DVec3::Y, 1.5 * PI).unwrap()
    }

    #[test]
    fn points_are_told_by_radius_angle_and_height() {
        let point = corner().locate(DVec3::new(0.0, 2.0, 1.0)).unwrap();
        assert!((point.radius - 2.0).abs() < 1e-12 && (point.angle - FRAC_PI_2).abs() < 1e-12);
        assert!((point.along - 1.0).abs() < 1e-12);
        assert!(corner().locate(DVec3::new(1.0, -1.0, 0.0)).is_none());
    }

    #[test]
    fn points_on_faces_and_on_the_edge_are_in_the_air() {
        let second = corner().locate(DVec3::new(1e-12, -1.0, 0.0)).unwrap();
        assert!((second.angle - 1.5 * PI).abs() < 1e-12);
        let first = corner().locate(DVec3::new(1.0, -1e-12, 0.0)).unwrap();
        assert!(first.angle.abs() < 1e-12);
        assert!(corner().locate(DVec3::Z).unwrap().radius <= 0.0);
    }

    #[test]
    fn a_part_of_an_edge_is_on_its_line() {
        let part = corner().between([-1.0, 2.5]);
        assert!((part.length() - 3.5).abs() < 1e-12);
        let point = part.locate(DVec3::new(0.0, 2.0, 1.0)).unwrap();
        assert!((point.angle - FRAC_PI_2).abs() < 1e-12 && (point.along - 2.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_wedge_is_none() {
        assert!(Wedge::new([DVec3::ZERO; 2], DVec3::X, DVec3::Y, 4.0).is_none());
        assert!(Wedge::new([DVec3::ZERO, DVec3::Z], DVec3::Z, DVec3::Y, 4.0).is_none());
        assert!(Wedge::new([DVec3::ZERO, DVec3::Z], DVec3::X, DVec3::Y, 7.0).is_none());
        assert!(Wedge::new([DVec3::ZERO, DVec3::Z], DVec3::X, DVec3::Y, f64::NAN).is_none());
    }

    #[test]
    fn the_shortest_path_is_straight_when_unfolded() {
        let at = |radius, along| WedgePoint { radius, angle: 0.0, along };
        assert!((apex(at(1.0, 0.0), at(3.0, 8.0)) - 2.0).abs() < 1e-12);
        assert!((apex(at(0.0, 0.0), at(0.0, 8.0)) - 4.0).abs() < 1e-12);
    }
}
