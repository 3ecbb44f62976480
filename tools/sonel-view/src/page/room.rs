//! The room as the page draws it.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use serde_json::{Value, json};
use sonel::acoustics::Directivity;
use sonel::echograms::Echograms;
use sonel::geometry::Geometry;
use sonel::scenes::CompiledScene;
use sonel::scenes::checkup::Checkup;

/// Walls, materials, sources, receivers, and what a checkup found.
pub(crate) fn json(scene: &CompiledScene, walls: &Geometry, checkup: Option<&Checkup>) -> Value {
    // A screen shows millimetres of a room that may lie kilometres from the origin.
    let mesh = walls.mesh();
    let origin = mesh.vertices.first().copied().unwrap_or_default();
    let vertices: Vec<u8> = mesh
        .vertices
        .iter()
        .flat_map(|vertex| (*vertex - origin).as_vec3().to_array())
        .flat_map(f32::to_le_bytes)
        .collect();
    let areas = areas(scene);
    let materials = scene.materials.iter().enumerate().map(|(index, material)| {
        let of_kind = |is_closed: bool| {
            let all = (0..).zip(&mesh.triangles);
            let own = all.filter(move |(at, triangle)| {
                let is_of_kind = walls.surface(walls.triangle_surface(*at)).closed == is_closed;
                triangle.material as usize == index && is_of_kind
            });
            own.flat_map(|(_, triangle)| triangle.corners)
        };
        // Walls before sheets: the backs of walls, which no sound is behind, are not drawn.
        let corners: Vec<u8> = of_kind(true).chain(of_kind(false)).flat_map(u32::to_le_bytes).collect();
        json!({
            "name": material.name, "area": areas[index], "absorption": material.absorption,
            "scattering": material.scattering, "transmission": material.transmission,
            "law": material.law.to_string(), "source": material.source, "corners": STANDARD.encode(corners),
            "closed": of_kind(true).count(),
        })
    });
    let sources = scene.sources.iter().map(|source| {
        json!({ "name": source.name, "at": source.position.to_array(), "aim": source.aim.to_array(),
                "directivity": directivity(&source.directivity) })
    });
    let receivers = scene.receivers.iter().map(|receiver| point(&receiver.name, receiver.position));
    let faults = checkup.map_or_else(Vec::new, |checkup| {
        [&checkup.faults[..], &checkup.warnings].concat().iter().map(|text| json!(text)).collect()
    });
    json!({
        "up": scene.up.to_array(), "origin": origin.to_array(), "vertices": STANDARD.encode(vertices),
        "bands": scene.bands.nominal(), "materials": materials.collect::<Vec<_>>(),
        "sources": sources.collect::<Vec<_>>(), "receivers": receivers.collect::<Vec<_>>(),
        "volume": walls.volume(), "faults": faults,
    })
}

/// Sources and receivers alone, where the map is not at hand.
pub(crate) fn of_response(response: &Echograms) -> Value {
    let points = |names: &[String], positions: &[[f64; 3]]| -> Vec<Value> {
        names.iter().zip(positions).map(|(name, at)| point(name, DVec3::from_array(*at))).collect()
    };
    json!({
        "up": response.provenance.up.unwrap_or([0.0, 0.0, 1.0]), "origin": response.receiver_positions[0], "vertices": "",
        "bands": response.center_frequency_hz, "materials": [],
        "sources": points(&response.source_names, &response.source_positions),
        "receivers": points(&response.receiver_names, &response.receiver_positions),
        "volume": response.provenance.volume_m3, "faults": [],
    })
}

fn directivity(directivity: &Directivity) -> &'static str {
    match directivity {
        Directivity::Pattern(pattern) => pattern.name(),
        Directivity::Measured { .. } => "measured",
    }
}

fn point(name: &str, position: DVec3) -> Value {
    json!({ "name": name, "at": position.to_array() })
}

/// Area of every material [m²], one side of each face.
fn areas(scene: &CompiledScene) -> Vec<f64> {
    let mut areas = vec![0.0; scene.materials.len()];
    for (index, triangle) in scene.mesh.triangles.iter().enumerate() {
        areas[triangle.material as usize] += scene.mesh.vector_area(index as u32).length();
    }
    areas
}
