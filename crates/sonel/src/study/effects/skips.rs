//! Computations skipped because no surface needs them: events without energy, bands with equal coefficients.

use sonel_map::{BandClasses, Spectral};
use sonel_scene::Scene;

/// Something that the stages do or leave out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skip {
    /// The step.
    pub what: &'static str,
    /// Whether it is left out.
    pub skipped: bool,
    /// Why, in words.
    pub reason: String,
}

/// Steps that the stages skip in `scene`. Every line states a fact that the stages find in the coefficients themselves.
#[must_use]
pub fn skips(scene: &Scene, spectral: Spectral) -> Vec<Skip> {
    vec![mirrors(scene), diffuse(scene), leads(scene, spectral)]
}

/// The reflected energy of any band of any material in use that `part` of it goes to.
fn any(scene: &Scene, part: impl Fn(f64) -> f64) -> bool {
    let used = |material: usize| scene.mesh.triangles.iter().any(|t| t.material as usize == material);
    scene.materials.iter().enumerate().any(|(index, material)| {
        let reflects = |(absorption, scattering): (&f64, &f64)| (1.0 - absorption) * part(*scattering) > 0.0;
        material.absorption.iter().zip(&material.scattering).any(reflects) && used(index)
    })
}

fn mirrors(scene: &Scene) -> Skip {
    let skipped = !any(scene, |scattering| 1.0 - scattering);
    let reason = if skipped { "no surface reflects specularly" } else { "surfaces reflect specularly" };
    Skip { what: "image-source paths, spheres, gather", skipped, reason: reason.to_owned() }
}

fn diffuse(scene: &Scene) -> Skip {
    let skipped = !any(scene, |scattering| scattering);
    let reason = if skipped { "no surface scatters" } else { "surfaces scatter" };
    Skip { what: "connections", skipped, reason: reason.to_owned() }
}

fn leads(scene: &Scene, spectral: Spectral) -> Skip {
    let still = vec![0.0; scene.bands.count()];
    let classes = BandClasses::alike(&scene.materials, &scene.sources, &still, spectral);
    let (bands, kinds) = (scene.bands.count(), classes.representatives().count());
    let skipped = kinds < bands || bands == 1;
    let reason = match (kinds, spectral) {
        _ if bands == 1 => "one band".to_owned(),
        (_, Spectral::PerBand) => "every band has its own packets, as requested".to_owned(),
        (1, _) => format!("all {bands} bands share coefficients: one lead band is enough"),
        (kinds, _) if kinds == bands => format!("all {bands} bands differ in their coefficients"),
        (kinds, _) => format!("{bands} bands of {kinds} kinds of coefficients"),
    };
    Skip { what: "a lead band for each band", skipped, reason }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{BandWidth, Bands, Material};

    fn room(scattering: f64) -> Scene {
        let bands = Bands::new(vec![500.0, 1000.0], BandWidth::Octave).unwrap();
        Scene::shoebox([5.0, 4.0, 3.0], Material::uniform("walls", 0.2, scattering, 2), bands)
    }

    #[test]
    fn what_no_surface_does_is_skipped() {
        let skipped = |scattering: f64| -> Vec<bool> {
            skips(&room(scattering), Spectral::Shared).iter().map(|skip| skip.skipped).collect()
        };
        assert_eq!(skipped(0.0), [false, true, true]);
        assert_eq!(skipped(0.5), [false, false, true]);
        assert_eq!(skipped(1.0), [true, false, true]);
        let mut scene = room(0.5);
        scene.materials[0].absorption[1] = 0.3;
        assert!(!skips(&scene, Spectral::Shared)[2].skipped);
    }
}
