//! … D S^k R, k ≥ 1: visibility rays from the receiver along specular reflections, density estimation where they arrive.
//!
//! Ray j of M with throughput T_j: F += (4π/M) · T_j · (δ/π) · Σ e_i / A(h), over the sonels that arrived on the same surface
//! and side within h of the ray's hit; A is the area of the disc clipped to the surface (docs/physics.md §4). No cosine: e is
//! flux, and flux over area is irradiance. What is seen directly belongs to the connection; then the ray goes on as a mirror reflection.
//! Next to the receiver, where connections leave a part, rays do not gather but go on from the surface by Lambert's law until they are far
//! enough: L … D_far S^k D_near S^l R. What has no D_far is connected ([`near`]). Rays are few
//! and their hits are indexed; the map streams past them, so memory does not grow with it. Each batch has rays of its own: the interval covers both passes.
//!
//! References: [Jensen1996], [KnausZwicker2011] (docs/references.md).

pub mod disc;
pub mod index;
pub mod near;
pub mod rays;
mod visible;

pub use index::GatherIndex;
pub use rays::{GatherSettings, cast};
