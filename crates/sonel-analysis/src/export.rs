//! Exports the sonels of a map: one row per sonel as CSV, one array per property for numpy.
//!
//! Columns are those of docs/formats/sonels.md. Derived quantities are written out, so the files are at least eight times
//! the size of the map; neither is held in memory. Echograms of a response become a long table.

mod csv;
mod echogram;
mod npz;

pub use self::csv::csv;
pub use self::echogram::echogram_csv;
pub use self::npz::{ARRAYS, npz};

use sonel_map::Event;

/// Name of the event at an arrival.
fn name(event: Event) -> &'static str {
    match event {
        Event::Specular => "specular",
        Event::Diffuse => "diffuse",
        Event::Transmitted => "transmitted",
        Event::Refracted => "refracted",
        Event::Diffracted => "diffracted",
        Event::Absorbed => "absorbed",
        Event::Escaped => "escaped",
        Event::Left => "left",
        Event::Expired => "expired",
        Event::Lost => "lost",
        Event::Returned => "returned",
        Event::Emerged => "emerged",
        Event::Split => "split",
    }
}
