//! Impulse responses as WAV files in a folder.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use glam::DVec3;
use rayon::prelude::*;
use sonel::ReceiverPoint;
use sonel_console::input;
use sonel_console::output::{Complete, Kind, Output};
use sonel_scene::Scene;
use sonel_sound::{Head, Microphone, Recording, SoundError, Synthesizer};

use crate::arguments::Arguments;
use crate::receivers;

/// The files of a folder: impulse responses of every source and receiver, and what is written beside those at single points.
pub struct SoundFiles<'a> {
    /// The folder.
    pub folder: &'a Path,
    /// Names of sources and receivers, as file names hold them.
    sources: Vec<String>,
    receivers: Vec<String>,
    /// Order of ambisonics.
    ambix: Option<u32>,
    /// Ears.
    head: Option<Head>,
    /// Microphones about each receiver.
    array: Option<Vec<Microphone>>,
    /// Samples per second.
    sample_rate_hz: u32,
    /// Files that are read.
    inputs: &'a [PathBuf],
}

/// Longest part of a name that a file name takes over: file systems allow 255 bytes in all.
const LONGEST: usize = 40;

/// Names with their numbers from 1, which tell them apart where characters that file names cannot hold are replaced.
pub fn numbered<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> Vec<String> {
    let digits = names.len().to_string().len();
    let plain = |name: &str| -> String {
        let allowed = |c: char| if c.is_alphanumeric() || " .-".contains(c) { c } else { '_' };
        name.chars().take(LONGEST).map(allowed).collect()
    };
    names.enumerate().map(|(index, name)| format!("{:0digits$}-{}", index + 1, plain(name))).collect()
}

impl<'a> SoundFiles<'a> {
    /// Impulse responses that are asked for, if any. Checks that the folder may be made or used, and that no file in it is lost.
    pub fn of(
        arguments: &'a Arguments,
        scene: &Scene,
        receivers: &[ReceiverPoint],
        inputs: &'a [PathBuf],
    ) -> anyhow::Result<Option<Self>> {
        let Some(folder) = arguments.wav.as_ref().filter(|_| arguments.path.is_none()) else {
            return Ok(None);
        };
        let read = |path: &PathBuf| -> anyhow::Result<Head> {
            let mut bytes = Vec::new();
            let file = input::open(path).and_then(|mut file| file.read_to_end(&mut bytes));
            file.with_context(|| format!("cannot read {}", path.display()))?;
            Head::read(&bytes, arguments.wav_rate).with_context(|| path.display().to_string())
        };
        let files = Self {
            folder,
            sources: numbered(scene.sources.iter().map(|source| source.name.as_str())),
            receivers: numbered(receivers.iter().map(|receiver| receiver.name.as_str())),
            ambix: arguments.ambix,
            head: arguments.hrtf.as_ref().map(read).transpose()?,
            array: arguments.array.as_deref().map(microphones).transpose()?,
            sample_rate_hz: arguments.wav_rate,
            inputs,
        };
        folder_for(folder)?;
        for end in files.ends() {
            let mut paths = files.pairs().into_iter().map(|pair| files.path(pair, &end));
            paths.try_for_each(|path| Output::try_create(&path, Kind::SOUND, inputs))?;
        }
        Ok(Some(files))
    }

    /// How many pairs of source and receiver.
    pub fn count(&self) -> usize {
        self.sources.len() * self.receivers.len()
    }

    /// The file of a pair, with what its name ends with: `1-stage_2-seat 12.wav`, number and name of the source and of the receiver.
    fn path(&self, (s, r): (usize, usize), end: &str) -> PathBuf {
        self.folder.join(format!("{}_{}{end}.wav", self.sources[s], self.receivers[r]))
    }

    fn pairs(&self) -> Vec<(usize, usize)> {
        (0..self.sources.len()).flat_map(|s| (0..self.receivers.len()).map(move |r| (s, r))).collect()
    }

    /// What the names of a pair's files end with, the single channel first.
    fn ends(&self) -> Vec<String> {
        let ambix = self.ambix.map(|order| format!("_ambix{order}"));
        let binaural = self.head.as_ref().map(|_| BINAURAL.to_owned());
        let array = self.array.as_ref().map(|_| ARRAY.to_owned());
        std::iter::once(String::new()).chain(ambix).chain(binaural).chain(array).collect()
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
        let array = self.array.as_ref().map(|array| synthesizer.array(pair, array)).transpose()?;
        let single = vec![synthesizer.impulse_response(pair.0, pair.1)?];
        Ok(std::iter::once(single).chain(ambix).chain(binaural).chain(array).collect())
    }

    /// Completes the files of all impulse responses; `up` is up for those with directions.
    pub fn complete(&self, synthesizer: &Synthesizer<'_>, up: DVec3) -> anyhow::Result<Vec<Complete>> {
        let complete = |path: &Path, channels| {
            let recording = Recording { sample_rate_hz: self.sample_rate_hz, channels };
            Output::create(path, Kind::SOUND, self.inputs)?.complete(|out| recording.write(out))
        };
        let of_pairs: anyhow::Result<Vec<Vec<Complete>>> = self
            .pairs()
            .into_par_iter()
            .map(|pair| {
                let all = self.channels(synthesizer, pair, up)?;
                let ends = self.ends();
                ends.iter()
                    .zip(all)
                    .map(|(end, channels)| complete(&self.path(pair, end), channels))
                    .collect()
            })
            .collect();
        Ok(of_pairs?.into_iter().flatten().collect())
    }
}

/// What the names of files with two ears end with.
const BINAURAL: &str = "_binaural";
/// What the names of files of arrays end with.
const ARRAY: &str = "_array";

/// Makes the folder for sound: one that cannot be written shall be found before the work is done.
pub fn folder_for(folder: &Path) -> anyhow::Result<()> {
    if folder.exists() && !folder.is_dir() {
        bail!("{} is not a folder: choose another one for --wav", folder.display());
    }
    if !folder.exists() {
        std::fs::create_dir(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    Ok(())
}

/// The microphones in a file of receivers.
pub fn microphones(path: &Path) -> anyhow::Result<Vec<Microphone>> {
    Ok(receivers::read_file(path)?.into_iter().map(sonel::microphone).collect())
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
