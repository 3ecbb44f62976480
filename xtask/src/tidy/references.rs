//! Citations such as `[Schroeder1965]` or `[ISO9613-1]` stand in docs/references.md.

use super::tree::{Finding, Tree};

const LIST: &str = "docs/references.md";

/// Keys cited anywhere but not listed.
pub(super) fn citations(tree: &Tree) -> Vec<Finding> {
    let listed: Vec<_> =
        tree.files.iter().filter(|f| f.path == LIST).flat_map(|f| listed_keys(&f.text)).collect();
    let mut findings = Vec::new();
    for file in tree.files.iter().filter(|f| f.path != LIST && cites(&f.path)) {
        for (number, line) in file.text.lines().enumerate() {
            for key in keys(line).filter(|key| !listed.contains(key)) {
                findings.push(file.finding(number + 1, format!("[{key}] is not in {LIST}")));
            }
        }
    }
    findings
}

/// Files that may cite; this one holds samples that must not resolve.
fn cites(path: &str) -> bool {
    [".rs", ".md", ".toml"].iter().any(|end| path.ends_with(end)) && path != "xtask/src/tidy/references.rs"
}

/// Keys at the start of the list's entries, `- **[Key]** …`.
fn listed_keys(list: &str) -> impl Iterator<Item = &str> {
    list.lines().filter_map(|line| keys(line.strip_prefix("- **")?).next())
}

/// Words in brackets that have the form of a key.
fn keys(line: &str) -> impl Iterator<Item = &str> {
    line.split('[')
        .skip(1)
        .filter_map(|rest| rest.split_once(']').map(|(word, _)| word))
        .filter(|w| is_key(w))
}

/// Authors and year (`Schroeder1965`, `Wilkie2014a`), or a standard's number (`ISO3382-1`, `IEC60268-16`).
fn is_key(word: &str) -> bool {
    let letters = word.chars().take_while(char::is_ascii_alphabetic).count();
    let (name, number) = word.split_at(letters);
    if name.is_empty() || !name.starts_with(|c: char| c.is_ascii_uppercase()) {
        return false;
    }
    if matches!(name, "ISO" | "IEC") {
        return number.split('-').all(|part| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit()));
    }
    let year = number.trim_end_matches(|c: char| c.is_ascii_lowercase());
    name.len() >= 3 && year.len() == 4 && number.len() <= 5 && year.bytes().all(|b| b.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unlisted_citations_are_rejected() {
        let list = (LIST, "# References\n\n- **[Schroeder1965]** M. R. Schroeder.\n- **[ISO9613-1]** Air.\n");
        let good = ("a.rs", "//! See [Schroeder1965], [ISO9613-1].\nlet x = [Air]; y[2024];");
        assert!(citations(&Tree::of(&[list, good])).is_empty());
        for missing in ["//! [Nobody1999]", "//! [ISO1-2]", "//! [Schroeder1965b]"] {
            assert_eq!(citations(&Tree::of(&[list, ("a.rs", missing)])).len(), 1, "{missing}");
        }
    }

    #[test]
    fn a_mention_in_the_list_is_no_entry() {
        let list = (LIST, "- **[Schroeder1965]** differs from [Nobody1999].\n");
        assert_eq!(citations(&Tree::of(&[list, ("a.md", "[Nobody1999]")])).len(), 1);
    }
}
