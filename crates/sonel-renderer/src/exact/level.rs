//! L S^k R where the speed of sound has a gradient and all reflections are at one level: exact, along arcs from reflection to reflection.

use core::f64::consts::PI;

use glam::DVec3;
use sonel_geometry::{Departure, Geometry, Hops, PlaneId, SpeedProfile, SurfaceId};
use sonel_map::CoefficientTable;

use crate::exact::direct::DirectWay;
use crate::partition::Partitions;

/// Least cosine between the normal of a level surface and the rise of the speed of sound: 0.05 mrad, as rounding leaves it.
const LEVEL: f64 = 1.0 - 1e-9;

/// Surfaces across the rise of the speed of sound.
pub(crate) struct Levels {
    profile: SpeedProfile,
    rise: DVec3,
    /// The plane of each surface that is level.
    planes: Vec<Option<PlaneId>>,
    /// These planes and their heights along the rise, about the scene's centre [m].
    heights: Vec<(PlaneId, f64)>,
}

impl Levels {
    /// The level surfaces of `geometry` in air with this profile.
    #[must_use]
    pub(crate) fn new(geometry: &Geometry, profile: SpeedProfile) -> Self {
        let rise = profile.gradient().normalize();
        let (mut planes, mut heights) = (Vec::new(), Vec::new());
        for surface in geometry.surfaces() {
            let cosine = surface.normal.dot(rise);
            let is_level = cosine.abs() > LEVEL;
            planes.push(is_level.then_some(surface.plane));
            if is_level {
                let offset = surface.offset - surface.normal.dot(geometry.center());
                heights.push((surface.plane, offset * cosine.signum()));
            }
        }
        heights.sort_by_key(|(plane, _)| *plane);
        heights.dedup_by_key(|(plane, _)| *plane);
        Self { profile, rise, planes, heights }
    }

    /// The level of a surface; none where it is inclined.
    pub(crate) fn of(&self, surface: SurfaceId) -> Option<PlaneId> {
        self.planes[surface.0 as usize]
    }

    /// The ways from source to receiver (both about the scene's centre [m]) over reflections at one level.
    pub(crate) fn ways(
        &self,
        geometry: &Geometry,
        table: &CoefficientTable,
        ends: [DVec3; 2],
    ) -> Vec<DirectWay> {
        let at_level = |&(plane, height): &(PlaneId, f64)| {
            let found = self.profile.hops(ends[0], ends[1], height);
            found.into_iter().filter_map(move |hops| {
                let stops = self.stops(ends, height, &hops);
                let way = self.follow(geometry, table, &stops, plane)?;
                Some(DirectWay { spread: hops.spread / (4.0 * PI), ..way })
            })
        };
        self.heights.iter().flat_map(at_level).collect()
    }

    /// Source, places of reflection and receiver.
    fn stops(&self, [source, receiver]: [DVec3; 2], height: f64, hops: &Hops) -> Vec<DVec3> {
        let level = |place: DVec3| place.reject_from_normalized(self.rise);
        let aside = level(receiver) - level(source);
        let heading = aside.try_normalize().unwrap_or(self.rise.any_orthonormal_vector());
        let reflection = |number: u32| {
            let way = hops.first + f64::from(number) * hops.between;
            level(source) + way * heading + height * self.rise
        };
        std::iter::once(source).chain((0..hops.reflections).map(reflection)).chain([receiver]).collect()
    }

    /// The way from stop to stop, without its spread, if nothing is on it and all stops but the ends are on surfaces of `plane`.
    fn follow(
        &self,
        geometry: &Geometry,
        table: &CoefficientTable,
        stops: &[DVec3],
        plane: PlaneId,
    ) -> Option<DirectWay> {
        let lift = 2.0 * f64::from(geometry.lift());
        let (mut from, mut length, mut directions) = (stops[0].as_vec3(), 0.0, Vec::new());
        let (mut passed, mut mirrors) = (Partitions::default(), Vec::new());
        for (number, ends) in (2..).zip(stops.windows(2)) {
            let leg = table.propagation().leg(ends[0], ends[1])?;
            let arriving = leg.arc.direction(leg.time);
            directions.extend([leg.arc.direction(0.0), arriving]);
            length += leg.length;
            let is_last = number == stops.len();
            let back = -arriving.dot(self.rise).signum() * self.rise;
            let to = if is_last { ends[1] } else { ends[1] + lift * back }.as_vec3();
            passed.extend(Partitions::along(geometry, table, from, &leg, to)?);
            if !is_last {
                // Straight down from there the level is met at that place or nowhere.
                let hit = geometry.closest_hit(Departure::free(to), -back.as_vec3())?;
                mirrors.push(Some(hit.surface).filter(|met| self.of(*met) == Some(plane))?);
            }
            from = to;
        }
        let (departing, towards) = (directions[0], -directions[directions.len() - 1]);
        Some(DirectWay { length, departing, towards, spread: 0.0, passed, mirrors })
    }
}
