//! Microphones about a receiver: exact delays of what one receiver gets.
//!
//! A listed arrival that a receiver gets from the direction u after the time t comes from the (image) source at L u, L = ct. At a displacement
//! d it has the length L′ = |L u − d|, the time L′/c and L/L′ times the amplitude. A wave of late sound is plane: it reaches d earlier by u·d/c. Sound over
//! an edge counts as from the distance of its whole way; its front is more curved, by at most d²/2ρ of its way at a distance ρ of the edge.
//!
//! A microphone multiplies each pulse by the pressure of its pattern, a + (1 − a) cos θ [Eargle2004].
//!
//! This holds within the sphere about the receiver that no surface enters: there the field is a sum of incoming waves, each of which reaches every
//! place [Williams1999, section 6.8]. Beyond, surfaces may be between microphone and receiver, or the microphone within one: it is refused.
//!
//! References: [Eargle2004], [Williams1999] (docs/references.md).

use std::borrow::Cow;

use glam::DVec3;
use sonel_acoustics::Pattern;
use sonel_echogram::Response;
use sonel_echogram::provenance::NearestSurface;

use crate::SoundError;
use crate::pulses::Pulses;

/// Largest distance of a microphone from its receiver [m]: three time bins of 1 ms, because late sound has the receiver's energies.
pub const FARTHEST: f64 = 1.0;
/// Smallest distance of a microphone, or a listener, from a source [m].
pub(crate) const CLOSEST: f64 = 0.01;

/// A microphone of an array.
#[derive(Debug, Clone, PartialEq)]
pub struct Microphone {
    /// Name in messages.
    pub name: String,
    /// Position relative to the receiver, in the axes of the scene [m].
    pub position: DVec3,
    /// Pattern about the aim.
    pub pattern: Pattern,
    /// Unit vector of its axis, in the axes of the scene; of no matter to an omnidirectional one.
    pub aim: DVec3,
}

impl Microphone {
    /// The receiver itself.
    pub(crate) const POINT: Self =
        Self { name: String::new(), position: DVec3::ZERO, pattern: Pattern::Omni, aim: DVec3::X };

    /// Pressure for sound from a direction, a unit vector, relative to the axis.
    pub(crate) fn gain(&self, towards: DVec3) -> f64 {
        if self.pattern == Pattern::Omni {
            return 1.0;
        }
        self.pattern.pressure(self.aim.dot(towards).clamp(-1.0, 1.0))
    }

    fn refused(&self, problem: String) -> SoundError {
        SoundError::Microphone { name: self.name.clone(), problem }
    }
}

/// Checks the microphones of an array about the receivers of a response.
///
/// # Errors
/// When there are none, one is not finite, too far off or not nearer to its receiver than all surfaces, one is directional and the response has no
/// directions, or a receiver is directional.
pub fn check(response: &Response, microphones: &[Microphone]) -> Result<(), SoundError> {
    if microphones.is_empty() {
        return Err(SoundError::NoMicrophones);
    }
    let nearest = &response.provenance.nearest_surfaces;
    if nearest.len() != response.receivers() {
        return Err(SoundError::NoSurfaces);
    }
    for microphone in microphones {
        let distance = microphone.position.length();
        // Not a number is neither.
        if !(0.0..=FARTHEST).contains(&distance) {
            return Err(microphone.refused(format!(
                "{distance} m from its receiver; at most {FARTHEST} m are allowed: make it a receiver of its own, late sound is shared"
            )));
        }
        if let Some(r) = nearest.iter().position(|surface| surface.distance_m <= distance) {
            let (NearestSurface { distance_m, material }, name) = (&nearest[r], &response.receiver_names[r]);
            let receiver = DVec3::from_array(response.receiver_positions[r]);
            let [found, free] =
                [1.0, 0.9 * distance_m / distance].map(|part| receiver + part * microphone.position);
            return Err(microphone.refused(format!(
                "at {found} m, {distance:.3} m from its receiver \"{name}\", to which a surface of \"{material}\" is nearer, {distance_m:.3} m; \
                 {free:.3} m is free; move the receiver, or make the microphone a receiver of its own, late sound is shared"
            )));
        }
        if microphone.pattern != Pattern::Omni && response.directions.is_none() {
            return Err(SoundError::NoDirections);
        }
    }
    let directional =
        response.receiver_directivities.iter().position(|found| found.name != Pattern::Omni.name());
    if let Some(receiver) = directional {
        return Err(SoundError::DirectionalReceiver { receiver: response.receiver_names[receiver].clone() });
    }
    Ok(())
}

/// The pulses at the place of a microphone of those at its receiver; its pattern is left to the caller.
///
/// # Errors
/// When the microphone is where a source is.
pub(crate) fn displaced<'p>(
    pulses: &'p Pulses,
    microphone: &Microphone,
    speed_of_sound: f64,
) -> Result<Cow<'p, Pulses>, SoundError> {
    let offset = microphone.position;
    if offset == DVec3::ZERO {
        return Ok(Cow::Borrowed(pulses));
    }
    let mut own = pulses.clone();
    let all = own.time.iter_mut().zip(&mut own.gain).zip(&mut own.direction);
    for (index, ((time, gain), direction)) in all.enumerate() {
        if index >= pulses.listed {
            *time -= direction.dot(offset) / speed_of_sound;
            continue;
        }
        let length = speed_of_sound * *time;
        let way = length * *direction - offset;
        let own = way.length();
        if own < CLOSEST {
            return Err(
                microphone.refused(format!("{own:.4} m from a source; at least {CLOSEST} m are needed"))
            );
        }
        (*time, *direction) = (own / speed_of_sound, way / own);
        *gain *= length / own;
    }
    Ok(Cow::Owned(own))
}
