//! How numbers and places are written in messages, and how bytes of files are text.

use std::borrow::Cow;

use glam::DVec3;

/// The text of a file, which is Latin-1 if it is no UTF-8: names in older files of Windows are.
pub(crate) fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    let latin = || bytes.iter().map(|byte| char::from(*byte)).collect::<String>();
    std::str::from_utf8(bytes)
        .map_or_else(|_| latin().into(), |text| text.trim_start_matches('\u{feff}').into())
}

/// A number of things.
pub(crate) fn count(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// The first three of some things.
pub(crate) fn listed<S: AsRef<str>>(all: impl IntoIterator<Item = S, IntoIter: ExactSizeIterator>) -> String {
    let mut all = all.into_iter();
    let first: Vec<S> = all.by_ref().take(3).collect();
    let first: Vec<&str> = first.iter().map(AsRef::as_ref).collect();
    let more = if all.len() > 0 { format!("; and {} more", all.len()) } else { String::new() };
    first.join("; ") + &more
}

/// Three coordinates [m], to a micrometre.
pub(crate) fn place(point: DVec3) -> String {
    point.to_array().map(|x| number((x * 1e6).round() / 1e6)).join(", ")
}

/// Four significant digits; as a power of ten where it has many zeros.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    if size.is_infinite() {
        return "∞".to_owned();
    }
    if size > 0.0 && !(1e-3..1e7).contains(&size) {
        return format!("{value:.3e}");
    }
    let digits = 3 - libm::floor(libm::log10(size.max(1e-3))) as i32;
    let scale = libm::pow(10.0, f64::from(digits.clamp(0, 6)));
    // Adding zero makes one number of both zeros.
    ((value * scale).round() / scale + 0.0).to_string()
}

/// A word of a command line, as shells read it.
#[must_use]
pub fn shell_word(word: &str) -> String {
    let is_plain = |letter: char| letter.is_alphanumeric() || "._=,:/-".contains(letter);
    if word.chars().all(is_plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        let numbers = [0.0, -0.0, 1.2e-7, 0.51374, 2.5532, 147_000.4, 9e10, f64::INFINITY].map(number);
        assert_eq!(numbers, ["0", "0", "1.200e-7", "0.5137", "2.553", "147000", "9.000e10", "∞"]);
    }
}
