//! Effort of a run: packets, rays, batches.

use sonel_renderer::RenderSettings;

/// A run as it is planned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Emissions per source (per source and band where bands do not share paths).
    pub emissions: u64,
    /// Visibility rays of a receiver.
    pub rays: u32,
    /// Batches.
    pub batches: u32,
}

impl Effort {
    /// Tracing so many `emissions`, and rendering with the rays that they have unless others are asked for.
    #[must_use]
    pub fn of_trace(emissions: u64, batches: u32) -> Self {
        Self { emissions, rays: RenderSettings::default().rays(emissions), batches }
    }
}
