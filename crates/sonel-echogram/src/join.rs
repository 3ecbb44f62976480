//! Parts of one response, each with some of its receivers, joined to the response of all receivers, value by value.
//!
//! Nothing at a receiver depends on the others, so joining is putting side by side. A part states in its provenance which it is
//! (`"shard": [I, N]`); everything else that it states must be stated by all.

use std::mem::take;

use serde_json::{Value, json};
use thiserror::Error;

use crate::provenance::SourceRendering;
use crate::{Arrivals, Batches, Directions, Lateral, Provenance, ReceiverDirectivity, Response};

/// Why responses cannot be joined. They are named as the caller names them.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum JoinError {
    /// A response of all receivers, or one that says nothing of parts.
    #[error("{0}: the response is not a part of a rendering: render parts with `shard` I/N")]
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
    #[error("part {0}/{1} is missing: render it with `shard` {0}/{1}, or add its response")]
    Missing(u32, u32),
}

impl Response {
    /// Marks the response as part `index` of `count` of the receivers.
    pub fn mark_as_part(&mut self, index: u32, count: u32) {
        self.provenance.shard = Some([index, count]);
    }

    /// The number of this part from 1, and of how many.
    fn part(&self) -> Option<[u32; 2]> {
        self.provenance.shard.filter(|[index, count]| (1..=*count).contains(index))
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
            Some([index, count]) => numbered.push((index, count, name, response)),
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
    if !problems.is_empty() {
        return Err(problems);
    }
    let mut whole = side_by_side(parts);
    whole.provenance.shard = None;
    Ok(whole)
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

/// What a part states that does not belong to its receivers.
fn shared(part: &Response) -> serde_json::Map<String, Value> {
    let sources = part.provenance.sources.iter().map(SourceRendering::without_receivers).collect();
    let stated = Provenance { shard: None, sources, nearest_surfaces: Vec::new(), ..part.provenance.clone() }
        .to_json();
    let mut facts = stated.as_object().cloned().unwrap_or_default();
    facts.insert("number of parts".to_owned(), json!(part.part().map_or(0, |[_, count]| count)));
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

/// The response of `parts`, of one rendering each with some of its receivers, in their order.
///
/// # Panics
/// Without any part.
#[must_use]
pub fn side_by_side(mut parts: Vec<Response>) -> Response {
    if parts.len() == 1 {
        return parts.remove(0);
    }
    let sources = parts[0].sources();
    let arrivals = arrivals(&parts, sources);
    let receiver_directivities = directivities(&parts);
    let directions = directions(&mut parts, sources);
    let batches = batches(&mut parts, sources);
    let direct_times_s = interleaved(sources, taken(&mut parts, |part| &mut part.direct_times_s));
    let energy = interleaved(sources, taken(&mut parts, |part| &mut part.energy));
    let mut whole = parts.remove(0);
    for part in parts {
        whole.receiver_names.extend(part.receiver_names);
        whole.receiver_positions.extend(part.receiver_positions);
        whole.provenance.nearest_surfaces.extend(part.provenance.nearest_surfaces);
        for (source, part) in whole.provenance.sources.iter_mut().zip(part.provenance.sources) {
            source.append(part);
        }
    }
    Response { receiver_directivities, energy, direct_times_s, batches, arrivals, directions, ..whole }
}

/// An array of every part, taken out of it: what is side by side already is in memory once.
fn taken<P, T>(parts: &mut [P], array: impl Fn(&mut P) -> &mut Vec<T>) -> Vec<Vec<T>> {
    parts.iter_mut().map(|part| take(array(part))).collect()
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

/// Arrays of [outer, receivers of the part, …] as one of [outer, all receivers, …].
fn interleaved<T: Copy>(outer: usize, parts: Vec<Vec<T>>) -> Vec<T> {
    let mut values = Vec::with_capacity(parts.iter().map(Vec::len).sum());
    for index in 0..outer {
        for part in &parts {
            let length = part.len() / outer;
            values.extend(&part[index * length..(index + 1) * length]);
        }
    }
    values
}

fn batches(parts: &mut [Response], sources: usize) -> Option<Batches> {
    let mut found: Vec<&mut Batches> = parts.iter_mut().filter_map(|part| part.batches.as_mut()).collect();
    let (weight, bins) = found.first().map(|first| (first.weight.clone(), first.bins))?;
    let outer = weight.len() * sources;
    let differences = found.iter_mut().map(|of| (of.energy.len(), take(&mut of.kernel_difference)));
    Some(Batches {
        kernel_difference: kernel_differences(outer, differences.collect()),
        energy: interleaved(outer, taken(&mut found, |batches| &mut batches.energy)),
        time_edges_s: interleaved(sources, taken(&mut found, |batches| &mut batches.time_edges_s)),
        weight,
        bins,
    })
}

/// Parts in which kernels change nothing, of so many values, leave the array out.
fn kernel_differences(outer: usize, parts: Vec<(usize, Vec<f32>)>) -> Vec<f32> {
    if parts.iter().all(|(_, found)| found.is_empty()) {
        return Vec::new();
    }
    let of = |(count, found): (usize, Vec<f32>)| if found.is_empty() { vec![0.0; count] } else { found };
    interleaved(outer, parts.into_iter().map(of).collect())
}

/// Directional echograms of all parts. Parts of one run have the same options, so either all have them or none.
fn directions(parts: &mut [Response], sources: usize) -> Option<Directions> {
    let outer = parts[0].batch_count() * sources;
    let mut found: Vec<&mut Directions> =
        parts.iter_mut().filter_map(|part| part.directions.as_mut()).collect();
    let mut lateral = |which: usize| {
        let mut of: Vec<&mut Lateral> = found.iter_mut().map(|found| &mut found.lateral[which]).collect();
        let differences = of.iter_mut().map(|of| (of.energy_batches.len(), take(&mut of.kernel_difference)));
        Lateral {
            kernel_difference: kernel_differences(outer, differences.collect()),
            energy_batches: interleaved(outer, taken(&mut of, |of| &mut of.energy_batches)),
            energy: interleaved(sources, taken(&mut of, |of| &mut of.energy)),
        }
    };
    let lateral = [lateral(0), lateral(1)];
    (!found.is_empty()).then(|| Directions {
        lateral,
        lateral_axes: taken(&mut found, |found| &mut found.lateral_axes).concat(),
        moment: interleaved(sources, taken(&mut found, |found| &mut found.moment)),
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
