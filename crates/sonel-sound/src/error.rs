//! Errors of responses and recordings.

use sonel_sofa::SofaError;
use thiserror::Error;

impl From<hound::Error> for SoundError {
    fn from(error: hound::Error) -> Self {
        match error {
            // The reader calls a file that ends too early so.
            hound::Error::IoError(error) if error.raw_os_error().is_some() => Self::File(error),
            error => Self::Wav(error),
        }
    }
}

/// Why there is no sound.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SoundError {
    /// The work was broken off between two steps.
    #[error("stopped")]
    Stopped,
    /// A listed arrival is not part of the echogram.
    #[error(
        "the arrival at {time_s:.6} s at receiver \"{receiver}\" has more energy than its bin of the echogram; render the response again"
    )]
    ArrivalWithoutEnergy {
        /// Name of the receiver.
        receiver: String,
        /// Travel time [s].
        time_s: f64,
    },
    /// Ambisonics or a head without directions.
    #[error(
        "the response holds no directions, which ambisonics and binaural responses need: render with `directions`"
    )]
    NoDirections,
    /// An array about receivers of which nothing is known.
    #[error(
        "the response does not state the surfaces nearest to its receivers, which an array needs: render it again from its map"
    )]
    NoSurfaces,
    /// An array without microphones.
    #[error("the array has no microphones: give at least one")]
    NoMicrophones,
    /// A microphone that cannot be used.
    #[error("microphone \"{name}\" is {problem}")]
    Microphone {
        /// Its name.
        name: String,
        /// What is wrong.
        problem: String,
    },
    /// An array about a directional receiver.
    #[error(
        "receiver \"{receiver}\" is directional: an array is about an omnidirectional one, its microphones have directivities"
    )]
    DirectionalReceiver {
        /// Its name.
        receiver: String,
    },
    /// A measured impulse response of a sample rate that holds no octave.
    #[error(
        "the sample rate is {sample_rate_hz} Hz, too low for the octave of 63 Hz: use a recording of 180 Hz or more"
    )]
    NoOctave {
        /// Samples per second.
        sample_rate_hz: u32,
    },
    /// A measured impulse response that is too short or too long.
    #[error(
        "the impulse response lasts {seconds:.3} s from its onset on, 0.12 … 600 s are read: cut it, or record on"
    )]
    Length {
        /// From the onset [s].
        seconds: f64,
    },
    /// The file is no WAV file, a damaged one, or of a coding that is not read.
    #[error("this is not a WAV file of integer or float samples, or it is damaged: {0}")]
    Wav(hound::Error),
    /// A path that nobody can go.
    #[error("point {number} {problem}")]
    Path {
        /// Number of the waypoint, from 1.
        number: usize,
        /// What is wrong.
        problem: String,
    },
    /// A path through a source.
    #[error(
        "{time_s:.3} s after the beginning of the path the listener is less than 1 cm from a source: lead the path around it"
    )]
    ThroughSource {
        /// Time since its beginning [s].
        time_s: f64,
    },
    /// A response of other places than those of a path.
    #[error("the response has {found} receivers, the path has {expected} places: render it at these")]
    Places {
        /// Receivers.
        found: usize,
        /// Places.
        expected: usize,
    },
    /// A file that WAV cannot hold.
    #[error(
        "the sound has {bytes} bytes, a WAV file holds less than 4 GiB: make fewer channels or a lower sample rate"
    )]
    TooLarge {
        /// Of all samples.
        bytes: u64,
    },
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] std::io::Error),
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
    /// No file of head-related impulse responses, or one that cannot be used.
    #[error(
        "no head-related impulse responses: {problem}; give a SOFA file of the convention SimpleFreeFieldHRIR or GeneralFIR"
    )]
    Head {
        /// What is wrong.
        problem: SofaError,
    },
    /// A recording without two ears.
    #[error("channels of the recording: {channels}; IACC needs two, left and right: make it for two ears")]
    NotBinaural {
        /// Found.
        channels: usize,
    },
    /// Silence.
    #[error("the recording is silent: nothing arrives at either ear")]
    Silent,
}
