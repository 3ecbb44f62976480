//! Gain and delay of a source within a system of several: loudspeakers, an orchestra.

use core::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

/// Change of a source within a system.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SourceChange {
    /// Gain [dB].
    pub gain_db: f64,
    /// Delay of what it radiates [s], 0 or more.
    pub delay: f64,
}

impl SourceChange {
    /// Gains that a scene or an option may state [dB].
    pub const GAINS_DB: RangeInclusive<f64> = -100.0..=100.0;
    /// Delays that a scene or an option may state [s].
    pub const DELAYS: RangeInclusive<f64> = 0.0..=1.0;

    /// Whether gain and delay are within their ranges.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        Self::GAINS_DB.contains(&self.gain_db) && Self::DELAYS.contains(&self.delay)
    }

    /// Whether it changes nothing.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_or_out_of_range_is_not_valid() {
        let change = |gain_db, delay| SourceChange { gain_db, delay };
        assert!(change(-100.0, 1.0).is_valid() && !change(-100.0, 1.0).is_none());
        assert!(SourceChange::default().is_valid() && SourceChange::default().is_none());
        for wrong in
            [change(100.5, 0.0), change(f64::NAN, 0.0), change(0.0, -0.001), change(0.0, f64::INFINITY)]
        {
            assert!(!wrong.is_valid(), "{wrong:?}");
        }
    }
}
