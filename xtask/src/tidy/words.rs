//! Words of all pages, with a budget. Borders of tables and other signs without a letter or digit are no words.
//!
//! Who adds a page takes as much from others: what the code or `--help` says, and what two pages say.

use super::tree::{Finding, SourceFile, Tree};

/// Most words of `docs/` and of the pages at the root.
const BUDGET: usize = 33_600;

/// The budget, if the pages exceed it.
pub(super) fn budget(tree: &Tree) -> Vec<Finding> {
    let count = count(tree);
    let message = format!("pages: {count} words, their budget is {BUDGET}: make them shorter");
    let finding = Finding { path: "xtask/src/tidy/words.rs".to_owned(), line: 1, message };
    (count > BUDGET).then_some(finding).into_iter().collect()
}

/// `100 of 200`
pub(super) fn summary(tree: &Tree) -> String {
    format!("{} of {BUDGET}", count(tree))
}

fn count(tree: &Tree) -> usize {
    let is_page = |path: &str| path.starts_with("docs/") || !path.contains('/');
    let pages = tree.files.iter().filter(|file| file.is_markdown() && is_page(&file.path));
    let is_word = |word: &&str| word.chars().any(char::is_alphanumeric);
    pages.map(|file: &SourceFile| file.text.split_whitespace().filter(is_word).count()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_above_their_budget_are_rejected() {
        let of = |words: usize| Tree::of(&[("docs/README.md", &"a ".repeat(words)), ("README.md", "b c")]);
        assert!(budget(&of(BUDGET - 2)).is_empty());
        assert_eq!(budget(&of(BUDGET - 1)).len(), 1);
    }

    #[test]
    fn pages_of_scenes_and_of_crates_do_not_count() {
        assert_eq!(
            count(&Tree::of(&[("scenes/hall/README.md", "a b"), ("docs/x.csv", "c"), ("STYLE.md", "| d |")])),
            1
        );
    }
}
