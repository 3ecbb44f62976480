//! `[[regions]]` and `interface = true` of materials: other air in parts of the room.

use glam::DVec3;
use sonel_acoustics::Air;
use sonel_geometry::Geometry;

use crate::bands::BandChoice;
use crate::document::Table;
use crate::media::{MediaFault, find_sides};
use crate::report::Report;
use crate::scene::{Source, attenuation_per_band};
use crate::sections::air::{AirChoice, read_speed, read_state};
use crate::sections::points::{Placed, read_names};
use crate::{Media, Region};

const KEYS: [&str; 5] =
    ["name", "inside", "temperature_celsius", "relative_humidity_percent", "speed_of_sound"];

/// A region and where its table and its point stand in the file.
pub(crate) struct PlacedRegion {
    region: Region,
    at: usize,
    path: String,
    inside_at: Option<usize>,
}

/// A material whose faces are interfaces, and where its table stands in the file.
pub(crate) struct Interface {
    pub(crate) material: u32,
    pub(crate) at: usize,
    pub(crate) path: String,
}

/// The materials with `interface = true`, as [`crate::sections::materials::read`] numbers them.
pub(crate) fn read_interfaces(document: &Table<'_>, report: &mut Report<'_>) -> Vec<Interface> {
    let Some(table) = document.get("materials").and_then(|section| section.table(report)) else {
        return Vec::new();
    };
    let tables = table
        .in_file_order()
        .into_iter()
        .filter_map(|(_, entry)| entry.table(report).map(|table| (entry, table)));
    let tables: Vec<_> = tables.collect();
    let is_interface = |table: &Table<'_>, report: &mut Report<'_>| {
        table.get("interface").and_then(|entry| entry.flag(report)).unwrap_or(false)
    };
    (0_u32..)
        .zip(&tables)
        .filter(|(_, (_, table))| is_interface(table, report))
        .map(|(material, (entry, _))| Interface { material, at: entry.at, path: entry.path.clone() })
        .collect()
}

/// Reads the regions; what they do not say of their air is as in `air`.
pub(crate) fn read(
    document: &Table<'_>,
    air: &AirChoice,
    bands: &BandChoice,
    report: &mut Report<'_>,
) -> Vec<PlacedRegion> {
    let Some(section) = document.get("regions") else { return Vec::new() };
    let tables = section.tables("[[regions]]", report);
    let names = read_names("region", &tables, report);
    tables.iter().zip(names).map(|(table, name)| read_one(table, name, air, bands, report)).collect()
}

fn read_one(
    table: &Table<'_>,
    name: String,
    scene: &AirChoice,
    bands: &BandChoice,
    report: &mut Report<'_>,
) -> PlacedRegion {
    table.allow_only(&KEYS, report);
    let inside = table.get("inside");
    if inside.is_none() {
        let key = table.path_of("inside");
        report.problem(table.at, format!("{key}: missing; give a point [x, y, z] in the region, in metres"));
    }
    let point = inside.as_ref().and_then(|entry| entry.vector(report));
    let mut air = scene.air;
    read_state(table, &mut air, report);
    let stated = table.get("speed_of_sound");
    if let (Some(entry), Some(_)) = (&stated, table.get("temperature_celsius")) {
        entry.problem(report, "given together with temperature_celsius; keep one of the two");
    }
    let stated = stated.and_then(|entry| read_speed(&entry, report));
    let (speed_of_sound, density) = speed_and_density(scene, air, stated);
    let air_attenuation = if scene.attenuates() {
        attenuation_per_band(&air, &bands.bands)
    } else {
        vec![0.0; bands.bands.count()]
    };
    PlacedRegion {
        at: table.at,
        path: table.path_of("inside"),
        inside_at: point.and(inside.map(|entry| entry.at)),
        region: Region {
            name,
            inside: point.unwrap_or(DVec3::ZERO),
            air,
            speed_of_sound,
            density,
            air_attenuation,
        },
    }
}

/// c [m/s] and ρ [kg/m³] of `air` beside that of the scene. The pressure is that of the scene: without a temperature ρc² is equal on both sides.
fn speed_and_density(scene: &AirChoice, air: Air, stated: Option<f64>) -> (f64, f64) {
    let own = scene.speed_of_sound();
    match stated {
        Some(speed) => (speed, scene.air.density() * (own / speed) * (own / speed)),
        None => {
            let ratio = air.temperature_kelvin() / scene.air.temperature_kelvin();
            (own * libm::sqrt(ratio), air.density())
        }
    }
}

/// Regions, interfaces and the airs at the sources; none where the scene has neither, or any of them is wrong.
pub(crate) fn compile(
    regions: Vec<PlacedRegion>,
    interfaces: &[Interface],
    sources: &[Placed<Source>],
    geometry: &Geometry,
    report: &mut Report<'_>,
) -> Option<Media> {
    let sources: Vec<DVec3> = sources.iter().map(|source| source.point.position).collect();
    let mut are_placed = true;
    for PlacedRegion { region, inside_at, path, .. } in &regions {
        let Some(at) = *inside_at else {
            are_placed = false;
            continue;
        };
        if let Err(misplaced) = geometry.check_place(region.inside, &sources) {
            report.problem(at, format!("{path}: {} {misplaced}", region.inside));
            are_placed = false;
        }
    }
    let is_used = geometry.surfaces().iter().any(|surface| surface.interface);
    if !are_placed || regions.is_empty() && !is_used {
        return None;
    }
    let inside: Vec<DVec3> = regions.iter().map(|placed| placed.region.inside).collect();
    match find_sides(geometry, &inside) {
        Ok(sides) => {
            let mut media = Media {
                regions: regions.into_iter().map(|placed| placed.region).collect(),
                interfaces: interfaces.iter().map(|interface| interface.material).collect(),
                sides,
                at_sources: Vec::new(),
            };
            let airs = media.airs(geometry);
            media.at_sources = sources.iter().map(|&source| airs.at(source)).collect();
            Some(media)
        }
        Err(faults) => {
            faults.into_iter().for_each(|fault| report_fault(fault, &regions, interfaces, report));
            None
        }
    }
}

fn report_fault(
    fault: MediaFault,
    regions: &[PlacedRegion],
    interfaces: &[Interface],
    report: &mut Report<'_>,
) {
    match fault {
        MediaFault::OneSpace { regions: [first, second] } => {
            let (first, second) = (&regions[first].region.name, &regions[second]);
            report.problem(second.at, format!("{}: region \"{first}\" is there too; {fault}", second.path));
        }
        MediaFault::Unbounded { region } => {
            report.problem(regions[region].at, format!("{}: {fault}", regions[region].path));
        }
        MediaFault::BoundsNothing { material, .. } | MediaFault::TwoAirs { material, .. } => {
            let interface = interfaces.iter().find(|interface| interface.material == material);
            let (at, path) = interface.map_or((0, "materials"), |found| (found.at, &found.path));
            report.problem(at, format!("{path}: {fault}"));
        }
    }
}
