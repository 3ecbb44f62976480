//! Changes in the text of a scene file. Comments and everything else stay.

use anyhow::{Context, bail};
use toml_edit::{Array, DocumentMut, Item, Table, value};

use super::wishes::Changes;

/// `text` with other positions of its sources, all of them, and other coefficients of its materials.
///
/// # Errors
/// When the text is no TOML, or has another number of sources.
pub(super) fn edited(text: &str, sources: &[[f64; 3]], changes: &Changes) -> anyhow::Result<String> {
    let mut document: DocumentMut = text.parse().context("the scene file")?;
    let listed = document.get_mut("sources").context("the scene file has no sources")?;
    let count = match listed {
        Item::ArrayOfTables(tables) => {
            tables.iter_mut().zip(sources).for_each(|(table, at)| table["position"] = value(numbers(at)));
            tables.len()
        }
        Item::Value(toml_edit::Value::Array(tables)) => {
            for (table, at) in tables.iter_mut().zip(sources) {
                let table = table.as_inline_table_mut().context("a source is no table")?;
                table.insert("position", numbers(at).into());
            }
            tables.len()
        }
        _ => bail!("`sources` is no list of tables"),
    };
    if count != sources.len() {
        bail!("the scene has {count} sources, {} were moved", sources.len());
    }
    for (name, values) in changes {
        let (material, key) = path(name)?;
        document["materials"][material][key] = value(numbers(values));
    }
    Ok(document.to_string())
}

/// A file for `--materials`: all coefficients of the materials that are named in `changes`.
///
/// # Errors
/// Never, but for changes that the page cannot make.
pub(super) fn materials(scene: &sonel::scenes::CompiledScene, changes: &Changes) -> anyhow::Result<String> {
    let mut all = Table::new();
    all.set_implicit(true);
    for name in changes.keys() {
        let (material, _) = path(name)?;
        let Some(own) = scene.materials.iter().find(|own| own.name == material) else { continue };
        let mut table = Table::new();
        table["absorption"] = value(numbers(&own.absorption));
        table["scattering"] = value(numbers(&own.scattering));
        table["transmission"] = value(numbers(&own.transmission));
        table["absorption_law"] = value(own.law.to_string());
        all.insert(material, Item::Table(table));
    }
    for (name, values) in changes {
        let (material, key) = path(name)?;
        if let Some(table) = all.get_mut(material) {
            table[key] = value(numbers(values));
        }
    }
    let mut document = DocumentMut::new();
    document["materials"] = Item::Table(all);
    Ok(document.to_string())
}

fn numbers(values: &[f64]) -> Array {
    values.iter().copied().collect()
}

/// Material and key of `materials.NAME.KEY`.
fn path(name: &str) -> anyhow::Result<(&str, &str)> {
    let parts = name.strip_prefix("materials.").and_then(|rest| rest.rsplit_once('.'));
    parts.with_context(|| format!("\"{name}\" is no coefficient of a material"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_move_and_comments_stay() {
        let text = "# a room\n[materials.\"wall a\"]\nlibrary = \"plaster\" # old\n\n[[sources]]\nname = \"s\"\nposition = [1, 2, 3] # m\n";
        let changes = Changes::from([("materials.wall a.absorption".to_owned(), vec![0.1, 0.25])]);
        let edited = edited(text, &[[1.5, 2.0, 1.0]], &changes).expect("a scene");
        assert!(edited.contains("# a room") && edited.contains("library = \"plaster\" # old"), "{edited}");
        assert!(edited.contains("position = [1.5, 2.0, 1.0]"), "{edited}");
        assert!(edited.contains("absorption = [0.1, 0.25]"), "{edited}");
        let inline = "sources = [{ name = \"s\", position = [0, 0, 0] }]\n";
        assert!(
            super::edited(inline, &[[1.0; 3]], &Changes::new()).expect("a scene").contains("[1.0, 1.0, 1.0]")
        );
        assert!(super::edited(text, &[], &Changes::new()).is_err());
    }
}
