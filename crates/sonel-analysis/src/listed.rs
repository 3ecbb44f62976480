//! Listed arrivals: the part of an echogram whose times are known exactly.
//!
//! Direct sound, image sources and paths over edges that a response lists are part of the energy of its bins. A decay curve takes them
//! out of the bins and falls by a step at the time of each, so limits between early and late divide them exactly, whatever the width of
//! the bins. What is left of a bin is spread over it.

use sonel_echogram::Response;

/// A discrete arrival in one band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrival {
    /// Travel time from the emission [s].
    pub time: f64,
    /// Part of the energy of the bin that holds `time`, in the unit of the echogram.
    pub energy: f64,
}

/// Distance to a border within which rounding may put an arrival on its other side [s]: 0.3 µm of path.
const BORDER: f64 = 1e-9;
/// Rounding of batches in single precision, relative to the energy of a bin.
const ROUNDING: f64 = 1e-6;

/// Indices of the arrivals of every source at every receiver, [S, R].
pub struct Index(Vec<Vec<usize>>);

impl Index {
    /// Listed arrivals of `response`.
    #[must_use]
    pub fn new(response: &Response) -> Self {
        let mut rows = vec![Vec::new(); response.sources() * response.receivers()];
        let arrivals = &response.arrivals;
        for (index, (&source, &receiver)) in arrivals.source.iter().zip(&arrivals.receiver).enumerate() {
            rows[source as usize * response.receivers() + receiver as usize].push(index);
        }
        for row in &mut rows {
            row.sort_by(|&a, &b| arrivals.time_s[a].total_cmp(&arrivals.time_s[b]));
        }
        Self(rows)
    }

    /// Arrivals of source `s` at receiver `r` in band `b`, ascending in time.
    #[must_use]
    pub fn of(&self, response: &Response, s: usize, r: usize, b: usize) -> Vec<Arrival> {
        let arrivals = &response.arrivals;
        let arrival = |&index: &usize| Arrival {
            time: arrivals.time_s[index],
            energy: arrivals.energy[index * response.bands() + b],
        };
        self.0[s * response.receivers() + r].iter().map(arrival).collect()
    }
}

/// Takes `arrivals` out of the bins of `energy` between `times` since the direct sound at `direct_time` [s], and returns them with times
/// since the direct sound. No bin gives more than it holds.
#[must_use]
pub fn take(arrivals: &[Arrival], direct_time: f64, times: &[f64], energy: &mut [f64]) -> Vec<Arrival> {
    let taken = arrivals.iter().filter_map(|arrival| {
        let time = (arrival.time - direct_time).max(0.0);
        let held = &mut energy[bin(times, energy, time, arrival.energy)?];
        let taken = arrival.energy.min(*held);
        *held -= taken;
        (taken > 0.0).then_some(Arrival { time, energy: taken })
    });
    taken.collect()
}

/// The bin that holds `time`; next to a border the one that has the `wanted` energy. [`None`] behind the last bin.
fn bin(times: &[f64], energy: &[f64], time: f64, wanted: f64) -> Option<usize> {
    let of = |time: f64| times.partition_point(|&border| border <= time).checked_sub(1);
    let candidates = [time, time - BORDER, time + BORDER].into_iter().filter_map(of);
    let mut candidates = candidates.filter(|&bin| bin < energy.len());
    let first = candidates.next()?;
    let holds = |bin: usize| energy[bin] >= wanted * (1.0 - ROUNDING);
    if holds(first) { Some(first) } else { candidates.find(|&bin| holds(bin)).or(Some(first)) }
}
