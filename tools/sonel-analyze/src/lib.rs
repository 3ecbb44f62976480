//! The library half of `sonel-analyze`: one module per subcommand.

mod arguments;
mod auralise;
mod diff;
mod export;
mod iacc;
mod image;
mod inspect;
mod merge;
mod open;
mod open_plan;
mod parameters;
mod plot;
mod sensitivity;
mod tradeoff;
mod verify;

use std::io::Write;
use std::sync::LazyLock;

use sonel::version::version;
use sonel_console::{Log, Outcome, speak_as, use_threads};

pub use arguments::{
    Arguments, Auralise, Command, Diff, Export, Format, IaccArguments, Image, Inspect, Merge, Parameters,
    Plot, Report, Verify, What,
};

/// Version of this program: the revision is that of what it renders.
static VERSION: LazyLock<String> = LazyLock::new(|| version(sonel::rendering::REVISION));

/// Runs the program: data to `out`, everything else to `log`.
///
/// # Errors
/// When a file or an option is unusable.
pub fn run(arguments: &Arguments, out: &mut dyn Write, log: &mut Log<'_>) -> anyhow::Result<Outcome> {
    speak_as::<Arguments>();
    use_threads(arguments.threads)?;
    match &arguments.command {
        Command::Parameters(parameters) => parameters::run(parameters, arguments.quiet, out, log),
        Command::OpenPlan(line) => open_plan::run(line, out, log),
        Command::Inspect(inspect) => inspect::run(inspect, out),
        Command::Verify(verify) => verify::run(verify, out),
        Command::Export(export) => export::run(export, arguments.quiet, log),
        Command::Image(image) => image::run(image, arguments.quiet, log),
        Command::Merge(merge) => merge::run(merge, arguments.quiet, log),
        Command::Diff(diff) => diff::run(diff, out),
        Command::Sensitivity(sensitivity) => sensitivity::run(sensitivity, arguments.quiet, out, log),
        Command::Plot(plot) => plot::run(plot, log),
        Command::Report(Report { files, output, heard, head }) => {
            sonel_view::freeze(files, output, heard, head, None, arguments.quiet, log)
        }
        Command::Auralise(auralise) => auralise::run(auralise, out, log),
        Command::Iacc(recordings) => iacc::run(recordings, out),
        Command::Tradeoff(tradeoff) => tradeoff::run(tradeoff, arguments.quiet, out, log),
    }
}
