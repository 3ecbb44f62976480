//! `fit` and `optimise`: commands that look for coefficients of materials.

use std::path::PathBuf;

use clap::Args;
use sonel::analysis::Parameter;
use sonel::rendering::ReceiverPoint;
use sonel_console::count::{numbers, parse_rays};
use sonel_console::receiver::parse_receiver;
use sonel_design::goal::Goal;

use super::Format;

/// `fit`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:
  sonel-analyze fit hall.sonelmap --measured measured.csv -o fitted.toml
  sonel-render hall.sonelmap -o fitted.npz --materials fitted.toml

The table has the columns receiver, center_frequency_hz, parameter and value, such as \"stalls rear\",500,t20_s,1.83, \
and may have source, ci95_low, ci95_high and receiver_x_m, receiver_y_m, receiver_z_m. What parameters --format csv \
prints is such a table.")]
pub struct FitArguments {
    /// The map; the fit starts from its materials.
    #[arg(value_name = "MAP.sonelmap")]
    pub map: PathBuf,
    /// Measured parameters, one per row.
    #[arg(long, value_name = "TABLE.csv")]
    pub measured: PathBuf,
    /// Materials file to write; an existing one is replaced when the new one is complete.
    #[arg(short, long, value_name = "MATERIALS.toml")]
    pub output: PathBuf,
    /// Also fit scattering.
    #[arg(long)]
    pub scattering: bool,
    /// Parameters to fit: level, g, edt, t20, t30, c50, c80, d50, ts.
    #[arg(long = "use", value_name = "PARAMETERS", value_delimiter = ',', default_value = "edt,t20,c80,level", value_parser = parse_parameter)]
    pub parameters: Vec<Parameter>,
    /// Standard deviation of measured values without an interval, in just-noticeable differences.
    #[arg(long, value_name = "JND", default_value = "0.5", value_parser = parse_positive, allow_hyphen_values = true)]
    pub error: f64,
    /// Uncertainty of the map's coefficients c: standard deviation of ln(c/(1−c)); 0.5 is ± 65 % of small ones and ± 0.12
    /// in the middle.
    #[arg(long, value_name = "W", default_value = "0.5", value_parser = parse_positive, allow_hyphen_values = true)]
    pub prior_sigma: f64,
    /// Visibility rays per receiver [default: a quarter as many as the map has packets per source].
    #[arg(long, value_name = "M", value_parser = parse_rays, allow_negative_numbers = true)]
    pub rays: Option<u32>,
    /// Output format: table, csv or json.
    #[arg(long, value_enum, default_value_t = Format::Table)]
    pub format: Format,
}

fn parse_parameter(text: &str) -> Result<Parameter, String> {
    sonel::study::target::parameter(text).map_err(|error| error.to_string())
}

fn parse_positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| format!("\"{text}\" is not a number above 0"))
}

/// `optimise`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:
  sonel-analyze optimise hall.sonelmap -o changed.toml \\
    --goal \"t30=1.8s±5%@500,1000\" --change panelling=0.05:0.6
  sonel-analyze optimise hall.sonelmap -o changed.toml \\
    --goal \"t30=1.8s±5%@500,1000\" --goal \"c80=0dB±1dB@1000\" \\
    --change ceiling=carpet-heavy-on-felt,audience-2 \\
    --change panelling=0.05:0.6 --price panelling=2.5

The cost of a change is its area times its price. Goals are for the mean over sources and receivers. sonel-trace \
materials searches the library.")]
pub struct OptimiseArguments {
    /// The map.
    #[arg(value_name = "MAP.sonelmap")]
    pub map: PathBuf,
    /// Wanted mean of a parameter (level, g, edt, t20, t30, c50, c80, d50 or ts) over sources and receivers, such as
    /// t30=1.8s±5%@500,1000 or d50=70%±5%: units as in the targets of --until, +- for ±, tolerance also in jnd, all bands without @;
    /// repeatable.
    #[arg(
        long = "goal",
        value_name = "PARAMETER=VALUE±TOLERANCE@HZ,…",
        required = true,
        allow_hyphen_values = true
    )]
    pub goals: Vec<Goal>,
    /// Allowed change of a material: to entries of the library, or absorption within bounds in the bands of the goals;
    /// repeatable.
    #[arg(long = "change", value_name = "MATERIAL=ENTRY,…|LOW:HIGH", required = true, value_parser = parse_change, allow_hyphen_values = true)]
    pub changes: Vec<Change>,
    /// Price per m² of a change [default: 1]; repeatable.
    #[arg(long = "price", value_name = "MATERIAL=PRICE", value_parser = parse_price, allow_hyphen_values = true)]
    pub prices: Vec<(String, f64)>,
    /// Receiver position in scene axes [m]; repeatable [default: of the scene].
    #[arg(long = "receiver", value_name = "NAME=x,y,z", value_parser = parse_receiver, allow_hyphen_values = true)]
    pub receivers: Vec<ReceiverPoint>,
    /// Materials file to write; an existing one is replaced when the new one is complete.
    #[arg(short, long, value_name = "MATERIALS.toml")]
    pub output: PathBuf,
}

/// One `--change`.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// The material.
    pub name: String,
    /// What may become of it.
    pub to: To,
}

/// What may become of a material.
#[derive(Debug, Clone, PartialEq)]
pub enum To {
    /// One of these entries of the library.
    Entries(Vec<String>),
    /// Absorption from … to.
    Absorption([f64; 2]),
}

fn parse_change(text: &str) -> Result<Change, String> {
    let wrong = || {
        format!(
            "\"{text}\" is not a change: write MATERIAL=LOW:HIGH such as panelling=0.05:0.6, or MATERIAL=ENTRY,ENTRY of the library"
        )
    };
    let (name, to) = text.rsplit_once('=').ok_or_else(wrong)?;
    let name = name.trim().to_owned();
    if !to.contains(':') {
        let entries: Vec<String> = to.split(',').map(|entry| entry.trim().to_owned()).collect();
        return if entries.iter().any(String::is_empty) {
            Err(wrong())
        } else {
            Ok(Change { name, to: To::Entries(entries) })
        };
    }
    let is_within = |[low, high]: &[f64; 2]| 0.0 <= *low && low < high && *high <= 1.0;
    let bounds = numbers(to, ':').filter(is_within).ok_or_else(|| {
        format!("\"{to}\" are not bounds of absorption: write LOW:HIGH within 0 … 1, the lower first")
    })?;
    Ok(Change { name, to: To::Absorption(bounds) })
}

fn parse_price(text: &str) -> Result<(String, f64), String> {
    let (name, price) =
        text.rsplit_once('=').ok_or_else(|| format!("\"{text}\" is not a price: write MATERIAL=PRICE"))?;
    Ok((name.trim().to_owned(), parse_positive(price.trim())?))
}
