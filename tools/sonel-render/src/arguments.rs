//! The command line of `sonel-render`.

use std::path::PathBuf;

use clap::Parser;
use glam::DVec3;
use sonel_console::choices::EstimatorArgument;
use sonel_console::time::parse_time;
use sonel_renderer::ReceiverPoint;
use sonel_study::target::Targets;

/// Renders echograms at any receivers from a sonel map.
#[derive(Debug, Clone, Parser)]
#[command(
    version,
    after_help = "Examples:\n  sonel-render room.sonelmap -o room.npz --receiver \"seat 12=60,9,60\" --grid 10:60:6,1.2,10:60:6\n  \
                  sonel-render hall.sonelmap --plan\n  \
                  sonel-render hall.sonelmap -o hall.npz --until \"t30<1%,level<0.1dB,c80<0.2dB\" --at-most 60s"
)]
pub struct Arguments {
    /// The map; it carries its scene.
    #[arg(value_name = "MAP.sonelmap")]
    pub map: PathBuf,
    /// Where the response goes; replaced only when the new one is complete.
    #[arg(short, long, value_name = "RESPONSE.npz", required_unless_present = "plan")]
    pub output: Option<PathBuf>,
    /// A receiver in the scene's axes [m]; may be repeated. Without any, those of the scene.
    #[arg(long = "receiver", value_name = "NAME=x,y,z", value_parser = parse_receiver, allow_hyphen_values = true)]
    pub receivers: Vec<ReceiverPoint>,
    /// Receivers from a CSV file (header name,x,y,z) or a TOML file of [[receivers]].
    #[arg(long = "receivers", value_name = "FILE")]
    pub receivers_file: Option<PathBuf>,
    /// A grid of receivers: each axis lo:hi:n or one number [m].
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_grid, allow_hyphen_values = true)]
    pub grid: Option<Grid>,
    /// Width of a time bin [s].
    #[arg(long, value_name = "SECONDS", default_value_t = 0.001)]
    pub bin: f64,
    /// Who owns which path class.
    #[arg(long, value_enum, default_value_t = EstimatorArgument::Auto)]
    pub estimator: EstimatorArgument,
    /// Order of the mirror chains from the source; chosen where none is given.
    #[arg(long, value_name = "K")]
    pub order: Option<u32>,
    /// Radius of the discs in which rays gather [m]; by default it follows from the room and the number of sonels.
    #[arg(long, value_name = "METRES")]
    pub radius: Option<f64>,
    /// Visibility rays of one receiver, where rays gather; 16384 where nothing is given. With --until the most there may be.
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..))]
    pub rays: Option<u32>,
    /// Seed of the renderer's own choices; the map's where none is given.
    #[arg(long)]
    pub seed: Option<u64>,
    /// Another temperature of the air's attenuation [°C]; travel times stay those of the map.
    #[arg(long, value_name = "CELSIUS", allow_hyphen_values = true)]
    pub temperature: Option<f64>,
    /// Another relative humidity of the air's attenuation [%].
    #[arg(long, value_name = "PERCENT")]
    pub humidity: Option<f64>,
    /// No attenuation by air.
    #[arg(long, conflicts_with_all = ["temperature", "humidity"])]
    pub no_air: bool,
    /// Say which accuracy takes how many rays, and where the map has too few sonels for any; with --output, then render and say
    /// what became of it.
    #[arg(long)]
    pub plan: bool,
    /// Add rays until half of every 95 % interval is below its target; exit code 1 where that is not reached, with the sonels
    /// it would take where rays cannot help. Figures: level, g, edt, t20, t30, c50, c80, d50, ts; units: %, s, ms, dB, jnd.
    #[arg(long, value_name = "TARGETS", requires = "output")]
    pub until: Option<Targets>,
    /// Begin no further look of --until that would end after this time by the clock: 60s, 5min, 2h.
    #[arg(long, value_name = "TIME", value_parser = parse_time, requires = "until")]
    pub at_most: Option<f64>,
    /// Print shares per path class, estimators and timings as JSON.
    #[arg(long)]
    pub json: bool,
    /// Say nothing on stderr but errors.
    #[arg(long)]
    pub quiet: bool,
    /// Threads; all cores where none is given. The result does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub threads: Option<u32>,
}

/// Positions of a grid along the three axes [m].
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    axes: [Vec<f64>; 3],
}

impl Grid {
    /// All points, x slowest, named by their indices.
    #[must_use]
    pub fn points(&self) -> Vec<ReceiverPoint> {
        let [xs, ys, zs] = &self.axes;
        let mut points = Vec::with_capacity(xs.len() * ys.len() * zs.len());
        for (i, &x) in xs.iter().enumerate() {
            for (j, &y) in ys.iter().enumerate() {
                for (k, &z) in zs.iter().enumerate() {
                    points.push(ReceiverPoint {
                        name: format!("grid {i} {j} {k}"),
                        position: DVec3::new(x, y, z),
                    });
                }
            }
        }
        points
    }
}

fn parse_receiver(text: &str) -> Result<ReceiverPoint, String> {
    let wrong = || format!("\"{text}\" is no receiver: write NAME=x,y,z such as \"seat 12=60,9,60\"");
    let (name, position) = text.rsplit_once('=').ok_or_else(wrong)?;
    let numbers: Vec<f64> = position
        .split(',')
        .map(|number| number.trim().parse().map_err(|_| wrong()))
        .collect::<Result<_, _>>()?;
    match numbers[..] {
        [x, y, z] if !name.trim().is_empty() => {
            Ok(ReceiverPoint { name: name.trim().to_owned(), position: DVec3::new(x, y, z) })
        }
        _ => Err(wrong()),
    }
}

fn parse_grid(text: &str) -> Result<Grid, String> {
    let wrong = || {
        format!("\"{text}\" is no grid: write three axes, each lo:hi:n or one number: 10:60:6,1.2,10:60:6")
    };
    let axes: Vec<Vec<f64>> =
        text.split(',').map(|axis| parse_axis(axis).ok_or_else(wrong)).collect::<Result<_, _>>()?;
    let axes: [Vec<f64>; 3] = axes.try_into().map_err(|_| wrong())?;
    Ok(Grid { axes })
}

/// `lo:hi:n`, both ends included, or one number.
fn parse_axis(text: &str) -> Option<Vec<f64>> {
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let number = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite());
    match parts[..] {
        [single] => Some(vec![number(single)?]),
        [low, high, count] => {
            let (low, high, count) = (number(low)?, number(high)?, count.parse::<u32>().ok()?);
            match count {
                0 => None,
                1 => Some(vec![0.5 * (low + high)]),
                _ => Some(
                    (0..count).map(|i| low + (high - low) * f64::from(i) / f64::from(count - 1)).collect(),
                ),
            }
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn receivers_and_grids_are_read() {
        let receiver = parse_receiver("a = b=1, -2,3.5").unwrap();
        assert_eq!((receiver.name.as_str(), receiver.position), ("a = b", DVec3::new(1.0, -2.0, 3.5)));
        let grid = parse_grid("0:10:3,1.2,-1:1:2").unwrap();
        assert_eq!(grid.points().len(), 6);
        assert_eq!(grid.points()[5].position, DVec3::new(10.0, 1.2, 1.0));
    }

    #[test]
    fn wrong_ones_say_what_is_right() {
        for text in ["1,2,3", "a=1,2", "a=1,2,x", "=1,2,3"] {
            assert!(parse_receiver(text).unwrap_err().contains("NAME=x,y,z"), "{text}");
        }
        for text in ["1,2", "0:1:0,1,1", "0:1,1,1", "nan,1,1"] {
            assert!(parse_grid(text).unwrap_err().contains("lo:hi:n"), "{text}");
        }
    }
}
