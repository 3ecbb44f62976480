//! Bands in which single modes of the room decide, which energies know nothing of.
//!
//! Below f = 2000 √(T/V) fewer than three modes overlap at any frequency: levels and decays differ from mode to mode and from place to place,
//! by more than any interval of energies says.
//!
//! References: [Schroeder1962] (docs/references.md).

use std::fmt;

use sonel_acoustics::schroeder_frequency;

use crate::parameter::Parameter;
use crate::receiver::ReceiverParameters;

/// Bands below the Schroeder frequency of a room.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalBands {
    /// Nominal centres of the bands [Hz], ascending; at least one.
    pub center_frequencies_hz: Vec<f64>,
    /// The highest Schroeder frequency of these bands [Hz].
    pub schroeder_frequency_hz: f64,
}

impl ModalBands {
    /// The bands of `parameters` whose centre is below the Schroeder frequency of their own T20, the mean of all receivers, in a room of
    /// `volume` [m³]; [`None`] where there is no such band. Bands without T20 are left out.
    #[must_use]
    pub fn of(parameters: &[ReceiverParameters], volume: f64) -> Option<Self> {
        let bands = parameters.first()?.bands.iter().enumerate();
        let limits = bands.filter_map(|(b, band)| {
            let times: Vec<f64> = parameters
                .iter()
                .filter_map(|receiver| receiver.bands[b].parameter(Parameter::T20).as_ref().ok())
                .map(|time| time.value)
                .collect();
            let mean = times.iter().sum::<f64>() / times.len() as f64;
            (!times.is_empty()).then(|| (band.center_frequency_hz, schroeder_frequency(mean, volume)))
        });
        let below: Vec<(f64, f64)> = limits.filter(|(center, limit)| center < limit).collect();
        let highest = below.iter().map(|(_, limit)| *limit).reduce(f64::max)?;
        let center_frequencies_hz = below.into_iter().map(|(center, _)| center).collect();
        Some(Self { center_frequencies_hz, schroeder_frequency_hz: highest })
    }
}

impl fmt::Display for ModalBands {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let centers: Vec<String> = self.center_frequencies_hz.iter().map(f64::to_string).collect();
        let verb = if centers.len() == 1 { "is" } else { "are" };
        write!(
            f,
            "{} Hz {verb} below the Schroeder frequency ({:.0} Hz): single modes dominate there, intervals do not include them",
            centers.join(", "),
            self.schroeder_frequency_hz
        )
    }
}
