//! The page: what a consultant hands over, the room to move in, and all numbers behind, in one HTML file that opens offline in any browser.
//!
//! Rust makes one [`Page`], which is JSON in the file; scripts (assets/) draw it. A served page is the same file, whose scripts ask the server for more
//! of the same types. Nothing of it is text in HTML.

mod design;
mod html;
pub(crate) mod number;
mod office;
pub(crate) mod pair;
mod reflections;
mod remarks;
mod requirement;
pub(crate) mod room;

use anyhow::Context;
use serde::Serialize;
use sonel::MaterialVariants;
use sonel::analysis::comparison::Pairing;
use sonel::analysis::modulation::Talk;
use sonel::analysis::receiver::parameters_of;
use sonel::analysis::single::Single;
use sonel::analysis::{Parameter, ReceiverParameters};
use sonel::drawing::plot::{Axis, Plan, PlanPoint, Plans};
use sonel::echograms::Echograms;
use sonel::geometry::Geometry;
use sonel::map::{SonelMap, hexadecimal};
use sonel_console::follower::Follower;
use sonel_console::heard::HeardArguments;
use sonel_console::spelled;
use sonel_console::uncertainty::UncertaintyArguments;

use crate::HeadArguments;
use design::Design;
use office::Office;
use pair::Pair;
use requirement::Requirement;
use room::Room;

/// Pairs of source and receiver with curves of their own: each takes 0.05 MB of the file.
pub(crate) const MOST_PAIRS: usize = 48;
/// Pairs with values in each band: each takes some 3 kB.
const MOST_TABLES: usize = 500;
/// Receivers below which a map is dots that a table says better.
const LEAST_MAPPED: usize = 12;
/// Receivers up to which the page has maps: each takes 0.1 kB in every map.
const MOST_MAPPED: usize = 5000;

/// Everything that a page shows.
#[derive(Debug, Serialize)]
pub(crate) struct Page {
    /// Above it: the project.
    pub title: String,
    pub author: Option<String>,
    pub date: Option<String>,
    pub revision: Option<String>,
    /// Rooms of the maps, or of the scene; of the first response alone without either.
    pub rooms: Vec<Room>,
    pub designs: Vec<Design>,
    /// Of all designs, design by design.
    pub pairs: Vec<Pair>,
    pub requirements: Vec<Requirement>,
    /// Open-plan offices, design by design, where that is asked for.
    pub offices: Vec<Office>,
    /// Single numbers over the room where receivers are many.
    pub maps: Vec<Plans>,
    /// Missing and uncertain values in plain words.
    pub remarks: Vec<String>,
    /// What the scripts need to ask a server, where there is one.
    pub live: Option<Live>,
}

/// A server.
#[derive(Debug, Serialize)]
pub(crate) struct Live {
    pub token: String,
    /// Number of the page: the server tells where there is a newer one.
    pub number: u64,
}

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
    /// What is said in which noise, where that is known.
    talk: Option<Talk>,
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
        Ok(Self { name, response, talk: heard.talk(), parameters, materials: None })
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

    /// Whether it was rendered from `map`.
    pub fn is_of(&self, map: &SonelMap) -> bool {
        self.echograms().provenance.map_digest == Some(hexadecimal(&map.digest()))
    }

    /// Volume of a closed room [m³].
    fn volume(&self) -> Option<f64> {
        self.echograms().provenance.volume_m3
    }

    /// Single numbers of its receivers: lateral ones if there are directions, ratios of speech if there is noise.
    fn singles(&self) -> impl Iterator<Item = Single> {
        let listed = self.parameters.first().map(ReceiverParameters::listed).unwrap_or_default();
        listed.into_iter().map(Single::Of).chain(Single::OF_SEVERAL)
    }

    /// Source and receiver of a pair.
    fn pair(&self, index: usize) -> (usize, usize) {
        let receivers = self.echograms().receivers();
        (index / receivers, index % receivers)
    }
}

/// A map that responses were rendered from.
#[derive(Clone, Copy)]
pub(crate) struct Traced<'a> {
    /// Its paths.
    pub map: &'a SonelMap,
    /// The walls of its scene.
    pub walls: &'a Geometry,
}

impl Traced<'_> {
    /// Whether `subject` was rendered from it.
    fn holds(self, subject: &Subject) -> bool {
        subject.is_of(self.map)
    }
}

impl Page {
    /// The page of a `room` without responses.
    pub(crate) fn of_room(name: &str, room: Room) -> Self {
        Self {
            title: name.to_owned(),
            author: None,
            date: None,
            revision: None,
            rooms: vec![room],
            designs: Vec::new(),
            pairs: Vec::new(),
            requirements: Vec::new(),
            offices: Vec::new(),
            maps: Vec::new(),
            remarks: Vec::new(),
            live: None,
        }
    }

    /// Whether a design fails a requirement.
    pub(crate) fn has_failed(&self) -> bool {
        self.requirements.iter().any(Requirement::has_failed)
    }

    /// The page of responses, with the maps that they were rendered from as far as they are at hand.
    pub(crate) fn of_responses(subjects: &[Subject], maps: &[Traced<'_>], head: &HeadArguments) -> Self {
        let first = &subjects[0];
        let name = head.project.as_deref().or(first.echograms().provenance.scene.as_deref());
        let room = maps
            .first()
            .map_or_else(|| Room::of_response(first.echograms()), |map| Room::of_map(map.map, map.walls));
        let mut page = Self {
            author: head.author.clone(),
            date: head.date.clone(),
            revision: head.revision.clone(),
            requirements: head.targets.iter().map(|target| Requirement::of(target, subjects)).collect(),
            offices: if head.open_plan { Office::all(subjects) } else { Vec::new() },
            maps: plans(subjects, maps),
            remarks: remarks::of(subjects, maps),
            ..Self::of_room(name.unwrap_or("Room acoustics"), room)
        };
        page.rooms.extend(maps.iter().skip(1).map(|map| Room::of_map(map.map, map.walls)));
        for (design, subject) in subjects.iter().enumerate() {
            let echograms = subject.echograms();
            let found = maps.iter().position(|map| map.holds(subject));
            let map = found.map(|index| maps[index]);
            let before = (design > 0).then_some(first);
            page.designs.push(Design::of(subject, (found.unwrap_or(0), map), before));
            let pairing = Pairing::of(&first.echograms().provenance, &echograms.provenance);
            for (index, parameters) in subject.parameters.iter().enumerate() {
                let before = before.and_then(|first| Some((design::same(first, parameters)?, pairing)));
                let mut pair = Pair { design, ..Pair::of(parameters, before) };
                if page.pairs.len() < MOST_PAIRS {
                    pair.curves =
                        Some(pair::curves(echograms, subject.pair(index), map.map(|map| map.walls)));
                } else if page.pairs.len() >= MOST_TABLES {
                    pair.parameters.iter_mut().for_each(|row| row.values.clear());
                }
                page.pairs.push(pair);
            }
        }
        page
    }
}

/// Plans of single numbers of every source, where receivers are a grid or an audience.
fn plans(subjects: &[Subject], maps: &[Traced<'_>]) -> Vec<Plans> {
    let shown = [Parameter::Strength, Parameter::T30, Parameter::ClarityC80].map(Single::Of);
    let mapped = |subject: &&Subject| (LEAST_MAPPED..=MOST_MAPPED).contains(&subject.echograms().receivers());
    let mapped: Vec<&Subject> = subjects.iter().filter(mapped).collect();
    let mut sources: Vec<&String> = mapped.iter().flat_map(|it| &it.echograms().source_names).collect();
    sources.sort_unstable();
    sources.dedup();
    let each = |source: &String, single: Single| {
        let plans = mapped.iter().filter_map(|subject| plan(subject, maps, source, single));
        let title = format!("{} of {source}", single.label());
        Plans { scale: Axis::linear(title), each: plans.collect() }
    };
    let all = sources
        .into_iter()
        .flat_map(|source| shown.into_iter().chain([Single::Speech]).map(move |single| (source, single)));
    let has_values =
        |plans: &Plans| plans.each.iter().flat_map(|plan| &plan.spots).any(|spot| spot.value.is_some());
    all.map(|(source, single)| each(source, single)).filter(has_values).collect()
}

fn plan(subject: &Subject, maps: &[Traced<'_>], source: &str, single: Single) -> Option<Plan> {
    let echograms = subject.echograms();
    let index = echograms.source_names.iter().position(|name| name == source)?;
    let own = subject.parameters.iter().filter(|receiver| receiver.source == source);
    let place = |receiver: &ReceiverParameters| PlanPoint {
        position: receiver.position,
        value: single.value(receiver).ok().map(|estimate| single.heading().2 * estimate.value),
    };
    let map = maps.iter().find(|map| map.holds(subject)).or(maps.first());
    let room = map.map(|map| &map.map.header().scene).map(|scene| (&scene.mesh, scene.up));
    let places: Vec<PlanPoint> = own.map(place).collect();
    Some(Plan::of(subject.name.clone(), &places, echograms.source_positions[index], room))
}
