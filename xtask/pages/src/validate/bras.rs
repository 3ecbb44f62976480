//! Rooms of BRAS, the Benchmark for Room Acoustical Simulation [Aspoeck2020], measured with dodecahedra at ten pairs each.
//!
//! Geometry, air and places are those of the simulations published with it [Aspoeck2020b]: y is up, sources are the middle
//! drivers of the dodecahedra. Coefficients come in two sets of third octaves. *Initial* ones are from tables and impedance
//! tubes; *fitted* ones are scaled until Eyring's formula gives the measured T20. Measured values are means over the pairs.

use anyhow::{Context, Result, ensure};

use super::ac3d;
use super::folder::Folder;
use super::room::{Face, Material, Place, Room, Values, Variant};

const GEOMETRY: &str = "the input data of the simulations of BRAS (L. Aspöck, CC BY-NC-SA 4.0), \
     https://publications.rwth-aachen.de/record/803828";
const SURFACES: &str =
    "\"3 Surface descriptions\" of BRAS (CC BY-SA 4.0), https://doi.org/10.14279/depositonce-6726.3";
const MEASURED: &str =
    "\"4 Additional data\" of BRAS (CC BY-SA 4.0), https://doi.org/10.14279/depositonce-6726.3";

/// Third octaves of the octaves 125 Hz … 4 kHz [Hz].
const BANDS: [f64; 18] = [
    100.0, 125.0, 160.0, 200.0, 250.0, 315.0, 400.0, 500.0, 630.0, 800.0, 1000.0, 1250.0, 1600.0, 2000.0,
    2500.0, 3150.0, 4000.0, 5000.0,
];

/// One thing changed at a time.
const VARIANTS: [Variant; 6] = [
    Variant { title: "fitted α", ..Variant::PLAIN },
    Variant { name: "initial", title: "initial α", estimate: 1, ..Variant::PLAIN },
    Variant { name: "angles", title: "locally reacting", is_locally_reacting: true, ..Variant::PLAIN },
    Variant { name: "straight", title: "diffraction off", effects: "-diffraction", ..Variant::PLAIN },
    Variant { name: "rough", title: "s at least 0.3", least_scattering: 0.3, ..Variant::PLAIN },
    Variant { name: "diffuse", title: "s = 1", least_scattering: 1.0, ..Variant::PLAIN },
];

/// Where a room is in the data sets, and what they say in prose.
struct Site {
    name: &'static str,
    title: &'static str,
    /// In names of its files.
    scene: &'static str,
    geometry: &'static str,
    /// Before the names of materials in the geometry.
    prefix: &'static str,
    air: [f64; 2],
    duration: f64,
    sources: &'static [Place],
    receivers: &'static [Place],
}

const SEMINAR_ROOM: Site = Site {
    name: "cr2",
    title: "BRAS CR2, seminar room, 146 m³",
    scene: "CR2",
    geometry: "scene9.ac",
    prefix: "mat_scene09_",
    air: [19.5, 41.7],
    duration: 3.0,
    sources: &[("LS1", [0.931, 0.723, 2.547]), ("LS2", [0.119, 0.723, -2.880])],
    receivers: &[
        ("MP1", [-0.993, 1.230, -1.426]),
        ("MP2", [0.439, 1.230, 0.147]),
        ("MP3", [1.361, 1.230, 0.603]),
        ("MP4", [-1.110, 1.230, 0.256]),
        ("MP5", [-0.998, 1.230, 1.409]),
    ],
};

const AUDITORIUM: Site = Site {
    name: "cr4",
    title: "BRAS CR4, auditorium, 8650 m³",
    scene: "CR4",
    geometry: "scene11.ac",
    prefix: "mat_scene11_",
    air: [20.9, 37.5],
    duration: 3.5,
    sources: &[("LS1", [0.0, 1.38, -4.5]), ("LS2", [-2.8, 1.38, 4.5])],
    receivers: &[
        ("MP1", [8.5, 1.09, 0.0]),
        ("MP2", [3.33, 0.57, 7.95]),
        ("MP3", [9.33, 1.18, 6.96]),
        ("MP4", [5.91, 0.83, -6.34]),
        ("MP5", [11.83, 1.43, -8.43]),
    ],
};

/// CR2, the seminar room.
pub(super) fn seminar_room(folder: &Folder) -> Result<Room> {
    room(folder, &SEMINAR_ROOM)
}

/// CR4, the auditorium.
pub(super) fn auditorium(folder: &Folder) -> Result<Room> {
    room(folder, &AUDITORIUM)
}

fn room(folder: &Folder, site: &Site) -> Result<Room> {
    let geometry = folder.text(site.geometry, GEOMETRY)?;
    let mut faces = ac3d::faces(&geometry).context(site.geometry)?;
    for face in &mut faces {
        face.material = face.material.replace(site.prefix, "");
    }
    let estimates = ["fitted", "initial"].map(|estimate| materials(folder, site, &faces, estimate));
    Ok(Room {
        name: site.name,
        title: site.title,
        faces,
        up: "y",
        temperature_celsius: site.air[0],
        relative_humidity_percent: site.air[1],
        duration: site.duration,
        bands: BANDS.to_vec(),
        bands_per_octave: 3,
        sources: site.sources,
        receivers: site.receivers,
        reverberation_time: ("T20", "t20_s"),
        estimates: estimates.into_iter().collect::<Result<_>>()?,
        variants: &VARIANTS,
        measured: vec![measured(folder, site.scene)?],
        others: vec![],
    })
}

/// Coefficients of the materials of `faces`.
fn materials(folder: &Folder, site: &Site, faces: &[Face], estimate: &str) -> Result<Vec<Material>> {
    let mut names: Vec<&str> = faces.iter().map(|face| face.material.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let material = |name: &str| {
        let file = format!("{estimate}_estimates/mat_{}_{name}.csv", site.scene);
        let rows = rows(&folder.text(&file, SURFACES)?).with_context(|| file.clone())?;
        ensure!(rows.len() == 3, "{file}: three rows are needed, frequency, absorption and scattering");
        let of_row = |row: usize| at_bands(&rows[0], &rows[row]).with_context(|| file.clone());
        Ok(Material { name: name.into(), absorption: of_row(1)?, scattering: of_row(2)? })
    };
    names.into_iter().map(material).collect()
}

/// The mean over the pairs, per band.
fn measured(folder: &Folder, scene: &str) -> Result<Vec<Values>> {
    let mut values = vec![[0.0; 4]; BANDS.len()];
    for (quantity, (name, unit)) in
        [("T20", 1.0), ("EDT", 1.0), ("C80", 1.0), ("D50", 0.01)].into_iter().enumerate()
    {
        let file = format!("Evaluation_{scene}_{name}.txt");
        let rows = rows(&folder.text(&file, MEASURED)?).with_context(|| file.clone())?;
        ensure!(rows.len() == 2, "{file}: two rows are needed, frequency and value");
        for (value, measured) in values.iter_mut().zip(at_bands(&rows[0], &rows[1]).context(file)?) {
            value[quantity] = unit * measured;
        }
    }
    Ok(values)
}

/// Lines of numbers with commas between.
fn rows(text: &str) -> Result<Vec<Vec<f64>>> {
    let lines = text.lines().filter(|line| !line.trim().is_empty());
    let number = |word: &str| word.trim().parse::<f64>().with_context(|| format!("{word:?} is not a number"));
    lines.map(|line| line.split(',').map(number).collect()).collect()
}

/// The values at our bands; a band may be named up to 4 % off (155 Hz for 160 Hz).
fn at_bands(frequencies: &[f64], values: &[f64]) -> Result<Vec<f64>> {
    let value = |band: &f64| {
        let index = frequencies.iter().position(|frequency| (frequency / band - 1.0).abs() < 0.04);
        index.and_then(|index| values.get(index)).copied().with_context(|| format!("no value at {band} Hz"))
    };
    BANDS.iter().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_taken_at_their_bands_also_under_old_names() {
        let frequencies = join(&BANDS).replace(",160,", ",155,");
        let text = format!("80,{frequencies}\n9,{}\n", join(&BANDS.map(|band| band / 1000.0)));
        let rows = rows(&text).unwrap();
        let values = at_bands(&rows[0], &rows[1]).unwrap();
        assert_eq!(values.len(), 18);
        assert!((values[2] - 0.16).abs() < 1e-12 && (values[0] - 0.1).abs() < 1e-12);
        assert!(at_bands(&rows[0][..10], &rows[1]).unwrap_err().to_string().contains("800 Hz"));
        assert!(super::rows("100, many").is_err());
    }

    #[test]
    fn a_room_has_its_materials_and_measured_means() {
        let root = std::env::temp_dir().join(format!("sonel-bras-{}", std::process::id()));
        let write = |file: &str, text: String| {
            let path = root.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        let triangle = "AC3Db\nMATERIAL \"mat_scene09_floor\" rgb 1 1 1\nOBJECT poly\nnumvert 3\n0 0 0\n1 0 0\n0 0 1\n\
                        numsurf 1\nSURF 0x10\nmat 0\nrefs 3\n0 0 0\n1 0 0\n2 0 0\nkids 0\n";
        write("models/scene9.ac", triangle.into());
        let constant = |value: f64| join(&[value; 18]);
        for (estimate, alpha) in [("fitted", 0.1), ("initial", 0.2)] {
            let text = format!("{}\n{}\n{}\n", join(&BANDS), constant(alpha), constant(0.05));
            write(&format!("csv/{estimate}_estimates/mat_CR2_floor.csv"), text);
        }
        for (name, value) in [("T20", 2.0), ("EDT", 1.5), ("C80", -1.0)] {
            write(
                &format!("data/Evaluation_CR2_{name}.txt"),
                format!("{}\n{}\n", join(&BANDS), constant(value)),
            );
        }
        let read = || seminar_room(&Folder::open(&root).unwrap());
        let message = read().err().unwrap().to_string();
        assert!(
            message.contains("Evaluation_CR2_D50.txt") && message.contains("4 Additional data"),
            "{message}"
        );
        write("data/Evaluation_CR2_D50.txt", format!("{}\n{}\n", join(&BANDS), constant(30.0)));
        let room = read().unwrap();
        assert_eq!(format!("{:?}", room.measured[0][17]), "[2.0, 1.5, -1.0, 0.3]");
        assert_eq!((room.faces[0].material.as_str(), room.estimates[1][0].name.as_str()), ("floor", "floor"));
        let absorption = [0, 1].map(|estimate| room.estimates[estimate][0].absorption[0]);
        assert!((absorption[0] - 0.1).abs() < 1e-12 && (absorption[1] - 0.2).abs() < 1e-12);
        std::fs::remove_dir_all(root).unwrap();
    }

    fn join(values: &[f64]) -> String {
        values.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")
    }
}
