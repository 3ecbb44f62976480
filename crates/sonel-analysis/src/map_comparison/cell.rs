//! Estimates of two maps for one place, window and band.

use std::f64::consts::LN_10;

use super::moments::Moments;
use crate::comparison::welch;
use crate::estimate::StandardError;

/// Values of both maps in one cell.
#[derive(Debug, Clone, Default)]
pub(super) struct CellStatistics {
    /// Incident energy in A and in B over their batches.
    pub sides: [Moments; 2],
    /// B − A batch by batch, where both have the same random numbers.
    pub paired: Option<Moments>,
    /// Σ of the arrivals in units of a packet.
    pub arrived: [f64; 2],
    /// Σ of their squares.
    pub squared: [f64; 2],
    /// Packets that may have arrived.
    pub packets: [f64; 2],
}

impl CellStatistics {
    /// Effective number of arrivals in either map, by Kish's sample size [Kish1965]: where packets of both weigh `alike`,
    /// what is expected of maps of one scene, shared out by packets; else what each has.
    pub(super) fn arrivals(&self, alike: bool) -> [f64; 2] {
        let effective =
            |arrived: f64, squared: f64| if squared > 0.0 { arrived * arrived / squared } else { 0.0 };
        if !alike {
            return [0, 1].map(|side| effective(self.arrived[side], self.squared[side]));
        }
        let all = effective(self.arrived[0] + self.arrived[1], self.squared[0] + self.squared[1]);
        self.packets.map(|packets| all * packets / (self.packets[0] + self.packets[1]))
    }

    /// Standard error of B − A.
    pub(super) fn error(&self) -> Option<StandardError> {
        if let Some(paired) = &self.paired {
            return paired.error();
        }
        Some(welch(self.sides[0].error()?, self.sides[1].error()?))
    }

    /// B over A and its standard error [dB], by the first order of the logarithm.
    pub(super) fn level(&self, joint: StandardError) -> Option<(f64, f64)> {
        let [a, b] = self.sides.each_ref().map(Moments::mean);
        if a <= 0.0 || b <= 0.0 {
            return None;
        }
        let [var_a, var_b] =
            [self.sides[0].error()?, self.sides[1].error()?].map(|error| error.sigma * error.sigma);
        let covariance =
            if self.paired.is_some() { 0.5 * (var_a + var_b - joint.sigma * joint.sigma) } else { 0.0 };
        let variance = var_a / (a * a) + var_b / (b * b) - 2.0 * covariance / (a * b);
        Some((10.0 * libm::log10(b / a), 10.0 / LN_10 * variance.max(0.0).sqrt()))
    }
}
