//! What a listener hears of a recording along a path, as WAV files in a folder.

use std::io::BufReader;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, bail};
use glam::DVec3;
use sonel::scenes::CompiledScene;
use sonel::sound::{Recording, resample, write_part};
use sonel::{Observer, ReceiverPoint, Response, Route, SoundOptions, Waypoint};
use sonel_console::follower::Follower;
use sonel_console::input;
use sonel_console::output::{Complete, Kind, Output};

use crate::arguments::Arguments;
use crate::receivers::read_csv;
use crate::sound::SoundFiles;

/// A path with what is heard along it.
pub(crate) struct Walk<'a> {
    path: Route,
    spacing: f64,
    /// The recording at the sample rate of the files.
    signal: Vec<f32>,
    /// Those of each source.
    pub(crate) files: SoundFiles<'a>,
}

impl<'a> Walk<'a> {
    /// The walk that is asked for, if any. Checks that its files may be written.
    pub(crate) fn of(arguments: &'a Arguments, scene: &CompiledScene) -> anyhow::Result<Option<Self>> {
        let (Some(file), Some(recording), Some(folder)) =
            (&arguments.path, &arguments.recording, &arguments.sound.wav)
        else {
            return Ok(None);
        };
        let sources = scene.sources.iter().map(|source| source.name.as_str());
        Ok(Some(Self {
            path: read(file)?,
            spacing: arguments.path_spacing,
            signal: dry(recording, arguments.sound.wav_rate)?,
            files: SoundFiles::of((folder, ""), &arguments.sound, sources, vec!["walk".to_owned()])?,
        }))
    }

    /// The places that are rendered, named by the length of the path up to them.
    pub(crate) fn receivers(&self) -> Vec<ReceiverPoint> {
        sonel::places(&self.path, self.spacing)
    }

    /// Completes the files of all sources. A walk that at its pace takes longer than `at_most` [s] is given up.
    pub(crate) fn complete(
        &self,
        response: &Response,
        (seed, at_most): (Option<u64>, f64),
        follower: &Follower<'_>,
    ) -> anyhow::Result<Vec<Complete>> {
        let rate = self.files.sample_rate_hz;
        let options = SoundOptions { seed, sample_rate_hz: rate, ..SoundOptions::default() };
        let all = self.files.heard.channels();
        let (begun, count) = (Instant::now(), all.len() * self.files.count());
        let mut complete = Vec::new();
        for (end, channels) in &all {
            for s in 0..self.files.count() {
                let route = (s, &self.path, self.spacing);
                let output = Output::create(&self.files.path((s, 0), end), Kind::SOUND, &[])?;
                let (file, mut written) = (complete.len(), 0);
                complete.push(output.complete(|out| {
                    let take = |frames: usize, section: Vec<Vec<f32>>| {
                        write_part(out, &mut written, frames, rate, &section)?;
                        let share = (file as f64 + written as f64 / frames as f64) / count as f64;
                        let _ = follower.progress("walking", share);
                        in_time(begun.elapsed().as_secs_f64() / share, at_most)
                    };
                    follower.result(response.walk(route, *channels, &self.signal, options, follower, take))
                })?);
            }
        }
        Ok(complete)
    }
}

/// Refuses a walk that takes longer than `at_most` [s].
fn in_time(seconds: f64, at_most: f64) -> sonel::Result<()> {
    if seconds <= at_most {
        return Ok(());
    }
    Err(sonel::Error::Options(vec![format!(
        "the walk takes about {seconds:.0} s, but `at_most` is {at_most} s: allow more, or give a shorter recording"
    )]))
}

/// The recording of one channel in `path`, converted to `rate` [Hz].
///
/// # Errors
/// When the file cannot be read, is no such recording, or has a rate of none.
pub fn dry(path: &Path, rate: u32) -> anyhow::Result<Vec<f32>> {
    let label = || path.display().to_string();
    let opened = input::open(path).with_context(|| format!("cannot open {}", label()))?;
    let dry = Recording::read(BufReader::new(opened)).with_context(label)?;
    let [signal] = &dry.channels[..] else {
        bail!("{} has {} channels: mix them to one", label(), dry.channels.len());
    };
    resample(signal, dry.sample_rate_hz, rate).with_context(label)
}

/// The path in a CSV file.
fn read(file: &Path) -> anyhow::Result<Route> {
    let label = file.display().to_string();
    let text = input::read_to_string(file).with_context(|| format!("cannot read the path {label}"))?;
    let points = waypoints(&text, &label)?;
    Route::new(points).with_context(|| label)
}

fn waypoints(text: &str, label: &str) -> anyhow::Result<Vec<Waypoint>> {
    let right = "a time [s] and three coordinates [m]";
    read_csv(text, label, ["time", "x", "y", "z"], right, |record| {
        let numbers: Vec<f64> = record.iter().map(str::parse).collect::<Result<_, _>>().ok()?;
        let [time, x, y, z] = numbers.try_into().ok()?;
        Some(Waypoint { time, position: DVec3::new(x, y, z) })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_read_and_bad_lines_are_named() {
        let points = waypoints("time, x, y, z\n0, 1, 2, 1.5\n2.5,1,3,1.5\n", "walk.csv").unwrap();
        assert_eq!(points[1], Waypoint { time: 2.5, position: DVec3::new(1.0, 3.0, 1.5) });
        let error = waypoints("time,x,y,z\n0,1,2\n1,1,2,x\n", "walk.csv").unwrap_err().to_string();
        assert!(error.contains("walk.csv:2:") && error.contains("walk.csv:3:"), "{error}");
        assert!(waypoints("x,y,z\n", "walk.csv").unwrap_err().to_string().contains("time,x,y,z"));
    }
}
