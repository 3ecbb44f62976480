//! Checks that need walls, sources and receivers together.

use glam::DVec3;
use sonel_geometry::{Geometry, Misplaced, Obstacle};

use crate::report::Report;
use crate::scene::{Receiver, Source};
use crate::sections::points::{Placed, Spot};

/// Reports sources and receivers where sound cannot be, and tells what building the geometry changed.
pub(crate) fn inspect(
    geometry: Option<&Geometry>,
    sources: &[Placed<Source>],
    receivers: &[Placed<Receiver>],
    report: &Report,
) {
    let (sources, receivers) = (readable(sources), readable(receivers));
    // Without walls only equal positions are certainly too close.
    let too_close = geometry.map_or(0.0, |geometry| f64::from(geometry.resolution()));
    for (at, receiver) in &receivers {
        for (_, source) in sources.iter().filter(|(_, s)| s.position.distance(receiver.position) <= too_close)
        {
            let message =
                format!("{}: is the position of {}; move one of the two", receiver.path, source.path);
            report.problem(*at, message);
        }
    }
    let Some(geometry) = geometry else { return };
    let all_sources: Vec<DVec3> = sources.iter().map(|(_, source)| source.position).collect();
    for (at, Spot { position, path, .. }) in sources.iter().chain(&receivers) {
        if let Err(misplaced) = geometry.check_place(*position, &all_sources) {
            let remedy = swapped(geometry, *position, &misplaced).or_else(|| stated(*position, &misplaced));
            report.problem(*at, format!("{path}: {position} {misplaced}{}", remedy.unwrap_or_default()));
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

/// The line that makes air of the place, where it is off all surfaces.
fn stated(place: DVec3, misplaced: &Misplaced) -> Option<String> {
    let is_off = !matches!(misplaced.obstacle, Obstacle::Surface { .. });
    is_off.then(|| format!("; if sound is to be there, add the line air_at = [{place}]"))
}

/// The positions that could be read, and where they stand in the file.
fn readable<T>(placed: &[Placed<T>]) -> Vec<(usize, &Spot)> {
    placed.iter().filter_map(|placed| Some((placed.spot.at?, &placed.spot))).collect()
}
