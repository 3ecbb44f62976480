//! An array for each property of the sonels, for `numpy.load`.
//!
//! Arrays of an archive stand one behind the other, so the map is read once for each.

use std::io::{Seek, Write};

use serde_json::json;
use sonel_echogram::{ArchiveWriter, Number, ResponseError};
use sonel_geometry::Side;
use sonel_map::{Event, SonelMap, hexadecimal};

use crate::sonels::{Sonel, Sonels};

/// Arrays with a row for each sonel: so often the map is read.
pub const ARRAYS: u64 = 13;

/// Writes all sonels and returns what they were written to; `progress` receives how many rows have been written, of [`ARRAYS`]
/// for each sonel.
///
/// # Errors
/// When `out` cannot be written.
pub fn npz<W: Write + Seek>(
    sonels: &Sonels<'_>,
    out: W,
    progress: &mut dyn FnMut(u64),
) -> Result<W, ResponseError> {
    let map = sonels.map();
    let bands = map.header().scene.bands.count();
    let mut table =
        Table { archive: ArchiveWriter::new(out), count: sonels.count(), sonels, written: 0, progress };
    table.legend(map)?;
    table.column("source", &[], |sonel, put| put.push(sonel.source))?;
    table.column("emission", &[], |sonel, put| put.push(sonel.emission))?;
    table.column("leading_band", &[], |sonel, put| put.push(sonel.leading_band))?;
    table.column("order", &[], |sonel, put| put.push(sonel.history.order))?;
    table.column("specular_run", &[], |sonel, put| put.push(sonel.history.specular_run))?;
    table.column("diffused", &[], |sonel, put| put.push(sonel.history.diffused))?;
    table.column("position_m", &[3], |sonel, put: &mut Vec<f64>| put.extend(sonel.position.to_array()))?;
    table.column("direction", &[3], |sonel, put: &mut Vec<f32>| put.extend(sonel.direction.to_array()))?;
    table.column("path_length_m", &[], |sonel, put| put.push(sonel.path_length))?;
    table.column("surface", &[], |sonel, put| put.push(sonel.arrival.surface.0))?;
    table.column("side", &[], |sonel, put| put.push(u8::from(sonel.arrival.side == Side::Back)))?;
    table.column("event", &[], |sonel, put| put.push(sonel.arrival.event as u8))?;
    table.column("energy", &[bands], |sonel, put: &mut Vec<f64>| {
        put.extend((0..bands).map(|band| sonel.energy(band)));
    })?;
    table.archive.finish()
}

struct Table<'a, 'p, W: Write + Seek> {
    archive: ArchiveWriter<W>,
    sonels: &'a Sonels<'a>,
    count: u64,
    written: u64,
    progress: &'p mut dyn FnMut(u64),
}

impl<W: Write + Seek> Table<'_, '_, W> {
    /// Meaning of the numbers in the columns.
    fn legend(&mut self, map: &SonelMap) -> Result<(), ResponseError> {
        let header = map.header();
        let (scene, events) = (&header.scene, Event::ALL.map(super::name));
        let codes = Event::ALL.map(|event| event as u8);
        let sources: Vec<&str> = scene.sources.iter().map(|source| source.name.as_str()).collect();
        let metadata = json!({
            "scene": scene.name,
            "map_digest": hexadecimal(&map.digest()),
            "tool_version": header.tool_version,
            "speed_of_sound": scene.speed_of_sound,
            "shard": [header.shard.index, header.shard.count],
        });
        let bands = scene.bands.nominal();
        self.archive.numbers("center_frequency_hz", &[bands.len()], bands)?;
        self.archive.texts("source_name", &[sources.len()], &sources)?;
        self.archive.numbers("event_code", &[codes.len()], &codes)?;
        self.archive.texts("event_name", &[events.len()], &events)?;
        self.archive.texts("metadata_json", &[], &[&metadata.to_string()])
    }

    /// Adds an array with a row of the shape `of_one` for each sonel, which `put` appends.
    fn column<T: Number + Send>(
        &mut self,
        key: &str,
        of_one: &[usize],
        put: impl Fn(&Sonel<'_>, &mut Vec<T>) + Sync,
    ) -> Result<(), ResponseError> {
        let shape = [&[self.count as usize], of_one].concat();
        let width = of_one.iter().product::<usize>() as u64;
        let mut array = self.archive.array(key, &shape)?;
        let (written, progress) = (&mut self.written, &mut self.progress);
        self.sonels.gather(put, |values: Vec<T>| {
            *written += values.len() as u64 / width;
            progress(*written);
            array.extend(&values)
        })?;
        Ok(array.finish()?)
    }
}
