//! Counts as people write them: `1000000`, `1e6`, `1M`, `500k`.

use crate::ParseError;

/// Parses a count.
///
/// # Errors
/// Where `text` is not a whole number of at least zero.
pub fn parse_count(text: &str) -> Result<u64, ParseError> {
    let wrong = || ParseError(format!("\"{text}\" is not a count: write 1000000, 1e6, 1M or 500k"));
    let (digits, scale) = match text.trim().char_indices().last() {
        Some((at, 'k' | 'K')) => (&text.trim()[..at], 1e3),
        Some((at, 'M')) => (&text.trim()[..at], 1e6),
        Some((at, 'G')) => (&text.trim()[..at], 1e9),
        _ => (text.trim(), 1.0),
    };
    if let (Ok(exact), true) = (digits.parse::<u64>(), scale <= 1.0) {
        return Ok(exact);
    }
    let value = digits.parse::<f64>().map_err(|_| wrong())? * scale;
    let whole = value.is_finite() && value >= 0.0 && value.fract() <= 0.0 && value < 9e15;
    if whole { Ok(value as u64) } else { Err(wrong()) }
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
    fn everything_else_is_refused() {
        for text in ["", "k", "-1", "1.5", "nan", "inf", "1e30", "10 k m", "0x10"] {
            assert!(parse_count(text).is_err(), "{text}");
        }
    }
}
