//! Other materials on a map that was traced before.
//!
//! ```text
//! cargo run --release -p sonel --example 3-materials-after-the-trace [PACKETS]
//! ```

#![allow(clippy::print_stdout)] // an example talks to people

use sonel::{
    Alternatives, Change, Error, Material, MaterialKey, Parameter, RenderOptions, Scene, Silent,
    TraceOptions, Variants,
};

fn main() -> Result<(), Error> {
    let packets = std::env::args().nth(1).and_then(|word| word.parse().ok());
    let room = Scene::shoebox([10.0, 7.0, 3.0])
        .material("walls", Material::new(0.2).with(MaterialKey::Scattering, 0.5))
        .source("stage", [2.0, 2.0, 1.5])
        .receiver("seat", [7.0, 5.0, 1.2])
        .build(&Silent)?;
    // The map shall carry every absorption up to 0.7 as well as it carries that of the scene.
    let values = Alternatives::Coefficients(MaterialKey::Absorption, vec![0.7.into()]);
    let variants = vec![Variants { material: "walls".to_owned(), values }];
    let map = room.trace(&TraceOptions { packets, variants, ..TraceOptions::default() }, &Silent)?.map;

    for absorption in [0.2, 0.4, 0.7] {
        let walls = Change::Coefficient("walls".to_owned(), MaterialKey::Absorption, absorption.into());
        let options = RenderOptions { set: vec![walls], ..RenderOptions::default() };
        let rendered = map.render(&[], &options, &Silent)?;
        let (time, half_width) = rendered.response.parameters().at(Parameter::T20, 1000.0)?[0];
        println!("absorption {absorption}: T20 at 1 kHz = {time:.3} ± {half_width:.3} s");
        for warning in &rendered.warnings {
            println!("  {warning}");
        }
    }
    Ok(())
}
