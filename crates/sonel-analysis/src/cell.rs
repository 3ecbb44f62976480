//! Names in tables that spreadsheets open.
//!
//! A spreadsheet computes a cell that begins with `=`, `+`, `-` or `@`, perhaps behind blanks. By the usual rule an apostrophe before the name makes it a
//! text.

use std::borrow::Cow;

use crate::shown::shown;

/// The begins that make a spreadsheet compute, also in their wide forms.
const FORMULAS: [char; 8] = ['=', '+', '-', '@', '＝', '＋', '－', '＠'];

/// A name as a cell that no spreadsheet computes.
#[must_use]
pub fn of_name(name: &str) -> Cow<'_, str> {
    let name = shown(name);
    let begin = name.trim_start_matches(|blank: char| blank.is_whitespace() || blank == '\u{fffd}');
    if begin.starts_with(FORMULAS) { Cow::Owned(format!("'{name}")) } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_would_be_computed_have_an_apostrophe() {
        for text in ["=1+1", "+1", "-2", "@SUM(A1)", "\t=1", "\r=1", "\n=1", " =1", "\u{a0}\u{feff}+1", "＝1"]
        {
            assert_eq!(of_name(text), format!("'{}", shown(text)));
        }
        for text in ["row 3", "'quoted'", "a=b", ""] {
            assert_eq!(of_name(text), text);
        }
    }
}
