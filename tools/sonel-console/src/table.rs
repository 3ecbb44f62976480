//! Tables in aligned columns, without lines between them.

use std::ops::RangeBounds;

use comfy_table::{Cell, CellAlignment, Row, Table, presets};

/// `rows` below their `head`, whose columns of `numbers` are aligned to the right. Every line ends with a line feed.
#[must_use]
pub fn aligned<R: Into<Row>>(
    head: impl IntoIterator<Item = impl Into<Cell>>,
    rows: impl IntoIterator<Item = R>,
    numbers: impl RangeBounds<usize>,
) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(head).add_rows(rows);
    for (_, column) in (0..).zip(table.column_iter_mut()).filter(|(index, _)| numbers.contains(index)) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}
