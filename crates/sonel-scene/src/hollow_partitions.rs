//! Partitions with thickness that are drawn as two faces on a floor that runs through: what is between the faces is the inside of a side.
//!
//! Where floor, ceiling and side walls run through under a partition, the space between its faces is a cell of air like a room, in which sound
//! would be reflected and absorbed. Then all other cells of air are stated to be the air, as a scene file may, so that this one is solid. So both
//! drawings of a wall are one.
//!
//! A cell is the inside of a partition if no source is in it, it is at most [`THICKEST_PARTITION`] deep, and most of what it shows to other air
//! are faces that transmit, each opposite a parallel one.
//!
//! References: docs/physics.md §3, docs/formats/scene.md.

use std::collections::BTreeMap;

use glam::DVec3;
use sonel_geometry::{FaceKind, Geometry, Side, SurfaceId, THICKEST_PARTITION};

use crate::notation::{number, place};
use crate::report::{NoteKind, Report};
use crate::sections::walls::Walls;

/// Least share of the faces towards other air that have an opposite one [1]. Chosen: at the end of an oblique wall, and about a corner, less of one
/// face is opposite the other.
const LEAST_OPPOSITE: f64 = 0.5;
/// Cosine between normals from which on two faces are parallel.
const PARALLEL: f64 = 1.0 - 1e-6;

/// Closes off all insides of partitions of `walls`, whose geometry is `geometry`, with faces of some `kind` by their material: the geometry
/// afterwards, and in `air_at` where it has air.
pub(crate) fn close_off(
    walls: &Walls,
    geometry: Geometry,
    kind: impl Fn(u32) -> FaceKind,
    air_at: &mut Vec<DVec3>,
    sources: &[DVec3],
    report: &Report,
) -> Geometry {
    let passes = |surface: SurfaceId| kind(geometry.surface(surface).material) == FaceKind::Partition;
    let cells = geometry.air_cells();
    let mut sides = sides_to_air(&geometry);
    let mut airs = Vec::new();
    for &cell in &cells {
        let sides = sides.remove(&cell.number).unwrap_or_default();
        let thickness = thickness(&geometry, cell.volume, &sides, &passes);
        let has_source = || sources.iter().any(|&source| geometry.cell_at(source) == cell.number);
        let Some(thickness) = thickness.filter(|_| !has_source()) else {
            airs.push(cell.place);
            continue;
        };
        report.note_of(
            NoteKind::Repair,
            format!(
                "{}: the space about ({}) m between faces that transmit, {} m deep, is the inside of a partition: none of its floor, ceiling \
                 and side walls counts",
                walls.path,
                place(cell.place),
                number(thickness)
            ),
        );
    }
    if airs.len() == cells.len() {
        return geometry;
    }
    *air_at = airs;
    Geometry::with_kinds(walls.mesh.clone(), kind, air_at).expect("the mesh has triangles")
}

/// A side of a triangle with its surface.
type ShownSide = (SurfaceId, u32, Side);

/// The sides of triangles that each cell shows to other air.
fn sides_to_air(geometry: &Geometry) -> BTreeMap<u32, Vec<ShownSide>> {
    let mut shown: BTreeMap<u32, Vec<ShownSide>> = BTreeMap::new();
    for surface in (0..geometry.surfaces().len() as u32).map(SurfaceId) {
        let beside: Vec<u32> = geometry.cells_beside(surface).collect();
        for (cells, &triangle) in beside.chunks(2).zip(&geometry.surface(surface).triangles) {
            if cells[0] != cells[1] && cells.iter().all(|&cell| geometry.is_air_cell(cell)) {
                for (cell, side) in cells.iter().zip([Side::Front, Side::Back]) {
                    shown.entry(*cell).or_default().push((surface, triangle, side));
                }
            }
        }
    }
    shown
}

/// Depth of the partition that a cell of a `volume` [m³] with such `sides` is the inside of [m].
fn thickness(
    geometry: &Geometry,
    volume: f64,
    sides: &[ShownSide],
    passes: &impl Fn(SurfaceId) -> bool,
) -> Option<f64> {
    let area = |&(_, triangle, _): &ShownSide| geometry.mesh().vector_area(triangle).length();
    let is_opposite = |&&(surface, triangle, side): &&ShownSide| {
        let inward = side.sign() * geometry.surface(surface).normal;
        let middle = geometry.mesh().corners(triangle).iter().sum::<DVec3>() / 3.0;
        let start = geometry.leave(geometry.to_local(middle), surface, side);
        let far = geometry.closest_hit(start, inward.as_vec3());
        passes(surface)
            && far.is_some_and(|far| {
                passes(far.surface)
                    && f64::from(far.distance) <= THICKEST_PARTITION
                    && geometry.surface(far.surface).normal.dot(inward).abs() > PARALLEL
            })
    };
    let shown: f64 = sides.iter().map(area).sum();
    let opposite: f64 = sides.iter().filter(is_opposite).map(area).sum();
    let thickness = volume / (0.5 * shown);
    let is_partition = opposite > 0.0 && opposite >= LEAST_OPPOSITE * shown;
    (is_partition && thickness <= THICKEST_PARTITION).then_some(thickness)
}
