//! `[materials.NAME]`

use sonel_acoustics::{AbsorptionLaw, Material, MaterialProblem};

use crate::DEFAULT_SCATTERING;
use crate::bands::BandChoice;
use crate::document::{Entry, Number, Table};
use crate::library::MaterialSources;
use crate::report::Report;
use crate::scene::opaque;

const KEYS: [&str; 10] = [
    "absorption",
    "scattering",
    "diffuse",
    "transmission",
    "absorption_law",
    "sound_reduction_db",
    "source",
    "library",
    "interface",
    VARIANTS,
];
/// Keys of a variant; what they do not state is as in its material.
const VARIANT_KEYS: [&str; 7] =
    ["absorption", "scattering", "diffuse", "transmission", "sound_reduction_db", "source", "library"];
/// The key of a list of variants.
const VARIANTS: &str = "variants";

/// α + δ may exceed 1 by this much: the decimal fractions of a scene file are rounded to binary ones.
const ROUNDING: f64 = 1e-12;

/// Reads every material, in the order of the file. A material with problems is there too, so that its name is known.
pub(crate) fn read(
    document: &Table<'_>,
    bands: &BandChoice,
    material_sources: &MaterialSources,
    report: &mut Report<'_>,
) -> Vec<Material> {
    let Some(section) = document.get("materials") else { return Vec::new() };
    let Some(table) = section.table(report) else { return Vec::new() };
    let mut materials = Vec::new();
    for (name, entry) in table.in_file_order() {
        if let Some(table) = entry.table(report) {
            table.allow_only(&KEYS, report);
            materials.push(read_one(name, None, &table, bands, material_sources, report));
        }
    }
    materials
}

/// Reads the variants of `materials`, in their order; nothing where none has any.
pub(crate) fn read_variants(
    document: &Table<'_>,
    materials: &[Material],
    bands: &BandChoice,
    material_sources: &MaterialSources,
    report: &mut Report<'_>,
) -> Vec<Vec<Material>> {
    let Some(table) = document.get("materials").and_then(|section| section.table(report)) else {
        return Vec::new();
    };
    let mut read = |material: &Material| -> Vec<Material> {
        let Some(own) = table.get(&material.name).and_then(|entry| entry.table(report)) else {
            return Vec::new();
        };
        let Some(list) = own.get(VARIANTS) else { return Vec::new() };
        if own.get("interface").is_some() {
            return Vec::new();
        }
        if !list.is_list() {
            list.problem(report, "expected a list of tables such as [{ absorption = 0.9 }]");
            return Vec::new();
        }
        let tables = list.tables("{", report);
        let one = |table: &Table<'_>| {
            check_variant_keys(table, report);
            read_variant(material, table, bands, material_sources, report)
        };
        tables.iter().map(one).collect()
    };
    let variants: Vec<Vec<Material>> = materials.iter().map(&mut read).collect();
    if variants.iter().all(Vec::is_empty) { Vec::new() } else { variants }
}

/// Reports keys of `table` that no variant has.
pub(crate) fn check_variant_keys(table: &Table<'_>, report: &mut Report<'_>) {
    table.allow_only(&VARIANT_KEYS, report);
}

/// Reads a variant of `material`; what it does not state is as in the material.
pub(crate) fn read_variant(
    material: &Material,
    table: &Table<'_>,
    bands: &BandChoice,
    material_sources: &MaterialSources,
    report: &mut Report<'_>,
) -> Material {
    let before = report.problem_count();
    let variant = read_one(&material.name, Some(material), table, bands, material_sources, report);
    if report.problem_count() == before {
        check_inherited(table, &variant, bands, report);
    }
    variant
}

/// Reports what a variant cannot have together with what it has from its material.
fn check_inherited(table: &Table<'_>, variant: &Material, bands: &BandChoice, report: &mut Report<'_>) {
    let center = |band: usize| bands.bands.nominal()[band];
    let message = match variant.problems(bands.bands.count()).first() {
        Some(&MaterialProblem::TransmissionAboveAbsorption { band, transmission, absorption }) => format!(
            "transmission {transmission}, as of the material, exceeds absorption {absorption} at {} Hz; give less transmission, or more \
             absorption",
            center(band)
        ),
        Some(&MaterialProblem::TooSoft { law, band, absorption }) => format!(
            "absorption {absorption} at {} Hz is more than the {:.3} that a {law} wall can absorb of a diffuse field; give less",
            center(band),
            law.largest()
        ),
        Some(MaterialProblem::AngularPartition { law, .. }) => {
            format!("nothing passes a {law} wall; remove transmission")
        }
        _ => return,
    };
    report.problem(table.at, format!("{}: {message}", table.path()));
}

/// Reads a material of this name; what a variant does not state is as in the material that it is of.
fn read_one(
    name: &str,
    original: Option<&Material>,
    table: &Table<'_>,
    bands: &BandChoice,
    material_sources: &MaterialSources,
    report: &mut Report<'_>,
) -> Material {
    if table.get("interface").and_then(|entry| entry.flag(report)) == Some(true) {
        return read_interface(name, table, bands, report);
    }
    let before = report.problem_count();
    let mut borrowed = material_sources.borrow(table, bands, report);
    if let Some(Material { absorption, scattering, .. }) = original {
        borrowed.absorption.get_or_insert_with(|| absorption.clone());
        borrowed.scattering.get_or_insert_with(|| scattering.clone());
    }
    let count = bands.bands.count();
    let absorption = given("absorption", table, bands, report);
    if table.get("absorption").is_none() && borrowed.absorption.is_none() {
        let key = table.path_of("absorption");
        report.problem(table.at, format!("{key}: missing; give one number, one per band, or library"));
    }
    let absorption =
        absorption.map(|(_, values)| values).or(borrowed.absorption).unwrap_or_else(|| vec![0.0; count]);
    let is_absorption_known = report.problem_count() == before;
    let scattering = given("scattering", table, bands, report);
    let diffuse = given("diffuse", table, bands, report);
    if let (Some(_), Some(entry)) = (table.get("scattering"), table.get("diffuse")) {
        entry.problem(report, "given together with scattering; keep one of the two");
    }
    let transmission = read_transmission(table, is_absorption_known.then_some(&absorption), bands, report);
    let scattering = match (scattering, diffuse) {
        (Some((_, values)), _) => values,
        (None, Some((entry, values))) => scattering_of(&entry, &values, &absorption, bands, report),
        (None, None) if borrowed.scattering.is_some() => borrowed.scattering.unwrap_or_default(),
        (None, None) => {
            report.default(format!("{}: {DEFAULT_SCATTERING} (default)", table.path_of("scattering")));
            vec![DEFAULT_SCATTERING; count]
        }
    };
    let passes = transmission.iter().flatten().any(|&share| share > 0.0);
    let law = match original {
        Some(original) => original.law,
        None => read_law(table, &absorption, passes, bands, report),
    };
    let otherwise = || original.map_or_else(|| vec![0.0; count], |original| original.transmission.clone());
    Material {
        name: name.to_owned(),
        law,
        absorption,
        scattering,
        transmission: transmission.unwrap_or_else(otherwise),
        source: table
            .get("source")
            .and_then(|entry| entry.text(report))
            .map(str::to_owned)
            .or(borrowed.source),
    }
}

/// The coefficient that is given under `key`, and its entry.
fn given<'a>(
    key: &str,
    table: &Table<'a>,
    bands: &BandChoice,
    report: &mut Report<'_>,
) -> Option<(Entry<'a>, Vec<f64>)> {
    let entry = table.get(key)?;
    let values = read_coefficient(&entry, bands, report)?;
    Some((entry, values))
}

/// Transmission as a coefficient or as a sound reduction; none where neither is given. It is compared with `absorption` where that could
/// be read.
fn read_transmission(
    table: &Table<'_>,
    absorption: Option<&Vec<f64>>,
    bands: &BandChoice,
    report: &mut Report<'_>,
) -> Option<Vec<f64>> {
    let transmission = given("transmission", table, bands, report);
    let reduction = table
        .get("sound_reduction_db")
        .and_then(|entry| Some((read_reduction(&entry, bands, report)?, entry)));
    if let (Some(_), Some(entry)) = (table.get("transmission"), table.get("sound_reduction_db")) {
        entry.problem(report, "given together with transmission; keep one of the two");
    }
    let transmission = transmission.or_else(|| reduction.map(|(values, entry)| (entry, values)));
    if let (Some((entry, values)), Some(absorption)) = (&transmission, absorption) {
        check_transmission(entry, values, absorption, bands, report);
    }
    transmission.map(|(_, values)| values)
}

fn read_law(
    table: &Table<'_>,
    absorption: &[f64],
    passes: bool,
    bands: &BandChoice,
    report: &mut Report<'_>,
) -> AbsorptionLaw {
    let Some(entry) = table.get("absorption_law") else { return AbsorptionLaw::Uniform };
    let Some(word) = entry.text(report) else { return AbsorptionLaw::Uniform };
    let Ok(law) = word.parse::<AbsorptionLaw>() else {
        let known = AbsorptionLaw::ALL.map(|law| format!("`{law}`")).join(" or ");
        entry.problem(report, &format!("unknown law `{word}`; write {known}"));
        return AbsorptionLaw::Uniform;
    };
    if !law.is_angular() {
        return law;
    }
    if passes {
        entry.problem(report, &format!("nothing passes a {law} wall; remove transmission, or this key"));
    }
    let limit = law.largest();
    if let Some(band) = absorption.iter().position(|&absorption| absorption > limit) {
        let (absorption, center) = (absorption[band], bands.bands.nominal()[band]);
        let message = format!(
            "absorption {absorption} at {center} Hz is more than the {limit:.3} that a {law} wall can absorb of a diffuse \
             field; give less, or remove this key"
        );
        entry.problem(report, &message);
        return AbsorptionLaw::Uniform;
    }
    law
}

/// An interface between airs: it has no coefficients.
fn read_interface(name: &str, table: &Table<'_>, bands: &BandChoice, report: &mut Report<'_>) -> Material {
    for key in KEYS.into_iter().filter(|&key| key != "interface" && key != "source") {
        if let Some(entry) = table.get(key) {
            entry.problem(
                report,
                "an interface between airs has no coefficients; remove this key, or interface",
            );
        }
    }
    let source = table.get("source").and_then(|entry| entry.text(report)).map(str::to_owned);
    Material { source, ..opaque(name, bands.bands.count()) }
}

/// Numbers 0 … 1, one per band.
fn read_coefficient(entry: &Entry<'_>, bands: &BandChoice, report: &mut Report<'_>) -> Option<Vec<f64>> {
    let numbers = entry.number_or_list(report)?;
    let outside = |number: &&Number| !(0.0..=1.0).contains(&number.value);
    let mut all_inside = true;
    for number in numbers.readable.iter().filter(outside) {
        all_inside = false;
        let above = entry.path.ends_with("absorption") && number.value > 1.0;
        let remedy = if above { "; give 1 for measured values above 1 (ISO 354)" } else { "" };
        report.problem(number.at, format!("{}: {} is outside 0 … 1{remedy}", entry.path, number.value));
    }
    let values = bands.per_band(entry, &numbers, report);
    (all_inside && numbers.is_complete).then_some(values)
}

/// τ = 10^(−R/10) from sound reduction indices R [dB], one or one per band.
fn read_reduction(entry: &Entry<'_>, bands: &BandChoice, report: &mut Report<'_>) -> Option<Vec<f64>> {
    let numbers = entry.number_or_list(report)?;
    let mut all_sound = true;
    for number in numbers.readable.iter().filter(|number| !(number.value >= 0.0 && number.value.is_finite()))
    {
        all_sound = false;
        report
            .problem(number.at, format!("{}: {} dB is below 0; give 0 dB or more", entry.path, number.value));
    }
    let values = bands.per_band(entry, &numbers, report);
    let transmission = |reduction: f64| libm::pow(10.0, -0.1 * reduction);
    (all_sound && numbers.is_complete).then(|| values.into_iter().map(transmission).collect())
}

/// s from the paper's δ: s = δ / (1−α), 0 where nothing is reflected.
fn scattering_of(
    entry: &Entry<'_>,
    diffuse: &[f64],
    absorption: &[f64],
    bands: &BandChoice,
    report: &mut Report<'_>,
) -> Vec<f64> {
    let excess = |(diffuse, absorption): (&f64, &f64)| diffuse + absorption > 1.0 + ROUNDING;
    if let Some(band) = diffuse.iter().zip(absorption).position(excess) {
        let (diffuse, absorption, center) = (diffuse[band], absorption[band], bands.bands.nominal()[band]);

        let message = format!(
            "{diffuse} and absorption {absorption} exceed 1 together at {center} Hz; give at most 1 - absorption"
        );
        entry.problem(report, &message);
    }
    let share = |(diffuse, absorption): (&f64, &f64)| {
        let reflected = 1.0 - absorption;
        if reflected > 0.0 { (diffuse / reflected).clamp(0.0, 1.0) } else { 0.0 }
    };
    diffuse.iter().zip(absorption).map(share).collect()
}

fn check_transmission(
    entry: &Entry<'_>,
    transmission: &[f64],
    absorption: &[f64],
    bands: &BandChoice,
    report: &mut Report<'_>,
) {
    let excess = |(transmission, absorption): (&f64, &f64)| transmission > absorption;
    if let Some(band) = transmission.iter().zip(absorption).position(excess) {
        let (transmission, absorption) = (transmission[band], absorption[band]);
        let center = bands.bands.nominal()[band];
        let message = format!(
            "transmission {transmission} exceeds absorption {absorption} at {center} Hz; what passes is part of what is absorbed: give \
             at least as much absorption"
        );
        entry.problem(report, &message);
    }
}
