//! `sonel-analyze auralise`: impulse responses of stored responses, or a recording heard through them.
//!
//! A recording has one gain in all files, so that designs differ in loudness as they do in the room.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use sonel::Response;
use sonel::analysis::report::aligned;
use sonel::sound::{Recording, SoundError, convolve_in_sections, write_part};
use sonel_console::Outcome;
use sonel_console::artifact::stem;
use sonel_console::output::{Complete, Kind, Output, has_ending, make_folder, publish};
use sonel_console::quantity::counted;
use sonel_render::{SoundFiles, dry, numbered};

use crate::arguments::Auralise;
use crate::open;

/// What is heard: a response with its files, or an impulse response with the file of what is heard through it.
enum Design<'a> {
    Rendered(&'a Path, Box<Response>, SoundFiles<'a>),
    Measured(Recording, PathBuf),
}

impl<'a> Design<'a> {
    /// The design in `path`, whose files have the `suffix`.
    fn open(path: &'a Path, suffix: &str, arguments: &'a Auralise) -> anyhow::Result<Self> {
        let folder = arguments.folder();
        if has_ending(path, "wav") {
            let hint = "is an impulse response already: state with --recording what is heard through it";
            ensure!(arguments.recording.is_some(), "{} {hint}", path.display());
            make_folder(folder)?;
            let file = folder.join(format!("heard{suffix}.wav"));
            Output::try_create(&file, Kind::SOUND)?;
            return Ok(Self::Measured(open::recording(path)?, file));
        }
        let response = open::response_with_room(path)?;
        let echograms = response.echograms();
        let [sources, receivers] = [&echograms.source_names, &echograms.receiver_names]
            .map(|names| names.iter().map(String::as_str));
        let files = SoundFiles::of((folder, suffix), &arguments.sound, sources, numbered(receivers))?;
        Ok(Self::Rendered(path, Box::new(response), files))
    }

    /// Samples per second.
    fn rate(&self) -> u32 {
        match self {
            Self::Rendered(_, _, files) => files.sample_rate_hz,
            Self::Measured(recording, _) => recording.sample_rate_hz,
        }
    }

    /// What `take` makes of each of its files and the impulse response for it.
    fn each<T: Send>(
        &self,
        seed: Option<u64>,
        take: impl Fn(&Path, &Recording) -> anyhow::Result<T> + Sync,
    ) -> anyhow::Result<Vec<T>> {
        match self {
            Self::Rendered(path, response, files) => {
                files.each(response, seed, take).with_context(|| path.display().to_string())
            }
            Self::Measured(recording, file) => Ok(vec![take(file, recording)?]),
        }
    }
}

/// Writes the impulse responses of responses, or a recording heard through them.
///
/// # Errors
/// When a file cannot be read or written, a response has no directions that are needed, or nothing is heard.
pub(crate) fn run(arguments: &Auralise, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Auralise { files, recording, seed, .. } = arguments;
    let stems: Vec<String> = files.iter().map(|path| stem(path)).collect();
    let names = numbered(stems.iter().map(String::as_str));
    let suffix = |name: &String| if files.len() > 1 { format!("_{name}") } else { String::new() };
    let named = files.iter().zip(names.iter().map(suffix));
    let designs = named.map(|(path, suffix)| Design::open(path, &suffix, arguments));
    let designs = designs.collect::<anyhow::Result<Vec<_>>>()?;
    let mut complete = Vec::new();
    if let Some(recording) = recording {
        let gain = match arguments.gain {
            Some(gain) => gain,
            None => full_scale(&designs, recording, *seed)?,
        };
        let heard = heard(&designs, recording, gain, *seed)?;
        let rows = heard.iter().map(|heard| heard.row.clone());
        write!(out, "{}", aligned(["file", "level [dB]", "peak [dB]"], rows, 1..))?;
        writeln!(log, "gain {gain} dB; level re the recording at 1 m in a free field, peak re full scale")?;
        if heard.iter().any(|heard| heard.peak > 1.0) {
            writeln!(log, "warning: peaks exceed full scale: leave --gain out, or give less")?;
        }
        complete.extend(heard.into_iter().map(|heard| heard.complete));
    } else {
        for design in &designs {
            complete.extend(design.each(*seed, sonel_render::complete)?);
        }
    }
    let count = counted(complete.len(), "file");
    publish(complete)?;
    writeln!(log, "{count} written to {}", arguments.folder().display())?;
    Ok(Outcome::Done)
}

/// A file in which a recording is heard.
struct Audio {
    complete: Complete,
    peak: f32,
    /// Name, level [dB re the recording], peak [dB re full scale].
    row: [String; 3],
}

/// The recording with a `gain` [dB] through all `designs`.
fn heard(
    designs: &[Design<'_>],
    recording: &Path,
    gain: i16,
    seed: Option<u64>,
) -> anyhow::Result<Vec<Audio>> {
    let mut heard = Vec::new();
    for design in designs {
        let mut signal = dry(recording, design.rate())?;
        signal.iter_mut().for_each(|sample| *sample *= 10_f32.powf(f32::from(gain) / 20.0));
        let mut at_1_m = Loudness::default();
        at_1_m.add(std::slice::from_ref(&signal));
        heard.extend(design.each(seed, |path, impulse| {
            let (mut written, mut loudness) = (0, Loudness::default());
            let complete = Output::create(path, Kind::SOUND, &[])?.complete(|out| {
                loudness = play(&signal, &impulse.channels, |samples, section| {
                    write_part(out, &mut written, samples, design.rate(), section)
                })?;
                anyhow::Ok(())
            })?;
            let level = 10.0 * (loudness.energy / at_1_m.energy).log10();
            let (peak, peak_db) = (loudness.peak, 20.0 * loudness.peak.log10());
            Ok(Audio { complete, peak, row: [stem(path), format!("{level:.1}"), format!("{peak_db:.1}")] })
        })?);
    }
    Ok(heard)
}

/// The largest gain [dB] with which nothing exceeds full scale.
fn full_scale(designs: &[Design<'_>], recording: &Path, seed: Option<u64>) -> anyhow::Result<i16> {
    let mut loudest = 0.0_f32;
    for design in designs {
        let signal = dry(recording, design.rate())?;
        let peaks = design.each(seed, |_, of| Ok(play(&signal, &of.channels, |_, _| Ok(()))?.peak))?;
        loudest = peaks.into_iter().fold(loudest, f32::max);
    }
    ensure!(loudest > 0.0, "nothing is heard: {} is silent, or all responses are", recording.display());
    Ok((-20.0 * loudest.log10()).floor() as i16)
}

/// What is heard through the `channels` of an impulse response: `take` gets the number of samples and, one after the other, sections of them.
fn play(
    signal: &[f32],
    channels: &[Vec<f32>],
    mut take: impl FnMut(usize, &[Vec<f32>]) -> Result<(), SoundError>,
) -> anyhow::Result<Loudness> {
    let mut loudness = Loudness::default();
    convolve_in_sections(signal, channels, |samples, section| {
        loudness.add(&section);
        take(samples, &section)
    })?;
    let advice = "the sound exceeds the largest 32-bit float: lower the level of the recording";
    ensure!(loudness.energy.is_finite(), advice);
    Ok(loudness)
}

/// Peak and energy of sound.
#[derive(Default)]
struct Loudness {
    peak: f32,
    energy: f64,
}

impl Loudness {
    fn add(&mut self, channels: &[Vec<f32>]) {
        self.peak = channels.iter().flatten().fold(self.peak, |peak, sample| peak.max(sample.abs()));
        // Both ears count. Of ambisonics it is the pressure, in the first channel.
        let counted = if channels.len() == 2 { channels } else { &channels[..1] };
        let energy: f64 = counted.iter().flatten().map(|sample| f64::from(*sample).powi(2)).sum();
        self.energy += energy / counted.len() as f64;
    }
}
