//! Consistency checks of a response: shapes first, then values.

use crate::directions::LATERAL_KEYS;
use crate::{Directions, Lateral, Response, ResponseError};

/// Checks everything that arrays can contradict each other in, on reading and before writing.
///
/// # Errors
/// [`ResponseError::Unsound`] with all problems.
pub fn check(response: &Response) -> Result<(), ResponseError> {
    let mut problems = shapes(response);
    if problems.is_empty() {
        problems = values(response);
    }
    if problems.is_empty() { Ok(()) } else { Err(ResponseError::Unsound { problems }) }
}

fn shapes(response: &Response) -> Vec<String> {
    let (s, r, b) = (response.sources(), response.receivers(), response.bands());
    let mut problems = Vec::new();
    let mut expect = |key: &str, length: usize, axes: &[usize]| {
        let expected = axes.iter().try_fold(1_usize, |product, &axis| product.checked_mul(axis));
        if expected != Some(length) {
            problems.push(format!("{key} holds {length} values instead of those of {axes:?}"));
        }
    };
    expect("receiver_position_m", response.receiver_positions.len(), &[r]);
    if !response.receiver_directivities.is_empty() {
        expect("receiver_directivity", response.receiver_directivities.len(), &[r]);
    }
    expect("source_position_m", response.source_positions.len(), &[s]);
    expect("energy", response.energy.len(), &[s, r, b, response.bins()]);
    expect("source_power_level_db", response.source_power_level_db.len(), &[s, b]);
    if !response.direct_times_s.is_empty() {
        expect("direct_time_s", response.direct_times_s.len(), &[s, r]);
    }
    if let Some(batches) = &response.batches {
        expect("batch_time_edges_s", batches.time_edges_s.len(), &[s, r, batches.bins.saturating_add(1)]);
        let shape = [batches.weight.len(), s, r, b, batches.bins];
        expect("energy_batches", batches.energy.len(), &shape);
        if !batches.kernel_difference.is_empty() {
            expect("kernel_difference_batches", batches.kernel_difference.len(), &shape);
        }
    }
    if let Some(missing) = &response.missing {
        expect("missing_fluence", missing.fluence.len(), &[s, b]);
        expect("missing_decay_rate", missing.decay_rate.len(), &[s, b]);
    }
    if let Some(Directions { lateral_axes, lateral, moment }) = &response.directions {
        expect("lateral_axis", lateral_axes.len(), &[r]);
        expect("direction_moment", moment.len(), &[s, r, b, response.bins(), 3]);
        for (Lateral { energy, energy_batches, kernel_difference }, keys) in lateral.iter().zip(LATERAL_KEYS)
        {
            expect(keys[0], energy.len(), &[s, r, b, response.bins()]);
            let batches = response.batches.as_ref().map_or(0, |batches| batches.energy.len());
            expect(keys[1], energy_batches.len(), &[batches]);
            if !kernel_difference.is_empty() {
                expect(keys[2], kernel_difference.len(), &[batches]);
            }
        }
    }
    let (arrivals, a) = (&response.arrivals, response.arrivals.source.len());
    expect("arrival_receiver", arrivals.receiver.len(), &[a]);
    expect("arrival_time_s", arrivals.time_s.len(), &[a]);
    expect("arrival_energy", arrivals.energy.len(), &[a, b]);
    expect("arrival_direction", arrivals.direction.len(), &[a, 3]);
    expect("arrival_order", arrivals.order.len(), &[a]);
    expect("arrival_kind", arrivals.kind.len(), &[a]);
    problems
}

fn values(response: &Response) -> Vec<String> {
    let mut problems = Vec::new();
    let mut reject = |key: &str, problem: Option<String>| {
        problems.extend(problem.map(|problem| format!("{key} {problem}")));
    };
    let none = |count: usize, what: &str| (count == 0).then(|| format!("names no {what}"));
    reject("source_name", none(response.sources(), "source"));
    reject("receiver_name", none(response.receivers(), "receiver"));
    reject("center_frequency_hz", none(response.bands(), "band"));
    reject("center_frequency_hz", not_ascending(&response.center_frequency_hz));
    reject("center_frequency_hz", not_positive(&response.center_frequency_hz));
    reject("time_edges_s", (response.bins() == 0).then(|| "holds no bin".to_owned()));
    reject("time_edges_s", not_ascending(&response.time_edges_s));
    reject("time_edges_s", not_finite(&response.time_edges_s));
    reject("receiver_position_m", not_finite(response.receiver_positions.as_flattened()));
    for found in &response.receiver_directivities {
        reject("receiver_aim", not_finite(&found.aim));
        let is_share = found.diffuse_sensitivity > 0.0 && found.diffuse_sensitivity <= 1.0;
        let message = format!("holds {}, outside 0 … 1 (0 excluded)", found.diffuse_sensitivity);
        reject("receiver_diffuse_sensitivity", (!is_share).then_some(message));
    }
    reject("source_position_m", not_finite(response.source_positions.as_flattened()));
    reject("source_power_level_db", not_finite(&response.source_power_level_db));
    reject("speed_of_sound", not_positive(&[response.speed_of_sound]));
    reject("characteristic_impedance", not_positive(&[response.characteristic_impedance]));
    reject("direct_time_s", no_energy(&response.direct_times_s));
    reject("energy", no_energy(&response.energy));
    if let Some(Directions { lateral_axes, lateral, moment }) = &response.directions {
        reject("lateral_axis", not_finite(lateral_axes.as_flattened()));
        reject("direction_moment", not_finite(moment));
        for (Lateral { energy, energy_batches, kernel_difference }, keys) in lateral.iter().zip(LATERAL_KEYS)
        {
            reject(keys[0], no_energy(energy));
            reject(keys[1], no_energy(energy_batches));
            reject(keys[2], not_finite(kernel_difference));
        }
    }
    reject_batches(response, &mut reject);
    if let Some(missing) = &response.missing {
        reject("missing_fluence", no_energy(&missing.fluence));
        reject("missing_decay_rate", not_positive(&missing.decay_rate));
    }
    let arrivals = &response.arrivals;
    let beyond = |indices: &[u32], count: usize| indices.iter().any(|&index| index as usize >= count);
    let strange = |strange: bool, what: &str| strange.then(|| format!("names {what} that do not exist"));
    reject("arrival_source", strange(beyond(&arrivals.source, response.sources()), "sources"));
    reject("arrival_receiver", strange(beyond(&arrivals.receiver, response.receivers()), "receivers"));
    reject("arrival_time_s", not_finite(&arrivals.time_s));
    reject("arrival_direction", not_finite(&arrivals.direction));
    reject("arrival_energy", no_energy(&arrivals.energy));
    problems
}

fn reject_batches(response: &Response, reject: &mut dyn FnMut(&str, Option<String>)) {
    let Some(batches) = &response.batches else { return };
    reject("batch_weight", no_energy(&batches.weight));
    let sum: f64 = batches.weight.iter().sum();
    reject("batch_weight", (sum <= 0.0).then(|| "has no batch with a weight above 0".to_owned()));
    let mut rows = batches.time_edges_s.chunks_exact(batches.bins + 1);
    let unsorted = rows.any(|row| !row.is_sorted());
    reject("batch_time_edges_s", unsorted.then(|| "does not ascend".to_owned()));
    reject("batch_time_edges_s", not_finite(&batches.time_edges_s));
    reject("energy_batches", no_energy(&batches.energy));
    reject("kernel_difference_batches", not_finite(&batches.kernel_difference));
}

fn not_finite(values: &[impl Copy + Into<f64>]) -> Option<String> {
    let wrong = values.iter().map(|&value| value.into()).find(|value| !value.is_finite())?;
    Some(format!("holds {wrong}, which is not finite"))
}

fn not_positive(values: &[f64]) -> Option<String> {
    let wrong = values.iter().find(|value| !(value.is_finite() && **value > 0.0))?;
    Some(format!("holds {wrong}, which is not above zero"))
}

fn not_ascending(values: &[f64]) -> Option<String> {
    let wrong = values.windows(2).find(|pair| pair[0] >= pair[1])?;
    Some(format!("does not ascend: {} follows {}", wrong[1], wrong[0]))
}

fn no_energy(values: &[impl Copy + Into<f64>]) -> Option<String> {
    let wrong =
        values.iter().map(|&value| value.into()).find(|value| !(value.is_finite() && *value >= 0.0))?;
    Some(format!("holds {wrong}; only finite numbers of at least zero are allowed"))
}
