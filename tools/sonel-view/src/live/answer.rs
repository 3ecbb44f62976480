//! What requests get.

use serde_json::Value;
use sonel_console::spelled;

/// What a request gets.
pub(super) enum Answer {
    /// The page.
    Page(String),
    /// Everything else but sound.
    Json(Value),
    /// Samples of both ears at 48 kHz, left ear first.
    Samples(Vec<f32>),
}

/// Why a request gets nothing.
#[derive(Debug)]
pub(super) struct Refusal {
    /// As HTTP counts them.
    pub status: u16,
    /// A sentence.
    pub text: String,
}

impl Refusal {
    /// A request that cannot be understood.
    pub(super) fn wrong(text: impl Into<String>) -> Self {
        Self { status: 400, text: text.into() }
    }

    /// A request from somebody else.
    pub(super) fn forbidden(text: &str) -> Self {
        Self { status: 403, text: text.to_owned() }
    }

    /// Work that cannot be done.
    pub(super) fn failed(error: &impl std::fmt::Display) -> Self {
        Self { status: 422, text: error.to_string() }
    }

    /// Work that a newer request of the window replaced: nobody waits for it, and browsers shall not list it as an error.
    pub(super) fn replaced() -> Self {
        Self { status: 200, text: "a newer request replaced this one".to_owned() }
    }
}

impl From<sonel::Error> for Refusal {
    fn from(error: sonel::Error) -> Self {
        match error {
            sonel::Error::Stopped => Self::replaced(),
            error => Self::failed(&spelled(error)),
        }
    }
}
