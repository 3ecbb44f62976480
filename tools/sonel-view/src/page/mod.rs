//! The page: room, listener, tables and charts in one HTML file that opens offline in any browser.
//!
//! Rust makes the numbers, the tables and what charts show; plotly.js draws charts and three.js the room, and both scripts are part of the file.

mod charts;
mod client;
mod document;
mod materials;
pub(crate) mod pair;
mod receivers;
mod reflections;
pub(crate) mod room;
mod sections;
pub(crate) mod single;
mod uncertainty;
mod words;

use anyhow::Context;
use serde_json::{Value, json};
use sonel::MaterialVariants;
use sonel::analysis::ReceiverParameters;
use sonel::analysis::receiver::parameters_of;
use sonel::echograms::Echograms;
use sonel::geometry::Geometry;
use sonel::map::{SonelMap, hexadecimal};
use sonel_console::follower::Follower;
use sonel_console::heard::HeardArguments;
use sonel_console::spelled;
use sonel_console::uncertainty::UncertaintyArguments;

use crate::HeadArguments;
use document::Document;

/// Pairs of source and receiver with curves of their own: each takes 0.06 MB of the file.
pub(crate) const MOST_PAIRS: usize = 48;

/// `response` as it is heard, and its parameters.
///
/// # Errors
/// When `heard` names a source that the response lacks.
pub(crate) fn read_off(
    response: sonel::Response,
    heard: &HeardArguments,
) -> anyhow::Result<(sonel::Response, Vec<ReceiverParameters>)> {
    let response = match heard.changes(response.echograms())? {
        Some(changes) => response.together(&changes).map_err(spelled)?,
        None => response,
    };
    let parameters = parameters_of(response.echograms(), heard.talk().as_ref());
    Ok((response, parameters))
}

/// A response with its parameters.
pub struct Subject {
    /// What the page calls it.
    pub name: String,
    response: sonel::Response,
    /// Of every source at every receiver.
    pub parameters: Vec<ReceiverParameters>,
    /// What is known of the uncertainty of its materials.
    pub materials: Option<MaterialVariants>,
}

impl Subject {
    /// Reads the parameters off `response`.
    ///
    /// # Errors
    /// When `heard` names a source that the response lacks.
    pub fn new(name: String, response: sonel::Response, heard: &HeardArguments) -> anyhow::Result<Self> {
        let (response, parameters) = read_off(response, heard)?;
        Ok(Self { name, response, parameters, materials: None })
    }

    /// Gives every parameter its changes by the uncertainty of the materials of `map`.
    ///
    /// # Errors
    /// When the response was rendered from another map, or a material does not exist.
    pub fn attach_materials(
        &mut self,
        uncertainty: &UncertaintyArguments,
        map: &sonel::Map,
        heard: &HeardArguments,
        follower: &Follower<'_>,
    ) -> anyhow::Result<()> {
        let Self { response, parameters, .. } = self;
        let attached = uncertainty.attach(parameters, response.echograms(), map, heard, follower);
        self.materials = Some(attached.with_context(|| self.name.clone())?);
        Ok(())
    }

    /// Number of pairs of source and receiver.
    pub fn pairs(&self) -> usize {
        self.parameters.len()
    }

    /// Echograms of the response.
    pub fn echograms(&self) -> &Echograms {
        self.response.echograms()
    }

    /// Volume of a closed room [m³].
    fn volume(&self) -> Option<f64> {
        self.echograms().provenance.volume_m3
    }

    /// Source and receiver of a pair.
    fn pair(&self, index: usize) -> (usize, usize) {
        let receivers = self.echograms().receivers();
        (index / receivers, index % receivers)
    }
}

/// The map that the responses were rendered from.
#[derive(Clone, Copy)]
pub(crate) struct Traced<'a> {
    /// Its paths.
    pub map: &'a SonelMap,
    /// The walls of its scene.
    pub walls: &'a Geometry,
}

impl Traced<'_> {
    /// Whether `response` was rendered from it.
    fn holds(self, response: &Echograms) -> bool {
        response.provenance.map_digest == Some(hexadecimal(&self.map.digest()))
    }
}

/// The page of responses and of the map of the first one, which asks the server of this `token` for more, if there is one.
pub(crate) fn of_responses(
    subjects: &[Subject],
    map: Option<Traced<'_>>,
    head: &HeadArguments,
    token: Option<&str>,
) -> String {
    let scene = subjects[0].echograms().provenance.scene.as_deref();
    let name = head.project.as_deref().or(scene).unwrap_or("Room acoustics");
    let room = map.map_or_else(
        || room::of_response(subjects[0].echograms()),
        |map| {
            let mut room = room::json(&map.map.header().scene, map.walls, None);
            room["rendered"] = materials::materials(subjects, map).iter().map(|it| it.json(map)).collect();
            room
        },
    );
    let pairs: Vec<Value> = sections::drawn(subjects)
        .into_iter()
        .map(|(name, subject, index)| {
            let walls = map.filter(|map| map.holds(subject.echograms())).map(|map| map.walls);
            let mut pair =
                pair::json(subject.echograms(), &subject.parameters[index], subject.pair(index), walls);
            pair["name"] = json!(name);
            pair
        })
        .collect();
    let live = token.map(|token| json!({ "token": token }));
    let mut page = Document::new(name, json!({ "room": room, "pairs": pairs, "live": live }));
    client::head(&mut page, head);
    sections::summary(&mut page, subjects);
    client::differences(&mut page, subjects);
    client::targets(&mut page, subjects, head);
    client::curves(&mut page, subjects, head);
    sections::remarks(&mut page, subjects, map);
    sections::over_bands(&mut page, subjects);
    sections::over_receivers(&mut page, subjects);
    receivers::maps(&mut page, subjects, map);
    receivers::tables(&mut page, subjects);
    client::room(&mut page, subjects, map);
    uncertainty::materials(&mut page, subjects);
    if let Some(map) = map {
        client::statistics(&mut page, subjects, map);
    }
    client::limits(&mut page, subjects);
    if let Some(map) = map {
        sections::effects(&mut page, map);
        sections::ledger(&mut page, map);
    }
    sections::provenance(&mut page, subjects);
    page.finish()
}

/// The page of a `room` without responses, which asks the server of this `token` for everything else.
pub(crate) fn live(name: &str, room: &Value, token: &str) -> String {
    Document::new(name, json!({ "room": room, "pairs": [], "live": { "token": token } })).finish()
}
