//! Variants of materials as a section of the file, validated on reading.

use sonel_acoustics::Material;
use sonel_scene::{Design, Scene};

use crate::codec::{DesignsRecord, VariantsRecord};
use crate::leads::{MOST_SETS, set_count};
use crate::record;

/// Name of the section.
pub(crate) const SECTION: &str = "variants";
/// Name of the section of named choices among them.
pub(crate) const DESIGNS: &str = "designs";

/// The section of `scene`; [`None`] where no material has variants.
pub(crate) fn record(scene: &Scene) -> Option<VariantsRecord> {
    let of = |(material, variants): (u32, &Vec<Material>)| -> VariantsRecord {
        variants.iter().map(|variant| (material, record::material_record(variant))).collect()
    };
    let variants: VariantsRecord = (0..).zip(&scene.variants).flat_map(of).collect();
    (!variants.is_empty()).then_some(variants)
}

/// Gives `scene` the variants that the section names; the reason where it cannot have them.
pub(crate) fn apply(section: Option<VariantsRecord>, scene: &mut Scene) -> Result<(), String> {
    let Some(variants) = section else { return Ok(()) };
    scene.variants = vec![Vec::new(); scene.materials.len()];
    for (material, coefficients) in variants {
        let original = scene.materials.get(material as usize);
        let law = original.ok_or("a variant is of a material that does not exist")?.law;
        let variant = Material { law, ..record::material(coefficients) };
        if let Some(problem) = variant.problems(scene.bands.count()).first() {
            return Err(format!("variant of material {}: {problem}", variant.name));
        }
        scene.variants[material as usize].push(variant);
    }
    Ok(())
}

/// The section of named choices; [`None`] where there are none.
pub(crate) fn designs(scene: &Scene) -> Option<DesignsRecord> {
    let record = |Design { name, choices }: &Design| {
        (name.clone(), choices.iter().map(|&(material, variant)| [material, variant]).collect())
    };
    let designs: DesignsRecord = scene.designs.iter().map(record).collect();
    (!designs.is_empty()).then_some(designs)
}

/// Gives `scene` the named choices of the section; the reason where it cannot have them.
pub(crate) fn apply_designs(section: Option<DesignsRecord>, scene: &mut Scene) -> Result<(), String> {
    for (name, choices) in section.into_iter().flatten() {
        let exists = |&[material, variant]: &[u32; 2]| {
            scene.variants.get(material as usize).is_some_and(|of| (variant as usize) < of.len())
        };
        if !choices.iter().all(exists) || scene.designs.iter().any(|design| design.name == name) {
            return Err(format!("variant \"{name}\" is there twice or has materials that do not exist"));
        }
        let choices = choices.into_iter().map(|[material, variant]| (material, variant)).collect();
        scene.designs.push(Design { name, choices });
    }
    if set_count(scene) > MOST_SETS {
        return Err("variants differ in more shares of events than packets are traced for".to_owned());
    }
    Ok(())
}
