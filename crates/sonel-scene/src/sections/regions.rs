//! `[[regions]]` and `interface = true` of materials: other air in parts of the room.

use glam::DVec3;
use sonel_acoustics::Air;
use sonel_geometry::Geometry;

use crate::bands::BandChoice;
use crate::document::Table;
use crate::media::MediaFault;
use crate::report::Report;
use crate::scene::Source;
use crate::sections::air::{AirChoice, read_speed, read_state};
use crate::sections::materials::is_interface;
use crate::sections::points::{Placed, Spot, place_at, read_names};
use crate::{Media, Region};

const KEYS: [&str; 5] =
    ["name", "inside", "temperature_celsius", "relative_humidity_percent", "speed_of_sound"];

/// A material whose faces are interfaces, and where its table stands in the file.
pub(crate) struct InterfaceMaterial {
    pub(crate) material: u32,
    pub(crate) at: usize,
    pub(crate) path: String,
}

/// The materials with `interface = true`, by their tables.
pub(crate) fn interfaces(tables: &[Table<'_>]) -> Vec<InterfaceMaterial> {
    let of_table = |(material, table): (u32, &Table<'_>)| InterfaceMaterial {
        material,
        at: table.at,
        path: table.path().to_owned(),
    };
    (0..).zip(tables).filter(|(_, table)| is_interface(table)).map(of_table).collect()
}

/// Reads the regions; what they do not say of their air is as in `air`.
pub(crate) fn read(document: &Table<'_>, air: &AirChoice, bands: &BandChoice) -> Vec<Placed<Region>> {
    let Some(section) = document.get("regions") else { return Vec::new() };
    let tables = section.tables("[[regions]]");
    let names = read_names("region", &tables);
    tables.iter().zip(names).map(|(table, name)| read_one(table, name, air, bands)).collect()
}

fn read_one(table: &Table<'_>, name: String, scene: &AirChoice, bands: &BandChoice) -> Placed<Region> {
    table.allow_only(&KEYS);
    let mut air = scene.air;
    read_state(table, &mut air);
    let stated = table.get("speed_of_sound");
    if let (Some(entry), Some(_)) = (&stated, table.get("temperature_celsius")) {
        entry.problem("given together with temperature_celsius; keep one of the two");
    }
    let stated = stated.and_then(|entry| read_speed(&entry));
    let (speed_of_sound, density) = speed_and_density(scene, air, stated);
    let air_attenuation = scene.attenuation_of(&air, &bands.bands);
    place_at(table, "inside", "give a point [x, y, z] in the region, in metres", |inside| Region {
        name,
        inside,
        air,
        speed_of_sound,
        density,
        air_attenuation,
    })
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
    regions: Vec<Placed<Region>>,
    interfaces: &[InterfaceMaterial],
    sources: &[Placed<Source>],
    geometry: &Geometry,
    report: &Report,
) -> Option<Media> {
    let sources: Vec<DVec3> = sources.iter().map(|source| source.point.position).collect();
    let mut are_placed = true;
    for Spot { position, at, path } in regions.iter().map(|region| &region.spot) {
        let found = at.map(|at| (at, geometry.check_place(*position, &sources)));
        if let Some((at, Err(misplaced))) = found {
            report.problem(at, format!("{path}: {position} {misplaced}"));
        }
        are_placed &= matches!(found, Some((_, Ok(()))));
    }
    let is_used = geometry.surfaces().iter().any(|surface| surface.interface);
    if !are_placed || regions.is_empty() && !is_used {
        return None;
    }
    let interface_materials = interfaces.iter().map(|interface| interface.material).collect();
    let of_scene = regions.iter().map(|region| region.point.clone()).collect();
    let found = Media::find(geometry, of_scene, interface_materials, &sources);
    found.map_err(|faults| faults.into_iter().for_each(|it| explain(it, &regions, interfaces, report))).ok()
}

fn explain(fault: MediaFault, regions: &[Placed<Region>], interfaces: &[InterfaceMaterial], report: &Report) {
    match fault {
        MediaFault::OneSpace { regions: [first, second] } => {
            let (first, second) = (&regions[first].point.name, &regions[second]);
            report.problem(
                second.at,
                format!("{}: region \"{first}\" is there too; {fault}", second.spot.path),
            );
        }
        MediaFault::Unbounded { region } => {
            report.problem(regions[region].at, format!("{}: {fault}", regions[region].spot.path));
        }
        MediaFault::BoundsNothing { material, .. } | MediaFault::TwoAirs { material, .. } => {
            let interface = interfaces.iter().find(|interface| interface.material == material);
            let (at, path) = interface.map_or((0, "materials"), |found| (found.at, &found.path));
            report.problem(at, format!("{path}: {fault}"));
        }
    }
}
