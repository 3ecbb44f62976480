//! Pressure impulse responses of energy echograms, convolution, WAV files.
//!
//! A response has energies per band and time, no phases. [`impulse`] draws a pressure with these energies: listed
//! arrivals as single pulses ([`pulses`]), everything else as pulses of [`plane_waves`] that all receivers share. Pulses lie between samples
//! ([`fractional`]), and linear-phase band filters ([`crossover`]) shape them. Where the response has directions, so have the pulses: in [`ambisonics`], or at the
//! ears of a [`head`], or at [`microphones`] about a receiver. [`measured`] reads impulse responses of measurements. [`iacc`](iacc()) reads the correlation of two ears.
//! [`convolution`] applies it to a recording, [`walk`](walk()) to one that a moving listener hears, [`wav`] reads and writes.
//!
//! Pressure is relative to that of an omnidirectional source of the same power at 1 m in a free field: direct sound is 1/r,
//! and the mean of |P|² over a band is 4π F, F being its fluence per unit emitted energy [1/m²] (docs/physics.md §1).
//!
//! The Fourier transforms are `realfft`'s, whose last bits depend on the processor. The same command gives the same bytes on one
//! machine, with any number of threads; between machines samples agree to the rounding of 32-bit numbers.

pub mod alignment;
pub mod ambisonics;
pub mod convolution;
pub mod crossover;
mod ears;
mod error;
pub mod fractional;
pub mod head;
mod iacc;
pub mod impulse;
pub mod measured;
pub mod microphones;
pub mod octave_filter;
mod path;
pub mod plane_waves;
pub mod pulses;
pub mod resampling;
mod sphere;
mod spots;
mod transform;
mod walk;
pub mod wav;

pub use alignment::Aligned;
pub use convolution::convolve;
pub use error::SoundError;
pub use head::Head;
pub use iacc::{BandIacc, Iacc, iacc};
pub use impulse::{SoundSettings, Step, Synthesizer};
pub use microphones::Microphone;
pub use path::{Path, Waypoint};
pub use resampling::resample;
pub use spots::Channels;
pub use walk::walk;
pub use wav::{Recording, write_part};

/// Sample rate of impulse responses unless another one is asked for [Hz].
pub const SAMPLE_RATE_HZ: u32 = 48_000;
/// Sample rates of impulse responses [Hz].
pub const SAMPLE_RATES_HZ: std::ops::RangeInclusive<u32> = 8000..=192_000;
