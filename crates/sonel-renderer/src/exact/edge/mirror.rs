//! Planar surfaces as mirrors: images of points, and whether a mirrored path is clear.

use glam::DVec3;
use sonel_geometry::{Departure, Geometry, Hit, PlaneId, Side, SurfaceId};
use sonel_map::CoefficientTable;

use crate::partition::Partitions;

/// Within so many lifts of the place where two mirrors meet a ray does not tell which of them is met first; their planes do.
const IN_CORNER: f64 = 16.0;

/// A surface seen from one of its sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mirror {
    pub plane: PlaneId,
    pub surface: SurfaceId,
    side: Side,
    /// Unit normal into the air.
    normal: DVec3,
    /// normal · x of its points, about the scene's centre [m].
    offset: f64,
}

impl Mirror {
    /// `surface`, seen from `side`.
    #[must_use]
    pub fn new(geometry: &Geometry, surface: SurfaceId, side: Side) -> Self {
        let of = geometry.surface(surface);
        let normal = of.normal * side.sign();
        let offset = side.sign() * (of.offset - of.normal.dot(geometry.center()));
        Self { plane: of.plane, surface, side, normal, offset }
    }

    /// Unit normal into the air.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Height of `point` above the plane, positive in the air [m].
    #[must_use]
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// The mirror image of `point`.
    #[must_use]
    pub fn image(&self, point: DVec3) -> DVec3 {
        point - 2.0 * self.height(point) * self.normal
    }

    /// Whether both lie in one plane and face the same side.
    #[must_use]
    pub fn is_coplanar_with(&self, other: &Self) -> bool {
        self.plane == other.plane && self.normal.dot(other.normal) > 0.0
    }
}

/// What the path from `from` over `mirrors`, in this order, to `to` passes; [`None`] where something is on it that nothing passes.
#[must_use]
pub(super) fn passed(
    (geometry, table): (&Geometry, &CoefficientTable),
    mirrors: &[Mirror],
    from: DVec3,
    to: DVec3,
) -> Option<Partitions> {
    let points = reflection_points(mirrors, from, to)?;
    let mut passed = Partitions::default();
    let corner = IN_CORNER * f64::from(geometry.lift());
    let (mut at, mut departure) = (from, Departure::free(from.as_vec3()));
    let mut is_in_corner = false;
    for (met, (mirror, &point)) in mirrors.iter().zip(&points).enumerate() {
        let next = points.get(met + 1).filter(|next| next.distance(point) <= corner);
        if is_in_corner {
            departure = Departure::free((point + mirror.normal * f64::from(geometry.lift())).as_vec3());
        } else {
            let direction = (point - at).normalize().as_vec3();
            let met = |hit: &Hit| {
                let is = |mirror: &Mirror| hit.surface == mirror.surface && hit.side == mirror.side;
                is(mirror) || next.is_some() && is(&mirrors[met + 1])
            };
            let mut hit = geometry.closest_hit(departure, direction)?;
            while !met(&hit) {
                if !passed.pass(geometry, table, hit.surface) {
                    return None;
                }
                hit = geometry.closest_hit(geometry.pass(&hit)?.departure, direction)?;
            }
            departure = geometry.leave(hit.position, hit.surface, hit.side);
        }
        is_in_corner = next.is_some();
        at = point;
    }
    passed.extend(Partitions::between(geometry, table, departure, to.as_vec3())?);
    Some(passed)
}

/// Where the straight path from `from` over `mirrors` to `to` is reflected [m]; [`None`] where it misses one of the planes.
fn reflection_points(mirrors: &[Mirror], from: DVec3, to: DVec3) -> Option<Vec<DVec3>> {
    let mut at = from;
    let reflect = |(met, mirror): (usize, &Mirror)| {
        let image = mirrors[met..].iter().rev().fold(to, |point, mirror| mirror.image(point));
        let (above, below) = (mirror.height(at), -mirror.height(image));
        at += (image - at) * (above / (above + below));
        (above > 0.0 && below > 0.0).then_some(at)
    };
    mirrors.iter().enumerate().map(reflect).collect()
}
