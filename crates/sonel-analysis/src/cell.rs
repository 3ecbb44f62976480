//! Names in tables that spreadsheets open.
//!
//! A spreadsheet computes a cell that begins with `=`, `+`, `-` or `@`. By the usual rule an apostrophe before the name makes it a text.

use std::borrow::Cow;

/// The begins that make a spreadsheet compute: a tab or a return before a formula is skipped.
const FORMULAS: [char; 6] = ['=', '+', '-', '@', '\t', '\r'];

/// A name as a cell that no spreadsheet computes.
#[must_use]
pub fn of_name(name: &str) -> Cow<'_, str> {
    if name.starts_with(FORMULAS) { Cow::Owned(format!("'{name}")) } else { Cow::Borrowed(name) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_would_be_computed_have_an_apostrophe() {
        for text in ["=1+1", "+1", "-2", "@SUM(A1)", "\t=1", "\r=1"] {
            assert_eq!(of_name(text), format!("'{text}"));
        }
        for text in ["row 3", "'quoted'", "a=b", ""] {
            assert_eq!(of_name(text), text);
        }
    }
}
