//! The command line of `sonel-analyze`.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use serde_json::Value;
use sonel::{Effects, Estimator, Mode, ReceiverPoint, parse_count};
use sonel_console::choices::{estimator, mode};
use sonel_console::count::{numbers, parse_rays};
use sonel_console::heard::HeardArguments;
use sonel_console::parse_threads;
use sonel_console::receiver::parse_receiver;
use sonel_render::SoundArguments;
use sonel_view::HeadArguments;

mod parameters;
mod plot;
mod speech;

pub use parameters::Parameters;
pub use plot::{Plot, What};
pub(crate) use speech::OpenPlan;

/// Inspects maps and responses, reads room-acoustic parameters.
#[derive(Debug, Clone, Parser)]
#[command(
    version = crate::VERSION.as_str(),
    after_long_help = "Example:\n  sonel-trace scenes/seed-room/scene.toml -o room.sonelmap\n  \
                  sonel-render room.sonelmap -o room.npz\n  sonel-analyze parameters room.npz\n  \
                  sonel-analyze verify room.sonelmap"
)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Print only errors.
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Threads [default: all cores].
    ///
    /// 1 … 1024. The result does not depend on it.
    #[arg(long, value_name = "N", global = true, value_parser = parse_threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

/// The subcommands.
#[derive(Debug, Clone, Subcommand)]
pub enum Command {
    /// Room-acoustic parameters of ISO 3382-1 with intervals, and the speech transmission index.
    Parameters(Parameters),
    /// Open-plan offices: D2,S, Lp,A,S,4m and rD of ISO 3382-3 along a line of receivers.
    OpenPlan(OpenPlan),
    /// Describe a map or a response: provenance, counts, ledger, hits and deposits.
    Inspect(Inspect),
    /// Verify a map: checksums, structure, ledger recomputed from the paths.
    Verify(Verify),
    /// Join shards of a run to its map, or parts of a rendering to its response.
    Merge(Merge),
    /// Export the sonels of a map or the echograms of a response as tables.
    Export(Export),
    /// Render incident energy on surfaces from a camera, as OpenEXR and as PNG in decibels.
    Image(Image),
    /// Compare two maps or two responses beyond noise; exit code 1 if they differ.
    Diff(Diff),
    /// Rank surfaces: derivatives of parameters by absorption and scattering of every material.
    Sensitivity(SensitivityArguments),
    /// Plot echogram, decay, early reflections, parameters and plans of receivers, as SVG or PNG.
    Plot(Plot),
    /// Write one HTML file that opens offline: room, echograms, parameters, effects, provenance.
    Report(Report),
    /// Write impulse responses of responses, or a recording heard through them, as WAV files.
    Auralise(Auralise),
    /// Interaural cross-correlation (IACC) of binaural impulse responses: early, late and all, per octave.
    Iacc(IaccArguments),
    /// Measure error against CPU time of a scene for several settings.
    Tradeoff(Tradeoff),
}

/// `report`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-analyze report hall.npz hall.sonelmap -o hall.html
  sonel-analyze report before.npz after.npz before.sonelmap -o renovation.html
  sonel-analyze report class.npz class-tiles.npz class.sonelmap -o class.html \\
    --project 'School, room 12' --date 2026-11-27 --target din18041-a3

The file needs no network. With the map it also shows room, effects and energy ledger.")]
pub struct Report {
    /// Responses, and optionally their maps.
    ///
    /// Responses are written by sonel-render. A map alone is rendered at the receivers of its scene.
    #[arg(value_name = "RESPONSE.npz|MAP.sonelmap", required = true)]
    pub files: Vec<PathBuf>,
    /// Page to write.
    ///
    /// An existing page is replaced when the new one is complete.
    #[arg(short, long, value_name = "REPORT.html")]
    pub output: PathBuf,
    /// Speech, noise, and sources as one system.
    #[command(flatten)]
    pub heard: HeardArguments,
    /// What stands above the page, and targets.
    #[command(flatten)]
    pub head: HeadArguments,
}

/// `auralise`.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("wav", |wav| wav.required(true).short('o').long("output").alias("wav")), after_long_help = "Example:
  sonel-render hall.sonelmap -o hall.npz --directions
  sonel-analyze auralise hall.npz -o impulses --ambix 3
  sonel-analyze auralise before.npz after.npz --recording speech.wav -o heard

With the seed of the rendering impulse responses are those of sonel-render --wav, byte for byte.")]
pub struct Auralise {
    /// Responses; with --recording also impulse responses.
    #[arg(value_name = "RESPONSE.npz|IR.wav", required = true)]
    pub files: Vec<PathBuf>,
    /// Recording to hear instead of impulse responses.
    ///
    /// A dry one of one channel; other sample rates are converted. All files have the same gain, and a table states their levels re the
    /// recording at 1 m from the source in a free field.
    #[arg(long, value_name = "DRY.wav")]
    pub recording: Option<PathBuf>,
    /// Gain of all files [dB] [default: to full scale].
    ///
    /// -200 … 200 dB. By default the loudest file has its peak within 1 dB below full scale; 0 keeps the level of the recording.
    #[arg(long, value_name = "dB", requires = "recording", allow_negative_numbers = true, value_parser = clap::value_parser!(i16).range(-200..=200))]
    pub gain: Option<i16>,
    /// Where files are written, and how.
    #[command(flatten)]
    pub sound: SoundArguments,
    /// Seed of late sound [default: of the rendering].
    #[arg(long, allow_negative_numbers = true)]
    pub seed: Option<u64>,
}

impl Auralise {
    /// Where files are written.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.sound.wav.as_deref().expect("the folder is required")
    }
}

/// `iacc`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-render hall.sonelmap -o hall.npz --wav impulses --hrtf head.sofa
  sonel-analyze iacc impulses/*_binaural.wav --json

IACC is 1 for equal sound at both ears and small for a diffuse field. It differs between realisations of late \
sound (--seed of sonel-render).")]
pub struct IaccArguments {
    /// Binaural impulse responses.
    ///
    /// WAV files of two channels, left and right.
    #[arg(value_name = "IR_binaural.wav", required = true)]
    pub recordings: Vec<PathBuf>,
    /// Table or JSON.
    #[command(flatten)]
    pub printed: Printed,
}

/// `tradeoff`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-analyze tradeoff scenes/shoebox/scene.toml -o shoebox-tradeoff
  sonel-analyze tradeoff scenes/hall/scene.toml -o survival \\
    --survival 0.15,0,0.05,0.4,1 --repeats 12
  sonel-analyze tradeoff scenes/hall/scene.toml -o rays \\
    --estimator gather --rays 16k,4k,64k

Properties are varied one at a time about the base setting, which has the first value of each list. The folder then \
has README.md with a recommendation, plots and tradeoff.json.")]
pub struct Tradeoff {
    /// Scene file.
    ///
    /// Errors are evaluated at its receivers.
    #[arg(value_name = "SCENE.toml")]
    pub scene: PathBuf,
    /// Folder of the results.
    ///
    /// Created if it does not exist; each file is replaced when the new one is complete.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Packets per source to try [default: 1k,4k,16k,64k].
    #[arg(long, alias = "sonels", value_delimiter = ',', value_name = "N,…", value_parser = parse_count, allow_negative_numbers = true)]
    pub packets: Vec<u64>,
    /// Roulette exponents β to try, 0 … 1.
    #[arg(long, value_delimiter = ',', value_name = "BETA,…", allow_hyphen_values = true)]
    pub survival: Vec<f64>,
    /// Methods to try.
    #[arg(long, value_parser = mode(), value_delimiter = ',', value_name = "MODE,…")]
    pub mode: Vec<Mode>,
    /// Estimators to try [default: all].
    ///
    /// The default is all unless several values of another option are given.
    #[arg(long, value_parser = estimator(), value_delimiter = ',', value_name = "ESTIMATOR,…")]
    pub estimator: Vec<Estimator>,
    /// Numbers of visibility rays to try.
    #[arg(long, value_delimiter = ',', value_name = "M,…", value_parser = parse_rays, allow_negative_numbers = true)]
    pub rays: Vec<u32>,
    /// Radii of gathering discs to try [m].
    #[arg(long, value_delimiter = ',', value_name = "METRES,…", allow_hyphen_values = true)]
    pub radius: Vec<f64>,
    /// Runs of every setting.
    ///
    /// Each with its own seed.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..))]
    pub repeats: u32,
    /// Seed of the first run.
    ///
    /// Later runs use the following numbers.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Packets of the reference run [default: four times the largest number].
    ///
    /// A reference is run where no exact answer is known.
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub reference: Option<u64>,
    /// Length of echograms [s] [default: of the scene].
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    pub duration: Option<f64>,
    /// Simulated effects [default: auto].
    ///
    /// As of sonel-trace: auto, all or none, then changes such as auto,-air.
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true)]
    pub effects: Option<Effects>,
}

/// `sensitivity`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-analyze sensitivity hall.sonelmap
  sonel-analyze sensitivity hall.sonelmap --receiver 'stalls=0,14,1.5' \\
    --format csv > sensitivity.csv")]
pub struct SensitivityArguments {
    /// The map.
    #[arg(value_name = "MAP.sonelmap")]
    pub map: PathBuf,
    /// Receiver; repeatable [default: those of the scene].
    ///
    /// A position in scene axes [m], with directivity and aim: NAME=x,y,z,cardioid,x,y,z.
    #[arg(long = "receiver", value_name = "NAME=x,y,z", value_parser = parse_receiver, allow_hyphen_values = true)]
    pub receivers: Vec<ReceiverPoint>,
    /// Output format.
    #[arg(long, value_enum, default_value_t = Format::Table)]
    pub format: Format,
}

/// `diff`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-analyze diff before.sonelmap after.sonelmap
  sonel-analyze diff before.npz after.npz || echo different
  sonel-analyze diff hall.npz --between 'stalls front' 'balcony rear'

Maps are compared by surfaces, bands and times, responses by parameters. Both compare beyond noise: two seeds of one scene differ in 1 % of comparisons.")]
pub struct Diff {
    /// A map or a response.
    #[arg(value_name = "A")]
    pub a: PathBuf,
    /// A second file of the same kind.
    ///
    /// With --between by default A. Sources and receivers are compared by name.
    #[arg(value_name = "B", required_unless_present = "between")]
    pub b: Option<PathBuf>,
    /// Compare two receivers, by name.
    ///
    /// A receiver of A with another of B.
    #[arg(long, num_args = 2, value_names = ["RECEIVER", "RECEIVER"])]
    pub between: Vec<String>,
    /// List all differences beyond noise.
    #[arg(long, conflicts_with = "json")]
    pub list: bool,
    /// Table or JSON.
    #[command(flatten)]
    pub printed: Printed,
}

impl Diff {
    /// What A is compared with.
    #[must_use]
    pub fn other(&self) -> &Path {
        self.b.as_ref().unwrap_or(&self.a)
    }
}

/// `merge`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-trace scenes/hall/scene.toml -o 1.sonelmap --packets 1M --shard 1/2
  sonel-trace scenes/hall/scene.toml -o 2.sonelmap --packets 1M --shard 2/2
  sonel-analyze merge 1.sonelmap 2.sonelmap -o hall.sonelmap
  sonel-render hall.sonelmap -o 1.npz --shard 1/2
  sonel-render hall.sonelmap -o 2.npz --shard 2/2
  sonel-analyze merge 1.npz 2.npz -o hall.npz

The result is what sonel-trace or sonel-render writes in one piece, byte for byte. Neighbouring shards of a map such \
as 1/4 and 2/4 make the larger shard 1/2.")]
pub struct Merge {
    /// Shards of a map or response, in any order.
    #[arg(value_name = "SHARD", required = true)]
    pub shards: Vec<PathBuf>,
    /// Map or response to write.
    ///
    /// An existing file is replaced when the new one is complete.
    #[arg(short, long, value_name = "WHOLE")]
    pub output: PathBuf,
}

/// `export`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-analyze export room.sonelmap -o sonels.npz
  python -c 'import numpy; f = numpy.load(\"sonels.npz\"); print(f[\"position_m\"])'
  sonel-analyze export room.npz -o echograms.csv

Columns: docs/formats/sonels.md and docs/formats/response.md. An archive takes 75 bytes per sonel and 8 more per \
band, CSV about twice that. The table of a response has a row for every source, receiver, band and time bin.")]
pub struct Export {
    /// A map written by sonel-trace, or a response written by sonel-render.
    #[arg(value_name = "MAP.sonelmap|RESPONSE.npz")]
    pub file: PathBuf,
    /// Table to write.
    ///
    /// Sonels as .csv or .npz, echograms as .csv. An existing file is replaced when the new one is complete.
    #[arg(short, long, value_name = "TABLE.csv|SONELS.npz")]
    pub output: PathBuf,
}

/// `image`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-analyze image hall.sonelmap -o energy.exr --eye 0,25,6 --look 0,5,5 \\
    --fov 80 --windows 0-20ms,20-50ms,50-100ms

writes energy.exr, with a layer per window and a channel per band, and energy.png, with a scale of colours. Values \
are incident energy per area and unit emitted energy in 1/m\u{b2}, direct sound included. A camera outside a closed \
room sees into it.")]
pub struct Image {
    /// The map.
    #[arg(value_name = "MAP.sonelmap")]
    pub map: PathBuf,
    /// OpenEXR file to write.
    ///
    /// A PNG is written beside it. Existing files are replaced when the new ones are complete.
    #[arg(short, long, value_name = "ENERGY.exr")]
    pub output: PathBuf,
    /// Position of the camera [m].
    #[arg(long, value_name = "x,y,z", value_parser = parse_position, allow_hyphen_values = true)]
    pub eye: DVec3,
    /// Point in the middle of the picture [m].
    #[arg(long, value_name = "x,y,z", value_parser = parse_position, allow_hyphen_values = true)]
    pub look: DVec3,
    /// Horizontal angle of view [°].
    ///
    /// Between the left and right borders, above 0 and below 180 degrees.
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    pub fov: f64,
    /// Pixels across and down.
    #[arg(long, value_name = "WxH", default_value = "960x540", value_parser = parse_size, allow_hyphen_values = true)]
    pub size: [u32; 2],
    /// Time windows, such as 0-20ms [default: the whole run].
    ///
    /// From emission, each with a unit: 0-20ms,0.05-0.1s.
    #[arg(long, value_name = "FROM-TO,…", value_delimiter = ',', value_parser = parse_window, allow_hyphen_values = true)]
    pub windows: Vec<NamedWindow>,
    /// Band of the PNG.
    ///
    /// Its nominal centre [Hz], or sum: all bands, weighted by the power of the source.
    #[arg(long, value_name = "HZ|sum", default_value = "sum")]
    pub band: String,
    /// Levels of the colours [dB re 1/m²] [default: highest 40 dB].
    ///
    /// Of the first and the last colour of the PNG.
    #[arg(long, value_name = "LOW:HIGH", value_parser = parse_range, allow_hyphen_values = true)]
    pub range: Option<[f64; 2]>,
    /// Source [default: the first].
    #[arg(long, value_name = "NAME")]
    pub source: Option<String>,
    /// Radius of the gathering discs [m] [default: from room and packets].
    #[arg(long, value_name = "METRES", allow_hyphen_values = true)]
    pub radius: Option<f64>,
}

/// A window of time and how it was written.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedWindow {
    /// Window as written, without blanks.
    pub name: String,
    /// From … to [s].
    pub window: [f64; 2],
}

fn parse_position(text: &str) -> anyhow::Result<DVec3> {
    let position = numbers(text, ',').map(DVec3::from_array);
    position.with_context(|| format!("\"{text}\" is not a position: write x,y,z in metres, such as 2,10,3"))
}

fn parse_size(text: &str) -> anyhow::Result<[u32; 2]> {
    let size = text
        .split_once('x')
        .and_then(|(width, height)| Some([width.trim().parse().ok()?, height.trim().parse().ok()?]));
    size.with_context(|| format!("\"{text}\" is not a size: write WIDTHxHEIGHT in pixels, such as 960x540"))
}

fn parse_window(text: &str) -> anyhow::Result<NamedWindow> {
    let name: String = text.split_whitespace().collect();
    let (times, unit) = match name.strip_suffix("ms") {
        Some(times) => (times, 1e-3),
        None => (name.strip_suffix('s').unwrap_or(""), 1.0),
    };
    let window = numbers(times, '-').map(|times| times.map(|time| time * unit));
    window.map(|window| NamedWindow { name, window }).with_context(|| {
        format!("\"{text}\" is not a time window: write FROM-TO with a unit, such as 20-50ms or 0.05-0.1s")
    })
}

fn parse_range(text: &str) -> anyhow::Result<[f64; 2]> {
    numbers(text, ':').filter(|[low, high]| low < high).with_context(|| {
        format!(
            "\"{text}\" is not a range: write LOW:HIGH in dB re 1/m\u{b2}, the lower first, such as -60:-20"
        )
    })
}

/// `inspect`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-analyze inspect room.sonelmap --json | jq .ledger")]
pub struct Inspect {
    /// A map or a response.
    #[arg(value_name = "MAP.sonelmap|RESPONSE.npz")]
    pub file: PathBuf,
    /// Table or JSON.
    #[command(flatten)]
    pub printed: Printed,
}

/// `verify`.
#[derive(Debug, Clone, Args)]
#[command(after_long_help = "Example:
  sonel-analyze verify room.sonelmap && echo valid")]
pub struct Verify {
    /// A map written by sonel-trace.
    #[arg(value_name = "MAP.sonelmap")]
    pub map: PathBuf,
}

/// `--json` of commands that print tables for people.
#[derive(Debug, Clone, Copy, Args)]
pub struct Printed {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Printed {
    /// Prints what is wanted.
    ///
    /// # Errors
    /// When `out` cannot be written.
    pub fn print(
        self,
        out: &mut dyn Write,
        json: impl FnOnce() -> Value,
        text: impl FnOnce() -> String,
    ) -> std::io::Result<()> {
        if self.json { writeln!(out, "{:#}", json()) } else { write!(out, "{}", text()) }
    }
}

/// `--format`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Aligned columns for people.
    Table,
    /// Rows of comma-separated values.
    Csv,
    /// One JSON object.
    Json,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_keep_their_names_and_are_in_seconds() {
        let window = parse_window(" 20 - 50 ms").unwrap();
        assert_eq!(window.name, "20-50ms");
        assert!((window.window[0] - 0.02).abs() < 1e-15 && (window.window[1] - 0.05).abs() < 1e-15);
        assert!((parse_window("0.05-0.1s").unwrap().window[1] - 0.1).abs() < 1e-15);
        for text in ["20-50", "20ms", "-20ms", "a-bms", "0-infs", "1-2-3ms", ""] {
            assert!(parse_window(text).unwrap_err().to_string().contains("20-50ms"), "{text}");
        }
    }

    #[test]
    fn positions_sizes_and_ranges_are_read_whole_or_not_at_all() {
        assert_eq!(parse_position("1, -2.5,3").unwrap(), DVec3::new(1.0, -2.5, 3.0));
        for text in ["1,2", "1,2,3,4", "1,2,x", "1,2,3,x", "1,2,inf", ""] {
            assert!(parse_position(text).is_err(), "{text}");
        }
        assert_eq!(parse_size("960x540").unwrap(), [960, 540]);
        for text in ["960", "960x", "-1x5", "9.5x4"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
        assert!(parse_range("-60:-20").is_ok());
        for text in ["-20:-60", "-20", "nan:0", "-inf:0"] {
            assert!(parse_range(text).is_err(), "{text}");
        }
    }
}
