//! Edge diffraction: the exact field of a rigid wedge, finite edges, and pairs of edges.
//!
//! - [`wedge`] places points about an edge, [`edge_path`] is the field of one edge of any length at any distance;
//! - [`face`] is the field over two edges of a convex face, as of a barrier or a panel;
//! - [`spectrum`] takes means over frequency bands, flat per Hz; [`wave_numbers`] are those that they ask for.
//!
//! The crate has no mesh and no room: callers state the faces and the visible part of the edge (docs/diffraction.md).

pub mod complex;
mod contour;
pub mod edge_path;
pub mod face;
pub mod pair;
pub mod spectrum;
mod transition;
pub mod wave_numbers;
pub mod wedge;

pub use complex::{Complex, unit};
pub use edge_path::{EdgePath, Visibility, WAVES};
pub use face::FacePath;
pub use pair::{EdgePair, PairWay, PartOfEdge};
pub use spectrum::{Cell, Spectrum, Wave};
pub use wave_numbers::WaveNumbers;
pub use wedge::{Wedge, WedgePoint, apex};
