//! Just-noticeable differences of room-acoustic parameters.
//!
//! References: [ISO3382-1] table A.1; for the speech transmission index [Bradley1999] (docs/references.md).

/// Reverberation time, relative (ISO 3382-1 gives it for the early decay time, usage extends it to T20 and T30).
pub const REVERBERATION_TIME: f64 = 0.05;
/// Early decay time, relative.
pub const EARLY_DECAY_TIME: f64 = 0.05;
/// Sound pressure level and strength G [dB].
pub const LEVEL_DB: f64 = 1.0;
/// Clarity C80 [dB]; used for C50 too.
pub const CLARITY_DB: f64 = 1.0;
/// Definition D50.
pub const DEFINITION: f64 = 0.05;
/// Centre time Ts, 10 ms [s].
pub const CENTER_TIME: f64 = 0.010;
/// Early lateral energy fraction LF.
pub const LATERAL_FRACTION: f64 = 0.05;
/// Speech transmission index [Bradley1999].
pub const SPEECH_TRANSMISSION_INDEX: f64 = 0.03;
