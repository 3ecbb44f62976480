//! Joining shards to the map of the run that they are parts of, byte for byte.
//!
//! A chunk does not depend on the shard that it was traced in, so chunks are copied as they are and their ledgers with them;
//! the ledger of the run is the sum over chunks in file order, whoever traced them. What all shards say alike (settings,
//! scene, surfaces) is written once. One chunk is in memory at a time, and of every shard its directory and its ledgers:
//! a few hundred bytes for every 512 emissions.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::mem::take;
use std::ops::Range;

use thiserror::Error;

use crate::emission::EmissionLayout;
use crate::error::MapError;
use crate::format::{ChunkEntry, MAJOR, MINOR, aligned};
use crate::header::{MapHeader, ShardRange};
use crate::ledger::Ledger;
use crate::places::Places;
use crate::provenance::{self, Difference};
use crate::reader::{self, SonelMap};
use crate::shards::{self, Fault};
use crate::tiling;
use crate::writer::MapWriter;

/// Why maps cannot be joined. Maps are named as the caller names them.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MergeError {
    /// No map.
    #[error("nothing to join: give the shards of one run")]
    TooFew,
    /// A map that cannot be read, or is damaged.
    #[error("{map}: {error}")]
    Unusable {
        /// Its name.
        map: String,
        /// Why.
        error: MapError,
    },
    /// A map may hold what this program does not know of, and would not copy.
    #[error(
        "{map}: the map has format version {MAJOR}.{minor}, this program joins {MAJOR}.{MINOR} at most: use a newer sonel for it"
    )]
    LaterFormat {
        /// Its name.
        map: String,
        /// Its minor version.
        minor: u16,
    },
    /// Two maps are not of the same run.
    #[error(
        "{map}: {} is {}, but {} in {reference}: only shards of one run can be joined",
        difference.what, quoted(&difference.there), quoted(&difference.here)
    )]
    Differs {
        /// The name of one map.
        map: String,
        /// The name of the other, the first one given.
        reference: String,
        /// In what they differ; `here` is the reference.
        difference: Difference,
    },
    /// Two maps hold the same part of a run.
    #[error(
        "{maps} both hold emissions {} to {} of every source: leave one out",
        emissions.start, emissions.end - 1, maps = .maps.join(" and ")
    )]
    Overlap {
        /// Their names.
        maps: [String; 2],
        /// The emissions.
        emissions: Range<u64>,
    },
    /// No map holds a part of the run that is needed.
    #[error(
        "emissions {} to {} of every source are missing{shards}: trace them, or add the map that holds them",
        emissions.start, emissions.end - 1, shards = missing_shards(.shards)
    )]
    Missing {
        /// The emissions.
        emissions: Range<u64>,
        /// The shards that hold them, where all maps are shards of one number.
        shards: Vec<ShardRange>,
    },
    /// The result cannot be written.
    #[error("{0}")]
    Output(MapError),
}

fn quoted(value: &str) -> &str {
    if value.is_empty() { "empty" } else { value }
}

fn missing_shards(shards: &[ShardRange]) -> String {
    match shards {
        [] => String::new(),
        [one] => format!(" (shard {}/{})", one.index, one.count),
        [first, .., last] => {
            format!(" (shards {}/{} to {}/{})", first.index, first.count, last.index, last.count)
        }
    }
}

/// Opener of the maps, by number.
///
/// Maps are opened one after the other and again when they are copied, so that a run can have more shards than a process
/// may have open files.
type Opener<'a> = dyn FnMut(usize) -> io::Result<File> + 'a;

/// Maps that can be joined.
#[derive(Debug)]
pub struct Merger {
    header: MapHeader,
    surfaces: u32,
    parts: Vec<Part>,
}

/// One map to be joined.
#[derive(Debug)]
struct Part {
    /// Number for the opener.
    number: usize,
    name: String,
    chunks: Vec<ChunkEntry>,
    ledgers: Vec<Ledger>,
}

impl Merger {
    /// Compares the maps of `names`, which `open` opens by their positions in that list, in any order.
    ///
    /// # Errors
    /// Everything that speaks against joining them.
    pub fn new(names: &[String], open: &mut Opener<'_>) -> Result<Self, Vec<MergeError>> {
        if names.is_empty() {
            return Err(vec![MergeError::TooFew]);
        }
        let (mut problems, mut headers, mut parts) = (Vec::new(), Headers::default(), Vec::new());
        for (number, name) in names.iter().enumerate() {
            match opened(name, number, open) {
                Ok(mut map) => {
                    problems.extend(headers.add(name, &map));
                    let (chunks, ledgers) = (take(&mut map.chunks), take(&mut map.ledgers));
                    parts.push(Part { number, name: name.clone(), chunks, ledgers });
                    headers.reference.get_or_insert_with(|| (name.clone(), map));
                }
                Err(error) => problems.push(error),
            }
        }
        let Some((_, reference)) = headers.reference.take() else { return Err(problems) };
        // Maps that cannot be read, or number their emissions in another way, have no place among the others.
        let placed = headers.shards.len() == names.len() && headers.alike;
        let union = if placed { headers.union(&reference.header, names) } else { Ok(ShardRange::WHOLE) };
        match union {
            Ok(shard) if problems.is_empty() => {
                let order = shards::order(&headers.shards);
                let mut parts: Vec<Option<Part>> = parts.into_iter().map(Some).collect();
                Ok(Self {
                    surfaces: reference.surfaces.len() as u32,
                    header: MapHeader { shard, ..reference.header },
                    parts: order.into_iter().filter_map(|number| parts[number].take()).collect(),
                })
            }
            union => {
                problems.extend(union.err().unwrap_or_default());
                Err(problems)
            }
        }
    }

    /// Provenance of the map that they make.
    #[must_use]
    pub fn header(&self) -> &MapHeader {
        &self.header
    }

    /// Paths of all maps.
    #[must_use]
    pub fn path_count(&self) -> u64 {
        self.parts.iter().flat_map(|part| &part.chunks).map(|chunk| u64::from(chunk.path_count)).sum()
    }

    /// Copies all chunks to `out`, comparing each with its checksum and the rules of the format. `open` as in [`Self::new`];
    /// `progress` receives how many paths have been copied.
    ///
    /// # Errors
    /// [`MergeError::Unusable`] where a map is damaged or has changed since, [`MergeError::Output`] where `out` cannot be
    /// written.
    pub fn write<W: Write + Seek>(
        self,
        out: W,
        open: &mut Opener<'_>,
        progress: &mut dyn FnMut(u64),
    ) -> Result<W, MergeError> {
        let mut writer = MapWriter::begin(out).map_err(MergeError::Output)?;
        let (mut chunk_bytes, mut copied) = (Vec::new(), 0);
        let places = Places { surfaces: self.surfaces, media: self.header.scene.media.as_ref() };
        for source in 0..self.header.scene.sources.len() as u32 {
            for part in &self.parts {
                let unusable = |error| MergeError::Unusable { map: part.name.clone(), error };
                let mut file = open(part.number).map_err(|error| unusable(error.into()))?;
                let of_source =
                    part.chunks.iter().zip(&part.ledgers).filter(|(chunk, _)| chunk.source == source);
                for (chunk, ledger) in of_source {
                    let bytes = read_chunk(&mut file, chunk, &mut chunk_bytes).map_err(unusable)?;
                    reader::check_chunk(chunk, bytes, places).map_err(unusable)?;
                    writer.push_copy(chunk, bytes, ledger).map_err(MergeError::Output)?;
                    copied += u64::from(chunk.path_count);
                    progress(copied);
                }
            }
        }
        let geometry = self.header.scene.geometry().map_err(|error| MergeError::Output(error.into()))?;
        writer.finish(&self.header, &geometry).map_err(MergeError::Output)
    }
}

fn opened(name: &str, number: usize, open: &mut Opener<'_>) -> Result<SonelMap, MergeError> {
    let unusable = |error| MergeError::Unusable { map: name.to_owned(), error };
    let file = open(number).map_err(|error| unusable(error.into()))?;
    let map = SonelMap::open(&file).map_err(unusable)?;
    if map.minor > MINOR {
        return Err(MergeError::LaterFormat { map: name.to_owned(), minor: map.minor });
    }
    Ok(map)
}

/// The bytes of `chunk` in `file`, read into `buffer`, whose words suit every record.
fn read_chunk<'a>(
    file: &mut File,
    chunk: &ChunkEntry,
    buffer: &'a mut Vec<u64>,
) -> Result<&'a [u8], MapError> {
    let length = chunk.length().expect("checked when the map was opened") as usize;
    let padded = aligned(length as u64) as usize;
    buffer.resize(padded / size_of::<u64>(), 0);
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(buffer);
    file.seek(SeekFrom::Start(chunk.offset))?;
    file.read_exact(bytes)?;
    tiling::check_zeros(&bytes[length..], chunk.offset + length as u64)?;
    Ok(&bytes[..length])
}

/// Differences of the maps from the first.
#[derive(Default)]
struct Headers {
    /// The first that could be read, without its chunks, and its name.
    reference: Option<(String, SonelMap)>,
    shards: Vec<ShardRange>,
    /// Whether all number their emissions alike.
    alike: bool,
}

impl Headers {
    /// Takes up a map; in what it differs from the first.
    fn add(&mut self, name: &str, map: &SonelMap) -> Vec<MergeError> {
        let header = &map.header;
        self.shards.push(header.shard);
        let Some((reference_name, reference)) = &self.reference else {
            self.alike = true;
            let geometry = header.scene.geometry().map_err(MapError::from);
            let check = geometry.and_then(|geometry| map.check_surfaces(&geometry));
            let unusable = |error| MergeError::Unusable { map: name.to_owned(), error };
            return check.map_err(unusable).err().into_iter().collect();
        };
        let layout = |header: &MapHeader| header.settings.layout(&header.scene);
        self.alike &= layout(header).total == layout(&reference.header).total;
        let mut differences = provenance::differences(&reference.header, header);
        let same_places = map.surfaces == reference.surfaces && map.center == reference.center;
        if differences.is_empty() && !same_places {
            differences.push(Difference {
                what: "numbering of the surfaces".to_owned(),
                here: "another".to_owned(),
                there: "its own".to_owned(),
            });
        }
        let differs = |difference| MergeError::Differs {
            map: name.to_owned(),
            reference: reference_name.clone(),
            difference,
        };
        differences.into_iter().map(differs).collect()
    }

    /// The shard that all make together.
    fn union(&self, header: &MapHeader, names: &[String]) -> Result<ShardRange, Vec<MergeError>> {
        let run = header.settings.layout(&header.scene);
        run.union(&self.shards).map_err(|faults| {
            let in_words = |fault| match fault {
                Fault::Overlap(a, b, emissions) => {
                    MergeError::Overlap { maps: [names[a].clone(), names[b].clone()], emissions }
                }
                Fault::Missing(emissions) => {
                    MergeError::Missing { shards: self.holders(&run, &emissions), emissions }
                }
            };
            faults.into_iter().map(in_words).collect()
        })
    }

    /// The shards that hold `emissions`, where all maps are shards of one number.
    fn holders(&self, run: &EmissionLayout, emissions: &Range<u64>) -> Vec<ShardRange> {
        let count = self.shards[0].count;
        if self.shards.iter().any(|shard| shard.count != count) {
            return Vec::new();
        }
        let all = (1..=count).map(|index| ShardRange { index, count });
        all.filter(|&shard| run.holds_some(shard, emissions)).collect()
    }
}
