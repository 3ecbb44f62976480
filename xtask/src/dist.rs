//! What a release consists of, in target/dist: static programs for Linux x86-64, a wheel, the sources, checksums. docs/releasing.md has the list of steps.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::python::{self, printed, shown};
use xtask::workspace;

const FOLDER: &str = "target/dist";
const TARGET: &str = "x86_64-unknown-linux-gnu";
const PROGRAMS: [&str; 4] = ["sonel-trace", "sonel-render", "sonel-view", "sonel-analyze"];
const ENVIRONMENT: &str = "target/dist-tools";
const REQUIREMENTS: &str = "python/requirements-dist.txt";
/// Files that stand beside the programs.
const BESIDE: [&str; 4] = ["LICENSE-MIT", "LICENSE-APACHE", "README.md", "CHANGELOG.md"];

/// Makes everything, checks the wheel, writes SHA256SUMS.
pub(crate) fn make() -> Result<()> {
    let root = workspace::root();
    ensure!(
        cfg!(all(target_os = "linux", target_arch = "x86_64")),
        "releases for other systems: .github/workflows/release.yml"
    );
    let version = version()?;
    let folder = root.join(FOLDER);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder)?;

    let name = format!("sonel-{version}-x86_64-linux");
    programs(&folder.join(&name))?;
    archive(&folder, &name)?;

    let tools = python::environment(ENVIRONMENT, REQUIREMENTS)?;
    let tool =
        |name: &str, words: &[&str]| shown(Command::new(tools.join("python")).args(["-m", name]).args(words));
    tool(
        "maturin",
        &["build", "--release", "--locked", "--manifest-path", "python/Cargo.toml", "--out", FOLDER],
    )?;
    let wheel = wheel(&folder)?;
    tool("auditwheel", &["show", &wheel])?;
    tool("twine", &["check", "--strict", &wheel])?;

    // What is committed, so that the archive is that of the version.
    let sources = format!("{FOLDER}/sonel-{version}-sources.tar.gz");
    let prefix = format!("--prefix=sonel-{version}/");
    printed(&mut workspace::command(
        "git",
        &["archive", "--format=tar.gz", &prefix, "--output", &sources, "HEAD"],
    ))?;

    let mut files: Vec<String> = fs::read_dir(&folder)?
        .filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned()))
        .filter(|name| name.ends_with(".tar.gz") || name.ends_with(".whl"))
        .collect();
    files.sort();
    let sums = Command::new("sha256sum")
        .args(&files)
        .current_dir(&folder)
        .output()
        .context("cannot run sha256sum")?;
    ensure!(sums.status.success(), "sha256sum: {}", sums.status);
    fs::write(folder.join("SHA256SUMS"), &sums.stdout)?;
    print!("{}", String::from_utf8_lossy(&sums.stdout));
    println!("dist: {} files and SHA256SUMS in {FOLDER}", files.len());
    Ok(())
}

/// Version of all members.
fn version() -> Result<String> {
    let manifest: toml::Table = workspace::read("Cargo.toml")?.parse().context("Cargo.toml")?;
    let version = manifest["workspace"]["package"]["version"].as_str();
    Ok(version.context("Cargo.toml states no version")?.to_owned())
}

/// Builds the programs, linked statically (docs/scale.md), with completions and man pages.
fn programs(into: &Path) -> Result<()> {
    let mut build = workspace::cargo(&["build", "--release", "--locked", "--target", TARGET]);
    build.args(PROGRAMS.iter().flat_map(|name| ["--package", name]));
    shown(build.env("RUSTFLAGS", "-C target-feature=+crt-static"))?;
    fs::create_dir_all(into.join("bin"))?;
    let built = workspace::root().join("target").join(TARGET).join("release");
    for name in PROGRAMS {
        fs::copy(built.join(name), into.join("bin").join(name))
            .with_context(|| format!("cannot copy {name}"))?;
    }
    for name in BESIDE {
        fs::copy(workspace::root().join(name), into.join(name))?;
    }
    let shell = into.join("share");
    shown(&mut workspace::cargo(&[
        "run",
        "--quiet",
        "--package",
        "pages",
        "--",
        "shell",
        "--output",
        &shell.to_string_lossy(),
    ]))
}

/// Packs the folder `name` beside it, the same bytes for the same files, and removes it.
fn archive(folder: &Path, name: &str) -> Result<()> {
    let words = ["--sort=name", "--owner=0", "--group=0", "--numeric-owner", "--mtime=@0", "-czf"];
    let status =
        Command::new("tar").args(words).arg(format!("{name}.tar.gz")).arg(name).current_dir(folder).status();
    ensure!(status.context("cannot run tar")?.success(), "tar failed");
    Ok(fs::remove_dir_all(folder.join(name))?)
}

/// The only wheel in a folder.
fn wheel(folder: &Path) -> Result<String> {
    let names = fs::read_dir(folder)?.filter_map(|entry| Some(entry.ok()?.path()));
    let wheels: Vec<_> =
        names.filter(|path| path.extension().is_some_and(|ending| ending == "whl")).collect();
    match &wheels[..] {
        [wheel] => Ok(wheel.to_string_lossy().into_owned()),
        _ => bail!("{} wheels in {}", wheels.len(), folder.display()),
    }
}

/// Unpacks a release on a bare Debian without Rust, and does there what the tutorial does, and the same in Python. Where it cannot run: what it needs.
pub(crate) fn accept() -> Result<Option<&'static str>> {
    let needs = "the release on a bare Debian needs root and Debian's `debootstrap`";
    if !Command::new("debootstrap").arg("--version").output().is_ok_and(|output| output.status.success()) {
        return Ok(Some(needs));
    }
    if printed(Command::new("id").arg("-u"))?.trim() != "0" {
        return Ok(Some(needs));
    }
    make()?;
    let root = workspace::root();
    let debian = root.join("target/debian");
    if !debian.join("usr/bin/python3").exists() {
        let include = "--include=python3,python3-pip,python3-numpy";
        let words = ["--variant=minbase", include, "stable"];
        shown(Command::new("debootstrap").args(words).arg(&debian))?;
    }
    let work = debian.join("srv");
    let _ = fs::remove_dir_all(&work);
    fs::create_dir_all(&work)?;
    for entry in fs::read_dir(root.join(FOLDER))? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            fs::copy(entry.path(), work.join(entry.file_name()))?;
        }
    }
    fs::copy(root.join("xtask/src/dist.sh"), work.join("dist.sh"))?;
    let run = Command::new("chroot")
        .arg(&debian)
        .args(["/bin/sh", "-eux", "/srv/dist.sh"])
        .env_clear()
        .env("PATH", "/usr/sbin:/usr/bin:/sbin:/bin")
        .output()?;
    let log = String::from_utf8_lossy(&run.stdout).into_owned();
    fs::write(root.join("target/dist/debian.log"), &log)?;
    ensure!(run.status.success(), "the release fails on a bare Debian:\n{log}");
    ensure!(log.contains("the same map"), "the wheel and the programs trace different maps:\n{log}");
    println!("{log}dist: the release works on a bare Debian; log in {FOLDER}/debian.log");
    Ok(None)
}
