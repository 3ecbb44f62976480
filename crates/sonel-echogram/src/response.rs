//! The response: energies, batches, arrivals and what is needed to read levels off them.

use std::ops::Range;

use crate::directions::{Directions, Lateral};
use crate::provenance::Provenance;

/// Means of cos² and of |cos| over all directions.
const DIFFUSE_SHARE: [f64; 2] = [1.0 / 3.0, 0.5];

/// Echograms of S sources at R receivers in B bands and T time bins, with G batch estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Nominal band centres, ascending [Hz].
    pub center_frequency_hz: Vec<f64>,
    /// T + 1 borders of the time bins, from the emission [s].
    pub time_edges_s: Vec<f64>,
    /// Names of the receivers.
    pub receiver_names: Vec<String>,
    /// Positions in the scene's axes [m].
    pub receiver_positions: Vec<[f64; 3]>,
    /// Directivities; empty where all are omnidirectional.
    pub receiver_directivities: Vec<ReceiverDirectivity>,
    /// Names of the sources.
    pub source_names: Vec<String>,
    /// Positions [m].
    pub source_positions: Vec<[f64; 3]>,
    /// Power level of every source and band, [S, B] [dB re 1 pW].
    pub source_power_level_db: Vec<f64>,
    /// [m/s].
    pub speed_of_sound: f64,
    /// ρc [Pa s/m].
    pub characteristic_impedance: f64,
    /// When direct sound arrives, or would arrive, [S, R] [s]; empty where that is distance / c.
    pub direct_times_s: Vec<f64>,
    /// Fluence per unit emitted energy, [S, R, B, T] [1/m²].
    pub energy: Vec<f64>,
    /// Batch estimates; none where the file holds none.
    pub batches: Option<Batches>,
    /// Energy after the last bin; none where the file has none.
    pub missing: Option<Missing>,
    /// Discrete arrivals.
    pub arrivals: Arrivals,
    /// Energies by direction; none where they were not asked for.
    pub directions: Option<Directions>,
    /// Tool version, seed, digests, options, shares per path class.
    pub provenance: Provenance,
}

/// Sensitivity of a receiver to sound from different directions.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverDirectivity {
    /// Name of the pattern.
    pub name: String,
    /// Unit vector of its axis.
    pub aim: [f64; 3],
    /// Mean energy sensitivity over all directions, 1 being that on the axis; above 0, at most 1.
    pub diffuse_sensitivity: f64,
}

impl ReceiverDirectivity {
    /// The same in every direction.
    #[must_use]
    pub fn omni() -> Self {
        Self { name: "omni".to_owned(), aim: [1.0, 0.0, 0.0], diffuse_sensitivity: 1.0 }
    }
}

/// Estimates of the batches, in coarser bins.
#[derive(Debug, Clone, PartialEq)]
pub struct Batches {
    /// Weight of every batch in the mean; they add up to one. [G]
    pub weight: Vec<f64>,
    /// Borders for every source and receiver, [S, R, `bins` + 1] [s].
    pub time_edges_s: Vec<f64>,
    /// Coarse bins.
    pub bins: usize,
    /// Fluence per unit emitted energy, [G, S, R, B, `bins`] [1/m²].
    pub energy: Vec<f32>,
    /// What discs and spheres of half the area would have found less `energy`, [G, S, R, B, `bins`] [1/m²]: minus half the
    /// bias of `energy`, which averages over their areas. Empty where nothing does.
    pub kernel_difference: Vec<f32>,
}

impl Batches {
    /// The same batches with other values.
    pub(crate) fn with(&self, energy: Vec<f32>, kernel_difference: Vec<f32>) -> Self {
        let (weight, time_edges_s) = (self.weight.clone(), self.time_edges_s.clone());
        Self { weight, time_edges_s, bins: self.bins, energy, kernel_difference }
    }
}

/// What arrives after the end of the run, from the energy that packets still carried then: its mean over the room.
#[derive(Debug, Clone, PartialEq)]
pub struct Missing {
    /// Fluence per unit emitted energy, [S, B] [1/m²].
    pub fluence: Vec<f64>,
    /// Rate at which the energy of all packets decayed at the end, [S, B] [1/s].
    pub decay_rate: Vec<f64>,
}

/// Kind of a discrete arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ArrivalKind {
    /// Direct sound.
    Direct = 0,
    /// Mirror reflections alone.
    ImageSource = 1,
    /// Over an edge.
    Edge = 2,
}

/// Discrete arrivals, A of them, side by side.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Arrivals {
    /// Index of the source. [A]
    pub source: Vec<u32>,
    /// Index of the receiver. [A]
    pub receiver: Vec<u32>,
    /// Travel time [s]. [A]
    pub time_s: Vec<f64>,
    /// Fluence per unit emitted energy, [A, B] [1/m²].
    pub energy: Vec<f64>,
    /// Unit vector from the receiver to where the sound seems to come from, [A, 3].
    pub direction: Vec<f64>,
    /// Number of reflections. [A]
    pub order: Vec<u32>,
    /// [`ArrivalKind`] as a number. [A]
    pub kind: Vec<u32>,
}

impl Response {
    /// Whether it was measured: its level is not known, and it is the only one.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        self.provenance.measured.is_some()
    }

    /// S.
    #[must_use]
    pub fn sources(&self) -> usize {
        self.source_names.len()
    }

    /// R.
    #[must_use]
    pub fn receivers(&self) -> usize {
        self.receiver_names.len()
    }

    /// B.
    #[must_use]
    pub fn bands(&self) -> usize {
        self.center_frequency_hz.len()
    }

    /// T.
    #[must_use]
    pub fn bins(&self) -> usize {
        self.time_edges_s.len().saturating_sub(1)
    }

    /// G; zero without batches.
    #[must_use]
    pub fn batch_count(&self) -> usize {
        self.batches.as_ref().map_or(0, |batches| batches.weight.len())
    }

    /// Energy of source `s` at receiver `r` in band `b`, per time bin [1/m²].
    #[must_use]
    pub fn echogram(&self, s: usize, r: usize, b: usize) -> &[f64] {
        let row = (s * self.receivers() + r) * self.bands() + b;
        &self.energy[row * self.bins()..(row + 1) * self.bins()]
    }

    /// Borders of the coarse bins of source `s` at receiver `r` [s].
    #[must_use]
    pub fn batch_edges(&self, s: usize, r: usize) -> Option<&[f64]> {
        let batches = self.batches.as_ref()?;
        let (row, width) = (s * self.receivers() + r, batches.bins + 1);
        batches.time_edges_s.get(row * width..(row + 1) * width)
    }

    /// Estimate of batch `g`, per coarse bin [1/m²].
    #[must_use]
    pub fn batch_echogram(&self, g: usize, s: usize, r: usize, b: usize) -> Option<&[f32]> {
        let batches = self.batches.as_ref()?;
        batches.energy.get(self.batch_row(batches, g, s, r, b))
    }

    /// What kernels of half the area would change in batch `g`, per coarse bin [1/m²]; [`None`] where nothing is known of it.
    #[must_use]
    pub fn kernel_difference(&self, g: usize, s: usize, r: usize, b: usize) -> Option<&[f32]> {
        let batches = self.batches.as_ref()?;
        batches.kernel_difference.get(self.batch_row(batches, g, s, r, b))
    }

    fn batch_row(&self, batches: &Batches, g: usize, s: usize, r: usize, b: usize) -> Range<usize> {
        let row = ((g * self.sources() + s) * self.receivers() + r) * self.bands() + b;
        row * batches.bins..(row + 1) * batches.bins
    }

    /// Fluence that receiver `r` is expected to take after the last bin from source `s` in band `b`, where sound comes from all directions
    /// as the mean over the room [1/m²], and its decay rate [1/s].
    #[must_use]
    pub fn missing(&self, s: usize, r: usize, b: usize) -> Option<(f64, f64)> {
        let (missing, at) = (self.missing.as_ref()?, s * self.bands() + b);
        let sensitivity = self.receiver_directivities.get(r).map_or(1.0, |found| found.diffuse_sensitivity);
        Some((missing.fluence.get(at)? * sensitivity, *missing.decay_rate.get(at)?))
    }

    /// The 95 % interval of what sound over edges that was not computed would change the level of source `s` at receiver `r` in band `b` by [dB]; of
    /// sources together, the widest.
    #[must_use]
    pub fn left_out_db(&self, s: usize, r: usize, b: usize) -> [f64; 2] {
        let sources = &self.provenance.sources;
        let own = if self.provenance.together.is_empty() { sources.get(s..=s) } else { Some(&sources[..]) };
        let changes = own.into_iter().flatten().filter_map(|of| of.edges.get(r)?.left_out_db.get(b));
        changes.fold([0.0, 0.0], |[least, most], [low, high]| [least.min(*low), most.max(*high)])
    }

    /// When the direct sound of source `s` reaches, or would reach, receiver `r` [s].
    #[must_use]
    pub fn direct_time(&self, s: usize, r: usize) -> f64 {
        if let Some(&time) = self.direct_times_s.get(s * self.receivers() + r) {
            return time;
        }
        let squares =
            self.source_positions[s].iter().zip(self.receiver_positions[r]).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt() / self.speed_of_sound
    }

    /// The response with one of its lateral energies in place of the energy: what follows the last bin is expected to come from all
    /// directions. [`None`] without directions.
    #[must_use]
    pub fn lateral(&self, which: usize) -> Option<Self> {
        let directions = self.directions.as_ref()?;
        let Lateral { energy, energy_batches, kernel_difference } = directions.lateral[which].clone();
        let batches = self.batches.as_ref().map(|batches| batches.with(energy_batches, kernel_difference));
        let missing = self.missing.as_ref().map(|Missing { fluence, decay_rate }| Missing {
            fluence: fluence.iter().map(|fluence| fluence * DIFFUSE_SHARE[which]).collect(),
            decay_rate: decay_rate.clone(),
        });
        Some(Self {
            receiver_directivities: Vec::new(),
            energy,
            batches,
            missing,
            arrivals: self.arrivals.lateral(which, &directions.lateral_axes, self.bands()),
            ..self.silent()
        })
    }

    /// The same axes, without any sound and without provenance.
    pub(crate) fn silent(&self) -> Self {
        Self {
            center_frequency_hz: self.center_frequency_hz.clone(),
            time_edges_s: self.time_edges_s.clone(),
            receiver_names: self.receiver_names.clone(),
            receiver_positions: self.receiver_positions.clone(),
            receiver_directivities: self.receiver_directivities.clone(),
            source_names: self.source_names.clone(),
            source_positions: self.source_positions.clone(),
            source_power_level_db: self.source_power_level_db.clone(),
            speed_of_sound: self.speed_of_sound,
            characteristic_impedance: self.characteristic_impedance,
            direct_times_s: self.direct_times_s.clone(),
            energy: Vec::new(),
            batches: None,
            missing: None,
            arrivals: Arrivals::default(),
            directions: None,
            provenance: Provenance::default(),
        }
    }
}

impl Arrivals {
    /// The same arrivals in `bands` bands with one of the lateral energies, of receivers with these lateral `axes`.
    fn lateral(&self, which: usize, axes: &[[f64; 3]], bands: usize) -> Self {
        let directions = self.receiver.iter().zip(self.direction.chunks_exact(3));
        let weights = directions.map(|(&receiver, towards)| {
            let cos: f64 = axes[receiver as usize].iter().zip(towards).map(|(axis, part)| axis * part).sum();
            if which == 0 { cos * cos } else { cos.abs() }
        });
        let rows = self.energy.chunks_exact(bands.max(1)).zip(weights);
        let energy = rows.flat_map(|(row, weight)| row.iter().map(move |energy| energy * weight)).collect();
        Self { energy, ..self.clone() }
    }
}
