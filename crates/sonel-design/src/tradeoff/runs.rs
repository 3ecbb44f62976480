//! Running a sweep: every setting, every number of packets, every repeat, and the reference.

use sonel_analysis::{Parameter, ParameterValue, ReceiverParameters};
use sonel_map::{Mode, Settings};
use sonel_renderer::{PathClass, ReceiverPoint, RenderSettings};

use super::sweep::{JUDGED, Setting, Sweep};
use sonel::echograms::Echograms;
use sonel::study::pipeline::{RenderSeconds, RenderedMap, Room, TraceSeconds, render_and_read};
use sonel::{MapStore, Observer};

/// Receiver, band and parameter of a value.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepCell {
    /// Name of the source.
    pub source: String,
    /// Name of the receiver.
    pub receiver: String,
    /// Nominal centre of the band [Hz].
    pub center_frequency_hz: f64,
    /// One of [`JUDGED`].
    pub parameter: Parameter,
}

/// A parameter of one run: value and, where the run knows one, half-width of its 95 % interval, in the parameter's unit. None where
/// the run refused it.
pub type Value = Option<(f64, Option<f64>)>;

/// Reference of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Emissions of the longer run; none where nothing is sampled and the answer exact.
    pub packets: Option<u64>,
    /// In the order of the cells.
    pub values: Vec<Value>,
}

/// CPU seconds of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RunSeconds {
    /// CPU seconds of the first pass.
    pub trace: TraceSeconds,
    /// CPU seconds of the second.
    pub render: RenderSeconds,
}

impl RunSeconds {
    /// Tracing and rendering; parameters are read alike whatever the setting.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.trace.total() + self.render.total() - self.render.parameters
    }

    /// Parts, with the names of outputs.
    #[must_use]
    pub fn phases(&self) -> [(&'static str, f64); 6] {
        [
            ("trace", self.trace.trace),
            ("write", self.trace.write),
            ("open", self.trace.open),
            ("prepare", self.render.prepare),
            ("deterministic", self.render.deterministic),
            ("sweep", self.render.sweep),
        ]
    }
}

/// One simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepRun {
    /// Index of the setting.
    pub setting: usize,
    /// Emissions per source.
    pub packets: u64,
    /// Cost.
    pub seconds: RunSeconds,
    /// In the order of the cells.
    pub values: Vec<Value>,
}

/// A sweep that was run.
#[derive(Debug, Clone, PartialEq)]
pub struct Tradeoff {
    /// Name of the scene.
    pub scene: String,
    /// Runs.
    pub sweep: Sweep,
    /// The parameters.
    pub cells: Vec<SweepCell>,
    /// Their reference.
    pub reference: Reference,
    /// All simulations.
    pub runs: Vec<SweepRun>,
}

impl Tradeoff {
    /// The repeats of `setting` with `packets`, in order.
    #[must_use]
    pub fn runs_of(&self, setting: usize, packets: u64) -> Vec<&SweepRun> {
        self.runs.iter().filter(|run| run.setting == setting && run.packets == packets).collect()
    }
}

/// Runs `sweep` in `room` at `receivers`. Repeats are outermost, so that what else the machine does spreads over all settings;
/// settings that trace alike share the map of each repeat, and each is charged for it. `progress` receives the share done.
///
/// # Errors
/// When the room leaks, a receiver is impossible, or a map cannot be stored.
pub fn conduct(
    room: &Room<'_>,
    receivers: &[ReceiverPoint],
    sweep: &Sweep,
    store: &mut impl MapStore,
    observer: &dyn Observer,
    progress: &mut dyn FnMut(f64),
) -> Result<Tradeoff, sonel::Error> {
    let stage = Stage { room, receivers, observer };
    let (cells, reference) = stage.reference(sweep, store)?;
    let total: u64 = sweep.reference_packets + u64::from(sweep.repeats) * sweep.packets.iter().sum::<u64>();
    let mut done = sweep.reference_packets;
    let mut runs = Vec::new();
    for repeat in 0..sweep.repeats {
        for &packets in &sweep.packets {
            progress(done as f64 / total as f64);
            let seed = sweep.seed.wrapping_add(u64::from(repeat));
            for group in groups(&sweep.settings) {
                let trace = Settings { emissions: packets, seed, ..sweep.settings[group[0]].trace };
                let traced = room.trace(trace, store, observer)?;
                for setting in group {
                    let (rendered, parameters) =
                        stage.render_and_read(&traced.map, &sweep.settings[setting].render)?;
                    let seconds = RunSeconds { trace: traced.seconds, render: rendered.seconds };
                    let values = values(&parameters);
                    runs.push(SweepRun { setting, packets, seconds, values });
                }
            }
            done += packets;
        }
    }
    progress(1.0);
    Ok(Tradeoff { scene: room.scene().name.clone(), sweep: sweep.clone(), cells, reference, runs })
}

/// Where everything is run.
struct Stage<'a> {
    room: &'a Room<'a>,
    receivers: &'a [ReceiverPoint],
    observer: &'a dyn Observer,
}

impl Stage<'_> {
    /// The cells and what they are compared with: the best method with the base setting's number of batches, first with the
    /// fewest packets, which is enough where nothing is sampled.
    fn reference(
        &self,
        sweep: &Sweep,
        store: &mut impl MapStore,
    ) -> Result<(Vec<SweepCell>, Reference), sonel::Error> {
        let mut packets = sweep.packets[0];
        loop {
            let settings = Settings {
                emissions: packets,
                // A seed that no repeat has.
                seed: sweep.seed.wrapping_sub(1),
                batches: sweep.settings[0].trace.batches,
                mode: Mode::Accurate,
                ..Settings::default()
            };
            let traced = self.room.trace(settings, store, self.observer)?;
            let edges = sweep.settings[0].render.edges;
            let (rendered, parameters) =
                self.render_and_read(&traced.map, &RenderSettings { edges, ..RenderSettings::default() })?;
            let sampled = (!is_exact(&rendered.response)).then_some(packets);
            if sampled.is_none() || packets == sweep.reference_packets {
                let reference = Reference { packets: sampled, values: values(&parameters) };
                return Ok((cells(&parameters), reference));
            }
            packets = sweep.reference_packets;
        }
    }

    fn render_and_read(
        &self,
        map: &sonel_map::SonelMap,
        settings: &RenderSettings,
    ) -> Result<(RenderedMap, Vec<ReceiverParameters>), sonel::Error> {
        render_and_read(map, self.room.geometry(), self.receivers, settings, self.observer)
    }
}

/// Indices of settings that trace alike, in order of the first of each.
fn groups(settings: &[Setting]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, setting) in settings.iter().enumerate() {
        match groups.iter_mut().find(|group| settings[group[0]].trace == setting.trace) {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    groups
}

/// Part of the energy that may be sampled where the rest is exact: image-source paths are enumerated down to 1e-8 of the energy.
const SAMPLED_SHARE: f64 = 1e-6;

/// Whether nothing that counts was sampled: the energy came by paths that are enumerated.
fn is_exact(response: &Echograms) -> bool {
    let enumerated = [PathClass::Direct, PathClass::ImageSource, PathClass::Edge].map(PathClass::notation);
    response.provenance.sources.iter().all(|source| {
        let sum = |is_sampled: bool| -> Vec<f64> {
            let mut sum = vec![0.0; response.bands()];
            for class in &source.classes {
                if enumerated.contains(&class.class.as_str()) != is_sampled {
                    let energies = class.energy.iter().flat_map(|energy| energy.iter().enumerate());
                    energies.for_each(|(band, energy)| sum[band] += energy);
                }
            }
            sum
        };
        sum(true).iter().zip(sum(false)).all(|(sampled, exact)| *sampled <= SAMPLED_SHARE * exact)
    })
}

fn compared(parameters: &[ReceiverParameters]) -> impl Iterator<Item = (SweepCell, &ParameterValue)> {
    parameters.iter().flat_map(|receiver| {
        receiver.bands.iter().flat_map(move |band| {
            JUDGED.map(|parameter| {
                let cell = SweepCell {
                    source: receiver.source.clone(),
                    receiver: receiver.name.clone(),
                    center_frequency_hz: band.center_frequency_hz,
                    parameter,
                };
                (cell, band.parameter(parameter))
            })
        })
    })
}

fn cells(parameters: &[ReceiverParameters]) -> Vec<SweepCell> {
    compared(parameters).map(|(cell, _)| cell).collect()
}

fn values(parameters: &[ReceiverParameters]) -> Vec<Value> {
    let value = |estimate: &ParameterValue| {
        let estimate = estimate.as_ref().ok()?;
        let half_width = estimate.interval.as_ref().ok().map(|[low, high]| 0.5 * (high - low));
        Some((estimate.value, half_width))
    };
    compared(parameters).map(|(_, estimate)| value(estimate)).collect()
}
