//! Measured directivities of sources and patterns of receivers as a section of the file.

use glam::DVec3;
use sonel_acoustics::{Balloon, Directivity, Pattern};
use sonel_scene::Scene;

use crate::codec::{BalloonRecord, DirectivityRecord, RollRecord};

/// Name of the section.
pub(crate) const SECTION: &str = "directivity";

/// Name of a measured directivity in the header.
const MEASURED: &str = "balloon";

/// Largest error of the squared lengths of `aim` and `up` and of their product [1]: far above rounding, far below any effect.
pub(crate) const ORTHONORMAL: f64 = 1e-9;

/// A directivity as the header names it.
pub(crate) fn word(directivity: &Directivity) -> &'static str {
    match directivity {
        Directivity::Pattern(pattern) => pattern.name(),
        Directivity::Measured { .. } => MEASURED,
    }
}

/// The section of `scene`; [`None`] where the header says everything. Sources with the same balloon share its record.
pub(crate) fn record(scene: &Scene) -> Option<DirectivityRecord> {
    let mut balloons: Vec<&Balloon> = Vec::new();
    let sources: Vec<RollRecord> = scene
        .sources
        .iter()
        .map(|source| match &source.directivity {
            Directivity::Pattern(_) => RollRecord { balloon: 0, up: [0.0; 3] },
            Directivity::Measured { balloon, up } => {
                let known = balloons.iter().position(|known| *known == balloon).unwrap_or_else(|| {
                    balloons.push(balloon);
                    balloons.len() - 1
                });
                RollRecord { balloon: known as u32 + 1, up: up.to_array() }
            }
        })
        .collect();
    if balloons.is_empty() && scene.receivers.iter().all(|receiver| receiver.pattern == Pattern::Omni) {
        return None;
    }
    let balloon = |balloon: &&Balloon| {
        let [azimuths, polars, _] = balloon.shape().map(|count| count as u32);
        BalloonRecord {
            name: balloon.name().to_owned(),
            azimuths,
            polars,
            factors: balloon.factors().to_vec(),
        }
    };
    Some(DirectivityRecord {
        balloons: balloons.iter().map(balloon).collect(),
        sources,
        receivers: scene.receivers.iter().map(|receiver| receiver.pattern.to_string()).collect(),
    })
}

/// Gives sources and receivers of `scene` the directivities that the header's `words` and the section name; the reason where these
/// contradict each other.
pub(crate) fn apply(
    words: &[String],
    section: Option<DirectivityRecord>,
    scene: &mut Scene,
) -> Result<(), String> {
    let (balloons, rolls) = match section {
        None => (Vec::new(), Vec::new()),
        Some(DirectivityRecord { balloons, sources, receivers }) => {
            if sources.len() != scene.sources.len() || receivers.len() != scene.receivers.len() {
                return Err("directivities are of other sources or receivers".to_owned());
            }
            for (receiver, word) in scene.receivers.iter_mut().zip(&receivers) {
                receiver.pattern = word.parse().map_err(|unknown| format!("{}: {unknown}", receiver.name))?;
            }
            let bands = scene.bands.count();
            let balloons = balloons.into_iter().map(|record| restore(record, bands));
            (balloons.collect::<Result<Vec<_>, _>>()?, sources)
        }
    };
    for (index, (source, word)) in scene.sources.iter_mut().zip(words).enumerate() {
        let roll = rolls.get(index).filter(|roll| roll.balloon > 0);
        source.directivity = match (word == MEASURED, roll) {
            (false, None) => {
                Directivity::Pattern(word.parse().map_err(|unknown| format!("{}: {unknown}", source.name))?)
            }
            (true, Some(roll)) => {
                let balloon = balloons.get(roll.balloon as usize - 1).cloned();
                let up = DVec3::from_array(roll.up);
                let is_off = (up.length_squared() - 1.0).abs() + up.dot(source.aim).abs();
                let balloon = balloon.filter(|_| is_off <= ORTHONORMAL);
                let balloon = balloon.ok_or_else(|| format!("source {} has no directivity", source.name))?;
                Directivity::Measured { balloon, up }
            }
            _ => return Err(format!("header and directivities contradict each other at {}", source.name)),
        };
    }
    Ok(())
}

fn restore(record: BalloonRecord, bands: usize) -> Result<Balloon, String> {
    let BalloonRecord { name, azimuths, polars, factors } = record;
    Balloon::restored(name, [azimuths as usize, polars as usize, bands], factors)
        .map_err(|error| format!("a directivity cannot be used: {error}"))
}
