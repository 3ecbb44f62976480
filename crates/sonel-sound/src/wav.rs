//! WAV files: integer or float samples in, 32-bit float samples out.

use std::io::{Read, Write};

use hound::{SampleFormat, WavReader, WavSpec};

use crate::SoundError;

/// Sound of one or more channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Samples per second.
    pub sample_rate_hz: u32,
    /// Samples of every channel, all of one length; full scale of integer files is 1.
    pub channels: Vec<Vec<f32>>,
}

impl Recording {
    /// Reads a WAV file.
    ///
    /// # Errors
    /// When it is none, is damaged, empty, or holds samples that are not finite.
    pub fn read(input: impl Read) -> Result<Self, SoundError> {
        let mut reader = WavReader::new(input)?;
        let WavSpec { channels, sample_rate, bits_per_sample, sample_format } = reader.spec();
        if sample_rate == 0 {
            return Err(hound::Error::FormatError("a sample rate of 0 Hz").into());
        }
        let samples: Vec<f32> = match sample_format {
            SampleFormat::Float => reader.samples::<f32>().collect::<Result<_, _>>()?,
            // Files without samples are read whatever their bits are.
            SampleFormat::Int if !(1..=32).contains(&bits_per_sample) => {
                return Err(hound::Error::Unsupported.into());
            }
            SampleFormat::Int => {
                let scale = 1.0 / (1_u64 << (bits_per_sample - 1)) as f32;
                reader
                    .samples::<i32>()
                    .map(|sample| Ok(sample? as f32 * scale))
                    .collect::<Result<_, hound::Error>>()?
            }
        };
        let count = usize::from(channels);
        if samples.is_empty() || count == 0 {
            return Err(SoundError::Empty);
        }
        if let Some(at) = samples.iter().position(|sample| !sample.is_finite()) {
            return Err(SoundError::NotFinite { index: at / count, channel: at % count + 1 });
        }
        let channel = |first: usize| samples.iter().skip(first).step_by(count).copied().collect();
        Ok(Self { sample_rate_hz: sample_rate, channels: (0..count).map(channel).collect() })
    }

    /// Writes a WAV file of 32-bit float samples. More than two channels are those of no loudspeakers; the library knows only up to 32 of those.
    ///
    /// # Errors
    /// When `out` cannot be written, or the file would have 4 GiB.
    pub fn write(&self, mut out: impl Write) -> Result<(), SoundError> {
        let frames = self.channels.first().map_or(0, Vec::len);
        write_part(&mut out, &mut 0, frames, self.sample_rate_hz, &self.channels)?;
        Ok(out.flush()?)
    }
}

/// Most channels of a file: its header counts the bytes of a frame in 16 bits.
pub const MOST_CHANNELS: usize = u16::MAX as usize / 4;

/// Writes a part of a file of so many `frames` in all, of which some are `written`; before the first one what is before the samples.
///
/// # Errors
/// When `out` cannot be written, or the file would have 4 GiB.
pub fn write_part(
    out: &mut impl Write,
    written: &mut usize,
    frames: usize,
    rate: u32,
    part: &[Vec<f32>],
) -> Result<(), SoundError> {
    let channels = part.len();
    if *written == 0 {
        let bytes = 4 * channels as u64 * frames as u64;
        let too_large = || SoundError::TooLarge { bytes };
        let size =
            u32::try_from(bytes).ok().filter(|bytes| *bytes < u32::MAX - HEADER).ok_or_else(too_large)?;
        let align = u16::try_from(4 * channels).map_err(|_| too_large())?;
        let mask: u32 = if channels <= 2 { (1 << channels) - 1 } else { 0 };
        let mut header = Vec::new();
        header.extend(b"RIFF");
        header.extend((HEADER - 8 + size).to_le_bytes());
        header.extend(b"WAVEfmt \x28\0\0\0");
        header.extend([EXTENSIBLE, align / 4].map(u16::to_le_bytes).as_flattened());
        header.extend([rate, rate.saturating_mul(u32::from(align))].map(u32::to_le_bytes).as_flattened());
        header.extend([align, 32, 22, 32].map(u16::to_le_bytes).as_flattened());
        header.extend(mask.to_le_bytes());
        header.extend(FLOAT);
        header.extend(b"fact\x04\0\0\0");
        header.extend((frames as u32).to_le_bytes());
        header.extend(b"data");
        header.extend(size.to_le_bytes());
        out.write_all(&header)?;
    }
    let mut frame = Vec::with_capacity(4 * channels);
    for index in 0..part.first().map_or(0, Vec::len) {
        frame.clear();
        part.iter().for_each(|channel| frame.extend(channel[index].to_le_bytes()));
        out.write_all(&frame)?;
        *written += 1;
    }
    Ok(())
}

/// Amplitude of the onset over the largest one: −20 dB.
const ONSET: f64 = 0.1;

/// The first sample of one or more channels that is within 20 dB of the largest one at any of them; none of silence.
pub(crate) fn onset(channels: &[Vec<f32>]) -> Option<usize> {
    let largest = channels.iter().flatten().fold(0.0_f32, |largest, sample| largest.max(sample.abs()));
    let is_loud = |sample: &f32| f64::from(sample.abs()) >= ONSET * f64::from(largest);
    channels.iter().filter_map(|channel| channel.iter().position(is_loud)).min().filter(|_| largest > 0.0)
}

/// Bytes before the samples.
const HEADER: u32 = 80;
/// Format tag of a file whose header states an identifier of the samples' type.
const EXTENSIBLE: u16 = 0xfffe;
/// That of 32-bit float samples: KSDATAFORMAT_SUBTYPE_IEEE_FLOAT.
const FLOAT: [u8; 16] = [3, 0, 0, 0, 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71];

#[cfg(test)]
mod tests {
    use super::*;
    use hound::WavWriter;
    use std::io::Cursor;

    #[test]
    fn bits_and_rates_that_no_file_has_are_refused() {
        let header = |rate: u32, bits: u16| {
            let block = [rate.to_le_bytes(), (4 * rate).to_le_bytes()].concat();
            let tail = [4_u16.to_le_bytes(), bits.to_le_bytes()].concat();
            [&b"RIFF\x24\0\0\0WAVEfmt \x10\0\0\0\x01\0\x01\0"[..], &block, &tail, b"data\0\0\0\0"].concat()
        };
        assert!(matches!(Recording::read(&header(48_000, 32)[..]), Err(SoundError::Empty)));
        for (rate, bits) in [(48_000, 0), (48_000, 8192), (0, 32)] {
            let refused = Recording::read(&header(rate, bits)[..]);
            assert!(matches!(refused, Err(SoundError::Wav(_))), "{rate} {bits}: {refused:?}");
        }
    }

    #[test]
    fn what_is_written_is_read_back_to_the_bit() {
        for channels in [1, 2, 64] {
            let channel = |number: usize| vec![1.5e-7 * number as f32, -3.0, 0.1];
            let written =
                Recording { sample_rate_hz: 48_000, channels: (0..channels).map(channel).collect() };
            let mut file = Vec::new();
            written.write(&mut file).unwrap();
            assert_eq!(file.len(), HEADER as usize + 12 * channels);
            assert_eq!(Recording::read(&file[..]).unwrap(), written);
        }
    }

    #[test]
    fn integers_are_scaled_to_one() {
        for bits_per_sample in [8, 16, 24, 32] {
            let spec =
                WavSpec { channels: 1, sample_rate: 8000, bits_per_sample, sample_format: SampleFormat::Int };
            let mut file = Cursor::new(Vec::new());
            let mut writer = WavWriter::new(&mut file, spec).unwrap();
            let half = 1_i32 << (bits_per_sample - 2);
            for sample in [half, -half] {
                writer.write_sample(sample).unwrap();
            }
            writer.finalize().unwrap();
            file.set_position(0);
            assert_eq!(Recording::read(file).unwrap().channels, [[0.5, -0.5]], "{bits_per_sample} bits");
        }
    }

    #[test]
    fn other_files_cut_files_and_bad_samples_are_errors() {
        let read = |bytes: &[u8]| Recording::read(bytes).map_err(|error| error.to_string());
        assert!(read(b"RIFF....AVI LIST").unwrap_err().contains("not a WAV file"));
        let mut file = Cursor::new(Vec::new());
        Recording { sample_rate_hz: 48_000, channels: vec![vec![0.0, f32::NAN]] }.write(&mut file).unwrap();
        let bytes = file.into_inner();
        assert!(read(&bytes).unwrap_err().contains("sample 1 of channel 1"), "{:?}", read(&bytes));
        for length in 0..bytes.len() {
            assert!(read(&bytes[..length]).is_err(), "cut at {length}");
        }
    }
}
