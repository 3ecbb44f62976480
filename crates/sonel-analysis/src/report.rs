//! Parameters as a table, CSV or JSON (docs/interface.md).

mod beside;
mod csv;
mod json;
mod means;
mod table;

pub use self::beside::{BesideBlock, Column, beside_blocks, beside_csv, beside_json, beside_table};
pub use self::csv::csv;
pub use self::json::{estimate, json, receivers};
pub use self::means::{means_csv, means_json, means_table};
pub use self::table::{by_materials, digits, table};
