//! A rectangular room from its sizes to its reverberation times.
//!
//! ```text
//! cargo run --release -p sonel --example 1-shoebox-to-t30 [PACKETS]
//! ```

#![allow(clippy::print_stdout)] // an example talks to people

use sonel::{Error, Material, MaterialKey, Parameter, RenderOptions, Scene, Silent, TraceOptions};

fn main() -> Result<(), Error> {
    let packets = std::env::args().nth(1).and_then(|word| word.parse().ok());
    // 10 × 7 × 3 m. Walls absorb 20 % and scatter half of what they reflect; the ceiling absorbs 60 %.
    let room = Scene::shoebox([10.0, 7.0, 3.0])
        .material("walls", Material::new(0.2).with(MaterialKey::Scattering, 0.5))
        .material("z1", Material::new(0.6))
        .source("stage", [2.0, 2.0, 1.5])
        .receiver("seat", [7.0, 5.0, 1.2])
        .build(&Silent)?;

    let traced = room.trace(&TraceOptions { packets, ..TraceOptions::default() }, &Silent)?;
    // Without receivers of its own a rendering is at those of the scene.
    let rendered = traced.map.render(&[], &RenderOptions::default(), &Silent)?;

    let times = rendered.response.parameters().array(Parameter::T30);
    for (frequency, (time, half_width)) in room.compiled().bands.nominal().iter().zip(times) {
        println!("{frequency:>6} Hz: T30 = {time:.3} ± {half_width:.3} s");
    }
    Ok(())
}
