//! Spreadsheets of the round robins on room acoustical simulation, saved as one CSV file per sheet, FILE-SHEET.csv.
//!
//! Corners and planes of a room are rows that begin with a number; all other rows are headings and remarks.

use std::collections::BTreeMap;
use std::ops::RangeFrom;

use anyhow::{Context, Result, ensure};
use glam::DVec3;

use super::room::{Face, Pairs};

/// Octaves of both round robins [Hz].
pub(super) const BANDS: [f64; 6] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0];

/// The cells of a row; a cell in quotes may hold commas.
pub(super) fn cells(row: &str) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut is_quoted = false;
    for letter in row.chars() {
        match letter {
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => cells.push(String::new()),
            _ => cells.last_mut().expect("begun with one").push(letter),
        }
    }
    cells.iter().map(|cell| cell.trim().to_owned()).collect()
}

/// Places by number: rows "number, x, y, z" [m], empty cells ignored.
pub(super) fn corners(sheets: &[String]) -> BTreeMap<u32, DVec3> {
    let row = |line: &str| {
        let cells = cells(line);
        cells[0].parse::<f64>().ok()?;
        let numbers: Vec<f64> = cells.iter().filter_map(|cell| cell.parse().ok()).collect();
        (numbers.len() >= 4).then(|| (numbers[0] as u32, DVec3::from_slice(&numbers[1..4])))
    };
    sheets.iter().flat_map(|sheet| sheet.lines()).filter_map(row).collect()
}

/// Columns of a sheet of planes, its number in the first.
pub(super) struct Columns {
    pub material: usize,
    pub corners: RangeFrom<usize>,
}

/// Number and polygon of every plane; cells after the last corner may hold remarks.
pub(super) fn planes(
    sheet: &str,
    columns: &Columns,
    corners: &BTreeMap<u32, DVec3>,
) -> Result<Vec<(u32, Face)>> {
    let mut planes = Vec::new();
    for row in sheet.lines().map(cells) {
        let Ok(number) = row[0].parse::<f64>() else { continue };
        let mut places = Vec::new();
        for cell in row.iter().skip(columns.corners.start).filter_map(|cell| cell.parse::<f64>().ok()) {
            let corner = corners.get(&(cell as u32));
            places.push(*corner.with_context(|| format!("plane {number}: there is no corner {cell}"))?);
        }
        let material = row.get(columns.material).cloned().unwrap_or_default();
        ensure!(places.len() >= 3 && !material.is_empty(), "plane {number}: corners or material are missing");
        planes.push((number as u32, Face { material, corners: places }));
    }
    ensure!(!planes.is_empty(), "the sheet has no planes");
    Ok(planes)
}

/// An error where a value of `pairs` is missing.
pub(super) fn complete(pairs: Pairs) -> Result<Pairs> {
    ensure!(pairs.iter().flatten().flatten().all(|value| value.is_finite()), "a measured value is missing");
    Ok(pairs)
}

/// Which of the values of a pair a row is titled after, and its unit.
pub(super) fn quantity(title: &str) -> Option<(usize, f64)> {
    let quantities =
        [("T30/s", 0, 1.0), ("EDT/s", 1, 1.0), ("C/dB", 2, 1.0), ("C80/dB", 2, 1.0), ("D/%", 3, 0.01)];
    quantities.into_iter().find(|(name, ..)| *name == title).map(|(_, quantity, unit)| (quantity, unit))
}

/// The number in a cell; not a number where it has none.
pub(super) fn number(cell: Option<&String>) -> f64 {
    cell.and_then(|cell| cell.parse().ok()).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_take_their_corners_by_number() {
        let sheets = [
            "Corners of a hall,,,\nNumber,x,y,z\n\n1,0.35,-1,5.2\n2.0,1,0,0\n".into(),
            "7,,0,1,0,far\n".into(),
        ];
        let corners = corners(&sheets);
        let sheet = "Planes,,,,\nNumber,,Corner 1,Corner 2\n3,\"left, low\",stage,7,1,2,,double sided\n";
        let columns = Columns { material: 2, corners: 3.. };
        let planes = planes(sheet, &columns, &corners).unwrap();
        assert_eq!((planes[0].0, planes[0].1.material.as_str()), (3, "stage"));
        assert_eq!(planes[0].1.corners, [DVec3::Y, DVec3::new(0.35, -1.0, 5.2), DVec3::X]);
        let message = |sheet: &str| super::planes(sheet, &columns, &corners).unwrap_err().to_string();
        assert!(message(&sheet.replace(",7,", ",8,")).contains("no corner 8"));
        assert!(message(&sheet.replace(",7,", ",,")).contains("plane 3"));
        assert!(message("Planes").contains("no planes"));
    }

    #[test]
    fn a_missing_measurement_is_an_error() {
        assert!(complete(vec![vec![[1.0; 4]; 6]]).is_ok());
        assert!(complete(vec![vec![[1.0, 1.0, number(None), 1.0]; 6]]).is_err());
    }
}
