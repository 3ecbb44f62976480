//! Forbidden in libraries: input and output, clocks, environment, and std's elementary functions.
//!
//! Clippy has lints for single macros and methods, but not for "in these crates, outside tests". The names are looked for in
//! the text without comments, literals and tests ([`super::rust_source`]).

use super::rust_source::shipped;
use super::tree::{Finding, Tree};

/// Printing, exiting, unwinding, clocks, the environment, thread counts, opening paths (ARCHITECTURE.md, rule 5).
const OUTSIDE_WORLD: [&str; 17] = [
    "println!",
    "eprintln!",
    "print!",
    "eprint!",
    "dbg!",
    "std::process",
    "process::exit",
    "std::env",
    "Instant::now",
    "SystemTime",
    "File::open",
    "File::create",
    "OpenOptions::new",
    "fs::read",
    "fs::write",
    "current_num_threads",
    "resume_unwind",
];

/// Functions whose last bits depend on platform or compiler: methods of floats, and glam's that call them. `sqrt` is exact.
const ELEMENTARY: [&str; 31] = [
    ".sin()",
    ".cos()",
    ".tan()",
    ".sin_cos()",
    ".asin()",
    ".acos()",
    ".atan()",
    ".atan2(",
    ".sinh()",
    ".cosh()",
    ".tanh()",
    ".exp()",
    ".exp2()",
    ".exp_m1()",
    ".ln()",
    ".ln_1p()",
    ".log(",
    ".log2()",
    ".log10()",
    ".powf(",
    ".powi(",
    ".cbrt()",
    ".hypot(",
    "f64::sin",
    "f64::cos",
    "f64::exp",
    "f64::ln",
    "f64::powi",
    "f64::powf",
    "from_axis_angle(",
    "angle_between(",
];

/// Names in [`OUTSIDE_WORLD`] that the public face may use: it opens the paths that its users give.
const OF_THE_FACE: [&str; 5] = ["File::open", "File::create", "OpenOptions::new", "fs::read", "fs::write"];
/// Where that is.
const FACE: &str = "crates/sonel/";

/// Libraries that reach out of their arguments.
pub(super) fn outside_world(tree: &Tree) -> Vec<Finding> {
    search(
        tree,
        |path, name| !(path.starts_with(FACE) && OF_THE_FACE.contains(&name)),
        &OUTSIDE_WORLD,
        "is left to the programs: libraries take streams, files and clocks as arguments",
    )
}

/// Elementary functions that are not `libm`'s.
pub(super) fn elementary_functions(tree: &Tree) -> Vec<Finding> {
    search(
        tree,
        |_, _| true,
        &ELEMENTARY,
        "may differ between platforms: use the function of the same name in `libm`",
    )
}

/// The `names` that `is_forbidden` in a path.
fn search(
    tree: &Tree,
    is_forbidden: impl Fn(&str, &str) -> bool,
    names: &[&str],
    remedy: &str,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    for file in tree.files.iter().filter(|f| f.is_library() && !only_for_tests(tree, &f.path)) {
        for (number, line) in shipped(&file.text).lines().enumerate() {
            for name in names.iter().filter(|name| calls(line, name) && is_forbidden(&file.path, name)) {
                findings.push(file.finding(number + 1, format!("`{name}` {remedy}")));
            }
        }
    }
    findings
}

/// Whether `name` occurs in `line` as a word of its own: `eprint!` is no `print!`.
fn calls(line: &str, name: &str) -> bool {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(name).any(|(at, _)| !name.starts_with(word) || !line[..at].ends_with(word))
}

/// Whether the file is a module that its parent declares under `#[cfg(test)]`, or lies below one.
pub(super) fn only_for_tests(tree: &Tree, path: &str) -> bool {
    let stem = path.trim_end_matches(".rs").trim_end_matches("/mod");
    let Some((folder, name)) = stem.rsplit_once('/') else { return false };
    if folder.ends_with("/src") && matches!(name, "lib" | "main") || !folder.contains("/src") {
        return false;
    }
    let declared = format!("mod {name};");
    let parents = ["/mod.rs", "/lib.rs", "/main.rs", ".rs"].map(|file| format!("{folder}{file}"));
    let parents: Vec<_> = tree.files.iter().filter(|f| parents.contains(&f.path)).collect();
    parents.iter().any(|f| f.text.contains(&declared) && !shipped(&f.text).contains(&declared))
        || parents.iter().any(|f| {
            !["/lib.rs", "/main.rs"].iter().any(|root| f.path.ends_with(root))
                && only_for_tests(tree, &f.path)
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn library(text: &str) -> Tree {
        Tree::of(&[("crates/sonel-map/src/reader.rs", text)])
    }

    #[test]
    fn every_name_is_rejected() {
        for name in OUTSIDE_WORLD {
            let tree = library(&format!("fn f() {{\n    {name}(1);\n}}"));
            let findings = outside_world(&tree);
            assert!(!findings.is_empty() && findings[0].line == 2, "{name}");
        }
        for name in ELEMENTARY {
            let tree = library(&format!("fn f() {{\n    x{name};\n    {name}(1.0);\n}}"));
            assert!(!elementary_functions(&tree).is_empty(), "{name}");
        }
    }

    #[test]
    fn comments_strings_tests_and_programs_are_free() {
        let text = "// println!\nfn f() { g(\"x.sin()\"); libm::sin(1.0); y.sqrt(); }\n#[cfg(test)]\nmod tests {\n    fn h() { println!(); z.sin(); }\n}";
        assert!(outside_world(&library(text)).is_empty());
        assert!(elementary_functions(&library(text)).is_empty());
        assert!(outside_world(&Tree::of(&[("tools/a/src/main.rs", "fn f() { println!(); }")])).is_empty());
    }

    #[test]
    fn the_public_face_opens_paths_and_reads_no_clock() {
        let face = |text: &str| Tree::of(&[("crates/sonel/src/file.rs", text)]);
        assert!(outside_world(&face("fn f() { File::open(p); fs::read(p); }")).is_empty());
        assert_eq!(outside_world(&face("fn f() { Instant::now(); println!(); }")).len(), 2);
    }

    #[test]
    fn modules_declared_for_tests_are_free_and_others_are_not() {
        let tree = |declaration: &str| {
            Tree::of(&[
                ("crates/a/src/lib.rs", declaration),
                ("crates/a/src/oracle.rs", "mod deeper;\nfn f() { x.sin(); }"),
                ("crates/a/src/oracle/deeper.rs", "fn f() { x.sin(); }"),
            ])
        };
        assert!(elementary_functions(&tree("#[cfg(test)]\nmod oracle;")).is_empty());
        assert_eq!(elementary_functions(&tree("mod oracle;")).len(), 2);
    }
}
