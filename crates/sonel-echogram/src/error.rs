//! Errors of response files.

use thiserror::Error;

/// Why a response could not be written or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ResponseError {
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The file is no archive at all, or a damaged one.
    #[error("this is not a response (a numpy .npz archive), or it is damaged: {0}; render it again")]
    Archive(String),
    /// A key that every response has is missing.
    #[error("the response has no array \"{0}\"; render it again with sonel-render")]
    Missing(String),
    /// An array is not what the interface says.
    #[error("array \"{key}\" of the response {problem}; render it again with sonel-render")]
    Array {
        /// Key.
        key: String,
        /// The fault, as a predicate.
        problem: String,
    },
    /// Arrays contradict each other or hold impossible values.
    #[error("the response is not valid; render it again with sonel-render:\n  {}", problems.join("\n  "))]
    Unsound {
        /// All of them, each naming its array.
        problems: Vec<String>,
    },
    /// A file of another version.
    #[error("the response has format version {found}; this program reads version {}", crate::FORMAT_VERSION)]
    Version {
        /// The version found.
        found: u32,
    },
}
