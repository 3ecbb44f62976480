//! Length, opening and name of source files.

use super::tree::{Finding, Tree};

/// Longest source file, in lines.
const LONGEST: usize = 600;

/// Names that say nothing about what is inside.
const EMPTY_NAMES: [&str; 9] =
    ["common", "core", "data", "helper", "helpers", "info", "manager", "util", "utils"];

/// Files that are too long, and files that do not open by saying what they are about.
pub(super) fn shape(tree: &Tree) -> Vec<Finding> {
    let mut findings = Vec::new();
    for file in tree.files.iter().filter(|f| f.is_rust()) {
        let lines = file.text.lines().count();
        if lines > LONGEST {
            findings.push(file.finding(LONGEST + 1, format!("{lines} lines; split it, one idea a file")));
        }
        if !file.text.trim_start().starts_with("//!") {
            findings.push(file.finding(1, "open with `//!`: what it is about, when it holds, references"));
        }
    }
    findings
}

/// Files, folders and inline modules with names that say nothing.
pub(super) fn names(tree: &Tree) -> Vec<Finding> {
    let mut findings = Vec::new();
    for file in tree.files.iter().filter(|f| f.is_rust()) {
        for part in file.path.trim_end_matches(".rs").split('/').filter(|part| says_nothing(part)) {
            findings.push(file.finding(1, format!("`{part}` says nothing; name the idea")));
        }
        for (number, line) in file.text.lines().enumerate() {
            let declared = line.trim_start().trim_start_matches("pub ").strip_prefix("mod ");
            let name = declared.map(|rest| rest.split([';', ' ', '{']).next().unwrap_or_default());
            if let Some(name) = name.filter(|name| says_nothing(name)) {
                findings.push(file.finding(number + 1, format!("`mod {name}` says nothing; name the idea")));
            }
        }
    }
    findings
}

fn says_nothing(name: &str) -> bool {
    EMPTY_NAMES.contains(&name)
        || EMPTY_NAMES
            .iter()
            .any(|empty| name.ends_with(&format!("_{empty}")) || name.ends_with(&format!("-{empty}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_files_and_files_without_an_opening_are_rejected() {
        let long = format!("//! Long.\n{}", "\n".repeat(LONGEST));
        assert_eq!(shape(&Tree::of(&[("a.rs", &long)])).len(), 1);
        assert_eq!(shape(&Tree::of(&[("a.rs", "use b;\n//! Late.")])).len(), 1);
        assert!(shape(&Tree::of(&[("a.rs", "//! Good.\n")])).is_empty());
    }

    #[test]
    fn names_that_say_nothing_are_rejected() {
        for path in ["crates/sonel-utils/src/lib.rs", "crates/a/src/helper.rs", "crates/a/src/common/mod.rs"]
        {
            assert_eq!(names(&Tree::of(&[(path, "")])).len(), 1, "{path}");
        }
        assert_eq!(names(&Tree::of(&[("a.rs", "pub mod data;\nmod scene_info {}")])).len(), 2);
        assert!(names(&Tree::of(&[("crates/a/src/database.rs", "mod inform;")])).is_empty());
    }
}
