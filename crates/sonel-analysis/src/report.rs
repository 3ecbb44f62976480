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

use comfy_table::{CellAlignment, Table, presets};

/// Rows below a head in columns of text, the first `left` of them aligned to the left and all others to the right.
#[must_use]
pub fn aligned(head: Vec<String>, rows: Vec<Vec<String>>, left: usize) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(head).add_rows(rows);
    for column in table.column_iter_mut().skip(left) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let lines: Vec<String> = table.lines().map(|line| line.trim_end().to_owned()).collect();
    lines.join("\n")
}
