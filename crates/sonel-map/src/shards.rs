//! The part of a run that several shards make together, and errors of the set.
//!
//! Shard I of N stands for the interval from (I − 1)/N to I/N of the run, and holds the chunks between the borders of
//! that interval. Shards may be of different N; joined they make a shard whose interval is theirs, where there is one:
//! shards 3 and 4 of 8 make 2 of 4, shards 2 and 3 of 8 make none.

use std::cmp::Ordering;
use std::ops::Range;

use crate::emission::EmissionLayout;
use crate::header::ShardRange;

/// Faults of a set of shards; they are named by their positions in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Fault {
    /// Two shards hold these emissions of every source.
    Overlap(usize, usize, Range<u64>),
    /// No shard holds these emissions, and they are needed.
    Missing(Range<u64>),
}

/// Shards have their places in the run that the layout numbers.
impl EmissionLayout {
    /// Whether `shard` holds any of `emissions`.
    pub(crate) fn holds_some(&self, shard: ShardRange, emissions: &Range<u64>) -> bool {
        let held = self.emissions(shard.chunks(self.chunks()));
        held.start.max(emissions.start) < held.end.min(emissions.end)
    }

    /// The shard that `shards` make together.
    ///
    /// # Errors
    /// All faults: overlaps, and what is missing to the whole run. Shards that neither overlap nor leave gaps may miss the
    /// rest, where they make a shard that has a name.
    pub(crate) fn union(&self, shards: &[ShardRange]) -> Result<ShardRange, Vec<Fault>> {
        let order = order(shards);
        let (Some(&first), Some(&last)) = (order.first(), order.last()) else { return Ok(ShardRange::WHOLE) };
        let all = self.chunks();
        let (mut faults, mut gaps) = (Vec::new(), Vec::new());
        let (mut reached, mut holder) = (shards[first].chunks(all).start, first);
        let from = reached;
        for &index in &order {
            let chunks = shards[index].chunks(all);
            if index != first && !chunks.is_empty() && chunks.start < reached {
                let both = self.emissions(chunks.start..chunks.end.min(reached));
                faults.push(Fault::Overlap(holder, index, both));
            }
            if chunks.start > reached {
                gaps.push(reached..chunks.start);
            }
            if chunks.end > reached {
                (reached, holder) = (chunks.end, index);
            }
        }
        let union = if (from, reached) == (0, all) {
            Some(ShardRange::WHOLE)
        } else {
            interval(shards[first], shards[last])
        };
        if union.is_none() || !gaps.is_empty() || !faults.is_empty() {
            gaps.insert(0, 0..from);
            gaps.push(reached..all);
        }
        gaps.retain(|gap| !gap.is_empty());
        faults.extend(gaps.into_iter().map(|gap| Fault::Missing(self.emissions(gap))));
        union.filter(|_| faults.is_empty()).ok_or(faults)
    }
}

/// Positions of `shards` in the order of their intervals.
pub(crate) fn order(shards: &[ShardRange]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..shards.len()).collect();
    order.sort_by(|&a, &b| {
        let (a, b) = (shards[a], shards[b]);
        compare((a.index - 1, a.count), (b.index - 1, b.count))
            .then(compare((a.index, a.count), (b.index, b.count)))
    });
    order
}

/// Compares two fractions.
fn compare(a: (u32, u32), b: (u32, u32)) -> Ordering {
    (u64::from(a.0) * u64::from(b.1)).cmp(&(u64::from(b.0) * u64::from(a.1)))
}

/// The shard whose interval goes from the beginning of `first` to the end of `last`.
fn interval(first: ShardRange, last: ShardRange) -> Option<ShardRange> {
    let wide = u128::from;
    let begin = wide(first.index - 1) * wide(last.count);
    let end = wide(last.index) * wide(first.count);
    let whole = wide(first.count) * wide(last.count);
    let length = end.checked_sub(begin).filter(|&length| length > 0)?;
    let is_shard = whole.is_multiple_of(length) && begin.is_multiple_of(length);
    let number = |value: u128| u32::try_from(value).ok();
    is_shard.then_some(())?;
    Some(ShardRange { index: number(begin / length + 1)?, count: number(whole / length)? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emission::CHUNK_EMISSIONS;

    /// Ten chunks.
    const RUN: EmissionLayout =
        EmissionLayout { total: 9 * CHUNK_EMISSIONS + 100, bands: 1, sets: 1, batches: 1 };

    fn union(shards: &[(u32, u32)]) -> Result<(u32, u32), Vec<Fault>> {
        let shards: Vec<ShardRange> =
            shards.iter().map(|&(index, count)| ShardRange { index, count }).collect();
        RUN.union(&shards).map(|shard| (shard.index, shard.count))
    }

    #[test]
    fn shards_make_the_run_in_any_order_and_of_any_sizes() {
        for shards in [
            &[(1, 2), (2, 2)][..],
            &[(3, 3), (1, 3), (2, 3)],
            &[(1, 2), (4, 4), (3, 4)],
            &[(2, 2), (2, 6), (1, 6), (3, 6)],
            // Shards beyond the chunks are empty.
            &[(1, 1), (1, 40)],
        ] {
            assert_eq!(union(shards), Ok((1, 1)), "{shards:?}");
        }
        let many: Vec<(u32, u32)> = (1..=40).rev().map(|index| (index, 40)).collect();
        assert_eq!(union(&many), Ok((1, 1)));
    }

    #[test]
    fn a_part_has_a_name_where_its_interval_has_one() {
        assert_eq!(union(&[(4, 8), (3, 8)]), Ok((2, 4)));
        assert_eq!(union(&[(4, 9), (5, 9), (6, 9)]), Ok((2, 3)));
        assert_eq!(union(&[(1, 4), (3, 8), (4, 8)]), Ok((1, 2)));
        let missing = vec![Fault::Missing(0..512), Fault::Missing(3 * 512..RUN.total)];
        assert_eq!(union(&[(2, 8), (3, 8)]), Err(missing));
    }

    #[test]
    fn gaps_and_overlaps_are_all_found() {
        assert_eq!(
            union(&[(1, 10), (4, 10), (3, 10), (8, 10)]),
            Err(vec![
                Fault::Missing(512..1024),
                Fault::Missing(4 * 512..7 * 512),
                Fault::Missing(8 * 512..RUN.total)
            ])
        );
        assert_eq!(
            union(&[(1, 2), (2, 5), (2, 2), (2, 2)]),
            Err(vec![Fault::Overlap(0, 1, 1024..2048), Fault::Overlap(2, 3, 5 * 512..RUN.total)])
        );
        assert_eq!(
            union(&[(1, 1), (2, 5), (3, 5)]),
            Err(vec![Fault::Overlap(0, 1, 1024..2048), Fault::Overlap(0, 2, 2048..3072)])
        );
    }
}
