//! `sonel-analyze listen`: convolves a recording with an impulse response.

use std::io::Write;

use anyhow::bail;
use sonel::sound::{convolve_in_sections, write_part};
use sonel_console::Outcome;
use sonel_console::output::{Kind, Output, has_ending, publish};
use sonel_render::dry;

use crate::arguments::Listen;
use crate::open;

/// Convolves a recording with an impulse response.
///
/// # Errors
/// When a file is no usable WAV file, the recording has several channels, or the output cannot be written.
pub(crate) fn run(arguments: &Listen, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Listen { impulse_response, recording, gain, output } = arguments;
    if !has_ending(output, "wav") {
        bail!("{} does not end in .wav: sound is written as WAV only", output.display());
    }
    let target = Output::create(output, Kind::SOUND, &[])?;
    let response = open::recording(impulse_response)?;
    let rate = response.sample_rate_hz;
    let (mut signal, of_file) = dry(recording, rate)?;
    let factor = 10_f32.powf(f32::from(*gain) / 20.0);
    signal.iter_mut().for_each(|sample| *sample *= factor);
    if of_file != rate {
        writeln!(log, "note: {} has {of_file} Hz and is converted to {rate} Hz", recording.display())?;
    }
    let (mut peak, mut written) = (0.0_f32, 0);
    let complete = target.complete(|out| {
        convolve_in_sections(&signal, &response.channels, |samples, section| {
            peak = section.iter().flatten().fold(peak, |peak, sample| peak.max(sample.abs()));
            write_part(out, &mut written, samples, rate, &section)
        })
    })?;
    if !peak.is_finite() {
        bail!("the result exceeds the largest 32-bit float: lower the level of {}", recording.display());
    }
    publish([complete])?;
    let seconds = written as f64 / f64::from(rate);
    writeln!(log, "{seconds:.2} s, peak {peak:.3e} of full scale; written to {}", output.display())?;
    if peak > 1.0 {
        let fits = (f32::from(*gain) - 20.0 * peak.log10()).floor();
        writeln!(log, "warning: the peak exceeds full scale: give --gain {fits} to all that are compared")?;
    }
    Ok(Outcome::Done)
}
