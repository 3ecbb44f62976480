//! Modules that import each other in a circle: none of them can be read, tested or moved alone.
//!
//! Compared are siblings, each with all that is inside it. A module and its parent may know each other, as Rust means it.

use std::collections::{BTreeMap, BTreeSet};

use super::rust_source::shipped;
use super::tree::{Finding, SourceFile, Tree};

/// The path of a module from the root of its crate; empty for the root.
type Module = Vec<String>;
/// Module → siblings that it imports from.
type Imports = BTreeMap<Module, BTreeSet<Module>>;

/// Sibling modules that import each other, directly or over others.
pub(super) fn circles(tree: &Tree) -> Vec<Finding> {
    let mut crates = BTreeMap::<&str, Vec<(Module, &SourceFile)>>::new();
    for file in tree.files.iter().filter(|file| file.is_rust()) {
        let Some((root, inside)) = file.path.split_once("/src/") else { continue };
        if !inside.split('/').any(|part| part.trim_end_matches(".rs") == "tests") {
            crates.entry(root).or_default().push((module(inside), file));
        }
    }
    crates.values().flat_map(|modules| circles_of(modules)).collect()
}

/// `a/b.rs` and `a/b/mod.rs` are `[a, b]`.
fn module(path: &str) -> Module {
    let mut parts: Module = path.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if parts.last().is_some_and(|name| matches!(name.as_str(), "lib" | "main" | "mod")) {
        parts.pop();
    }
    parts
}

fn circles_of(modules: &[(Module, &SourceFile)]) -> Vec<Finding> {
    let known: BTreeSet<&Module> = modules.iter().map(|(module, _)| module).collect();
    let code: BTreeMap<&Module, Vec<Module>> =
        modules.iter().map(|(module, file)| (module, paths(module, &shipped(&file.text)))).collect();
    let mut imports = Imports::new();
    for (from, targets) in &code {
        for target in targets.iter().filter_map(|path| home(path, &known, &code, 4)) {
            let common = from.iter().zip(&target).take_while(|(a, b)| a == b).count();
            if common < from.len() && common < target.len() {
                imports.entry(from[..=common].to_vec()).or_default().insert(target[..=common].to_vec());
            }
        }
    }
    let circle = |start: &Module| -> Option<Finding> {
        let round: Vec<&Module> = imports
            .keys()
            .filter(|other| is_reached(&imports, start, other) && is_reached(&imports, other, start))
            .collect();
        if round.len() < 2 || round[0] != start {
            return None;
        }
        let (_, file) = modules.iter().find(|(module, _)| module.starts_with(start))?;
        let arrows = round.iter().map(|from| {
            let to: Vec<String> =
                imports[*from].iter().filter(|to| round.contains(to)).map(|to| to.join("::")).collect();
            format!("{} → {}", from.join("::"), to.join(", "))
        });
        Some(file.finding(1, format!("imports in a circle: {}", arrows.collect::<Vec<_>>().join("; "))))
    };
    imports.keys().filter_map(circle).collect()
}

/// Whether `end` is imported from `start`, over any number of modules.
fn is_reached(imports: &Imports, start: &Module, end: &Module) -> bool {
    let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
    while let Some(module) = open.pop() {
        if module == end {
            return true;
        }
        if seen.insert(module) {
            open.extend(imports.get(module).into_iter().flatten());
        }
    }
    false
}

/// The module that defines what `path` names; what a module passes on with `use` is looked for at most `depth` times.
fn home(
    path: &[String],
    known: &BTreeSet<&Module>,
    code: &BTreeMap<&Module, Vec<Module>>,
    depth: u32,
) -> Option<Module> {
    let module = (0..=path.len()).rev().map(|length| path[..length].to_vec()).find(|m| known.contains(m))?;
    let Some(name) = path.get(module.len()) else { return Some(module) };
    let passed_on = code[&module].iter().find(|use_of| use_of.last() == Some(name) && *use_of != path);
    match passed_on {
        Some(further) if depth > 0 => home(further, known, code, depth - 1),
        _ => Some(module),
    }
}

/// All paths into the own crate that `code` of `module` writes, from the root of the crate.
fn paths(module: &Module, code: &str) -> Vec<Module> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("::") {
        let start = code[..at].rfind(|c: char| !is_word(c)).map_or(0, |before| before + 1);
        let is_inner = code[..start].ends_with("::");
        let first = &code[start..at];
        if !is_inner && (matches!(first, "crate" | "self" | "super") || is_use(&code[..start])) {
            expand(&code[start..], &mut Vec::new(), &mut found);
        }
    }
    found.into_iter().filter_map(|path| absolute(module, &path)).collect()
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn is_use(before: &str) -> bool {
    before.trim_end().ends_with("use")
}

/// Adds to `found` all paths of the tree of imports that `text` starts with; returns what follows it.
fn expand<'a>(text: &'a str, before: &mut Module, found: &mut Vec<Module>) -> &'a str {
    let text = text.trim_start();
    let end = text.find(|c: char| !is_word(c)).unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    let length = before.len();
    if !name.is_empty() {
        before.push(name.to_owned());
    }
    let mut rest = match rest.strip_prefix("::").map(str::trim_start) {
        Some(inner) if inner.starts_with('{') => group(&inner[1..], before, found),
        Some(inner) if inner.starts_with(is_word) => expand(inner, before, found),
        _ => {
            found.push(before.clone());
            rest
        }
    };
    if let Some(renamed) = rest.trim_start().strip_prefix("as ") {
        rest = renamed.trim_start().trim_start_matches(is_word);
    }
    before.truncate(length);
    rest
}

/// The paths of `a, b::{c, d}}`, each behind `before`.
fn group<'a>(mut text: &'a str, before: &mut Module, found: &mut Vec<Module>) -> &'a str {
    loop {
        text = text.trim_start();
        match text.chars().next() {
            Some('}') => return &text[1..],
            Some(c) if is_word(c) => text = expand(text, before, found),
            Some(c) => text = &text[c.len_utf8()..],
            None => return text,
        }
    }
}

/// `path` from the root of the crate, where it leads there; a bare first name is a child of `module`.
fn absolute(module: &Module, path: &[String]) -> Option<Module> {
    let above = path.iter().take_while(|name| *name == "super").count();
    let rest: Module = path[above..].iter().filter(|name| *name != "self").cloned().collect();
    match path.first()?.as_str() {
        "crate" => Some(path[1..].to_vec()),
        _ if above > module.len() => None,
        _ => Some([&module[..module.len() - above], &rest].concat()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&str, &str)]) -> Vec<String> {
        circles(&Tree::of(files)).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn two_modules_that_import_each_other_are_rejected() {
        let back = "use std::fmt;\nfn f() { super::a::f() }";
        let both = found(&[
            ("x/src/lib.rs", "mod a; mod b;"),
            ("x/src/a.rs", "use crate::{c, b::{d, e}};"),
            ("x/src/b.rs", back),
        ]);
        assert!(both.len() == 1 && both[0].contains("a → b; b → a"), "{both:?}");
    }

    #[test]
    fn a_circle_of_three_folders_is_rejected() {
        let files = [
            ("x/src/a/mod.rs", "mod inner;"),
            ("x/src/a/inner.rs", "use crate::b::T;"),
            ("x/src/b.rs", "use super::c::T as S;"),
            ("x/src/c.rs", "use crate::a::inner::T;"),
        ];
        assert_eq!(found(&files).len(), 1);
    }

    #[test]
    fn what_the_root_passes_on_is_found_where_it_is() {
        let root = ("x/src/lib.rs", "mod a;\nmod b;\npub use b::T;\npub use a::S;");
        assert_eq!(found(&[root, ("x/src/a.rs", "use crate::T;"), ("x/src/b.rs", "use crate::S;")]).len(), 1);
        assert!(found(&[root, ("x/src/a.rs", "use crate::T;"), ("x/src/b.rs", "struct S;")]).is_empty());
    }

    #[test]
    fn parents_children_and_tests_may_know_each_other() {
        let child = "use super::T;\n#[cfg(test)]\nmod tests { use crate::b::B; }";
        let files = [
            ("x/src/a/mod.rs", "mod child;\nuse child::C;"),
            ("x/src/a/child.rs", child),
            ("x/src/b.rs", "use crate::a::T;"),
        ];
        assert!(found(&files).is_empty());
    }
}
