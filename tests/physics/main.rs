//! Physics across crates: every estimator against an exact answer or a second, independent one.

mod absorption_law;
mod barrier;
mod boundary;
mod box_energies;
mod conservation;
mod diffraction;
mod diffuse_box;
mod diffuse_sphere;
mod directions;
mod directivity;
mod effects;
mod forked_paths;
mod free_field;
mod furniture;
mod general_position;
mod gradient;
mod gradient_edges;
mod invariances;
mod kernels;
mod mirrored_edges;
mod mirrors;
mod near_walls;
mod paper;
mod partitions;
mod picture;
mod refraction;
mod rows;
mod screens;
mod shipped_rooms;
mod short_runs;
mod solid_buildings;
mod sound;
mod thick_partitions;
mod twofold;

mod uneven_box;
mod watertight;
mod what_if;
mod windows;

/// The long form is in `accept`.
const WATERTIGHT_RAYS: u32 = 200_000;
/// Impulse responses of one echogram; the long form is in `accept`.
const REALISATIONS: u64 = 10;
