//! The record of one arrival: 16 bytes, the unit of the map.
//!
//! Position in f32 about the scene's centre, and one tag word holding surface, side and event. Direction, length,
//! order, history and energy follow from the sequence of vertices (docs/physics.md §2).

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use sonel_geometry::{Side, SurfaceId};

/// Event of a packet at an arrival. The codes are part of the file format; 4, 5 and 11 belonged to earlier ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Event {
    /// Mirror reflection.
    Specular = 0,
    /// Lambert reflection.
    Diffuse = 1,
    /// Straight on through a partition.
    Transmitted = 2,
    /// Into another air, through an interface.
    Refracted = 3,
    /// Sent on from an edge, in the paper's mode: all energy goes on.
    Diffracted = 6,
    /// Back from an interface between airs, as from a mirror.
    Returned = 7,
    /// Ended here by roulette on the surface's absorption.
    Absorbed = 8,
    /// Met no surface; the position is where it would be at the end of the run.
    Escaped = 9,
    /// Arrived here after the end of the run.
    Expired = 10,
    /// Met no surface in a closed room without cracks: a defect, counted.
    Lost = 12,
    /// Met no surface behind a partition, where the position is that at the end of the run, or entered one that has no other face there.
    Left = 13,
    /// Comes out of a partition with thickness, at the place on its other face that is opposite to where it entered.
    Emerged = 14,
    /// From here two packets go on, each with half of the energy: what follows up to an end is the first's path, then comes the second's.
    Split = 15,
}

impl Event {
    /// All events with their codes.
    pub const ALL: [Self; 13] = [
        Self::Specular,
        Self::Diffuse,
        Self::Transmitted,
        Self::Refracted,
        Self::Diffracted,
        Self::Returned,
        Self::Absorbed,
        Self::Escaped,
        Self::Expired,
        Self::Lost,
        Self::Left,
        Self::Emerged,
        Self::Split,
    ];

    #[inline]
    fn from_code(code: u32) -> Option<Self> {
        BY_CODE.get(code as usize).copied().flatten()
    }

    /// Whether the packet ends with this event.
    #[must_use]
    pub fn is_final(self) -> bool {
        (Self::Absorbed as u32..=Self::Left as u32).contains(&(self as u32))
    }

    /// Whether the packet arrived at a surface within the run, so that a sonel was left there.
    #[must_use]
    pub fn leaves_sonel(self) -> bool {
        use Event::{Absorbed, Diffuse, Specular, Transmitted};
        matches!(self, Specular | Diffuse | Transmitted | Absorbed)
    }

    /// Whether the packet met an interface between airs.
    #[inline]
    #[must_use]
    pub fn is_at_interface(self) -> bool {
        matches!(self, Self::Refracted | Self::Returned)
    }
}

/// Events by their codes.
const BY_CODE: [Option<Event>; 1 << EVENT_BITS] = {
    let mut table = [None; 1 << EVENT_BITS];
    let mut index = 0;
    while index < Event::ALL.len() {
        table[Event::ALL[index] as usize] = Some(Event::ALL[index]);
        index += 1;
    }
    table
};

const EVENT_BITS: u32 = 4;
const SIDE_BITS: u32 = 1;
/// Surfaces that a tag can name.
pub const SURFACE_LIMIT: u32 = 1 << (32 - EVENT_BITS - SIDE_BITS);

/// One arrival: 12 bytes of position and a tag. Laid out exactly as in the file.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    /// Position about the scene's centre [m].
    pub position: Vec3,
    tag: u32,
}

impl Vertex {
    /// An arrival at `surface` on `side`, ending in `event`.
    #[inline]
    #[must_use]
    pub fn new(position: Vec3, surface: SurfaceId, side: Side, event: Event) -> Self {
        assert!(surface.0 < SURFACE_LIMIT && position.is_finite());
        let side_bit = u32::from(side == Side::Back);
        Self { position, tag: surface.0 << (EVENT_BITS + SIDE_BITS) | side_bit << EVENT_BITS | event as u32 }
    }

    /// A packet sent on from `position` on edge number `edge` of those that diffract.
    #[inline]
    #[must_use]
    pub fn on_edge(position: Vec3, edge: u32) -> Self {
        Self::new(position, SurfaceId(edge), Side::Front, Event::Diffracted)
    }

    /// The end of a packet that met no surface, or where one is split.
    #[must_use]
    pub fn nowhere(position: Vec3, event: Event) -> Self {
        Self::new(position, SurfaceId(SURFACE_LIMIT - 1), Side::Front, event)
    }

    /// Event; [`None`] for a code that no version of the format knows.
    #[inline]
    #[must_use]
    pub fn event(&self) -> Option<Event> {
        Event::from_code(self.tag & ((1 << EVENT_BITS) - 1))
    }

    /// The surface that was met (meaningless where none was: escaped and lost packets; of diffracted ones the number of the edge).
    #[inline]
    #[must_use]
    pub fn surface(&self) -> SurfaceId {
        SurfaceId(self.tag >> (EVENT_BITS + SIDE_BITS))
    }

    /// The side on which the packet arrived.
    #[inline]
    #[must_use]
    pub fn side(&self) -> Side {
        if self.tag >> EVENT_BITS & 1 == 1 { Side::Back } else { Side::Front }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_returns_what_it_was_given_in_sixteen_bytes() {
        assert_eq!(size_of::<Vertex>(), 16);
        for event in Event::ALL {
            for side in [Side::Front, Side::Back] {
                let surface = SurfaceId(SURFACE_LIMIT - 2);
                let vertex = Vertex::new(Vec3::new(1.0, -2.0, 3.5), surface, side, event);
                assert_eq!((vertex.surface(), vertex.side(), vertex.event()), (surface, side, Some(event)));
            }
        }
    }

    #[test]
    fn unknown_event_codes_are_not_guessed() {
        for code in [4_u32, 5, 11] {
            let vertex: Vertex = bytemuck::cast([0, 0, 0, code]);
            assert_eq!(vertex.event(), None);
        }
    }
}
