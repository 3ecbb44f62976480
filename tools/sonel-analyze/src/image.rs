//! `sonel-analyze image`: energy on surfaces as a camera sees it, as OpenEXR and PNG.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use serde_json::{Value, json};
use sonel::acoustics::energy_from_level_db;
use sonel::drawing::picture::{self, DecibelScale, Drawing, Picture, WindowPicture};
use sonel::geometry::Geometry;
use sonel::map::{SonelMap, hexadecimal};
use sonel::names::place;
use sonel::rendering::picture::{Camera, Windows};
use sonel::rendering::{Estimator, RenderSettings, Renderer};
use sonel::scenes::CompiledScene;
use sonel_console::output::{Kind, Output, has_ending};
use sonel_console::progress::Progress;
use sonel_console::quantity;
use sonel_console::{Outcome, spelled};

use crate::arguments::{Image, NamedWindow};
use crate::open;

/// Writes both pictures.
///
/// # Errors
/// When the map is unusable, there is no such camera, window, band or source, or an output cannot be written.
pub(crate) fn run(arguments: &Image, quiet: bool, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let drawn = drawn_name(arguments)?;
    let (map, geometry) = open::map(&arguments.map)?;
    let request = PictureRequest::new(arguments, &map, &geometry)?;
    let settings =
        RenderSettings { gather_radius: arguments.radius, ..RenderSettings::of(Estimator::Connection) };
    let named = || arguments.map.display().to_string();
    let renderer = Renderer::new(&map, &geometry, settings).with_context(named)?;
    let values = Output::create(&arguments.output, Kind::PICTURE, &[])?;
    let mut drawing = Output::create(&drawn, Kind::DRAWN_PICTURE, &[])?;
    let progress = Progress::begin("counting", quiet);
    let mut reach = |share| progress.reach(share);
    let seen = renderer.picture(request.source, &request.camera, &request.windows, &mut reach);
    let seen = seen.map_err(|error| spelled(error.into()))?;
    drop(progress);
    request.log_what_is_seen(&seen, &map.header().scene, log)?;
    let picture = request.picture(seen, &map, arguments);
    request.draw(&picture, arguments, &mut drawing, log)?;
    values.write(|out| picture::exr(picture, out))?;
    drawing.publish()?;
    writeln!(log, "written to {} and {}", arguments.output.display(), drawn.display())?;
    Ok(Outcome::Done)
}

/// Where the PNG goes.
fn drawn_name(arguments: &Image) -> anyhow::Result<PathBuf> {
    let output = &arguments.output;
    if !has_ending(output, "exr") {
        bail!("{} does not end in .exr: the PNG gets the same name with .png", output.display());
    }
    Ok(output.with_extension("png"))
}

/// What is asked for, in terms of the map.
struct PictureRequest {
    camera: Camera,
    named: Vec<NamedWindow>,
    windows: Windows,
    source: usize,
    /// What each band weighs in the drawing.
    weights: Vec<f64>,
    /// Band or bands drawn.
    band: String,
}

impl PictureRequest {
    /// Everything that is wrong is said at once.
    fn new(arguments: &Image, map: &SonelMap, geometry: &Geometry) -> anyhow::Result<Self> {
        let scene = &map.header().scene;
        let mut problems: Vec<String> = Vec::new();
        let camera = Camera::new(arguments.eye, arguments.look, arguments.fov, arguments.size, geometry)
            .map_err(|errors| problems.extend(errors.iter().map(ToString::to_string)));
        let named = if arguments.windows.is_empty() {
            let name = format!("0-{}ms", 1e3 * scene.duration);
            vec![NamedWindow { name, window: [0.0, scene.duration] }]
        } else {
            arguments.windows.clone()
        };
        let spans: Vec<[f64; 2]> = named.iter().map(|named| named.window).collect();
        let windows = Windows::new(&spans, scene.speed_of_sound, scene.duration)
            .map_err(|errors| problems.extend(errors.iter().map(ToString::to_string)));
        let source = source(arguments, scene).map_err(|problem| problems.push(problem.to_string()));
        let weights = weights(&arguments.band, scene, *source.as_ref().unwrap_or(&0))
            .map_err(|problem| problems.push(problem.to_string()));
        let (Ok(camera), Ok(windows), Ok(source), Ok((weights, band))) = (camera, windows, source, weights)
        else {
            bail!("{}", problems.join("\nerror: "));
        };
        Ok(Self { camera, named, windows, source, weights, band })
    }

    fn log_what_is_seen(
        &self,
        seen: &sonel::rendering::picture::Picture,
        scene: &CompiledScene,
        log: &mut dyn Write,
    ) -> std::io::Result<()> {
        if scene.sources.len() > 1 {
            let name = &scene.sources[self.source].name;
            writeln!(log, "source \"{name}\"; choose another with --source")?;
        }
        let [front, back, none] = seen.shares().map(|share| 100.0 * share);
        writeln!(
            log,
            "{front:.1} % of the pixels show fronts of surfaces, {back:.1} % backs, {none:.1} % no surface; discs of {:.3} m",
            seen.radius
        )?;
        for (named, window) in self.named.iter().zip(&seen.windows) {
            let covered = window.relative_error.iter().zip(&seen.seen).filter(|(_, hit)| hit.is_some());
            let mut errors: Vec<f32> = covered.map(|(&error, _)| error).collect();
            errors.sort_unstable_by(f32::total_cmp);
            let Some(&median) = errors.get(errors.len() / 2) else { continue };
            let empty = errors.iter().filter(|error| error.is_infinite()).count();
            let empty = 100.0 * empty as f64 / errors.len() as f64;
            let name = &named.name;
            if median.is_finite() {
                writeln!(
                    log,
                    "{name}: standard error {:.0} % (median pixel); nothing arrives in {empty:.1} % of the pixels",
                    100.0 * median
                )?;
            } else {
                writeln!(
                    log,
                    "warning: {name}: nothing arrives in {empty:.1} % of the pixels: use more packets, a larger --radius or another window"
                )?;
            }
        }
        Ok(())
    }

    fn picture(
        &self,
        seen: sonel::rendering::picture::Picture,
        map: &SonelMap,
        arguments: &Image,
    ) -> Picture {
        let windows = self.named.iter().zip(seen.windows).map(|(named, window)| WindowPicture {
            name: named.name.clone(),
            energy: window.energy,
            relative_error: window.relative_error,
        });
        Picture {
            size: arguments.size,
            center_frequencies_hz: map.header().scene.bands.nominal().to_vec(),
            is_covered: seen.seen.iter().map(Option::is_some).collect(),
            windows: windows.collect(),
            metadata: self.metadata(map, arguments, seen.radius),
        }
    }

    fn metadata(&self, map: &SonelMap, arguments: &Image, radius: f64) -> Value {
        let scene = &map.header().scene;
        let digest = hexadecimal(&map.digest());
        json!({
            "quantity": "incident energy per area and unit emitted energy [1/m^2]",
            "scene": scene.name,
            "source": scene.sources[self.source].name,
            "eye_m": arguments.eye.to_array(),
            "look_m": arguments.look.to_array(),
            "fov_degrees": arguments.fov,
            "windows_s": self.named.iter().map(|named| named.window).collect::<Vec<_>>(),
            "radius_m": radius,
            "map_digest": digest,
            "sonel_version": env!("CARGO_PKG_VERSION"),
        })
    }

    fn draw(
        &self,
        picture: &Picture,
        arguments: &Image,
        out: &mut dyn Write,
        log: &mut dyn Write,
    ) -> anyhow::Result<()> {
        let energies = picture.weighted(&self.weights);
        let covered = || {
            let pixels = energies.iter().flat_map(|window| window.iter().zip(&picture.is_covered));
            pixels.filter(|(_, is_covered)| **is_covered).map(|(&energy, _)| energy)
        };
        let scale = match arguments.range {
            Some([low, high]) => DecibelScale { low, high },
            None => DecibelScale::of(covered()),
        };
        let [below, above] = scale.beyond(covered()).map(|share| 100.0 * share);
        writeln!(
            log,
            "PNG: {}, {} to {} dB re 1/m\u{b2}; {below:.1} % of the pixels with a surface are below, {above:.1} % above",
            self.band, scale.low, scale.high
        )?;
        let captions = self.named.iter().map(|named| format!("{}, {}", named.name, self.band));
        let windows = captions.zip(energies).collect();
        picture::png(&Drawing { size: picture.size, is_covered: &picture.is_covered, windows, scale }, out)?;
        Ok(())
    }
}

/// Index of the source asked for.
fn source(arguments: &Image, scene: &CompiledScene) -> anyhow::Result<usize> {
    let Some(wanted) = &arguments.source else { return Ok(0) };
    Ok(place(scene.sources.iter().map(|source| source.name.as_str()), wanted, "the map has no source")?)
}

/// What each band weighs in the drawing, and what that is called.
fn weights(band: &str, scene: &CompiledScene, source: usize) -> anyhow::Result<(Vec<f64>, String)> {
    let frequencies = scene.bands.nominal();
    if band == "sum" {
        let power = |level_db: &f64| energy_from_level_db(*level_db);
        let weights = scene.sources[source].power_level_db.iter().map(power).collect();
        return Ok((weights, "all bands".to_owned()));
    }
    let wanted = band.parse::<f64>().ok();
    let is_wanted =
        |frequency: &f64| wanted.is_some_and(|wanted| (wanted - frequency).abs() < 1e-6 * frequency);
    let (known, is_known) = (quantity::list(frequencies), frequencies.iter().any(is_wanted));
    ensure!(is_known, "the map has no band \"{band}\"; choose sum or one of {known} Hz");
    let weights = frequencies.iter().map(|frequency| f64::from(u8::from(is_wanted(frequency)))).collect();
    Ok((weights, format!("{band} Hz")))
}
