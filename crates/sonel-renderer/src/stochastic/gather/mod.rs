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

pub(crate) mod disc;
pub(crate) mod index;
pub(crate) mod near;
pub(crate) mod rays;
pub(crate) mod sonel_sample;
mod visible;

pub(crate) use index::GatherIndex;
pub(crate) use rays::{GatherSettings, cast};
