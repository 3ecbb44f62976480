//! The error of this crate.

use std::io;

use sonel_echogram::ResponseError;
use sonel_geometry::GeometryError;
use sonel_map::MapError;
use sonel_renderer::RenderError;
use sonel_scene::SceneErrors;
#[cfg(feature = "sound")]
use sonel_sound::SoundError;
use sonel_tracer::TraceError;
use thiserror::Error;

/// Why something could not be done. The text states what is wrong, where, and what to do; several problems are a line each.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// Options out of range, or that contradict one another: a sentence each. An option is called by its field, in backticks.
    #[error("{}", .0.join("\nerror: "))]
    Options(Vec<String>),
    /// A map, scene or room that does not allow what is asked for: a sentence each.
    #[error("{}", .0.join("\nerror: "))]
    Refused(Vec<String>),
    /// Everything wrong with a scene.
    #[error(transparent)]
    Scene(#[from] SceneErrors),
    /// The walls cannot be used.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A map is damaged or of another version.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The map cannot be written.
    #[error("cannot write the map: {0}")]
    Write(MapError),
    /// The trace failed, as in a room that leaks.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// A receiver is impossible, or a setting out of range.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A response is damaged.
    #[error(transparent)]
    Response(#[from] ResponseError),
    /// The response has no sound, or the head is damaged.
    #[cfg(feature = "sound")]
    #[error(transparent)]
    Sound(SoundError),
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] io::Error),
    /// Neither receivers were given nor does the scene have any.
    #[error("no receivers: give receivers, `grid` or `audience`")]
    NoReceivers,
    /// An [`Observer`](crate::Observer) stopped the work.
    #[error("stopped")]
    Stopped,
    /// An error at some place.
    #[error("{place}: {cause}")]
    At {
        /// Object of the work, such as a file.
        place: String,
        /// The cause.
        cause: Box<Error>,
    },
}

/// A text, such as that of an option, that cannot be read. The message says what is right.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct ParseError(pub(crate) String);

impl From<ParseError> for Error {
    fn from(error: ParseError) -> Self {
        Self::Options(vec![error.0])
    }
}

/// Result with this crate's error.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// One thing that is not possible.
    pub(crate) fn refused(sentence: impl Into<String>) -> Self {
        Self::Refused(vec![sentence.into()])
    }

    /// Whether the system had no memory.
    #[must_use]
    pub fn is_out_of_memory(&self) -> bool {
        match self {
            Self::File(error) | Self::Map(MapError::Io(error)) => error.kind() == io::ErrorKind::OutOfMemory,
            Self::At { cause, .. } => cause.is_out_of_memory(),
            _ => false,
        }
    }
}

#[cfg(feature = "sound")]
impl From<SoundError> for Error {
    fn from(error: SoundError) -> Self {
        match error {
            SoundError::Stopped => Self::Stopped,
            error => Self::Sound(error),
        }
    }
}

/// Says of an error where it happened.
pub(crate) trait At<T> {
    /// The error at `place`.
    fn at(self, place: impl FnOnce() -> String) -> Result<T>;
}

impl<T, E: Into<Error>> At<T> for std::result::Result<T, E> {
    fn at(self, place: impl FnOnce() -> String) -> Result<T> {
        self.map_err(|error| match error.into() {
            Error::Stopped => Error::Stopped,
            error => Error::At { place: place(), cause: Box::new(error) },
        })
    }
}
