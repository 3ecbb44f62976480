//! What was changed in the page as files, and the commands that give its numbers.

use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde_json::{Value, json};
use sonel::scenes::CompiledScene;

use super::edit;
use super::session::Session;
use super::wishes::{LISTENER, Save};

/// Saved files of one name.
const MOST_VERSIONS: usize = 1000;

impl Session {
    /// Writes files beside the scene or map, none of which exists before; with the commands. The map is one of `traced`.
    ///
    /// # Errors
    /// When they cannot be written.
    pub(super) fn saved(&self, traced: &CompiledScene, wish: &Save) -> anyhow::Result<Value> {
        let given = self.scene.as_ref().or(self.map_file.as_ref()).context("nothing to save")?;
        let (mut files, mut commands) = (Vec::new(), Vec::new());
        let (mut stem, mut map) = (given.with_extension(""), given.clone());
        if let Some(scene) = &self.scene {
            let (mut file, text) = (scene.clone(), self.text());
            if std::fs::read_to_string(scene).ok().as_ref() != Some(&text) {
                file = create(scene, "", "toml", &text)?;
                stem = file.with_extension("");
                files.push(file.clone());
            }
            map = free(&stem, "sonelmap");
            let packets = self.packets.map_or_else(String::new, |packets| format!(" --packets {packets}"));
            commands.push(format!("sonel-trace {} -o {}{packets}", quoted(&file), quoted(&map)));
        }
        let response = free(&stem, "npz");
        let mut render = format!("sonel-render {} -o {}", quoted(&map), quoted(&response));
        if !wish.changes.is_empty() {
            let text = edit::materials(traced, &wish.changes)?;
            let file = create(given, "-materials", "toml", &text)?;
            render += &format!(" --materials {}", quoted(&file));
            files.push(file);
        }
        let listed = wish.receivers.iter().map(|(name, at)| (name.as_str(), at));
        for (name, [x, y, z]) in std::iter::once((LISTENER, &wish.listener)).chain(listed) {
            render += &format!(" --receiver {}", quoted(Path::new(&format!("{name}={x},{y},{z}"))));
        }
        commands.push(render);
        let heard =
            self.heard.words().iter().map(|word| format!(" {}", quoted(Path::new(word)))).collect::<String>();
        commands.push(format!("sonel-analyze parameters {}{heard}", quoted(&response)));
        Ok(json!({ "files": files, "commands": commands }))
    }
}

/// Writes a new file beside `given`: its name with `what` and the first number that is free.
fn create(given: &Path, what: &str, ending: &str, text: &str) -> anyhow::Result<PathBuf> {
    let stem = given.file_stem().unwrap_or_default().to_string_lossy();
    for number in 2..MOST_VERSIONS {
        let path = given.with_file_name(format!("{stem}{what}-{number}.{ending}"));
        match File::create_new(&path) {
            Ok(mut file) => {
                file.write_all(text.as_bytes())
                    .with_context(|| format!("cannot write {}", path.display()))?;
                return Ok(path);
            }
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error).with_context(|| format!("cannot write {}", path.display())),
        }
    }
    bail!("{MOST_VERSIONS} versions of {stem}{what}.{ending} exist: delete some")
}

/// `stem.ending`, or the first numbered one that is free: no command replaces a file.
fn free(stem: &Path, ending: &str) -> PathBuf {
    let name = stem.file_name().unwrap_or_default().to_string_lossy();
    let numbered = (2..MOST_VERSIONS).map(|number| stem.with_file_name(format!("{name}-{number}.{ending}")));
    let mut names = std::iter::once(stem.with_extension(ending)).chain(numbered);
    names.find(|path| !path.exists()).unwrap_or_else(|| stem.with_extension(ending))
}

/// A path as a shell reads it.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-=,".contains(letter);
    if text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}
