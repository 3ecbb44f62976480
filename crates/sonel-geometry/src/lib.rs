//! Meshes, planar surfaces, watertight ray casting, edges.
//!
//! A [`Mesh`] in metres becomes a [`Geometry`]: vertices welded, faces divided where others meet them, orientation made consistent,
//! coplanar triangles gathered into [`Surface`]s, and everything moved so that the scene's centre is the origin before
//! positions are rounded to `f32`. Every tolerance in this crate is a multiple of one length,
//! [`Geometry::resolution`], which is derived from the size of the scene.
//!
//! Rays start from a [`Departure`]. [`Geometry::leave`] is the only way to make one on a surface: it lifts the origin
//! off the wall and remembers the wall's plane, which a straight ray cannot meet again.
//!
//! Valid for scenes whose smallest detail is well above the resolution (about 5 µm in a room of 20 m).
//!
//! References: [WoopBenthinWald2013], [Ize2013], [VanOosterom1983] (docs/references.md).

mod arc;
mod block;
mod bodies;
mod boundary;
mod cells;
mod conform;
mod cracks;
mod crossings;
mod edges;
mod enclosure;
mod error;
mod geometry;
mod grid;
mod hops;
mod index;
mod joints;
mod layers;
mod mend;
mod mesh;
mod nearest_side;
mod orient;
mod overlaps;
mod placement;
mod probe;
mod ray;
mod rim;
mod rooms;
mod scale;
mod section;
mod sectors;
mod shoebox;
mod stitch;
mod surfaces;
mod topology;
mod tree;
mod weld;

pub use arc::{Arc, LARGEST_TURN, SAGITTA, SpeedProfile};
pub use cells::CellPlace;
pub use cracks::{Crack, WIDEST_CRACK};
pub use crossings::Crossing;
pub use edges::{Edge, EdgeShape};
pub use error::GeometryError;
pub use geometry::{Crossed, End, Geometry, Leg, MOST_ROUNDS, Passage, Regions, Sight};
pub use hops::Hops;
pub use layers::Redrawn;
pub use mend::Mended;
pub use mesh::{Mesh, MeshTriangle};
pub use nearest_side::NearestSide;
pub use overlaps::Overlap;
pub use placement::{Misplaced, Obstacle};
pub use ray::{Departure, Hit};
pub use rooms::{FaceKind, THICKEST_PARTITION};

pub use section::section;
pub use sectors::AirSector;
pub use shoebox::Shoebox;
pub use surfaces::{PlaneId, Side, Surface, SurfaceId};
pub use topology::Connected;
pub use weld::Welded;
