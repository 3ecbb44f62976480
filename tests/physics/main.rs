//! Physics across crates: every estimator against an exact answer or a second, independent one.

/// Small shoebox with known energies at a receiver, for purely diffuse, mixed and purely specular walls.
mod box_energies;
/// Energy is neither made nor lost, in any band, for any roulette.
mod conservation;
