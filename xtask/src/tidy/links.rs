//! Links between pages, and pages that are mentioned by path.

use super::tree::{Finding, Tree};

/// Markdown links and mentions of `docs/….md` that lead nowhere.
pub(crate) fn targets(tree: &Tree) -> Vec<Finding> {
    let mut findings = Vec::new();
    for file in tree.files.iter().filter(|f| f.is_markdown() || f.is_rust() && f.path != OWN_SAMPLES) {
        for (number, line) in file.text.lines().enumerate() {
            let links = if file.is_markdown() { links(line) } else { Vec::new() };
            let broken_links = links.into_iter().filter(|link| !tree.contains(&resolve(&file.path, link)));
            let broken_mentions = mentions(line).filter(|page| !tree.contains(page));
            for target in broken_links.chain(broken_mentions) {
                findings.push(file.finding(number + 1, format!("{target} does not exist")));
            }
        }
    }
    findings
}

/// This file holds samples that must not resolve.
const OWN_SAMPLES: &str = "xtask/src/tidy/links.rs";

/// Targets of `[text](target)` in this repository, without anchors.
pub(crate) fn links(line: &str) -> Vec<&str> {
    let targets = line.split("](").skip(1).filter_map(|rest| rest.split_once(')').map(|(target, _)| target));
    targets
        .map(|target| target.split('#').next().unwrap_or_default())
        .filter(|target| !target.is_empty() && !target.contains("://") && !target.starts_with("mailto:"))
        .collect()
}

/// Pages written as a path from the root.
fn mentions(line: &str) -> impl Iterator<Item = &str> {
    line.match_indices("docs/").filter_map(|(at, _)| {
        let end = line[at..].find(|c: char| !(c.is_ascii_alphanumeric() || "/_.-".contains(c)));
        let page = line[at..].split_at(end.unwrap_or(line.len() - at)).0.trim_end_matches('.');
        let from_root = !line[..at].ends_with(|c: char| c.is_alphanumeric() || "/._-".contains(c));
        (from_root && page.ends_with(".md")).then_some(page)
    })
}

/// `link` as seen from the page `from`, as a path from the root.
pub(crate) fn resolve(from: &str, link: &str) -> String {
    let mut parts: Vec<&str> = from.split('/').collect();
    parts.pop();
    for part in link.trim_end_matches('/').split('/') {
        match part {
            "." => {}
            ".." => {
                parts.pop();
            }
            name => parts.push(name),
        }
    }
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_and_mentions_that_lead_nowhere_are_rejected() {
        let pages = [("docs/physics.md", ""), ("scenes/hall/README.md", "")];
        let with = |path: &str, text: &str| {
            let [a, b] = pages;
            targets(&Tree::of(&[a, b, (path, text)])).len()
        };
        assert_eq!(
            with("docs/a.md", "[x](physics.md#units), [y](../scenes/hall/), [z](https://a.example/b)"),
            0
        );
        assert_eq!(with("a.rs", "//! docs/physics.md §3, docs/physics.md."), 0);
        assert_eq!(with("docs/a.md", "[x](physic.md)"), 1);
        assert_eq!(with("docs/a.md", "[x](../physics.md)"), 1);
        assert_eq!(with("a.rs", "//! See docs/physic.md."), 1);
    }
}
