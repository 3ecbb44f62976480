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
pub use self::table::{Notes, by_materials, cell, digits, table};

use std::ops::RangeBounds;

use comfy_table::{CellAlignment, Table, presets};

/// `rows` below their `head`, whose columns of `numbers` are aligned to the right. Every line ends with a line feed.
#[must_use]
pub fn aligned(
    head: impl IntoIterator<Item = impl ToString>,
    rows: impl IntoIterator<Item = impl IntoIterator<Item = String>>,
    numbers: impl RangeBounds<usize>,
) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(head).add_rows(rows);
    for (_, column) in (0..).zip(table.column_iter_mut()).filter(|(index, _)| numbers.contains(index)) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}
