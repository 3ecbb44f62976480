//! Regions of other air in a scene, and the air on each side of every interface.
//!
//! Air 0 is that of the scene, air i + 1 that of region i. A region is all air that a point in it is connected with; walls and
//! interfaces alike bound it. What is in no region has the scene's air.
//!
//! References: docs/formats/scene.md, docs/physics.md §3.

use std::fmt;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use sonel_acoustics::Air;
use sonel_geometry::{Departure, Geometry, Regions, Side, SurfaceId};

use crate::notation;

/// The sides of a surface that is no interface.
pub const NO_AIR: u32 = u32::MAX;

/// Most surfaces that a straight line passes. It ends lines that find the same surface for ever.
const MOST_PARTS: u32 = 1024;

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
    /// The regions of `geometry`, bounded by the faces of the materials `interfaces`, with the airs at `sources` [m].
    ///
    /// # Errors
    /// Everything that is wrong with regions and interfaces.
    pub fn find(
        geometry: &Geometry,
        regions: Vec<Region>,
        interfaces: Vec<u32>,
        sources: &[DVec3],
    ) -> Result<Self, Vec<MediaFault>> {
        let inside: Vec<DVec3> = regions.iter().map(|region| region.inside).collect();
        let (sides, airs) = find_sides(geometry, &inside)?;
        let at_sources = sources.iter().map(|&source| airs.at(source)).collect();
        Ok(Self { regions, interfaces, sides, at_sources })
    }

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
        from: DVec3,
        mut air: u32,
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

    /// The airs of a scene by place.
    #[must_use]
    pub fn airs<'a>(&self, geometry: &'a Geometry) -> Airs<'a> {
        Airs::new(geometry, self.regions.iter().map(|region| region.inside))
    }
}

/// The air at every place.
pub struct Airs<'a> {
    spaces: Regions<'a>,
    /// The space of each region of the scene.
    of_region: Vec<u32>,
}

impl<'a> Airs<'a> {
    fn new(geometry: &'a Geometry, inside: impl Iterator<Item = DVec3>) -> Self {
        let spaces = geometry.regions(|_| false);
        let of_region = inside.map(|place| spaces.at(place)).collect();
        Self { spaces, of_region }
    }

    /// The air at a world position [m].
    #[must_use]
    pub fn at(&self, place: DVec3) -> u32 {
        self.of_space(self.spaces.at(place))
    }

    fn of_space(&self, space: u32) -> u32 {
        self.of_region.iter().position(|&of| of == space).map_or(0, |region| region as u32 + 1)
    }
}

/// Faults of regions and interfaces.
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
fn find_sides<'a>(
    geometry: &'a Geometry,
    inside: &[DVec3],
) -> Result<(Vec<[u32; 2]>, Airs<'a>), Vec<MediaFault>> {
    let airs = Airs::new(geometry, inside.iter().copied());
    let first_in = |region: usize| airs.of_region.iter().position(|of| *of == airs.of_region[region]);
    let doubled = (0..inside.len()).filter_map(|region| {
        let first = first_in(region).filter(|first| *first < region)?;
        Some(MediaFault::OneSpace { regions: [first, region] })
    });
    let mut faults: Vec<MediaFault> = doubled.collect();
    let mut sides = vec![[NO_AIR; 2]; geometry.surfaces().len()];
    for (surface, sides) in
        geometry.surfaces().iter().zip(&mut sides).filter(|(surface, _)| surface.interface)
    {
        let of_triangle = |triangle: &u32| airs.spaces.beside(*triangle).map(|space| airs.of_space(space));
        *sides = of_triangle(&surface.triangles[0]);
        let (material, place) = (surface.material, surface.centroid);
        match surface.triangles.iter().find(|triangle| of_triangle(triangle) != *sides) {
            Some(&triangle) => {
                let [a, b, c] = geometry.mesh().corners(triangle);
                faults.push(MediaFault::TwoAirs { material, place: (a + b + c) / 3.0 });
            }
            None if sides[0] == sides[1] => {
                faults.push(MediaFault::BoundsNothing { material, place, air: sides[0] });
            }
            None => {}
        }
    }
    let bounds = |region: usize| sides.iter().flatten().any(|&side| side == region as u32 + 1);
    let unbounded = (0..inside.len()).filter(|&region| first_in(region) == Some(region) && !bounds(region));
    faults.extend(unbounded.map(|region| MediaFault::Unbounded { region }));
    if faults.is_empty() { Ok((sides, airs)) } else { Err(faults) }
}
