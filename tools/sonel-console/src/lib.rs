//! Shared by the programs: clocks, choices, counts, times, outputs that appear when complete, interruptions, progress, exit codes.

pub mod artifact;
pub mod choices;
pub mod clock;
pub mod count;
mod defect;
pub mod follower;
pub mod heard;
pub mod inputs;
pub mod interrupt;
pub mod output;
pub mod progress;
pub mod receiver;
pub mod shard;
pub mod uncertainty;

use std::cell::RefCell;
use std::error::Error;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use clap::CommandFactory;

pub use clock::Stopwatch;
pub use inputs::parse;
pub use sonel::file as input;
use sonel::names::{message, shown};
pub use sonel::quantity;

/// Where a program logs to, from whatever thread.
pub type Log<'a> = dyn Write + Send + 'a;

/// How a program ended, when nothing was wrong with its input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done: exit code 0.
    Done,
    /// Done, but a requested tolerance or comparison failed: exit code 1.
    Missed,
}

/// Runs a program with stdout and a log, which is stderr, or nothing where it is `quiet`. Outputs that are not complete are
/// removed when it is interrupted. Exit code 2 comes with the error on stderr.
///
/// When the reader of a stream goes away (`… | head`), the program goes on to its end, and writes the files that it was asked for.
pub fn run_to_exit(
    quiet: bool,
    program: impl FnOnce(&mut dyn Write, &mut Log<'_>) -> anyhow::Result<Outcome> + Send,
) -> ExitCode {
    QUIET.store(quiet, Ordering::Relaxed);
    defect::note_panics();
    let result = interrupt::remove_unfinished_files()
        .context("cannot handle signals")
        .and_then(|()| {
            let mut out = Stream::new(std::io::stdout(), false);
            let mut log = Stream::new(log_stream(quiet), true);
            on_whole_stack(|| {
                program(&mut out, &mut log).and_then(|outcome| Ok(out.flush().map(|()| outcome)?))
            })
        })
        .and_then(|outcome| inputs::require_unchanged().map(|()| outcome));
    exit_code(result)
}

/// Calls `work` in a thread whose stack is there from the begin. That of the first thread grows, and where the address space is used up a
/// program that needs more of it ends by a signal.
fn on_whole_stack<T: Send>(work: impl FnOnce() -> anyhow::Result<T> + Send) -> anyhow::Result<T> {
    const STACK_BYTES: usize = 8 << 20;
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, work);
        let ended = thread.context("cannot start a thread: allow more memory (ulimit -v)")?.join();
        ended.unwrap_or_else(|panic| {
            inputs::require_unchanged()?;
            defect::tell();
            std::panic::resume_unwind(panic)
        })
    })
}

/// A stream that steers no terminal, and that a program goes on without: stdout where its reader has gone away, the log wherever it fails.
struct Stream<W> {
    stream: W,
    is_log: bool,
    is_gone: bool,
}

impl<W> Stream<W> {
    fn new(stream: W, is_log: bool) -> Self {
        Self { stream, is_log, is_gone: false }
    }

    /// What `write` says, or `done` where nobody listens any more.
    fn unless_gone<T>(
        &mut self,
        done: T,
        write: impl FnOnce(&mut W) -> std::io::Result<T>,
    ) -> std::io::Result<T> {
        if self.is_gone {
            return Ok(done);
        }
        match write(&mut self.stream) {
            Err(error) if error.kind() == ErrorKind::Interrupted => Err(error),
            Err(error) if self.is_log || error.kind() == ErrorKind::BrokenPipe => {
                self.is_gone = true;
                Ok(done)
            }
            result => result,
        }
    }
}

impl<W: Write> Write for Stream<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let text = std::str::from_utf8(bytes).unwrap_or_default();
        let plain = if self.is_log { message(text).into() } else { shown(text) };
        let plain = if text.is_empty() { bytes } else { plain.as_bytes() };
        self.unless_gone(bytes.len(), |stream| stream.write_all(plain).map(|()| bytes.len()))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.unless_gone((), W::flush)
    }
}

/// The exit code of `result`; an error is printed to stderr with its causes and is code 2.
fn exit_code(result: anyhow::Result<Outcome>) -> ExitCode {
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Missed) => ExitCode::from(1),
        Err(error) => {
            // A closed stderr cannot be told.
            let _ = writeln!(std::io::stderr(), "{}", message(&format!("error: {}", with_advice(&error))));
            ExitCode::from(2)
        }
    }
}

/// `error` as the command line spells options: `at_most` is `--at-most`.
#[must_use]
pub fn spelled(error: sonel::Error) -> anyhow::Error {
    match error {
        error if error.is_out_of_memory() => error.into(),
        sonel::Error::NoReceivers => {
            anyhow::anyhow!(
                "no receivers: give --receiver NAME=x,y,z, --receivers FILE, --grid X,Y,Z or --audience MATERIAL"
            )
        }
        error => anyhow::anyhow!("{}", in_words(&error.to_string())),
    }
}

thread_local! {
    /// Options of the program that runs: the field that a library calls each by, and what the command line calls it.
    static OPTIONS: RefCell<Vec<(String, String)>> = const { RefCell::new(Vec::new()) };
}

/// From now on, messages in this thread call options as program `P` does: `at_most` is `--at-most`.
pub fn speak_as<P: CommandFactory>() {
    fn add(command: &clap::Command, options: &mut Vec<(String, String)>) {
        let long =
            |option: &clap::Arg| Some((option.get_id().to_string(), format!("--{}", option.get_long()?)));
        options.extend(command.get_arguments().filter_map(long));
        command.get_subcommands().for_each(|command| add(command, options));
    }
    OPTIONS.with_borrow_mut(|options| {
        options.clear();
        add(&P::command(), options);
    });
}

/// `text` of a library, which calls options by their field, in backticks, with those of this program as its command line calls them.
fn in_words(text: &str) -> String {
    OPTIONS.with_borrow(|options| {
        let spell =
            |text: String, (field, option): &(String, String)| text.replace(&format!("`{field}`"), option);
        options.iter().fold(text.to_owned(), spell)
    })
}

/// An error with its causes, and what to do where there is no memory, as when a map cannot be mapped.
fn with_advice(error: &anyhow::Error) -> String {
    let of_system = error.chain().filter_map(|cause| cause.downcast_ref::<std::io::Error>());
    let of_maps = error.chain().filter_map(|cause| match cause.downcast_ref()? {
        sonel::map::MapError::Io(error) => Some(error),
        _ => None,
    });
    let mut kinds = of_system.chain(of_maps).map(std::io::Error::kind);
    let is_memory = kinds.any(|kind| kind == std::io::ErrorKind::OutOfMemory)
        || error.chain().filter_map(|cause| cause.downcast_ref()).any(sonel::Error::is_out_of_memory);
    let advice = if is_memory { ": give the program more memory or address space (ulimit -v)" } else { "" };
    format!("{error:#}{advice}")
}

/// Whether nobody wants to read notes: until a program begins nobody does.
static QUIET: AtomicBool = AtomicBool::new(true);

/// Says on the log of the program what no caller asked for.
pub(crate) fn note(text: &str) {
    // A closed stderr cannot be told.
    let _ = writeln!(log_stream(QUIET.load(Ordering::Relaxed)), "note: {}", message(text));
}

/// Where a program logs to: stderr, or nowhere with `--quiet`.
fn log_stream(quiet: bool) -> Box<Log<'static>> {
    if quiet { Box::new(std::io::sink()) } else { Box::new(std::io::stderr()) }
}

/// Three quarters of the memory of this machine, or of what its control group may take [bytes]; none where the system does not say it.
#[must_use]
pub fn usable_memory() -> Option<f64> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let machine = std::fs::read_to_string("/proc/meminfo").ok()?;
    let machine =
        machine.lines().find_map(|line| number(line.strip_prefix("MemTotal:")?.strip_suffix("kB")?))?;
    let group = std::fs::read_to_string("/sys/fs/cgroup/memory.max").ok().and_then(|text| number(&text));
    Some(0.75 * group.unwrap_or(f64::INFINITY).min(1024.0 * machine))
}

/// Most threads of a program: far more than cores only cost memory and switches.
const MOST_THREADS: usize = 1024;

/// Options that every program has.
#[derive(Debug, Clone, clap::Args)]
pub struct Common {
    /// Print only errors.
    #[arg(long)]
    pub quiet: bool,
    /// Threads [default: all cores].
    ///
    /// 1 … 1024. The result does not depend on it.
    #[arg(long, value_name = "N", value_parser = parse_threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

/// Parses a number of threads.
///
/// # Errors
/// A sentence for the user where `text` is no number of 1 … 1024.
pub fn parse_threads(text: &str) -> anyhow::Result<usize> {
    match text.trim().parse() {
        Ok(threads) if (1..=MOST_THREADS).contains(&threads) => Ok(threads),
        _ => anyhow::bail!("give 1 … {MOST_THREADS} threads, or leave the option out for all cores"),
    }
}

/// Address space of a thread [bytes]: the 2 MiB stack of the standard library, and an eighth for what it needs to start.
const THREAD_BYTES: usize = 9 << 18;

/// Uses `threads` threads for all parallel work of this process; all cores where none is given.
///
/// # Errors
/// When the threads cannot be started.
pub fn use_threads(threads: Option<usize>) -> anyhow::Result<()> {
    // A thread that finds no room for its signal stack aborts the process: whether there is room is asked before.
    if Vec::<u8>::new().try_reserve_exact(threads.unwrap_or(1) * THREAD_BYTES).is_err() {
        anyhow::bail!(
            "no memory for so many threads: take fewer --threads, or allow more memory (ulimit -v)"
        );
    }
    match rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build_global() {
        // Without a source: there are threads already.
        Err(error) if threads.is_some() || error.source().is_some() => anyhow::bail!(
            "cannot start threads: {error}: take fewer --threads, or allow more memory and processes (ulimit -v, -u)"
        ),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A name that clears the screen, as it would appear in a table.
    #[test]
    fn names_do_not_steer_terminals() {
        let mut out = Vec::new();
        writeln!(Stream::new(&mut out, false), "seat \u{1b}[2J\u{9b}1m\r12\tα").expect("written");
        assert_eq!(String::from_utf8(out).unwrap(), "seat \u{fffd}[2J\u{fffd}1m\u{fffd}12\tα\n");
    }

    /// Fails at every write.
    struct Failing(ErrorKind);

    impl Write for Failing {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(self.0.into())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Err(self.0.into())
        }
    }

    #[test]
    fn work_goes_on_without_a_log_and_without_a_reader_but_not_without_its_result() {
        let succeeds = |kind: ErrorKind, is_log: bool| {
            let mut stream = Stream::new(Failing(kind), is_log);
            [writeln!(stream, "one"), writeln!(stream, "two"), stream.flush()].iter().all(Result::is_ok)
        };
        assert!(succeeds(ErrorKind::BrokenPipe, true) && succeeds(ErrorKind::StorageFull, true));
        assert!(succeeds(ErrorKind::BrokenPipe, false));
        assert!(!succeeds(ErrorKind::StorageFull, false), "a result that is not written is told");
    }

    #[test]
    fn options_of_the_program_are_spelled_and_other_quotations_stay() {
        #[derive(clap::Parser)]
        struct Program {
            #[arg(long)]
            at_most: Option<f64>,
            #[arg(long = "for")]
            variants: Option<String>,
        }
        speak_as::<Program>();
        let text = "`at_most` needs `variants`; no material `felty`: give `bin`";
        assert_eq!(in_words(text), "--at-most needs --for; no material `felty`: give `bin`");
    }

    #[test]
    fn missing_memory_comes_with_advice() {
        let of =
            |number| anyhow::Error::new(std::io::Error::from_raw_os_error(number)).context("hall.sonelmap");
        let [no_memory, no_file] = [12, 2].map(|number| with_advice(&of(number)));
        assert!(
            no_memory.starts_with("hall.sonelmap: ") && no_memory.ends_with("(ulimit -v)"),
            "{no_memory}"
        );
        assert!(!no_file.contains("ulimit"), "{no_file}");
        let unmapped = sonel::map::MapError::Io(std::io::Error::from_raw_os_error(12));
        let unmapped = with_advice(&anyhow::Error::new(unmapped).context("hall.sonelmap"));
        assert!(unmapped.ends_with("(ulimit -v)"), "{unmapped}");
    }
}
