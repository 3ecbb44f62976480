//! No paths that exist on one machine only.

use super::tree::{Finding, Tree};

/// Folders at a system's root under which people and machines keep their own things.
const ROOTS: [&str; 8] = ["Users", "home", "mnt", "opt", "root", "tmp", "var", "work"];

/// Absolute paths in text files.
pub(super) fn absolute(tree: &Tree) -> Vec<Finding> {
    let mut findings = Vec::new();
    for file in &tree.files {
        for (number, line) in file.text.lines().enumerate() {
            if let Some(path) = absolute_path(line) {
                findings.push(file.finding(number + 1, format!("`{path}` exists on one machine only")));
            }
        }
    }
    findings
}

fn absolute_path(line: &str) -> Option<String> {
    let drive = line.match_indices(":\\").any(|(at, _)| {
        let mut before = line[..at].chars().rev();
        before.next().is_some_and(|c| c.is_ascii_uppercase())
            && !before.next().is_some_and(char::is_alphanumeric)
    });
    if drive {
        return Some("a drive's letter".into());
    }
    ROOTS.iter().map(|root| format!("/{root}/")).find(|path| {
        let starts =
            |at: usize| !line[..at].ends_with(|c: char| c.is_alphanumeric() || "_.-/})*".contains(c));
        line.match_indices(path.as_str()).any(|(at, _)| starts(at))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absolute_paths_are_rejected_and_relative_ones_are_not() {
        for root in ROOTS {
            let text = format!("first\nopen(\"/{root}/anna/scene.toml\")");
            let findings = absolute(&Tree::of(&[("a.rs", &text)]));
            assert_eq!(findings.len(), 1, "{text}");
            assert_eq!(findings[0].line, 2);
        }
        assert_eq!(absolute(&Tree::of(&[("a.md", concat!("see C:", "\\scenes"))])).len(), 1);
        let good = "target/tmp/x, ../home/y, https://a.example/work/z, {root}/tmp/q";
        assert!(absolute(&Tree::of(&[("a.md", good)])).is_empty());
    }
}
