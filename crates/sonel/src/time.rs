//! Times as people write them: `60s`, `5min`, `2h`, or a number of seconds.

use crate::ParseError;

/// Parses a time [s].
///
/// # Errors
/// Where `text` is no time above zero.
pub fn parse_time(text: &str) -> Result<f64, ParseError> {
    let trimmed = text.trim();
    let digits = trimmed.trim_end_matches(|c: char| c.is_alphabetic());
    let scale = match &trimmed[digits.len()..] {
        "" | "s" => Some(1.0),
        "min" | "m" => Some(60.0),
        "h" => Some(3600.0),
        _ => None,
    };
    let seconds = digits.trim().parse::<f64>().ok().zip(scale).map(|(number, scale)| number * scale);
    seconds
        .filter(|seconds| seconds.is_finite() && *seconds > 0.0)
        .ok_or_else(|| ParseError(format!("\"{text}\" is not a time: write 60s, 5min or 2h")))
}

#[cfg(test)]
mod tests {
    use super::*;

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
