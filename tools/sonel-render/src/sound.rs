//! Impulse responses as WAV files in a folder.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use glam::DVec3;
use rayon::prelude::*;
use sonel_console::output::{self, Kind, Output};
use sonel_renderer::ReceiverPoint;
use sonel_scene::Scene;
use sonel_sound::{Recording, SAMPLE_RATE_HZ, Synthesizer};

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

    /// The file of a pair, in ambisonics of an order where there is one.
    fn path(&self, folder: &Path, (s, r): (usize, usize), order: Option<u32>) -> PathBuf {
        let end = order.map(|order| format!("_ambix{order}")).unwrap_or_default();
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

/// Checks that `folder` may be made or used, and that no file in it is lost.
pub fn check_folder(
    folder: &Path,
    names: &Names,
    inputs: &[PathBuf],
    ambix: Option<u32>,
) -> anyhow::Result<()> {
    if folder.exists() && !folder.is_dir() {
        bail!("{} is not a folder: choose another one for --wav", folder.display());
    }
    let orders = || std::iter::once(None).chain(ambix.map(Some));
    let paths = names.pairs().into_iter().flat_map(|pair| orders().map(move |order| (pair, order)));
    paths
        .map(|(pair, order)| names.path(folder, pair, order))
        .try_for_each(|path| output::check_target(&path, Kind::SOUND, inputs))
}

/// Writes all impulse responses, with an order of ambisonics and what is up there also in these.
pub fn write(
    folder: &Path,
    names: &Names,
    inputs: &[PathBuf],
    synthesizer: &Synthesizer<'_>,
    ambix: Option<(u32, DVec3)>,
) -> anyhow::Result<()> {
    if !folder.exists() {
        std::fs::create_dir(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    let save = |pair, order, channels| {
        let mut file = Output::create(&names.path(folder, pair, order), Kind::SOUND, inputs)?;
        let recording = Recording { sample_rate_hz: SAMPLE_RATE_HZ, channels };
        recording.write(file.writer()).with_context(|| {
            format!("cannot write {}; an older file there is untouched", file.target().display())
        })?;
        file.publish()
    };
    names.pairs().into_par_iter().try_for_each(|pair| {
        save(pair, None, vec![synthesizer.impulse_response(pair.0, pair.1)?])?;
        let Some((order, up)) = ambix else { return Ok(()) };
        save(pair, Some(order), synthesizer.ambisonics(pair, order, up)?)
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
