//! Outputs that appear under their name only when complete.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, bail};
use tempfile::TempPath;

use sonel::scenes::checkup::FIRST_LINE;
use sonel::scenes::is_mesh;

use crate::{inputs, interrupt, note};

/// What the name of a file ends with until it is complete.
pub const UNFINISHED: &str = ".unfinished";

/// The longest begin of a file that tells its kind [bytes].
const LONGEST_BEGIN: u64 = 4096;

/// A kind of output, told by how its files begin.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// With its article, for messages.
    name: &'static str,
    /// The usual ending of a name; other names are allowed where they are not usual for another kind.
    ending: &'static str,
    /// Whether a file of the kind begins so; none where users edit them: none is replaced.
    is_begin: Option<fn(&[u8]) -> bool>,
}

impl Kind {
    const fn new(name: &'static str, ending: &'static str, is_begin: fn(&[u8]) -> bool) -> Self {
        Self { name, ending, is_begin: Some(is_begin) }
    }

    /// What `sonel-trace new` writes. A scene file is edited, so that none is replaced.
    pub const SCENE: Self = Self { name: "a scene file", ending: "toml", is_begin: None };
    /// What `sonel-trace check --fix` writes.
    pub const REPAIRED_MESH: Self =
        Self::new("a mesh repaired by sonel-trace", "obj", |begin| begin.starts_with(FIRST_LINE.as_bytes()));
    /// What sonel-trace and merge write.
    pub const MAP: Self = Self::new("a sonel map", "sonelmap", |begin| begin.starts_with(b"SONELMAP"));
    /// What sonel-render writes.
    pub const RESPONSE: Self =
        Self::new("a response", "npz", |begin| is_archive(begin, "format_version.npy"));
    /// What export writes for numpy.
    pub const SONEL_ARCHIVE: Self =
        Self::new("a numpy archive of sonels", "npz", |begin| is_archive(begin, "center_frequency_hz.npy"));
    /// What export writes for spreadsheets.
    pub const SONEL_TABLE: Self =
        Self::new("a CSV file of sonels", "csv", |begin| begin.starts_with(b"source,emission,"));
    /// What export writes of a response.
    pub const ECHOGRAM_TABLE: Self = Self::new("a CSV file of echograms", "csv", |begin| {
        begin.starts_with(b"source,receiver,center_frequency_hz,begin_s,")
    });
    /// What sonel-view and report write.
    pub const PAGE: Self = Self::new("a page of sonel-view", "html", |begin| {
        String::from_utf8_lossy(begin).contains("content=\"sonel-view\"")
    });
    /// What render --wav and auralise write: 32-bit float samples. Recordings of integers are never taken for it.
    pub const SOUND: Self = Self::new("a WAV file of 32-bit float samples", "wav", is_float_sound);
    /// What plot and tradeoff draw.
    pub const DRAWING: Self = Self::new("a drawing of sonel-analyze (SVG)", "svg", |begin| {
        begin.starts_with(b"<!-- sonel-analyze -->")
    });
    /// What image writes for programs.
    pub const PICTURE: Self = Self::new("a picture of sonel-analyze (OpenEXR)", "exr", |begin| {
        is_picture(begin, b"\x76\x2f\x31\x01")
    });
    /// What image draws.
    pub const DRAWN_PICTURE: Self =
        Self::new("a picture of sonel-analyze (PNG)", "png", |begin| is_picture(begin, b"\x89PNG"));
    /// The report of tradeoff for programs.
    pub const TRADEOFF_REPORT: Self =
        Self::new("a report of tradeoff", "json", |begin| begin.starts_with(b"{\n  \"scene\""));
    /// The report of tradeoff for people.
    pub const TRADEOFF_PAGE: Self = Self::new("a page of tradeoff", "md", |begin| {
        let line = begin.split(|&byte| byte == b'\n').next().unwrap_or_default();
        String::from_utf8_lossy(line).ends_with(": what accuracy costs")
    });
}

/// Whether a file begins as a numpy archive whose first array is `first`.
fn is_archive(begin: &[u8], first: &str) -> bool {
    // A local header of 30 bytes precedes the name.
    begin.starts_with(b"PK\x03\x04") && begin.get(30..).is_some_and(|name| name.starts_with(first.as_bytes()))
}

/// Whether a file begins as a WAV file of 32-bit floats, as an extensible format chunk says it.
fn is_float_sound(begin: &[u8]) -> bool {
    const BITS: std::ops::Range<usize> = 34..36;
    const SUB_FORMAT: std::ops::Range<usize> = 44..46;
    let is = |range: std::ops::Range<usize>, number: u16| {
        begin.get(range).is_some_and(|bytes| bytes == number.to_le_bytes())
    };
    begin.starts_with(b"RIFF")
        && begin.get(8..16).is_some_and(|name| name == b"WAVEfmt ")
        && is(BITS, 32)
        && is(SUB_FORMAT, 3)
}

/// Whether a file begins as a picture of a format and names the program that wrote it.
fn is_picture(begin: &[u8], magic: &[u8]) -> bool {
    let program = b"sonel-analyze";
    begin.starts_with(magic) && begin.windows(program.len()).any(|part| part == program)
}

/// A file being written beside its final place, under a name that says for what and ends with [`UNFINISHED`]. Dropped
/// without [`Output::publish`] it leaves no trace, nor does a process that is interrupted ([`interrupt`]). One that is killed
/// leaves that file; the next run with the same target removes it.
#[derive(Debug)]
pub struct Output {
    target: PathBuf,
    file: BufWriter<File>,
    /// Removes the file when it is dropped.
    path: TempPath,
    /// Dropped after the file.
    unfinished: interrupt::Unfinished,
}

/// Checks that `target` may be written: it is none of the `inputs`, and where it exists an earlier output of this `kind` or empty.
fn check_target(target: &Path, kind: Kind, inputs: &[PathBuf]) -> anyhow::Result<()> {
    if target.as_os_str() == "-" || target.parent() == Some(Path::new("/dev")) {
        bail!(
            "{} is a stream or device, outputs are files: choose another output (./- for a file called -)",
            target.display()
        );
    }
    check_name(target)?;
    let named = inputs::named().chain(inputs).find(|input| is_same_file(input, target));
    if let Some(input) = named {
        bail!(
            "{} is an input of this command ({}): choose another output",
            target.display(),
            input.display()
        );
    }
    let ending = target.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let is_known = USUAL_ENDINGS.contains(&&*ending) || is_mesh(&target.to_string_lossy());
    if is_known && ending != kind.ending {
        bail!(
            "{} ends in .{ending}, but {} ends in .{}: choose such a name",
            target.display(),
            kind.name,
            kind.ending
        );
    }
    if !target.exists() {
        return Ok(());
    }
    if !target.is_file() {
        bail!("{} is not a regular file: choose another output", target.display());
    }
    let mut begin = Vec::new();
    let read = File::open(target).and_then(|file| file.take(LONGEST_BEGIN).read_to_end(&mut begin));
    read.with_context(|| format!("cannot read {}, which would be replaced", target.display()))?;
    let what = match kind.is_begin {
        _ if begin.is_empty() => return Ok(()),
        Some(is_begin) if is_begin(&begin) => return Ok(()),
        Some(_) => format!("exists and is not {}", kind.name),
        None => "exists".to_owned(),
    };
    bail!("{} {what}: delete it first, or choose another output", target.display())
}

/// Checks that `target` names a file.
fn check_name(target: &Path) -> anyhow::Result<()> {
    if target.file_name().is_none() || target.as_os_str().to_string_lossy().ends_with(std::path::is_separator)
    {
        bail!("{} names a folder, outputs are files: add a file name", target.display());
    }
    Ok(())
}

/// Checks, before anything is read, that `target` names a file in a folder that is there.
///
/// # Errors
/// When it names a folder, or is in none.
pub fn check_place(target: &Path) -> anyhow::Result<()> {
    check_name(target)?;
    let folder = folder_of(target);
    if !folder.is_dir() {
        bail!("the folder {} does not exist: create it first", folder.display());
    }
    Ok(())
}

/// Makes the `folder` of outputs where there is none: one that cannot be made shall be found before the work is done.
///
/// # Errors
/// When it is no folder, or cannot be made.
pub fn make_folder(folder: &Path) -> anyhow::Result<()> {
    if folder.exists() && !folder.is_dir() {
        bail!("{} is not a folder: choose another one", folder.display());
    }
    if !folder.exists() {
        std::fs::create_dir(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    Ok(())
}

/// Endings that tell what a file is, besides those of meshes.
const USUAL_ENDINGS: [&str; 11] =
    ["sonelmap", "npz", "csv", "svg", "json", "md", "toml", "wav", "html", "exr", "png"];

/// Whether a file name has an ending, in whatever case.
#[must_use]
pub fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending))
}

/// Whether both paths lead to one file, through links or not.
fn is_same_file(a: &Path, b: &Path) -> bool {
    #[cfg(all(unix, not(sonel_portable)))]
    if let (Ok(a), Ok(b)) = (a.metadata(), b.metadata()) {
        use std::os::unix::fs::MetadataExt;
        return (a.dev(), a.ino()) == (b.dev(), b.ino());
    }
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// The folder of a file.
#[must_use]
pub fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// How the names of unfinished files of `target` begin.
fn prefix(target: &Path) -> OsString {
    let mut prefix = target.file_name().unwrap_or_default().to_owned();
    prefix.push(".");
    prefix
}

/// Folders that this process writes in, each with a lock that other runs share, so that who has it alone knows that nobody else writes there, and
/// with unfinished files that nobody wrote any more when this process came. One lock for each: complete files wait closed for their names, and may be many.
static ENTERED: Mutex<BTreeMap<PathBuf, (File, Vec<PathBuf>)>> = Mutex::new(BTreeMap::new());

/// Says to other runs that this one writes in the folder of `target`, and removes unfinished files of `target` that killed runs left. What cannot be
/// read, locked or removed stays.
fn enter(target: &Path) {
    let Ok(folder) = folder_of(target).canonicalize() else { return };
    let mut entered = ENTERED.lock().unwrap_or_else(PoisonError::into_inner);
    if !entered.contains_key(&folder) {
        let Ok(lock) = File::open(&folder) else { return };
        let is_alone = lock.try_lock().is_ok();
        let entries = folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.path());
        let left = entries.filter(|path| is_alone && path.is_file() && has_ending(path, &UNFINISHED[1..]));
        let left = left.collect();
        let _ = lock.lock_shared();
        entered.insert(folder.clone(), (lock, left));
    }
    let Some((_, left)) = entered.get_mut(&folder) else { return };
    let prefix = prefix(target).to_string_lossy().into_owned();
    let is_of_target = |path: &mut PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let random = name.strip_prefix(&prefix).and_then(|rest| rest.strip_suffix(UNFINISHED));
        random.is_some_and(|random| !random.is_empty() && !random.contains('.'))
    };
    for path in left.extract_if(.., is_of_target) {
        if std::fs::remove_file(&path).is_ok() {
            note(&format!("removed {}, left by a killed run", path.display()));
        }
    }
}

impl Output {
    /// Begins an output of some `kind` that will be `target`, and removes what earlier runs that were killed left of it.
    /// `inputs` are files that are read beside those that the command line names.
    ///
    /// # Errors
    /// When `target` is an input, an existing file of another kind, or no regular file, or its folder cannot be written.
    pub fn create(target: &Path, kind: Kind, inputs: &[PathBuf]) -> anyhow::Result<Self> {
        check_target(target, kind, inputs)?;
        check_place(target)?;
        let folder = folder_of(target);
        enter(target);
        let begin =
            || tempfile::Builder::new().prefix(&prefix(target)).suffix(UNFINISHED).tempfile_in(folder);
        let (file, unfinished) = interrupt::Unfinished::begin(begin)
            .with_context(|| format!("cannot write in {}: choose another folder for it", folder.display()))?;
        let (file, path) = file.into_parts();
        let file = BufWriter::with_capacity(1 << 20, file);
        Ok(Self { target: target.to_owned(), file, path, unfinished })
    }

    /// Checks what [`Self::create`] does, before work that takes long; leaves no file.
    ///
    /// # Errors
    /// The errors of [`Self::create`].
    pub fn try_create(target: &Path, kind: Kind) -> anyhow::Result<()> {
        Self::create(target, kind, &[]).map(drop)
    }

    /// The file as written so far, to be read before it is published.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn file(&mut self) -> std::io::Result<&File> {
        self.file.flush()?;
        Ok(self.file.get_ref())
    }

    /// Writes `content` and puts the file in its place.
    ///
    /// # Errors
    /// Those of both.
    pub fn write<T, E>(self, content: impl FnOnce(&mut BufWriter<File>) -> Result<T, E>) -> anyhow::Result<()>
    where
        Result<T, E>: Context<T, E>,
    {
        publish([self.complete(content)?])
    }

    /// Writes `content`; [`publish`] then puts the file in its place.
    ///
    /// # Errors
    /// Those of `content`.
    pub fn complete<T, E>(
        mut self,
        content: impl FnOnce(&mut BufWriter<File>) -> Result<T, E>,
    ) -> anyhow::Result<Complete>
    where
        Result<T, E>: Context<T, E>,
    {
        content(&mut self.file).with_context(|| failed(&self.target))?;
        self.end()
    }

    /// Puts the complete file in its place, replacing an older one in a single step.
    ///
    /// # Errors
    /// When the disk is full or the file cannot be renamed; an older file then stays as it was.
    pub fn publish(self) -> anyhow::Result<()> {
        publish([self.end()?])
    }

    /// Closes the file.
    fn end(self) -> anyhow::Result<Complete> {
        let Self { target, file, path, unfinished } = self;
        let failed = || failed(&target);
        let file = file.into_inner().map_err(std::io::IntoInnerError::into_error).with_context(failed)?;
        let permissions = readable_by_all(&file);
        file.sync_all().with_context(failed)?;
        if let Some(permissions) = permissions {
            file.set_permissions(permissions).with_context(failed)?;
        }
        Ok(Complete { target, path, unfinished })
    }
}

/// What is said of an output that cannot be written.
#[must_use]
pub fn failed(target: &Path) -> String {
    format!("cannot write {}; an older file there is untouched", target.display())
}

/// A complete file that has not got its name yet. Dropped without [`publish`] it leaves no trace.
#[derive(Debug)]
pub struct Complete {
    target: PathBuf,
    path: TempPath,
    unfinished: interrupt::Unfinished,
}

/// Puts complete files in their places, replacing older ones. An interruption finds none of them there or all.
///
/// # Errors
/// When an input was written to meanwhile, or a file cannot be renamed; older files at its place and those of the later ones then stay as they were.
pub fn publish(files: impl IntoIterator<Item = Complete>) -> anyhow::Result<()> {
    inputs::require_unchanged()?;
    let files = files.into_iter().map(|Complete { target, path, unfinished }| (unfinished, (target, path)));
    interrupt::publish(files, |(target, path): (PathBuf, TempPath)| {
        let renamed = path.persist(&target).map_err(|error| error.error);
        renamed.with_context(|| format!("cannot rename to {}", target.display()))
    })
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Output {
    fn seek(&mut self, position: SeekFrom) -> std::io::Result<u64> {
        self.file.seek(position)
    }
}

/// Temporary files are private to their owner; an output has the permissions a new file would have.
#[cfg(all(unix, not(sonel_portable)))]
fn readable_by_all(file: &File) -> Option<std::fs::Permissions> {
    use std::os::unix::fs::PermissionsExt;
    let mut permissions = file.metadata().ok()?.permissions();
    permissions.set_mode(0o644);
    Some(permissions)
}

#[cfg(any(not(unix), sonel_portable))]
fn readable_by_all(_: &File) -> Option<std::fs::Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const OLD: &str = "SONELMAP, an old one";

    fn names(folder: &Path) -> Vec<String> {
        let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
        names.map(|name| name.to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn an_unfinished_output_leaves_the_old_file_alone() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("hall.sonelmap");
        std::fs::write(&target, OLD).unwrap();
        let mut output = Output::create(&target, Kind::MAP, &[]).unwrap();
        output.write_all(b"new, but never finished").unwrap();
        let is_unfinished = |name: &String| name.starts_with("hall.sonelmap.") && name.ends_with(UNFINISHED);
        assert!(names(folder.path()).iter().any(is_unfinished));
        drop(output);
        assert_eq!(std::fs::read_to_string(&target).unwrap(), OLD);
        assert_eq!(names(folder.path()).len(), 1);
    }

    #[test]
    fn a_published_output_replaces_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("hall.sonelmap");
        for old in [OLD, ""] {
            std::fs::write(&target, old).unwrap();
            let mut output = Output::create(&target, Kind::MAP, &[]).unwrap();
            output.write_all(b"new").unwrap();
            output.publish().unwrap();
            assert_eq!(std::fs::read_to_string(&target).unwrap(), "new");
        }
    }

    #[test]
    fn folders_and_missing_folders_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = Output::create(folder.path(), Kind::MAP, &[]).unwrap_err();
        assert!(error.to_string().contains("not a regular file"));
        let error = Output::create(&folder.path().join("nowhere/a.sonelmap"), Kind::MAP, &[]).unwrap_err();
        assert!(error.to_string().contains("does not exist"));
    }

    #[test]
    fn folders_are_made_where_they_can_be() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("file"), "").unwrap();
        make_folder(folder.path()).unwrap();
        make_folder(&path("made")).unwrap();
        for (name, problem) in [("file", "is not a folder"), ("no/new", "cannot make the folder")] {
            let error = make_folder(&path(name)).unwrap_err();
            assert!(error.to_string().contains(problem), "{name}: {error}");
        }
        let error = Output::create(&path("new/"), Kind::MAP, &[]).unwrap_err();
        assert!(error.to_string().contains("add a file name"), "{error}");
        assert!(path("made").is_dir() && names(folder.path()).len() == 2);
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_with_the_name_of_an_unfinished_file_blocks_no_run() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("a.npz.Ab12Cd.unfinished");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let (done, ended) = std::sync::mpsc::channel();
        let target = folder.path().join("a.npz");
        std::thread::spawn(move || done.send(Output::create(&target, Kind::RESPONSE, &[]).map(drop)));
        ended.recv_timeout(std::time::Duration::from_secs(20)).unwrap().unwrap();
        assert!(pipe.exists());
    }

    #[test]
    fn inputs_and_files_of_other_kinds_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("sub")).unwrap();
        std::fs::write(path("a.sonelmap"), OLD).unwrap();
        std::fs::write(path("scene.toml"), "shoebox = [1, 2, 3]").unwrap();
        std::fs::hard_link(path("a.sonelmap"), path("link.sonelmap")).unwrap();
        // Elsewhere a second name of a file is another file, which a new one replaces; the first name keeps the old one.
        let knows_links = cfg!(all(unix, not(sonel_portable)));
        let same = ["a.sonelmap", "sub/../a.sonelmap", "link.sonelmap"];
        for target in same.into_iter().filter(|name| knows_links || *name != "link.sonelmap") {
            let error = Output::create(&path(target), Kind::MAP, &[path("a.sonelmap")]).unwrap_err();
            assert!(error.to_string().contains("is an input of this command"), "{target}: {error}");
        }
        std::fs::write(path("letter"), "dear").unwrap();
        let error = Output::create(&path("letter"), Kind::MAP, &[]).unwrap_err();
        assert!(error.to_string().contains("exists and is not a sonel map"), "{error}");
        let error = Output::create(&path("scene.toml"), Kind::SCENE, &[]).unwrap_err();
        assert!(error.to_string().contains("scene.toml exists: delete it first"), "{error}");
        for (target, kind) in
            [("scene.toml", Kind::MAP), ("a.sonelmap", Kind::RESPONSE), ("new.NPZ", Kind::DRAWING)]
        {
            let error = Output::create(&path(target), kind, &[]).unwrap_err();
            assert!(error.to_string().contains("choose such a name"), "{error}");
        }
        for stream in ["-", "/dev/stdout"] {
            let error = Output::create(Path::new(stream), Kind::MAP, &[]).unwrap_err();
            assert!(error.to_string().contains("a stream or device"), "{error}");
        }
        assert_eq!(names(folder.path()).len(), 5);
    }

    #[test]
    fn what_killed_runs_left_is_removed_and_what_others_write_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.npz");
        for left in ["a.npz.Ab12Cd.unfinished", "b.npz.Ab12Cd.unfinished", "a.npz.mine.too.unfinished"] {
            std::fs::write(folder.path().join(left), "half").unwrap();
        }
        let first = Output::create(&target, Kind::RESPONSE, &[]).unwrap();
        let second = Output::create(&target, Kind::RESPONSE, &[]).unwrap();
        let names = names(folder.path());
        assert!(names.len() == 4 && !names.contains(&"a.npz.Ab12Cd.unfinished".to_owned()), "{names:?}");
        drop((first, second));
    }
}
