//! Rust of README.md and of the pages of this crate, word for word (`cargo xtask tidy` compares).

use sonel::{Material, Parameter, RenderOptions, Scene, Silent, TraceOptions};

/// README.md.
fn other_materials() -> sonel::Result<sonel::Response> {
    let room = Scene::load("scenes/shoebox/scene.toml", &Silent)?;
    let until = Some("t30<1%".parse()?);
    let map = room.trace(&TraceOptions { until, ..Default::default() }, &Silent)?.map;
    let set = vec!["materials.walls.absorption=0.3".parse()?];
    let response = map.render(&[], &RenderOptions { set, ..Default::default() }, &Silent)?.response;
    Ok(response)
}

/// Page of the crate and its README.
#[test]
fn the_first_room_has_a_reverberation_time() -> sonel::Result<()> {
    let room = Scene::shoebox([10.0, 7.0, 3.0])
        .material("walls", Material::new(0.2))
        .source("stage", [2.0, 2.0, 1.5])
        .receiver("seat", [7.0, 5.0, 1.2])
        .build(&Silent)?;
    let map = room.trace(&TraceOptions::default(), &Silent)?.map;
    let rendered = map.render(&[], &RenderOptions::default(), &Silent)?;
    let (t30, half_width) = rendered.response.parameters().at(Parameter::T30, 1000.0)?[0];
    println!("T30 at 1 kHz: {t30:.3} ± {half_width:.3} s");
    assert!(t30 > 0.5 && half_width < 0.1, "{t30} {half_width}");
    Ok(())
}

/// It names a file of the repository, beside which tests do not run.
const _: fn() -> sonel::Result<sonel::Response> = other_materials;
