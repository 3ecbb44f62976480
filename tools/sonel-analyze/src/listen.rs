//! `sonel-analyze listen`: convolves a recording with an impulse response.

use std::io::Write;

use anyhow::{Context, bail};
use rayon::prelude::*;
use sonel::sound::{Recording, convolve, resample};
use sonel_console::Outcome;
use sonel_console::output::{Kind, Output, has_ending};

use crate::arguments::Listen;
use crate::open;

/// Convolves a recording with an impulse response.
///
/// # Errors
/// When a file is no usable WAV file, the recording has several channels, or the output cannot be written.
pub(crate) fn run(arguments: &Listen, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Listen { impulse_response, recording, output } = arguments;
    if !has_ending(output, "wav") {
        bail!("{} does not end in .wav: sound is written as WAV only", output.display());
    }
    let target = Output::create(output, Kind::SOUND, &[])?;
    let response = open::recording(impulse_response)?;
    let dry = open::recording(recording)?;
    let [signal] = &dry.channels[..] else {
        bail!("{} has {} channels: mix them to one", recording.display(), dry.channels.len());
    };
    let rate = response.sample_rate_hz;
    if dry.sample_rate_hz != rate {
        writeln!(
            log,
            "note: {} has {} Hz and is converted to {rate} Hz",
            recording.display(),
            dry.sample_rate_hz
        )?;
    }
    let signal =
        resample(signal, dry.sample_rate_hz, rate).with_context(|| recording.display().to_string())?;
    let channels: Vec<Vec<f32>> =
        response.channels.par_iter().map(|channel| convolve(&signal, channel)).collect();
    if channels.iter().flatten().any(|sample: &f32| !sample.is_finite()) {
        bail!("the result exceeds the largest 32-bit float: lower the level of {}", recording.display());
    }
    let rendered = Recording { sample_rate_hz: rate, channels };
    target.write(|out| rendered.write(out))?;
    let peak = rendered.channels.iter().flatten().fold(0.0_f32, |peak, sample| peak.max(sample.abs()));
    let seconds = rendered.channels[0].len() as f64 / f64::from(rate);
    writeln!(log, "{seconds:.2} s, peak {peak:.3e} of full scale; written to {}", output.display())?;
    if peak > 1.0 {
        writeln!(log, "warning: the peak exceeds full scale: lower the level of the file before playing it")?;
    }
    Ok(Outcome::Done)
}
