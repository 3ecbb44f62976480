//! What can only be judged once walls, sources and receivers are known together.

use glam::DVec3;
use sonel_geometry::Geometry;

use crate::report::Report;
use crate::scene::{Receiver, Source};
use crate::sections::points::Placed;

/// Positions in the file, where and under which key.
struct Position {
    position: DVec3,
    at: usize,
    path: String,
}

/// Reports sources and receivers where sound cannot be, and tells what building the geometry changed.
pub(crate) fn inspect(
    geometry: Option<&Geometry>,
    sources: &[Placed<Source>],
    receivers: &[Placed<Receiver>],
    report: &mut Report<'_>,
) {
    let sources = positions(sources, |source| source.position);
    let receivers = positions(receivers, |receiver| receiver.position);
    // Without walls only equal positions are certainly too close.
    let too_close = geometry.map_or(0.0, |geometry| f64::from(geometry.resolution()));
    for receiver in &receivers {
        for source in sources.iter().filter(|s| s.position.distance(receiver.position) <= too_close) {
            let message =
                format!("{}: is the position of {}; move one of the two", receiver.path, source.path);
            report.problem(receiver.at, message);
        }
    }
    let Some(geometry) = geometry else { return };
    for Position { position, at, path } in sources.iter().chain(&receivers) {
        if geometry.distance_to_nearest_surface(*position) <= too_close {
            report.problem(*at, format!("{path}: {position} lies on a wall; move it into the room"));
        } else if geometry.is_closed_room() && !geometry.contains(*position) {
            let (lowest, highest) = geometry.bounds();
            let message = format!(
                "{path}: {position} is outside the room; it extends from {lowest} to {highest} m (a closed object in the \
                 open needs what it stands on)"
            );
            report.problem(*at, message);
        }
    }
}

fn positions<T>(placed: &[Placed<T>], position: impl Fn(&T) -> DVec3) -> Vec<Position> {
    let of = |placed: &Placed<T>| {
        let at = placed.position_at?;
        Some(Position { position: position(&placed.point), at, path: placed.position_path.clone() })
    };
    placed.iter().filter_map(of).collect()
}
