//! One row per sonel, for spreadsheets and data frames.

use std::io::{self, Write};

use sonel_geometry::Side;

use crate::cell;
use crate::sonels::{Sonel, Sonels};

/// Columns before the energies.
const COLUMNS: &str = "source,emission,leading_band_hz,order,specular_run,diffused,x_m,y_m,z_m,direction_x,direction_y,\
    direction_z,path_length_m,surface,side,event";

/// Rows on their way to the file.
struct Rows {
    writer: ::csv::Writer<Vec<u8>>,
    count: u64,
    /// Room for one number.
    number: Vec<u8>,
}

impl Default for Rows {
    fn default() -> Self {
        Self { writer: ::csv::Writer::from_writer(Vec::new()), count: 0, number: Vec::new() }
    }
}

/// Writes all sonels; `progress` receives how many have been written.
///
/// # Errors
/// When `out` cannot be written.
pub fn csv(sonels: &Sonels<'_>, mut out: impl Write, progress: &mut dyn FnMut(u64)) -> io::Result<()> {
    let scene = &sonels.map().header().scene;
    let mut header = Rows::default();
    let energies = scene.bands.nominal().iter().map(|frequency| format!("energy_{frequency}_hz"));
    header.writer.write_record(COLUMNS.split(',').map(str::to_owned).chain(energies))?;
    out.write_all(&header.bytes()?)?;
    let mut written = 0;
    let names: Vec<&str> = scene.sources.iter().map(|source| source.name.as_str()).collect();
    let frequencies: Vec<String> = scene.bands.nominal().iter().map(f64::to_string).collect();
    sonels.gather(
        |sonel, rows: &mut Rows| {
            rows.put(sonel, names[sonel.source as usize], &frequencies).expect("a vector takes every row");
        },
        |rows| {
            written += rows.count;
            out.write_all(&rows.bytes()?)?;
            progress(written);
            Ok(())
        },
    )
}

impl Rows {
    fn put(&mut self, sonel: &Sonel<'_>, source: &str, frequencies: &[String]) -> io::Result<()> {
        let (history, arrival) = (sonel.history, sonel.arrival);
        self.writer.write_field(&*cell::of_name(source))?;
        self.number(sonel.emission)?;
        self.writer.write_field(&frequencies[sonel.leading_band as usize])?;
        self.number(history.order)?;
        self.number(history.specular_run)?;
        self.number(u8::from(history.diffused))?;
        for coordinate in sonel.position.to_array() {
            self.number(coordinate)?;
        }
        for component in sonel.direction.to_array() {
            self.number(component)?;
        }
        self.number(sonel.path_length)?;
        self.number(arrival.surface.0)?;
        self.writer.write_field(if arrival.side == Side::Front { "front" } else { "back" })?;
        self.writer.write_field(super::name(arrival.event))?;
        for band in 0..frequencies.len() {
            // Energies span hundreds of decibels: an exponent instead of a dozen zeros.
            self.number(format_args!("{:e}", sonel.energy(band)))?;
        }
        self.writer.write_record(None::<&[u8]>)?;
        self.count += 1;
        Ok(())
    }

    /// A number in the fewest digits that tell it from its neighbours.
    fn number(&mut self, value: impl std::fmt::Display) -> io::Result<()> {
        self.number.clear();
        write!(self.number, "{value}")?;
        Ok(self.writer.write_field(&self.number)?)
    }

    fn bytes(self) -> io::Result<Vec<u8>> {
        self.writer.into_inner().map_err(|error| error.into_error())
    }
}
