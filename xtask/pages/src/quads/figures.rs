//! What is expected of a room before anything is traced: volume, areas, and the statistical times with its materials.

use std::fmt::Write;

use anyhow::{Context, Result};
use sonel_acoustics::{eyring_time, mean_free_path, sabine_time};
use sonel_scene::Scene;

use super::mesh::QuadMesh;

/// The figures as markdown, with materials and air of `scene`.
pub(crate) fn markdown(mesh: &QuadMesh, scene: &Scene) -> Result<String> {
    let areas: Vec<_> = mesh.areas().into_iter().collect();
    let (volume, surface) = (mesh.volume(), areas.iter().map(|(_, area)| area).sum());
    let mut text = String::from("| | |\n|---|---|\n");
    let triangles = mesh.quads.len() * 2;
    writeln!(
        text,
        "| triangles | {triangles} ({} quads, {} vertices) |",
        mesh.quads.len(),
        mesh.vertices.len()
    )?;
    writeln!(text, "| volume | {volume:.0} m³ |")?;
    writeln!(text, "| surface | {surface:.0} m² |")?;
    for (material, area) in &areas {
        writeln!(text, "| of it `{material}` | {area:.0} m² |")?;
    }
    writeln!(text, "| mean free path 4V/S | {:.2} m |", mean_free_path(volume, surface))?;
    text.push_str("\n| band [Hz] | mean absorption | Sabine [s] | Eyring [s] |\n|---|---|---|---|\n");
    let c = scene.air.speed_of_sound();
    for (i, nominal) in scene.bands.nominal().iter().enumerate() {
        let mut absorbing = 0.0;
        for (name, area) in &areas {
            let material = scene.materials.iter().find(|material| material.name == *name);
            absorbing += area * material.with_context(|| format!("no material {name}"))?.absorption[i];
        }
        let m = scene.air.energy_attenuation(scene.bands.exact_midband(i));
        let mean = absorbing / surface;
        let (sabine, eyring) =
            (sabine_time(volume, absorbing, m, c), eyring_time(volume, surface, mean, m, c));
        writeln!(text, "| {nominal} | {mean:.3} | {sabine:.2} | {eyring:.2} |")?;
    }
    Ok(text)
}
