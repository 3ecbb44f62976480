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

use glam::DVec3;
use sonel_geometry::{CellPlace, FaceKind, Geometry, Side, SurfaceId};

use crate::notation::{number, place};
use crate::report::{NoteKind, Report};
use crate::sections::walls::Walls;

/// Largest thickness of a partition [m], as of one that is drawn as a solid (docs/formats/scene.md).
const THICKEST_PARTITION: f64 = 1.0;
/// Least share of the faces towards other air that have an opposite one [1]. Chosen: at the end of an oblique wall, and about a corner, less of one
/// face is opposite the other.
const LEAST_OPPOSITE: f64 = 0.5;
/// Cosine between normals from which on two faces are parallel.
const PARALLEL: f64 = 1.0 - 1e-6;

/// A side of a triangle.
struct CellSide {
    triangle: u32,
    surface: SurfaceId,
    side: Side,
    /// The cell behind it.
    beyond: u32,
}

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
    let mut airs = Vec::new();
    for &cell in &cells {
        let thickness = thickness(&geometry, &cell, &sides(&geometry, cell.number), &passes);
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

/// The sides of triangles that bound a cell.
fn sides(geometry: &Geometry, cell: u32) -> Vec<CellSide> {
    let surfaces = (0..geometry.surfaces().len() as u32).map(SurfaceId);
    let of_surface = |surface: SurfaceId| {
        let beside: Vec<u32> = geometry.cells_beside(surface).collect();
        let triangles = geometry.surface(surface).triangles.clone();
        triangles.into_iter().enumerate().flat_map(move |(at, triangle)| {
            let [front, back] = [beside[2 * at], beside[2 * at + 1]];
            let both = [(front, Side::Front, back), (back, Side::Back, front)];
            let faces = move |&(here, _, beyond): &(u32, Side, u32)| here == cell && beyond != cell;
            let bounding = move |(_, side, beyond)| CellSide { triangle, surface, side, beyond };
            both.into_iter().filter(faces).map(bounding)
        })
    };
    surfaces.flat_map(of_surface).collect()
}

/// Depth of the partition that `cell` is the inside of [m].
fn thickness(
    geometry: &Geometry,
    cell: &CellPlace,
    sides: &[CellSide],
    passes: &impl Fn(SurfaceId) -> bool,
) -> Option<f64> {
    let area = |side: &CellSide| {
        let [a, b, c] = geometry.mesh().corners(side.triangle);
        0.5 * (b - a).cross(c - a).length()
    };
    let to_air = || sides.iter().filter(|side| geometry.is_air_cell(side.beyond));
    let shown: f64 = to_air().map(area).sum();
    let is_opposite = |side: &&CellSide| {
        let inward = side.side.sign() * geometry.surface(side.surface).normal;
        let middle = geometry.mesh().corners(side.triangle).iter().sum::<DVec3>() / 3.0;
        let start = geometry.leave(geometry.to_local(middle), side.surface, side.side);
        let far = geometry.closest_hit(start, inward.as_vec3());
        passes(side.surface)
            && far.is_some_and(|far| {
                passes(far.surface)
                    && f64::from(far.distance) <= THICKEST_PARTITION
                    && geometry.surface(far.surface).normal.dot(inward).abs() > PARALLEL
            })
    };
    let opposite: f64 = to_air().filter(is_opposite).map(area).sum();
    let thickness = cell.volume / (0.5 * shown);
    let is_partition = opposite > 0.0 && opposite >= LEAST_OPPOSITE * shown;
    (is_partition && thickness <= THICKEST_PARTITION).then_some(thickness)
}
