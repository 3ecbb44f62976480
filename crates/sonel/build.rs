//! The build: a digest of the libraries' sources and of the versions of foreign packages. The same sources have the same build on any
//! machine.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// 64-bit FNV-1a: it tells builds apart and protects from nobody.
const BASIS: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0100_0000_01b3;

fn main() -> io::Result<()> {
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR").expect("cargo says it")).join("../..");
    let (root, files) = sources(root)?;
    let mut named: Vec<(String, PathBuf)> = files
        .into_iter()
        .map(|file| {
            let name = file.strip_prefix(&root).expect("below the root").to_string_lossy().replace('\\', "/");
            (name, file)
        })
        .collect();
    named.sort();
    let mut digest = BASIS;
    for (name, file) in &named {
        println!("cargo::rerun-if-changed={}", file.display());
        for byte in name.bytes().chain([0]).chain(fs::read(file)?) {
            digest = (digest ^ u64::from(byte)).wrapping_mul(PRIME);
        }
    }
    println!("cargo::rustc-env=SONEL_BUILD={digest:016x}");
    Ok(())
}

/// The sources of all libraries in the workspace, below `root`. A crate from a registry has its own alone: those it depends on are of its version.
fn sources(root: PathBuf) -> io::Result<(PathBuf, Vec<PathBuf>)> {
    let libraries = root.join("crates");
    if !libraries.join("sonel-map/src").is_dir() {
        let own = PathBuf::from(env::var("CARGO_MANIFEST_DIR").expect("cargo says it"));
        let mut files = vec![own.join("Cargo.toml")];
        gather(&own.join("src"), &mut files)?;
        return Ok((own, files));
    }
    let mut files = vec![root.join("Cargo.lock")];
    for library in fs::read_dir(libraries)? {
        gather(&library?.path().join("src"), &mut files)?;
    }
    Ok((root, files))
}

/// All files in `folder` and below.
fn gather(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    println!("cargo::rerun-if-changed={}", folder.display());
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { gather(&path, files)? } else { files.push(path) }
    }
    Ok(())
}
