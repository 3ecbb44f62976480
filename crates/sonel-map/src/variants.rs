//! Variants of materials as a section of the file, validated on reading.

use sonel_acoustics::Material;
use sonel_scene::Scene;

use crate::codec::{VariantRecord, VariantsRecord};
use crate::leads::{MOST_SETS, set_count};
use crate::record;

/// Name of the section.
pub(crate) const SECTION: &str = "variants";

/// The section of `scene`; [`None`] where no material has variants.
pub(crate) fn record(scene: &Scene) -> Option<VariantsRecord> {
    let of = |(material, variants): (u32, &Vec<Material>)| -> Vec<VariantRecord> {
        let record = |variant| VariantRecord { material, coefficients: record::material_record(variant) };
        variants.iter().map(record).collect()
    };
    let variants: Vec<VariantRecord> = (0..).zip(&scene.variants).flat_map(of).collect();
    (!variants.is_empty()).then_some(VariantsRecord { variants })
}

/// Gives `scene` the variants that the section names; the reason where it cannot have them.
pub(crate) fn apply(section: Option<VariantsRecord>, scene: &mut Scene) -> Result<(), String> {
    let Some(VariantsRecord { variants }) = section else { return Ok(()) };
    scene.variants = vec![Vec::new(); scene.materials.len()];
    for VariantRecord { material, coefficients } in variants {
        let original = scene.materials.get(material as usize);
        let law = original.ok_or("a variant is of a material that does not exist")?.law;
        let variant = Material { law, ..record::material(coefficients) };
        if let Some(problem) = variant.problems(scene.bands.count()).first() {
            return Err(format!("variant of material {}: {problem}", variant.name));
        }
        scene.variants[material as usize].push(variant);
    }
    if set_count(scene) > MOST_SETS {
        return Err("variants differ in more shares of events than packets are traced for".to_owned());
    }
    Ok(())
}
