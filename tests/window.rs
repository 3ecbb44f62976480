//! A room on black ground that lets sound out through a window or an opening, and receivers outside: what reaches them comes from a small
//! part of all directions. The slow simulator of the test kit says what is right.

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::{Mesh, MeshTriangle};
use sonel_scene::Scene;
use sonel_testkit::bruteforce::{BoxRoom, Count, Counted, Window};
use sonel_testkit::z_test::Estimate;

use crate::meshes::add_quad;

/// Inner size of the room [m].
const SIZE: [f64; 3] = [6.0, 5.0, 3.0];
const SOURCE: [f64; 3] = [2.0, 2.0, 1.5];
/// Materials.
const WALL: u32 = 0;
const PANE: u32 = 1;
const GROUND: u32 = 2;
const ABSORPTION: f64 = 0.1;
/// Length of the run [s].
const DURATION: f64 = 1.2;

/// The room.
#[derive(Debug, Clone, Copy)]
pub struct RoomWithWindow {
    /// Corners of the window in the wall x = 6 m, along y and z [m].
    pub corners: [[f64; 2]; 2],
    /// Transmission coefficient of the window; none: it is open.
    pub transmission: Option<f64>,
    /// Scattering coefficient of the walls and of the window.
    pub scattering: f64,
}

impl RoomWithWindow {
    /// As a scene with `receivers` [m].
    #[must_use]
    pub fn scene(&self, receivers: &[[f64; 3]]) -> Scene {
        let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave");
        let wall = |name| Material::uniform(name, ABSORPTION, self.scattering, 1);
        let mut pane = wall("pane");
        pane.transmission = vec![self.transmission.unwrap_or(0.0)];
        let materials = vec![wall("wall"), pane, Material::uniform("ground", 1.0, 0.0, 1)];
        let mut scene = Scene::from_parts(self.mesh(), materials, bands, DURATION)
            .with_source("source", SOURCE)
            .without_air_attenuation();
        for receiver in receivers {
            scene = scene.with_receiver("receiver", *receiver);
        }
        scene
    }

    fn mesh(&self) -> Mesh {
        let mut mesh = Mesh::shoebox(SIZE, [WALL; 6]);
        let is_front = |triangle: &MeshTriangle| {
            triangle.corners.iter().all(|&corner| mesh.vertices[corner as usize].x > SIZE[0] - 1e-9)
        };
        let front = mesh.triangles.iter().filter(|triangle| !is_front(triangle)).copied().collect();
        mesh.triangles = front;
        let rectangle = |[low, high]: [[f64; 2]; 2]| {
            [[low[0], low[1]], [low[0], high[1]], [high[0], high[1]], [high[0], low[1]]]
                .map(|[y, z]| dvec3(SIZE[0], y, z))
        };
        let (outer, inner) = (rectangle([[0.0; 2], [SIZE[1], SIZE[2]]]), rectangle(self.corners));
        for side in 0..4 {
            let next = (side + 1) % 4;
            add_quad(&mut mesh, WALL, [outer[side], outer[next], inner[next], inner[side]]);
        }
        if self.transmission.is_some() {
            add_quad(&mut mesh, PANE, inner);
        }
        let ground: [DVec3; 4] =
            [[-60.0, -60.0], [60.0, -60.0], [60.0, 60.0], [-60.0, 60.0]].map(|[x, y]| dvec3(x, y, -0.2));
        add_quad(&mut mesh, GROUND, ground);
        mesh
    }

    /// Fluence at a receiver outside: direct sound and image sources in closed form, the rest by the slow simulator. Light borders of images
    /// run through its sphere, whose mean is up to 5 % off what the centre gets of them.
    #[must_use]
    pub fn fluence(&self, receiver: [f64; 3], radius: f64, rays: usize) -> Estimate {
        let scattered = self.count(receiver, radius, rays).scattered();
        let value = self.specular_fluence(DVec3::from_array(receiver)) + scattered.value;
        Estimate { value, ..scattered }
    }

    /// Fluence of the direct sound and of all image sources whose way leads through the window.
    fn specular_fluence(&self, receiver: DVec3) -> f64 {
        let reflected = (1.0 - ABSORPTION) * (1.0 - self.scattering);
        let most = (-16.0 / reflected.log10()).min(60.0) as i32;
        let reach = DURATION * self.scene(&[]).speed_of_sound;
        let mut fluence = 0.0;
        for (orders, image) in images(most) {
            let length = image.distance(receiver);
            if length < reach && self.is_seen(image, receiver) {
                let factor = self.transmission.unwrap_or(1.0) * reflected.powi(orders);
                fluence += factor / (4.0 * std::f64::consts::PI * length * length);
            }
        }
        fluence
    }

    /// Whether the way from an image of the source leaves the room through the window, and has met the wall about it before if that is open.
    fn is_seen(&self, image: DVec3, receiver: DVec3) -> bool {
        let [low, high] = self.corners;
        let is_in_window = |x: f64| {
            let at = image.lerp(receiver, (x - image.x) / (receiver.x - image.x));
            let [y, z] = [1, 2].map(|axis| folded(at[axis], SIZE[axis]));
            low[0] < y && y < high[0] && low[1] < z && z < high[1]
        };
        let leaves = image.lerp(receiver, (SIZE[0] - image.x) / (receiver.x - image.x));
        let is_unfolded = (0.0..SIZE[1]).contains(&leaves.y) && (0.0..SIZE[2]).contains(&leaves.z);
        let earlier = (1_i32..).map(|turn| SIZE[0] * f64::from(1 - 2 * turn)).take_while(|&x| x > image.x);
        is_unfolded
            && is_in_window(SIZE[0])
            && (self.transmission.is_some() || !earlier.into_iter().any(is_in_window))
    }

    /// What the slow simulator counts in a sphere about a receiver.
    #[must_use]
    pub fn count(&self, receiver: [f64; 3], radius: f64, rays: usize) -> Counted {
        let [low, high] = self.corners;
        let window = Window {
            wall: 1,
            low,
            high,
            transmission: self.transmission.unwrap_or(1.0),
            absorption: if self.transmission.is_some() { ABSORPTION } else { 1.0 },
        };
        let room = BoxRoom {
            size: SIZE,
            absorption: [ABSORPTION; 6],
            scattering: [self.scattering; 6],
            speed_of_sound: self.scene(&[]).speed_of_sound,
            air_attenuation: 0.0,
            window: Some(window),
        };
        room.count(&Count {
            source: SOURCE,
            receiver,
            radius,
            bin_width: 0.001,
            bins: (DURATION * 1000.0) as usize,
            batches: 32,
            rays_per_batch: rays / 32,
            seed: 11,
        })
    }
}

/// The images of the source of up to `most` reflections that are not beyond the wall with the window, with their numbers of reflections.
fn images(most: i32) -> impl Iterator<Item = (i32, DVec3)> {
    let along = move |axis: usize| {
        (-most..=most).map(move |turn| {
            let inside = if turn % 2 == 0 { SOURCE[axis] } else { SIZE[axis] - SOURCE[axis] };
            (turn.abs(), f64::from(turn) * SIZE[axis] + inside)
        })
    };
    let all = along(0).filter(|&(_, x)| x < SIZE[0]).flat_map(move |x| {
        along(1).flat_map(move |y| along(2).map(move |z| (x.0 + y.0 + z.0, dvec3(x.1, y.1, z.1))))
    });
    all.filter(move |&(orders, _)| orders <= most)
}

/// A coordinate of the unfolded room in the room itself.
fn folded(at: f64, size: f64) -> f64 {
    let at = at.rem_euclid(2.0 * size);
    at.min(2.0 * size - at)
}
