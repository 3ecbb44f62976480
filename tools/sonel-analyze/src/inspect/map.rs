//! Content of a map as text and JSON.

use std::fmt::Write;

use serde_json::{Value, json};
use sonel::acoustics::CompiledMaterial;
use sonel::analysis::survey::Deposit;
use sonel::ledger::{balances_json, fates_json};
use sonel::map::{Fate, MapHeader, hexadecimal};
use sonel::scenes::{CompiledScene, Region};
use sonel_console::quantity::list;

use super::{LISTED, edges, omitted};
use crate::open::WalkedMap;

fn region(region: &Region) -> Value {
    json!({ "name": region.name, "inside_m": region.inside.to_array(), "speed_of_sound": region.speed_of_sound,
        "density_kg_m3": region.density })
}

/// The map as JSON. Energies are relative to what one source emits.
pub(crate) fn json(walked: &WalkedMap) -> Value {
    let (map, header) = (&walked.map, walked.map.header());
    let (scene, ledger) = (&header.scene, map.ledger());
    let point =
        |name: &str, position: glam::DVec3| json!({ "name": name, "position_m": position.to_array() });
    json!({
        "kind": "sonelmap",
        "tool_version": header.tool_version,
        "digest": hexadecimal(&map.digest()),
        "bytes": map.byte_length(),
        "scene": scene.name,
        "scene_digest": hexadecimal(&scene.digest),
        "mesh_digest": hexadecimal(&scene.mesh_digest),
        "settings": settings(header),
        "center_frequency_hz": scene.bands.nominal(),
        "duration_s": scene.duration,
        "speed_of_sound": scene.speed_of_sound,
        "sound_speed_gradient": scene.sound_speed_gradient,
        "regions": scene.media.iter().flat_map(|media| &media.regions).map(region).collect::<Vec<_>>(),
        "variants": variants(scene),
        "sources": scene.sources.iter().map(|source| point(&source.name, source.position)).collect::<Vec<_>>(),
        "receivers": scene.receivers.iter().map(|at| point(&at.name, at.position)).collect::<Vec<_>>(),
        "effects": header.effects.iter()
            .map(|effect| json!({ "name": effect.effect.name(), "on": effect.on, "reason": effect.reason }))
            .collect::<Vec<_>>(),
        "emitted": map.path_count(),
        "stored": map.vertex_count(),
        "segments": ledger.segments,
        "fates": fates_json(&ledger.fates),
        "ledger": balances_json(&ledger, scene.bands.nominal(), scene.sources.len()),
        "surfaces": walked.survey.surfaces.iter().zip(walked.geometry.surfaces()).enumerate()
            .map(|(index, (deposit, surface))| {
                let material = &scene.materials[surface.material as usize].name;
                listed(json!({ "surface": index, "material": material, "area_m2": surface.area }), deposit)
            })
            .collect::<Vec<_>>(),
        "diffracting_edges": edges::json(&walked.geometry),
        "orders": walked.survey.orders.iter().enumerate()
            .map(|(order, deposit)| listed(json!({ "order": order }), deposit))
            .collect::<Vec<_>>(),
    })
}

fn settings(header: &MapHeader) -> Value {
    let settings = &header.settings;
    json!({
        "emissions": settings.emissions,
        "seed": settings.seed,
        "batches": settings.batches,
        "survival": settings.survival,
        "spectral": settings.spectral.name(),
        "mode": settings.mode.name(),
        "shard": [header.shard.index, header.shard.count],
    })
}

/// Other materials that the map carries.
fn variants(scene: &CompiledScene) -> Vec<Value> {
    let all = scene.variants.iter().flatten();
    let variant = |variant: &CompiledMaterial| {
        json!({
            "material": variant.name,
            "absorption": variant.absorption,
            "scattering": variant.scattering,
            "transmission": variant.transmission,
        })
    };
    all.map(variant).collect()
}

/// `fields` with what was deposited.
fn listed(mut fields: Value, deposit: &Deposit) -> Value {
    fields["hits"] = json!(deposit.hits);
    fields["incident_energy"] = json!(deposit.incident);
    fields["absorbed_energy"] = json!(deposit.absorbed);
    fields
}

/// In words.
pub(crate) fn text(walked: &WalkedMap) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let mut line = |name: &str, value: &str| {
        let _ = writeln!(text, "{name:<16}{value}");
    };
    let (map, header) = (&walked.map, walked.map.header());
    let (scene, settings, ledger) = (&header.scene, &header.settings, map.ledger());
    line("sonel map", &format!("of \"{}\", sonel {}", scene.name, header.tool_version));
    line("digest", &hexadecimal(&map.digest()));
    line("scene digest", &hexadecimal(&scene.digest));
    line(
        "settings",
        &format!(
            "{} packets a source, seed {}, {} batches, survival {}, spectral {}, mode {}, shard {}/{}",
            settings.emissions,
            settings.seed,
            settings.batches,
            settings.survival,
            settings.spectral.name(),
            settings.mode.name(),
            header.shard.index,
            header.shard.count
        ),
    );
    line("bands", &format!("{} Hz", list(scene.bands.nominal())));
    line("duration", &format!("{} s at {:.2} m/s", scene.duration, scene.speed_of_sound));
    if scene.sound_speed_gradient != 0.0 {
        line("gradient", &format!("{} m/s per metre of height", scene.sound_speed_gradient));
    }
    for region in scene.media.iter().flat_map(|media| &media.regions) {
        line("region", &format!("\"{}\" at {:.2} m/s", region.name, region.speed_of_sound));
    }
    for source in &scene.sources {
        line("source", &format!("{} at ({}) m", source.name, list(&source.position.to_array())));
    }
    for receiver in &scene.receivers {
        line("receiver", &format!("{} at ({}) m", receiver.name, list(&receiver.position.to_array())));
    }
    for effect in &header.effects {
        let on = effect.on.iter().filter(|on| **on).count();
        line(
            "effect",
            &format!("{} on in {on} of {} bands: {}", effect.effect.name(), effect.on.len(), effect.reason),
        );
    }
    line(
        "stored",
        &format!("{} packets, {} sonels, {} bytes", map.path_count(), map.sonel_count(), map.byte_length()),
    );
    let fates: Vec<String> =
        Fate::ALL.iter().map(|&fate| format!("{} {}", ledger.fates.count(fate), fate.name())).collect();
    line("fates", &fates.join(", "));
    let _ = writeln!(text, "\nenergy relative to what one source emits");
    text.push_str(&balances(walked));
    text.push_str(&deposits(walked));
    text.push_str(&edges::text(&walked.geometry));
    text
}

fn balances(walked: &WalkedMap) -> String {
    let scene = &walked.map.header().scene;
    let sources = scene.sources.len() as f64;
    let mut text = String::from(
        "    f [Hz]  absorbed  transmitted   escaped  truncated   sampling ± sigma      residual\n",
    );
    for (frequency, band) in scene.bands.nominal().iter().zip(&walked.map.ledger().bands) {
        let [absorbed, transmitted, escaped, truncated, sampling, sigma] = [
            band.absorbed,
            band.transmitted,
            band.escaped,
            band.truncated,
            band.sampling,
            band.sampling_sigma(),
        ]
        .map(|energy| energy / sources);
        let _ = writeln!(
            text,
            "{frequency:>10}  {absorbed:8.6}     {transmitted:8.6}  {escaped:8.6}   {truncated:8.2e}  \
             {sampling:9.2e} ± {sigma:7.1e}  {:8.1e}",
            band.relative_residual()
        );
    }
    text
}

/// Hits and absorbed energy, averaged over bands, of the surfaces that absorb most and of the first orders.
fn deposits(walked: &WalkedMap) -> String {
    let mut text = String::new();
    let materials = &walked.map.header().scene.materials;
    let mut surfaces: Vec<(usize, &Deposit)> = walked.survey.surfaces.iter().enumerate().collect();
    surfaces.sort_by(|a, b| mean(&b.1.absorbed).total_cmp(&mean(&a.1.absorbed)).then(a.0.cmp(&b.0)));
    let _ = writeln!(text, "\n   surface    sonels  incident  absorbed  material, mean over bands");
    for &(index, deposit) in surfaces.iter().take(LISTED) {
        let surface = &walked.geometry.surfaces()[index];
        let _ = writeln!(
            text,
            "{index:>10}  {}  {}, {:.2} m²",
            columns(deposit),
            materials[surface.material as usize].name,
            surface.area
        );
    }
    omitted(&mut text, surfaces.len(), "surfaces");
    let _ = writeln!(text, "\n     order    sonels  incident  absorbed");
    for (order, deposit) in walked.survey.orders.iter().enumerate().take(LISTED) {
        let _ = writeln!(text, "{order:>10}  {}", columns(deposit));
    }
    omitted(&mut text, walked.survey.orders.len(), "orders");
    text
}

fn columns(deposit: &Deposit) -> String {
    format!("{:>8}  {:8.6}  {:8.6}", deposit.hits, mean(&deposit.incident), mean(&deposit.absorbed))
}

fn mean(energies: &[f64]) -> f64 {
    energies.iter().sum::<f64>() / energies.len() as f64
}
