//! What is expected of the hall before anything is traced: volume, areas, and the statistical times with its materials.

use std::fmt::Write;

use anyhow::{Context, Result, anyhow};
use sonel_acoustics::{Air, Bands, eyring_time, mean_free_path, sabine_time};

use super::mesh::QuadMesh;

/// The figures as markdown, with materials and air of the scene file's text.
pub fn markdown(mesh: &QuadMesh, scene: &str) -> Result<String> {
    let scene: toml::Table = scene.parse().context("scenes/hall/scene.toml does not parse")?;
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
    let air = air(&scene)?;
    let bands = Bands::octaves();
    for (i, nominal) in bands.nominal().iter().enumerate() {
        let mut absorbing = 0.0;
        for (material, area) in &areas {
            absorbing += area * absorption(&scene, material, i)?;
        }
        let m = air.energy_attenuation(bands.exact_midband(i));
        let c = air.speed_of_sound();
        let mean = absorbing / surface;
        let (sabine, eyring) =
            (sabine_time(volume, absorbing, m, c), eyring_time(volume, surface, mean, m, c));
        writeln!(text, "| {nominal} | {mean:.3} | {sabine:.2} | {eyring:.2} |")?;
    }
    Ok(text)
}

fn air(scene: &toml::Table) -> Result<Air> {
    let number = |key: &str| scene["air"].get(key).and_then(toml::Value::as_float);
    Ok(Air {
        temperature_celsius: number("temperature_celsius").context("the hall states its temperature")?,
        relative_humidity_percent: number("relative_humidity_percent")
            .context("the hall states its humidity")?,
        ..Air::default()
    })
}

fn absorption(scene: &toml::Table, material: &str, band: usize) -> Result<f64> {
    scene["materials"].get(material).and_then(|m| m.get("absorption")?.get(band)?.as_float()).ok_or_else(
        || anyhow!("scenes/hall/scene.toml: material {material} has no absorption for each octave"),
    )
}
