//! Runs the commands of the tutorial and of the answers to questions, each page in a folder of its own, with few packets.
//!
//! Blocks `sh` are run; a block `toml NAME` is written to that file first. Answers find what a reader has: a model, its scene, a map, two responses, a
//! recording.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::python::printed;
use xtask::workspace::{self, Profile};

const FOLDER: &str = "target/site/run";
const TUTORIAL: &str = "docs/tutorial.md";
const ANSWERS: &str = "docs/how-to";
/// The page that begins with the model alone.
const OF_MODEL: &str = "model.md";
/// Traces with few packets, unless the page states how many.
const FEW: &str = "#!/bin/sh\ncase \"$*\" in\nnew\\ *|check\\ *|materials\\ *|*--packets*|*--plan*|*--until*) exec \"$PROGRAMS/sonel-trace\" \"$@\" ;;\n\
                   *) exec \"$PROGRAMS/sonel-trace\" \"$@\" --packets 4000 ;;\nesac\n";
const MODEL: &str = "sonel-trace new --shoebox 9,7,3 -o box.toml\nsonel-trace check box.toml --fix hall.obj\n\
                     sed -i 's/usemtl z0/usemtl floor parquet/; s/usemtl z1/usemtl ceiling/' hall.obj\n";
const HALL: &str = "sonel-trace new hall.obj -o hall.toml\nsonel-trace hall.toml -o hall.sonelmap\n\
                    sonel-render hall.sonelmap -o hall.npz\n\
                    sonel-render hall.sonelmap -o felt.npz --set materials.walls.absorption=0.3\n";

/// Runs all pages; returns how many commands.
pub(super) fn run() -> Result<usize> {
    let programs = workspace::programs(Profile::Release)?;
    let root = workspace::root();
    let mut pages = vec![TUTORIAL.to_owned()];
    for entry in fs::read_dir(root.join(ANSWERS))? {
        pages.push(format!("{ANSWERS}/{}", entry?.file_name().to_string_lossy()));
    }
    pages.retain(|page| page.ends_with(".md"));
    pages.sort();
    let mut count = 0;
    for page in pages {
        let folder = root.join(FOLDER).join(page.replace('/', "-"));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(folder.join("bin"))?;
        let few = folder.join("bin/sonel-trace");
        fs::write(&few, FEW)?;
        printed(Command::new("chmod").arg("+x").arg(&few))?;
        fs::write(folder.join("speech.wav"), recording())?;
        let text = workspace::read(&page)?;
        let mut script = match page.as_str() {
            TUTORIAL => String::new(),
            page if page.ends_with(OF_MODEL) => MODEL.to_owned(),
            _ => format!("{MODEL}{HALL}"),
        };
        for (kind, block) in blocks(&text) {
            match kind.split_once(' ') {
                None if kind == "sh" => {
                    count += block.lines().filter(|line| line.starts_with("sonel-")).count();
                    script += &block;
                }
                Some(("toml", name)) => fs::write(folder.join(name), block)?,
                _ => {}
            }
        }
        shell(&programs, &folder, &script).with_context(|| page.clone())?;
        println!("{page}: its commands run");
    }
    Ok(count)
}

fn shell(programs: &Path, folder: &Path, script: &str) -> Result<()> {
    let path = std::env::var("PATH").unwrap_or_default();
    let mut shell = Command::new("sh");
    shell.args(["-eu", "-c", script]).current_dir(folder).env("PROGRAMS", programs);
    shell.env("PATH", format!("{}:{}:{path}", folder.join("bin").display(), programs.display()));
    let run = shell.output().context("cannot run sh")?;
    ensure!(run.status.success(), "{}\n{}", run.status, String::from_utf8_lossy(&run.stderr));
    Ok(())
}

/// Fenced blocks: the words behind the fence, and the lines.
fn blocks(page: &str) -> Vec<(String, String)> {
    let (mut found, mut open): (Vec<(String, String)>, bool) = (Vec::new(), false);
    for line in page.lines() {
        match line.strip_prefix("```") {
            Some(_) if open => open = false,
            Some(kind) => {
                open = true;
                found.push((kind.to_owned(), String::new()));
            }
            None => {
                if let Some((_, block)) = found.last_mut().filter(|_| open) {
                    *block += line;
                    block.push('\n');
                }
            }
        }
    }
    found
}

/// A tenth of a second of a tone as a WAV file: 16-bit, 48 kHz.
fn recording() -> Vec<u8> {
    let samples: Vec<u8> =
        (0..4800_i32).flat_map(|i| (((i % 96) * 200 - 9600) as i16).to_le_bytes()).collect();
    let size = samples.len() as u32;
    let mut bytes = b"RIFF".to_vec();
    bytes.extend((36 + size).to_le_bytes());
    bytes.extend(b"WAVEfmt \x10\0\0\0\x01\0\x01\0\x80\xbb\0\0\0\x77\x01\0\x02\0\x10\0data");
    bytes.extend(size.to_le_bytes());
    bytes.extend(samples);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_have_kinds() {
        let page = "a\n```sh\nx\ny\n```\n```toml a.toml\nz = 1\n```\n";
        let expected =
            [("sh", "x\ny\n"), ("toml a.toml", "z = 1\n")].map(|(a, b)| (a.to_owned(), b.to_owned()));
        assert_eq!(blocks(page), expected);
    }
}
