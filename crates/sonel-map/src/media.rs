//! Regions of other air as a section of the file, validated on reading.

use glam::DVec3;
use sonel_scene::{Media, NO_AIR, Region, Scene};

use crate::codec::{MediaRecord, RegionRecord};
use crate::format::SurfaceRow;
use crate::record;

/// Name of the section.
pub(crate) const SECTION: &str = "regions";

pub(crate) fn record(media: &Media) -> MediaRecord {
    let region = |region: &Region| RegionRecord {
        name: region.name.clone(),
        inside: region.inside.to_array(),
        air: record::air_record(&region.air),
        speed_of_sound: region.speed_of_sound,
        density: region.density,
        air_attenuation: region.air_attenuation.clone(),
    };
    MediaRecord {
        regions: media.regions.iter().map(region).collect(),
        interfaces: media.interfaces.clone(),
        at_sources: media.at_sources.clone(),
        sides: media.sides.clone(),
    }
}

/// The regions of `record` for `scene`, whose surfaces are `rows`; the reason where they contradict these.
pub(crate) fn media(record: MediaRecord, scene: &Scene, rows: &[SurfaceRow]) -> Result<Media, String> {
    let airs = record.regions.len() as u32 + 1;
    let bands = scene.bands.count();
    let is_interface = |row: &SurfaceRow| record.interfaces.contains(&row.material);
    let agrees = |(row, sides): (&SurfaceRow, &[u32; 2])| match sides {
        [NO_AIR, NO_AIR] => !is_interface(row),
        [front, back] => is_interface(row) && front != back && *front.max(back) < airs,
    };
    if record.interfaces.iter().any(|&interface| interface as usize >= scene.materials.len()) {
        return Err("an interface is of a material that does not exist".to_owned());
    }
    if record.sides.len() != rows.len() || !rows.iter().zip(&record.sides).all(agrees) {
        return Err("regions and surfaces contradict each other".to_owned());
    }
    if record.at_sources.len() != scene.sources.len() || record.at_sources.iter().any(|&air| air >= airs) {
        return Err("a source is in a region that does not exist".to_owned());
    }
    let is_sound = |region: &RegionRecord| {
        let numbers = [region.speed_of_sound, region.density];
        numbers.iter().all(|number| number.is_finite() && *number > 0.0)
            && region.inside.iter().all(|number| number.is_finite())
            && region.air_attenuation.len() == bands
            && region.air_attenuation.iter().all(|m| (0.0..f64::INFINITY).contains(m))
    };
    if let Some(region) = record.regions.iter().find(|region| !is_sound(region)) {
        return Err(format!("region {} has no place or no air", region.name));
    }
    let region = |record: RegionRecord| Region {
        name: record.name,
        inside: DVec3::from_array(record.inside),
        air: record::air(record.air),
        speed_of_sound: record.speed_of_sound,
        density: record.density,
        air_attenuation: record.air_attenuation,
    };
    Ok(Media {
        regions: record.regions.into_iter().map(region).collect(),
        interfaces: record.interfaces,
        sides: record.sides,
        at_sources: record.at_sources,
    })
}
