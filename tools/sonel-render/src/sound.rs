//! Impulse responses as WAV files in a folder.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use glam::DVec3;
use rayon::prelude::*;
use sonel::Response;
use sonel_console::input;
use sonel_console::output::{Complete, Kind, Output};
use sonel_sound::ambisonics::MOST_ORDER;
use sonel_sound::{
    Head, Microphone, Recording, SAMPLE_RATE_HZ, SAMPLE_RATES_HZ, SoundError, SoundSettings, Synthesizer,
};

use crate::receivers;

/// Impulse responses in a folder.
#[derive(Debug, Clone, Args)]
pub struct SoundArguments {
    /// Folder for pressure impulse responses, a WAV file for each source and receiver: 32-bit float, direct sound
    /// 1/r, sample 0 at the emission. Created if it does not exist.
    #[arg(long, value_name = "DIR")]
    pub wav: Option<PathBuf>,
    /// Sample rate of --wav [Hz], 8000 to 192000. Responses are made at this rate; do not convert them like recordings.
    #[arg(long, value_name = "HZ", requires = "wav", default_value_t = SAMPLE_RATE_HZ, value_parser = clap::value_parser!(u32).range(i64::from(*SAMPLE_RATES_HZ.start())..=i64::from(*SAMPLE_RATES_HZ.end())), allow_negative_numbers = true)]
    pub wav_rate: u32,
    /// Scale every band of --wav each 10 ms to the energies of the response: T30 and levels of one file are then those of the
    /// response, not of the mean of many seeds alone. Direct sound is scaled too.
    #[arg(long, requires = "wav")]
    pub wav_match: bool,
    /// Also write ambisonics of an order from 1 to 7 (ACN, SN3D: AmbiX) as NAME_ambix3.wav. With --directions, which sonel-render
    /// implies; needs --wav.
    #[arg(long, value_name = "ORDER", requires = "wav", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_ORDER)), allow_negative_numbers = true)]
    pub ambix: Option<u32>,
    /// Also write binaural responses as NAME_binaural.wav, with the HRTF of FILE.sofa (SimpleFreeFieldHRIR). The head looks
    /// along the receiver's aim, by default towards the first source. With --directions, which sonel-render implies; needs --wav.
    #[arg(long, value_name = "FILE.sofa", requires = "wav")]
    pub hrtf: Option<PathBuf>,
    /// Also write the channels of a microphone array about each receiver as NAME_array.wav: the file is one of --receivers of
    /// sonel-render, its positions are relative to the receiver, in scene axes, within 1 m. With --directions, which sonel-render
    /// implies; needs --wav.
    #[arg(long, value_name = "FILE", requires = "wav")]
    pub array: Option<PathBuf>,
}

impl SoundArguments {
    /// Whether a response must have energies by direction.
    #[must_use]
    pub fn needs_directions(&self) -> bool {
        self.ambix.is_some() || self.hrtf.is_some() || self.array.is_some()
    }

    /// Files that are read.
    pub fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        self.hrtf.iter().chain(&self.array)
    }
}

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
    /// Whether bands are scaled to the energies of the response.
    is_matched: bool,
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
    /// Impulse responses that are asked for, if any, of sources and receivers of these names. Checks that the folder may be made or used, and
    /// that no file in it is lost.
    ///
    /// # Errors
    /// When the folder cannot be used, a file in it is an input or none of ours, or the HRTF or the array cannot be read.
    pub fn of(
        arguments: &'a SoundArguments,
        sources: &[&str],
        receivers: &[&str],
        inputs: &'a [PathBuf],
    ) -> anyhow::Result<Option<Self>> {
        let Some(folder) = &arguments.wav else { return Ok(None) };
        let read = |path: &PathBuf| -> anyhow::Result<Head> {
            let mut bytes = Vec::new();
            let file = input::open(path).and_then(|mut file| file.read_to_end(&mut bytes));
            file.with_context(|| format!("cannot read {}", path.display()))?;
            Head::read(&bytes, arguments.wav_rate).with_context(|| path.display().to_string())
        };
        let files = Self {
            folder,
            sources: numbered(sources.iter().copied()),
            receivers: numbered(receivers.iter().copied()),
            ambix: arguments.ambix,
            head: arguments.hrtf.as_ref().map(read).transpose()?,
            array: arguments.array.as_deref().map(microphones).transpose()?,
            sample_rate_hz: arguments.wav_rate,
            is_matched: arguments.wav_match,
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

    /// Completes the files of all impulse responses of a response; `seed` is that of the waves of late sound, by default that of the rendering.
    ///
    /// # Errors
    /// When the response has no directions that are needed, does not state which one is up, or a file cannot be written.
    pub fn complete(&self, response: &Response, seed: Option<u64>) -> anyhow::Result<Vec<Complete>> {
        let room = response.surroundings();
        let settings = SoundSettings {
            volume: room.volume,
            seed: seed.unwrap_or(room.seed),
            sample_rate_hz: self.sample_rate_hz,
            is_matched: self.is_matched,
        };
        let synthesizer = Synthesizer::new(response.echograms(), settings);
        let needs_up = self.ambix.is_some() || self.head.is_some();
        let up = if needs_up { room.upward()? } else { DVec3::Z };
        let complete = |path: &Path, channels| {
            let recording = Recording { sample_rate_hz: self.sample_rate_hz, channels };
            Output::create(path, Kind::SOUND, self.inputs)?.complete(|out| recording.write(out))
        };
        let of_pairs: anyhow::Result<Vec<Vec<Complete>>> = self
            .pairs()
            .into_par_iter()
            .map(|pair| {
                let all = self.channels(&synthesizer, pair, up)?;
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
