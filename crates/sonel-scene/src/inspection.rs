//! Checks that need walls, sources and receivers together.

use glam::DVec3;
use sonel_geometry::{Geometry, Misplaced, Obstacle};

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
    let all_sources: Vec<DVec3> = sources.iter().map(|source| source.position).collect();
    for Position { position, at, path } in sources.iter().chain(&receivers) {
        if let Err(misplaced) = geometry.check_place(*position, &all_sources) {
            let swapped = swapped(geometry, *position, &misplaced).unwrap_or_default();
            report.problem(*at, format!("{path}: {position} {misplaced}{swapped}"));
        }
    }
}

/// Says so where a place outside the room is inside with y and z swapped, as between programs with different axes up.
fn swapped(geometry: &Geometry, place: DVec3, misplaced: &Misplaced) -> Option<String> {
    if !matches!(misplaced.obstacle, Obstacle::Hull { .. }) {
        return None;
    }
    let DVec3 { x, y, z } = place;
    let turned = [[x, z, y], [x, z, -y], [x, -z, y]].map(DVec3::from_array);
    let inside = turned.into_iter().find(|&place| geometry.check_place(place, &[]).is_ok())?;
    Some(format!(
        "; with y and z swapped, {inside} m, it is inside: give positions in the axes of the mesh, and mesh_up = \"y\" where y is up"
    ))
}

fn positions<T>(placed: &[Placed<T>], position: impl Fn(&T) -> DVec3) -> Vec<Position> {
    let of = |placed: &Placed<T>| {
        let at = placed.position_at?;
        Some(Position { position: position(&placed.point), at, path: placed.position_path.clone() })
    };
    placed.iter().filter_map(of).collect()
}
