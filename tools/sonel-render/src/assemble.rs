//! From renderings to a response file and its report.

use serde_json::{Value, json};
use sonel_echogram::{ArrivalKind, Arrivals, Batches, Response};
use sonel_map::SonelMap;
use sonel_renderer::{CoarseEchogram, Estimator, ReceiverPoint, RenderSettings, Renderer, Rendering};

/// What was rendered, and how.
pub struct Run<'a> {
    /// From which map.
    pub map: &'a SonelMap,
    /// By whom.
    pub renderer: &'a Renderer<'a>,
    /// How.
    pub settings: &'a RenderSettings,
    /// Where.
    pub receivers: &'a [ReceiverPoint],
}

impl Run<'_> {
    /// The response of `renderings`, one per source, whose batches have the coarse `borders` per source and receiver.
    pub fn response(&self, renderings: &[Rendering], borders: &[Vec<Vec<f64>>]) -> Response {
        let scene = &self.map.header().scene;
        Response {
            center_frequency_hz: scene.bands.nominal().to_vec(),
            time_edges_s: self.renderer.bins().edges(),
            receiver_names: self.receivers.iter().map(|receiver| receiver.name.clone()).collect(),
            receiver_positions: self.receivers.iter().map(|receiver| receiver.position.to_array()).collect(),
            source_names: scene.sources.iter().map(|source| source.name.clone()).collect(),
            source_positions: scene.sources.iter().map(|source| source.position.to_array()).collect(),
            source_power_level_db: scene
                .sources
                .iter()
                .flat_map(|source| source.power_level_db.clone())
                .collect(),
            speed_of_sound: scene.speed_of_sound,
            characteristic_impedance: scene.impedance(),
            energy: self.energy(renderings),
            batches: Some(self.batches(renderings, borders)),
            arrivals: self.arrivals(renderings),
            metadata: self.metadata(renderings),
        }
    }

    fn energy(&self, renderings: &[Rendering]) -> Vec<f64> {
        let (bands, bins) = (self.map.header().scene.bands.count(), self.renderer.bins().count);
        let mut energy = Vec::with_capacity(renderings.len() * self.receivers.len() * bands * bins);
        for rendering in renderings {
            for receiver in 0..self.receivers.len() {
                for band in 0..bands {
                    energy.extend((0..bins).map(|bin| rendering.total.get(receiver, bin, band)));
                }
            }
        }
        energy
    }

    fn batches(&self, renderings: &[Rendering], borders: &[Vec<Vec<f64>>]) -> Batches {
        let (layout, bands) = (self.map.layout(), self.map.header().scene.bands.count());
        // A batch without emissions (fewer emissions than batches) estimates nothing and is left out.
        let filled: Vec<u32> = (0..layout.batches).filter(|&batch| layout.batch_count(batch) > 0).collect();
        let column = |of: &dyn Fn(&Rendering) -> &Vec<Vec<CoarseEchogram>>| -> Vec<f32> {
            let mut values = Vec::new();
            for &batch in &filled {
                for receiver in renderings.iter().flat_map(|rendering| &of(rendering)[batch as usize]) {
                    values.extend((0..bands).flat_map(|band| receiver.band(band)).map(|value| value as f32));
                }
            }
            values
        };
        let mut kernel_difference = column(&|rendering| &rendering.kernel_differences);
        if kernel_difference.iter().all(|&difference| difference == 0.0) {
            kernel_difference.clear();
        }
        Batches {
            weight: filled.iter().map(|&batch| layout.batch_weight(batch)).collect(),
            bins: borders.first().and_then(|source| source.first()).map_or(0, |edges| edges.len() - 1),
            time_edges_s: borders.iter().flatten().flatten().copied().collect(),
            energy: column(&|rendering| &rendering.batches),
            kernel_difference,
        }
    }

    fn arrivals(&self, renderings: &[Rendering]) -> Arrivals {
        let mut arrivals = Arrivals::default();
        for (source, rendering) in renderings.iter().enumerate() {
            for arrival in &rendering.arrivals {
                let kind = match arrival.order {
                    _ if arrival.over_edges => ArrivalKind::Edge,
                    0 => ArrivalKind::Direct,
                    _ => ArrivalKind::MirrorChain,
                };
                arrivals.source.push(source as u32);
                arrivals.receiver.push(arrival.receiver as u32);
                arrivals.time_s.push(self.renderer.bins().time(arrival.length));
                arrivals.energy.extend(&arrival.energy);
                arrivals.direction.extend(arrival.towards);
                arrivals.order.push(arrival.order);
                arrivals.kind.push(kind as u32);
            }
        }
        arrivals
    }

    /// Provenance: everything that decided the response and nothing that depends on machine or clock.
    fn metadata(&self, renderings: &[Rendering]) -> Value {
        let header = self.map.header();
        json!({
            "tool": "sonel-render",
            "tool_version": env!("CARGO_PKG_VERSION"),
            "scene": header.scene.name,
            "scene_digest": hexadecimal(&header.scene.digest),
            "mesh_digest": hexadecimal(&header.scene.mesh_digest),
            "map_digest": hexadecimal(&self.map.digest()),
            "seed": self.settings.seed.unwrap_or(header.settings.seed),
            "emissions": header.settings.emissions,
            "batches": header.settings.batches,
            "survival": header.settings.survival,
            "options": {
                "bin_s": self.settings.bin,
                "estimator": estimator(self.settings.estimator),
                "order": self.settings.mirror_order,
                "rays": self.settings.rays,
                "radius_m": self.settings.gather_radius,
                "air_attenuation": self.renderer.attenuation(),
            },
            "sources": renderings.iter().map(|rendering| self.shares(rendering)).collect::<Vec<_>>(),
        })
    }

    /// Orders and energy per path class of one source.
    fn shares(&self, rendering: &Rendering) -> Value {
        let classes: Vec<Value> = rendering
            .classes
            .iter()
            .map(|(class, energy)| {
                let samples: Vec<Option<f64>> =
                    (0..energy.len()).map(|band| rendering.effective_sample_size(*class, band)).collect();
                json!({
                    "class": class.notation(),
                    "estimator": self.renderer.owner(*class),
                    "reason": self.renderer.reason(*class, rendering.mirror_order),
                    "energy": energy,
                    "effective_sample_size": samples,
                })
            })
            .collect();
        json!({
            "mirror_order": rendering.mirror_order,
            "image_order": rendering.image_order,
            "sphere_radius_m": rendering.sphere_radius,
            "classes": classes,
        })
    }

    /// What `--json` prints.
    pub fn report(&self, renderings: &[Rendering], opened: (f64, f64), total: (f64, f64)) -> Value {
        let mut report = self.metadata(renderings);
        report["timings"] = json!({
            "open_wall_s": opened.0,
            "open_cpu_s": opened.1,
            "wall_s": total.0,
            "cpu_s": total.1,
        });
        report
    }
}

fn estimator(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::Auto => "auto",
        Estimator::Connection => "connection",
        Estimator::Gather => "gather",
        Estimator::Sphere => "sphere",
        Estimator::Paper => "paper",
    }
}

fn hexadecimal(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}
