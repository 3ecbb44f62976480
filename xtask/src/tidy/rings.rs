//! Lines of code of each ring, with a budget: neither blank lines nor comments nor tests.
//!
//! A budget is what the ring has, rounded up to the next hundred. Whoever removes code lowers it; a ring that needs more says in
//! ARCHITECTURE.md why.

use super::purity::only_for_tests;
use super::rust_source::lines_of_code;
use super::tree::{Finding, Tree};

/// Name, most lines, and folders, of which only `src` counts.
type Ring = (&'static str, usize, &'static [&'static str]);

const RINGS: [Ring; 6] = [
    (
        "engine",
        29_000,
        &[
            "crates/sonel-acoustics/",
            "crates/sonel-sampling/",
            "crates/sonel-geometry/",
            "crates/sonel-diffraction/",
            "crates/sonel-sofa/",
            "crates/sonel-scene/",
            "crates/sonel-map/",
            "crates/sonel-tracer/",
            "crates/sonel-renderer/",
            "crates/sonel-echogram/",
        ],
    ),
    ("results", 7_530, &["crates/sonel-analysis/", "crates/sonel-design/", "crates/sonel-drawing/"]),
    ("sound", 2_195, &["crates/sonel-sound/"]),
    ("face", 6_875, &["crates/sonel/"]),
    ("programs", 7_100, &["tools/"]),
    ("binding", 1_100, &["python/"]),
];

/// Rings above their budget.
pub(super) fn budgets(tree: &Tree) -> Vec<Finding> {
    let over = |&(name, budget, folders): &Ring| {
        let count = lines(tree, folders);
        let message = format!("ring {name}: {count} lines of code, its budget is {budget}: make it smaller");
        (count > budget).then(|| Finding { path: "xtask/src/tidy/rings.rs".to_owned(), line: 1, message })
    };
    RINGS.iter().filter_map(over).collect()
}

/// `engine 26 of 100, …`
pub(super) fn summary(tree: &Tree) -> String {
    let ring = |(name, budget, folders): &Ring| format!("{name} {} of {budget}", lines(tree, folders));
    RINGS.iter().map(ring).collect::<Vec<_>>().join(", ")
}

fn lines(tree: &Tree, folders: &[&str]) -> usize {
    let is_of = |path: &str| path.contains("/src/") && folders.iter().any(|folder| path.starts_with(folder));
    let files = tree.files.iter().filter(|file| file.is_rust() && is_of(&file.path));
    files.filter(|file| !only_for_tests(tree, &file.path)).map(|file| lines_of_code(&file.text)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_above_its_budget_is_rejected() {
        let budget = RINGS[5].1;
        let of = |count: usize| Tree::of(&[("python/src/lib.rs", &"f();\n".repeat(count))]);
        assert!(budgets(&of(budget)).is_empty());
        assert_eq!(budgets(&of(budget + 1)).len(), 1);
    }

    #[test]
    fn modules_for_tests_and_other_folders_do_not_count() {
        let tree = Tree::of(&[
            ("tools/a/src/main.rs", "#[cfg(test)]\nmod tests;\nfn main() {}"),
            ("tools/a/src/tests.rs", "fn f() {}"),
            ("tools/a/tests/b.rs", "fn g() {}"),
        ]);
        assert_eq!(lines(&tree, &["tools/"]), 1);
    }
}
