//! Writing a response.

use std::io::{Seek, Write};

use crate::archive::ArchiveWriter;
use crate::check::check;
use crate::directions::LATERAL_KEYS;
use crate::{Batches, Directions, FORMAT_VERSION, Lateral, Response, ResponseError};

impl Response {
    /// Writes the response as a numpy archive and returns what it was written to.
    ///
    /// # Errors
    /// When the response is not sound (nothing is written then), or `out` cannot be written.
    pub fn write<W: Write + Seek>(&self, out: W) -> Result<W, ResponseError> {
        check(self)?;
        let (sources, receivers, bands) = (self.sources(), self.receivers(), self.bands());
        let mut archive = ArchiveWriter::new(out);
        archive.numbers("format_version", &[], &[FORMAT_VERSION])?;
        archive.numbers("center_frequency_hz", &[bands], &self.center_frequency_hz)?;
        archive.numbers("time_edges_s", &[self.time_edges_s.len()], &self.time_edges_s)?;
        archive.texts("receiver_name", &[receivers], &texts(&self.receiver_names))?;
        archive.numbers("receiver_position_m", &[receivers, 3], self.receiver_positions.as_flattened())?;
        let directivities = &self.receiver_directivities;
        if !directivities.is_empty() {
            let names: Vec<&str> = directivities.iter().map(|found| found.name.as_str()).collect();
            let aims: Vec<[f64; 3]> = directivities.iter().map(|found| found.aim).collect();
            let diffuse: Vec<f64> = directivities.iter().map(|found| found.diffuse_sensitivity).collect();
            archive.texts("receiver_directivity", &[receivers], &names)?;
            archive.numbers("receiver_aim", &[receivers, 3], aims.as_flattened())?;
            archive.numbers("receiver_diffuse_sensitivity", &[receivers], &diffuse)?;
        }
        archive.texts("source_name", &[sources], &texts(&self.source_names))?;
        archive.numbers("source_position_m", &[sources, 3], self.source_positions.as_flattened())?;
        archive.numbers("source_power_level_db", &[sources, bands], &self.source_power_level_db)?;
        archive.numbers("speed_of_sound", &[], &[self.speed_of_sound])?;
        archive.numbers("characteristic_impedance", &[], &[self.characteristic_impedance])?;
        if !self.direct_times_s.is_empty() {
            archive.numbers("direct_time_s", &[sources, receivers], &self.direct_times_s)?;
        }
        archive.numbers("energy", &[sources, receivers, bands, self.bins()], &self.energy)?;
        self.write_batches(&mut archive)?;
        if let Some(missing) = &self.missing {
            archive.numbers("missing_fluence", &[sources, bands], &missing.fluence)?;
            archive.numbers("missing_decay_rate", &[sources, bands], &missing.decay_rate)?;
        }
        self.write_arrivals(&mut archive)?;
        self.write_directions(&mut archive)?;
        archive.texts("metadata_json", &[], &[&self.metadata.to_string()])?;
        archive.finish_with_digest()
    }

    fn write_batches<W: Write + Seek>(&self, archive: &mut ArchiveWriter<W>) -> Result<(), ResponseError> {
        let (sources, receivers, bands) = (self.sources(), self.receivers(), self.bands());
        let Some(batches) = &self.batches else { return Ok(()) };
        let count = batches.weight.len();
        archive.numbers("batch_weight", &[count], &batches.weight)?;
        archive.numbers(
            "batch_time_edges_s",
            &[sources, receivers, batches.bins + 1],
            &batches.time_edges_s,
        )?;
        let shape = [count, sources, receivers, bands, batches.bins];
        archive.numbers("energy_batches", &shape, &batches.energy)?;
        if !batches.kernel_difference.is_empty() {
            archive.numbers("kernel_difference_batches", &shape, &batches.kernel_difference)?;
        }
        Ok(())
    }

    fn write_arrivals<W: Write + Seek>(&self, archive: &mut ArchiveWriter<W>) -> Result<(), ResponseError> {
        let (arrivals, count) = (&self.arrivals, self.arrivals.source.len());
        let bands = self.bands();
        archive.numbers("arrival_source", &[count], &arrivals.source)?;
        archive.numbers("arrival_receiver", &[count], &arrivals.receiver)?;
        archive.numbers("arrival_time_s", &[count], &arrivals.time_s)?;
        archive.numbers("arrival_energy", &[count, bands], &arrivals.energy)?;
        archive.numbers("arrival_direction", &[count, 3], &arrivals.direction)?;
        archive.numbers("arrival_order", &[count], &arrivals.order)?;
        archive.numbers("arrival_kind", &[count], &arrivals.kind)?;
        Ok(())
    }

    fn write_directions<W: Write + Seek>(&self, archive: &mut ArchiveWriter<W>) -> Result<(), ResponseError> {
        let (sources, receivers, bands) = (self.sources(), self.receivers(), self.bands());
        let Some(Directions { lateral_axes, lateral, moment }) = &self.directions else { return Ok(()) };
        archive.numbers("lateral_axis", &[receivers, 3], lateral_axes.as_flattened())?;
        for (Lateral { energy, energy_batches, kernel_difference }, keys) in lateral.iter().zip(LATERAL_KEYS)
        {
            archive.numbers(keys[0], &[sources, receivers, bands, self.bins()], energy)?;
            let Some(Batches { weight, bins, .. }) = &self.batches else { continue };
            let shape = [weight.len(), sources, receivers, bands, *bins];
            archive.numbers(keys[1], &shape, energy_batches)?;
            if !kernel_difference.is_empty() {
                archive.numbers(keys[2], &shape, kernel_difference)?;
            }
        }
        archive.numbers("direction_moment", &[sources, receivers, bands, self.bins(), 3], moment)?;
        Ok(())
    }
}

fn texts(names: &[String]) -> Vec<&str> {
    names.iter().map(String::as_str).collect()
}
