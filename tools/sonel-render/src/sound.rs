//! Impulse responses as WAV files in a folder.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::Args;
use sonel::sound::{Head, Microphone, Recording, SAMPLE_RATE_HZ, SAMPLE_RATES_HZ};
use sonel::sound::{MOST_AMBISONICS_ORDER, MOST_CHANNELS};
use sonel::{Axes, Channels, Response, Silent, SoundOptions};
use sonel_console::input;
use sonel_console::output::{Complete, Kind, Output, make_folder};

use crate::receivers;

/// Impulse responses in a folder.
#[derive(Debug, Clone, Args)]
pub struct SoundArguments {
    /// Folder for WAV files.
    ///
    /// An impulse response for each source and receiver: 32-bit float pressure, direct sound 1/r, sample 0 at the emission. The folder is
    /// created if it does not exist.
    #[arg(long, value_name = "DIR")]
    pub wav: Option<PathBuf>,
    /// Sample rate of WAV files [Hz].
    ///
    /// 8000 … 192000. Responses are made at this rate; do not convert them like recordings.
    #[arg(long, value_name = "HZ", requires = "wav", default_value_t = SAMPLE_RATE_HZ, value_parser = clap::value_parser!(u32).range(i64::from(*SAMPLE_RATES_HZ.start())..=i64::from(*SAMPLE_RATES_HZ.end())), allow_negative_numbers = true)]
    pub wav_rate: u32,
    /// Also write ambisonics, order 1 … 7.
    ///
    /// ACN and SN3D (AmbiX) in scene axes, front is x, as NAME_ambix3.wav. Needs energies by direction: sonel-render implies
    /// --directions.
    #[arg(long, value_name = "ORDER", requires = "wav", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_AMBISONICS_ORDER)), allow_negative_numbers = true)]
    pub ambix: Option<u32>,
    /// Turn ambisonics to the receiver's aim.
    ///
    /// Front is the horizontal part of the aim of each receiver, by default towards the first source.
    #[arg(long, requires = "ambix")]
    pub aim: bool,
    /// Also write binaural responses.
    ///
    /// With the HRTF of FILE.sofa (SimpleFreeFieldHRIR, GeneralFIR), as NAME_binaural.wav. The head looks along the receiver's aim, by
    /// default towards the first source. Needs energies by direction: sonel-render implies --directions.
    #[arg(long, value_name = "FILE.sofa", requires = "wav")]
    pub hrtf: Option<PathBuf>,
    /// Also write a microphone array.
    ///
    /// The channels of an array about each receiver, as NAME_array.wav. The file is one of --receivers of sonel-render; its
    /// positions are relative to the receiver, in scene axes, within 1 m. Needs energies by direction: sonel-render implies
    /// --directions.
    #[arg(long, value_name = "FILE", requires = "wav")]
    pub array: Option<PathBuf>,
}

impl SoundArguments {
    /// Whether a response must have energies by direction.
    #[must_use]
    pub fn needs_directions(&self) -> bool {
        self.ambix.is_some() || self.hrtf.is_some() || self.array.is_some()
    }
}

/// What is written for each pair of source and receiver.
pub(crate) struct SoundKinds {
    /// Order of ambisonics, and their axes.
    ambix: Option<(u32, Axes)>,
    /// Ears.
    head: Option<Head>,
    /// Microphones about each receiver.
    array: Option<Vec<Microphone>>,
}

impl SoundKinds {
    /// What is asked for.
    ///
    /// # Errors
    /// When the HRTF or the array cannot be read.
    pub(crate) fn of(arguments: &SoundArguments) -> anyhow::Result<Self> {
        let head = |path: &PathBuf| -> anyhow::Result<Head> {
            let bytes = input::read(path).with_context(|| format!("cannot read {}", path.display()))?;
            Head::read(&bytes, arguments.wav_rate).with_context(|| path.display().to_string())
        };
        let microphones = |path: &PathBuf| -> anyhow::Result<Vec<Microphone>> {
            let all = receivers::read_file(path)?;
            let (label, count) = (path.display(), all.len());
            ensure!(
                count <= MOST_CHANNELS,
                "{label} has {count} microphones, a WAV file at most {MOST_CHANNELS} channels: leave some out"
            );
            Ok(all.into_iter().map(sonel::microphone).collect())
        };
        Ok(Self {
            ambix: arguments.ambix.map(|order| (order, if arguments.aim { Axes::Aim } else { Axes::Scene })),
            head: arguments.hrtf.as_ref().map(head).transpose()?,
            array: arguments.array.as_ref().map(microphones).transpose()?,
        })
    }

    /// What the names of files end with, and their channels; the single channel first.
    pub(crate) fn channels(&self) -> Vec<(String, Channels<'_>)> {
        let ambix =
            self.ambix.map(|(order, axes)| (format!("_ambix{order}"), Channels::Ambisonics(order, axes)));
        let ears = self.head.as_ref().map(|head| ("_binaural".to_owned(), Channels::Ears(head)));
        let array = self.array.as_ref().map(|array| ("_array".to_owned(), Channels::Array(array)));
        std::iter::once((String::new(), Channels::Single)).chain(ambix).chain(ears).chain(array).collect()
    }
}

/// The files of a folder: impulse responses of every source and receiver, and what is written beside those at single points.
pub struct SoundFiles<'a> {
    folder: &'a Path,
    /// Names of sources and receivers, as file names hold them, and what follows these.
    sources: Vec<String>,
    receivers: Vec<String>,
    suffix: String,
    pub(crate) heard: SoundKinds,
    /// Samples per second.
    pub sample_rate_hz: u32,
}

/// Longest part of a name that a file name takes over: file systems allow 255 bytes in all.
const LONGEST: usize = 40;

/// Names with their numbers from 1, which tell them apart where characters that file names cannot hold are replaced.
#[must_use]
pub fn numbered<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> Vec<String> {
    let digits = names.len().to_string().len();
    let plain = |name: &str| -> String {
        let allowed = |c: char| if c.is_alphanumeric() || " .-".contains(c) { c } else { '_' };
        name.chars().take(LONGEST).map(allowed).collect()
    };
    names.enumerate().map(|(index, name)| format!("{:0digits$}-{}", index + 1, plain(name))).collect()
}

impl<'a> SoundFiles<'a> {
    /// Files of sources of these names at receivers that file names call so. Checks that the folder may be made or used, and that no file in it is lost.
    ///
    /// # Errors
    /// When the folder cannot be used, a file in it is an input or none of ours, or the HRTF or the array cannot be read.
    pub fn of<'b>(
        (folder, suffix): (&'a Path, &str),
        arguments: &SoundArguments,
        sources: impl ExactSizeIterator<Item = &'b str>,
        receivers: Vec<String>,
    ) -> anyhow::Result<Self> {
        let files = Self {
            folder,
            sources: numbered(sources),
            receivers,
            suffix: suffix.to_owned(),
            heard: SoundKinds::of(arguments)?,
            sample_rate_hz: arguments.wav_rate,
        };
        make_folder(folder)?;
        for (end, _) in files.heard.channels() {
            for s in 0..files.sources.len() {
                let mut paths = (0..files.receivers.len()).map(|r| files.path((s, r), &end));
                paths.try_for_each(|path| Output::try_create(&path, Kind::SOUND))?;
            }
        }
        Ok(files)
    }

    /// How many pairs of source and receiver.
    pub fn count(&self) -> usize {
        self.sources.len() * self.receivers.len()
    }

    /// The file of a pair, with what its name ends with: `1-stage_2-seat 12.wav`, number and name of the source and of the receiver.
    pub(crate) fn path(&self, (s, r): (usize, usize), end: &str) -> PathBuf {
        self.folder.join(format!("{}_{}{}{end}.wav", self.sources[s], self.receivers[r], self.suffix))
    }

    /// What `take` makes of each file and its impulse response; `seed` is that of the waves of late sound, by default that of the
    /// rendering.
    ///
    /// # Errors
    /// When the response has no directions that are needed or does not state which one is up. The errors of `take`.
    pub fn each<T: Send>(
        &self,
        response: &Response,
        seed: Option<u64>,
        take: impl Fn(&Path, &Recording) -> anyhow::Result<T> + Sync,
    ) -> anyhow::Result<Vec<T>> {
        let options = SoundOptions { seed, sample_rate_hz: self.sample_rate_hz, ..SoundOptions::default() };
        let (ends, channels): (Vec<String>, Vec<Channels<'_>>) = self.heard.channels().into_iter().unzip();
        let of_pairs = response.each_pair(&channels, options, &Silent, |pair, all| {
            let take = |(end, channels): (&String, _)| {
                let recording = Recording { sample_rate_hz: self.sample_rate_hz, channels };
                take(&self.path(pair, end), &recording)
            };
            ends.iter().zip(all).map(take).collect::<anyhow::Result<Vec<T>>>()
        })?;
        Ok(of_pairs.into_iter().flatten().collect())
    }
}

/// Completes the file of a `recording`.
///
/// # Errors
/// When it cannot be written.
pub fn complete(path: &Path, recording: &Recording) -> anyhow::Result<Complete> {
    Output::create(path, Kind::SOUND, &[])?.complete(|out| recording.write(out))
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
