//! The page as it is served to one's own machine.

mod answer;
mod edit;
mod http;
mod save;
mod session;
mod wishes;

use std::io::Write;
use std::net::TcpListener;

use anyhow::Context;
use sonel_console::{Log, Outcome, interrupt};

use crate::Arguments;
use crate::files::Files;
use http::Guard;
use session::Session;

/// Serves the page of `files` until the program is interrupted.
///
/// # Errors
/// When the scene cannot be read, or there is no address.
pub(crate) fn serve(
    files: Files,
    arguments: &Arguments,
    out: &mut dyn Write,
    log: &mut Log<'_>,
) -> anyhow::Result<Outcome> {
    let port = arguments.port;
    let listener = TcpListener::bind(("127.0.0.1", port))
        .with_context(|| format!("cannot listen at 127.0.0.1:{port}"))?;
    let guard = Guard::new(listener.local_addr()?.port())?;
    let session = Session::open(files, arguments, &guard.token)?;
    let address = guard.address();
    writeln!(out, "{address}")?;
    out.flush()?;
    writeln!(log, "Ctrl-C ends sonel-view; anybody who knows the address sees the room")?;
    interrupt::is_the_end();
    if !arguments.no_open
        && let Err(error) = open::that_detached(&address)
    {
        writeln!(log, "note: no browser can be opened ({error}): open the address yourself")?;
    }
    if session.scene.is_some() {
        session.trace(session.text(), session.scene());
    }
    http::run(listener, guard, session)?;
    Ok(Outcome::Done)
}
