//! The concert hall of Elmia, Jönköping, room of the second round robin on room acoustical simulation [Bork2000].
//!
//! Three teams measured two sources and six receivers in octaves; thirteen simulations were handed in. Geometry and results are
//! spreadsheets, read as one CSV file per sheet, FILE-SHEET.csv. Coefficients are those that the participants were given.

use anyhow::{Context, Result, ensure};

use super::folder::Folder;
use super::room::{Material, Pairs, Room, Variant};
use super::sheets::{self, BANDS, Columns};

const ORIGIN: &str =
    "the second round robin, sheets saved as CSV; docs/validation.md says where it is and how to save them";
/// Sheets of the participants.
const OTHERS: [&str; 13] =
    ["1", "2", "3", "5", "5DXF", "6", "6DXF", "8", "9DXF", "13DXF", "14DXF", "15DXF", "16DXF"];
/// s where the data state none, as reflectors.
const DEFAULT_SCATTERING: f64 = 0.1;

const VARIANTS: [Variant; 4] = [
    Variant::PLAIN,
    Variant { name: "angles", title: "locally reacting", is_locally_reacting: true, ..Variant::PLAIN },
    Variant { name: "rough", title: "s at least 0.3", least_scattering: 0.3, ..Variant::PLAIN },
    Variant { name: "straight", title: "diffraction off", effects: "-diffraction", ..Variant::PLAIN },
];

/// The hall. Its walls cross and end on one another, so the mesh is not watertight; few packets leave.
pub(super) fn hall(folder: &Folder) -> Result<Room> {
    let [corners, planes] = ["cornersCatt", "planesCatt"]
        .map(|sheet| folder.text(&format!("elmia_coordinates-{sheet}.csv"), ORIGIN));
    let corners = sheets::corners(&[corners?]);
    let planes = sheets::planes(&planes?, &Columns { material: 1, corners: 2.. }, &corners)
        .context("elmia_coordinates-planesCatt.csv")?;
    let faces: Vec<_> = planes.into_iter().map(|(_, face)| face).collect();
    let materials = materials(&folder.text("material_catt.txt", ORIGIN)?).context("material_catt.txt")?;
    for face in &faces {
        let is_known = materials.iter().any(|material| material.name == face.material);
        ensure!(is_known, "material_catt.txt has no material {}", face.material);
    }
    let results = |sheet: &str| {
        let file = format!("Auswertung_Phase_II-{sheet}.csv");
        pairs(&folder.text(&file, ORIGIN)?).context(file)
    };
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
        measured: results("measured")
            .and_then(sheets::complete)
            .context("Auswertung_Phase_II-measured.csv")?,
        others: OTHERS.into_iter().map(results).collect::<Result<_>>()?,
    })
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

/// Blocks that begin with the name of a quantity, a row per octave, a column per pair.
fn pairs(text: &str) -> Result<Pairs> {
    let mut pairs = vec![vec![[f64::NAN; 4]; BANDS.len()]; 12];
    let rows: Vec<Vec<String>> = text.lines().map(sheets::cells).collect();
    for (at, row) in rows.iter().enumerate() {
        let Some((quantity, unit)) = sheets::quantity(&row[0]) else { continue };
        let block = rows.get(at + 1..=at + BANDS.len());
        for (band, row) in
            block.with_context(|| format!("{}: six octaves are needed", row[0]))?.iter().enumerate()
        {
            for (index, pair) in pairs.iter_mut().enumerate() {
                pair[band][quantity] = unit * sheets::number(row.get(1 + index));
            }
        }
    }
    Ok(pairs)
}

#[cfg(test)]
mod tests {
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
        assert!(super::pairs(&text.replace("C/dB", "C80/dB")).unwrap()[0][5][2] > 3.9);
        assert!(super::pairs(text.trim_end().rsplit_once('\n').unwrap().0).is_err());
    }
}
