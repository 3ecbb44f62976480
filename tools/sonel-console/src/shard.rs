//! Parts of a run or of its receivers: `I/N`.

use anyhow::Context;
use sonel::map::ShardRange;

/// Reads `I/N`.
///
/// # Errors
/// A sentence that says what is right.
pub fn parse_shard(text: &str) -> anyhow::Result<ShardRange> {
    let numbers =
        text.split_once('/').and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
    let shard = numbers.map(|(index, count)| ShardRange { index, count });
    let shard = shard.filter(|shard| (1..=shard.count).contains(&shard.index));
    shard.with_context(|| format!("\"{text}\" is not a shard: write I/N with I from 1 to N, such as 2/8"))
}
