//! Propagation between surfaces: along straight lines in even air and in regions of different air, along arcs where the speed of sound has
//! a gradient.
//!
//! Lengths of paths are travel times times the speed of sound c₀ of the scene [m]. Places are about the scene's centre [m].
//!
//! References: docs/physics.md §3, [Salomons2001] (docs/references.md).

use glam::{DVec3, Vec3};
use sonel_geometry::{Arc, Departure, Geometry, Hit, Side, SpeedProfile, SurfaceId};

use crate::media::Media;
use crate::scene::Scene;

/// Propagation of sound in a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Propagation {
    /// One air: straight lines.
    Even,
    /// Regions of different air: straight lines from interface to interface.
    Regions(Regions),
    /// A speed of sound with a gradient: arcs.
    Gradient(Gradient),
}

/// Regions of different air, by the number of the air.
#[derive(Clone, Debug, PartialEq)]
pub struct Regions {
    media: Media,
    sides: Vec<AirSide>,
    stretches: Vec<f64>,
}

/// A speed of sound with a gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient {
    profile: SpeedProfile,
    /// c₀ [m/s].
    speed_of_sound: f64,
}

/// An air as an interface sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirSide {
    /// Speed of sound [m/s].
    pub speed_of_sound: f64,
    /// ρc [Pa·s/m].
    pub impedance: f64,
}

/// An interface: first the air that sound arrives in, then that beyond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface {
    /// Numbers of the airs.
    pub airs: [u32; 2],
    /// States of the airs.
    pub sides: [AirSide; 2],
}

/// Position and direction of a packet.
#[derive(Debug, Clone, Copy)]
pub struct Flight {
    /// Last vertex.
    pub position: DVec3,
    /// Start of the ray that leaves it.
    pub departure: Departure,
    /// Unit direction there.
    pub direction: Vec3,
    /// Path length since emission [m].
    pub length: f64,
    /// Number of the air that it is in.
    pub air: u32,
}

/// The arc between two places.
#[derive(Debug, Clone, Copy)]
pub struct Leg {
    /// The arc.
    pub arc: Arc,
    /// Travel time [s].
    pub time: f64,
    /// Path length [m].
    pub length: f64,
    /// Solid angle at its beginning of the rays through a unit area across them at its end [1/m²].
    pub spread: f64,
}

impl Propagation {
    /// Propagation in `scene`, whose middle is `center` [m].
    #[must_use]
    pub fn of(scene: &Scene, center: DVec3) -> Self {
        let speed_of_sound = scene.speed_of_sound;
        match (scene.profile(center), &scene.media) {
            (Some(profile), _) => Self::Gradient(Gradient { profile, speed_of_sound }),
            (None, None) => Self::Even,
            (None, Some(media)) => {
                let stretches = scene.stretches();
                let side = |(impedance, stretch): (f64, &f64)| AirSide {
                    speed_of_sound: speed_of_sound / stretch,
                    impedance,
                };
                let sides = scene.impedances().into_iter().zip(&stretches).map(side).collect();
                Self::Regions(Regions { media: media.clone(), sides, stretches })
            }
        }
    }

    /// Whether paths are straight.
    #[inline]
    #[must_use]
    pub fn is_straight(&self) -> bool {
        !matches!(self, Self::Gradient(_))
    }

    /// How the speed of sound changes; none in even air and in regions.
    #[must_use]
    pub fn profile(&self) -> Option<SpeedProfile> {
        let Self::Gradient(gradient) = self else { return None };
        Some(gradient.profile)
    }

    /// Path length from one place to another that is seen from it, in `air` [m].
    #[inline]
    #[must_use]
    pub fn length(&self, air: u32, from: DVec3, to: DVec3) -> f64 {
        match self {
            Self::Even => from.distance(to),
            Self::Regions(regions) => from.distance(to) * regions.stretches[air as usize],
            Self::Gradient(gradient) => gradient.profile.travel_time(from, to) * gradient.speed_of_sound,
        }
    }

    /// c₀/c at a place in `air`.
    #[inline]
    #[must_use]
    pub fn stretch(&self, air: u32, place: DVec3) -> f64 {
        match self {
            Self::Even => 1.0,
            Self::Regions(regions) => regions.stretches[air as usize],
            Self::Gradient(gradient) => gradient.speed_of_sound / gradient.profile.speed_at(place),
        }
    }

    /// The interface that sound meets on a `side` of `surface`; [`None`] where that is a wall.
    #[inline]
    #[must_use]
    pub fn interface(&self, surface: SurfaceId, side: Side) -> Option<Interface> {
        let Self::Regions(regions) = self else { return None };
        let airs = regions.media.across(surface, side)?;
        Some(Interface { airs, sides: airs.map(|air| regions.sides[air as usize]) })
    }

    /// The leg from one place to another, where it is an arc; [`None`] where it is straight.
    #[inline]
    #[must_use]
    pub fn leg(&self, from: DVec3, to: DVec3) -> Option<Leg> {
        let Self::Gradient(Gradient { profile, speed_of_sound }) = self else { return None };
        let time = profile.travel_time(from, to);
        let (arc, spread) = (Arc::between(*profile, from, to), profile.spread(from, to));
        Some(Leg { arc, time, length: time * speed_of_sound, spread })
    }

    /// What a packet meets that ends at `reach` [m]. On an arc it then goes in the direction that it has there; in a closed room the arc is
    /// followed beyond the end of the run.
    #[inline]
    pub fn advance(&self, geometry: &Geometry, flight: &mut Flight, reach: f64) -> Option<Hit> {
        match self {
            Self::Even | Self::Regions(_) => geometry.closest_hit(flight.departure, flight.direction),
            Self::Gradient(gradient) => gradient.advance(geometry, flight, reach),
        }
    }

    /// Position at `reach` [m] of a packet that meets nothing.
    #[must_use]
    pub fn end(&self, flight: &Flight, reach: f64) -> Vec3 {
        let remaining = reach - flight.length;
        match self {
            Self::Even | Self::Regions(_) => {
                let stretch = self.stretch(flight.air, flight.position);
                flight.departure.origin + flight.direction * (remaining / stretch) as f32
            }
            Self::Gradient(gradient) => {
                gradient.arc(flight).at(remaining / gradient.speed_of_sound).as_vec3()
            }
        }
    }
}

impl Gradient {
    fn arc(&self, flight: &Flight) -> Arc {
        Arc::leaving(self.profile, flight.position, flight.direction.as_dvec3().normalize())
    }

    /// See [`Propagation::advance`]: chord by chord.
    fn advance(&self, geometry: &Geometry, flight: &mut Flight, reach: f64) -> Option<Hit> {
        let (profile, arc) = (&self.profile, self.arc(flight));
        let remaining = (reach - flight.length) / self.speed_of_sound;
        let limit = if geometry.is_watertight() { remaining + profile.longest_time() } else { remaining };
        let (mut from, mut time) = (flight.departure.origin, 0.0);
        while time < limit {
            let end = arc.chord_end(time);
            let to = arc.at(end).as_vec3();
            if let Some(hit) = geometry.hit_on_chord(from, to) {
                let passed = profile.travel_time(flight.position, hit.position.as_dvec3());
                // The arc meets the surface elsewhere than its chord: with another direction, which many reflections would add up.
                let surface = geometry.surface(hit.surface);
                let offset = surface.offset - surface.normal.dot(geometry.center());
                let missing = offset - surface.normal.dot(arc.at(passed));
                let approach = surface.normal.dot(arc.direction(passed)) * profile.speed_at(arc.at(passed));
                let later = Some(missing / approach).filter(|later| later.abs() < end - time).unwrap_or(0.0);
                flight.direction = arc.direction(passed + later).as_vec3();
                return Some(hit);
            }
            (from, time) = (to, end);
        }
        None
    }
}
