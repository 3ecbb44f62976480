//! OBJ files: polygons over vertices, each under a `usemtl` name.
//!
//! A scan of our own finds every problem with its line and passes on only what matters; `tobj` reads that. Alone, `tobj` accepts
//! NaN and unknown `usemtl`, triangulates concave polygons wrongly and states no lines. Without an
//! `.mtl` file `tobj` forgets the names of `usemtl`, so it is given one in which every name of the file occurs.
//!
//! Reference: [Wavefront1995] (docs/references.md).

mod polygons;
mod scan;
mod triangulate;

pub(crate) use polygons::{Face, FileTerms, Polygons, Vertices, read};
pub(crate) use scan::{MaterialName, NAMELESS, and_more, repeated};
pub(crate) use triangulate::{Triangulation, is_line, triangulate};
