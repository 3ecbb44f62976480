//! One map in a file, opened again and rendered at a grid of receivers.
//!
//! ```text
//! cargo run --release -p sonel --example 2-map-reused-for-a-grid [PACKETS]
//! ```

#![allow(clippy::print_stdout)] // an example talks to people

use sonel::{Axis, Error, Grid, Map, Material, Parameter, RenderOptions, Scene, Silent, TraceOptions};

fn main() -> Result<(), Error> {
    let packets = std::env::args().nth(1).and_then(|word| word.parse().ok());
    let room = Scene::shoebox([10.0, 7.0, 3.0])
        .material("walls", Material::new(0.2))
        .source("stage", [2.0, 2.0, 1.5])
        .build(&Silent)?;
    let path = std::env::temp_dir().join(format!("sonel-example-{}.sonelmap", std::process::id()));
    room.trace(&TraceOptions { packets, ..TraceOptions::default() }, &Silent)?.map.save(&path)?;

    // Another day: the map has everything, also its scene.
    let map = Map::open(&path)?;
    let axis = |low, high, count| Axis { low, high, count };
    let grid = Grid::new([axis(4.0, 9.0, 3), axis(1.5, 5.5, 2), 1.2.into()]).expect("six points");
    let options = RenderOptions { grid: Some(grid), ..RenderOptions::default() };
    let rendered = map.render(&[], &options, &Silent)?;

    let parameters = rendered.response.parameters();
    let band = 4; // 1 kHz
    for (receiver, row) in parameters.rows().iter().enumerate() {
        let [x, y, _] = row.position;
        match parameters.value(Parameter::Strength, 0, receiver, band) {
            Ok(strength) => println!("x = {x:.1} m, y = {y:.1} m: G = {:.2} dB", strength.value),
            Err(reason) => println!("x = {x:.1} m, y = {y:.1} m: no G: {reason}"),
        }
    }
    std::fs::remove_file(path)?;
    Ok(())
}
