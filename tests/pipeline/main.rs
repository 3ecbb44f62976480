//! The programs as a user runs them, from a scene file to a response.

mod bad_input;
mod comparison;
mod extend;
mod figures;
mod reproducible;

use std::path::{Path, PathBuf};

use clap::Parser;
use sonel_console::Outcome;
use sonel_echogram::Response;
use tempfile::TempDir;

/// A folder with a small scene, removed with the value.
pub struct Workshop {
    folder: TempDir,
}

const SCENE: &str = r#"
name = "Two-coloured box"
shoebox = [5.0, 4.0, 3.0]
duration_s = 0.6

[bands]
center_frequencies_hz = [250, 500, 1000]

[air]
speed_of_sound = 343.0

[materials.walls]
absorption = [0.2, 0.3, 0.4]
scattering = 0.4

[materials.z0]
absorption = 0.5
scattering = [0.1, 0.5, 0.9]

[[sources]]
name = "speaker"
position = [1.0, 1.0, 1.5]

[[receivers]]
name = "listener"
position = [3.9, 2.8, 1.2]
"#;

impl Workshop {
    /// A folder that holds a small `scene.toml`.
    pub fn open() -> Self {
        Self::with(SCENE)
    }

    /// A folder that holds `scene` as `scene.toml`.
    pub fn with(scene: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder for temporary files");
        std::fs::write(folder.path().join("scene.toml"), scene).expect("an empty folder");
        Self { folder }
    }

    /// A copy of a shipped scene.
    pub fn shipped(name: &str) -> Self {
        let shop = Self::open();
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name);
        for entry in std::fs::read_dir(scene).expect("a shipped scene") {
            let file = entry.expect("a readable folder").path();
            std::fs::copy(&file, shop.path(&file.file_name().expect("a file").to_string_lossy()))
                .expect("a copy");
        }
        shop
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The bytes of a file.
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).expect("a file that was written")
    }

    /// Runs `sonel-trace scene.toml -o MAP` with more `options`; what it prints to stdout.
    pub fn trace(&self, map: &str, options: &[&str]) -> anyhow::Result<String> {
        let arguments = self.line("sonel-trace", &["scene.toml"], map, options);
        let arguments = sonel_trace::Arguments::try_parse_from(arguments)?;
        let mut out = Vec::new();
        assert_eq!(sonel_trace::run(&arguments, &mut out, &mut Vec::new())?, Outcome::Done);
        Ok(String::from_utf8(out)?)
    }

    /// Runs `sonel-render MAP -o RESPONSE` with more `options`; what it prints to stdout.
    pub fn render(&self, map: &str, response: &str, options: &[&str]) -> anyhow::Result<String> {
        let arguments = self.line("sonel-render", &[map], response, options);
        let arguments = sonel_render::Arguments::try_parse_from(arguments)?;
        let mut out = Vec::new();
        assert_eq!(sonel_render::run(&arguments, &mut out, &mut Vec::new())?, Outcome::Done);
        Ok(String::from_utf8(out)?)
    }

    /// Reads a response.
    pub fn response(&self, name: &str) -> Response {
        Response::read(std::io::Cursor::new(self.bytes(name))).expect("a response just written")
    }

    fn line(&self, program: &str, inputs: &[&str], output: &str, options: &[&str]) -> Vec<String> {
        let place = |name: &Path| name.display().to_string();
        let mut line = vec![program.to_owned()];
        line.extend(inputs.iter().map(|name| place(&self.path(name))));
        line.extend(["-o".to_owned(), place(&self.path(output)), "--quiet".to_owned()]);
        line.extend(options.iter().map(|&option| option.to_owned()));
        line
    }
}
