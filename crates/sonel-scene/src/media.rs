//! Regions of other air in a scene, and the air on each side of every interface.
//!
//! Air 0 is that of the scene, air i + 1 that of region i. A region is the air that a point in it is connected with, past walls and
//! interfaces alike. Walks in random directions find it: two places are in one air where a straight way or a walk leads from one to the other,
//! which is exact; a side of an interface from which no walk finds a region has the scene's air.
//!
//! References: docs/formats/scene.md, docs/physics.md §3.

use std::fmt;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use sonel_acoustics::Air;
use sonel_geometry::{Departure, Geometry, Side, SurfaceId};

use crate::notation;
use crate::walk::Walk;

/// The sides of a surface that is no interface.
pub const NO_AIR: u32 = u32::MAX;

/// Steps of a walk that looks for known places.
const STEPS: u32 = 512;
/// Places of a walk that are known from then on.
const KNOWN_PLACES: usize = 64;
/// Known places of each air looked for at a step.
const LOOKS: usize = 4;
/// Surfaces that a straight line passes at most.
const MOST_PARTS: u32 = 1024;
/// Steps of the walk that tells in which air a place is.
const LONG_STEPS: u32 = 4096;

/// A part of the room with an air of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Name, unique among the regions.
    pub name: String,
    /// A point in it [m].
    pub inside: DVec3,
    /// State of its air.
    pub air: Air,
    /// Speed of sound [m/s].
    pub speed_of_sound: f64,
    /// Density [kg/m³].
    pub density: f64,
    /// Energy attenuation m per band [1/m].
    pub air_attenuation: Vec<f64>,
}

/// Regions and interfaces of a scene that has more than one air.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Media {
    /// The regions.
    pub regions: Vec<Region>,
    /// Materials whose faces are interfaces.
    pub interfaces: Vec<u32>,
    /// For each surface of the geometry the airs in front of it and behind; [`NO_AIR`] where it is no interface.
    pub sides: Vec<[u32; 2]>,
    /// The air at each source.
    pub at_sources: Vec<u32>,
}

impl Media {
    /// Whether the faces of `material` are interfaces.
    #[must_use]
    pub fn is_interface(&self, material: u32) -> bool {
        self.interfaces.contains(&material)
    }

    /// The airs on the side of an interface that a path arrives on and beyond it; none where `surface` is a wall.
    #[inline]
    #[must_use]
    pub fn across(&self, surface: SurfaceId, side: Side) -> Option<[u32; 2]> {
        let [front, back] = self.sides[surface.0 as usize];
        (front != NO_AIR).then_some(match side {
            Side::Front => [front, back],
            Side::Back => [back, front],
        })
    }

    /// The airs on the straight line from a world position in the given air to another [m], with the lengths of its parts [m]. Walls are
    /// passed as if they were not there.
    #[must_use]
    pub fn parts_between(
        &self,
        geometry: &Geometry,
        (from, mut air): (DVec3, u32),
        to: DVec3,
    ) -> Vec<(u32, f64)> {
        let direction = (to - from).as_vec3().normalize_or_zero();
        let end = geometry.to_local(to);
        let (mut parts, mut at) = (Vec::new(), Departure::free(geometry.to_local(from)));
        let mut done = 0.0;
        let total = from.distance(to);
        for _ in 0..MOST_PARTS {
            if !geometry.is_blocked(at, end) {
                break;
            }
            let Some(hit) = geometry.closest_hit(at, direction) else { break };
            let reached = geometry.to_world(hit.position).distance(from).min(total);
            parts.push((air, reached - done));
            done = reached;
            air = self.across(hit.surface, hit.side).map_or(air, |[_, beyond]| beyond);
            at = geometry.leave(hit.position, hit.surface, hit.side.opposite());
        }
        parts.push((air, total - done));
        parts
    }

    /// The air at a world position [m]: of the first region whose point a walk from there sees, or that on the side of the first interface it
    /// meets; the scene's where it finds neither.
    #[must_use]
    pub fn air_at(&self, geometry: &Geometry, place: DVec3) -> u32 {
        let mut walk = Walk::new(geometry, geometry.to_local(place));
        let found = (0..LONG_STEPS).find_map(|_| {
            let sees = |region: &Region| walk.sees(geometry.to_local(region.inside));
            let seen = self.regions.iter().position(sees).map(|region| region as u32 + 1);
            let mut met = || walk.step().and_then(|hit| self.across(hit.surface, hit.side));
            seen.or_else(|| met().map(|[here, _]| here))
        });
        found.unwrap_or(0)
    }
}

/// What is wrong with regions and interfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MediaFault {
    /// Nothing is between two regions.
    OneSpace {
        /// Their indices.
        regions: [usize; 2],
    },
    /// No interface bounds a region.
    Unbounded {
        /// Its index.
        region: usize,
    },
    /// An interface has the same air on both sides.
    BoundsNothing {
        /// Its material.
        material: u32,
        /// A point on it [m].
        place: DVec3,
        /// The air.
        air: u32,
    },
    /// One side of an interface has two airs.
    TwoAirs {
        /// Its material.
        material: u32,
        /// A point on it [m].
        place: DVec3,
    },
}

impl fmt::Display for MediaFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OneSpace { .. } => {
                write!(f, "no interface is between both regions: put one between, or give one region only")
            }
            Self::Unbounded { .. } => write!(
                f,
                "no interface bounds the region: give its border a material with interface = true, or move `inside` into it"
            ),
            Self::BoundsNothing { place, air: 0, .. } => write!(
                f,
                "the interface at ({}) m has the air of the scene on both sides: give [[regions]] with a point inside, or remove the face",
                notation::place(*place)
            ),
            Self::BoundsNothing { place, .. } => write!(
                f,
                "the interface at ({}) m has the same region on both sides: close the gap around it, or remove the face",
                notation::place(*place)
            ),
            Self::TwoAirs { place, .. } => write!(
                f,
                "the interface at ({}) m has two airs on one side: divide the face where they meet and give its parts different materials",
                notation::place(*place)
            ),
        }
    }
}

/// Finds the airs on both sides of every surface of `geometry` for regions with points `inside` [m].
///
/// # Errors
/// Everything that is wrong.
pub fn find_sides(geometry: &Geometry, inside: &[DVec3]) -> Result<Vec<[u32; 2]>, Vec<MediaFault>> {
    let mut spaces = Spaces { geometry, spaces: Vec::new() };
    let mut faults = Vec::new();
    let mut is_apart = vec![true; inside.len()];
    for (region, &place) in inside.iter().enumerate() {
        let (found, walked) = spaces.find(geometry.to_local(place));
        match found {
            Some(air) => {
                is_apart[region] = false;
                faults.push(MediaFault::OneSpace { regions: [air as usize - 1, region] });
            }
            None => spaces.spaces.push(Space { air: region as u32 + 1, places: walked }),
        }
    }
    let mut sides = vec![[NO_AIR; 2]; geometry.surfaces().len()];
    for (surface, sides) in
        geometry.surfaces().iter().zip(&mut sides).filter(|(surface, _)| surface.interface)
    {
        let (material, place) = (surface.material, surface.centroid);
        match surface.triangles.iter().find_map(|&triangle| spaces.add_sides(triangle, sides)) {
            Some(place) => faults.push(MediaFault::TwoAirs { material, place }),
            None if sides[0] == sides[1] => {
                faults.push(MediaFault::BoundsNothing { material, place, air: sides[0] });
            }
            None => {}
        }
    }
    let bounds = |region: usize| sides.iter().flatten().any(|&side| side == region as u32 + 1);
    let unbounded = (0..inside.len()).filter(|&region| is_apart[region] && !bounds(region));
    faults.extend(unbounded.map(|region| MediaFault::Unbounded { region }));
    if faults.is_empty() { Ok(sides) } else { Err(faults) }
}

/// Places that are known to be in one air.
struct Space {
    air: u32,
    places: Vec<Vec3>,
}

/// All spaces found so far.
struct Spaces<'a> {
    geometry: &'a Geometry,
    spaces: Vec<Space>,
}

impl Spaces<'_> {
    /// Finds the airs on both sides of a triangle of an interface whose surface has `sides`; where these are others already.
    fn add_sides(&mut self, triangle: u32, sides: &mut [u32; 2]) -> Option<DVec3> {
        let surface = self.geometry.triangle_surface(triangle);
        let corners = self.geometry.mesh().corners(triangle);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let places = corners.map(|corner| middle.lerp(corner, 0.75));
        for place in [middle].into_iter().chain(places) {
            for (side, known) in [Side::Front, Side::Back].into_iter().zip(sides.iter_mut()) {
                let from = self.geometry.leave(self.geometry.to_local(place), surface, side);
                let air = self.air_about(from.origin);
                if *known != NO_AIR && *known != air {
                    return Some(place);
                }
                *known = air;
            }
        }
        None
    }

    /// The air about a local position [m]; a space that is new has the scene's.
    fn air_about(&mut self, place: Vec3) -> u32 {
        let (found, walked) = self.find(place);
        found.unwrap_or_else(|| {
            self.spaces.push(Space { air: 0, places: walked });
            0
        })
    }

    /// The air of the known space that a walk from a local position [m] finds, and places of that walk.
    fn find(&self, place: Vec3) -> (Option<u32>, Vec<Vec3>) {
        let mut walk = Walk::new(self.geometry, place);
        let mut walked = vec![place];
        for step in 0..STEPS as usize {
            for space in &self.spaces {
                let looked_for =
                    (0..LOOKS).map(|look| space.places[(step * LOOKS + look) % space.places.len()]);
                if looked_for.into_iter().any(|place| walk.sees(place)) {
                    return (Some(space.air), walked);
                }
            }
            walk.step();
            if step % (STEPS as usize / KNOWN_PLACES) == 0 {
                walked.push(walk.at);
            }
        }
        (None, walked)
    }
}
