//! What packets carry past the balls of receivers, and what of it crossed them.
//!
//! Where none of the packets crossed a ball, their spread says nothing of how many might have: with fewer than three to be expected,
//! none is seen in one run of twenty [HanleyLippmanHand1983]. The interval reaches to what three of the strongest would have brought: of those
//! that passed at some distance, which know of the partitions between, or of all where none did.
//! Beams are rare where a ball is small or far from what is lit, whatever else crosses it: every kind of path is counted apart.
//!
//! References: docs/physics.md §7, docs/references.md.

use sonel_map::{BandValues, Lanes, lanes_of};

use crate::ball::BeamKind;

/// Packets that may be expected where none is seen: with more, one is seen in 19 of 20 runs.
const MOST_UNSEEN: f64 = 3.0;

/// Counted at some receivers, by kind of path.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Crossings {
    lanes: usize,
    kinds: [BeamCount; BeamKind::ALL.len()],
}

#[derive(Debug, Clone, PartialEq)]
struct BeamCount {
    /// The most that a packet carries, per band.
    strongest: Vec<Lanes>,
    /// The same of those that passed each receiver nearby.
    nearby: Vec<Lanes>,
    /// Crossings of the ball of each receiver.
    crossed: Vec<Lanes>,
}

impl Crossings {
    /// Nothing yet.
    #[must_use]
    pub(crate) fn new(receivers: usize, bands: usize) -> Self {
        let lanes = lanes_of(bands);
        let nothing = |count: usize| vec![Lanes::ZERO; count * lanes];
        Self {
            lanes,
            kinds: BeamKind::ALL.map(|_| BeamCount {
                strongest: nothing(1),
                nearby: nothing(receivers),
                crossed: nothing(receivers),
            }),
        }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        for BeamCount { strongest, nearby, crossed } in &mut self.kinds {
            strongest.iter_mut().chain(nearby).chain(crossed).for_each(|lanes| *lanes = Lanes::ZERO);
        }
    }

    /// Counts a packet that carries `energy`, whether it crosses any ball or none.
    #[inline]
    pub(crate) fn pass(&mut self, beam: BeamKind, energy: &[Lanes]) {
        raise(&mut self.kinds[beam as usize].strongest, energy, 1.0);
    }

    /// Counts one that may pass `receiver` nearby; whether it does is asked where it would matter.
    pub(crate) fn pass_near(
        &mut self,
        beam: BeamKind,
        receiver: usize,
        energy: &[Lanes],
        is_near: impl FnOnce() -> bool,
    ) {
        let nearby =
            &mut self.kinds[beam as usize].nearby[receiver * self.lanes..(receiver + 1) * self.lanes];
        let is_more = |(nearby, energy)| energy > nearby;
        if nearby.values().zip(energy.values()).any(is_more) && is_near() {
            raise(nearby, energy, 1.0);
        }
    }

    /// Counts one that crosses the ball of `receiver`.
    pub(crate) fn cross(&mut self, beam: BeamKind, receiver: usize, energy: &[Lanes]) {
        self.kinds[beam as usize].crossed[receiver * self.lanes..][..self.lanes].add(energy);
    }

    /// Adds what a batch of `weight` counted at the receivers from `first` on.
    pub(crate) fn add(&mut self, first: usize, other: &Self, weight: f64) {
        for (mine, other) in self.kinds.iter_mut().zip(&other.kinds) {
            mine.crossed[first * self.lanes..].add(&other.crossed);
            raise(&mut mine.nearby[first * self.lanes..], &other.nearby, weight);
            raise(&mut mine.strongest, &other.strongest, weight);
        }
    }

    /// Multiplies the energy of packets by `factor`.
    pub(crate) fn scale(&mut self, factor: f64) {
        for BeamCount { strongest, nearby, .. } in &mut self.kinds {
            strongest.scale(factor);
            nearby.scale(factor);
        }
    }

    /// The most that paths may bring to `receiver` of kinds of which none crossed its ball, per band, where one would bring on average
    /// `fluence` of what it carries [1/m²].
    #[must_use]
    pub(crate) fn unseen(&self, receiver: usize, fluence: impl Fn(BeamKind) -> f64) -> Vec<Lanes> {
        let mut unseen = vec![Lanes::ZERO; self.lanes];
        let of_receiver = receiver * self.lanes..(receiver + 1) * self.lanes;
        for (beam, BeamCount { strongest, nearby, crossed }) in BeamKind::ALL.into_iter().zip(&self.kinds) {
            let (nearby, crossed) = (&nearby[of_receiver.clone()], &crossed[of_receiver.clone()]);
            let most = MOST_UNSEEN * fluence(beam);
            for (at, unseen) in unseen.iter_mut().enumerate() {
                let likely = nearby[at].select(nearby[at], strongest[at]);
                *unseen += crossed[at].select(Lanes::ZERO, likely * most);
            }
        }
        unseen
    }
}

/// Raises `largest` to `weight` times `energy`, where that is more.
#[inline]
fn raise(largest: &mut [Lanes], energy: &[Lanes], weight: f64) {
    for (largest, &energy) in largest.iter_mut().zip(energy) {
        *largest = largest.max(energy * weight);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_map::to_lanes;

    #[test]
    fn three_of_the_strongest_stand_for_what_no_receiver_saw() {
        let mut batch = Crossings::new(2, 2);
        batch.pass(BeamKind::Refracted, &to_lanes([0.5, 0.1]));
        batch.pass(BeamKind::Refracted, &to_lanes([0.2, 0.25]));
        batch.cross(BeamKind::Refracted, 1, &to_lanes([0.2]));
        let mut all = Crossings::new(3, 2);
        all.add(1, &batch, 0.25);
        let fluence = |beam: BeamKind| if beam == BeamKind::Refracted { 2.0 } else { 1e9 };
        assert_eq!(all.unseen(1, fluence), to_lanes([0.75, 0.375]));
        assert_eq!(all.unseen(2, fluence), to_lanes([0.0, 0.375]), "one crossed in the first band");
        all.pass_near(BeamKind::Refracted, 1, &to_lanes([0.5]), || false);
        all.pass_near(BeamKind::Refracted, 1, &to_lanes([0.0625]), || true);
        assert_eq!(all.unseen(1, fluence), to_lanes([0.375, 0.375]), "one passed nearby");
    }
}
