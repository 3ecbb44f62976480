//! Chains of specular reflections: whether the path over one reaches a receiver, and with which energy.
//!
//! A chain is a sequence of plane mirrors, walls or interfaces between airs. Each has the image of the source in all mirrors up to it, so the
//! path is followed backwards from the receiver in straight lines to the images. It is exact: in double precision, between displaced ends
//! (docs/physics.md §4).

use glam::DVec3;
use smallvec::{SmallVec, smallvec};
use sonel_geometry::{Crossed, Geometry, Leg, MOST_ROUNDS, PlaneId, Side, Sight, SurfaceId};
use sonel_map::{BandValues, CoefficientTable, Lanes};
use sonel_scene::refract;

use super::{MirrorArrival, Radiator};
use crate::partition::Partitions;

/// Depth behind its plane to which a mirror's triangles are sought [resolutions]: corners may be one off the plane of their surface.
const DEPTH: f64 = 2.0;

/// A surface seen from one side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct SurfaceSide {
    pub surface: SurfaceId,
    pub side: Side,
}

/// A reflection of a chain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reflection {
    pub mirror: SurfaceSide,
    /// Image of the displaced source in this mirror and those before it.
    pub image: DVec3,
    /// Image of the source itself.
    pub of_radiator: DVec3,
}

/// Ends of a path, about the scene's centre [m].
pub(crate) struct Ends<'a> {
    pub radiator: Radiator<'a>,
    /// The radiator's position in general position.
    pub origin: DVec3,
    pub receiver: DVec3,
    /// The receiver in general position.
    pub displaced: DVec3,
}

impl SurfaceSide {
    /// Signed distance of `point` (about the scene's centre) above the mirror's plane, positive on its side [m].
    #[must_use]
    pub(crate) fn height(self, geometry: &Geometry, point: DVec3) -> f64 {
        let surface = geometry.surface(self.surface);
        let offset = surface.offset - surface.normal.dot(geometry.center());
        (surface.normal.dot(point) - offset) * self.side.sign()
    }

    fn reflected(self, geometry: &Geometry, point: DVec3) -> DVec3 {
        let normal = geometry.surface(self.surface).normal * self.side.sign();
        point - 2.0 * self.height(geometry, point) * normal
    }
}

impl Reflection {
    /// The reflection at `mirror` behind those that have these images of the displaced source and of the source itself.
    #[must_use]
    pub(crate) fn new(geometry: &Geometry, mirror: SurfaceSide, images: [DVec3; 2]) -> Self {
        let [image, of_radiator] = images.map(|image| mirror.reflected(geometry, image));
        Self { mirror, image, of_radiator }
    }

    /// Point where the line from `point`, on the mirror's side, to the image, behind it, crosses its plane.
    fn crossing(&self, geometry: &Geometry, point: DVec3) -> Option<DVec3> {
        let [above, below] = [point, self.image].map(|point| self.mirror.height(geometry, point));
        (above > 0.0 && below < 0.0).then(|| point + (self.image - point) * (above / (above - below)))
    }

    /// Where the way from `point`, in the plane that is `left`, to the image meets the mirror; none where it meets anything before that is not
    /// `ignored`, or the plane beside the mirror.
    fn met(
        &self,
        geometry: &Geometry,
        point: DVec3,
        left: Option<PlaneId>,
        mut ignored: impl FnMut(&Crossed) -> bool,
    ) -> Option<DVec3> {
        let Self { mirror, image, .. } = *self;
        let reflection = self.crossing(geometry, point)?;
        let (above, below) = (mirror.height(geometry, point), -mirror.height(geometry, image));
        let depth = below.min(DEPTH * f64::from(geometry.resolution()));
        let beyond = point + (image - point) * ((above + depth) / (above + below));
        let (ends, plane) = ([point, beyond], geometry.surface(mirror.surface).plane);
        let is_mirror = |face: &Crossed| face.surface == mirror.surface && face.side == mirror.side;
        let (mut there, at) = (None::<Crossed>, above / (above + depth));
        let is_blocked = geometry.visit_between(ends, left, |face| {
            if face.plane != plane {
                return face.share < at && !ignored(&face);
            }
            if there.is_none_or(|known| face.hides(&known)) {
                there = Some(face);
            }
            false
        });
        (!is_blocked && there.is_some_and(|face| is_mirror(&face))).then_some(reflection)
    }
}

/// The sound of a path over `chain`, the last reflection first, and the direction in which it leaves the source, not normalised; [`None`] where
/// something is in the way that nothing passes. `factor` is set.
pub(crate) fn arrive<'f>(
    geometry: &Geometry,
    table: &CoefficientTable,
    ends: &Ends<'_>,
    chain: &[&Reflection],
    factor: &'f mut [Lanes],
) -> Option<(MirrorArrival<'f>, DVec3)> {
    let (leaving, sight) = if table.transmits() {
        let passes = |surface| table.mean_row(surface).is_partition;
        connect_through(geometry, chain, [ends.origin, ends.displaced], &passes)?
    } else {
        let displaced = [ends.origin, ends.displaced];
        let leaving = connect(geometry, chain.iter().copied(), displaced, |_| false)?;
        (leaving, Sight::default())
    };
    let offset = chain[0].of_radiator - sight.shift - ends.receiver;
    reflect(table, chain, offset, factor);
    let passed = Partitions::from(sight);
    passed.attenuate(table, factor);
    ends.radiator.towards(leaving).weigh(factor);
    let in_air = offset.length();
    let length = in_air + passed.thickness();
    // Sound spreads in the air alone.
    let spreads = (length / in_air) * (length / in_air);
    factor.scale(spreads);
    let mirrors = chain.iter().map(|reflection| reflection.mirror.surface).collect();
    let (towards, order) = (offset / in_air, chain.len() as u32);
    let through = passed.materials(geometry);
    Some((MirrorArrival { length, towards, order, mirrors, factor, through }, leaving))
}

/// Sets `factor` to ∏ (1−α)(1−s), R at interfaces, along `chain` for sound that reaches its last mirror from `towards`, seen from the receiver.
fn reflect(table: &CoefficientTable, chain: &[&Reflection], mut towards: DVec3, factor: &mut [Lanes]) {
    factor.fill(Lanes::ONE);
    for Reflection { mirror: SurfaceSide { surface, side }, .. } in chain {
        let normal = table.normal(*surface);
        match table.propagation().interface(*surface, *side) {
            Some(interface) => {
                factor.scale(refract(towards.normalize(), normal, interface.sides).reflected);
            }
            None => table.mirror(*surface, towards, factor),
        }
        towards = towards.reflect(normal);
    }
}

/// Follows a chain, the last reflection first, backwards from `from`. Returns the offset from `origin`
/// to the first reflection where nothing is in the way but what is `ignored`.
pub(crate) fn connect<'a>(
    geometry: &Geometry,
    chain: impl Iterator<Item = &'a Reflection>,
    [origin, from]: [DVec3; 2],
    mut ignored: impl FnMut(&Crossed) -> bool,
) -> Option<DVec3> {
    let (mut point, mut left) = (from, None);
    for reflection in chain {
        point = reflection.met(geometry, point, left, &mut ignored)?;
        left = Some(geometry.surface(reflection.mirror.surface).plane);
    }
    let is_blocked = geometry.visit_between([point, origin], left, |face| !ignored(&face));
    (!is_blocked).then_some(point - origin)
}

/// The same past surfaces that `passes`, with what is passed. Its shift is that of the image as it is seen from `from`.
///
/// Validation as for a straight way ([`Geometry::sight`]): the shifts of the legs are assumed and the chain is followed until both agree.
fn connect_through(
    geometry: &Geometry,
    chain: &[&Reflection],
    ends: [DVec3; 2],
    passes: &dyn Fn(SurfaceId) -> bool,
) -> Option<(DVec3, Sight)> {
    let mut assumed: SmallVec<[DVec3; 8]> = smallvec![DVec3::ZERO; chain.len() + 1];
    for _ in 0..MOST_ROUNDS {
        let seen = as_seen(geometry, chain, &assumed);
        let mut legs: SmallVec<[Sight; 8]> = smallvec![Sight::default(); chain.len() + 1];
        let leaving = follow_back(geometry, chain, ends, &seen, passes, &mut legs);
        let is_same = |(leg, assumed): (&Sight, &DVec3)| geometry.is_same_shift(leg.shift, *assumed);
        if legs.iter().zip(&assumed).all(is_same) {
            let surfaces = legs.iter().flat_map(|leg| leg.surfaces.iter().copied()).collect();
            let thickness = legs.iter().map(|leg| leg.thickness).sum();
            return leaving.map(|leaving| (leaving, Sight { surfaces, shift: seen[0], thickness }));
        }
        assumed = legs.iter().map(|leg| leg.shift).collect();
    }
    None
}

/// Follows `chain` backwards from `from`, where `shifts` is how far from where they are without partitions its images are seen on each leg,
/// and notes in `legs` what is passed.
fn follow_back(
    geometry: &Geometry,
    chain: &[&Reflection],
    [origin, mut from]: [DVec3; 2],
    shifts: &[DVec3],
    passes: &dyn Fn(SurfaceId) -> bool,
    legs: &mut [Sight],
) -> Option<DVec3> {
    let mut left = None;
    for ((Reflection { mirror, image, .. }, shift), sight) in chain.iter().zip(shifts).zip(&mut *legs) {
        let plane = geometry.surface(mirror.surface).plane;
        let leg = Leg { from, way: *image - *shift - from, left };
        let met = geometry.follow(leg, passes, |face| face.plane == plane, sight)??;
        if met.surface != mirror.surface || met.side != mirror.side {
            return None;
        }
        (from, left) = (met.place, Some(plane));
    }
    let way = origin - shifts[chain.len()] - from;
    geometry.follow(Leg { from, way, left }, passes, |_| false, &mut legs[chain.len()])?;
    Some(-way)
}

/// How far from where they are without partitions the images of a chain, the last mirror first, are seen on every leg, for the shift of each
/// [m]: what the legs behind a mirror shift is seen in it.
fn as_seen(geometry: &Geometry, chain: &[&Reflection], shifts: &[DVec3]) -> SmallVec<[DVec3; 8]> {
    let mut seen: SmallVec<[DVec3; 8]> = SmallVec::from_slice(shifts);
    for (leg, reflection) in chain.iter().enumerate().rev() {
        let normal = geometry.surface(reflection.mirror.surface).normal;
        let behind = seen[leg + 1].reflect(normal);
        seen[leg] += behind;
    }
    seen
}
