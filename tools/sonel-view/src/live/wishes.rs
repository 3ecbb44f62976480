//! What the page asks for. Positions are in metres, in the axes of the scene; unknown keys are mistakes.

use std::collections::BTreeMap;

use serde::Deserialize;
use sonel::Change;

use super::answer::Refusal;

/// What the page calls where the listener is.
pub(super) const LISTENER: &str = "listener";

/// Other coefficients than those of the map, band by band: `materials.NAME.absorption` and their values.
pub(super) type Changes = BTreeMap<String, Vec<f64>>;

/// Parameters, charts and early reflections of a listener.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Render {
    /// The window that asks: its newest request replaces older ones.
    pub window: String,
    /// Where the listener is.
    pub listener: [f64; 3],
    /// Index of the source.
    #[serde(default)]
    pub source: usize,
    /// Other materials.
    #[serde(default)]
    pub changes: Changes,
    /// Number of batches; by default all.
    #[serde(default)]
    pub batches: Option<u32>,
}

/// Parameters all over a plane.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plane {
    /// The window that asks.
    pub window: String,
    /// Height above the lowest point of the room.
    pub height: f64,
    /// Distance of neighbours; above 0.
    pub spacing: f64,
    /// Index of the source.
    #[serde(default)]
    pub source: usize,
    /// Other materials.
    #[serde(default)]
    pub changes: Changes,
    /// Number of batches; by default all.
    #[serde(default)]
    pub batches: Option<u32>,
}

/// A trace of the scene as it was changed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Changed {
    /// Positions of all sources, in the order of the scene.
    pub sources: Vec<[f64; 3]>,
    /// Materials.
    #[serde(default)]
    pub changes: Changes,
}

/// The state of the page as files and commands.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Save {
    /// Where the listener is.
    pub listener: [f64; 3],
    /// Names and positions of the receivers, where they are not those of the scene.
    #[serde(default)]
    pub receivers: Vec<(String, [f64; 3])>,
    /// Materials.
    #[serde(default)]
    pub changes: Changes,
}

/// Entries of the material library.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Search {
    /// Words that all occur in name, text, group or source.
    pub words: String,
}

/// Changes as the renderer takes them.
pub(super) fn changes(changes: &Changes) -> Result<Vec<Change>, Refusal> {
    let each = changes.iter().map(|(name, values)| Change::of(name, values.clone().into()));
    each.collect::<Result<_, _>>().map_err(|error| Refusal::wrong(error.to_string()))
}
