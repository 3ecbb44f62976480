//! docs/validation.md, "Against measured rooms": packets against published measurements, in just-noticeable differences.
//!
//! Geometry and coefficients are data sets of others under licences of their own. They are read from a folder of the reader and
//! are no part of this repository; results are.

mod ac3d;
mod bras;
mod comparison;
mod elmia;
mod folder;
mod packets;
mod room;
mod sheets;
mod studio;

use std::path::Path;
use std::time::Instant;

use anyhow::{Result, ensure};
use xtask::workspace;

use comparison::Run;
use folder::Folder;
use room::Room;

const PAGE: &str = "docs/validation.md";
const BLOCK: &str = "measured rooms";
const TABLE: &str = "docs/validation/measured-rooms.csv";
/// Lines beside the measured ones in the drawing of a room.
const DRAWN: usize = 3;

/// A room's name and how it is read.
type Site = (&'static str, fn(&Folder) -> Result<Room>);

const SITES: [Site; 5] = [
    ("cr2", bras::seminar_room),
    ("cr4", bras::auditorium),
    ("elmia", elmia::hall),
    ("studio-open", studio::with_open_curtains),
    ("studio-closed", studio::with_closed_curtains),
];

/// Traces all rooms of `folder` in every way and writes CSV file, summary and drawings; `only` names one room, whose part of the CSV
/// file is then printed.
pub(crate) fn run(folder: &Path, only: Option<&str>) -> Result<()> {
    let sites: Vec<Site> =
        SITES.into_iter().filter(|(name, _)| only.is_none_or(|only| only == *name)).collect();
    ensure!(
        !sites.is_empty(),
        "there is no room {}; rooms are {}",
        only.unwrap_or_default(),
        SITES.map(|(name, _)| name).join(", ")
    );
    let folder = Folder::open(folder)?;
    // Everything is read before anything is traced: a missing file is told at once.
    let rooms: Vec<Room> = sites.iter().map(|(_, read)| read(&folder)).collect::<Result<_>>()?;
    let mut table = comparison::csv_head(&rooms[0]);
    let mut summary = comparison::summary_head();
    for room in &rooms {
        let begun = Instant::now();
        let mut runs = Vec::new();
        for variant in room.variants {
            runs.push(Run {
                name: variant.name,
                title: variant.title,
                pairs: packets::pairs(room, variant)?,
            });
        }
        eprintln!("{}: {:.0} s", room.name, begun.elapsed().as_secs_f64());
        table += &comparison::csv(room, &runs);
        summary += &comparison::summary(room, &runs)?;
        if only.is_none() {
            let drawn: Vec<&Run> = runs.iter().take(DRAWN).collect();
            workspace::write(
                &format!("docs/validation/{}.svg", room.name),
                comparison::drawing(room, &drawn)?,
            )?;
        }
    }
    if only.is_some() {
        print!("{table}");
        return Ok(());
    }
    workspace::write(TABLE, table)?;
    workspace::write(PAGE, workspace::with_block(&workspace::read(PAGE)?, BLOCK, &summary)?)
}
