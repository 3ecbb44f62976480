//! An image with nothing but the statically linked programs, built and run: docs/scale.md says how.

use std::fs;
use std::process::Command;

use anyhow::{Result, ensure};

use crate::python::printed;
use xtask::workspace;

const TARGET: &str = "x86_64-unknown-linux-gnu";
const SCENE: &str = "scenes/shoebox/scene.toml";
const PACKETS: &str = "1000";

/// Builds the image and compares the map that it traces with that of the programs it was made of. Where it cannot run: what it needs.
pub(crate) fn accept() -> Result<Option<&'static str>> {
    if !Command::new("buildah").arg("--version").output().is_ok_and(|output| output.status.success()) {
        return Ok(Some("the container needs Debian's `buildah`"));
    }
    let mut build = workspace::cargo(&["build", "--release", "--target", TARGET]);
    build.args(["--package", "sonel-trace", "--package", "sonel-render", "--package", "sonel-analyze"]);
    printed(build.env("RUSTFLAGS", "-C target-feature=+crt-static"))?;

    let folder = workspace::root().join("target/container");
    fs::create_dir_all(&folder)?;
    fs::copy(workspace::root().join(SCENE), folder.join("scene.toml"))?;
    let of_host = folder.join("host.sonelmap");
    let program = workspace::root().join("target").join(TARGET).join("release/sonel-trace");
    printed(Command::new(program).args([SCENE, "--packets", PACKETS, "--quiet", "--output"]).arg(&of_host))?;

    // Neither root's overlays nor namespaces: it works inside other containers.
    let buildah = |arguments: &[&str]| {
        printed(workspace::command("buildah", &["--storage-driver", "vfs"]).args(arguments))
    };
    buildah(&["build", "--isolation", "chroot", "--file", "workflow/Containerfile", "--tag", "sonel", "."])?;
    let container = buildah(&["from", "sonel"])?;
    let volume = format!("{}:/work", folder.display());
    let run = ["run", "--isolation", "chroot", "--volume", &volume, container.trim()];
    buildah(
        &[
            &run[..],
            &["sonel-trace", "scene.toml", "--packets", PACKETS, "--quiet", "--output", "a.sonelmap"],
        ]
        .concat(),
    )?;
    buildah(&["rm", container.trim()])?;
    ensure!(fs::read(folder.join("a.sonelmap"))? == fs::read(of_host)?, "the container traces another map");
    println!("container: the map of the host's program");
    Ok(None)
}
