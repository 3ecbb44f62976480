//! OBJ files: polygons over vertices, each under a `usemtl` name.
//!
//! The crate `tobj` 4.0 accepts NaN, triangulates concave polygons wrongly, states no lines, and forgets the names of `usemtl` without an
//! `.mtl` file.
//!
//! Reference: [Wavefront1995] (docs/references.md).

mod polygons;
mod scan;
mod triangulate;

pub(crate) use polygons::{FileTerms, Polygons, Vertices, read};
pub(crate) use scan::{Face, MaterialName, NAMELESS, and_more, repeated};
pub(crate) use triangulate::{Triangulation, is_line, triangulate};
