//! What can be wrong with a mesh.

use thiserror::Error;

/// A mesh that cannot become a [`Geometry`](crate::Geometry). All defects of one kind are counted, and the first one
/// is named.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum GeometryError {
    /// The mesh has no triangle of positive area.
    #[error("the mesh has no triangle with an area: {dropped} of its {dropped} triangles are degenerate")]
    Empty {
        /// Triangles that were dropped because they have no area.
        dropped: usize,
    },
    /// Vertices with a coordinate that is infinite or not a number.
    #[error("{count} vertices are not finite, the first is vertex {first} (counted from 0)")]
    NotFinite {
        /// Index of the first one.
        first: usize,
        /// How many there are.
        count: usize,
    },
    /// Triangles whose corners are no vertices of the mesh.
    #[error(
        "{count} triangles name a vertex that does not exist, the first is triangle {first} (counted from 0)"
    )]
    NoSuchVertex {
        /// Index of the first one.
        first: usize,
        /// How many there are.
        count: usize,
    },
    /// More triangles or vertices than a 32-bit index counts.
    #[error("the mesh has {count} triangles or vertices, more than 2^31")]
    TooLarge {
        /// The larger of the two counts.
        count: usize,
    },
    /// Faces that cross one another everywhere.
    #[error(
        "the faces cross one another at more than {most} places, and are not divided at so many: leave out what crosses, such as plants and nets, or draw it coarser"
    )]
    Tangled {
        /// The largest number of places.
        most: usize,
    },
}
