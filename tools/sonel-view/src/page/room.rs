//! The room as pages draw it.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use serde::Serialize;
use serde_json::Value;
use sonel::acoustics::{CompiledMaterial, Directivity};
use sonel::echograms::Echograms;
use sonel::geometry::Geometry;
use sonel::ledger::{balances_json, fates_json, on_in_words};
use sonel::map::SonelMap;
use sonel::scenes::CompiledScene;
use sonel::scenes::checkup::Checkup;

/// Walls, materials, sources, receivers, and what is known of the trace.
#[derive(Debug, Serialize)]
pub(crate) struct Room {
    pub up: [f64; 3],
    /// What `vertices` are relative to [m].
    pub origin: [f64; 3],
    /// Three 32-bit floats each, in base64 [m].
    pub vertices: String,
    /// Nominal centres [Hz].
    pub bands: Vec<f64>,
    pub materials: Vec<Material>,
    pub sources: Vec<Point>,
    pub receivers: Vec<Point>,
    /// Of a closed room [m³].
    pub volume: Option<f64>,
    /// What a checkup found.
    pub faults: Vec<String>,
    /// Of the map, where there is one.
    pub trace: Option<Trace>,
}

/// A material with its surfaces.
#[derive(Debug, Serialize)]
pub(crate) struct Material {
    pub name: String,
    /// Sides that sound reaches [m²].
    pub area: f64,
    #[serde(flatten)]
    pub coefficients: Coefficients,
    pub law: String,
    pub source: Option<String>,
    /// Three 32-bit indices of vertices for each triangle, in base64.
    corners: String,
    /// How many of these are of walls with nothing behind.
    closed: usize,
}

/// Coefficients of a material in every band.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Coefficients {
    pub absorption: Vec<f64>,
    pub scattering: Vec<f64>,
    pub transmission: Vec<f64>,
    /// Whether they are not those of the map.
    pub is_changed: bool,
}

/// A source or receiver.
#[derive(Debug, Serialize)]
pub(crate) struct Point {
    pub name: String,
    pub at: [f64; 3],
    /// Of a source.
    pub aim: Option<[f64; 3]>,
    pub directivity: Option<&'static str>,
}

/// What a map says of its trace.
#[derive(Debug, Serialize)]
pub(crate) struct Trace {
    /// Packets of each source.
    pub packets: u64,
    /// Name, state, reason and bound.
    pub effects: Vec<[String; 3]>,
    /// Shares of the emitted energy, by band.
    pub balances: Value,
    /// Numbers of packets.
    pub fates: Value,
}

impl Coefficients {
    pub(crate) fn of(material: &CompiledMaterial, is_changed: bool) -> Self {
        let CompiledMaterial { absorption, scattering, transmission, .. } = material.clone();
        Self { absorption, scattering, transmission, is_changed }
    }
}

impl Point {
    fn of(name: &str, at: DVec3) -> Self {
        Self { name: name.to_owned(), at: at.to_array(), aim: None, directivity: None }
    }
}

impl Room {
    /// The room of a scene.
    pub(crate) fn of(scene: &CompiledScene, walls: &Geometry, checkup: Option<&Checkup>) -> Self {
        // A screen shows millimetres of a room that may lie kilometres from the origin.
        let mesh = walls.mesh();
        let origin = mesh.vertices.first().copied().unwrap_or_default();
        let vertices = mesh.vertices.iter().flat_map(|vertex| (*vertex - origin).as_vec3().to_array());
        let vertices: Vec<u8> = vertices.flat_map(f32::to_le_bytes).collect();
        let material = |(index, material): (usize, &CompiledMaterial)| {
            let of_kind = |is_closed: bool| {
                let all = (0..).zip(&mesh.triangles);
                let own = all.filter(move |(at, triangle)| {
                    let is_of_kind = walls.surface(walls.triangle_surface(*at)).closed == is_closed;
                    triangle.material as usize == index && is_of_kind
                });
                own.flat_map(|(_, triangle)| triangle.corners)
            };
            // Walls before sheets: the backs of walls, which no sound is behind, are not drawn.
            let corners: Vec<u8> = of_kind(true).chain(of_kind(false)).flat_map(u32::to_le_bytes).collect();
            Material {
                name: material.name.clone(),
                area: walls.exposed_area(index as u32),
                coefficients: Coefficients::of(material, false),
                law: material.law.to_string(),
                source: material.source.clone(),
                corners: STANDARD.encode(corners),
                closed: of_kind(true).count(),
            }
        };
        let sources = scene.sources.iter().map(|source| Point {
            aim: Some(source.aim.to_array()),
            directivity: Some(match &source.directivity {
                Directivity::Pattern(pattern) => pattern.name(),
                Directivity::Measured { .. } => "measured",
            }),
            ..Point::of(&source.name, source.position)
        });
        Self {
            up: scene.up.to_array(),
            origin: origin.to_array(),
            vertices: STANDARD.encode(vertices),
            bands: scene.bands.nominal().to_vec(),
            materials: scene.materials.iter().enumerate().map(material).collect(),
            sources: sources.collect(),
            receivers: scene.receivers.iter().map(|it| Point::of(&it.name, it.position)).collect(),
            volume: walls.volume(),
            faults: checkup.map_or_else(Vec::new, |found| [&found.faults[..], &found.warnings].concat()),
            trace: None,
        }
    }

    /// The room of a map.
    pub(crate) fn of_map(map: &SonelMap, walls: &Geometry) -> Self {
        let (header, ledger) = (map.header(), map.ledger());
        let effects = header.effects.iter();
        Self {
            trace: Some(Trace {
                packets: header.settings.emissions,
                effects: effects
                    .map(|it| [it.effect.name().to_owned(), on_in_words(&it.on), it.reason.clone()])
                    .collect(),
                balances: balances_json(&ledger, header.scene.bands.nominal(), header.scene.sources.len()),
                fates: fates_json(&ledger.fates),
            }),
            ..Self::of(&header.scene, walls, None)
        }
    }

    /// Sources and receivers alone, where the map is not at hand.
    pub(crate) fn of_response(response: &Echograms) -> Self {
        let points = |names: &[String], positions: &[[f64; 3]]| -> Vec<Point> {
            names.iter().zip(positions).map(|(name, at)| Point::of(name, (*at).into())).collect()
        };
        Self {
            up: response.provenance.up.unwrap_or([0.0, 0.0, 1.0]),
            origin: response.receiver_positions[0],
            vertices: String::new(),
            bands: response.center_frequency_hz.clone(),
            materials: Vec::new(),
            sources: points(&response.source_names, &response.source_positions),
            receivers: points(&response.receiver_names, &response.receiver_positions),
            volume: response.provenance.volume_m3,
            faults: Vec::new(),
            trace: None,
        }
    }
}
