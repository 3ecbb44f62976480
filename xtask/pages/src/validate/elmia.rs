//! The concert hall of Elmia, Jönköping, room of the second round robin on room acoustical simulation [Bork2000].
//!
//! Three teams measured two sources and six receivers in octaves; thirteen simulations were handed in. Geometry and results are
//! spreadsheets, read as one CSV file per sheet, FILE-SHEET.csv. Coefficients are those that the participants were given.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use glam::DVec3;

use super::folder::Folder;
use super::room::{Face, Material, Pairs, Room, Variant};

const ORIGIN: &str =
    "the second round robin, sheets saved as CSV; docs/validation.md says where it is and how to save them";
const BANDS: [f64; 6] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0];
/// Sheets of the participants.
const OTHERS: [&str; 13] =
    ["1", "2", "3", "5", "5DXF", "6", "6DXF", "8", "9DXF", "13DXF", "14DXF", "15DXF", "16DXF"];
/// s where the data state none, as reflectors.
const DEFAULT_SCATTERING: f64 = 0.1;

const VARIANTS: [Variant; 4] = [
    Variant::PLAIN,
    Variant { name: "angles", title: "locally reacting", is_locally_reacting: true, ..Variant::PLAIN },
    Variant { name: "rough", title: "s at least 0.3", least_scattering: 0.3, ..Variant::PLAIN },
    Variant { name: "straight", title: "diffraction off", effects: "auto,-diffraction", ..Variant::PLAIN },
];

/// The hall. Its walls cross and end on one another, so the mesh is not watertight; few packets leave.
pub fn hall(folder: &Folder) -> Result<Room> {
    let [corners, planes] = ["cornersCatt", "planesCatt"]
        .map(|sheet| folder.text(&format!("elmia_coordinates-{sheet}.csv"), ORIGIN));
    let faces = faces(&corners?, &planes?)?;
    let materials = materials(&folder.text("material_catt.txt", ORIGIN)?).context("material_catt.txt")?;
    for face in &faces {
        let is_known = materials.iter().any(|material| material.name == face.material);
        ensure!(is_known, "material_catt.txt has no material {}", face.material);
    }
    let results = |sheet: &str| {
        let file = format!("Auswertung_Phase_II-{sheet}.csv");
        pairs(&folder.text(&file, ORIGIN)?).context(file)
    };
    let measured = results("measured")?;
    ensure!(
        measured.iter().flatten().flatten().all(|value| value.is_finite()),
        "Auswertung_Phase_II-measured.csv: a value is missing"
    );
    Ok(Room {
        name: "elmia",
        title: "Elmia, concert hall, 11 000 m³",
        faces,
        up: "z",
        temperature_celsius: 20.0,
        relative_humidity_percent: 50.0,
        duration: 3.0,
        bands: BANDS.to_vec(),
        bands_per_octave: 1,
        sources: &[("S1", [8.5, 0.0, 2.1]), ("S2", [3.0, 3.5, 2.1])],
        receivers: &[
            ("R1", [13.8, 0.0, 1.45]),
            ("R2", [12.9, 10.5, 5.3]),
            ("R3", [19.9, 5.1, 2.7]),
            ("R4", [25.5, -4.9, 4.35]),
            ("R5", [24.8, 11.9, 5.7]),
            ("R6", [37.8, 6.4, 8.45]),
        ],
        reverberation_time: ("T30", "t30_s"),
        estimates: vec![materials],
        variants: &VARIANTS,
        measured,
        others: OTHERS.into_iter().map(results).collect::<Result<_>>()?,
    })
}

/// Planes "number, material, corner, corner …" over corners "number, x, y, z"; other rows are headings.
fn faces(corners: &str, planes: &str) -> Result<Vec<Face>> {
    let row = |line: &str| line.split(',').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let mut places = BTreeMap::new();
    for line in corners.lines() {
        let numbers: Vec<f64> = row(line).iter().map_while(|cell| cell.parse().ok()).collect();
        if numbers.len() >= 4 {
            places.insert(numbers[0] as u32, DVec3::from_slice(&numbers[1..4]));
        }
    }
    let mut faces = Vec::new();
    for line in planes.lines() {
        let cells = row(line);
        if cells[0].parse::<f64>().is_err() || cells.len() < 5 {
            continue;
        }
        let corner = |cell: &String| {
            let number = cell.parse::<f64>().ok().map(|number| number as u32);
            let place = number.and_then(|number| places.get(&number)).copied();
            place.with_context(|| format!("plane {}: there is no corner {cell}", cells[0]))
        };
        let corners = cells[2..].iter().filter(|cell| !cell.is_empty()).map(corner).collect::<Result<_>>()?;
        faces.push(Face { material: cells[1].clone(), corners });
    }
    ensure!(!faces.is_empty(), "the sheet planesCatt has no planes");
    Ok(faces)
}

/// Lines "NAME = < α per octave > L < s per octave >" in percent.
fn materials(text: &str) -> Result<Vec<Material>> {
    let material = |line: &str| {
        let (name, rest) = line.split_once('=')?;
        let lists: Vec<Vec<f64>> = rest
            .split('<')
            .skip(1)
            .map(|list| {
                let words = list.split('>').next().unwrap_or_default().split_whitespace();
                words.filter_map(|word| word.parse::<f64>().ok()).map(|percent| percent / 100.0).collect()
            })
            .collect();
        let absorption = lists.first()?.clone();
        let scattering = lists.get(1).cloned().unwrap_or_else(|| vec![DEFAULT_SCATTERING; BANDS.len()]);
        let is_whole = absorption.len() == BANDS.len() && scattering.len() == BANDS.len();
        is_whole.then(|| Material { name: name.trim().to_owned(), absorption, scattering })
    };
    let lines = text.lines().filter(|line| !line.trim().is_empty());
    let mut materials = Vec::<Material>::new();
    for line in lines {
        let material = material(line).with_context(|| format!("not read: {line}"))?;
        if materials.iter().all(|known| known.name != material.name) {
            materials.push(material);
        }
    }
    Ok(materials)
}

/// Blocks that begin with "T30/s", "EDT/s", "C/dB" or "D/%", a row per octave, a column per pair; cells without a number are none.
fn pairs(text: &str) -> Result<Pairs> {
    let mut pairs = vec![vec![[f64::NAN; 4]; BANDS.len()]; 12];
    let blocks = [("T30/s", 1.0), ("EDT/s", 1.0), ("C/dB", 1.0), ("D/%", 0.01)];
    for (quantity, (title, unit)) in blocks.into_iter().enumerate() {
        // One participant writes C80.
        let is_title =
            |line: &str| line.split(',').next().is_some_and(|cell| cell.replace("C80", "C") == title);
        let block = text.lines().skip_while(|line| !is_title(line));
        let rows: Vec<&str> = block.skip(1).take(BANDS.len()).collect();
        ensure!(rows.len() == BANDS.len(), "there is no block {title} with six octaves");
        for (band, row) in rows.into_iter().enumerate() {
            for (pair, cell) in pairs.iter_mut().zip(row.split(',').skip(1)) {
                pair[band][quantity] = cell.trim().parse().map_or(f64::NAN, |value: f64| unit * value);
            }
        }
    }
    Ok(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_take_their_corners_by_number() {
        let corners = "Corners of a hall,,,\nNumber,x,y,z\n\n1,0.35,-1,5.2\n2.0,1,0,0\n7,0,1,0\n";
        let planes = "Planes,,,,\nNumber,,Corner 1,Corner 2,Corner 3,Corner 4\n1,stage,7,1,2,\n";
        let faces = super::faces(corners, planes).unwrap();
        assert_eq!(faces[0].material, "stage");
        assert_eq!(faces[0].corners, [DVec3::Y, DVec3::new(0.35, -1.0, 5.2), DVec3::X]);
        let message = super::faces(corners, &planes.replace(",7,", ",8,")).unwrap_err().to_string();
        assert!(message.contains("no corner 8"), "{message}");
    }

    #[test]
    fn coefficients_are_percent_and_scattering_may_be_missing() {
        let text = "stage = < 15 8 6 6 6 6 > L < 15 13 11 9 7 5 >\nreflectors = < 12 10 4 3 3 2 >\nstage = < 1 1 1 1 1 1 >\n";
        let materials = super::materials(text).unwrap();
        assert_eq!(materials.len(), 2);
        assert!((materials[0].absorption[1] - 0.08).abs() < 1e-12);
        assert!((materials[0].scattering[5] - 0.05).abs() < 1e-12);
        assert!((materials[1].scattering[0] - 0.1).abs() < 1e-12);
        assert!(super::materials("stage = < 15 8 >").is_err());
    }

    #[test]
    fn blocks_become_pairs() {
        let block = |title: &str, first: f64| {
            let row = |band: usize| {
                format!("{} Hz,{}\n", band, vec![(first + band as f64).to_string(); 13].join(","))
            };
            format!("{title},S1R1,S1R2\n{}", (0..6).map(row).collect::<String>())
        };
        let text =
            block("T30/s", 2.0) + &block("EDT/s", 1.0) + ",,\n" + &block("D/%", 30.0) + &block("C/dB", -1.0);
        let pairs = super::pairs(&text).unwrap();
        assert_eq!(pairs.len(), 12);
        assert_eq!(format!("{:.2?}", pairs[11][1]), "[3.00, 2.00, 0.00, 0.31]");
        assert!(super::pairs(&text.replace("35", "-")).unwrap()[0][5][3].is_nan());
        assert!(super::pairs(&text.replace("C/dB", "C")).is_err());
    }
}
