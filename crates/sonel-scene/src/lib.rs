//! The scene file and its mesh: loading, validation, the compiled scene.
//!
//! [`load`] reads `scene.toml` and the mesh it names and returns a [`Scene`] in SI, or *every* problem of both files,
//! each with its line and a remedy. Tests make scenes in code: [`Scene::shoebox`].
//!
//! References: docs/interface.md, docs/formats/scene.md.

mod balloon_file;
mod bands;
pub mod checkup;
mod defaults;
mod document;
mod draft;
mod effect;
mod formats;
mod hollow_partitions;
mod inspection;
pub mod library;
mod load;
pub mod media;
mod mesh_file;
mod notation;
mod obj;
mod polygon_mesh;
mod problem;
mod propagation;
mod refraction;
mod report;
pub mod requirement;
mod room;
mod scene;
mod seclusion;
mod sections;
mod suggest;
mod value;
mod words;

pub use balloon_file::{is_balloon_file, load_balloon};
pub use defaults::folded;
pub use draft::{Draft, DraftOptions, Purpose, draft, draft_shoebox};
pub use effect::Effect;
pub use formats::{MESH_FORMATS, is_mesh};
pub use load::{
    Document, Loaded, load, load_materials, load_receivers, read_material, read_variants, reload,
};
pub use media::{Airs, Media, NO_AIR, Region};
pub use notation::shell_word;
pub use polygon_mesh::PolygonMesh;
pub use problem::{Place, Problem, SceneErrors};
pub use propagation::{AirSide, Flight, Interface, Leg, Propagation};
pub use refraction::{Refraction, refract};
pub use scene::{
    DEFAULT_POWER_LEVEL_DB, DEFAULT_SCATTERING, DURATION_PER_SABINE_TIME, Design, LONGEST_DEFAULT_DURATION,
    LONGEST_DURATION, Receiver, Scene, Source,
};
pub use value::Value;
