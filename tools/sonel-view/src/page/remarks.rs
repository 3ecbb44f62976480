//! Missing and uncertain values in plain words, for clients.

use std::collections::BTreeMap;

use sonel::analysis::{ReceiverParameters, Unsupported};

use super::{Subject, Traced};

/// A sentence for each kind of missing or doubtful parameter, with how many there are, and for each response that is of no map.
pub(super) fn of(subjects: &[Subject], maps: &[Traced<'_>]) -> Vec<String> {
    let mut found: BTreeMap<&str, usize> = BTreeMap::new();
    let parameters = subjects.iter().flat_map(|subject| &subject.parameters);
    for estimate in parameters.flat_map(ReceiverParameters::parameters) {
        let sentence = match estimate {
            Err(reason) => Some(missing(reason)),
            Ok(estimate) => estimate.warning.as_ref().map(|warning| doubtful(warning)),
        };
        if let Some(sentence) = sentence {
            *found.entry(sentence).or_default() += 1;
        }
    }
    let values = found.into_iter().map(|(sentence, count)| format!("{count} of the parameters: {sentence}"));
    let is_foreign = |subject: &&Subject| maps.iter().all(|map| !map.holds(subject));
    let foreign = subjects.iter().filter(|subject| !maps.is_empty() && is_foreign(subject)).map(|subject| {
        format!(
            "{} was not rendered from this map: room, effects and ledger are of another run.",
            subject.name
        )
    });
    values.chain(foreign).collect()
}

fn missing(reason: &Unsupported) -> &'static str {
    match reason {
        Unsupported::NoEnergy | Unsupported::NoReverberation => {
            "no sound arrives at this place and frequency."
        }
        Unsupported::NothingEarly { .. } | Unsupported::NothingLate { .. } => {
            "all sound arrives early, or all late, so a ratio of both has no value."
        }
        Unsupported::NotStraight { .. } => {
            "the sound dies away in several stages, so that one reverberation time does not describe it. Look at the decay curves."
        }
        Unsupported::Noisy { .. } | Unsupported::OneBatchDecides { .. } => {
            "the random scatter of the simulation is too large to state a value. A longer calculation (more packets) gives one."
        }
        Unsupported::DirectOutside { .. }
        | Unsupported::NotDecaying
        | Unsupported::RecordTooShort { .. }
        | Unsupported::CutOff { .. }
        | Unsupported::RangeNotReached { .. }
        | Unsupported::LimitOutside { .. } => {
            "the simulated time is too short for this value. A longer duration gives one."
        }
        Unsupported::TooSteep { .. } | Unsupported::BinTooWide { .. } | Unsupported::SingleBin => {
            "the time steps of the calculation are too long for this value. Finer time steps (--bin) give one."
        }
        Unsupported::BandsMissing { .. } | Unsupported::OctavesMissing { .. } => {
            "the simulation does not cover all octaves that this value needs."
        }
        Unsupported::Band { reason, .. } => missing(reason),
        _ => "the value cannot be stated; sonel-analyze parameters prints the reason.",
    }
}

fn doubtful(warning: &str) -> &'static str {
    if warning.contains("straight") {
        "the sound does not die away evenly, so that the reverberation time is a compromise."
    } else if warning.contains("the interval of the materials") {
        "the absorption of a surface is so uncertain that the interval of the materials is rough."
    } else {
        "the stated uncertainty may be too small, as a few strong paths decide. A longer calculation (more packets) helps."
    }
}
