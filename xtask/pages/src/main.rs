//! Writes the pages, plots and meshes that are generated. `cargo pages --help` lists them.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a chore reports to the person who runs it")]

mod accuracy;
mod diffraction;
mod figures;
mod hall;
mod loudspeaker;
mod options;
mod quads;
mod rooms;
mod scale;
mod shell;
mod validate;
mod waves;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;

/// Write the pages, plots and meshes that are generated.
#[derive(Parser)]
#[command(name = "cargo pages")]
enum Page {
    /// Run the sweeps behind docs/accuracy.md and draw its plots
    Accuracy {
        /// Redraw from the runs in target/accuracy
        #[arg(long)]
        redraw: bool,
    },
    /// Write docs/diffraction: insertion loss of a screen by every law
    Diffraction,
    /// Repeat the founding paper's experiment and write docs/paper
    Figures {
        /// Redraw from the runs in target/paper
        #[arg(long)]
        redraw: bool,
    },
    /// Write scenes/hall/hall.obj and the figures in its README from the plan
    Hall,
    /// Write scenes/loudspeaker/loudspeaker.csv from the sizes of the loudspeaker
    Loudspeaker,
    /// Write the tables of options in docs/interface.md from the command lines
    Options,
    /// Write the meshes of scenes/classroom, scenes/office and scenes/church and the figures in their READMEs from the plans
    Rooms,
    /// Run the jobs of workflow/ on the hall and write the table of docs/scale.md; some minutes
    Scale,
    /// Write shell completions and man pages of the programs
    Shell {
        /// The folder they go to
        #[arg(short, long, default_value = "target/shell")]
        output: PathBuf,
    },
    /// Compare packets with measured rooms and write docs/validation and the table of docs/validation.md; the page says which data sets it reads
    Validate {
        /// The folder with the data sets
        folder: PathBuf,
        /// Only this room, printed: cr2, cr4, elmia, studio-open, studio-closed
        #[arg(long)]
        room: Option<String>,
    },
    /// Compare packets with the wave equation and write docs/validation and the table of docs/validation.md; about half an hour
    Waves {
        /// Only this room, printed: empty, screens, boxes, rows, door-1, door-4, hall
        #[arg(long)]
        room: Option<String>,
    },
}

fn main() -> ExitCode {
    let outcome = match Page::parse() {
        Page::Accuracy { redraw } => accuracy::run(redraw),
        Page::Diffraction => diffraction::run(),
        Page::Figures { redraw } => figures::run(redraw),
        Page::Hall => hall::run(),
        Page::Loudspeaker => loudspeaker::run(),
        Page::Options => options::run(),
        Page::Rooms => rooms::run(),
        Page::Scale => scale::run(),
        Page::Shell { output } => shell::run(&output),
        Page::Validate { folder, room } => validate::run(&folder, room.as_deref()),
        Page::Waves { room } => waves::run(room.as_deref()),
    };
    xtask::exit_code(outcome)
}
