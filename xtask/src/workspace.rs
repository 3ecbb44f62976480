//! Where the workspace is, and running programs in it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result, ensure};

/// The folder of the root manifest.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask is a member one level below the root")
}

/// The text of a file named from the root.
///
/// # Errors
/// When it cannot be read.
pub fn read(path: &str) -> Result<String> {
    std::fs::read_to_string(root().join(path)).with_context(|| format!("cannot read {path}"))
}

/// Writes a file named from the root, with the folders it lies in.
///
/// # Errors
/// When it cannot be written.
pub fn write(path: &str, content: impl AsRef<[u8]>) -> Result<()> {
    let whole = root().join(path);
    whole
        .parent()
        .map_or(Ok(()), std::fs::create_dir_all)
        .and_then(|()| std::fs::write(&whole, content))
        .with_context(|| format!("cannot write {path}"))
}

/// A program to be run in the workspace's folder.
pub fn command(program: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(root());
    command
}

/// The cargo that runs this chore.
pub fn cargo(arguments: &[&str]) -> Command {
    linting(&std::env::var("CARGO").unwrap_or_else(|_| "cargo".into()), arguments)
}

/// A program that runs cargo, in the workspace's folder.
pub fn linting(program: &str, arguments: &[&str]) -> Command {
    let mut program = command(program, arguments);
    if LINTING.load(Ordering::Relaxed) {
        // What `cargo clippy` sets, for builds that are run afterwards as well.
        program
            .env("RUSTC_WORKSPACE_WRAPPER", "clippy-driver")
            .env("CLIPPY_ARGS", "-Dwarnings__CLIPPY_HACKERY__");
    }
    program
}

static LINTING: AtomicBool = AtomicBool::new(false);

/// From now on members are compiled by clippy, which compiles as rustc does: lints cost no second pass over all crates.
pub fn lint_while_compiling() {
    LINTING.store(true, Ordering::Relaxed);
}

/// A profile of the root manifest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// That of development and tests.
    Dev,
    /// That of users.
    Release,
}

/// Builds all libraries with the dev profile, the Python module among them.
///
/// # Errors
/// When one does not build.
pub fn libraries() -> Result<()> {
    let mut build = cargo(&["build", "--quiet", "--workspace", "--lib"]);
    let status = build.status().with_context(|| format!("cannot run {build:?}"))?;
    ensure!(status.success(), "{build:?}: {status}");
    Ok(())
}

/// Builds the programs; returns the folder they lie in.
///
/// They are selected from the whole workspace: a package built alone unifies fewer features of its dependencies, and cargo would
/// build most of them once more.
///
/// # Errors
/// When they do not build.
pub fn programs(profile: Profile) -> Result<PathBuf> {
    let mut build = cargo(&["build", "--quiet", "--workspace"]);
    build.args(
        ["sonel-trace", "sonel-render", "sonel-view", "sonel-analyze"]
            .iter()
            .flat_map(|name| ["--bin", name]),
    );
    if profile == Profile::Release {
        build.arg("--release");
    }
    let status = build.status().with_context(|| format!("cannot run {build:?}"))?;
    ensure!(status.success(), "{build:?}: {status}");
    folder(profile)
}

/// The folder of the programs of a profile.
///
/// # Errors
/// When the own place is not known.
pub fn folder(profile: Profile) -> Result<PathBuf> {
    // Chores are built with the dev profile.
    let own = std::env::current_exe()?;
    let dev = own.parent().context("a program lies in a folder")?;
    Ok(if profile == Profile::Dev { dev.to_owned() } else { dev.with_file_name("release") })
}

/// Runs one of the programs, its log on our stderr; returns its stdout.
///
/// # Errors
/// When it cannot be built or run, or fails.
pub fn program(profile: Profile, name: &str, arguments: &[&str]) -> Result<String> {
    run_in(&programs(profile)?, name, arguments)
}

/// Runs a program that lies in `folder`, its log on our stderr; returns its stdout.
///
/// # Errors
/// When it cannot be run, or fails.
pub fn run_in(folder: &Path, name: &str, arguments: &[&str]) -> Result<String> {
    let path = folder.join(name);
    eprintln!("$ {name} {}", arguments.join(" "));
    let mut run = command(&path.to_string_lossy(), arguments);
    let run = run.stderr(std::process::Stdio::inherit());
    let output = run.output().with_context(|| format!("cannot run {name}"))?;
    ensure!(output.status.success(), "{name}: {}", output.status);
    String::from_utf8(output.stdout).with_context(|| format!("{name} printed no UTF-8"))
}

/// `page` with what stands between its markers `<!-- figures: begin -->` and `<!-- figures: end -->` replaced by `figures`.
///
/// # Errors
/// When it lost one of them.
pub fn with_figures(page: &str, figures: &str) -> Result<String> {
    with_block(page, "figures", figures)
}

/// `page` with what stands between its markers `<!-- NAME: begin -->` and `<!-- NAME: end -->` replaced by `text`.
///
/// # Errors
/// When it lost one of them.
pub fn with_block(page: &str, name: &str, text: &str) -> Result<String> {
    let (begin, end) = (format!("<!-- {name}: begin -->\n"), format!("<!-- {name}: end -->"));
    let (head, rest) =
        page.split_once(&begin).with_context(|| format!("the page lost its marker {begin:?}"))?;
    let (_, tail) = rest.split_once(&end).with_context(|| format!("the page lost its marker {end:?}"))?;
    Ok(format!("{head}{begin}{text}{end}{tail}"))
}
