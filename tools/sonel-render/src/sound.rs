//! Impulse responses as WAV files in a folder.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use glam::DVec3;
use rayon::prelude::*;
use sonel_console::input;
use sonel_console::output::{self, Kind, Output};
use sonel_renderer::ReceiverPoint;
use sonel_scene::Scene;
use sonel_sound::{Head, Recording, SAMPLE_RATE_HZ, SoundError, Synthesizer};

use crate::arguments::Arguments;

/// File names of all sources and receivers.
pub struct Names {
    sources: Vec<String>,
    receivers: Vec<String>,
}

impl Names {
    /// `1-stage_2-seat 12.wav`: number and name of the source and of the receiver.
    pub fn of(scene: &Scene, receivers: &[ReceiverPoint]) -> Self {
        Self {
            sources: numbered(scene.sources.iter().map(|source| source.name.as_str())),
            receivers: numbered(receivers.iter().map(|receiver| receiver.name.as_str())),
        }
    }

    /// How many files.
    pub fn count(&self) -> usize {
        self.sources.len() * self.receivers.len()
    }

    /// The file of a pair, with what its name ends with.
    fn path(&self, folder: &Path, (s, r): (usize, usize), end: &str) -> PathBuf {
        folder.join(format!("{}_{}{end}.wav", self.sources[s], self.receivers[r]))
    }

    fn pairs(&self) -> Vec<(usize, usize)> {
        (0..self.sources.len()).flat_map(|s| (0..self.receivers.len()).map(move |r| (s, r))).collect()
    }
}

/// Longest part of a name that a file name takes over: file systems allow 255 bytes in all.
const LONGEST: usize = 40;

/// Names with their numbers from 1, which tell them apart where characters that file names cannot hold are replaced.
fn numbered<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> Vec<String> {
    let digits = names.len().to_string().len();
    let plain = |name: &str| -> String {
        let allowed = |c: char| if c.is_alphanumeric() || " .-".contains(c) { c } else { '_' };
        name.chars().take(LONGEST).map(allowed).collect()
    };
    names.enumerate().map(|(index, name)| format!("{:0digits$}-{}", index + 1, plain(name))).collect()
}

/// What is written beside the impulse responses at single points.
pub struct Beside {
    /// Order of ambisonics.
    ambix: Option<u32>,
    /// Ears.
    head: Option<Head>,
}

impl Beside {
    /// As the arguments ask for it.
    pub fn of(arguments: &Arguments) -> anyhow::Result<Self> {
        let read = |path: &PathBuf| -> anyhow::Result<Head> {
            let mut bytes = Vec::new();
            let file = input::open(path).and_then(|mut file| file.read_to_end(&mut bytes));
            file.with_context(|| format!("cannot read {}", path.display()))?;
            Head::read(&bytes).with_context(|| path.display().to_string())
        };
        Ok(Self { ambix: arguments.ambix, head: arguments.hrtf.as_ref().map(read).transpose()? })
    }

    /// What the names of a pair's files end with, the single channel first.
    fn ends(&self) -> Vec<String> {
        let ambix = self.ambix.map(|order| format!("_ambix{order}"));
        let binaural = self.head.as_ref().map(|_| BINAURAL.to_owned());
        std::iter::once(String::new()).chain(ambix).chain(binaural).collect()
    }

    /// Channels of a pair in the order of [`Self::ends`].
    fn channels(
        &self,
        synthesizer: &Synthesizer<'_>,
        pair: (usize, usize),
        up: DVec3,
    ) -> Result<Vec<Vec<Vec<f32>>>, SoundError> {
        let ambix = self.ambix.map(|order| synthesizer.ambisonics(pair, order, up)).transpose()?;
        let binaural = self.head.as_ref().map(|head| synthesizer.binaural(pair, head, up)).transpose()?;
        let single = vec![synthesizer.impulse_response(pair.0, pair.1)?];
        Ok(std::iter::once(single).chain(ambix).chain(binaural).collect())
    }
}

/// What the names of files with two ears end with.
const BINAURAL: &str = "_binaural";

/// Checks that `folder` may be made or used, and that no file in it is lost.
pub fn check_folder(folder: &Path, names: &Names, inputs: &[PathBuf], beside: &Beside) -> anyhow::Result<()> {
    if folder.exists() && !folder.is_dir() {
        bail!("{} is not a folder: choose another one for --wav", folder.display());
    }
    let ends = beside.ends();
    let paths = names.pairs().into_iter().flat_map(|pair| ends.iter().map(move |end| (pair, end)));
    paths
        .map(|(pair, end)| names.path(folder, pair, end))
        .try_for_each(|path| output::check_target(&path, Kind::SOUND, inputs))
}

/// Writes all impulse responses; `up` is up for those with directions.
pub fn write(
    folder: &Path,
    names: &Names,
    inputs: &[PathBuf],
    synthesizer: &Synthesizer<'_>,
    (beside, up): (&Beside, DVec3),
) -> anyhow::Result<()> {
    if !folder.exists() {
        std::fs::create_dir(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    let save = |path: &Path, channels| {
        let mut file = Output::create(path, Kind::SOUND, inputs)?;
        let recording = Recording { sample_rate_hz: SAMPLE_RATE_HZ, channels };
        recording.write(file.writer()).with_context(|| {
            format!("cannot write {}; an older file there is untouched", file.target().display())
        })?;
        file.publish()
    };
    names.pairs().into_par_iter().try_for_each(|pair| {
        let all = beside.channels(synthesizer, pair, up)?;
        beside
            .ends()
            .iter()
            .zip(all)
            .try_for_each(|(end, channels)| save(&names.path(folder, pair, end), channels))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_apart_by_numbers_and_fit_into_file_names() {
        let names = ["a/b", "a:b", "Reihe 3, Platz ö"];
        assert_eq!(numbered(names.into_iter()), ["1-a_b", "2-a_b", "3-Reihe 3_ Platz ö"]);
        let long = "ö".repeat(300);
        assert!(numbered(std::iter::repeat_n(long.as_str(), 100_000))[99_999].len() < 100);
    }
}
