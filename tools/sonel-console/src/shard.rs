//! Parts of a run or of its receivers: `I/N`.

use sonel::map::ShardRange;

/// Reads `I/N`.
///
/// # Errors
/// A sentence that says what is right.
pub fn parse_shard(text: &str) -> Result<ShardRange, String> {
    let wrong = || format!("\"{text}\" is not a shard: write I/N with I from 1 to N, such as 2/8");
    let (index, count) = text.split_once('/').ok_or_else(wrong)?;
    let (index, count) = (index.parse().map_err(|_| wrong())?, count.parse().map_err(|_| wrong())?);
    if index >= 1 && index <= count { Ok(ShardRange { index, count }) } else { Err(wrong()) }
}
