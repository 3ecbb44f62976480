//! Counts first, then seconds: how many rays a second of one thread's time traces in rooms of several sizes.
//!
//! `cargo run --release -p sonel-geometry --example rays [part of a room's name]`
#![allow(clippy::print_stdout, missing_docs)] // a measurement talks to whoever runs it

#[path = "../tests/rays/numbers.rs"]
mod numbers;
#[path = "../tests/rays/rooms.rs"]
mod rooms;

use glam::{Vec3, dvec3};
use numbers::Numbers;
use sonel_geometry::{Departure, Geometry, Mesh};
use std::time::Instant;

fn main() {
    let hall = |objects| move || rooms::furnished_hall(objects);
    let rooms: [(&str, &dyn Fn() -> Mesh, usize); 7] = [
        ("screened room", &rooms::screened_room, 4_000_000),
        ("L-shaped room", &rooms::l_room, 4_000_000),
        ("small hall", &hall(8), 1_000_000),
        ("box, 12 k", &|| rooms::tessellated_box(dvec3(10.0, 7.0, 3.0), 32), 1_000_000),
        ("boulder", &|| rooms::boulder(6), 1_000_000),
        ("furnished hall", &hall(8_333), 500_000),
        ("crowded hall", &hall(83_333), 200_000),
    ];
    println!(
        "{:16} {:>9} {:>9} {:>9} {:>8} {:>8} {:>9} {:>9}",
        "room", "triangles", "surfaces", "rays", "hits", "blocked", "closest/s", "shadow/s"
    );
    let wanted = std::env::args().nth(1).unwrap_or_default();
    for (name, room, count) in rooms.into_iter().filter(|(name, ..)| name.contains(&wanted)) {
        let start = Instant::now();
        let geometry = Geometry::build(room()).expect("rooms are valid");
        let build = start.elapsed().as_secs_f64();
        let (low, high) = geometry.bounds();
        let mut numbers = Numbers(3);
        let mut point = || {
            let inner = numbers.within(low + 0.02 * (high - low), high - 0.02 * (high - low));
            (geometry.to_local(inner), numbers.direction().as_vec3())
        };
        let rays: Vec<(Vec3, Vec3)> = (0..count).map(|_| point()).collect();
        let (hits, closest) = measured(|| {
            rays.iter().filter(|(o, d)| geometry.closest_hit(Departure::free(*o), *d).is_some()).count()
        });
        let (blocked, shadow) = measured(|| {
            rays.windows(2).filter(|w| geometry.is_blocked(Departure::free(w[0].0), w[1].0)).count()
        });
        println!(
            "{name:16} {:>9} {:>9} {count:>9} {:>7.1}% {:>7.1}% {:>8.2}M {:>8.2}M   built in {build:.2} s",
            geometry.mesh().triangles.len(),
            geometry.surfaces().len(),
            100.0 * hits as f64 / count as f64,
            100.0 * blocked as f64 / count as f64,
            count as f64 / closest / 1e6,
            count as f64 / shadow / 1e6,
        );
    }
}

/// The result and the seconds this thread ran for it.
fn measured(work: impl Fn() -> usize) -> (usize, f64) {
    let start = (thread_time(), Instant::now());
    let result = work();
    let seconds = match (start.0, thread_time()) {
        (Some(before), Some(after)) => after - before,
        _ => start.1.elapsed().as_secs_f64(),
    };
    (result, seconds)
}

/// Seconds this thread has run, where the system tells.
fn thread_time() -> Option<f64> {
    let statistics = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(statistics.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
}
