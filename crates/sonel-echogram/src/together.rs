//! Several sources as one: loudspeakers of a system, an orchestra.
//!
//! Energies are added, weighted by the power of each source: sources that radiate the same signal interfere below the Schroeder frequency, which
//! energies do not know. A delay moves listed arrivals exactly; what else a bin holds is taken as spread over it. What a delay moves beyond
//! the last bin counts as energy after the record, as the mean over the receivers.

use sonel_acoustics::SourceChange;

use crate::error::ResponseError;
use crate::provenance::{Provenance, SourceRendering, SystemSource};
use crate::response::{Arrivals, Batches, Missing, Response};

/// Distance to a border within which rounding may put an arrival on its other side [s].
const BORDER: f64 = 1e-9;
/// Rounding of batches in single precision, relative to the energy of a bin.
const ROUNDING: f64 = 1e-6;

impl Response {
    /// Gain and delay of every source as its scene states them, 0 where it states none.
    ///
    /// # Errors
    /// When the provenance states a value that no scene can have.
    pub fn stated_changes(&self) -> Result<Vec<SourceChange>, ResponseError> {
        let stated = |s: usize| {
            let source = self.provenance.sources.get(s);
            let gain = source.and_then(|source| source.gain_db).unwrap_or(0.0);
            let delay = source.and_then(|source| source.delay_s).unwrap_or(0.0);
            let change = SourceChange { gain_db: gain, delay };
            let problem = || {
                format!(
                    "states a gain of {gain} dB and a delay of {delay} s of \"{}\"; {} … {} dB and {} … {} s are possible",
                    self.source_names[s],
                    SourceChange::GAINS_DB.start(),
                    SourceChange::GAINS_DB.end(),
                    SourceChange::DELAYS.start(),
                    SourceChange::DELAYS.end()
                )
            };
            change
                .is_valid()
                .then_some(change)
                .ok_or_else(|| ResponseError::Array { key: "metadata_json".to_owned(), problem: problem() })
        };
        (0..self.sources()).map(stated).collect()
    }

    /// The response with all sources as one, of which `changes` has one per source. The first direct sound is the direct sound, the position
    /// is that of the source whose direct sound is first at the first receiver. Lateral energies are left out.
    ///
    /// # Panics
    /// When there is not one change per source, or the response has no source.
    #[must_use]
    pub fn together(&self, changes: &[SourceChange]) -> Self {
        assert!(changes.len() == self.sources() && !changes.is_empty(), "one change per source");
        let mix = Mix::new(self, changes);
        let first = |r: usize| mix.first(r);
        let receivers = self.receivers();
        let direct_times_s: Vec<f64> = (0..receivers).map(|r| mix.direct_time(first(r), r)).collect();
        let mut energy = vec![0.0; receivers * self.bands() * self.bins()];
        let mut lost = vec![0.0; self.bands()];
        for r in 0..receivers {
            for (b, lost) in lost.iter_mut().enumerate() {
                let at = (r * self.bands() + b) * self.bins();
                *lost += mix.fine(r, b, &mut energy[at..at + self.bins()]) / receivers as f64;
            }
        }
        let together = self.source_names.iter().zip(changes).map(|(name, change)| SystemSource {
            source: name.clone(),
            gain_db: change.gain_db,
            delay_s: change.delay,
        });
        // They are in it, and are not applied again.
        let sources = self.provenance.sources.iter().map(|source| SourceRendering {
            gain_db: None,
            delay_s: None,
            ..source.clone()
        });
        let named = if receivers > 0 { first(0) } else { 0 };
        Self {
            source_names: vec![self.source_names.join(" + ")],
            source_positions: vec![self.source_positions[named]],
            source_power_level_db: mix.power.iter().map(|power| 10.0 * libm::log10(*power)).collect(),
            direct_times_s,
            energy,
            batches: self.batches.as_ref().map(|batches| mix.batches(batches)),
            missing: self.missing.as_ref().map(|missing| mix.missing(missing, &lost)),
            arrivals: mix.arrivals(),
            provenance: Provenance {
                together: together.collect(),
                sources: sources.collect(),
                ..self.provenance.clone()
            },
            ..self.silent()
        }
    }
}

struct Mix<'a> {
    response: &'a Response,
    changes: &'a [SourceChange],
    /// Power of all sources per band [pW].
    power: Vec<f64>,
    /// Share of every source in it, [S, B].
    shares: Vec<f64>,
}

impl<'a> Mix<'a> {
    fn new(response: &'a Response, changes: &'a [SourceChange]) -> Self {
        let (sources, bands) = (response.sources(), response.bands());
        let power = |s: usize, b: usize| {
            libm::pow(10.0, 0.1 * (response.source_power_level_db[s * bands + b] + changes[s].gain_db))
        };
        let all: Vec<f64> = (0..bands).map(|b| (0..sources).map(|s| power(s, b)).sum()).collect();
        let shares = (0..sources * bands).map(|at| power(at / bands, at % bands) / all[at % bands]).collect();
        Self { response, changes, power: all, shares }
    }

    fn share(&self, s: usize, b: usize) -> f64 {
        self.shares[s * self.response.bands() + b]
    }

    /// When the direct sound of source `s` reaches receiver `r`, with its delay [s].
    fn direct_time(&self, s: usize, r: usize) -> f64 {
        self.response.direct_time(s, r) + self.changes[s].delay
    }

    /// The source whose direct sound reaches receiver `r` first.
    fn first(&self, r: usize) -> usize {
        let sources = 0..self.response.sources();
        sources.min_by(|&a, &b| self.direct_time(a, r).total_cmp(&self.direct_time(b, r))).unwrap_or(0)
    }

    /// Adds all sources at receiver `r` in band `b` to `bins`; returns what a delay moves beyond the last.
    fn fine(&self, r: usize, b: usize, bins: &mut [f64]) -> f64 {
        let edges = &self.response.time_edges_s;
        let mut lost = 0.0;
        for (s, change) in self.changes.iter().enumerate() {
            let listed = self.listed(s, r, b);
            let energy = self.response.echogram(s, r, b);
            lost += move_into(edges, energy, &listed, change.delay, self.share(s, b), edges, bins);
        }
        lost
    }

    /// Times [s] and energies of the arrivals of source `s` at receiver `r` in band `b`.
    fn listed(&self, s: usize, r: usize, b: usize) -> Vec<[f64; 2]> {
        let arrivals = &self.response.arrivals;
        let pairs = arrivals.source.iter().zip(&arrivals.receiver).enumerate();
        let of = pairs.filter(|(_, (source, receiver))| (**source as usize, **receiver as usize) == (s, r));
        of.map(|(at, _)| [arrivals.time_s[at], arrivals.energy[at * self.response.bands() + b]]).collect()
    }

    /// Batches in the coarse bins of the source whose direct sound is first.
    fn batches(&self, stored: &Batches) -> Batches {
        let response = self.response;
        let (receivers, bands, count) = (response.receivers(), response.bands(), stored.weight.len());
        let edges = |r: usize| -> Vec<f64> {
            let first = self.first(r);
            let moved = response.batch_edges(first, r).unwrap_or_default();
            moved.iter().map(|edge| edge + self.changes[first].delay).collect()
        };
        let edges: Vec<Vec<f64>> = (0..receivers).map(edges).collect();
        let of_sources =
            |(r, b): (usize, usize)| (0..self.changes.len()).map(|s| self.listed(s, r, b)).collect();
        let rows = (0..receivers).flat_map(|r| (0..bands).map(move |b| (r, b)));
        let listed: Vec<Vec<Vec<[f64; 2]>>> = rows.clone().map(of_sources).collect();
        let rows = (0..count).flat_map(|g| rows.clone().map(move |(r, b)| (g, r, b)));
        let energy = rows.clone().flat_map(|(g, r, b)| {
            let listed = &listed[r * bands + b];
            self.coarse(r, b, &edges[r], listed, |s| response.batch_echogram(g, s, r, b))
        });
        let kernel_difference = rows.flat_map(|(g, r, b)| {
            self.coarse(r, b, &edges[r], &[], |s| response.kernel_difference(g, s, r, b))
        });
        let has_kernels = !stored.kernel_difference.is_empty();
        Batches {
            energy: energy.collect(),
            kernel_difference: if has_kernels { kernel_difference.collect() } else { Vec::new() },
            weight: stored.weight.clone(),
            time_edges_s: edges.concat(),
            bins: stored.bins,
        }
    }

    /// The `row` of every source at receiver `r` in band `b`, added between the borders `to`; `listed` arrivals of each source are in them.
    fn coarse<'r>(
        &self,
        r: usize,
        b: usize,
        to: &[f64],
        listed: &[Vec<[f64; 2]>],
        row: impl Fn(usize) -> Option<&'r [f32]>,
    ) -> Vec<f32> {
        let mut bins = vec![0.0; to.len().saturating_sub(1)];
        for (s, change) in self.changes.iter().enumerate() {
            let (Some(row), Some(from)) = (row(s), self.response.batch_edges(s, r)) else { continue };
            let energy: Vec<f64> = row.iter().map(|&energy| f64::from(energy)).collect();
            let listed = listed.get(s).map_or(&[][..], Vec::as_slice);
            move_into(from, &energy, listed, change.delay, self.share(s, b), to, &mut bins);
        }
        bins.into_iter().map(|bin| bin as f32).collect()
    }

    fn missing(&self, stored: &Missing, lost: &[f64]) -> Missing {
        let bands = self.response.bands();
        let of = |b: usize| -> (f64, f64) {
            let each = (0..self.changes.len()).map(|s| {
                (self.share(s, b) * stored.fluence[s * bands + b], stored.decay_rate[s * bands + b])
            });
            let each: Vec<(f64, f64)> = each.collect();
            let fluence: f64 = each.iter().map(|(fluence, _)| fluence).sum();
            // The mean life of what is missing; without any, that of the slowest source.
            let lives: f64 = each.iter().map(|(fluence, rate)| fluence / rate).sum();
            let slowest = each.iter().map(|(_, rate)| *rate).fold(f64::INFINITY, f64::min);
            (fluence + lost[b], if lives > 0.0 && lives.is_finite() { fluence / lives } else { slowest })
        };
        let (fluence, decay_rate) = (0..bands).map(of).unzip();
        Missing { fluence, decay_rate }
    }

    fn arrivals(&self) -> Arrivals {
        let (all, bands) = (&self.response.arrivals, self.response.bands());
        let end = self.response.time_edges_s.last().copied().unwrap_or(0.0);
        let time = |at: usize| all.time_s[at] + self.changes[all.source[at] as usize].delay;
        let kept: Vec<usize> = (0..all.source.len()).filter(|&at| time(at) < end).collect();
        let energies = kept.iter().flat_map(|&at| {
            (0..bands).map(move |b| all.energy[at * bands + b] * self.share(all.source[at] as usize, b))
        });
        Arrivals {
            source: vec![0; kept.len()],
            receiver: kept.iter().map(|&at| all.receiver[at]).collect(),
            time_s: kept.iter().map(|&at| time(at)).collect(),
            energy: energies.collect(),
            direction: kept.iter().flat_map(|&at| all.direction[3 * at..3 * at + 3].to_vec()).collect(),
            order: kept.iter().map(|&at| all.order[at]).collect(),
            kind: kept.iter().map(|&at| all.kind[at]).collect(),
        }
    }
}

/// Adds `share` times the `energy` between the borders `from`, moved by `delay` [s], to `bins` between the borders `to`: `listed` arrivals, times
/// and energies, are moved exactly and the rest is spread over its bins. What would come before the first border stays in the first bin; returns
/// what lies beyond the last.
fn move_into(
    from: &[f64],
    energy: &[f64],
    listed: &[[f64; 2]],
    delay: f64,
    share: f64,
    to: &[f64],
    bins: &mut [f64],
) -> f64 {
    let mut rest = energy.to_vec();
    let mut lost = 0.0;
    for &[time, amount] in listed {
        // Rounding may have put an arrival next to a border on its other side.
        let candidates = [time, time - BORDER, time + BORDER].map(|time| holder(from, time));
        let holds = |bin: &usize| rest[*bin] >= amount * (1.0 - ROUNDING);
        let Some(bin) = candidates.into_iter().flatten().find(holds).or(candidates[0]) else { continue };
        let taken = amount.min(rest[bin].max(0.0));
        rest[bin] -= taken;
        match holder(to, time + delay) {
            Some(bin) => bins[bin] += share * taken,
            None => lost += share * taken,
        }
    }
    for (pair, amount) in from.windows(2).zip(&rest) {
        lost += spread(pair[0] + delay, pair[1] + delay, share * amount, to, bins);
    }
    lost
}

/// Spreads `amount` over the time from `begin` to `end` [s]; returns what lies behind the last border.
fn spread(begin: f64, end: f64, amount: f64, to: &[f64], bins: &mut [f64]) -> f64 {
    let Some(mut bin) = holder(to, begin) else { return amount };
    let width = end - begin;
    if width <= 0.0 {
        bins[bin] += amount;
        return 0.0;
    }
    let mut at = begin;
    while at < end {
        let Some(held) = bins.get_mut(bin) else { return amount * (end - at) / width };
        let until = to[bin + 1].min(end);
        *held += amount * (until - at).max(0.0) / width;
        (at, bin) = (at.max(until), bin + 1);
    }
    0.0
}

/// The bin that holds `time`, the first also what is before it; none behind the last.
fn holder(edges: &[f64], time: f64) -> Option<usize> {
    let bin = edges.partition_point(|&edge| edge <= time).saturating_sub(1);
    (bin + 1 < edges.len()).then_some(bin)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sources of 90 dB with 1 and 2 in every bin of 0.1 s, and a listed arrival of 5 at 0.05 s of the second.
    fn response() -> Response {
        let mut energy: Vec<f64> = [[1.0; 10], [2.0; 10]].concat();
        energy[10] += 5.0;
        Response {
            center_frequency_hz: vec![1000.0],
            time_edges_s: (0..=10).map(|edge| 0.1 * f64::from(edge)).collect(),
            receiver_names: vec!["seat".into()],
            receiver_positions: vec![[0.0; 3]],
            receiver_directivities: Vec::new(),
            source_names: vec!["left".into(), "right".into()],
            source_positions: vec![[3.43, 0.0, 0.0], [6.86, 0.0, 0.0]],
            source_power_level_db: vec![90.0; 2],
            speed_of_sound: 343.0,
            characteristic_impedance: 412.0,
            direct_times_s: Vec::new(),
            batches: Some(Batches {
                weight: vec![0.5; 2],
                time_edges_s: [(0..=10).map(|edge| 0.1 * f64::from(edge)).collect::<Vec<_>>(); 1]
                    .concat()
                    .repeat(2),
                bins: 10,
                energy: energy.repeat(2).iter().map(|e| *e as f32).collect(),
                kernel_difference: Vec::new(),
            }),
            energy,
            missing: Some(Missing { fluence: vec![0.1; 2], decay_rate: vec![10.0; 2] }),
            arrivals: Arrivals {
                source: vec![1],
                receiver: vec![0],
                time_s: vec![0.05],
                energy: vec![5.0],
                direction: vec![1.0, 0.0, 0.0],
                order: vec![0],
                kind: vec![0],
            },
            directions: None,
            provenance: Provenance::default(),
        }
    }

    fn total(response: &Response) -> f64 {
        response.energy.iter().sum::<f64>()
            + response.missing.as_ref().map_or(0.0, |missing| missing.fluence[0])
    }

    #[test]
    fn equal_sources_have_half_of_each_energy_and_twice_the_power() {
        let sum = response().together(&[SourceChange::default(); 2]);
        assert!((sum.source_power_level_db[0] - 93.0103).abs() < 1e-4);
        assert!((sum.energy[0] - 4.0).abs() < 1e-12 && (sum.energy[5] - 1.5).abs() < 1e-12);
        assert!((sum.direct_times_s[0] - 0.01).abs() < 1e-12);
        let stated = Provenance { together: Vec::new(), ..sum.provenance.clone() };
        assert!(stated == Provenance::default() && sum.provenance.together.len() == 2);
        assert!((sum.arrivals.energy[0] - 2.5).abs() < 1e-12);
        let batches = sum.batches.expect("batches");
        assert!((batches.energy[0] - 4.0).abs() < 1e-6 && (batches.energy[15] - 1.5).abs() < 1e-6);
    }

    /// The same as the next test, but stated by the scene. What was applied is not stated any more.
    #[test]
    fn gains_and_delays_of_the_scene_are_read_once() {
        let source = SourceRendering { mirror_order: 3, ..SourceRendering::default() };
        let late = SourceRendering { gain_db: Some(-10.0), delay_s: Some(0.055), ..source.clone() };
        let provenance = Provenance { sources: vec![source.clone(), late], ..Provenance::default() };
        let response = Response { provenance, ..response() };
        let changes = response.stated_changes().expect("valid");
        assert_eq!(changes, [SourceChange::default(), SourceChange { gain_db: -10.0, delay: 0.055 }]);
        let sum = response.together(&changes);
        assert_eq!(sum.stated_changes().expect("valid"), [SourceChange::default()]);
        assert_eq!(sum.provenance.sources[1], source);
        let second = SystemSource { source: "right".to_owned(), gain_db: -10.0, delay_s: 0.055 };
        assert_eq!(sum.provenance.together[1], second);
    }

    #[test]
    fn impossible_gains_and_delays_in_the_provenance_are_refused() {
        let none = SourceRendering::default;
        for wrong in [
            SourceRendering { gain_db: Some(1e9), ..none() },
            SourceRendering { delay_s: Some(-1.0), ..none() },
        ] {
            let provenance = Provenance { sources: vec![none(), wrong], ..Provenance::default() };
            let error = Response { provenance, ..response() }.stated_changes().expect_err("impossible");
            assert!(error.to_string().contains("of \"right\""), "{error}");
        }
        assert_eq!(response().stated_changes().expect("nothing stated"), [SourceChange::default(); 2]);
    }

    /// 10 dB less of the second leave 1/11 of the power; 55 ms put its arrival into the second bin, and 0.55 of a bin behind the end.
    #[test]
    fn gains_and_delays_are_those_of_the_sources() {
        let change = SourceChange { gain_db: -10.0, delay: 0.055 };
        let sum = response().together(&[SourceChange::default(), change]);
        let (loud, soft) = (10.0 / 11.0, 1.0 / 11.0);
        assert!((sum.energy[0] - (loud + 0.45 * 2.0 * soft)).abs() < 1e-9, "{}", sum.energy[0]);
        assert!((sum.energy[1] - (loud + 7.0 * soft)).abs() < 1e-9, "{}", sum.energy[1]);
        assert!((sum.arrivals.time_s[0] - 0.105).abs() < 1e-12);
        let missing = sum.missing.as_ref().expect("a tail").fluence[0];
        assert!((missing - 0.1 - 0.55 * 2.0 * soft).abs() < 1e-9, "{missing}");
        let expected = loud * 10.1 + soft * 25.1;
        assert!((total(&sum) - expected).abs() < 1e-9, "nothing is lost");
    }
}
