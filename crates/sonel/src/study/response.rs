//! Renders every source of a map into one response.
//!
//! What the response says of its provenance is left to whoever writes it to a file.

use sonel_acoustics::Pattern;
use sonel_echogram::{
    ArrivalKind, Arrivals, Batches, Directions, Lateral, Missing, ReceiverDirectivity, Response,
    batch_time_edges,
};
use sonel_map::SonelMap;
use sonel_renderer::{BatchSums, CoarseEchogram, Columns, ReceiverPoint, RenderError, Renderer, Rendering};
use sonel_scene::Scene;

/// Receivers whose sums are in memory at once, 2 MB each, of which the response keeps a fifth; enough to keep all cores busy.
pub const PART: usize = 64;

/// The receivers that a scene names.
#[must_use]
pub fn receivers_of(scene: &Scene) -> Vec<ReceiverPoint> {
    scene.receivers.iter().map(ReceiverPoint::from).collect()
}

/// Coarse borders of the batches of `source` at every receiver [s].
#[must_use]
pub fn borders(
    scene: &Scene,
    renderer: &Renderer<'_>,
    source: usize,
    receivers: &[ReceiverPoint],
) -> Vec<Vec<f64>> {
    let direct = direct_times(renderer, source, receivers);
    direct.into_iter().map(|direct| batch_time_edges(direct, scene.duration)).collect()
}

/// When direct sound of `source` arrives, or would arrive, at every receiver [s].
fn direct_times(renderer: &Renderer<'_>, source: usize, receivers: &[ReceiverPoint]) -> Vec<f64> {
    receivers.iter().map(|receiver| renderer.direct_time(source, receiver.position)).collect()
}

/// Sums over no batch of `map` at `receivers`, source by source.
///
/// # Errors
/// [`RenderError::Receivers`] with all problems of all receivers.
pub fn begin(
    map: &SonelMap,
    renderer: &Renderer<'_>,
    receivers: &[ReceiverPoint],
) -> Result<Vec<BatchSums>, RenderError> {
    let scene = &map.header().scene;
    let begin = |source| renderer.begin(source, receivers, &borders(scene, renderer, source, receivers));
    (0..scene.sources.len()).map(begin).collect()
}

/// The response of `renderings`; its provenance is empty.
#[must_use]
pub fn assemble(
    map: &SonelMap,
    renderer: &Renderer<'_>,
    receivers: &[ReceiverPoint],
    renderings: &[Rendering],
) -> Response {
    let scene = &map.header().scene;
    Response {
        center_frequency_hz: scene.bands.nominal().to_vec(),
        time_edges_s: renderer.bins().edges(),
        receiver_names: receivers.iter().map(|receiver| receiver.name.clone()).collect(),
        receiver_positions: receivers.iter().map(|receiver| receiver.position.to_array()).collect(),
        receiver_directivities: directivities(receivers),
        source_names: scene.sources.iter().map(|source| source.name.clone()).collect(),
        source_positions: scene.sources.iter().map(|source| source.position.to_array()).collect(),
        source_power_level_db: scene
            .sources
            .iter()
            .flat_map(|source| source.power_level_db.clone())
            .collect(),
        speed_of_sound: scene.speed_of_sound,
        characteristic_impedance: scene.impedance(),
        direct_times_s: if scene.media.is_some() || scene.sound_speed_gradient != 0.0 {
            (0..scene.sources.len()).flat_map(|source| direct_times(renderer, source, receivers)).collect()
        } else {
            Vec::new()
        },
        energy: echograms(renderer, renderings, 0),
        batches: Some(batches(map, renderer, receivers, renderings)),
        directions: directions(map, renderer, receivers, renderings),
        missing: Some(missing(renderer, renderings)),
        arrivals: arrivals(renderer, renderings),
        provenance: Default::default(),
    }
}

/// Directivities of `receivers`; none where all are omnidirectional.
fn directivities(receivers: &[ReceiverPoint]) -> Vec<ReceiverDirectivity> {
    if receivers.iter().all(|receiver| receiver.sensitivity.pattern == Pattern::Omni) {
        return Vec::new();
    }
    let of = |receiver: &ReceiverPoint| match receiver.sensitivity.pattern {
        Pattern::Omni => ReceiverDirectivity::omni(),
        pattern => ReceiverDirectivity {
            name: pattern.name().to_owned(),
            aim: receiver.sensitivity.aim.to_array(),
            diffuse_sensitivity: 1.0 / pattern.factor(1.0),
        },
    };
    receivers.iter().map(of).collect()
}

/// A column of every receiver, in fine bins.
fn echograms(renderer: &Renderer<'_>, renderings: &[Rendering], column: usize) -> Vec<f64> {
    let bins = renderer.bins().count;
    let mut energy = Vec::new();
    for (rendering, receiver, band) in rows(renderings) {
        let at = receiver * rendering.columns.fine + column;
        energy.extend((0..bins).map(|bin| rendering.total.get(at, bin, band)));
    }
    energy
}

/// Renderings with their receivers and bands, as responses list them.
fn rows(renderings: &[Rendering]) -> impl Iterator<Item = (&Rendering, usize, usize)> {
    renderings.iter().flat_map(|rendering| {
        let bands = rendering.classes[0].1.len();
        let receivers = rendering.sphere_radius.len();
        (0..receivers).flat_map(move |receiver| (0..bands).map(move |band| (rendering, receiver, band)))
    })
}

/// Rendered batches with emissions; one without (fewer emissions than batches) estimates nothing and is left out.
fn filled(map: &SonelMap, renderer: &Renderer<'_>) -> Vec<u32> {
    (0..renderer.batches()).filter(|&batch| map.layout().batch_count(batch) > 0).collect()
}

/// A column of every receiver in every batch, in coarse bins.
fn coarse(
    filled: &[u32],
    renderings: &[Rendering],
    column: usize,
    of: impl Fn(&Rendering) -> &Vec<Vec<CoarseEchogram>>,
) -> Vec<f32> {
    let mut values = Vec::new();
    for &batch in filled {
        for (rendering, receiver, band) in rows(renderings) {
            let at = receiver * rendering.columns.coarse + column;
            values.extend(of(rendering)[batch as usize][at].band(band).map(|value| value as f32));
        }
    }
    values
}

/// The same of what kernels of half the area change; empty where they change nothing.
fn kernel_difference(filled: &[u32], renderings: &[Rendering], column: usize) -> Vec<f32> {
    let found = coarse(filled, renderings, column, |rendering| &rendering.kernel_differences);
    if found.iter().all(|&difference| difference == 0.0) { Vec::new() } else { found }
}

fn batches(
    map: &SonelMap,
    renderer: &Renderer<'_>,
    receivers: &[ReceiverPoint],
    renderings: &[Rendering],
) -> Batches {
    let (scene, filled, weights) = (&map.header().scene, filled(map, renderer), renderer.batch_weights());
    let edges: Vec<Vec<f64>> =
        (0..scene.sources.len()).flat_map(|source| borders(scene, renderer, source, receivers)).collect();
    Batches {
        weight: filled.iter().map(|&batch| weights[batch as usize]).collect(),
        bins: edges.first().map_or(0, |edges| edges.len() - 1),
        time_edges_s: edges.concat(),
        energy: coarse(&filled, renderings, 0, |rendering| &rendering.batches),
        kernel_difference: kernel_difference(&filled, renderings, 0),
    }
}

/// Energies by direction, where the renderings have them.
fn directions(
    map: &SonelMap,
    renderer: &Renderer<'_>,
    receivers: &[ReceiverPoint],
    renderings: &[Rendering],
) -> Option<Directions> {
    if renderings.first()?.columns != Columns::DIRECTED {
        return None;
    }
    let axes: Option<Vec<[f64; 3]>> =
        receivers.iter().map(|receiver| Some(renderer.lateral_axis(receiver)?.to_array())).collect();
    let filled = filled(map, renderer);
    let lateral = |column: usize| Lateral {
        energy: echograms(renderer, renderings, column),
        energy_batches: coarse(&filled, renderings, column, |rendering| &rendering.batches),
        kernel_difference: kernel_difference(&filled, renderings, column),
    };
    let axis = |index: usize| echograms(renderer, renderings, Columns::MOMENT + index);
    let [x, y, z] = [axis(0), axis(1), axis(2)];
    let moment = x.into_iter().zip(y).zip(z).flat_map(|((x, y), z)| [x, y, z]).collect();
    Some(Directions { lateral_axes: axes?, lateral: [lateral(1), lateral(2)], moment })
}

fn missing(renderer: &Renderer<'_>, renderings: &[Rendering]) -> Missing {
    let (fluence, rate): (Vec<_>, Vec<_>) =
        renderings.iter().map(|rendering| renderer.missing(rendering)).unzip();
    Missing { fluence: fluence.concat(), decay_rate: rate.concat() }
}

fn arrivals(renderer: &Renderer<'_>, renderings: &[Rendering]) -> Arrivals {
    let mut arrivals = Arrivals::default();
    for (source, rendering) in renderings.iter().enumerate() {
        for arrival in &rendering.arrivals {
            let kind = match arrival.order {
                _ if arrival.over_edges => ArrivalKind::Edge,
                0 => ArrivalKind::Direct,
                _ => ArrivalKind::ImageSource,
            };
            arrivals.source.push(source as u32);
            arrivals.receiver.push(arrival.receiver as u32);
            arrivals.time_s.push(renderer.bins().time(arrival.length));
            arrivals.energy.extend(&arrival.energy);
            arrivals.direction.extend(arrival.towards);
            arrivals.order.push(arrival.order);
            arrivals.kind.push(kind as u32);
        }
    }
    arrivals
}
