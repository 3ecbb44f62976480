//! The music studio of the PTB, Braunschweig, room of the third round robin on room acoustical simulation [Bork2005].
//!
//! Phase 3: all diffusers of the ceiling and the boxes of the side wall are drawn. Curtains that hang free are open or closed; sound
//! reaches both of their sides. Measured were two sources and three receivers in octaves.

use anyhow::{Context, Result, ensure};

use super::folder::Folder;
use super::room::{Face, Material, Pairs, Room, Variant};
use super::sheets::{self, BANDS, Columns};

const ORIGIN: &str =
    "the third round robin, sheets saved as CSV; docs/validation.md says where it is and how to save them";
/// Sheets of participants; the others are empty.
const OTHERS: [u32; 17] = [1, 2, 3, 5, 6, 7, 8, 9, 11, 12, 13, 14, 15, 16, 17, 20, 21];
/// Planes of phase 2 that the drawn ceiling and boxes replace.
const REPLACED: [u32; 2] = [10, 25];
const PAIRS: usize = 6;

const VARIANTS: [Variant; 2] = [
    Variant::PLAIN,
    Variant { name: "angles", title: "locally reacting", is_locally_reacting: true, ..Variant::PLAIN },
];

/// A state of the curtains.
struct State {
    name: &'static str,
    title: &'static str,
    /// Material of curtains that are not there.
    absent: &'static str,
    /// Column of its results.
    column: usize,
}

/// The studio with open curtains.
pub(super) fn with_open_curtains(folder: &Folder) -> Result<Room> {
    room(
        folder,
        &State {
            name: "studio-open",
            title: "PTB studio, curtains open, 400 m³",
            absent: "curtainclosed",
            column: 0,
        },
    )
}

/// The studio with closed curtains.
pub(super) fn with_closed_curtains(folder: &Folder) -> Result<Room> {
    room(
        folder,
        &State {
            name: "studio-closed",
            title: "PTB studio, curtains closed, 400 m³",
            absent: "curtainopen",
            column: 8,
        },
    )
}

fn room(folder: &Folder, state: &State) -> Result<Room> {
    let mut faces = faces(folder)?;
    faces.retain(|face| face.material != state.absent);
    let file = "studio_coordinates_p3-properties+conditions.csv";
    let materials = materials(&folder.text(file, ORIGIN)?);
    for face in &faces {
        let is_known = materials.iter().any(|material| material.name == face.material);
        ensure!(is_known, "{file} has no material {}", face.material);
    }
    let results = |sheet: &str| {
        let file = format!("results_p3_public-{sheet}.csv");
        Ok(pairs(&folder.text(&file, ORIGIN)?, state.column))
    };
    let others = OTHERS.into_iter().map(|number| results(&number.to_string()));
    Ok(Room {
        name: state.name,
        title: state.title,
        faces,
        up: "z",
        temperature_celsius: 20.0,
        relative_humidity_percent: 50.0,
        duration: 1.8,
        bands: BANDS.to_vec(),
        bands_per_octave: 1,
        sources: &[("S1", [1.5, 3.5, 1.5]), ("S2", [-1.5, 5.5, 1.5])],
        receivers: &[("R1", [-2.0, 3.0, 1.2]), ("R2", [2.0, 6.0, 1.2]), ("R3", [0.0, 7.5, 1.2])],
        reverberation_time: ("T30", "t30_s"),
        estimates: vec![materials],
        variants: &VARIANTS,
        measured: results("measurement")
            .and_then(sheets::complete)
            .context("results_p3_public-measurement.csv")?,
        others: others.collect::<Result<_>>()?,
    })
}

/// Walls, ceiling, boxes and the curtains of both states.
fn faces(folder: &Folder) -> Result<Vec<Face>> {
    let text = |sheet: &str| folder.text(&format!("studio_coordinates_p3-{sheet}.csv"), ORIGIN);
    let corners = sheets::corners(&[text("corners")?, text("corners_phase3")?]);
    let of_sheet = |sheet: &str, material: usize, first: usize| {
        let columns = Columns { material, corners: first.. };
        sheets::planes(&text(sheet)?, &columns, &corners)
            .with_context(|| format!("studio_coordinates_p3-{sheet}.csv"))
    };
    let mut planes = of_sheet("planes", 1, 3)?;
    planes.retain(|(number, _)| !REPLACED.contains(number));
    planes.extend(of_sheet("planes_ceiling", 4, 1)?);
    planes.extend(of_sheet("planes_wood_absorbers", 4, 5)?);
    let named = |(_, face): (u32, Face)| Face { material: plain(&face.material), ..face };
    Ok(planes.into_iter().map(named).collect())
}

/// A material's name without what differs between the sheets: spaces, brackets, plural.
fn plain(name: &str) -> String {
    let letters: String = name.chars().filter(char::is_ascii_alphabetic).collect();
    letters.trim_end_matches('s').to_owned()
}

/// Rows with a name, α of six octaves and, after the name again, s of six octaves.
fn materials(sheet: &str) -> Vec<Material> {
    let material = |line: &str| {
        let cells = sheets::cells(line);
        let numbers: Vec<f64> = cells.iter().filter_map(|cell| cell.parse().ok()).collect();
        let name = plain(&cells[0]);
        (!name.is_empty() && numbers.len() == 12).then(|| Material {
            name,
            absorption: numbers[..6].to_vec(),
            scattering: numbers[6..].to_vec(),
        })
    };
    sheet.lines().filter_map(material).collect()
}

/// Blocks that begin with "125 Hz" … in `column`, under them a row per quantity. Later blocks are standard deviations.
fn pairs(sheet: &str, column: usize) -> Pairs {
    let mut pairs = vec![vec![[f64::NAN; 4]; BANDS.len()]; PAIRS];
    let mut band = None;
    for row in sheet.lines().map(sheets::cells) {
        let Some(title) = row.get(column) else { continue };
        if let Some(centre) = title.strip_suffix(" Hz") {
            band = BANDS.iter().position(|band| band.to_string() == centre);
        }
        if let (Some(band), Some((quantity, unit))) = (band, sheets::quantity(title)) {
            for (index, pair) in pairs.iter_mut().enumerate() {
                if pair[band][quantity].is_nan() {
                    pair[band][quantity] = unit * sheets::number(row.get(column + 1 + index));
                }
            }
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_the_sheets_agree() {
        assert_eq!(plain("windowglas"), plain("windowglass"));
        assert_eq!(plain("studio_wall"), plain("studio wall"));
        assert_eq!(plain("wood absorbers"), plain("wood absorber"));
        assert_eq!(
            (plain("curtain (closed)"), plain("curtain(open)")),
            ("curtainclosed".into(), "curtainopen".into())
        );
    }

    #[test]
    fn materials_have_twelve_numbers_and_a_name() {
        let sheet = ",125,250,500,1000,2000,4000,,125,250,500,1000,2000,4000\nwood,.1,.2,.3,.4,.5,.6,wood,1,.9,.8,.7,.6,.5,wood\n";
        let materials = materials(sheet);
        assert_eq!(materials.len(), 1);
        assert_eq!(format!("{:?} {:?}", materials[0].absorption[1], materials[0].scattering[5]), "0.2 0.5");
    }

    #[test]
    fn both_states_have_their_column() {
        let sheet = "125 Hz,octave,,,,,,,125 Hz,octave\n,S1R1,,,,,,,,S1R1\n\
                     T30/s,1,2,3,4,5,6,3.5,T30/s,7,8,9,10,11,12\nC80/dB,1,1,1,1,1,1,1,C/dB,-1,-1,-1,-1,-1,-1\n\
                     4000 Hz,,,,,,,,4000 Hz\nD/%,50,50,50,50,50,50,,D/%,60,60,60,60,60,60\n\
                     125 Hz,,,,,,,,125 Hz\nT30/s,0,0,0,0,0,0,,T30/s,0,0,0,0,0,0\n";
        let [open, closed] = [0, 8].map(|column| pairs(sheet, column));
        assert_eq!(
            format!("{:?} {:?}", open[5][0], closed[5][0]),
            "[6.0, NaN, 1.0, NaN] [12.0, NaN, -1.0, NaN]"
        );
        assert!((open[0][5][3] - 0.5).abs() < 1e-12 && (closed[0][5][3] - 0.6).abs() < 1e-12);
        assert!(sheets::complete(open).is_err());
    }
}
