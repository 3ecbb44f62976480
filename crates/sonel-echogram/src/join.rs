//! Parts of one response, each with some of its receivers, joined to the response of all receivers, value by value.
//!
//! Nothing at a receiver depends on the others, so joining is putting side by side. A part states in its provenance which it is
//! (`"shard": [I, N]`); everything else that it states must be stated by all.

use std::convert::Infallible;
use std::mem::take;

use serde_json::{Value, json};
use thiserror::Error;

use crate::provenance::SourceRendering;
use crate::{Arrivals, Directions, Provenance, ReceiverDirectivity, Response};

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
    let receivers = parts.iter().map(Response::receivers).sum();
    let Ok(mut whole) = side_by_side(receivers, parts.into_iter().map(Ok::<_, Infallible>));
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

/// The response of `receivers` receivers from `parts`, of one rendering each with some of them, in their order. Each part is dropped before the
/// next is taken: where parts are made one by one, hardly more than the whole is in memory.
///
/// # Errors
/// That of a part.
///
/// # Panics
/// Without any part.
pub fn side_by_side<E>(
    receivers: usize,
    parts: impl IntoIterator<Item = Result<Response, E>>,
) -> Result<Response, E> {
    let (mut found, mut listed, mut from) = (None, Vec::new(), 0);
    for part in parts {
        let mut part: Response = part?;
        let place = [from, part.receivers(), receivers];
        let doubles: Vec<Vec<f64>> = part.doubles().into_iter().map(|(_, values)| take(values)).collect();
        let singles: Vec<Vec<f32>> = part.singles().into_iter().map(|(_, values)| take(values)).collect();
        listed.push((from as u32, part.bands(), take(&mut part.arrivals)));
        from += part.receivers();
        let whole = match &mut found {
            Some(whole) => Response::append(whole, part),
            None => found.insert(part),
        };
        whole.doubles().into_iter().zip(doubles).for_each(|(of, part)| put(of, &part, place));
        whole.singles().into_iter().zip(singles).for_each(|(of, part)| put(of, &part, place));
    }
    let whole: Response = found.expect("a response has receivers");
    Ok(Response { arrivals: arrivals(&listed, whole.sources()), ..whole })
}

/// Puts `part`, an array of [outer, `count` receivers, …], into `whole`, one of [outer, `all` receivers, …], behind its first `from` receivers.
/// Parts that leave an array out have zeros there.
fn put<T: Copy + Default>((outer, whole): (usize, &mut Vec<T>), part: &[T], [from, count, all]: [usize; 3]) {
    let each = part.len() / (outer * count).max(1);
    if each == 0 {
        return;
    }
    if whole.is_empty() {
        *whole = vec![T::default(); outer * all * each];
    }
    for (of_outer, part) in whole.chunks_exact_mut(all * each).zip(part.chunks_exact(count * each)) {
        of_outer[from * each..][..count * each].copy_from_slice(part);
    }
}

impl Response {
    /// Arrays of [outer, receivers, …] in double precision, and how long the outer axis is.
    fn doubles(&mut self) -> Vec<(usize, &mut Vec<f64>)> {
        let mut arrays = vec![&mut self.energy, &mut self.direct_times_s];
        arrays.extend(self.batches.as_mut().map(|batches| &mut batches.time_edges_s));
        if let Some(Directions { lateral: [squares, cosines], moment, .. }) = &mut self.directions {
            arrays.extend([&mut squares.energy, &mut cosines.energy, moment]);
        }
        let sources = self.source_names.len();
        arrays.into_iter().map(|array| (sources, array)).collect()
    }

    /// The same in single precision: those of batches.
    fn singles(&mut self) -> Vec<(usize, &mut Vec<f32>)> {
        let outer = self.batch_count() * self.sources();
        let of_batches = self.batches.as_mut().map(|of| [&mut of.energy, &mut of.kernel_difference]);
        let lateral = self.directions.iter_mut().flat_map(|directions| &mut directions.lateral);
        let lateral = lateral.flat_map(|of| [&mut of.energy_batches, &mut of.kernel_difference]);
        of_batches.into_iter().flatten().chain(lateral).map(|array| (outer, array)).collect()
    }

    /// Appends what `part` says of its receivers one by one.
    fn append(&mut self, mut part: Self) -> &mut Self {
        if !(self.receiver_directivities.is_empty() && part.receiver_directivities.is_empty()) {
            self.receiver_directivities.resize(self.receivers(), ReceiverDirectivity::omni());
            part.receiver_directivities.resize(part.receivers(), ReceiverDirectivity::omni());
        }
        self.receiver_directivities.extend(part.receiver_directivities);
        self.receiver_names.extend(part.receiver_names);
        self.receiver_positions.extend(part.receiver_positions);
        if let Some((whole, part)) = self.directions.as_mut().zip(part.directions) {
            whole.lateral_axes.extend(part.lateral_axes);
        }
        self.provenance.nearest_surfaces.extend(part.provenance.nearest_surfaces);
        for (source, part) in self.provenance.sources.iter_mut().zip(part.provenance.sources) {
            source.append(part);
        }
        self
    }
}

/// By source, then receiver.
fn arrivals(parts: &[(u32, usize, Arrivals)], sources: usize) -> Arrivals {
    let mut all = Arrivals::default();
    for source in 0..sources as u32 {
        for &(first_receiver, bands, ref from) in parts {
            for a in (0..from.source.len()).filter(|&a| from.source[a] == source) {
                all.source.push(source);
                all.receiver.push(first_receiver + from.receiver[a]);
                all.time_s.push(from.time_s[a]);
                all.energy.extend(&from.energy[a * bands..(a + 1) * bands]);
                all.direction.extend(&from.direction[a * 3..(a + 1) * 3]);
                all.order.push(from.order[a]);
                all.kind.push(from.kind[a]);
            }
        }
    }
    all
}
