//! Rust on pages stands in a file that is compiled.

use super::tree::{Finding, SourceFile, Tree};

/// Where the Rust of pages is compiled.
const COMPILED: &str = "crates/sonel/tests/face/snippets.rs";

/// Snippets of pages, and of the first page of crate sonel, that [`COMPILED`] has not.
pub(super) fn compiled(tree: &Tree) -> Vec<Finding> {
    let code = tree.files.iter().find(|file| file.path == COMPILED).map_or("", |file| &file.text);
    let code = joined(code.lines());
    let pages = tree.files.iter().filter(|file| file.is_markdown() || file.path == "crates/sonel/src/lib.rs");
    let missing = |file: &SourceFile| -> Vec<Finding> {
        let other = |(_, text): &(usize, String)| !text.is_empty() && !code.contains(text.as_str());
        let found = snippets(&file.text, file.is_rust()).into_iter().filter(other);
        found.map(|(line, _)| file.finding(line, format!("this Rust is not in {COMPILED}"))).collect()
    };
    pages.flat_map(missing).collect()
}

/// Lines without indentation, one after the other.
fn joined<'a>(lines: impl Iterator<Item = &'a str>) -> String {
    lines.map(str::trim).filter(|line| !line.is_empty()).map(|line| format!("{line}\n")).collect()
}

/// Snippets with the lines where they begin, without comments, imports and what pages hide.
fn snippets(text: &str, is_rust: bool) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut begun: Option<(usize, Vec<&str>)> = None;
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.strip_prefix("//!").filter(|_| is_rust).unwrap_or(line).trim();
        match &mut begun {
            Some((begin, lines)) if line.starts_with("```") => {
                found.push((*begin, joined(lines.iter().copied())));
                begun = None;
            }
            Some((_, lines)) if !is_left_out(line) => lines.push(line),
            None if ["```rust", "```no_run"].contains(&line) => begun = Some((number, Vec::new())),
            _ => {}
        }
    }
    found
}

/// Whether a line of a snippet is told otherwise: a comment, an import, what pages hide.
fn is_left_out(line: &str) -> bool {
    ["//", "use ", "# "].iter().any(|begin| line.starts_with(begin))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rust_that_is_not_compiled_is_rejected() {
        let page = "text\n```rust\nlet a = 1;\nf(a);\n```\n";
        let of = |code: &str| compiled(&Tree::of(&[("README.md", page), (COMPILED, code)]));
        assert!(of("fn g() {\n    let a = 1;\n    f(a);\n}\n").is_empty());
        assert_eq!(of("fn g() {\n    let a = 2;\n    f(a);\n}\n")[0].line, 2);
        let crate_page = "//! ```no_run\n//! use x;\n//! # fn main() {\n//! f(2);\n//! # }\n//! ```\n";
        let tree = Tree::of(&[("crates/sonel/src/lib.rs", crate_page), (COMPILED, "    f(2);\n")]);
        assert!(compiled(&tree).is_empty());
    }
}
