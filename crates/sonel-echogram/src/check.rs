//! Consistency checks of a response: shapes first, then values.

use crate::arrays::{Allowed, Array, Values};
use crate::{Response, ResponseError};

/// Checks everything that arrays can contradict each other in, on reading and before writing.
///
/// # Errors
/// [`ResponseError::Unsound`] with all problems.
pub(crate) fn check(response: &Response) -> Result<(), ResponseError> {
    let arrays = response.arrays();
    let mut problems: Vec<String> = arrays.iter().filter_map(Array::wrong_length).collect();
    if problems.is_empty() {
        problems.extend(arrays.iter().filter_map(Array::wrong_value));
        problems.extend(contradictions(response));
    }
    if problems.is_empty() { Ok(()) } else { Err(ResponseError::Unsound { problems }) }
}

impl Array<'_> {
    fn wrong_length(&self) -> Option<String> {
        let length = match &self.values {
            Values::Texts(texts) => texts.len(),
            Values::U32(numbers) => numbers.len(),
            Values::F32(numbers) => numbers.len(),
            Values::F64(numbers) => numbers.len(),
        };
        let (key, axes) = (self.key, &self.shape);
        let expected = axes.iter().try_fold(1_usize, |product, &axis| product.checked_mul(axis));
        (expected != Some(length))
            .then(|| format!("{key} holds {length} values instead of those of {axes:?}"))
    }

    fn wrong_value(&self) -> Option<String> {
        let wrong = match &self.values {
            Values::Texts(_) | Values::U32(_) => None,
            Values::F32(numbers) => self.allowed.first_wrong(numbers),
            Values::F64(numbers) => self.allowed.first_wrong(numbers),
        }?;
        let rule = match self.allowed {
            Allowed::Any | Allowed::Finite => ", which is not finite",
            Allowed::Energy => "; only finite numbers of at least zero are allowed",
            Allowed::Positive => ", which is not above zero",
        };
        Some(format!("{} holds {wrong}{rule}", self.key))
    }
}

impl Allowed {
    /// The first of `values` that is not allowed.
    fn first_wrong(self, values: &[impl Copy + Into<f64>]) -> Option<f64> {
        let is_right = |value: f64| match self {
            Self::Any => true,
            Self::Finite => value.is_finite(),
            Self::Energy => value.is_finite() && value >= 0.0,
            Self::Positive => value.is_finite() && value > 0.0,
        };
        values.iter().map(|&value| value.into()).find(|&value| !is_right(value))
    }
}

/// What no array shows by itself.
fn contradictions(response: &Response) -> Vec<String> {
    let mut problems = Vec::new();
    let mut reject = |is_wrong: bool, problem: &str| problems.extend(is_wrong.then(|| problem.to_owned()));
    reject(response.sources() == 0, "source_name names no source");
    reject(response.receivers() == 0, "receiver_name names no receiver");
    reject(response.bands() == 0, "center_frequency_hz names no band");
    reject(response.bins() == 0, "time_edges_s holds no bin");
    for found in &response.receiver_directivities {
        let share = found.diffuse_sensitivity;
        let problem = format!("receiver_diffuse_sensitivity holds {share}, outside 0 … 1 (0 excluded)");
        reject(share > 1.0, &problem);
    }
    if let Some(batches) = &response.batches {
        let is_nothing = batches.weight.iter().sum::<f64>() <= 0.0;
        reject(is_nothing, "batch_weight has no batch with a weight above 0");
        let mut rows = batches.time_edges_s.chunks_exact(batches.bins + 1);
        reject(rows.any(|row| !row.is_sorted()), "batch_time_edges_s does not ascend");
    }
    let arrivals = &response.arrivals;
    let beyond = |indices: &[u32], count: usize| indices.iter().any(|&index| index as usize >= count);
    let strangers = "arrival_source names sources that do not exist";
    reject(beyond(&arrivals.source, response.sources()), strangers);
    let strangers = "arrival_receiver names receivers that do not exist";
    reject(beyond(&arrivals.receiver, response.receivers()), strangers);
    problems.extend(not_ascending("center_frequency_hz", &response.center_frequency_hz));
    problems.extend(not_ascending("time_edges_s", &response.time_edges_s));
    problems
}

fn not_ascending(key: &str, values: &[f64]) -> Option<String> {
    let wrong = values.windows(2).find(|pair| pair[0] >= pair[1])?;
    Some(format!("{key} does not ascend: {} follows {}", wrong[1], wrong[0]))
}
