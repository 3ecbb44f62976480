//! Figures as a table for people, as CSV for spreadsheets, as JSON for programs (docs/interface.md).

mod csv;
mod json;
mod table;

pub use self::csv::csv;
pub use self::json::{estimate, json, receivers};
pub use self::table::table;
