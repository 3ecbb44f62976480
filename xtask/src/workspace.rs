//! Where the workspace is, and running programs in it.

use std::path::Path;
use std::process::{Command, Output};

use anyhow::{Context, Result, ensure};

const BEGIN: &str = "<!-- figures: begin -->\n";
const END: &str = "<!-- figures: end -->";

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
    command(&std::env::var("CARGO").unwrap_or_else(|_| "cargo".into()), arguments)
}

/// Runs one of the tools in release, its log on our stderr; returns its stdout.
///
/// # Errors
/// When it cannot be run or fails.
pub fn program(name: &str, arguments: &[&str]) -> Result<String> {
    let output = output(name, arguments)?;
    ensure!(output.status.success(), "{name}: {}", output.status);
    String::from_utf8(output.stdout).with_context(|| format!("{name} printed no UTF-8"))
}

/// The same with whatever exit code it ends.
///
/// # Errors
/// When it cannot be run.
pub fn output(name: &str, arguments: &[&str]) -> Result<Output> {
    eprintln!("$ {name} {}", arguments.join(" "));
    let mut run = cargo(&["run", "--quiet", "--release", "--package", name, "--"]);
    let run = run.args(arguments).stderr(std::process::Stdio::inherit());
    run.output().with_context(|| format!("cannot run {name}"))
}

/// `page` with what stands between its markers `<!-- figures: begin -->` and `<!-- figures: end -->` replaced by `figures`.
///
/// # Errors
/// When it lost one of them.
pub fn with_figures(page: &str, figures: &str) -> Result<String> {
    let (head, rest) = page.split_once(BEGIN).context("the page lost its first figures marker")?;
    let (_, tail) = rest.split_once(END).context("the page lost its last figures marker")?;
    Ok(format!("{head}{BEGIN}{figures}{END}{tail}"))
}
