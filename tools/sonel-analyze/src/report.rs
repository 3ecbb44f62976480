//! `sonel-analyze report`: the page of `sonel-view`, frozen in a file.

use sonel_console::progress::ProgressSink;
use sonel_console::{Log, Outcome};

use crate::arguments::Report;

/// Writes the page.
///
/// # Errors
/// When a file is unusable, there is no response, more than one map or a map of another scene, or the output cannot be written.
pub fn run(arguments: &Report, quiet: bool, log: &mut Log<'_>) -> anyhow::Result<Outcome> {
    sonel_view::freeze(
        &arguments.files,
        &arguments.output,
        &arguments.heard,
        &arguments.head,
        None,
        ProgressSink::unless(quiet),
        log,
    )
}
