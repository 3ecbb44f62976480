//! Room acoustics by sonel mapping: trace a scene once, render it at any receivers.
//!
//! sonel traces packets of sound energy from the sources of a room and stores their arrivals at surfaces (*sonels*) in a [`Map`]. From the
//! map it renders echograms at any number of receivers: energies in octave or third-octave bands, and from them the parameters of ISO 3382-1,
//! each with the interval that holds the true value with a probability of 95 %. The programs and the Python package call this crate.
//!
//! # The first hour
//!
//! 1. **A room to its reverberation time.** [`Scene::shoebox`] or [`Scene::load`] makes a scene; [`Scene::trace`] its map; [`Map::render`] a
//!    [`Response`]; [`Response::parameters`] the parameters. `cargo run --release -p sonel --example 1-shoebox-to-t30`.
//! 2. **One map, many receivers.** A [`Grid`] in [`RenderOptions`]: what is costly has been done. Example `2-map-reused-for-a-grid`.
//! 3. **Other materials after the trace.** [`Change`] for another absorption of the same walls; [`Variants`] in [`TraceOptions`] where a
//!    map shall carry materials that are far apart. Example `3-materials-after-the-trace`.
//!
//! ```no_run
//! use sonel::{Material, Parameter, RenderOptions, Scene, Silent, TraceOptions};
//!
//! # fn main() -> sonel::Result<()> {
//! let room = Scene::shoebox([10.0, 7.0, 3.0])
//!     .material("walls", Material::new(0.2))
//!     .source("stage", [2.0, 2.0, 1.5])
//!     .receiver("seat", [7.0, 5.0, 1.2])
//!     .build(&Silent)?;
//! let map = room.trace(&TraceOptions::default(), &Silent)?.map;
//! let rendered = map.render(&[], &RenderOptions::default(), &Silent)?;
//! let (t30, half_width) = rendered.response.parameters().at(Parameter::T30, 1000.0)?[0];
//! println!("T30 at 1 kHz: {t30:.3} ± {half_width:.3} s");
//! # Ok(())
//! # }
//! ```
//!
//! # What to know
//!
//! - **Accuracy** is asked for in one of two ways: numbers ([`TraceOptions::packets`], [`RenderOptions::rays`]), or [`Targets`] such as
//!   `t30<1%,level<0.1dB` with `until`. [`Scene::plan`] predicts what accuracies cost.
//! - **Effects** (air, transmission, directivity, …) are left out where that is inaudible; [`Effects`] decides otherwise.
//! - **Results do not depend on threads or platform**: the same options give the same bytes.
//! - **Long work** reports to an [`Observer`], which may stop it. [`Silent`] follows nothing. The crate prints nothing and reads no clock.
//! - **Errors** are one type, [`Error`], and state all problems at once.
//!
//! # Modules
//!
//! The names that most programs need are here at the root. What their methods return, and what else the programs of this project use, is in
//! modules: [`scenes`], [`map`] and [`rendering`] for the stages, [`echograms`] and [`analysis`] for results, [`study`] for effects, plans and
//! criteria, [`acoustics`] and [`geometry`] below them. The other crates of the workspace are the inside of this one: name none of them.

/// Materials, directivities, statistical formulas and just-noticeable differences.
pub mod acoustics {
    pub use sonel_acoustics::{
        AbsorptionLaw, BandWidth, Bands, Coefficient, Directivity, Material as CompiledMaterial, Pattern,
        energy_from_level_db, eyring_time, just_noticeable, mean_free_path, sabine_time,
    };
}
/// Walls as a trace sees them.
pub mod geometry {
    pub use sonel_geometry::{AirSector, Departure, Edge, Geometry, Mesh, Side};
}
/// Scenes as files state them: drafts, checkups, the library of materials, and the compiled scene that a map carries.
pub mod scenes {
    pub use sonel_scene::{
        Draft, DraftOptions, MESH_FORMATS, Purpose, Region, Scene as CompiledScene, SceneErrors, checkup,
        draft, draft_shoebox, folded, is_mesh, library, load_materials, load_receivers, shell_word,
    };
}
/// Settings of a rendering, and pictures of energy on surfaces.
pub mod rendering {
    pub use crate::coefficients::rendered_with;
    pub use sonel_renderer::{
        Estimator, REVISION, ReceiverPoint, RenderSettings, Renderer, Sensitivity, free_path, picture,
    };
}
/// Echograms as files hold them, with arrivals, batches and provenance.
pub mod echograms {
    pub use sonel_echogram::provenance::{self, Provenance};
    pub use sonel_echogram::{
        ArrivalKind, Arrivals, Batches, Directions, LATERAL_KEYS, Lateral, Missing, ReceiverDirectivity,
        Response as Echograms, ResponseError, SourceChange, join,
    };
}
/// Parameters with their intervals, and everything else that is read off responses and maps: comparisons, averages, reports, tables.
pub use sonel_analysis as analysis;
/// Plots, plans and pictures, as SVG, PNG and OpenEXR.
#[cfg(feature = "drawing")]
pub use sonel_drawing as drawing;

pub mod checkup;
mod coefficients;
mod error;
mod feasible;
pub mod file;
pub mod ledger;
pub mod map;
pub mod names;
mod observer;
pub mod plan;
mod prepared;
pub mod quantity;
mod render;
mod response;
mod scaled;
mod scene;
#[cfg(feature = "sound")]
pub mod sound;
mod store;
pub mod study;
mod trace;
mod until;
mod variants;
pub mod version;

pub use coefficients::{Coefficients, MaterialKey};
pub use error::{Error, ParseError, Result};
pub use map::Map;
pub use observer::{Clock, Observer, Severity, Silent};
pub use render::{
    AbsorptionUncertainty, Air, Audience, Axis, Change, ClassShare, Grid, GridCounts, MaterialVariants,
    PreparedRendering, Refinement, RenderEffects, RenderOptions, Rendered, VERSION as RENDERER_VERSION,
};
pub use response::{Parameters, Response, Surroundings, system};
pub use scaled::{parse_count, parse_time};
pub use scene::{Material, Scene, SceneBuilder, check_file};
#[cfg(feature = "sound")]
pub use sound::{Axes, Channels, SPACINGS, SoundOptions, microphone, places};
pub use store::TemporaryMaps;
pub use trace::{PreparedTrace, TraceOptions, Traced, VERSION as TRACER_VERSION};
pub use variants::{Alternatives, Variants};

pub use crate::study::effects::{Effect, EffectSpec as Effects};
pub use crate::study::pipeline::{InMemory, MapStore};
pub use crate::study::plan::Plan;
pub use crate::study::sensitivity::Varied;
pub use crate::study::target::Targets;
pub use sonel_acoustics::{AbsorptionLaw, BandWidth, Bands, Coefficient, Pattern};
pub use sonel_analysis::{Estimate, Parameter, ParameterValue};
pub use sonel_map::{Mode, ShardRange, Spectral};
pub use sonel_renderer::{Estimator, ReceiverPoint, Sensitivity};
pub use sonel_scene::checkup::Checkup;
pub use sonel_scene::{Document, PolygonMesh, Value as SceneValue};
#[cfg(feature = "sound")]
pub use sonel_sound::{Head, Microphone, Path as Route, Waypoint};
