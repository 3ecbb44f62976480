//! Parameters as a table, CSV or JSON (docs/interface.md).

mod csv;
mod json;
mod table;

pub use self::csv::csv;
pub use self::json::{estimate, json, receivers};
pub use self::table::table;
