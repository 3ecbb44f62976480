//! The diffracting edges of a map's scene.

use std::fmt::Write;

use serde_json::{Value, json};
use sonel::geometry::{AirSector, Edge, Geometry, Side};

use super::{LISTED, omitted};

/// A row per edge and sector of air.
fn rows(geometry: &Geometry) -> impl Iterator<Item = (&Edge, &AirSector)> {
    geometry.diffracting_edges().flat_map(|edge| edge.sectors.iter().map(move |sector| (edge, sector)))
}

/// Edges as JSON: every edge with the sector of air into which it diffracts.
pub(super) fn json(geometry: &Geometry) -> Value {
    let side = |side| if side == Side::Front { "front" } else { "back" };
    rows(geometry)
        .map(|(edge, sector)| {
            json!({
                "ends_m": edge.ends.map(|end| end.to_array()),
                "length_m": edge.length(),
                "kind": kind(sector),
                "wedge_angle_degrees": sector.angle.to_degrees(),
                "surfaces": edge.surfaces.iter().map(|surface| surface.0).collect::<Vec<_>>(),
                "faces": sector.faces.map(|(surface, of)| json!({ "surface": surface.0, "side": side(of) })),
            })
        })
        .collect()
}

/// In words: the longest first.
pub(super) fn text(geometry: &Geometry) -> String {
    let mut edges: Vec<(&Edge, &AirSector)> = rows(geometry).collect();
    if edges.is_empty() {
        return "\nno edge diffracts\n".to_owned();
    }
    edges.sort_by(|a, b| b.0.length().total_cmp(&a.0.length()));
    let mut text =
        String::from("\n diffracting edges\n length [m]  wedge angle  kind    ends [m], surfaces\n");
    for (edge, sector) in edges.iter().take(LISTED) {
        let [from, to] = edge.ends.map(|end| end.to_array().map(|x| format!("{x:.3}")).join(", "));
        let surfaces =
            edge.surfaces.iter().map(|surface| surface.0.to_string()).collect::<Vec<_>>().join(", ");
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{:>11.3}  {:>10.2}°  {:<6}  ({from}) – ({to}), {surfaces}",
            edge.length(),
            sector.angle.to_degrees(),
            kind(sector)
        );
    }
    omitted(&mut text, edges.len(), "edges");
    text
}

fn kind(sector: &AirSector) -> &'static str {
    let [(first, _), (second, _)] = sector.faces;
    if first == second { "free" } else { "convex" }
}
