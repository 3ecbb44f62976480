//! Checks that vertices refer to existing surfaces, edges and interfaces.

use sonel_scene::Media;

use crate::edges;
use crate::format::EdgeRow;
use crate::vertex::{EdgePlace, Event, Vertex};

/// What paths may name: surfaces, of which there are so many, and edges.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Places<'a> {
    pub surfaces: u32,
    pub edges: &'a [EdgeRow],
    pub media: Option<&'a Media>,
}

impl Places<'_> {
    /// Whether `vertex` is where its event can be: at a wall, at an interface, anywhere.
    fn hold(&self, vertex: &Vertex, event: Event) -> bool {
        let surface = vertex.surface();
        let is_interface = || self.media.is_some_and(|media| media.across(surface, vertex.side()).is_some());
        match (event.is_at_interface(), event.leaves_sonel()) {
            (true, _) => surface.0 < self.surfaces && is_interface(),
            (false, true) => surface.0 < self.surfaces && !is_interface(),
            (false, false) => true,
        }
    }
}

/// Whether a path keeps the rules of the format.
pub(crate) fn is_sound_path(path: &[Vertex], places: Places<'_>) -> bool {
    let Some((last, before)) = path.split_last() else { return false };
    let sound = |vertex: &Vertex, is_final: bool| {
        vertex.event().is_some_and(|event| {
            event.is_final() == is_final
                && places.hold(vertex, event)
                && (!event.is_at_edge() || is_sound_passing(event, vertex.at(), places.edges))
        }) && vertex.position.is_finite()
    };
    sound(last, true) && before.iter().all(|vertex| sound(vertex, false))
}

/// Whether the edge exists, the place lies on it, and only what is bent has an angle.
fn is_sound_passing(event: Event, (edge, place): (u32, EdgePlace), edges: &[EdgeRow]) -> bool {
    let is_on = |row: &EdgeRow| {
        let along = f64::from(place.along);
        along >= 0.0 && along <= edges::length(row) * (1.0 + f64::from(f32::EPSILON))
    };
    edges.get(edge as usize).is_some_and(is_on)
        && place.distance > 0.0
        && (event == Event::Bent || place.tangent.abs() <= 0.0)
}
