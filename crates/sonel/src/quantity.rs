//! Counts, times and sizes in a few digits.

/// A count: `50k`, `1.5M`.
#[must_use]
pub fn count(number: u64) -> String {
    match number {
        0..10_000 => number.to_string(),
        10_000..1_000_000 => format!("{}k", number / 1000),
        1_000_000..1_000_000_000 => format!("{:.1}M", number as f64 / 1e6),
        _ => format!("{:.1}G", number as f64 / 1e9),
    }
}

/// A range that may be open: `0.40 … 0.80`, `at most 0.80`, `at least 2.00`.
#[must_use]
pub fn range([low, high]: [f64; 2]) -> String {
    match (low.is_finite() && low != 0.0, high.is_finite()) {
        (true, true) => format!("{low:.2} … {high:.2}"),
        (false, true) => format!("at most {high:.2}"),
        _ => format!("at least {low:.2}"),
    }
}

/// Numbers with commas between.
#[must_use]
pub fn list(numbers: &[f64]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// A number of things: `1 receiver`, `2 receivers`.
#[must_use]
pub fn counted(number: usize, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

/// A time in the unit that suits it.
#[must_use]
pub fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.2} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s if s < 2e5 => format!("{:.1} h", s / 3600.0),
        s if s < 3e7 => format!("{:.0} days", s / 86_400.0),
        s => format!("{:.1} years", s / (365.0 * 86_400.0)),
    }
}

/// A size in the unit that suits it.
#[must_use]
pub fn bytes(bytes: f64) -> String {
    match bytes {
        b if b < 1e9 => format!("{:.1} MB", b / 1e6),
        b if b < 1e12 => format!("{:.1} GB", b / 1e9),
        b => format!("{:.1} TB", b / 1e12),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thing_is_no_plural() {
        assert_eq!([0, 1, 2].map(|number| counted(number, "row")), ["0 rows", "1 row", "2 rows"]);
    }
}
