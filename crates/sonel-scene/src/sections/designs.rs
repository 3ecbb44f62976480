//! `[variants.NAME]`: named choices of other materials, which a map carries besides those of the scene.

use sonel_acoustics::Material;

use super::materials::read_variant;
use crate::Design;
use crate::document::Table;
use crate::library::MaterialSources;
use crate::suggest::suggest;

/// The section.
pub(crate) const SECTION: &str = "variants";
/// The word that stands for every variant (`sonel-render --variant`).
const ALL: &str = "all";

/// Reads every design, in the order of the file, and adds its materials to `variants` unless they are there.
pub(crate) fn read(
    document: &Table<'_>,
    materials: &[Material],
    tables: &[Table<'_>],
    variants: &mut Vec<Vec<Material>>,
    sources: &MaterialSources,
) -> Vec<Design> {
    let Some(table) = document.table(SECTION) else { return Vec::new() };
    let mut designs = Vec::new();
    for (name, entry) in table.in_file_order() {
        let Some(chosen) = entry.table() else { continue };
        if !is_file_name(name) || name == ALL {
            entry.problem(
                "is part of a file name: use letters, digits, spaces, dots and hyphens, and not `all`",
            );
        }
        let mut choices = Vec::new();
        for (of, entry) in chosen.in_file_order() {
            let Some(index) = materials.iter().position(|material| material.name == of) else {
                let known = materials.iter().map(|material| material.name.as_str());
                entry.problem(&format!("no such material; {}", suggest(of, known)));
                continue;
            };
            if tables[index].get("interface").is_some() {
                entry.problem("is an interface between airs and has no coefficients; remove this key");
                continue;
            }
            let Some(table) = entry.table() else { continue };
            let variant = read_variant(&materials[index], &table, sources);
            if variant == materials[index] {
                continue;
            }
            if variants.is_empty() {
                variants.resize(materials.len(), Vec::new());
            }
            let known = variants[index].iter().position(|known| *known == variant);
            let at = known.unwrap_or_else(|| {
                variants[index].push(variant);
                variants[index].len() - 1
            });
            choices.push((index as u32, at as u32));
        }
        designs.push(Design { name: name.to_owned(), choices });
    }
    designs
}

/// Whether any system takes `name` as part of a file name.
fn is_file_name(name: &str) -> bool {
    name.trim() == name
        && !name.is_empty()
        && name.chars().all(|letter| letter.is_alphanumeric() || " .-_".contains(letter))
}
