//! `sonel-analyze fit`: coefficients of materials from measured parameters.

mod measured;
mod report;

use std::io::Write;

use anyhow::{Context, bail};
use sonel::acoustics::{Coefficient, CompiledMaterial};
use sonel::rendering::RenderSettings;
use sonel::scenes::materials_toml;
use sonel::{Observer, TemporaryMaps};
use sonel_console::follower::Follower;
use sonel_console::output::{Kind, Output, folder_of};
use sonel_console::quantity::counted;
use sonel_console::{Log, Outcome};
use sonel_design::fit::{FitSettings, Stage};
use sonel_design::sensitivity::VariedMap;

use crate::arguments::FitArguments;
use crate::open;

/// Writes the fitted materials and prints the coefficients.
///
/// # Errors
/// When the map or the table is unusable, nothing measured can be computed, or the output cannot be written.
pub(crate) fn run(
    arguments: &FitArguments,
    quiet: bool,
    out: &mut dyn Write,
    log: &mut Log<'_>,
) -> anyhow::Result<Outcome> {
    let (mut map, geometry) = open::changeable_map(&arguments.map)?;
    let scene = map.header().scene.clone();
    refuse_angular(&scene.materials)?;
    let measured = measured::read(arguments, &scene, log)?;
    let output = Output::create(&arguments.output, Kind::MATERIALS, &[])?;
    let scattering = arguments.scattering.then_some(Coefficient::Scattering);
    let settings = FitSettings {
        coefficients: std::iter::once(Coefficient::Absorption).chain(scattering).collect(),
        prior_sigma: arguments.prior_sigma,
    };
    let varied = VariedMap {
        map: &mut map,
        geometry: &geometry,
        receivers: &measured.receivers,
        render: RenderSettings { rays: arguments.rays, ..RenderSettings::default() },
    };
    let follower = Follower::new(quiet, log);
    let found = sonel_design::fit::fit(
        varied,
        &measured.measurements,
        &settings,
        &mut TemporaryMaps::new(folder_of(&arguments.output).to_owned()),
        &mut |stage| tell(stage, &follower),
    );
    drop(follower);
    let found = found.with_context(|| arguments.map.display().to_string())?;
    let head = format!(
        "sonel-analyze fit {} --measured {}\nuse it with sonel-render --materials, or copy the tables to the scene file",
        arguments.map.display(),
        arguments.measured.display()
    );
    let source = format!("fitted to {}", arguments.measured.display());
    write_materials(output, &found.materials, &scene.materials, (&head, &source))?;
    report::print(&found, &scene, arguments.format, out)?;
    let renderings = counted(found.rounds as usize, "rendering");
    writeln!(log, "{renderings}; written to {}", arguments.output.display())?;
    if !found.is_settled {
        writeln!(log, "warning: the coefficients did not settle: fit again from the result")?;
    }
    Ok(if found.is_settled { Outcome::Done } else { Outcome::Missed })
}

/// Writes `materials`; those that differ from `before` get `source` before their own.
pub(crate) fn write_materials(
    output: Output,
    materials: &[CompiledMaterial],
    before: &[CompiledMaterial],
    (head, source): (&str, &str),
) -> anyhow::Result<()> {
    let mut materials = materials.to_vec();
    for (material, before) in materials.iter_mut().zip(before) {
        if material != before {
            let own = before.source.as_ref().map_or(String::new(), |own| format!("; before: {own}"));
            material.source = Some(format!("{source}{own}"));
        }
    }
    output.write(|out| out.write_all(materials_toml(&materials, head).as_bytes()))
}

/// Shows renderings as bars, and says why the scene is traced again. A log that cannot be written is no reason to stop.
pub(crate) fn tell(stage: Stage, follower: &Follower<'_>) {
    match stage {
        Stage::Rendering(number, share) => {
            let _ = follower.progress(&format!("rendering {number}"), share);
        }
        Stage::Retracing(reasons) => {
            let reasons: String = reasons.iter().map(|reason| format!("\n  {reason}")).collect();
            let _ = follower.line(&format!("the scene is traced with the new coefficients:{reasons}"));
        }
    }
}

/// The searches know no upper bound of such walls, and alternatives to them are uniform.
pub(crate) fn refuse_angular(materials: &[CompiledMaterial]) -> anyhow::Result<()> {
    if let Some(wall) = materials.iter().find(|material| material.law.is_angular()) {
        bail!(
            "\"{}\" has the absorption law {}; fit and optimise need uniform absorption: trace the scene without absorption_law",
            wall.name,
            wall.law
        );
    }
    Ok(())
}
