//! Channels of sound at a place, and what each makes of sound from a direction.

use std::sync::Arc;

use glam::DVec3;
use sonel_echogram::Response;

use crate::SoundError;
use crate::alignment::Aligned;
use crate::ambisonics::{Axes, Frame, channels};
use crate::ears::Ears;
use crate::head::Head;
use crate::microphones::{self, Microphone};

/// Channels of an impulse response.
#[derive(Debug, Clone, Copy)]
pub enum Channels<'a> {
    /// Pressure at the receiver.
    Single,
    /// Ambisonics of an order 1 … 7 in these axes: ACN, SN3D. The response needs directions.
    Ambisonics(u32, Axes),
    /// Left and right ear of a head that looks along the receiver's aim. The response needs directions.
    Ears(&'a Head),
    /// Microphones about each receiver. Directional ones need directions.
    Array(&'a [Microphone]),
}

impl Channels<'_> {
    /// Whether the direction up matters.
    #[must_use]
    pub fn have_axes(self) -> bool {
        matches!(self, Self::Ambisonics(..) | Self::Ears(_))
    }

    /// Axes of the channels at a receiver, also between two of them, `up` a unit vector.
    pub(crate) fn frame(self, response: &Response, receiver: f64, up: DVec3) -> Frame {
        let Some(directions) = &response.directions else { return Frame::of_scene(up) };
        if !self.have_axes() || matches!(self, Self::Ambisonics(_, Axes::Scene)) {
            return Frame::of_scene(up);
        }
        let [before, after] =
            [receiver.floor(), receiver.ceil()].map(|r| DVec3::from(directions.lateral_axes[r as usize]));
        Frame::new(before.lerp(after, receiver.fract()).normalize_or(before), up)
    }
}

/// Channels at one point.
pub(crate) enum Spot<'a> {
    Microphone(&'a Microphone),
    Ambisonics(u32),
    Ear(Arc<Ears<'a>>, usize),
}

impl<'a> Spot<'a> {
    /// All spots of some channels.
    ///
    /// # Errors
    /// Those of [`microphones::check`], and one where directions are needed and missing.
    pub(crate) fn all(response: &Response, wanted: Channels<'a>) -> Result<Vec<Self>, SoundError> {
        if wanted.have_axes() && response.directions.is_none() {
            return Err(SoundError::NoDirections);
        }
        Ok(match wanted {
            Channels::Single => vec![Self::Microphone(const { &Microphone::POINT })],
            Channels::Ambisonics(order, _) => vec![Self::Ambisonics(order)],
            Channels::Ears(head) => {
                let ears = Arc::new(Ears::new(head));
                (0..head.responses[0].len()).map(|ear| Self::Ear(Arc::clone(&ears), ear)).collect()
            }
            Channels::Array(array) => {
                microphones::check(response, array)?;
                array.iter().map(Self::Microphone).collect()
            }
        })
    }

    /// Place relative to the receiver [m].
    pub(crate) fn offset(&self) -> DVec3 {
        if let Self::Microphone(microphone) = self { microphone.position } else { DVec3::ZERO }
    }

    /// How many channels.
    pub(crate) fn channels(&self) -> usize {
        if let Self::Ambisonics(order) = self { channels(*order) } else { 1 }
    }

    /// Samples before and behind a sound without its delay at which its filters end and begin.
    pub(crate) fn reach(&self) -> [usize; 2] {
        if let Self::Ear(ears, _) = self { [ears.end, ears.lead] } else { [0; 2] }
    }

    /// Filter of every channel for sound from a direction, a unit vector; a gain, where there is no ear.
    pub(crate) fn filters(&self, frame: &Frame, towards: DVec3) -> Vec<Aligned> {
        let gains = match self {
            Self::Microphone(microphone) => vec![microphone.gain(towards)],
            Self::Ambisonics(order) => frame.gains(*order, towards),
            Self::Ear(ears, ear) => return vec![ears.head.between(frame.local(towards), *ear)],
        };
        gains.into_iter().map(|gain| Aligned { taps: vec![gain], ..Aligned::default() }).collect()
    }
}
