//! A measured room and the scene that is traced for it.

use std::fmt::Write;

use anyhow::Result;
use glam::DVec3;
use xtask::workspace;

/// A polygon of one material.
#[derive(Debug)]
pub(super) struct Face {
    pub material: String,
    /// In the axes of the data set [m].
    pub corners: Vec<DVec3>,
}

/// Coefficients of a material per band of the room.
#[derive(Clone)]
pub(super) struct Material {
    pub name: String,
    pub absorption: Vec<f64>,
    pub scattering: Vec<f64>,
}

/// A named place [m].
pub(super) type Place = (&'static str, [f64; 3]);

/// Reverberation time [s], EDT [s], C80 [dB] and D50 (0 … 1).
pub(super) type Values = [f64; 4];

/// Values of a source and a receiver per band, for all pairs or for the mean over them.
pub(super) type Pairs = Vec<Vec<Values>>;

/// A room whose geometry, coefficients and measured parameters are published.
pub(super) struct Room {
    /// In options and file names.
    pub name: &'static str,
    /// In the page.
    pub title: &'static str,
    pub faces: Vec<Face>,
    /// Up in the axes of the data set, "y" or "z".
    pub up: &'static str,
    pub temperature_celsius: f64,
    pub relative_humidity_percent: f64,
    /// Longer than the longest reverberation time [s].
    pub duration: f64,
    /// Nominal centres [Hz], one or three per octave.
    pub bands: Vec<f64>,
    /// Bands per octave.
    pub bands_per_octave: usize,
    pub sources: &'static [Place],
    pub receivers: &'static [Place],
    /// The reverberation time that was measured: title and key.
    pub reverberation_time: (&'static str, &'static str),
    /// Sets of coefficients, the ones to rely on first.
    pub estimates: Vec<Vec<Material>>,
    pub variants: &'static [Variant],
    /// One row per pair, sources first, or one of means.
    pub measured: Pairs,
    /// What simulations by others gave, in the same form.
    pub others: Vec<Pairs>,
}

/// How a room is traced.
pub(super) struct Variant {
    /// In file names.
    pub name: &'static str,
    /// In the table.
    pub title: &'static str,
    /// The set of coefficients.
    pub estimate: usize,
    /// For `--effects` of `sonel-render`.
    pub effects: &'static str,
    pub is_locally_reacting: bool,
    /// The published scattering coefficients are raised to this.
    pub least_scattering: f64,
}

impl Variant {
    /// The published coefficients, and the effects that matter.
    pub(super) const PLAIN: Self = Self {
        name: "plain",
        title: "published coefficients",
        estimate: 0,
        effects: "auto",
        is_locally_reacting: false,
        least_scattering: 0.0,
    };
}

impl Room {
    /// The scene file of a variant.
    pub(super) fn scene(&self, variant: &Variant) -> String {
        let width = if self.bands_per_octave == 3 { "third" } else { "octave" };
        let mut text = format!(
            "mesh = \"room.obj\"\nmesh_up = \"{}\"\nmesh_weld = 0.003\nduration_s = {:?}\n\n\
             [bands]\ncenter_frequencies_hz = {:?}\nwidth = \"{width}\"\n\n\
             [air]\ntemperature_celsius = {:?}\nrelative_humidity_percent = {:?}\n",
            self.up, self.duration, self.bands, self.temperature_celsius, self.relative_humidity_percent
        );
        for material in &self.estimates[variant.estimate] {
            let scattering: Vec<f64> =
                material.scattering.iter().map(|s| s.max(variant.least_scattering)).collect();
            let law = if variant.is_locally_reacting { "locally-reacting" } else { "uniform" };
            text += &format!(
                "\n[materials.\"{}\"]\nabsorption = {:?}\nscattering = {scattering:?}\nabsorption_law = \"{law}\"\n",
                material.name, material.absorption
            );
        }
        for (table, places) in [("sources", self.sources), ("receivers", self.receivers)] {
            for (name, position) in places {
                text += &format!("\n[[{table}]]\nname = \"{name}\"\nposition = {position:?}\n");
            }
        }
        text
    }

    /// Writes scene and mesh below target; the name of the scene file.
    pub(super) fn write(&self, variant: &Variant) -> Result<String> {
        let folder = format!("target/validate/{}", self.name);
        workspace::write(&format!("{folder}/room.obj"), obj(&self.faces))?;
        let scene = format!("{folder}/{}.toml", variant.name);
        workspace::write(&scene, self.scene(variant))?;
        Ok(scene)
    }
}

/// The polygons as a Wavefront OBJ file.
fn obj(faces: &[Face]) -> String {
    let (mut text, mut vertices) = (String::new(), 0);
    for face in faces {
        for corner in &face.corners {
            writeln!(text, "v {} {} {}", corner.x, corner.y, corner.z).expect("text has room");
        }
        let corners = (vertices + 1..=vertices + face.corners.len()).map(|corner| corner.to_string());
        writeln!(text, "usemtl {}\nf {}", face.material, corners.collect::<Vec<_>>().join(" "))
            .expect("text has room");
        vertices += face.corners.len();
    }
    text
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A cube of 2 m with thirds about 1 kHz.
    pub(crate) fn cube() -> Room {
        let corner =
            |index: usize| DVec3::new((index & 1) as f64, (index >> 1 & 1) as f64, (index >> 2) as f64) * 2.0;
        let sides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let faces = sides.map(|side| Face { material: "stone".into(), corners: side.map(corner).to_vec() });
        let stone = Material {
            name: "stone".into(),
            absorption: vec![0.1, 0.2, 0.3],
            scattering: vec![0.05, 0.4, 0.5],
        };
        Room {
            name: "cube",
            title: "cube",
            faces: faces.into(),
            up: "y",
            temperature_celsius: 20.0,
            relative_humidity_percent: 50.0,
            duration: 1.0,
            bands: vec![800.0, 1000.0, 1250.0],
            bands_per_octave: 3,
            sources: &[("S1", [0.5, 0.5, 0.5])],
            receivers: &[("R1", [1.5, 1.5, 1.0])],
            reverberation_time: ("T20", "t20_s"),
            estimates: vec![vec![stone]],
            variants: &[Variant::PLAIN],
            measured: vec![vec![[1.0, 1.0, 0.0, 0.5]; 3]],
            others: vec![],
        }
    }

    #[test]
    fn the_scene_compiles_with_the_coefficients_of_its_variant() {
        let room = cube();
        let load = |variant: &Variant| {
            let text = room.scene(variant);
            sonel_scene::load(&text, "cube.toml", &mut |_| Ok(obj(&room.faces).into_bytes()))
                .unwrap_or_else(|problems| panic!("{problems}\n{text}"))
                .scene
        };
        let plain = load(&Variant::PLAIN);
        assert_eq!((plain.materials.len(), plain.sources.len(), plain.receivers.len()), (1, 1, 1));
        assert!((plain.materials[0].absorption[2] - 0.3).abs() < 1e-6);
        assert!((plain.materials[0].scattering[0] - 0.05).abs() < 1e-6);
        let raised = load(&Variant { least_scattering: 0.3, is_locally_reacting: true, ..Variant::PLAIN });
        let scattering = &raised.materials[0].scattering;
        assert!((scattering[0] - 0.3).abs() < 1e-6 && (scattering[1] - 0.4).abs() < 1e-6);
        assert_ne!(raised.materials[0].law, plain.materials[0].law);
        assert!((plain.geometry().unwrap().volume().unwrap() - 8.0).abs() < 1e-3);
    }
}
