//! Long work beside Python: on a thread of its own, while the calling thread lets other Python threads run, passes on what
//! is said of the work, and looks whether somebody interrupts it.
//!
//! Work that is interrupted ends when it next speaks: its listener unwinds, and no file is left.

use std::io::Write;
use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use rayon::ThreadPoolBuilder;
use sonel_console::progress::ProgressSink;

use crate::error;

/// How long nobody looks for an interruption.
const PATIENCE: Duration = Duration::from_millis(50);

/// Who in Python hears of the work.
pub struct Followers<'py> {
    /// Called with what is being done and its share that is done.
    pub progress: Option<Bound<'py, PyAny>>,
    /// Called with each line of the log.
    pub log: Bound<'py, PyAny>,
}

/// What the thread that works says.
enum WorkMessage<T> {
    Progress(String, f64),
    Line(String),
    Done(anyhow::Result<T>),
}

/// Runs `job` with so many `threads`, all cores where none are given.
///
/// # Errors
/// The error of the job as [`crate::Error`]; what a follower raised; `KeyboardInterrupt`.
pub fn work<T: Send + 'static>(
    py: Python<'_>,
    followers: &Followers<'_>,
    threads: Option<usize>,
    job: impl FnOnce(ProgressSink<'_>, &mut dyn Write) -> anyhow::Result<T> + Send + 'static,
) -> PyResult<T> {
    let (sender, mut news) = channel();
    let worker = thread::Builder::new().name("sonel".to_owned()).spawn(move || {
        let result = on_threads(threads, &sender, job);
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
                if let Some(progress) = &followers.progress {
                    progress.call1((what, share))?;
                }
            }
            Ok(WorkMessage::Line(line)) => {
                followers.log.call1((line,))?;
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

fn on_threads<T: Send>(
    threads: Option<usize>,
    sender: &Sender<WorkMessage<T>>,
    job: impl FnOnce(ProgressSink<'_>, &mut dyn Write) -> anyhow::Result<T> + Send,
) -> anyhow::Result<T> {
    let listener = |what: &str, share: f64| {
        if sender.send(WorkMessage::Progress(what.to_owned(), share)).is_err() {
            resume_unwind(Box::new("interrupted"));
        }
    };
    let work = || job(ProgressSink::Listener(&listener), &mut Log { sender, begun: Vec::new() });
    match threads {
        Some(threads) => ThreadPoolBuilder::new().num_threads(threads).build()?.install(work),
        None => work(),
    }
}

/// Sends complete lines.
struct Log<'a, T> {
    sender: &'a Sender<WorkMessage<T>>,
    begun: Vec<u8>,
}

impl<T> Write for Log<'_, T> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.begun.extend_from_slice(bytes);
        while let Some(end) = self.begun.iter().position(|&byte| byte == b'\n') {
            let line: Vec<u8> = self.begun.drain(..=end).collect();
            let line = String::from_utf8_lossy(&line[..end]).into_owned();
            self.sender.send(WorkMessage::Line(line)).map_err(|_| std::io::ErrorKind::Interrupted)?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
