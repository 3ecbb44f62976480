//! Rendering: echograms at any number of receivers from a sonel map.
//!
//! `exact` has the classes that are computed, `stochastic` those that packets estimate, `paper` the founding paper's own estimators; `render`
//! drives all three batch by batch. Every path class of docs/physics.md §4 is owned by exactly one module (L source, S specular, D diffuse, R receiver):
//!
//! | class | module |
//! |---|---|
//! | L R | `exact::direct` |
//! | L S^k R, k ≤ K | `exact::mirror` (image sources, completely enumerated) |
//! | L E R, L S E R, and what edges add to the two above | `exact::edge` (coherent sums over edges, where diffraction is on) |
//! | … D R | `stochastic::connection` (a shadow ray from every sonel; beside a surface shared with `stochastic::gather`) |
//! | … D S^k R in empty boxes, over mirrors that lose little | `stochastic::mirror_connection` (a connection from every sonel to one of the receiver's images) |
//! | … D S⁺ R elsewhere | `stochastic::gather` (visibility rays and density estimation) |
//! | L S^k R, k > K | `render::specular` (rays that are always mirrored, through a receiver sphere) |
//! | … D S^k R, over others | `stochastic::crossing` (traced segments through a receiver sphere) |
//!
//! In scenes with several airs straight paths end at the interfaces. Paths that met one since their last diffuse reflection
//! are estimated by `stochastic::crossing`; `regions` has their lengths and attenuation.
//!
//! With `directions` all of them also add energies weighted by the direction of incidence.
//!
//! [`picture`] estimates the energy that arrives on the surfaces that a camera sees.
//!
//! [`deposit`] holds the echograms under construction.

/// Revision of the echograms: raised by every change after which the same command may write another response to the same map.
/// `tests/pipeline` keeps digests of some. Responses of two revisions are never joined.
pub const REVISION: u32 = 33;

mod air;
mod ball;
pub mod boundary;
mod crossings;
pub mod deposit;
mod directions;
mod disc_size;
mod error;
mod exact;
mod guided_directions;
mod paper;
mod partition;
mod path_class;
pub mod picture;
mod receiver;
mod regions;
mod render;
mod rendering;
mod settings;
mod stochastic;

pub use directions::Columns;
pub use disc_size::free_path;
pub use error::RenderError;
pub use path_class::PathClass;
pub use receiver::{ReceiverPoint, Sensitivity};
pub use regions::straight_length;
pub use render::batch::BATCHES_IN_FLIGHT;
pub use render::{
    BatchSums, Preparation, Progress, RAYS_IN_FLIGHT, RECEIVERS_IN_FLIGHT, Renderer, is_at_source,
};
pub use rendering::{CoarseEchogram, DiscreteArrival, EdgeWork, Rendering};
pub use settings::{Air, Estimator, MOST_RAYS, RenderSettings};
