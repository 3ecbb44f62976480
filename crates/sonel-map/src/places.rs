//! Checks that vertices refer to existing surfaces and interfaces.

use sonel_scene::Media;

use crate::vertex::{Event, Vertex};

/// Numbers of surfaces that paths may name.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Places<'a> {
    pub surfaces: u32,
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
    let mut under_way = 1_u64;
    let sound = path.iter().all(|vertex| {
        let Some(event) = vertex.event().filter(|_| under_way > 0) else { return false };
        under_way += u64::from(event == Event::Split);
        under_way -= u64::from(event.is_final());
        places.hold(vertex, event) && vertex.position.is_finite()
    });
    sound && under_way == 0
}
