//! Pass two: from a sonel map to echograms at any number of receivers.
//!
//! Every path class of docs/physics.md §4 is owned by exactly one module (L source, S specular, D diffuse, R receiver):
//!
//! | class | module |
//! |---|---|
//! | L R | [`direct`] |
//! | L S^k R, k ≤ K | [`mirror`] (image sources over completely enumerated mirror chains) |
//! | L E R, L S E R, and what edges add to the two above | `edge` (coherent sums over edges, where diffraction is on) |
//! | … D R | [`connection`] (a shadow ray from every sonel; beside a surface shared with [`gather`]) |
//! | … D S^k R, k ≤ K′, in empty boxes | [`mirror_connection`] (a connection from every sonel to one of the receiver's images) |
//! | … D S⁺ R elsewhere | [`gather`] (visibility rays and density estimation) |
//! | L S^k R, k > K | `specular` (rays that are always mirrored, through a receiver sphere); [`crossing`] where edges bent it |
//! | … D S^k R, k > K′ | [`crossing`] (traced segments through a receiver sphere) |
//!
//! The founding paper's own estimators are apart from these, in `paper`.
//!
//! Where a scene has several airs, straight ways end at the interfaces. Paths that have met one since their last diffuse reflection are
//! left to [`crossing`], whatever their class; [`regions`] has what they carry.
//!
//! Where edges bend packets, [`bending`] says which bands a way is left to. What was bent since its last diffuse reflection is gathered by
//! visibility rays that turn; where an estimator without rays is asked for, by [`crossing`].
//!
//! Where [`directions`] are asked for, all of them also add energies weighed by the direction of arrival.
//!
//! [`picture`] estimates the energy that arrives on the surfaces that a camera sees.
//!
//! [`render`](mod@render) drives them batch by batch; [`deposit`] holds the echograms under construction.

/// Revision of the echograms: raised by every change after which the same command may write another response to the same map.
/// `tests/pipeline` keeps digests of some. Responses of two revisions are never joined.
pub const REVISION: u32 = 2;

pub mod air;
mod alias;
pub mod ball;
mod batch;
pub mod bending;
pub mod connection;
pub mod crossing;
pub mod deposit;
mod deterministic;
pub mod direct;
pub mod directions;
mod disc_size;
mod edge;
mod error;
pub mod gather;
pub mod kernel;
pub mod medium;
pub mod mirror;
pub mod mirror_connection;
mod ownership;
mod paper;
mod partition;
mod path_class;
pub mod picture;
pub mod receiver;
pub mod regions;
pub mod render;
pub mod rendering;
mod settings;
mod specular;

pub use directions::Columns;
pub use error::RenderError;
pub use path_class::PathClass;
pub use receiver::{ReceiverPoint, Sensitivity};
pub use regions::straight_length;
pub use render::{Renderer, is_at_source};
pub use rendering::{CoarseEchogram, DiscreteArrival, EdgeWork, Rendering};
pub use settings::{Air, Estimator, RenderSettings};
