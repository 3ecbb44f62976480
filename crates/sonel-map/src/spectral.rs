//! Whether bands share their paths (docs/physics.md §2).

/// Whether bands share their paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spectral {
    /// Every path carries all bands, weighted by the balance heuristic over the leading band.
    Shared,
    /// Every path carries its leading band alone.
    PerBand,
}

impl Spectral {
    /// Name in docs/interface.md.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Shared => "shared",
            Self::PerBand => "per-band",
        }
    }
}
