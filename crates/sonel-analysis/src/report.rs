//! Parameters as a table, CSV or JSON (docs/interface.md).

mod csv;
mod json;
mod means;
mod table;

pub use self::csv::csv;
pub use self::json::{estimate, json, receivers};
pub use self::means::{means_csv, means_json, means_table};
pub use self::table::table;
