//! What can be wrong with responses and recordings.

use thiserror::Error;

/// Why there is no sound.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SoundError {
    /// A listed arrival is not part of the echogram.
    #[error(
        "the arrival at {time_s:.6} s at receiver \"{receiver}\" holds more energy than the echogram does then; render the response again"
    )]
    ArrivalWithoutEnergy {
        /// Name of the receiver.
        receiver: String,
        /// Travel time [s].
        time_s: f64,
    },
    /// Ambisonics without directions.
    #[error("the response holds no directions, which ambisonics need: render with --directions")]
    NoDirections,
    /// The file is no WAV file, a damaged one, or of a coding that is not read.
    #[error("this is not a WAV file of integer or float samples, or it is damaged: {0}")]
    Wav(#[from] hound::Error),
    /// A file without samples.
    #[error("the recording holds no samples")]
    Empty,
    /// Not a number.
    #[error("sample {index} of channel {channel} is not finite")]
    NotFinite {
        /// Index from 0.
        index: usize,
        /// Channel from 1.
        channel: usize,
    },
    /// A rate that cannot be converted.
    #[error(
        "cannot convert {from_hz} Hz to {to_hz} Hz: {problem}; convert the recording with another program first"
    )]
    Rate {
        /// [Hz].
        from_hz: u32,
        /// [Hz].
        to_hz: u32,
        /// What is wrong.
        problem: String,
    },
}
