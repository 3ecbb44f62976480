//! The commands of `sonel-trace`: trace, check, new, materials.

use std::io::Write;

use clap::{Parser, Subcommand};
use sonel_console::{Common, Log, Outcome, speak_as, use_threads};

use crate::{Arguments, check, materials, new};

/// Traces packets through a scene and saves the sonel map.
#[derive(Debug, Clone, Parser)]
#[command(
    version = sonel::TRACER_VERSION.as_str(),
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    disable_help_subcommand = true,
    after_long_help = "Examples:\n  sonel-trace scenes/seed-room/scene.toml -o room.sonelmap \\\n    --packets 200k --seed 7\n  \
                  sonel-trace scenes/hall/scene.toml --plan\n  \
                  sonel-trace scenes/hall/scene.toml -o hall.sonelmap \\\n    --until \"level<0.1dB,c80<0.2dB\" --at-most 60s\n  \
                  sonel-trace scenes/seed-room/scene.toml -o room.sonelmap \\\n    --extend room.sonelmap --packets 1M\n  \
                  sonel-trace new hall.glb -o scene.toml\n  sonel-trace check scene.toml\n  \
                  sonel-trace materials carpet felt"
)]
pub struct Program {
    #[command(flatten)]
    trace: Option<Arguments>,
    #[command(subcommand)]
    command: Option<Command>,
}

/// What is done before a trace. A scene file of such a name is given with its folder: `./check`.
#[derive(Debug, Clone, Subcommand)]
enum Command {
    Check(check::Checked),
    New(new::New),
    Materials(materials::Words),
}

impl Command {
    fn common(&self) -> &Common {
        match self {
            Self::Check(checked) => &checked.common,
            Self::New(new) => &new.common,
            Self::Materials(words) => &words.common,
        }
    }
}

impl Program {
    /// Whether nothing is said on stderr but errors.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        match &self.command {
            Some(command) => command.common().quiet,
            None => self.trace.as_ref().is_some_and(|trace| trace.quiet),
        }
    }

    /// Runs it: data to `out`, everything else to `log`.
    ///
    /// # Errors
    /// The errors of the command.
    pub fn run(&self, out: &mut dyn Write, log: &mut Log<'_>) -> anyhow::Result<Outcome> {
        speak_as::<Self>();
        if let Some(command) = &self.command {
            use_threads(command.common().threads)?;
        }
        match (&self.command, &self.trace) {
            (Some(Command::Check(checked)), _) => check::run(checked, out, log),
            (Some(Command::New(new)), _) => new::run(new, log),
            (Some(Command::Materials(words)), _) => materials::run(words, out),
            (None, Some(trace)) => crate::run(trace, out, log),
            (None, None) => anyhow::bail!("no scene file: write sonel-trace SCENE.toml -o MAP.sonelmap"),
        }
    }
}
