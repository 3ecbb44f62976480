//! Errors of maps, with remedies.

use thiserror::Error;

/// Why a map could not be written, opened or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MapError {
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The file does not begin like a map.
    #[error(
        "this is not a sonel map (it does not begin with \"SONELMAP\"); pass a file written by sonel-trace"
    )]
    NotAMap,
    /// Written by a later format.
    #[error(
        "the map has format version {major}.{minor}, this program reads {supported}.x: use a newer sonel for it"
    )]
    UnsupportedVersion {
        /// Major version of the file.
        major: u16,
        /// Minor version of the file.
        minor: u16,
        /// Major version read here.
        supported: u16,
    },
    /// The writer never finished.
    #[error("the map was never completed: the run that wrote it was stopped; trace it again")]
    Incomplete,
    /// A part lies outside the file.
    #[error(
        "the map is cut off: {part} should end at byte {end}, the file has {length}; copy or trace it again"
    )]
    Truncated {
        /// The part.
        part: String,
        /// Its end as stated [bytes].
        end: u64,
        /// Length of the file.
        length: u64,
    },
    /// A checksum or a rule of the layout is violated.
    #[error("the map is damaged at byte {offset}: {reason}; copy or trace it again")]
    Damaged {
        /// Begin of the damaged part [bytes].
        offset: u64,
        /// The fault.
        reason: String,
    },
    /// Written to by another process.
    #[error("the map was changed by another process while it was read: run the command again")]
    Changed,
    /// Only a part of a run.
    #[error("the map is shard {index} of {count}: join all shards first (sonel-analyze merge)")]
    Shard {
        /// Number of the shard, from 1.
        index: u32,
        /// Number of shards.
        count: u32,
    },
    /// The walls of the scene cannot be used.
    #[error("the walls of the scene cannot be used: {0}")]
    Walls(#[from] sonel_geometry::GeometryError),
    /// The surfaces that the paths refer to are not those of this program.
    #[error(
        "this program numbers the surfaces of the scene in another way than the map ({reason}): use the sonel version that wrote the map, or trace it again"
    )]
    ForeignSurfaces {
        /// The first difference.
        reason: String,
    },
    /// More than the format can hold.
    #[error("{0}")]
    Limit(String),
}
