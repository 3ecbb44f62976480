//! Rays benchmark: closest hits and shadow rays of one thread in the hall and in the same hall cut into 82 000 triangles.
//!
//! The rays are those of diffuse walks from the source: incoherent, as in a trace. `cargo xtask bench rays` casts the same rays with Embree
//! and prints both; without it the rays are left in `target/rays`, and the rates alone are printed.

#![allow(clippy::print_stdout)] // a benchmark reports to whoever runs it

use std::fs::{self, File};
use std::hint::black_box;
use std::io::{BufWriter, Write};
use std::path::Path;

use cpu_time::ThreadTime;
use glam::{DVec3, Vec3};
use sonel_geometry::{Departure, Geometry};
use sonel_testkit::uniform::Uniform;
use sonel_tests::{meshes, shipped};

/// Walks and steps of each.
const WALKS: [u32; 2] = [100_000, 10];
/// Each measurement is the fastest of so many.
const REPEATS: u32 = 3;

/// A ray, and the end of the shadow ray from the same start.
struct Ray {
    from: Departure,
    direction: Vec3,
    target: Vec3,
}

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/rays");
    fs::create_dir_all(&folder)?;
    let hall = shipped("hall");
    let mut rates = String::new();
    for (name, times) in [("hall", 0), ("fine hall", 2)] {
        let geometry = Geometry::build(meshes::tessellated(&hall.mesh, times)).expect("a sound mesh");
        let rays = walk(&geometry, geometry.to_local(hall.sources[0].position));
        let hit = |ray: &Ray| geometry.closest_hit(ray.from, ray.direction).is_some();
        let blocked = |ray: &Ray| geometry.is_blocked(ray.from, ray.target);
        let [closest, shadow] = [per_second(&rays, hit), per_second(&rays, blocked)];
        println!("{name}: {:.2} M closest hits, {:.2} M shadow rays per CPU-s", closest / 1e6, shadow / 1e6);
        rates.push_str(&format!("{name},{closest},{shadow}\n"));
        write(&folder.join(format!("{name}.bin")), &geometry, &rays)?;
    }
    fs::write(folder.join("rates.csv"), rates)
}

/// The rays of diffuse walks from `start`, each with a target: the start of a ray of another walk.
fn walk(geometry: &Geometry, start: Vec3) -> Vec<Ray> {
    let mut random = Uniform::new(1);
    let mut unit_vector = || DVec3::from(random.unit_vector()).as_vec3();
    let mut rays = Vec::new();
    for _ in 0..WALKS[0] {
        let (mut from, mut direction) = (Departure::free(start), unit_vector());
        for _ in 0..WALKS[1] {
            rays.push(Ray { from, direction, target: from.origin });
            let Some(hit) = geometry.closest_hit(from, direction) else { break };
            let front = geometry.surface(hit.surface).normal.as_vec3();
            let normal = if direction.dot(front) < 0.0 { front } else { -front };
            from = geometry.leave(hit.position, hit.surface, hit.side);
            // Lambert's law.
            direction = (normal + unit_vector()).normalize();
        }
    }
    let starts: Vec<Vec3> = rays.iter().map(|ray| ray.from.origin).collect();
    let shift = starts.len() / 2 + 1;
    rays.iter_mut().zip(starts.iter().cycle().skip(shift)).for_each(|(ray, &target)| ray.target = target);
    rays
}

/// How many rays per CPU second `cast` takes.
fn per_second(rays: &[Ray], cast: impl Fn(&Ray) -> bool) -> f64 {
    let seconds = (0..REPEATS).map(|_| {
        let begin = ThreadTime::now();
        black_box(rays.iter().filter(|ray| cast(ray)).count());
        begin.elapsed().as_secs_f64()
    });
    rays.len() as f64 / seconds.fold(f64::INFINITY, f64::min)
}

/// Numbers of triangles and rays, then corners, starts, directions and targets as triples of single precision about the scene's centre [m].
fn write(path: &Path, geometry: &Geometry, rays: &[Ray]) -> std::io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    let mesh = geometry.mesh();
    for count in [mesh.triangles.len(), rays.len()] {
        file.write_all(&(count as u32).to_le_bytes())?;
    }
    let corners = mesh.triangles.iter().flat_map(|triangle| triangle.corners);
    let mut triples: Vec<Vec3> =
        corners.map(|corner| geometry.to_local(mesh.vertices[corner as usize])).collect();
    triples.extend(rays.iter().map(|ray| ray.from.origin));
    triples.extend(rays.iter().map(|ray| ray.direction));
    triples.extend(rays.iter().map(|ray| ray.target));
    file.write_all(bytemuck::cast_slice(&triples))
}
