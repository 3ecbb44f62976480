//! The command line of `sonel-view`.

use std::path::PathBuf;

use clap::{Args, Parser};
use sonel::parse_count;
use sonel::study::criteria::Criterion;
use sonel_console::Common;
use sonel_console::heard::HeardArguments;
use sonel_console::uncertainty::UncertaintyArguments;

/// What stands above a frozen page, what the room shall meet, and how uncertain its materials are.
#[derive(Debug, Clone, Default, Args)]
pub struct HeadArguments {
    /// Title of the report [default: name of the scene].
    #[arg(long, value_name = "TEXT")]
    pub project: Option<String>,
    /// Author of the report.
    #[arg(long, value_name = "TEXT")]
    pub author: Option<String>,
    /// Date of the report.
    ///
    /// Printed as given; no date without it.
    #[arg(long, value_name = "TEXT")]
    pub date: Option<String>,
    /// Version of the report.
    #[arg(long, value_name = "TEXT")]
    pub revision: Option<String>,
    /// Requirement; repeatable.
    ///
    /// What the mean over the receivers shall meet: t30=0.6s±20%@250-2000, c50>=2dB@500,1000, sti>=0.6, a standard such as
    /// din18041-a3, or one of your own in a file, FILE.toml:NAME.
    #[arg(long = "target", value_name = "CRITERION", value_parser = str::parse::<Criterion>)]
    pub targets: Vec<Criterion>,
    /// Add parameters of an open-plan office.
    ///
    /// D2,S, Lp,A,S,4m and distances of ISO 3382-3 along the receivers of the first source, by default with the speech of the standard.
    #[arg(long, requires = "noise")]
    pub open_plan: bool,
    /// Uncertainty of materials.
    #[command(flatten)]
    pub uncertainty: UncertaintyArguments,
}

/// Shows a room in the browser: move the listener and the sources, change materials, see and hear the result.
///
/// A scene is traced while the page is open; a map is rendered where the listener stands. Responses stand beside one another. The page is
/// served to this machine alone, under an address that is printed; nothing is fetched from elsewhere. Ctrl-C ends it.
#[derive(Debug, Clone, Parser)]
#[command(
    mut_arg("material_uncertainty", |argument| argument.requires("output")),
    version = sonel::RENDERER_VERSION.as_str(),
    after_long_help = "Examples:\n  sonel-view scenes/classroom/scene.toml\n  sonel-view hall.sonelmap\n  \
                  sonel-view before.npz after.npz before.sonelmap -o renovation.html"
)]
pub struct Arguments {
    /// A scene, or maps and responses.
    ///
    /// A served page is of one map.
    #[arg(value_name = "SCENE.toml|MAP.sonelmap|RESPONSE.npz", required = true)]
    pub files: Vec<PathBuf>,
    /// Page to write instead of serving.
    ///
    /// An existing page is replaced when the new one is complete. A scene is traced, a map without response rendered at the
    /// receivers of its scene.
    #[arg(short, long, value_name = "PAGE.html")]
    pub output: Option<PathBuf>,
    /// Packets of each trace [default: as sonel-trace].
    ///
    /// More take longer and give narrower intervals.
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub packets: Option<u64>,
    /// Speech, noise, and sources as one system.
    #[command(flatten)]
    pub heard: HeardArguments,
    /// What stands above the page, and targets.
    #[command(flatten)]
    pub head: HeadArguments,
    /// Port of the address [default: a free one].
    #[arg(
        long,
        value_name = "PORT",
        default_value_t = 0,
        hide_default_value = true,
        conflicts_with = "output"
    )]
    pub port: u16,
    /// Open no browser.
    ///
    /// The address is printed.
    #[arg(long, conflicts_with = "output")]
    pub no_open: bool,
    /// Options of every program.
    #[command(flatten)]
    pub common: Common,
}
