//! The command line of `sonel-render`.

use std::path::PathBuf;

use anyhow::{Context, ensure};
use clap::Parser;
use sonel::study::target;
use sonel::{
    Air, Audience, Change, Estimator, Grid, ReceiverPoint, RenderEffects, RenderOptions, ShardRange, Targets,
    parse_count, parse_time,
};
use sonel_console::choices::estimator;
use sonel_console::count::parse_rays;
use sonel_console::receiver::parse_receiver;
use sonel_console::shard::parse_shard;
use sonel_console::{Common, usable_memory};

use crate::sound::SoundArguments;

/// Renders echograms at any receivers from a sonel map.
#[derive(Debug, Clone, Parser)]
#[command(
    mut_arg("wav", |wav| wav.requires("output")),
    version = sonel::RENDERER_VERSION.as_str(),
    after_long_help = "Examples:\n  sonel-render room.sonelmap -o room.npz \\\n    --receiver \"seat 12=60,9,60\" --grid 10:60:6,1.2,10:60:6\n  \
                  sonel-render hall.sonelmap --plan\n  \
                  sonel-render hall.sonelmap -o hall.npz \\\n    --until \"t30<1%,level<0.1dB,c80<0.2dB\" --at-most 60s\n  \
                  sonel-render hall.sonelmap -o hall.npz --wav hall-impulses --hrtf head.sofa"
)]
pub struct Arguments {
    /// The map; it carries its scene.
    #[arg(value_name = "MAP.sonelmap")]
    pub map: PathBuf,
    /// Response to write.
    ///
    /// An existing response is replaced when the new one is complete. Optional with --plan.
    #[arg(short, long, value_name = "RESPONSE.npz", required_unless_present = "plan")]
    pub output: Option<PathBuf>,
    /// Impulse responses.
    #[command(flatten)]
    pub sound: SoundArguments,
    /// Path of a walking listener.
    ///
    /// Writes what the listener hears of --recording as SOURCE_walk.wav in the folder of --wav, instead of impulse responses. A
    /// CSV file with the header time,x,y,z [s, m]; between its points the path is straight. Not with other receivers.
    #[arg(long, value_name = "FILE.csv", requires_all = ["wav", "recording"], conflicts_with_all = ["receivers", "receivers_file", "grid", "audience", "shard"])]
    pub path: Option<PathBuf>,
    /// Recording that the sources play along --path.
    ///
    /// One channel, converted to the rate of --wav. Every source plays it from the first time of the path on.
    #[arg(long, value_name = "FILE.wav", requires = "path")]
    pub recording: Option<PathBuf>,
    /// Longest step along --path [m].
    ///
    /// Distance between the places that are rendered. Delays are exact at any distance.
    #[arg(long, value_name = "METRES", requires = "path", default_value_t = 0.25, value_parser = parse_spacing, allow_negative_numbers = true)]
    pub path_spacing: f64,
    /// Receiver; repeatable [default: those of the scene].
    ///
    /// A position in scene axes [m], with directivity and aim: NAME=x,y,z,cardioid,x,y,z.
    #[arg(long = "receiver", value_name = "NAME=x,y,z", value_parser = parse_receiver, allow_hyphen_values = true)]
    pub receivers: Vec<ReceiverPoint>,
    /// File of receivers.
    ///
    /// A CSV file with the header name,x,y,z, or a TOML file of [[receivers]] (also directivity and aim).
    #[arg(long = "receivers", value_name = "FILE")]
    pub receivers_file: Option<PathBuf>,
    /// Grid of receivers [m].
    ///
    /// Each axis is lo:hi:n or one number. Points on surfaces, in solids or outside the room are left out.
    #[arg(long, value_name = "X,Y,Z", value_parser = str::parse::<Grid>, allow_hyphen_values = true)]
    pub grid: Option<Grid>,
    /// Receivers above all faces of a material; repeatable.
    ///
    /// They are numbered "MATERIAL 1" … Sloped faces have receivers too. Points as in --grid, and those below another face, are
    /// left out.
    #[arg(long, value_name = "MATERIAL")]
    pub audience: Vec<String>,
    /// Spacing of --audience [m].
    #[arg(
        long,
        value_name = "METRES",
        requires = "audience",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
    pub spacing: f64,
    /// Height of --audience above the face [m].
    #[arg(
        long,
        value_name = "METRES",
        requires = "audience",
        default_value_t = 1.2,
        allow_negative_numbers = true
    )]
    pub height: f64,
    /// Render part I of N of the receivers [default: all].
    ///
    /// I counts from 1; sonel-analyze merge joins the parts. Not with --plan, --until or --wav.
    #[arg(long, value_name = "I/N", value_parser = parse_shard, conflicts_with_all = ["plan", "until", "wav"])]
    pub shard: Option<ShardRange>,
    /// Width of a time bin [s].
    ///
    /// At most 2²⁰ bins.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.001, allow_negative_numbers = true)]
    pub bin: f64,
    /// Store energies by direction of incidence.
    ///
    /// For LF, LFC and L_J. Receivers must be omnidirectional. The lateral axis is horizontal, at right angles to the aim, by
    /// default towards the first source.
    #[arg(long)]
    pub directions: bool,
    /// Estimator for each path class.
    ///
    /// auto, connection, gather, sphere or paper. paper needs even air and excludes --order. Maps with a gradient take auto,
    /// connection or sphere, without --order.
    #[arg(long, value_parser = estimator(), default_value = Estimator::Auto.name())]
    pub estimator: Estimator,
    /// Effects: auto, or without some: -diffraction, -boundary.
    ///
    /// -diffraction leaves out sound over edges, -boundary leaves low frequencies as rays have them. sonel-trace decides about other effects.
    #[arg(long, value_name = "SPEC", default_value = "auto", allow_hyphen_values = true)]
    pub effects: RenderEffects,
    /// Highest order of image sources [default: from the room].
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    pub order: Option<u32>,
    /// Radius of the gathering discs [m] [default: from room and packets].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    pub radius: Option<f64>,
    /// Visibility rays per receiver [default: a quarter of the packets].
    ///
    /// With --until the maximum. With --estimator paper the default is 16384.
    #[arg(long, value_name = "M", value_parser = parse_rays, allow_negative_numbers = true)]
    pub rays: Option<u32>,
    /// Render the first K batches alone [default: all].
    ///
    /// Takes a share of the time, and intervals are wider. Not with --plan or --until.
    #[arg(long, value_name = "K", allow_negative_numbers = true, conflicts_with_all = ["plan", "until"])]
    pub batches: Option<u32>,
    /// Seed of the rendering [default: of the map].
    #[arg(long, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Air temperature for attenuation [°C] [default: of the map].
    ///
    /// Travel times stay. Maps with regions of other air take --no-air alone.
    #[arg(long, value_name = "CELSIUS", allow_hyphen_values = true)]
    pub temperature: Option<f64>,
    /// Relative humidity for attenuation [%] [default: of the map].
    #[arg(long, value_name = "PERCENT", allow_negative_numbers = true)]
    pub humidity: Option<f64>,
    /// No attenuation by air.
    #[arg(long, conflicts_with_all = ["temperature", "humidity"])]
    pub no_air: bool,
    /// Change a coefficient or directivity; repeatable.
    ///
    /// materials.NAME.absorption=0.4, also scattering, diffuse, transmission, sound_reduction_db: one number, or one per band
    /// with commas between. materials.NAME.library=ENTRY. sources.NAME.directivity=WORD, or a file (.csv, .sofa). What the
    /// stored paths do not support is refused, with the sonel-trace command that makes it possible.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = str::parse::<Change>)]
    pub set: Vec<Change>,
    /// Also render this variant; repeatable.
    ///
    /// A variant [variants.NAME] of the scene file, or all. It is written to RESPONSE-NAME.npz, beside the response with the
    /// materials of the scene. --materials and --set apply to each.
    #[arg(long = "variant", value_name = "NAME", requires = "output", conflicts_with_all = ["plan", "until", "json"])]
    pub variants: Vec<String>,
    /// Change materials by a file.
    ///
    /// A TOML file of [materials.NAME] as in a scene file, applied before --set; other materials stay.
    #[arg(long, value_name = "FILE.toml")]
    pub materials: Option<PathBuf>,
    /// Predict rays, cost and intervals.
    ///
    /// Prints them for several accuracies at up to sixteen receivers, and the packets required where more rays do not help.
    /// With --output, also renders and compares.
    #[arg(long)]
    pub plan: bool,
    /// Target half-widths, such as t30<1%,level<0.1dB.
    #[arg(long, value_name = "TARGETS", requires = "output", long_help = format!(
        "Target half-widths, such as t30<1%,level<0.1dB,c80<0.2jnd\n\n\
         Takes more batches of the map, a quarter at first, then more rays until the half-width of every 95 % interval meets its target at \
         every receiver; else exit code 1, and the log states the rays or packets required. The response is that of --batches and --rays with \
         the final numbers. Parameters: {}; units: %, s, ms, dB, jnd.",
        target::names()
    ))]
    pub until: Option<Targets>,
    /// Time limit, such as 5min or 2h.
    ///
    /// A run that is predicted to take longer on all cores is refused before it starts, a walk as soon as its pace is known; --until ends with what it has.
    #[arg(long, value_name = "TIME", value_parser = parse_time, default_value = "10min")]
    pub at_most: f64,
    /// Memory limit [bytes], such as 8G [default: three quarters of the machine's].
    ///
    /// A rendering that is predicted to take more memory of its own is refused before it starts.
    #[arg(long, value_name = "BYTES", value_parser = parse_count, allow_negative_numbers = true)]
    pub memory: Option<u64>,
    /// Print the parameters.
    ///
    /// The table of sonel-analyze parameters; with --json the same under the key `parameters`.
    #[arg(long, requires = "output")]
    pub parameters: bool,
    /// Print the rendering as JSON.
    ///
    /// Shares per path class, estimators, points left out of the grid, timings.
    #[arg(long)]
    pub json: bool,
    /// Options of every program.
    #[command(flatten)]
    pub common: Common,
}

/// Reads a distance between places.
fn parse_spacing(text: &str) -> anyhow::Result<f64> {
    let spacing: f64 = text.parse().ok().with_context(|| format!("\"{text}\" is not a number of metres"))?;
    let allowed = sonel::SPACINGS;
    let within = allowed.contains(&spacing);
    ensure!(within, "{spacing} m is not between {} and {} m", allowed.start(), allowed.end());
    Ok(spacing)
}

impl Arguments {
    /// The options of the rendering.
    pub(crate) fn options(&self) -> RenderOptions {
        let (temperature, humidity) = (self.temperature, self.humidity);
        RenderOptions {
            bin: self.bin,
            estimator: self.estimator,
            effects: self.effects,
            order: self.order,
            batches: self.batches,
            radius: self.radius,
            rays: self.rays,
            seed: self.seed,
            air: if self.no_air { Air::None } else { Air::State { temperature, humidity } },
            directions: self.directions || self.sound.needs_directions(),
            variant: None,
            materials: self.materials.clone(),
            set: self.set.clone(),
            grid: self.grid.clone(),
            audience: (!self.audience.is_empty()).then(|| Audience {
                materials: self.audience.clone(),
                spacing: self.spacing,
                height: self.height,
            }),
            shard: self.shard,
            until: self.until.clone(),
            at_most: Some(self.at_most),
            memory: self.memory.map(|bytes| bytes as f64).or_else(usable_memory),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn receivers_are_read() {
        let cardioid = parse_receiver("mic=1,2,3,cardioid,0,0,-2").unwrap();
        assert_eq!((cardioid.sensitivity.pattern.name(), cardioid.sensitivity.aim.z), ("cardioid", -1.0));
        assert!(
            parse_receiver("mic=1,2,3,cardiod,0,0,-2")
                .unwrap_err()
                .to_string()
                .contains("unknown directivity")
        );
        assert!(parse_receiver("mic=1,2,3,cardioid,0,0,0").unwrap_err().to_string().contains("no length"));
        assert!(parse_receiver("mic=1,2,3,cardioid").is_err());
        let receiver = parse_receiver("a = b=1, -2,3.5").unwrap();
        assert_eq!((receiver.name.as_str(), receiver.position), ("a = b", DVec3::new(1.0, -2.0, 3.5)));
    }

    #[test]
    fn wrong_ones_say_what_is_right() {
        for text in ["1,2,3", "a=1,2", "a=1,2,x", "=1,2,3"] {
            assert!(parse_receiver(text).unwrap_err().to_string().contains("NAME=x,y,z"), "{text}");
        }
    }
}
