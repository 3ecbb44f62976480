//! From echograms and arrivals to pulses.
//!
//! A listed arrival is one pulse at its time with the root of its energy in every band. It is positive, as sound is that no wall or hard walls
//! reflected: a response does not hold the sign of a reflection factor.
//!
//! What the bins hold beside the arrivals comes with plane waves that all receivers share ([`crate::plane_waves`]), one pulse each. A wave has the energy of
//! the part of the bin that it stands for: E/Δ of a bin of width Δ over the waves per second. Their signs are random, so that the
//! expected energy of a sum is the sum of the energies, as the echogram has it.
//!
//! An arrival has its direction, and the pulses of a bin have those of their waves; where the response has directions, moved so that their mean is that
//! of the bin, over all bands ([`crate::ambisonics`]). Delays between receivers stay those of the waves: noise in the mean directions of two
//! receivers does not take their pulses apart.

use glam::DVec3;
use sonel_echogram::Response;

use crate::SoundError;
use crate::ambisonics::Lean;
use crate::plane_waves::{PlaneWave, SPARSEST};

/// Squared amplitude of a pulse for a fluence of 1/m²: 4π, so that direct sound is 1/r.
const PRESSURE_OF_FLUENCE: f64 = 4.0 * std::f64::consts::PI;
/// Sums in another order differ by less than this part of all that they sum.
pub(crate) const ROUNDING: f64 = 1e-9;

/// What a time bin holds beside listed arrivals.
#[derive(Debug, Clone, PartialEq)]
pub struct Late {
    /// First time [s].
    pub begin: f64,
    /// Last time [s].
    pub end: f64,
    /// Sum of squared amplitudes in every band. [B]
    pub squared: Vec<f64>,
    /// Sum of squared amplitudes times their directions, over all bands; zero where the response has no directions.
    pub moment: DVec3,
}

/// Pulses of one source at one receiver.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pulses {
    /// Time of each, from the emission on [s]. [P]
    pub time: Vec<f64>,
    /// Its amplitude in every band is this times its shape. [P]
    pub gain: Vec<f64>,
    /// Number of its shape: each listed arrival has its own, late sound that of its time bin; pulses of one shape are neighbours. [P]
    pub shape: Vec<u32>,
    /// Whether it is spread in time ([`crate::plane_waves`]). [P]
    pub is_spread: Vec<bool>,
    /// Amplitudes in every band, relative to a free field at 1 m. [shapes, B]
    pub shapes: Vec<f64>,
    /// How many of them are listed arrivals: the first ones.
    pub listed: usize,
    /// What the others are to be drawn from, one for each time bin; none where they are drawn. [T]
    pub late: Vec<Late>,
    /// Unit vector towards where each comes from, in the axes of the scene; of late sound of a response without directions that of its wave. [P]
    pub direction: Vec<DVec3>,
}

impl Pulses {
    /// The listed arrivals alone, with the late sound that waves are to be drawn from.
    ///
    /// # Errors
    /// When listed arrivals are not part of the echogram.
    pub(crate) fn of_arrivals(response: &Response, (s, r): (usize, usize)) -> Result<Self, SoundError> {
        let mut pulses = Self::default();
        let echograms: Vec<&[f64]> =
            (0..response.bands()).map(|band| response.echogram(s, r, band)).collect();
        let mut rest: Vec<Vec<f64>> = echograms.iter().map(|echogram| echogram.to_vec()).collect();
        let mut moment = moments(response, (s, r));
        pulses.add_arrivals(response, (s, r), (&mut rest, &mut moment))?;
        // What rounding leaves of a bin is no sound.
        for (rest, echogram) in rest.iter_mut().zip(&echograms) {
            let pairs = rest.iter_mut().zip(*echogram);
            pairs.filter(|(rest, whole)| **rest < ROUNDING * **whole).for_each(|(rest, _)| *rest = 0.0);
        }
        pulses.listed = pulses.time.len();
        let direct = response.direct_time(s, r);
        let late = |(bin, edges): (usize, &[f64])| {
            let (begin, end) = (edges[0], edges[1]);
            // Nothing is scattered to the receiver before its direct sound, behind which a wave has to fit.
            let begin = if direct < end { begin.max(direct.min(end - 1.0 / SPARSEST)) } else { begin };
            let squared = rest.iter().map(|band| PRESSURE_OF_FLUENCE * band[bin]).collect();
            let moment = moment.get(bin).map_or(DVec3::ZERO, |moment| PRESSURE_OF_FLUENCE * *moment);
            Late { begin, end, squared, moment }
        };
        pulses.late = response.time_edges_s.windows(2).enumerate().map(late).collect();
        Ok(pulses)
    }

    /// Adds the waves of source `s` at a place, whose energies are the weighted sum of those of one or more receivers.
    pub(crate) fn add_waves(
        &mut self,
        response: &Response,
        s: usize,
        (place, late): (DVec3, &[(f64, &[Late])]),
        waves: &[PlaneWave],
    ) {
        let edges = &response.time_edges_s;
        let offset = (place - DVec3::from_array(response.source_positions[s])) / response.speed_of_sound;
        let bands = response.bands();
        let first = self.shapes.len() / bands;
        // When late sound begins in each bin, and how its directions lean. Nothing is scattered to the place before the earliest direct sound.
        let mut known = Vec::with_capacity(response.bins());
        for bin in 0..response.bins() {
            let (mut moment, mut begin) = (DVec3::ZERO, f64::INFINITY);
            let mut squared = vec![0.0; bands];
            for (weight, late) in late.iter().filter(|(weight, _)| *weight > 0.0) {
                let late = &late[bin];
                let share = weight / (late.end - late.begin);
                squared.iter_mut().zip(&late.squared).for_each(|(sum, squared)| *sum += share * squared);
                moment += share * late.moment;
                begin = begin.min(late.begin);
            }
            let all: f64 = squared.iter().sum();
            let lean = (moment != DVec3::ZERO).then(|| Lean::towards(moment / all));
            known.push((if all > 0.0 { begin } else { f64::INFINITY }, lean));
            self.shapes.extend(squared.into_iter().map(f64::sqrt));
        }
        // By bin, there the spread ones behind the others.
        let mut found = vec![Vec::new(); 2 * known.len()];
        for wave in waves {
            let time = wave.time - wave.towards.dot(offset);
            let Some(bin) = edges.partition_point(|edge| *edge <= time).checked_sub(1) else { continue };
            if known.get(bin).is_some_and(|(begin, _)| time >= *begin) {
                found[2 * bin + usize::from(wave.is_spread)].push((time, wave));
            }
        }
        for (number, (time, wave)) in
            found.into_iter().enumerate().flat_map(|(n, all)| all.into_iter().map(move |one| (n, one)))
        {
            self.time.push(time);
            self.gain.push(wave.sign / wave.density.sqrt());
            self.shape.push((first + number / 2) as u32);
            self.is_spread.push(wave.is_spread);
            self.direction.push(known[number / 2].1.map_or(wave.towards, |lean| lean.of(wave.towards)));
        }
    }

    /// Adds the listed arrivals and takes their energy out of `rest`, the echogram of every band, and out of the moments.
    fn add_arrivals(
        &mut self,
        response: &Response,
        (s, r): (usize, usize),
        (rest, moment): (&mut [Vec<f64>], &mut [DVec3]),
    ) -> Result<(), SoundError> {
        let (arrivals, bands) = (&response.arrivals, response.bands());
        for a in 0..arrivals.source.len() {
            if (arrivals.source[a] as usize, arrivals.receiver[a] as usize) != (s, r) {
                continue;
            }
            let (time, energy) = (arrivals.time_s[a], &arrivals.energy[a * bands..(a + 1) * bands]);
            let bin = bin_holding(response, (s, r), time, energy, rest).ok_or_else(|| {
                let receiver = response.receiver_names[r].clone();
                SoundError::ArrivalWithoutEnergy { receiver, time_s: time }
            })?;
            for (band, energy) in rest.iter_mut().zip(energy) {
                band[bin] -= energy;
            }
            self.time.push(time);
            // A pulse of amplitude a has the spectrum a² at all frequencies, so that its band mean is 4πF whatever the width of the band.
            self.shape.push(self.gain.len() as u32);
            self.gain.push(1.0);
            self.is_spread.push(false);
            self.shapes.extend(energy.iter().map(|energy| (PRESSURE_OF_FLUENCE * energy).sqrt()));
            let direction = DVec3::from_slice(&arrivals.direction[3 * a..]);
            self.direction.push(direction);
            if let Some(moment) = moment.get_mut(bin) {
                *moment -= direction * energy.iter().sum::<f64>();
            }
        }
        Ok(())
    }
}

/// Moments of all bins, summed over the bands; none where the response has no directions.
fn moments(response: &Response, (s, r): (usize, usize)) -> Vec<DVec3> {
    let Some(directions) = &response.directions else { return Vec::new() };
    let (bands, bins) = (response.bands(), response.bins());
    let mut sums = vec![DVec3::ZERO; bins];
    let first = (s * response.receivers() + r) * bands;
    for band in first..first + bands {
        let of_band = directions.moment[3 * band * bins..3 * (band + 1) * bins].chunks_exact(3);
        for (sum, moment) in sums.iter_mut().zip(of_band) {
            *sum += DVec3::from_slice(moment);
        }
    }
    sums
}

/// The bin of an arrival: that of its time or, at a border, the neighbour it was rounded to; the one that holds its energy.
fn bin_holding(
    response: &Response,
    (s, r): (usize, usize),
    time: f64,
    energy: &[f64],
    rest: &[Vec<f64>],
) -> Option<usize> {
    let edges = &response.time_edges_s;
    let candidates = [time, time * (1.0 - ROUNDING), time * (1.0 + ROUNDING)];
    let bins = candidates.map(|time| edges.partition_point(|edge| *edge <= time).saturating_sub(1));
    // Of a bin with a strong arrival the others leave what rounding makes of all of it.
    let holds = |bin: &usize| {
        let bands = rest.iter().enumerate().zip(energy);
        bands
            .map(|((band, rest), energy)| (rest.get(*bin), response.echogram(s, r, band).get(*bin), energy))
            .all(|(rest, whole, energy)| {
                rest.zip(whole).is_some_and(|(rest, whole)| rest + ROUNDING * whole >= *energy)
            })
    };
    bins.into_iter().find(holds)
}
