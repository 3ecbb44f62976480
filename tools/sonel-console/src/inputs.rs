//! Files that a command line names, none of which is ever replaced.
//!
//! One rule for all options: a file that is the value of any argument but an output, or follows `=` in one, is an input.

use std::ffi::{OsStr, OsString};
use std::fs::Metadata;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

use clap::error::ErrorKind;
use clap::{ArgMatches, Parser};
use sonel::names::message;

/// Arguments of the programs whose values are outputs.
pub const OUTPUTS: [&str; 3] = ["output", "fix", "wav"];
/// The argument whose file may be replaced: `--extend` with the same `--output` grows a map.
pub const REPLACEABLE: &str = "extend";

/// Inputs that the command line of this process names; those that are files, as they were before they were read.
static NAMED: OnceLock<Vec<(PathBuf, Option<FileStamp>)>> = OnceLock::new();

/// Number of a file, its length [bytes] and the time of its last change.
type FileStamp = (u64, u64, Option<SystemTime>);

fn stamp(path: &Path) -> Option<FileStamp> {
    let metadata = path.metadata().ok().filter(Metadata::is_file)?;
    #[cfg(all(unix, not(sonel_portable)))]
    let number = std::os::unix::fs::MetadataExt::ino(&metadata);
    #[cfg(any(not(unix), sonel_portable))]
    let number = 0;
    Some((number, metadata.len(), metadata.modified().ok()))
}

/// Checks that no file that the command line of this process names was written to since: results would be of both contents. One that was replaced
/// or removed meanwhile is read as it was.
///
/// # Errors
/// Names the first that was.
pub(crate) fn require_unchanged() -> anyhow::Result<()> {
    let is_other = |before: FileStamp, now: FileStamp| now.0 == before.0 && now != before;
    let was_written = |(path, before): &&(PathBuf, Option<FileStamp>)| {
        before.zip(stamp(path)).is_some_and(|(before, now)| is_other(before, now))
    };
    match NAMED.get().and_then(|named| named.iter().find(was_written)) {
        Some((path, _)) => {
            anyhow::bail!("{} was changed during the run: run the command again", path.display())
        }
        None => Ok(()),
    }
}

/// Reads the command line of this process. The files that it names are inputs from then on ([`crate::output`]).
#[must_use]
pub fn parse<P: Parser>() -> P {
    let matches = P::command().try_get_matches().unwrap_or_else(|printed| {
        let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
        let misplaced = (printed.kind() == ErrorKind::ArgumentConflict).then(|| misplaced::<P>(&words));
        end(&misplaced.flatten().unwrap_or(printed))
    });
    let named = named_by(&matches).into_iter().map(|path| (path.clone(), stamp(&path)));
    NAMED.get_or_init(|| named.collect());
    P::from_arg_matches(&matches).unwrap_or_else(|error| end(&error.format(&mut P::command())))
}

/// Prints help or what is wrong with a command line, and ends the program: with code 2 where help is lost to a full disk.
fn end(printed: &clap::Error) -> ! {
    let mut code = printed.exit_code();
    // A closed stderr cannot be told.
    if printed.use_stderr() {
        let _ = std::io::stderr().write_all(message(&printed.render().to_string()).as_bytes());
    } else if let Err(error) = printed.print().and_then(|()| std::io::stdout().flush())
        && error.kind() != std::io::ErrorKind::BrokenPipe
    {
        let _ = writeln!(std::io::stderr(), "error: {error}");
        code = 2;
    }
    std::process::exit(code)
}

/// A command that does not come first, or is none: clap takes the first word for a file, and the second for what conflicts with it.
fn misplaced<P: Parser>(words: &[String]) -> Option<clap::Error> {
    let mut command = P::command();
    let commands: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
    let [first, second, ..] = words else { return None };
    let message = if commands.contains(&second.as_str()) {
        format!("the command comes first: {} {second} {first}", command.get_name())
    } else if !commands.contains(&first.as_str()) && !Path::new(first).exists() {
        format!("`{first}` is neither a file nor a command; commands: {}", commands.join(", "))
    } else {
        return None;
    };
    Some(command.error(ErrorKind::ArgumentConflict, message))
}

/// Inputs that the command line of this process names; none where another program calls.
pub(crate) fn named<'a>() -> impl Iterator<Item = &'a PathBuf> {
    NAMED.get().into_iter().flatten().map(|(path, _)| path)
}

/// Paths that arguments of a program and of its command name, but for outputs. Not all of them are files.
#[must_use]
pub fn named_by(matches: &ArgMatches) -> Vec<PathBuf> {
    let is_input = |id: &&str| !OUTPUTS.contains(id) && *id != REPLACEABLE;
    let ids = matches.ids().map(clap::Id::as_str).filter(is_input);
    let values = ids.filter_map(|id| matches.get_raw(id)).flatten();
    let mut named: Vec<PathBuf> = values.flat_map(in_value).collect();
    named.extend(matches.subcommand().into_iter().flat_map(|(_, matches)| named_by(matches)));
    named
}

/// The value itself, and what follows each of its `=`, as in `sources.stage.directivity=FILE`.
fn in_value(value: &OsStr) -> impl Iterator<Item = PathBuf> + use<> {
    let text = value.to_string_lossy().into_owned();
    let parts: Vec<OsString> = text.match_indices('=').map(|(at, _)| text[at + 1..].into()).collect();
    std::iter::once(value.to_owned()).chain(parts).map(PathBuf::from)
}
