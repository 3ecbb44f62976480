//! The house page: the pages of docs/ and what they link to, as a site that needs no server and no network.
//!
//! Pages keep their places below target/site/source, so links between them need no change. Linked files that are no pages become
//! downloads. The menu on the left comes from the lists of docs/README.md. Sphinx makes the pages, with search; a link that leads nowhere is an
//! error.

mod commands;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::python::{self, shown};
use crate::tidy::links::{links, resolve};
use xtask::workspace;

const ENVIRONMENT: &str = "target/site/python";
const REQUIREMENTS: &str = "docs/site/requirements.txt";
const SOURCE: &str = "target/site/source";
const HTML: &str = "target/site/html";
const START: &str = "docs/README.md";

/// The folder of programs of the environment with Sphinx.
pub(crate) fn environment() -> Result<PathBuf> {
    python::environment(ENVIRONMENT, REQUIREMENTS)
}

/// Builds the site.
pub(crate) fn build() -> Result<()> {
    let python = environment()?.join("python");
    let root = workspace::root();
    for folder in [SOURCE, HTML] {
        let _ = fs::remove_dir_all(root.join(folder));
    }
    let pages = assemble()?;
    workspace::write(&format!("{SOURCE}/conf.py"), workspace::read("docs/site/conf.py")?)?;
    let words =
        ["-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going", "--builder", "html", SOURCE, HTML];
    shown(Command::new(python).args(words))?;
    workspace::write(
        &format!("{HTML}/index.html"),
        "<!doctype html><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"0; url=docs/README.html\"><title>sonel</title>\n",
    )?;
    let foreign = foreign(&root.join(HTML))?;
    ensure!(foreign.is_empty(), "the site loads from elsewhere: {}", foreign.join(", "));
    println!("site: {pages} pages; open {HTML}/index.html");
    Ok(())
}

/// Builds the site and runs the commands of its tutorial and answers.
pub(crate) fn accept() -> Result<()> {
    build()?;
    println!("site: {} commands run", commands::run()?);
    Ok(())
}

/// Copies the first page and all that it leads to; returns the number of pages.
fn assemble() -> Result<usize> {
    let (mut waiting, mut known) = (vec![START.to_owned()], BTreeSet::from([START.to_owned()]));
    let mut pages = 0;
    while let Some(path) = waiting.pop() {
        let target = format!("{SOURCE}/{path}");
        if !path.ends_with(".md") {
            let bytes =
                fs::read(workspace::root().join(&path)).with_context(|| format!("cannot read {path}"))?;
            workspace::write(&target, bytes)?;
            continue;
        }
        pages += 1;
        let mut text = without_folders(&path, &workspace::read(&path)?);
        for link in text.lines().flat_map(links) {
            let linked = resolve(&path, link);
            if known.insert(linked.clone()) {
                waiting.push(linked);
            }
        }
        if path == START {
            text += &menu(&text);
        }
        workspace::write(&target, text)?;
    }
    Ok(pages)
}

/// `text` of the page `path` with links to folders as links to their README.md, or as plain words where they have none.
fn without_folders(path: &str, text: &str) -> String {
    let mut changed = text.to_owned();
    for link in text.lines().flat_map(links) {
        let folder = resolve(path, link);
        if !workspace::root().join(&folder).is_dir() {
            continue;
        }
        if workspace::root().join(&folder).join("README.md").is_file() {
            changed = changed
                .replace(&format!("]({link})"), &format!("]({}/README.md)", link.trim_end_matches('/')));
        } else {
            // `[words](folder)` becomes `words (folder)`.
            let mut parts = changed.split(&format!("]({link})")).map(str::to_owned).collect::<Vec<_>>();
            let last = parts.pop().unwrap_or_default();
            let words = parts.into_iter().map(|part| match part.rsplit_once('[') {
                Some((before, words)) => format!("{before}{words} (`{folder}`)"),
                None => part,
            });
            changed = words.collect::<String>() + &last;
        }
    }
    changed
}

/// The lists of the first page as menus, one for each heading.
fn menu(page: &str) -> String {
    let mut text = String::new();
    for section in page.split("\n## ").skip(1) {
        let caption = section.lines().next().unwrap_or_default();
        let items = section
            .lines()
            .filter(|line| line.starts_with("- ["))
            .flat_map(|line| links(line).into_iter().take(1));
        let entries: Vec<&str> = items.filter(|link| link.ends_with(".md")).collect();
        if !entries.is_empty() {
            text +=
                &format!("\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{}\n```\n", entries.join("\n"));
        }
    }
    text
}

/// Scripts, styles and pictures that the pages below `folder` load from elsewhere.
fn foreign(folder: &Path) -> Result<Vec<String>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(self::foreign(&path)?);
        } else if path.extension().is_some_and(|ending| ending == "html") {
            let text = fs::read_to_string(&path)?;
            let loads = |tag: &str, key: &str| {
                text.split(tag).skip(1).filter_map(|rest| rest.split('>').next()).any(|tag| {
                    [format!("{key}=\"http"), format!("{key}=\"//")]
                        .iter()
                        .any(|outside| tag.contains(outside))
                })
            };
            if loads("<script", "src") || loads("<link", "href") || loads("<img", "src") {
                found.push(path.display().to_string());
            }
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn menus_have_the_pages_of_the_lists() {
        let page = "# D\n\n## Using\n\n- [a](a.md): text, [b](b.md)\n- [c](x/c.md)\n- [crate](../lib.rs)\n\n## None\n\nwords\n";
        assert_eq!(menu(page), "\n```{toctree}\n:hidden:\n:caption: Using\n\na.md\nx/c.md\n```\n");
    }

    #[test]
    fn folders_are_linked_by_their_readme_or_named() {
        let text = without_folders(
            "docs/README.md",
            "[hall](../scenes/hall/), [cases](../tests/cases) and [x](README.md)",
        );
        assert_eq!(text, "[hall](../scenes/hall/README.md), cases (`tests/cases`) and [x](README.md)");
    }
}
