//! Faults of a mesh: holes, surfaces outside the room, crossing and overlapping faces, slivers, unreachable surfaces.

use std::collections::HashMap;

use glam::DVec3;
use sonel_acoustics::Material;
use sonel_geometry::{CellPlace, Connected, Geometry, Surface, SurfaceId};

use crate::Scene;
use crate::notation::{count, listed, number, place};
use crate::room::crossings;

/// Height below which a triangle may be a sliver [m]: that of the cracks that are closed by default.
const SLIVER_HEIGHT: f64 = 1e-3;
/// Share of its longest side below which it is one [1]. Chosen, not measured; doubled, strips of 1 mm on half a metre are named.
const SLIVER_SHARE: f64 = 1e-3;
/// Largest distance of overlapping faces [m]: that of the cracks that are closed by default.
const WIDEST_OVERLAP: f64 = 1e-3;
/// Largest share of a solid's face in air [1] with which all of it counts as touching others. Chosen, not measured; doubled, 2 % may be bare.
const LARGEST_BARE_SHARE: f64 = 0.01;

/// One sentence for each kind of fault of the walls of a scene.
pub(super) fn of(geometry: &Geometry, scene: &Scene) -> Vec<String> {
    let mut faults = Vec::new();
    let holes = holes(&geometry.open_edges());
    if !holes.is_empty() {
        let area = "energy that leaves by them counts as escaped";
        faults.push(format!(
            "the mesh is not watertight: {}: {}; {area}",
            count(holes.len(), "hole"),
            listed(&holes)
        ));
    } else if !geometry.is_closed_room() {
        let outside = surfaces(geometry.outside().into_iter().map(|id| geometry.surface(id)));
        faults.push(format!(
            "no closed part of the mesh contains all other parts, so the room has no volume; remove or separate {} beyond the \
             largest part: {}; rooms drawn as closed shells side by side must be at most 1 m apart, each with a wall that transmits \
             parallel to one of its neighbour's",
            count(outside.len(), "surface"),
            listed(&outside)
        ));
    }
    // Those of solids are no fault: they are united (see the notes).
    if !geometry.crossings().is_empty() && geometry.masonry().is_empty() {
        faults.push(format!(
            "{}; they are divided there, which makes {} triangles in all; the volume may be wrong",
            crossings(geometry),
            geometry.mesh().triangles.len()
        ));
    }
    let slivers = slivers(geometry);
    if !slivers.is_empty() {
        faults.push(format!("{}: {}", count(slivers.len(), "sliver"), listed(&slivers)));
    }
    faults.extend(overlaps(geometry));
    faults.extend(dead_ends(geometry, scene));
    if geometry.is_closed_room() {
        faults.extend(within_solids(geometry));
        faults.extend(sealed(geometry, scene));
    }
    faults
}

/// Each group of open edges that hang together, the longest rim first.
fn holes(edges: &[[DVec3; 2]]) -> Vec<String> {
    let mut at: HashMap<[u64; 3], u32> = HashMap::new();
    let mut connected = Connected::new(edges.len());
    for (edge, ends) in (0..).zip(edges) {
        for end in ends {
            connected.join(edge, *at.entry(end.to_array().map(f64::to_bits)).or_insert(edge));
        }
    }
    let mut holes: Vec<(f64, String)> = Vec::new();
    for rim in connected.groups(0..edges.len() as u32) {
        let rim = || rim.iter().map(|&edge| edges[edge as usize]);
        let length: f64 = rim().map(|[from, to]| from.distance(to)).sum();
        let (low, high) = rim()
            .flatten()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let size = (high - low).to_array().map(number).join(" × ");
        let middle = place(0.5 * (low + high));
        let edges = count(rim().count(), "edge");
        holes.push((length, format!("{size} m about ({middle}) m, {edges}, rim {} m", number(length))));
    }
    holes.sort_by(|a, b| b.0.total_cmp(&a.0));
    holes.into_iter().map(|(_, hole)| hole).collect()
}

fn slivers(geometry: &Geometry) -> Vec<String> {
    let mesh = geometry.mesh();
    let mut found = Vec::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.corners.map(|corner| mesh.vertices[corner as usize]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let height = (b - a).cross(c - a).length() / longest;
        if height < SLIVER_HEIGHT && height < SLIVER_SHARE * longest {
            let middle = place((a + b + c) / 3.0);
            found.push(format!(
                "{} m long, {} mm high at ({middle}) m",
                number(longest),
                number(1e3 * height)
            ));
        }
    }
    found
}

/// Area and place of some surfaces.
fn surfaces<'g>(surfaces: impl Iterator<Item = &'g Surface>) -> Vec<String> {
    surfaces
        .map(|surface| format!("{} m² about ({}) m", number(surface.area), place(surface.centroid)))
        .collect()
}

/// Faces that lie over others, in a sentence.
fn overlaps(geometry: &Geometry) -> Option<String> {
    let named: Vec<String> = geometry
        .overlaps(WIDEST_OVERLAP)
        .iter()
        .map(|overlap| format!("{} m² about ({}) m", number(overlap.area), place(overlap.center)))
        .collect();
    (!named.is_empty()).then(|| {
        format!(
            "faces lie over others within {} mm: {}; their areas count twice: remove one of each",
            number(1e3 * WIDEST_OVERLAP),
            listed(&named)
        )
    })
}

/// Partitions that nothing passes as they are drawn, in a sentence.
fn dead_ends(geometry: &Geometry, scene: &Scene) -> Option<String> {
    let transmits =
        |surface: &Surface| scene.materials.get(surface.material as usize).is_some_and(Material::transmits);
    let exposed = geometry.surfaces().iter().zip((0..).map(SurfaceId)).filter(|(surface, id)| {
        transmits(surface) && geometry.exposed(*id) > LARGEST_BARE_SHARE * surface.area
    });
    // Narrow sides of a partition are dead ends of no matter.
    let (dead, passed): (Vec<_>, Vec<_>) = exposed.partition(|(_, id)| geometry.is_dead_end(*id));
    let is_passed = |material: u32| passed.iter().any(|(surface, _)| surface.material == material);
    let named =
        surfaces(dead.into_iter().map(|(surface, _)| surface).filter(|surface| !is_passed(surface.material)));
    (!named.is_empty()).then(|| {
        format!(
            "nothing passes {} of materials that transmit, as no parallel face is within 1 m behind: {}; draw the wall as one sheet, \
             or its two faces parallel and at most 1 m apart",
            count(named.len(), "surface"),
            listed(&named)
        )
    })
}

/// Air of a closed room that no source is in and no wall leads to, in a sentence: inside a pillar or a cabinet that is drawn without its ends it
/// counts as room.
fn sealed(geometry: &Geometry, scene: &Scene) -> Option<String> {
    let at_sources: Vec<u32> = scene
        .sources
        .iter()
        .map(|source| geometry.cell_at(source.position))
        .filter(|cell| geometry.is_air_cell(*cell))
        .collect();
    if scene.materials.iter().any(Material::transmits) || at_sources.is_empty() {
        return None;
    }
    let sealed = geometry.air_cells().into_iter().filter(|cell| !at_sources.contains(&cell.number));
    let named = |CellPlace { volume, bounds: (low, high), .. }: CellPlace| {
        format!("{} m³ about ({}) m", number(volume), place(0.5 * (low + high)))
    };
    let named: Vec<String> = sealed.map(named).collect();
    (!named.is_empty()).then(|| {
        format!(
            "air is sealed off from every source and counts in the volume: {}; draw what closes the object, its top or bottom, or a way in, or state where air \
             is: air_at = [{}]",
            listed(&named),
            scene.sources[0].position
        )
    })
}

/// Surfaces of a closed room with no air on either side, in a sentence. Where a solid stands flush against a wall or another solid is no fault.
fn within_solids(geometry: &Geometry) -> Option<String> {
    let is_contact = |(surface, id): (&Surface, SurfaceId)| {
        surface.closed && geometry.exposed(id) <= LARGEST_BARE_SHARE * surface.area
    };
    let all = geometry.surfaces().iter().zip((0..).map(SurfaceId));
    let unreached = all.filter(|&(surface, id)| {
        !surface.interface
            && !is_contact((surface, id))
            && !geometry.cells_beside(id).any(|cell| geometry.is_air_cell(cell))
    });
    let named = surfaces(unreached.map(|(surface, _)| surface));
    (!named.is_empty()).then(|| {
        format!("{} inside solids, which no sound reaches: {}", count(named.len(), "surface"), listed(&named))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_edge_is_singular() {
        let edge = |x: f64| [DVec3::new(x, 0.0, 0.0), DVec3::new(x, 2.0, 0.0)];
        assert_eq!(holes(&[edge(1.0)]), ["0 × 2 × 0 m about (1, 1, 0) m, 1 edge, rim 2 m"]);
    }
}
