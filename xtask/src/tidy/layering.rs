//! Allowed dependencies between crates, and the home of each foreign package, read from the manifests.
//!
//! Only `[dependencies]` count, and not those of `tests/` and `fuzz/`: tests may look wherever they need to.

use super::rust_source::without_literals;
use super::tree::{Finding, SourceFile, Tree};

/// Our crates by layer, lowest first; a crate may depend on lower layers only.
const LAYERS: [&[&str]; 10] = [
    &[
        "sonel-acoustics",
        "sonel-sampling",
        "sonel-geometry",
        "sonel-diffraction",
        "sonel-sofa",
        "sonel-testkit",
    ],
    &["sonel-scene"],
    &["sonel-map", "sonel-echogram"],
    &["sonel-tracer", "sonel-renderer", "sonel-analysis", "sonel-sound"],
    &["sonel-drawing"],
    &["sonel"],
    &["sonel-design"],
    &["sonel-console"],
    &["sonel-trace", "sonel-render", "sonel-view"],
    &["sonel-analyze"],
];

/// Foreign packages that any crate may use.
const EVERYWHERE: [&str; 6] = ["bytemuck", "glam", "libm", "rayon", "serde", "thiserror"];

/// Every other foreign package and the folders it may be used in.
const HOMES: [(&str, &[&str]); 46] = [
    ("anyhow", &["tools/", "python", "xtask"]),
    ("base64", &["crates/sonel-scene", "tools/sonel-view"]),
    ("bincode", &["crates/sonel-map"]),
    ("blake3", &["crates/sonel-scene", "crates/sonel-map", "crates/sonel-echogram"]),
    ("clap", &["tools/", "xtask"]),
    ("clap_complete", &["xtask"]),
    ("clap_mangen", &["xtask"]),
    ("comfy-table", &["crates/sonel-analysis"]),
    ("cpu-time", &["tools/", "python"]),
    ("csv", &["crates/sonel-analysis", "crates/sonel-scene", "tools/"]),
    ("ctrlc", &["tools/sonel-console"]),
    ("dejavu", &["crates/sonel-drawing"]),
    ("earcutr", &["crates/sonel-scene"]),
    ("exr", &["crates/sonel-drawing"]),
    ("flate2", &["tools/sonel-view"]),
    ("foldhash", &["crates/sonel-geometry", "crates/sonel-scene"]),
    ("getrandom", &["tools/sonel-view"]),
    ("gltf", &["crates/sonel-scene"]),
    ("hound", &["crates/sonel-sound"]),
    ("http-body-util", &["tools/sonel-view"]),
    ("hyper", &["tools/sonel-view"]),
    ("hyper-util", &["tools/sonel-view"]),
    ("indicatif", &["tools/"]),
    ("libc", &["tools/sonel-console"]),
    ("memmap2", &["crates/sonel-map"]),
    ("obvhs", &["crates/sonel-geometry"]),
    ("num-complex", &["crates/sonel-diffraction"]),
    ("ply-rs-bw", &["crates/sonel-scene"]),
    ("open", &["tools/sonel-view"]),
    ("plotters", &["crates/sonel-drawing"]),
    ("png", &["crates/sonel-drawing"]),
    ("pyo3", &["python"]),
    ("rand", &["crates/sonel-sampling"]),
    ("realfft", &["crates/sonel-sound"]),
    ("rubato", &["crates/sonel-sound"]),
    (
        "serde_json",
        &[
            "crates/sonel-scene",
            "crates/sonel-echogram",
            "crates/sonel-analysis",
            "crates/sonel-design",
            "crates/sonel-drawing",
            "crates/sonel/",
            "tools/",
            "python",
            "xtask",
        ],
    ),
    ("signal-hook", &["tools/sonel-console"]),
    ("smallvec", &["crates/sonel-geometry", "crates/sonel-renderer"]),
    ("sofar", &["crates/sonel-sofa", "crates/sonel-sound"]),
    ("spade", &["crates/sonel-geometry", "crates/sonel-sofa"]),
    ("statrs", &["crates/sonel-testkit"]),
    ("tempfile", &["crates/sonel/", "tools/", "crates/sonel-testkit"]),
    ("tokio", &["tools/sonel-view"]),
    ("toml", &["crates/sonel-scene", "xtask"]),
    ("toml_edit", &["tools/sonel-view"]),
    ("zip", &["crates/sonel-echogram"]),
];

/// Arrows that point up or sideways, and shipped code that depends on the test kit.
pub(super) fn arrows(tree: &Tree) -> Vec<Finding> {
    each_dependency(tree, |manifest, package| {
        let own = manifest.path.strip_prefix("crates/")?.split('/').next()?;
        let (from, to) = (layer(own), layer(package)?);
        let Some(from) = from else {
            return Some(format!("{own} is in no layer; give it one in xtask/src/tidy/layering.rs"));
        };
        (to >= from || package == "sonel-testkit").then(|| format!("{own} must not depend on {package}"))
    })
}

/// Programs and Python that name a crate below `sonel`, and what that hides from its users.
pub(super) fn one_door(tree: &Tree) -> Vec<Finding> {
    let face = layer("sonel");
    let mut findings = each_dependency(tree, |manifest, package| {
        let is_user = ["tools/", "python/"].iter().any(|folder| manifest.path.starts_with(folder));
        let is_below = layer(package).is_some_and(|layer| Some(layer) < face);
        (is_user && is_below)
            .then(|| format!("{package} is below crate sonel, which has what programs and Python name"))
    });
    for file in tree.files.iter().filter(|file| file.path.starts_with("crates/sonel/src/")) {
        let lines = file.text.lines().enumerate();
        let hidden = lines.filter(|(_, line)| line.contains("#[doc(hidden)]"));
        findings.extend(hidden.map(|(at, _)| {
            file.finding(at + 1, "crate sonel hides nothing: document it, or make it private".to_owned())
        }));
    }
    findings
}

/// Foreign packages away from home.
pub(super) fn homes(tree: &Tree) -> Vec<Finding> {
    each_dependency(tree, |manifest, package| {
        let for_tests = ["tests/", "fuzz/"].iter().any(|folder| manifest.path.starts_with(folder));
        let is_own = ["xtask", "sonel"].contains(&package) || package.starts_with("sonel-");
        if for_tests || is_own || EVERYWHERE.contains(&package) {
            return None;
        }
        let Some((_, homes)) = HOMES.iter().find(|(name, _)| *name == package) else {
            return Some(format!(
                "{package} has no home; give it one in xtask/src/tidy/layering.rs and ARCHITECTURE.md"
            ));
        };
        let at_home = homes.iter().any(|home| manifest.path.starts_with(home));
        (!at_home).then(|| format!("{package} lives in {}", homes.join(", ")))
    })
}

/// Dependencies that no source of their crate names: tests and examples count for development only.
pub(super) fn unused(tree: &Tree) -> Vec<Finding> {
    let folder_of = |path: &str| path.trim_end_matches("Cargo.toml").to_owned();
    let mut findings = Vec::new();
    for kind in ["dependencies", "dev-dependencies"] {
        findings.extend(each_of(tree, kind, |manifest, package| {
            let folder = folder_of(&manifest.path);
            let inner = manifests(tree)
                .map(|other| folder_of(&other.path))
                .find(|other| *other != folder && other.starts_with(&folder));
            let sources = tree.files.iter().filter(|file| {
                let own = file.path.strip_prefix(&folder).filter(|_| file.is_rust());
                own.is_some_and(|own| {
                    kind != "dependencies"
                        || own.starts_with("src/")
                        || !tree.contains(&format!("{folder}src"))
                }) && inner.as_ref().is_none_or(|inner| !file.path.starts_with(inner))
            });
            let name = package.replace('-', "_");
            let is_named = |file: &SourceFile| names(&without_literals(&file.text), &name);
            (!sources.into_iter().any(is_named))
                .then(|| format!("no source names {package}: leave it out of [{kind}]"))
        }));
    }
    findings
}

/// Whether `code` uses package `name`: `name::…` or `use name`. A variable may have the name of a package.
fn names(code: &str, name: &str) -> bool {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(name).any(|(at, _)| {
        let (before, after) = (&code[..at], &code[at + name.len()..]);
        let is_used = after.starts_with("::") || before.trim_end().ends_with("use");
        is_used && !before.ends_with(word) && !after.starts_with(word)
    })
}

fn layer(package: &str) -> Option<usize> {
    LAYERS.iter().position(|crates| crates.contains(&package))
}

/// What `complain` says about each dependency of each member of the workspace.
fn each_dependency(tree: &Tree, complain: impl Fn(&SourceFile, &str) -> Option<String>) -> Vec<Finding> {
    each_of(tree, "dependencies", complain)
}

fn manifests(tree: &Tree) -> impl Iterator<Item = &SourceFile> {
    tree.files.iter().filter(|file| file.path.ends_with("/Cargo.toml"))
}

/// The same of the dependencies of a `kind`.
fn each_of(tree: &Tree, kind: &str, complain: impl Fn(&SourceFile, &str) -> Option<String>) -> Vec<Finding> {
    let mut findings = Vec::new();
    for manifest in manifests(tree) {
        let table: toml::Table = match manifest.text.parse() {
            Ok(table) => table,
            Err(error) => {
                findings.push(manifest.finding(1, format!("does not parse: {error}")));
                continue;
            }
        };
        let packages = table.get(kind).and_then(toml::Value::as_table);
        for package in packages.into_iter().flat_map(toml::Table::keys) {
            if let Some(message) = complain(manifest, package) {
                findings.push(manifest.finding(line_of(&manifest.text, package), message));
            }
        }
    }
    findings
}

fn line_of(manifest: &str, package: &str) -> usize {
    manifest.lines().position(|line| line.starts_with(package)).map_or(1, |n| n + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(path: &str, dependencies: &str) -> Tree {
        Tree::of(&[(path, &format!("[package]\nname = \"x\"\n[dependencies]\n{dependencies}\n"))])
    }

    #[test]
    fn downward_arrows_pass() {
        let tree = manifest("crates/sonel-map/Cargo.toml", "sonel-scene.workspace = true");
        assert!(arrows(&tree).is_empty());
    }

    #[test]
    fn sideways_and_upward_arrows_and_the_test_kit_are_rejected() {
        for (own, other) in [
            ("sonel-tracer", "sonel-renderer"),
            ("sonel-scene", "sonel-map"),
            ("sonel-geometry", "sonel-acoustics"),
            ("sonel-map", "sonel-testkit"),
        ] {
            let tree = manifest(&format!("crates/{own}/Cargo.toml"), &format!("{other}.workspace = true"));
            assert_eq!(arrows(&tree).len(), 1, "{own} on {other}");
            assert_eq!(arrows(&tree)[0].line, 4);
        }
    }

    #[test]
    fn programs_and_python_have_one_door() {
        for user in ["tools/sonel-view", "python"] {
            let of = |package: &str| {
                manifest(&format!("{user}/Cargo.toml"), &format!("{package}.workspace = true"))
            };
            assert!(one_door(&of("sonel")).is_empty() && one_door(&of("serde")).is_empty());
            assert_eq!(one_door(&of("sonel-map")).len(), 1, "{user}");
        }
        let hiding = Tree::of(&[("crates/sonel/src/lib.rs", "#[doc(hidden)]\npub mod names;")]);
        assert_eq!(one_door(&hiding).len(), 1);
    }

    #[test]
    fn a_crate_without_a_layer_is_rejected() {
        let tree = manifest("crates/sonel-novel/Cargo.toml", "sonel-scene.workspace = true");
        assert_eq!(arrows(&tree).len(), 1);
    }

    #[test]
    fn a_dependency_that_no_source_names_is_rejected() {
        let package = "[dependencies]\na-b = \"1\"\n[dev-dependencies]\nc = \"1\"\n";
        let of = |source: &str, test: &str| {
            let files = [
                ("crates/x/Cargo.toml", package),
                ("crates/x/src/lib.rs", source),
                ("crates/x/tests/t.rs", test),
            ];
            unused(&Tree::of(&files)).len()
        };
        assert_eq!(of("use a_b::D;", "c::e();"), 0);
        assert_eq!(of("// a_b\nuse a_bc;", "fn c2() {}"), 2);
        assert_eq!(of("let a_b = 1;", "use c as _;"), 1, "a variable is no use of a package");
        assert_eq!(of("", "a_b::d(); c::e();"), 1, "a test is no reason for a dependency of the library");
    }

    #[test]
    fn packages_away_from_home_or_without_one_are_rejected() {
        for package in ["rand", "clap", "left-pad"] {
            let tree = manifest("crates/sonel-map/Cargo.toml", &format!("{package} = \"1\""));
            assert_eq!(homes(&tree).len(), 1, "{package}");
        }
        assert!(homes(&manifest("crates/sonel-map/Cargo.toml", "memmap2 = \"1\"\nglam = \"1\"")).is_empty());
    }
}
