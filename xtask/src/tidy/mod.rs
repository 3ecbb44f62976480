//! Checks what a program can check of the house rules (ARCHITECTURE.md, STYLE.md).
//!
//! A rule is a function from the tree of files to findings. Each has a test with a violating sample it must reject.

mod circles;
mod layering;
pub(crate) mod links;
mod modules;
mod paths;
mod purity;
mod references;
mod rings;
mod rust_source;
mod snippets;
mod tree;
mod words;

use anyhow::{Result, bail};

use tree::{Finding, Tree};

type Rule = fn(&Tree) -> Vec<Finding>;

const RULES: [(&str, Rule); 15] = [
    ("arrows between our crates point down", layering::arrows),
    ("programs and Python name crate sonel and none below it", layering::one_door),
    ("a foreign package has one home", layering::homes),
    ("dependencies are used", layering::unused),
    ("a ring keeps to its budget", rings::budgets),
    ("pages keep to their budget", words::budget),
    ("libraries touch no outside world", purity::outside_world),
    ("libraries take elementary functions from libm", purity::elementary_functions),
    ("modules do not import each other in circles", circles::circles),
    ("a file holds one idea and says which", modules::shape),
    ("names say something", modules::names),
    ("citations are resolved", references::citations),
    ("no paths of one machine", paths::absolute),
    ("links lead somewhere", links::targets),
    ("Rust on pages is compiled", snippets::compiled),
];

/// Prints every finding; an error if there is any.
pub(crate) fn run() -> Result<()> {
    let tree = Tree::read()?;
    let mut count = 0;
    for (title, rule) in RULES {
        for finding in rule(&tree) {
            println!("{finding}  [{title}]");
            count += 1;
        }
    }
    if count > 0 {
        bail!("tidy: {count} findings in {} files", tree.files.len());
    }
    println!("lines of code: {}", rings::summary(&tree));
    println!("words of pages: {}", words::summary(&tree));
    println!("tidy: {} files, {} rules, no findings", tree.files.len(), RULES.len());
    Ok(())
}
