//! Parts of one response, each with some of its receivers, joined to the response of all receivers, value by value.
//!
//! Nothing at a receiver depends on the others, so joining is putting side by side. A part says in its metadata which it is
//! (`"shard": [I, N]`); everything else that it says must be said by all.

use serde_json::{Value, json};
use thiserror::Error;

use crate::{Arrivals, Batches, Directions, Lateral, ReceiverDirectivity, Response};

/// Key of the metadata with the part of the receivers that a response holds.
const SHARD: &str = "shard";
/// Lists in every entry of the metadata's `sources` with an entry per receiver, and in every entry of its `classes`.
const OF_SOURCE: [&str; 3] = ["image_order", "sphere_radius_m", "edges"];
const OF_CLASS: [&str; 2] = ["energy", "effective_sample_size"];

/// Why responses cannot be joined. They are named as the caller names them.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum JoinError {
    /// A response of all receivers, or one that says nothing of parts.
    #[error("{0}: the response is not a part of a rendering: render parts with sonel-render --shard I/N")]
    NoPart(String),
    /// Two parts are not of the same rendering.
    #[error(
        "{name}: {what} is {there}, but {here} in {reference}: only parts of one rendering can be joined"
    )]
    Differs {
        /// The name of one part.
        name: String,
        /// The name of the other, the first one given.
        reference: String,
        /// In what they differ.
        what: String,
        /// Value in the first one.
        here: String,
        /// Value in the other one.
        there: String,
    },
    /// Two responses are the same part.
    #[error("{0} and {1} are the same part: leave one out")]
    Twice(String, String),
    /// A part is not there.
    #[error("part {0}/{1} is missing: render it with --shard {0}/{1}, or add its response")]
    Missing(u64, u64),
}

impl Response {
    /// Marks the response as part `index` of `count` of the receivers.
    pub fn mark_as_part(&mut self, index: u32, count: u32) {
        self.metadata[SHARD] = json!([index, count]);
    }

    /// The number of this part from 1, and of how many.
    fn part(&self) -> Option<(u64, u64)> {
        let number = |at: usize| self.metadata[SHARD][at].as_u64();
        number(0).zip(number(1)).filter(|(index, count)| (1..=*count).contains(index))
    }
}

/// Joins named `parts`, given in any order, to the response in one piece.
///
/// # Errors
/// Everything that speaks against joining them.
pub fn join(parts: Vec<(String, Response)>) -> Result<Response, Vec<JoinError>> {
    let mut numbered = Vec::new();
    let mut problems = Vec::new();
    for (name, response) in parts {
        match response.part() {
            Some((index, count)) => numbered.push((index, count, name, response)),
            None => problems.push(JoinError::NoPart(name)),
        }
    }
    if let Some((_, _, reference, first)) = numbered.first() {
        let others = &numbered[1..];
        problems
            .extend(others.iter().flat_map(|(_, _, name, part)| differences(reference, first, name, part)));
    }
    numbered.sort_by_key(|(index, ..)| *index);
    let twice = numbered.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    problems.extend(twice.map(|pair| JoinError::Twice(pair[0].2.clone(), pair[1].2.clone())));
    if problems.is_empty()
        && let Some(&(_, count, ..)) = numbered.first()
    {
        let missing = (1..=count).filter(|index| !numbered.iter().any(|(found, ..)| found == index));
        problems.extend(missing.map(|index| JoinError::Missing(index, count)));
    }
    let parts: Vec<Response> = numbered.into_iter().map(|(.., response)| response).collect();
    if problems.is_empty() { Ok(side_by_side(parts)) } else { Err(problems) }
}

/// In what two parts differ besides their receivers.
fn differences(reference: &str, a: &Response, name: &str, b: &Response) -> Vec<JoinError> {
    let (here, there) = (shared(a), shared(b));
    let keys = here.keys().chain(there.keys().filter(|key| !here.contains_key(*key)));
    let said = |facts: &serde_json::Map<String, Value>, key: &str| {
        facts.get(key).unwrap_or(&Value::Null).to_string()
    };
    keys.filter(|key| here.get(*key) != there.get(*key))
        .map(|key| JoinError::Differs {
            name: name.to_owned(),
            reference: reference.to_owned(),
            what: key.clone(),
            here: said(&here, key),
            there: said(&there, key),
        })
        .collect()
}

/// Metadata of a part that do not belong to its receivers.
fn shared(part: &Response) -> serde_json::Map<String, Value> {
    let mut facts = part.metadata.as_object().cloned().unwrap_or_default();
    let of = part.part().map_or(0, |(_, count)| count);
    facts.insert("number of parts".to_owned(), json!(of));
    facts.shift_remove(SHARD);
    for source in facts.get_mut("sources").and_then(Value::as_array_mut).into_iter().flatten() {
        each_receiver_list(source, &mut |list| list.clear());
    }
    let arrays = json!({
        "center_frequency_hz": part.center_frequency_hz,
        "time_edges_s": part.time_edges_s,
        "source_name": part.source_names,
        "source_position_m": part.source_positions,
        "source_power_level_db": part.source_power_level_db,
        "speed_of_sound": part.speed_of_sound,
        "characteristic_impedance": part.characteristic_impedance,
        "batch_weight": part.batches.as_ref().map(|batches| (&batches.weight, batches.bins)),
        "missing_fluence": part.missing.as_ref().map(|missing| &missing.fluence),
        "missing_decay_rate": part.missing.as_ref().map(|missing| &missing.decay_rate),
    });
    facts.extend(arrays.as_object().cloned().unwrap_or_default());
    facts
}

/// Visits the lists of `source` in the metadata that have an entry per receiver, always in the same order.
fn each_receiver_list(source: &mut Value, visit: &mut dyn FnMut(&mut Vec<Value>)) {
    let mut take = |owner: &mut Value, keys: &[&str]| {
        for key in keys {
            if let Some(list) = owner.get_mut(*key).and_then(Value::as_array_mut) {
                visit(list);
            }
        }
    };
    take(source, &OF_SOURCE);
    for class in source.get_mut("classes").and_then(Value::as_array_mut).into_iter().flatten() {
        take(class, &OF_CLASS);
    }
}

/// The response of `parts` in the order of their receivers.
fn side_by_side(parts: Vec<Response>) -> Response {
    let sources = parts.first().map_or(0, Response::sources);
    let batches = batches(&parts, sources);
    let direct_times: Vec<&[f64]> = parts.iter().map(|part| &part.direct_times_s[..]).collect();
    let direct_times_s = interleaved(sources, &direct_times);
    let energies: Vec<&[f64]> = parts.iter().map(|part| &part.energy[..]).collect();
    let (energy, arrivals) = (interleaved(sources, &energies), arrivals(&parts, sources));
    let receiver_directivities = directivities(&parts);
    let directions = directions(&parts, sources);
    let mut parts = parts.into_iter();
    let Some(mut whole) = parts.next() else { unreachable!("checked: there is a part") };
    for part in parts {
        whole.receiver_names.extend(part.receiver_names);
        whole.receiver_positions.extend(part.receiver_positions);
        append_metadata(&mut whole.metadata, part.metadata);
    }
    if let Some(metadata) = whole.metadata.as_object_mut() {
        metadata.shift_remove(SHARD);
    }
    Response { receiver_directivities, energy, direct_times_s, batches, arrivals, directions, ..whole }
}

/// Directivities of all receivers, where any part has some.
fn directivities(parts: &[Response]) -> Vec<ReceiverDirectivity> {
    if parts.iter().all(|part| part.receiver_directivities.is_empty()) {
        return Vec::new();
    }
    let of = |part: &Response| match &part.receiver_directivities[..] {
        [] => vec![ReceiverDirectivity::omni(); part.receivers()],
        found => found.to_vec(),
    };
    parts.iter().flat_map(of).collect()
}

fn append_metadata(whole: &mut Value, mut part: Value) {
    let mut lists = Vec::new();
    for source in part["sources"].as_array_mut().into_iter().flatten() {
        each_receiver_list(source, &mut |list| lists.push(std::mem::take(list)));
    }
    let mut lists = lists.into_iter();
    for source in whole["sources"].as_array_mut().into_iter().flatten() {
        each_receiver_list(source, &mut |list| list.extend(lists.next().unwrap_or_default()));
    }
}

/// Arrays of [outer, receivers of the part, …] as one of [outer, all receivers, …].
fn interleaved<T: Copy>(outer: usize, parts: &[&[T]]) -> Vec<T> {
    let mut values = Vec::with_capacity(parts.iter().map(|part| part.len()).sum());
    for index in 0..outer {
        for part in parts {
            let length = part.len() / outer;
            values.extend(&part[index * length..(index + 1) * length]);
        }
    }
    values
}

fn batches(parts: &[Response], sources: usize) -> Option<Batches> {
    let found: Vec<&Batches> = parts.iter().filter_map(|part| part.batches.as_ref()).collect();
    let first = *found.first()?;
    let outer = first.weight.len() * sources;
    let edges: Vec<&[f64]> = found.iter().map(|batches| &batches.time_edges_s[..]).collect();
    let energy: Vec<&[f32]> = found.iter().map(|batches| &batches.energy[..]).collect();
    let differences = found.iter().map(|batches| (batches.energy.len(), &batches.kernel_difference[..]));
    let kernel_difference = kernel_differences(outer, differences);
    Some(Batches {
        weight: first.weight.clone(),
        bins: first.bins,
        time_edges_s: interleaved(sources, &edges),
        energy: interleaved(outer, &energy),
        kernel_difference,
    })
}

/// Parts in which kernels change nothing, of so many values, leave the array out.
fn kernel_differences<'a>(outer: usize, parts: impl Iterator<Item = (usize, &'a [f32])> + Clone) -> Vec<f32> {
    if parts.clone().all(|(_, found)| found.is_empty()) {
        return Vec::new();
    }
    let of =
        |(count, found): (usize, &[f32])| if found.is_empty() { vec![0.0; count] } else { found.to_vec() };
    let columns: Vec<Vec<f32>> = parts.map(of).collect();
    interleaved(outer, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

/// Directional echograms of all parts. Parts of one run have the same options, so either all have them or none.
fn directions(parts: &[Response], sources: usize) -> Option<Directions> {
    let found: Vec<&Directions> = parts.iter().filter_map(|part| part.directions.as_ref()).collect();
    let batches = parts.first()?.batch_count();
    let lateral = |which: usize| {
        let of: Vec<&Lateral> = found.iter().map(|found| &found.lateral[which]).collect();
        let energies: Vec<&[f64]> = of.iter().map(|of| &of.energy[..]).collect();
        let of_batches: Vec<&[f32]> = of.iter().map(|of| &of.energy_batches[..]).collect();
        let differences = of.iter().map(|of| (of.energy_batches.len(), &of.kernel_difference[..]));
        Lateral {
            energy: interleaved(sources, &energies),
            energy_batches: interleaved(batches * sources, &of_batches),
            kernel_difference: kernel_differences(batches * sources, differences),
        }
    };
    let moments: Vec<&[f64]> = found.iter().map(|found| &found.moment[..]).collect();
    (!found.is_empty()).then(|| Directions {
        lateral_axes: found.iter().flat_map(|found| found.lateral_axes.clone()).collect(),
        lateral: [lateral(0), lateral(1)],
        moment: interleaved(sources, &moments),
    })
}

/// By source, then receiver.
fn arrivals(parts: &[Response], sources: usize) -> Arrivals {
    let mut all = Arrivals::default();
    for source in 0..sources as u32 {
        let mut first_receiver = 0;
        for part in parts {
            let (from, bands) = (&part.arrivals, part.bands());
            for a in (0..from.source.len()).filter(|&a| from.source[a] == source) {
                all.source.push(source);
                all.receiver.push(first_receiver + from.receiver[a]);
                all.time_s.push(from.time_s[a]);
                all.energy.extend(&from.energy[a * bands..(a + 1) * bands]);
                all.direction.extend(&from.direction[a * 3..(a + 1) * 3]);
                all.order.push(from.order[a]);
                all.kind.push(from.kind[a]);
            }
            first_receiver += part.receivers() as u32;
        }
    }
    all
}
