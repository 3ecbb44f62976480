//! `[materials.NAME]`

use sonel_acoustics::{AbsorptionLaw, Material, MaterialProblem, sample};

use crate::DEFAULT_SCATTERING;
use crate::bands::BandChoice;
use crate::document::{Entry, Number, Table};
use crate::library::{MaterialSources, shipped};
use crate::scene::opaque;

const KEYS: [&str; 12] = [
    "absorption",
    "scattering",
    "diffuse",
    "transmission",
    "sound_reduction_db",
    SAMPLE,
    PEOPLE,
    "source",
    "library",
    "absorption_law",
    "interface",
    VARIANTS,
];
/// How many of these a variant may have; what it does not state is as in its material.
const OF_VARIANT: usize = 9;
/// The key of a list of variants.
const VARIANTS: &str = "variants";

/// The key of the number of people on a surface [1/m²].
const PEOPLE: &str = "people";

/// Audience areas of the library with their people [1/m²]; fewer leave the rest of the surface as it is.
const AUDIENCES: [(f64, &str); 3] = [(1.0, "audience-1"), (1.5, "audience-1.5"), (2.0, "audience-2")];

/// The key of the area of the sample on which absorption was measured [m²].
const SAMPLE: &str = "sample_area";

/// Largest sample [m²]; walls without end need no key.
const LARGEST_SAMPLE: f64 = 100.0;

/// α + δ may exceed 1 by this much: the decimal fractions of a scene file are rounded to binary ones.
const ROUNDING: f64 = 1e-12;

/// Reads every material, in the order of the file, and its table. A material with problems is there too, so that its name is known.
pub(crate) fn read<'t>(document: &Table<'t>, sources: &MaterialSources) -> (Vec<Material>, Vec<Table<'t>>) {
    let section = document.table("materials");
    let tables = section.iter().flat_map(Table::in_file_order);
    let read = |(name, entry): (&str, Entry<'t>)| {
        let table = entry.table()?;
        table.allow_only(&KEYS);
        Some((read_one(name, None, &table, sources), table))
    };
    tables.filter_map(read).unzip()
}

/// Whether the table of a material makes it an interface.
pub(crate) fn is_interface(table: &Table<'_>) -> bool {
    table.get("interface").and_then(|entry| entry.flag()) == Some(true)
}

/// Reads the variants of `materials` from their `tables`, in their order; nothing where none has any.
pub(crate) fn read_variants(
    materials: &[Material],
    tables: &[Table<'_>],
    sources: &MaterialSources,
) -> Vec<Vec<Material>> {
    let of_material = |(material, own)| variants_of(material, own, sources);
    let variants: Vec<Vec<Material>> = materials.iter().zip(tables).map(of_material).collect();
    if variants.iter().all(Vec::is_empty) { Vec::new() } else { variants }
}

/// Reads the variants of one material from its `own` table.
pub(crate) fn variants_of(material: &Material, own: &Table<'_>, sources: &MaterialSources) -> Vec<Material> {
    let Some(list) = own.get(VARIANTS).filter(|_| own.get("interface").is_none()) else { return Vec::new() };
    if !list.is_list() {
        return list.refused("expected a list of tables such as [{ absorption = 0.9 }]").unwrap_or_default();
    }
    let tables = list.tables("{");
    tables.iter().map(|table| read_variant(material, table, sources)).collect()
}

/// Reads a variant of `material`; what it does not state is as in the material.
pub(crate) fn read_variant(material: &Material, table: &Table<'_>, sources: &MaterialSources) -> Material {
    table.allow_only(&KEYS[..OF_VARIANT]);
    read_one(&material.name, Some(material), table, sources)
}

/// Reports what a material cannot be: at the key that makes it so, or for what a variant has from its material at the variant.
fn check(table: &Table<'_>, material: &Material, bands: &BandChoice) {
    let center = |band: usize| bands.bands.nominal()[band];
    let mut problems = material.problems(bands.bands.count());
    problems.dedup_by_key(|problem| std::mem::discriminant(problem));
    for problem in problems {
        let (key, message, [stated, inherited]) = match problem {
            MaterialProblem::TransmissionAboveAbsorption { band, transmission, absorption } => {
                let key = table.get("transmission").or_else(|| table.get("sound_reduction_db"));
                let origin = if key.is_some() { "" } else { ", as of the material," };
                let message = format!(
                    "transmission {transmission}{origin} exceeds absorption {absorption} at {} Hz",
                    center(band)
                );
                let part = "what passes is part of what is absorbed: give at least as much absorption";
                (key, message, [part, "give less transmission, or more absorption"])
            }
            MaterialProblem::TooSoft { law, band, absorption } => (
                table.get("absorption_law"),
                format!(
                    "absorption {absorption} at {} Hz is more than the {:.3} that a {law} wall can absorb of a diffuse field",
                    center(band),
                    law.largest()
                ),
                ["give less, or remove this key", "give less"],
            ),
            MaterialProblem::AngularPartition { law, .. } => (
                table.get("absorption_law"),
                format!("nothing passes a {law} wall"),
                ["remove transmission, or this key", "remove transmission"],
            ),
            // Reported where the numbers were read.
            MaterialProblem::WrongLength { .. } | MaterialProblem::OutOfRange { .. } => continue,
        };
        match key {
            Some(entry) => entry.problem(&format!("{message}; {stated}")),
            None => table.report.problem(table.at, format!("{}: {message}; {inherited}", table.path())),
        }
    }
}

/// Reads a material of this name; what a variant does not state is as in the material that it is of.
fn read_one(
    name: &str,
    original: Option<&Material>,
    table: &Table<'_>,
    sources: &MaterialSources,
) -> Material {
    let bands = &sources.bands;
    if is_interface(table) {
        return read_interface(name, table, bands);
    }
    let before = table.report.problem_count();
    let mut borrowed = sources.borrow(table);
    if let Some(Material { scattering, .. }) = original {
        borrowed.scattering.get_or_insert_with(|| scattering.clone());
    }
    let count = bands.bands.count();
    let law = original.map_or_else(|| read_law(table), |original| original.law);
    let stated = given("absorption", table, bands).map(|(_, values)| values).or(borrowed.absorption);
    let stated = stated.map(|values| read_as_measured(values, law, table, bands));
    let absorption = stated.or_else(|| original.map(|original| original.absorption.clone()));
    if table.get("absorption").is_none() && absorption.is_none() {
        table.missing("absorption", "give one number, one per band, or library");
    }
    let absorption = absorption.unwrap_or_else(|| vec![0.0; count]);
    let absorption = with_people(absorption, table, bands);
    let is_absorption_known = table.report.problem_count() == before;
    let scattering = given("scattering", table, bands);
    let diffuse = given("diffuse", table, bands);
    if let (Some(_), Some(entry)) = (table.get("scattering"), table.get("diffuse")) {
        entry.problem("given together with scattering; keep one of the two");
    }
    let transmission = read_transmission(table, bands);
    let scattering = match (scattering, diffuse) {
        (Some((_, values)), _) => values,
        (None, Some((entry, values))) => scattering_of(&entry, &values, &absorption, bands),
        (None, None) if borrowed.scattering.is_some() => borrowed.scattering.unwrap_or_default(),
        (None, None) => {
            table.report.default(format!("{}: {DEFAULT_SCATTERING} (default)", table.path_of("scattering")));
            vec![DEFAULT_SCATTERING; count]
        }
    };
    let otherwise = || original.map_or_else(|| vec![0.0; count], |original| original.transmission.clone());
    let material = Material {
        name: name.to_owned(),
        law,
        absorption,
        scattering,
        transmission: transmission.unwrap_or_else(otherwise),
        source: table.get("source").and_then(|entry| entry.text()).map(str::to_owned).or(borrowed.source),
    };
    if is_absorption_known {
        check(table, &material, bands);
    }
    material
}

/// The absorption of a surface of these `values` with people on it: between audience areas of the library, by their number per area.
fn with_people(values: Vec<f64>, table: &Table<'_>, bands: &BandChoice) -> Vec<f64> {
    let Some(entry) = table.get(PEOPLE) else { return values };
    let Some(density) = entry.positive() else { return values };
    let mut below = (0.0, values);
    for (people, name) in AUDIENCES {
        let octaves = shipped().iter().find(|of| of.name == name).and_then(|of| of.absorption.as_ref());
        let of_band = |hz: &f64| octaves.map_or(0.0, |octaves| octaves.at(*hz).0);
        let full: Vec<f64> = bands.bands.nominal().iter().map(of_band).collect();
        if density <= people {
            let share = (density - below.0) / (people - below.0);
            return below.1.iter().zip(full).map(|(less, more)| less + share * (more - less)).collect();
        }
        below = (people, full);
    }
    entry.problem(&format!("{density} people per m² are more than tables have; give at most {}", below.0));
    below.1
}

/// The absorption of walls without end where `values` are those of a sample.
fn read_as_measured(values: Vec<f64>, law: AbsorptionLaw, table: &Table<'_>, bands: &BandChoice) -> Vec<f64> {
    let Some(entry) = table.get(SAMPLE) else { return values };
    let Some(area) = entry.positive() else { return values };
    let of_wall = |(value, center): (&f64, &f64)| sample::without_end(*value, area, *center);
    let walls: Option<Vec<f64>> = values.iter().zip(bands.bands.nominal()).map(of_wall).collect();
    let is_sample = law == AbsorptionLaw::LocallyReacting && area <= LARGEST_SAMPLE;
    walls.filter(|_| is_sample).unwrap_or_else(|| {
        entry.problem(&format!("no locally reacting sample of {area} m² (at most {LARGEST_SAMPLE} m²) has absorption {values:?}: give less, state absorption_law = \"locally-reacting\", or remove this key"));
        values
    })
}

/// The coefficient that is given under `key`, one or one per band, and its entry.
fn given<'a>(key: &str, table: &Table<'a>, bands: &BandChoice) -> Option<(Entry<'a>, Vec<f64>)> {
    let entry = table.get(key)?;
    let largest = if key == "absorption" && table.get(SAMPLE).is_some() { 2.0 } else { 1.0 };
    let values = read_per_band(&entry, bands, |value| {
        let above = key == "absorption" && value > largest;
        let remedy = if above { "; give 1 for measured values above 1 (ISO 354)" } else { "" };
        (!(0.0..=largest).contains(&value)).then(|| format!("{value} is outside 0 … {largest}{remedy}"))
    })?;
    Some((entry, values))
}

/// Transmission as a coefficient or as a sound reduction; none where neither is given.
fn read_transmission(table: &Table<'_>, bands: &BandChoice) -> Option<Vec<f64>> {
    let transmission = given("transmission", table, bands).map(|(_, values)| values);
    let reduction = table.get("sound_reduction_db");
    if let (Some(_), Some(entry)) = (table.get("transmission"), &reduction) {
        entry.problem("given together with transmission; keep one of the two");
    }
    let reduction = reduction.and_then(|entry| read_reduction(&entry, bands));
    transmission.or(reduction)
}

fn read_law(table: &Table<'_>) -> AbsorptionLaw {
    let read = |entry: Entry<'_>| {
        let word = entry.text()?;
        word.parse().ok().or_else(|| {
            let known = AbsorptionLaw::ALL.map(|law| format!("`{law}`")).join(" or ");
            entry.refused(&format!("unknown law `{word}`; write {known}"))
        })
    };
    table.get("absorption_law").and_then(read).unwrap_or_default()
}

/// An interface between airs: it has no coefficients.
fn read_interface(name: &str, table: &Table<'_>, bands: &BandChoice) -> Material {
    for key in KEYS.into_iter().filter(|&key| key != "interface" && key != "source") {
        if let Some(entry) = table.get(key) {
            entry.problem("an interface between airs has no coefficients; remove this key, or interface");
        }
    }
    let source = table.get("source").and_then(|entry| entry.text()).map(str::to_owned);
    Material { source, ..opaque(name, bands.bands.count()) }
}

/// τ = 10^(−R/10) from sound reduction indices R [dB], one or one per band.
fn read_reduction(entry: &Entry<'_>, bands: &BandChoice) -> Option<Vec<f64>> {
    let below = |value: f64| (value < 0.0).then(|| format!("{value} dB is below 0; give 0 dB or more"));
    let reductions = read_per_band(entry, bands, below)?;
    Some(reductions.into_iter().map(|reduction| libm::pow(10.0, -0.1 * reduction)).collect())
}

/// One number or one per band, where `fault` finds none in them.
fn read_per_band(
    entry: &Entry<'_>,
    bands: &BandChoice,
    fault: impl Fn(f64) -> Option<String>,
) -> Option<Vec<f64>> {
    let numbers = entry.number_or_list()?;
    let mut is_sound = numbers.is_complete;
    for Number { value, at } in &numbers.readable {
        if let Some(fault) = fault(*value) {
            is_sound = false;
            entry.report.problem(*at, format!("{}: {fault}", entry.path));
        }
    }
    let values = bands.per_band(entry, &numbers);
    is_sound.then_some(values)
}

/// s from the paper's δ: s = δ / (1−α), 0 where nothing is reflected.
fn scattering_of(entry: &Entry<'_>, diffuse: &[f64], absorption: &[f64], bands: &BandChoice) -> Vec<f64> {
    let excess = |(diffuse, absorption): (&f64, &f64)| diffuse + absorption > 1.0 + ROUNDING;
    if let Some(band) = diffuse.iter().zip(absorption).position(excess) {
        let (diffuse, absorption, center) = (diffuse[band], absorption[band], bands.bands.nominal()[band]);

        let message = format!(
            "{diffuse} and absorption {absorption} exceed 1 together at {center} Hz; give at most 1 - absorption"
        );
        entry.problem(&message);
    }
    let share = |(diffuse, absorption): (&f64, &f64)| {
        let reflected = 1.0 - absorption;
        if reflected > 0.0 { (diffuse / reflected).clamp(0.0, 1.0) } else { 0.0 }
    };
    diffuse.iter().zip(absorption).map(share).collect()
}
