//! From renderings to a response file and its report.

use serde_json::{Value, json};
use sonel_echogram::Response;
use sonel_map::SonelMap;
use sonel_renderer::{Estimator, ReceiverPoint, RenderSettings, Renderer, Rendering};
use sonel_study::response::assemble;

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
    /// The response of `renderings`, one per source.
    pub fn response(&self, renderings: &[Rendering]) -> Response {
        Response {
            metadata: self.metadata(renderings),
            ..assemble(self.map, self.renderer, self.receivers, renderings)
        }
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
