//! The first packets of a run, which predict intervals and cost of all of it.
//!
//! - Four times as many are looked at where a parameter cannot be read anywhere, few strong paths decide it, or far more packets are needed: few packets
//!   miss the rare paths that carry the late decay.
//! - Rays follow packets as those of a run do. Only the parameters that a plan predicts are read, at some receivers.
//!
//! Everything but the seconds is a function of scene and settings.

use sonel_analysis::Parameter;
use sonel_map::{Settings, SonelMap};
use sonel_renderer::{ReceiverPoint, RenderSettings};

use crate::Result;
use crate::observer::{Observer, Silent, Watch};
use crate::study::forecast::{Costs, Effort, LEAST_PER_BATCH, Pilot};
use crate::study::job::Job;
use crate::study::pipeline::{InMemory, Room, trace};
use crate::study::spread::PLANNED;

/// Packets of the first look: 256 in each of 32 batches. With half as many the numbers that a classroom needs differ by a factor 2.6 between seeds,
/// with these by 2.
pub const FIRST: u64 = 8192;
/// Half-width for which a first look must be enough [JND].
const ACCURACY: f64 = 0.5;
/// Packets of the second look over those of the first. Chosen, not measured; doubled, long runs are chosen at twice the cost.
const SECOND: u64 = 4;
/// Factor from the packets of the first look to the most that it may ask for [1].
const FARTHEST: u64 = 16;
/// Excess kurtosis of a batch up to which the first look is trusted [1]: its variance scatters by half, by a quarter without any.
const TRUSTED_KURTOSIS: f64 = 6.0;
/// Emissions of [`segments`]: half a chunk. Chosen, not measured.
pub const FEW: u64 = 256;
/// Bits that distinguish the seed of [`segments`] from those of users: the golden ratio's.
const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// Largest share of a run's time that its pilot takes in CPU seconds [1], even if a single processor works. Chosen, not measured.
pub const SHARE_OF_TIME: f64 = 0.3;

/// Purpose of a pilot.
pub struct PilotConfig<'a> {
    /// The room.
    pub room: &'a Room<'a>,
    /// Settings of the run that is planned.
    pub settings: Settings,
    /// Evaluation receivers.
    pub receivers: &'a [ReceiverPoint],
    /// CPU seconds that a pilot may take, where the clock matters; its first look takes what it takes.
    pub seconds: Option<f64>,
}

/// Runs a pilot.
///
/// # Errors
/// The errors of [`Room::trace`] and of a rendering.
pub fn run(config: &PilotConfig<'_>, observer: &dyn Observer) -> Result<Pilot> {
    let clock = Watch(observer).clock();
    let begin = clock.process();
    let first = FIRST.max(LEAST_PER_BATCH * u64::from(config.settings.batches));
    let (pilot, map) = look(config, first, None, observer)?;
    // The second look costs no more than in proportion to its packets.
    let end = (1 + SECOND) as f64 * (clock.process() - begin);
    let ends_late = config.seconds.is_some_and(|seconds| end > seconds);
    let is_last = is_enough(&pilot) || ends_late;
    if is_last { Ok(pilot) } else { Ok(look(config, SECOND * first, Some(&map), observer)?.0) }
}

/// Whether a first look is trusted.
fn is_enough(pilot: &Pilot) -> bool {
    let effort = pilot.effort;
    let is_clear = |&parameter: &Parameter| {
        pilot.typical(parameter, effort).is_some()
            && !pilot.is_uncertain(parameter, effort, ACCURACY, TRUSTED_KURTOSIS)
    };
    PLANNED.iter().all(is_clear)
        && pilot.typical_need(ACCURACY, effort.batches).effort.emissions <= FARTHEST * effort.emissions
}

/// A look at the first `emissions`, those of the map `known` among them.
fn look(
    config: &PilotConfig<'_>,
    emissions: u64,
    known: Option<&SonelMap>,
    observer: &dyn Observer,
) -> Result<(Pilot, SonelMap)> {
    let PilotConfig { room, receivers, .. } = *config;
    let header = room.whole_run(Settings { emissions, ..config.settings });
    let traced = trace(&header, room.geometry(), known, &mut InMemory, observer)?;
    let job = Job::of(&traced.map, room.geometry(), receivers, Watch(observer));
    let (rendered, parameters) = job.read(&RenderSettings::default(), &PLANNED)?;
    let (all, new) = (emissions as f64, emissions - known.map_or(0, |map| map.header().settings.emissions));
    let (trace, render) = (traced.seconds, rendered.seconds);
    let costs = Costs {
        // Only new packets are traced; all are written.
        trace: trace.trace / new as f64 + trace.write / all,
        open: (trace.open + render.prepare) / all,
        deterministic: render.deterministic,
        sweep: render.sweep / all,
        ray: 0.0,
        bytes: traced.map.byte_length() as f64 / all,
        segments: traced.ledger.segments as f64 / all,
    };
    let pilot = Pilot::of(None, &parameters, &PLANNED, Effort::of_trace(emissions, config.settings.batches));
    Ok((Pilot { casts_rays: rendered.casts_rays, costs, ..pilot }, traced.map))
}

/// Segments per emission of the run that is planned: a few packets traced and not rendered.
///
/// # Errors
/// The errors of [`Room::trace`].
pub fn segments(room: &Room<'_>, settings: Settings) -> Result<f64> {
    let settings = Settings { emissions: FEW, seed: settings.seed.wrapping_mul(SEED), ..settings };
    let traced = room.trace(settings, &mut InMemory, &Silent)?;
    Ok(traced.ledger.segments as f64 / (FEW * room.scene().sources.len() as u64) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Clock;
    use crate::study::evaluation_receivers::evaluation_receivers;
    use crate::study::plan::Plan;
    use sonel_acoustics::{BandWidth, Bands, Material};
    use sonel_geometry::Mesh;
    use sonel_scene::Scene;
    use std::sync::Mutex;

    /// A second passes whenever somebody asks for the time.
    #[derive(Default)]
    struct Ticking(Mutex<f64>);

    impl Observer for Ticking {
        fn clock(&self) -> Option<&dyn Clock> {
            Some(self)
        }
    }

    impl Clock for Ticking {
        fn wall(&self) -> f64 {
            0.0
        }

        fn process(&self) -> f64 {
            let mut time = self.0.lock().expect("nobody panicked");
            *time += 1.0;
            *time
        }

        fn thread(&self) -> f64 {
            0.0
        }
    }

    /// A pilot of a box whose floor and ceiling have this `absorption`, beside smooth hard walls where it is large, that may take `seconds`.
    fn pilot(absorption: f64, seconds: Option<f64>) -> Pilot {
        let bands = Bands::new(vec![500.0], BandWidth::Octave).expect("an octave");
        let material =
            |absorption, scattering| Material::uniform("walls", absorption, scattering, bands.count());
        let walls = if absorption > 0.5 { material(0.05, 0.05) } else { material(0.3, 0.5) };
        let mesh = Mesh::shoebox([6.0, 5.0, 3.0], [0, 0, 0, 0, 1, 1]);
        let scene = Scene::from_parts(mesh, vec![walls, material(absorption, 0.5)], bands, 0.8)
            .with_source("source", [1.0, 1.0, 1.5])
            .with_receiver("seat", [4.2, 3.4, 1.2]);
        let geometry = scene.geometry().expect("walls");
        let room = Room::within(&scene, &geometry, &[]);
        let receivers = evaluation_receivers(&scene, room.geometry(), 1);
        let settings = Settings::default();
        let config = PilotConfig { room: &room, settings, receivers: &receivers, seconds };
        let pilot = run(&config, &Ticking::default()).expect("a valid scene");
        let plan = Plan::of_trace(pilot.clone(), &scene, &receivers, 32, 0.001);
        assert!(plan.rows.iter().all(|row| row.price.trace.is_finite() && row.effort.emissions > 0));
        pilot
    }

    #[test]
    fn late_decay_of_few_packets_makes_pilots_longer_where_there_is_time() {
        assert_eq!(pilot(0.3, None).effort.emissions, FIRST);
        assert!(pilot(0.9, None).effort.emissions > FIRST);
        assert_eq!(pilot(0.9, Some(3.0)).effort.emissions, FIRST);
    }
}
