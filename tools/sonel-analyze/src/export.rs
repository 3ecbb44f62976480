//! `sonel-analyze export`: the sonels of a map one by one, or the echograms of a response, for other programs.

use std::io::Write;
use std::path::Path;

use anyhow::bail;
use sonel::analysis::export;
use sonel::analysis::sonels::Sonels;
use sonel_console::Outcome;
use sonel_console::artifact::Artifact;
use sonel_console::output::{Kind, Output, has_ending};
use sonel_console::progress::Progress;
use sonel_console::quantity;

use crate::arguments::Export;
use crate::open;

/// Writes all sonels of a map, or all echograms of a response.
///
/// # Errors
/// When the map or response is unusable, or the output has another ending or cannot be written.
pub(crate) fn run(arguments: &Export, quiet: bool, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Export { file: map, output } = arguments;
    if open::kind(map)? == Artifact::Response {
        return echograms(map, output, log);
    }
    let (as_archive, kind) = match output {
        _ if has_ending(output, "csv") => (false, Kind::SONEL_TABLE),
        _ if has_ending(output, "npz") => (true, Kind::SONEL_ARCHIVE),
        _ => bail!("{} ends neither in .csv nor in .npz: choose one of them", output.display()),
    };
    let (map, geometry) = open::checked_map(map)?;
    let sonels = Sonels::new(&map, &geometry);
    let target = Output::create(output, kind, &[])?;
    let (count, passes) = (sonels.count(), if as_archive { export::ARRAYS } else { 1 });
    let progress = Progress::begin("exporting", quiet);
    let reach = &mut |rows| progress.reach(rows as f64 / (count * passes) as f64);
    if as_archive {
        target.write(|out| export::npz(&sonels, out, reach).map(drop))?;
    } else {
        target.write(|out| export::csv(&sonels, out, reach))?;
    }
    drop(progress);
    let bytes = std::fs::metadata(output)?.len();
    writeln!(log, "{count} sonels, {bytes} bytes; written to {}", output.display())?;
    Ok(Outcome::Done)
}

fn echograms(response: &Path, output: &Path, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    if !has_ending(output, "csv") {
        bail!(
            "{} does not end in .csv: a response is exported as CSV only (it is a numpy archive already)",
            output.display()
        );
    }
    let target = Output::create(output, Kind::ECHOGRAM_TABLE, &[])?;
    let response = open::response(response)?;
    target.write(|out| export::echogram_csv(&response, out))?;
    let bytes = std::fs::metadata(output)?.len();
    writeln!(log, "{}; written to {}", quantity::bytes(bytes as f64), output.display())?;
    Ok(Outcome::Done)
}
