//! Strength in time windows after the direct sound, for comparisons.
//!
//! 10 lg(400π ΣF) over the energy that arrives in a window after the direct sound, read off the decay curve, so that windows
//! need not begin at bin borders. A window must lie within the record.

use sonel_acoustics::strength_db;

use crate::decay::DecayCurve;
use crate::estimate::Unsupported;

/// A stretch of time after the direct sound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Key in outputs.
    pub key: &'static str,
    /// Begin [s].
    pub begin: f64,
    /// End [s].
    pub end: f64,
}

/// From the direct sound to two seconds: about as many decibels of a decay each, early ones finer.
pub const WINDOWS: [Window; 6] = [
    Window { key: "strength_g_0_to_50_ms_db", begin: 0.0, end: 0.05 },
    Window { key: "strength_g_50_to_100_ms_db", begin: 0.05, end: 0.1 },
    Window { key: "strength_g_100_to_200_ms_db", begin: 0.1, end: 0.2 },
    Window { key: "strength_g_200_to_500_ms_db", begin: 0.2, end: 0.5 },
    Window { key: "strength_g_500_to_1000_ms_db", begin: 0.5, end: 1.0 },
    Window { key: "strength_g_1000_to_2000_ms_db", begin: 1.0, end: 2.0 },
];

impl Window {
    /// Strength of the energy in this window [dB].
    ///
    /// # Errors
    /// When the record ends before the window does, or nothing arrives in it.
    pub fn strength(&self, curve: &DecayCurve) -> Result<f64, Unsupported> {
        let after =
            |time: f64| curve.remaining(time).ok_or(Unsupported::LimitOutside { limit_ms: 1000.0 * time });
        let energy = after(self.begin)? - after(self.end)?;
        if energy > 0.0 { Ok(strength_db(energy)) } else { Err(Unsupported::NoEnergy) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decay::Echogram;
    use sonel_testkit::exponential::ExponentialDecay;

    #[test]
    fn windows_hold_the_energy_of_the_decay() {
        let decay = ExponentialDecay { reverberation_time: 0.9, energy: 0.01 };
        let (edges, energy): (Vec<f64>, _) =
            ((0..=800).map(|edge| f64::from(edge) * 0.001_9).collect(), decay.bins(0.001_9, 800));
        let curve =
            DecayCurve::new(Echogram { edges: &edges, energy: &energy, direct_time: 0.0, arrivals: &[] })
                .unwrap();
        for window in &WINDOWS[..5] {
            let expected = strength_db(decay.energy_between(window.begin, window.end));
            assert!((window.strength(&curve).unwrap() - expected).abs() < 1e-9, "{}", window.key);
        }
        assert_eq!(WINDOWS[5].strength(&curve), Err(Unsupported::LimitOutside { limit_ms: 2000.0 }));
    }
}
