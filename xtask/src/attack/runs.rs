//! The attacks.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};

use super::cases::{self, INPUTS, NO_FILES, PROGRAMS, STREAMS};
use super::{Random, Tally, files};
use xtask::workspace;

/// A run takes no longer [s], however damaged its input.
const LONGEST_SECONDS: usize = 30;
/// Address space of a run with a damaged input [KiB]: small files have no large appetites.
const AMPLE_KIB: usize = 2 << 20;

/// Files by their paths.
type Files = Vec<(PathBuf, Vec<u8>)>;

/// Damages a file.
pub(super) type Damage = fn(&mut Vec<u8>, &mut Random);

/// A folder with inputs, and the programs.
pub(super) struct Ground<'a> {
    programs: &'a Path,
    folder: PathBuf,
}

/// How a run ended.
struct Ended {
    status: ExitStatus,
    out: Vec<u8>,
    err: String,
}

impl Ended {
    /// What is wrong with the way in which it ended: it may have been ended by `signal`.
    fn fault(&self, signal: bool) -> Option<String> {
        let code = self.status.code();
        let is_allowed = matches!(code, Some(0..=2)) || signal && matches!(code, None | Some(130 | 143));
        // The C library may say a line of its own before.
        let is_told = code != Some(2) || self.err.lines().any(|line| line.starts_with("error: "));
        (!is_allowed || !is_told || self.err.contains("defect of the program"))
            .then(|| format!("{}: {}", self.status, self.err))
    }
}

impl<'a> Ground<'a> {
    /// Makes the inputs.
    pub(super) fn prepare(programs: &'a Path, folder: &Path) -> Result<Self> {
        if folder.exists() {
            std::fs::remove_dir_all(folder)?;
        }
        std::fs::create_dir_all(folder)?;
        let ground = Self { programs, folder: folder.to_owned() };
        let write = |name: &str, content: &[u8]| std::fs::write(folder.join(name), content);
        for (name, absorption) in [("a", "0.3"), ("b", "0.2")] {
            write(&format!("{name}.toml"), cases::scene(absorption).as_bytes())?;
            for line in [
                format!("sonel-trace {name}.toml -o {name}.sonelmap --packets 2k --batches 8"),
                format!("sonel-trace {name}.toml -o {name}1.sonelmap --packets 20k --shard 1/2"),
                format!("sonel-trace {name}.toml -o {name}2.sonelmap --packets 20k --shard 2/2"),
                format!(
                    "sonel-render {name}.sonelmap -o {name}.npz --bin 0.01 --rays 64 --wav sounds-{name}"
                ),
            ] {
                ground.done(&line)?;
            }
        }
        write("mesh.toml", cases::MESH_SCENE.as_bytes())?;
        write("receivers.csv", cases::RECEIVERS.as_bytes())?;
        write("materials.toml", cases::MATERIALS.as_bytes())?;
        write("balloon.csv", cases::BALLOON.as_bytes())?;
        write("path.csv", cases::PATH.as_bytes())?;
        let seeds = workspace::root().join("fuzz/seeds");
        for (from, to) in [
            ("wav/float.wav", "dry.wav"),
            ("sofa/contiguous.sofa", "head.sofa"),
            ("obj/room.obj", "room.obj"),
            ("stl/text.stl", "text.stl"),
            ("stl/binary.stl", "binary.stl"),
            ("ply/text.ply", "text.ply"),
            ("ply/binary.ply", "binary.ply"),
            ("dxf/faces.dxf", "faces.dxf"),
            ("dxf/polyface.dxf", "polyface.dxf"),
            ("gltf/room.glb", "room.glb"),
            ("gltf/room.gltf", "room.gltf"),
        ] {
            std::fs::copy(seeds.join(from), folder.join(to)).with_context(|| format!("{from} is missing"))?;
        }
        let library = workspace::root().join("crates/sonel-scene/tests/corpus/good/library.txt");
        std::fs::copy(library, folder.join("library.txt"))?;
        Ok(ground)
    }

    /// Starts a command line in a shell, between what the shell is told `before` and `behind`.
    fn start(&self, before: &str, line: &str, behind: &str) -> Result<std::process::Child> {
        let quoted: Vec<String> = line.split(' ').skip(1).map(|word| format!("'{word}'")).collect();
        let program = self.programs.join(line.split(' ').next().context("a program")?);
        let mut shell = Command::new("sh");
        let script = format!("{before} {} {} {behind}", program.display(), quoted.join(" "));
        shell.current_dir(&self.folder).env_remove("RUST_BACKTRACE").args(["-c", &script]);
        Ok(shell.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?)
    }

    fn run(&self, before: &str, line: &str) -> Result<Ended> {
        let before = format!("{before} exec timeout {LONGEST_SECONDS}");
        let ended = self.start(&before, line, "")?.wait_with_output()?;
        let err = String::from_utf8_lossy(&ended.stderr).into_owned();
        Ok(Ended { status: ended.status, out: ended.stdout, err })
    }

    fn done(&self, line: &str) -> Result<Ended> {
        let ended = self.run("", line)?;
        ensure!(ended.status.success(), "{line}: {}: {}", ended.status, ended.err);
        Ok(ended)
    }

    fn out(&self) -> PathBuf {
        self.folder.join("out")
    }

    /// Empties the folder of outputs and puts `content` there.
    fn restore(&self, content: &[(PathBuf, Vec<u8>)]) -> Result<()> {
        if self.out().exists() {
            std::fs::remove_dir_all(self.out())?;
        }
        std::fs::create_dir(self.out())?;
        for (path, bytes) in content {
            std::fs::create_dir_all(path.parent().context("in a folder")?)?;
            std::fs::write(path, bytes)?;
        }
        Ok(())
    }

    /// The old outputs of a program, the new ones, and how long it takes.
    fn both(&self, line: &str) -> Result<[(Files, Duration); 2]> {
        let made = |which: &str| -> Result<(Files, Duration)> {
            self.restore(&[])?;
            let begun = Instant::now();
            self.done(&line.replace("{}", which))?;
            Ok((files(&self.out())?, begun.elapsed()))
        };
        Ok([made("a")?, made("b")?])
    }

    /// What is wrong with the outputs where a run may have left the old or the new ones: an unfinished file may be left where it `may_leave` one.
    fn outputs(
        &self,
        old: &[(PathBuf, Vec<u8>)],
        new: &[(PathBuf, Vec<u8>)],
        may_leave: bool,
    ) -> Result<Option<String>> {
        for (path, bytes) in files(&self.out())? {
            let is = |known: &[(PathBuf, Vec<u8>)]| {
                known.iter().any(|(at, content)| *at == path && *content == bytes)
            };
            let is_left = may_leave && path.to_string_lossy().ends_with(".unfinished");
            if !is_left && !is(old) && !is(new) {
                return Ok(Some(format!("{} is neither the old nor the new output", path.display())));
            }
        }
        let is_gone = old.iter().find(|(path, _)| !path.exists());
        Ok(is_gone.map(|(path, _)| format!("{} is gone", path.display())))
    }

    /// Kills every program at random times.
    pub(super) fn kills(&self, random: &mut Random, repetitions: usize) -> Result<Tally> {
        let mut tally = Tally::default();
        for line in PROGRAMS {
            let [(old, _), (new, time)] = self.both(line)?;
            for repetition in 0..repetitions {
                self.restore(&old)?;
                let signal = ["KILL", "INT", "TERM"][repetition % 3];
                let child = self.start("exec", &line.replace("{}", "b"), "")?;
                std::thread::sleep(time.mul_f64(random.below(1000) as f64 / 900.0));
                Command::new("kill")
                    .args(["-s", signal, &child.id().to_string()])
                    .stderr(Stdio::null())
                    .status()?;
                let ended = child.wait_with_output()?;
                let err = String::from_utf8_lossy(&ended.stderr).into_owned();
                let ended = Ended { status: ended.status, out: Vec::new(), err };
                let mut wrong = ended.fault(true).or(self.outputs(&old, &new, signal == "KILL")?);
                if wrong.is_none() && repetition < 3 {
                    // The next run cleans up.
                    let again = self.run("", &line.replace("{}", "b"))?;
                    wrong = again.fault(false).or(self.outputs(&new, &new, false)?);
                }
                tally.count(ended.status.success(), wrong.map(|wrong| format!("{line} {signal}: {wrong}")));
            }
        }
        Ok(tally)
    }

    /// Runs every program under a limit.
    fn limited(&self, repetitions: usize, limit: &mut dyn FnMut(usize) -> String) -> Result<Tally> {
        let mut tally = Tally::default();
        for line in PROGRAMS {
            let [(old, _), (new, _)] = self.both(line)?;
            let largest = new.iter().map(|(_, bytes)| bytes.len()).max().unwrap_or(0);
            for _ in 0..repetitions {
                self.restore(&old)?;
                let before = limit(largest);
                let ended = self.run(&before, &line.replace("{}", "b"))?;
                let wrong = ended.fault(false).or(self.outputs(&old, &new, false)?);
                tally.count(ended.status.success(), wrong.map(|wrong| format!("{before} {line}: {wrong}")));
            }
        }
        Ok(tally)
    }

    /// Files that end at a random size.
    pub(super) fn full_disks(&self, random: &mut Random, repetitions: usize) -> Result<Tally> {
        // In blocks of 512 bytes.
        let mut limit =
            |largest: usize| format!("trap '' XFSZ; ulimit -f {};", random.below(largest / 512 + 2));
        self.limited(repetitions, &mut limit)
    }

    /// Little address space.
    pub(super) fn small_memories(&self, random: &mut Random, repetitions: usize) -> Result<Tally> {
        self.limited(repetitions, &mut |_| format!("ulimit -v {};", (24 << 10) + random.below(176 << 10)))
    }

    /// Every program without a reader of what it prints, or on a full disk. A run that ends well has written what it was asked for.
    pub(super) fn broken_streams(&self) -> Result<Tally> {
        let mut tally = Tally::default();
        for line in PROGRAMS {
            let [(old, _), (new, _)] = self.both(line)?;
            let line = line.replace("{}", "b").replace(" --quiet", "");
            for (own, reader) in STREAMS {
                self.restore(&old)?;
                // The end of a pipe does not tell how the program ended.
                let behind = format!("{own}; echo $? > code; }} {reader}");
                self.start(&format!("{{ timeout {LONGEST_SECONDS}"), &line, &behind)?.wait_with_output()?;
                let code = std::fs::read_to_string(self.folder.join("code"))?.trim().to_owned();
                let is_done = code == "0";
                let wrong = (!is_done && code != "2").then(|| format!("exit code {code}"));
                let allowed = if is_done { &new } else { &old };
                let wrong = wrong.or(self.outputs(allowed, &new, false)?);
                tally.count(is_done, wrong.map(|wrong| format!("{line} {own} {reader}: {wrong}")));
            }
        }
        Ok(tally)
    }

    /// Two runs at once with one output: both end well, and what is there is complete.
    pub(super) fn pairs(&self, repetitions: usize) -> Result<Tally> {
        let mut tally = Tally::default();
        for line in PROGRAMS {
            let [(old, _), (new, _)] = self.both(line)?;
            for _ in 0..repetitions {
                self.restore(&old)?;
                let begin = || self.start("exec", &line.replace("{}", "b"), "");
                let both = [begin()?, begin()?];
                for child in both {
                    let ended = child.wait_with_output()?;
                    let err = String::from_utf8_lossy(&ended.stderr).into_owned();
                    let wrong = (!ended.status.success()).then_some(err);
                    let wrong = wrong.or(self.outputs(&new, &new, true)?);
                    tally.count(ended.status.success(), wrong.map(|wrong| format!("{line}: {wrong}")));
                }
                let wrong = self.outputs(&new, &new, false)?;
                tally.violations.extend(wrong.map(|wrong| format!("{line}: {wrong}")));
            }
        }
        Ok(tally)
    }

    /// What is no file in the place of every input: a message, at once and without memory.
    pub(super) fn no_files(&self) -> Result<Tally> {
        let mut tally = Tally::default();
        let before = format!("ulimit -v {AMPLE_KIB};");
        for (name, line, _) in INPUTS {
            let word = damaged(line)?;
            let place = self.folder.join(word);
            for (kind, make) in NO_FILES {
                let removed = std::fs::remove_file(&place).or_else(|_| std::fs::remove_dir(&place));
                drop(removed);
                let mut shell = Command::new("sh");
                let made = shell.current_dir(&self.folder).args(["-c", &format!("{make} {word}")]);
                ensure!(made.status()?.success(), "{make} {word}");
                self.restore(&[])?;
                let ended = self.run(&before, line)?;
                let is_refused = ended.status.code() == Some(2);
                let wrong = ended.fault(false).or((!is_refused).then(|| "it is read".to_owned()));
                tally.count(false, wrong.map(|wrong| format!("{kind} as {name}: {wrong}")));
            }
            std::fs::remove_file(&place)?;
        }
        Ok(tally)
    }

    /// Damaged inputs of every kind.
    pub(super) fn damage(&self, damage: Damage, random: &mut Random, copies: usize) -> Result<Tally> {
        let mut tally = Tally::default();
        let before = format!("ulimit -v {AMPLE_KIB};");
        for (name, line, has_digest) in INPUTS {
            let good = std::fs::read(self.folder.join(name))?;
            let word = damaged(line)?;
            let place = self.folder.join(word);
            std::fs::write(&place, &good)?;
            self.restore(&[])?;
            let expected = self.run("", line)?;
            ensure!(matches!(expected.status.code(), Some(0 | 1)), "{name}: {}", expected.err);
            for copy in 0..copies {
                let mut damaged = good.clone();
                damage(&mut damaged, random);
                std::fs::write(&place, &damaged)?;
                self.restore(&[])?;
                let ended = self.run(&before, line)?;
                let is_other = has_digest && ended.status.success() && ended.out != expected.out;
                let wrong = ended.fault(false).or(is_other.then(|| "it prints something else".to_owned()));
                if wrong.is_some() {
                    std::fs::copy(&place, self.folder.join(format!("found-{copy}-{word}")))?;
                }
                tally.count(
                    ended.status.code() != Some(2),
                    wrong.map(|wrong| format!("{name} {copy}: {wrong}")),
                );
            }
        }
        Ok(tally)
    }
}

/// The name of the damaged input in a command line.
fn damaged(line: &str) -> Result<&str> {
    let words = line.split([' ', '=']);
    words.into_iter().find(|word| word.starts_with("damaged.")).context("a damaged input")
}

/// Flips a bit.
#[allow(clippy::ptr_arg, reason = "a kind of damage, as those that change the length")]
pub(super) fn flipped(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    bytes[at] ^= 1 << random.below(8);
}

/// Cuts the file.
pub(super) fn cut(bytes: &mut Vec<u8>, random: &mut Random) {
    bytes.truncate(random.below(bytes.len()));
}

/// Swaps two bytes.
#[allow(clippy::ptr_arg, reason = "a kind of damage, as those that change the length")]
pub(super) fn swapped(bytes: &mut Vec<u8>, random: &mut Random) {
    let (a, b) = (random.below(bytes.len()), random.below(bytes.len()));
    bytes.swap(a, b);
}

/// Repeats a part of at most 256 bytes elsewhere.
pub(super) fn repeated(bytes: &mut Vec<u8>, random: &mut Random) {
    let (from, at, length) = (random.below(bytes.len()), random.below(bytes.len()), 1 + random.below(256));
    let part = bytes[from..bytes.len().min(from + length)].to_vec();
    bytes.splice(at..at, part);
}
