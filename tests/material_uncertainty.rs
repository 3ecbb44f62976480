//! A room of uncertain materials: what the law of propagation predicts, and renderings with other materials to compare it with.

use sonel::{
    AbsorptionUncertainty, Change, Map, RenderEffects, RenderOptions, Response, Scene, Silent, TraceOptions,
};
use sonel_analysis::average::single_number;
use sonel_analysis::{Parameter, ReceiverParameters, parameters};

const ROOM: &str = r#"
name = "uncertain"
shoebox = [5.0, 4.0, 3.0]
duration_s = 0.7

[bands]
center_frequencies_hz = [500, 1000]

[materials.walls]
absorption = [0.2, 0.3]
scattering = 0.5

[materials.z0]
absorption = [0.3, 0.25]
scattering = 0.5

[materials.z1]
absorption = [0.6, 0.5]
scattering = 0.5

[[sources]]
name = "source"
position = [1.0, 1.1, 1.5]

[[receivers]]
name = "receiver"
position = [3.9, 2.8, 1.2]
"#;
/// Materials with their absorption and its standard uncertainty, which are those of the scene.
pub const MATERIALS: [(&str, [f64; 2], [f64; 2]); 3] = [
    ("walls", [0.2, 0.3], [0.02, 0.03]),
    ("z0", [0.3, 0.25], [0.03, 0.03]),
    ("z1", [0.6, 0.5], [0.06, 0.05]),
];
/// What is compared.
pub const READ: [Parameter; 3] = [Parameter::Strength, Parameter::T20, Parameter::ClarityC80];

/// A map of the room, and its response.
pub struct Uncertain {
    map: Map,
    response: Response,
    options: RenderOptions,
}

impl Uncertain {
    /// Traces the room.
    #[must_use]
    pub fn traced(packets: u64) -> Self {
        let scene = Scene::load_text(ROOM.to_owned(), "scene.toml", &Silent).expect("a valid scene");
        let options = TraceOptions { packets: Some(packets), ..TraceOptions::default() };
        let map = scene.trace(&options, &Silent).expect("a map").map;
        let effects = RenderEffects { diffraction: false, ..RenderEffects::default() };
        let options = RenderOptions { rays: Some(256), bin: 0.002, effects, ..RenderOptions::default() };
        let response = map.render(&[], &options, &Silent).expect("a response").response;
        Self { map, response, options }
    }

    /// Parameters of the room, with what the uncertainty of the materials makes of them.
    #[must_use]
    pub fn predicted(&self) -> ReceiverParameters {
        let uncertainty = MATERIALS.map(|(name, _, [first, second])| {
            format!("{name}={first},{second}").parse::<AbsorptionUncertainty>().expect("an uncertainty")
        });
        let mut found = parameters(self.response.echograms());
        let variants = self.map.material_variants(self.response.echograms(), &uncertainty, &Silent);
        let read = |echograms: &_| Ok::<_, ()>(parameters(echograms));
        variants.expect("variants").attach(&mut found, read).expect("parameters");
        found.remove(0)
    }

    /// Parameters of the room with the absorption of every material so many standard uncertainties off.
    #[must_use]
    pub fn with(&self, off: [f64; 3]) -> ReceiverParameters {
        let set = MATERIALS.iter().zip(off).filter(|(_, off)| off.abs() > 0.0).map(
            |((name, absorption, u), off)| {
                let changed: Vec<f64> =
                    absorption.iter().zip(u).map(|(absorption, u)| absorption + off * u).collect();
                Change::of(&format!("materials.{name}.absorption"), changed.into()).expect("a change")
            },
        );
        let options = RenderOptions { set: set.collect(), ..self.options.clone() };
        let rendered = self.map.render(&[], &options, &Silent).expect("a map of these materials");
        parameters(rendered.response.echograms()).remove(0)
    }
}

/// The values that are compared: each of [`READ`] by band, then its single number.
#[must_use]
pub fn values(found: &ReceiverParameters) -> Vec<sonel_analysis::Estimate> {
    let of = |parameter: &Parameter| {
        let bands = found.bands.iter().map(|band| band.parameter(*parameter).clone());
        bands.chain([single_number(found, *parameter)]).collect::<Vec<_>>()
    };
    READ.iter().flat_map(of).map(|value| value.expect("a value")).collect()
}

/// Half the width of the interval of the materials.
#[must_use]
pub fn half_width(estimate: &sonel_analysis::Estimate) -> f64 {
    let [low, high] = estimate.material_interval().expect("materials");
    0.5 * (high - low)
}
