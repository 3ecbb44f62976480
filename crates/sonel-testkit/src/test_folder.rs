//! A temporary folder in which tests run the programs.
//!
//! Programs are started in the folder, so that a command line names files without their path. What runs as a library call
//! gets whole paths, by [`TestFolder::line`].

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// Longest time a program of a test may take; one that waits for what never comes is ended and fails its test.
const PATIENCE: Duration = Duration::from_secs(120);

/// A folder with a `scene.toml`, removed with the value.
///
/// Every function panics where the folder cannot be read or written.
pub struct TestFolder {
    folder: TempDir,
}

/// How a program ended and what it said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ended {
    /// Exit code; none if a signal ended it.
    pub code: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl TestFolder {
    /// A folder that holds `scene` as `scene.toml`.
    pub fn with(scene: &str) -> Self {
        let folder = Self { folder: tempfile::tempdir().expect("a folder for temporary files") };
        folder.write("scene.toml", scene);
        folder
    }

    /// A folder that holds the files of a shipped scene.
    pub fn shipped(name: &str) -> Self {
        let folder = Self::with("");
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
        for entry in std::fs::read_dir(scene).expect("a shipped scene") {
            let file = entry.expect("a readable folder").path();
            std::fs::copy(&file, folder.path(&file.file_name().expect("a file").to_string_lossy()))
                .expect("a copy");
        }
        folder
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder().join(name)
    }

    /// The bytes of a file.
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).expect("a file that was written")
    }

    /// The text of a file.
    pub fn text(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).expect("text")
    }

    /// Makes a file, or another one of an older.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).expect("a folder to write in");
    }

    /// A pipe with a name, which nobody writes to.
    pub fn pipe(&self, name: &str) -> PathBuf {
        let made = Command::new("mkfifo").arg(self.path(name)).status().expect("a system with pipes");
        assert!(made.success());
        self.path(name)
    }

    /// The names in the folder, sorted.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder()).expect("a readable folder");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("a name").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// The command line `PROGRAM INPUT -o OUTPUT --quiet OPTIONS` for a library call: files with their paths.
    pub fn line(&self, program: &str, input: &str, output: &str, options: &[&str]) -> Vec<String> {
        let place = |name: &str| self.path(name).display().to_string();
        let mut line = vec![program.to_owned(), place(input), "-o".into(), place(output), "--quiet".into()];
        line.extend(options.iter().map(|&option| option.to_owned()));
        line
    }

    /// Runs the executable `program` in the folder.
    pub fn run(&self, program: &str, words: &[&str]) -> Ended {
        Ended::of(Command::new(program).current_dir(self.folder()).args(words))
    }
}

impl Ended {
    /// Runs `command` to its end.
    pub fn of(command: &mut Command) -> Self {
        Self::with(command, Stdio::piped(), Stdio::piped())
    }

    /// Runs `command` to its end, which prints to `out` and `err`; what they are but pipes is not read.
    pub fn with(command: &mut Command, out: Stdio, err: Stdio) -> Self {
        command.stdin(Stdio::null()).stdout(out).stderr(err);
        let mut child = command.spawn().expect("a program that starts");
        let (out, err) = (listen(child.stdout.take()), listen(child.stderr.take()));
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().expect("a child") {
                break status;
            }
            if begun.elapsed() > PATIENCE {
                child.kill().expect("a child that runs");
                panic!("{command:?} did not end");
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        let [out, err] = [out, err].map(|heard| heard.join().expect("a stream that can be read"));
        Self { code: status.code(), out, err }
    }

    /// The same, if it ended with code 0.
    #[track_caller]
    pub fn done(self) -> Self {
        assert_eq!(self.code, Some(0), "{self:?}");
        self
    }

    /// What stderr said, if it ended with code 2 and printed nothing.
    #[track_caller]
    pub fn refused(self) -> String {
        assert!(self.code == Some(2) && self.out.is_empty() && !self.err.contains("panicked"), "{self:?}");
        self.err
    }
}

/// Reads a stream beside the program, which would wait if nobody did.
fn listen(stream: Option<impl Read + Send + 'static>) -> std::thread::JoinHandle<String> {
    std::thread::spawn(move || {
        let mut text = String::new();
        stream.map(|mut stream| stream.read_to_string(&mut text)).transpose().expect("text");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_run_in_the_folder_and_are_heard() {
        let folder = TestFolder::with("a = 1");
        let ended = folder.run("sh", &["-c", "cat scene.toml; echo no >&2; exit 2"]);
        assert_eq!(ended, Ended { code: Some(2), out: "a = 1".into(), err: "no\n".into() });
        assert_eq!(folder.names(), ["scene.toml"]);
    }

    #[test]
    #[should_panic(expected = "code: Some(1)")]
    fn a_failure_is_not_done() {
        let _ = TestFolder::with("").run("false", &[]).done();
    }
}
