//! Every bit of a rendered response, flipped: the file is refused or says the same, never anything else. `sonel-map` tests the same of a
//! map in every run of its tests.

use std::io::Cursor;

use rayon::prelude::*;
use sonel_echogram::Response;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_tests::{Traced, shipped};

#[test]
fn a_response_with_any_bit_flipped_is_refused_or_the_same() {
    let mut scene = shipped("shoebox");
    scene.duration = 0.2;
    let traced = Traced::new(scene, Settings { emissions: 8, batches: 2, ..Settings::default() });
    // Few bins and arrivals: the time goes with the square of the size.
    let settings =
        RenderSettings { bin: 0.1, rays: Some(4), mirror_order: Some(1), ..RenderSettings::default() };
    let response = traced.respond(settings);
    let good = response.write(Cursor::new(Vec::new())).unwrap().into_inner();
    let response = Response::read(Cursor::new(&good)).unwrap();
    let refused: usize = (0..good.len() * 8)
        .into_par_iter()
        .map(|bit| {
            let mut damaged = good.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            match Response::read(Cursor::new(damaged)) {
                Err(_) => 1,
                Ok(read) => {
                    assert!(read == response, "bit {bit}");
                    0
                }
            }
        })
        .sum();
    println!("{refused} of {} flipped bits refused, the others change nothing", good.len() * 8);
    assert!(refused > good.len() * 8 * 3 / 4);
}
