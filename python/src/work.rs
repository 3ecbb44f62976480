//! Long work beside Python: on a thread of its own, while the calling thread lets other Python threads run, passes on what
//! is said of the work, and looks whether somebody interrupts it.
//!
//! Work that is interrupted ends at its next step, and no file is left.

use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use cpu_time::{ProcessTime, ThreadTime};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use sonel::{Clock, Observer, Severity};

use crate::error;

/// How long nobody looks for an interruption.
const PATIENCE: Duration = Duration::from_millis(50);

/// What the thread that works says.
enum WorkMessage<T> {
    Progress(String, f64),
    Said(Severity, String),
    Done(sonel::Result<T>),
}

/// Runs `job` with so many `threads`, all cores where none are given. `progress` is called with what is being done and its share that is done,
/// `log` with the level of `logging` and the text of what is said.
///
/// # Errors
/// The error of the job as [`crate::Error`]; what a follower raised; `KeyboardInterrupt`.
pub(crate) fn work<T: Send + 'static>(
    py: Python<'_>,
    log: Option<Bound<'_, PyAny>>,
    progress: Option<Bound<'_, PyAny>>,
    threads: Option<usize>,
    job: impl FnOnce(&dyn Observer) -> sonel::Result<T> + Send + 'static,
) -> PyResult<T> {
    let (sender, mut news) = channel();
    let wanted = Arc::new(AtomicBool::new(true));
    let _unwanted = Unwanted(Arc::clone(&wanted));
    let pool = match threads {
        Some(threads) => Arc::new(ThreadPoolBuilder::new().num_threads(threads).build().map_err(error)?),
        None => pool()?,
    };
    let worker = thread::Builder::new().name("sonel".to_owned()).spawn(move || {
        let reporter = Reporter {
            sender: &sender,
            wanted: &wanted,
            watch: Stopwatch(Instant::now(), ProcessTime::now()),
        };
        let result = pool.install(|| job(&reporter));
        // Whoever was interrupted does not want it any more.
        let _ = sender.send(WorkMessage::Done(result));
    })?;
    loop {
        let heard;
        (news, heard) = py.detach(move || {
            let heard = news.recv_timeout(PATIENCE);
            (news, heard)
        });
        match heard {
            Ok(WorkMessage::Progress(what, share)) => {
                if let Some(progress) = &progress {
                    progress.call1((what, share))?;
                }
            }
            Ok(WorkMessage::Said(severity, text)) => {
                if let Some(log) = &log {
                    log.call1((level(severity), sonel::names::message(&text)))?;
                }
            }
            Ok(WorkMessage::Done(result)) => return result.map_err(error),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Err(panic) => resume_unwind(panic),
                Ok(()) => unreachable!("the last news of a worker that did not panic is its result"),
            },
        }
        py.check_signals()?;
    }
}

/// Runs a `job` that says nothing, on all cores.
///
/// # Errors
/// As [`work`].
pub(crate) fn silent_work<T: Send + 'static>(
    py: Python<'_>,
    job: impl FnOnce(&dyn Observer) -> sonel::Result<T> + Send + 'static,
) -> PyResult<T> {
    work(py, None, None, None, job)
}

/// Tells the work, when dropped, that nobody waits for it any more.
struct Unwanted(Arc<AtomicBool>);

impl Drop for Unwanted {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

/// Threads on all cores, kept between calls with the process that started them: a forked process has none of its parent's threads.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

fn pool() -> PyResult<Arc<ThreadPool>> {
    let mut kept = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    match &*kept {
        Some((process, pool)) if *process == std::process::id() => Ok(Arc::clone(pool)),
        _ => {
            let pool = Arc::new(ThreadPoolBuilder::new().build().map_err(error)?);
            // Threads of the parent do not end here: nobody waits for them.
            std::mem::forget(kept.replace((std::process::id(), Arc::clone(&pool))));
            Ok(pool)
        }
    }
}

/// Seconds since its start, on the wall and of the processor.
struct Stopwatch(Instant, ProcessTime);

impl Clock for Stopwatch {
    fn wall(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }

    fn process(&self) -> f64 {
        self.1.elapsed().as_secs_f64()
    }

    fn thread(&self) -> f64 {
        ThreadTime::now().as_duration().as_secs_f64()
    }
}

/// The level of `logging`.
fn level(severity: Severity) -> u8 {
    match severity {
        Severity::Detail => 10,
        Severity::Info | Severity::Note => 20,
        Severity::Warning => 30,
    }
}

/// Sends what is said of the work to the calling thread; stops the work that nobody waits for any more.
struct Reporter<'a, T> {
    sender: &'a Sender<WorkMessage<T>>,
    wanted: &'a AtomicBool,
    watch: Stopwatch,
}

impl<T> Reporter<'_, T> {
    fn send(&self, message: WorkMessage<T>) -> ControlFlow<()> {
        self.sender.send(message).map_or(ControlFlow::Break(()), ControlFlow::Continue)
    }
}

impl<T: Send> Observer for Reporter<'_, T> {
    fn progress(&self, step: &str, share: f64) -> ControlFlow<()> {
        self.send(WorkMessage::Progress(step.to_owned(), share))
    }

    fn go_on(&self) -> ControlFlow<()> {
        if self.wanted.load(Ordering::Relaxed) { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }

    fn message(&self, severity: Severity, text: &str) -> ControlFlow<()> {
        self.send(WorkMessage::Said(severity, text.to_owned()))
    }

    fn clock(&self) -> Option<&dyn Clock> {
        Some(&self.watch)
    }
}
