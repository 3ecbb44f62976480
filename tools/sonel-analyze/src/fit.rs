//! `sonel-analyze fit`: coefficients of materials from measured parameters.

mod measured;
mod report;

use std::io::Write;
use std::path::Path;

use anyhow::{Context, bail};
use sonel::TemporaryMaps;
use sonel_acoustics::{Coefficient, Material};
use sonel_console::output::{Kind, Output};
use sonel_console::progress::{Progress, ProgressSink};
use sonel_console::quantity::counted;
use sonel_console::{Log, Outcome};
use sonel_design::fit::{FitSettings, Stage};
use sonel_design::sensitivity::VariedMap;
use sonel_renderer::RenderSettings;
use sonel_scene::materials_toml;

use crate::arguments::FitArguments;
use crate::open;

/// Steps of the progress bar.
const STEPS: u64 = 1000;

/// Writes the fitted materials and prints the coefficients.
///
/// # Errors
/// When the map or the table is unusable, nothing measured can be computed, or the output cannot be written.
pub fn run(
    arguments: &FitArguments,
    quiet: bool,
    out: &mut dyn Write,
    log: &mut Log<'_>,
) -> anyhow::Result<Outcome> {
    let (mut map, geometry) = open::changeable_map(&arguments.map)?;
    let scene = map.header().scene.clone();
    refuse_angular(&scene.materials)?;
    let measured = measured::read(arguments, &scene, log)?;
    let inputs = [arguments.map.clone(), arguments.measured.clone()];
    let output = Output::create(&arguments.output, Kind::MATERIALS, &inputs)?;
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
    let mut stages = Stages::begin(quiet, log);
    let found = sonel_design::fit::fit(
        varied,
        &measured.measurements,
        &settings,
        &mut TemporaryMaps::new(folder_of(&arguments.output)),
        &mut |stage| stages.tell(stage),
    );
    stages.end();
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

/// The folder in which maps are kept meanwhile: that of the output.
pub fn folder_of(output: &Path) -> std::path::PathBuf {
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new(".")).to_owned()
}

/// Writes `materials`; those that differ from `before` get `source` before their own.
pub fn write_materials(
    output: Output,
    materials: &[Material],
    before: &[Material],
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

/// Shows renderings as bars, and says why the scene is traced again.
pub struct Stages<'a> {
    quiet: bool,
    log: &'a mut Log<'a>,
    bar: Option<(u32, Progress)>,
}

impl<'a> Stages<'a> {
    pub fn begin<'b: 'a>(quiet: bool, log: &'a mut Log<'b>) -> Self {
        Self { quiet, log, bar: None }
    }

    pub fn tell(&mut self, stage: Stage) {
        match stage {
            Stage::Rendering(number, share) => {
                if self.bar.as_ref().is_none_or(|(shown, _)| *shown != number) {
                    self.end();
                    let what = format!("rendering {number}");
                    self.bar = Some((number, Progress::begin(what, STEPS, ProgressSink::unless(self.quiet))));
                }
                let (_, bar) = self.bar.as_ref().expect("begun above");
                bar.reach((STEPS as f64 * share) as u64);
            }
            Stage::Retracing(reasons) => {
                self.end();
                // A log that cannot be written is no reason to stop.
                let _ = writeln!(self.log, "the scene is traced with the new coefficients:");
                for reason in reasons {
                    let _ = writeln!(self.log, "  {reason}");
                }
            }
        }
    }

    pub fn end(&mut self) {
        if let Some((_, bar)) = self.bar.take() {
            bar.end();
        }
    }
}

/// The searches know no upper bound of such walls, and alternatives to them are uniform.
pub fn refuse_angular(materials: &[Material]) -> anyhow::Result<()> {
    if let Some(wall) = materials.iter().find(|material| material.law.is_angular()) {
        bail!(
            "\"{}\" has the absorption law {}; fit and optimise need uniform absorption: trace the scene without absorption_law",
            wall.name,
            wall.law
        );
    }
    Ok(())
}
