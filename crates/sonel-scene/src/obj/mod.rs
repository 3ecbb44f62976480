//! OBJ files: polygons over vertices, each under a `usemtl` name; and the polygons of any format, with their triangles.
//!
//! The crate `tobj` accepts NaN and unknown `usemtl`, triangulates concave polygons wrongly and states no lines.
//!
//! Reference: [Wavefront1995] (docs/references.md).

mod collector;
mod polygons;
mod scan;
mod triangulate;

pub(crate) use collector::Collector;
pub(crate) use polygons::{Face, FileTerms, Polygons};
pub(crate) use scan::{LineProblem, NAMELESS, and_more, read};
pub(crate) use triangulate::{Triangulation, is_line, triangulate};
