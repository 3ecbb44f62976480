//! Counts and times as people write them: `1000000`, `1e6`, `1M`, `500k`; `60s`, `5min`, `2h`, or a number of seconds.

use crate::ParseError;

/// Parses a count.
///
/// # Errors
/// Where `text` is not a whole number of at least zero.
pub fn parse_count(text: &str) -> Result<u64, ParseError> {
    let whole = |value: &f64| *value >= 0.0 && value.fract() <= 0.0 && *value < 9e15;
    let scaled = || scaled(text, &[("k", 1e3), ("K", 1e3), ("M", 1e6), ("G", 1e9)]).filter(whole);
    let count = text.trim().parse().ok().or_else(|| scaled().map(|value| value as u64));
    count.ok_or_else(|| ParseError(format!("\"{text}\" is not a count: write 1000000, 1e6, 1M or 500k")))
}

/// Parses a time [s].
///
/// # Errors
/// Where `text` is no time above zero.
pub fn parse_time(text: &str) -> Result<f64, ParseError> {
    scaled(text, &[("s", 1.0), ("min", 60.0), ("m", 60.0), ("h", 3600.0)])
        .filter(|seconds| seconds.is_finite() && *seconds > 0.0)
        .ok_or_else(|| ParseError(format!("\"{text}\" is not a time: write 60s, 5min or 2h")))
}

/// A number, times what the letters behind it stand for, if there are any.
fn scaled(text: &str, letters: &[(&str, f64)]) -> Option<f64> {
    let text = text.trim();
    let digits = text.trim_end_matches(char::is_alphabetic);
    let known = std::iter::once(&("", 1.0)).chain(letters);
    let (_, scale) = known.copied().find(|(letters, _)| *letters == &text[digits.len()..])?;
    Some(digits.trim().parse::<f64>().ok()? * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_read_in_every_usual_form() {
        for (text, count) in [
            ("1000000", 1_000_000),
            ("1e6", 1_000_000),
            ("1M", 1_000_000),
            ("500k", 500_000),
            ("1.5k", 1500),
            ("0", 0),
        ] {
            assert_eq!(parse_count(text), Ok(count), "{text}");
        }
    }

    #[test]
    fn what_is_no_count_is_refused() {
        for text in ["", "k", "-1", "1.5", "nan", "inf", "1e30", "10 k m", "0x10"] {
            assert!(parse_count(text).is_err(), "{text}");
        }
    }

    #[test]
    fn times_are_read_in_every_usual_form() {
        for (text, seconds) in [("60s", 60.0), ("60", 60.0), ("1.5min", 90.0), ("2h", 7200.0), (" 5 s", 5.0)]
        {
            assert!((parse_time(text).unwrap() - seconds).abs() < 1e-9, "{text}");
        }
        for text in ["", "s", "-1s", "0", "nan", "1d", "inf"] {
            assert!(parse_time(text).unwrap_err().0.contains("60s"), "{text}");
        }
    }
}
