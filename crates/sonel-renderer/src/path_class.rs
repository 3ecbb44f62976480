//! Path classes (docs/physics.md §4).

/// Path class of the energy (docs/physics.md §4).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PathClass {
    /// L R.
    Direct,
    /// L S^k R, k ≤ K.
    ImageSource,
    /// L E R, L S E R and paths of more reflections: over edges where the path without them is shaded.
    Edge,
    /// L S^k R, k > K.
    LateSpecular,
    /// … D R.
    Diffuse,
    /// … D S^k R over mirrors that lose little.
    DiffuseMirror,
    /// … D S^k R over others.
    LongDiffuseMirror,
    /// Paths that passed an interface between airs since the source, or met one since the last diffuse reflection.
    Refracted,
}

impl PathClass {
    /// All classes.
    pub const ALL: [Self; 8] = [
        Self::Direct,
        Self::ImageSource,
        Self::Edge,
        Self::LateSpecular,
        Self::Diffuse,
        Self::DiffuseMirror,
        Self::LongDiffuseMirror,
        Self::Refracted,
    ];

    /// The class as a string over L, S, D, R.
    #[must_use]
    pub fn notation(self) -> &'static str {
        match self {
            Self::Direct => "L R",
            Self::ImageSource => "L S^k R, k <= K",
            Self::Edge => "L E R, L S E R",
            Self::LateSpecular => "L S^k R, k > K",
            Self::Diffuse => "... D R",
            Self::DiffuseMirror => "... D S^k R",
            Self::LongDiffuseMirror => "... D S^k R of much loss",
            Self::Refracted => "... I S^k R",
        }
    }
}
