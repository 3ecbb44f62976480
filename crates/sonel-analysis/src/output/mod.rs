//! The parameters of a report as a table for people, as CSV and as JSON (docs/interface.md).

mod csv_rows;
mod json;
mod table;

pub use csv_rows::csv;
pub use json::json;
pub use table::table;
