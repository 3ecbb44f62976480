//! WAV files: integer or float samples in, 32-bit float samples out.

use std::io::{Read, Seek, Write};

use hound::{SampleFormat, WavReader, WavSpec, WavWriter};

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
        let samples: Vec<f32> = match sample_format {
            SampleFormat::Float => reader.samples::<f32>().collect::<Result<_, _>>()?,
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

    /// Writes a WAV file of 32-bit float samples.
    ///
    /// # Errors
    /// When `out` cannot be written.
    pub fn write(&self, out: impl Write + Seek) -> Result<(), SoundError> {
        let spec = WavSpec {
            channels: self.channels.len() as u16,
            sample_rate: self.sample_rate_hz,
            bits_per_sample: 32,
            sample_format: SampleFormat::Float,
        };
        let mut writer = WavWriter::new(out, spec)?;
        for index in 0..self.channels.first().map_or(0, Vec::len) {
            for channel in &self.channels {
                writer.write_sample(channel[index])?;
            }
        }
        Ok(writer.finalize()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn what_is_written_is_read_back_to_the_bit() {
        let written = Recording {
            sample_rate_hz: 48_000,
            channels: vec![vec![1.5e-7, -3.0, 0.1], vec![0.0, 2.0, -1e6]],
        };
        let mut file = Cursor::new(Vec::new());
        written.write(&mut file).unwrap();
        file.set_position(0);
        assert_eq!(Recording::read(file).unwrap(), written);
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
