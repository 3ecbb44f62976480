//! Programs whose reader has gone away, or whose disk is full under what they print.
//!
//! What a run is asked to write is there in the end, or its exit code says so. Its log is nothing that it is asked for.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::test_folder::{Ended, TestFolder};

/// Where outputs are in a folder.
pub const OUTPUTS: &str = "out";

/// What becomes of a standard stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stream {
    /// It is read.
    Read,
    /// Its reader has gone away, as after `| head`.
    Left,
    /// Its disk is full.
    Full,
}

/// What becomes of stdout and stderr.
const STREAMS: [(Stream, Stream); 5] = [
    (Stream::Read, Stream::Left),
    (Stream::Read, Stream::Full),
    (Stream::Left, Stream::Left),
    (Stream::Full, Stream::Read),
    (Stream::Full, Stream::Full),
];

impl Stream {
    fn stdio(self) -> Stdio {
        match self {
            Self::Read => Stdio::piped(),
            Self::Left => std::io::pipe().expect("a pipe").1.into(),
            Self::Full => File::options().write(true).open("/dev/full").expect("a full disk").into(),
        }
    }
}

/// Files below `folder` with their content.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a name").path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.insert(path.display().to_string(), std::fs::read(&path).expect("a readable file"));
        }
    }
    found
}

/// Runs `line`, a program with its words, in `folder` with an empty folder of outputs.
fn run(folder: &TestFolder, line: &str, out: Stream, err: Stream) -> (Ended, BTreeMap<String, Vec<u8>>) {
    let outputs = folder.path(OUTPUTS);
    if outputs.exists() {
        std::fs::remove_dir_all(&outputs).expect("a folder of ours");
    }
    std::fs::create_dir(&outputs).expect("a folder to write in");
    let mut words = line.split(' ');
    let mut command = Command::new(words.next().expect("a program"));
    command.current_dir(folder.folder()).args(words.map(|word| word.replace('~', " ")));
    let ended = Ended::with(&mut command, out.stdio(), err.stdio());
    (ended, files(&outputs))
}

/// What is wrong with runs of `line` (a tilde is a blank within a word) in `folder` whose stdout and stderr are read, left by their readers or on a full disk; empty where all is well.
/// Outputs are in [`OUTPUTS`]; their bytes are those of the first run, but where they `state_times`.
///
/// A run ends as one that is read: with its exit code and its outputs. If data for stdout are lost to a full disk it ends with code 2, its outputs
/// complete or absent.
pub fn faults(folder: &TestFolder, line: &str, state_times: bool) -> Vec<String> {
    let (good, made) = run(folder, line, Stream::Read, Stream::Read);
    assert!(matches!(good.code, Some(0 | 1)), "{line}: {good:?}");
    assert!(!made.is_empty() || !good.out.is_empty(), "{line} is asked for nothing");
    let mut faults = Vec::new();
    for (out, err) in STREAMS {
        let (ended, found) = run(folder, line, out, err);
        let loses = out == Stream::Full && !good.out.is_empty();
        let code = if loses { Some(2) } else { good.code };
        let is_same = |(name, bytes): (&String, &Vec<u8>)| {
            made.get(name).is_some_and(|made| made == bytes || state_times && !bytes.is_empty())
        };
        let has_all = found.len() == made.len() || loses && found.is_empty();
        if ended.code != code || !has_all || !found.iter().all(is_same) {
            let names: Vec<&String> = found.keys().collect();
            faults.push(format!("{line}: stdout {out:?}, stderr {err:?}: {ended:?}, {names:?}"));
        }
    }
    faults
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the shell command `text` has wrong.
    fn found(text: &str) -> Vec<String> {
        let folder = TestFolder::with("");
        folder.write("program", text);
        faults(&folder, "sh program", false)
    }

    #[test]
    fn who_goes_on_without_a_log_has_no_fault() {
        assert!(found("trap '' PIPE; echo log >&2; echo map >out/map").is_empty());
    }

    #[test]
    fn who_ends_without_a_map_or_hides_a_loss_has_faults() {
        assert!(!found("trap '' PIPE; echo log >&2 || exit 0; echo map >out/map").is_empty(), "no map");
        assert!(!found("trap '' PIPE; echo data; echo map >out/map; exit 0").is_empty(), "lost data");
        let half = "trap '' PIPE; echo log >&2 || echo half >out/map; test -e out/map || echo map >out/map";
        assert!(!found(half).is_empty(), "half a map");
    }
}
