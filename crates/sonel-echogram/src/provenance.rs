//! Provenance of a response: everything that decided it, and nothing that depends on machine or clock.
//!
//! Files hold it as JSON in `metadata_json`, with the keys of docs/formats/response.md; fields have the names of the keys. A response that
//! was not rendered by `sonel-render` states less, so nearly everything may be missing.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};

/// Everything that decided a response. The default states nothing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Provenance {
    /// Program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
    /// Its version.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_version: Option<String>,
    /// Name of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// Hexadecimal digest of the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene_digest: Option<String>,
    /// Hexadecimal digest of the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh_digest: Option<String>,
    /// Hexadecimal digest of the map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map_digest: Option<String>,
    /// Version of the program that traced the map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map_tool_version: Option<String>,
    /// Seed of the renderer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Packets of each source of the map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub emissions: Option<u64>,
    /// Batches of the map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub batches: Option<u32>,
    /// Unit vector that points up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// Lowest survival probability of the map's packets.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub survival: Option<f64>,
    /// Options of the rendering, as applied.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub options: Option<Options>,
    /// How each source was rendered.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<SourceRendering>,
    /// Volume of the air of a closed room [m³].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume_m3: Option<f64>,
    /// Height of the model [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// The surface nearest to each receiver: within that distance sound has no obstacle.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub nearest_surfaces: Vec<NearestSurface>,
    /// Variant of the materials.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Which part of the receivers this is, from 1, and of how many.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shard: Option<[u32; 2]>,
    /// Only of a measured response.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<Measured>,
    /// Only of sources as one system: each of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub together: Vec<SystemSource>,
    /// Keys of which this version knows nothing.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

/// The surface nearest to a receiver.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct NearestSurface {
    /// Its distance [m].
    pub distance_m: f64,
    /// Name of its material.
    pub material: String,
}

/// Options of a rendering, as applied.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Options {
    /// Width of the time bins [s].
    pub bin_s: f64,
    /// Name of the estimator.
    pub estimator: String,
    /// Order of image sources; none: automatic.
    pub order: Option<u32>,
    /// Visibility rays of a receiver.
    pub rays: u32,
    /// Radius of gathering [m]; none: automatic.
    pub radius_m: Option<f64>,
    /// Attenuation by air of every band [1/m].
    pub air_attenuation: Vec<f64>,
    /// What walls absorb with the boundary term, of what they absorb of rays [1], per band; empty without it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boundary_absorption: Vec<f64>,
    /// Batches that were rendered, where these are not all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub batches: Option<u32>,
    /// Whether there are energies by direction.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub directions: bool,
    /// Materials and directivities, where these are not those of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub changed: Option<Changed>,
}

/// Materials and directivities of a rendering.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Changed {
    /// By name of the material.
    pub materials: ByName<Coefficients>,
    /// By name of the source.
    pub directivities: ByName<Directivity>,
}

/// Coefficients of a material per band, 0 … 1.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Coefficients {
    /// Absorption α.
    pub absorption: Vec<f64>,
    /// Scattering s.
    pub scattering: Vec<f64>,
    /// Transmission τ.
    pub transmission: Vec<f64>,
}

/// Directivity of a source.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Directivity {
    /// Name of a pattern.
    Pattern(String),
    /// A measured directivity.
    Measured {
        /// Name of the file, or `talker`.
        file: String,
        /// Directivity index of every band [dB].
        directivity_index_db: Vec<f64>,
        /// Unit vector of the side that is up.
        up: [f64; 3],
    },
}

/// How a source was rendered.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct SourceRendering {
    /// Order K of its image sources.
    pub mirror_order: u32,
    /// Radius of every receiver's sphere [m].
    pub sphere_radius_m: Vec<f64>,
    /// By how much the boundary term changes the level of all but direct sound, by receiver and band [dB]; empty without it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boundary_db: Vec<Vec<f64>>,
    /// Edge contributions of every receiver; empty where no edge diffracts.
    pub edges: Vec<EdgeContributions>,
    /// Path classes.
    pub classes: Vec<PathClass>,
    /// Gain that the scene states [dB].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain_db: Option<f64>,
    /// Delay that the scene states [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delay_s: Option<f64>,
}

/// Edge contributions at a receiver.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct EdgeContributions {
    /// How many were computed.
    pub computed: usize,
    /// The 95 % interval of what the others would change the level of each band by [dB].
    pub left_out_db: Vec<[f64; 2]>,
}

/// Energy and estimator of a path class.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct PathClass {
    /// Notation of docs/physics.md §4, such as `L R`.
    pub class: String,
    /// Estimator.
    pub estimator: String,
    /// Why this estimator.
    pub reason: String,
    /// Fluence per unit emitted energy over all times, by receiver and band [1/m²].
    pub energy: Vec<Vec<f64>>,
    /// Number of independent equal contributions with the same scatter, by receiver and band; none where nothing scatters.
    pub effective_sample_size: Vec<Vec<Option<f64>>>,
}

/// A source of a system, as applied.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct SystemSource {
    /// Name.
    pub source: String,
    /// Gain [dB].
    pub gain_db: f64,
    /// Delay [s].
    pub delay_s: f64,
}

/// What is known of a measured response.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Measured {
    /// Level of the decay curve at which each octave meets its noise [dB].
    pub reached_db: Vec<f64>,
}

impl SourceRendering {
    /// Appends the receivers of `part`, a rendering of the same source.
    pub(crate) fn append(&mut self, part: Self) {
        self.sphere_radius_m.extend(part.sphere_radius_m);
        self.boundary_db.extend(part.boundary_db);
        self.edges.extend(part.edges);
        for (class, part) in self.classes.iter_mut().zip(part.classes) {
            class.energy.extend(part.energy);
            class.effective_sample_size.extend(part.effective_sample_size);
        }
    }

    /// What does not belong to its receivers.
    pub(crate) fn without_receivers(&self) -> Self {
        let class = |class: &PathClass| PathClass {
            energy: Vec::new(),
            effective_sample_size: Vec::new(),
            ..class.clone()
        };
        Self {
            sphere_radius_m: Vec::new(),
            boundary_db: Vec::new(),
            edges: Vec::new(),
            classes: self.classes.iter().map(class).collect(),
            ..self.clone()
        }
    }
}

/// Values by name; files hold an object with these keys in this order.
#[derive(Debug, Clone, PartialEq)]
pub struct ByName<T>(pub Vec<(String, T)>);

impl<T> Default for ByName<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> ByName<T> {
    /// The value of this name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&T> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, value)| value)
    }
}

impl<T: Serialize> Serialize for ByName<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl<'de, T: for<'a> Deserialize<'a>> Deserialize<'de> for ByName<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let entries = Map::<String, Value>::deserialize(deserializer)?.into_iter();
        let read = entries.map(|(name, value)| Ok((name, T::deserialize(value).map_err(D::Error::custom)?)));
        read.collect::<Result<_, _>>().map(Self)
    }
}
