//! Arrangements of furniture against the wave equation: rigid screens, desks, seats, walls with a door on a rigid floor, one in free space.
//!
//! `tests/waves` has the scenes and, in `waves.json`, levels re free field at 1 m by finite differences of 0.0375 m (staggered leapfrog, absorbing
//! layers; free field within 0.1 dB up to 500 Hz, another grid within 0.5 dB rms). Over a floor they are means of the energies with a rigid and a
//! soft floor, which add source and mirrored source by energy.

use std::f64::consts::PI;
use std::path::Path;

use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Loaded;

use crate::Traced;

/// Octaves of the levels [Hz].
pub const OCTAVES: [f64; 5] = [63.0, 125.0, 250.0, 500.0, 1000.0];

/// Levels of sonel less those of waves [dB] at the receivers of an arrangement, by octave.
///
/// # Panics
/// When a file is not as it was made.
#[must_use]
pub fn errors(name: &str, with_edges: bool) -> Vec<[f64; OCTAVES.len()]> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("waves");
    let read = |file: &str| std::fs::read_to_string(folder.join(file)).expect("a file of the waves");
    let known: serde_json::Value = serde_json::from_str(&read("waves.json")).expect("JSON");
    let known = known[name]["level_re_free_field_at_1m_db"].as_array().expect("levels of receivers");
    let text = read(&format!("{name}.toml"));
    let mut mesh = |mesh: &str| std::fs::read(folder.join(mesh));
    let Loaded { scene, .. } = sonel_scene::load(&text, name, &mut mesh).expect("a valid scene");
    let settings = Settings { emissions: 32, ..Settings::default() };
    let traced = if with_edges { Traced::diffracting } else { Traced::new }(scene, settings);
    let rendering = traced.render(RenderSettings::default());
    let error = |(receiver, known): (usize, &serde_json::Value)| {
        std::array::from_fn(|band| {
            let level = 10.0 * (4.0 * PI * rendering.energy(receiver, band)).max(1e-9).log10();
            level - known[band].as_f64().expect("a level")
        })
    };
    known.iter().enumerate().map(error).collect()
}

/// Root of the mean square of errors, by octave, and the largest [dB].
#[must_use]
pub fn summary(errors: &[[f64; OCTAVES.len()]]) -> ([f64; OCTAVES.len()], f64) {
    let square = |band: usize| errors.iter().map(|errors| errors[band] * errors[band]).sum::<f64>();
    let rms = std::array::from_fn(|band| (square(band) / errors.len() as f64).sqrt());
    (rms, errors.iter().flatten().map(|error| error.abs()).fold(0.0, f64::max))
}
